//! How much a node is likely to send to a receiver.
//!
//! For a node of intensity `I` whose lights lie in a box of centre `c`, half-extents `h` and half-diagonal `r`, with normals in
//! the ball `|n − v| ≤ ρ`, and a point `x` with normal `n_x`, let `d = c − x` and `D = max(|d|², r²)`. The weight is
//!
//! `w = I · E(−v·d, |v|·h + ρ(√D + |h|₁)) · E(n_x·d, |n_x|·h) / D²`,
//!
//! the second factor the emission's cosine and the third the receiver's, each times a distance. `E(m, s)` is the mean of
//! `max(0, y)` over `m − s ≤ y ≤ m + s`: it is smooth, needs no trigonometry, and is zero only if all of the interval is
//! negative. Since the intervals contain the true values for every light in the box and every normal in the ball, a
//! weight of zero means that no light of the node reaches the point: a bound where it matters, and an estimate
//! everywhere else. Spreads are widened by [`MARGIN`], so that rounding does not undo this.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays at once")]

use crate::block::{NodeBlock, WIDTH};
use crate::normals::{CENTER_STEP, RADIUS_STEP};
use crate::receiver::{Facing, RaySegment, ShadingPoint};
use glam::Vec3;

/// How the distance to a node enters its weight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weighting {
    /// Distance to the centre, at least half the box's diagonal (Conty Estevez and Kulla 2018, §5.2).
    Center,
    /// The mean of two probabilities, by the least and by the greatest distance to the box (Lin 2022 §4.3.2, eqs. 4.1
    /// and 4.2, here among up to eight siblings). What is near is never much underestimated. Where the point is inside boxes, they share the first probability
    /// regardless of distance.
    #[default]
    MinMax,
    /// The least distance to the box, unless the point is nearer to one of the siblings' boxes than its diagonal: then none's
    /// distance counts (Yuksel 2019, as Lin 2022 §4.3.2 describes it).
    Yuksel,
}

/// Widening of a spread, relative to the distance: far above the rounding errors of cosines in `f32`.
const MARGIN: f32 = 1e-5;
/// Squared distances are at least this.
const LEAST_SQUARED: f32 = 1e-30;
/// Weights are at most this, so that eight of them can be added.
const LARGEST: f32 = f32::MAX / 16.0;

#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// `4 s E(m, s)` for `s > 0`.
#[inline(always)]
fn clamped_mean_4s(m: f32, s: f32) -> f32 {
    let t = min(max(m + s, 0.0), s + s);
    t * t + 4.0 * s * max(m - s, 0.0)
}

/// A coordinate of the centre of a packed normal ball.
#[inline(always)]
fn ball_coordinate(packed: u32, shift: u32) -> f32 {
    ((packed << shift) as i32 >> 24) as f32 * CENTER_STEP
}

/// For eight nodes, twice the offset from `x` to the centre and twice the half-extents.
struct Offsets {
    d: [[f32; WIDTH]; 3],
    h: [[f32; WIDTH]; 3],
    /// Squared least and greatest distances to the box, times four.
    nearest: [f32; WIDTH],
    farthest: [f32; WIDTH],
}

/// Weights of the nodes of `block` at a surface point.
#[inline(always)]
pub(crate) fn surface_weights(at: &ShadingPoint, block: &NodeBlock, weighting: Weighting) -> [f32; WIDTH] {
    // What is asked for most is compiled in place, the others apart.
    match (weighting, at.facing) {
        (Weighting::Center, Facing::Front) => center_weights::<0>(at, block),
        (Weighting::MinMax, Facing::Front) => range_weights::<0>(at, block, Weighting::MinMax),
        _ => other_surface_weights(at, block, weighting),
    }
}

#[inline(never)]
fn other_surface_weights(at: &ShadingPoint, block: &NodeBlock, weighting: Weighting) -> [f32; WIDTH] {
    match (weighting, at.facing) {
        (Weighting::Center, Facing::Front) => center_weights::<0>(at, block),
        (Weighting::Center, Facing::Both) => center_weights::<1>(at, block),
        (Weighting::Center, Facing::All) => center_weights::<2>(at, block),
        (_, Facing::Front) => range_weights::<0>(at, block, weighting),
        (_, Facing::Both) => range_weights::<1>(at, block, weighting),
        (_, Facing::All) => range_weights::<2>(at, block, weighting),
    }
}

