//! Frames of the methods with reuse among pixels and frames.

use crate::bindings::{Bindings, BoundGroup, ReuseBindings, Table};
use crate::frames::finished_frame;
use crate::path_tracer::groups_of;
use crate::scene::Settings;
use crate::{Buffer, Gpu, GpuError, GpuScene, Kernel, PassTime};
use bytemuck::Pod;
use lightshed_film::RayCounts;

/// Most neighbours, as the shader module `inputs` has it.
pub(crate) const MOST_NEIGHBOURS: u32 = 8;
/// Bytes of what a pixel sees.
const PRIMARY_BYTES: u64 = 32;
/// Bytes of a pixel of the image.
const IMAGE_BYTES: u64 = 16;

/// Frames of spatiotemporal reuse: what pixels see, their own candidates, a merge with the previous
/// frame, and rounds of merges with neighbours, the last of which shades.
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
    /// Which of the two buffers of reservoirs holds those of the last frame.
    latest: usize,
    times: Vec<PassTime>,
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
    /// Rounds of spatial reuse, at least 1: the last one shades.
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
            ..
        } = program;
        let constants = scene.constants(wgsl, program.constants);
        let kernel =
            |entry: &str| gpu.kernel_of_tables(&format!("{name} {entry}"), wgsl, entry, tables, &constants);
        let [width, height] = scene.size();
        let pixels = u64::from(width) * u64::from(height);
        let primaries = |name| gpu.zeros(name, PRIMARY_BYTES * pixels);
        let reservoirs = |name| gpu.zeros(name, reservoir_bytes * pixels);
        Ok(Self {
            gpu,
            scene,
            kernels: Kernels {
                primary: kernel("primary")?,
                candidates: kernel("candidates")?,
                temporal: kernel("temporal")?,
                spatial: kernel("spatial")?,
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
            times: Vec::new(),
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
        buffers.map(Buffer::bytes).sum()
    }

    /// How long each dispatch of the last frame ran.
    pub fn times(&self) -> &[PassTime] {
        &self.times
    }

    /// Renders a frame; `about` has what the program's `frame` says in each round.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`], [`GpuError::TooLarge`].
    pub fn frame<F: Pod>(
        &mut self,
        asked: ReuseFrame,
        about: impl Fn(u32) -> F,
    ) -> Result<(Vec<[f32; 3]>, RayCounts), GpuError> {
        let [max_depth, roulette_depth] = asked.depths;
        let settings = self.scene.kernel_settings(asked.seed, max_depth, roulette_depth);
        self.gpu.write(&self.memory.settings, &[settings]);
        let [width, height] = self.size();
        let groups = groups_of(width * height);
        let mut work = self.gpu.timed_work();
        let mut made = 1 - self.latest;
        for round in 0..asked.rounds {
            let about = self.gpu.buffer("frame", &[about(round)])?;
            let mut dispatch = |kernel: &Kernel, made: usize| {
                let method = self.gpu.bind(&[&self.bindings(asked.number, made, &about)]);
                let bound: Vec<&BoundGroup> = self.scene_groups.iter().chain([&method]).collect();
                work.dispatch_bound(kernel, &bound, groups);
            };
            if round == 0 {
                dispatch(&self.kernels.primary, made);
                dispatch(&self.kernels.candidates, made);
                if asked.temporal && asked.number > 0 {
                    dispatch(&self.kernels.temporal, made);
                }
            }
            made = 1 - made;
            dispatch(&self.kernels.spatial, made);
        }
        self.times = work.finish()?;
        self.latest = made;
        finished_frame(self.gpu, &self.memory.image, self.size())
    }

    fn bindings<'b>(&'b self, number: u32, made: usize, frame: &'b Buffer) -> ReuseBindings<'b> {
        let Memory {
            settings,
            primaries,
            reservoirs,
            image,
        } = &self.memory;
        let parity = number as usize % 2;
        ReuseBindings {
            settings,
            primaries: &primaries[parity],
            before: &primaries[1 - parity],
            given: &reservoirs[1 - made],
            made: &reservoirs[made],
            image,
            frame,
        }
    }
}
