//! Frames of the methods with reuse among pixels and frames.

use crate::bindings::{Bindings, BoundGroup, ReuseBindings, Table};
#[cfg(test)]
use crate::cell_table::GpuCellTable;
use crate::path_tracer::groups_of;
use crate::scene::Settings;
use crate::world::{GpuWorld, MOST_READS, WorldProgram};
use crate::{BegunFrame, Buffer, Gpu, GpuError, GpuScene, Kernel};
use bytemuck::Pod;

/// Most neighbours, as the shader module `inputs` has it.
pub(crate) const MOST_NEIGHBOURS: u32 = 8;
// What a pixel reads of cells is held as neighbours are.
const _: () = assert!(MOST_READS <= MOST_NEIGHBOURS);
/// Bytes of what a pixel sees.
pub(crate) const PRIMARY_BYTES: u64 = 32;
/// Bytes of a pixel of the image.
pub(crate) const IMAGE_BYTES: u64 = 16;

/// Frames of spatiotemporal reuse: what pixels see, their own candidates, a merge with the previous
/// frame, and rounds of merges with neighbours, the last of which shades. Cells of space, if there
/// are any, take what pixels have before the first merge, and are read before the first round.
///
/// Reservoirs are in two buffers. Candidates are made in one and merged there with the last frame's
/// in the other. Then each round reads one and writes the other. What pixels see is in two buffers
/// as well, for even and odd frames, so that the previous frame is evaluated with its own.
pub(crate) struct RestirFrames<'a> {
    gpu: &'a Gpu,
    scene: &'a GpuScene,
    kernels: Kernels,
    /// The scene, and what lies in it besides.
    scene_groups: Vec<BoundGroup>,
    memory: Memory,
    world: Option<GpuWorld>,
    /// Which of the two buffers of reservoirs holds those of the last frame.
    latest: usize,
}

/// A program with entry points `primary`, `candidates`, `temporal` and `spatial`.
pub(crate) struct ReuseProgram<'p> {
    /// The method's name.
    pub name: &'static str,
    /// The program, linked.
    pub wgsl: &'p str,
    /// Overridable constants besides those of the scene.
    pub constants: &'p [(&'static str, bool)],
    /// Bytes of a pixel's reservoir.
    pub reservoir_bytes: u64,
    /// What it binds.
    pub tables: &'p [Table],
    /// The scene's medium or light tree.
    pub besides: Option<&'p dyn Bindings>,
    /// Cells of space.
    pub world: Option<WorldProgram<'p>>,
}

/// What a frame is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReuseFrame {
    pub number: u32,
    pub seed: u64,
    /// Longest path, and the first edge at which roulette may end one.
    pub depths: [u32; 2],
    /// Whether the previous frame is reused, if there is one.
    pub temporal: bool,
    /// Rounds of spatial reuse, at least 1 without cells: the last one shades.
    pub rounds: u32,
}

struct Kernels {
    primary: Kernel,
    candidates: Kernel,
    temporal: Kernel,
    spatial: Kernel,
}

struct Memory {
    settings: Buffer,
    /// Of even and of odd frames.
    primaries: [Buffer; 2],
    reservoirs: [Buffer; 2],
    image: Buffer,
}

/// Bytes on the device for each pixel: two reservoirs, what is seen in this frame and in the
/// previous one, and the image.
pub(crate) const fn bytes_per_pixel(reservoir_bytes: u64) -> u64 {
    2 * (reservoir_bytes + PRIMARY_BYTES) + IMAGE_BYTES
}

