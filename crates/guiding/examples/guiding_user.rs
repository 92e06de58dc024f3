//! What a renderer writes: light on a floor from a bright spot on a wall, by directions that learn
//! where the spot is.

use lightshed_guiding::glam::Vec3;
use lightshed_guiding::{
    FieldOptions, GuidingError, GuidingField, GuidingSample, QuadtreeModel, QuadtreeOptions,
};
use lightshed_sampling::{CosineHemisphere, CounterRng, Density, DirectionDistribution, Oriented};
use lightshed_spatial::Bounds;

/// Radiance that arrives: bright within two degrees of a place on a wall.
fn incident(position: Vec3, direction: Vec3) -> f32 {
    let to_spot = (Vec3::new(2.0, 0.6, 0.0) - position).normalize();
    if direction.dot(to_spot) > 2f32.to_radians().cos() {
        500.0
    } else {
        0.1
    }
}

fn main() -> Result<(), GuidingError> {
    let bounds = Bounds {
        min: Vec3::new(-1.0, 0.0, -1.0),
        max: Vec3::ONE,
    };
    let trees = QuadtreeModel::new(QuadtreeOptions::default())?;
    let mut field = GuidingField::<_>::new(bounds, trees, FieldOptions::default())?;
    let scattering = Oriented::new(CosineHemisphere, Vec3::Y);
    for pass in 0..5 {
        let (mut sum, mut squares) = (0.0, 0.0);
        let count = 100_000;
        for i in 0..count {
            let mut rng = CounterRng::new(1, i, pass);
            let [x, z] = rng.next_2d().map(|u| 2.0 * u - 1.0);
            let position = Vec3::new(x, 0.0, z);
            let known = field.at(position);
            // One sample of the mixture of guide and cosine.
            let share = known.as_ref().map_or(0.0, |known| known.share);
            let u = rng.next_2d();
            let sample = match &known {
                Some(known) if rng.next_f32() < share => known.sample(u),
                _ => scattering.sample(u),
            };
            let Some((direction, _)) = sample else { continue };
            let scattering_pdf = scattering.pdf(direction);
            let guide_pdf = known.map_or(0.0, |known| known.pdf(direction).value());
            let pdf = Density::new((1.0 - share) * scattering_pdf.value() + share * guide_pdf);
            let weight = incident(position, direction) * direction.y.max(0.0) / pdf.value();
            sum += f64::from(weight);
            squares += f64::from(weight * weight);
            field.record(&[GuidingSample {
                position,
                direction,
                distance: f32::INFINITY,
                weight,
                pdf,
                scattering_pdf,
            }]);
        }
        let mean = sum / f64::from(count);
        let deviation = (squares / f64::from(count) - mean * mean).sqrt();
        println!(
            "pass {pass}: {mean:.3}, standard deviation {deviation:.2}; {:?}",
            field.update()?
        );
    }
    Ok(())
}
