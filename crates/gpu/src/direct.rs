//! Direct light with emitters selected by a light tree or a light cache, on the device.

use crate::bindings::{
    ImageBindings, LightCacheBindings, LightTreeBindings, OctreeBindings, SceneBindings, Table,
};
use crate::emitter_tree::{EmitterTree, TreeShape};
use crate::light_cache::LightCacheMemory;
use crate::programs::DIRECT;
use crate::sample_kernel::SampleKernel;
use crate::{BegunFrame, Gpu, GpuError, GpuLightTree, GpuMethod, GpuScene, PassTime};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::MAX_DIRECT_SAMPLES;
use lightshed_integrator::guiding::FlatLightCache;

/// Emission and light that is scattered once, with emitters selected by a perfect light tree that
/// the device builds, or by a light cache that the host has trained: the estimator of
/// `lightshed_integrator::DirectLight` with `LightChoosing::Tree` or `LightChoosing::Vlc`.
///
/// Random numbers and selections are the host's, so a pixel's sample equals the host's to rounding.
/// An exception are near triangles, which the host samples by solid angle and the device by area:
/// those pixels agree in expectation.
pub struct GpuDirectLight<'a> {
    samples: SampleKernel<'a>,
    emitters: EmitterTree,
    asked: Direct,
}

/// What the program binds.
pub(crate) const TABLES: [Table; 5] = [
    SceneBindings::TABLE,
    LightTreeBindings::TABLE,
    OctreeBindings::TABLE,
    LightCacheBindings::TABLE,
    ImageBindings::TABLE,
];

/// As the shader reads it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Direct {
    tree: TreeShape,
    sample: u32,
    emitter_samples: u32,
    bsdf_samples: u32,
    groups: u32,
    stratum: [u32; 2],
    has_tree: u32,
    padding: u32,
}

impl<'a> GpuDirectLight<'a> {
    /// Bytes on the device for each pixel: the image.
    pub const BYTES_PER_PIXEL: u64 = SampleKernel::BYTES_PER_PIXEL;

    /// `n` samples of the emitters and, if the surface is not diffuse, `m` of the BSDF, at the
    /// point that a camera ray hits. Builds the light tree.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for no samples of emitters, or more than [`MAX_DIRECT_SAMPLES`] of
    /// either; [`GpuError::Refused`], [`GpuError::TooLarge`], [`GpuError::Lost`].
    pub fn new(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        emitter_samples: u32,
        bsdf_samples: u32,
    ) -> Result<Self, GpuError> {
        Self::of_program(gpu, scene, [emitter_samples, bsdf_samples], None, DIRECT)
    }

    /// As [`GpuDirectLight::new`], with emitters selected by a cache over the scene's finite
    /// emitters: `lightshed_integrator::LightSelection::flat_cache`.
    ///
    /// # Errors
    ///
    /// As [`GpuDirectLight::new`], and [`GpuError::Settings`] for a cache of another number of
    /// lights.
    pub fn with_cache(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        cache: &FlatLightCache<'_>,
        emitter_samples: u32,
        bsdf_samples: u32,
    ) -> Result<Self, GpuError> {
        Self::of_program(gpu, scene, [emitter_samples, bsdf_samples], Some(cache), DIRECT)
    }

    fn of_program(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        [emitter_samples, bsdf_samples]: [u32; 2],
        cache: Option<&FlatLightCache<'_>>,
        program: &str,
    ) -> Result<Self, GpuError> {
        scene.refuse_media()?;
        scene.refuse_part_of_a_sky("direct by lights")?;
        if emitter_samples == 0 || emitter_samples.max(bsdf_samples) > MAX_DIRECT_SAMPLES {
            return Err(GpuError::Settings(
                format!(
                    "samples of emitters must number between 1 and {MAX_DIRECT_SAMPLES}, of the BSDF no more"
                )
                .into(),
            ));
        }
        if cache.is_some_and(|cache| cache.tree.leaf_of.len() != scene.lights().len()) {
            return Err(GpuError::Settings("the light cache is of another scene".into()));
        }
        let shines = scene.lights().iter().any(|light| light.intensity > 0.0);
        let (emitters, memory) = match cache {
            Some(cache) => (EmitterTree::unused(gpu)?, LightCacheMemory::new(gpu, cache)?),
            None => (EmitterTree::new(gpu, scene)?, LightCacheMemory::none(gpu)?),
        };
        let stratum = u64::MAX / u64::from(emitter_samples);
        let tree = match cache {
            Some(_) => memory.tree(),
            None => emitters.bindings(),
        };
        Ok(Self {
            asked: Direct {
                tree: emitters.shape(),
                sample: 0,
                emitter_samples,
                bsdf_samples,
                groups: u32::from(shines) + scene.directions() + u32::from(scene.has_surroundings()),
                stratum: [stratum as u32, (stratum >> 32) as u32],
                has_tree: u32::from(shines),
                padding: 0,
            },
            samples: SampleKernel::new(
                (gpu, scene),
                "direct",
                (program, &[("BY_CACHE", cache.is_some())]),
                &TABLES,
                gpu.bind(&[&tree, &memory.octrees(), &memory.bindings()]),
            )?,
            emitters,
        })
    }

