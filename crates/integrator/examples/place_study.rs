//! Where the variance of `path --guide places` is, by quadrature:
//! `place_study SCENE SIDE FRAMES [setting=value]…`.
//!
//! Direct light of a scene whose emitters are small meshes. A point that a pixel sees integrates
//! `f = cos θ L`. By a density `p`, a flame (a mesh) has the second moment `∫ f²/p dω` over its
//! triangles, a plain sum over stratified points of each. After 1, 2, 4, … frames the table has the
//! second moment of one sample over a grid of pixels, relative to that of the BSDF alone: whole; of
//! flames that the guide samples more often than the BSDF ("known here"); of those that it samples
//! more often elsewhere only; of those that it samples nowhere. Then that of known flames relative
//! to their own by the BSDF, how many flames are known, regions, their mean share, and the least
//! that any directions could have.

use lightshed_integrator::film::FrameMethod;
use lightshed_integrator::{
    DirectionGuide, GuideKind, GuidedPaths, GuidedPathsOptions, GuidedVertex, LightChoosing, LightSelection,
    SceneField,
};
use lightshed_sampling::{CosineHemisphere, CounterRng, DirectionDistribution, luminance};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Geometry, Rgb, Scene, SceneDescription, SurfacePoint, builtin};
use std::error::Error;
use std::sync::atomic::AtomicBool;

/// Points on each triangle.
const STRATA: u32 = 4;
/// Pixels of the grid along an axis.
const GRID: u32 = 48;

/// A sample of a flame that a point sees.
struct Term {
    point: usize,
    flame: usize,
    direction: Vec3,
    /// `f² dω`, and the density of the BSDF.
    square: f64,
    scattering: f64,
    /// `f dω`.
    integral: f64,
}

struct Point {
    position: Vec3,
    normal: Vec3,
    outgoing: Vec3,
}

/// Points of a grid of pixels, and all that they see of flames.
fn terms(description: &SceneDescription, scene: &Scene) -> (Vec<Point>, Vec<Term>, usize) {
    let flames: Vec<(&lightshed_scene::TriangleMesh, f32)> = description
        .shapes
        .iter()
        .filter_map(|shape| match (&shape.geometry, shape.emission) {
            (Geometry::Mesh(mesh), Some(emission)) => Some((mesh, luminance(emission))),
            _ => None,
        })
        .collect();
    let (mut points, mut terms) = (Vec::new(), Vec::new());
    let step = scene.settings().width as f32 / GRID as f32;
    for pixel in 0..GRID * GRID {
        let at = Vec2::new((pixel % GRID) as f32 + 0.5, (pixel / GRID) as f32 + 0.5) * step;
        let ray = scene.camera().ray(at, [0.5; 2]);
        let Some(point) = scene.intersect(&ray) else {
            continue;
        };
        if point.emitter != SurfacePoint::NO_EMITTER {
            continue;
        }
        let outgoing = -ray.direction;
        let normal = point.shading.normal * point.shading.normal.dot(outgoing).signum();
        let mut rng = CounterRng::new(11, pixel, 0);
        for (flame, (mesh, radiance)) in flames.iter().enumerate() {
            for corners in &mesh.indices {
                let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
                let area = 0.5 * (b - a).cross(c - a);
                for k in 0..STRATA {
                    let [u, v] = rng.next_2d();
                    let s = ((k as f32 + u) / STRATA as f32).sqrt();
                    let place = a * (1.0 - s) + b * (s * (1.0 - v)) + c * (s * v);
                    let to = place - point.position;
                    let squared = to.length_squared();
                    let direction = to / squared.sqrt();
                    let facing = -direction.dot(area) / STRATA as f32;
                    let cosine = normal.dot(direction);
                    if !(facing > 0.0 && cosine > 0.0) {
                        continue;
                    }
                    let hit = scene.intersect(&point.spawn(direction));
                    if hit.is_none_or(|hit| hit.position.distance(place) > 1e-3) {
                        continue;
                    }
                    terms.push(Term {
                        point: points.len(),
                        flame,
                        direction,
                        square: f64::from((cosine * radiance).powi(2)) * f64::from(facing / squared),
                        integral: f64::from(cosine * radiance * facing / squared),
                        scattering: f64::from(CosineHemisphere::density(cosine).value()),
                    });
                }
            }
        }
        points.push(Point {
            position: point.position,
            normal,
            outgoing,
        });
    }
    (points, terms, flames.len())
}

