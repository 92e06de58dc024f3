//! Cuts of a few subtrees that neighbouring receivers share (Lin 2022 §4.3.3).

use crate::block::WIDTH;
use crate::child_cdf::ChildCdf;
use crate::descent::{BATCH, EntryPoint, OneReceiver, choice, descend_batch, probability_along};
use crate::traversal::TraversalState;
use crate::tree::{Child, Tree};
use crate::weighing::{Receiver, Sealed};
use crate::{LightBvh, LightChoice, PerfectTree, ShadingPoint};
use lightshed_lanes::{LaneChoice, LaneKernel, LaneMask, Lanes};

/// A cut through a light tree: subtrees that together contain all lights, each light in one.
///
/// A receiver takes one light of each subtree, so that bright and dim parts of the lights are both
/// sampled: `Σ_i f(i) = Σ_s E[f(i_s) / p_s(i_s | receiver)]`, for any receiver that the cut was
/// selected for. Selecting a cut takes as long as selecting a few lights, so a block of pixels
/// shares it.
///
/// A cut belongs to the tree for which it was selected, in that tree's state at the time. Its
/// result with another tree is meaningless, and it may name nodes that the other does not have,
/// which panics.
#[derive(Clone, Debug, Default)]
pub struct Lightcut {
    subtrees: Vec<Subtree>,
}

impl Lightcut {
    /// Number of subtrees.
    pub fn len(&self) -> usize {
        self.subtrees.len()
    }

    /// Whether there are none: no light is on, or no cut was selected.
    pub fn is_empty(&self) -> bool {
        self.subtrees.is_empty()
    }
}

/// A subtree, and its weight for the receiver that the cut was selected for.
#[derive(Clone, Copy, Debug)]
struct Subtree {
    root: SubtreeRoot,
    weight: f32,
}

#[derive(Clone, Copy, Debug)]
enum SubtreeRoot {
    /// One light.
    Light(u32),
    /// Some of the children of a node.
    Children { node: u64, from: u8, to: u8 },
}

/// A light tree that can be cut: a [`PerfectTree`] or a [`LightBvh`].
///
/// ```
/// use lightshed_lights::{
///     Bounds, Light, LightSubtrees, Lightcut, PerfectTree, ShadingPoint, glam::Vec3,
/// };
///
/// let bounds = |x: f32| Bounds::of_point(Vec3::new(x, 2.0, 0.0));
/// let lamp = |x: f32| Light { bounds: bounds(x), intensity: 1.0, cone: None };
/// let lights: Vec<Light> = (0..100).map(|i| lamp(0.1 * i as f32)).collect();
/// let tree = PerfectTree::new(&lights)?;
///
/// // The cut of a block of pixels, chosen for one of them …
/// let mut cut = Lightcut::default();
/// tree.choose_cut(&ShadingPoint::new(Vec3::ZERO, Vec3::Y, 1.0), 8, &mut cut);
/// assert_eq!(cut.len(), 8);
///
/// // … and one light of each subtree for another.
/// let at = ShadingPoint::new(Vec3::X, Vec3::Y, 1.0);
/// let mut choices = [None; 8];
/// tree.sample_subtrees(&cut, 0, &at, &[1 << 63; 8], &mut choices);
/// let chosen = choices[3].expect("all lamps are above the horizon");
/// assert_eq!(tree.subtree_pmf(&cut, &at, chosen.light), chosen.pmf);
/// # Ok::<(), lightshed_lights::LightError>(())
/// ```
pub trait LightSubtrees: Sync {
    /// Makes `cut` a cut of up to `count` subtrees: the root is divided again and again where most
    /// light is likely to come from for `at`. It has fewer subtrees only if fewer lights are on, or
    /// if the rest sends nothing there. Reuses the memory of the cut.
    fn choose_cut(&self, at: &ShadingPoint, count: usize, cut: &mut Lightcut);

