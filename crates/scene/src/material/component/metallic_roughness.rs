//! glTF 2.0 metallic-roughness (specification, appendix B), with `KHR_materials_ior` and thin
//! `KHR_materials_transmission`.
//!
//! With `m` metalness, `t` transmission, `c` base colour, `α` the square of the perceptual
//! roughness, `h` the half vector, Schlick's `F_d = F_0 + (1 − F_0)(1 − wo·h)⁵`,
//! `F_0 = ((η−1)/(η+1))²`, `F_m = c + (1 − c)(1 − wo·h)⁵`:
//! - specular `(F_d (1 − m) + F_m m) · S`, `S = D(h) G2(wo, wi) / (4 cos θ_o cos θ_i)`
//! - diffuse `(1 − m)(1 − F_d)(1 − t) c/π`
//! - transmission `(1 − m)(1 − F_d) t c · S` with `wi` mirrored to the side of `wo` in `S`,
//!   `F_d` and `h`: a thin sheet that does not bend light, so that radiance is not scaled.
//!
//! `D` is GGX and `G2` is *height-correlated* Smith masking, as appendix B has it; the other
//! microfacet components here use the separable form. Visible normals are sampled: `wi` has density
//! `G1(wo) D(h)/(4 cos θ_o)`.

use super::{Draw, LobeEvaluation, MAX_COMPONENT_LOBES, Scatter, reflect};
use crate::Rgb;
use glam::{Vec2, Vec3};
use lightshed_sampling::{CosineHemisphere, Ggx, MicrofacetDistribution};
use std::f32::consts::FRAC_1_PI;

/// Lobe 0 is specular, lobe 1 diffuse, lobe 2 transmission.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct MetallicRoughness {
    pub base_color: Rgb,
    pub metallic: f32,
    pub transmission: f32,
    /// Dielectric reflectance at normal incidence.
    pub f0: f32,
    pub distribution: Ggx,
}

/// `(1 − c)⁵`.
#[inline(always)]
fn schlick(cos: f32) -> f32 {
    let x = (1.0 - cos).clamp(0.0, 1.0);
    let x2 = x * x;
    x2 * x2 * x
}

impl MetallicRoughness {
    #[inline]
    fn dielectric(&self, grazing: f32) -> f32 {
        self.f0 + (1.0 - self.f0) * grazing
    }

    #[inline]
    fn specular(&self, grazing: f32) -> Rgb {
        let metal = self.base_color + (Rgb::ONE - self.base_color) * grazing;
        Rgb::splat(self.dielectric(grazing) * (1.0 - self.metallic)) + metal.max(Rgb::ZERO) * self.metallic
    }

    /// The share of light that enters the surface.
    #[inline]
    fn entering(&self, grazing: f32) -> f32 {
        (1.0 - self.metallic) * (1.0 - self.dielectric(grazing))
    }

    /// The specular lobe for `wi` above the surface.
    #[inline]
    fn reflected(&self, wo: Vec3, wi: Vec3, h: Vec3, grazing: f32) -> LobeEvaluation {
        let (value, pdf) = self.microfacets(wo, wi, h);
        LobeEvaluation {
            value: self.specular(grazing) * value,
            pdf,
        }
    }

    /// The diffuse lobe for `wi` above the surface.
    #[inline]
    fn diffused(&self, wi: Vec3, grazing: f32) -> LobeEvaluation {
        let pdf = wi.z * FRAC_1_PI;
        LobeEvaluation {
            value: self.base_color * (self.entering(grazing) * (1.0 - self.transmission) * pdf),
            pdf,
        }
    }

    /// `cos θ_i S` and the density of `wi`, both for `wi` above the surface.
    #[inline]
    fn microfacets(&self, wo: Vec3, wi: Vec3, h: Vec3) -> (f32, f32) {
        Self::microfacets_of(&self.distribution, wo, wi, h)
    }

