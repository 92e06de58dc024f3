//! Light trees whose weights are multiplied by learnt factors.
//!
//! At a node whose children `c` have probabilities `p_c`, the probabilities become
//! `f_c p_c / Σ_j f_j p_j`. Factors are stored for the upper part of the tree, as rows of eight
//! starting with that of the root; below, all are 1. As long as factors are positive, every light
//! that the tree can select stays reachable.

use crate::bvh::LightBvh;
use crate::child_cdf::ChildCdf;
use crate::descent::{cdf_of_all, choice};
use crate::receiver::ShadingPoint;
use crate::sampler::LightChoice;
use crate::traversal::TraversalState;
use crate::tree::{Child, Tree};
use crate::weighing::Sealed;
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, Lanes};

/// Factors of the eight children of a node, and the rows of those children.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct FactorRow {
    /// Positive and finite, of a sum that is finite as well.
    pub factors: [f32; LANES],
    /// Indices of rows, or [`FactorRow::NONE`].
    pub below: [u32; LANES],
}

impl FactorRow {
    /// There are no factors below.
    pub const NONE: u32 = u32::MAX;

    /// All alike, and nothing below.
    pub const ONE: Self = Self {
        factors: [1.0; LANES],
        below: [Self::NONE; LANES],
    };
}

/// A step of the way to a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FactoredStep {
    /// Which of the eight children is selected.
    pub lane: usize,
    /// Whether the child is a node, not a light.
    pub is_inner: bool,
    /// Probability of selecting it without factors …
    pub plain: f64,
    /// … and with them.
    pub chosen: f64,
}

/// Longest path to a light that [`LightBvh::steps_factored`] visits.
const MAX_STEPS: usize = 64;

impl LightBvh {
    /// Selects a light by 64 uniform bits, with factors for the upper part of the tree. `None` as
    /// for [`LightSampler::sample`](crate::LightSampler::sample).
    #[inline]
    pub fn sample_factored(&self, at: &ShadingPoint, u: u64, rows: &[FactorRow]) -> Option<LightChoice> {
        LaneChoice::best().run(Sample {
            tree: self,
            at,
            u,
            rows,
        })
    }

    /// One selection for each of many receivers, each with the factors of its `rows`: `choices[i]`
    /// becomes what [`sample_factored`](Self::sample_factored) returns for `at[i]` and `u[i]`, bit
    /// for bit. Receivers take their steps in turns, so that none waits for its own nodes only. The
    /// length of the shortest slice counts.
    pub fn sample_each_factored<'r>(
        &self,
        at: &[ShadingPoint],
        u: &[u64],
        rows: impl Fn(&ShadingPoint) -> &'r [FactorRow],
        choices: &mut [Option<LightChoice>],
    ) {
        for ((at, u), choices) in at
            .chunks(LANES)
            .zip(u.chunks(LANES))
            .zip(choices.chunks_mut(LANES))
        {
            let count = at.len().min(u.len()).min(choices.len());
            let mut descents = [Descent::NONE; LANES];
            for i in 0..count {
                descents[i] = Descent::new(self, &at[i], u[i], rows(&at[i]));
            }
            LaneChoice::best().run(SampleEach {
                tree: self,
                at: &at[..count],
                descents: &mut descents[..count],
                choices: &mut choices[..count],
            });
        }
    }

    /// Probability with which [`sample_factored`](Self::sample_factored) selects a light; 0 out of
    /// range.
    #[inline]
    pub fn pmf_factored(&self, at: &ShadingPoint, light: u32, rows: &[FactorRow]) -> f32 {
        let mut product = 1.0;
        self.steps_factored(at, light, rows, |step| product *= step.chosen);
        if self.path_to(light).is_some() {
            product as f32
        } else {
            0.0
        }
    }

    /// Calls `visit` for each step of the path to a light, from the root; for none if there is no
    /// such light or nothing reaches the receiver.
    #[inline]
    pub fn steps_factored(
        &self,
        at: &ShadingPoint,
        light: u32,
        rows: &[FactorRow],
        mut visit: impl FnMut(FactoredStep),
    ) {
        let (steps, count) = LaneChoice::best().run(Steps {
            tree: self,
            at,
            light,
            rows,
        });
        steps[..count].iter().for_each(|&step| visit(step));
    }
}

