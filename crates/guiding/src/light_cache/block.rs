//! Lights as a cache weights them, eight at a time.
//!
//! Let `c` be the middle of a light, `r` the radius of a ball around `c` that contains the light,
//! `n` its normal (zero if it emits in all directions), `d = c − x`, and `n_x` the normal at the
//! receiver `x`. The weight is
//!
//! `w = s · max(0, o‖d‖ − n·d + r) · max(0, n_x·d + r) / max(‖d‖, r)⁴`:
//!
//! the irradiance by the light's intensity `s`, times a learnt number, with both cosines bounded by
//! those of the ball. `o` is 1 if the light emits in all directions, otherwise 0. The weight is
//! zero only if no point of the light sends anything to `x`. For a glossy receiver, a part of the
//! last cosine, `max(0, n_x·d + r) / max(‖d‖, r)`, is replaced by the mean of the receiver's lobe
//! over the ball ([`ReflectionLobe`]).

use crate::lobe::ReflectionLobe;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lightshed_lanes::{LANES, Lanes, Vec3Lanes};
use lightshed_lights::{Facing, Light, ShadingPoint};

/// A light, or a group of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WeighedLight {
    /// Middle.
    pub center: Vec3,
    /// Radius of a ball around the middle.
    pub radius: f32,
    /// Normal; of a group the mean, which is shorter than 1.
    pub normal: Vec3,
    /// 1 for a light that emits in all directions; for a group the value that makes the cosine a
    /// bound.
    pub all_around: f32,
    /// Radiant intensity.
    pub intensity: f32,
}

impl WeighedLight {
    pub fn new(light: &Light) -> Self {
        let (normal, all_around) = match light.cone {
            Some(cone) if cone.normals_angle == 0.0 => (cone.axis, 0.0),
            _ => (Vec3::ZERO, 1.0),
        };
        Self {
            center: light.bounds.center(),
            // Rounded up, so that no corner is left out.
            radius: 0.5 * light.bounds.diagonal().length() * (1.0 + 1e-5) + 1e-12,
            normal,
            all_around,
            intensity: light.intensity,
        }
    }

    /// A group whose weight is about the sum of its members' weights, and zero only if all of them
    /// are.
    pub fn group(members: &[Self]) -> Self {
        let total: f32 = members.iter().map(|light| light.intensity).sum();
        if !(total > 0.0) {
            return Self::default();
        }
        let mean = |value: &dyn Fn(&Self) -> Vec3| -> Vec3 {
            members
                .iter()
                .map(|light| value(light) * (light.intensity / total))
                .sum()
        };
        let (center, normal) = (mean(&|light| light.center), mean(&|light| light.normal));
        let shining = || members.iter().filter(|light| light.intensity > 0.0);
        let reach = |light: &Self| (light.center - center).length() + light.radius;
        let spread = |light: &Self| light.all_around + (light.normal - normal).length();
        Self {
            center,
            normal,
            radius: shining().map(reach).fold(0.0, f32::max) * (1.0 + 1e-5),
            all_around: shining().map(spread).fold(0.0, f32::max),
            intensity: total,
        }
    }
}

/// A receiver and its lobe.
#[derive(Clone, Copy)]
pub(super) struct Receiver<'a> {
    pub at: &'a ShadingPoint,
    lobe: Option<ReflectionLobe>,
}

impl<'a> Receiver<'a> {
    /// Of a receiver whose gloss counts `with_lobe`.
    #[inline(always)]
    pub fn new(at: &'a ShadingPoint, with_lobe: bool) -> Self {
        let lobe = match with_lobe {
            true => ReflectionLobe::of(at),
            false => None,
        };
        Self { at, lobe }
    }
}

/// Eight of them.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub(super) struct LightBlock {
    center: [[f32; LANES]; 3],
    normal: [[f32; LANES]; 3],
    radius: [f32; LANES],
    all_around: [f32; LANES],
    intensity: [f32; LANES],
    /// Numbers of the lights; [`LightBlock::NONE`] where there is none.
    pub lights: [u32; LANES],
}

/// Squared distances are at least this.
const MIN_SQUARED: f32 = 1e-18;
/// Weights are at most this, so that sums of them are finite.
const MAX_WEIGHT: f32 = 1e30;
/// A light that can contribute has at least this weight.
const MIN_WEIGHT: f32 = 1e-30;

impl LightBlock {
    pub const NONE: u32 = u32::MAX;
    /// Rows of four words.
    pub const ROWS: usize = size_of::<Self>() / 16;

    pub const EMPTY: Self = Self {
        center: [[0.0; LANES]; 3],
        normal: [[0.0; LANES]; 3],
        radius: [0.0; LANES],
        all_around: [0.0; LANES],
        intensity: [0.0; LANES],
        lights: [Self::NONE; LANES],
    };

    /// Puts a light with its number into a lane.
    pub fn set(&mut self, lane: usize, number: u32, light: &WeighedLight) {
        for axis in 0..3 {
            self.center[axis][lane] = light.center[axis];
            self.normal[axis][lane] = light.normal[axis];
        }
        self.radius[lane] = light.radius;
        self.all_around[lane] = light.all_around;
        self.intensity[lane] = light.intensity;
        self.lights[lane] = number;
    }

