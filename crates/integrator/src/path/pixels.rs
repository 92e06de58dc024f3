//! Paths traced for the pixels of a camera.

use super::batch::follow_up_to;
use super::ending::{EndingVertex, NoEnding, PathEnding};
use super::further_emitters::further_emitters;
use super::guide::DirectionGuide;
use super::numbers::PathWords;
use super::observer::{NoObserver, PathObserver, PathVertex, Trail};
use super::paths::Paths;
use super::purpose::Purpose;
use super::start::{Start, pixel_name};
use super::transport::{PathState, Transport};
use crate::emitter_sampler::EmitterSampler;
use lightshed_film::{MAX_BATCH, RayKind, RayTally, SampleId};
use lightshed_lanes::{LANES, Lanes};
use lightshed_sampling::SobolScrambles;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Camera, HitBatch, Ray, Rgb, SurfacePoint};

/// Edges of the longest short paths: of emission that the camera sees, and of direct light.
pub(crate) const SHORT: u32 = 2;

/// The least name of the pixels of some samples, if there are no more than eight from that on; of
/// few samples none, since nothing is saved.
fn first_of_near(ids: &[SampleId]) -> Option<u32> {
    if ids.len() <= LANES {
        return None;
    }
    let (mut least, mut most) = (u32::MAX, 0);
    for id in ids {
        let name = pixel_name(id);
        (least, most) = (least.min(name), most.max(name));
    }
    (most - least < LANES as u32).then_some(least)
}

/// Radiance that arrives at a camera.
pub(super) struct Pixels<'o, O = NoObserver, E: PathEnding = NoEnding> {
    words: PathWords,
    /// The least name of the paths' pixels, if all are among that one and the seven after it.
    first: Option<u32>,
    radiances: [Rgb; MAX_BATCH],
    observer: &'o O,
    ending: &'o E,
    /// The samples of the paths, and the ending's state of each.
    ids: &'o [SampleId],
    endings: [E::Path; MAX_BATCH],
    /// Paths that are watched, as bits, and of each path a record, if any is watched.
    watched: u64,
    trails: Vec<Trail>,
    /// Paths, as bits, whose radiances leave out surface emission at the end of the first edge.
    without_visible: u64,
    /// Paths, as bits, whose radiances leave out the light of paths of at most [`SHORT`] edges.
    without_short: u64,
    /// Whether paths have one sample of the emitters at all vertices.
    samples_once: bool,
    /// Where rays behind the first vertex are counted.
    tally: Option<&'o RayTally>,
    has_left: bool,
}

impl<'o, O: PathObserver, E: PathEnding> Pixels<'o, O, E> {
    /// For the paths of some samples.
    #[inline(always)]
    pub fn new(words: PathWords, observer: &'o O, ending: &'o E, ids: &'o [SampleId]) -> Self {
        let (mut watched, mut trails) = (0, Vec::new());
        if Self::OBSERVES {
            for (place, id) in ids.iter().enumerate().take(MAX_BATCH) {
                watched |= u64::from(observer.wants(*id, words.seed)) << place;
            }
            if watched != 0 {
                trails = Trail::take(ids.len());
            }
        }
        Self {
            words,
            first: first_of_near(ids),
            radiances: [Rgb::ZERO; MAX_BATCH],
            observer,
            ending,
            ids,
            endings: [E::Path::default(); MAX_BATCH],
            watched,
            trails,
            without_visible: 0,
            without_short: 0,
            samples_once: false,
            tally: None,
            has_left: false,
        }
    }

    /// With rays counted, those from the camera apart.
    #[inline(always)]
    pub fn counted_by(mut self, tally: Option<&'o RayTally>) -> Self {
        self.tally = tally;
        self
    }

    /// Without surface emission at the end of the first edge of these paths, a bit each; observers
    /// still see it.
    #[inline(always)]
    pub fn without_visible(mut self, paths: u64) -> Self {
        self.without_visible = paths;
        self
    }

    /// Without the light of paths of at most [`SHORT`] edges, of these paths, a bit each.
    #[inline(always)]
    pub fn without_short(mut self, paths: u64) -> Self {
        self.without_short = paths;
        self
    }

    /// With one sample of the emitters at all vertices, whatever the transport has.
    #[inline(always)]
    pub fn with_one_emitter_sample(mut self, is_wanted: bool) -> Self {
        self.samples_once = is_wanted;
        self
    }

    /// Whether light over so many edges is left out.
    #[inline(always)]
    fn leaves_out(&self, place: usize, edges: u32) -> bool {
        edges <= SHORT && self.without_short >> (place % MAX_BATCH) & 1 == 1
    }

    #[inline(always)]
    fn add(&mut self, place: usize, edges: u32, is_sampled_emitter: bool, met: Option<Vec3>, radiance: Rgb) {
        if Self::OBSERVES && self.watches(place) {
            self.trails[place].contribute(edges, is_sampled_emitter, met, radiance);
        }
        self.radiances[place % MAX_BATCH] += radiance;
    }

