//! Flights through media that emit: light from all along the ray, not only from its collision.

use crate::volume::volpath::{Channels, VolumeTracking, fly as fly_freely};
use lightshed_sampling::f32_from_u32;
use lightshed_sampling::rand::Rng;
use lightshed_scene::volume::{DensityAccessor, DensityField, Interval, TentativeCollisions};
use lightshed_scene::{Medium, MediumDensity, Ray, Rgb};

/// A flight along a ray.
pub struct Flight {
    /// Where it collides, if it does.
    pub distance: Option<f32>,
    /// An estimate of the light that the medium emits along the whole ray, with the weights of its
    /// channels.
    pub emitted: Rgb,
}

/// How many times as many tentative collisions there are as majorants ask for.
const DENSER: f32 = 4.0;

/// Probability of coming so far below which, behind the collision, roulette ends the look.
const LEAST: f32 = 0.3;

/// Delta tracking along `ray` up to `t_max`, which has a unit vector for its direction.
///
/// Each tentative collision shows its emission with the probability that the flight comes there
/// and that it is real, in place of a decision; so do those beyond the first real one.
pub fn fly(medium: &Medium, ray: &Ray, t_max: f32, channels: &mut Channels, rng: &mut impl Rng) -> Flight {
    let field = match medium.density() {
        MediumDensity::Grid(field) if medium.emission().is_some() => field,
        _ => {
            let distance = fly_freely(medium, ray, t_max, VolumeTracking::Delta, channels, rng);
            let emitted = distance.map_or(Rgb::ZERO, |t| {
                channels.weight() * medium.emission_per_collision(ray.origin + ray.direction * t)
            });
            return Flight { distance, emitted };
        }
    };
    let field_ray = field.field_ray(ray);
    let segments = field
        .majorants()
        .segments(&field_ray, Interval { t0: 0.0, t1: t_max });
    let (is_grey, before) = (medium.is_grey(), *channels);
    let extinction = medium.extinction();
    let rate = extinction[channels.hero()];
    let mut collisions = TentativeCollisions::new(segments, DENSER * rate);
    let mut density = field.grid().accessor();
    let (mut count, mut comes, mut emitted, mut distance) = (0, 1.0, Rgb::ZERO, None);
    let mut here = before;
    while let Some(collision) = collisions.next(rng) {
        count += 1;
        let real = density.density(field_ray.at(collision.t)) / (DENSER * collision.majorant);
        if !is_grey {
            here = before;
            here.fly(ratios(
                extinction,
                rate,
                count,
                DENSER * collisions.majorant_depth(),
            ));
        }
        if real > 0.0 {
            let shown = medium.emission_per_collision(ray.origin + ray.direction * collision.t);
            emitted += here.weight() * shown * (comes * real);
        }
        if distance.is_none() && f32_from_u32(rng.next_u32()) < real {
            (distance, *channels) = (Some(collision.t), here);
        }
        if !is_planted() {
            comes *= 1.0 - real.min(1.0);
        }
        if distance.is_some() && comes < LEAST {
            if f32_from_u32(rng.next_u32()) * LEAST >= comes {
                break;
            }
            comes = LEAST;
        }
    }
    if distance.is_none() && !is_grey {
        channels.fly(ratios(
            extinction,
            rate,
            count,
            DENSER * collisions.majorant_depth(),
        ));
    }
    Flight { distance, emitted }
}

/// `(k_c/k_h)^n e^{−(k_c − k_h) τ̄}`, the density of a walk of that many tentative collisions in
/// each channel over that in the one that set the rate `k_h`.
fn ratios(extinction: Rgb, rate: f32, count: i32, depth: f32) -> [f32; 3] {
    extinction.to_array().map(|k| {
        if k == rate {
            return 1.0;
        }
        let (k, rate) = (f64::from(k), f64::from(rate));
        let powers = if count > 0 { (k / rate).powi(count) } else { 1.0 };
        (powers * (-(k - rate) * f64::from(depth)).exp()).min(f64::from(f32::MAX)) as f32
    })
}

/// Whether a test has planted the fault that a flight comes everywhere.
#[inline(always)]
fn is_planted() -> bool {
    #[cfg(test)]
    return UNHINDERED.get();
    #[cfg(not(test))]
    false
}

#[cfg(test)]
thread_local! {
    pub(super) static UNHINDERED: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}
