//! ReSTIR DI on the device.

use crate::emitter_tree::{EmitterTree, TreeShape};
use crate::frames::finished_frame;
use crate::path_tracer::groups_of;
use crate::programs::RESTIR_DI;
use crate::scene::{SCENE_BINDINGS, Settings};
use crate::{Access, Buffer, Gpu, GpuError, GpuMethod, GpuScene, Kernel, PassTime};
use bytemuck::{Pod, Zeroable};
use lightshed_film::RayCounts;
use lightshed_integrator::RestirDiSettings;

/// Direct light by reservoirs that pixels and frames share: the estimator of `lightshed_integrator::RestirDi`, unbiased, with one round of
/// spatial reuse and a camera at rest.
///
/// Random numbers are its own, and merges are in `f32`: images agree with the host's in expectation.
pub struct GpuRestirDi<'a> {
    gpu: &'a Gpu,
    scene: &'a GpuScene,
    settings: RestirDiSettings,
    emitters: EmitterTree,
    kernels: [Kernel; 4],
    memory: Memory,
    times: Vec<PassTime>,
}

struct Memory {
    settings: Buffer,
    /// Of even and of odd frames.
    primaries: [Buffer; 2],
    held: Buffer,
    history: Buffer,
    image: Buffer,
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Frame {
    number: u32,
    candidates: u32,
    neighbours: u32,
    radius: f32,
    confidence_cap: f32,
    padding: [u32; 3],
    tree: TreeShape,
}

// As in the shader; held to it by a test.
const _: () = assert!(size_of::<Frame>() == 48);

/// Bytes of a pixel's reservoir.
const LIGHT_BYTES: u64 = 48;
/// Bytes of what a pixel sees.
const PRIMARY_BYTES: u64 = 32;
/// Bytes of a pixel of the image.
const IMAGE_BYTES: u64 = 16;
/// Most neighbours.
const MOST_NEIGHBOURS: u32 = 8;

impl<'a> GpuRestirDi<'a> {
    /// Bytes on the device for each pixel: reservoirs and what is seen, of this frame and the one before, and the image.
    pub const BYTES_PER_PIXEL: u64 = 2 * (LIGHT_BYTES + PRIMARY_BYTES) + IMAGE_BYTES;

    /// With [`RestirDiSettings::UNBIASED`].
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn new(gpu: &'a Gpu, scene: &'a GpuScene) -> Result<Self, GpuError> {
        Self::with_settings(gpu, scene, RestirDiSettings::UNBIASED)
    }

    /// With other settings: unbiased, with one round of at most 8 neighbours.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for others; [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn with_settings(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        settings: RestirDiSettings,
    ) -> Result<Self, GpuError> {
        Self::of_program(gpu, scene, settings, false, RESTIR_DI)
    }

    /// With candidates that are chosen for the point by a light tree, as those of `lightshed_integrator::RestirDi::with_sampler` by
    /// `LightSelection` with `LightChoosing::Tree`; the device builds the tree.
    ///
    /// # Errors
    ///
    /// As [`GpuRestirDi::with_settings`]; [`GpuError::Lost`].
    pub fn with_tree(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        settings: RestirDiSettings,
    ) -> Result<Self, GpuError> {
        Self::of_program(gpu, scene, settings, true, RESTIR_DI)
    }

