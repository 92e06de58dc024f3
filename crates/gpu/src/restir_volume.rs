//! Volumetric ReSTIR on the device.

use crate::bindings::{MediumBindings, ReuseBindings, SceneBindings, Table};
use crate::programs::RESTIR_VOLUME;
use crate::restir_frames::{RestirFrames, ReuseFrame, ReuseProgram, bytes_per_pixel};
use crate::{BegunFrame, Gpu, GpuError, GpuMethod, GpuScene};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::{RestirVolumeError, RestirVolumeOptions};

/// Light that a medium and surfaces scatter once, by reservoirs that pixels and frames share: the
/// estimator of `lightshed_integrator::RestirVolume` with one scattering vertex, for a camera at
/// rest.
///
/// Targets are those of the host with neighbours, by the full resolution of the density. Candidates
/// mix emitter samples with directions of the phase function, random numbers are the device's own,
/// and merges are in `f32`: images agree with the host's in expectation.
pub struct GpuRestirVolume<'a> {
    frames: RestirFrames<'a>,
    options: RestirVolumeOptions,
    phase_share: f32,
}

/// What the program binds.
pub(crate) const TABLES: [Table; 3] = [SceneBindings::TABLE, MediumBindings::TABLE, ReuseBindings::TABLE];

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
/// Most neighbours, as the program has it.
const MOST_NEIGHBOURS: u32 = 3;

impl<'a> GpuRestirVolume<'a> {
    /// Bytes on the device for each pixel: reservoirs and what is seen, of this frame and the one
    /// before, and the image.
    pub const BYTES_PER_PIXEL: u64 = bytes_per_pixel(PATH_BYTES);

    /// In a scene made by [`GpuScene::with_medium`]; paths scatter once, a pixel has one reservoir,
    /// at most 3 neighbours take part, and targets and proposals are by densities of level 0.
    ///
    /// # Errors
    ///
    /// [`GpuError::Medium`] for a scene without one; [`GpuError::Settings`] for other options, and
    /// for materials that no emitter sample finds light by; [`GpuError::Refused`],
    /// [`GpuError::TooLarge`].
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
        scene.refuse_part_of_a_sky("restir-volume")?;
        scene.refuse_deltas("restir-volume")?;
        scene.refuse_dielectrics("restir-volume")?;
        if let Some(index) = scene.sharp_material() {
            let error = RestirVolumeError::SharpMaterial(index);
            return Err(GpuError::Settings(error.to_string().into()));
        }
        let program = ReuseProgram {
            name: "restir-volume",
            wgsl: program,
            constants: &[],
            reservoir_bytes: PATH_BYTES,
            tables: &TABLES,
            besides: Some(&medium.bindings()),
            world: None,
        };
        Ok(Self {
            frames: RestirFrames::new(gpu, scene, &program)?,
            options,
            phase_share: if scene.has_surroundings() {
                medium.phase_share
            } else {
                0.0
            },
        })
    }

    /// Bytes on the device, the scene's and the medium's apart.
    pub fn bytes(&self) -> u64 {
        self.frames.bytes()
    }
}

/// The part of the host's options that the device supports.
fn check(options: &RestirVolumeOptions) -> Result<(), GpuError> {
    let refused = |why: &'static str| Err(GpuError::Settings(why.into()));
    if let Err(error) = options.check() {
        return Err(GpuError::Settings(error.to_string().into()));
    }
    if options.scatterings != 1 {
        return refused("paths through media are reused with one scattering only: the longest has 2 edges");
    }
    if options.reservoirs != 1 {
        return refused("a pixel has one reservoir: see `RestirVolumeOptions::with_neighbours`");
    }
    if options.neighbours > MOST_NEIGHBOURS {
        return refused("at most 3 neighbours are possible");
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
        self.frames.size()
    }

    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        let Self {
            options, phase_share, ..
        } = *self;
        let asked = ReuseFrame {
            number: frame,
            seed,
            depths: [2, u32::MAX],
            temporal: options.temporal_reuse,
            rounds: 1,
        };
        self.frames.begin(asked, |_| Frame {
            number: frame,
            walks: options.walks,
            neighbours: options.neighbours,
            radius: options.radius_pixels,
            confidence_cap: options.confidence_cap.min(f32::MAX),
            phase_share,
            padding: [0; 2],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::{Chains, faulty, gpu, host_means, planted};
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
        let paths = VolumePathTracer::new(scene, scene.emitters_by_power()).with_depths(Some(2), u32::MAX);
        host_means([SIDE; 2], images, |x, y, index| paths.sample(x, y, index, 5))
    }

    /// Means of images by z-tests at 1e-4 each. Programs with a fault are noticed.
    #[test]
    fn images_have_the_expectation_of_paths() {
        let Some(gpu) = gpu() else { return };
        let faults = [
            // Light arrives whether or not anything is in between.
            [
                "value *= through.transmittance;",
                "value *= select(1.0, through.transmittance, leg == 0u);",
            ],
            // A neighbour is trusted as if it alone could have produced its path.
            [".confidence * density;", ".confidence * density * f32(i == j);"],
            // Others are trusted less than they were.
            [
                "total += package_reuse__1merge_input(j).confidence",
                "total += min(package_reuse__1merge_input(j).confidence, 1.0)",
            ],
            // Nobody is asked about this pixel's own path.
            ["density = there.p_hat * there.jacobian;", "density = 0.0;"],
        ];
        for (name, description, images) in [
            ("cloud", builtin::cloud(), 600),
            ("smoke-in-cornell", builtin::smoke_in_cornell(), 600),
        ] {
            let scene = sized(description);
            let options = RestirVolumeOptions::of_scene(&scene, Some(2)).with_neighbours();
            let truth = by_paths(&scene, images);
            let on_device = GpuScene::with_medium(gpu, &scene).expect("the device knows it");
            let chains = Chains {
                counted: 0..FRAMES,
                known: &|_, _, _| Rgb::ZERO,
            };
            let mut sound = method(gpu, &on_device, options, RESTIR_VOLUME);
            assert!(chains.agree(name, &mut sound, 24, &truth), "{name}");
            if name != "cloud" {
                continue;
            }
            for &fault in planted(gpu, &faults) {
                let program = faulty(RESTIR_VOLUME, fault);
                let mut planted = method(gpu, &on_device, options, &program);
                assert!(chains.differ(&mut planted, 24, &truth), "{fault:?}");
            }
        }
    }

    #[test]
    fn other_options_are_refused() {
        let Some(gpu) = gpu() else { return };
        let scene = sized(builtin::cloud());
        let on_device = GpuScene::with_medium(gpu, &scene).expect("the device knows it");
        let sound = RestirVolumeOptions::new(1).with_neighbours();
        let change = |change: &dyn Fn(&mut RestirVolumeOptions)| {
            let mut options = sound;
            change(&mut options);
            GpuRestirVolume::new(gpu, &on_device, options).err()
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
        let flat = GpuScene::new(gpu, &sized(builtin::cornell())).expect("it is flat");
        assert!(matches!(
            GpuRestirVolume::new(gpu, &flat, sound).err(),
            Some(GpuError::Medium(_))
        ));
    }
}
