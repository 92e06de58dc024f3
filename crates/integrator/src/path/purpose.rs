//! What paths are traced for.

use super::ending::EndingVertex;
use super::observer::PathVertex;
use super::paths::Paths;
use super::scattering::SurfaceVertex;
use super::transport::{PathState, Transport};
use crate::emitter_sampler::EmitterSampler;
use crate::path::guide::DirectionGuide;
use lightshed_film::SampleId;
use lightshed_lanes::{ArrayLanes, LaneWords, Lanes};
use lightshed_sampling::{Density, SobolScrambles};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{HitBatch, Ray, Rgb, Scene, SurfacePoint};

/// The receiver of a batch's results. A path is identified by its place among those with which the
/// batch started.
pub(crate) trait Purpose {
    /// Whether vertices are reported.
    const OBSERVES: bool = false;

    /// Whether paths may end before their vertices.
    const ENDS: bool = false;

    /// Whether [`escape`](Self::escape) takes what is found around the scene; if not,
    /// [`arrive`](Self::arrive) does.
    const TAKES_ESCAPED: bool = false;

    /// Samples of the emitters at vertices at the end of edge number `depth`.
    #[inline(always)]
    fn samples_at<S, G>(&self, transport: &Transport<'_, S, G>, depth: u32) -> u32 {
        transport.samples_at(depth)
    }

    /// Four random words of eight paths with these names.
    fn words<L: Lanes>(&self, names: [L::Words; 2], block: u32) -> [L::Words; 4];

    /// What the words of a block have in common for all paths of the batch, if they are named by
    /// pixels that are near each other.
    #[inline(always)]
    fn common<L: Lanes>(&self, _block: u32) -> Option<SobolScrambles> {
        None
    }

    /// [`words`](Self::words), with what they have in common if it is known.
    #[inline(always)]
    fn words_by<L: Lanes>(
        &self,
        _common: Option<&SobolScrambles>,
        names: [L::Words; 2],
        block: u32,
    ) -> [L::Words; 4] {
        self.words::<L>(names, block)
    }

    /// [`words`](Self::words) of one path.
    #[inline(always)]
    fn words_alone(&self, names: [u32; 2], block: u32) -> [u32; 4] {
        let names = names.map(<ArrayLanes as Lanes>::Words::splat);
        let words = self.words::<ArrayLanes>(names, block);
        words.map(|words| words.store()[0])
    }

    /// This number of paths have traced their rays, their edges number `depth`.
    #[inline(always)]
    fn hit<K: Copy + Default>(
        &mut self,
        _scene: &Scene,
        _depth: u32,
        _paths: (&Paths<K>, usize),
        _hits: &HitBatch,
    ) {
    }

    /// A path's ray, its edge number `depth`, has hit `point`, or the environment. There may be no
    /// emission there.
    fn arrive<S: EmitterSampler, G: DirectionGuide>(
        &mut self,
        transport: &Transport<'_, S, G>,
        place: usize,
        depth: u32,
        path: &PathState<S::Site>,
        ray: &Ray,
        point: Option<&SurfacePoint>,
    );

    /// A path's ray, its edge number `depth`, has met nothing, and brings this light from around
    /// the scene: the path's throughput and the weight that `arrive` would have are in it. Called
    /// only if [`TAKES_ESCAPED`](Self::TAKES_ESCAPED).
    #[inline(always)]
    fn escape(&mut self, _place: usize, _depth: u32, _radiance: Rgb) {}

    /// A path has reached a surface by `ray`, and nothing is sampled there yet. Returns the
    /// throughput with which it continues, or `None` if it ends. The vertex names no sample. Called
    /// only if [`ENDS`](Self::ENDS).
    #[inline(always)]
    fn goes_on(&mut self, _place: usize, vertex: &EndingVertex, _ray: &Ray) -> Option<Rgb> {
        Some(vertex.throughput)
    }

    /// Whether [`scatter`](Self::scatter) is of use for this path. Called only if
    /// [`OBSERVES`](Self::OBSERVES).
    #[inline(always)]
    fn watches(&self, _place: usize) -> bool {
        false
    }

    /// A path has reached a vertex that scatters. Called only if it is [watched](Self::watches).
    #[inline(always)]
    fn scatter(&mut self, _place: usize, _vertex: PathVertex) {}

    /// A path of `length` edges has reached an emitter by sampling it.
    fn connect(&mut self, place: usize, length: u32, radiance: Rgb);

    /// Numbers of rays that continued paths, and of rays to emitters.
    #[inline(always)]
    fn count(&mut self, _path: usize, _emitter: usize) {}

    /// The rays of `paths` (and their number), their edges number `depth`, have hit `hits`, and
    /// emitters have been sampled there once: the other samples of
    /// [`samples_at`](Transport::samples_at), if there may be any.
    #[inline(always)]
    fn sample_further<S: EmitterSampler, G: DirectionGuide>(
        &mut self,
        _transport: &Transport<'_, S, G>,
        _depth: u32,
        _paths: (&Paths<S::Site>, usize),
        _hits: &HitBatch,
    ) {
    }
}

/// A vertex for who ends paths, of a surface with this position and unit geometric normal. It names
/// no sample.
#[inline(always)]
pub(crate) fn ending_vertex<K>(
    depth: u32,
    path: &PathState<K>,
    ray: &Ray,
    [position, normal]: [Vec3; 2],
    roughness: f32,
) -> EndingVertex {
    let cosine = -normal.dot(ray.direction);
    let bounce = path.bounce.as_ref();
    EndingVertex {
        id: SampleId::default(),
        seed: 0,
        depth,
        position,
        normal: if cosine < 0.0 { -normal } else { normal },
        direction: -ray.direction,
        cos_theta: cosine.abs(),
        distance: position.distance(bounce.map_or(ray.origin, |bounce| bounce.from)),
        pdf: match bounce {
            Some(bounce) if !bounce.is_delta => bounce.pdf,
            _ => Density::new(f32::INFINITY),
        },
        throughput: path.throughput,
        roughness,
    }
}

/// The same of a vertex that is known.
#[inline(always)]
pub(crate) fn ending_surface<K>(
    depth: u32,
    path: &PathState<K>,
    ray: &Ray,
    vertex: &SurfaceVertex,
) -> EndingVertex {
    let place = [vertex.point.position, vertex.point.geometric_normal];
    let bsdf = &vertex.bsdf;
    let widths = (0..bsdf.lobe_count()).map(|lobe| bsdf.lobe_roughness(lobe));
    ending_vertex(depth, path, ray, place, widths.fold(0.0, f32::max))
}
