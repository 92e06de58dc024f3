//! How much of a path goes on.

use super::published::CachedRadiance;
use super::spread::AreaSpread;
use super::termination::Termination;
use lightshed_sampling::{LUMINANCE, Rgb};

/// The effect on the pixel of ending a path at a vertex: the record's values times the vertex's
/// throughput.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Prefixed {
    /// What the cache would contribute.
    pub brightness: f32,
    /// `P`: the variance of a sample that one more edge adds.
    pub variance: f32,
    /// `B²`: squared bias of ending here.
    pub bias_squared: f32,
    /// The same for ending at the next vertex, on average.
    pub deferred_bias_squared: f32,
}

impl Prefixed {
    /// From a record at a vertex with a throughput, in luminance: deviations add up over the
    /// channels, which bounds that of the luminance (see [`CachedRadiance`]).
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

/// The variance that a path has used so far, and whether it ends (Algorithm 5).
///
/// At each vertex that has a record, [`share`](Self::share) returns the share `α` of the path that
/// continues: the pixel gets `(1 − α) T rc` from the cache, and everything that follows times
/// `α`. After the first `α` below 1 the path ends at the next vertex that has a record, where
/// `α = 0`. At vertices without a record paths continue unchanged.
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
    /// The share `α` in `[0, 1]` of the path that continues from the vertex at the end of edge
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

/// `α = √(left / P)` (eq. 7.15), or 1 if that suffices for all of it.
#[inline]
fn interpolated(left: f32, variance: f32) -> f32 {
    match variance > left {
        true => (left.max(0.0) / variance).sqrt(),
        false => 1.0,
    }
}
