//! A medium of one's own, given by a function: what comes through it, and what scatters in it.
//!
//! `cargo run --release --manifest-path examples/users/Cargo.toml -p own_medium`
mod medium;

use lightshed_sampling::CounterRng;
use lightshed_volume::glam::Vec3;
use lightshed_volume::{
    Control, DensityField, DensityRange, FieldBounds, FieldRay, HenyeyGreenstein, Interval, MajorantGrid,
    PhaseFunction, Procedural, delta_tracking, residual_ratio_tracking,
};
use medium::{ALBEDO, EXTINCTION, LAMP, density, most};
use std::error::Error;

/// The medium as trackers see it, with bounds of the density in cells.
struct Fog<F> {
    field: F,
    majorants: MajorantGrid,
    phase: HenyeyGreenstein,
}

fn fog() -> Result<Fog<impl DensityField>, Box<dyn Error>> {
    let bounds = FieldBounds::new(-Vec3::ONE, Vec3::ONE).ok_or("the box is empty")?;
    let range = |low: Vec3, high: Vec3| DensityRange { min: 0.0, max: most(low, high) };
    let field = Procedural::new(density, range, bounds).ok_or("the density has no bound")?;
    Ok(Fog { majorants: MajorantGrid::new(&field, 0.25)?, field, phase: HenyeyGreenstein::new(0.5)? })
}

impl<F: DensityField> Fog<F> {
    /// An estimate of the transmittance along a ray up to a distance.
    fn through(&self, ray: &FieldRay, distance: f32, rng: &mut CounterRng) -> f32 {
        let segments = self.majorants.segments(ray, Interval { t0: 0.0, t1: distance });
        let control = Control::Minorant;
        residual_ratio_tracking(&mut self.field.accessor(), ray, segments, EXTINCTION, control, rng).value
    }

    /// Radiance against a ray: light of the lamp that scatters up to eight times.
    fn radiance(&self, mut origin: Vec3, mut direction: Vec3, rng: &mut CounterRng) -> f32 {
        let (mut sum, mut throughput) = (0.0, 1.0);
        for _ in 0..8 {
            let ray = FieldRay::new(origin, direction);
            let segments = self.majorants.segments(&ray, Interval { t0: 0.0, t1: f32::INFINITY });
            let flight = delta_tracking(&mut self.field.accessor(), &ray, segments, EXTINCTION, rng);
            let Some(distance) = flight.distance else { break };
            origin += direction * distance;
            throughput *= ALBEDO;
            let (to_lamp, far) = ((LAMP - origin).normalize(), LAMP.distance(origin));
            let arriving = self.through(&FieldRay::new(origin, to_lamp), far, rng) / (far * far);
            sum += throughput * arriving * self.phase.phase_between(direction, to_lamp);
            direction = self.phase.sample(direction, rng.next_2d()).direction;
        }
        sum
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let fog = fog()?;
    for row in 0..12 {
        let shade = |column: usize| {
            let from = Vec3::new(column as f32 / 12.0 - 0.96, 0.92 - row as f32 / 6.0, -3.0);
            let sample = |i| fog.radiance(from, Vec3::Z, &mut CounterRng::new(1, column as u32, i));
            let mean = (0..64).map(sample).sum::<f32>() / 64.0;
            char::from(b" .:-=+*#%@"[((mean * 900.0) as usize).min(9)])
        };
        println!("{}", (0..24).map(shade).collect::<String>());
    }
    Ok(())
}

#[cfg(test)]
mod tests;
