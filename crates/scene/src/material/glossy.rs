//! Materials of microfacets of a conductor, alone or blended with a diffuse base, as eight vertices
//! at a time read them.

use super::{Material, Microfacet, Roughness};
use crate::{ColorTexture, FloatTexture, Rgb};
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

    /// The row of a material and what else there is to know of it; `None` for other materials.
    pub fn new(material: &Material) -> Option<(Self, GlossyLook)> {
        let glossy = material.as_glossy()?;
        let black = ColorTexture::Constant(Rgb::ZERO);
        let base = glossy.base.unwrap_or(&black);
        let (albedo, tint) = (base.as_constant(), glossy.tint.as_constant());
        let textured = albedo.is_none() || tint.is_none();
        let [a, t] = [albedo, tint].map(|color| color.unwrap_or(Rgb::ZERO));
        let [share, other] = glossy.weights;
        let (eta, k) = (glossy.eta, glossy.k);
        let last = f32::from(u8::from(glossy.base_is_last));
        let row = Self([
            [a.x, a.y, a.z, t.x, t.y, t.z, share, other],
            [eta.x, eta.y, eta.z, k.x, k.y, k.z, glossy.alpha, last],
        ]);
        let look = GlossyLook {
            two_sided: glossy.two_sided,
            colors: textured.then(|| [base.clone(), glossy.tint.clone()]),
        };
        Some((row, look))
    }
}

/// What a [`GlossyRow`] does not hold.
pub(crate) struct GlossyLook {
    /// Whether it is seen from both sides.
    pub two_sided: bool,
    /// Albedo of the base and tint, if any of them differs from place to place.
    pub colors: Option<[ColorTexture; 2]>,
}

impl Material {
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
