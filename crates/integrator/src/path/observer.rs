//! Observers of paths.

use lightshed_film::SampleId;
use lightshed_guiding::FlightEnd;
use lightshed_lights::ShadingPoint;
use lightshed_sampling::{Density, SolidAngle};
use lightshed_scene::Rgb;
use lightshed_scene::glam::Vec3;
use std::cell::RefCell;

/// Observes the paths of a tracer; guides and caches are trained by it.
pub trait PathObserver: Sync {
    /// Whether it watches at all: false compiles to nothing.
    const IS_ACTIVE: bool = true;

    /// Whether the path of this sample is to be observed; asked before it is traced, so that
    /// nothing is kept of paths that are not. A pure function.
    #[inline(always)]
    fn wants(&self, _id: SampleId, _seed: u64) -> bool {
        true
    }

    /// A path is complete. Called once for each sample that it [`wants`](Self::wants), from any
    /// thread and in any order. To get the same result for any number of threads, sum in the order
    /// of [`ObservedPath::id`] or in integers.
    fn observe(&self, path: &ObservedPath<'_>);
}

/// A path from the camera with all of its results.
#[derive(Clone, Copy, Debug)]
pub struct ObservedPath<'a> {
    /// Its sample number under `seed`.
    pub id: SampleId,
    /// The seed.
    pub seed: u64,
    /// Its vertices that scatter, in order.
    pub vertices: &'a [PathVertex],
    /// The light it found. Its sum in this order is [`radiance`](Self::radiance), bit for bit.
    pub contributions: &'a [PathContribution],
    /// Where its flights through media ended, in order; but for those of its last edge.
    pub arrivals: &'a [PathArrival],
    /// Radiance that arrives at the camera: the sample's value.
    pub radiance: Rgb,
}

/// A vertex of a path that scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathVertex {
    /// Number of the edge that leads to it, from 1.
    pub depth: u32,
    /// Position.
    pub position: Vec3,
    /// Unit shading normal, on either side of the surface; `None` in a medium.
    pub normal: Option<Vec3>,
    /// The data that the selection of emitters may use.
    pub lit: ShadingPoint,
    /// Unit direction of the edge that leads to it.
    pub incoming: Vec3,
    /// Weight in the pixel of radiance that leaves the vertex against `incoming`.
    pub throughput: Rgb,
    /// Direction towards the emitter that was sampled there, and its density including the
    /// selection of the emitter (zero for lights that nothing else can hit); `None` if the sample
    /// has value zero.
    pub emitter: Option<(Vec3, Density<SolidAngle>)>,
    /// Index of that emitter.
    pub emitter_index: Option<u32>,
    /// The continuation of the path; `None` if it ended.
    pub onward: Option<PathDirection>,
}

/// How a path leaves a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathDirection {
    /// Unit direction.
    pub direction: Vec3,
    /// Density with which the direction was actually sampled: of the mixture with a guide, if there
    /// is one. Infinite for a lobe without width.
    pub pdf: Density<SolidAngle>,
    /// Density with which the BSDF or phase function would have sampled it, without lobes that have
    /// no width: [`pdf`](Self::pdf) if there is no guide.
    pub scattering_pdf: Density<SolidAngle>,
    /// Whether it left by a lobe without width.
    pub is_delta: bool,
    /// Probability with which roulette let it go on.
    pub survival: f32,
    /// Weight in the pixel of radiance that arrives from there: `f |cos θ| / p` times the
    /// throughput, divided by the probability of having survived roulette.
    pub throughput: Rgb,
}

/// Light that a path found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathContribution {
    /// Edges of the path from the camera to what emits.
    pub edges: u32,
    /// Whether its end was found by emitter sampling from the previous vertex; otherwise a
    /// direction hit it.
    pub is_sampled_emitter: bool,
    /// Where a direction met what emits, on a surface or in a medium: a path that ends there has no
    /// vertex.
    pub place: Option<Vec3>,
    /// Its contribution to the pixel, with its MIS weight.
    pub radiance: Rgb,
}