    /// One light of each of the subtrees from number `first` on: `choices[i]` by `u[i]` of subtree
    /// `first + i`, with its probability within the subtree. The length of the shorter slice
    /// counts; beyond the last subtree nothing is selected.
    fn sample_subtrees(
        &self,
        cut: &Lightcut,
        first: usize,
        at: &ShadingPoint,
        u: &[u64],
        choices: &mut [Option<LightChoice>],
    );

    /// Probability of `light` within its subtree, the same bits as
    /// [`sample_subtrees`](Self::sample_subtrees) returns. If every subtree is sampled once, it is
    /// the expected number of times that the light is selected.
    fn subtree_pmf(&self, cut: &Lightcut, at: &ShadingPoint, light: u32) -> f32;
}

macro_rules! impl_subtrees {
    ($tree:ty) => {
        impl LightSubtrees for $tree {
            fn choose_cut(&self, at: &ShadingPoint, count: usize, cut: &mut Lightcut) {
                LaneChoice::best().run(Choose {
                    tree: self,
                    at,
                    count,
                    cut,
                });
            }

            fn sample_subtrees(
                &self,
                cut: &Lightcut,
                first: usize,
                at: &ShadingPoint,
                u: &[u64],
                choices: &mut [Option<LightChoice>],
            ) {
                LaneChoice::best().run(Sample {
                    tree: self,
                    subtrees: cut.subtrees.get(first..).unwrap_or(&[]),
                    at,
                    u,
                    choices,
                });
            }

            fn subtree_pmf(&self, cut: &Lightcut, at: &ShadingPoint, light: u32) -> f32 {
                LaneChoice::best().run(Pmf {
                    tree: self,
                    subtrees: &cut.subtrees,
                    at,
                    light,
                })
            }
        }
    };
}

impl_subtrees!(PerfectTree);
impl_subtrees!(LightBvh);

struct Choose<'a, T> {
    tree: &'a T,
    at: &'a ShadingPoint,
    count: usize,
    cut: &'a mut Lightcut,
}

impl<T: Tree> LaneKernel for Choose<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tree, at, count, cut } = self;
        let subtrees = &mut cut.subtrees;
        subtrees.clear();
        subtrees.reserve(count);
        let whole = |step| match step {
            Child::Leaf(light) => SubtreeRoot::Light(light),
            Child::Inner(node) => SubtreeRoot::Children {
                node: tree.encode(node),
                from: 0,
                to: WIDTH as u8,
            },
        };
        subtrees.push(Subtree {
            root: whole(tree.root()),
            weight: f32::MAX,
        });
        // A node that is off is left out with everything below it.
        while subtrees.len() < count {
            let mut greatest = None;
            for (i, subtree) in subtrees.iter().enumerate() {
                let more = greatest.is_none_or(|(_, weight)| subtree.weight > weight);
                if more && subtree.weight > 0.0 && matches!(subtree.root, SubtreeRoot::Children { .. }) {
                    greatest = Some((i, subtree.weight));
                }
            }
            let Some((i, weight)) = greatest else { break };
            let SubtreeRoot::Children { node, from, to } = subtrees[i].root else {
                break;
            };
            let own_node = tree.decode(node);
            if to - from == 1 {
                let root = whole(tree.child(own_node, usize::from(from)));
                subtrees[i] = Subtree { root, weight };
                continue;
            }
            let nodes = tree.siblings(own_node);
            let weights = at.weights::<L>(&nodes).store();
            let middle = (from + to) / 2;
            let mut halves = [None; 2];
            for (half, (from, to)) in halves.iter_mut().zip([(from, middle), (middle, to)]) {
                let lanes = usize::from(from)..usize::from(to);
                let weight = weights[lanes.clone()].iter().sum();
                let shines = nodes.intensity[lanes].iter().any(|&intensity| intensity > 0.0);
                if shines {
                    let root = SubtreeRoot::Children { node, from, to };
                    *half = Some(Subtree { root, weight });
                }
            }
            match halves {
                [Some(low), Some(high)] => {
                    subtrees[i] = low;
                    subtrees.insert(i + 1, high);
                }
                [Some(one), None] | [None, Some(one)] => subtrees[i] = one,
                [None, None] => {
                    subtrees.remove(i);
                }
            }
        }
    }
}

