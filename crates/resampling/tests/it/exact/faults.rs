//! Planted faults: each mistake that is easily made in resampling is made here once, and the exact
//! proof notices it.
//!
//! Mistakes in *using* the library are made through its interface. Mistakes *inside* a merge are
//! planted in a naive merge of a few lines, which without a fault has the same outcomes with the
//! same probabilities as the shipped one.

use super::finite::{ByLabel, ELSEWHERE, Enumerate, Finite, HERE, Pixel, THERE, deviation};
use lightshed_resampling::{
    Choose, ContributionWeight, Counting, Domain, Input, Jacobian, Mis, Reservoir, Ris, ShiftMapping,
    Shifted, Technique, Tractable, Undefined, merge,
};
use lightshed_testkit::{Chooser, check_faults, distribution, expectation_vector};

const SHIFT: ByLabel = ByLabel { gate: f64::INFINITY };

/// Holds if every indicator's expectation is right to 1e-12.
fn exact(truth: &[f64], run: impl FnMut(&mut Chooser) -> Vec<f64>) -> Result<(), String> {
    let result = expectation_vector(run);
    let error = deviation(&result.values, truth);
    if error < 1e-12 {
        Ok(())
    } else {
        Err(format!("off by {error:.3}: {:?}, not {truth:?}", result.values))
    }
}

