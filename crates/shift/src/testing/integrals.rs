//! What domains integrate to, by their own paths and by those of their neighbours.

use super::alcove::Alcove;
use super::naive::radiance_sample;
use super::pairs::{LENGTH, domain, film, mappings, of_pixel};
use crate::connectability::Connectability;
use crate::domain::PathDomain;
use crate::path_shift::PathShift;
use crate::tracer::{Finding, TreeTracer};
use crate::world::{RayKind, World, WorldGeometry, WorldLighting};
use lightshed_resampling::{
    DomainReservoir, Input, Jacobian, Mis, MixtureRis, Pulled, ShiftMapping, Shifted, Undefined, merge,
};
use lightshed_sampling::{CounterRng, PathSeed};
use lightshed_testkit::{MeanTest, check_faults};

/// The radiance behind a domain's first vertex, by the naive path tracer.
fn truth<W: World>(world: &W, domain: &PathDomain<'_, W>, samples: u32) -> MeanTest {
    let mut mean = MeanTest::new();
    let Some((first, wo)) = domain.first() else {
        return mean;
    };
    for sample in 0..samples {
        let mut rng = CounterRng::new(7, 0, sample);
        mean.push(radiance_sample(world, first.clone(), wo, LENGTH, &mut rng).element_sum());
    }
    mean
}

/// Trees find, in the mean over the film, what naive path tracing does: at given first vertices
/// with roulette, and from sensors with what these see directly. False-positive rate 10⁻⁵ for
/// each mapping.
#[test]
fn trees_find_the_light_of_path_tracing() {
    let world = Alcove::new();
    let samples = 40_000u32;
    let mut expected = [MeanTest::new(), MeanTest::new()];
    for sample in 0..4 * samples {
        let mut rng = CounterRng::new(8, 0, sample);
        let Some(domain) = domain(&world, film(&mut rng), Connectability::REPLAY) else {
            expected[0].push(0.0);
            continue;
        };
        let Some((first, wo)) = domain.first() else {
            continue;
        };
        expected[0].push(radiance_sample(&world, first.clone(), wo, LENGTH, &mut rng).element_sum());
    }
    let pixel = [0.1, 0.4];
    for sample in 0..4 * samples {
        let mut rng = CounterRng::new(9, 0, sample);
        let ([a, b], [c, d]) = (rng.next_2d(), rng.next_2d());
        let Some((ray, direction)) = world.sensor_ray(&pixel, [a, b, c, d]) else {
            continue;
        };
        expected[1].push(match world.trace(&ray, RayKind::Sensor) {
            Some(first) => {
                let seen = world.emitted(&first, -direction).as_dvec3();
                (seen + radiance_sample(&world, first, -direction, LENGTH, &mut rng)).element_sum()
            }
            None => world.environment(direction).as_dvec3().element_sum(),
        });
    }
    for (label, rules) in mappings() {
        let mut trees = TreeTracer::new(3);
        let mut found = [MeanTest::new(), MeanTest::new()];
        for sample in 0..samples {
            let mut rng = CounterRng::new(10, 0, sample);
            let place = film(&mut rng);
            let of_sensor = PathDomain::of_sensor(&world, pixel, rules, LENGTH);
            for (domain, found) in [domain(&world, place, rules), Some(of_sensor)]
                .iter()
                .zip(&mut found)
            {
                let mut sum = 0.0;
                if let Some(domain) = domain {
                    trees.trace(
                        &[(domain, PathSeed::draw(&mut rng))],
                        |_, finding| match finding {
                            Finding::Path(path, weight) => {
                                sum += path.contribution().as_dvec3().element_sum() * weight.value();
                            }
                            Finding::Seen(radiance) => sum += radiance.as_dvec3().element_sum(),
                        },
                    );
                }
                found.push(sum);
            }
        }
        for (found, expected) in found.iter().zip(&expected) {
            let report = found.test_equal(expected, 1e-5);
            println!(
                "{label}: {:.4?} against {:.4?}",
                (found.mean(), found.standard_error()),
                (expected.mean(), expected.standard_error())
            );
            report.unwrap_or_else(|error| panic!("{label}: {error}"));
        }
    }
}

/// Trees without short paths find the other paths of the same trees, bit for bit, in the same
/// order. Planted faults: one edge too few or too many is left out.
#[test]
fn trees_without_short_paths_find_the_others() {
    let world = Alcove::new();
    let find = |domain: &PathDomain<'_, Alcove>, seed, least| {
        let mut paths = Vec::new();
        TreeTracer::new(3)
            .with_least_length(least)
            .trace(&[(domain, seed)], |_, finding| {
                if let Finding::Path(path, weight) = finding {
                    paths.push((*path, weight));
                }
            });
        paths
    };
    let caught = check_faults(&[-1i32, 1], |fault| {
        for (label, rules) in mappings() {
            for sample in 0..200 {
                let mut rng = CounterRng::new(12, 0, sample);
                let Some(domain) = domain(&world, film(&mut rng), rules) else {
                    continue;
                };
                let seed = PathSeed::draw(&mut rng);
                let mut expected = find(&domain, seed, 0);
                expected.retain(|(path, _)| path.shape().length >= 3);
                let least = 3u32.saturating_add_signed(fault.unwrap_or(0));
                if find(&domain, seed, least) != expected {
                    return Err(format!("{label}, {sample}"));
                }
            }
        }
        Ok(())
    });
    caught.unwrap();
}

