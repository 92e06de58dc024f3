//! Passes over domains some of which are absent, and over neighbours that no grid has: each
//! domain's expectations after a whole pass are exact, and planted faults are not.

use super::finite::{ByLabel, ELSEWHERE, Finite, HERE, Pixel, THERE, deviation};
use super::merging::unbiased_families;
use lightshed_resampling::{
    CellGrid, Choose, Contribution, Domain, Domains, History, MergeRule, Mis, NeighbourLists, Reuse, Sums,
    Topology,
};
use lightshed_testkit::{Chooser, check_faults, expectation_vector};
use std::sync::{Arc, Mutex};

const SHIFT: ByLabel = ByLabel { gate: f64::INFINITY };

/// Three domains and one that is absent.
const DOMAINS: [Option<Finite>; 4] = [Some(HERE), None, Some(THERE), Some(ELSEWHERE)];
const CONFIDENCES: [f32; 4] = [1.0, 0.0, 2.5, 0.5];

/// Mistakes that a user can make.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// The absent domain is left out of the row, so that those behind it move up; their reservoirs
    /// stay.
    MovedUp,
    /// Neighbours are chosen by what they hold.
    EmptyNeighboursLeftOut,
}

/// A renderer's own container.
struct Row(Option<Fault>);

impl Domains for Row {
    type Domain = Finite;
    fn count(&self) -> usize {
        DOMAINS.len()
    }
    fn domain(&self, index: usize) -> Option<&Finite> {
        // Present where it should be, but another one.
        let moved = match (self.0, index) {
            (Some(Fault::MovedUp), 2) => 3,
            _ => index,
        };
        const { &DOMAINS }.domain(index)?;
        const { &DOMAINS }.domain(moved)
    }
}

/// The enumerator, shared by all domains of a pass: they are merged one after the other.
#[derive(Clone)]
pub struct Shared(Arc<Mutex<Chooser>>);

impl Choose for Shared {
    fn accept(&mut self, part: f64, total: f64) -> bool {
        part == total || self.0.lock().unwrap().bernoulli(part / total)
    }
}

/// Runs `pass` with the enumerator behind a pointer.
pub fn shared(chooser: &mut Chooser, pass: impl FnOnce(Shared)) {
    let shared = Shared(Arc::new(Mutex::new(std::mem::take(chooser))));
    pass(shared.clone());
    *chooser = std::mem::take(&mut shared.0.lock().unwrap());
}

fn fresh(chooser: &mut Chooser) -> Vec<Pixel> {
    let draw = |(domain, confidence): (&Option<Finite>, f32)| match domain {
        Some(domain) => domain.draw(chooser, 1, confidence),
        None => Pixel::empty(0.0),
    };
    DOMAINS.iter().zip(CONFIDENCES).map(draw).collect()
}

/// Every indicator of every domain that is there.
fn indicators(reservoirs: &[Pixel]) -> Vec<f64> {
    assert_eq!(reservoirs[1], Pixel::empty(0.0), "the absent domain");
    let domains = DOMAINS.iter().flatten();
    domains
        .zip([0, 2, 3])
        .flat_map(|(domain, index)| domain.indicators(&reservoirs[index]))
        .collect()
}

fn exact(run: impl FnMut(&mut Chooser) -> Vec<f64>) -> Result<(), String> {
    let truth: Vec<f64> = DOMAINS.iter().flatten().flat_map(Finite::truth).collect();
    let result = expectation_vector(run);
    let error = deviation(&result.values, &truth);
    if error < 1e-12 {
        Ok(())
    } else {
        Err(format!("off by {error:.3}"))
    }
}

/// A directed graph: nobody reuses from the third domain but the fourth, the absent one is
/// everybody's neighbour.
fn graph() -> NeighbourLists {
    NeighbourLists::new([vec![1, 3], vec![0, 2], vec![1, 0], vec![0, 1, 2]]).unwrap()
}

fn spatial(mis: Mis, topology: &impl Topology, fault: Option<Fault>) -> Result<(), String> {
    let reuse = Reuse::new(Row(fault), MergeRule::new(SHIFT).with_mis(mis));
    exact(|chooser| {
        let input = fresh(chooser);
        let mut output = input.clone();
        let kept =
            |_: usize, other: usize| fault != Some(Fault::EmptyNeighboursLeftOut) || !input[other].is_empty();
        shared(chooser, |choose| {
            let topology = topology.filtered(kept);
            reuse
                .spatial(topology, &input, &mut output, |_| choose.clone())
                .unwrap();
        });
        indicators(&output)
    })
}

#[test]
fn a_graph_with_an_absent_domain() {
    for mis in unbiased_families() {
        let faults = [Fault::MovedUp, Fault::EmptyNeighboursLeftOut];
        check_faults(&faults, |fault| spatial(mis, &graph(), fault)).unwrap();
    }
    // The control: by constant weights a family is found out that asks nobody.
    assert!(spatial(Mis::ConstantBiased, &graph(), None).is_err());
}

