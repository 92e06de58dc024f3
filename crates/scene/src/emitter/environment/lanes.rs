//! Eight directions of an environment at a time, with the bits of one after the other.

use super::{Environment, ImageEnvironment, Kind, row_count};
use crate::SkySampling;
use lightshed_lanes::{LANES, LaneMask, LaneWords, Lanes, Vec3Lanes};
use lightshed_sampling::{PiecewiseConstant2d, UniformSphere, sin_cos_turns_lanes, turn_of_lanes};
use std::f32::consts::PI;

/// Eight unit directions towards an environment.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentLanes<L: Lanes> {
    /// The directions.
    pub direction: Vec3Lanes<L>,
    /// Radiance from there.
    pub radiance: Vec3Lanes<L>,
    /// Density with which they are sampled, per steradian; zero where nothing is sampled.
    pub pdf_solid_angle: L,
}

impl Environment {
    /// [`sample_by`](Self::sample_by) of eight points, bit for bit.
    #[inline(always)]
    pub fn sample_lanes<L: Lanes>(&self, sky: SkySampling, u: [L; 2]) -> EnvironmentLanes<L> {
        match &self.0 {
            Kind::Constant(radiance) => EnvironmentLanes {
                direction: UniformSphere::sample_lanes(u),
                radiance: Vec3Lanes::splat(radiance.to_array()),
                pdf_solid_angle: L::splat(UniformSphere::density().value()),
            },
            Kind::Image(image) => image.sample_lanes(image.distribution(sky), u),
        }
    }

    /// [`light_by`](Self::light_by) of eight directions, bit for bit; the density may be positive
    /// where the radiance is black. Those outside of the lanes `wanted`, of which there is at least
    /// one, have no meaning. `sky` is how the environment is sampled, or `None` where no density is
    /// asked for.
    #[inline(always)]
    pub fn light_lanes<L: Lanes>(
        &self,
        sky: Option<SkySampling>,
        direction: Vec3Lanes<L>,
        wanted: u32,
    ) -> EnvironmentLanes<L> {
        match &self.0 {
            Kind::Constant(radiance) => EnvironmentLanes {
                direction,
                radiance: Vec3Lanes::splat(radiance.to_array()),
                pdf_solid_angle: L::splat(UniformSphere::density().value()),
            },
            Kind::Image(image) => {
                // Lanes that are not wanted read the memory of the first that is.
                let (mask, first) = (L::Mask::from_bits(wanted), wanted.trailing_zeros() as usize);
                let [u, v] = image.coordinates_lanes(direction);
                let uv = [
                    u.select(mask, L::splat(u.lane(first))),
                    v.select(mask, L::splat(v.lane(first))),
                ];
                EnvironmentLanes {
                    direction,
                    radiance: image.radiance_lanes(uv),
                    pdf_solid_angle: match sky {
                        Some(sky) => image.pdf_lanes(image.distribution(sky), uv),
                        None => L::splat(0.0),
                    },
                }
            }
        }
    }
}

/// [`to_solid_angle`](super::to_solid_angle), lane by lane.
#[inline(always)]
fn to_solid_angle<L: Lanes>(pdf_uv: L, sin_theta: L) -> L {
    let zero = L::splat(0.0);
    (pdf_uv / (L::splat(2.0 * PI * PI) * sin_theta)).select(zero.less(sin_theta), zero)
}

/// `a (1 − s) + b s`, as `glam::Vec3::lerp`.
#[inline(always)]
fn lerp<L: Lanes>(a: Vec3Lanes<L>, b: Vec3Lanes<L>, s: L) -> Vec3Lanes<L> {
    a * (L::splat(1.0) - s) + b * s
}

impl ImageEnvironment {
    /// [`coordinates`](Self::coordinates) of eight directions.
    #[inline(always)]
    fn coordinates_lanes<L: Lanes>(&self, direction: Vec3Lanes<L>) -> [L; 2] {
        let local = &self.to_local;
        let d = Vec3Lanes::splat(local.x_axis.to_array()) * direction.x
            + Vec3Lanes::splat(local.y_axis.to_array()) * direction.y
            + Vec3Lanes::splat(local.z_axis.to_array()) * direction.z;
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let half_texel = L::splat(0.5 / self.image.width() as f32);
        let u = turn_of_lanes(d.x, -d.z) - half_texel;
        let v = L::splat(2.0) * turn_of_lanes((d.x * d.x + d.z * d.z).sqrt(), d.y);
        [(u + one).select(u.less(zero), u), v]
    }

