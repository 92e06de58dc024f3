//! ReSTIR PT on the device.

use crate::bindings::{ReuseBindings, SceneBindings, Table, WorldBindings};
use crate::programs::{RESTIR_PT, RESTIR_PT_WORLD};
use crate::restir_frames::{MOST_NEIGHBOURS, RestirFrames, ReuseFrame, ReuseProgram, bytes_per_pixel};
use crate::world::{WorldProgram, check_world};
use crate::{BegunFrame, Gpu, GpuError, GpuMethod, GpuScene};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::{Neighbourhood, PathMapping, RestirPtOptions};
use lightshed_shift::Connectability;

/// ReSTIR path tracing: the estimator of `lightshed_integrator::RestirPt` for a camera at rest,
/// with the same walks, shifts and MIS weights.
///
/// It has its own random numbers, and merges are in `f32`: images agree with the host's in
/// expectation. Paths have at most 126 edges, confidences are whole numbers up to 127, and the
/// direction behind a reconnection vertex is one of 2³², so that a path with its weight and its
/// confidence takes 64 bytes.
pub struct GpuRestirPt<'a> {
    frames: RestirFrames<'a>,
    options: RestirPtOptions,
    neighbours: u32,
    radius: f32,
    rules: Rules,
    /// Longest path, and the first edge at which roulette may end one.
    depths: [u32; 2],
}

/// What the program binds.
pub(crate) const TABLES: [Table; 2] = [SceneBindings::TABLE, ReuseBindings::TABLE];

/// What the program of its cells binds.
pub(crate) const WORLD_TABLES: [Table; 3] =
    [SceneBindings::TABLE, ReuseBindings::TABLE, WorldBindings::TABLE];

/// A [`Connectability`] as shaders read it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Rules {
    min_roughness: f32,
    min_distance: f32,
    reach: u32,
    padding: u32,
}

impl From<Connectability> for Rules {
    fn from(rules: Connectability) -> Self {
        Self {
            min_roughness: rules.min_roughness(),
            min_distance: rules.min_distance(),
            // None, the first pair, any pair.
            reach: u32::from(rules.reaches(2)) + u32::from(rules.reaches(3)),
            padding: 0,
        }
    }
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Frame {
    rules: Rules,
    number: u32,
    candidates: u32,
    round: u32,
    shades: u32,
    neighbours: u32,
    radius: f32,
    confidence_cap: f32,
    padding: u32,
}

/// Bytes of a pixel's reservoir.
pub(crate) const RESERVOIR_BYTES: u64 = 64;
/// Longest path that a reservoir holds, in edges.
const LONGEST_PATH: u32 = 126;

impl<'a> GpuRestirPt<'a> {
    /// Bytes on the device for each pixel: two reservoirs, what is seen in this frame and in the
    /// one before, and the image. Cells of space take more.
    pub const BYTES_PER_PIXEL: u64 = bytes_per_pixel(RESERVOIR_BYTES);

    /// With [`RestirPtOptions::real_time`] by the hybrid shift.
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn new(gpu: &'a Gpu, scene: &'a GpuScene) -> Result<Self, GpuError> {
        Self::with_options(gpu, scene, RestirPtOptions::real_time(PathMapping::Hybrid))
    }

    /// With other options: paths that start at a surface point, direct light among them, and at
    /// most 8 neighbours in a disk or reservoirs of cells of space. Numbers are independent, and
    /// paths find visible emission, whatever the options say.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for others; [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn with_options(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        options: RestirPtOptions,
    ) -> Result<Self, GpuError> {
        Self::of_programs(gpu, scene, options, [RESTIR_PT, RESTIR_PT_WORLD])
    }

