//! What a renderer tells of stored vertices.

use super::view::CacheView;
use lightshed_sampling::Rgb;
use lightshed_spatial::SurfaceSite;

/// Samples what vertices scatter: the one thing that a cache asks of a renderer. `V` is a vertex as
/// the renderer needs it to start again from there: a ray that meets it, or a point with its
/// outgoing direction.
pub trait VertexSampler<V>: Sync {
    /// Draws independent samples of the radiance that each vertex scatters towards where its path
    /// came from, by the same techniques as the renderer's paths: `samples` has equally many for
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
    /// Number of the pass; with [`slot`](Self::slot) it names the visit for random numbers.
    pub pass: u32,
}

/// A sample of what a vertex scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheSample<V> {
    /// `Y`: direct light, and what the cache has at the end of the next edge, times what that
    /// counts for.
    pub radiance: Rgb,
    /// `(w ⊙ b)²`: square of the bias of what the cache had there, with what it counts for.
    pub deferred_bias_squared: Rgb,
    /// The next vertex, if it is one that a cache can answer for.
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