    /// [`radiance`](Self::radiance) at eight places.
    #[inline(always)]
    fn radiance_lanes<L: Lanes>(&self, uv: [L; 2]) -> Vec3Lanes<L> {
        let (width, rows) = (self.image.width(), row_count(&self.image));
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let (x, y) = (uv[0] * L::splat(width as f32), uv[1] * L::splat(rows as f32));
        // Sides are exact as `f32`.
        let column = L::from_integers(x.to_integers())
            .min(L::splat((width - 1) as f32))
            .max(zero);
        let row = L::from_integers(y.to_integers())
            .min(L::splat((rows - 1) as f32))
            .max(zero);
        let fx = (x - column).max(zero).min(one);
        let fy = (y - row).max(zero).min(one);
        let (columns, rows) = (column.to_integers().store(), row.to_integers().store());
        let mut spare = [[[0.0; LANES]; LANES]; 2];
        let [above, below] = &mut spare;
        let [a0, a1, a2, a3, a4, a5, a6, a7] = above;
        let [b0, b1, b2, b3, b4, b5, b6, b7] = below;
        let last = self.image.height() - 1;
        let [a, b] = pairs_of(L::load_transposed([
            self.image.pair(columns[0], rows[0], a0),
            self.image.pair(columns[1], rows[1], a1),
            self.image.pair(columns[2], rows[2], a2),
            self.image.pair(columns[3], rows[3], a3),
            self.image.pair(columns[4], rows[4], a4),
            self.image.pair(columns[5], rows[5], a5),
            self.image.pair(columns[6], rows[6], a6),
            self.image.pair(columns[7], rows[7], a7),
        ]));
        let [c, d] = pairs_of(L::load_transposed([
            self.image.pair(columns[0], (rows[0] + 1).min(last), b0),
            self.image.pair(columns[1], (rows[1] + 1).min(last), b1),
            self.image.pair(columns[2], (rows[2] + 1).min(last), b2),
            self.image.pair(columns[3], (rows[3] + 1).min(last), b3),
            self.image.pair(columns[4], (rows[4] + 1).min(last), b4),
            self.image.pair(columns[5], (rows[5] + 1).min(last), b5),
            self.image.pair(columns[6], (rows[6] + 1).min(last), b6),
            self.image.pair(columns[7], (rows[7] + 1).min(last), b7),
        ]));
        lerp(lerp(a, b, fx), lerp(c, d, fx), fy) * L::splat(self.scale)
    }

    /// [`pdf`](Self::pdf) at eight places.
    #[inline(always)]
    fn pdf_lanes<L: Lanes>(&self, distribution: &PiecewiseConstant2d, uv: [L; 2]) -> L {
        let (sin_theta, _) = sin_cos_turns_lanes(L::splat(0.5) * uv[1]);
        to_solid_angle(distribution.pdf_lanes(uv), sin_theta)
    }

    /// [`sample`](Self::sample) of eight points.
    #[inline(always)]
    fn sample_lanes<L: Lanes>(&self, distribution: &PiecewiseConstant2d, u: [L; 2]) -> EnvironmentLanes<L> {
        let sample = distribution.sample_lanes(u);
        let one = L::splat(1.0);
        let half_texel = L::splat(0.5 / self.image.width() as f32);
        let (sin_theta, cos_theta) = sin_cos_turns_lanes(L::splat(0.5) * sample.uv[1]);
        let turn = sample.uv[0] + half_texel;
        let (sin_phi, cos_phi) = sin_cos_turns_lanes(turn.select(turn.less(one), turn - one));
        let (x, z) = (sin_theta * sin_phi, -sin_theta * cos_phi);
        let world = &self.to_world;
        EnvironmentLanes {
            direction: Vec3Lanes::splat(world.x_axis.to_array()) * x
                + Vec3Lanes::splat(world.y_axis.to_array()) * cos_theta
                + Vec3Lanes::splat(world.z_axis.to_array()) * z,
            radiance: self.radiance_lanes(sample.uv),
            pdf_solid_angle: to_solid_angle(sample.pdf, sin_theta),
        }
    }
}

/// Two colours from the six numbers that come first.
#[inline(always)]
fn pairs_of<L: Lanes>(rows: [L; LANES]) -> [Vec3Lanes<L>; 2] {
    let [a, b, c, d, e, f, ..] = rows;
    [Vec3Lanes::new(a, b, c), Vec3Lanes::new(d, e, f)]
}

