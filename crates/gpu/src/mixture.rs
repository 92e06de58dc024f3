//! Markov chain mixtures on the device.

use crate::bindings::{BoundGroup, MixtureBindings, SceneBindings, Table};
use crate::programs::MIXTURE;
use crate::scene::Settings;
use crate::{BegunFrame, Buffer, Gpu, GpuError, GpuMethod, GpuScene, Kernel};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::guiding::{MarkovOptions, MarkovState};
use lightshed_integrator::resampling::Exchange;
use lightshed_integrator::{MixtureOptions, MixtureSets};

/// Light at the surfaces that the camera sees, by Markov chain mixtures: the estimator of
/// `lightshed_integrator::Mixture` with spatial sets of one step, for a camera at rest. One kernel
/// renders a frame; chains trade places in the memory of a workgroup.
///
/// It has its own random numbers, and its lobes and weights are `f32`: images agree with the host's
/// in expectation.
pub struct GpuMixture<'a> {
    gpu: &'a Gpu,
    scene: &'a GpuScene,
    options: MixtureOptions,
    bound: BoundGroup,
    kernel: Kernel,
    settings: Buffer,
    image: Buffer,
    /// Of this frame and the one before, by turns.
    states: [Buffer; 2],
}

/// What the program binds.
pub(crate) const TABLES: [Table; 2] = [SceneBindings::TABLE, MixtureBindings::TABLE];

/// `MarkovOptions` as shaders read them.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct ChainRow {
    prior_count: f32,
    prior_cosine: f32,
    prior_normal: f32,
    decay: f32,
    count_limit: u32,
    survival: f32,
    balanced: u32,
    padding: u32,
}

/// What is asked of a frame.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Asked {
    chains: ChainRow,
    frame: u32,
    places: u32,
    across: u32,
    neighbours: u32,
    window: f32,
    defensive: f32,
    far: f32,
    by_emitters: u32,
    padding: [u32; 4],
}

// As in the shader; held to it by a test.
const _: () = assert!(size_of::<Asked>() == 80 && size_of::<MarkovState>() == 32);

/// Threads of a workgroup: places of the largest tile.
const MOST: u32 = 32;
/// Bytes of a pixel of the image, and of a state.
const IMAGE_BYTES: u64 = 16;
const STATE_BYTES: u64 = size_of::<MarkovState>() as u64;
/// Extents of the scene that stand for an infinite distance.
const FAR: f32 = 1e5;

impl From<&MarkovOptions> for ChainRow {
    fn from(options: &MarkovOptions) -> Self {
        Self {
            prior_count: options.prior_count,
            prior_cosine: options.prior_cosine,
            prior_normal: options.prior_normal,
            decay: options.decay,
            count_limit: options.count_limit,
            survival: options.survival,
            balanced: u32::from(options.balanced),
            padding: 0,
        }
    }
}

impl<'a> GpuMixture<'a> {
    /// Bytes on the device for each pixel: the image, and two states.
    pub const BYTES_PER_PIXEL: u64 = IMAGE_BYTES + 2 * STATE_BYTES;

