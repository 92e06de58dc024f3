//! Light from all directions: constant, or an image.

mod lanes;

pub use lanes::EnvironmentLanes;

use super::{SkySampling, check_rgb, luminance_f64};
use crate::{EnvironmentMap, FlatSky, Image, Rgb};
use glam::{Mat3, Vec3};
use lightshed_sampling::{
    Density, PiecewiseConstant2d, PrimarySample, SolidAngle, UniformSphere, sin_cos_turns, turn_of,
};
use std::f32::consts::PI;
use std::sync::Arc;

/// What surrounds the scene.
#[derive(Clone, Debug)]
pub struct Environment(Kind);

#[derive(Clone, Debug)]
enum Kind {
    /// Sampled uniformly over the sphere.
    Constant(Rgb),
    Image(Box<ImageEnvironment>),
}

/// An equirectangular image, sampled in proportion to luminance times `sin θ`, constant over each
/// cell between four neighbouring texel centres. Bilinear interpolation is zero only where all four
/// corners are, and so is that density.
#[derive(Clone, Debug)]
struct ImageEnvironment {
    image: Arc<Image>,
    scale: f32,
    to_world: Mat3,
    to_local: Mat3,
    distribution: PiecewiseConstant2d,
    /// In proportion to what a cell's luminance exceeds the mean by; `None` if none does.
    above_mean: Option<PiecewiseConstant2d>,
}

impl Environment {
    /// Constant radiance; `None` if it is black.
    pub(super) fn constant(radiance: Rgb) -> Result<Option<Self>, &'static str> {
        check_rgb(radiance)?;
        Ok((radiance != Rgb::ZERO).then_some(Self(Kind::Constant(radiance))))
    }

    /// An image; `None` if it is black.
    pub(super) fn image(map: &EnvironmentMap) -> Result<Option<Self>, &'static str> {
        let EnvironmentMap {
            image,
            scale,
            to_world,
        } = map;
        if !(scale.is_finite() && *scale >= 0.0) {
            return Err("its scale must be finite and not negative");
        }
        let to_world = Mat3::from(to_world.matrix3);
        let orthonormal = (to_world * to_world.transpose()).abs_diff_eq(Mat3::IDENTITY, 1e-3);
        if !to_world.is_finite() || !orthonormal {
            return Err("its transform must be a rotation");
        }
        let (width, height) = (image.width(), image.height());
        for y in 0..height {
            for x in 0..width {
                check_rgb(image.texel(x, y))?;
            }
        }
        let (weights, mean) = cell_weights(image, 0.0);
        if *scale == 0.0 || weights.iter().all(|&weight| weight == 0.0) {
            return Ok(None);
        }
        let distribution = PiecewiseConstant2d::new(&weights, width as usize)
            .map_err(|_| "its image is too large or too bright")?;
        // A constant image exceeds its mean by rounding at most, and nothing is sampled by that.
        let (above, _) = cell_weights(image, mean * (1.0 + 1e-6));
        let above_mean = PiecewiseConstant2d::new(&above, width as usize).ok();
        let to_local = to_world.transpose();
        let image = Arc::clone(image);
        Ok(Some(Self(Kind::Image(Box::new(ImageEnvironment {
            image,
            scale: *scale,
            to_world,
            to_local,
            distribution,
            above_mean,
        })))))
    }

    /// Radiance from all directions alike; `None` for an image.
    pub fn constant_radiance(&self) -> Option<Rgb> {
        match &self.0 {
            Kind::Constant(radiance) => Some(*radiance),
            Kind::Image(_) => None,
        }
    }

    /// The image and the distribution of this way to sample as a shader reads them; `None` where
    /// there is no image.
    pub(crate) fn flat(&self, sky: SkySampling) -> Option<FlatSky> {
        match &self.0 {
            Kind::Constant(_) => None,
            Kind::Image(image) => Some(image.flat(image.distribution(sky))),
        }
    }

    /// Radiance arriving from the unit direction `direction`.
    #[inline]
    pub fn radiance(&self, direction: Vec3) -> Rgb {
        match &self.0 {
            Kind::Constant(radiance) => *radiance,
            Kind::Image(image) => image.radiance(image.coordinates(direction)),
        }
    }

    /// A unit direction towards the environment, the radiance from there and the density: by
    /// [`SkySampling::Luminance`].
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Rgb, Density<SolidAngle>)> {
        self.sample_by(SkySampling::Luminance, u)
    }

    /// Density with which [`Environment::sample`] returns `direction`.
    #[inline]
    pub fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        self.pdf_by(SkySampling::Luminance, direction)
    }

    /// A unit direction towards the environment, the radiance from there and the density.
    #[inline]
    pub fn sample_by(&self, sky: SkySampling, u: [f32; 2]) -> Option<(Vec3, Rgb, Density<SolidAngle>)> {
        match &self.0 {
            Kind::Constant(radiance) => {
                let direction = UniformSphere::sample(u);
                Some((direction, *radiance, UniformSphere::density()))
            }
            Kind::Image(image) => image.sample(image.distribution(sky), u),
        }
    }

    /// Density with which [`sample_by`](Self::sample_by) returns `direction`.
    #[inline]
    pub fn pdf_by(&self, sky: SkySampling, direction: Vec3) -> Density<SolidAngle> {
        match &self.0 {
            Kind::Constant(_) => UniformSphere::density(),
            Kind::Image(image) => image.pdf(image.distribution(sky), image.coordinates(direction)),
        }
    }

    /// Both [`radiance`](Self::radiance) and [`pdf_by`](Self::pdf_by) of a direction, which is
    /// looked up once; the density is 0 where the radiance is.
    #[inline]
    pub fn light_by(&self, sky: SkySampling, direction: Vec3) -> (Rgb, Density<SolidAngle>) {
        match &self.0 {
            Kind::Constant(radiance) => (*radiance, UniformSphere::density()),
            Kind::Image(image) => {
                let uv = image.coordinates(direction);
                let radiance = image.radiance(uv);
                let pdf = match radiance == Rgb::ZERO {
                    true => Density::ZERO,
                    false => image.pdf(image.distribution(sky), uv),
                };
                (radiance, pdf)
            }
        }
    }
}

