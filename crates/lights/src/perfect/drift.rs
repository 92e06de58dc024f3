//! How much the nodes of a tree have grown since its lights were sorted.

/// The size of the nodes of each part at its last sort.
#[derive(Clone, Debug, Default)]
pub(super) struct Drift {
    pub costs: Vec<Cost>,
    pub codes: Vec<u64>,
    pub keys: Vec<(u64, u32)>,
}

/// `Σ I |diagonal|²` over the nodes of eight lights in a part, and over the part's root.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cost {
    pub small: f64,
    pub root: f64,
}

impl Cost {
    /// The ratio to `before`, the greater of both numbers; 1 if there is nothing to compare.
    pub fn growth(&self, before: &Self) -> f64 {
        let ratio = |now: f64, before: f64| if before > 0.0 { now / before } else { 1.0 };
        ratio(self.small, before.small).max(ratio(self.root, before.root))
    }
}
