//! The discrete trees of figures 7.3 and 7.4: light transport that can be enumerated.
//!
//! Leaves emit; an inner node sums what its two subtrees send, and samples the left one with
//! probability 0.9. Its cache holds that sum, or something else.

use lightshed_caching::{PathBudget, Prefixed, Termination};

/// Probabilities of the left and the right subtree.
pub const CHANCES: [f64; 2] = [0.9, 0.1];

pub struct Node {
    /// What is sent in truth.
    pub value: f64,
    /// What the cache has; of a leaf the truth.
    pub cache: f64,
    pub children: Option<Box<[Node; 2]>>,
}

/// An estimator: its mean and variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimator {
    pub mean: f64,
    pub variance: f64,
}

impl Estimator {
    /// Error of the mean of so many samples.
    pub fn mse(&self, truth: f64, samples: f64) -> f64 {
        self.variance / samples + (self.mean - truth).powi(2)
    }
}

impl Node {
    pub fn leaf(value: f64) -> Self {
        Self {
            value,
            cache: value,
            children: None,
        }
    }

    /// An inner node whose cache is off by `bias`.
    pub fn inner(bias: f64, children: [Self; 2]) -> Self {
        let value = children[0].value + children[1].value;
        Self {
            value,
            cache: value + bias,
            children: Some(Box::new(children)),
        }
    }

    /// A full tree of leaves that emit one unit; `bias` says by how much caches are off, by the
    /// number of the node in a heap.
    pub fn full(depth: u32, number: u32, bias: &dyn Fn(u32) -> f64) -> Self {
        if depth == 0 {
            return Self::leaf(1.0);
        }
        let child = |side: u32| Self::full(depth - 1, 2 * number + side, bias);
        Self::inner(bias(number), [child(0), child(1)])
    }

    /// Variance of one step that ends in the caches of the children: `Σ c²/p − (Σ c)²`.
    pub fn local_variance(&self) -> f64 {
        let Some(children) = &self.children else {
            return 0.0;
        };
        let [a, b] = [&children[0], &children[1]].map(|child| child.cache);
        a * a / CHANCES[0] + b * b / CHANCES[1] - (a + b).powi(2)
    }

    pub fn bias_squared(&self) -> f64 {
        (self.cache - self.value).powi(2)
    }

    /// `E[(w b)²]` over the children.
    pub fn deferred_bias_squared(&self) -> f64 {
        let Some(children) = &self.children else {
            return 0.0;
        };
        let each = children.iter().zip(CHANCES);
        each.map(|(child, p)| child.bias_squared() / p).sum()
    }

    /// The estimator that ends by a rule, over all paths.
    pub fn ended_by(&self, rule: &Termination) -> Estimator {
        self.ended_with(rule, |throughput| throughput * throughput)
    }

    /// The same with another factor of local variances and squared biases than the square of the
    /// prefix.
    pub fn ended_with(&self, rule: &Termination, prefix: fn(f64) -> f64) -> Estimator {
        let mut sums = [0.0; 2];
        let start = PathBudget::default();
        self.walk((rule, prefix), start, 1, [1.0, 0.0, 1.0], &mut sums);
        Estimator {
            mean: sums[0],
            variance: sums[1] - sums[0] * sums[0],
        }
    }

    /// Probability, contribution and throughput of the path so far.
    fn walk(
        &self,
        (rule, prefix): (&Termination, fn(f64) -> f64),
        mut budget: PathBudget,
        depth: u32,
        [p, mut found, mut throughput]: [f64; 3],
        sums: &mut [f64; 2],
    ) {
        let mut share = 0.0;
        if self.children.is_some() {
            let squared = prefix(throughput);
            let at = Prefixed {
                brightness: (throughput * self.cache) as f32,
                variance: (squared * self.local_variance()) as f32,
                bias_squared: (squared * self.bias_squared()) as f32,
                deferred_bias_squared: (squared * self.deferred_bias_squared()) as f32,
                interpolation: 0.0,
            };
            share = f64::from(budget.share(rule, depth, &at));
        }
        found += (1.0 - share) * throughput * self.cache;
        throughput *= share;
        match &self.children {
            Some(children) if share > 0.0 => {
                for (child, chance) in children.iter().zip(CHANCES) {
                    let state = [p * chance, found, throughput / chance];
                    child.walk((rule, prefix), budget, depth + 1, state, sums);
                }
            }
            _ => {
                sums[0] += p * found;
                sums[1] += p * found * found;
            }
        }
    }

    /// Means and mean squares of every estimator that ends at a set of nodes: the exhaustive list.
    fn cuts(&self) -> Vec<[f64; 2]> {
        let mut all = vec![[self.cache, self.cache * self.cache]];
        if let Some(children) = &self.children {
            let [left, right] = [&children[0], &children[1]].map(Self::cuts);
            for l in &left {
                all.extend(right.iter().map(|r| {
                    // A child's estimate counts over its chance.
                    [l[0] + r[0], l[1] / CHANCES[0] + r[1] / CHANCES[1]]
                }));
            }
        }
        all
    }

    /// Every estimator that ends at fixed nodes.
    pub fn estimators(&self) -> Vec<Estimator> {
        let of = |[mean, second]: [f64; 2]| Estimator {
            mean,
            variance: second - mean * mean,
        };
        self.cuts().into_iter().map(of).collect()
    }

    /// The least value of the bound of eq. 7.12 over all sets of nodes, `Σ P/N + E[B²]`, by
    /// dynamic programming: what follows a node does not depend on what came before it, but for the
    /// square of the prefix. The same minimised over the true error would not part into subtrees,
    /// as biases cancel.
    pub fn least_bound(&self, samples: f64) -> f64 {
        let Some(children) = &self.children else {
            return 0.0;
        };
        let further: f64 = children
            .iter()
            .zip(CHANCES)
            .map(|(child, p)| child.least_bound(samples) / p)
            .sum();
        self.bias_squared().min(self.local_variance() / samples + further)
    }
}
