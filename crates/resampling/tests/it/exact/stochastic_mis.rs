//! Stochastic MIS over chains that learn from their own samples: every sample, transition and
//! permutation is enumerated.

use lightshed_resampling::{ChainTile, Exchange, SetWeight, TileScratch, spatial_smis, temporal_smis};
use lightshed_testkit::{Chooser, check_faults, expectation_vector};
use std::cell::RefCell;

/// Values of the integrand at each place: `I` is their sum.
const INTEGRANDS: [[f64; 3]; 3] = [[1.0, 0.5, 4.0], [2.0, 0.0, 0.25], [0.0, 3.0, 1.5]];
/// What states sample by, before the defensive part.
const LOBES: [[f64; 3]; 2] = [[0.9, 0.1, 0.0], [0.0, 0.3, 0.7]];
/// Densities of a technique beside the chains.
const OTHER: [f64; 3] = [0.2, 0.2, 0.6];
const DEFENSIVE: f64 = 0.25;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    Kept,
    OwnTwice,
    AfterUpdate,
    NotDefensive,
}

/// A technique: the lobe of a state, and who made it.
#[derive(Clone, Copy)]
struct Technique {
    lobe: usize,
    name: usize,
}

struct Sample {
    x: usize,
    by: usize,
}

struct Toy<'c> {
    chooser: &'c RefCell<&'c mut Chooser>,
    estimates: Vec<f64>,
    fault: Option<Fault>,
    /// Whether there is a technique beside the chains.
    beside: bool,
    names: std::cell::Cell<usize>,
    /// Lobes after the update, by name of the technique.
    after: Vec<usize>,
}

impl Toy<'_> {
    fn densities(&self, lobe: usize) -> [f64; 3] {
        LOBES[lobe].map(|density| DEFENSIVE / 3.0 + (1.0 - DEFENSIVE) * density)
    }
}

impl ChainTile for Toy<'_> {
    type State = usize;
    type Technique = Technique;
    type Sample = Sample;

    fn begin_step(&mut self, _step: usize, _states: &mut [usize]) {}

    fn technique(&self, state: &usize) -> Technique {
        let name = self.names.get();
        self.names.set(name + 1);
        Technique { lobe: *state, name }
    }

    fn draw(&mut self, _step: usize, techniques: &[Technique], samples: &mut Vec<Option<Sample>>) {
        for (place, technique) in techniques.iter().enumerate() {
            let x = self.chooser.borrow_mut().choose(&self.densities(technique.lobe));
            let by = technique.name;
            // A sample of value zero may be none.
            samples.push((INTEGRANDS[place][x] > 0.0).then_some(Sample { x, by }));
        }
    }

    fn density(&self, _place: usize, technique: &Technique, sample: &Sample) -> f64 {
        let own = technique.name == sample.by;
        match self.fault {
            Some(Fault::OwnTwice) if own => 2.0 * self.densities(technique.lobe)[sample.x],
            Some(Fault::AfterUpdate) => self.densities(self.after[technique.name])[sample.x],
            Some(Fault::NotDefensive) => LOBES[technique.lobe][sample.x],
            _ => self.densities(technique.lobe)[sample.x],
        }
    }

    /// Lobe 1 follows samples at 2, lobe 0 those at 0, the others leave it to a coin.
    fn advance(
        &mut self,
        _step: usize,
        _place: usize,
        state: &mut usize,
        technique: &Technique,
        sample: Option<&Sample>,
    ) {
        *state = match sample.map(|sample| sample.x) {
            Some(0) => 0,
            Some(2) => 1,
            _ => usize::from(self.chooser.borrow_mut().bernoulli(0.25)),
        };
        self.after.resize(technique.name, 0);
        self.after.push(*state);
    }

    fn other_density(&self, _place: usize, sample: &Sample) -> f64 {
        if self.beside { OTHER[sample.x] } else { 0.0 }
    }

    fn draw_other(&mut self, _first: usize, _place: usize, samples: &mut Vec<Sample>) {
        if self.beside {
            let x = self.chooser.borrow_mut().choose(&OTHER);
            samples.push(Sample { x, by: usize::MAX });
        }
    }

    /// Half of `f` is what only the chains may count.
    fn add(&mut self, place: usize, sample: &Sample, weight: SetWeight) {
        let f = INTEGRANDS[place][sample.x];
        let alone = if sample.by == usize::MAX {
            0.0
        } else {
            weight.of_set()
        };
        self.estimates[place] += 0.5 * f * (weight.merged() + alone);
    }
}

/// Expectations of the estimates at all places, from given states.
fn expected(places: usize, steps: usize, spatial: bool, beside: bool, fault: Option<Fault>) -> Vec<f64> {
    let result = expectation_vector(|chooser: &mut Chooser| {
        let chooser = RefCell::new(chooser);
        let mut toy = Toy {
            chooser: &chooser,
            estimates: vec![0.0; places],
            fault,
            beside,
            names: 0.into(),
            after: Vec::new(),
        };
        let mut states: Vec<usize> = (0..places).map(|place| place % 2).collect();
        let exchange = match fault {
            Some(Fault::Kept) => Exchange::Kept,
            _ => Exchange::Traded,
        };
        let mut scratch = TileScratch::default();
        if spatial {
            let below = |n| chooser.borrow_mut().choose_equal(n);
            spatial_smis(&mut toy, &mut states, steps, exchange, below, &mut scratch);
        } else {
            temporal_smis(&mut toy, &mut states, steps, exchange, &mut scratch);
        }
        toy.estimates
    });
    assert!((result.probability - 1.0).abs() < 1e-12);
    result.values
}

fn check(
    places: usize,
    steps: usize,
    spatial: bool,
    beside: bool,
    fault: Option<Fault>,
) -> Result<(), String> {
    let found = expected(places, steps, spatial, beside, fault);
    for (value, integrand) in found.iter().zip(INTEGRANDS) {
        let truth: f64 = integrand.iter().sum();
        if (value - truth).abs() > 1e-12 * truth {
            return Err(format!("{value}, not {truth}"));
        }
    }
    Ok(())
}

const FAULTS: [Fault; 4] = [
    Fault::Kept,
    Fault::OwnTwice,
    Fault::AfterUpdate,
    Fault::NotDefensive,
];

/// Two steps in a set of two and of three places; three steps in two places make two sets.
#[test]
fn temporal_sets_are_exact() {
    check_faults(&FAULTS, |fault| check(2, 2, false, false, fault)).unwrap();
    check(3, 2, false, false, None).unwrap();
    check(2, 3, false, false, None).unwrap();
}

/// Both steps of two places, and one step of three.
#[test]
fn spatial_sets_are_exact() {
    check_faults(&FAULTS, |fault| check(2, 2, true, false, fault)).unwrap();
    check(3, 1, true, false, None).unwrap();
}

/// A technique of known density beside the chains, by the balance heuristic over all.
#[test]
fn other_techniques_merge_exactly() {
    for spatial in [false, true] {
        check_faults(&FAULTS, |fault| check(2, 2, spatial, true, fault)).unwrap();
    }
}

/// Without the exchange the expectation of the temporal estimator is off by percents.
#[test]
fn chains_that_stay_are_biased() {
    let found = expected(2, 2, false, false, Some(Fault::Kept));
    let bias = found[0] / INTEGRANDS[0].iter().sum::<f64>() - 1.0;
    println!("bias without exchange: {bias}");
    assert!(bias.abs() > 0.01, "{bias}");
}
