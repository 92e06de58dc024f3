//! Ray marching: biased.

use super::TransmittanceEstimate;
use crate::{DensityAccessor, FieldRay, Interval};
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, Lanes};

/// Transmittance by ray marching with `steps` equal steps (at least 1), one lookup within each:
/// `exp(−k Σ ρ_i Δt)`. **Biased.**
///
/// At the midpoints, `offset` ½, the optical depth of a smooth density has an error of the square
/// of the step, and so does the estimate; structures narrower than a step may be missed. With a
/// random `offset` the optical depth is unbiased, but its exponential is not: by Jensen's
/// inequality it is too large, by about half its variance. Good for target functions of resampling,
/// where bias only adds noise (Lin 2022 §5.4.3); for shading see
/// [`unbiased_ray_marching`](crate::unbiased_ray_marching).
///
/// `extinction` is the coefficient `k ≥ 0` of `σ = k ρ`.
#[inline]
pub fn ray_marching_transmittance<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    interval: Interval,
    steps: u32,
    offset: f32,
    extinction: f32,
) -> TransmittanceEstimate {
    let steps = steps.max(1);
    let (sum, step) = march(density, ray, interval, steps, offset);
    TransmittanceEstimate {
        value: (-extinction * sum * step).exp(),
        lookups: steps,
    }
}

/// `∫ ρ dt` by ray marching, the exponent of [`ray_marching_transmittance`] for the coefficient
/// 1: unbiased with a random `offset`, off by the square of the step at the midpoints.
#[inline]
pub fn ray_marching_depth<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    interval: Interval,
    steps: u32,
    offset: f32,
) -> f32 {
    let (sum, step) = march(density, ray, interval, steps.max(1), offset);
    sum * step
}

/// The sum of `steps` lookups, and the length of a step.
#[inline]
fn march<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    interval: Interval,
    steps: u32,
    offset: f32,
) -> (f32, f32) {
    let step = (interval.t1 - interval.t0).max(0.0) / steps as f32;
    let sum = LaneChoice::best().run(March {
        density,
        ray,
        t0: interval.t0,
        step,
        steps,
        offset,
    });
    (sum, step)
}

/// `Σ ρ(t0 + (i + offset) step)` over all `i` below `steps`, in this order.
struct March<'a, A> {
    density: &'a mut A,
    ray: &'a FieldRay,
    t0: f32,
    step: f32,
    steps: u32,
    offset: f32,
}

impl<A: DensityAccessor> LaneKernel for March<'_, A> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        const EACH: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        let mut sum = 0.0f32;
        let mut done = 0;
        while done < self.steps {
            let count = (self.steps - done).min(LANES as u32) as usize;
            let index = L::splat(done as f32) + L::load(&EACH);
            let t = L::splat(self.t0) + (index + L::splat(self.offset)) * L::splat(self.step);
            let rho = self.density.densities(self.ray, t, count).store();
            for value in &rho[..count] {
                sum += value;
            }
            done += count as u32;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DensityField, DensityRange, FieldBounds, Procedural};
    use glam::Vec3;
    use lightshed_testkit::check_faults;

    #[test]
    fn midpoints_integrate_linear_densities_exactly() {
        let bounds = FieldBounds::new(Vec3::ZERO, Vec3::splat(8.0)).unwrap();
        let whole = DensityRange { min: 0.0, max: 8.0 };
        let field = Procedural::new(|p: Vec3| p.x, |_, _| whole, bounds).unwrap();
        let ray = FieldRay::new(Vec3::ZERO, Vec3::X * 2.0);
        let interval = Interval { t0: 1.0, t1: 3.0 };
        check_faults(&[0.25], |fault: Option<f32>| {
            let depth = ray_marching_depth(&mut field.accessor(), &ray, interval, 5, fault.unwrap_or(0.5));
            // ∫ 2 t dt from 1 to 3.
            if (depth - 8.0).abs() < 1e-5 {
                Ok(())
            } else {
                Err(format!("{depth}"))
            }
        })
        .unwrap();
    }
}