    fn of_program(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        settings: RestirDiSettings,
        by_tree: bool,
        program: &str,
    ) -> Result<Self, GpuError> {
        scene.refuse_media()?;
        scene.refuse_deltas("restir-di")?;
        scene.refuse_dielectrics("restir-di")?;
        if settings.biased || settings.spatial_rounds != 1 {
            return Err(GpuError::Settings(
                "only one unbiased round of spatial reuse is known".into(),
            ));
        }
        if !(1..=MOST_NEIGHBOURS).contains(&settings.neighbours) {
            return Err(GpuError::Settings(
                "between 1 and 8 neighbours are possible".into(),
            ));
        }
        if !(1..=1 << 16).contains(&settings.emitter_candidates) {
            return Err(GpuError::Settings(
                "candidates must number between 1 and 65536".into(),
            ));
        }
        let positive = |x: f32| x > 0.0 && x.is_finite();
        if !(positive(settings.radius_pixels) && positive(settings.confidence_cap)) {
            return Err(GpuError::Settings(
                "radius and confidence cap must be positive".into(),
            ));
        }
        let mut access = vec![Access::Read; SCENE_BINDINGS + 4];
        access.extend([
            Access::Write,
            Access::Read,
            Access::Write,
            Access::Write,
            Access::Write,
            Access::Read,
        ]);
        let emitters = if by_tree {
            EmitterTree::new(gpu, scene)?
        } else {
            EmitterTree::unused(gpu)?
        };
        let mut constants = scene.constants(program);
        constants.push(("BY_TREE", f64::from(u8::from(by_tree && emitters.shines))));
        let kernel =
            |entry: &str| gpu.kernel(&format!("restir-di {entry}"), program, entry, &access, &constants);
        let [width, height] = scene.size();
        let pixels = u64::from(width) * u64::from(height);
        let primaries = |name| gpu.zeros(name, PRIMARY_BYTES * pixels);
        Ok(Self {
            gpu,
            scene,
            settings,
            emitters,
            kernels: [
                kernel("primary")?,
                kernel("fresh")?,
                kernel("temporal")?,
                kernel("spatial")?,
            ],
            memory: Memory {
                settings: gpu.zeros("settings", size_of::<Settings>() as u64)?,
                primaries: [primaries("even primaries")?, primaries("odd primaries")?],
                held: gpu.zeros("reservoirs", LIGHT_BYTES * pixels)?,
                history: gpu.zeros("history", LIGHT_BYTES * pixels)?,
                image: gpu.zeros("image", IMAGE_BYTES * pixels)?,
            },
            times: Vec::new(),
        })
    }

    /// Bytes on the device, the scene's and the tree's apart.
    pub fn bytes(&self) -> u64 {
        let Memory {
            settings: _,
            primaries,
            held,
            history,
            image,
        } = &self.memory;
        let buffers = primaries.iter().chain([held, history, image]);
        buffers.map(Buffer::bytes).sum()
    }
}

