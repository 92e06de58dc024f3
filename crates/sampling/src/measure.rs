//! Densities that carry their measure in the type.
//!
//! A probability density means nothing without its measure: `p_ω` (per steradian), `p_A` (per unit
//! area) and `p_u` (per unit of primary sample space) describe the same event by different numbers.
//! [`Density<M>`] holds one number and names its measure `M`, so mixing two of them does not
//! compile:
//!
//! ```compile_fail
//! use lightshed_sampling::{Area, Density, SolidAngle, power_heuristic};
//! let by_angle = Density::<SolidAngle>::new(0.5);
//! let by_area = Density::<Area>::new(0.5);
//! let _ = power_heuristic(by_angle, by_area); // error: mismatched measures
//! ```
//!
//! The only way from one measure to another is a conversion that takes the geometry it needs:
//!
//! ```
//! use lightshed_sampling::{Area, Density, SolidAngle, power_heuristic};
//! let by_angle = Density::<SolidAngle>::new(0.5);
//! let by_area = Density::<Area>::new(0.5);
//! let weight = power_heuristic(by_angle, by_area.to_solid_angle(4.0, 0.5));
//! assert!((weight - 0.25 / (0.25 + 16.0)).abs() < 1e-6);
//! ```

use core::marker::PhantomData;
use core::ops::Mul;
use lightshed_lanes::Lanes;

mod sealed {
    pub trait Sealed {}
}

/// A measure that a density can be taken with respect to. Sealed: the set of measures is closed.
pub trait Measure: sealed::Sealed + Copy + Default + core::fmt::Debug + 'static {
    /// Unit of a density in this measure, for messages.
    const UNIT: &'static str;
}

macro_rules! measure {
    ($(#[$doc:meta])* $name:ident, $unit:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name;
        impl sealed::Sealed for $name {}
        impl Measure for $name {
            const UNIT: &'static str = $unit;
        }
    };
}

measure!(
    /// Solid angle on the unit sphere, in steradians.
    SolidAngle,
    "1/sr"
);
measure!(
    /// Surface area, in the square of the scene's unit of length.
    Area,
    "1/length²"
);
measure!(
    /// Length along a line, in its unit of length or of its parameter.
    Length,
    "1/length"
);
measure!(
    /// The unit hypercube of random numbers that a technique consumes.
    PrimarySample,
    "1"
);

/// A probability density with respect to the measure `M`. Zero means "never sampled".
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
#[repr(transparent)]
pub struct Density<M: Measure> {
    value: f32,
    measure: PhantomData<M>,
}

impl<M: Measure> Density<M> {
    /// The density of something that is never sampled.
    pub const ZERO: Self = Self::new(0.0);

    /// States that `value` is a density with respect to `M`.
    #[inline(always)]
    pub const fn new(value: f32) -> Self {
        Self {
            value,
            measure: PhantomData,
        }
    }

    /// The bare number, in units of `1/M`.
    #[inline(always)]
    pub const fn value(self) -> f32 {
        self.value
    }

    /// Whether the density is positive (false for NaN).
    #[inline(always)]
    pub fn is_positive(self) -> bool {
        self.value > 0.0
    }
}

/// Scaling by a probability (of a lobe, a light, a technique) keeps the measure.
impl<M: Measure> Mul<f32> for Density<M> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, probability: f32) -> Self {
        Self::new(self.value * probability)
    }
}

/// Adding densities of the same measure: the density of a mixture, once each is scaled by its
/// share.
impl<M: Measure> core::ops::Add for Density<M> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.value + other.value)
    }
}

impl Density<Area> {
    /// `p_ω = p_A · d² / |cos θ|`, with `d` the distance to the point and `θ` the angle at it
    /// between its normal and the direction. A point seen edge-on (`cos θ = 0`) gives zero: it
    /// subtends no solid angle. Saturates at `f32::MAX`.
    #[inline(always)]
    pub fn to_solid_angle(self, distance_squared: f32, cos_theta: f32) -> Density<SolidAngle> {
        let cos_theta = cos_theta.abs();
        if cos_theta > 0.0 {
            Density::new(saturate(self.value * distance_squared / cos_theta))
        } else {
            Density::ZERO
        }
    }
}

impl Density<SolidAngle> {
    /// `p_A = p_ω · |cos θ| / d²`. Zero distance gives zero. Saturates at `f32::MAX`.
    #[inline(always)]
    pub fn to_area(self, distance_squared: f32, cos_theta: f32) -> Density<Area> {
        if distance_squared > 0.0 {
            Density::new(saturate(self.value * cos_theta.abs() / distance_squared))
        } else {
            Density::ZERO
        }
    }
}

/// ∞ to the largest finite number; NaN stays.
#[inline(always)]
fn saturate(value: f32) -> f32 {
    if value > f32::MAX { f32::MAX } else { value }
}

/// Balance heuristic `p_a / (p_a + p_b)` (Veach 1997 eq. 9.8) for one sample of each technique.
///
/// 0 if `p_a` is 0. Two infinite densities get ½ each, one gets 1. `w(a, b) + w(b, a)` is 1 to
/// rounding unless both densities are 0.
#[inline(always)]
pub fn balance_heuristic<M: Measure>(a: Density<M>, b: Density<M>) -> f32 {
    heuristic(a.value, b.value, |ratio| ratio)
}

/// Power heuristic with exponent 2, `p_a² / (p_a² + p_b²)` (Veach 1997 eq. 9.10), by the ratio
/// so that neither square can overflow.
///
/// 0 if `p_a` is 0. Two infinite densities get ½ each, one gets 1. `w(a, b) + w(b, a)` is 1 to
/// rounding unless both densities are 0.
#[inline(always)]
pub fn power_heuristic<M: Measure>(a: Density<M>, b: Density<M>) -> f32 {
    heuristic(a.value, b.value, |ratio| ratio * ratio)
}

/// `1 / (1 + r(b/a))`; an overflowing ratio rightly gives 0.
#[inline(always)]
fn heuristic(a: f32, b: f32, r: impl Fn(f32) -> f32) -> f32 {
    if !(a > 0.0) {
        0.0
    } else if a.is_infinite() {
        if b.is_infinite() { 0.5 } else { 1.0 }
    } else {
        1.0 / (1.0 + r(b / a))
    }
}

/// [`power_heuristic`] of eight pairs of densities, each pair in one measure, bit for bit.
#[inline(always)]
pub fn power_heuristic_lanes<L: Lanes>(a: L, b: L) -> L {
    let (zero, one, infinity) = (L::splat(0.0), L::splat(1.0), L::splat(f32::INFINITY));
    let ratio = b / a;
    let weight = one / (one + ratio * ratio);
    let both_infinite = L::splat(0.5).select(infinity.equal(b), one);
    let weight = both_infinite.select(infinity.equal(a), weight);
    weight.select(zero.less(a), zero)
}