    /// With these options and the scene's longest path, of at least two edges.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for options that the host refuses, temporal sets, several steps of a
    /// frame or states that do not trade places; [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn new(gpu: &'a Gpu, scene: &'a GpuScene, options: MixtureOptions) -> Result<Self, GpuError> {
        check_sets(&options)?;
        Self::of_program(gpu, scene, options, MIXTURE)
    }

    fn of_program(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        options: MixtureOptions,
        program: &str,
    ) -> Result<Self, GpuError> {
        scene.refuse_media()?;
        scene.refuse_part_of_a_sky("mcmm")?;
        let pixels = scene.size().map(u64::from).iter().product::<u64>();
        let states = || gpu.zeros("states", STATE_BYTES * pixels);
        let constants = scene.constants(program, &[]);
        Ok(Self {
            gpu,
            scene,
            options,
            bound: gpu.bind(&[&scene.bindings()]),
            kernel: gpu.kernel_of_tables("mixture", program, "frame", &TABLES, &constants)?,
            settings: gpu.zeros("settings", size_of::<Settings>() as u64)?,
            image: gpu.zeros("image", IMAGE_BYTES * pixels)?,
            states: [states()?, states()?],
        })
    }

    /// Bytes on the device, the scene's apart.
    pub fn bytes(&self) -> u64 {
        self.image.bytes() + self.states.iter().map(Buffer::bytes).sum::<u64>()
    }

    /// The states after the frame of this number, which was the last, row by row.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`].
    pub fn states(&self, frame: u32) -> Result<Vec<MarkovState>, GpuError> {
        let pixels = self.scene.size().iter().product::<u32>();
        self.gpu.read(&self.states[frame as usize % 2], pixels as usize)
    }

    /// Workgroups for all tiles, in rows.
    fn groups(&self) -> [u32; 3] {
        const ROW: u32 = 1 << 15;
        let [across, down] = tile(self.options.size);
        let [width, height] = self.scene.size();
        let tiles = width.div_ceil(across) * height.div_ceil(down);
        let groups = tiles.div_ceil(MOST / self.options.size);
        [groups.min(ROW), groups.div_ceil(ROW), 1]
    }
}

/// Width and height of a tile of so many places, a power of two.
fn tile(places: u32) -> [u32; 2] {
    let bits = places.ilog2();
    [1 << bits.div_ceil(2), 1 << (bits / 2)]
}

/// What of a method the device knows.
pub(crate) fn check_sets(options: &MixtureOptions) -> Result<(), GpuError> {
    let refused = |why: &'static str| Err(GpuError::Settings(why.into()));
    if let Err(error) = options.check() {
        return Err(GpuError::Settings(error.to_string().into()));
    }
    if options.sets != MixtureSets::Spatial || options.steps_of_frame() != 1 || options.states != 1 {
        return refused("the device knows spatial sets of one step and one state a frame");
    }
    if options.exchange != Exchange::Traded {
        return refused("on the device chains always trade places");
    }
    Ok(())
}

