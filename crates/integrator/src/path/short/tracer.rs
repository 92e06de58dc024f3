//! Traces short paths.

use crate::emitter_sampler::EmitterSampler;
use crate::path::ending::NoEnding;
use crate::path::guide::{DirectionGuide, NoGuide};
use crate::path::numbers::PathWords;
use crate::path::observer::NoObserver;
use crate::path::pixels::Pixels;
use crate::path::transport::Transport;
use crate::visible_emission::VisibleEmission;
use lightshed_film::{MAX_BATCH, RayTally, SampleId};
use lightshed_scene::Rgb;

/// What traces short paths.
pub(crate) struct ShortTracer<'t, 'a, S, G = NoGuide> {
    pub transport: &'t Transport<'a, S, G>,
    /// What sees emission directly in place of paths.
    pub visible: Option<&'t VisibleEmission>,
    /// Whether paths have one sample of the emitters, whatever the transport has.
    pub samples_once: bool,
}

impl<S: EmitterSampler, G: DirectionGuide> ShortTracer<'_, '_, S, G> {
    /// What paths of at most `longest` edges find, if the transport has such, but for directly
    /// visible emission that has rays of its own.
    pub(super) fn up_to(
        &self,
        longest: u32,
        words: PathWords,
        ids: &[SampleId],
        tally: Option<&RayTally>,
    ) -> [Rgb; MAX_BATCH] {
        let transport = self.transport;
        let taken = self.visible.map_or(0, |visible| visible.taken(ids));
        let pixels = Pixels::new(words, &NoObserver, &NoEnding, ids);
        let pixels = pixels.without_visible(taken).counted_by(tally);
        let pixels = pixels.with_one_emitter_sample(self.samples_once);
        pixels.trace(
            transport,
            transport.scene.camera(),
            longest.min(transport.max_depth),
        )
    }

    /// What rays of their own find of directly visible emission that paths leave out.
    pub(super) fn emission(&self, words: PathWords, ids: &[SampleId]) -> [Rgb; MAX_BATCH] {
        let mut found = [Rgb::ZERO; MAX_BATCH];
        if let Some(visible) = self.visible {
            let scene = self.transport.scene;
            visible.add(scene, scene.camera(), (words.points, words.seed), ids, &mut found);
        }
        found
    }
}