/// A shift that is none.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Jacobians are 1.
    NoJacobian,
    /// Densities are divided by: `1/J`.
    InverseJacobian,
    /// Paths that the neighbour cannot hold count for it all the same.
    ForgottenSupport,
    /// The base path's pixel decides which pairs of the image are connectable.
    ThresholdsOfBase,
}

struct Wrapped(Option<Fault>);

impl Wrapped {
    /// The domain as an image is judged by.
    fn judged<'w, W: World>(&self, to: &PathDomain<'w, W>, from: &PathDomain<'w, W>) -> PathDomain<'w, W> {
        let judge = if self.0 == Some(Fault::ThresholdsOfBase) {
            from
        } else {
            to
        };
        PathDomain {
            connectability: judge.connectability,
            ..to.clone()
        }
    }

    fn jacobian(&self, jacobian: Jacobian) -> Result<Jacobian, Undefined> {
        match self.0 {
            Some(Fault::NoJacobian) => Ok(Jacobian::IDENTITY),
            Some(Fault::InverseJacobian) => Jacobian::new(jacobian.value().recip()),
            _ => Ok(jacobian),
        }
    }
}

impl<'w, W: World> ShiftMapping<PathDomain<'w, W>> for Wrapped {
    fn shift(
        &self,
        x: &crate::PathSample,
        from: &PathDomain<'w, W>,
        to: &PathDomain<'w, W>,
    ) -> Result<Shifted<crate::PathSample>, Undefined> {
        let image = PathShift::default().shift(x, from, &self.judged(to, from))?;
        Ok(Shifted {
            jacobian: self.jacobian(image.jacobian)?,
            ..image
        })
    }

    fn pull(
        &self,
        y: &crate::PathSample,
        to: &PathDomain<'w, W>,
        from: &PathDomain<'w, W>,
    ) -> Result<Pulled, Undefined> {
        match (PathShift::default().pull(y, to, &self.judged(from, to)), self.0) {
            (Err(_), Some(Fault::ForgottenSupport)) => Ok(Pulled {
                jacobian: Jacobian::IDENTITY,
                proxy: lightshed_resampling::Domain::target(to, y),
            }),
            (Ok(pulled), _) => Ok(Pulled {
                jacobian: self.jacobian(pulled.jacobian)?,
                ..pulled
            }),
            (error, _) => error,
        }
    }
}

/// Means of merged reservoirs, and of what can be neither reconnected nor replayed and is summed
/// where it was found.
fn merged<'w, W: World>(
    pair: [&PathDomain<'w, W>; 2],
    shift: &impl ShiftMapping<PathDomain<'w, W>>,
    merges: u32,
) -> MeanTest {
    let (mut tracer, mut mean) = (TreeTracer::new(u32::MAX), MeanTest::new());
    for sample in 0..merges {
        let mut rng = CounterRng::new(11, 0, sample);
        let mut stays = [0.0; 2];
        let [a, b]: [DomainReservoir<PathDomain<'w, W>>; 2] = core::array::from_fn(|place| {
            let (domain, mut ris) = (pair[place], MixtureRis::new());
            let seed = PathSeed::draw(&mut rng);
            tracer.trace(&[(domain, seed)], |_, finding| {
                if let Finding::Path(path, weight) = finding {
                    if domain.can_leave(path) {
                        ris.candidate(*path, path.target(), 1.0, weight, &mut rng);
                    } else {
                        stays[place] += path.contribution().as_dvec3().element_sum() * weight.value();
                    }
                }
            });
            ris.finish(1.0)
        });
        let inputs = [Input::canonical(pair[0], &a), Input::neighbour(pair[1], &b)];
        let merged = merge(pair[0], shift, &inputs, Mis::Balance, &mut rng).unwrap();
        let shared = merged
            .reservoir
            .estimate(|path| path.contribution().as_dvec3().element_sum());
        mean.push(stays[0] + shared);
    }
    mean
}

/// Merged with a neighbour's, a domain's reservoir has the mean of path tracing: across the edge
/// between the rough and the smooth half of the floor, where other pairs are connectable, and
/// towards the glossy wall. False-positive rate 10⁻⁵ for each.
#[test]
fn merges_have_the_mean_of_path_tracing() {
    let world = Alcove::new();
    let places = [[0.1, 0.25], [-0.1, 0.25]];
    let glossy = [[0.55, 0.7], [0.6, 0.6]];
    let faults = [
        Fault::NoJacobian,
        Fault::InverseJacobian,
        Fault::ForgottenSupport,
        Fault::ThresholdsOfBase,
    ];
    let truths: Vec<_> = [places, [places[1], places[0]], glossy]
        .into_iter()
        .map(|pair| {
            let domain = domain(&world, pair[0], Connectability::REPLAY).unwrap();
            (pair, truth(&world, &domain, 200_000))
        })
        .collect();
    check_faults(&faults, |fault| {
        for (label, rules) in &mappings()[..4] {
            for (pair, truth) in &truths {
                let of = |place: usize, scale| domain(&world, pair[place], of_pixel(*rules, scale)).unwrap();
                let pair = [of(0, 1.0), of(1, 8.0)];
                let mean = merged([&pair[0], &pair[1]], &Wrapped(fault), 30_000);
                println!(
                    "{fault:?} {label}: {:.4} ± {:.4} against {:.4}",
                    mean.mean(),
                    mean.standard_error(),
                    truth.mean()
                );
                mean.test_equal(truth, 1e-5)
                    .map_err(|error| format!("{label}: {error}"))?;
            }
        }
        Ok::<_, String>(())
    })
    .unwrap();
}
