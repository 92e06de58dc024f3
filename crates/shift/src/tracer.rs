//! Candidates: trees of paths from the camera.

use crate::domain::{PathDomain, Start};
use crate::sample::PathSample;
use crate::suffix::trace_suffix;
use crate::walk::{Candidate, Onward, Pending, Walk};
use crate::world::{RayKind, Suffix, SuffixLight, SuffixLimits, World};
use lightshed_resampling::ContributionWeight;
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{PathSeed, PrimarySample};

/// Traces trees of paths: one walk by scattering from the domain's first vertex. At every vertex of
/// the walk there is a path to a sampled emitter, and a path to the emitter that the walk hits, if
/// any. Each path is a candidate for a reservoir of the domain.
///
/// Every path of a domain belongs to exactly one of a tree's candidates, so a candidate of one of
/// `N` trees has the resampling MIS weight `1/N`. Its contribution weight is one over the
/// probability of having survived roulette.
///
/// All trees of a call are traced together, depth by depth. Each depends on its domain and seed
/// alone.
pub struct TreeTracer<W: World> {
    roulette_from: u32,
    /// Least edges of candidates.
    least_length: u32,
    /// By tree.
    walks: Vec<Walk<W>>,
    /// The active trees, and the vertices that they have reached.
    places: Vec<usize>,
    vertices: Vec<Option<W::Vertex>>,
    /// Where they came from: indices into the previous vertices.
    origins: Vec<usize>,
    before: Vec<Option<W::Vertex>>,
    next_places: Vec<usize>,
    rays: Vec<W::Ray>,
    pending: Vec<(usize, Candidate)>,
    pending_rays: Vec<W::Ray>,
    occluded: Vec<bool>,
    /// Of this depth, and their trees.
    suffixes: Vec<Suffix<W::Ray, W::Site>>,
    suffix_trees: Vec<usize>,
}

/// What a tree has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finding<'a> {
    /// A candidate of positive target, with its contribution weight.
    Path(&'a PathSample, ContributionWeight<PrimarySample, f64>),
    /// Radiance that the sensor sees directly: no path of the domain, but part of the sensor's
    /// measurement.
    Seen(Vec3),
}

impl<W: World> TreeTracer<W> {
    /// Roulette may end a walk from vertex number `roulette_from` on (the first surface is number
    /// 1).
    pub fn new(roulette_from: u32) -> Self {
        Self {
            roulette_from,
            least_length: 0,
            walks: Vec::new(),
            places: Vec::new(),
            vertices: Vec::new(),
            origins: Vec::new(),
            before: Vec::new(),
            next_places: Vec::new(),
            rays: Vec::new(),
            pending: Vec::new(),
            pending_rays: Vec::new(),
            occluded: Vec::new(),
            suffixes: Vec::new(),
            suffix_trees: Vec::new(),
        }
    }

    /// Without the candidates of fewer than `edges` edges (that from the camera included), which
    /// are left to another estimator. All else stays the same, bit for bit.
    #[must_use]
    pub fn with_least_length(mut self, edges: u32) -> Self {
        self.least_length = edges;
        self
    }