#[cfg(test)]
mod tests {
    use super::super::tests::{directions, environment};
    use super::*;
    use crate::Rgb;
    use glam::Vec3;
    use lightshed_lanes::{LaneChoice, LaneKernel};
    use lightshed_sampling::{CounterRng, Density, SolidAngle};

    const WAYS: [SkySampling; 2] = [SkySampling::Luminance, SkySampling::AboveMean];

    /// Directions, radiance and densities, a row for each number.
    type Rows = ([[f32; LANES]; 3], [[f32; LANES]; 3], [f32; LANES]);

    #[inline(always)]
    fn rows<L: Lanes>(of: &EnvironmentLanes<L>) -> Rows {
        (
            of.direction.store(),
            of.radiance.store(),
            of.pdf_solid_angle.store(),
        )
    }

    /// Those of one lane.
    fn of_lane((direction, radiance, pdf): &Rows, lane: usize) -> (Vec3, Rgb, Density<SolidAngle>) {
        let vector = |rows: &[[f32; LANES]; 3]| Vec3::from(rows.map(|row| row[lane]));
        (vector(direction), vector(radiance), Density::new(pdf[lane]))
    }

    /// What comes from eight directions, those of these lanes.
    struct Lights<'a>(&'a Environment, Option<SkySampling>, [[f32; LANES]; 3], u32);

    impl LaneKernel for Lights<'_> {
        type Output = Rows;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Rows {
            let [x, y, z] = [L::load(&self.2[0]), L::load(&self.2[1]), L::load(&self.2[2])];
            let direction = Vec3Lanes::new(x, y, z);
            rows(&self.0.light_lanes(self.1, direction, self.3))
        }
    }

    /// Eight samples.
    struct Samples<'a>(&'a Environment, SkySampling, [[f32; LANES]; 2]);

    impl LaneKernel for Samples<'_> {
        type Output = Rows;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Rows {
            let u = [L::load(&self.2[0]), L::load(&self.2[1])];
            rows(&self.0.sample_lanes(self.1, u))
        }
    }

    /// Eight directions are looked up as each alone is, bit for bit; a density has no meaning where
    /// it is black.
    #[test]
    fn lights_have_the_bits_of_each() {
        let wanted = [0xff, 0b1, 0b1010_0110];
        for environment in [environment(true), environment(false)] {
            for lanes in LaneChoice::all() {
                for (turn, eight) in directions().chunks_exact(LANES).enumerate() {
                    let rows = [0, 1, 2].map(|axis| std::array::from_fn(|lane| eight[lane][axis]));
                    let wanted = wanted[turn % 3];
                    let radiances = lanes.run(Lights(&environment, None, rows, wanted));
                    let lights = WAYS.map(|sky| lanes.run(Lights(&environment, Some(sky), rows, wanted)));
                    for lane in (0..LANES).filter(|lane| wanted >> lane & 1 == 1) {
                        for (lights, sky) in lights.iter().zip(WAYS) {
                            let (_, radiance, mut pdf) = of_lane(lights, lane);
                            if radiance == Rgb::ZERO {
                                pdf = Density::ZERO;
                            }
                            assert_eq!((radiance, pdf), environment.light_by(sky, eight[lane]), "{lane}");
                            assert_eq!(radiance, of_lane(&radiances, lane).1);
                        }
                    }
                }
            }
        }
    }

    /// So are eight samples.
    #[test]
    fn samples_have_the_bits_of_each() {
        let mut rng = CounterRng::new(31, 0, 0);
        for environment in [environment(true), environment(false)] {
            for lanes in LaneChoice::all() {
                for round in 0..100 {
                    let mut u = [[0.0; LANES]; 2];
                    for u in u.iter_mut().flatten().skip(round % 2) {
                        *u = rng.next_f32();
                    }
                    for sky in WAYS {
                        let samples = lanes.run(Samples(&environment, sky, u));
                        for (lane, (&u, &v)) in u[0].iter().zip(&u[1]).enumerate() {
                            let alone = environment.sample_by(sky, [u, v]);
                            let found = Some(of_lane(&samples, lane)).filter(|found| found.2.is_positive());
                            assert_eq!(found, alone);
                        }
                    }
                }
            }
        }
    }
}
