//! Reservoirs in cells of space on the device.

use crate::bindings::{BoundGroup, Table, WorldBindings};
use crate::cell_table::{CellTableOptions, GpuCellTable};
use crate::path_tracer::groups_of;
use crate::programs::CELL_TABLE;
use crate::radiance_cache::LevelGridRow;
use crate::{Buffer, Gpu, GpuError, GpuScene, Kernel, Work};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::WorldReuse;

/// Most pixels that bring something to a cell.
const MOST_BROUGHT: u32 = 16;
/// Most reservoirs of a cell.
const MOST_RESERVOIRS: u32 = 8;
/// Most inputs of a cell, as the shader has room for.
const MOST_INPUTS: u32 = 24;
const _: () = assert!(MOST_BROUGHT + MOST_RESERVOIRS <= MOST_INPUTS);
/// Most reservoirs that a pixel reads.
pub(crate) const MOST_READS: u32 = 8;

/// Cells for a method with reuse among pixels, and its program with the entry points `visit`,
/// `bring`, `fill` and `link`.
#[derive(Clone, Copy)]
pub(crate) struct WorldProgram<'p> {
    pub reuse: WorldReuse,
    /// The program, linked.
    pub wgsl: &'p str,
    /// What it binds.
    pub tables: &'p [Table],
    /// Overridable constants besides those of the scene.
    pub constants: &'p [(&'static str, bool)],
    /// Greatest confidence of a pixel after it has read.
    pub pixel_cap: f32,
    /// Whether pixels are shaded by what they read.
    pub shades: bool,
}

/// The cells: a site and reservoirs in each, and the kernels that fill and read them.
pub(crate) struct GpuWorld {
    kernels: Kernels,
    reuse: WorldReuse,
    pixel_cap: f32,
    shades: bool,
    pixels: u32,
    table: GpuCellTable,
    world: Buffer,
    sites: Buffer,
    cells: Buffer,
    confidences: Buffer,
    terms: Buffer,
}

struct Kernels {
    visit: Kernel,
    bring: Kernel,
    fill: Kernel,
    link: Kernel,
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct WorldRow {
    grid: LevelGridRow,
    number: u32,
    each: u32,
    most: u32,
    reads: u32,
    cap: f32,
    pixel_cap: f32,
    shades: u32,
    padding: u32,
}

// As in the shader; held to it by a test.
const _: () = assert!(size_of::<WorldRow>() == 64);

/// Whether the device can keep reservoirs so.
///
/// # Errors
///
/// [`GpuError::Settings`].
pub(crate) fn check_world(reuse: &WorldReuse) -> Result<(), GpuError> {
    reuse
        .check()
        .map_err(|error| GpuError::Settings(error.to_string().into()))?;
    let limits = [
        (
            reuse.contributors,
            MOST_BROUGHT,
            "at most 16 pixels bring something to a cell",
        ),
        (
            reuse.reservoirs,
            MOST_RESERVOIRS,
            "at most 8 reservoirs of a cell are possible",
        ),
        (
            reuse.reads,
            MOST_READS,
            "at most 8 reservoirs of cells are read by a pixel",
        ),
    ];
    match limits.iter().find(|(asked, most, _)| asked > most) {
        Some(&(.., why)) => Err(GpuError::Settings(why.into())),
        None => Ok(()),
    }
}

impl GpuWorld {
    /// Without any cell.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        (name, constants): (&str, &[(String, f64)]),
        (primary_bytes, reservoir_bytes): (u64, u64),
        program: &WorldProgram<'_>,
    ) -> Result<Self, GpuError> {
        let &WorldProgram {
            reuse,
            wgsl,
            tables,
            pixel_cap,
            shades,
            constants: _,
        } = program;
        check_world(&reuse)?;
        let [width, height] = scene.size();
        let table = CellTableOptions {
            cells: scene.world_cells(&reuse),
            slots: reuse.slots,
            visitors: width * height,
            most: reuse.contributors,
            max_age: reuse.max_age,
            renewal: reuse.renewal,
        };
        let table = GpuCellTable::new(gpu, CELL_TABLE, table)?;
        let kernel =
            |entry: &str| gpu.kernel_of_tables(&format!("{name} {entry}"), wgsl, entry, tables, constants);
        let slots = table.slots() as u64;
        let inputs = u64::from(table.most_visits()) * u64::from(reuse.reservoirs + reuse.contributors);
        Ok(Self {
            kernels: Kernels {
                visit: kernel("visit")?,
                bring: kernel("bring")?,
                fill: kernel("fill")?,
                link: kernel("link")?,
            },
            world: gpu.zeros("world", size_of::<WorldRow>() as u64)?,
            sites: gpu.zeros("world: sites", primary_bytes * slots)?,
            cells: gpu.zeros(
                "world: reservoirs",
                reservoir_bytes * u64::from(reuse.reservoirs) * slots,
            )?,
            confidences: gpu.zeros("world: confidences", 4 * slots)?,
            terms: gpu.zeros("world: terms", reservoir_bytes * inputs)?,
            reuse,
            pixel_cap,
            shades,
            pixels: width * height,
            table,
        })
    }

    /// The table of cells.
    #[cfg(test)]
    pub fn table(&self) -> &GpuCellTable {
        &self.table
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let own = [
            &self.world,
            &self.sites,
            &self.cells,
            &self.confidences,
            &self.terms,
        ];
        self.table.bytes() + own.map(Buffer::bytes).iter().sum::<u64>()
    }

    /// Buffers for a frame, whose number it is told.
    pub fn begin(&self, gpu: &Gpu, number: u32) -> BoundGroup {
        let row = WorldRow {
            grid: self.table.grid(),
            number,
            each: self.reuse.reservoirs,
            most: self.reuse.contributors,
            reads: self.reuse.reads,
            cap: self.reuse.confidence_cap.min(f32::MAX),
            pixel_cap: self.pixel_cap.min(f32::MAX),
            shades: u32::from(self.shades),
            padding: 0,
        };
        gpu.write(&self.world, &[row]);
        gpu.bind(&[&WorldBindings {
            world: &self.world,
            world_visitors: &self.table.visitors,
            world_words: &self.table.words,
            world_sited: &self.table.sited,
            sites: &self.sites,
            cells: &self.cells,
            confidences: &self.confidences,
            terms: &self.terms,
            world_visits: &self.table.visits,
            world_visit_count: &self.table.visit_count,
            world_indices: self.table.indices(),
        }])
    }

    /// Records that cells merge what pixels have made of this frame alone.
    pub fn update(&self, gpu: &Gpu, work: &mut Work, bound: &[&BoundGroup], number: u32) {
        let Kernels {
            visit, bring, fill, ..
        } = &self.kernels;
        work.dispatch_bound(visit, bound, groups_of(self.pixels));
        self.table.visit(gpu, work, number);
        let visits = self.table.most_visits();
        let inputs = self.reuse.reservoirs + self.reuse.contributors;
        work.dispatch_bound(bring, bound, groups_of(visits * inputs));
        work.dispatch_bound(fill, bound, groups_of(visits));
    }

    /// Records that pixels merge what they read of cells.
    pub fn link(&self, work: &mut Work, bound: &[&BoundGroup]) {
        work.dispatch_bound(&self.kernels.link, bound, groups_of(self.pixels));
    }
}