fn report(field: &SceneField, points: &[Point], terms: &[Term], flames: usize) {
    let known: Vec<_> = points
        .iter()
        .map(|point| {
            field.guide(&GuidedVertex {
                position: point.position,
                normal: Some(point.normal),
                outgoing: point.outgoing,
                lit: None,
            })
        })
        .collect();
    let mut sums = std::collections::BTreeMap::<(usize, usize), [f64; 4]>::new();
    for term in terms {
        let (share, guide) = known[term.point]
            .as_ref()
            .map_or((0.0, 0.0), |(directions, share)| {
                (
                    f64::from(*share),
                    f64::from(directions.pdf(term.direction).value()),
                )
            });
        let pdf = (1.0 - share) * term.scattering + share * guide;
        let sum = sums.entry((term.point, term.flame)).or_default();
        sum[0] += term.square / term.scattering;
        sum[1] += term.square / pdf;
        sum[2] += share * guide * term.square;
        sum[3] += term.scattering * term.square;
    }
    let mut integrals = vec![0.0; points.len()];
    for term in terms {
        integrals[term.point] += term.integral;
    }
    let least: f64 = integrals.iter().map(|sum| sum * sum).sum();
    let mut anywhere = vec![false; flames];
    for ((_, flame), sum) in &sums {
        anywhere[*flame] |= sum[2] > sum[3];
    }
    let (mut plain, mut parts, mut of_known) = (0.0, [0.0; 3], [0.0; 2]);
    for ((_, flame), sum) in &sums {
        plain += sum[0];
        let part = match (sum[2] > sum[3], anywhere[*flame]) {
            (true, _) => 0,
            (false, true) => 1,
            (false, false) => 2,
        };
        parts[part] += sum[1];
        if part == 0 {
            of_known = [of_known[0] + sum[0], of_known[1] + sum[1]];
        }
    }
    let per_mille = |x: f64| 1000.0 * x / plain;
    println!(
        "{:8.2} {:10.2} {:10.2} {:10.2} {:10.2} {:8} of {flames} {:8} {:6.3} {:8.2}",
        per_mille(parts.iter().sum()),
        per_mille(parts[0]),
        per_mille(parts[1]),
        per_mille(parts[2]),
        1000.0 * of_known[1] / of_known[0],
        anywhere.iter().filter(|known| **known).count(),
        field.learnt_regions(),
        field.mean_share(),
        per_mille(least),
    );
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |i: usize, default: &str| arguments.get(i).cloned().unwrap_or(default.to_owned());
    let mut description = builtin::by_name(&argument(0, "candles")).ok_or("no such scene")?;
    let (side, frames): (u32, u32) = (argument(1, "128").parse()?, argument(2, "256").parse()?);
    (description.settings.width, description.settings.height) = (side, side);
    description.settings.max_depth = Some(2);
    let scene = Scene::new(&description)?;
    let (points, terms, flames) = terms(&description, &scene);
    let emitters = LightSelection::new(&scene, LightChoosing::Unfound)?;
    let mut options = GuidedPathsOptions::new(GuideKind::Places);
    options.may_drop = false;
    for setting in arguments.iter().skip(3) {
        let (name, value) = setting.split_once('=').ok_or("settings are name=value")?;
        match name {
            "places" => options.places.places = value.parse()?,
            "angle" => options.places.prior_angle = value.parse()?,
            "decay" => options.places.decay = value.parse()?,
            "even" => options.places.even_share = value.parse()?,
            "share" => options.field.max_share = value.parse()?,
            "split" => {
                options.field.split_above = value.parse()?;
                options.field.collapse_below = options.field.split_above / 2;
            }
            "exploring" => options.exploring = value.parse()?,
            "within" => options.learn_within = value.parse()?,
            "training" => options.training = value.parse()?,
            "every" => options.every_frame = value.parse()?,
            _ => return Err(format!("no setting {name}").into()),
        }
    }
    let mut method = GuidedPaths::new(&scene, &emitters, options)?;
    let mut image = vec![Rgb::ZERO; (side * side) as usize];
    println!(
        "frame  variance, per mille of the second moment: whole, known here, elsewhere, nowhere, by known; flames; regions; share; least"
    );
    for frame in 0..frames {
        let _ = method.render_frame(frame, 1, &mut image, &AtomicBool::new(false));
        if (frame + 1).is_power_of_two() {
            print!("{:5} {:9.2e}", frame + 1, method.last_variance());
            report(method.field(), &points, &terms, flames);
        }
    }
    Ok(())
}
