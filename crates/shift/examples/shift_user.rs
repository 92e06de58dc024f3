//! Points below a ceiling with a lamp in it share directions, by reconnecting to the same place of
//! the ceiling.
//!
//! `cargo run -p lightshed-shift --example shift_user`
use lightshed_resampling::{Domain, DomainReservoir, Input, Mis, Moments, Ris, merge};
use lightshed_resampling::{ShiftMapping, Shifted, Tractable, Undefined};
use lightshed_sampling::{CounterRng, SolidAngle, UniformHemisphere as Hemisphere, glam::Vec3};
use lightshed_shift::reconnection_jacobian;

/// A point of the floor, `z = 0`; the ceiling is at `z = 1`.
struct Floor(Vec3);

impl Domain for Floor {
    type Sample = Vec3;
    type Space = SolidAngle;
    /// Radiance out of a direction, of a lamp in dim surroundings, times the cosine.
    fn target(&self, &direction: &Vec3) -> f64 {
        let offset = self.0 + direction / direction.z.max(1e-6) - Vec3::new(0.3, 0.2, 1.0);
        let lit = offset.abs().max_element() < 0.1;
        f64::from(direction.z * if lit { 30.0 } else { 0.1 })
    }
}

struct Reconnect;
impl ShiftMapping<Floor> for Reconnect {
    fn shift(&self, &direction: &Vec3, from: &Floor, to: &Floor) -> Result<Shifted<Vec3>, Undefined> {
        let seen = from.0 + direction / direction.z.max(1e-6);
        let jacobian = reconnection_jacobian(from.0, to.0, seen, Vec3::NEG_Z)?.determinant();
        let sample = (seen - to.0).normalize();
        Ok(Shifted {
            sample,
            jacobian,
            target: to.target(&sample),
        })
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let weight = Tractable::<SolidAngle>::from_density(Hemisphere::density(1.0).value())?.weight();
    let floors = [0.0, 0.1, 0.2, 0.3].map(|x| Floor(Vec3::new(x, 0.0, 0.0)));
    for count in 1..=floors.len() {
        let mut irradiance = Moments::new();
        for turn in 0..20_000 {
            let mut rng = CounterRng::new(1, turn, 0);
            let found = floors.each_ref().map(|floor| -> DomainReservoir<Floor> {
                let mut ris = Ris::new();
                for direction in [(); 8].map(|()| Hemisphere::sample(rng.next_2d())) {
                    ris.candidate(direction, floor.target(&direction), weight, &mut rng);
                }
                ris.finish(1.0)
            });
            let mut inputs = vec![Input::canonical(&floors[0], &found[0])];
            inputs.extend((1..count).map(|other| Input::neighbour(&floors[other], &found[other])));
            let merged = merge(&floors[0], &Reconnect, &inputs, Mis::Balance, &mut rng)?;
            irradiance.push(merged.reservoir.estimate(|direction| floors[0].target(direction)));
        }
        let (mean, deviation) = (irradiance.mean(), irradiance.variance().sqrt());
        println!("{count} points: irradiance {mean:.4}, standard deviation {deviation:.3}");
    }
    Ok(())
}
