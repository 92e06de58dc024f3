//! From a material to its BSDF at a point.

use super::bsdf::{Bsdf, Entry, MAX_COMPONENTS, Side};
use super::component::{
    Component, Diffuse, Layered, MetallicRoughness, Mirror, Plastic, PlasticBase, RoughConductor,
    RoughDielectric, RoughPlastic, SmoothConductor, SmoothDielectric, ThinDielectric,
};
use super::microfacet::Distribution;
use super::{Material, Roughness, fresnel, rough_coat};
use crate::{ColorTexture, Place, Rgb};
use lightshed_sampling::Ggx;

impl Material {
    /// The scattering function at a place of a mesh, or at its coordinates alone: looks up
    /// textures, and flattens blends and sides. Neither allocates nor fails; a material that
    /// [`Material::validate`] refuses gives a finite result.
    ///
    /// A rough dielectric whose index matches the outside's is a smooth one: it lets all light pass
    /// unbent.
    #[inline]
    pub fn at(&self, place: impl Into<Place>) -> Bsdf {
        let place = place.into();
        match self.as_diffuse() {
            Some((reflectance, two_sided)) => Bsdf::diffuse(
                reflectance.at(place),
                if two_sided { Side::Both } else { Side::Front },
            ),
            None => self.resolve(place),
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
            Self::Relief { base, .. } => base.as_diffuse(),
            _ => None,
        }
    }

    #[inline(never)]
    fn resolve(&self, place: Place) -> Bsdf {
        let (inner, side) = match self {
            Self::TwoSided { front, back: None } => (&**front, Some(Side::Both)),
            Self::Relief { base, .. } => return base.resolve(place),
            _ => (self, None),
        };
        if let Some((component, natural_side)) = inner.leaf(place) {
            return Bsdf::single(component, side.unwrap_or(natural_side));
        }
        let mut leaves = Leaves {
            entries: [BLACK; MAX_COMPONENTS],
            count: 0,
        };
        self.collect(place, 1.0, None, &mut leaves);
        Bsdf::from_entries(&leaves.entries[..leaves.count])
    }

    /// Adds the leaves of this material. `side` is the side set by an enclosing
    /// [`Material::TwoSided`].
    fn collect(&self, place: Place, weight: f32, side: Option<Side>, leaves: &mut Leaves) {
        match self {
            Self::Blend {
                weight: second_share,
                first,
                second,
            } => {
                let share = second_share.at(place).clamp(0.0, 1.0);
                first.collect(place, weight * (1.0 - share), side, leaves);
                second.collect(place, weight * share, side, leaves);
            }
            Self::TwoSided { front, back } => match (back, side) {
                (None, _) => front.collect(place, weight, side.or(Some(Side::Both)), leaves),
                (Some(_), Some(settled)) => front.collect(place, weight, Some(settled), leaves),
                (Some(back), None) => {
                    front.collect(place, weight, Some(Side::Front), leaves);
                    back.collect(place, weight, Some(Side::Back), leaves);
                }
            },
            _ => {
                if let Some((component, natural_side)) = self.leaf(place) {
                    leaves.push(component, weight, side.unwrap_or(natural_side));
                }
            }
        }
    }

    /// The component of a material that is no blend and has no sides of its own, and the side it is
    /// seen from.
    #[inline]
    fn leaf(&self, place: Place) -> Option<(Component, Side)> {
        Some(match self {
            Self::Blend { .. } | Self::TwoSided { .. } | Self::Relief { .. } => return None,
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
                    reflectance: reflectance.at(place),
                }),
                Side::Front,
            ),
            Self::Mirror { reflectance } => (
                Component::Mirror(Mirror {
                    reflectance: reflectance.at(place),
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
                    tint: specular_reflectance.at(place),
                };
                let component = match roughness {
                    None => Component::SmoothConductor(smooth),
                    Some(roughness) => Component::RoughConductor(RoughConductor {
                        smooth,
                        distribution: roughness.at(place),
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
                    reflection_tint: specular_reflectance.at(place),
                    transmission_tint: specular_transmittance.at(place),
                };
                let component = match roughness {
                    Some(roughness) if *eta != 1.0 => Component::RoughDielectric(RoughDielectric {
                        smooth,
                        distribution: roughness.at(place),
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
                    reflection_tint: specular_reflectance.at(place),
                    transmission_tint: specular_transmittance.at(place),
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
                let albedo = diffuse_reflectance.at(place);
                let reflection_tint = specular_reflectance.at(place);
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
                        let distribution = roughness.at(place);
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
            Self::Layered { base, layers } => match base.leaf(place)? {
                (Component::MetallicRoughness(base), side) => {
                    let alpha = |roughness: &crate::FloatTexture| {
                        let perceptual = roughness.at(place).clamp(0.0, 1.0);
                        perceptual * perceptual
                    };
                    let coat = layers.coat.at(place).clamp(0.0, 1.0);
                    let sheen = layers.sheen.at(place).clamp(Rgb::ZERO, Rgb::ONE);
                    let layered = Layered::new(
                        base,
                        (coat, alpha(&layers.coat_roughness)),
                        (sheen, alpha(&layers.sheen_roughness)),
                    );
                    (Component::Layered(layered), side)
                }
                other => other,
            },
            Self::MetallicRoughness {
                base_color,
                metallic,
                roughness,
                transmission,
                ior,
            } => {
                let root = (ior - 1.0) / (ior + 1.0);
                let perceptual = roughness.at(place).min(1.0);
                let alpha = perceptual * perceptual;
                let transmission = transmission.at(place).clamp(0.0, 1.0);
                let component = Component::MetallicRoughness(MetallicRoughness {
                    // Schlick's interpolation to white needs colours up to white.
                    base_color: base_color.at(place).min(Rgb::ONE),
                    metallic: metallic.at(place).clamp(0.0, 1.0),
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
    fn at(&self, place: Place) -> Distribution {
        Distribution::new(self.distribution, self.alpha_u.at(place), self.alpha_v.at(place))
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
