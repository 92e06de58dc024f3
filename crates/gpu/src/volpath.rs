//! Path tracing through a medium on the device.

use crate::bindings::{ImageBindings, MediumBindings, SceneBindings, Table};
use crate::programs::VOLPATH;
use crate::sample_kernel::SampleKernel;
use crate::{BegunFrame, Gpu, GpuError, GpuMethod, GpuScene};

/// Path tracing through surfaces and a medium by delta and ratio tracking: the estimator of
/// `lightshed_integrator::VolumePathTracer`, with the same random numbers for each path, so that
/// images differ by rounding only.
pub struct GpuVolumePathTracer<'a> {
    samples: SampleKernel<'a>,
    max_depth: u32,
}

/// What the program binds.
pub(crate) const TABLES: [Table; 3] = [SceneBindings::TABLE, MediumBindings::TABLE, ImageBindings::TABLE];

impl<'a> GpuVolumePathTracer<'a> {
    /// Bytes on the device for each pixel: the image.
    pub const BYTES_PER_PIXEL: u64 = SampleKernel::BYTES_PER_PIXEL;

    /// With the lengths of the scene's settings, in a scene made by [`GpuScene::with_medium`].
    ///
    /// # Errors
    ///
    /// [`GpuError::Medium`] for a scene without; [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn new(gpu: &'a Gpu, scene: &'a GpuScene) -> Result<Self, GpuError> {
        Self::with_max_depth(gpu, scene, scene.settings().max_depth)
    }

    /// With paths of at most this number of edges (`None` is unbounded): 2 is single scattering.
    ///
    /// # Errors
    ///
    /// As [`GpuVolumePathTracer::new`].
    pub fn with_max_depth(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        max_depth: Option<u32>,
    ) -> Result<Self, GpuError> {
        Self::of_program(gpu, scene, max_depth, VOLPATH)
    }

    fn of_program(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        max_depth: Option<u32>,
        program: &str,
    ) -> Result<Self, GpuError> {
        let medium = scene.medium().ok_or(GpuError::Medium("there is none"))?;
        Ok(Self {
            samples: SampleKernel::new(
                (gpu, scene),
                "volpath",
                (program, &[]),
                &TABLES,
                gpu.bind(&[&medium.bindings()]),
            )?,
            max_depth: max_depth.unwrap_or(u32::MAX),
        })
    }

    /// Bytes on the device, the scene's and the medium's apart.
    pub fn bytes(&self) -> u64 {
        self.samples.bytes()
    }
}

