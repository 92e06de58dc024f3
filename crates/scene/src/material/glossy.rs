//! Materials of microfacets of a conductor, alone or blended with a diffuse base, as eight vertices
//! at a time read them.

use super::{Material, Microfacet, Roughness};
use crate::{ColorTexture, FloatTexture, Place, Rgb};
use lightshed_lanes::LANES;
use lightshed_sampling::Ggx;

/// Microfacets (GGX, of the same roughness everywhere and along both axes) of a conductor, and a
/// diffuse base if the two are blended by a constant.
struct Glossy<'a> {
    /// Complex index of refraction.
    eta: Rgb,
    k: Rgb,
    /// `α`, clamped.
    alpha: f32,
    tint: &'a ColorTexture,
    base: Option<&'a ColorTexture>,
    /// Shares of the base and of the conductor.
    weights: [f32; 2],
    /// Whether the base comes after the conductor.
    base_is_last: bool,
    two_sided: bool,
}

/// The numbers of such a material: albedo of the base, tint, shares of both; η, k, α, and 1 where
/// the base comes after the conductor, else 0. Textured colours are left out.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct GlossyRow(pub [[f32; LANES]; 2]);

impl GlossyRow {
    /// In place of a material.
    pub const NONE: Self = Self([[0.0; LANES], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0]]);

    /// The row of a material, with whether it is seen from both sides and whether its colours
    /// differ from place to place; `None` for other materials.
    pub fn new(material: &Material) -> Option<(Self, bool, bool)> {
        let glossy = material.as_glossy()?;
        let albedo = glossy.base.map_or(Some(Rgb::ZERO), ColorTexture::as_constant);
        let tint = glossy.tint.as_constant();
        let textured = albedo.is_none() || tint.is_none();
        let [a, t] = [albedo, tint].map(|color| color.unwrap_or(Rgb::ZERO));
        let [base, conductor] = glossy.weights;
        let (eta, k) = (glossy.eta, glossy.k);
        let last = f32::from(u8::from(glossy.base_is_last));
        let row = Self([
            [a.x, a.y, a.z, t.x, t.y, t.z, base, conductor],
            [eta.x, eta.y, eta.z, k.x, k.y, k.z, glossy.alpha, last],
        ]);
        Some((row, glossy.two_sided, textured))
    }
}

impl Material {
    /// Albedo of the base and tint at a place of a glossy material.
    pub(crate) fn glossy_colors(&self, place: Place) -> [Rgb; 2] {
        match self.as_glossy() {
            Some(glossy) => [
                glossy.base.map_or(Rgb::ZERO, |albedo| albedo.at(place)),
                glossy.tint.at(place),
            ],
            None => [Rgb::ZERO; 2],
        }
    }

    fn as_glossy(&self) -> Option<Glossy<'_>> {
        let (inner, two_sided) = match self {
            Self::TwoSided { front, back: None } => (&**front, true),
            _ => (self, false),
        };
        let glossy = match inner {
            Self::Blend {
                weight: FloatTexture::Constant(second_share),
                first,
                second,
            } if *second_share > 0.0 && *second_share < 1.0 => {
                let shares = [1.0 - second_share, *second_share];
                match (&**first, &**second) {
                    (Self::Diffuse { reflectance }, other) => Glossy {
                        base: Some(reflectance),
                        weights: shares,
                        ..other.as_microfacets()?
                    },
                    (other, Self::Diffuse { reflectance }) => Glossy {
                        base: Some(reflectance),
                        weights: [shares[1], shares[0]],
                        base_is_last: true,
                        ..other.as_microfacets()?
                    },
                    _ => return None,
                }
            }
            _ => inner.as_microfacets()?,
        };
        Some(Glossy { two_sided, ..glossy })
    }

    fn as_microfacets(&self) -> Option<Glossy<'_>> {
        let Self::Conductor {
            ior,
            roughness:
                Some(Roughness {
                    distribution: Microfacet::Ggx,
                    alpha_u: FloatTexture::Constant(alpha_u),
                    alpha_v: FloatTexture::Constant(alpha_v),
                }),
            specular_reflectance,
        } = self
        else {
            return None;
        };
        let (alpha, along_v) = Ggx::new(*alpha_u, *alpha_v).alpha();
        (alpha == along_v && !specular_reflectance.has_vertices()).then_some(Glossy {
            eta: ior.eta,
            k: ior.k,
            alpha,
            tint: specular_reflectance,
            base: None,
            weights: [0.0, 1.0],
            base_is_last: false,
            two_sided: false,
        })
    }
}