    /// Traces the paths of the samples up to `longest` edges: their values.
    pub fn trace<S: EmitterSampler, G: DirectionGuide>(
        mut self,
        transport: &Transport<'_, S, G>,
        camera: &Camera,
        longest: u32,
    ) -> [Rgb; MAX_BATCH] {
        let mut paths = Paths::new();
        transport.lanes.run(Start {
            camera,
            ids: self.ids,
            words: self.words,
            paths: &mut paths,
        });
        let paths = (&mut paths, self.ids.len());
        follow_up_to(transport, longest, paths, 1, None, &mut self);
        self.finish()
    }

    /// The samples' values.
    #[inline(always)]
    pub fn finish(self) -> [Rgb; MAX_BATCH] {
        if Self::OBSERVES && self.watched != 0 {
            for (place, (trail, id)) in self.trails.iter().zip(self.ids).enumerate() {
                if self.watches(place) {
                    trail.tell(self.observer, *id, self.words.seed, self.radiances[place]);
                }
            }
            Trail::give_back(self.trails);
        }
        self.radiances
    }
}

impl<O: PathObserver, E: PathEnding> Purpose for Pixels<'_, O, E> {
    const OBSERVES: bool = O::IS_ACTIVE && !cfg!(lightshed_without = "observer");
    const ENDS: bool = E::IS_ACTIVE && !cfg!(lightshed_without = "ending");
    const TAKES_ESCAPED: bool = true;

    #[inline(always)]
    fn samples_at<S, G>(&self, transport: &Transport<'_, S, G>, depth: u32) -> u32 {
        match self.samples_once {
            true => 1,
            false => transport.samples_at(depth),
        }
    }

    #[inline(always)]
    fn words<L: Lanes>(&self, names: [L::Words; 2], block: u32) -> [L::Words; 4] {
        self.words.vertex_lanes::<L>(names, block)
    }

    #[inline(always)]
    fn common<L: Lanes>(&self, block: u32) -> Option<SobolScrambles> {
        match self.first {
            Some(first) => self.words.common_lanes::<L>(first, block),
            None => None,
        }
    }

    #[inline(always)]
    fn words_by<L: Lanes>(
        &self,
        common: Option<&SobolScrambles>,
        names: [L::Words; 2],
        block: u32,
    ) -> [L::Words; 4] {
        self.words.vertex_lanes_by::<L>(common, names, block)
    }

    #[inline(always)]
    fn words_alone(&self, names: [u32; 2], block: u32) -> [u32; 4] {
        self.words.vertex_block(names, block)
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
        if self.leaves_out(place, depth) {
            return;
        }
        let (scene, sampler) = (transport.scene, &transport.sampler);
        let samples = self.samples_at(transport, depth.wrapping_sub(1));
        let met = path.met_beside(scene, sampler, samples, ray, point);
        let radiance = path.throughput * met;
        let at = point.map(|point| point.position);
        if depth == 1 && point.is_some() && self.without_visible >> (place % MAX_BATCH) & 1 == 1 {
            if Self::OBSERVES && self.watches(place) {
                self.trails[place].contribute(depth, false, at, radiance);
            }
            return;
        }
        self.add(place, depth, false, at, radiance);
    }

    #[inline(always)]
    fn escape(&mut self, place: usize, depth: u32, radiance: Rgb) {
        if !self.leaves_out(place, depth) {
            self.add(place, depth, false, None, radiance);
        }
    }

    #[inline(always)]
    fn goes_on(&mut self, place: usize, vertex: &EndingVertex, _ray: &Ray) -> Option<Rgb> {
        let place = place % MAX_BATCH;
        let vertex = EndingVertex {
            id: self.ids.get(place).copied().unwrap_or_default(),
            seed: self.words.seed,
            ..*vertex
        };
        let ending = self.ending.at(&mut self.endings[place], &vertex);
        if ending.radiance != Rgb::ZERO {
            self.add(place, vertex.depth, false, None, ending.radiance);
        }
        (ending.goes_on > 0.0).then(|| vertex.throughput * ending.goes_on)
    }

    #[inline(always)]
    fn watches(&self, place: usize) -> bool {
        self.watched >> (place % MAX_BATCH) & 1 == 1
    }

    #[inline(always)]
    fn count(&mut self, path: usize, emitter: usize) {
        if Self::ENDS {
            self.ending.count(path, emitter);
        }
        if let Some(tally) = self.tally {
            let kind = match self.has_left {
                true => RayKind::Path,
                false => RayKind::Camera,
            };
            self.has_left = true;
            tally.add(kind, path);
            tally.add(RayKind::Emitter, emitter);
        }
    }

    #[inline(always)]
    fn scatter(&mut self, place: usize, vertex: PathVertex) {
        self.trails[place].vertices.push(vertex);
    }

    #[inline(always)]
    fn connect(&mut self, place: usize, length: u32, radiance: Rgb) {
        if self.leaves_out(place, length) {
            return;
        }
        self.add(place, length, true, None, radiance);
    }

    #[inline(always)]
    fn sample_further<S: EmitterSampler, G: DirectionGuide>(
        &mut self,
        transport: &Transport<'_, S, G>,
        depth: u32,
        paths: (&Paths<S::Site>, usize),
        hits: &HitBatch,
    ) {
        // Guided, observed and ended paths sample once.
        let may_be = const { !G::IS_ACTIVE && !Self::OBSERVES && !Self::ENDS };
        if may_be && self.samples_at(transport, depth) > 1 {
            further_emitters(transport, depth, paths, hits, self);
        }
    }
}
