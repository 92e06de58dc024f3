//! Direct light beside resampled longer paths.

use crate::emitter_sampler::EmitterSampler;
use crate::path::FrameOfPaths;
use crate::reuse_frames::{FrameView, in_batches};
use crate::visible_emission::VisibleFrames;
use crate::{PathTracer, SceneWorld};
use lightshed_film::{MAX_BATCH, PixelEstimator, RayCounts, RayTally, SampleId};
use lightshed_scene::Rgb;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Most edges of a path that are direct light: that from the camera, and that to the emitter.
pub const DIRECT_EDGES: u32 = 2;

/// A seed of its own, so that paths of the frame and of direct light share no numbers.
const OTHER_SEED: u64 = 0x6469_7265_6374_2e2e;

/// Direct light that is path traced beside resampled longer paths, and emission in view.
#[derive(Default)]
pub struct DirectLight {
    pub visible: VisibleFrames,
    /// Of the path tracer.
    tally: Arc<RayTally>,
}

impl DirectLight {
    /// Adds the mean of `samples` paths of up to two edges a pixel, each with a camera ray of its
    /// own. A camera ray, an emitter sample and a BSDF sample cost a small part of a frame's trees
    /// and shifts, and their errors at lamps and at edges of surfaces, of textures and of shadows
    /// are those that reuse behind a single camera ray does not reduce. Numbers are stratified over
    /// all frames.
    pub fn add<E: EmitterSampler>(
        &self,
        world: &SceneWorld<'_, E>,
        view: FrameView<'_>,
        samples: u32,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) {
        let settings = world.scene().settings();
        let longest = settings
            .max_depth
            .map_or(DIRECT_EDGES, |depth| depth.min(DIRECT_EDGES));
        let tracer = PathTracer::new(world.scene(), world.sampler())
            .with_depths(Some(longest), u32::MAX)
            .with_points(view.numbers.points())
            .in_frame(FrameOfPaths {
                camera: view.camera.clone(),
                visible: self.visible.shared(),
                tally: Arc::clone(&self.tally),
            });
        let (width, seed) = (settings.width, view.numbers.seed() ^ OTHER_SEED);
        in_batches(image.chunks_mut(MAX_BATCH), cancel, |first, values| {
            for sample in 0..samples {
                let ids: [SampleId; MAX_BATCH] = std::array::from_fn(|place| {
                    let pixel = (first + place) as u32;
                    SampleId {
                        x: pixel % width,
                        y: pixel / width,
                        index: view.number.wrapping_mul(samples).wrapping_add(sample),
                    }
                });
                let mut found = [Rgb::ZERO; MAX_BATCH];
                let count = values.len();
                tracer.sample_many(&ids[..count], seed, &mut found[..count]);
                for (value, found) in values.iter_mut().zip(found) {
                    *value += found / samples as f32;
                }
            }
        });
    }

    /// The rays of a frame: its `camera` rays, those of `world` and those of direct light.
    pub fn take_counts<E: EmitterSampler>(&mut self, world: &SceneWorld<'_, E>, camera: u64) -> RayCounts {
        let mut counts = world.take_counts();
        counts.camera += camera;
        // Nothing else holds the tally between frames.
        counts += Arc::get_mut(&mut self.tally)
            .map(RayTally::take)
            .unwrap_or_default();
        counts
    }
}
