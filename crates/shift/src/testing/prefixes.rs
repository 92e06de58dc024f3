//! Prefixes: what lies before them and behind them adds up, and shifts return.

use super::alcove::Alcove;
use super::naive::radiance_sample;
use super::pairs::{LENGTH, film};
use crate::connectability::Connectability;
use crate::prefix::{PrefixDomain, PrefixFinding, PrefixSample, PrefixShift, PrefixStart, PrefixTracer};
use crate::world::{RayKind, World, WorldGeometry, WorldLighting};
use lightshed_resampling::{
    DomainReservoir, Input, Jacobian, Mis, Reservoir, Ris, ShiftMapping, Shifted, Undefined, merge,
};
use lightshed_sampling::{CounterRng, PathSeed};
use lightshed_testkit::{MeanTest, ShiftConformance, check_faults};

fn ends() -> Connectability {
    Connectability::hybrid(0.2, 0.1).unwrap()
}

/// The prefixes of a point of the film.
fn prefixes(world: &Alcove, film: [f32; 2]) -> Option<PrefixDomain<'_, Alcove>> {
    let (ray, direction) = world.sensor_ray(&film, [0.5; 4])?;
    let first = world.trace(&ray, RayKind::Sensor)?;
    Some(PrefixDomain::behind(world, first, -direction, ends(), LENGTH))
}

/// What is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Lost {
    /// Emitters sampled or met on the way.
    Light,
    /// The suffixes are those of a path as long as if the prefix had no edges.
    Length,
    /// The throughput of the prefix.
    Throughput,
    /// Light by two edges counts twice: in the estimator that it is left to, and on the way.
    Twice,
    /// The number of the first direction is not uniform.
    First,
}

/// Longest path of the sums below: short, so that a length that is off by one is seen.
const EDGES: u32 = 4;

/// The radiance that a sensor measures is the light on the way of prefixes, and their throughput
/// times what leaves their last vertices. With roulette from the second vertex on. Light by at
/// most two edges has an estimator of its own here, and the first scattering has its own numbers.
/// False-positive rate 10⁻⁵.
#[test]
fn prefixes_and_suffixes_add_up_to_paths() {
    let world = Alcove::new();
    let pixel = [0.1, 0.4];
    let mut truth = MeanTest::new();
    for sample in 0..200_000 {
        let mut rng = CounterRng::new(31, 0, sample);
        let ([a, b], [c, d]) = (rng.next_2d(), rng.next_2d());
        let (ray, direction) = world.sensor_ray(&pixel, [a, b, c, d]).unwrap();
        truth.push(match world.trace(&ray, RayKind::Sensor) {
            Some(first) => {
                let seen = world.emitted(&first, -direction).as_dvec3();
                (seen + radiance_sample(&world, first, -direction, EDGES, &mut rng)).element_sum()
            }
            None => world.environment(direction).as_dvec3().element_sum(),
        });
    }
    let domain = PrefixDomain::of_sensor(&world, pixel, ends(), EDGES);
    let short = PrefixDomain::of_sensor(&world, pixel, ends(), 2);
    let faults = [
        Lost::Light,
        Lost::Length,
        Lost::Throughput,
        Lost::Twice,
        Lost::First,
    ];
    check_faults(&faults, |lost| {
        let least = if lost == Some(Lost::Twice) { 0 } else { 3 };
        let (mut direct, mut found) = (PrefixTracer::new(2), MeanTest::new());
        let mut tracer = PrefixTracer::new(2).with_least_length(least);
        for sample in 0..100_000 {
            let mut rng = CounterRng::new(32, 0, sample);
            let (mut light, mut end) = (0.0, None);
            let [seed, other] = [0, 1].map(|_| PathSeed::draw(&mut rng));
            direct.trace(
                &[PrefixStart::new(&short, other)],
                true,
                |_, finding| match finding {
                    PrefixFinding::Light(radiance) => light += radiance.as_dvec3().element_sum(),
                    PrefixFinding::Prefix(..) => panic!("a prefix of two edges"),
                },
            );
            let [u, v] = rng.next_2d();
            let first = match lost {
                Some(Lost::First) => [rng.next_f32(), 0.5 * u, v],
                _ => [rng.next_f32(), u, v],
            };
            let start = PrefixStart {
                first: Some(first),
                ..PrefixStart::new(&domain, seed)
            };
            tracer.trace(&[start], true, |_, finding| match finding {
                PrefixFinding::Light(_) if lost == Some(Lost::Light) => (),
                PrefixFinding::Light(radiance) => light += radiance.as_dvec3().element_sum(),
                PrefixFinding::Prefix(prefix, vertex, weight) => {
                    end = Some((*prefix, vertex.clone(), weight.value()));
                }
            });
            if let Some((prefix, vertex, weight)) = end {
                assert!(prefix.length() < EDGES);
                let length = match lost {
                    Some(Lost::Length) => EDGES,
                    _ => EDGES + 1 - prefix.length(),
                };
                let behind = radiance_sample(&world, vertex, prefix.wo(), length, &mut rng);
                let throughput = match lost {
                    Some(Lost::Throughput) => 1.0,
                    _ => weight,
                };
                let value = match lost {
                    Some(Lost::Throughput) => behind,
                    _ => behind * prefix.throughput().as_dvec3(),
                };
                light += value.element_sum() * throughput;
            }
            found.push(light);
        }
        println!("{lost:?}: {:.4} against {:.4}", found.mean(), truth.mean());
        found
            .test_equal(&truth, 1e-5)
            .map(|_| ())
            .map_err(|error| error.to_string())
    })
    .unwrap();
}

