//! Integration domains and the shift mappings between them.

use crate::space::Space;
use crate::storage::sanitised;
use std::sync::Arc;

/// An integration domain `Ω` with its target function `p̂`: a pixel of this or the previous
/// frame, a cell of a world-space grid, the suffix space behind a prefix.
///
/// A domain has everything that its target needs: its *own* surface, view direction, lights and
/// visibility (for a temporal neighbour, those of the previous frame). Two domains of one type may
/// differ in all of it.
pub trait Domain {
    /// A point `x` of `Ω`.
    type Sample: Clone;
    /// The measure `dx` of `Ω`.
    type Space: Space;

    /// `p̂(x) ≥ 0`, unnormalised. Negative and non-finite values count as 0.
    ///
    /// A merge asks for the target of each input's sample in the input's own domain. Where it is
    /// dear, let the sample carry it.
    ///
    /// The samples that a reservoir of this domain can hold must be exactly those with
    /// `p̂(x) > 0`, or MIS weights sum to something else than 1. A target cached inside the sample
    /// must be that of the sample *as stored*.
    fn target(&self, x: &Self::Sample) -> f64;

    /// The density `p(x)` of the samples of this domain where it is known (Lin 2022 §B.4.4); it
    /// then replaces `p̂` in MIS weights. Either all domains of a merge know it or none does. All
    /// canonical densities must cover the support of `p̂`.
    fn tractable_density(&self, x: &Self::Sample) -> Option<f64> {
        let _ = x;
        None
    }
}

/// The density of a domain's samples as MIS weights use it: the density if it is known, otherwise
/// the target.
#[inline]
pub(crate) fn proxy<D: Domain + ?Sized>(domain: &D, x: &D::Sample) -> f64 {
    sanitised(domain.tractable_density(x).unwrap_or_else(|| domain.target(x)))
}

/// The same, for a sample with a target that is already known.
#[inline]
pub(crate) fn proxy_with_target<D: Domain + ?Sized>(domain: &D, x: &D::Sample, target: f64) -> f64 {
    sanitised(domain.tractable_density(x).unwrap_or(target))
}

/// Why a shift is undefined at a sample. The numbers are stable: they are what a GPU stores.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
#[non_exhaustive]
pub enum Undefined {
    /// The sample does not lie in the shift's domain `D(T)`, or has no image in the other domain.
    OutsideDomain = 0,
    /// The two ends cannot be connected (roughness, distance, path length).
    NotConnectable = 1,
    /// The image exists, but shifting it back would not return: the map would not be a bijection.
    NotInvertible = 2,
    /// The Jacobian is beyond the reciprocal gate, `max(J, 1/J) > τ`.
    JacobianGate = 3,
    /// Something blocks the way between the two ends, and the shift treats that as undefined rather
    /// than as a zero target.
    Occluded = 4,
    /// The Jacobian is zero, infinite or NaN: the map degenerates here.
    Degenerate = 5,
}

impl Undefined {
    /// All reasons, by number.
    pub const ALL: [Self; 6] = [
        Self::OutsideDomain,
        Self::NotConnectable,
        Self::NotInvertible,
        Self::JacobianGate,
        Self::Occluded,
        Self::Degenerate,
    ];
}

impl core::fmt::Display for Undefined {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::OutsideDomain => "sample outside the shift's domain",
            Self::NotConnectable => "ends not connectable",
            Self::NotInvertible => "shift not invertible here",
            Self::JacobianGate => "Jacobian beyond its gate",
            Self::Occluded => "connection occluded",
            Self::Degenerate => "Jacobian zero or not finite",
        })
    }
}

impl core::error::Error for Undefined {}

/// The absolute Jacobian determinant `|∂T/∂x|` of a shift: positive, finite, with a finite
/// reciprocal.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
#[repr(transparent)]
pub struct Jacobian(f64);

impl Jacobian {
    /// The determinant of the identity.
    pub const IDENTITY: Self = Self(1.0);

    /// Takes the absolute value of a determinant.
    ///
    /// # Errors
    /// [`Undefined::Degenerate`] if it is 0, subnormal, NaN or infinite.
    #[inline]
    pub fn new(determinant: impl Into<f64>) -> Result<Self, Undefined> {
        let value = determinant.into().abs();
        // `is_normal` is false for 0, subnormals (whose reciprocals overflow), infinity and NaN.
        if value.is_normal() && value < 1.0 / f64::MIN_POSITIVE {
            Ok(Self(value))
        } else {
            Err(Undefined::Degenerate)
        }
    }

    /// `|∂T/∂x|`.
    #[inline(always)]
    pub fn value(self) -> f64 {
        self.0
    }

    /// `|∂T⁻¹/∂y| = 1/|∂T/∂x|`.
    #[inline(always)]
    #[must_use]
    pub fn inverse(self) -> Self {
        Self(1.0 / self.0)
    }

    /// The determinant of this map after another.
    ///
    /// # Errors
    /// [`Undefined::Degenerate`] where the product leaves the range of normal numbers.
    #[inline]
    pub fn then(self, other: Self) -> Result<Self, Undefined> {
        Self::new(self.0 * other.0)
    }

    /// Refuses extreme determinants, `max(J, 1/J) ≤ limit`. Reciprocal, so that a shift and its
    /// inverse agree on it; clamping a determinant instead would be bias. Apply the gate inside the
    /// [`ShiftMapping`], where every MIS weight sees it.
    ///
    /// # Errors
    /// [`Undefined::JacobianGate`] beyond the limit (also for a limit below 1 or NaN).
    #[inline]
    pub fn gated(self, limit: f64) -> Result<Self, Undefined> {
        if self.0.max(1.0 / self.0) <= limit {
            Ok(self)
        } else {
            Err(Undefined::JacobianGate)
        }
    }
}

