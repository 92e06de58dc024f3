//! Frames for stills: pixels share most paths, and what they cannot share is resampled.

use super::split::{OfflineSplit, split_of};
use super::{RestirPt, RestirPtError, RestirPtOptions};
use crate::emitter_sampler::EmitterSampler;
use crate::{CameraMotion, PathReuse, SceneWorld};
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_scene::Rgb;
use std::sync::atomic::AtomicBool;

/// ReSTIR path tracing for stills: what a pixel's neighbours can use by a connection is shared
/// ([`PathReuse`]), and what they cannot is resampled with the hybrid shift ([`RestirPt`]).
///
/// A frame is the mean of some frames of path reuse plus one of resampled paths. Path reuse weighs
/// the trees of many pixels by the balance heuristic: the sum over what a reservoir would choose
/// from (Lin 2022 eq. 6.47), in lanes. But it connects `x₁` of one pixel with `x₂` of another, so
/// paths of three edges and more that a delta lobe scatters at `x₁` or `x₂` belong to their own
/// pixel only. Where these matter, path reuse leaves them out and reservoirs have nothing else. The
/// hybrid shift replays delta lobes and connects behind them.
///
/// Which of them are resampled is a function of the scene ([`OfflineSplit`]), chosen before the
/// first frame by numbers that no frame uses. Every frame is unbiased, and frames are independent.
pub struct RestirPtOffline<'a, S: EmitterSampler, E: EmitterSampler> {
    reuse: PathReuse<'a, S>,
    rest: Option<RestirPt<'a, E>>,
    split: OfflineSplit,
    /// A part of a frame.
    found: Vec<Rgb>,
}

/// A seed of its own, so that path reuse and resampled paths share no numbers.
const OTHER_SEED: u64 = 0x7265_6d61_696e_6465;

impl<'a, S: EmitterSampler + Send, E: EmitterSampler> RestirPtOffline<'a, S, E> {
    /// With this path reuse, and resampled paths of the same scene. Of the options, trees, rounds
    /// and direct light are replaced. Choosing the split takes four to six frames of path reuse of
    /// a small image, or of an eighth of a large one, if the scene has delta lobes.
    ///
    /// # Errors
    /// [`RestirPtError`] for options out of range.
    pub fn new(
        mut reuse: PathReuse<'a, S>,
        world: &'a SceneWorld<'a, E>,
        options: RestirPtOptions,
    ) -> Result<Self, RestirPtError> {
        let split = split_of(&mut reuse, world);
        Self::with_split(reuse, world, options, split)
    }

    /// The same with a split that is given.
    ///
    /// # Errors
    /// [`RestirPtError`] for options out of range.
    pub fn with_split(
        mut reuse: PathReuse<'a, S>,
        world: &'a SceneWorld<'a, E>,
        options: RestirPtOptions,
        split: OfflineSplit,
    ) -> Result<Self, RestirPtError> {
        reuse.leave_out(split.resampled);
        let rest = match split.resampled {
            Some(part) => {
                let options = RestirPtOptions {
                    candidates: split.candidates,
                    direct_samples: 0,
                    visible_emission: false,
                    ..options
                };
                Some(RestirPt::new(world, options, CameraMotion::STILL)?.of_part(part))
            }
            None => None,
        };
        Ok(Self {
            reuse,
            rest,
            split,
            found: Vec::new(),
        })
    }

    /// With several samples of short paths where these vary, in an image of `frames` frames, as
    /// [`PathReuse::with_short_paths`]. A frame counts as all of its frames of path reuse.
    #[must_use]
    pub fn with_short_paths(mut self, frames: u32) -> Self {
        let frames = frames.saturating_mul(self.reuse_frames());
        self.reuse = self.reuse.with_short_paths(frames);
        self
    }

    /// Frames of path reuse in a frame.
    fn reuse_frames(&self) -> u32 {
        self.split.reuse_frames.max(1)
    }

    /// What is resampled, and how many frames share.
    pub fn split(&self) -> OfflineSplit {
        self.split
    }
}