/// The map takes `du dv` to `2π² sin θ du dv` of solid angle.
#[inline(always)]
fn to_solid_angle(pdf_uv: Density<PrimarySample>, sin_theta: f32) -> Density<SolidAngle> {
    if sin_theta > 0.0 {
        Density::new(pdf_uv.value() / (2.0 * PI * PI * sin_theta))
    } else {
        Density::ZERO
    }
}

/// Texels around the cell right of and below the centre of texel (`column`, `row`): columns wrap,
/// rows end.
fn cell_corners(image: &Image, column: u32, row: u32) -> [Rgb; 4] {
    let right = if column + 1 == image.width() {
        0
    } else {
        column + 1
    };
    let below = (row + 1).min(image.height() - 1);
    [(column, row), (right, row), (column, below), (right, below)].map(|(x, y)| image.texel(x, y))
}

/// Number of rows of cells.
fn row_count(image: &Image) -> u32 {
    image.height().max(2) - 1
}

/// What the luminance of each cell exceeds `least` by, times `sin θ`, row by row; and the mean of
/// that excess over all directions.
fn cell_weights(image: &Image, least: f64) -> (Vec<f32>, f64) {
    let (width, rows) = (image.width(), row_count(image));
    let mut weights = Vec::with_capacity(width as usize * rows as usize);
    let (mut sum, mut solid_angle) = (0.0, 0.0);
    for row in 0..rows {
        // Solid angle of a cell in this row, over that of one at the equator.
        let sin_theta = ((f64::from(row) + 0.5) / f64::from(rows) * std::f64::consts::PI).sin();
        let mut of_row = 0.0;
        for column in 0..width {
            let corners = cell_corners(image, column, row);
            let luminance = corners.map(luminance_f64).iter().sum::<f64>() / 4.0;
            let excess = (luminance - least).max(0.0);
            weights.push((excess * sin_theta) as f32);
            of_row += excess;
        }
        sum += of_row * sin_theta;
        solid_angle += f64::from(width) * sin_theta;
    }
    (weights, sum / solid_angle)
}

impl ImageEnvironment {
    #[inline(always)]
    fn distribution(&self, sky: SkySampling) -> &PiecewiseConstant2d {
        match (sky, &self.above_mean) {
            (SkySampling::AboveMean, Some(above_mean)) => above_mean,
            _ => &self.distribution,
        }
    }

    fn flat(&self, distribution: &PiecewiseConstant2d) -> FlatSky {
        let size = [self.image.width(), self.image.height()];
        let mut words = distribution.row_starts().to_vec();
        words.extend(distribution.column_starts());
        words.extend(distribution.last_columns());
        for y in 0..size[1] {
            words.extend((0..size[0]).flat_map(|x| self.image.texel(x, y).to_array().map(f32::to_bits)));
        }
        FlatSky {
            axes: [self.to_local.x_axis, self.to_local.y_axis, self.to_local.z_axis],
            scale: self.scale,
            size,
            last_row: distribution.last_row(),
            words,
        }
    }