/// Directional factor `I E E / D` of a lane, and `1/D`, all in units in which lengths are doubled.
#[inline(always)]
fn directional<const FACING: u8>(
    at: &ShadingPoint,
    block: &NodeBlock,
    lane: usize,
    d: [f32; 3],
    h: [f32; 3],
) -> (f32, f32) {
    let d_squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    let r_squared = h[0] * h[0] + h[1] * h[1] + h[2] * h[2];
    let clamped = max(max(d_squared, r_squared), LEAST_SQUARED);
    let inverse = 1.0 / clamped.sqrt();

    let normals = block.normals[lane];
    let (vx, vy, vz) = (
        ball_coordinate(normals, 0),
        ball_coordinate(normals, 8),
        ball_coordinate(normals, 16),
    );
    let rho = (normals & 0xff) as i32 as f32 * RADIUS_STEP;
    let h_sum = h[0] + h[1] + h[2];
    let m_e = -(vx * d[0] + vy * d[1] + vz * d[2]) * inverse;
    let spread = vx.abs() * h[0] + vy.abs() * h[1] + vz.abs() * h[2] + rho * h_sum;
    let s_e = spread * inverse + (rho + MARGIN);
    let emitted = clamped_mean_4s(m_e, s_e);

    let (received, s_r) = if FACING == 2 {
        (1.0, 0.25)
    } else {
        let n = at.normal;
        let m = (n.x * d[0] + n.y * d[1] + n.z * d[2]) * inverse;
        let s = (n.x.abs() * h[0] + n.y.abs() * h[1] + n.z.abs() * h[2]) * inverse + MARGIN;
        let front = clamped_mean_4s(m, s);
        (
            if FACING == 1 {
                front + clamped_mean_4s(-m, s)
            } else {
                front
            },
            s,
        )
    };
    let factor = emitted * received / (16.0 * s_e * s_r);
    (block.intensity[lane] * factor, inverse * inverse)
}

#[inline(always)]
fn center_weights<const FACING: u8>(at: &ShadingPoint, block: &NodeBlock) -> [f32; WIDTH] {
    let x = at.position;
    let mut weights = [0.0; WIDTH];
    for lane in 0..WIDTH {
        let (d, h) = offsets(block, lane, x);
        let (directed, inverse_squared) = directional::<FACING>(at, block, lane, d, h);
        weights[lane] = min(directed * inverse_squared, LARGEST);
    }
    weights
}

/// Twice the offset from `x` to the centre of a box, and twice its half-extents: no cancellation but that of the corners'
/// own differences from `x`.
#[inline(always)]
fn offsets(block: &NodeBlock, lane: usize, x: Vec3) -> ([f32; 3], [f32; 3]) {
    let x = [x.x, x.y, x.z];
    let (mut d, mut h) = ([0.0; 3], [0.0; 3]);
    for axis in 0..3 {
        let (low, high) = (block.min[axis][lane] - x[axis], block.max[axis][lane] - x[axis]);
        d[axis] = low + high;
        h[axis] = high - low;
    }
    (d, h)
}

/// The weightings by least and greatest distance.
#[inline(always)]
fn range_weights<const FACING: u8>(
    at: &ShadingPoint,
    block: &NodeBlock,
    weighting: Weighting,
) -> [f32; WIDTH] {
    let x = at.position;
    let mut directed = [0.0; WIDTH];
    let mut reach = Offsets {
        d: [[0.0; WIDTH]; 3],
        h: [[0.0; WIDTH]; 3],
        nearest: [0.0; WIDTH],
        farthest: [0.0; WIDTH],
    };
    for lane in 0..WIDTH {
        let (d, h) = offsets(block, lane, x);
        directed[lane] = min(directional::<FACING>(at, block, lane, d, h).0, LARGEST);
        for axis in 0..3 {
            reach.d[axis][lane] = d[axis];
            reach.h[axis][lane] = h[axis];
        }
        let (mut nearest, mut farthest) = (0.0, 0.0);
        for axis in 0..3 {
            let near = max(d[axis].abs() - h[axis], 0.0);
            let far = d[axis].abs() + h[axis];
            nearest += near * near;
            farthest += far * far;
        }
        reach.nearest[lane] = nearest;
        reach.farthest[lane] = max(farthest, LEAST_SQUARED);
    }
    match weighting {
        Weighting::Yuksel => yuksel(&directed, &reach),
        _ => min_max(&directed, &reach),
    }
}

/// Eqs. 4.1 and 4.2.
#[inline(always)]
fn min_max(directed: &[f32; WIDTH], reach: &Offsets) -> [f32; WIDTH] {
    let mut inside = false;
    for lane in 0..WIDTH {
        inside |= directed[lane] > 0.0 && reach.nearest[lane] < LEAST_SQUARED;
    }
    let (mut by_min, mut by_max) = ([0.0; WIDTH], [0.0; WIDTH]);
    for lane in 0..WIDTH {
        let near = reach.nearest[lane];
        by_min[lane] = if inside {
            if near < LEAST_SQUARED { directed[lane] } else { 0.0 }
        } else {
            min(directed[lane] / max(near, LEAST_SQUARED), LARGEST)
        };
        by_max[lane] = min(directed[lane] / reach.farthest[lane], LARGEST);
    }
    let (inverse_min, inverse_max) = (inverse_of_sum(&by_min), inverse_of_sum(&by_max));
    let mut weights = [0.0; WIDTH];
    for lane in 0..WIDTH {
        let w = by_min[lane] * inverse_min + by_max[lane] * inverse_max;
        // Both terms may have vanished by rounding where the factor has not.
        weights[lane] = if directed[lane] > 0.0 {
            max(w, f32::MIN_POSITIVE)
        } else {
            0.0
        };
    }
    weights
}

