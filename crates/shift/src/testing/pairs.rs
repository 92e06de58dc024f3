//! Pairs of domains and the paths of one of them.

use super::alcove::Alcove;
use crate::connectability::{Connectability, Footprint};
use crate::domain::PathDomain;
use crate::sample::PathSample;
use crate::tracer::{Finding, TreeTracer};
use crate::world::{RayKind, World, WorldGeometry};
use lightshed_sampling::{CounterRng, PathSeed};

/// Longest path of these domains.
pub(crate) const LENGTH: u32 = 5;

/// The mappings under test.
pub(crate) fn mappings() -> [(&'static str, Connectability); 5] {
    let footprint = Footprint::new(0.05, 0.02).unwrap();
    [
        ("hybrid", Connectability::hybrid(0.2, 0.1).unwrap()),
        (
            "hybrid of near vertices",
            Connectability::hybrid(0.05, 0.0).unwrap(),
        ),
        ("reconnection", Connectability::RECONNECTION),
        (
            "footprint",
            Connectability::hybrid(1.0, 0.0)
                .unwrap()
                .with_footprint(footprint),
        ),
        ("replay", Connectability::REPLAY),
    ]
}

/// The same rules of a pixel whose footprint is so many times as large.
pub(crate) fn of_pixel(rules: Connectability, scale: f32) -> Connectability {
    rules.footprint().map_or(rules, |footprint| {
        let [area, solid_angle] = [footprint.area(), footprint.solid_angle()];
        rules.with_footprint(Footprint::new(scale * area, scale * solid_angle).unwrap())
    })
}

/// The domain of a point of the film, `[−1, 1]²`; `None` where nothing is seen.
pub(crate) fn domain(
    world: &Alcove,
    film: [f32; 2],
    rules: Connectability,
) -> Option<PathDomain<'_, Alcove>> {
    let (ray, direction) = world.sensor_ray(&film, [0.5; 4])?;
    let first = world.trace(&ray, RayKind::Sensor)?;
    Some(PathDomain::behind(world, first, -direction, rules, LENGTH))
}

/// A place of the film.
pub(crate) fn film(rng: &mut CounterRng) -> [f32; 2] {
    let [x, y] = rng.next_2d();
    [2.0 * x - 1.0, 1.5 * y]
}

/// Calls `visit` with paths of a random domain, that domain, and another: mostly near by, some of a
/// sensor and some with other thresholds; about `count` paths.
pub(crate) fn random_paths<'w>(
    world: &'w Alcove,
    rules: Connectability,
    seed: u64,
    count: usize,
    mut visit: impl FnMut(&PathSample, &PathDomain<'w, Alcove>, &PathDomain<'w, Alcove>),
) {
    let mut tracer = TreeTracer::new(4);
    let (mut seen, mut turn) = (0, 0);
    while seen < count {
        let mut rng = CounterRng::new(seed, turn, 0);
        turn += 1;
        let place = film(&mut rng);
        let reach = if turn % 4 == 0 { 2.0 } else { 0.2 };
        let [dx, dy] = rng.next_2d();
        let other = [place[0] + reach * (dx - 0.5), place[1] + reach * (dy - 0.5)];
        let stricter = if rules.footprint().is_some() {
            of_pixel(rules, [0.5, 3.0, 1.0, 2.0][turn as usize % 4])
        } else if turn % 5 == 0 && rules.replays() && rules.reaches(3) {
            Connectability::hybrid(0.35, 0.3).unwrap_or(rules)
        } else {
            rules
        };
        let (from, to) = if turn % 3 == 0 {
            (
                PathDomain::of_sensor(world, place, rules, LENGTH),
                PathDomain::of_sensor(world, other, stricter, LENGTH),
            )
        } else {
            let (Some(from), Some(to)) = (domain(world, place, rules), domain(world, other, stricter)) else {
                continue;
            };
            (from, to)
        };
        for path in paths(&mut tracer, &from, &mut rng, 8) {
            seen += 1;
            visit(&path, &from, &to);
        }
    }
}

/// The paths of so many trees.
pub(crate) fn paths<W: World>(
    tracer: &mut TreeTracer<W>,
    domain: &PathDomain<'_, W>,
    rng: &mut CounterRng,
    trees: usize,
) -> Vec<PathSample> {
    let mut found = Vec::new();
    let trees: Vec<_> = (0..trees).map(|_| (domain, PathSeed::draw(rng))).collect();
    tracer.trace(&trees, |_, finding| {
        if let Finding::Path(path, _) = finding {
            found.push(*path);
        }
    });
    found
}
