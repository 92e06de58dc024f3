//! A table of cells on the device, and who visits which cell.

use crate::bindings::{CellTableBindings, Table};
use crate::path_tracer::groups_of;
use crate::radiance_cache::LevelGridRow;
use crate::radix_sort::{RadixSort, SortBuffers};
use crate::{Buffer, Gpu, GpuError, Kernel, Work};
use bytemuck::{Pod, Zeroable};
use lightshed_spatial::{LevelGrid, LevelGridOptions};

/// What the program binds.
pub(crate) const TABLES: [Table; 1] = [CellTableBindings::TABLE];

/// Least slots, as the host's table has it.
const LEAST_SLOTS: usize = 32;
/// Bits of a visitor's rank in the codes that are sorted.
const RANK_BITS: u32 = 16;

/// How a table is kept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellTableOptions {
    pub cells: LevelGridOptions,
    /// Most cells, rounded up to a power of two.
    pub slots: usize,
    /// Visitors of a frame.
    pub visitors: u32,
    /// Most visitors of a cell that bring something.
    pub most: u32,
    /// Frames after which a cell goes that nobody has visited.
    pub max_age: u32,
    /// A cell moves its site once in so many frames, in the mean.
    pub renewal: u32,
}

/// A table in buffers, with the content of the host's `CellTable` after the same claims.
pub(crate) struct GpuCellTable {
    kernels: Kernels,
    sort: RadixSort,
    options: CellTableOptions,
    grid: LevelGridRow,
    table: Buffer,
    /// A visitor for each thread: the word of its cell and its rank. The caller writes them.
    pub visitors: Buffer,
    pub words: Buffer,
    claims: Buffer,
    used: Buffer,
    /// 1 where a cell has a site.
    pub sited: Buffer,
    sorted: SortBuffers,
    pub visits: Buffer,
    pub visit_count: Buffer,
}

struct Kernels {
    claim: Kernel,
    settle: Kernel,
    locate: Kernel,
    gather: Kernel,
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct TableRow {
    grid: LevelGridRow,
    visitors: u32,
    slots: u32,
    frame: u32,
    max_age: u32,
    most: u32,
    renewal: u32,
    padding: [u32; 2],
}

/// A [`Visitor`](GpuCellTable::visitors).
const VISITOR_BYTES: u64 = 16;
/// A cell that is visited.
const VISIT_BYTES: u64 = 16;

// As in the shader; held to it by a test.
const _: () = assert!(size_of::<TableRow>() == 64);

impl GpuCellTable {
    /// Without any cell. `program` is the text of the shader.
    pub fn new(gpu: &Gpu, program: &str, options: CellTableOptions) -> Result<Self, GpuError> {
        let cells =
            LevelGrid::new(options.cells).map_err(|error| GpuError::Settings(error.to_string().into()))?;
        let slots = options.slots.next_power_of_two().max(LEAST_SLOTS);
        let options = CellTableOptions { slots, ..options };
        let kernel =
            |entry: &str| gpu.kernel_of_tables(&format!("cells {entry}"), program, entry, &TABLES, &[]);
        let (all, visitors) = (slots as u64, u64::from(options.visitors));
        Ok(Self {
            kernels: Kernels {
                claim: kernel("claim")?,
                settle: kernel("settle")?,
                locate: kernel("locate")?,
                gather: kernel("gather")?,
            },
            sort: RadixSort::new(gpu)?,
            grid: LevelGridRow::new(&cells, slots),
            table: gpu.zeros("cells: table", size_of::<TableRow>() as u64)?,
            visitors: gpu.zeros("cells: visitors", VISITOR_BYTES * visitors)?,
            words: gpu.zeros("cells: words", 8 * all)?,
            claims: gpu.zeros("cells: claims", 4 * all)?,
            used: gpu.zeros("cells: used", 4 * all)?,
            sited: gpu.zeros("cells: sited", 4 * all)?,
            // A slot, or one more than all.
            sorted: SortBuffers::new(gpu, options.visitors, RANK_BITS + slots.ilog2() + 1)?,
            visits: gpu.zeros("cells: visits", VISIT_BYTES * visitors.min(all))?,
            visit_count: gpu.zeros("cells: visit count", 4)?,
            options,
        })
    }

    /// The grid as shaders read it.
    pub fn grid(&self) -> LevelGridRow {
        self.grid
    }

    /// Slots there are.
    pub fn slots(&self) -> usize {
        self.options.slots
    }

    /// Most cells that are visited in a frame.
    pub fn most_visits(&self) -> u32 {
        self.options.visitors.min(self.options.slots as u32)
    }

    /// Visitors by cell and rank.
    pub fn indices(&self) -> &Buffer {
        &self.sorted.indices
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let Self {
            table,
            visitors,
            words,
            claims,
            used,
            sited,
            sorted,
            visits,
            visit_count,
            kernels: _,
            sort: _,
            options: _,
            grid: _,
        } = self;
        let own = [table, visitors, words, claims, used, sited, visits, visit_count];
        sorted.bytes() + own.map(Buffer::bytes).iter().sum::<u64>()
    }

    /// Records a frame, `frame` frames after the first, which forgets what was: cells of the
    /// visitors are opened or stay in use, others go, and `visits` has those that are visited.
    pub fn visit(&self, gpu: &Gpu, work: &mut Work, frame: u32) {
        let CellTableOptions {
            slots,
            visitors,
            most,
            max_age,
            renewal,
            ..
        } = self.options;
        let row = TableRow {
            grid: self.grid,
            visitors,
            slots: slots as u32,
            frame,
            max_age,
            most,
            renewal,
            padding: [0; 2],
        };
        gpu.write(&self.table, &[row]);
        if frame == 0 {
            for buffer in [&self.words, &self.used, &self.sited] {
                work.clear(buffer, buffer.bytes());
            }
        }
        work.clear(&self.visit_count, self.visit_count.bytes());
        let bound = work.bind(&CellTableBindings {
            table: &self.table,
            visitors: &self.visitors,
            table_words: &self.words,
            claims: &self.claims,
            used: &self.used,
            sited: &self.sited,
            codes: &self.sorted.codes,
            indices: &self.sorted.indices,
            visits: &self.visits,
            visit_count: &self.visit_count,
        });
        let Kernels {
            claim,
            settle,
            locate,
            gather,
        } = &self.kernels;
        work.dispatch_bound(claim, &[&bound], groups_of(visitors));
        work.dispatch_bound(settle, &[&bound], groups_of(slots as u32));
        work.dispatch_bound(locate, &[&bound], groups_of(visitors));
        self.sort.sort(work, &self.sorted);
        work.dispatch_bound(gather, &[&bound], groups_of(visitors));
    }
}