    /// Coordinates over the cells, in the unit square: `u` starts at the centre of the first
    /// column, `v` at the first row.
    #[inline]
    fn coordinates(&self, direction: Vec3) -> [f32; 2] {
        let d = self.to_local * direction;
        let half_texel = 0.5 / self.image.width() as f32;
        let u = turn_of(d.x, -d.z) - half_texel;
        // The angle from the perpendicular keeps its precision near the poles, where acos has none.
        let v = 2.0 * turn_of((d.x * d.x + d.z * d.z).sqrt(), d.y);
        [if u < 0.0 { u + 1.0 } else { u }, v]
    }

    #[inline]
    fn pdf(&self, distribution: &PiecewiseConstant2d, uv: [f32; 2]) -> Density<SolidAngle> {
        to_solid_angle(distribution.pdf(uv), sin_cos_turns(0.5 * uv[1]).0)
    }

    #[inline]
    fn radiance(&self, uv: [f32; 2]) -> Rgb {
        let (width, rows) = (self.image.width(), row_count(&self.image));
        let (x, y) = (uv[0] * width as f32, uv[1] * rows as f32);
        let (column, row) = ((x as u32).min(width - 1), (y as u32).min(rows - 1));
        let (fx, fy) = (
            (x - column as f32).clamp(0.0, 1.0),
            (y - row as f32).clamp(0.0, 1.0),
        );
        let [a, b, c, d] = cell_corners(&self.image, column, row);
        (a.lerp(b, fx)).lerp(c.lerp(d, fx), fy) * self.scale
    }

    #[inline]
    fn sample(
        &self,
        distribution: &PiecewiseConstant2d,
        u: [f32; 2],
    ) -> Option<(Vec3, Rgb, Density<SolidAngle>)> {
        let sample = distribution.sample(u);
        let half_texel = 0.5 / self.image.width() as f32;
        let (sin_theta, cos_theta) = sin_cos_turns(0.5 * sample.uv[1]);
        let turn = sample.uv[0] + half_texel;
        let (sin_phi, cos_phi) = sin_cos_turns(if turn < 1.0 { turn } else { turn - 1.0 });
        let pdf = to_solid_angle(sample.pdf, sin_theta);
        let local = Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi);
        pdf.is_positive()
            .then(|| (self.to_world * local, self.radiance(sample.uv), pdf))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Affine3A;
    use lightshed_sampling::CounterRng;

    /// Of numbers as they are, or of codes.
    pub(super) fn environment(is_linear: bool) -> Environment {
        let texel = |i: u32| [i, i * i % 71, 1];
        let image = match is_linear {
            true => Image::from_linear(32, 17, (0..32 * 17).map(|i| texel(i).map(|v| v as f32)).collect()),
            false => Image::from_srgb8(32, 17, (0..32 * 17).map(|i| texel(i).map(|v| v as u8)).collect()),
        };
        let map = EnvironmentMap {
            image: Arc::new(image.unwrap()),
            scale: 1.5,
            to_world: Affine3A::from_rotation_y(0.7) * Affine3A::from_rotation_z(2.0),
        };
        Environment::image(&map).unwrap().unwrap()
    }

    /// Axes, their opposites and random directions.
    pub(super) fn directions() -> Vec<Vec3> {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        let mut rng = CounterRng::new(12, 0, 0);
        let random = (0..1018).map(|_| UniformSphere::sample(rng.next_2d()));
        let axes = axes.into_iter().flat_map(|axis| [axis, -axis]);
        axes.chain(random).collect()
    }

    /// In coordinates of `f64`, by `atan2` and `acos`; within 10⁻⁶ but for the poles.
    /// Planted faults: half a texel left out; `v` from the other pole.
    #[test]
    fn places_are_those_of_double_precision() {
        let environment = environment(true);
        let Kind::Image(image) = &environment.0 else {
            panic!("an image is one")
        };
        for direction in directions() {
            let d = (image.to_local * direction).as_dvec3();
            let u = d.x.atan2(-d.z) / std::f64::consts::TAU - 0.5 / 32.0;
            let v = d.x.hypot(d.z).atan2(d.y) / std::f64::consts::PI;
            let [found_u, found_v] = image.coordinates(direction).map(f64::from);
            let off = (found_u - u - (found_u - u).round()).abs() * (std::f64::consts::PI * v).sin();
            assert!(off < 1e-6 && (found_v - v).abs() < 1e-6, "{direction} {off}");
            assert!((0.0..=1.0).contains(&found_u) && (0.0..=1.0).contains(&found_v));
        }
    }

    /// What is looked up once is what both look-ups give.
    #[test]
    fn radiance_and_density_are_those_of_a_direction() {
        let environment = environment(true);
        for direction in directions() {
            for sky in [SkySampling::Luminance, SkySampling::AboveMean] {
                let (radiance, pdf) = environment.light_by(sky, direction);
                assert_eq!(radiance, environment.radiance(direction));
                assert_eq!(pdf, environment.pdf_by(sky, direction));
            }
        }
    }
}
