//! What a guest writes: points below a ceiling with a lamp in it take over each other's directions by reconnecting to the same place.
//!
//! `cargo run --release -p lightshed-shift --example shift_guest`
use lightshed_resampling::{
    Domain, DomainReservoir, Input, Mis, Moments, Ris, ShiftMapping, Shifted, Tractable, Undefined, merge,
};
use lightshed_sampling::{CounterRng, SolidAngle, UniformHemisphere, glam::Vec3};
use lightshed_shift::reconnection_jacobian;
use std::error::Error;

/// A point of the floor, `y = 0`; the ceiling is at `y = 1`.
struct Floor(Vec3);

impl Floor {
    fn ceiling(&self, direction: Vec3) -> Vec3 {
        self.0 + direction / direction.y.max(1e-6)
    }
}

impl Domain for Floor {
    type Sample = Vec3;
    type Space = SolidAngle;
    /// Radiance from there, of a lamp in dim surroundings, times the cosine.
    fn target(&self, &direction: &Vec3) -> f64 {
        let lamp = (self.ceiling(direction) - Vec3::new(0.3, 1.0, 0.2))
            .abs()
            .max_element()
            < 0.1;
        f64::from(direction.y) * if lamp { 30.0 } else { 0.1 }
    }
}

struct Reconnect;

impl ShiftMapping<Floor> for Reconnect {
    fn shift(&self, &direction: &Vec3, from: &Floor, to: &Floor) -> Result<Shifted<Vec3>, Undefined> {
        let seen = from.ceiling(direction);
        let jacobian = reconnection_jacobian(from.0, to.0, seen, Vec3::NEG_Y)?.determinant();
        let sample = (seen - to.0).normalize();
        Ok(Shifted {
            sample,
            jacobian,
            target: to.target(&sample),
        })
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let weight = Tractable::<SolidAngle>::from_density(UniformHemisphere::density(1.0).value())?.weight();
    let floors: Vec<Floor> = (0..8)
        .map(|i| Floor(Vec3::new(0.1 * i as f32, 0.0, 0.0)))
        .collect();
    println!(
        "8 candidates a point: mean and standard deviation of a point's irradiance with so many neighbours"
    );
    for neighbours in 0..8 {
        let mut irradiance = Moments::new();
        for turn in 0..20_000 {
            let mut rng = CounterRng::new(1, turn, neighbours);
            let mut draw = |floor: &Floor| -> DomainReservoir<Floor> {
                let mut ris = Ris::new();
                for _ in 0..8 {
                    let up = UniformHemisphere::sample(rng.next_2d());
                    let direction = Vec3::new(up.x, up.z, up.y);
                    ris.candidate(direction, floor.target(&direction), weight, &mut rng);
                }
                ris.finish(1.0)
            };
            let found: Vec<_> = floors[..=neighbours as usize].iter().map(&mut draw).collect();
            let mut inputs = vec![Input::canonical(&floors[0], &found[0])];
            let others = floors.iter().zip(&found).skip(1);
            inputs.extend(others.map(|(floor, found)| Input::neighbour(floor, found)));
            let merged = merge(&floors[0], &Reconnect, &inputs, Mis::Balance, &mut rng)?;
            irradiance.push(merged.reservoir.estimate(|direction| floors[0].target(direction)));
        }
        println!(
            "{neighbours:>3} {:>8.4} {:>8.3}",
            irradiance.mean(),
            irradiance.variance().sqrt()
        );
    }
    Ok(())
}
