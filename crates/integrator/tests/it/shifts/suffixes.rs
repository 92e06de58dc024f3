//! Suffixes traced in batches against the naive tracer of `lightshed-shift`.

use super::zoo::scene;
use lightshed_integrator::SceneWorld;
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{CounterRng, Density, PathSeed};
use lightshed_scene::Ray;
use lightshed_scene::glam::Vec2;
use lightshed_shift::{
    Suffix, SuffixLight, SuffixLimits, WorldGeometry, WorldLighting, WorldScattering, trace_suffix,
};
use lightshed_testkit::{MeanTest, check_faults};

const LIMITS: SuffixLimits = SuffixLimits {
    first: 3,
    max_length: 8,
    roulette_from: 4,
};

/// Suffixes that begin at what the camera sees, and what both tracers find of each.
fn found(name: &str, count: u32) -> Vec<[Vec<SuffixLight>; 2]> {
    let scene = scene(name);
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let suffixes: Vec<Suffix<Ray, (Vec3, ())>> = (0..count)
        .filter_map(|number| {
            let mut rng = CounterRng::new(5, number, 0);
            let film = Vec2::from(rng.next_2d()) * 32.0;
            let ray = scene.camera().ray(film, [0.5; 2]);
            let vertex = world.arrive(&ray, &scene.accelerator().intersect(&ray)?);
            let sampled = world.sample_lobe(&vertex, -ray.direction, rng.next_f32(), rng.next_2d())?;
            (!sampled.is_delta).then(|| Suffix {
                ray: world.ray(&vertex, sampled.wi),
                direction: sampled.wi,
                site: world.site(&vertex),
                total_pdf: sampled.total_pdf,
                seed: PathSeed::draw(&mut rng),
                importance: 0.9,
            })
        })
        .collect();
    let mut found = vec![[Vec::new(), Vec::new()]; suffixes.len()];
    // Batches of several sizes, of which the tracer makes its own.
    for start in (0..suffixes.len()).step_by(150) {
        let chunk = &suffixes[start..suffixes.len().min(start + 150)];
        let is_traced = world.trace_suffixes(chunk, LIMITS, &mut |number, light| {
            found[start + number][0].push(light);
        });
        assert!(is_traced);
    }
    for (suffix, [_, alone]) in suffixes.iter().zip(&mut found) {
        trace_suffix(&world, suffix, LIMITS, &mut |light| alone.push(light));
    }
    found
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    NoEmitters,
    Length,
    Radiance,
    OtherPdf,
}

fn faulty(light: &SuffixLight, fault: Option<Fault>) -> Option<SuffixLight> {
    let mut light = *light;
    match (&mut light, fault) {
        (
            SuffixLight::Scattered {
                is_sampled_emitter: true,
                ..
            },
            Some(Fault::NoEmitters),
        ) => return None,
        (SuffixLight::Scattered { length, .. }, Some(Fault::Length)) => *length += 1,
        (SuffixLight::Scattered { radiance, .. }, Some(Fault::Radiance)) => *radiance *= 1.05,
        (SuffixLight::Met { emitter_pdf, .. }, Some(Fault::OtherPdf)) => {
            *emitter_pdf = Density::new(1.01 * emitter_pdf.value());
        }
        _ => (),
    }
    Some(light)
}

/// Edges, technique and radiance; of what is met at once the density with it.
fn key(light: &SuffixLight) -> (u32, bool, Vec3, f32) {
    match *light {
        SuffixLight::Met {
            radiance,
            emitter_pdf,
        } => (LIMITS.first, false, radiance, emitter_pdf.value()),
        SuffixLight::Scattered {
            length,
            is_sampled_emitter,
            radiance,
        } => (length, is_sampled_emitter, radiance, 0.0),
    }
}

fn alike(a: &SuffixLight, b: &SuffixLight) -> bool {
    let ((length, technique, radiance, pdf), (length_b, technique_b, radiance_b, pdf_b)) = (key(a), key(b));
    let close = (radiance - radiance_b).abs().max_element() <= 2e-3 * radiance_b.max_element();
    (length, technique) == (length_b, technique_b) && close && (pdf - pdf_b).abs() <= 1e-4 * pdf_b
}

/// On diffuse surfaces both take the same decisions with the same numbers: all but the few paths
/// that rounding sends past an edge find the same light.
#[test]
fn suffixes_between_diffuse_walls_find_the_same_light_in_batches() {
    let found = found("cornell", 4000);
    let faults = [Fault::NoEmitters, Fault::Length, Fault::Radiance, Fault::OtherPdf];
    check_faults(&faults, |fault| {
        let mut different = 0;
        for [together, alone] in &found {
            let together: Vec<_> = together.iter().filter_map(|light| faulty(light, fault)).collect();
            let (mut a, mut b): (Vec<_>, Vec<_>) = (together.iter().collect(), alone.iter().collect());
            a.sort_by_key(|light| (key(light).0, key(light).1));
            b.sort_by_key(|light| (key(light).0, key(light).1));
            let same = a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| alike(a, b));
            different += usize::from(!same);
        }
        println!("{fault:?}: {different} of {}", found.len());
        (different * 500 < found.len()).then_some(()).ok_or(different)
    })
    .unwrap();
}

/// Where lobes are drawn in different ways, means agree. False-positive rate 10⁻⁴.
#[test]
fn suffixes_among_all_materials_find_as_much_light_in_batches() {
    let found = found("zoo", 60_000);
    check_faults(&[Fault::NoEmitters], |fault| {
        let mut moments = [MeanTest::new(), MeanTest::new()];
        for [together, alone] in &found {
            let sum = |lights: &[SuffixLight], fault| -> f64 {
                let scattered = lights
                    .iter()
                    .filter_map(|light| faulty(light, fault))
                    .filter_map(|light| match light {
                        SuffixLight::Met { .. } => None,
                        SuffixLight::Scattered { radiance, .. } => Some(f64::from(radiance.element_sum())),
                    });
                scattered.sum()
            };
            moments[0].push(sum(together, fault));
            moments[1].push(sum(alone, None));
        }
        println!("{fault:?}: {:.4} {:.4}", moments[0].mean(), moments[1].mean());
        moments[0].test_equal(&moments[1], 1e-4).map(|_| ())
    })
    .unwrap();
}