/// A prefix of a domain with its weight.
fn draw<W: World>(
    tracer: &mut PrefixTracer<W>,
    domain: &PrefixDomain<'_, W>,
    rng: &mut CounterRng,
) -> Reservoir<PrefixSample, lightshed_sampling::PrimarySample> {
    let mut found = Vec::new();
    tracer.trace(
        &[PrefixStart::new(domain, PathSeed::draw(rng))],
        false,
        |_, finding| {
            if let PrefixFinding::Prefix(prefix, _, weight) = finding {
                found.push((*prefix, weight));
            }
        },
    );
    let mut ris = Ris::new();
    for (prefix, weight) in found {
        ris.candidate(prefix, prefix.target(), weight, rng);
    }
    ris.finish(1.0)
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    NoJacobian,
    InverseJacobian,
    /// The image keeps the density of the base prefix.
    StaleDensity,
    /// The image keeps the throughput of the base prefix.
    StaleThroughput,
}

struct Faulty(Option<Fault>);

impl<'w, W: World> ShiftMapping<PrefixDomain<'w, W>> for Faulty {
    fn shift(
        &self,
        x: &PrefixSample,
        from: &PrefixDomain<'w, W>,
        to: &PrefixDomain<'w, W>,
    ) -> Result<Shifted<PrefixSample>, Undefined> {
        let mut image = PrefixShift.shift(x, from, to)?;
        match self.0 {
            Some(Fault::NoJacobian) => image.jacobian = Jacobian::IDENTITY,
            Some(Fault::InverseJacobian) => image.jacobian = image.jacobian.inverse(),
            Some(Fault::StaleDensity) => image.sample.density = x.density,
            Some(Fault::StaleThroughput) => {
                image.sample.throughput = x.throughput;
                image.target = x.target();
            }
            None => (),
        }
        Ok(image)
    }
}

