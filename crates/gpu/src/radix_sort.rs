//! Sorting by codes of 64 bits.

use crate::bindings::{SortBindings, Table};
use crate::buffer::Buffer;
use crate::device::Gpu;
use crate::kernel::Kernel;
use crate::programs::RADIX_SORT;
use crate::{GpuError, Work};
use bytemuck::{Pod, Zeroable};

/// What the program binds.
pub(crate) const TABLES: [Table; 1] = [SortBindings::TABLE];

/// Codes of a tile.
const TILE: u32 = 2048;
const DIGIT_BITS: u32 = 4;
const DIGITS: u32 = 1 << DIGIT_BITS;

/// Sorts indices by codes, ties by where they were: a radix sort, four bits a pass.
pub(crate) struct RadixSort {
    count: Kernel,
    scan: Kernel,
    place: Kernel,
}

/// Memory for sorting so many codes.
pub(crate) struct SortBuffers {
    /// Codes, two words each, the low one first.
    pub codes: Buffer,
    /// What is sorted with them.
    pub indices: Buffer,
    /// As many, free between sorts.
    pub spare_codes: Buffer,
    pub spare_indices: Buffer,
    counts: Buffer,
    passes: Vec<Buffer>,
    tiles: u32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Pass {
    count: u32,
    shift: u32,
    tiles: u32,
    padding: u32,
}

// As in the shader; held to it by a test.
const _: () = assert!(size_of::<Pass>() == 16);

impl SortBuffers {
    /// For codes whose bits from number `bits` on are zero.
    pub fn new(gpu: &Gpu, count: u32, bits: u32) -> Result<Self, GpuError> {
        // An even number, after which all is where it was at first.
        let pass_count = bits.div_ceil(DIGIT_BITS).next_multiple_of(2);
        let tiles = count.div_ceil(TILE);
        let bytes = u64::from(count);
        let pass = |pass| {
            let pass = Pass {
                count,
                shift: pass * DIGIT_BITS,
                tiles,
                padding: 0,
            };
            gpu.buffer("sort: pass", &[pass])
        };
        Ok(Self {
            codes: gpu.zeros("sort: codes", 8 * bytes)?,
            indices: gpu.zeros("sort: indices", 4 * bytes)?,
            spare_codes: gpu.zeros("sort: spare codes", 8 * bytes)?,
            spare_indices: gpu.zeros("sort: spare indices", 4 * bytes)?,
            counts: gpu.zeros("sort: counts", u64::from(4 * DIGITS * tiles))?,
            passes: (0..pass_count).map(pass).collect::<Result<_, _>>()?,
            tiles,
        })
    }

    /// Bytes of all of it.
    pub fn bytes(&self) -> u64 {
        let buffers = [
            &self.codes,
            &self.indices,
            &self.spare_codes,
            &self.spare_indices,
            &self.counts,
        ];
        buffers.into_iter().chain(&self.passes).map(Buffer::bytes).sum()
    }
}

impl RadixSort {
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let kernel = |label, entry| gpu.kernel_of_tables(label, RADIX_SORT, entry, &TABLES, &[]);
        Ok(Self {
            count: kernel("sort: count", "count_digits")?,
            scan: kernel("sort: scan", "scan_counts")?,
            place: kernel("sort: move", "move_codes")?,
        })
    }

    /// Sorts the codes and indices of `buffers` in place.
    pub fn sort(&self, work: &mut Work, buffers: &SortBuffers) {
        let groups = groups(buffers.tiles);
        let mut from = (&buffers.codes, &buffers.indices);
        let mut to = (&buffers.spare_codes, &buffers.spare_indices);
        for pass in &buffers.passes {
            let bound = work.bind(&SortBindings {
                sorting: pass,
                from_codes: from.0,
                from_indices: from.1,
                to_codes: to.0,
                to_indices: to.1,
                counts: &buffers.counts,
            });
            work.dispatch_bound(&self.count, &[&bound], groups);
            work.dispatch_bound(&self.scan, &[&bound], [1, 1, 1]);
            work.dispatch_bound(&self.place, &[&bound], groups);
            (from, to) = (to, from);
        }
    }
}

/// So many workgroups, in two dimensions where one has too few.
pub(crate) fn groups(count: u32) -> [u32; 3] {
    const MOST: u32 = 1 << 15;
    let x = count.min(MOST);
    [x, count.div_ceil(x.max(1)), 1]
}