impl<'a> RestirFrames<'a> {
    /// Prepares the program.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn new(gpu: &'a Gpu, scene: &'a GpuScene, program: &ReuseProgram) -> Result<Self, GpuError> {
        let &ReuseProgram {
            name,
            wgsl,
            reservoir_bytes,
            tables,
            besides,
            world,
            ..
        } = program;
        let constants = scene.constants(wgsl, program.constants);
        let kernel =
            |entry: &str| gpu.kernel_of_tables(&format!("{name} {entry}"), wgsl, entry, tables, &constants);
        let [primary, candidates, temporal, spatial] =
            Gpu::at_once(["primary", "candidates", "temporal", "spatial"], kernel)?;
        let [width, height] = scene.size();
        let pixels = u64::from(width) * u64::from(height);
        let primaries = |name| gpu.zeros(name, PRIMARY_BYTES * pixels);
        let reservoirs = |name| gpu.zeros(name, reservoir_bytes * pixels);
        let cells = |program: WorldProgram<'_>| {
            let constants = scene.constants(program.wgsl, program.constants);
            let bytes = (PRIMARY_BYTES, reservoir_bytes);
            GpuWorld::new(gpu, scene, (name, &constants), bytes, &program)
        };
        Ok(Self {
            world: world.map(cells).transpose()?,
            gpu,
            scene,
            kernels: Kernels {
                primary,
                candidates,
                temporal,
                spatial,
            },
            scene_groups: [Some(&scene.bindings() as &dyn Bindings), besides]
                .into_iter()
                .flatten()
                .map(|bindings| gpu.bind(&[bindings]))
                .collect(),
            memory: Memory {
                settings: gpu.zeros("settings", size_of::<Settings>() as u64)?,
                primaries: [primaries("even primaries")?, primaries("odd primaries")?],
                reservoirs: [reservoirs("reservoirs")?, reservoirs("more reservoirs")?],
                image: gpu.zeros("image", IMAGE_BYTES * pixels)?,
            },
            latest: 0,
        })
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        self.scene.size()
    }

    /// Bytes on the device, the scene's apart.
    pub fn bytes(&self) -> u64 {
        let Memory {
            settings: _,
            primaries,
            reservoirs,
            image,
        } = &self.memory;
        let buffers = primaries.iter().chain(reservoirs).chain([image]);
        buffers.map(Buffer::bytes).sum::<u64>() + self.world.as_ref().map_or(0, GpuWorld::bytes)
    }

    /// The cells of space, and what pixels see in frame `number`.
    #[cfg(test)]
    pub fn cells(&self, number: u32) -> Option<(&GpuCellTable, &Buffer)> {
        Some((
            self.world.as_ref()?.table(),
            &self.memory.primaries[number as usize % 2],
        ))
    }

    /// Begins a frame; `about` has what the program's `frame` says in each round.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`], [`GpuError::TooLarge`].
    pub fn begin<F: Pod>(
        &mut self,
        asked: ReuseFrame,
        about: impl Fn(u32) -> F,
    ) -> Result<BegunFrame, GpuError> {
        let [max_depth, roulette_depth] = asked.depths;
        let settings = self.scene.kernel_settings(asked.seed, max_depth, roulette_depth);
        self.gpu.write(&self.memory.settings, &[settings]);
        let [width, height] = self.size();
        let groups = groups_of(width * height);
        let mut work = self.gpu.timed_work();
        let mut made = 1 - self.latest;
        let first = self.gpu.buffer("frame", &[about(0)])?;
        let cells = self
            .world
            .as_ref()
            .map(|world| (world, world.begin(self.gpu, asked.number)));
        let bound = self.bound(asked.number, made, &first);
        let all: Vec<&BoundGroup> = self.scene_groups.iter().chain([&bound]).collect();
        work.dispatch_bound(&self.kernels.primary, &all, groups);
        work.dispatch_bound(&self.kernels.candidates, &all, groups);
        if let Some((world, cells)) = &cells {
            let all: Vec<&BoundGroup> = all.iter().copied().chain([cells]).collect();
            world.update(self.gpu, &mut work, &all, asked.number);
        }
        if asked.temporal && asked.number > 0 {
            work.dispatch_bound(&self.kernels.temporal, &all, groups);
        }
        if let Some((world, cells)) = &cells {
            made = 1 - made;
            let bound = self.bound(asked.number, made, &first);
            let all: Vec<&BoundGroup> = self.scene_groups.iter().chain([&bound, cells]).collect();
            world.link(&mut work, &all);
        }
        for round in 0..asked.rounds {
            made = 1 - made;
            let about = self.gpu.buffer("frame", &[about(round)])?;
            let bound = self.bound(asked.number, made, &about);
            let all: Vec<&BoundGroup> = self.scene_groups.iter().chain([&bound]).collect();
            work.dispatch_bound(&self.kernels.spatial, &all, groups);
        }
        self.latest = made;
        Ok(work.begin_image(&self.memory.image, self.size()))
    }

    fn bound(&self, number: u32, made: usize, frame: &Buffer) -> BoundGroup {
        let Memory {
            settings,
            primaries,
            reservoirs,
            image,
        } = &self.memory;
        let parity = number as usize % 2;
        self.gpu.bind(&[&ReuseBindings {
            settings,
            primaries: &primaries[parity],
            before: &primaries[1 - parity],
            given: &reservoirs[1 - made],
            made: &reservoirs[made],
            image,
            frame,
        }])
    }
}
