//! The renderer's side: samples of stored vertices.

use super::view::CacheView;
use lightshed_sampling::Rgb;
use lightshed_spatial::SurfaceSite;

/// Samples what vertices scatter: the only function that a cache needs from a renderer. `V` is a
/// vertex in the form that the renderer needs to start again from there: a ray that hits it, or a
/// point with its outgoing direction.
pub trait VertexSampler<V>: Sync {
    /// Draws independent samples of the radiance that each vertex scatters towards the origin of
    /// its path, by the same techniques as the renderer's paths. `samples` has the same number for
    /// each visit, those of the first one first. Called from any thread; a pure function of its
    /// arguments.
    fn sample(&self, cache: &CacheView<'_>, visits: &[VertexVisit<V>], samples: &mut [CacheSample<V>]);
}

/// A vertex whose turn it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexVisit<V> {
    /// The vertex.
    pub vertex: V,
    /// Where it is.
    pub site: SurfaceSite,
    /// Number of the record.
    pub slot: u32,
    /// Number of the pass; with [`slot`](Self::slot) it identifies the visit for random numbers.
    pub pass: u32,
}

/// A sample of what a vertex scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheSample<V> {
    /// `Y`: direct light, plus the cache's value at the end of the next edge times its weight.
    pub radiance: Rgb,
    /// `(w ⊙ b)²`: square of the bias of the cache's value there, times its weight.
    pub deferred_bias_squared: Rgb,
    /// The next vertex, if a cache can answer for it.
    pub next: Option<(SurfaceSite, V)>,
}

impl<V> Default for CacheSample<V> {
    /// Nothing was found.
    fn default() -> Self {
        Self {
            radiance: Rgb::ZERO,
            deferred_bias_squared: Rgb::ZERO,
            next: None,
        }
    }
}
