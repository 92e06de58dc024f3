//! From a material to its BSDF at a point.

use super::bsdf::{Bsdf, Entry, MAX_COMPONENTS, Side};
use super::component::{
    Component, Diffuse, MetallicRoughness, Mirror, Plastic, PlasticBase, RoughConductor, RoughDielectric,
    RoughPlastic, SmoothConductor, SmoothDielectric, ThinDielectric,
};
use super::microfacet::Distribution;
use super::{Material, Roughness, fresnel, rough_coat};
use crate::{ColorTexture, Rgb};
use glam::Vec2;
use lightshed_sampling::Ggx;

impl Material {
    /// The scattering function at mesh coordinates `uv`: looks up textures, and flattens blends and
    /// sides. Neither allocates nor fails; a material that [`Material::validate`] refuses gives a
    /// finite result.
    ///
    /// A rough dielectric whose index matches the outside's is a smooth one: it lets all light pass
    /// unbent.
    #[inline]
    pub fn at(&self, uv: Vec2) -> Bsdf {
        match self.as_diffuse() {
            Some((reflectance, two_sided)) => Bsdf::diffuse(
                reflectance.at(uv),
                if two_sided { Side::Both } else { Side::Front },
            ),
            None => self.resolve(uv),
        }
    }

    /// The reflectance of a material that is diffuse everywhere, and whether it is seen from both
    /// sides.
    #[inline]
    pub(crate) fn as_diffuse(&self) -> Option<(&ColorTexture, bool)> {
        match self {
            Self::Diffuse { reflectance } => Some((reflectance, false)),
            Self::TwoSided { front, back: None } => match &**front {
                Self::Diffuse { reflectance } => Some((reflectance, true)),
                _ => None,
            },
            _ => None,
        }
    }

    #[inline(never)]
    fn resolve(&self, uv: Vec2) -> Bsdf {
        let (inner, side) = match self {
            Self::TwoSided { front, back: None } => (&**front, Some(Side::Both)),
            _ => (self, None),
        };
        if let Some((component, natural_side)) = inner.leaf(uv) {
            return Bsdf::single(component, side.unwrap_or(natural_side));
        }
        let mut leaves = Leaves {
            entries: [BLACK; MAX_COMPONENTS],
            count: 0,
        };
        self.collect(uv, 1.0, None, &mut leaves);
        Bsdf::from_entries(&leaves.entries[..leaves.count])
    }

    /// Adds the leaves of this material. `side` is the side set by an enclosing
    /// [`Material::TwoSided`].
    fn collect(&self, uv: Vec2, weight: f32, side: Option<Side>, leaves: &mut Leaves) {
        match self {
            Self::Blend {
                weight: second_share,
                first,
                second,
            } => {
                let share = second_share.at(uv).clamp(0.0, 1.0);
                first.collect(uv, weight * (1.0 - share), side, leaves);
                second.collect(uv, weight * share, side, leaves);
            }
            Self::TwoSided { front, back } => match (back, side) {
                (None, _) => front.collect(uv, weight, side.or(Some(Side::Both)), leaves),
                (Some(_), Some(settled)) => front.collect(uv, weight, Some(settled), leaves),
                (Some(back), None) => {
                    front.collect(uv, weight, Some(Side::Front), leaves);
                    back.collect(uv, weight, Some(Side::Back), leaves);
                }
            },
            _ => {
                if let Some((component, natural_side)) = self.leaf(uv) {
                    leaves.push(component, weight, side.unwrap_or(natural_side));
                }
            }
        }
    }

