//! Storage precision of contribution weights.

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// The number a reservoir stores its contribution weight in: `f32` in a renderer, `f64` in a proof.
/// Sealed.
///
/// All arithmetic of this crate runs in `f64` and rounds *once*, when a weight is stored. The code
/// that a renderer runs with `f32` storage is therefore the very code that exact enumeration holds
/// to 1e-12 with `f64` storage.
pub trait Storage:
    sealed::Sealed + Copy + Default + PartialEq + core::fmt::Debug + Send + Sync + 'static
{
    /// Widens without loss.
    fn to_f64(self) -> f64;
    /// Rounds to the nearest number of this type; a number that is too large becomes the largest
    /// finite one, NaN becomes 0.
    fn from_f64(value: f64) -> Self;
}

impl Storage for f32 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        if value.is_nan() {
            return 0.0;
        }
        // Clamped in f64: a value just above f32::MAX would otherwise round to infinity.
        value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
    }
}

impl Storage for f64 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        if value.is_nan() {
            0.0
        } else {
            value.clamp(f64::MIN, f64::MAX)
        }
    }
}

/// A non-negative finite number: a negative number or NaN becomes 0, one that is too large becomes
/// `f64::MAX`. The neutral reading of a bad target in the hot path.
#[inline(always)]
pub(crate) fn sanitised(value: f64) -> f64 {
    // Also false for NaN.
    if value > 0.0 { value.min(f64::MAX) } else { 0.0 }
}

/// The product of non-negative finite factors, capped at `f64::MAX`; never NaN.
#[inline(always)]
pub(crate) fn product<const N: usize>(factors: [f64; N]) -> f64 {
    // Capped at each step, so that ∞ · 0 cannot occur.
    factors
        .into_iter()
        .fold(1.0, |value, factor| (value * factor).min(f64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_stays_finite() {
        assert_eq!(f32::from_f64(1e300), f32::MAX);
        assert_eq!(f32::from_f64(f64::from(f32::MAX) * (1.0 + 1e-9)), f32::MAX);
        assert_eq!(f32::from_f64(f64::NAN), 0.0);
        assert_eq!(f64::from_f64(f64::INFINITY), f64::MAX);
        assert_eq!(sanitised(f64::NAN), 0.0);
        assert_eq!(sanitised(-3.0), 0.0);
        assert_eq!(product([1e200, 1e200, 1e-300]), f64::MAX * 1e-300);
        assert_eq!(product([1e200, 1e200, 0.0]), 0.0);
    }
}