    /// The same of any distribution.
    #[inline]
    pub(super) fn microfacets_of(distribution: &Ggx, wo: Vec3, wi: Vec3, h: Vec3) -> (f32, f32) {
        let facing = wo.dot(h);
        if facing <= 0.0 {
            return (0.0, 0.0);
        }
        let pdf = distribution.visible_normal_density(wo, h).value() / (4.0 * facing);
        let masking = distribution.masking(wo);
        let value = if masking > 0.0 {
            pdf * (distribution.masking_shadowing(wo, wi) / masking).min(1.0)
        } else {
            0.0
        };
        (value, pdf)
    }
}

impl Scatter for MetallicRoughness {
    const LOBES: u8 = 3;

    #[inline]
    fn probabilities(&self, wo: Vec3, _: bool) -> [f32; MAX_COMPONENT_LOBES] {
        let grazing = schlick(wo.z);
        // The half vector is not known yet: bounds ensure that its lobes are not selected too
        // seldom.
        let specular = self.specular(grazing).max_element().max(0.05);
        let entering = (1.0 - self.dielectric(grazing)).max(0.1) * (1.0 - self.metallic);
        let base = entering * self.base_color.max_element();
        let (diffuse, transmitted) = (base * (1.0 - self.transmission), base * self.transmission);
        let scale = 1.0 / (specular + diffuse + transmitted);
        [specular * scale, diffuse * scale, transmitted * scale]
    }

    fn roughness(&self, lobe: u8) -> f32 {
        if lobe == 1 {
            1.0
        } else {
            self.distribution.alpha().0.min(1.0)
        }
    }

    #[inline]
    fn evaluate(&self, lobe: u8, wo: Vec3, wi: Vec3, _: bool) -> LobeEvaluation {
        let transmits = lobe == 2;
        let wi = if transmits {
            Vec3::new(wi.x, wi.y, -wi.z)
        } else {
            wi
        };
        if wi.z <= 0.0 {
            return LobeEvaluation::default();
        }
        let h = (wo + wi).normalize_or(Vec3::Z);
        let grazing = schlick(wo.dot(h));
        match lobe {
            0 => self.reflected(wo, wi, h, grazing),
            1 => self.diffused(wi, grazing),
            _ => {
                let entering = self.entering(grazing);
                let (value, pdf) = self.microfacets(wo, wi, h);
                LobeEvaluation {
                    value: self.base_color * (entering * self.transmission * value),
                    pdf,
                }
            }
        }
    }

    #[inline]
    fn evaluate_lobes(&self, wo: Vec3, wi: Vec3, inside: bool) -> [LobeEvaluation; MAX_COMPONENT_LOBES] {
        let nothing = LobeEvaluation::default();
        if wi.z > 0.0 {
            let h = (wo + wi).normalize_or(Vec3::Z);
            let grazing = schlick(wo.dot(h));
            return [
                self.reflected(wo, wi, h, grazing),
                self.diffused(wi, grazing),
                nothing,
            ];
        }
        // An opaque surface never chooses its last lobe.
        let through = if self.transmission > 0.0 {
            self.evaluate(2, wo, wi, inside)
        } else {
            nothing
        };
        [nothing, nothing, through]
    }

    #[inline]
    fn sample(&self, lobe: u8, wo: Vec3, u: Vec2, _: bool) -> Option<Draw> {
        if lobe == 1 {
            return Some(Draw::Direction {
                wi: CosineHemisphere::sample(u.to_array()),
                eta: 1.0,
            });
        }
        let wi = reflect(wo, self.distribution.sample_visible_normal(wo, u.to_array()));
        let side = if lobe == 2 { -1.0 } else { 1.0 };
        (wi.z > 0.0).then_some(Draw::Direction {
            wi: Vec3::new(wi.x, wi.y, side * wi.z),
            eta: 1.0,
        })
    }

    fn albedo_hint(&self) -> Rgb {
        self.specular(0.0) + self.base_color * ((1.0 - self.metallic) * (1.0 - self.f0))
    }

    fn importance(&self) -> f32 {
        // The rim always reflects.
        self.albedo_hint().max_element().max(0.05)
    }
}
