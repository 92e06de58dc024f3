//! What a guide learns from.

use crate::square::{code_of, direction_of, square_of, square_of_code};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lightshed_sampling::{Density, SolidAngle};

/// A direction that a path took from a point, and its result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidingSample {
    /// The point.
    pub position: Vec3,
    /// Unit direction away from it.
    pub direction: Vec3,
    /// Distance to the hit; infinite for the environment.
    pub distance: f32,
    /// The result of the direction, divided by the density with which it was actually sampled: an
    /// estimate of `∫ f(ω) dω`, where directions should be sampled in proportion to `f` as far
    /// as possible. `f` may be the radiance that arrives, or that times BSDF and cosine. Do not
    /// clamp it, and include all factors of roulette; otherwise the guide learns another `f`.
    pub weight: f32,
    /// The density with which the direction was actually sampled: of the mixture, if it was one.
    pub pdf: Density<SolidAngle>,
    /// The density of the direction by the BSDF alone: the share of a guide is learnt against it.
    pub scattering_pdf: Density<SolidAngle>,
}

/// A [`GuidingSample`] as it is stored, in 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct TrainingSample {
    position: [f32; 3],
    code: u32,
    weight: f32,
    pdf: f32,
    scattering_pdf: f32,
    distance: f32,
}

impl TrainingSample {
    /// Packs a sample. `None` if it has no information: a weight that is not positive and finite, a
    /// position or direction that is not finite.
    #[inline]
    pub fn new(sample: &GuidingSample) -> Option<Self> {
        let weighs = sample.weight > 0.0 && sample.weight.is_finite() && sample.pdf.is_positive();
        let is_place = sample.position.is_finite() && sample.direction.is_finite();
        (weighs && is_place).then(|| Self {
            position: sample.position.to_array(),
            code: code_of(square_of(sample.direction)),
            weight: sample.weight,
            pdf: sample.pdf.value().min(f32::MAX),
            scattering_pdf: sample.scattering_pdf.value().clamp(0.0, f32::MAX),
            distance: if sample.distance >= 0.0 {
                sample.distance
            } else {
                f32::INFINITY
            },
        })
    }

    /// The point.
    #[inline(always)]
    pub fn position(&self) -> Vec3 {
        Vec3::from(self.position)
    }

    /// Unit direction, within 6·10⁻⁵ radians.
    #[inline(always)]
    pub fn direction(&self) -> Vec3 {
        direction_of(square_of_code(self.code))
    }

    /// Morton code of the direction on the octahedral square, 16 bits an axis.
    #[inline(always)]
    pub(crate) fn code(&self) -> u32 {
        self.code
    }

    /// Estimate of `∫ f(ω) dω`: positive and finite.
    #[inline(always)]
    pub fn weight(&self) -> f32 {
        self.weight
    }

    /// The density with which the direction was actually sampled, per steradian.
    #[inline(always)]
    pub fn pdf(&self) -> f32 {
        self.pdf
    }

    /// The density of the direction by the BSDF alone, per steradian.
    #[inline(always)]
    pub fn scattering_pdf(&self) -> f32 {
        self.scattering_pdf
    }

    /// Distance to the hit; infinite for the environment.
    #[inline(always)]
    pub fn distance(&self) -> f32 {
        self.distance
    }

    /// Orders samples by all of their contents: any sum over samples in this order has the same
    /// bits for any order of arrival.
    pub(crate) fn order(&self, other: &Self) -> std::cmp::Ordering {
        let key = |sample: &Self| {
            let rest = [sample.pdf, sample.scattering_pdf, sample.distance].map(f32::to_bits);
            let own = u64::from(sample.code) << 32 | u64::from(sample.weight.to_bits());
            (own, sample.position.map(f32::to_bits), rest)
        };
        key(self).cmp(&key(other))
    }
}