/// There and back it is the same prefix with the reciprocal Jacobian; at home it is itself.
#[test]
fn prefixes_return() {
    let world = Alcove::new();
    check_faults(&[Fault::StaleDensity], |fault| {
        let there = |x: &PrefixSample, from: &PrefixDomain<'_, Alcove>, to: &PrefixDomain<'_, Alcove>| {
            let image = Faulty(fault).shift(x, from, to).ok()?;
            Some((image.sample, image.jacobian.value()))
        };
        let same = |a: &PrefixSample, b: &PrefixSample| a.is_same_prefix(b);
        let mut kit = ShiftConformance::new(&there, &same, 1e-4);
        let mut tracer = PrefixTracer::new(9);
        let (mut long, mut home) = (0, 0);
        for turn in 0..20_000 {
            let mut rng = CounterRng::new(33, turn, 0);
            let place = film(&mut rng);
            let [dx, dy] = rng.next_2d();
            let other = [place[0] + 0.3 * (dx - 0.5), place[1] + 0.3 * (dy - 0.5)];
            let (Some(from), Some(to)) = (prefixes(&world, place), prefixes(&world, other)) else {
                continue;
            };
            let reservoir = draw(&mut tracer, &from, &mut rng);
            let Some(prefix) = reservoir.sample() else {
                continue;
            };
            kit.check(prefix, &from, &to);
            long += u32::from(prefix.length() > 2);
            let image = PrefixShift.shift(prefix, &from, &from).unwrap();
            home += 1;
            let off = (image.target / prefix.target() - 1.0).abs();
            assert!(
                off < 1e-3 && (image.jacobian.value() - 1.0).abs() < 1e-3,
                "at home off by {off:.1e}"
            );
        }
        let tally = kit.tally();
        assert!(home > 3000 && long > 500, "{home} prefixes, {long} of them long");
        assert!(tally.defined > 2 * tally.undefined, "{tally:?}");
        if tally.is_conformant() {
            Ok(())
        } else {
            Err(format!("{tally:?}"))
        }
    })
    .unwrap();
}

/// What stands for the light behind a prefix: a smooth function of where it ends.
fn behind(world: &Alcove, prefix: &PrefixSample, domain: &PrefixDomain<'_, Alcove>) -> f64 {
    let suffixes = domain.suffixes(prefix, ends());
    let (last, wo) = suffixes.first().unwrap();
    assert_eq!(wo, prefix.wo());
    let position = world.position(last).as_dvec3();
    let value = 0.1 + (position.x + 1.0).powi(2) + (position.y + 0.5).powi(2);
    value * prefix.throughput().as_dvec3().element_sum()
}

/// Prefixes merged with a neighbour's integrate as the domain's own do, though they start
/// elsewhere. False-positive rate 10⁻⁵.
#[test]
fn merged_prefixes_integrate_as_their_own() {
    let world = Alcove::new();
    let pair = [[0.1, 0.25], [0.45, 0.5]].map(|place| prefixes(&world, place).unwrap());
    let mut tracer = PrefixTracer::new(9);
    let mut truth = MeanTest::new();
    for sample in 0..150_000 {
        let mut rng = CounterRng::new(34, 0, sample);
        let own = draw(&mut tracer, &pair[0], &mut rng);
        truth.push(own.estimate(|prefix| behind(&world, prefix, &pair[0])));
    }
    let faults = [Fault::NoJacobian, Fault::InverseJacobian, Fault::StaleThroughput];
    check_faults(&faults, |fault| {
        let (mut tracer, mut mean) = (PrefixTracer::new(9), MeanTest::new());
        for sample in 0..60_000 {
            let mut rng = CounterRng::new(35, 0, sample);
            let [own, other]: [DomainReservoir<PrefixDomain<'_, Alcove>>; 2] =
                core::array::from_fn(|place| draw(&mut tracer, &pair[place], &mut rng));
            let inputs = [
                Input::canonical(&pair[0], &own),
                Input::neighbour(&pair[1], &other),
            ];
            let merged = merge(&pair[0], &Faulty(fault), &inputs, Mis::Balance, &mut rng).unwrap();
            mean.push(
                merged
                    .reservoir
                    .estimate(|prefix| behind(&world, prefix, &pair[0])),
            );
        }
        println!(
            "{fault:?}: {:.4} ± {:.4} against {:.4}",
            mean.mean(),
            mean.standard_error(),
            truth.mean()
        );
        mean.test_equal(&truth, 1e-5)
            .map(|_| ())
            .map_err(|error| error.to_string())
    })
    .unwrap();
}