impl GpuMethod for GpuVolumePathTracer<'_> {
    fn size(&self) -> [u32; 2] {
        self.samples.scene.size()
    }

    /// Sample number `frame` of each pixel.
    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        let roulette_depth = self.samples.scene.settings().roulette_depth;
        let depths = [self.max_depth, roulette_depth];
        self.samples.begin(seed, depths, [frame, 0, 0, 0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::gpu;
    use lightshed_film::PixelEstimator;
    use lightshed_integrator::VolumePathTracer;
    use lightshed_scene::glam::Vec3;
    use lightshed_scene::{
        EmitterDescription, Geometry, Material, Rgb, Scene, SceneDescription, ShapeDescription, SkySampling,
        TriangleMesh, builtin,
    };

    const SIDE: u32 = 40;

    /// Share of the samples that differ from the host's by more than rounding.
    fn unlike(gpu: &Gpu, scene: &Scene, max_depth: u32, program: &str) -> f64 {
        let sky = SkySampling::AboveMean;
        let on_device = GpuScene::with_medium_and_sky(gpu, scene, sky).expect("it is flat");
        let mut device = GpuVolumePathTracer::of_program(gpu, &on_device, Some(max_depth), program)
            .expect("the program is sound");
        assert_eq!(
            device.bytes(),
            GpuVolumePathTracer::BYTES_PER_PIXEL * u64::from(SIDE * SIDE)
        );
        let settings = scene.settings();
        let emitters = scene.emitters_by_power().with_sky(sky);
        let host =
            VolumePathTracer::new(scene, emitters).with_depths(Some(max_depth), settings.roulette_depth);
        let (mut unlike, mut bits, mut lit) = (0, 0, 0);
        for index in 3..5 {
            let (found, _) = device.frame(index, 11).expect("the device answers");
            for (i, value) in (0..).zip(found) {
                let (value, truth) = (Rgb::from(value), host.sample(i % SIDE, i / SIDE, index, 11));
                let scale = truth.max_element().max(1e-4);
                unlike += u32::from((value - truth).abs().max_element() > 1e-4 * scale);
                bits += u32::from(value == truth);
                lit += u32::from(truth != Rgb::ZERO);
            }
        }
        let count = f64::from(2 * SIDE * SIDE);
        println!("  {:.4} the same to the bit", f64::from(bits) / count);
        assert!(f64::from(lit) > 0.3 * count, "the picture is black");
        f64::from(unlike) / count
    }

    fn sized(mut description: SceneDescription) -> Scene {
        (description.settings.width, description.settings.height) = (SIDE, SIDE);
        Scene::new(&description).expect("built-in scenes are sound")
    }

    /// Smoke around a ball of glass, lit by a point and a direction, too.
    fn with_glass_and_points() -> SceneDescription {
        let mut scene = builtin::smoke_in_cornell();
        scene.shapes.push(ShapeDescription {
            name: "ball".to_owned(),
            geometry: Geometry::Mesh(builtin::icosphere(Vec3::new(0.2, -0.1, 0.4), 0.3, 2)),
            material: scene.materials.len() as u32,
            emission: None,
        });
        scene.materials.push(Material::Dielectric {
            eta: 1.5,
            roughness: None,
            specular_reflectance: Rgb::ONE.into(),
            specular_transmittance: Rgb::ONE.into(),
        });
        scene.emitters.extend([
            EmitterDescription::Point {
                position: Vec3::new(-0.4, 0.3, 0.2),
                intensity: Rgb::splat(0.3),
            },
            EmitterDescription::Directional {
                direction: Vec3::new(0.2, -0.3, -1.0),
                irradiance: Rgb::ONE,
            },
        ]);
        scene
    }

    /// A cloud down to the floor, in whose plane its lower boundary is, under constant light.
    fn on_a_floor() -> SceneDescription {
        let mut scene = builtin::cloud();
        scene.emitters = vec![EmitterDescription::Constant {
            radiance: Rgb::new(0.3, 0.4, 0.6),
        }];
        let Geometry::Mesh(boundary) = &scene.shapes[0].geometry else {
            panic!("a cuboid is a mesh")
        };
        let lowest = boundary
            .positions
            .iter()
            .map(|p| p.y)
            .fold(f32::INFINITY, f32::min);
        let corner = |x: f32, z: f32| Vec3::new(x, lowest, z);
        scene.shapes.push(ShapeDescription {
            name: "floor".to_owned(),
            geometry: Geometry::Mesh(TriangleMesh {
                positions: vec![
                    corner(-2.0, 3.0),
                    corner(4.0, 3.0),
                    corner(4.0, -2.5),
                    corner(-2.0, -2.5),
                ],
                indices: vec![[0, 1, 2], [0, 2, 3]],
                ..TriangleMesh::default()
            }),
            material: scene.materials.len() as u32,
            emission: None,
        });
        scene.materials.push(Material::Diffuse {
            reflectance: Rgb::new(0.7, 0.5, 0.3).into(),
        });
        scene
    }

    /// Paths through smoke and a cloud are the host's: collisions are exact, and so is all else but
    /// what the order of a product rounds.
    #[test]
    fn paths_are_those_of_the_host() {
        let Some(gpu) = gpu() else { return };
        let mut overcast = builtin::cloud();
        overcast.emitters = vec![EmitterDescription::Constant {
            radiance: Rgb::new(0.3, 0.4, 0.6),
        }];
        // Directions to an image are the host's to rounding, and a few of the collisions behind
        // them others.
        let scenes = [
            ("smoke", sized(builtin::smoke_in_cornell()), 5, 0.0),
            ("overcast", sized(overcast), 8, 0.0),
            ("cloud", sized(builtin::cloud()), 8, 0.01),
            ("on a floor", sized(on_a_floor()), 6, 0.0),
            ("glass and points", sized(with_glass_and_points()), 5, 0.0),
        ];
        for (name, scene, max_depth, most) in &scenes {
            let differing = unlike(gpu, scene, *max_depth, VOLPATH);
            println!("{name}: {differing:.5} differ");
            assert!(differing <= if gpu.is_exact() { *most } else { 0.1 }, "{name}");
        }
        // Light that is met counts as if it could not have been sampled.
        let weight = (
            "weight = package_lightshed_measure__1power_heuristic(pdf, other);",
            "weight = 1.0;",
        );
        // A boundary on a floor is met before the floor.
        let touching = (
            "override package_medium__1HAS_TOUCHING: bool = true",
            "const package_medium__1HAS_TOUCHING: bool = false",
        );
        for ((right, planted), (_, scene, max_depth, _)) in [(weight, &scenes[0]), (touching, &scenes[3])] {
            assert!(VOLPATH.contains(right), "{right}");
            let differing = unlike(gpu, scene, *max_depth, &VOLPATH.replace(right, planted));
            println!("{planted}: {differing:.5} differ");
            assert!(differing > 0.005, "{planted} is not noticed");
        }
    }

    #[test]
    fn other_media_are_refused() {
        let Some(gpu) = gpu() else { return };
        let refused = |scene: &Scene| GpuScene::with_medium(gpu, scene).err();
        let [fire, none] = [sized(builtin::fire()), sized(builtin::cornell())];
        assert!(matches!(refused(&fire), Some(GpuError::Medium(_))));
        assert!(matches!(refused(&none), Some(GpuError::Medium(_))));
        let flat = GpuScene::new(gpu, &none).expect("it is flat");
        assert!(matches!(
            GpuVolumePathTracer::new(gpu, &flat).err(),
            Some(GpuError::Medium(_))
        ));
        let smoke = GpuScene::with_medium(gpu, &sized(builtin::smoke_in_cornell())).expect("it is flat");
        assert!(matches!(
            crate::GpuPathTracer::new(gpu, &smoke).err(),
            Some(GpuError::Scene(_))
        ));
    }
}
