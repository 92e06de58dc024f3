//! Free flight and transmittance in one medium.

use lightshed_sampling::rand::Rng;
use lightshed_sampling::{CounterRng, f32_from_u32};
use lightshed_scene::volume::{
    Control, DensityField, Interval, decomposition_tracking, delta_tracking, ratio_tracking,
    residual_ratio_tracking, spectral_delta_tracking, spectral_ratio_tracking,
    spectral_residual_ratio_tracking,
};
use lightshed_scene::{Medium, MediumDensity, Ray, Rgb};

/// Flights and estimates of transmittance, all unbiased.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VolumeTracking {
    /// Delta tracking and ratio tracking.
    #[default]
    Delta,
    /// Decomposition tracking (Kutz et al. 2017) and residual ratio tracking (Novák et al. 2014)
    /// over super-voxels of 8 voxels (fewer in small grids): the baseline of Lin 2022 §5.6. Fewer
    /// lookups where the density's lower bound is high. Where extinction differs by channel,
    /// flights are by delta tracking.
    Decomposition,
}

/// Weights of a path in each channel, if it was sampled at the rate of one of them.
///
/// With `r_c = p_c / p_h`, the density of the path's flights at the rate of channel `c` over that
/// of the channel `h` used, and `h` chosen uniformly, the balance heuristic gives channel `c` the
/// weight `r_c / (⅓ Σ_i r_i)` relative to a path that was sampled at its own rate. Common
/// factors of all `r` cancel.
#[derive(Clone, Copy)]
pub(crate) struct Channels {
    hero: usize,
    /// `r`, but for a common factor.
    ratio: Rgb,
}

impl Channels {
    /// At the beginning of a path, with the channel chosen by a uniform word.
    #[inline(always)]
    pub fn new(word: u32) -> Self {
        Self {
            hero: ((u64::from(word) * 3) >> 32) as usize,
            ratio: Rgb::ONE,
        }
    }

    /// `r / (⅓ Σ r)`.
    #[inline(always)]
    pub fn weight(&self) -> Rgb {
        if self.ratio == Rgb::ONE {
            return Rgb::ONE;
        }
        // The greatest is 1.
        self.ratio * (3.0 / self.ratio.element_sum())
    }

    /// The channel whose rate flights have.
    pub fn hero(&self) -> usize {
        self.hero
    }

    /// One more flight.
    pub fn fly(&mut self, density_ratio: [f32; 3]) {
        // The hero's own is 1, so the greatest is positive; both factors are finite, but their
        // product need not be.
        let ratio = self.ratio.as_dvec3() * Rgb::from_array(density_ratio).as_dvec3();
        self.ratio = (ratio / ratio.max_element()).as_vec3();
    }
}

/// Where on `ray`, within `(0, t_max)`, light collides; `None` if it does not. Collisions have
/// density `σ_t T` in the channel that `channels` has chosen.
#[inline]
pub(crate) fn fly(
    medium: &Medium,
    ray: &Ray,
    t_max: f32,
    tracking: VolumeTracking,
    channels: &mut Channels,
    rng: &mut impl Rng,
) -> Option<f32> {
    let extinction = medium.extinction() * ray.direction.length();
    match medium.density() {
        MediumDensity::Grid(field) => {
            let field_ray = field.field_ray(ray);
            let interval = Interval { t0: 0.0, t1: t_max };
            let segments = field.majorants().segments(&field_ray, interval);
            let mut accessor = field.grid().accessor();
            if medium.is_grey() {
                let k = extinction.x;
                return match tracking {
                    VolumeTracking::Delta => delta_tracking(&mut accessor, &field_ray, segments, k, rng),
                    VolumeTracking::Decomposition => {
                        decomposition_tracking(&mut accessor, &field_ray, segments, k, rng)
                    }
                }
                .distance;
            }
            let flight = spectral_delta_tracking(
                &mut accessor,
                &field_ray,
                segments,
                extinction.to_array(),
                channels.hero,
                rng,
            );
            channels.fly(flight.density_ratio);
            flight.distance
        }
        MediumDensity::Homogeneous => {
            let rate = extinction[channels.hero];
            let t = -(-f32_from_u32(rng.next_u32())).ln_1p() / rate;
            let collides = t < t_max;
            if !medium.is_grey() {
                let (length, collisions) = if collides { (t, 1.0) } else { (t_max, 0.0) };
                channels.fly(
                    extinction
                        .to_array()
                        .map(|k| homogeneous_ratio(k, rate, length, collisions)),
                );
            }
            collides.then_some(t)
        }
    }
}

/// `(k/k_h)^n e^{−(k − k_h) t}`, at most `f32::MAX`.
fn homogeneous_ratio(k: f32, hero: f32, t: f32, collisions: f32) -> f32 {
    if k == hero {
        return 1.0;
    }
    let (k, hero) = (f64::from(k), f64::from(hero));
    let factor = if collisions > 0.0 { k / hero } else { 1.0 };
    (factor * (-(k - hero) * f64::from(t)).exp()).min(f64::from(f32::MAX)) as f32
}

/// An unbiased estimate of the transmittance along `ray` up to `t_max`, in each channel.
#[inline]
pub(crate) fn transmittance(
    medium: &Medium,
    ray: &Ray,
    t_max: f32,
    tracking: VolumeTracking,
    rng: &mut CounterRng,
) -> Rgb {
    let extinction = medium.extinction() * ray.direction.length();
    match medium.density() {
        MediumDensity::Grid(field) => {
            let field_ray = field.field_ray(ray);
            let interval = Interval { t0: 0.0, t1: t_max };
            let segments = field.majorants().segments(&field_ray, interval);
            let mut accessor = field.grid().accessor();
            let (density, ray) = (&mut accessor, &field_ray);
            let (k, by_channel) = (extinction.x, extinction.to_array());
            const CONTROL: Control = Control::Minorant;
            match (tracking, medium.is_grey()) {
                (VolumeTracking::Delta, true) => {
                    Rgb::splat(ratio_tracking(density, ray, segments, k, rng).value)
                }
                (VolumeTracking::Delta, false) => {
                    spectral_ratio_tracking(density, ray, segments, by_channel, rng)
                        .value
                        .into()
                }
                (VolumeTracking::Decomposition, true) => {
                    Rgb::splat(residual_ratio_tracking(density, ray, segments, k, CONTROL, rng).value)
                }
                (VolumeTracking::Decomposition, false) => {
                    spectral_residual_ratio_tracking(density, ray, segments, by_channel, CONTROL, rng)
                        .value
                        .into()
                }
            }
        }
        MediumDensity::Homogeneous => {
            // No extinction lets light through from infinity too.
            Rgb::from_array(
                extinction
                    .to_array()
                    .map(|k| if k > 0.0 { (-k * t_max).exp() } else { 1.0 }),
            )
        }
    }
}