/// One over the sum, or 0 where that is too small to have an inverse.
#[inline(always)]
fn inverse_of_sum(w: &[f32; WIDTH]) -> f32 {
    let sum = ((w[0] + w[1]) + (w[2] + w[3])) + ((w[4] + w[5]) + (w[6] + w[7]));
    if sum > 1e-36 { 1.0 / sum } else { 0.0 }
}

#[inline(always)]
fn yuksel(directed: &[f32; WIDTH], reach: &Offsets) -> [f32; WIDTH] {
    let mut too_near = false;
    for lane in 0..WIDTH {
        let diagonal: f32 = (0..3).map(|a| reach.h[a][lane] * reach.h[a][lane]).sum();
        too_near |= directed[lane] > 0.0 && reach.nearest[lane] <= max(diagonal, LEAST_SQUARED);
    }
    let mut weights = [0.0; WIDTH];
    for lane in 0..WIDTH {
        weights[lane] = if too_near {
            directed[lane]
        } else {
            min(directed[lane] / reach.nearest[lane], LARGEST)
        };
    }
    weights
}

/// Squared ratio of distance and half-diagonal below which a node is near.
const NEAR_SQUARED: f32 = 4.0;

/// Nodes near a point.
#[inline(always)]
pub(crate) fn near_point(x: Vec3, block: &NodeBlock) -> [bool; WIDTH] {
    let mut near = [false; WIDTH];
    for lane in 0..WIDTH {
        let (d, h) = offsets(block, lane, x);
        let d_squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let r_squared = h[0] * h[0] + h[1] * h[1] + h[2] * h[2];
        near[lane] = d_squared < NEAR_SQUARED * r_squared;
    }
    near
}

/// Nodes near the line of a stretch.
#[inline(always)]
pub(crate) fn near_segment(at: &RaySegment, block: &NodeBlock) -> [bool; WIDTH] {
    let mut near = [false; WIDTH];
    for lane in 0..WIDTH {
        let (d, h) = offsets(block, lane, at.start());
        let d = Vec3::from(d);
        let along = d.dot(at.direction()).clamp(0.0, 2.0 * at.length());
        let r_squared = h[0] * h[0] + h[1] * h[1] + h[2] * h[2];
        near[lane] = (d - at.direction() * along).length_squared() < NEAR_SQUARED * r_squared;
    }
    near
}

/// Weights of the nodes of `block` for a stretch of a ray: `I E(…)` times the mean over the stretch of one over the squared
/// distance to the box's centre, `∫ dt / (h² + t²) = γ / h`, with `γ` the angle under which the stretch is seen from the centre
/// and `h` its distance from the ray's line (Conty Estevez and Kulla 2018, §6), at least half the diagonal. All weightings are
/// the same here.
#[inline(always)]
pub(crate) fn segment_weights(at: &RaySegment, block: &NodeBlock, _: Weighting) -> [f32; WIDTH] {
    let (start, direction, length) = (at.start(), at.direction(), at.length());
    let mut weights = [0.0; WIDTH];
    for lane in 0..WIDTH {
        // Doubled lengths, as for points.
        let (d, h) = offsets(block, lane, start);
        let d = Vec3::from(d);
        let length = 2.0 * length;
        let along = d.dot(direction);
        let r_squared = h[0] * h[0] + h[1] * h[1] + h[2] * h[2];
        let off_squared = max((d - direction * along).length_squared(), r_squared);
        let off = max(off_squared, LEAST_SQUARED).sqrt();
        let seen = (off * length).atan2(off * off - along * (length - along));

        let normals = block.normals[lane];
        let v = Vec3::new(
            ball_coordinate(normals, 0),
            ball_coordinate(normals, 8),
            ball_coordinate(normals, 16),
        );
        let rho = (normals & 0xff) as i32 as f32 * RADIUS_STEP;
        // From the middle of the stretch; positions differ by half of it.
        let to_middle = d - direction * (0.5 * length);
        let distance = max(to_middle.length(), off) + 0.5 * length;
        let m_e = -v.dot(to_middle) / distance;
        let h_sum = h[0] + h[1] + h[2];
        let spread = v.abs().dot(Vec3::from(h)) + 0.5 * length * v.dot(direction).abs() + rho * h_sum;
        let s_e = spread / distance + (rho + MARGIN);
        let emitted = clamped_mean_4s(m_e, s_e) / (4.0 * s_e);
        weights[lane] = min(block.intensity[lane] * emitted * (seen / off), LARGEST);
    }
    weights
}
