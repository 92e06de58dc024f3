//! How a field learns, whatever it learns.

use crate::error::{GuidingError, check_option};

/// How regions that touch are blended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Each position has what its region knows.
    None,
    /// A position asks the region of a place up to half a region's extent away, which its own
    /// coordinates choose: borders become noise.
    #[default]
    Jitter,
}

/// How a field learns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOptions {
    /// Regions with more samples in an update are split.
    pub split_above: u32,
    /// Regions that have fewer together are joined; at most [`split_above`](Self::split_above).
    pub collapse_below: u32,
    /// Most regions.
    pub max_regions: usize,
    /// Most levels by which regions are split or joined in an update.
    pub levels: u32,
    /// How regions that touch are blended.
    pub interpolation: Interpolation,
    /// Share of directions that a guide gets where nothing is known of its worth.
    pub first_share: f32,
    /// Largest share.
    pub max_share: f32,
    /// Smaller shares than this are none: the guide is not asked there.
    pub min_share: f32,
    /// Whether the share is that of least variance rather than of greatest likelihood.
    pub share_by_variance: bool,
    /// So many samples in favour of one half are added to those by which the share is learnt.
    pub share_prior: f32,
}

impl Default for FieldOptions {
    fn default() -> Self {
        Self {
            split_above: 512,
            collapse_below: 256,
            max_regions: 1 << 20,
            levels: 20,
            interpolation: Interpolation::Jitter,
            first_share: 0.5,
            max_share: 0.6,
            min_share: 0.05,
            share_by_variance: false,
            share_prior: 16.0,
        }
    }
}

impl FieldOptions {
    /// Whether a field can keep to them.
    ///
    /// # Errors
    /// [`GuidingError::Option`].
    pub fn check(&self) -> Result<(), GuidingError> {
        let [split, collapse] = [self.split_above, self.collapse_below];
        check_option(
            collapse <= split,
            "collapse_below",
            collapse.into(),
            "at most split_above",
        )?;
        let is_limit = (8..=1 << 27).contains(&self.max_regions);
        check_option(is_limit, "max_regions", self.max_regions as f64, "in 8..=2^27")?;
        for (name, share) in [
            ("first_share", self.first_share),
            ("max_share", self.max_share),
            ("min_share", self.min_share),
        ] {
            check_option((0.0..=0.99).contains(&share), name, share.into(), "in 0..=0.99")?;
        }
        let prior = self.share_prior;
        check_option(
            (0.0..=1e6).contains(&prior),
            "share_prior",
            prior.into(),
            "in 0..=1e6",
        )
    }
}