    /// With these texts of the program and of that of its cells.
    pub(crate) fn of_programs(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        options: RestirPtOptions,
        [program, world]: [&str; 2],
    ) -> Result<Self, GpuError> {
        scene.refuse_media()?;
        scene.refuse_part_of_a_sky("restir-pt")?;
        scene.refuse_deltas("restir-pt")?;
        scene.refuse_dielectrics("restir-pt")?;
        let rules = options
            .thresholds(scene.extent(), scene.is_diffuse())
            .map_err(|error| GpuError::Settings(error.to_string().into()))?;
        check(&options)?;
        let (count, radius) = disk(options.neighbourhood)?;
        let program = ReuseProgram {
            name: "restir-pt",
            wgsl: program,
            constants: &[],
            reservoir_bytes: RESERVOIR_BYTES,
            tables: &TABLES,
            besides: None,
            world: options.world.map(|reuse| WorldProgram {
                reuse,
                wgsl: world,
                tables: &WORLD_TABLES,
                constants: &[],
                pixel_cap: options.temporal_cap.unwrap_or(f32::MAX),
                shades: options.rounds == 0,
            }),
        };
        Ok(Self {
            frames: RestirFrames::new(gpu, scene, &program)?,
            options,
            neighbours: if options.rounds == 0 { 0 } else { count },
            radius,
            rules: rules.into(),
            depths: depths_of(scene),
        })
    }

    /// Bytes on the device, the scene's apart.
    pub fn bytes(&self) -> u64 {
        self.frames.bytes()
    }
}

/// Longest path of a scene that reservoirs hold, and the first edge at which roulette may end one.
pub(crate) fn depths_of(scene: &GpuScene) -> [u32; 2] {
    let asked = scene.settings();
    [
        asked.max_depth.unwrap_or(LONGEST_PATH).min(LONGEST_PATH),
        asked.roulette_depth,
    ]
}

/// How many neighbours there are, and within how many pixels.
pub(crate) fn disk(neighbourhood: Neighbourhood) -> Result<(u32, f32), GpuError> {
    let refused = |why: &'static str| Err(GpuError::Settings(why.into()));
    match neighbourhood {
        Neighbourhood::Disk { count, .. } if count > MOST_NEIGHBOURS => {
            refused("at most 8 neighbours are possible")
        }
        Neighbourhood::Disk { radius, .. } if !(radius >= 0.0 && radius.is_finite()) => {
            refused("the radius must be finite")
        }
        Neighbourhood::Disk { radius, count } => Ok((count, radius)),
        Neighbourhood::Window { .. } => refused("neighbours have to lie in a disk"),
    }
}

/// What of the host's options the device knows, neighbours apart.
fn check(options: &RestirPtOptions) -> Result<(), GpuError> {
    let refused = |why: &'static str| Err(GpuError::Settings(why.into()));
    if options.path_starts_at_sensor {
        return refused("paths have to start at a surface point");
    }
    if options.pairs.is_some() || options.direct_samples > 0 {
        return refused("the device knows neither pairs nor samples of direct light beside paths");
    }
    if let Some(world) = &options.world {
        check_world(world)?;
    }
    if options.footprint.is_some() || options.mutations > 0 {
        return refused("the device knows neither footprints nor steps of Markov chains");
    }
    Ok(())
}