    /// Appends lights with their numbers, in blocks that begin with the first.
    pub fn push_all<'a>(blocks: &mut Vec<Self>, lights: impl Iterator<Item = (u32, &'a WeighedLight)>) {
        for (i, (number, light)) in lights.enumerate() {
            if i % LANES == 0 {
                blocks.push(Self::EMPTY);
            }
            if let Some(block) = blocks.last_mut() {
                block.set(i % LANES, number, light);
            }
        }
    }

    /// Weights for a receiver.
    #[inline(always)]
    pub fn weights<L: Lanes>(&self, to: &Receiver<'_>) -> L {
        let at = to.at;
        let load = |rows: &[[f32; LANES]; 3]| {
            Vec3Lanes::<L>::new(L::load(&rows[0]), L::load(&rows[1]), L::load(&rows[2]))
        };
        let zero = L::splat(0.0);
        let d = load(&self.center) - Vec3Lanes::splat(at.position.to_array());
        let (radius, intensity) = (L::load(&self.radius), L::load(&self.intensity));
        let squared = d.dot(d);
        let distance = squared.sqrt();
        let emitted = L::load(&self.all_around) * distance - load(&self.normal).dot(d) + radius;
        let received = match at.facing {
            Facing::All => distance + radius,
            Facing::Front => Vec3Lanes::<L>::splat(at.normal.to_array()).dot(d) + radius,
            Facing::Both => Vec3Lanes::<L>::splat(at.normal.to_array()).dot(d).abs() + radius,
        };
        let clamped = squared.max(radius * radius).max(L::splat(MIN_SQUARED));
        let weight = match &to.lobe {
            None => (intensity * emitted.max(zero) / clamped) * (received.max(zero) / clamped),
            Some(lobe) => {
                let length = clamped.sqrt();
                let cosine = received.max(zero) / length;
                let reflected = lobe.weights(d, squared, radius * radius / clamped, cosine);
                (intensity * emitted.max(zero) / clamped) * (reflected / length)
            }
        };
        let positive = zero.less(intensity) & zero.less(emitted) & zero.less(received);
        let weight = weight.min(L::splat(MAX_WEIGHT)).max(L::splat(MIN_WEIGHT));
        weight.select(positive, zero)
    }

    /// The same for one lane without lanes: the reference of the tests.
    #[cfg(test)]
    pub fn naive_weight(&self, lane: usize, at: &ShadingPoint) -> f64 {
        let vector = |rows: &[[f32; LANES]; 3]| {
            glam::DVec3::new(rows[0][lane].into(), rows[1][lane].into(), rows[2][lane].into())
        };
        let d = vector(&self.center) - at.position.as_dvec3();
        let r = f64::from(self.radius[lane]);
        let emitted = f64::from(self.all_around[lane]) * d.length() - vector(&self.normal).dot(d) + r;
        let along = at.normal.as_dvec3().dot(d);
        let received = r + match at.facing {
            Facing::All => d.length(),
            Facing::Front => along,
            Facing::Both => along.abs(),
        };
        let clamped = d.length_squared().max(r * r).max(f64::from(MIN_SQUARED));
        f64::from(self.intensity[lane]) * emitted.max(0.0) * received.max(0.0) / (clamped * clamped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_lanes::{ArrayLanes, LaneChoice, LaneKernel};
    use lightshed_lights::{Bounds, Gloss, OrientationCone};
    use lightshed_sampling::{CounterRng, UniformSphere};

    struct Weigh<'a>(&'a LightBlock, Receiver<'a>);

    impl LaneKernel for Weigh<'_> {
        type Output = [f32; LANES];

        #[inline(always)]
        fn run<L: Lanes>(self) -> [f32; LANES] {
            self.0.weights::<L>(&self.1).store()
        }
    }

    fn lights(seed: u64) -> Vec<Light> {
        (0..8)
            .map(|i| {
                let mut rng = CounterRng::new(seed, i, 0);
                let center = UniformSphere::sample(rng.next_2d()) * (3.0 * rng.next_f32());
                let half = 0.2 * rng.next_f32();
                Light {
                    bounds: Bounds::new(center - half, center + half),
                    intensity: rng.next_f32(),
                    cone: (i % 3 > 0).then(|| OrientationCone::diffuse(UniformSphere::sample(rng.next_2d()))),
                }
            })
            .collect()
    }

    fn receivers(seed: u64) -> impl Iterator<Item = ShadingPoint> {
        (0..60).map(move |i| {
            let mut rng = CounterRng::new(seed, i, 1);
            ShadingPoint {
                position: UniformSphere::sample(rng.next_2d()) * rng.next_f32(),
                normal: UniformSphere::sample(rng.next_2d()),
                facing: [Facing::Front, Facing::Both, Facing::All][i as usize % 3],
                reflectance_bound: 1.0,
                gloss: Gloss {
                    viewer: UniformSphere::sample(rng.next_2d()),
                    roughness: rng.next_f32(),
                    share: [0.0, rng.next_f32()][i as usize / 3 % 2],
                },
            }
        })
    }

    #[test]
    fn lanes_agree_with_the_formula() {
        for seed in 0..20 {
            let mut block = LightBlock::EMPTY;
            for (lane, light) in lights(seed).iter().enumerate() {
                block.set(lane, lane as u32, &WeighedLight::new(light));
            }
            for at in receivers(seed) {
                let glossy = Receiver::new(&at, true);
                let found = LaneChoice::best().run(Weigh(&block, glossy));
                assert_eq!(found, block.weights::<ArrayLanes>(&glossy).store());
                let to = Receiver::new(&at, false);
                let found = LaneChoice::best().run(Weigh(&block, to));
                assert_eq!(found, block.weights::<ArrayLanes>(&to).store());
                for (lane, found) in found.into_iter().enumerate() {
                    let truth = block.naive_weight(lane, &at);
                    // Cosines cancel in single precision.
                    let scale = truth + 1e-5 * f64::from(block.intensity[lane]) / 1e-2;
                    assert!(
                        (f64::from(found) - truth).abs() < 1e-3 * scale,
                        "{found}, not {truth}"
                    );
                }
            }
        }
    }

    /// A weight of zero means that no corner of a light, and no member of a group, sends anything.
    #[test]
    fn weights_are_zero_only_where_nothing_arrives() {
        let sends = |light: &Light, at: &ShadingPoint| {
            (0..8).any(|corner| {
                let pick = |axis: usize| {
                    if corner >> axis & 1 == 0 {
                        light.bounds.min
                    } else {
                        light.bounds.max
                    }
                };
                let place = Vec3::new(pick(0).x, pick(1).y, pick(2).z);
                let d = place - at.position;
                let emits = light.cone.is_none_or(|cone| cone.axis.dot(d) < 0.0);
                let receives = match at.facing {
                    Facing::Front => at.normal.dot(d) > 0.0,
                    _ => true,
                };
                emits && receives && light.intensity > 0.0
            })
        };
        let mut zeros = 0;
        for seed in 0..40 {
            let lights = lights(seed);
            let weighed: Vec<WeighedLight> = lights.iter().map(WeighedLight::new).collect();
            let mut block = LightBlock::EMPTY;
            weighed
                .iter()
                .enumerate()
                .for_each(|(lane, light)| block.set(lane, lane as u32, light));
            let mut group = LightBlock::EMPTY;
            group.set(0, 0, &WeighedLight::group(&weighed[..4]));
            for at in receivers(seed) {
                let to = Receiver::new(&at, true);
                let weights = block.weights::<ArrayLanes>(&to).store();
                for (light, weight) in lights.iter().zip(weights) {
                    assert!(weight > 0.0 || !sends(light, &at));
                    zeros += u32::from(weight == 0.0);
                }
                let of_group = group.weights::<ArrayLanes>(&to).first();
                assert!(of_group > 0.0 || weights[..4].iter().all(|&weight| weight == 0.0));
            }
        }
        assert!(zeros > 1000);
    }

    /// Whatever is finite leads to weights that are finite, and a lobe hides no light that the
    /// cosine sees.
    #[test]
    fn finite_points_have_finite_weights() {
        for seed in 0..20_000 {
            let mut rng = CounterRng::new(99, seed, 0);
            let mut number = || {
                let x = f32::from_bits(rng.next_u32());
                if x.is_finite() { x } else { 1.0 }
            };
            let at = ShadingPoint {
                position: Vec3::new(number(), number(), number()),
                normal: Vec3::new(number(), number(), number()),
                facing: Facing::Front,
                reflectance_bound: 1.0,
                gloss: Gloss {
                    viewer: Vec3::new(number(), number(), number()),
                    roughness: number(),
                    share: number(),
                },
            };
            // Some of what is usual among it.
            let unit = Vec3::new(0.6, 0.0, 0.8);
            let at = match seed % 4 {
                0 => at,
                1 => ShadingPoint { normal: unit, ..at },
                2 => ShadingPoint {
                    normal: unit,
                    position: Vec3::ONE,
                    ..at
                },
                _ => ShadingPoint {
                    normal: unit,
                    position: Vec3::ONE,
                    gloss: Gloss {
                        viewer: unit,
                        ..at.gloss
                    },
                    ..at
                },
            };
            let mut block = LightBlock::EMPTY;
            for (lane, light) in lights(u64::from(seed % 7)).iter().enumerate() {
                block.set(lane, lane as u32, &WeighedLight::new(light));
            }
            let glossy = block.weights::<ArrayLanes>(&Receiver::new(&at, true)).store();
            let diffuse = block.weights::<ArrayLanes>(&Receiver::new(&at, false)).store();
            for (glossy, diffuse) in glossy.into_iter().zip(diffuse) {
                assert!(glossy.is_finite() && glossy >= 0.0, "{at:?}: {glossy}");
                assert_eq!(glossy > 0.0, diffuse > 0.0, "{at:?}: {glossy}, {diffuse}");
            }
        }
    }
}
