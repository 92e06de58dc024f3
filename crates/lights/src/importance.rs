//! The weight of a node for a receiver.
//!
//! For a node of intensity `I` whose lights lie in a box of centre `c`, half-extents `h` and
//! half-diagonal `r`, with normals in the ball `|n − v| ≤ ρ`, and a point `x` with normal
//! `n_x`, let `d = c − x` and `D = max(|d|², r²)`. The weight is
//!
//! `w = I · E(−v·d, |v|·h + ρ(√D + |h|₁)) · E(n_x·d, |n_x|·h) / D²`,
//!
//! the second factor is the emission's cosine and the third the receiver's, each times a distance.
//! `E(m, s)` is the mean of `max(0, y)` over `m − s ≤ y ≤ m + s`: it is smooth, needs no
//! trigonometry, and is zero only if all of the interval is negative. The intervals contain the
//! true values for every light in the box and every normal in the ball. So a weight of zero means
//! that no light of the node reaches the point; other weights are estimates. Spreads are widened by
//! [`MARGIN`], so that rounding does not invalidate this.

use crate::approximate::{MAX_INVERSE_SQRT_TIMES_ROOT, approximate_inverse_sqrt};
use crate::block::{NodeBlock, WIDTH};
use crate::child_cdf::ChildCdf;
use crate::normals::{BallLanes, CENTER_STEPS, NormalBall};
use crate::receiver::{Facing, RaySegment, ShadingPoint};
use glam::Vec3;
use lightshed_lanes::{LaneMask, Lanes, Vec3Lanes};

/// How the distance to a node enters its weight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Weighting {
    /// Distance to the centre, at least half the box's diagonal (Conty Estevez and Kulla 2018,
    /// §5.2).
    Center,
    /// The mean of two probabilities, by the least and by the greatest distance to the box (Lin
    /// 2022 §4.3.2, eqs. 4.1 and 4.2, here among up to eight siblings). Near nodes are never much
    /// underestimated. The least distance counts as at least 0.3 % of the greatest: boxes around
    /// the point share the first probability.
    #[default]
    MinMax,
    /// The least distance to the box, unless the point is nearer to one of the siblings' boxes than
    /// its diagonal: then no distance counts (Yuksel 2019, as Lin 2022 §4.3.2 describes it).
    Yuksel,
}

/// Widening of a spread, relative to the distance: far above the rounding errors of cosines in
/// `f32`.
const MARGIN: f32 = 1e-5;
/// Lower bound of squared distances.
const MIN_SQUARED: f32 = 1e-28;
/// Lower bound of the least squared distance, as a share of the greatest.
const MIN_RATIO: f32 = 1e-5;
/// The same if nodes of different size are compared: otherwise large boxes around the point would
/// take all probability.
const MIN_RATIO_BETWEEN_BLOCKS: f32 = 1e-3;
/// Weights are at most this, 2¹²⁰, so that eight of them can be added and the sum has an
/// [`approximate_inverse`](crate::approximate::approximate_inverse).
const MAX_WEIGHT: f32 = f32::from_bits(247 << 23);
/// Added to each of the weights, whose sum is about one or two, so that every light can be selected
/// and an underestimated one has a bounded contribution.
const MIN_SHARE: f32 = 1.0 / (1 << 19) as f32;

/// `4 s E(m, s)` by the ends `m + s` and `m − s` of the interval: the difference of the squares
/// of their positive parts.
#[inline(always)]
fn clamped_mean_4s<L: Lanes>(high: L, low: L) -> L {
    let (high, low) = (high.max(L::splat(0.0)), low.max(L::splat(0.0)));
    (high - low) * (high + low)
}

/// Eight boxes relative to a point, lengths doubled: nothing cancels except the differences between
/// the corners and the point.
struct BoxesSeen<L> {
    /// To the centres.
    d: Vec3Lanes<L>,
    /// Extents.
    h: Vec3Lanes<L>,
    d_squared: L,
    h_squared: L,
}

impl<L: Lanes> BoxesSeen<L> {
    #[inline(always)]
    fn new(x: Vec3, block: &NodeBlock) -> Self {
        let x = Vec3Lanes::<L>::splat(x.to_array());
        let corner = |c: &[[f32; WIDTH]; 3]| Vec3Lanes::new(L::load(&c[0]), L::load(&c[1]), L::load(&c[2]));
        let (low, high) = (corner(&block.min) - x, corner(&block.max) - x);
        let (d, h) = (low + high, high - low);
        Self {
            d_squared: d.dot(d),
            h_squared: h.dot(h),
            d,
            h,
        }
    }

    /// Squared distance to the centre, at least half the diagonal squared.
    #[inline(always)]
    fn clamped(&self) -> L {
        self.d_squared.max(self.h_squared).max(L::splat(MIN_SQUARED))
    }

