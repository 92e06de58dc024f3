//! Direct light by stochastic lightcuts, on the device.

use crate::bindings::{BoundGroup, LightTreeBindings, LightcutBindings, SceneBindings, Table};
use crate::emitter_tree::{EmitterTree, TreeShape};
use crate::path_tracer::groups_of;
use crate::programs::LIGHTCUTS;
use crate::scene::Settings;
use crate::{BegunFrame, Buffer, Gpu, GpuError, GpuLightTree, GpuMethod, GpuScene, Kernel};
use bytemuck::{Pod, Zeroable};
use lightshed_integrator::{
    CutTree, LightcutError, LightcutOptions, MAX_CUT_BLOCK, MAX_DIRECT_SAMPLES, MAX_SUBTREES,
};

/// Emission and light that is scattered once, with cuts through a light tree that blocks of pixels
/// share (Lin 2022 §4.3.3): the estimator of `lightshed_integrator::Lightcuts` with
/// [`CutTree::Perfect`].
///
/// Random numbers, cuts and selections are the host's, so a pixel's value equals the host's to
/// rounding. An exception are near triangles, which the host samples by solid angle and the device
/// by area: those pixels agree in expectation.
pub struct GpuLightcuts<'a> {
    gpu: &'a Gpu,
    scene: &'a GpuScene,
    options: LightcutOptions,
    emitters: EmitterTree,
    /// The scene, and the tree.
    groups: [BoundGroup; 2],
    kernels: [Kernel; 3],
    settings: Buffer,
    image: Buffer,
    cuts: Buffer,
    lengths: Buffer,
    hits: Buffer,
    blocks: [u32; 2],
}

/// What the program binds.
pub(crate) const TABLES: [Table; 3] = [
    SceneBindings::TABLE,
    LightTreeBindings::TABLE,
    LightcutBindings::TABLE,
];

/// As the shader reads it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Asked {
    tree: TreeShape,
    frame: u32,
    subtrees: u32,
    block: u32,
    interleaving: u32,
    bsdf_samples: u32,
    has_tree: u32,
    columns: u32,
    blocks: u32,
}

// As in the shader; a test compares them.
const _: () = assert!(size_of::<Asked>() == 48);

/// Bytes of a pixel of the image, and of a camera ray's hit.
const IMAGE_BYTES: u64 = 16;
const HIT_BYTES: u64 = 16;
/// Bytes of a subtree of a cut, and of a cut's length.
const SUBTREE_BYTES: u64 = 16;
const LENGTH_BYTES: u64 = 4;

impl<'a> GpuLightcuts<'a> {
    /// Bytes on the device for each pixel: the image and what is seen. A block of pixels has a
    /// [cut](Self::bytes_per_block), too.
    pub const BYTES_PER_PIXEL: u64 = IMAGE_BYTES + HIT_BYTES;

    /// Bytes on the device for each block of pixels that share a cut of `subtrees`.
    pub const fn bytes_per_block(subtrees: u32) -> u64 {
        SUBTREE_BYTES * subtrees as u64 + LENGTH_BYTES
    }

    /// Builds the light tree.
    ///
    /// # Errors
    ///
    /// [`GpuError::Settings`] for options that the host refuses, other trees than
    /// [`CutTree::Perfect`] or more than [`MAX_DIRECT_SAMPLES`] samples of the BSDF;
    /// [`GpuError::Refused`], [`GpuError::TooLarge`], [`GpuError::Lost`].
    pub fn new(gpu: &'a Gpu, scene: &'a GpuScene, options: LightcutOptions) -> Result<Self, GpuError> {
        Self::of_program(gpu, scene, options, LIGHTCUTS)
    }

    fn of_program(
        gpu: &'a Gpu,
        scene: &'a GpuScene,
        options: LightcutOptions,
        program: &str,
    ) -> Result<Self, GpuError> {
        scene.refuse_media()?;
        scene.refuse_part_of_a_sky("lightcuts")?;
        scene.refuse_deltas("lightcuts")?;
        scene.refuse_dielectrics("lightcuts")?;
        check(&options)?;
        let emitters = EmitterTree::new(gpu, scene)?;
        let constants = scene.constants(program, &[]);
        let kernel = |entry: &str| {
            gpu.kernel_of_tables(&format!("lightcuts {entry}"), program, entry, &TABLES, &constants)
        };
        let size = scene.size();
        let pixels = size.map(u64::from).iter().product::<u64>();
        let blocks = size.map(|side| side.div_ceil(options.block));
        let block_count = blocks.map(u64::from).iter().product::<u64>();
        Ok(Self {
            gpu,
            scene,
            options,
            groups: [gpu.bind(&[&scene.bindings()]), gpu.bind(&[&emitters.bindings()])],
            emitters,
            kernels: Gpu::at_once(["see", "choose", "shade"], kernel)?,
            settings: gpu.zeros("settings", size_of::<Settings>() as u64)?,
            image: gpu.zeros("image", IMAGE_BYTES * pixels)?,
            cuts: gpu.zeros("cuts", SUBTREE_BYTES * u64::from(options.subtrees) * block_count)?,
            lengths: gpu.zeros("lengths of cuts", LENGTH_BYTES * block_count)?,
            hits: gpu.zeros("hits", HIT_BYTES * pixels)?,
            blocks,
        })
    }

