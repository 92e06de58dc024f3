//! Frames for stills: tiles share most paths, and what they cannot share is resampled.

use super::split::{OfflineSplit, split_of};
use super::{RestirPt, RestirPtError, RestirPtOptions};
use crate::emitter_sampler::EmitterSampler;
use crate::{CameraMotion, PathReuse, SceneWorld};
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_scene::Rgb;
use std::sync::atomic::AtomicBool;

/// ReSTIR path tracing for stills: what a pixel's neighbours can use by a connection is shared in
/// tiles ([`PathReuse`]), and what they cannot is resampled with the hybrid shift ([`RestirPt`]).
///
/// A frame is the mean of some frames of tiles plus one of resampled paths. Tiles weigh the trees
/// of all their pixels by the balance heuristic: the sum over what a reservoir would choose from
/// (Lin 2022 eq. 6.47), in lanes. But they connect `x₁` of one pixel with `x₂` of another, so paths
/// of three edges and more that a delta lobe scatters at `x₁` or `x₂` belong to their own pixel
/// only. Where these matter, tiles leave them out and reservoirs have nothing else. The hybrid
/// shift replays delta lobes and connects behind them.
///
/// Which of them are resampled is a function of the scene ([`OfflineSplit`]), chosen before the
/// first frame by numbers that no frame uses. Every frame is unbiased, and frames are independent.
pub struct RestirPtOffline<'a, S: EmitterSampler, E: EmitterSampler> {
    tiles: PathReuse<'a, S>,
    rest: Option<RestirPt<'a, E>>,
    split: OfflineSplit,
    /// A part of a frame.
    found: Vec<Rgb>,
}

/// A seed of its own, so that tiles and resampled paths share no numbers.
const OTHER_SEED: u64 = 0x7265_6d61_696e_6465;

impl<'a, S: EmitterSampler + Send, E: EmitterSampler> RestirPtOffline<'a, S, E> {
    /// With these tiles, and resampled paths of the same scene. Of the options their trees, rounds
    /// and direct light are replaced. Choosing the split takes four to six frames of tiles in a
    /// small image, or in an eighth of a large one, if the scene has delta lobes.
    ///
    /// # Errors
    /// [`RestirPtError`] for options out of range.
    pub fn new(
        mut tiles: PathReuse<'a, S>,
        world: &'a SceneWorld<'a, E>,
        options: RestirPtOptions,
    ) -> Result<Self, RestirPtError> {
        let split = split_of(&mut tiles, world);
        Self::with_split(tiles, world, options, split)
    }

    /// The same with a split that is given.
    ///
    /// # Errors
    /// [`RestirPtError`] for options out of range.
    pub fn with_split(
        mut tiles: PathReuse<'a, S>,
        world: &'a SceneWorld<'a, E>,
        options: RestirPtOptions,
        split: OfflineSplit,
    ) -> Result<Self, RestirPtError> {
        tiles.leave_out(split.resampled);
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
            tiles,
            rest,
            split,
            found: Vec::new(),
        })
    }

    /// What is resampled, and how often tiles share.
    pub fn split(&self) -> OfflineSplit {
        self.split
    }
}

impl<S: EmitterSampler + Send, E: EmitterSampler> FrameMethod for RestirPtOffline<'_, S, E> {
    fn size(&self) -> [u32; 2] {
        self.tiles.size()
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let count = self.split.tile_frames.max(1);
        let mut counts = RayCounts::default();
        image.fill(Rgb::ZERO);
        self.found.resize(image.len(), Rgb::ZERO);
        // Numbers are stratified over all frames of tiles.
        for number in 0..count {
            let frame = frame.wrapping_mul(count).wrapping_add(number);
            counts += self.tiles.render_frame(frame, seed, &mut self.found, cancel)?;
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