impl GpuMethod for GpuRestirPt<'_> {
    fn size(&self) -> [u32; 2] {
        self.frames.size()
    }

    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        let Self {
            options,
            neighbours,
            radius,
            rules,
            depths,
            ..
        } = *self;
        // Without cells the last round shades, which then has no neighbours.
        let rounds = options.rounds.max(u32::from(options.world.is_none()));
        let asked = ReuseFrame {
            number: frame,
            seed,
            depths,
            temporal: options.temporal_cap.is_some(),
            rounds,
        };
        self.frames.begin(asked, |round| Frame {
            rules,
            number: frame,
            candidates: options.candidates,
            round,
            shades: u32::from(round + 1 == rounds),
            neighbours,
            radius,
            confidence_cap: options.temporal_cap.unwrap_or(f32::MAX),
            padding: 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::{Chains, faulty, gpu, host_means, planted, under_the_sky};
    use lightshed_film::PixelEstimator;
    use lightshed_integrator::{PathTracer, WorldReuse};
    use lightshed_scene::{EmitterDescription, Rgb, Scene, SceneDescription, builtin, luminance};
    use lightshed_testkit::MeanTest;

    /// What the device does not do is refused, not ignored.
    #[test]
    fn other_options_are_refused() {
        let usual = RestirPtOptions::real_time(PathMapping::Hybrid);
        assert!(check(&usual).is_ok());
        let changes: [fn(&mut RestirPtOptions); 6] = [
            |options| options.footprint = Some(100.0),
            |options| options.mutations = 1,
            |options| options.pairs = Some(16),
            |options| options.direct_samples = 1,
            |options| options.path_starts_at_sensor = true,
            |options| {
                let mut reuse = WorldReuse::default();
                reuse.reservoirs = 9;
                options.world = Some(reuse);
            },
        ];
        for (number, change) in changes.iter().enumerate() {
            let mut options = usual;
            change(&mut options);
            assert!(
                matches!(check(&options), Err(GpuError::Settings(_))),
                "change {number}"
            );
        }
    }

    const SIDE: u32 = 32;
    /// Frames of a chain.
    const FRAMES: u32 = 4;

    fn method<'a>(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        options: RestirPtOptions,
        program: &str,
    ) -> GpuRestirPt<'a> {
        let method = GpuRestirPt::of_programs(gpu, scene, options, [program, RESTIR_PT_WORLD])
            .expect("the program is sound");
        assert_eq!(
            method.bytes(),
            GpuRestirPt::BYTES_PER_PIXEL * u64::from(SIDE * SIDE)
        );
        method
    }

    /// The host's reflected light.
    fn by_paths(scene: &Scene, images: u32) -> MeanTest {
        let all = PathTracer::new(scene, scene.emitters_by_power());
        let seen = PathTracer::new(scene, scene.emitters_by_power()).with_depths(Some(1), u32::MAX);
        host_means([SIDE; 2], images, |x, y, index| {
            all.sample(x, y, index, 5) - seen.sample(x, y, index, 5)
        })
    }

    fn scenes() -> Vec<(&'static str, SceneDescription, PathMapping)> {
        let mut lit_from_around = builtin::cornell_glossy();
        lit_from_around.emitters.push(EmitterDescription::Constant {
            radiance: Rgb::new(0.3, 0.4, 0.6),
        });
        vec![
            (
                "cornell-glossy",
                under_the_sky(builtin::cornell_glossy()),
                PathMapping::Hybrid,
            ),
            ("cornell-glossy", lit_from_around, PathMapping::Reconnection),
        ]
    }

    /// If all frames see the same, a shift is the identity, and merging with history is averaging:
    /// after frame `f` of a single pixel, `W p̂ = (Y_f + c W' p̂') / (1 + c)`, with `Y_f` of the
    /// frame's own candidates, `c = min(f, cap)` the history's confidence and `W' p̂'` its
    /// contribution. This holds for every pixel, whatever was selected. Wrong confidences show at
    /// once, which no mean over images detects.
    #[test]
    fn merging_with_what_is_seen_again_is_averaging() {
        let Some(gpu) = gpu() else { return };
        let mut description = builtin::cornell();
        (description.settings.width, description.settings.height) = (SIDE, SIDE);
        let scene = Scene::new(&description).expect("built-in scenes are sound");
        let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
        // All frames look through the middles of pixels.
        let camera = "package__1restir_pt_domain_block(pixel, package_primaries_CAMERA)";
        assert!(RESTIR_PT.contains(camera));
        let sound = RESTIR_PT.replace(camera, "vec4u(0x80000000u)");
        const CAP: f32 = 2.0;
        let images = |temporal_cap, program: &str| -> Vec<Vec<[f32; 3]>> {
            let options = RestirPtOptions {
                temporal_cap,
                rounds: 0,
                ..RestirPtOptions::real_time(PathMapping::Hybrid)
            };
            let mut method = GpuRestirPt::of_programs(gpu, &on_device, options, [program, RESTIR_PT_WORLD])
                .expect("the program is sound");
            let frames = 0..FRAMES;
            frames
                .map(|frame| method.frame(frame, 11).expect("the device answers").0)
                .collect()
        };
        let brightness = |pixel: [f32; 3]| luminance(Rgb::from(pixel));
        let own = images(None, &sound);
        // The share of pixels that are the average, in the frame where that is fewest.
        let share = |program: &str| -> f64 {
            let merged = images(Some(CAP), program);
            let shares = (1..FRAMES as usize).map(|frame| {
                let c = (frame as f32).min(CAP);
                let alike = (0..own[frame].len()).filter(|&i| {
                    let expected =
                        (brightness(own[frame][i]) + c * brightness(merged[frame - 1][i])) / (1.0 + c);
                    (brightness(merged[frame][i]) - expected).abs() <= 1e-3 * expected.max(1e-3)
                });
                alike.count() as f64 / own[frame].len() as f64
            });
            shares.fold(1.0, f64::min)
        };
        let sound_share = share(&sound);
        println!("{sound_share:.4} of the pixels are averages");
        assert!(sound_share > 0.98);
        let faults = [
            // No cap.
            ["min(confidence, cap)", "min(confidence, 1000.0)"],
            // Confidence is lost.
            ["min(confidence, cap)", "0.5"],
            // History counts as one frame.
            [
                "MergeInput(package_lightshed__1path_sample__1reservoir_confidence(held),",
                "MergeInput(min(package_lightshed__1path_sample__1reservoir_confidence(held), 1.0),",
            ],
        ];
        for &fault in planted(gpu, &faults) {
            let share = share(&faulty(&sound, fault));
            println!("  {share:.4}");
            assert!(share < 0.6, "{fault:?} is not noticed");
        }
    }

    /// Means of images by z-tests at 1e-4 each. Programs with a fault in a merge are noticed.
    ///
    /// A mean over an image cannot detect a Jacobian that is wrong for all pixels alike, because
    /// some pixels lose what others gain: Jacobians are compared with the library's bit for bit.
    #[test]
    fn images_have_the_expectation_of_paths() {
        let Some(gpu) = gpu() else { return };
        let faults = [
            // Neighbours' samples are carried without their Jacobian.
            ["m * weight * image.jacobian", "m * weight"],
            // A neighbour is trusted as if it could have produced everything.
            ["* fraction;", "* 0.0;"],
            // History merges without being asked about my sample.
            ["density = there.p_hat * there.jacobian;", "density = 0.0;"],
        ];
        for (name, mut description, mapping) in scenes() {
            (description.settings.width, description.settings.height) = (SIDE, SIDE);
            let scene = Scene::new(&description).expect("built-in scenes are sound");
            let options = RestirPtOptions::real_time(mapping);
            let truth = by_paths(&scene, 500);
            let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
            // A path's own camera ray has the same random numbers: what it sees emitting is taken
            // off exactly.
            let seen = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(1), u32::MAX);
            let chains = Chains {
                counted: 0..FRAMES,
                known: &|[x, y], frame, seed| seen.sample(x, y, frame, seed),
            };
            let mut sound = method(gpu, &on_device, options, RESTIR_PT);
            assert!(chains.agree(name, &mut sound, 24, &truth), "{name}");
            if mapping == PathMapping::Hybrid {
                continue;
            }
            for &fault in planted(gpu, &faults) {
                let program = faulty(RESTIR_PT, fault);
                let mut planted = method(gpu, &on_device, options, &program);
                assert!(
                    chains.differ(&mut planted, 24, &truth),
                    "{fault:?} is not noticed"
                );
            }
        }
    }
}
