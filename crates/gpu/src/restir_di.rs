//! ReSTIR DI on the device.

use crate::bindings::{LightTreeBindings, ReuseBindings, SceneBindings, Table, WorldBindings};
use crate::emitter_tree::{EmitterTree, TreeShape};
use crate::programs::{RESTIR_DI, RESTIR_DI_WORLD};
use crate::restir_frames::{MOST_NEIGHBOURS, RestirFrames, ReuseFrame, ReuseProgram, bytes_per_pixel};
use crate::world::{WorldProgram, check_world};
use crate::{BegunFrame, Gpu, GpuError, GpuMethod, GpuScene};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::RestirDiSettings;

/// Direct light by reservoirs that pixels and frames share: the estimator of
/// `lightshed_integrator::RestirDi`, unbiased, with one round of spatial reuse, reservoirs in cells
/// of space, or both, and a camera at rest.
///
/// It has its own random numbers, and merges are in `f32`: images agree with the host's in
/// expectation.
pub struct GpuRestirDi<'a> {
    frames: RestirFrames<'a>,
    settings: RestirDiSettings,
    tree: TreeShape,
}

/// What the program binds.
pub(crate) const TABLES: [Table; 3] = [
    SceneBindings::TABLE,
    LightTreeBindings::TABLE,
    ReuseBindings::TABLE,
];

/// What the program of its cells binds.
pub(crate) const WORLD_TABLES: [Table; 4] = [
    SceneBindings::TABLE,
    LightTreeBindings::TABLE,
    ReuseBindings::TABLE,
    WorldBindings::TABLE,
];

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

impl<'a> GpuRestirDi<'a> {
    /// Bytes on the device for each pixel: reservoirs and what is seen, of this frame and the one
    /// before, and the image. Cells of space take more.
    pub const BYTES_PER_PIXEL: u64 = bytes_per_pixel(LIGHT_BYTES);

    /// With [`RestirDiSettings::UNBIASED`].
    ///
    /// # Errors
    ///
    /// [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn new(gpu: &'a Gpu, scene: &'a GpuScene) -> Result<Self, GpuError> {
        Self::with_settings(gpu, scene, RestirDiSettings::UNBIASED)
    }

    /// With other settings: unbiased, with one round of at most 8 neighbours; or with at most 8
    /// reservoirs of cells of space in place of both reuse among neighbours and in time, or before.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for others; [`GpuError::Refused`], [`GpuError::TooLarge`].
    pub fn with_settings(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        settings: RestirDiSettings,
    ) -> Result<Self, GpuError> {
        Self::of_programs(gpu, scene, settings, false, [RESTIR_DI, RESTIR_DI_WORLD])
    }

    /// With candidates that a light tree selects for the point, as those of
    /// `lightshed_integrator::RestirDi::with_sampler` by `LightSelection` with
    /// `LightChoosing::Tree`; the device builds the tree.
    ///
    /// # Errors
    ///
    /// As [`GpuRestirDi::with_settings`]; [`GpuError::Lost`].
    pub fn with_tree(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        settings: RestirDiSettings,
    ) -> Result<Self, GpuError> {
        Self::of_programs(gpu, scene, settings, true, [RESTIR_DI, RESTIR_DI_WORLD])
    }

    /// With these texts of the program and of that of its cells.
    pub(crate) fn of_programs(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        settings: RestirDiSettings,
        by_tree: bool,
        [program, world]: [&str; 2],
    ) -> Result<Self, GpuError> {
        scene.refuse_media()?;
        scene.refuse_part_of_a_sky("restir-di")?;
        scene.refuse_deltas("restir-di")?;
        scene.refuse_dielectrics("restir-di")?;
        check(&settings)?;
        let emitters = if by_tree {
            EmitterTree::new(gpu, scene)?
        } else {
            EmitterTree::unused(gpu)?
        };
        let constants = &[("BY_TREE", by_tree && emitters.shines)];
        let program = ReuseProgram {
            name: "restir-di",
            wgsl: program,
            constants,
            reservoir_bytes: LIGHT_BYTES,
            tables: &TABLES,
            besides: Some(&emitters.bindings()),
            world: settings.world.map(|reuse| WorldProgram {
                reuse,
                wgsl: world,
                tables: &WORLD_TABLES,
                constants,
                pixel_cap: settings.confidence_cap,
                shades: settings.spatial_rounds == 0,
            }),
        };
        Ok(Self {
            frames: RestirFrames::new(gpu, scene, &program)?,
            settings,
            tree: emitters.shape(),
        })
    }

    /// The table of cells of space, and what pixels see in frame `number`.
    #[cfg(test)]
    pub(crate) fn cells(&self, number: u32) -> Option<(&crate::cell_table::GpuCellTable, &crate::Buffer)> {
        self.frames.cells(number)
    }

    /// Bytes on the device, the scene's and the tree's apart.
    pub fn bytes(&self) -> u64 {
        self.frames.bytes()
    }
}

/// The part of the host's settings that the device supports.
fn check(settings: &RestirDiSettings) -> Result<(), GpuError> {
    let refused = |why: &'static str| Err(GpuError::Settings(why.into()));
    if let Err(error) = settings.check() {
        return Err(GpuError::Settings(error.to_string().into()));
    }
    let least_rounds = u32::from(settings.world.is_none());
    if settings.biased || !(least_rounds..=1).contains(&settings.spatial_rounds) {
        return refused("only one unbiased round of spatial reuse is known, or none with cells of space");
    }
    if settings.pairs.is_some() || settings.mutations > 0 {
        return refused("neither pairs nor steps of Markov chains are known");
    }
    if let Some(world) = &settings.world {
        check_world(world)?;
    }
    if settings.stratified {
        return refused("candidates are independent");
    }
    if settings.neighbours > MOST_NEIGHBOURS {
        return refused("at most 8 neighbours are possible");
    }
    Ok(())
}