/// `y = T(x)` with what was found on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shifted<X> {
    /// `y`, a point of the domain shifted to.
    pub sample: X,
    /// `|∂y/∂x|`.
    pub jacobian: Jacobian,
    /// `p̂(y)` of the domain shifted *to*. A shift traces what the target needs, so it hands the
    /// value on.
    pub target: f64,
}

/// What a MIS weight needs from a shift: no sample, so nothing is copied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulled {
    /// `|∂x/∂y|`, of the way back.
    pub jacobian: Jacobian,
    /// `p̂_j(x)` of the domain shifted back into, or its density where that domain knows one.
    pub proxy: f64,
}

impl Pulled {
    /// `p̂_{←j}(y) = p̂_j(T_j⁻¹(y)) |∂T_j⁻¹/∂y|` (Lin 2022 eq. 6.35).
    #[inline(always)]
    pub fn density(self) -> f64 {
        (sanitised(self.proxy) * self.jacobian.value()).min(f64::MAX)
    }
}

/// A family of bijections `T_{a→b}` between subsets of any two domains (Lin 2022 def. 6.3.2),
/// holding what it needs to trace.
///
/// # Laws
/// * **Reciprocal**: where `T_{a→b}(x) = y` is defined, `T_{b→a}(y) = x` is, with the
///   reciprocal Jacobian. A map that cannot promise it at `x` is undefined there.
/// * **Free of memory**: the result depends on the arguments alone.
///
/// [`round_trip`](crate::round_trip) checks the first law at a sample.
pub trait ShiftMapping<D: Domain + ?Sized> {
    /// `T_{from→to}(x)`, its Jacobian, and the target of `to` at the image.
    ///
    /// # Errors
    /// Why the shift is undefined at `x`.
    fn shift(&self, x: &D::Sample, from: &D, to: &D) -> Result<Shifted<D::Sample>, Undefined>;

    /// `p̂_{←from}(y)` in two factors, for `y` in `to`: one shift back, `T_{to→from}`, whose
    /// image need not be built. Override it where a sample is expensive to build.
    ///
    /// # Errors
    /// Why `y` cannot have come from `from`; its MIS share then is 0.
    fn pull(&self, y: &D::Sample, to: &D, from: &D) -> Result<Pulled, Undefined> {
        let back = self.shift(y, to, from)?;
        Ok(Pulled {
            jacobian: back.jacobian,
            proxy: proxy_with_target(from, &back.sample, back.target),
        })
    }
}

/// A shift behind a pointer is that shift.
macro_rules! delegate_shift {
    ($pointer:ty) => {
        impl<D: Domain + ?Sized, T: ShiftMapping<D> + ?Sized> ShiftMapping<D> for $pointer {
            #[inline(always)]
            fn shift(&self, x: &D::Sample, from: &D, to: &D) -> Result<Shifted<D::Sample>, Undefined> {
                (**self).shift(x, from, to)
            }

            #[inline(always)]
            fn pull(&self, y: &D::Sample, to: &D, from: &D) -> Result<Pulled, Undefined> {
                (**self).pull(y, to, from)
            }
        }
    };
}

delegate_shift!(&T);
delegate_shift!(Arc<T>);

/// `T(x) = x`: domains over one set, told apart by their targets only (lights as seen from
/// different surfaces).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IdentityShift;

impl<D: Domain + ?Sized> ShiftMapping<D> for IdentityShift {
    #[inline]
    fn shift(&self, x: &D::Sample, _from: &D, to: &D) -> Result<Shifted<D::Sample>, Undefined> {
        Ok(Shifted {
            sample: x.clone(),
            jacobian: Jacobian::IDENTITY,
            target: to.target(x),
        })
    }

    #[inline]
    fn pull(&self, y: &D::Sample, _to: &D, from: &D) -> Result<Pulled, Undefined> {
        Ok(Pulled {
            jacobian: Jacobian::IDENTITY,
            proxy: proxy(from, y),
        })
    }
}

/// How a shift broke its first law.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum BrokenLaw<X> {
    /// `T_{a→b}(x)` is defined, its way back is not.
    NoWayBack(Undefined),
    /// The way back leads to another point.
    OtherPoint(X),
    /// The Jacobians are not reciprocal; holds their product.
    Jacobians(f64),
}

/// Shifts `x` from `from` to `to` and back, and compares: the check to run over many samples before
/// trusting a new [`ShiftMapping`]. It sees that a shift and its inverse agree, not that their
/// Jacobians are right (a determinant clamped on both sides passes): compare those with finite
/// differences.
///
/// `same` says when two samples are equal up to rounding; `tolerance` bounds `|J J⁻¹ − 1|`.
/// True where the shift is defined, false where it is not (which breaks no law).
///
/// # Errors
/// The law that is broken at `x`.
pub fn round_trip<D: Domain, T: ShiftMapping<D>>(
    shift: &T,
    x: &D::Sample,
    from: &D,
    to: &D,
    same: impl Fn(&D::Sample, &D::Sample) -> bool,
    tolerance: f64,
) -> Result<bool, BrokenLaw<D::Sample>> {
    let Ok(there) = shift.shift(x, from, to) else {
        return Ok(false);
    };
    let back = shift
        .shift(&there.sample, to, from)
        .map_err(BrokenLaw::NoWayBack)?;
    let unit = there.jacobian.value() * back.jacobian.value();
    if !same(x, &back.sample) {
        Err(BrokenLaw::OtherPoint(back.sample))
    } else if (unit - 1.0).abs() <= tolerance {
        Ok(true)
    } else {
        Err(BrokenLaw::Jacobians(unit))
    }
}