/// The distribution over the children of a node, without factors and with those of a row.
#[inline(always)]
fn cdfs<L: Lanes>(
    tree: &LightBvh,
    at: &ShadingPoint,
    node: u32,
    row: Option<&FactorRow>,
) -> (ChildCdf<L>, ChildCdf<L>) {
    let plain = cdf_of_all::<L, _, _>(tree, at, node);
    match row {
        Some(row) => (plain, plain.times(L::load(&row.factors))),
        None => (plain, plain),
    }
}

#[inline(always)]
fn row_below(row: Option<&FactorRow>, rows: &[FactorRow], lane: usize) -> Option<usize> {
    let below = row?.below[lane] as usize;
    (below < rows.len()).then_some(below)
}

struct Sample<'a> {
    tree: &'a LightBvh,
    at: &'a ShadingPoint,
    u: u64,
    rows: &'a [FactorRow],
}

impl LaneKernel for Sample<'_> {
    type Output = Option<LightChoice>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<LightChoice> {
        if self.at.is_black() {
            return None;
        }
        let mut state = TraversalState::new(self.u);
        let (mut child, mut row) = (self.tree.root(), self.rows.first());
        loop {
            match child {
                Child::Leaf(light) => return choice(light, state.probability),
                Child::Inner(node) => {
                    self.tree.prefetch_children(node);
                    let (_, cdf) = cdfs::<L>(self.tree, self.at, node, row);
                    let lane = state.choose_child::<L>(&cdf)?;
                    child = self.tree.child(node, lane);
                    row = row_below(row, self.rows, lane).map(|below| &self.rows[below]);
                }
            }
        }
    }
}

/// A receiver on its way down.
#[derive(Clone, Copy)]
struct Descent<'r> {
    state: TraversalState,
    /// `None` once it has arrived, or if nothing can be selected.
    child: Option<Child<u32>>,
    row: Option<&'r FactorRow>,
    rows: &'r [FactorRow],
}

impl<'r> Descent<'r> {
    const NONE: Self = Self {
        state: TraversalState::NONE,
        child: None,
        row: None,
        rows: &[],
    };

    #[inline(always)]
    fn new(tree: &LightBvh, at: &ShadingPoint, u: u64, rows: &'r [FactorRow]) -> Self {
        Self {
            state: TraversalState::new(u),
            child: (!at.is_black()).then_some(tree.root()),
            row: rows.first(),
            rows,
        }
    }
}

struct SampleEach<'a, 'r> {
    tree: &'a LightBvh,
    at: &'a [ShadingPoint],
    descents: &'a mut [Descent<'r>],
    choices: &'a mut [Option<LightChoice>],
}

impl LaneKernel for SampleEach<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.choices.fill(None);
        let mut going = true;
        while going {
            going = false;
            for i in 0..self.descents.len() {
                let descent = &mut self.descents[i];
                let Some(child) = descent.child else { continue };
                descent.child = match child {
                    Child::Leaf(light) => {
                        self.choices[i] = choice(light, descent.state.probability);
                        None
                    }
                    Child::Inner(node) => {
                        let (_, cdf) = cdfs::<L>(self.tree, &self.at[i], node, descent.row);
                        match descent.state.choose_child::<L>(&cdf) {
                            None => None,
                            Some(lane) => {
                                let child = self.tree.child(node, lane);
                                if let Child::Inner(node) = child {
                                    self.tree.prefetch(node);
                                }
                                descent.row = match row_below(descent.row, descent.rows, lane) {
                                    Some(below) => Some(&descent.rows[below]),
                                    None => None,
                                };
                                Some(child)
                            }
                        }
                    }
                };
                going |= descent.child.is_some();
            }
        }
    }
}

struct Steps<'a> {
    tree: &'a LightBvh,
    at: &'a ShadingPoint,
    light: u32,
    rows: &'a [FactorRow],
}