#[track_caller]
fn caught<F: Copy + std::fmt::Debug>(faults: &[F], property: impl Fn(Option<F>) -> Result<(), String>) {
    for fault in check_faults(faults, property).unwrap() {
        println!("{:?}: {}", fault.fault, fault.message);
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Inside {
    DivideByJacobian,
    DropJacobian,
    DivideByCountAgain,
    DropTechniqueWhoseOwnSampleFailed,
    DropTechniqueWhoseOwnTargetIsSmall,
    ForgetShareOfUndefinedShift,
    OwnTargetForNeighbour,
}

/// The merge as one would first write it: all densities of all techniques at each candidate,
/// weights by definition.
fn naive_merge(
    chooser: &mut Chooser,
    to: &Finite,
    inputs: &[(&Finite, &Pixel, bool)],
    mis: Mis,
    fault: Option<Inside>,
) -> Pixel {
    let density = |y: usize, (domain, pixel, canonical): (&Finite, &Pixel, bool)| -> Option<f64> {
        let arrived = pixel.sample().map(|x| SHIFT.shift(x, domain, to));
        match (fault, arrived) {
            (Some(Inside::DropTechniqueWhoseOwnSampleFailed), Some(Err(_))) => return None,
            (Some(Inside::DropTechniqueWhoseOwnTargetIsSmall), Some(Ok(s))) if s.target < 0.5 => return None,
            _ => {}
        }
        if canonical {
            return Some(to.target(&y));
        }
        match SHIFT.shift(&y, to, domain) {
            Ok(back) if fault == Some(Inside::OwnTargetForNeighbour) => {
                Some(to.target(&y) * back.jacobian.value())
            }
            Ok(back) => Some(back.target * back.jacobian.value()),
            Err(_) => Some(0.0),
        }
    };
    let (mut sum, mut selected) = (0.0, None);
    for (i, &(domain, pixel, canonical)) in inputs.iter().enumerate() {
        let Some((x, weight)) = pixel.weighted_sample() else {
            continue;
        };
        let arrived = if canonical {
            Shifted {
                sample: *x,
                jacobian: Jacobian::IDENTITY,
                target: to.target(x),
            }
        } else {
            match SHIFT.shift(x, domain, to) {
                Ok(arrived) => arrived,
                Err(_) => continue,
            }
        };
        let y = arrived.sample;
        let techniques: Vec<Technique> = inputs
            .iter()
            .map(|&input| {
                let density = density(y, input);
                let confidence = if density.is_some() {
                    f64::from(input.1.confidence())
                } else {
                    0.0
                };
                Technique {
                    density: density.unwrap_or(0.0),
                    confidence,
                    canonical: input.2,
                }
            })
            .collect();
        let mut weights = vec![0.0; inputs.len()];
        mis.weights(&techniques, &mut weights);
        let mut m = weights[i];
        if fault == Some(Inside::ForgetShareOfUndefinedShift) && canonical {
            // What the canonical sample keeps, without the whole shares of those that cannot
            // produce it.
            let lost = techniques.iter().filter(|t| !t.canonical && t.density == 0.0);
            let total: f64 = techniques.iter().map(|t| t.confidence).sum();
            m -= lost.map(|t| t.confidence / total).sum::<f64>();
        }
        let jacobian = match fault {
            Some(Inside::DivideByJacobian) => 1.0 / arrived.jacobian.value(),
            Some(Inside::DropJacobian) => 1.0,
            _ => arrived.jacobian.value(),
        };
        let w = m * arrived.target * weight.value() * jacobian;
        if w > 0.0 {
            sum += w;
            if Enumerate(chooser).accept(w, sum) {
                selected = Some((y, arrived.target));
            }
        }
    }
    let confidence = inputs.iter().map(|input| input.1.confidence()).sum();
    let Some((y, target)) = selected else {
        return Pixel::empty(confidence);
    };
    let mut weight = sum / target;
    if fault == Some(Inside::DivideByCountAgain) {
        weight /= inputs.len() as f64;
    }
    Reservoir::new(y, ContributionWeight::new(weight).unwrap(), confidence).unwrap()
}

fn three(chooser: &mut Chooser) -> [Pixel; 3] {
    [
        THERE.draw(chooser, 1, 2.0),
        HERE.draw(chooser, 1, 1.0),
        ELSEWHERE.draw(chooser, 1, 1.5),
    ]
}

const ROLES: [(&Finite, bool); 3] = [(&THERE, false), (&HERE, true), (&ELSEWHERE, false)];

#[test]
fn mistakes_inside_the_merge() {
    let run = |mis: Mis, fault: Option<Inside>| {
        exact(&HERE.truth(), |chooser| {
            let pixels = three(chooser);
            let inputs: Vec<_> = ROLES.iter().zip(&pixels).map(|(&(d, c), p)| (d, p, c)).collect();
            HERE.indicators(&naive_merge(chooser, &HERE, &inputs, mis, fault))
        })
    };
    for mis in [Mis::Balance, Mis::PAIRWISE_DEFENSIVE, Mis::PAIRWISE_UNIFORM] {
        let faults = [
            Inside::DivideByJacobian,
            Inside::DropJacobian,
            Inside::DivideByCountAgain,
            Inside::DropTechniqueWhoseOwnSampleFailed,
            Inside::DropTechniqueWhoseOwnTargetIsSmall,
            Inside::OwnTargetForNeighbour,
        ];
        caught(&faults, |fault| run(mis, fault));
    }
    caught(&[Inside::ForgetShareOfUndefinedShift], |fault| {
        run(Mis::PAIRWISE_DEFENSIVE, fault)
    });
}

#[test]
fn the_naive_merge_and_the_shipped_one_have_the_same_outcomes() {
    let key = |pixel: &Pixel| {
        pixel
            .weighted_sample()
            .map_or((usize::MAX, 0), |(&y, w)| (y, (w.value() * 1e9).round() as i64))
    };
    for mis in [
        Mis::ConstantBiased,
        Mis::Balance,
        Mis::PAIRWISE_UNIFORM,
        Mis::PAIRWISE_DEFENSIVE,
    ] {
        let naive = distribution(|chooser| {
            let pixels = three(chooser);
            let inputs: Vec<_> = ROLES.iter().zip(&pixels).map(|(&(d, c), p)| (d, p, c)).collect();
            key(&naive_merge(chooser, &HERE, &inputs, mis, None))
        });
        let shipped = distribution(|chooser| {
            let pixels = three(chooser);
            let inputs = [
                Input::neighbour(&THERE, &pixels[0]),
                Input::canonical(&HERE, &pixels[1]),
                Input::neighbour(&ELSEWHERE, &pixels[2]),
            ];
            key(&merge(&HERE, &SHIFT, &inputs, mis, &mut Enumerate(chooser))
                .unwrap()
                .reservoir)
        });
        assert_eq!(naive.len(), shipped.len());
        for ((a, p), (b, q)) in naive.iter().zip(&shipped) {
            assert!(a == b && (p - q).abs() < 1e-13, "{mis:?}: {a:?} {p}, {b:?} {q}");
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Use {
    CapScalesWeight,
    ConfidenceFromTarget,
    LeaveOutNeighbourWhoseSampleIsUnfit,
    NeighbourWithTheTargetOfThisPixel,
    FloorOnTheSum,
    EmptyNeighbourLosesConfidence,
}

/// A generator's decision as it is often written: divides, by a sum kept away from zero.
struct Floored<'a>(&'a mut Chooser);

impl Choose for Floored<'_> {
    fn accept(&mut self, part: f64, total: f64) -> bool {
        let probability = part / total.max(1e-5);
        probability >= 1.0 || self.0.bernoulli(probability)
    }
}

#[test]
fn mistakes_in_using_the_merge() {
    // Small targets everywhere: a floor of 1e-5 on the sum matters, and nothing else does.
    const DIM: Finite = Finite {
        target: &[0.7e-7, 2.0e-7, 0.1e-7, 0.0, 3.0e-7],
        ..HERE
    };
    // The neighbour's labels with the target of this pixel where they coincide.
    const CONFUSED: Finite = Finite {
        target: &[1.0, 3.0, 2.0, 0.0, 0.7],
        ..THERE
    };
    let faults = [
        Use::CapScalesWeight,
        Use::ConfidenceFromTarget,
        Use::LeaveOutNeighbourWhoseSampleIsUnfit,
        Use::NeighbourWithTheTargetOfThisPixel,
        Use::FloorOnTheSum,
        Use::EmptyNeighbourLosesConfidence,
    ];
    for mis in [Mis::Balance, Mis::PAIRWISE_DEFENSIVE, Mis::PAIRWISE_UNIFORM] {
        caught(&faults, |fault| {
            exact(&DIM.truth(), |chooser| {
                let here = DIM.draw(chooser, 1, 1.0);
                // A technique that comes up empty for reasons that have nothing to do with its
                // sample.
                let mut there = THERE.draw(chooser, 1, 4.0);
                let failed = chooser.bernoulli(0.5);
                let doubled = |w: f64| ContributionWeight::new(2.0 * w).unwrap();
                there = match there.weighted_sample() {
                    Some((&x, w)) if !failed => {
                        let mut weight = doubled(w.value());
                        let mut confidence = 2.5;
                        match fault {
                            Some(Use::CapScalesWeight) => {
                                weight = ContributionWeight::new(weight.value() * 2.5 / 4.0).unwrap();
                            }
                            Some(Use::ConfidenceFromTarget) if THERE.target[x] > 1.0 => confidence = 0.5,
                            _ => {}
                        }
                        Reservoir::new(x, weight, confidence).unwrap()
                    }
                    _ if fault == Some(Use::EmptyNeighbourLosesConfidence) => Reservoir::empty(0.0),
                    _ => Reservoir::empty(2.5),
                };
                let domain = match fault {
                    Some(Use::NeighbourWithTheTargetOfThisPixel) => &CONFUSED,
                    _ => &THERE,
                };
                let mut inputs = vec![Input::canonical(&DIM, &here)];
                let unfit = there
                    .sample()
                    .is_some_and(|x| SHIFT.shift(x, &THERE, &DIM).is_err());
                if !(unfit && fault == Some(Use::LeaveOutNeighbourWhoseSampleIsUnfit)) {
                    inputs.push(Input::neighbour(domain, &there));
                }
                let merged = if fault == Some(Use::FloorOnTheSum) {
                    merge(&DIM, &SHIFT, &inputs, mis, &mut Floored(chooser))
                } else {
                    merge(&DIM, &SHIFT, &inputs, mis, &mut Enumerate(chooser))
                };
                DIM.indicators(&merged.unwrap().reservoir)
            })
        });
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Gate {
    OneSided,
    Clamped,
    OnlyForward,
}

#[derive(Clone, Copy)]
struct Gated(Option<Gate>);

const LIMIT: f64 = 2.5;

impl ShiftMapping<Finite> for Gated {
    fn shift(&self, x: &usize, from: &Finite, to: &Finite) -> Result<Shifted<usize>, Undefined> {
        let mut image = SHIFT.shift(x, from, to)?;
        image.jacobian = match self.0 {
            None | Some(Gate::OnlyForward) => image.jacobian.gated(LIMIT)?,
            Some(Gate::OneSided) if image.jacobian.value() > LIMIT => return Err(Undefined::JacobianGate),
            Some(Gate::OneSided) => image.jacobian,
            Some(Gate::Clamped) => Jacobian::new(image.jacobian.value().clamp(1.0 / LIMIT, LIMIT))?,
        };
        Ok(image)
    }
    fn pull(&self, y: &usize, to: &Finite, from: &Finite) -> Result<lightshed_resampling::Pulled, Undefined> {
        match self.0 {
            Some(Gate::OnlyForward) => SHIFT.pull(y, to, from),
            _ => {
                let back = self.shift(y, to, from)?;
                Ok(lightshed_resampling::Pulled {
                    jacobian: back.jacobian,
                    proxy: back.target,
                })
            }
        }
    }
}

#[test]
fn gates_that_are_not_reciprocal() {
    for mis in [Mis::Balance, Mis::PAIRWISE_DEFENSIVE] {
        caught(&[Gate::OneSided, Gate::Clamped, Gate::OnlyForward], |fault| {
            exact(&HERE.truth(), |chooser| {
                let here = HERE.draw(chooser, 1, 1.0);
                let there = THERE.draw(chooser, 1, 2.0);
                let inputs = [Input::canonical(&HERE, &here), Input::neighbour(&THERE, &there)];
                let merged = merge(&HERE, &Gated(fault), &inputs, mis, &mut Enumerate(chooser)).unwrap();
                HERE.indicators(&merged.reservoir)
            })
        });
    }
}

#[test]
fn the_round_trip_check_sees_a_broken_shift() {
    caught(&[Gate::OneSided], |fault| {
        for x in 0..THERE.labels.len() {
            lightshed_resampling::round_trip(&Gated(fault), &x, &THERE, &HERE, |a, b| a == b, 1e-12)
                .map_err(|broken| format!("{x}: {broken:?}"))?;
        }
        Ok(())
    });
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum InRis {
    DivideByCountAgain,
    ForgetCandidateOfZeroTarget,
    EvaluateThenPack,
}

#[test]
fn mistakes_in_ris() {
    // Packing keeps the upper bits: samples 2k and 2k + 1 are stored as 2k.
    let packed = |x: usize| x & !1;
    let pmf: Vec<f64> = (0..5)
        .map(|x| (0..5).filter(|&z| packed(z) == x).map(|z| HERE.pmf[z]).sum())
        .collect();
    let target = [1.0, 9.0, 0.0, 9.0, 0.5];
    let truth = [HERE.measure[0], 0.0, 0.0, 0.0, HERE.measure[4]];
    let faults = [
        InRis::DivideByCountAgain,
        InRis::ForgetCandidateOfZeroTarget,
        InRis::EvaluateThenPack,
    ];
    caught(&faults, |fault| {
        exact(&truth, |chooser| {
            let mut ris = Ris::<usize, Counting>::new();
            for _ in 0..2 {
                let x = chooser.choose(HERE.pmf);
                let stored = packed(x);
                let evaluated = if fault == Some(InRis::EvaluateThenPack) {
                    x
                } else {
                    stored
                };
                if target[evaluated] == 0.0 && fault == Some(InRis::ForgetCandidateOfZeroTarget) {
                    continue;
                }
                let density = pmf[stored] / HERE.measure[stored];
                let weight = Tractable::<Counting, f64>::from_density(density)
                    .unwrap()
                    .weight();
                ris.candidate(stored, target[evaluated], weight, &mut Enumerate(chooser));
            }
            let count = ris.candidates() as f64;
            let pixel: Pixel = ris.finish(1.0);
            let mut values = HERE.indicators(&pixel);
            if fault == Some(InRis::DivideByCountAgain) {
                values.iter_mut().for_each(|v| *v /= count);
            }
            values
        })
    });
}

/// The two-technique toy: one technique covers [0, 2), the other [0, 1), and `∫ 1 = 2`.
#[test]
fn the_two_technique_toy() {
    const WIDE: Finite = Finite {
        labels: &[0, 1],
        measure: &[1.0, 1.0],
        target: &[1.0, 1.0],
        pmf: &[0.5, 0.5],
        tractable: false,
    };
    const NARROW: Finite = Finite {
        target: &[1.0, 0.0],
        pmf: &[0.9, 0.1],
        ..WIDE
    };
    // Leaving the narrow technique out of the weights whenever its own sample came up empty.
    caught(&["own sample"], |fault| {
        exact(&WIDE.truth(), |chooser| {
            let wide = WIDE.draw(chooser, 1, 1.0);
            let narrow = NARROW.draw(chooser, 1, 1.0);
            let mut inputs = vec![Input::canonical(&WIDE, &wide)];
            if fault.is_none() || !narrow.is_empty() {
                inputs.push(Input::neighbour(&NARROW, &narrow));
            }
            let merged = merge(&WIDE, &SHIFT, &inputs, Mis::Balance, &mut Enumerate(chooser)).unwrap();
            WIDE.indicators(&merged.reservoir)
        })
    });
}
