//! Conditional and joint contribution weights: suffix spaces behind prefixes (Kettunen 2023
//! §§4–7).

use super::finite::Enumerate;
use lightshed_resampling::{
    ConditionallyIndependent, ContributionWeight, Counting, Domain, DomainReservoir, Given, Input, Jacobian,
    Joint, Mis, Reservoir, Ris, ShiftMapping, Shifted, Tractable, Undefined, integrate, merge,
};
use lightshed_testkit::{Chooser, check_faults, distribution, expectation, expectation_vector};

const PREFIX_PMF: [f64; 3] = [0.5, 0.2, 0.3];
const PREFIX_MEASURE: [f64; 3] = [1.0, 2.0, 0.5];
/// Throughput `f_p` of a prefix; positive everywhere.
const PREFIX_THROUGHPUT: [f64; 3] = [0.4, 1.0, 2.5];

const SUFFIX_PMF: [f64; 4] = [0.1, 0.4, 0.2, 0.3];
/// Measures of suffix points behind each prefix: a suffix carried from one to another has a
/// Jacobian.
const SUFFIX_MEASURE: [[f64; 4]; 3] = [[1.0, 0.5, 1.0, 2.0], [0.25, 1.0, 1.0, 1.0], [1.0, 1.0, 3.0, 0.5]];
/// `f_ps(z, x) f_s(x)`: what a suffix contributes behind a prefix. Some are occluded from some
/// prefixes.
const CONTRIBUTION: [[f64; 4]; 3] = [[1.0, 0.0, 2.0, 0.1], [0.3, 4.0, 0.0, 1.0], [2.0, 0.5, 0.7, 0.0]];

/// The suffix space behind a prefix.
#[derive(Clone, Copy, Debug)]
struct Behind {
    prefix: usize,
}

type Suffix = DomainReservoir<Behind, f64>;
type Prefix = Reservoir<usize, Counting, f64>;

impl Domain for Behind {
    type Sample = usize;
    type Space = Given<Counting, Counting>;
    fn target(&self, &x: &usize) -> f64 {
        CONTRIBUTION[self.prefix][x]
    }
}

impl Behind {
    fn draw(&self, chooser: &mut Chooser, confidence: f32) -> Suffix {
        let mut ris = Ris::<usize, Given<Counting, Counting>>::new();
        let x = chooser.choose(&SUFFIX_PMF);
        let density = SUFFIX_PMF[x] / SUFFIX_MEASURE[self.prefix][x];
        let weight = Tractable::<_, f64>::from_density(density).unwrap().weight();
        ris.candidate(x, self.target(&x), weight, &mut Enumerate(chooser));
        ris.finish(confidence)
    }
}

/// Reconnects the same suffix point behind another prefix; prefixes 1 and 2 cannot exchange
/// point 0.
struct Reconnect;

impl ShiftMapping<Behind> for Reconnect {
    fn shift(&self, &x: &usize, from: &Behind, to: &Behind) -> Result<Shifted<usize>, Undefined> {
        if x == 0 && from.prefix + to.prefix == 3 {
            return Err(Undefined::NotConnectable);
        }
        let jacobian = Jacobian::new(SUFFIX_MEASURE[to.prefix][x] / SUFFIX_MEASURE[from.prefix][x])?;
        Ok(Shifted {
            sample: x,
            jacobian,
            target: to.target(&x),
        })
    }
}

const FAMILIES: [Mis; 4] = [
    Mis::Balance,
    Mis::PAIRWISE_UNIFORM,
    Mis::PAIRWISE_DEFENSIVE,
    Mis::ConstantDebiased,
];

fn suffix_integral(prefix: usize) -> f64 {
    (0..4)
        .map(|x| CONTRIBUTION[prefix][x] * SUFFIX_MEASURE[prefix][x])
        .sum()
}

fn full_integral() -> f64 {
    (0..3)
        .map(|z| PREFIX_THROUGHPUT[z] * PREFIX_MEASURE[z] * suffix_integral(z))
        .sum()
}

fn draw_prefix(chooser: &mut Chooser) -> (usize, Tractable<Counting, f64>) {
    let z = chooser.choose(&PREFIX_PMF);
    (
        z,
        Tractable::from_density(PREFIX_PMF[z] / PREFIX_MEASURE[z]).unwrap(),
    )
}

/// A prefix resampled from two candidates by its own throughput.
fn resample_prefix(chooser: &mut Chooser) -> Prefix {
    let mut ris = Ris::<usize, Counting>::new();
    for _ in 0..2 {
        let (z, weight) = draw_prefix(chooser);
        ris.candidate(z, PREFIX_THROUGHPUT[z], weight.weight(), &mut Enumerate(chooser));
    }
    ris.finish(1.0)
}

#[track_caller]
fn assert_close(what: &str, value: f64, truth: f64) {
    assert!(
        (value - truth).abs() < 1e-12 * truth,
        "{what}: {value}, not {truth}"
    );
}

