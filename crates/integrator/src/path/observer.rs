//! Who wants to know what becomes of paths.

use lightshed_film::SampleId;
use lightshed_lights::ShadingPoint;
use lightshed_sampling::{Density, SolidAngle};
use lightshed_scene::Rgb;
use lightshed_scene::glam::Vec3;

/// Watches the paths of a tracer: what guides and caches are trained by.
pub trait PathObserver: Sync {
    /// Whether it watches at all: false compiles to nothing.
    const IS_ACTIVE: bool = true;

    /// A path is complete. Called once for each sample, from any thread and in any order: what is
    /// to be the same for any number of threads is summed in the order of [`ObservedPath::id`] or
    /// in integers.
    fn observe(&self, path: &ObservedPath<'_>);
}

/// A path from the camera with all that it found.
#[derive(Clone, Copy, Debug)]
pub struct ObservedPath<'a> {
    /// The sample that it is, under `seed`.
    pub id: SampleId,
    /// The seed.
    pub seed: u64,
    /// Its vertices that scatter, in order.
    pub vertices: &'a [PathVertex],
    /// What it found. Their sum in this order is [`radiance`](Self::radiance), bit for bit.
    pub contributions: &'a [PathContribution],
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
    /// What the choice among emitters may know of it.
    pub lit: ShadingPoint,
    /// Unit direction of the edge that leads to it.
    pub incoming: Vec3,
    /// What radiance that leaves the vertex against `incoming` counts for in the pixel.
    pub throughput: Rgb,
    /// Direction towards the emitter that was sampled there, and its density with the choice of
    /// emitter (zero for lights that nothing else can meet); `None` if the sample has value zero.
    pub emitter: Option<(Vec3, Density<SolidAngle>)>,
    /// Index of that emitter.
    pub emitter_index: Option<u32>,
    /// How the path went on; `None` if it ended.
    pub onward: Option<PathDirection>,
}

/// How a path leaves a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathDirection {
    /// Unit direction.
    pub direction: Vec3,
    /// Density with which the direction was really sampled: of the mixture with a guide where there
    /// is one. Infinite for a lobe without width.
    pub pdf: Density<SolidAngle>,
    /// Density with which what scatters would have sampled it, lobes without width apart:
    /// [`pdf`](Self::pdf) where there is no guide.
    pub scattering_pdf: Density<SolidAngle>,
    /// Whether it left by a lobe without width.
    pub is_delta: bool,
    /// What radiance that arrives from there counts for in the pixel: `f |cos θ| / p` times the
    /// throughput, over the probability of having survived roulette.
    pub throughput: Rgb,
}

/// Light that a path found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathContribution {
    /// Edges of the path from the camera to what emits.
    pub edges: u32,
    /// Whether its end was found by sampling an emitter from the vertex before; else it was met.
    pub is_sampled_emitter: bool,
    /// What it adds to the pixel, with its MIS weight.
    pub radiance: Rgb,
}

impl ObservedPath<'_> {
    /// What the emitter that was sampled at vertex number `index` added to the pixel, with its MIS
    /// weight; `None` if it was hidden.
    pub fn from_sampled_emitter(&self, index: usize) -> Option<Rgb> {
        let edges = self.vertices.get(index)?.depth + 1;
        let mut found = self.contributions.iter();
        found
            .find(|light| light.is_sampled_emitter && light.edges == edges)
            .map(|light| light.radiance)
    }

    /// An estimate of the radiance that arrives at vertex number `index` from where the path went
    /// on, with the MIS weights of what was met at the next edge; over [`PathDirection::pdf`] it is
    /// what a guide learns from. `None` if the path ended there.
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
    fn observe(&self, path: &ObservedPath<'_>) {
        O::observe(self, path);
    }
}

/// What is known of a path that is watched, so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trail {
    pub vertices: Vec<PathVertex>,
    contributions: Vec<PathContribution>,
}

impl Trail {
    /// Light of a path; black counts for nothing.
    pub fn contribute(&mut self, edges: u32, is_sampled_emitter: bool, radiance: Rgb) {
        if radiance != Rgb::ZERO {
            self.contributions.push(PathContribution {
                edges,
                is_sampled_emitter,
                radiance,
            });
        }
    }

    /// Tells of the whole path.
    pub fn tell(&self, observer: &impl PathObserver, id: SampleId, seed: u64, radiance: Rgb) {
        observer.observe(&ObservedPath {
            id,
            seed,
            vertices: &self.vertices,
            contributions: &self.contributions,
            radiance,
        });
    }
}
