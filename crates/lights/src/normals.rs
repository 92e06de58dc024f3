//! Sets of emission normals, in 32 bits.
//!
//! All normals `n` of a group lie in a ball: `|n − v| ≤ ρ`. So for any vector `ω`,
//! `n·ω ≤ v·ω + ρ|ω|`: a bound without trigonometry. A cone of half-angle θ ≤ π/2
//! around `a` lies in the ball of `v = a cos θ` and `ρ = sin θ`, and every set of unit vectors
//! in that of `v = 0` and `ρ = 1`.

use crate::OrientationCone;
use glam::Vec3;
use lightshed_lanes::{AnyLanes, ArrayLanes, LANES, LaneWords, Lanes, Vec3Lanes};
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
/// The length of one step of a coordinate.
const CENTER_STEP: f32 = 1.0 / CENTER_STEPS;
/// The length of one step of the radius.
const RADIUS_STEP: f32 = 1.0 / RADIUS_STEPS;
/// Added to a number between 0 and 2²², leaves its nearest integer in the low bits.
const TO_INTEGER: f32 = (1 << 23) as f32;
/// More than the rounding errors of this module's arithmetic.
const SLACK: f32 = 1e-6;

impl NormalBall {
    /// Contains all unit vectors.
    pub const ALL: Self = Self {
        center: Vec3::ZERO,
        radius: 1.0,
    };

    /// The least ball around the cone's normals, widened if light leaves beyond 90° from all of
    /// them.
    pub fn of_cone(cone: &OrientationCone) -> Self {
        // Light leaves up to `normals_angle + emission_angle` from the axis: such directions are
        // within 90° of a cone of that angle less π/2.
        let angle = (cone.normals_angle + cone.emission_angle - FRAC_PI_2).max(0.0);
        if angle >= FRAC_PI_2 {
            return Self::ALL;
        }
        let (sin, cos) = if angle > 0.0 { angle.sin_cos() } else { (0.0, 1.0) };
        Self {
            center: cone.axis.normalize_or_zero() * cos,
            radius: sin,
        }
    }

    /// Rounded outwards to 32 bits: four bytes, those of the coordinates counted from −1.
    pub fn pack(&self) -> u32 {
        let ball = BallLanes::<ArrayLanes> {
            center: Vec3Lanes::splat((self.center * CENTER_STEPS).to_array()),
            radius: ArrayLanes::splat(self.radius * CENTER_STEPS),
        };
        ball.pack().store()[0]
    }

    /// [`Self::ALL`], packed.
    const ALL_PACKED: u32 =
        u32::from_be_bytes([CENTER_STEPS as u8, CENTER_STEPS as u8, CENTER_STEPS as u8, 255]);

    /// The inverse of [`pack`](Self::pack).
    pub fn unpack(packed: u32) -> Self {
        let [x, y, z, radius] = packed.to_be_bytes();
        let coordinate = |byte: u8| (f32::from(byte) - CENTER_STEPS) * CENTER_STEP;
        Self {
            center: Vec3::new(coordinate(x), coordinate(y), coordinate(z)),
            radius: f32::from(radius) * RADIUS_STEP,
        }
    }
}

/// Eight packed balls, lengths in steps of a coordinate: [`CENTER_STEPS`] times as long.
#[derive(Clone, Copy)]
pub(crate) struct BallLanes<L> {
    pub center: Vec3Lanes<L>,
    pub radius: L,
}

/// The byte of the coordinate nearest to this one, and its error in steps.
#[inline(always)]
fn whole_step<L: Lanes>(coordinate: L) -> (L::Words, L) {
    let from_least = (coordinate + L::splat(CENTER_STEPS))
        .max(L::splat(0.0))
        .min(L::splat(2.0 * CENTER_STEPS));
    let step = from_least + L::splat(TO_INTEGER);
    let off = step - L::splat(TO_INTEGER) - from_least;
    (step.to_bits() & L::Words::splat(0xff), off)
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

    /// Rounded outwards.
    #[inline(always)]
    pub fn pack(&self) -> L::Words {
        let byte = L::Words::splat(0xff);
        let center = self.center;
        let (x, off_x) = whole_step(center.x);
        let (y, off_y) = whole_step(center.y);
        let (z, off_z) = whole_step(center.z);
        let off = off_x * off_x + off_y * off_y + off_z * off_z;
        let radius = self.radius + off.sqrt() + L::splat(SLACK * CENTER_STEPS);
        let radius_steps = radius * L::splat(RADIUS_STEPS / CENTER_STEPS);
        // Half a step more, rounded to the nearest: never less than the value.
        let radius_byte = (radius_steps + L::splat(0.5)) + L::splat(TO_INTEGER);
        let packed =
            x.rotate::<24, 8>() + y.rotate::<16, 16>() + z.rotate::<8, 24>() + (radius_byte.to_bits() & byte);
        let all = L::from_bits(L::Words::splat(NormalBall::ALL_PACKED));
        let fits = radius_steps.less_equal(L::splat(RADIUS_STEPS));
        L::from_bits(packed).select(fits, all).to_bits()
    }

    /// Unions of packed balls; one of both where it contains the other.
    #[inline(always)]
    pub fn union(a: &[u32; LANES], b: &[u32; LANES]) -> L::Words {
        let (ball_a, ball_b) = (Self::unpack(a), Self::unpack(b));
        let across = ball_b.center - ball_a.center;
        // Centres that are equal have a distance of exactly zero.
        let distance = across.dot(across).sqrt() * L::splat(1.0 + 4.0 * f32::EPSILON);
        let radius = (distance + ball_a.radius + ball_b.radius) * L::splat(0.5);
        let part = (radius - ball_a.radius) / distance.max(L::splat(1.0));
        let union = Self {
            center: ball_a.center + across * part,
            radius,
        };
        let in_a = (distance + ball_b.radius).less_equal(ball_a.radius);
        let in_b = (distance + ball_a.radius).less_equal(ball_b.radius);
        let words = |words: &[u32; LANES]| L::from_bits(L::Words::load(words));
        let union = words(b).select(in_b, L::from_bits(union.pack()));
        words(a).select(in_a, union).to_bits()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_lanes::{LaneChoice, LaneKernel};
    use lightshed_sampling::Frame;
    use lightshed_sampling::{CounterRng, UniformCone, UniformSphere};

    /// By every kind of lanes.
    fn union(a: u32, b: u32) -> u32 {
        struct Union(u32, u32);
        impl LaneKernel for Union {
            type Output = [u32; LANES];
            #[inline(always)]
            fn run<L: Lanes>(self) -> [u32; LANES] {
                BallLanes::<L>::union(&[self.0; LANES], &[self.1; LANES]).store()
            }
        }
        let found = LaneChoice::best().run(Union(a, b));
        assert_eq!(found, LaneChoice::ARRAY.run(Union(a, b)));
        found[0]
    }

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

    /// Normals of both cones lie in the packed union of their balls, over a chain of unions as in a
    /// tree.
    #[test]
    fn packed_unions_contain_all_normals() {
        let mut rng = CounterRng::new(3, 0, 0);
        for _ in 0..2000 {
            let cones: Vec<OrientationCone> = (0..4).map(|_| random_cone(&mut rng)).collect();
            let packed: Vec<u32> = cones.iter().map(|c| NormalBall::of_cone(c).pack()).collect();
            let all = packed.into_iter().reduce(union).unwrap();
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
        assert_eq!(union(packed, packed), packed);
        assert!(NormalBall::unpack(packed).radius < 0.02);
        assert_eq!(NormalBall::unpack(NormalBall::ALL.pack()), NormalBall::ALL);
    }
}
