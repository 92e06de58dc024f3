//! Path tracing on the device.

use crate::bindings::{
    BoundGroup, GuideBindings, OctreeBindings, RadianceCacheBindings, SceneBindings, Table, WavefrontBindings,
};
use crate::guide::GuideMemory;
use crate::image::PixelSums;
use crate::programs::PATH;
use crate::radiance_cache::CacheMemory;
use crate::scene::{GpuScene, Settings};
use crate::{BegunFrame, Buffer, Gpu, GpuError, GpuImage, GpuMethod, Kernel, PassTime, Work};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::CacheEnding;
use lightshed_integrator::guiding::FlatGuidingField;

/// Unidirectional path tracing with emitter sampling, by wavefronts: the estimator of
/// `lightshed_integrator::PathTracer`, with the same random numbers for each path, so that images
/// differ by rounding only.
pub struct GpuPathTracer<'a> {
    gpu: &'a Gpu,
    scene: &'a GpuScene,
    program: &'a str,
    /// The scene, and the guide's field with the cache.
    bound: [BoundGroup; 2],
    guide: GuideMemory,
    cache: CacheMemory,
    kernels: Kernels,
    max_depth: u32,
    roulette_depth: u32,
    /// Samples of each pixel that are active at once.
    samples: u32,
    memory: Memory,
    times: Vec<PassTime>,
}

struct Kernels {
    start: Kernel,
    extend: Kernel,
    shade: Kernel,
    connect: Kernel,
    accumulate: Kernel,
    show: Kernel,
}

struct Memory {
    settings: Buffer,
    paths: Buffer,
    hits: Buffer,
    shadows: Buffer,
    queues: Buffer,
    counts: Buffer,
    film: Buffer,
    budgets: Buffer,
}

/// Data that changes from dispatch to dispatch.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Step {
    depth: u32,
    sample: u32,
    samples: u32,
    padding: u32,
}

/// What the program binds.
pub(crate) const TABLES: [Table; 5] = [
    SceneBindings::TABLE,
    OctreeBindings::TABLE,
    GuideBindings::TABLE,
    RadianceCacheBindings::TABLE,
    WavefrontBindings::TABLE,
];

/// Bytes of an active path: itself, its hit, its shadow ray, and its places in two queues.
const PATH_BYTES: u64 = 80 + 16 + 48 + 2 * 4;
/// Bytes more of a path that ends in a cache.
const BUDGET_BYTES: u64 = 20;
/// Bytes of a pixel's sums.
const PIXEL_BYTES: u64 = size_of::<PixelSums>() as u64;
/// Active paths at once, unless an image has more pixels.
const PATHS: u32 = 1 << 18;
/// Number of edges after which the host checks whether any path is active.
const LOOK_EVERY: u32 = 16;
/// Places of counts of which rays are counted.
const COUNTED: u64 = 2 * 1024;
/// Longest path of any: places for counts.
const MOST_EDGES: u32 = 1 << 16;
/// Threads in a workgroup.
const GROUP: u32 = 64;

impl<'a> GpuPathTracer<'a> {
    /// Bytes on the device for each pixel with one sample of each on its way: what a path needs,
    /// and the pixel's sums.
    pub const BYTES_PER_PIXEL: u64 = PATH_BYTES + PIXEL_BYTES;

