//! What a record tells.

use super::cell::CellMoments;
use glam::DVec3;
use lightshed_sampling::{LUMINANCE, Rgb};

/// The published values of a record: outgoing radiance of the cell, and the error of a sample of
/// it.
///
/// Variance and bias are stored for each channel, as deviations. A path's throughput is a colour,
/// and the variance of the luminance of `t ⊙ Y` does not follow from that of `Y`'s luminance. The
/// channels' deviations `σ_c` give a bound: `V[Σ l_c t_c Y_c] ≤ (Σ l_c t_c σ_c)²`, with
/// equality if the channels are perfectly correlated, as they nearly are if one colour of light
/// dominates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct CachedRadiance {
    /// `E[Y]`: radiance that the surfaces of the cell scatter, without emission.
    pub radiance: Rgb,
    /// Root of the local variance `E[V[Y|y]]` (eq. 7.16), where `Y` is a sample that continues by
    /// one edge and ends in the cache there; not below that of the surroundings, relative to the
    /// squared radiance.
    pub deviation: Rgb,
    /// Root of the squared bias of the record `E[(E[Y|y] − E[Y])²]` (eq. 7.17), 0 where its
    /// estimate is negative.
    pub bias: Rgb,
    /// Root of the mean squared bias of a path that continues by one edge: `E[(w ⊙ b)²]`, with
    /// `b` the bias of the record there and `w` its weight.
    pub deferred_bias: Rgb,
    /// Root of the variance of [`radiance`](Self::radiance) over look-ups that are moved at random
    /// ([`CacheView::query_jittered`](crate::CacheView::query_jittered)), with the surroundings:
    /// relative to the squared radiance it is the same in a block of cells.
    pub interpolation: Rgb,
    /// Number of passes it is based on; 0 if the record does not answer yet.
    pub passes: f32,
}

impl CachedRadiance {
    /// Of moments, and of the means of the squared deferred bias and of the variance over moved
    /// look-ups.
    pub(crate) fn new(moments: &CellMoments, [deferred, interpolation]: [DVec3; 2]) -> Self {
        let root = |square: DVec3| square.max(DVec3::ZERO).map(f64::sqrt).as_vec3();
        Self {
            radiance: moments.mean().as_vec3(),
            deviation: root(moments.variance()),
            bias: root(moments.bias_squared()),
            deferred_bias: root(deferred),
            interpolation: root(interpolation),
            passes: moments.weight() as f32,
        }
    }

    /// `(Σ l_c t_c d_c)²`: the square of a deviation that counts for `throughput`, in luminance.
    #[inline]
    pub(crate) fn prefixed(throughput: Rgb, deviation: Rgb) -> f32 {
        let luminance = (LUMINANCE * throughput.abs()).dot(deviation);
        luminance * luminance
    }
}
