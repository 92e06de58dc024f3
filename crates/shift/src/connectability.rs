//! When two vertices may be reconnected.

use core::f32::consts::PI;
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{Area, Density, SolidAngle};

/// Thresholds of connectability (Lin 2022 §6.6.5): `x_i` and `x_{i+1}` are *connectable* if the
/// lobes that scatter at both are at least `min_roughness` wide and they lie at least
/// `min_distance` apart. Emitters count as rough.
///
/// A base path reconnects at its *first* connectable pair. An offset path must agree, by the
/// thresholds of its own domain: every earlier pair must fail and that pair must pass. Otherwise
/// the inverse shift would reconnect elsewhere, and the shift is undefined.
///
/// A [`Footprint`] replaces both thresholds by one that depends on the path:
/// [`Connectability::with_footprint`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Connectability {
    min_roughness: f32,
    min_distance: f32,
    reach: Reach,
    footprint: Option<Footprint>,
}

/// Least spread of the lobes at a reconnection.
///
/// A reconnection copies `x_i` to a path whose vertex `y_{i−1}` lies beside `x_{i−1}`, about as
/// far as the pixels' surface points do. It works if lobes hardly change over that distance. Let
/// `A` be the area that some pixels cover at the first vertex, and `Ω` their solid angle. The pair
/// `x_{i−1}, x_i` is connectable if
///
/// - `1 / p(x_i) ≥ A`, with the density of the lobe that left `x_{i−1}`, in area measure: the edge
///   spreads over at least this area. It is the term of the last edge in the area spread of Müller
///   2021 (*Real-time Neural Radiance Caching for Path Tracing*, eq. 3). Earlier edges do not
///   count: they are replayed, so they make no lobe wider.
/// - `4π α² d² ≥ A`, with the width `α` of the lobe at `x_i` and the distance `d`: seen from `x_i`,
///   the area lies within that lobe.
///
/// An emitter has no lobe. One at infinity has no distance either: there `1 / p(ω) ≥ Ω` decides.
///
/// Close vertices and narrow lobes fail, as by fixed thresholds. But a small pixel admits closer
/// vertices, and a far vertex narrower lobes. An offset path is judged by the footprint of its own
/// pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    area: f32,
    solid_angle: f32,
}

impl Footprint {
    /// `area` is `A` at the first vertex, in squared units of the scene; `solid_angle` is `Ω`, in
    /// steradians.
    ///
    /// # Errors
    /// [`ConnectabilityError::Footprint`] if one of them is not positive. An infinite one, of a
    /// surface seen edge-on, allows no reconnection.
    pub fn new(area: f32, solid_angle: f32) -> Result<Self, ConnectabilityError> {
        if area > 0.0 && solid_angle > 0.0 {
            Ok(Self { area, solid_angle })
        } else {
            Err(ConnectabilityError::Footprint)
        }
    }

    /// `A`.
    pub fn area(&self) -> f32 {
        self.area
    }

    /// `Ω`.
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle
    }
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
    /// An area or a solid angle is not positive.
    Footprint,
}

impl core::fmt::Display for ConnectabilityError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Roughness => "the least roughness for a reconnection must lie in (0, 1]",
            Self::Distance => "the least distance for a reconnection must be finite and not negative",
            Self::Footprint => "the area and the solid angle of a footprint must be positive",
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
        footprint: None,
    };

    /// The reconnection shift: `y₂ = x₂` for every lobe except delta lobes (Lin 2022 §6.6.4).
    /// Paths that are not connectable there cannot be shifted.
    pub const RECONNECTION: Self = Self {
        min_roughness: f32::MIN_POSITIVE,
        min_distance: 0.0,
        reach: Reach::First,
        footprint: None,
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
                footprint: None,
            })
        }
    }

    /// The same mapping, but pairs are connectable by a least spread, not by a least roughness and
    /// distance. Delta lobes and coincident vertices still fail. Prefixes
    /// ([`PrefixDomain`](crate::PrefixDomain)) do not look at it.
    #[must_use]
    pub fn with_footprint(self, footprint: Footprint) -> Self {
        Self {
            min_roughness: self.min_roughness.min(f32::MIN_POSITIVE),
            min_distance: 0.0,
            footprint: Some(footprint),
            ..self
        }
    }

    /// The least spread, if there is one.
    pub fn footprint(&self) -> Option<Footprint> {
        self.footprint
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

    /// Whether a lobe at the second vertex of a pair is wide enough, seen over a squared distance.
    #[inline(always)]
    pub(crate) fn returns(&self, roughness: f32, distance_squared: f32) -> bool {
        let covers =
            |footprint: Footprint| 4.0 * PI * roughness * roughness * distance_squared >= footprint.area;
        self.rough(roughness) && self.footprint.is_none_or(covers)
    }

    /// Whether an edge spreads widely enough that finds its end with this density.
    #[inline(always)]
    pub(crate) fn spreads(&self, density: Density<Area>) -> bool {
        self.footprint
            .is_none_or(|footprint| density.value() * footprint.area <= 1.0)
    }

    /// The same of an edge that leads to infinity.
    #[inline(always)]
    pub(crate) fn spreads_out(&self, density: Density<SolidAngle>) -> bool {
        self.footprint
            .is_none_or(|footprint| density.value() * footprint.solid_angle <= 1.0)
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
    fn footprints_take_the_place_of_thresholds() {
        for [area, solid_angle] in [[0.0, 1.0], [1.0, -1.0], [f32::NAN, 1.0]] {
            assert_eq!(
                Footprint::new(area, solid_angle),
                Err(ConnectabilityError::Footprint)
            );
        }
        let plain = Connectability::hybrid(0.2, 0.5).unwrap();
        let wide = plain.with_footprint(Footprint::new(0.1, 0.01).unwrap());
        assert!(wide.rough(1e-3) && !wide.rough(0.0) && wide.far(Vec3::ONE, Vec3::X * 0.1));
        assert!(wide.spreads(Density::new(10.0)) && !wide.spreads(Density::new(10.1)));
        assert!(wide.spreads_out(Density::new(100.0)) && !wide.spreads_out(Density::new(101.0)));
        // α d = 0.09 and 0.08: 4π α² d² is 0.102 and 0.080.
        assert!(wide.returns(0.3, 0.09) && !wide.returns(0.2, 0.16));
        // Without a footprint the spread does not matter.
        assert!(plain.spreads(Density::new(1e9)) && plain.returns(0.2, 0.0));
        // What never reconnects still does not.
        assert!(
            !Connectability::REPLAY
                .with_footprint(Footprint::new(0.1, 0.1).unwrap())
                .reaches(2)
        );
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