#[test]
fn conditional_weights_integrate_for_each_fixed_condition() {
    for mis in FAMILIES {
        for (z, supporting) in [(0, 1), (1, 2), (2, 0)] {
            let (to, from) = (Behind { prefix: z }, Behind { prefix: supporting });
            let result = expectation_vector(|chooser| {
                let own = to.draw(chooser, 1.0);
                let borrowed = from.draw(chooser, 3.0);
                let inputs = [Input::canonical(&to, &own), Input::neighbour(&from, &borrowed)];
                let merged = merge(&to, &Reconnect, &inputs, mis, &mut Enumerate(chooser))
                    .unwrap()
                    .reservoir;
                let mut values = vec![0.0; 4];
                if let Some((&x, w)) = merged.weighted_sample() {
                    values[x] = w.value();
                }
                values
            });
            for x in 0..4 {
                let truth = if CONTRIBUTION[z][x] > 0.0 {
                    SUFFIX_MEASURE[z][x]
                } else {
                    0.0
                };
                let value = result.values.get(x).copied().unwrap_or(0.0);
                assert!(
                    (value - truth).abs() < 1e-12,
                    "{mis:?}, {z} from {supporting}, {x}: {value}, not {truth}"
                );
            }
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Dependence {
    /// Supporting prefixes are resampled by a target that sees their suffixes (against Kettunen
    /// 2023 eq. 19). Given the supporting prefix, its suffix then is no longer distributed as its
    /// weight says.
    SupportChosenBySuffix,
}

/// An integration prefix, resampled; a suffix for it from its own technique and from a supporting
/// prefix.
#[test]
fn joint_weights_integrate_over_prefix_and_suffix() {
    let run = |mis: Mis, fault: Option<Dependence>| {
        let result = expectation(|chooser| {
            let mut pairs = Ris::<(usize, Suffix), Counting>::new();
            for _ in 0..2 {
                let (z, weight) = draw_prefix(chooser);
                let suffix = Behind { prefix: z }.draw(chooser, 2.0);
                let seen = match fault {
                    Some(Dependence::SupportChosenBySuffix) => suffix.estimate(|&x| CONTRIBUTION[z][x]) + 0.1,
                    None => 1.0,
                };
                let target = PREFIX_THROUGHPUT[z] * seen;
                pairs.candidate((z, suffix), target, weight.weight(), &mut Enumerate(chooser));
            }
            let pair: Reservoir<(usize, Suffix), Counting, f64> = pairs.finish(1.0);
            let (supporting, borrowed) = pair.sample().unwrap();
            let supporting = Behind { prefix: *supporting };

            let prefix = resample_prefix(chooser);
            let (&z, prefix_weight) = prefix.weighted_sample().unwrap();
            let domain = Behind { prefix: z };
            let own = domain.draw(chooser, 1.0);
            let inputs = [
                Input::canonical(&domain, &own),
                Input::neighbour(&supporting, borrowed),
            ];
            let suffix = merge(&domain, &Reconnect, &inputs, mis, &mut Enumerate(chooser))
                .unwrap()
                .reservoir;
            let Some((&x, suffix_weight)) = suffix.weighted_sample() else {
                return 0.0;
            };
            let joint: ContributionWeight<Joint<Counting, Counting>, f64> =
                prefix_weight.join(suffix_weight, ConditionallyIndependent::PROMISED);
            PREFIX_THROUGHPUT[z] * CONTRIBUTION[z][x] * joint.value()
        });
        let error = (result.value / full_integral() - 1.0).abs();
        if error < 1e-12 {
            Ok(())
        } else {
            Err(format!("off by {error:.3}"))
        }
    };
    for mis in FAMILIES {
        for caught in check_faults(&[Dependence::SupportChosenBySuffix], |fault| run(mis, fault)).unwrap() {
            println!("{:?}: {}", caught.fault, caught.message);
        }
    }
}

/// Theorem 4.1 needs its premise: two weights, each right by itself, whose product is wrong because
/// both depend on the prefix that was not chosen.
#[test]
fn weights_that_share_randomness_have_no_product() {
    // The suffix technique looks at the prefix candidate that lost.
    let suffix_pmf = [
        [0.7, 0.1, 0.1, 0.1],
        [0.1, 0.2, 0.3, 0.4],
        [0.25, 0.25, 0.25, 0.25],
    ];
    let draw = |chooser: &mut Chooser, shared: bool| {
        let candidates = [(); 2].map(|()| chooser.choose(&PREFIX_PMF));
        let mut ris = Ris::<usize, Counting>::new();
        for (k, z) in candidates.into_iter().enumerate() {
            let density = PREFIX_PMF[z] / PREFIX_MEASURE[z];
            let weight = Tractable::<_, f64>::from_density(density).unwrap().weight();
            ris.candidate(k, PREFIX_THROUGHPUT[z], weight, &mut Enumerate(chooser));
        }
        let chosen: Prefix = ris.finish(1.0);
        let loser = candidates[1 - chosen.sample().unwrap()];
        let prefix = chosen.map(|k| candidates[k]);
        let x = shared.then(|| chooser.choose(&suffix_pmf[loser]));
        (prefix, x)
    };
    // The suffix's conditional distribution given the prefix, by enumeration: a proper one.
    let joint = distribution(|chooser| {
        let (prefix, x) = draw(chooser, true);
        (*prefix.sample().unwrap(), x.unwrap())
    });
    let marginal = |z: usize| (0..4).map(|x| joint[&(z, x)]).sum::<f64>();
    let conditional = |z: usize| (0..4).map(|x| joint[&(z, x)] / marginal(z)).collect::<Vec<_>>();
    let suffix_weight = |z: usize, x: usize| {
        let density = conditional(z)[x] / SUFFIX_MEASURE[z][x];
        Tractable::<Given<Counting, Counting>, f64>::from_density(density)
            .unwrap()
            .weight()
    };

    check_faults(&["shared"], |fault| {
        let result = expectation(|chooser| {
            let (prefix, x) = draw(chooser, fault.is_some());
            let (&z, prefix_weight) = prefix.weighted_sample().unwrap();
            // The same conditional law, from random numbers of its own.
            let x = x.unwrap_or_else(|| chooser.choose(&conditional(z)));
            let joint = prefix_weight.join(suffix_weight(z, x), ConditionallyIndependent::PROMISED);
            PREFIX_THROUGHPUT[z] * CONTRIBUTION[z][x] * joint.value()
        });
        let error = (result.value / full_integral() - 1.0).abs();
        if error < 1e-12 {
            Ok(())
        } else {
            Err(format!("off by {error:.3}"))
        }
    })
    .unwrap();

    // Each weight by itself is right also under the fault.
    let prefix_alone = expectation(|chooser| {
        let (prefix, _) = draw(chooser, true);
        prefix.estimate(|&z| PREFIX_THROUGHPUT[z])
    });
    let truth = (0..3).map(|z| PREFIX_THROUGHPUT[z] * PREFIX_MEASURE[z]).sum();
    assert_close("prefix", prefix_alone.value, truth);
    for z in [0, 1, 2] {
        let suffix_alone = expectation(|chooser| {
            let (prefix, x) = draw(chooser, true);
            let x = x.unwrap();
            let here = *prefix.sample().unwrap() == z;
            if here {
                CONTRIBUTION[z][x] * suffix_weight(z, x).value() / marginal(z)
            } else {
                0.0
            }
        });
        assert_close("suffix", suffix_alone.value, suffix_integral(z));
    }
}

#[test]
fn a_drawn_prefix_needs_no_promise() {
    let result = expectation(|chooser| {
        let (z, weight) = draw_prefix(chooser);
        let suffix = Behind { prefix: z }.draw(chooser, 1.0);
        let Some((&x, suffix_weight)) = suffix.weighted_sample() else {
            return 0.0;
        };
        PREFIX_THROUGHPUT[z] * CONTRIBUTION[z][x] * weight.join(suffix_weight).value()
    });
    assert_close("tractable prefix", result.value, full_integral());
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Gather {
    /// Kettunen 2023 Algorithm 1, line 12, read wrongly.
    DivideCanonicalByCount,
    /// Prefixes without a canonical suffix leave it out of the MIS weights.
    ForgetCanonicalTechnique,
}

/// Kettunen 2023 eq. 23: many prefixes, one of them with a canonical suffix of its own; for the
/// others roulette has replaced it by a null sample, which keeps its confidence.
#[test]
fn final_gather_with_roulette() {
    let count = 2;
    for mis in [Mis::Balance, Mis::PAIRWISE_DEFENSIVE, Mis::PAIRWISE_UNIFORM] {
        let run = |fault: Option<Gather>| {
            let result = expectation(|chooser| {
                let supporting = Behind {
                    prefix: resample_prefix(chooser).sample().copied().unwrap(),
                };
                let borrowed = supporting.draw(chooser, 2.0);
                let mut total = 0.0;
                for i in 0..count {
                    let (z, prefix_weight) = draw_prefix(chooser);
                    let domain = Behind { prefix: z };
                    let own = match (i, fault) {
                        (0, _) => domain.draw(chooser, 1.0),
                        (_, Some(Gather::ForgetCanonicalTechnique)) => Suffix::empty(1e-9),
                        _ => Suffix::empty(1.0),
                    };
                    let inputs = [
                        Input::canonical(&domain, &own),
                        Input::neighbour(&supporting, &borrowed),
                    ];
                    integrate(&domain, &Reconnect, &inputs, mis, |part| {
                        let x = *part.sample;
                        let path = PREFIX_THROUGHPUT[z] * CONTRIBUTION[z][x];
                        let weight = prefix_weight.weight().value() * part.weight;
                        let canonical = part.input == 0 && fault != Some(Gather::DivideCanonicalByCount);
                        total += path * weight / if canonical { 1.0 } else { f64::from(count) };
                    })
                    .unwrap();
                }
                total
            });
            let error = (result.value / full_integral() - 1.0).abs();
            if error < 1e-12 {
                Ok(())
            } else {
                Err(format!("off by {error:.3}"))
            }
        };
        let faults = [Gather::DivideCanonicalByCount, Gather::ForgetCanonicalTechnique];
        for caught in check_faults(&faults, run).unwrap() {
            println!("{:?}: {}", caught.fault, caught.message);
        }
    }
}