    /// A path tracer with the lengths of the scene's settings.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn new(gpu: &'a Gpu, scene: &'a GpuScene) -> Result<Self, GpuError> {
        let settings = scene.settings();
        Self::with_depths(gpu, scene, settings.max_depth, settings.roulette_depth)
    }

    /// A path tracer with the given longest path in edges (`None`: 65,536) and first edge at which
    /// roulette may end a path.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn with_depths(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        max_depth: Option<u32>,
        roulette_depth: u32,
    ) -> Result<Self, GpuError> {
        Self::of_program(gpu, scene, max_depth, roulette_depth, PATH)
    }

    pub(crate) fn of_program(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        max_depth: Option<u32>,
        roulette_depth: u32,
        program: &'a str,
    ) -> Result<Self, GpuError> {
        scene.refuse_media()?;
        let [width, height] = scene.size();
        let pixels = width * height;
        let samples = (PATHS / pixels).max(1);
        let max_depth = max_depth.unwrap_or(MOST_EDGES).min(MOST_EDGES);
        let count = u64::from(pixels) * u64::from(samples);
        let memory = Memory {
            settings: gpu.zeros("settings", size_of::<Settings>() as u64)?,
            paths: gpu.zeros("paths", 80 * count)?,
            hits: gpu.zeros("hits", 16 * count)?,
            shadows: gpu.zeros("shadow rays", 48 * count)?,
            queues: gpu.zeros("queues", 8 * count)?,
            counts: gpu.zeros("counts", 8 * u64::from(max_depth + 2))?,
            film: gpu.zeros("film", PIXEL_BYTES * u64::from(pixels))?,
            budgets: gpu.zeros("budgets", BUDGET_BYTES)?,
        };
        let (guide, cache) = (GuideMemory::none(gpu)?, CacheMemory::none(gpu)?);
        Ok(Self {
            gpu,
            scene,
            program,
            bound: [
                gpu.bind(&[&scene.bindings()]),
                gpu.bind(&[&guide.octree(), &guide.bindings(), &cache.bindings()]),
            ],
            guide,
            cache,
            kernels: Kernels::new(gpu, scene, program, [false; 2])?,
            max_depth,
            roulette_depth,
            samples,
            memory,
            times: Vec::new(),
        })
    }

    /// Guides the paths to come by what a field has learnt, with roulette from this edge on;
    /// without a field they are plain again. With a guide paths are those of
    /// `lightshed_integrator::PathTracer::with_guide`.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn set_guide(
        &mut self,
        field: Option<&FlatGuidingField<'_>>,
        roulette_depth: u32,
    ) -> Result<(), GpuError> {
        self.set(field, None, roulette_depth)
    }

    /// Ends the paths to come in a cache, as `lightshed_integrator::PathTracer::with_ending` does,
    /// and guides them by a field if there is one, with roulette from this edge on. The cache is
    /// copied as it is.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for a rule that the device does not know; [`GpuError::Refused`],
    /// [`GpuError::TooLarge`].
    pub fn set_cache(
        &mut self,
        ending: &CacheEnding<'_>,
        field: Option<&FlatGuidingField<'_>>,
        roulette_depth: u32,
    ) -> Result<(), GpuError> {
        self.set(field, Some(ending), roulette_depth)
    }

    /// What the cache of [`set_cache`](Self::set_cache) answers now. Nothing else of how paths end
    /// changes.
    pub(crate) fn write_cache(&self, ending: &CacheEnding<'_>) {
        self.cache.write(self.gpu, ending);
    }

    fn set(
        &mut self,
        field: Option<&FlatGuidingField<'_>>,
        ending: Option<&CacheEnding<'_>>,
        roulette_depth: u32,
    ) -> Result<(), GpuError> {
        let gpu = self.gpu;
        self.guide = match field {
            Some(field) => GuideMemory::new(gpu, field)?,
            None => GuideMemory::none(gpu)?,
        };
        self.cache = match ending {
            Some(ending) => CacheMemory::new(gpu, ending)?,
            None => CacheMemory::none(gpu)?,
        };
        let paths = match ending {
            Some(_) => u64::from(self.pixels()) * u64::from(self.samples),
            None => 1,
        };
        self.memory.budgets = gpu.zeros("budgets", BUDGET_BYTES * paths)?;
        self.bound[1] = gpu.bind(&[
            &self.guide.octree(),
            &self.guide.bindings(),
            &self.cache.bindings(),
        ]);
        let has = [field.is_some(), ending.is_some()];
        self.kernels = Kernels::new(gpu, self.scene, self.program, has)?;
        self.roulette_depth = roulette_depth;
        Ok(())
    }

    /// Bytes on the device of the guide's field.
    pub fn guide_bytes(&self) -> u64 {
        self.guide.bytes()
    }

    /// Bytes on the device of the cache.
    pub fn cache_bytes(&self) -> u64 {
        self.cache.bytes()
    }

    /// How long each dispatch of the last [`GpuPathTracer::render`] ran.
    pub fn times(&self) -> &[PassTime] {
        &self.times
    }

    /// Bytes on the device, the scene's, a guide's, a cache's and a few counts apart:
    /// [`GpuPathTracer::BYTES_PER_PIXEL`] for each pixel of an image that is large enough to have
    /// one sample of each on its way, and 20 more with a cache; smaller ones have several.
    pub fn bytes(&self) -> u64 {
        let Memory {
            settings: _,
            paths,
            hits,
            shadows,
            queues,
            counts: _,
            film,
            budgets,
        } = &self.memory;
        let paths: u64 = [paths, hits, shadows, queues, film]
            .map(Buffer::bytes)
            .iter()
            .sum();
        // One that nobody uses is for the binding.
        paths + if self.cache.is_used() { budgets.bytes() } else { 0 }
    }

    /// Samples `first .. first + count` of each pixel under `seed`, averaged.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`].
    pub fn render(&mut self, first: u32, count: u32, seed: u64) -> Result<GpuImage, GpuError> {
        self.times.clear();
        self.prepare(seed);
        let mut work = self.gpu.work();
        work.clear(&self.memory.film, self.memory.film.bytes());
        work.submit();
        let mut done = 0;
        while done < count {
            let samples = self.samples.min(count - done);
            let mut work = self.wave(first + done, samples)?;
            let step = self.step(0, first + done, samples)?;
            self.dispatch(&mut work, &self.kernels.accumulate, &step, self.pixels());
            self.times.extend(work.finish()?);
            done += samples;
        }
        let sums: Vec<PixelSums> = self.gpu.read(&self.memory.film, self.pixels() as usize)?;
        Ok(GpuImage::from_sums(self.scene.size(), &sums))
    }

    /// The values of sample `index` of all pixels, row by row.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`].
    pub fn sample(&mut self, index: u32, seed: u64) -> Result<Vec<[f32; 3]>, GpuError> {
        Ok(self.begin(index, seed)?.finish()?.values)
    }

    fn pixels(&self) -> u32 {
        let [width, height] = self.scene.size();
        width * height
    }

    /// Sets what is rendered.
    fn prepare(&self, seed: u64) {
        let settings = self
            .scene
            .kernel_settings(seed, self.max_depth, self.roulette_depth);
        self.gpu.write(&self.memory.settings, &[settings]);
    }

    fn step(&self, depth: u32, sample: u32, samples: u32) -> Result<Buffer, GpuError> {
        let step = Step {
            depth,
            sample,
            samples,
            padding: 0,
        };
        self.gpu.buffer("step", &[step])
    }

    /// Traces `samples` paths of each pixel to their ends, by work of which the last is returned.
    fn wave(&mut self, sample: u32, samples: u32) -> Result<Work<'a>, GpuError> {
        let paths = self.pixels() * samples;
        let gpu = self.gpu;
        let mut work = gpu.timed_work();
        work.clear(&self.memory.counts, self.memory.counts.bytes());
        let step = self.step(0, sample, samples)?;
        self.dispatch(&mut work, &self.kernels.start, &step, paths);
        for depth in 1..=self.max_depth {
            let step = self.step(depth, sample, samples)?;
            for kernel in [&self.kernels.extend, &self.kernels.shade, &self.kernels.connect] {
                self.dispatch(&mut work, kernel, &step, paths);
            }
            if depth % LOOK_EVERY == 0 && depth < self.max_depth {
                self.times.extend(work.finish()?);
                work = gpu.timed_work();
                let counts: Vec<u32> = self.gpu.read(&self.memory.counts, 2 * depth as usize + 3)?;
                if counts[2 * depth as usize + 2] == 0 {
                    break;
                }
            }
        }
        Ok(work)
    }

    fn dispatch(&self, work: &mut Work, kernel: &Kernel, step: &Buffer, threads: u32) {
        let Memory {
            settings,
            paths,
            hits,
            shadows,
            queues,
            counts,
            film,
            budgets,
        } = &self.memory;
        let method = self.gpu.bind(&[&WavefrontBindings {
            settings,
            paths,
            hits,
            shadows,
            queues,
            counts,
            film,
            step,
            budgets,
        }]);
        let [scene, parts] = &self.bound;
        work.dispatch_bound(kernel, &[scene, parts, &method], groups_of(threads));
    }
}