impl<S: EmitterSampler + Send, E: EmitterSampler> FrameMethod for RestirPtOffline<'_, S, E> {
    fn size(&self) -> [u32; 2] {
        self.reuse.size()
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let count = self.reuse_frames();
        let mut counts = RayCounts::default();
        image.fill(Rgb::ZERO);
        self.found.resize(image.len(), Rgb::ZERO);
        // Numbers are stratified over all frames of path reuse.
        for number in 0..count {
            let frame = frame.wrapping_mul(count).wrapping_add(number);
            counts += self.reuse.render_frame(frame, seed, &mut self.found, cancel)?;
            add(image, &self.found, 1.0 / count as f32);
        }
        if let Some(rest) = &mut self.rest {
            counts += rest.render_frame(frame, seed ^ OTHER_SEED, &mut self.found, cancel)?;
            add(image, &self.found, 1.0);
        }
        Some(counts)
    }
}

/// Adds a part of a frame with a weight.
fn add(image: &mut [Rgb], found: &[Rgb], weight: f32) {
    for (value, found) in image.iter_mut().zip(found) {
        *value += *found * weight;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PathTracer;
    use crate::restir::pt::PathMapping;
    use lightshed_film::{PixelEstimator, SampleId};
    use lightshed_scene::{
        ColorTexture, EmittersByPower, FloatTexture, Geometry, Material, Scene, ShapeDescription,
        SphereGeometry, builtin,
    };
    use lightshed_shift::PathPart;
    use lightshed_testkit::{MeanTest, check_faults};

    const SIDE: u32 = 16;
    const EARLY: OfflineSplit = OfflineSplit {
        resampled: Some(PathPart::EarlySpecular),
        reuse_frames: 2,
        candidates: 2,
    };
    const FIRST: OfflineSplit = OfflineSplit {
        resampled: Some(PathPart::FirstSpecular),
        ..EARLY
    };

    type Method<'a> = RestirPtOffline<'a, EmittersByPower<'a>, EmittersByPower<'a>>;

    /// What is done wrong.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Fault {
        /// What is resampled is left in path reuse.
        Twice,
        /// What is left out of path reuse is not resampled.
        Never,
        /// Path reuse leaves out one vertex less than is resampled.
        LessLeftOut,
        /// Path reuse leaves out one vertex more.
        MoreLeftOut,
        /// Resampled frames have direct light, too.
        DirectTwice,
    }

    /// A Cornell box whose ceiling is the lamp, so that noise is low, with spheres of mirror, of
    /// glass, and of a mirror under half of a diffuse coat.
    fn scene(max_depth: u32) -> Scene {
        let mut description = builtin::cornell();
        (description.settings.width, description.settings.height) = (SIDE, SIDE);
        description.settings.max_depth = Some(max_depth);
        let (white, first) = (
            ColorTexture::Constant(Rgb::splat(0.9)),
            description.materials.len() as u32,
        );
        let mirror = Material::Mirror {
            reflectance: white.clone(),
        };
        let glass = Material::Dielectric {
            eta: 1.5,
            roughness: None,
            specular_reflectance: white.clone(),
            specular_transmittance: white.clone(),
        };
        let coated = Material::Blend {
            weight: FloatTexture::Constant(0.5),
            first: Box::new(mirror.clone()),
            second: Box::new(Material::Diffuse { reflectance: white }),
        };
        description.materials.extend([mirror, glass, coated]);
        for shape in &mut description.shapes {
            shape.emission = (shape.name == "ceiling").then_some(Rgb::ONE);
        }
        let spheres = [
            ([-0.35, -0.3, 0.2], 0.55),
            ([0.45, -0.5, 0.6], 0.35),
            ([0.4, 0.45, 0.2], 0.35),
        ];
        for (number, (center, radius)) in spheres.into_iter().enumerate() {
            description.shapes.push(ShapeDescription {
                name: format!("sphere {number}"),
                geometry: Geometry::Sphere(SphereGeometry {
                    center: center.into(),
                    radius,
                    flip_normals: false,
                }),
                material: first + number as u32,
                emission: None,
            });
        }
        Scene::new(&description).unwrap()
    }

    fn method<'a>(world: &'a SceneWorld<'a>, split: OfflineSplit, fault: Option<Fault>) -> Method<'a> {
        let scene = world.scene();
        let reuse = PathReuse::new(scene, scene.emitters_by_power());
        let options = RestirPtOptions::offline(PathMapping::Hybrid);
        let mut method = RestirPtOffline::with_split(reuse, world, options, split).unwrap();
        match fault {
            Some(Fault::Twice) => method.reuse.leave_out(None),
            Some(Fault::Never) => method.rest = None,
            Some(Fault::LessLeftOut) => method.reuse.leave_out(Some(PathPart::FirstSpecular)),
            Some(Fault::MoreLeftOut) => method.reuse.leave_out(Some(PathPart::EarlySpecular)),
            Some(Fault::DirectTwice) => {
                if let Some(rest) = &mut method.rest {
                    rest.options.direct_samples = 1;
                }
            }
            None => (),
        }
        method
    }

    /// Sums over quarters and the whole over `count` images, by channel.
    fn means(count: u32, mut image: impl FnMut(u32, &mut [Rgb])) -> Vec<MeanTest> {
        let mut means = vec![MeanTest::new(); 5 * 3];
        let mut pixels = vec![Rgb::ZERO; (SIDE * SIDE) as usize];
        for number in 0..count {
            image(number, &mut pixels);
            let mut sums = [[0.0f64; 3]; 5];
            for (index, value) in pixels.iter().enumerate() {
                let (x, y) = (index as u32 % SIDE, index as u32 / SIDE);
                let quarter = (2 * (y * 2 / SIDE) + x * 2 / SIDE) as usize;
                for part in [quarter, 4] {
                    for (sum, value) in sums[part].iter_mut().zip(value.to_array()) {
                        *sum += f64::from(value);
                    }
                }
            }
            for (mean, sum) in means.iter_mut().zip(sums.as_flattened()) {
                mean.push(*sum);
            }
        }
        means
    }

    fn paths(scene: &Scene, images: u32) -> Vec<MeanTest> {
        let tracer = PathTracer::new(scene, scene.emitters_by_power());
        means(images, |number, pixels| {
            for (index, value) in (0..).zip(pixels) {
                let ids: [SampleId; 16] = std::array::from_fn(|sample| SampleId {
                    x: index % SIDE,
                    y: index / SIDE,
                    index: number * 16 + sample as u32,
                });
                let mut found = [Rgb::ZERO; 16];
                tracer.sample_many(&ids, 77, &mut found);
                *value = found.into_iter().sum::<Rgb>() / 16.0;
            }
        })
    }

    /// Frames have the mean of paths.
    fn agree(
        scene: &Scene,
        truth: &[MeanTest],
        (split, seeds): (OfflineSplit, u32),
        fault: Option<Fault>,
    ) -> Result<(), String> {
        let world = SceneWorld::new(scene, scene.emitters_by_power());
        let mut method = method(&world, split, fault);
        let found = means(seeds, |seed, pixels| {
            method
                .render_frame(seed % 3, u64::from(seed), pixels, &AtomicBool::new(false))
                .unwrap();
        });
        for (number, (found, truth)) in found.iter().zip(truth).enumerate() {
            found
                .test_equal(truth, 1e-5)
                .map_err(|error| format!("{split:?}, mean {number}: {error}"))?;
        }
        Ok(())
    }

    /// Direct light, one bounce and more, with any split: each path is counted once.
    #[test]
    fn parts_make_up_all_paths() {
        for (max_depth, images) in [(1, 20), (2, 60), (3, 120), (6, 150)] {
            let scene = scene(max_depth);
            let truth = paths(&scene, images);
            for split in [OfflineSplit::ALL_SHARED, FIRST, EARLY] {
                agree(&scene, &truth, (split, 2 * images), None).unwrap();
            }
        }
    }

    #[test]
    fn parts_counted_twice_or_never_are_seen() {
        for max_depth in [3, 6] {
            let scene = scene(max_depth);
            let truth = paths(&scene, 200);
            let of = |split| {
                let (scene, truth) = (&scene, &truth);
                move |fault| agree(scene, truth, (split, 400), fault)
            };
            let always = [Fault::Twice, Fault::Never, Fault::DirectTwice];
            check_faults(&[&always[..], &[Fault::LessLeftOut]].concat(), of(EARLY)).unwrap();
            check_faults(&[&always[..], &[Fault::MoreLeftOut]].concat(), of(FIRST)).unwrap();
        }
    }
}
