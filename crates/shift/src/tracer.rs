//! Candidates: trees of paths from the camera.

use crate::domain::{PathDomain, Start};
use crate::sample::PathSample;
use crate::walk::{Candidate, Pending, Walk};
use crate::world::{RayKind, World};
use lightshed_sampling::PathSeed;
use lightshed_sampling::glam::Vec3;

/// Traces trees of paths: one walk by scattering from the domain's first vertex, and at every vertex of it a path to a sampled
/// emitter and, where it meets one, a path to that emitter. Each is a candidate for a reservoir of the domain.
///
/// Every path of a domain belongs to exactly one of a tree's candidates, so a candidate of one of `N` trees has the
/// resampling MIS weight `1/N`. Its contribution weight is one over the probability of having survived roulette.
///
/// All trees of a call are traced together, depth by depth. Each depends on its domain and seed alone.
pub struct TreeTracer<W: World> {
    roulette_from: u32,
    walks: Vec<(usize, Walk<W>)>,
    rays: Vec<W::Ray>,
    vertices: Vec<Option<W::Vertex>>,
    /// First vertices of the trees that start at sensors.
    seen: Vec<Option<W::Vertex>>,
    pending: Vec<(usize, Candidate)>,
    pending_rays: Vec<W::Ray>,
    occluded: Vec<bool>,
}

/// What a tree has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finding<'a> {
    /// A candidate of positive target, with its contribution weight.
    Path(&'a PathSample, f64),
    /// Radiance that the sensor sees directly: no path of the domain, but part of what the sensor measures.
    Seen(Vec3),
}

impl<W: World> TreeTracer<W> {
    /// Roulette may end a walk from vertex number `roulette_from` on (the first surface is number 1).
    pub fn new(roulette_from: u32) -> Self {
        Self {
            roulette_from,
            walks: Vec::new(),
            rays: Vec::new(),
            vertices: Vec::new(),
            seen: Vec::new(),
            pending: Vec::new(),
            pending_rays: Vec::new(),
            occluded: Vec::new(),
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
        self.vertices.clear();
        self.rays.clear();
        for (tree, &(domain, seed)) in trees.iter().enumerate() {
            let mut walk = Walk::new(seed);
            match &domain.start {
                Start::Vertex { first, wo } => {
                    walk.start(*wo);
                    self.vertices.push(Some(first.clone()));
                }
                Start::Sensor(sensor) => {
                    self.rays.push(walk.leave_sensor(domain, sensor));
                    self.vertices.push(None);
                }
            }
            self.walks.push((tree, walk));
        }
        if !self.rays.is_empty() {
            self.seen.clear();
            self.seen.resize(self.rays.len(), None);
            world.trace_many(&self.rays, RayKind::Sensor, &mut self.seen);
            let mut seen = self.seen.drain(..);
            for ((tree, walk), vertex) in self.walks.iter().zip(&mut self.vertices) {
                let domain = trees[*tree].0;
                if matches!(domain.start, Start::Sensor(_)) {
                    *vertex = seen.next().flatten();
                    let radiance = walk.seen(domain, vertex.as_ref());
                    if radiance != Vec3::ZERO && domain.max_length >= 1 {
                        visit(*tree, Finding::Seen(radiance));
                    }
                }
            }
        }
        let mut kept = 0;
        for place in 0..self.walks.len() {
            if self.vertices[place].is_some() && trees[self.walks[place].0].0.max_length >= 2 {
                self.walks.swap(kept, place);
                self.vertices.swap(kept, place);
                kept += 1;
            }
        }
        self.walks.truncate(kept);
        self.vertices.truncate(kept);
    }

    /// Traces a tree for each domain and seed and hands what it finds to `visit`, with the number of the tree. The candidates of
    /// a tree come in a fixed order.
    pub fn trace(
        &mut self,
        trees: &[(&PathDomain<'_, W>, PathSeed)],
        mut visit: impl FnMut(usize, Finding<'_>),
    ) {
        let Some(world) = trees.first().map(|(domain, _)| domain.world) else {
            return;
        };
        self.begin(world, trees, &mut visit);
        while !self.walks.is_empty() {
            self.pending.clear();
            self.pending_rays.clear();
            self.rays.clear();
            let mut alive = 0;
            for place in 0..self.walks.len() {
                let (tree, walk) = &mut self.walks[place];
                let (tree, domain) = (*tree, trees[*tree].0);
                let Some(vertex) = self.vertices[place].as_ref() else {
                    continue;
                };
                if let Some(Pending { candidate, ray }) = walk.sample_emitter(domain, vertex) {
                    self.pending.push((tree, candidate));
                    self.pending_rays.push(ray);
                }
                if let Some(ray) = walk.scatter(domain, vertex, self.roulette_from) {
                    self.rays.push(ray);
                    self.walks.swap(alive, place);
                    alive += 1;
                }
            }
            self.walks.truncate(alive);
            self.occluded.clear();
            self.occluded.resize(self.pending_rays.len(), false);
            world.occluded_many(&self.pending_rays, RayKind::Emitter, &mut self.occluded);
            for ((tree, (sample, weight)), &occluded) in self.pending.iter().zip(&self.occluded) {
                if !occluded {
                    visit(*tree, Finding::Path(sample, *weight));
                }
            }
            self.vertices.clear();
            self.vertices.resize(alive, None);
            world.trace_many(&self.rays, RayKind::Path, &mut self.vertices);
            let mut kept = 0;
            for place in 0..alive {
                let (tree, walk) = &self.walks[place];
                let domain = trees[*tree].0;
                let vertex = self.vertices[place].as_ref();
                if let Some((sample, weight)) = walk.arrive(domain, vertex) {
                    visit(*tree, Finding::Path(&sample, weight));
                }
                if vertex.is_some() && walk.index() < domain.max_length {
                    self.walks.swap(kept, place);
                    self.vertices.swap(kept, place);
                    kept += 1;
                }
            }
            self.walks.truncate(kept);
            self.vertices.truncate(kept);
        }
    }
}