/// The distribution over the children `from .. to` of `node` alone.
#[inline(always)]
fn cdf_of<L: Lanes, T: Tree, R: Receiver>(
    tree: &T,
    at: &R,
    node: T::NodeId,
    from: u8,
    to: u8,
) -> ChildCdf<L> {
    let mask = ((1u32 << to) - 1) & !((1u32 << from) - 1);
    tree.child_cdf(at, node, L::Mask::from_bits(mask))
}

struct Subtrees<'a>(&'a [Subtree]);

impl<T: Tree> EntryPoint<T> for Subtrees<'_> {
    #[inline(always)]
    fn enter<L: Lanes, R: Receiver>(
        &self,
        i: usize,
        tree: &T,
        at: &R,
        state: &mut TraversalState,
    ) -> Option<Child<T::NodeId>> {
        match self.0[i].root {
            SubtreeRoot::Light(light) => Some(Child::Leaf(light)),
            SubtreeRoot::Children { node, from, to } => {
                let node = tree.decode(node);
                let lane = state.choose_child(&cdf_of::<L, T, R>(tree, at, node, from, to))?;
                Some(tree.child(node, lane))
            }
        }
    }
}

struct Sample<'a, T> {
    tree: &'a T,
    subtrees: &'a [Subtree],
    at: &'a ShadingPoint,
    u: &'a [u64],
    choices: &'a mut [Option<LightChoice>],
}

impl<T: Tree> LaneKernel for Sample<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let count = self.u.len().min(self.choices.len());
        let there = count.min(self.subtrees.len());
        self.choices[there..count].fill(None);
        let mut first = 0;
        while first < there {
            let end = there.min(first + BATCH);
            let entry = Subtrees(&self.subtrees[first..end]);
            let (u, choices) = (&self.u[first..end], &mut self.choices[first..end]);
            descend_batch::<L, T, ShadingPoint, _>(self.tree, &OneReceiver(self.at), &entry, u, choices);
            first = end;
        }
    }
}

struct Pmf<'a, T> {
    tree: &'a T,
    subtrees: &'a [Subtree],
    at: &'a ShadingPoint,
    light: u32,
}

