//! Frames of a still image whose pixels share nothing: each pixel is finished before the next, and
//! only its reservoirs are kept.

use super::evaluation::Evaluation;
use super::pixel::{VolumePixel, VolumeReservoir};
use super::{Pass, RestirVolume, View, bounded, shift_of};
use lightshed_film::{MAX_BATCH, RayKind};
use lightshed_resampling::{IdentityShift, Input, MergeRule, Mis};
use lightshed_sampling::parallel;
use lightshed_scene::Rgb;
use lightshed_shift::FollowPaths;
use std::sync::atomic::{AtomicBool, Ordering};

impl RestirVolume<'_> {
    /// The whole frame; false if cancelled. A path has the target of the walk that found it,
    /// because no other target is needed.
    pub(super) fn still_frame(&mut self, view: View<'_>, image: &mut [Rgb], cancel: &AtomicBool) -> bool {
        let reservoirs = self.options.reservoirs as usize;
        let mut held = std::mem::take(&mut self.held);
        held.resize(self.extent().len() * reservoirs, VolumeReservoir::empty(0.0));
        let evaluation = self.evaluation(view.frame.number);
        let chunks = image
            .chunks_mut(MAX_BATCH)
            .zip(held.chunks_mut(MAX_BATCH * reservoirs));
        parallel::for_each(chunks, |chunk, (image, held)| {
            let pixel = &mut VolumePixel::default();
            if cancel.load(Ordering::Relaxed) {
                return;
            }
            self.tally.add(RayKind::Camera, image.len());
            for (place, (value, held)) in image.iter_mut().zip(held.chunks_mut(reservoirs)).enumerate() {
                let index = chunk * MAX_BATCH + place;
                *value = self.look_at(view, &evaluation, index, pixel);
                let shift = shift_of(view, index);
                for (reservoir, held) in (0..).zip(held) {
                    let view = View { reservoir, ..view };
                    let fresh = self.walk_from(view, &evaluation, index, pixel, shift);
                    self.keep(view, index, pixel, fresh, held);
                    *value += self.shown(view, &evaluation, index, pixel, held);
                }
            }
        });
        self.held = held;
        !cancel.load(Ordering::Relaxed)
    }

    /// Merges what a pixel held with what it has found.
    fn keep(
        &self,
        view: View<'_>,
        index: usize,
        pixel: &VolumePixel,
        fresh: VolumeReservoir,
        held: &mut VolumeReservoir,
    ) {
        if view.frame.number == 0 || !self.options.temporal_reuse {
            *held = fresh;
            return;
        }
        let inputs = [Input::canonical(pixel, &fresh), Input::neighbour(pixel, held)];
        let choose = &mut view.rng(index, Pass::Temporal);
        let rule = MergeRule::new(IdentityShift).with_mis(Mis::Balance);
        let rule = rule.with_confidence_cap(self.options.still_confidence_cap);
        // Every fresh reservoir has confidence, so nothing fails.
        *held = rule
            .merge(pixel, &inputs, choose)
            .map_or(fresh, |merged| merged.reservoir);
    }

    /// `F(Y) W` of a reservoir, as its share in the pixel.
    ///
    /// The estimate of `F` from the first time that a path is shown is used as long as the
    /// reservoir holds the path: which paths stay does not depend on it, so it has the mean `F(Y)`
    /// in every frame.
    fn shown(
        &self,
        view: View<'_>,
        evaluation: &Evaluation<'_>,
        index: usize,
        pixel: &VolumePixel,
        held: &mut VolumeReservoir,
    ) -> Rgb {
        let Some((path, weight)) = self.shared(held) else {
            return Rgb::ZERO;
        };
        if let Some(light) = path.light {
            return bounded(light.as_dvec3() * weight);
        }
        let mut rng = view.rng(index, Pass::Shade);
        let light = bounded(evaluation.estimate(pixel, path, &mut rng));
        let path = std::mem::replace(held, VolumeReservoir::empty(0.0));
        *held = path.map(|path| path.shown_by(light));
        bounded(light.as_dvec3() * weight)
    }
}
