//! Programs of one kernel, which computes a sample of each pixel.

use crate::bindings::{BoundGroup, ImageBindings, Table};
use crate::path_tracer::groups_of;
use crate::scene::Settings;
use crate::{BegunFrame, Buffer, Gpu, GpuError, GpuScene, Kernel};
use bytemuck::Pod;

/// A kernel that writes an image, with what it reads and writes: the scene, something of the
/// method, and the settings.
pub(crate) struct SampleKernel<'a> {
    gpu: &'a Gpu,
    pub scene: &'a GpuScene,
    /// The scene, and what the method adds.
    groups: [BoundGroup; 2],
    kernel: Kernel,
    settings: Buffer,
    image: Buffer,
}

impl<'a> SampleKernel<'a> {
    /// Bytes of a pixel of the image.
    pub const BYTES_PER_PIXEL: u64 = 16;

    /// The kernel `name` of a program with these constants of the method and these tables, of which
    /// `added` fills the second group.
    pub fn new(
        (gpu, scene): (&'a Gpu, &'a GpuScene),
        name: &'static str,
        (program, constants): (&str, &[(&str, bool)]),
        tables: &[Table],
        added: BoundGroup,
    ) -> Result<Self, GpuError> {
        let [width, height] = scene.size();
        let pixels = u64::from(width) * u64::from(height);
        Ok(Self {
            gpu,
            scene,
            groups: [gpu.bind(&[&scene.bindings()]), added],
            kernel: gpu.kernel_of_tables(
                name,
                program,
                name,
                tables,
                &scene.constants(program, constants),
            )?,
            settings: gpu.zeros("settings", size_of::<Settings>() as u64)?,
            image: gpu.zeros("image", Self::BYTES_PER_PIXEL * pixels)?,
        })
    }

    /// Bytes of the image.
    pub fn bytes(&self) -> u64 {
        self.image.bytes()
    }

    /// Begins an image of paths of these depths: the longest, and where roulette starts. `asked` is
    /// what the program reads besides.
    pub fn begin<T: Pod>(
        &mut self,
        seed: u64,
        [max_depth, roulette_depth]: [u32; 2],
        asked: T,
    ) -> Result<BegunFrame, GpuError> {
        let settings = self.scene.kernel_settings(seed, max_depth, roulette_depth);
        self.gpu.write(&self.settings, &[settings]);
        let asked = self.gpu.buffer("asked", &[asked])?;
        let method = self.gpu.bind(&[&ImageBindings {
            settings: &self.settings,
            image: &self.image,
            asked: &asked,
        }]);
        let [of_scene, added] = &self.groups;
        let [width, height] = self.scene.size();
        let mut work = self.gpu.timed_work();
        work.dispatch_bound(
            &self.kernel,
            &[of_scene, added, &method],
            groups_of(width * height),
        );
        Ok(work.begin_image(&self.image, [width, height]))
    }
}