    /// Squared least and greatest distances.
    #[inline(always)]
    fn range(&self) -> (L, L) {
        let (d, zero) = (self.d.abs(), L::splat(0.0));
        let near = d - self.h;
        let near = Vec3Lanes::new(near.x.max(zero), near.y.max(zero), near.z.max(zero));
        let far = d + self.h;
        (near.dot(near), far.dot(far).max(L::splat(MIN_SQUARED)))
    }
}

/// `I E E` of eight nodes as numerators and denominators, in a common unit; only where a numerator
/// is positive.
struct WeightParts<L: Lanes> {
    numerator: L,
    denominator: L,
    positive: L::Mask,
}

#[inline(always)]
fn weight_parts<L: Lanes>(at: &ShadingPoint, block: &NodeBlock, seen: &BoxesSeen<L>) -> WeightParts<L> {
    let BoxesSeen { d, h, .. } = *seen;
    // Finite for zero, too.
    let inverse = approximate_inverse_sqrt(seen.d_squared.max(seen.h_squared));
    let BallLanes { center, radius } = BallLanes::<L>::unpack(&block.normals);
    // Means and spreads times the distance; their sums do not wait for its inverse.
    let mean = -center.dot(d);
    let spread = center.abs().dot(h) + radius * (h.x + h.y + h.z);
    let margin = radius * L::splat(MAX_INVERSE_SQRT_TIMES_ROOT) + L::splat(MARGIN * CENTER_STEPS);
    let emitted = clamped_mean_4s(
        (mean + spread) * inverse + margin,
        (mean - spread) * inverse - margin,
    );
    let emitted_spread = spread * inverse + margin;
    let intensity = L::load(&block.intensity);
    let zero = L::splat(0.0);
    if at.facing == Facing::All {
        return WeightParts {
            numerator: intensity * emitted,
            denominator: emitted_spread * L::splat(0.25),
            positive: zero.less(emitted) & zero.less(intensity),
        };
    }
    let n = Vec3Lanes::<L>::splat(at.normal.to_array());
    let (mean, spread, margin) = (n.dot(d), n.abs().dot(h), L::splat(MARGIN));
    let high = (mean + spread) * inverse + margin;
    let low = (mean - spread) * inverse - margin;
    let mut received = clamped_mean_4s(high, low);
    if at.facing == Facing::Both {
        received = received + clamped_mean_4s(-low, -high);
    }
    let both = emitted * received;
    WeightParts {
        // Factors that are known first are multiplied first.
        numerator: (intensity * received) * emitted,
        denominator: emitted_spread * (spread * inverse + margin),
        positive: zero.less(both) & zero.less(intensity),
    }
}

impl<L: Lanes> WeightParts<L> {
    /// Without the other nodes.
    #[inline(always)]
    fn masked(self, nodes: L::Mask) -> Self {
        Self {
            positive: self.positive & nodes,
            ..self
        }
    }

    /// Divided by a squared distance; zero where nothing is positive. Finite: denominators are no
    /// less than about 1e-44.
    #[inline(always)]
    fn over(&self, squared: L) -> L {
        let finite = (self.numerator / (self.denominator * squared)).min(L::splat(MAX_WEIGHT));
        finite.select(self.positive, L::splat(0.0))
    }
}

/// Weights of the nodes of `block` at a surface point, comparable with those of any other block:
/// divided by the product of the least and the greatest distance. The distance to the centre
/// underestimates near nodes: a room with a lamp behind a row of dim lights had ten times the
/// variance.
#[inline(always)]
pub(crate) fn surface_weights<L: Lanes>(at: &ShadingPoint, block: &NodeBlock) -> L {
    let seen = BoxesSeen::<L>::new(at.position, block);
    let weight_parts = weight_parts(at, block, &seen);
    let (near, far) = seen.range();
    let weights = weight_parts.over((near.max(far * L::splat(MIN_RATIO_BETWEEN_BLOCKS)) * far).sqrt());
    weights
        .max(L::splat(f32::MIN_POSITIVE))
        .select(weight_parts.positive, L::splat(0.0))
}

/// The distribution over the nodes of `block` that are in `mask`: its sum is about one, two, or
/// zero if nothing reaches the surface point.
#[inline(always)]
pub(crate) fn surface_cdf<L: Lanes>(
    at: &ShadingPoint,
    block: &NodeBlock,
    weighting: Weighting,
    mask: L::Mask,
) -> ChildCdf<L> {
    let seen = BoxesSeen::<L>::new(at.position, block);
    let weight_parts = weight_parts(at, block, &seen).masked(mask);
    match weighting {
        Weighting::MinMax => {
            let (near, far) = seen.range();
            // Known long before the numerators.
            let ratio = far / near.max(far * L::splat(MIN_RATIO));
            let by_max = weight_parts.over(far);
            let by_min = (by_max * ratio).min(L::splat(MAX_WEIGHT));
            let least = ChildCdf::new(minimum_shares(weight_parts.positive));
            ChildCdf::normalized(by_min).plus(ChildCdf::normalized(by_max).plus(least))
        }
        Weighting::Center => cdf_of(weight_parts.over(seen.clamped()), weight_parts.positive),
        Weighting::Yuksel => {
            let (near, _) = seen.range();
            let diagonal = seen.h_squared.max(L::splat(MIN_SQUARED));
            let too_near = near.less_equal(diagonal) & weight_parts.positive;
            let distance = if too_near.bits() == 0 { near } else { L::splat(1.0) };
            cdf_of(weight_parts.over(distance), weight_parts.positive)
        }
    }
}

