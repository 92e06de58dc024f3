//! Light of a lamp that fog scatters once: relative variance of a sample, by how distances are
//! sampled.

use lightshed_sampling::CounterRng;
use lightshed_testkit::{MeanTest, integrate};
use lightshed_volume::glam::Vec3;
use lightshed_volume::{EquiAngular, FieldRay, Interval, homogeneous_flight};

const SAMPLES: u32 = 100_000;

/// Length of the ray; the lamp is beside its middle.
const LENGTH: f32 = 4.0;

/// The ray's `∫ σ e^{−σ (t + d)} / d² dt`, `d` from the lamp to the ray at `t`.
struct Fog {
    sigma: f64,
    lamp: f64,
}

impl Fog {
    fn integrand(&self, t: f64) -> f64 {
        let along = t - 0.5 * f64::from(LENGTH);
        let squared = along * along + self.lamp * self.lamp;
        self.sigma * (-self.sigma * (t + squared.sqrt())).exp() / squared
    }

    fn by_flight(&self, interval: Interval, rng: &mut CounterRng) -> f64 {
        let sigma = self.sigma as f32;
        let flight = homogeneous_flight(1.0, interval, sigma, f64::from(rng.next_f32()));
        let light = |t: f32| self.integrand(f64::from(t)) / f64::from(flight.pdf(sigma));
        flight.distance.map_or(0.0, light)
    }

    fn by_angle(&self, angles: &EquiAngular, rng: &mut CounterRng) -> f64 {
        let sample = angles.sample(rng.next_f32());
        self.integrand(f64::from(sample.t)) / f64::from(sample.pdf.value())
    }
}

pub fn run() {
    println!("single scattering from a lamp: relative variance of a sample by free flight, by equal angles");
    let (ray, interval) = (
        FieldRay::new(Vec3::ZERO, Vec3::X),
        Interval { t0: 0.0, t1: LENGTH },
    );
    for sigma in [0.05, 0.5, 5.0] {
        for lamp in [0.02, 0.2, 2.0] {
            let fog = Fog { sigma, lamp };
            let truth = integrate(|t| fog.integrand(t), 0.0, f64::from(LENGTH), 1e-9).value;
            let place = Vec3::new(0.5 * LENGTH, lamp as f32, 0.0);
            let Some(angles) = EquiAngular::new(&ray, interval, place) else {
                continue;
            };
            let mut rng = CounterRng::new(1, 0, 0);
            let relative = |sample: &mut dyn FnMut(&mut CounterRng) -> f64, rng: &mut CounterRng| {
                let mut moments = MeanTest::new();
                for _ in 0..SAMPLES {
                    let error = sample(rng) / truth - 1.0;
                    moments.push(error * error);
                }
                moments.mean()
            };
            let flight = relative(&mut |rng| fog.by_flight(interval, rng), &mut rng);
            let angle = relative(&mut |rng| fog.by_angle(&angles, rng), &mut rng);
            println!("  σ = {sigma:<4}  lamp at {lamp:<4}  {flight:10.3}  {angle:10.3}");
        }
    }
}
