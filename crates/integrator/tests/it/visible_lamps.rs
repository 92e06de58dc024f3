//! Direct light with several emitter samples sees lamps by rays of their own: the same image with
//! less noise.
//!
//! Images are compared by tiles with seeds of their own; a sound implementation fails with
//! probability 1e-5.

use crate::rendered::{Rendered, compare};
use lightshed_integrator::{DirectLight, DirectLightOptions, PathTracer};
use lightshed_scene::{EmitterDescription, Rgb, Scene, builtin};
use lightshed_testkit::check_faults;

const SIZE: [u32; 2] = [32, 32];

/// A lamp in view below a sky, which the rays for lamps do not see.
fn scene() -> Scene {
    let mut description = builtin::cornell();
    [description.settings.width, description.settings.height] = SIZE;
    description.emitters.push(EmitterDescription::Constant {
        radiance: Rgb::splat(0.5),
    });
    Scene::new(&description).unwrap()
}

/// Planted faults: lamps are counted twice, or not at all, and so is the sky.
#[test]
fn lamps_in_view_have_rays_of_their_own() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        Twice,
        NoLamp,
        NoSky,
    }
    let scene = scene();
    for (seed, (emitter_samples, camera_strata)) in (1..).zip([(4, 1), (3, 2)]) {
        let options = DirectLightOptions {
            camera_strata,
            ..DirectLightOptions::samples(emitter_samples, 1)
        };
        let direct = || DirectLight::new(&scene, scene.emitters_by_power(), options).unwrap();
        let by_paths = Rendered::new(&direct(), SIZE, 512, seed);
        let seen = |scene: &Scene| {
            let tracer = PathTracer::new(scene, scene.emitters_by_power());
            Rendered::new(&tracer.with_depths(Some(1), 1), SIZE, 512, 50)
        };
        check_faults(&[Fault::Twice, Fault::NoLamp, Fault::NoSky], |fault| {
            let mut found = Rendered::new(&direct().with_visible_emission(), SIZE, 512, 10 + seed);
            let share: f64 = match fault {
                Some(Fault::Twice) => 1.0,
                Some(Fault::NoLamp | Fault::NoSky) => -1.0,
                None => 0.0,
            };
            let lamp = seen(&scene);
            let is_lamp = |value: f64| value > 1.0;
            for (value, lamp) in found.mean.iter_mut().zip(&lamp.mean) {
                if is_lamp(*lamp) != matches!(fault, Some(Fault::NoSky)) {
                    *value += share * lamp;
                }
            }
            compare(&found, &by_paths, 16)?;
            let [less, more] = [&found, &by_paths].map(|image| image.variance_of_mean.iter().sum::<f64>());
            match less < 0.5 * more {
                true => Ok(()),
                false => Err(format!("a variance of {less} for {more}")),
            }
        })
        .unwrap_or_else(|error| panic!("{emitter_samples} samples: {error:?}"));
    }
}