impl<T: Tree> LaneKernel for Pmf<'_, T> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        let Self {
            tree,
            subtrees,
            at,
            light,
        } = self;
        if at.is_black() {
            return 0.0;
        }
        let path = tree.path_to(light);
        for subtree in subtrees {
            match subtree.root {
                SubtreeRoot::Light(own) if own == light => return 1.0,
                SubtreeRoot::Light(_) => (),
                SubtreeRoot::Children { node, from, to } => {
                    let (Some(path), node) = (&path, tree.decode(node)) else {
                        continue;
                    };
                    let mut steps = 0;
                    while let Some((passed, lane)) = path.step(steps) {
                        steps += 1;
                        if passed == node && (usize::from(from)..usize::from(to)).contains(&lane) {
                            let here = cdf_of::<L, T, _>(tree, at, node, from, to).probability(lane);
                            let probability = probability_along::<L, T, _>(here, tree, at, path, steps);
                            return choice(light, probability).map_or(0.0, |choice| choice.pmf);
                        }
                    }
                }
            }
        }
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{LAYOUTS, Layout, lights_of, points};
    use crate::{LightSampler, PerfectTreeOptions, Stride};
    use lightshed_sampling::CounterRng;
    use lightshed_testkit::check_faults;

    /// Every light that shines is in one subtree, and no other is in any: probabilities within
    /// subtrees add up to their number where no branch is dead, and to no more anywhere.
    fn check_cut<T: LightSubtrees + LightSampler>(
        tree: &T,
        cut: &Lightcut,
        at: &ShadingPoint,
    ) -> Result<(), String> {
        let lights = LightSampler::<ShadingPoint>::light_count(tree) as u32;
        let mut sum = 0.0;
        for light in 0..lights {
            let (within, alone) = (tree.subtree_pmf(cut, at, light), tree.pmf(at, light));
            // A light that is alone in its subtree is selected whatever it contributes.
            if alone > 0.0 && within <= 0.0 {
                return Err(format!(
                    "light {light} has {alone} in the tree and is lost in the cut"
                ));
            }
            sum += f64::from(within);
        }
        if sum > cut.len() as f64 + 1e-5 {
            return Err(format!("{sum} in {} subtrees", cut.len()));
        }
        // Numbers on a grid: what is found is what the probabilities say.
        let (mut found, rounds) = (0, 40);
        for round in 0..rounds {
            let u: Vec<u64> = (0..cut.len() as u32)
                .map(|i| CounterRng::new(4, i, round).next_u64())
                .collect();
            let mut choices = vec![None; u.len()];
            tree.sample_subtrees(cut, 0, at, &u, &mut choices);
            for chosen in choices.iter().flatten() {
                found += 1;
                if chosen.pmf.to_bits() != tree.subtree_pmf(cut, at, chosen.light).to_bits() {
                    return Err(format!("light {} has two probabilities", chosen.light));
                }
            }
        }
        // Each find is a coin of at most unit probability: five deviations.
        let deviation = (f64::from(rounds) * cut.len() as f64 * 0.25).sqrt();
        let expected = f64::from(rounds) * sum;
        if (f64::from(found) - expected).abs() > 5.0 * deviation + 1e-6 {
            return Err(format!("{found} finds instead of {expected}"));
        }
        Ok(())
    }

    /// With trees of all kinds, receivers other than that of the cut, and any number of subtrees. A
    /// subtree that is lost is noticed.
    #[test]
    fn cuts_have_every_light_once() {
        for layout in LAYOUTS {
            for count in [1, 9, 300] {
                let lights = lights_of(layout, count, 11);
                let at = points(&lights, 12, 3);
                let thesis = PerfectTreeOptions::default().with_stride(Stride::One);
                let trees = [
                    check_tree(PerfectTree::new(&lights).unwrap(), at.clone()),
                    check_tree(PerfectTree::with_options(&lights, thesis).unwrap(), at.clone()),
                    check_tree(LightBvh::new(&lights).unwrap(), at),
                ];
                for tree in &trees {
                    for subtrees in [1, 2, 7, 8, 33, 400] {
                        let faults: &[bool] = match (layout, count, subtrees) {
                            (Layout::Uniform, 300, 8) => &[true],
                            _ => &[],
                        };
                        check_faults(faults, |fault| tree(subtrees, fault.is_some()))
                            .unwrap_or_else(|e| panic!("{subtrees} of {count} {layout:?}: {e:?}"));
                    }
                }
            }
        }
    }

    type Check = Box<dyn Fn(usize, bool) -> Result<(), String>>;

    fn check_tree<T: LightSubtrees + LightSampler + 'static>(tree: T, at: Vec<ShadingPoint>) -> Check {
        Box::new(move |count, lose_one| {
            let mut cut = Lightcut::default();
            for pair in at.windows(2) {
                tree.choose_cut(&pair[0], count, &mut cut);
                if cut.len() > count.max(1) {
                    return Err(format!("{} subtrees", cut.len()));
                }
                if lose_one {
                    cut.subtrees.pop();
                }
                check_cut(&tree, &cut, &pair[1])?;
            }
            Ok(())
        })
    }

    #[test]
    fn a_cut_has_as_many_subtrees_as_asked_for() {
        let lights = lights_of(Layout::Uniform, 300, 11);
        let at = ShadingPoint::without_normal(glam::Vec3::splat(0.1));
        let mut cut = Lightcut::default();
        for count in [1, 5, 8, 32, 100] {
            PerfectTree::new(&lights)
                .unwrap()
                .choose_cut(&at, count, &mut cut);
            assert_eq!(cut.len(), count);
            LightBvh::new(&lights).unwrap().choose_cut(&at, count, &mut cut);
            assert_eq!(cut.len(), count);
        }
    }
}
