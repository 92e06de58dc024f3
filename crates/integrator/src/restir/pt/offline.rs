//! Frames for stills: tiles share most paths, and what they cannot share is resampled.

use super::{RestirPt, RestirPtError, RestirPtOptions};
use crate::emitter_sampler::EmitterSampler;
use crate::{CameraMotion, PathReuse, SceneWorld};
use lightshed_film::{FrameMethod, RayCounts};
use lightshed_scene::Rgb;
use lightshed_shift::PathPart;
use std::sync::atomic::AtomicBool;

pub struct RestirPtOffline<'a, S: EmitterSampler, E: EmitterSampler> {
    tiles: PathReuse<'a, S>,
    tiles_of_frame: u32,
    rest: Option<RestirPt<'a, E>>,
    found: Vec<Rgb>,
}

/// A seed of its own, so that tiles and resampled paths share no numbers.
const OTHER_SEED: u64 = 0x7265_6d61_696e_6465;

impl<'a, S: EmitterSampler, E: EmitterSampler> RestirPtOffline<'a, S, E> {
    pub fn new(
        tiles: PathReuse<'a, S>,
        world: &'a SceneWorld<'a, E>,
        options: RestirPtOptions,
    ) -> Result<Self, RestirPtError> {
        let get = |name: &str, d: u32| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(d);
        let mut options = RestirPtOptions {
            direct_samples: 0,
            visible_emission: false,
            ..options
        };
        options.candidates = get("H35_TREES", 3);
        options.rounds = get("H35_ROUNDS", 2);
        options.neighbourhood = super::Neighbourhood::Disk { radius: get("H35_RADIUS", 2) as f32, count: get("H35_COUNT", 4) };
        let only = get("H35_ONLY", 0);
        let resampled = get("H35_R", 1) == 1;
        Ok(Self {
            tiles: match resampled {
                true => tiles.without_specular(),
                false => tiles,
            },
            tiles_of_frame: if only == 1 { 0 } else { get("H35_M", 4) },
            rest: match resampled && only != 2 {
                true => Some(RestirPt::new(world, options, CameraMotion::STILL)?.of_part(PathPart::Specular)),
                false => None,
            },
            found: Vec::new(),
        })
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
        let mut counts = RayCounts::default();
        image.fill(Rgb::ZERO);
        self.found.clear();
        self.found.resize(image.len(), Rgb::ZERO);
        for number in 0..self.tiles_of_frame {
            let frame = frame.wrapping_mul(self.tiles_of_frame).wrapping_add(number);
            counts += self.tiles.render_frame(frame, seed, &mut self.found, cancel)?;
            for (value, found) in image.iter_mut().zip(&self.found) {
                *value += *found / self.tiles_of_frame as f32;
            }
        }
        if let Some(rest) = &mut self.rest {
            counts += rest.render_frame(frame, seed ^ OTHER_SEED, &mut self.found, cancel)?;
            for (value, found) in image.iter_mut().zip(&self.found) {
                *value += *found;
            }
        }
        Some(counts)
    }
}
