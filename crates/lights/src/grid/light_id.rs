//! Names of lights of the hierarchy.

/// Names a light of the hierarchy: of level 0, the lights themselves in the grid's own order, or of
/// a level of grid lights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightId {
    /// 0 for the lights themselves, else the level ℓ of S_ℓ.
    pub level: u32,
    /// Place within the level.
    pub index: u32,
}
