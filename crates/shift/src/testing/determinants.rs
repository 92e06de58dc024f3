//! The claimed Jacobians against finite differences of the geometry, in `f64`.

use super::alcove::Alcove;
use super::pairs::{mappings, random_paths};
use crate::domain::PathDomain;
use crate::path_shift::PathShift;
use crate::sample::PathSample;
use crate::world::World;
use lightshed_resampling::ShiftMapping;
use lightshed_sampling::glam::{DVec3, Vec3};
use lightshed_testkit::{check_faults, jacobian_determinant};

/// A factor of the determinant that is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Dropped {
    Cosines,
    Distances,
    DensityBefore,
    DensityBehind,
}

/// What is known of a reconnection at the first indirect vertex.
struct Case {
    claimed: f64,
    /// `|dω_y/dω_x|` by finite differences.
    solid_angle: f64,
    cosines: f64,
    distances: f64,
    /// `p(ω_y)/p(ω_x)` of the lobe before the reconnection vertex.
    density_before: f64,
    /// `p(ω_r | ω_y)/p(ω_r | ω_x)` of the lobe at it; 1 where it drops out.
    density_behind: f64,
    /// How much a displacement of a vertex turns the directions, and those the cosines:
    /// `max|x_i| / (d · cos θ)`, the worst of all ends; and how much turning changes densities,
    /// `1/α²` of the narrowest lobe.
    condition: f64,
}

/// How directions from `y` follow those from `x` through the tangent plane at `z`.
fn solid_angle(x: DVec3, y: DVec3, z: DVec3, normal: DVec3) -> f64 {
    let frame = |d: DVec3| {
        let d = d.normalize();
        let (s, t) = d.any_orthonormal_pair();
        [s, t, d]
    };
    let (from, to) = (frame(z - x), frame(z - y));
    // Steep planes are left within less of an angle.
    let step = 1e-2
        * normal.dot(from[2]).abs().min(normal.dot(to[2]).abs())
        * ((z - y).length() / (z - x).length()).min(1.0);
    jacobian_determinant(
        |[a, b]: [f64; 2]| {
            let d = from[2] + from[0] * a + from[1] * b;
            let hit = x + d * ((z - x).dot(normal) / d.dot(normal));
            let e = (hit - y).normalize();
            [e.dot(to[0]), e.dot(to[1])]
        },
        [0.0; 2],
        step,
    )
    .value
}

fn case<'w, W: World>(
    world: &W,
    x: &PathSample,
    from: &PathDomain<'w, W>,
    to: &PathDomain<'w, W>,
) -> Option<Case> {
    let anatomy = x.anatomy();
    let kept = world.vertex(&anatomy.place.filter(|_| anatomy.reconnection == Some(2))?);
    let lobe_before = anatomy.lobe_before?;
    let image = PathShift::default().shift(x, from, to).ok()?;
    let normal = world.geometric_normal(&kept).as_dvec3();
    let z = world.position(&kept);
    let seen = |domain: &PathDomain<'_, W>| {
        let (first, wo) = domain.first()?;
        let position = world.position(first);
        let direction = (z - position).normalize();
        let before = world.evaluate_lobe(first, wo, direction, lobe_before);
        let behind = match (anatomy.lobe_at, anatomy.incident) {
            (Some(lobe), Some(incident)) => {
                world.evaluate_lobe(&kept, -direction, incident, lobe).pdf.value()
            }
            _ => 1.0,
        };
        let cosine = f64::from(world.geometric_normal(first).dot(direction).abs());
        Some((
            position,
            direction,
            cosine,
            [before.pdf.value(), behind].map(f64::from),
        ))
    };
    let (px, dx, cos_x, [before_x, behind_x]) = seen(from)?;
    let (py, dy, cos_y, [before_y, behind_y]) = seen(to)?;
    let cosine = |direction: Vec3| normal.dot(direction.as_dvec3()).abs();
    let least_cosine = cosine(dx).min(cosine(dy)).min(cos_x).min(cos_y);
    let magnitude = f64::from(z.abs().max(px.abs()).max(py.abs()).max_element());
    let squared = |position: Vec3| (z - position).as_dvec3().length_squared();
    let widths = [
        from.first()
            .map_or(0.0, |(first, _)| world.lobe_roughness(first, lobe_before)),
        to.first()
            .map_or(0.0, |(first, _)| world.lobe_roughness(first, lobe_before)),
        anatomy
            .lobe_at
            .map_or(1.0, |lobe| world.lobe_roughness(&kept, lobe)),
    ];
    let width = f64::from(widths.into_iter().fold(1.0, f32::min));
    let condition = magnitude / (squared(px).min(squared(py)).sqrt() * least_cosine * width * width);
    // Finite differences are taken in a plane, as a sphere is only near by. In the tails of lobes
    // single precision resolves nothing.
    let moderate = [before_y / before_x, behind_y / behind_x].map(|ratio| ratio > 1e-3 && ratio < 1e3);
    (cosine(dx).min(cosine(dy)) > 0.02 && moderate == [true; 2]).then(|| Case {
        claimed: image.jacobian.value(),
        solid_angle: solid_angle(px.as_dvec3(), py.as_dvec3(), z.as_dvec3(), normal),
        cosines: cosine(dy) / cosine(dx),
        distances: squared(px) / squared(py),
        density_before: before_y / before_x,
        density_behind: behind_y / behind_x,
        condition,
    })
}

/// Relative deviation over [`Case::condition`] that single precision explains.
const ENVELOPE: f64 = 1e-4;

#[test]
fn determinants_are_those_of_finite_differences() {
    let mut cases = Vec::new();
    let world = Alcove::new();
    for (_, rules) in &mappings()[..4] {
        random_paths(&world, *rules, 6, 10_000, |x, from, to| {
            cases.extend(case(&world, x, from, to));
        });
    }
    assert!(cases.len() > 5_000, "{} cases", cases.len());
    let faults = [
        Dropped::Cosines,
        Dropped::Distances,
        Dropped::DensityBefore,
        Dropped::DensityBehind,
    ];
    let worst = |fault: Option<Dropped>| {
        let deviations = cases.iter().map(|case| {
            let truth = case.solid_angle * case.density_before * case.density_behind;
            let dropped = match fault {
                None => 1.0,
                Some(Dropped::Cosines) => case.cosines,
                Some(Dropped::Distances) => case.distances,
                Some(Dropped::DensityBefore) => case.density_before,
                Some(Dropped::DensityBehind) => case.density_behind,
            };
            (case.claimed / dropped / truth - 1.0).abs() / case.condition
        });
        deviations.fold(0.0, f64::max)
    };
    println!(
        "{} reconnections, worst deviation {:.1e}",
        cases.len(),
        worst(None)
    );
    check_faults(&faults, |fault| match worst(fault) {
        deviation if deviation <= ENVELOPE => Ok(()),
        deviation => Err(deviation),
    })
    .unwrap();
}
