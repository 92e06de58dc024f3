//! The passes of a frame of suffix reuse.

use super::{Frame, TABLES};
use crate::bindings::{BoundGroup, SuffixBindings};
use crate::path_tracer::groups_of;
use crate::restir_frames::{IMAGE_BYTES, PRIMARY_BYTES, bytes_per_pixel};
use crate::restir_pt::RESERVOIR_BYTES;
use crate::scene::Settings;
use crate::{BegunFrame, Buffer, BvhBuilder, Gpu, GpuBvh, GpuError, GpuScene, Kernel, Work};

/// Bytes of the box of a site.
const BOX_BYTES: u64 = 24;
/// Bytes of a pixel, but for the tree and for integration prefixes. Reservoirs of prefixes are as
/// large as those of paths.
pub(super) const BYTES_PER_PIXEL: u64 = bytes_per_pixel(2 * RESERVOIR_BYTES) + BOX_BYTES;
/// Bytes of an integration prefix.
const INTEGRATION_BYTES: u64 = 80;
/// Most integration prefixes in memory at a time, but for those of a single pixel.
const MOST_INTEGRATIONS: u32 = 1 << 18;

/// Frames of suffix reuse.
///
/// Integration prefixes are more than fit in memory: they are traced for some pixels at a time, and
/// each of a pixel's has a thread of its own.
pub(super) struct SuffixFrames<'a> {
    gpu: &'a Gpu,
    scene: &'a GpuScene,
    kernels: Kernels,
    scene_group: BoundGroup,
    memory: Memory,
    builder: BvhBuilder,
    tree: GpuBvh,
    depths: [u32; 2],
    /// Pixels whose integration prefixes are in memory at a time.
    in_memory: u32,
    /// Which of the two buffers of reservoirs holds those of the last frame.
    latest: usize,
}

struct Kernels {
    primary: Kernel,
    supports: Kernel,
    prefix_temporal: Kernel,
    suffixes: Kernel,
    temporal: Kernel,
    spatial: Kernel,
    sites: Kernel,
    /// Of the final gather, in order: those with a thread for each prefix, and for each pixel.
    integrate: Kernel,
    choose: Kernel,
    own: Kernel,
    gather: Kernel,
    resolve: Kernel,
}

struct Memory {
    settings: Buffer,
    /// Of even and of odd frames.
    primaries: [Buffer; 2],
    prefixes: [Buffer; 2],
    reservoirs: [Buffer; 2],
    image: Buffer,
    site_boxes: Buffer,
    integrations: Buffer,
    own_suffixes: Buffer,
}

impl Memory {
    fn new(gpu: &Gpu, pixels: u64, integrations: u64) -> Result<Self, GpuError> {
        let of_pixels = |name, bytes| gpu.zeros(name, bytes * pixels);
        let primaries = |name| of_pixels(name, PRIMARY_BYTES);
        let reservoirs = |name| of_pixels(name, RESERVOIR_BYTES);
        Ok(Self {
            settings: gpu.zeros("settings", size_of::<Settings>() as u64)?,
            primaries: [primaries("even primaries")?, primaries("odd primaries")?],
            prefixes: [reservoirs("even prefixes")?, reservoirs("odd prefixes")?],
            reservoirs: [reservoirs("reservoirs")?, reservoirs("more reservoirs")?],
            image: of_pixels("image", IMAGE_BYTES)?,
            site_boxes: of_pixels("boxes of sites", BOX_BYTES)?,
            integrations: gpu.zeros("integration prefixes", INTEGRATION_BYTES * integrations)?,
            own_suffixes: gpu.zeros("own suffixes", RESERVOIR_BYTES * integrations)?,
        })
    }
}