impl LaneKernel for Steps<'_> {
    type Output = ([FactoredStep; MAX_STEPS], usize);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let none = FactoredStep {
            lane: 0,
            is_inner: false,
            plain: 0.0,
            chosen: 0.0,
        };
        let (mut steps, mut count) = ([none; MAX_STEPS], 0);
        let path = self.tree.path_to(self.light).filter(|_| !self.at.is_black());
        let Some(path) = path else {
            // One step of probability zero.
            return (steps, 1);
        };
        let mut row = self.rows.first();
        while let Some((node, lane)) = path.step(count) {
            let (plain, chosen) = cdfs::<L>(self.tree, self.at, node, row);
            steps[count] = FactoredStep {
                lane,
                is_inner: matches!(self.tree.child(node, lane), Child::Inner(_)),
                plain: plain.probability(lane),
                chosen: chosen.probability(lane),
            };
            count += 1;
            row = row_below(row, self.rows, lane).map(|below| &self.rows[below]);
        }
        (steps, count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LightSampler;
    use crate::testing::{Layout, lights_of, points};
    use lightshed_sampling::CounterRng;
    use lightshed_testkit::check_faults;

    /// A tree of rows that is random in shape and factors.
    fn random_rows(seed: u64) -> Vec<FactorRow> {
        let count = 40u32;
        (0..count)
            .map(|row| {
                let mut rng = CounterRng::new(seed, row, 0);
                FactorRow {
                    factors: std::array::from_fn(|_| 0.05 + rng.next_f32()),
                    below: std::array::from_fn(|lane| match rng.next_u32() % 3 {
                        0 if row * 8 + (lane as u32) < count - 1 => row * 8 + lane as u32 + 1,
                        _ => FactorRow::NONE,
                    }),
                }
            })
            .collect()
    }

    /// Probabilities of all lights add up to what can be reached, each is the frequency, and is
    /// what comes with a choice; the same alone and with others. A factor that the probability
    /// forgets is found.
    #[test]
    fn probabilities_are_frequencies() {
        #[derive(Clone, Copy, Debug)]
        struct Forgotten;
        check_faults(&[Forgotten], |fault| {
            for layout in [Layout::Uniform, Layout::Clustered, Layout::Overlapping] {
                let lights = lights_of(layout, 100, 5);
                let tree = LightBvh::new(&lights).unwrap();
                let rows = random_rows(9);
                let told = if fault.is_some() { &[][..] } else { &rows[..] };
                for at in points(&lights, 16, 3) {
                    let pmfs: Vec<f64> = (0..100).map(|l| tree.pmf_factored(&at, l, told).into()).collect();
                    let sum: f64 = pmfs.iter().sum();
                    let (mut counts, bits) = (vec![0.0; 100], 12);
                    let u: Vec<u64> = (0..1u64 << bits).map(|i| (2 * i + 1) << (63 - bits)).collect();
                    let mut together = vec![None; u.len()];
                    let each = vec![at; u.len()];
                    tree.sample_each_factored(&each, &u, |_| &rows, &mut together);
                    for (&u, together) in u.iter().zip(together) {
                        let alone = tree.sample_factored(&at, u, &rows);
                        assert_eq!(alone, together);
                        if let Some(choice) = alone {
                            counts[choice.light as usize] += 0.5f64.powi(bits);
                            if choice.pmf != pmfs[choice.light as usize] as f32 {
                                return Err(format!("{choice:?} has {}", pmfs[choice.light as usize]));
                            }
                        }
                    }
                    let chosen: f64 = counts.iter().sum();
                    if (sum - chosen).abs() > 2e-3 || sum > 1.0 + 1e-5 {
                        return Err(format!("{layout:?}: the sum is {sum}, not {chosen}"));
                    }
                    // A light's part of the unit interval is one interval.
                    for (count, pmf) in counts.iter().zip(&pmfs) {
                        if (count - pmf).abs() > 1e-3 {
                            return Err(format!("{layout:?}: chosen {count}, told {pmf}"));
                        }
                    }
                }
            }
            Ok(())
        })
        .unwrap();
    }

    /// Without factors it is the tree, bit for bit.
    #[test]
    fn no_factors_change_nothing() {
        let lights = lights_of(Layout::Clustered, 300, 5);
        let tree = LightBvh::new(&lights).unwrap();
        for (i, at) in points(&lights, 16, 3).iter().enumerate() {
            let u = CounterRng::new(4, i as u32, 0).next_u64();
            assert_eq!(tree.sample_factored(at, u, &[]), tree.sample(at, u));
            for light in 0..301 {
                assert_eq!(tree.pmf_factored(at, light, &[]), tree.pmf(at, light));
            }
        }
        let black = ShadingPoint {
            reflectance_bound: 0.0,
            ..ShadingPoint::default()
        };
        assert_eq!(tree.sample_factored(&black, 1 << 60, &[FactorRow::ONE]), None);
        assert_eq!(tree.pmf_factored(&black, 0, &[FactorRow::ONE]), 0.0);
    }
}
