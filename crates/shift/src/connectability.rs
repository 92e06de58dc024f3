//! When two vertices may be reconnected.

use lightshed_sampling::glam::Vec3;

/// Thresholds of connectability (Lin 2022 §6.6.5): `x_i` and `x_{i+1}` are *connectable* if the
/// lobes that scatter at both are at least `min_roughness` wide and they lie at least
/// `min_distance` apart. Emitters count as rough.
///
/// A base path reconnects at its *first* connectable pair. An offset path must agree, by the
/// thresholds of its own domain: every earlier pair must fail and that pair must pass. Otherwise
/// the inverse shift would reconnect elsewhere, and the shift is undefined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Connectability {
    min_roughness: f32,
    min_distance: f32,
    reach: Reach,
}

/// Which pairs may be reconnected at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reach {
    Never,
    First,
    Any,
}

/// Invalid thresholds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ConnectabilityError {
    /// The least roughness does not lie in `(0, 1]`.
    Roughness,
    /// The least distance is negative or not finite.
    Distance,
}

impl core::fmt::Display for ConnectabilityError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Roughness => "the least roughness for a reconnection must lie in (0, 1]",
            Self::Distance => "the least distance for a reconnection must be finite and not negative",
        })
    }
}

impl core::error::Error for ConnectabilityError {}

impl Connectability {
    /// Random replay alone: nothing is ever reconnected.
    pub const REPLAY: Self = Self {
        min_roughness: f32::INFINITY,
        min_distance: 0.0,
        reach: Reach::Never,
    };

    /// The reconnection shift: `y₂ = x₂` for every lobe except delta lobes (Lin 2022 §6.6.4).
    /// Paths that are not connectable there cannot be shifted.
    pub const RECONNECTION: Self = Self {
        min_roughness: f32::MIN_POSITIVE,
        min_distance: 0.0,
        reach: Reach::First,
    };

    /// The reconnection shift for vertices at least `min_distance` apart (in units of the scene).
    /// Closer ones, whose geometry term is nearly singular, are not shifted.
    ///
    /// # Errors
    /// [`ConnectabilityError::Distance`].
    pub fn reconnection(min_distance: f32) -> Result<Self, ConnectabilityError> {
        let hybrid = Self::hybrid(1.0, min_distance)?;
        Ok(Self {
            min_distance: hybrid.min_distance,
            ..Self::RECONNECTION
        })
    }

    /// The hybrid shift: random replay up to the first connectable pair. `min_roughness` is in
    /// units of GGX's `α` (the thesis uses 0.2), `min_distance` in units of the scene (1–5 % of
    /// its size).
    ///
    /// # Errors
    /// [`ConnectabilityError`] for invalid thresholds.
    pub fn hybrid(min_roughness: f32, min_distance: f32) -> Result<Self, ConnectabilityError> {
        if !(min_roughness > 0.0 && min_roughness <= 1.0) {
            Err(ConnectabilityError::Roughness)
        } else if !(min_distance >= 0.0 && min_distance.is_finite()) {
            Err(ConnectabilityError::Distance)
        } else {
            Ok(Self {
                min_roughness,
                min_distance,
                reach: Reach::Any,
            })
        }
    }

    /// Least width of lobes at both vertices, in units of GGX's `α`.
    pub fn min_roughness(&self) -> f32 {
        self.min_roughness
    }

    /// Least distance of the vertices, in units of the scene.
    pub fn min_distance(&self) -> f32 {
        self.min_distance
    }

    /// Whether a pair whose second vertex has number `second` may be reconnected at all.
    #[inline(always)]
    pub fn reaches(&self, second: u32) -> bool {
        match self.reach {
            Reach::Never => false,
            Reach::First => second == 2,
            Reach::Any => true,
        }
    }

    /// Whether an offset path may draw any vertex by replay.
    #[inline(always)]
    pub fn replays(&self) -> bool {
        !cfg!(lightshed_without = "replay") && self.reach != Reach::First
    }

    /// Whether a lobe is wide enough.
    #[inline(always)]
    pub(crate) fn rough(&self, roughness: f32) -> bool {
        roughness >= self.min_roughness
    }

    /// Whether a vertex at `position` is far enough from another, at `offset` from it. Also false
    /// if single precision does not resolve the direction between them to about 10⁻³.
    #[inline(always)]
    pub(crate) fn far(&self, position: Vec3, offset: Vec3) -> bool {
        let resolved = position.abs().max_element() * RESOLVED;
        let least = self.min_distance.max(resolved);
        let squared = offset.length_squared();
        squared >= least * least && squared > 0.0
    }
}

/// Least distance over the magnitude of coordinates: rays start about 2⁻¹⁸ off their surfaces,
/// compared with 2⁻⁸.
const RESOLVED: f32 = 1.0 / 256.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_are_checked() {
        assert_eq!(
            Connectability::hybrid(0.0, 1.0),
            Err(ConnectabilityError::Roughness)
        );
        assert_eq!(
            Connectability::hybrid(f32::NAN, 1.0),
            Err(ConnectabilityError::Roughness)
        );
        assert_eq!(
            Connectability::hybrid(0.2, -1.0),
            Err(ConnectabilityError::Distance)
        );
        assert_eq!(
            Connectability::hybrid(0.2, f32::INFINITY),
            Err(ConnectabilityError::Distance)
        );
        let hybrid = Connectability::hybrid(0.2, 0.5).unwrap();
        assert!(hybrid.rough(0.2) && !hybrid.rough(0.1999));
        assert!(hybrid.far(Vec3::ONE, Vec3::X * 0.5) && !hybrid.far(Vec3::ONE, Vec3::X * 0.4999));
        assert!(hybrid.reaches(2) && hybrid.reaches(9) && hybrid.replays());
    }

    #[test]
    fn the_pure_shifts_are_the_limits() {
        assert!(!Connectability::REPLAY.reaches(2) && Connectability::REPLAY.replays());
        let reconnection = Connectability::RECONNECTION;
        assert!(reconnection.reaches(2) && !reconnection.reaches(3) && !reconnection.replays());
        assert!(reconnection.rough(1e-4) && !reconnection.rough(0.0));
        assert!(reconnection.far(Vec3::ZERO, Vec3::X * 1e-10) && !reconnection.far(Vec3::ZERO, Vec3::ZERO));
        // A thousand times further from the origin, a thousand times further apart.
        assert!(
            reconnection.far(Vec3::ONE, Vec3::Y * 4e-3) && !reconnection.far(Vec3::ONE * 1e3, Vec3::Y * 4e-3)
        );
    }
}