impl<'a> SuffixFrames<'a> {
    /// Prepares the two programs for frames with so many integration prefixes a pixel.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn new(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        [first, second]: [&str; 2],
        prefixes: u32,
        depths: [u32; 2],
    ) -> Result<Self, GpuError> {
        let of_program = |label: &str, wgsl: &str, entry: &str| {
            let label = format!("restir-suffix {label}");
            gpu.kernel_of_tables(&label, wgsl, entry, &TABLES, &scene.constants(wgsl, &[]))
        };
        let of_first = |label, entry| of_program(label, first, entry);
        let of_second = |entry| of_program(entry, second, entry);
        let [width, height] = scene.size();
        let pixels = width * height;
        let in_memory = (MOST_INTEGRATIONS / prefixes).clamp(1, pixels);
        let integrations = u64::from(in_memory) * u64::from(prefixes);
        Ok(Self {
            gpu,
            scene,
            kernels: Kernels {
                primary: of_first("primary", "primary")?,
                supports: of_first("supports", "supports")?,
                prefix_temporal: of_first("prefix_temporal", "temporal")?,
                suffixes: of_second("suffixes")?,
                temporal: of_second("temporal")?,
                spatial: of_second("spatial")?,
                sites: of_second("sites")?,
                integrate: of_second("integrate")?,
                choose: of_second("choose")?,
                own: of_second("own")?,
                gather: of_second("gather")?,
                resolve: of_second("resolve")?,
            },
            scene_group: gpu.bind(&[&scene.bindings()]),
            memory: Memory::new(gpu, u64::from(pixels), integrations)?,
            builder: BvhBuilder::new(gpu)?,
            tree: GpuBvh::new(gpu, pixels as usize)?,
            depths,
            in_memory,
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
            prefixes,
            reservoirs,
            image,
            site_boxes,
            integrations,
            own_suffixes,
        } = &self.memory;
        let pairs = [primaries, prefixes, reservoirs];
        let buffers = pairs.into_iter().flatten();
        let buffers = buffers.chain([image, site_boxes, integrations, own_suffixes]);
        buffers.map(Buffer::bytes).sum::<u64>() + self.tree.bytes() + self.tree.scratch_bytes()
    }

    /// Begins a frame, with the previous one if `temporal`.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`], [`GpuError::TooLarge`].
    pub fn begin(
        &mut self,
        asked: Frame,
        seed: u64,
        temporal: bool,
        rounds: u32,
    ) -> Result<BegunFrame, GpuError> {
        let [max_depth, roulette_depth] = self.depths;
        let settings = self.scene.kernel_settings(seed, max_depth, roulette_depth);
        self.gpu.write(&self.memory.settings, &[settings]);
        let [width, height] = self.size();
        let pixels = width * height;
        // Paths that are too short for prefixes are all direct light.
        let has_prefixes = max_depth >= asked.least_length;
        let mut made = 1 - self.latest;
        let mut work = self.gpu.timed_work();
        let mut pass = Pass {
            scene_group: &self.scene_group,
            work: &mut work,
        };
        let about = self.gpu.buffer("frame", &[asked])?;
        let bound = self.bind(asked.number, made, &about);
        pass.run(&self.kernels.primary, &bound, pixels);
        if has_prefixes {
            pass.run(&self.kernels.supports, &bound, pixels);
            if temporal {
                pass.run(&self.kernels.prefix_temporal, &bound, pixels);
            }
            pass.run(&self.kernels.suffixes, &bound, pixels);
            if temporal {
                pass.run(&self.kernels.temporal, &bound, pixels);
            }
            for round in 0..rounds {
                made = 1 - made;
                let about = self.gpu.buffer("frame", &[Frame { round, ..asked }])?;
                let bound = self.bind(asked.number, made, &about);
                pass.run(&self.kernels.spatial, &bound, pixels);
            }
            if asked.borrowed > 0 {
                pass.run(&self.kernels.sites, &bound, pixels);
                self.builder.build(pass.work, &self.memory.site_boxes, &self.tree);
            }
            for first in (0..pixels).step_by(self.in_memory as usize) {
                let count = self.in_memory.min(pixels - first);
                let asked = Frame {
                    first,
                    count,
                    ..asked
                };
                self.gather(&mut pass, asked, made)?;
            }
        }
        self.latest = made;
        Ok(work.begin_image(&self.memory.image, self.size()))
    }

    /// The final gather of some pixels.
    fn gather(&self, pass: &mut Pass<'_, '_>, asked: Frame, made: usize) -> Result<(), GpuError> {
        let about = self.gpu.buffer("frame", &[asked])?;
        let bound = self.bind(asked.number, made, &about);
        let (prefixes, pixels) = (asked.count * asked.prefixes, asked.count);
        pass.run(&self.kernels.integrate, &bound, prefixes);
        pass.run(&self.kernels.choose, &bound, pixels);
        pass.run(&self.kernels.own, &bound, prefixes);
        pass.run(&self.kernels.gather, &bound, prefixes);
        pass.run(&self.kernels.resolve, &bound, pixels);
        Ok(())
    }

    fn bind(&self, number: u32, made: usize, frame: &Buffer) -> BoundGroup {
        let Memory {
            settings,
            primaries,
            prefixes,
            reservoirs,
            image,
            site_boxes,
            integrations,
            own_suffixes,
        } = &self.memory;
        let parity = number as usize % 2;
        self.gpu.bind(&[&SuffixBindings {
            settings,
            primaries: &primaries[parity],
            before: &primaries[1 - parity],
            prefixes: &prefixes[parity],
            prefixes_before: &prefixes[1 - parity],
            given: &reservoirs[1 - made],
            made: &reservoirs[made],
            image,
            frame,
            site_boxes,
            site_nodes: &self.tree.nodes,
            site_order: &self.tree.order,
            integrations,
            own_suffixes,
        }])
    }
}

/// Where passes are recorded.
struct Pass<'p, 'w> {
    scene_group: &'p BoundGroup,
    work: &'p mut Work<'w>,
}

impl Pass<'_, '_> {
    fn run(&mut self, kernel: &Kernel, bound: &BoundGroup, threads: u32) {
        self.work
            .dispatch_bound(kernel, &[self.scene_group, bound], groups_of(threads));
    }
}

#[cfg(test)]
impl SuffixFrames<'_> {
    /// Of the tree over sites, and of what builds it.
    pub fn tree_bytes(&self) -> u64 {
        self.tree.bytes() + self.tree.scratch_bytes()
    }

    /// Fewer pixels in memory.
    pub fn restrict(&mut self, in_memory: Option<u32>) {
        self.in_memory = in_memory.unwrap_or(self.in_memory);
    }

    /// The first pixel whose site is at no place.
    pub fn wrong_site(&self) -> Result<Option<u32>, GpuError> {
        self.tree.wrong(self.gpu)
    }

    /// Weight times target of each pixel's supporting prefix after a frame.
    pub fn held_prefixes(&self, frame: u32) -> Result<Vec<f32>, GpuError> {
        let [width, height] = self.size();
        let held: Vec<[f32; 16]> = self.gpu.read(
            &self.memory.prefixes[frame as usize % 2],
            (width * height) as usize,
        )?;
        let target = |held: &[f32; 16]| lightshed_scene::luminance([held[4], held[5], held[6]].into());
        Ok(held
            .iter()
            .map(|held| match held[11] > 0.0 {
                true => held[11] * target(held),
                false => 0.0,
            })
            .collect())
    }
}