/// The end of a flight through a medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathArrival {
    /// Where.
    pub position: Vec3,
    /// At what.
    pub end: FlightEnd,
    /// Weight in the pixel of radiance that leaves the place against the flight.
    pub throughput: Rgb,
    /// Number of [`contributions`](ObservedPath::contributions) that the path had found before,
    /// with what a surface there emits.
    pub before: usize,
}

impl ObservedPath<'_> {
    /// Contribution to the pixel of the emitter that was sampled at vertex number `index`, with its
    /// MIS weight; `None` if it was hidden.
    pub fn from_sampled_emitter(&self, index: usize) -> Option<Rgb> {
        let edges = self.vertices.get(index)?.depth + 1;
        let mut found = self.contributions.iter();
        found
            .find(|light| light.is_sampled_emitter && light.edges == edges)
            .map(|light| light.radiance)
    }

    /// An estimate of the radiance that arrives at vertex number `index` from where the path
    /// continued, with the MIS weights of what the next edge hit. Divided by
    /// [`PathDirection::pdf`], it is what a guide learns from. `None` if the path ended there.
    pub fn arrived(&self, index: usize) -> Option<Rgb> {
        let vertex = self.vertices.get(index)?;
        let onward = vertex.onward?;
        let behind = self
            .contributions
            .iter()
            .filter(|light| light.edges > vertex.depth + u32::from(light.is_sampled_emitter));
        let sum: Rgb = behind.map(|light| light.radiance).sum();
        let share = |sum: f32, throughput: f32| if throughput > 0.0 { sum / throughput } else { 0.0 };
        Some(Rgb::new(
            share(sum.x, onward.throughput.x),
            share(sum.y, onward.throughput.y),
            share(sum.z, onward.throughput.z),
        ))
    }
}

/// Nobody watches.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoObserver;

impl PathObserver for NoObserver {
    const IS_ACTIVE: bool = false;

    #[inline(always)]
    fn observe(&self, _path: &ObservedPath<'_>) {}
}

impl<O: PathObserver> PathObserver for &O {
    const IS_ACTIVE: bool = O::IS_ACTIVE;

    #[inline(always)]
    fn wants(&self, id: SampleId, seed: u64) -> bool {
        O::wants(self, id, seed)
    }

    #[inline(always)]
    fn observe(&self, path: &ObservedPath<'_>) {
        O::observe(self, path);
    }
}

/// The record of an observed path so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trail {
    pub vertices: Vec<PathVertex>,
    contributions: Vec<PathContribution>,
    arrivals: Vec<PathArrival>,
}

thread_local! {
    /// Memory of earlier batches.
    static UNUSED: RefCell<Vec<Trail>> = const { RefCell::new(Vec::new()) };
}

impl Trail {
    /// So many empty ones, in memory that an earlier batch gave [back](Self::give_back).
    pub fn take(count: usize) -> Vec<Self> {
        let mut trails = UNUSED.take();
        for trail in &mut trails {
            trail.vertices.clear();
            trail.contributions.clear();
            trail.arrivals.clear();
        }
        trails.resize_with(count, Self::default);
        trails
    }

    /// Keeps memory for the next batch of this thread.
    pub fn give_back(trails: Vec<Self>) {
        UNUSED.set(trails);
    }

    /// Light of a path; black counts for nothing.
    pub fn contribute(&mut self, edges: u32, is_sampled_emitter: bool, place: Option<Vec3>, radiance: Rgb) {
        if radiance != Rgb::ZERO {
            self.contributions.push(PathContribution {
                edges,
                is_sampled_emitter,
                place,
                radiance,
            });
        }
    }

    /// The end of a flight through a medium; what the path finds from now on is found there.
    pub fn arrive(&mut self, position: Vec3, end: FlightEnd, throughput: Rgb) {
        self.arrivals.push(PathArrival {
            position,
            end,
            throughput,
            before: self.contributions.len(),
        });
    }

    /// Tells of the whole path.
    pub fn tell(&self, observer: &impl PathObserver, id: SampleId, seed: u64, radiance: Rgb) {
        observer.observe(&ObservedPath {
            id,
            seed,
            vertices: &self.vertices,
            contributions: &self.contributions,
            arrivals: &self.arrivals,
            radiance,
        });
    }
}