    /// Bytes on the device, the scene's and the tree's apart.
    pub fn bytes(&self) -> u64 {
        [&self.image, &self.cuts, &self.lengths, &self.hits]
            .map(Buffer::bytes)
            .iter()
            .sum()
    }

    /// The tree.
    pub fn tree(&self) -> &GpuLightTree {
        &self.emitters.tree
    }
}

fn check(options: &LightcutOptions) -> Result<(), GpuError> {
    let LightcutOptions {
        subtrees,
        block,
        interleaving,
        bsdf_samples,
        tree,
        rebuild: _,
    } = *options;
    let refused = |error: LightcutError| Err(GpuError::Settings(error.to_string().into()));
    if !(1..=MAX_SUBTREES).contains(&subtrees) {
        return refused(LightcutError::Subtrees(subtrees));
    }
    if !(1..=MAX_CUT_BLOCK).contains(&block) {
        return refused(LightcutError::Block(block));
    }
    if interleaving == 0 || block % interleaving != 0 {
        return refused(LightcutError::Interleaving(interleaving));
    }
    if bsdf_samples > MAX_DIRECT_SAMPLES {
        return Err(GpuError::Settings(
            format!("samples of the BSDF must be at most {MAX_DIRECT_SAMPLES}").into(),
        ));
    }
    if tree != CutTree::Perfect {
        return Err(GpuError::Settings("only a perfect tree can be cut".into()));
    }
    Ok(())
}

