//! Volumetric ReSTIR on the device.

use crate::frames::finished_frame;
use crate::path_tracer::groups_of;
use crate::programs::RESTIR_VOLUME;
use crate::scene::{SCENE_BINDINGS, Settings};
use crate::{Access, Buffer, Gpu, GpuError, GpuMethod, GpuScene, Kernel, PassTime};
use bytemuck::{Pod, Zeroable};
use lightshed_film::RayCounts;
use lightshed_integrator::{RestirVolumeError, RestirVolumeOptions};

/// Light that a medium and surfaces scatter once, by reservoirs that pixels and frames share: the estimator of
/// `lightshed_integrator::RestirVolume` with one scattering vertex, for a camera at rest.
///
/// Targets are those of the host with neighbours, by the full resolution of the density; candidates mix emitter samples with directions of the phase
/// function, random numbers are the device's own, and merges are in `f32`: images agree with the host's in expectation.
pub struct GpuRestirVolume<'a> {
    gpu: &'a Gpu,
    scene: &'a GpuScene,
    medium: &'a [Buffer; 4],
    options: RestirVolumeOptions,
    phase_share: f32,
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
    walks: u32,
    neighbours: u32,
    radius: f32,
    confidence_cap: f32,
    phase_share: f32,
    padding: [u32; 2],
}

// As in the shader; held to it by a test, as are reservoirs and what pixels see.
const _: () = assert!(size_of::<Frame>() == 32);

/// Bytes of a pixel's reservoir.
const PATH_BYTES: u64 = 48;
/// Bytes of what a pixel sees.
const PRIMARY_BYTES: u64 = 32;
/// Bytes of a pixel of the image.
const IMAGE_BYTES: u64 = 16;
/// Most neighbours.
const MOST_NEIGHBOURS: u32 = 3;
/// Most walks: random numbers are set aside for so many.
const MOST_WALKS: u32 = 1024;

impl<'a> GpuRestirVolume<'a> {
    /// Bytes on the device for each pixel: reservoirs and what is seen, of this frame and the one before, and the image.
    pub const BYTES_PER_PIXEL: u64 = 2 * (PATH_BYTES + PRIMARY_BYTES) + IMAGE_BYTES;

