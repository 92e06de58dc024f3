//! How much of a path goes on.

use super::published::CachedRadiance;
use super::spread::AreaSpread;
use super::termination::Termination;
use lightshed_sampling::{LUMINANCE, Rgb};

/// What ending a path at a vertex would mean for the pixel: the record's values times what the
/// vertex counts for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Prefixed {
    /// What the cache would contribute.
    pub brightness: f32,
    /// `P`: what going on by one edge adds to the variance of a sample.
    pub variance: f32,
    /// `B²`: squared bias of ending here.
    pub bias_squared: f32,
    /// The same of ending at the next vertex, in the mean.
    pub deferred_bias_squared: f32,
}

impl Prefixed {
    /// Of a record at a vertex with a throughput, in luminance: deviations add up over the
    /// channels, which bounds the luminance's (see [`CachedRadiance`]).
    #[inline]
    pub fn new(throughput: Rgb, record: &CachedRadiance) -> Self {
        Self {
            brightness: (LUMINANCE * throughput).dot(record.radiance),
            variance: CachedRadiance::prefixed(throughput, record.deviation),
            bias_squared: CachedRadiance::prefixed(throughput, record.bias),
            deferred_bias_squared: CachedRadiance::prefixed(throughput, record.deferred_bias),
        }
    }
}

/// What a path has spent on its way, and whether it ends (Algorithm 5).
///
/// At each vertex that has a record, [`share`](Self::share) gives the share `α` of the path that
/// goes on: the pixel gets `(1 − α) T rc` from the cache, and everything that follows times
/// `α`. From the first `α` below 1 on the path ends at the next vertex that has a record, where
/// `α = 0`. At vertices without a record paths go on as they are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathBudget {
    /// `Σ P_j` of the vertices so far.
    variance: f32,
    /// The bound on it, from the first vertex with a record on.
    limit: Option<f32>,
    is_ending: bool,
    /// For [`Termination::Spread`]: the caller extends it edge by edge.
    pub spread: AreaSpread,
}

impl PathBudget {
    /// The share `α` in `[0, 1]` of the path that goes on from the vertex at the end of edge
    /// number `depth`.
    #[inline]
    pub fn share(&mut self, rule: &Termination, depth: u32, at: &Prefixed) -> f32 {
        if self.is_ending {
            return 0.0;
        }
        let share = match *rule {
            Termination::Fixed { depth: last } => f32::from(u8::from(depth < last)),
            Termination::Spread { share } => f32::from(u8::from(!self.spread.exceeds(share))),
            Termination::Variance { threshold, relative } => {
                let limit = *self.limit.get_or_insert(match relative {
                    true => threshold * at.brightness * at.brightness,
                    false => threshold,
                });
                interpolated(limit - self.variance, at.variance)
            }
            Termination::Mse { target, margin } => {
                let deferred = at.deferred_bias_squared.min(0.9 * margin * at.bias_squared);
                let here = self.variance / target + at.bias_squared;
                let further = (self.variance + at.variance) / target + deferred;
                f32::from(u8::from(!(margin * here < further)))
            }
        };
        self.variance += at.variance;
        self.is_ending = share < 1.0;
        share
    }

    /// Whether the path ends at the next vertex that has a record.
    pub fn is_ending(&self) -> bool {
        self.is_ending
    }
}

/// `α = √(left / P)` (eq. 7.15), or 1 where that is enough for all of it.
#[inline]
fn interpolated(left: f32, variance: f32) -> f32 {
    match variance > left {
        true => (left.max(0.0) / variance).sqrt(),
        false => 1.0,
    }
}