impl GpuMethod for GpuPathTracer<'_> {
    fn size(&self) -> [u32; 2] {
        self.scene.size()
    }

    /// Sample number `frame` of each pixel.
    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        self.times.clear();
        self.prepare(seed);
        let mut work = self.wave(frame, 1)?;
        let step = self.step(0, frame, 1)?;
        self.dispatch(&mut work, &self.kernels.show, &step, self.pixels().div_ceil(4));
        let Memory { film, counts, .. } = &self.memory;
        let words = (counts.bytes() / 4).min(COUNTED);
        let times = std::mem::take(&mut self.times);
        Ok(work.begin_paths(times, (film, self.pixels()), (counts, words)))
    }
}

/// Workgroups for this number of threads, in rows, because no side may have more than 65,535.
pub(crate) fn groups_of(threads: u32) -> [u32; 3] {
    const ROW: u32 = 1 << 15;
    let groups = threads.div_ceil(GROUP);
    if groups <= ROW {
        [groups, 1, 1]
    } else {
        [ROW, groups.div_ceil(ROW), 1]
    }
}

impl Kernels {
    fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        program: &str,
        [has_guide, has_cache]: [bool; 2],
    ) -> Result<Self, GpuError> {
        let besides = [("HAS_GUIDE", has_guide), ("HAS_CACHE", has_cache)];
        let constants = scene.constants(program, &besides);
        let kernel =
            |entry: &str| gpu.kernel_of_tables(&format!("path {entry}"), program, entry, &TABLES, &constants);
        let entries = ["start", "extend", "shade", "connect", "accumulate", "show"];
        let [start, extend, shade, connect, accumulate, show] = Gpu::at_once(entries, kernel)?;
        Ok(Self {
            start,
            extend,
            shade,
            connect,
            accumulate,
            show,
        })
    }
}