    /// Bytes on the device, without those of the scene, the tree and the cache.
    pub fn bytes(&self) -> u64 {
        self.samples.bytes()
    }

    /// The tree; of one light if a cache selects.
    pub fn tree(&self) -> &GpuLightTree {
        &self.emitters.tree
    }

    /// How long each dispatch of the tree's building ran; nothing where the device has no clock.
    pub fn build_times(&self) -> &[PassTime] {
        &self.emitters.build_times
    }
}

impl GpuMethod for GpuDirectLight<'_> {
    fn size(&self) -> [u32; 2] {
        self.samples.scene.size()
    }

    /// Sample number `frame` of each pixel.
    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        let asked = Direct {
            sample: frame,
            ..self.asked
        };
        self.samples.begin(seed, [2, u32::MAX], asked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::{Likeness, faulty, gpu, planted, under_the_sky};
    use lightshed_film::PixelEstimator;
    use lightshed_integrator::{DirectLight, DirectLightOptions, LightChoosing, LightSelection};
    use lightshed_scene::glam::Vec3;
    use lightshed_scene::{EmitterDescription, Rgb, Scene, SceneDescription, builtin};
    use lightshed_testkit::MeanTest;

    const SIDE: u32 = 40;

    /// A Cornell box with points, a spot and two directions besides its lamp.
    fn with_points() -> SceneDescription {
        let mut scene = builtin::cornell();
        let direction = |x, irradiance| EmitterDescription::Directional {
            direction: Vec3::new(x, 0.3, -1.0),
            irradiance,
        };
        let point = |x| EmitterDescription::Point {
            position: Vec3::new(x, 0.1, 0.6),
            intensity: Rgb::new(0.3, 0.2, 0.1),
        };
        scene.emitters = vec![
            point(0.3),
            point(-0.6),
            EmitterDescription::Spot {
                position: Vec3::new(0.0, 0.0, 0.5),
                direction: Vec3::new(0.2, 0.5, -1.0),
                intensity: Rgb::ONE,
                beam_width: 0.5,
                cutoff_angle: 1.0,
            },
            direction(0.4, Rgb::new(2.0, 0.0, 0.0)),
            direction(-0.4, Rgb::new(0.0, 0.0, 1.0)),
        ];
        scene
    }

    /// The share of the pixels whose sample is the host's within 10⁻⁴, over some samples, and
    /// the mean difference of the others.
    fn like_the_host(
        gpu: &Gpu,
        scene: &Scene,
        selection: &LightSelection<'_>,
        samples: u32,
        program: &str,
    ) -> (f64, MeanTest) {
        let on_device = GpuScene::new(gpu, scene).expect("it is flat");
        let cache = selection.flat_cache();
        let mut device = GpuDirectLight::of_program(gpu, &on_device, [samples, 1], cache.as_ref(), program)
            .expect("the program is sound");
        assert_eq!(
            device.bytes(),
            GpuDirectLight::BYTES_PER_PIXEL * u64::from(SIDE * SIDE)
        );
        let host = DirectLight::new(
            scene,
            selection,
            DirectLightOptions {
                emitter_samples: samples,
                bsdf_samples: 1,
                bsdf_samples_where_diffuse: false,
                ..DirectLightOptions::default()
            },
        )
        .expect("samples are few");
        let mut likeness = Likeness::default();
        for index in 0..4 {
            let (found, _) = device.frame(index, 7).expect("the device answers");
            for (i, value) in (0..).zip(found) {
                let truth = host.sample(i % SIDE, i / SIDE, index, 7);
                likeness.push(value.into(), truth);
            }
        }
        (likeness.share(), likeness.differences)
    }

    /// The share of samples that equal the host's, which is at least `least`; the others differ by
    /// nothing in the mean.
    fn agrees(gpu: &Gpu, name: &str, least: f64, (alike, differences): (f64, MeanTest)) -> f64 {
        println!(
            "{name}: {alike:.4} alike, differences {:.2e} ({:.2e})",
            differences.mean(),
            differences.standard_error()
        );
        let expected = if gpu.is_exact() { least } else { 0.9 * least };
        assert!(alike >= expected, "{name}");
        assert!(differences.test_against(0.0, 1e-4).is_ok(), "{name}");
        alike
    }

    /// With the host's numbers come the host's values, and where triangles are near, their
    /// expectation (a z-test at 1e-4 on the mean of the differences).
    #[test]
    fn samples_are_the_hosts_but_for_near_triangles() {
        let Some(gpu) = gpu() else { return };
        let scenes = [
            (
                "cornell-glossy",
                under_the_sky(builtin::cornell_glossy()),
                3,
                0.99,
            ),
            ("many-lights", builtin::many_lights(), 4, 0.97),
            ("points", with_points(), 4, 0.99),
            // More than a quarter of what is seen is near a lamp.
            ("glossy-bounce", builtin::glossy_bounce(), 3, 0.65),
        ];
        let faults = [
            // Strata are left out: every sample asks the same part of the tree.
            ["vec2u(i, 0u)", "vec2u(0u, 0u)"],
            // The tree's probability is forgotten where the BSDF's sample is weighed.
            [
                "* finite_probability();\n                pdf",
                "* 0.0;\n                pdf",
            ],
            // The first direction is taken for all of them.
            ["settings.first_direction + direction", "settings.first_direction"],
        ];
        for (name, mut description, samples, least) in scenes {
            (description.settings.width, description.settings.height) = (SIDE, SIDE);
            let scene = Scene::new(&description).expect("built-in scenes are sound");
            let tree = LightSelection::new(&scene, LightChoosing::Tree).expect("there are lights");
            let alike = agrees(
                gpu,
                name,
                least,
                like_the_host(gpu, &scene, &tree, samples, DIRECT),
            );
            let faults = match name {
                "cornell-glossy" => &faults[..2],
                "points" => &faults[2..],
                _ => &[],
            };
            for &fault in planted(gpu, faults) {
                let program = faulty(DIRECT, fault);
                let (fewer, differences) = like_the_host(gpu, &scene, &tree, samples, &program);
                println!("  {fewer:.4} alike, {:.2e}", differences.mean());
                assert!(
                    fewer < alike - 0.01 || differences.test_against(0.0, 1e-4).is_err(),
                    "{fault:?}"
                );
            }
        }
    }

    /// The same with emitters selected by a trained cache: with its lists in the warehouse, with
    /// what training has left of it elsewhere. Faults are noticed: a probability of the lists
    /// without their share, one of the tree instead, regions taken from another octree.
    #[test]
    fn samples_by_caches_are_the_hosts() {
        let Some(gpu) = gpu() else { return };
        let scenes = [
            ("warehouse", builtin::warehouse(), 3, 0.99),
            (
                "cornell-glossy",
                under_the_sky(builtin::cornell_glossy()),
                3,
                0.99,
            ),
            ("many-lights", builtin::many_lights(), 4, 0.97),
        ];
        let faults = [
            ["(1.0 - head.share)", "1.0"],
            ["cache.list_root, position", "cache.factor_root, position"],
        ];
        for (name, mut description, samples, least) in scenes {
            (description.settings.width, description.settings.height) = (SIDE, SIDE);
            let scene = Scene::new(&description).expect("built-in scenes are sound");
            // Lists need more paths to prove their worth than such an image has.
            (description.settings.width, description.settings.height) = (4 * SIDE, 4 * SIDE);
            let larger = Scene::new(&description).expect("built-in scenes are sound");
            let trained = LightSelection::trained(&larger, LightChoosing::Vlc).expect("there are lights");
            let flat = trained.flat_cache().expect("it is a cache or a part of one");
            let has_lists = flat.list_root != FlatLightCache::NONE;
            println!("{name}, lists: {has_lists}");
            let found = like_the_host(gpu, &scene, &trained, samples, DIRECT);
            let alike = agrees(gpu, name, least, found);
            if name != "warehouse" {
                continue;
            }
            assert!(has_lists);
            for &fault in planted(gpu, &faults) {
                let program = faulty(DIRECT, fault);
                let (fewer, differences) = like_the_host(gpu, &scene, &trained, samples, &program);
                println!("  {fewer:.4}, {:.2e}", differences.mean());
                assert!(fewer < alike - 0.01, "{fault:?}");
            }
        }
    }
}