    /// In a scene made by [`GpuScene::with_medium`]; paths scatter once, a pixel has one reservoir, at most 3 neighbours take part, and targets and proposals are by
    /// densities of level 0.
    ///
    /// # Errors
    ///
    /// [`GpuError::Medium`] for a scene without one; [`GpuError::Settings`] for other options, and for materials that no emitter sample
    /// finds light by; [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn new(gpu: &'a Gpu, scene: &'a GpuScene, options: RestirVolumeOptions) -> Result<Self, GpuError> {
        Self::of_program(gpu, scene, options, RESTIR_VOLUME)
    }

    fn of_program(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        options: RestirVolumeOptions,
        program: &str,
    ) -> Result<Self, GpuError> {
        let medium = scene.medium().ok_or(GpuError::Medium("there is none"))?;
        check(&options)?;
        scene.refuse_deltas("restir-volume")?;
        scene.refuse_dielectrics("restir-volume")?;
        if let Some(index) = scene.sharp_material() {
            let error = RestirVolumeError::SharpMaterial(index);
            return Err(GpuError::Settings(error.to_string().into()));
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
        let mut constants = scene.constants(program);
        let has_surfaces = f64::from(u8::from(scene.has_surfaces()));
        constants.push(("package_volume__1HAS_SURFACES", has_surfaces));
        let kernel = |entry: &str| {
            gpu.kernel(
                &format!("restir-volume {entry}"),
                program,
                entry,
                &access,
                &constants,
            )
        };
        let [width, height] = scene.size();
        let pixels = u64::from(width) * u64::from(height);
        let primaries = |name| gpu.zeros(name, PRIMARY_BYTES * pixels);
        Ok(Self {
            gpu,
            scene,
            medium: &medium.buffers,
            options,
            phase_share: if scene.has_surroundings() {
                medium.phase_share
            } else {
                0.0
            },
            kernels: [
                kernel("primary")?,
                kernel("candidates")?,
                kernel("temporal")?,
                kernel("spatial")?,
            ],
            memory: Memory {
                settings: gpu.zeros("settings", size_of::<Settings>() as u64)?,
                primaries: [primaries("even primaries")?, primaries("odd primaries")?],
                held: gpu.zeros("reservoirs", PATH_BYTES * pixels)?,
                history: gpu.zeros("history", PATH_BYTES * pixels)?,
                image: gpu.zeros("image", IMAGE_BYTES * pixels)?,
            },
            times: Vec::new(),
        })
    }

    /// Bytes on the device, the scene's and the medium's apart.
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

/// What of the host's options the device knows.
fn check(options: &RestirVolumeOptions) -> Result<(), GpuError> {
    let refused = |why: &'static str| Err(GpuError::Settings(why.into()));
    if options.scatterings != 1 {
        return refused("paths through media are reused with one scattering only: the longest has 2 edges");
    }
    if options.reservoirs != 1 {
        return refused("a pixel has one reservoir: see `RestirVolumeOptions::with_neighbours`");
    }
    if !(1..=MOST_WALKS).contains(&options.walks) {
        return refused("walks must number between 1 and 1024");
    }
    if options.neighbours > MOST_NEIGHBOURS {
        return refused("at most 3 neighbours are possible");
    }
    let positive = |x: f32| x > 0.0 && x.is_finite();
    if !(options.neighbours == 0 || positive(options.radius_pixels)) || !(options.confidence_cap > 0.0) {
        return refused("radius and confidence cap must be positive");
    }
    if options
        .camera_level
        .max(options.reuse_level)
        .max(options.shadow_level)
        > 0
    {
        return refused("densities of level 0 are the only ones");
    }
    Ok(())
}

impl GpuMethod for GpuRestirVolume<'_> {
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
                walks: self.options.walks,
                neighbours: self.options.neighbours,
                radius: self.options.radius_pixels,
                confidence_cap: self.options.confidence_cap.min(f32::MAX),
                phase_share: self.phase_share,
                padding: [0; 2],
            }],
        )?;
        let parity = frame as usize % 2;
        let mut buffers = vec![settings];
        buffers.extend(&self.scene.buffers);
        buffers.extend(self.medium);
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
        let [primary, candidates, temporal, spatial] = &self.kernels;
        work.dispatch(primary, &buffers, groups);
        work.dispatch(candidates, &buffers, groups);
        if self.options.temporal_reuse && frame > 0 {
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
    use crate::testing::{Chains, gpu, mean_luminance};
    use lightshed_film::PixelEstimator;
    use lightshed_integrator::VolumePathTracer;
    use lightshed_scene::{Rgb, Scene, SceneDescription, builtin};
    use lightshed_testkit::MeanTest;

    const SIDE: u32 = 16;
    /// Frames of a chain.
    const FRAMES: u32 = 4;

    fn sized(mut description: SceneDescription) -> Scene {
        (description.settings.width, description.settings.height) = (SIDE, SIDE);
        Scene::new(&description).expect("built-in scenes are sound")
    }

    fn method<'a>(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        options: RestirVolumeOptions,
        program: &str,
    ) -> GpuRestirVolume<'a> {
        let method = GpuRestirVolume::of_program(gpu, scene, options, program).expect("the program is sound");
        assert_eq!(
            method.bytes(),
            GpuRestirVolume::BYTES_PER_PIXEL * u64::from(SIDE * SIDE)
        );
        method
    }

    fn by_paths(scene: &Scene, images: u32) -> MeanTest {
        let paths = VolumePathTracer::with_depths(scene, Some(2), u32::MAX);
        let mut means = MeanTest::new();
        for index in 0..images {
            means.push(mean_luminance([SIDE; 2], |x, y| paths.sample(x, y, index, 5)));
        }
        means
    }

    /// Means of images by z-tests at 1e-4 each. Programs with a fault are noticed.
    #[test]
    fn images_have_the_expectation_of_paths() {
        let Some(gpu) = gpu() else { return };
        let faults = [
            // Light arrives whether or not anything is in between.
            (
                "value *= through.transmittance;",
                "value *= select(1.0, through.transmittance, leg == 0u);",
            ),
            // A neighbour is trusted as if it alone could have produced its path.
            (
                "total += package_volume_held[inputs[j]].confidence * targets[i][j];",
                "total += package_volume_held[inputs[j]].confidence * targets[i][i] * f32(i == j);",
            ),
            // Others are trusted less than they were.
            (
                "total += package_volume_held[inputs[j]].confidence",
                "total += min(package_volume_held[inputs[j]].confidence, 1.0)",
            ),
            // History merges without being asked about my path.
            (
                "mine.confidence * mine.p_hat + theirs.confidence * q",
                "mine.confidence * mine.p_hat",
            ),
        ];
        for (name, description, images) in [
            ("cloud", builtin::cloud(), 600),
            ("smoke-in-cornell", builtin::smoke_in_cornell(), 600),
        ] {
            let scene = sized(description);
            let options = RestirVolumeOptions::of_scene(&scene, Some(2)).with_neighbours();
            let truth = by_paths(&scene, images);
            let on_device = GpuScene::with_medium(&gpu, &scene).expect("the device knows it");
            let chains = Chains {
                counted: 0..FRAMES,
                known: &|_, _, _| Rgb::ZERO,
            };
            let found = chains.means(&mut method(&gpu, &on_device, options, RESTIR_VOLUME), 24);
            println!(
                "{name}: {:.5} ({:.5}) against {:.5} ({:.5})",
                found.mean(),
                found.standard_error(),
                truth.mean(),
                truth.standard_error()
            );
            assert!(found.test_equal(&truth, 1e-4).is_ok(), "{name}");
            if name != "cloud" {
                continue;
            }
            for (right, planted) in faults {
                assert!(RESTIR_VOLUME.contains(right), "{right}");
                println!(" {planted}");
                let program = RESTIR_VOLUME.replace(right, planted);
                let mut faulty = method(&gpu, &on_device, options, &program);
                assert!(chains.differ(&mut faulty, 24, &truth), "{planted}");
            }
        }
    }

    #[test]
    fn other_options_are_refused() {
        let Some(gpu) = gpu() else { return };
        let scene = sized(builtin::cloud());
        let on_device = GpuScene::with_medium(&gpu, &scene).expect("the device knows it");
        let sound = RestirVolumeOptions::new(1).with_neighbours();
        let change = |change: &dyn Fn(&mut RestirVolumeOptions)| {
            let mut options = sound;
            change(&mut options);
            GpuRestirVolume::new(&gpu, &on_device, options).err()
        };
        assert_eq!(change(&|_| ()), None);
        for refused in [
            change(&|options| options.scatterings = 2),
            change(&|options| options.reservoirs = 2),
            change(&|options| options.walks = 0),
            change(&|options| options.neighbours = 4),
            change(&|options| options.radius_pixels = f32::NAN),
            change(&|options| options.confidence_cap = 0.0),
            change(&|options| options.shadow_level = 1),
        ] {
            assert!(matches!(refused, Some(GpuError::Settings(_))), "{refused:?}");
        }
        let flat = GpuScene::new(&gpu, &sized(builtin::cornell())).expect("it is flat");
        assert!(matches!(
            GpuRestirVolume::new(&gpu, &flat, sound).err(),
            Some(GpuError::Medium(_))
        ));
    }
}
