//! Paths that end in a cache.

use crate::path::ending::{EndingVertex, PathEnding, VertexEnding};
use lightshed_caching::{AreaSpread, CacheView, CachedRadiance, Facets, PathBudget, Prefixed, Termination};
use lightshed_film::{RayKind, RayTally};
use lightshed_sampling::CounterRng;
use lightshed_scene::glam::Vec3;
use lightshed_spatial::SurfaceSite;

/// Words of a path's stream that decide where it ends: eight a vertex from this one on, which no
/// path uses otherwise.
const FIRST_WORD: u32 = 1 << 31;

/// Ends paths in a cache by a rule ([`PathBudget`]).
///
/// Surfaces without a wide lobe are passed, mirrors and metals that are not rough: their radiance
/// belongs to a direction, not to a place. With facets, only those with narrower lobes than facets
/// are. Places without a record are passed, too.
#[derive(Clone, Copy)]
pub struct CacheEnding<'c> {
    /// The cache.
    pub cache: CacheView<'c>,
    /// The rule.
    pub rule: Termination,
    /// Where the camera is.
    pub eye: Vec3,
    /// Whether the positions of look-ups are moved at random.
    pub jitter: bool,
    /// How the directions of glossy surfaces are told apart, if they have records.
    pub facets: Option<Facets>,
    /// Probability with which a path survives each vertex except its first.
    pub survival: f32,
    /// Counts rays.
    pub rays: &'c RayTally,
}

/// Least roughness of a lobe whose radiance a record without directions represents. Below, what a
/// record averages over directions is another image than the surface reflects.
const LEAST_ROUGHNESS: f32 = 0.4;

/// A vertex in the form that the cache uses, if it may have a record for it. Cells grow with the
/// straight distance from the camera, so that a place has one record and not one for each path to
/// it.
#[inline(always)]
pub(super) fn site(vertex: &EndingVertex, eye: Vec3, facets: Option<Facets>) -> Option<SurfaceSite> {
    let facet = match (vertex.roughness >= LEAST_ROUGHNESS, facets) {
        (true, _) => 0,
        // A facet is about 3.5 / n wide, a lobe of reflection about 3 α.
        (false, Some(facets)) if vertex.roughness * f32::from(facets.side()) >= 1.0 => {
            facets.facet(vertex.direction)
        }
        _ => return None,
    };
    let site = SurfaceSite::new(vertex.position, vertex.normal).with_facet(facet);
    Some(site.with_eye_distance(vertex.position.distance(eye)))
}

/// The record of a vertex at `site`, looked up at a place and, if it has a facet, in a direction
/// moved at random.
#[inline(always)]
pub(super) fn query_moved<'c>(
    cache: &CacheView<'c>,
    site: &SurfaceSite,
    direction: Vec3,
    facets: Option<Facets>,
    rng: &mut CounterRng,
) -> Option<&'c CachedRadiance> {
    let u = rng.next_2d();
    if let (1.., Some(facets)) = (site.facet, facets) {
        let moved = site.with_facet(facets.moved(direction, rng.next_2d()));
        return cache
            .query(&cache.cells().jittered(&moved, u))
            .or_else(|| cache.query(site));
    }
    cache.query_jittered(site, u)
}

/// Random numbers for ending a path at a vertex: a stream of four words.
#[inline(always)]
pub(super) fn numbers([pixel, sample]: [u32; 2], seed: u64, depth: u32) -> CounterRng {
    let mut rng = CounterRng::new(seed, pixel, sample);
    rng.set_dimension(FIRST_WORD.wrapping_add(depth.wrapping_mul(8)));
    rng
}

impl PathEnding for CacheEnding<'_> {
    type Path = PathBudget;

    #[inline]
    fn at(&self, budget: &mut PathBudget, vertex: &EndingVertex) -> VertexEnding {
        if vertex.depth == 1 {
            budget.spread = AreaSpread::first(vertex.distance, vertex.cos_theta);
        } else {
            let spread = &mut budget.spread;
            spread.extend(vertex.distance, vertex.pdf, vertex.cos_theta);
        }
        let name = [vertex.id.y << 16 | vertex.id.x, vertex.id.index];
        let mut rng = numbers(name, vertex.seed, vertex.depth);
        let mut factor = 1.0;
        if self.survival < 1.0 && vertex.depth > 1 {
            if rng.next_f32() >= self.survival {
                return VertexEnding {
                    goes_on: 0.0,
                    ..VertexEnding::GO_ON
                };
            }
            factor = 1.0 / self.survival;
        }
        let go_on = VertexEnding {
            goes_on: factor,
            ..VertexEnding::GO_ON
        };
        let Some(site) = site(vertex, self.eye, self.facets) else {
            return go_on;
        };
        let cached = match self.jitter {
            true => query_moved(&self.cache, &site, vertex.direction, self.facets, &mut rng),
            false => self.cache.query(&site),
        };
        let Some(cached) = cached else {
            return go_on;
        };
        let throughput = vertex.throughput * factor;
        let mut prefixed = Prefixed::new(throughput, cached);
        if !self.jitter {
            prefixed.interpolation = 0.0;
        }
        let share = budget.share(&self.rule, vertex.depth, &prefixed);
        VertexEnding {
            radiance: (1.0 - share) * throughput * cached.radiance,
            goes_on: share * factor,
        }
    }

    #[inline]
    fn count(&self, path: usize, emitter: usize) {
        self.rays.add(RayKind::Path, path);
        self.rays.add(RayKind::Emitter, emitter);
    }
}