impl GpuMethod for GpuMixture<'_> {
    fn size(&self) -> [u32; 2] {
        self.scene.size()
    }

    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        let render = self.scene.settings();
        let settings =
            self.scene
                .kernel_settings(seed, render.max_depth.unwrap_or(u32::MAX), render.roulette_depth);
        self.gpu.write(&self.settings, &[settings]);
        let [width, height] = self.size();
        let MixtureOptions {
            chains,
            size,
            samples_emitters,
            ..
        } = self.options;
        let [across, _] = tile(size);
        let asked = Asked {
            chains: ChainRow::from(&chains),
            frame,
            places: size,
            across,
            neighbours: chains.neighbours,
            window: chains.window_of(height),
            defensive: chains.defensive_share,
            far: FAR * self.scene.extent().max(f32::MIN_POSITIVE),
            by_emitters: u32::from(samples_emitters),
            padding: [0; 4],
        };
        let asked = self.gpu.buffer("mixture", &[asked])?;
        let [even, odd] = &self.states;
        let [states, states_before] = if frame.is_multiple_of(2) {
            [even, odd]
        } else {
            [odd, even]
        };
        let method = self.gpu.bind(&[&MixtureBindings {
            settings: &self.settings,
            image: &self.image,
            states_before,
            states,
            mixture: &asked,
        }]);
        let mut work = self.gpu.timed_work();
        if frame == 0 {
            // A chain of frames starts with empty states.
            work.clear(states_before, states_before.bytes());
        }
        work.dispatch_bound(&self.kernel, &[&self.bound, &method], self.groups());
        Ok(work.begin_image(&self.image, [width, height]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::{Chains, faulty, gpu, host_means, planted};
    use lightshed_film::{FrameMethod, PixelEstimator};
    use lightshed_integrator::{Mixture, PathTracer};
    use lightshed_scene::{EmitterDescription, EmittersByPower, Rgb, Scene, SceneDescription, builtin};
    use lightshed_testkit::MeanTest;
    use std::sync::atomic::AtomicBool;

    /// No multiple of a tile's sides.
    const SIZE: [u32; 2] = [37, 30];
    /// Frames of a chain: all count, the first of which have no lobes.
    const FRAMES: u32 = 6;

    fn sized(mut description: SceneDescription, size: [u32; 2], depth: u32) -> Scene {
        [description.settings.width, description.settings.height] = size;
        description.settings.max_depth = Some(depth);
        Scene::new(&description).expect("built-in scenes are sound")
    }

    fn paths(scene: &Scene, depth: Option<u32>) -> PathTracer<'_, EmittersByPower<'_>> {
        let roulette = scene.settings().roulette_depth;
        PathTracer::new(scene, scene.emitters_by_power()).with_depths(depth, roulette)
    }

    /// What the host's paths find behind the first surface.
    fn truth(scene: &Scene, images: u32) -> MeanTest {
        let settings = scene.settings();
        let (all, seen) = (paths(scene, settings.max_depth), paths(scene, Some(1)));
        host_means([settings.width, settings.height], images, |x, y, index| {
            all.sample(x, y, index, 5) - seen.sample(x, y, index, 5)
        })
    }

    fn options(size: u32, samples_emitters: bool, balanced: bool) -> MixtureOptions {
        let mut options = MixtureOptions::default();
        (options.size, options.samples_emitters) = (size, samples_emitters);
        options.chains.balanced = balanced;
        options
    }

    fn under_points(mut scene: SceneDescription) -> SceneDescription {
        scene.emitters.push(EmitterDescription::Point {
            position: glam::Vec3::new(0.3, 0.1, 0.6),
            intensity: Rgb::new(0.3, 0.2, 0.1),
        });
        scene.emitters.push(EmitterDescription::Constant {
            radiance: Rgb::new(0.1, 0.2, 0.4),
        });
        scene
    }

    /// Means of chains of frames are those of paths on the host, by z-tests at 10⁻⁴: direct light
    /// and longer paths, diffuse and glossy surfaces and glass, large and small sets, with and
    /// without emitter samples, greedy and balanced chains.
    #[test]
    fn images_have_the_expectation_of_paths() {
        let Some(gpu) = gpu() else { return };
        for (name, description, depth, choices) in [
            (
                "cornell",
                builtin::cornell(),
                2,
                vec![options(32, false, false), options(4, true, true)],
            ),
            (
                "cornell-glossy",
                under_points(builtin::cornell_glossy()),
                3,
                vec![options(32, true, false), options(8, false, true)],
            ),
            (
                "glass",
                crate::tests::paths::glass(),
                5,
                vec![options(16, true, false)],
            ),
        ] {
            let scene = sized(description, SIZE, depth);
            let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
            let truth = truth(&scene, 800);
            // A path's own camera ray has the same random numbers: what it sees emitting is taken
            // off exactly.
            let seen = paths(&scene, Some(1));
            let chains = Chains {
                counted: 0..FRAMES,
                known: &|[x, y], frame, seed| seen.sample(x, y, frame, seed),
            };
            for options in choices {
                let mut method = GpuMixture::new(gpu, &on_device, options).expect("options are sound");
                assert_eq!(
                    method.bytes(),
                    GpuMixture::BYTES_PER_PIXEL * u64::from(SIZE[0] * SIZE[1])
                );
                assert!(chains.agree(name, &mut method, 60, &truth), "{name}, {options:?}");
            }
        }
    }

    /// Chains that keep their places, densities that count twice, and lobes that count with another
    /// share than they are sampled with are noticed: in an image of two tiles, whose pixels see
    /// quite different things.
    #[test]
    fn faults_are_noticed() {
        let Some(gpu) = gpu() else { return };
        let faults = [
            [
                "= given[tile.first + places[tile.first + own]]",
                "= given[tile.first + own]",
            ],
            ["return sum / f32(count);", "return 2.0 * sum / f32(count);"],
            ["own + (1.0 - defensive) * ", "own + "],
        ];
        let scene = sized(builtin::cornell_glossy(), [8, 8], 2);
        let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
        let truth = truth(&scene, 20_000);
        let seen = paths(&scene, Some(1));
        let chains = Chains {
            counted: 1..12,
            known: &|[x, y], frame, seed| seen.sample(x, y, frame, seed),
        };
        let method = |program: &str| {
            GpuMixture::of_program(gpu, &on_device, options(32, false, false), program)
                .expect("the program is sound")
        };
        assert!(chains.agree("sound", &mut method(MIXTURE), 600, &truth));
        for &fault in planted(gpu, &faults) {
            let program = faulty(MIXTURE, fault);
            assert!(
                chains.differ(&mut method(&program), 1200, &truth),
                "{fault:?} is not noticed"
            );
        }
    }

    /// Mean squared difference of two frames in turn, from frame `first` on, that `render` makes.
    fn spread(frames: u32, first: u32, mut render: impl FnMut(u32) -> Vec<Rgb>) -> f64 {
        let images: Vec<Vec<Rgb>> = (0..frames).map(&mut render).collect();
        let pairs = images[first as usize..].chunks_exact(2);
        let of = |pair: &[Vec<Rgb>]| -> f64 {
            let values = pair[0].iter().zip(&pair[1]);
            values.map(|(a, b)| f64::from((*a - *b).length_squared())).sum()
        };
        pairs.map(of).sum::<f64>() / f64::from((frames - first) / 2)
    }

    /// Chains learn as the host's do: after some frames the variance is the host's, within a
    /// quarter. States that are forgotten after each frame leave more.
    #[test]
    fn chains_learn_as_on_the_host() {
        let Some(gpu) = gpu() else { return };
        const FRAMES: u32 = 72;
        let scene = sized(builtin::cornell(), [64, 64], 2);
        let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
        let options = options(32, false, false);
        let on_host = {
            let mut host =
                Mixture::new(&scene, scene.emitters_by_power(), options).expect("options are sound");
            spread(FRAMES, 8, |frame| {
                let mut image = vec![Rgb::ZERO; 64 * 64];
                host.render_frame(frame, 3, &mut image, &AtomicBool::new(false));
                image
            })
        };
        let on_device = |program: &str| {
            let mut method =
                GpuMixture::of_program(gpu, &on_device, options, program).expect("the program is sound");
            let spread = spread(FRAMES, 8, |frame| {
                let (image, _) = method.frame(frame, 3).expect("the device answers");
                image.into_iter().map(Rgb::from).collect()
            });
            (spread, method.states(FRAMES - 1).expect("the device answers"))
        };
        let (sound, states) = on_device(MIXTURE);
        println!("{sound} on the device, {on_host} on the host");
        assert!((sound / on_host - 1.0).abs() < 0.25);
        for &fault in planted(gpu, &[["states[pixel] = ", "states[pixel].count = 0u; // "]]) {
            let (forgetful, _) = on_device(&faulty(MIXTURE, fault));
            println!("  {forgetful} without memory");
            assert!(forgetful / on_host > 1.25);
        }
        let valid = states.iter().filter(|state| state.is_valid()).count();
        assert!(2 * valid > states.len(), "{valid} of {}", states.len());
    }

    #[test]
    fn other_sets_are_refused() {
        let refused = |change: fn(&mut MixtureOptions)| {
            let mut options = MixtureOptions::default();
            change(&mut options);
            match check_sets(&options) {
                Err(GpuError::Settings(why)) => why.into_owned(),
                _ => String::new(),
            }
        };
        assert_eq!(refused(|_| ()), "");
        assert!(refused(|options| options.sets = MixtureSets::Temporal).contains("spatial"));
        assert!(refused(|options| options.steps = 2).contains("one step"));
        assert!(refused(|options| options.exchange = Exchange::Kept).contains("trade"));
        assert!(refused(|options| options.size = 3).contains("sets of 3"));
    }
}
