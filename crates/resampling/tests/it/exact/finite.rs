//! Finite domains with partial shifts, and the enumerator standing where a generator stands.

use lightshed_resampling::{
    Choose, Counting, Domain, DomainReservoir, Jacobian, Reservoir, Ris, ShiftMapping, Shifted, Tractable,
    Undefined,
};
use lightshed_testkit::Chooser;

/// Every decision forks the run.
pub struct Enumerate<'a>(pub &'a mut Chooser);

impl Choose for Enumerate<'_> {
    fn accept(&mut self, part: f64, total: f64) -> bool {
        assert!(
            part > 0.0 && part <= total && total.is_finite(),
            "{part} of {total}"
        );
        // Certain decisions do not fork: 1 − part/total may otherwise leave a branch of
        // probability 1e-17.
        part == total || self.0.bernoulli(part / total)
    }
}

/// A finite domain. Each point has a label, by which shifts find it, and a measure:
/// `∫ f = Σ f(x) μ(x)`, so a shift between points of different measure has a Jacobian.
#[derive(Clone, Debug)]
pub struct Finite {
    pub labels: &'static [u32],
    pub measure: &'static [f64],
    pub target: &'static [f64],
    /// Probabilities of the technique that draws initial candidates.
    pub pmf: &'static [f64],
    /// Whether MIS weights use the density instead of the target.
    pub tractable: bool,
}

pub type Pixel = DomainReservoir<Finite, f64>;

impl Domain for Finite {
    type Sample = usize;
    type Space = Counting;
    fn target(&self, &x: &usize) -> f64 {
        self.target[x]
    }
    fn tractable_density(&self, &x: &usize) -> Option<f64> {
        self.tractable.then(|| self.density(x))
    }
}

impl Finite {
    pub fn density(&self, x: usize) -> f64 {
        self.pmf[x] / self.measure[x]
    }

    pub fn tractable(self) -> Self {
        Self {
            tractable: true,
            ..self
        }
    }

    /// One candidate and RIS: what cannot have a positive target becomes the null sample.
    pub fn draw(&self, chooser: &mut Chooser, candidates: u32, confidence: f32) -> Pixel {
        let mut ris = Ris::<usize, Counting>::new();
        for _ in 0..candidates {
            let x = chooser.choose(self.pmf);
            let weight = Tractable::<Counting, f64>::from_density(self.density(x))
                .unwrap()
                .weight();
            ris.candidate(x, self.target[x], weight, &mut Enumerate(chooser));
        }
        ris.finish(confidence)
    }

    /// One sample with its density, unresampled: for tractable forms, whose canonical densities
    /// cover the target.
    pub fn draw_tractable(&self, chooser: &mut Chooser, confidence: f32) -> Pixel {
        let x = chooser.choose(self.pmf);
        Reservoir::from_density(x, self.density(x), confidence).unwrap()
    }

    /// `1{Y = y} W` for every `y`: linear functionals that span all `f`.
    pub fn indicators(&self, reservoir: &Pixel) -> Vec<f64> {
        let mut values = vec![0.0; self.measure.len()];
        if let Some((&y, weight)) = reservoir.weighted_sample() {
            values[y] = weight.value();
        }
        values
    }

    /// What their expectations must be: `μ(y)` on the support of the target, else 0.
    pub fn truth(&self) -> Vec<f64> {
        self.target
            .iter()
            .zip(self.measure)
            .map(|(&p, &mu)| if p > 0.0 { mu } else { 0.0 })
            .collect()
    }
}

/// Largest deviation, relative to the largest truth.
pub fn deviation(values: &[f64], truth: &[f64]) -> f64 {
    let scale = truth.iter().fold(0.0f64, |a, &b| a.max(b));
    let value = |i: usize| values.get(i).copied().unwrap_or(0.0);
    truth
        .iter()
        .enumerate()
        .map(|(i, t)| (value(i) - t).abs() / scale)
        .fold(0.0, f64::max)
}

/// Shifts to the point with the same label; undefined where there is none, and between certain
/// labels beyond a Jacobian gate.
#[derive(Clone, Copy, Debug)]
pub struct ByLabel {
    pub gate: f64,
}

impl ShiftMapping<Finite> for ByLabel {
    fn shift(&self, &x: &usize, from: &Finite, to: &Finite) -> Result<Shifted<usize>, Undefined> {
        let label = from.labels[x];
        let y = to
            .labels
            .iter()
            .position(|&l| l == label)
            .ok_or(Undefined::OutsideDomain)?;
        let jacobian = Jacobian::new(to.measure[y] / from.measure[x])?.gated(self.gate)?;
        Ok(Shifted {
            sample: y,
            jacobian,
            target: to.target[y],
        })
    }
}

/// The domain merged into: a zero target at label 3, which its own technique draws nevertheless.
pub const HERE: Finite = Finite {
    labels: &[0, 1, 2, 3, 4],
    measure: &[1.0, 0.5, 2.0, 1.0, 0.25],
    target: &[0.7, 2.0, 0.1, 0.0, 3.0],
    pmf: &[0.2, 0.1, 0.3, 0.25, 0.15],
    tractable: false,
};

/// A neighbour with other labels (partial), in another order, of other measure, and zero where
/// `HERE` is not.
pub const THERE: Finite = Finite {
    labels: &[9, 4, 1, 3, 0],
    measure: &[1.0, 0.5, 0.75, 0.5, 3.0],
    target: &[1.0, 0.4, 0.0, 5.0, 1.5],
    pmf: &[0.1, 0.3, 0.2, 0.15, 0.25],
    tractable: false,
};

/// A small neighbour that knows little of the other two.
pub const ELSEWHERE: Finite = Finite {
    labels: &[2, 7, 4],
    measure: &[0.25, 1.0, 1.0],
    target: &[4.0, 1.0, 0.02],
    pmf: &[0.5, 0.2, 0.3],
    tractable: false,
};
