//! The BSDFs that blends and sides consist of. All see `wo` above the surface; a flag says whether
//! the medium there is the inside of the object.

mod conductor;
mod dielectric;
mod diffuse;
mod layered;
mod metallic_roughness;
mod mirror;
mod plastic;
mod rough_plastic;
mod thin_dielectric;

pub(super) use conductor::{RoughConductor, SmoothConductor};
pub(super) use dielectric::{RoughDielectric, SmoothDielectric};
pub(super) use diffuse::Diffuse;
pub(super) use layered::{Layered, prepare as prepare_sheen};
pub(super) use metallic_roughness::MetallicRoughness;
pub(super) use mirror::Mirror;
pub(super) use plastic::{Plastic, PlasticBase};
pub(super) use rough_plastic::RoughPlastic;
pub(super) use thin_dielectric::ThinDielectric;

use crate::Rgb;
use glam::{Vec2, Vec3};

/// Most lobes of one component.
pub(super) const MAX_COMPONENT_LOBES: usize = 3;

/// `f_l·|cos θ_i|` and the density of `wi` *given* the lobe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct LobeEvaluation {
    pub value: Rgb,
    pub pdf: f32,
}

/// A direction drawn from a lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Draw {
    /// From a delta lobe that scatters the share `value` of radiance.
    Delta { wi: Vec3, value: Rgb, eta: f32 },
    /// From a lobe with a density.
    Direction { wi: Vec3, eta: f32 },
}

impl Draw {
    /// A delta reflection.
    #[inline(always)]
    fn mirror(wo: Vec3, value: Rgb) -> Self {
        Draw::Delta {
            wi: Vec3::new(-wo.x, -wo.y, wo.z),
            value,
            eta: 1.0,
        }
    }
}

/// Whether mirrors and smooth refractions can be met at all: in builds without them they answer
/// nothing.
pub(super) const HAS_DELTA: bool = !cfg!(lightshed_without = "specular");

/// The functions of every component. `wo.z > 0` always; `inside` says that `wo` is on the inner
/// side of a closed object.
trait Scatter {
    /// Number of lobes, at most [`MAX_COMPONENT_LOBES`].
    const LOBES: u8;
    /// Whether all of them are delta lobes, so that there is nothing to evaluate.
    const ALL_DELTA: bool = false;
    /// `P(l | wo)`; sums to one unless the component is black.
    fn probabilities(&self, wo: Vec3, inside: bool) -> [f32; MAX_COMPONENT_LOBES];
    /// 0 for a delta lobe, `α` for a microfacet lobe, 1 for a diffuse one.
    fn roughness(&self, lobe: u8) -> f32;
    fn evaluate(&self, lobe: u8, wo: Vec3, wi: Vec3, inside: bool) -> LobeEvaluation;
    /// The same of all lobes. Components whose lobes have work in common do it once.
    #[inline]
    fn evaluate_lobes(&self, wo: Vec3, wi: Vec3, inside: bool) -> [LobeEvaluation; MAX_COMPONENT_LOBES] {
        let mut found = [LobeEvaluation::default(); MAX_COMPONENT_LOBES];
        for lobe in 0..Self::LOBES {
            found[usize::from(lobe)] = self.evaluate(lobe, wo, wi, inside);
        }
        found
    }
    fn sample(&self, lobe: u8, wo: Vec3, u: Vec2, inside: bool) -> Option<Draw>;
    /// Approximate share of light scattered.
    fn albedo_hint(&self) -> Rgb;
    /// Weight in the selection among components; zero only if nothing is ever scattered.
    fn importance(&self) -> f32 {
        self.albedo_hint().max_element()
    }
}

macro_rules! components {
    ($($name:ident),* $(,)?) => {
        /// One of the components.
        #[derive(Clone, Copy, Debug)]
        pub(super) enum Component {
            $($name($name),)*
        }

        impl Component {
            #[inline]
            pub fn lobe_count(&self) -> u8 {
                match self {
                    $(Self::$name(_) => <$name as Scatter>::LOBES,)*
                }
            }

            #[inline]
            pub fn all_delta(&self) -> bool {
                match self {
                    $(Self::$name(_) => HAS_DELTA && <$name as Scatter>::ALL_DELTA,)*
                }
            }

            #[inline]
            pub fn probabilities(&self, wo: Vec3, inside: bool) -> [f32; MAX_COMPONENT_LOBES] {
                match self {
                    $(Self::$name(_) if !HAS_DELTA && <$name as Scatter>::ALL_DELTA => [0.0; MAX_COMPONENT_LOBES],
                    Self::$name(c) => c.probabilities(wo, inside),)*
                }
            }

            #[inline]
            pub fn roughness(&self, lobe: u8) -> f32 {
                match self {
                    $(Self::$name(c) => c.roughness(lobe),)*
                }
            }

            #[inline]
            pub fn evaluate(&self, lobe: u8, wo: Vec3, wi: Vec3, inside: bool) -> LobeEvaluation {
                match self {
                    $(Self::$name(c) => c.evaluate(lobe, wo, wi, inside),)*
                }
            }

            #[inline]
            pub fn evaluate_lobes(&self, wo: Vec3, wi: Vec3, inside: bool) -> [LobeEvaluation; MAX_COMPONENT_LOBES] {
                match self {
                    $(Self::$name(c) => c.evaluate_lobes(wo, wi, inside),)*
                }
            }

            #[inline]
            pub fn sample(&self, lobe: u8, wo: Vec3, u: Vec2, inside: bool) -> Option<Draw> {
                match self {
                    $(Self::$name(_) if !HAS_DELTA && <$name as Scatter>::ALL_DELTA => None,
                    Self::$name(c) => c.sample(lobe, wo, u, inside),)*
                }
            }

            pub fn albedo_hint(&self) -> Rgb {
                match self {
                    $(Self::$name(c) => c.albedo_hint(),)*
                }
            }

            #[inline]
            pub fn importance(&self) -> f32 {
                match self {
                    $(Self::$name(c) => c.importance(),)*
                }
            }
        }
    };
}

components!(
    Diffuse,
    Layered,
    MetallicRoughness,
    Mirror,
    Plastic,
    RoughConductor,
    RoughDielectric,
    RoughPlastic,
    SmoothConductor,
    SmoothDielectric,
    ThinDielectric,
);

/// `[a/(a+b), b/(a+b), 0]`, zeros for 0/0.
#[inline(always)]
fn two_way(a: f32, b: f32) -> [f32; MAX_COMPONENT_LOBES] {
    let sum = a + b;
    if sum > 0.0 {
        let first = a / sum;
        [first, 1.0 - first, 0.0]
    } else {
        [0.0; MAX_COMPONENT_LOBES]
    }
}

/// The mirror image of `wo` in a microfacet of normal `h`.
#[inline(always)]
fn reflect(wo: Vec3, h: Vec3) -> Vec3 {
    2.0 * wo.dot(h) * h - wo
}
