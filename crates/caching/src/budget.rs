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
    /// `J`: the variance of what the cache would contribute, over look-ups that are moved at
    /// random; 0 if they are not.
    pub interpolation: f32,
}

impl Prefixed {
    /// From a record at a vertex with a throughput, in luminance: deviations add up over the
    /// channels, which bounds that of the luminance (see [`CachedRadiance`]). For look-ups that are
    /// not moved, set [`interpolation`](Self::interpolation) to 0.
    #[inline]
    pub fn new(throughput: Rgb, record: &CachedRadiance) -> Self {
        Self {
            brightness: (LUMINANCE * throughput).dot(record.radiance),
            variance: CachedRadiance::prefixed(throughput, record.deviation),
            bias_squared: CachedRadiance::prefixed(throughput, record.bias),
            deferred_bias_squared: CachedRadiance::prefixed(throughput, record.deferred_bias),
            interpolation: CachedRadiance::prefixed(throughput, record.interpolation),
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
                // Variances of later look-ups are in the local variances of earlier vertices.
                let moved = match self.limit {
                    None => at.interpolation,
                    Some(_) => 0.0,
                };
                let limit = *self.limit.get_or_insert(match relative {
                    true => threshold * at.brightness * at.brightness,
                    false => threshold,
                });
                interpolated(limit - self.variance, at.variance, moved)
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

/// The largest `α` in `[0, 1]` with `α² P + (1 − α)² J ≤ left`, where `J` is the variance of what
/// the cache adds. Without it, this is `√(left / P)` (eq. 7.15, which leaves it out). If no `α`
/// has so little variance, the one with the least, `J / (P + J)`.
#[inline]
fn interpolated(left: f32, variance: f32, moved: f32) -> f32 {
    // Also where nothing varies, and rounding has left less than nothing.
    if !(variance > left.max(0.0)) {
        return 1.0;
    }
    // Products of `f32` neither overflow nor vanish.
    let [left, step, moved] = [left, variance, moved].map(f64::from);
    let spare = left * (step + moved) - step * moved;
    let share = (moved + spare.max(0.0).sqrt()) / (step + moved);
    share.clamp(0.0, 1.0) as f32
}
