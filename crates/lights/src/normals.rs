//! Sets of emission normals, in 32 bits.
//!
//! All normals `n` of a group lie in a ball: `|n − v| ≤ ρ`. So for any vector `ω`, `n·ω ≤ v·ω + ρ|ω|`: a bound without
//! trigonometry. A cone of half-angle θ ≤ π/2 around `a` lies in the ball of `v = a cos θ` and `ρ = sin θ`, and every set of
//! unit vectors in that of `v = 0` and `ρ = 1`.

use crate::OrientationCone;
use glam::Vec3;
use lightshed_lanes::{LANES, LaneWords, Lanes, Vec3Lanes};
use std::f32::consts::FRAC_PI_2;

/// A ball around normals, before it is packed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NormalBall {
    pub center: Vec3,
    pub radius: f32,
}

/// Steps of a coordinate of the centre in [0, 1]; bytes hold a coordinate plus one.
pub(crate) const CENTER_STEPS: f32 = 127.0;
/// Steps of the radius in [0, 1].
const RADIUS_STEPS: f32 = 255.0;
/// What one step of a coordinate is worth.
const CENTER_STEP: f32 = 1.0 / CENTER_STEPS;
/// What one step of the radius is worth.
const RADIUS_STEP: f32 = 1.0 / RADIUS_STEPS;
/// More than the rounding of this module's arithmetic.
const SLACK: f32 = 1e-6;

impl NormalBall {
    /// Contains all unit vectors.
    pub const ALL: Self = Self {
        center: Vec3::ZERO,
        radius: 1.0,
    };

    /// The least ball around the cone's normals, widened where light leaves beyond 90° from none of them.
    pub fn of_cone(cone: &OrientationCone) -> Self {
        // Light leaves up to `normals_angle + emission_angle` from the axis: such directions are within 90° of a cone of
        // that angle less π/2.
        let angle = (cone.normals_angle + cone.emission_angle - FRAC_PI_2).max(0.0);
        if angle >= FRAC_PI_2 {
            return Self::ALL;
        }
        let (sin, cos) = angle.sin_cos();
        Self {
            center: cone.axis.normalize_or_zero() * cos,
            radius: sin,
        }
    }

    /// A ball around both, no larger than [`NormalBall::ALL`].
    pub fn union(&self, other: &Self) -> Self {
        let across = other.center - self.center;
        let distance = across.length();
        if distance + other.radius <= self.radius {
            return *self;
        }
        if distance + self.radius <= other.radius {
            return *other;
        }
        let radius = 0.5 * (distance + self.radius + other.radius);
        if radius >= 1.0 {
            return Self::ALL;
        }
        let center = self.center + across * ((radius - self.radius) / distance);
        Self { center, radius }
    }

    /// Rounded outwards to 32 bits: four bytes, those of the coordinates counted from −1.
    pub fn pack(&self) -> u32 {
        let steps = (self.center * CENTER_STEPS).round();
        let off = (steps * CENTER_STEP - self.center).length();
        let radius = ((self.radius + off + SLACK) * RADIUS_STEPS).ceil();
        let byte = |step: f32| (step + CENTER_STEPS) as u8;
        if !(radius <= RADIUS_STEPS) {
            return Self::ALL_PACKED;
        }
        u32::from_be_bytes([byte(steps.x), byte(steps.y), byte(steps.z), radius as u8])
    }

    /// [`Self::ALL`], packed.
    const ALL_PACKED: u32 =
        u32::from_be_bytes([CENTER_STEPS as u8, CENTER_STEPS as u8, CENTER_STEPS as u8, 255]);

    /// What [`pack`](Self::pack) kept.
    pub fn unpack(packed: u32) -> Self {
        let [x, y, z, radius] = packed.to_be_bytes();
        let coordinate = |byte: u8| (f32::from(byte) - CENTER_STEPS) * CENTER_STEP;
        Self {
            center: Vec3::new(coordinate(x), coordinate(y), coordinate(z)),
            radius: f32::from(radius) * RADIUS_STEP,
        }
    }

    /// The union of two packed balls; itself where one contains the other.
    pub fn union_packed(a: u32, b: u32) -> u32 {
        if a == b {
            return a;
        }
        let (ball_a, ball_b) = (Self::unpack(a), Self::unpack(b));
        let distance = ball_a.center.distance(ball_b.center) + SLACK;
        if distance + ball_b.radius <= ball_a.radius {
            a
        } else if distance + ball_a.radius <= ball_b.radius {
            b
        } else {
            ball_a.union(&ball_b).pack()
        }
    }
}

/// Eight packed balls, lengths in steps of a coordinate: [`CENTER_STEPS`] times as long.
#[derive(Clone, Copy)]
pub(crate) struct BallLanes<L> {
    pub center: Vec3Lanes<L>,
    pub radius: L,
}

impl<L: Lanes> BallLanes<L> {
    /// What `packed` holds.
    #[inline(always)]
    pub fn unpack(packed: &[u32; LANES]) -> Self {
        let words = L::Words::load(packed);
        let byte = L::Words::splat(0xff);
        let coordinate = |word| L::from_integers(word) - L::splat(CENTER_STEPS);
        Self {
            center: Vec3Lanes::new(
                coordinate(words.shift_right::<24>()),
                coordinate(words.shift_right::<16>() & byte),
                coordinate(words.shift_right::<8>() & byte),
            ),
            radius: L::from_integers(words & byte) * L::splat(CENTER_STEPS * RADIUS_STEP),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::Frame;
    use lightshed_sampling::{CounterRng, UniformCone, UniformSphere};

    fn random_cone(rng: &mut CounterRng) -> OrientationCone {
        let angle = rng.next_f32() * rng.next_f32() * 3.0;
        OrientationCone {
            axis: UniformSphere::sample(rng.next_2d()),
            normals_angle: angle,
            emission_angle: FRAC_PI_2,
        }
    }

    fn normal_in(cone: &OrientationCone, rng: &mut CounterRng) -> Vec3 {
        let spread = UniformCone::from_one_minus_cos(1.0 - cone.normals_angle.cos());
        Frame::from_normal(cone.axis).to_world(spread.sample(rng.next_2d()))
    }

    /// Normals of both cones lie in the packed union of their balls, over a chain of unions as in a tree.
    #[test]
    fn packed_unions_contain_all_normals() {
        let mut rng = CounterRng::new(3, 0, 0);
        for _ in 0..2000 {
            let cones: Vec<OrientationCone> = (0..4).map(|_| random_cone(&mut rng)).collect();
            let packed: Vec<u32> = cones.iter().map(|c| NormalBall::of_cone(c).pack()).collect();
            let all = packed.iter().copied().reduce(NormalBall::union_packed).unwrap();
            let ball = NormalBall::unpack(all);
            for cone in &cones {
                for _ in 0..8 {
                    let normal = normal_in(cone, &mut rng);
                    let off = normal.distance(ball.center) - ball.radius;
                    assert!(off <= 1e-6, "{normal} is {off} outside of {ball:?}");
                }
            }
        }
    }

    #[test]
    fn equal_directions_do_not_widen() {
        let packed = NormalBall::of_cone(&OrientationCone::diffuse(Vec3::new(0.6, 0.0, 0.8))).pack();
        assert_eq!(NormalBall::union_packed(packed, packed), packed);
        assert!(NormalBall::unpack(packed).radius < 0.02);
        assert_eq!(NormalBall::unpack(NormalBall::ALL.pack()), NormalBall::ALL);
    }
}