    /// Traces a tree for each domain and seed and passes its results to `visit`, with the number of
    /// the tree. The candidates of a tree have a fixed order.
    pub fn trace(
        &mut self,
        trees: &[(&PathDomain<'_, W>, PathSeed)],
        mut visit: impl FnMut(usize, Finding<'_>),
    ) {
        let Some(world) = trees.first().map(|(domain, _)| domain.world) else {
            return;
        };
        self.begin(world, trees, &mut visit);
        let lengths = trees.iter().map(|(domain, _)| domain.max_length);
        let mut limits = SuffixLimits {
            first: 1,
            max_length: lengths.max().unwrap_or(0),
            roulette_from: self.roulette_from,
        };
        let least_length = self.least_length;
        let is_long = |tree: usize, sample: &PathSample| {
            sample.shape().length >= least_length.max(trees[tree].0.part.least_length())
        };
        while !self.places.is_empty() {
            self.leave(trees);
            limits.first += 1;
            self.occluded.clear();
            self.occluded.resize(self.pending_rays.len(), false);
            world.occluded_many(&self.pending_rays, RayKind::Emitter, &mut self.occluded);
            for ((tree, (sample, weight)), &occluded) in self.pending.iter().zip(&self.occluded) {
                if !occluded {
                    visit(*tree, Finding::Path(sample, *weight));
                }
            }
            let mut take_in = |number: usize, light: SuffixLight| {
                let tree = self.suffix_trees[number];
                match self.walks[tree].take_in(&light) {
                    Some((sample, weight))
                        if sample.shape().length <= trees[tree].0.max_length && is_long(tree, &sample) =>
                    {
                        visit(tree, Finding::Path(&sample, weight));
                    }
                    _ => (),
                }
            };
            if !world.trace_suffixes(&self.suffixes, limits, &mut take_in) {
                for (number, suffix) in self.suffixes.iter().enumerate() {
                    trace_suffix(world, suffix, limits, &mut |light| take_in(number, light));
                }
            }
            std::mem::swap(&mut self.places, &mut self.next_places);
            std::mem::swap(&mut self.vertices, &mut self.before);
            self.follow(world, RayKind::Path);
            let arrivals = self.places.iter().zip(&self.origins).zip(&self.vertices);
            for ((&tree, &origin), vertex) in arrivals {
                let Some(before) = &self.before[origin] else {
                    continue;
                };
                let (walk, domain) = (&mut self.walks[tree], trees[tree].0);
                walk.settle(domain, before, vertex.as_ref());
                let candidate = walk.arrive(domain, before, vertex.as_ref());
                if let Some((sample, weight)) = candidate.filter(|(sample, _)| is_long(tree, sample)) {
                    visit(tree, Finding::Path(&sample, weight));
                }
            }
        }
    }

    /// The first vertices.
    fn begin(
        &mut self,
        world: &W,
        trees: &[(&PathDomain<'_, W>, PathSeed)],
        visit: &mut impl FnMut(usize, Finding<'_>),
    ) {
        self.walks.clear();
        self.walks.extend(trees.iter().map(|&(_, seed)| Walk::new(seed)));
        self.places.clear();
        self.rays.clear();
        for (tree, (domain, _)) in trees.iter().enumerate() {
            if let Start::Sensor(sensor) = &domain.start
                && let Some(ray) = self.walks[tree].leave_sensor(domain, sensor)
            {
                self.rays.push(ray);
                self.places.push(tree);
            }
        }
        self.follow(world, RayKind::Sensor);
        for (&tree, vertex) in self.places.iter().zip(&self.vertices) {
            let domain = trees[tree].0;
            let radiance = self.walks[tree].seen(domain, vertex.as_ref());
            if radiance != Vec3::ZERO && domain.max_length >= 1 {
                visit(tree, Finding::Seen(radiance));
            }
        }
        for (tree, (domain, _)) in trees.iter().enumerate() {
            if let Start::Vertex { first, wo } = &domain.start {
                self.walks[tree].start(*wo);
                self.places.push(tree);
                self.vertices.push(Some(first.clone()));
            }
        }
    }

    /// Where the rays lead.
    fn follow(&mut self, world: &W, kind: RayKind) {
        self.vertices.clear();
        self.vertices.resize(self.rays.len(), None);
        world.trace_many(&self.rays, kind, &mut self.vertices);
    }

    /// From every vertex, a path to an emitter and a ray to the next vertex.
    fn leave(&mut self, trees: &[(&PathDomain<'_, W>, PathSeed)]) {
        self.pending.clear();
        self.pending_rays.clear();
        self.next_places.clear();
        self.rays.clear();
        self.origins.clear();
        self.suffixes.clear();
        self.suffix_trees.clear();
        for (place, (&tree, vertex)) in self.places.iter().zip(&self.vertices).enumerate() {
            let (walk, domain) = (&mut self.walks[tree], trees[tree].0);
            let Some(vertex) = vertex.as_ref().filter(|_| walk.index() < domain.max_length) else {
                continue;
            };
            if walk.index() + 1 >= self.least_length.max(domain.part.least_length())
                && let Some(Pending { candidate, ray }) = walk.sample_emitter(domain, vertex)
            {
                self.pending.push((tree, candidate));
                self.pending_rays.push(ray);
            }
            match walk.scatter(domain, vertex, self.roulette_from) {
                Some(Onward::Ray(ray)) => {
                    self.rays.push(ray);
                    self.next_places.push(tree);
                    self.origins.push(place);
                }
                Some(Onward::Suffix(suffix)) => {
                    self.suffixes.push(suffix);
                    self.suffix_trees.push(tree);
                }
                None => (),
            }
        }
    }
}
