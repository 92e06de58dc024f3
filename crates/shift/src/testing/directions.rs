//! Directions of held paths against what the world says of them.

use super::alcove::Alcove;
use super::pairs::{mappings, random_paths};
use crate::directions::held_directions;
use crate::world::{RayKind, World, WorldGeometry, WorldScattering};
use lightshed_sampling::glam::Vec3;
use lightshed_testkit::check_faults;

/// What is told wrongly.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// The contribution is not divided by the throughput.
    NoThroughput,
    /// It is divided by the throughput behind the vertex.
    ThroughputBehind,
    /// The density of another direction.
    OtherDensity,
    /// The distance is that from the vertex before.
    OtherDistance,
}

/// A direction, as plain numbers.
#[derive(Clone)]
struct Told<V> {
    vertex: V,
    wo: Vec3,
    wi: Vec3,
    distance: f32,
    scattered: Vec3,
    pdf: f32,
}

fn close(a: Vec3, b: Vec3) -> bool {
    (a - b).abs().max_element() <= 2e-3 * a.abs().max(b.abs()).max_element()
}

/// The first thing that is wrong with the directions of a path.
fn check<W: World>(world: &W, told: &[Told<W::Vertex>]) -> Result<(), String> {
    for (index, this) in told.iter().enumerate() {
        let pdf = world.evaluate(&this.vertex, this.wo, this.wi).pdf.value();
        if (pdf - this.pdf).abs() > 2e-3 * pdf {
            return Err(format!("{index}: density {}, not {pdf}", this.pdf));
        }
        let met = world.trace(&world.ray(&this.vertex, this.wi), RayKind::Path);
        let origin = world.position(&this.vertex);
        // Mirrors tell no direction.
        let may_skip = met
            .as_ref()
            .is_some_and(|met| (0..world.lobe_count(met)).any(|lobe| world.lobe_roughness(met, lobe) == 0.0));
        let distance = met.map_or(f32::INFINITY, |met| world.position(&met).distance(origin));
        if distance != this.distance && (distance - this.distance).abs() > 2e-3 * distance {
            return Err(format!("{index}: distance {}, not {distance}", this.distance));
        }
        let Some(next) = told.get(index + 1) else { continue };
        let arrival = origin + this.wi * this.distance;
        let off = arrival.distance(world.position(&next.vertex));
        if off > 2e-3 * this.distance && may_skip {
            continue;
        }
        if off > 2e-3 * this.distance || this.wi.distance(-next.wo) > 2e-3 {
            return Err(format!("{index}: leads {off} beside the next vertex"));
        }
        // One of the lobes has scattered what the next vertex sends.
        let lobes = 0..world.lobe_count(&this.vertex);
        let explains = |lobe| {
            let scattering = world.evaluate_lobe(&this.vertex, this.wo, this.wi, lobe);
            close(next.scattered * scattering.weight(), this.scattered)
        };
        if !lobes.into_iter().any(explains) {
            return Err(format!("{index}: scatters {}", this.scattered));
        }
    }
    Ok(())
}

/// Directions lead from vertex to vertex, with the world's densities and distances, and each vertex
/// scatters what the next one sends, by a lobe. One path in a hundred may lie where rounding
/// decides.
#[test]
fn directions_are_those_of_the_path() {
    let world = Alcove::new();
    let faults = [
        Fault::NoThroughput,
        Fault::ThroughputBehind,
        Fault::OtherDensity,
        Fault::OtherDistance,
    ];
    check_faults(&faults, |fault| {
        for (label, rules) in mappings() {
            let (mut count, mut pairs, mut wrong, mut message) = (0, 0, 0, String::new());
            random_paths(&world, rules, 1, 4000, |x, from, _| {
                if !from.can_leave(x) {
                    return;
                }
                let mut told = Vec::new();
                held_directions(x, from, |found| {
                    told.push(Told {
                        vertex: found.vertex.clone(),
                        wo: found.wo,
                        wi: found.wi,
                        distance: found.distance,
                        scattered: found.scattered,
                        pdf: found.total_pdf.value(),
                    });
                });
                // Unless the first vertex has no width.
                if let (Some((first, _)), Some(told)) = (from.first(), told.first())
                    && world.position(first) == world.position(&told.vertex)
                {
                    assert_eq!(told.scattered, x.contribution());
                }
                let honest = told.clone();
                for (index, told) in told.iter_mut().enumerate() {
                    let behind = honest
                        .get(index + 1)
                        .map_or(told.scattered, |next| next.scattered);
                    match fault {
                        None => (),
                        Some(Fault::NoThroughput) => told.scattered = x.contribution(),
                        Some(Fault::ThroughputBehind) => told.scattered = behind,
                        Some(Fault::OtherDensity) => {
                            told.pdf = world.evaluate(&told.vertex, told.wo, -told.wi).pdf.value();
                        }
                        Some(Fault::OtherDistance) => told.distance *= 0.5,
                    }
                }
                count += 1;
                pairs += usize::from(told.len() > 1);
                if let Err(error) = check(&world, &told) {
                    wrong += 1;
                    message = format!("{x:?}: {error}");
                }
            });
            assert!(pairs * 8 > count, "{label}: {pairs} of {count}");
            if wrong * 100 > count {
                return Err(format!("{label}: {wrong} of {count}: {message}"));
            }
        }
        Ok(())
    })
    .unwrap();
}