#[test]
fn cells_of_a_grid_with_an_absent_cell() {
    for shape in [[2, 2, 1], [4, 1, 1], [1, 2, 2]] {
        let cells = CellGrid::new(shape, 1).unwrap();
        check_faults(&[Fault::MovedUp], |fault| {
            spatial(Mis::PAIRWISE_DEFENSIVE, &cells, fault)
        })
        .unwrap();
    }
}

/// A domain that appears has no history, one that vanishes leaves none.
#[test]
fn histories_with_absent_domains() {
    const BEFORE: [Option<Finite>; 3] = [None, Some(THERE), Some(HERE)];
    // The first domain was not there, the third is another one now, the fourth comes from beyond
    // the row.
    let places = [0, 1, 2, 7];
    let run = |mis: Mis, fault: Option<Fault>| {
        let reuse = Reuse::new(Row(fault), MergeRule::new(SHIFT).with_mis(mis));
        exact(|chooser| {
            let now = fresh(chooser);
            let held: Vec<Pixel> = BEFORE
                .iter()
                .map(|domain| match domain {
                    Some(domain) => domain.draw(chooser, 1, 3.0),
                    None => Pixel::empty(0.0),
                })
                .collect();
            let mut output = now.clone();
            let history = History::new(&BEFORE, &held);
            let source = |index: usize| {
                let kept = fault != Some(Fault::EmptyNeighboursLeftOut)
                    || held.get(places[index]).is_some_and(|held| !held.is_empty());
                kept.then_some(places[index])
            };
            shared(chooser, |choose| {
                reuse
                    .temporal(&now, history, source, &mut output, |_| choose.clone())
                    .unwrap();
            });
            indicators(&output)
        })
    };
    for mis in unbiased_families() {
        let faults = [Fault::MovedUp, Fault::EmptyNeighboursLeftOut];
        check_faults(&faults, |fault| run(mis, fault)).unwrap();
    }
}

/// One shift a domain: pairs across any distance, one of them broken by the absent domain.
#[test]
fn pairs_with_an_absent_partner() {
    let pairs = NeighbourLists::new([vec![2], vec![3], vec![0], vec![1]]).unwrap();
    // Nobody's partner is the fourth; the first and the third are each other's.
    let one_sided = NeighbourLists::new([vec![2], vec![], vec![0], vec![2]]).unwrap();
    for pairs in [pairs, one_sided] {
        for mis in [Mis::PAIRWISE_UNIFORM, Mis::PAIRWISE_DEFENSIVE] {
            check_faults(&[Fault::MovedUp], |fault| {
                let reuse = Reuse::new(Row(fault), MergeRule::new(SHIFT).with_mis(mis));
                exact(|chooser| {
                    let input = fresh(chooser);
                    let mut output = input.clone();
                    shared(chooser, |choose| {
                        reuse
                            .paired(&pairs, &input, &mut output, |_| choose.clone())
                            .unwrap();
                    });
                    assert_eq!(output[3], input[3]);
                    indicators(&output)
                })
            })
            .unwrap();
        }
    }
}

/// A struct of a renderer keeps its domains and its shift, owned or shared, with what reuses among
/// them.
struct Renderer {
    reuse: Reuse<'static, Arc<[Option<Finite>]>, Arc<ByLabel>>,
    own: Reuse<'static, Vec<Finite>, ByLabel>,
}

/// What a round adds up averages to the integral too, and an absent domain's sum is left alone.
#[test]
fn shared_domains_and_sums() {
    let renderer = Renderer {
        reuse: Reuse::new(Arc::new(DOMAINS), MergeRule::new(Arc::new(SHIFT))),
        own: Reuse::new(vec![HERE, THERE], MergeRule::new(SHIFT)),
    };
    assert_eq!(renderer.own.domains().count(), 2);
    let truth: Vec<f64> = DOMAINS
        .iter()
        .map(|domain| {
            let domain = domain.as_ref();
            domain.map_or(-1.0, |domain| {
                (0..domain.labels.len())
                    .map(|x| domain.target(&x) * domain.measure[x])
                    .sum()
            })
        })
        .collect();
    check_faults(&["the last is forgotten"], |fault| {
        let result = expectation_vector(|chooser| {
            let input = fresh(chooser);
            let mut output = input.clone();
            let mut sums = [0.0, -1.0, 0.0, 0.0];
            let add = |index: usize, part: Contribution<'_, usize>, sum: &mut f64| {
                let target = DOMAINS[index]
                    .as_ref()
                    .map_or(f64::NAN, |d| d.target(part.sample));
                if fault.is_none() || part.input == 0 {
                    *sum += target * part.weight;
                }
            };
            shared(chooser, |choose| {
                let sums = Sums::new(&mut sums, add);
                renderer
                    .reuse
                    .spatial_integrated(graph(), &input, &mut output, sums, |_| choose.clone())
                    .unwrap();
            });
            sums.to_vec()
        });
        let error = deviation(&result.values, &truth);
        (error < 1e-12).then_some(()).ok_or(error)
    })
    .unwrap();
}
