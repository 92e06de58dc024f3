//! The interface of distributions of directions.

use crate::{
    CosineHemisphere, Density, Frame, SolidAngle, UniformCone, UniformHemisphere, UniformSphere,
    VonMisesFisher,
};
use glam::Vec3;

/// Directions that can be sampled and whose density `p(ω)` is known: lobes, environments, phase
/// functions, guides.
///
/// An implementation must satisfy these laws; `DirectionConformance` of the crate
/// `lightshed-testkit` checks them if the integral is 1.
///
/// - Samples are distributed by `p`, and `∫ p dω ≤ 1` over the sphere. The difference to 1 is
///   the probability of no direction, which is a sample of value zero. So
///   `∫ f dω = E[f(ω) / p(ω)]` for any `f` that is zero where `p` is.
/// - The density returned with a sample equals [`pdf`](Self::pdf) of its direction, bit for bit. A
///   mixture, or a MIS weight, evaluates the density of a direction that another technique sampled,
///   and must get the same number.
/// - Samples are unit directions of positive finite density, for all `u` in [0, 1)².
///
/// The inherent `sample` functions of this crate's warps return the density of the direction before
/// rounding. Through this trait they return that of the rounded direction.
///
/// ```
/// use lightshed_sampling::glam::Vec3;
/// use lightshed_sampling::{DirectionDistribution, Oriented, VonMisesFisher, CosineHemisphere};
///
/// /// `∫ f dω` by one sample.
/// fn estimate(lobe: &impl DirectionDistribution, u: [f32; 2], f: impl Fn(Vec3) -> f32) -> f32 {
///     lobe.sample(u).map_or(0.0, |(direction, density)| f(direction) / density.value())
/// }
/// let normal = Vec3::new(0.6, 0.0, 0.8);
/// let floor = Oriented::new(CosineHemisphere, normal);
/// // The integral of the cosine is π, whatever the sample.
/// assert!((estimate(&floor, [0.3, 0.9], |d| d.dot(normal)) - std::f32::consts::PI).abs() < 1e-5);
/// let lobe = VonMisesFisher::new(normal, 50.0);
/// let (direction, density) = DirectionDistribution::sample(&lobe, [0.2, 0.4]).expect("a lobe has samples");
/// assert_eq!(density, lobe.pdf(direction));
/// ```
pub trait DirectionDistribution {
    /// Maps `u` in [0, 1)² to a unit direction and its density. Returns `None` if there is no
    /// direction of positive density; that is a sample of value zero, which counts.
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)>;

    /// Density with which [`sample`](Self::sample) returns the unit `direction`: finite and not
    /// negative, zero if it never does.
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle>;
}

impl<D: DirectionDistribution + ?Sized> DirectionDistribution for &D {
    #[inline(always)]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        (**self).sample(u)
    }

    #[inline(always)]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        (**self).pdf(direction)
    }
}

/// Returns `direction` with its density by `distribution`, or `None` if that is not positive.
/// Implementations of [`DirectionDistribution::sample`] end with this call.
#[inline(always)]
pub fn with_density<D: DirectionDistribution + ?Sized>(
    distribution: &D,
    direction: Vec3,
) -> Option<(Vec3, Density<SolidAngle>)> {
    let density = distribution.pdf(direction);
    density.is_positive().then_some((direction, density))
}

macro_rules! implement {
    ($distribution:ty, |$self:ident, $u:ident| $sample:expr, |$direction:ident| $pdf:expr) => {
        impl DirectionDistribution for $distribution {
            #[inline]
            fn sample(&$self, $u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
                with_density($self, $sample)
            }

            #[inline]
            fn pdf(&$self, $direction: Vec3) -> Density<SolidAngle> {
                $pdf
            }
        }
    };
}

// Around the local z axis.
implement!(CosineHemisphere, |self, u| Self::sample(u), |direction| {
    Self::density(direction.z)
});
implement!(UniformHemisphere, |self, u| Self::sample(u), |direction| {
    Self::density(direction.z)
});
implement!(UniformSphere, |self, u| Self::sample(u), |_direction| {
    Self::density()
});
implement!(UniformCone, |self, u| Self::sample(self, u), |direction| self
    .density(direction));
// Around its mean.
implement!(VonMisesFisher, |self, u| Self::sample(self, u), |direction| self
    .density(direction));

/// A distribution around the local z axis, turned to another axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oriented<D> {
    local: D,
    frame: Frame,
}

impl<D: DirectionDistribution> Oriented<D> {
    /// `local` with its z axis along `axis` (normalised; z if it has no direction).
    #[inline]
    pub fn new(local: D, axis: Vec3) -> Self {
        Self {
            local,
            frame: Frame::from_normal(axis.normalize_or(Vec3::Z)),
        }
    }
}

impl<D: DirectionDistribution> DirectionDistribution for Oriented<D> {
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let (local, _) = self.local.sample(u)?;
        with_density(self, self.frame.to_world(local))
    }

    #[inline]
    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        self.local.pdf(self.frame.to_local(direction))
    }
}
