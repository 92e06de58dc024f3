//! How places are learnt.

use crate::GuidingError;
use crate::error::check_option;

/// Most places of a region.
pub const MAX_PLACES: u32 = 512;

/// How a [`PlaceModel`](super::PlaceModel) learns.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PlaceOptions {
    /// Most places of a region, 1 to [`MAX_PLACES`]: the budget of memory, 32 bytes each.
    pub places: u32,
    /// Root mean square distance of light from a place that one sample has found, as an angle at
    /// the sample's position, in radians: over 0 to 1.
    pub prior_angle: f32,
    /// Number of samples for which that counts, over 0.
    pub prior_count: f32,
    /// Share of what earlier updates found that is kept, 0 to 1.
    pub decay: f32,
    /// Share of directions that all places get equally, 0 to 1.
    pub even_share: f32,
    /// Whether regions try the places that others have just found.
    pub exchanges: bool,
}

impl Default for PlaceOptions {
    fn default() -> Self {
        Self {
            places: 256,
            prior_angle: 0.01,
            prior_count: 2.0,
            decay: 0.5,
            even_share: 0.25,
            exchanges: true,
        }
    }
}

impl PlaceOptions {
    /// # Errors
    /// [`GuidingError::Option`] where an option is out of its range.
    pub fn check(&self) -> Result<(), GuidingError> {
        let count = (1..=MAX_PLACES).contains(&self.places);
        check_option(count, "places", self.places.into(), "1 to 512")?;
        let angle = self.prior_angle > 0.0 && self.prior_angle <= 1.0;
        check_option(angle, "prior_angle", self.prior_angle.into(), "over 0 to 1")?;
        let prior = self.prior_count > 0.0 && self.prior_count.is_finite();
        check_option(prior, "prior_count", self.prior_count.into(), "over 0 and finite")?;
        for (name, share) in [("decay", self.decay), ("even_share", self.even_share)] {
            check_option((0.0..=1.0).contains(&share), name, share.into(), "0 to 1")?;
        }
        Ok(())
    }
}