impl GpuMethod for GpuRestirDi<'_> {
    fn size(&self) -> [u32; 2] {
        self.scene.size()
    }

    fn frame(&mut self, frame: u32, seed: u64) -> Result<(Vec<[f32; 3]>, RayCounts), GpuError> {
        let Memory {
            settings,
            primaries,
            held,
            history,
            image,
        } = &self.memory;
        self.gpu
            .write(settings, &[self.scene.kernel_settings(seed, 2, u32::MAX)]);
        let about = self.gpu.buffer(
            "frame",
            &[Frame {
                number: frame,
                candidates: self.settings.emitter_candidates,
                neighbours: self.settings.neighbours,
                radius: self.settings.radius_pixels,
                confidence_cap: self.settings.confidence_cap,
                padding: [0; 3],
                tree: self.emitters.shape(),
            }],
        )?;
        let parity = frame as usize % 2;
        let mut buffers = vec![settings];
        buffers.extend(&self.scene.buffers);
        buffers.extend(self.emitters.buffers());
        buffers.extend([
            &primaries[parity],
            &primaries[1 - parity],
            held,
            history,
            image,
            &about,
        ]);
        let [width, height] = self.scene.size();
        let groups = groups_of(width * height);
        let mut work = self.gpu.timed_work();
        let [primary, fresh, temporal, spatial] = &self.kernels;
        work.dispatch(primary, &buffers, groups);
        work.dispatch(fresh, &buffers, groups);
        if self.settings.temporal_reuse && frame > 0 {
            work.dispatch(temporal, &buffers, groups);
        }
        work.dispatch(spatial, &buffers, groups);
        self.times = work.finish()?;
        finished_frame(self.gpu, image, self.size())
    }

    fn times(&self) -> &[PassTime] {
        &self.times
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Chains, gpu, mean_luminance, under_the_sky};
    use lightshed_film::PixelEstimator;
    use lightshed_integrator::PathTracer;
    use lightshed_scene::{Scene, SceneDescription, builtin};
    use lightshed_testkit::MeanTest;

    const SIDE: u32 = 32;
    /// Frames of a chain, of which the last counts.
    const FRAMES: u32 = 4;

    fn method<'a>(gpu: &'a Gpu, scene: &'a GpuScene, by_tree: bool, program: &str) -> GpuRestirDi<'a> {
        let settings = RestirDiSettings::UNBIASED;
        let method =
            GpuRestirDi::of_program(gpu, scene, settings, by_tree, program).expect("the program is sound");
        assert_eq!(
            method.bytes(),
            GpuRestirDi::BYTES_PER_PIXEL * u64::from(SIDE * SIDE)
        );
        method
    }

    /// The host's reflected direct light, by paths of two edges.
    fn by_paths(scene: &Scene, images: u32) -> MeanTest {
        let [two, one] = [2, 1].map(|depth| PathTracer::with_depths(scene, Some(depth), u32::MAX));
        let mut means = MeanTest::new();
        for index in 0..images {
            means.push(mean_luminance([SIDE; 2], |x, y| {
                two.sample(x, y, index, 5) - one.sample(x, y, index, 5)
            }));
        }
        means
    }

    fn scenes() -> Vec<(&'static str, SceneDescription)> {
        vec![
            ("cornell", builtin::cornell()),
            ("cornell-glossy", under_the_sky(builtin::cornell_glossy())),
            ("many-lights", builtin::many_lights()),
        ]
    }

    /// Means of images by z-tests at 1e-4 each. Programs with a fault in a merge are noticed.
    #[test]
    fn images_have_the_expectation_of_direct_light() {
        let Some(gpu) = gpu() else { return };
        let faults = [
            // A neighbour is trusted as if it could have produced everything.
            ["* fraction;", "* 0.0;"],
            // History merges without being asked about my sample.
            ["mine.confidence * p + confidence * q", "mine.confidence * p"],
        ];
        for (name, mut description) in scenes() {
            (description.settings.width, description.settings.height) = (SIDE, SIDE);
            let scene = Scene::new(&description).expect("built-in scenes are sound");
            let truth = by_paths(&scene, 1000);
            let on_device = GpuScene::new(&gpu, &scene).expect("it is flat");
            // A path's own camera ray has the same random numbers: what it sees emitting is taken off exactly.
            let seen = PathTracer::with_depths(&scene, Some(1), u32::MAX);
            let chains = Chains {
                counted: FRAMES - 1..FRAMES,
                known: &|[x, y], frame, seed| seen.sample(x, y, frame, seed),
            };
            let is_noticed = |by_tree: bool, [from, to]: [&str; 2]| {
                assert!(RESTIR_DI.contains(from), "{from}");
                println!(" {to}");
                let program = RESTIR_DI.replace(from, to);
                chains.differ(&mut method(&gpu, &on_device, by_tree, &program), 20, &truth)
            };
            for by_tree in [false, true] {
                let found = chains.means(&mut method(&gpu, &on_device, by_tree, RESTIR_DI), 40);
                println!(
                    "{name}, tree {by_tree}: {:.5} ({:.5}) against {:.5} ({:.5})",
                    found.mean(),
                    found.standard_error(),
                    truth.mean(),
                    truth.standard_error()
                );
                assert!(found.test_equal(&truth, 1e-4).is_ok(), "{name}");
            }
            if name == "many-lights" {
                // The tree's choices count as if they were made twice as often.
                let fault = ["pdf_emitter = probability /", "pdf_emitter = 2.0 * probability /"];
                assert!(is_noticed(true, fault), "{fault:?}");
            }
            if name != "cornell" {
                continue;
            }
            for fault in faults {
                assert!(is_noticed(false, fault), "{fault:?}");
            }
        }
    }
}