impl GpuMethod for GpuLightcuts<'_> {
    fn size(&self) -> [u32; 2] {
        self.scene.size()
    }

    fn begin(&mut self, frame: u32, seed: u64) -> Result<BegunFrame, GpuError> {
        let settings = self.scene.kernel_settings(seed, 2, u32::MAX);
        self.gpu.write(&self.settings, &[settings]);
        let [columns, rows] = self.blocks;
        let shines = self.emitters.shines;
        let asked = Asked {
            tree: self.emitters.shape(),
            frame,
            subtrees: self.options.subtrees,
            block: self.options.block,
            interleaving: self.options.interleaving,
            bsdf_samples: self.options.bsdf_samples,
            has_tree: u32::from(shines),
            columns,
            blocks: columns * rows,
        };
        let asked = self.gpu.buffer("lightcuts", &[asked])?;
        let method = self.gpu.bind(&[&LightcutBindings {
            settings: &self.settings,
            image: &self.image,
            asked: &asked,
            subtrees: &self.cuts,
            lengths: &self.lengths,
            hits: &self.hits,
        }]);
        let [of_scene, of_tree] = &self.groups;
        let bound = [of_scene, of_tree, &method];
        let [width, height] = self.size();
        let mut work = self.gpu.timed_work();
        if self.options.rebuild {
            self.emitters.rebuild(&mut work);
        }
        let [see, choose, shade] = &self.kernels;
        work.dispatch_bound(see, &bound, groups_of(width * height));
        if shines {
            work.dispatch_bound(choose, &bound, groups_of(columns * rows));
        }
        work.dispatch_bound(shade, &bound, groups_of(width * height));
        Ok(work.begin_image(&self.image, self.size()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::{Likeness, faulty, gpu, planted};
    use lightshed_film::FrameMethod;
    use lightshed_integrator::Lightcuts;
    use lightshed_scene::{EmitterDescription, Rgb, Scene, builtin};
    use lightshed_testkit::MeanTest;
    use std::sync::atomic::AtomicBool;

    /// No multiple of a block's side.
    const SIZE: [u32; 2] = [44, 37];

    /// The share of the pixels whose value is the host's within 10⁻⁴, over some frames, and the
    /// mean difference of the others.
    fn like_the_host(gpu: &Gpu, scene: &Scene, options: LightcutOptions, program: &str) -> (f64, MeanTest) {
        let on_device = GpuScene::new(gpu, scene).expect("it is flat");
        let mut device =
            GpuLightcuts::of_program(gpu, &on_device, options, program).expect("the program is sound");
        let pixels = SIZE[0] * SIZE[1];
        let blocks = SIZE[0].div_ceil(options.block) * SIZE[1].div_ceil(options.block);
        assert_eq!(
            device.bytes(),
            GpuLightcuts::BYTES_PER_PIXEL * u64::from(pixels)
                + GpuLightcuts::bytes_per_block(options.subtrees) * u64::from(blocks)
        );
        let mut host = Lightcuts::new(scene, options).expect("options are sound");
        let mut likeness = Likeness::default();
        let mut truth = vec![Rgb::ZERO; pixels as usize];
        for frame in 0..4 {
            let (found, _) = device.frame(frame, 7).expect("the device answers");
            host.render_frame(frame, 7, &mut truth, &AtomicBool::new(false));
            for (value, &truth) in found.into_iter().zip(&truth) {
                likeness.push(value.into(), truth);
            }
        }
        (likeness.share(), likeness.differences)
    }

    /// With the host's numbers come the host's values, and where triangles are near, their
    /// expectation (a z-test at 1e-4 on the mean of the differences).
    #[test]
    fn frames_are_the_hosts_but_for_near_triangles() {
        let Some(gpu) = gpu() else { return };
        let mut lit_from_around = builtin::cornell_glossy();
        lit_from_around.emitters.push(EmitterDescription::Constant {
            radiance: Rgb::new(0.3, 0.4, 0.6),
        });
        let usual = LightcutOptions::default();
        let scenes = [
            ("cornell-glossy", lit_from_around, usual, 0.99),
            ("glossy-bounce", builtin::glossy_bounce(), usual, 0.65),
            (
                "many-lights",
                builtin::many_lights(),
                LightcutOptions {
                    subtrees: 21,
                    interleaving: 2,
                    bsdf_samples: 2,
                    ..usual
                },
                0.95,
            ),
            (
                "many-lights",
                builtin::many_lights(),
                LightcutOptions {
                    rebuild: true,
                    ..usual
                },
                0.95,
            ),
        ];
        let faults = [
            // Another pixel decides.
            ["(start + i) % count", "(start + i + 1u) % count"],
            // Interleaved subtrees count once.
            ["1.0 / f32(all_parts)", "1.0"],
            // A part ends one too early.
            [
                "(part + 1u) * length / all_parts",
                "((part + 1u) * length - 1u) / all_parts",
            ],
        ];
        for (name, mut description, options, least) in scenes {
            [description.settings.width, description.settings.height] = SIZE;
            let scene = Scene::new(&description).expect("built-in scenes are sound");
            let (alike, differences) = like_the_host(gpu, &scene, options, LIGHTCUTS);
            println!(
                "{name}: {alike:.4} alike, differences {:.2e} ({:.2e})",
                differences.mean(),
                differences.standard_error()
            );
            let expected = if gpu.is_exact() { least } else { 0.9 * least };
            assert!(alike >= expected, "{name}");
            assert!(differences.test_against(0.0, 1e-4).is_ok(), "{name}");
            if options.interleaving == 1 {
                continue;
            }
            for &fault in planted(gpu, &faults) {
                let program = faulty(LIGHTCUTS, fault);
                let (fewer, differences) = like_the_host(gpu, &scene, options, &program);
                println!("  {fewer:.4} alike, {:.2e}", differences.mean());
                assert!(
                    fewer < alike - 0.01 || differences.test_against(0.0, 1e-4).is_err(),
                    "{fault:?}"
                );
            }
        }
    }

    #[test]
    fn impossible_options_are_refused() {
        let Some(gpu) = gpu() else { return };
        let scene = Scene::new(&builtin::cornell()).expect("built-in scenes are sound");
        let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
        let usual = LightcutOptions::default();
        for options in [
            LightcutOptions { subtrees: 0, ..usual },
            LightcutOptions { block: 17, ..usual },
            LightcutOptions {
                interleaving: 3,
                ..usual
            },
            LightcutOptions {
                bsdf_samples: MAX_DIRECT_SAMPLES + 1,
                ..usual
            },
            LightcutOptions {
                tree: CutTree::Bvh,
                ..usual
            },
        ] {
            let refused = GpuLightcuts::new(gpu, &on_device, options).err();
            assert!(
                matches!(refused, Some(GpuError::Settings(_))),
                "{options:?}: {refused:?}"
            );
        }
    }
}
