//! What paths are traced for.

use super::numbers::PathWords;
use super::observer::{NoObserver, PathObserver, PathVertex, Trail};
use super::paths::Paths;
use super::transport::{PathState, Transport};
use crate::emitter_sampler::EmitterSampler;
use crate::path::guide::DirectionGuide;
use lightshed_film::{MAX_BATCH, SampleId};
use lightshed_lanes::Lanes;
use lightshed_scene::{HitBatch, Ray, Rgb, Scene, SurfacePoint};

/// Who wants to know what the paths of a batch find. A path is known by its place among those that
/// the batch began with.
pub(crate) trait Purpose {
    /// Whether vertices are told of: then none is shaded in lanes.
    const OBSERVES: bool = false;

    /// Four random words of eight paths with these names.
    fn words<L: Lanes>(&self, names: [L::Words; 2], block: u32) -> [L::Words; 4];

    /// So many paths have traced their rays, their edges number `depth`.
    #[inline(always)]
    fn hit<K: Copy + Default>(
        &mut self,
        _scene: &Scene,
        _depth: u32,
        _paths: (&Paths<K>, usize),
        _hits: &HitBatch,
    ) {
    }

    /// A path's ray, its edge number `depth`, has met `point`, or the environment. Nothing need be
    /// emitted there.
    fn arrive<S: EmitterSampler, G: DirectionGuide>(
        &mut self,
        transport: &Transport<'_, S, G>,
        place: usize,
        depth: u32,
        path: &PathState<S::Site>,
        ray: &Ray,
        point: Option<&SurfacePoint>,
    );

    /// A path has come to a vertex that scatters.
    #[inline(always)]
    fn scatter(&mut self, _place: usize, _vertex: PathVertex) {}

    /// A path of `length` edges has reached an emitter by sampling it.
    fn connect(&mut self, place: usize, length: u32, radiance: Rgb);

    /// So many rays were traced to go on, and to emitters.
    #[inline(always)]
    fn count(&mut self, _path: usize, _emitter: usize) {}
}

/// Radiance that arrives at a camera.
pub(super) struct Pixels<'o, O = NoObserver> {
    words: PathWords,
    radiances: [Rgb; MAX_BATCH],
    observer: &'o O,
    /// Of each path that is watched.
    trails: Vec<Trail>,
    /// Paths, as bits, whose radiances leave out surfaces' emission at the end of the first edge.
    without_visible: u64,
}

impl<'o, O: PathObserver> Pixels<'o, O> {
    /// For so many paths.
    #[inline(always)]
    pub fn new(words: PathWords, observer: &'o O, count: usize) -> Self {
        let watched = if Self::OBSERVES { count } else { 0 };
        Self {
            words,
            radiances: [Rgb::ZERO; MAX_BATCH],
            observer,
            trails: vec![Trail::default(); watched],
            without_visible: 0,
        }
    }

    /// Without surfaces' emission at the end of the first edge of these paths, a bit each;
    /// observers still hear of it.
    #[inline(always)]
    pub fn without_visible(mut self, paths: u64) -> Self {
        self.without_visible = paths;
        self
    }

    #[inline(always)]
    fn add(&mut self, place: usize, edges: u32, is_sampled_emitter: bool, radiance: Rgb) {
        if Self::OBSERVES {
            self.trails[place].contribute(edges, is_sampled_emitter, radiance);
        }
        self.radiances[place % MAX_BATCH] += radiance;
    }

    /// The samples' values.
    #[inline(always)]
    pub fn finish(self, ids: &[SampleId]) -> [Rgb; MAX_BATCH] {
        for ((trail, id), radiance) in self.trails.iter().zip(ids).zip(self.radiances) {
            trail.tell(self.observer, *id, self.words.seed, radiance);
        }
        self.radiances
    }
}

impl<O: PathObserver> Purpose for Pixels<'_, O> {
    const OBSERVES: bool = O::IS_ACTIVE && !cfg!(lightshed_without = "observer");

    #[inline(always)]
    fn words<L: Lanes>(&self, names: [L::Words; 2], block: u32) -> [L::Words; 4] {
        self.words.vertex_lanes::<L>(names, block)
    }

    #[inline(always)]
    fn arrive<S: EmitterSampler, G: DirectionGuide>(
        &mut self,
        transport: &Transport<'_, S, G>,
        place: usize,
        depth: u32,
        path: &PathState<S::Site>,
        ray: &Ray,
        point: Option<&SurfacePoint>,
    ) {
        let met = path.met(transport.scene, &transport.sampler, ray, point);
        let radiance = path.throughput * met;
        if depth == 1 && point.is_some() && self.without_visible >> (place % MAX_BATCH) & 1 == 1 {
            if Self::OBSERVES {
                self.trails[place].contribute(depth, false, radiance);
            }
            return;
        }
        self.add(place, depth, false, radiance);
    }

    #[inline(always)]
    fn scatter(&mut self, place: usize, vertex: PathVertex) {
        if Self::OBSERVES {
            self.trails[place].vertices.push(vertex);
        }
    }

    #[inline(always)]
    fn connect(&mut self, place: usize, length: u32, radiance: Rgb) {
        self.add(place, length, true, radiance);
    }
}
