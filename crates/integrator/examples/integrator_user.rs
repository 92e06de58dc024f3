//! A user's example: an estimator of its own beside the library's, on one film, and noise that
//! falls.
//!
//! `cargo run --release -p lightshed-integrator --example integrator_user`
use lightshed_film::{Budget, PixelEstimator, RenderOptions, RgbImage, render};
use lightshed_integrator::{DirectLight, DirectLightOptions};
use lightshed_sampling::{CosineHemisphere, CounterRng};
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Rgb, Scene, SurfacePoint, builtin, luminance};
use std::error::Error;
use std::sync::atomic::AtomicBool;

/// Direct light by directions of the cosine alone, for diffuse surfaces.
struct ByDirections<'a>(&'a Scene);

impl PixelEstimator for ByDirections<'_> {
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        let (scene, mut rng) = (self.0, CounterRng::new(seed, y << 16 | x, sample_index));
        let emitted = |point: &SurfacePoint, direction| match point.emitter {
            SurfacePoint::NO_EMITTER => Rgb::ZERO,
            _ => scene.emitters().radiance(point, direction),
        };
        let place = Vec2::new(x as f32, y as f32) + Vec2::from(rng.next_2d());
        let ray = scene.camera().ray(place, [0.5; 2]);
        let Some(point) = scene.intersect(&ray) else {
            return Rgb::ZERO;
        };
        let (wo, wi) = (
            point.shading.to_local(-ray.direction),
            CosineHemisphere::sample(rng.next_2d()),
        );
        let next = point.spawn(point.shading.to_world(wi));
        let found = scene
            .intersect(&next)
            .map_or(Rgb::ZERO, |hit| emitted(&hit, next.direction));
        // f |cos| L / p with p = cos / π; `value` holds the cosine already.
        let scattered = scene.bsdf(&point).evaluate(wo, wi).value;
        emitted(&point, ray.direction) + scattered * found * (std::f32::consts::PI / wi.z.max(1e-6))
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut description = builtin::cornell();
    (description.settings.width, description.settings.height) = (32, 32);
    let scene = Scene::new(&description)?;
    println!("samples   by directions     by emitters   (mean and standard error)");
    for samples in [4, 16, 64, 256] {
        let row = |estimator: &dyn PixelEstimator| -> Result<String, Box<dyn Error>> {
            let options = RenderOptions::new(32, 32, Budget::Samples(samples));
            let film = render(&estimator, &options, &|_| (), &AtomicBool::new(false))?.film;
            let sum = |image: &RgbImage| {
                image
                    .pixels()
                    .iter()
                    .map(|&p| f64::from(luminance(p.into())))
                    .sum::<f64>()
            };
            let variance = film.variance_of_mean().as_ref().map_or(0.0, sum);
            Ok(format!(
                "{:>8.4} ± {:.4}",
                sum(&film.mean_image()) / 1024.0,
                variance.sqrt() / 1024.0
            ))
        };
        println!(
            "{samples:>7} {} {:>20}",
            row(&ByDirections(&scene))?,
            row(
                &DirectLight::new(&scene, scene.emitters_by_power(), DirectLightOptions::default()).unwrap()
            )?
        );
    }
    Ok(())
}