/// The least weight of every node that can contribute: more than the rounding error.
#[inline(always)]
fn minimum_shares<L: Lanes>(positive: L::Mask) -> L {
    L::splat(MIN_SHARE).select(positive, L::splat(0.0))
}

/// The distribution of weights that are zero where they are not positive.
#[inline(always)]
fn cdf_of<L: Lanes>(weights: L, positive: L::Mask) -> ChildCdf<L> {
    ChildCdf::normalized(weights).plus(ChildCdf::new(minimum_shares(positive)))
}

/// Squared ratio of distance and half-diagonal below which a node is near. Half of it opens too few
/// nodes in a game level; twice as much takes time that never pays off.
const NEAR_SQUARED: f32 = 2.0;

/// Nodes near a point, a bit each.
#[inline(always)]
pub(crate) fn near_point<L: Lanes>(x: Vec3, block: &NodeBlock) -> u32 {
    let seen = BoxesSeen::<L>::new(x, block);
    let reach = seen.h_squared * L::splat(NEAR_SQUARED);
    seen.d_squared.less(reach).bits()
}

/// Offset from the start of a segment to a box's centre and squared half-diagonal, lengths doubled.
#[inline(always)]
fn seen_from(start: Vec3, block: &NodeBlock, lane: usize) -> (Vec3, Vec3) {
    let bounds = block.node(lane).bounds;
    let (low, high) = (bounds.min - start, bounds.max - start);
    (low + high, high - low)
}

/// Nodes near the line of a segment, a bit each.
#[inline(always)]
pub(crate) fn near_segment(at: &RaySegment, block: &NodeBlock) -> u32 {
    let mut near = 0;
    for lane in 0..WIDTH {
        let (d, h) = seen_from(at.start(), block, lane);
        let along = d.dot(at.direction()).clamp(0.0, 2.0 * at.length());
        let off = (d - at.direction() * along).length_squared();
        near |= u32::from(off < NEAR_SQUARED * h.length_squared()) << lane;
    }
    near
}

/// As [`surface_cdf`] for a segment of a ray, for any weighting.
#[inline(always)]
pub(crate) fn segment_cdf<L: Lanes>(at: &RaySegment, block: &NodeBlock, mask: L::Mask) -> ChildCdf<L> {
    let zero = L::splat(0.0);
    let weights = L::load(&segment_weights(at, block)).select(mask, zero);
    cdf_of(weights, zero.less(weights))
}

/// Weights of the nodes of `block` for a segment of a ray: `I E(…)` times the mean over the
/// segment of one over the squared distance to the box's centre, `∫ dt / (h² + t²) = γ / h`,
/// with `γ` the angle under which the segment is seen from the centre and `h` its distance from
/// the ray's line (Conty Estevez and Kulla 2018, §6), at least half the diagonal.
#[inline(never)]
pub(crate) fn segment_weights(at: &RaySegment, block: &NodeBlock) -> [f32; WIDTH] {
    let (start, direction, length) = (at.start(), at.direction(), at.length());
    let mut weights = [0.0; WIDTH];
    for (lane, weight) in weights.iter_mut().enumerate() {
        // Doubled lengths, as for points.
        let (d, h) = seen_from(start, block, lane);
        let length = 2.0 * length;
        let along = d.dot(direction);
        let off_squared = (d - direction * along).length_squared().max(h.length_squared());
        let off = off_squared.max(MIN_SQUARED).sqrt();
        let seen = (off * length).atan2(off * off - along * (length - along));

        let ball = NormalBall::unpack(block.normals[lane]);
        // From the middle of the stretch; positions differ by half of it.
        let to_middle = d - direction * (0.5 * length);
        let distance = to_middle.length().max(off) + 0.5 * length;
        let mean = -ball.center.dot(to_middle) / distance;
        let spread = ball.center.abs().dot(h)
            + 0.5 * length * ball.center.dot(direction).abs()
            + ball.radius * (h.x + h.y + h.z);
        let spread = spread / distance + (ball.radius + MARGIN);
        let t = (mean + spread).clamp(0.0, 2.0 * spread);
        let emitted = t * t / (4.0 * spread) + (mean - spread).max(0.0);
        let w = block.intensity[lane] * emitted * (seen / off);
        *weight = if emitted > 0.0 && block.intensity[lane] > 0.0 {
            // NaN, from an infinity times zero, is the largest too.
            let finite = w.min(MAX_WEIGHT);
            finite.max(f32::MIN_POSITIVE)
        } else {
            0.0
        };
    }
    weights
}