    /// The component of a material that is no blend and has no sides of its own, and the side it is
    /// seen from.
    #[inline]
    fn leaf(&self, uv: Vec2) -> Option<(Component, Side)> {
        Some(match self {
            Self::Blend { .. } | Self::TwoSided { .. } => return None,
            // An index of 1 lets all light pass.
            Self::Null => (
                Component::SmoothDielectric(SmoothDielectric {
                    eta: 1.0,
                    reflection_tint: Rgb::ONE,
                    transmission_tint: Rgb::ONE,
                }),
                Side::Both,
            ),
            Self::Diffuse { reflectance } => (
                Component::Diffuse(Diffuse {
                    reflectance: reflectance.at(uv),
                }),
                Side::Front,
            ),
            Self::Mirror { reflectance } => (
                Component::Mirror(Mirror {
                    reflectance: reflectance.at(uv),
                }),
                Side::Front,
            ),
            Self::Conductor {
                ior,
                roughness,
                specular_reflectance,
            } => {
                let smooth = SmoothConductor {
                    eta: ior.eta,
                    k: ior.k,
                    tint: specular_reflectance.at(uv),
                };
                let component = match roughness {
                    None => Component::SmoothConductor(smooth),
                    Some(roughness) => Component::RoughConductor(RoughConductor {
                        smooth,
                        distribution: roughness.at(uv),
                    }),
                };
                (component, Side::Front)
            }
            Self::Dielectric {
                eta,
                roughness,
                specular_reflectance,
                specular_transmittance,
            } => {
                let smooth = SmoothDielectric {
                    eta: *eta,
                    reflection_tint: specular_reflectance.at(uv),
                    transmission_tint: specular_transmittance.at(uv),
                };
                let component = match roughness {
                    Some(roughness) if *eta != 1.0 => Component::RoughDielectric(RoughDielectric {
                        smooth,
                        distribution: roughness.at(uv),
                    }),
                    _ => Component::SmoothDielectric(smooth),
                };
                (component, Side::Both)
            }
            Self::ThinDielectric {
                eta,
                specular_reflectance,
                specular_transmittance,
            } => (
                Component::ThinDielectric(ThinDielectric {
                    eta: *eta,
                    reflection_tint: specular_reflectance.at(uv),
                    transmission_tint: specular_transmittance.at(uv),
                }),
                Side::Both,
            ),
            Self::Plastic {
                eta,
                diffuse_reflectance,
                specular_reflectance,
                nonlinear,
                roughness,
            } => {
                let albedo = diffuse_reflectance.at(uv);
                let reflection_tint = specular_reflectance.at(uv);
                let component = match roughness {
                    None => Component::Plastic(Plastic {
                        eta: *eta,
                        base: PlasticBase::new(
                            albedo,
                            fresnel::diffuse_reflectance(1.0 / eta),
                            *eta,
                            *nonlinear,
                        ),
                        reflection_tint,
                    }),
                    Some(roughness) => {
                        let distribution = roughness.at(uv);
                        let inner = rough_coat::internal_reflectance(&distribution, *eta);
                        Component::RoughPlastic(RoughPlastic {
                            eta: *eta,
                            base: PlasticBase::new(albedo, inner, *eta, *nonlinear),
                            reflection_tint,
                            distribution,
                        })
                    }
                };
                (component, Side::Front)
            }
            Self::MetallicRoughness {
                base_color,
                metallic,
                roughness,
                transmission,
                ior,
            } => {
                let root = (ior - 1.0) / (ior + 1.0);
                let perceptual = roughness.at(uv).min(1.0);
                let alpha = perceptual * perceptual;
                let transmission = transmission.at(uv).clamp(0.0, 1.0);
                let component = Component::MetallicRoughness(MetallicRoughness {
                    // Schlick's interpolation to white needs colours up to white.
                    base_color: base_color.at(uv).min(Rgb::ONE),
                    metallic: metallic.at(uv).clamp(0.0, 1.0),
                    transmission,
                    f0: root * root,
                    distribution: Ggx::new(alpha, alpha),
                });
                // Transmissive materials are visible from both sides.
                (
                    component,
                    if transmission > 0.0 {
                        Side::Both
                    } else {
                        Side::Front
                    },
                )
            }
        })
    }
}

impl Roughness {
    fn at(&self, uv: Vec2) -> Distribution {
        Distribution::new(self.distribution, self.alpha_u.at(uv), self.alpha_v.at(uv))
    }
}

const BLACK: Entry = Entry {
    component: Component::Diffuse(Diffuse {
        reflectance: Rgb::ZERO,
    }),
    side: Side::Front,
    weight: 0.0,
    importance: 0.0,
};

/// Leaves found so far.
struct Leaves {
    entries: [Entry; MAX_COMPONENTS],
    count: usize,
}

impl Leaves {
    fn push(&mut self, component: Component, weight: f32, side: Side) {
        // More leaves than that are refused by validation.
        if let Some(slot) = self.entries.get_mut(self.count)
            && weight > 0.0
        {
            *slot = Entry {
                component,
                side,
                weight,
                importance: weight * component.importance(),
            };
            self.count += 1;
        }
    }
}
