//! Options of a field, for any model.

use crate::error::{GuidingError, check_option};

/// How adjacent regions are blended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Interpolation {
    /// Each position uses its own region.
    None,
    /// A position uses the region of a point up to half a region's extent away, determined by its
    /// own coordinates: borders become noise.
    #[default]
    Jitter,
}

/// How a field learns.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FieldOptions {
    /// Regions with more samples in an update are split.
    pub split_above: u32,
    /// Regions that have fewer samples together are joined; at most
    /// [`split_above`](Self::split_above).
    pub collapse_below: u32,
    /// Most regions.
    pub max_regions: usize,
    /// Greatest number of levels by which regions are split or joined in an update.
    pub levels: u32,
    /// How adjacent regions are blended.
    pub interpolation: Interpolation,
    /// Share of directions that a guide gets while its value is unknown.
    pub first_share: f32,
    /// Largest share.
    pub max_share: f32,
    /// Smaller shares count as none: the guide is not used there.
    pub min_share: f32,
    /// Whether the share minimises the variance instead of maximising the likelihood.
    pub share_by_variance: bool,
    /// Number of samples in favour of one half that are added when the share is learnt.
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
    /// Whether a field can satisfy them.
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