impl GpuMethod for GpuRestirDi<'_> {
    fn size(&self) -> [u32; 2] {
        self.frames.size()
    }

    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        let Self { settings, tree, .. } = *self;
        let asked = ReuseFrame {
            number: frame,
            seed,
            depths: [2, u32::MAX],
            temporal: settings.temporal_reuse,
            rounds: settings.spatial_rounds,
        };
        self.frames.begin(asked, |_| Frame {
            number: frame,
            candidates: settings.emitter_candidates,
            neighbours: settings.neighbours,
            radius: settings.radius_pixels,
            confidence_cap: settings.confidence_cap.min(f32::MAX),
            padding: [0; 3],
            tree,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::{Chains, faulty, gpu, host_means, planted, under_the_sky};
    use lightshed_film::PixelEstimator;
    use lightshed_integrator::{PathTracer, WorldReuse};
    use lightshed_scene::{Scene, SceneDescription, builtin};
    use lightshed_testkit::MeanTest;

    const SIDE: u32 = 32;
    /// Frames of a chain, of which the last counts.
    const FRAMES: u32 = 4;

    fn method<'a>(gpu: &'a Gpu, scene: &'a GpuScene, by_tree: bool, program: &str) -> GpuRestirDi<'a> {
        let settings = RestirDiSettings::UNBIASED;
        let method = GpuRestirDi::of_programs(gpu, scene, settings, by_tree, [program, RESTIR_DI_WORLD])
            .expect("the program is sound");
        assert_eq!(
            method.bytes(),
            GpuRestirDi::BYTES_PER_PIXEL * u64::from(SIDE * SIDE)
        );
        method
    }

    /// The host's reflected direct light, by paths of two edges.
    fn by_paths(scene: &Scene, images: u32) -> MeanTest {
        let [two, one] = [2, 1].map(|depth| {
            PathTracer::new(scene, scene.emitters_by_power()).with_depths(Some(depth), u32::MAX)
        });
        host_means([SIDE; 2], images, |x, y, index| {
            two.sample(x, y, index, 5) - one.sample(x, y, index, 5)
        })
    }

    fn scenes() -> Vec<(&'static str, SceneDescription)> {
        vec![
            ("cornell", builtin::cornell()),
            ("cornell-glossy", under_the_sky(builtin::cornell_glossy())),
            ("many-lights", builtin::many_lights()),
        ]
    }

    /// What the device does not do is refused, not ignored.
    #[test]
    fn other_settings_are_refused() {
        assert!(check(&RestirDiSettings::UNBIASED).is_ok());
        let changes: [fn(&mut RestirDiSettings); 6] = [
            |settings| settings.stratified = true,
            |settings| settings.pairs = Some(16),
            |settings| settings.mutations = 1,
            |settings| {
                let mut reuse = WorldReuse::default();
                reuse.contributors = 17;
                settings.world = Some(reuse);
            },
            |settings| settings.biased = true,
            |settings| settings.neighbours = MOST_NEIGHBOURS + 1,
        ];
        for (number, change) in changes.iter().enumerate() {
            let mut settings = RestirDiSettings::UNBIASED;
            change(&mut settings);
            assert!(
                matches!(check(&settings), Err(GpuError::Settings(_))),
                "change {number}"
            );
        }
    }

    /// Means of images by z-tests at 1e-4 each. Programs with a fault in a merge are noticed.
    #[test]
    fn images_have_the_expectation_of_direct_light() {
        let Some(gpu) = gpu() else { return };
        let faults = [
            // A neighbour is trusted as if it could have produced everything.
            ["* fraction;", "* 0.0;"],
            // History merges without being asked about my sample.
            ["density = there.p_hat * there.jacobian;", "density = 0.0;"],
            // The tree's choices count as if they were made twice as often.
            ["pdf_emitter = probability /", "pdf_emitter = 2.0 * probability /"],
        ];
        for (name, mut description) in scenes() {
            (description.settings.width, description.settings.height) = (SIDE, SIDE);
            let scene = Scene::new(&description).expect("built-in scenes are sound");
            let truth = by_paths(&scene, 1000);
            let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
            // A path's own camera ray has the same random numbers: what it sees emitting is taken
            // off exactly.
            let seen = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(1), u32::MAX);
            let chains = Chains {
                counted: FRAMES - 1..FRAMES,
                known: &|[x, y], frame, seed| seen.sample(x, y, frame, seed),
            };
            let is_noticed = |by_tree: bool, fault: [&str; 2]| {
                let program = faulty(RESTIR_DI, fault);
                chains.differ(&mut method(gpu, &on_device, by_tree, &program), 20, &truth)
            };
            for by_tree in [false, true] {
                let mut sound = method(gpu, &on_device, by_tree, RESTIR_DI);
                assert!(
                    chains.agree(name, &mut sound, 40, &truth),
                    "{name}, tree {by_tree}"
                );
            }
            let faults = match name {
                "cornell" => &faults[..2],
                "many-lights" => &faults[2..],
                _ => &[],
            };
            for &fault in planted(gpu, faults) {
                assert!(is_noticed(name == "many-lights", fault), "{fault:?}");
            }
        }
    }
}
