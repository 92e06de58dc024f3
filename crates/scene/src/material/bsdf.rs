//! A material at a point: a small value that evaluates and samples scattering, lobe by lobe.

use super::component::{Component, Diffuse, Draw, HAS_DELTA, LobeEvaluation, MAX_COMPONENT_LOBES};
use crate::Rgb;
use glam::{Vec2, Vec3};
use lightshed_sampling::{CosineHemisphere, Density, SolidAngle};
use std::f32::consts::FRAC_1_PI;

/// Most components (leaves of blends and sides) that a [`Bsdf`] holds.
pub(super) const MAX_COMPONENTS: usize = 4;

/// A bidirectional scattering distribution function at one surface point, in the local shading
/// frame whose `z` is the shading normal.
///
/// **Directions.** `wo` (towards the viewer) and `wi` (towards the light) are unit vectors that
/// both point away from the surface; either may be below it. `value`s are `f(wo, wi)·|cos θ_i|`
/// for *radiance* arriving along `wi` and leaving along `wo`; refraction scales radiance by the
/// squared ratio of indices.
///
/// **Lobes.** The function is a sum of lobes `f = Σ_l f_l`, each with its own sampler. `P(l | wo)`
/// is the probability of choosing lobe `l`: it depends on `wo` alone, and sampling realises exactly
/// it, from its own random number, so that a replay of random numbers follows the same lobes.
/// Densities in the solid-angle measure are *joint* with the choice:
/// `p_l(wi) = P(l | wo) · p(wi | l, wo)`, so that their sum over lobes is the density of the whole
/// sampler.
///
/// **Delta lobes** (mirrors, smooth dielectrics) have no density: they evaluate to zero for any
/// given `wi`, and samples of them say so by `is_delta` and carry an infinite density.
///
/// ```
/// use lightshed_scene::{Material, Rgb, glam::{Vec2, Vec3}};
/// let material = Material::Diffuse { reflectance: Rgb::splat(0.5).into() };
/// let bsdf = material.at(Vec2::ZERO);
/// let sample = bsdf.sample(Vec3::Z, 0.3, Vec2::new(0.2, 0.7)).unwrap();
/// assert!((sample.weight - Rgb::splat(0.5)).abs().max_element() < 1e-6);
/// let again = bsdf.evaluate(Vec3::Z, sample.wi);
/// assert_eq!(again.pdf, sample.pdf);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    repr: Repr,
}

/// Nearly all surfaces are diffuse, so this comes first.
#[derive(Clone, Copy, Debug)]
enum Repr {
    Diffuse {
        reflectance: Rgb,
        side: Side,
    },
    Single(Entry),
    Mixture {
        entries: [Entry; MAX_COMPONENTS],
        count: u8,
    },
}

/// The side of the surface from which a component is seen. It is evaluated in a frame mirrored so
/// that `wo` is above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Front,
    Back,
    Both,
}

impl Side {
    /// Factor for `z` that brings `wo` above the surface; `None` where the component is not seen
    /// from `wo`.
    #[inline(always)]
    fn mirror(self, wo: Vec3) -> Option<f32> {
        match self {
            Side::Front if wo.z > 0.0 => Some(1.0),
            Side::Back if wo.z < 0.0 => Some(-1.0),
            Side::Both if wo.z > 0.0 => Some(1.0),
            Side::Both if wo.z < 0.0 => Some(-1.0),
            _ => None,
        }
    }
}

/// A component with its share of the blend.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub component: Component,
    pub side: Side,
    /// Share of the blend, in `[0, 1]`.
    pub weight: f32,
    /// Unnormalised probability of being chosen: zero only if the component scatters nothing.
    pub importance: f32,
}

/// Mirrors `v` at the surface if `mirror` is −1.
#[inline(always)]
fn mirrored(v: Vec3, mirror: f32) -> Vec3 {
    Vec3::new(v.x, v.y, v.z * mirror)
}

/// A value of the function and the density with which it is sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BsdfValue {
    /// `f(wo, wi)·|cos θ_i|`, per steradian.
    pub value: Rgb,
    /// Density of `wi` given `wo`, joint with the choice of lobe.
    pub pdf: Density<SolidAngle>,
}

/// A direction sampled from all lobes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Sampled direction towards the light.
    pub wi: Vec3,
    /// `f·|cos θ_i|/p` with `p` the density of *all* non-delta lobes; for a delta lobe its share
    /// of the scattered radiance over the probability of the lobe.
    pub weight: Rgb,
    /// Density of `wi` over all non-delta lobes; infinite for a delta lobe.
    pub pdf: Density<SolidAngle>,
    /// The lobe that was sampled.
    pub lobe: u8,
    /// Whether the lobe is a delta lobe.
    pub is_delta: bool,
    /// Index of refraction on the side of `wi` over that on the side of `wo` for transmission, 1
    /// for reflection. A path that multiplies its throughput by `eta²` undoes the radiance
    /// scaling, as Russian roulette needs.
    pub eta: f32,
}

/// A direction sampled from one given lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeSample {
    /// Sampled direction towards the light.
    pub wi: Vec3,
    /// `f_l(wo, wi)·|cos θ_i|` of this lobe alone, per steradian; for a delta lobe the share of
    /// radiance that it scatters (no unit).
    pub value: Rgb,
    /// Density of `wi`, joint with the choice of this lobe; infinite for a delta lobe.
    pub pdf: Density<SolidAngle>,
    /// `P(l | wo)`.
    pub probability: f32,
    /// Whether the lobe is a delta lobe.
    pub is_delta: bool,
    /// As [`BsdfSample::eta`].
    pub eta: f32,
}

const INFINITE: Density<SolidAngle> = Density::new(f32::INFINITY);

impl Bsdf {
    /// Lambertian reflection.
    #[inline(always)]
    pub(super) fn diffuse(reflectance: Rgb, side: Side) -> Self {
        Self {
            repr: Repr::Diffuse { reflectance, side },
        }
    }

    /// One component alone.
    #[inline]
    pub(super) fn single(component: Component, side: Side) -> Self {
        let repr = match component {
            Component::Diffuse(diffuse) => Repr::Diffuse {
                reflectance: diffuse.reflectance,
                side,
            },
            _ => Repr::Single(Entry {
                component,
                side,
                weight: 1.0,
                // Nothing to compare with.
                importance: 1.0,
            }),
        };
        Self { repr }
    }

    /// From components; at most [`MAX_COMPONENTS`] are used. None is black.
    pub(super) fn from_entries(entries: &[Entry]) -> Self {
        let repr = match entries {
            [] => Repr::Diffuse {
                reflectance: Rgb::ZERO,
                side: Side::Front,
            },
            [
                Entry {
                    component: Component::Diffuse(diffuse),
                    side,
                    weight,
                    ..
                },
            ] => Repr::Diffuse {
                reflectance: diffuse.reflectance * *weight,
                side: *side,
            },
            [entry] => Repr::Single(*entry),
            _ => {
                let count = entries.len().min(MAX_COMPONENTS);
                let mut padded = [entries[0]; MAX_COMPONENTS];
                padded[..count].copy_from_slice(&entries[..count]);
                Repr::Mixture {
                    entries: padded,
                    count: count as u8,
                }
            }
        };
        Self { repr }
    }

    /// The entries of a representation other than diffuse.
    #[inline]
    fn entries(&self) -> &[Entry] {
        match &self.repr {
            Repr::Diffuse { .. } => &[],
            Repr::Single(entry) => std::slice::from_ref(entry),
            Repr::Mixture { entries, count } => &entries[..*count as usize],
        }
    }

    /// All components, the first so many of them.
    pub(super) fn leaves(&self) -> ([Entry; MAX_COMPONENTS], usize) {
        let diffuse = |reflectance, side| Entry {
            component: Component::Diffuse(Diffuse { reflectance }),
            side,
            weight: 1.0,
            importance: 1.0,
        };
        match self.repr {
            Repr::Diffuse { reflectance, side } => ([diffuse(reflectance, side); MAX_COMPONENTS], 1),
            Repr::Single(entry) => ([entry; MAX_COMPONENTS], 1),
            Repr::Mixture { entries, count } => (entries, usize::from(count)),
        }
    }

    /// Number of lobes; lobes are `0..lobe_count`.
    #[inline]
    pub fn lobe_count(&self) -> u8 {
        match &self.repr {
            Repr::Diffuse { .. } => 1,
            _ => self
                .entries()
                .iter()
                .map(|entry| entry.component.lobe_count())
                .sum(),
        }
    }

    /// The entry that a lobe belongs to, and its number there.
    #[inline]
    fn locate(&self, lobe: u8) -> Option<(&Entry, u8)> {
        let mut local = lobe;
        for entry in self.entries() {
            let count = entry.component.lobe_count();
            if local < count {
                return Some((entry, local));
            }
            local -= count;
        }
        None
    }

    /// Sum of the importances of what is seen from `wo`.
    #[inline]
    fn total_importance(&self, wo: Vec3) -> f32 {
        let seen = |entry: &&Entry| entry.side.mirror(wo).is_some();
        self.entries()
            .iter()
            .filter(seen)
            .map(|entry| entry.importance)
            .sum()
    }

    /// `P(lobe | wo)`, the probability that [`Bsdf::sample`] chooses `lobe`. The sum over lobes is
    /// 1, or 0 where nothing is scattered towards `wo` (a one-sided surface from behind, or one
    /// that is black). 0 for a lobe that does not exist.
    #[inline]
    pub fn lobe_probability(&self, lobe: u8, wo: Vec3) -> f32 {
        if let Repr::Diffuse { side, .. } = self.repr {
            return if lobe == 0 && side.mirror(wo).is_some() {
                1.0
            } else {
                0.0
            };
        }
        let Some((entry, local)) = self.locate(lobe) else {
            return 0.0;
        };
        let Some(mirror) = entry.side.mirror(wo) else {
            return 0.0;
        };
        let share = share(entry.importance, self.total_importance(wo));
        share * entry.component.probabilities(mirrored(wo, mirror), mirror < 0.0)[local as usize]
    }

    /// A measure of a lobe's width: 0 for a delta lobe, `min(α_x, α_y, 1)` for a microfacet lobe,
    /// 1 for a diffuse lobe. For thresholds of connectability. 0 for a lobe that does not exist.
    #[inline]
    pub fn lobe_roughness(&self, lobe: u8) -> f32 {
        match (&self.repr, self.locate(lobe)) {
            (Repr::Diffuse { .. }, _) if lobe == 0 => 1.0,
            (_, Some((entry, local))) => entry.component.roughness(local),
            _ => 0.0,
        }
    }

    /// Whether a lobe scatters into finitely many directions only.
    #[inline]
    pub fn is_delta(&self, lobe: u8) -> bool {
        self.lobe_roughness(lobe) == 0.0
    }

    /// Whether any lobe has a density, that is whether connecting to a given `wi` can be of use.
    #[inline]
    pub fn has_non_delta(&self) -> bool {
        match self.repr {
            Repr::Diffuse { .. } => true,
            _ => self.entries().iter().any(|entry| !entry.component.all_delta()),
        }
    }

    /// Whether a lobe with a density may scatter light through the surface, from the side away from
    /// `wo`.
    #[inline]
    pub fn scatters_through(&self) -> bool {
        self.entries().iter().any(|entry| match &entry.component {
            Component::RoughDielectric(_) => true,
            Component::MetallicRoughness(component) => component.transmission > 0.0,
            _ => false,
        })
    }

    /// Whether light is scattered by a diffuse lobe alone.
    #[inline(always)]
    pub fn is_diffuse(&self) -> bool {
        matches!(self.repr, Repr::Diffuse { .. })
    }

    /// Approximate share of light scattered at normal incidence; for heuristics only.
    pub fn albedo_hint(&self) -> Rgb {
        match self.repr {
            Repr::Diffuse { reflectance, .. } => reflectance,
            _ => self
                .entries()
                .iter()
                .map(|entry| entry.component.albedo_hint() * entry.weight)
                .sum(),
        }
    }

    /// `f(wo, wi)·|cos θ_i|` over all non-delta lobes, and the density with which
    /// [`Bsdf::sample`] takes `wi`.
    #[inline(always)]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfValue {
        match self.repr {
            Repr::Diffuse { reflectance, side } => evaluate_diffuse(reflectance, side, wo, wi),
            _ => self.evaluate_entries(wo, wi),
        }
    }

    #[inline(never)]
    fn evaluate_entries(&self, wo: Vec3, wi: Vec3) -> BsdfValue {
        let total = self.total_importance(wo);
        let mut sum = LobeEvaluation::default();
        for entry in self.entries() {
            let Some(mirror) = entry.side.mirror(wo) else {
                continue;
            };
            if entry.component.all_delta() {
                continue;
            }
            let inside = mirror < 0.0;
            let (wo, wi) = (mirrored(wo, mirror), mirrored(wi, mirror));
            let share = share(entry.importance, total);
            let found = entry.component.evaluate_lobes(wo, wi, inside);
            // Nothing is scattered there: the probabilities are of no use.
            if found.iter().all(|lobe| *lobe == LobeEvaluation::default()) {
                continue;
            }
            let probabilities = entry.component.probabilities(wo, inside);
            for (lobe, probability) in found.iter().zip(probabilities) {
                sum.value += lobe.value * entry.weight;
                sum.pdf += lobe.pdf * share * probability;
            }
        }
        BsdfValue {
            value: sum.value,
            pdf: Density::new(sum.pdf),
        }
    }

    /// `f_l(wo, wi)·|cos θ_i|` of one lobe, and its density joint with the choice of the lobe.
    /// Zero for a delta lobe and for a lobe that does not exist.
    #[inline]
    pub fn evaluate_lobe(&self, lobe: u8, wo: Vec3, wi: Vec3) -> BsdfValue {
        if let Repr::Diffuse { reflectance, side } = self.repr {
            return if lobe == 0 {
                evaluate_diffuse(reflectance, side, wo, wi)
            } else {
                BsdfValue::default()
            };
        }
        let Some((entry, local)) = self.locate(lobe) else {
            return BsdfValue::default();
        };
        let Some(mirror) = entry.side.mirror(wo) else {
            return BsdfValue::default();
        };
        let inside = mirror < 0.0;
        let evaluation = entry
            .component
            .evaluate(local, mirrored(wo, mirror), mirrored(wi, mirror), inside);
        BsdfValue {
            value: evaluation.value * entry.weight,
            pdf: Density::new(evaluation.pdf * self.lobe_probability(lobe, wo)),
        }
    }

    /// Chooses a lobe by `u_lobe ∈ [0, 1)` alone and samples it by `u ∈ [0, 1)²`. `None` where
    /// nothing is scattered or the sampled microfacet scatters into the surface: such samples count
    /// as zero.
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        match self.repr {
            Repr::Diffuse { reflectance, side } => {
                let (wi, pdf) = sample_diffuse(side, wo, u)?;
                Some(BsdfSample {
                    wi,
                    weight: reflectance,
                    pdf,
                    lobe: 0,
                    is_delta: false,
                    eta: 1.0,
                })
            }
            _ => self.sample_entries(wo, u_lobe, u),
        }
    }

    #[inline(never)]
    fn sample_entries(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let choice = self.choose(wo, u_lobe)?;
        match choice.draw(u)? {
            Draw::Delta { .. } if !HAS_DELTA => None,
            Draw::Delta { wi, value, eta } => Some(BsdfSample {
                wi: mirrored(wi, choice.mirror),
                weight: value * (choice.entry.weight / choice.probability),
                pdf: INFINITE,
                lobe: choice.lobe,
                is_delta: true,
                eta,
            }),
            Draw::Direction { wi, eta } => {
                let wi = mirrored(wi, choice.mirror);
                let BsdfValue { value, pdf } = self.evaluate(wo, wi);
                // The density is zero where rounding took the direction off the lobe's support.
                pdf.is_positive().then(|| BsdfSample {
                    wi,
                    weight: value / pdf.value(),
                    pdf,
                    lobe: choice.lobe,
                    is_delta: false,
                    eta,
                })
            }
        }
    }

    /// Samples a given lobe. `None` as in [`Bsdf::sample`], and for a lobe of probability zero.
    #[inline]
    pub fn sample_lobe(&self, lobe: u8, wo: Vec3, u: Vec2) -> Option<LobeSample> {
        if let Repr::Diffuse { reflectance, side } = self.repr {
            if lobe != 0 {
                return None;
            }
            let (wi, pdf) = sample_diffuse(side, wo, u)?;
            return Some(LobeSample {
                wi,
                value: reflectance * pdf.value(),
                pdf,
                probability: 1.0,
                is_delta: false,
                eta: 1.0,
            });
        }
        let (entry, local) = self.locate(lobe)?;
        let probability = self.lobe_probability(lobe, wo);
        if probability <= 0.0 {
            return None;
        }
        let mirror = entry.side.mirror(wo)?;
        let choice = Choice {
            entry,
            lobe,
            local,
            mirror,
            wo: mirrored(wo, mirror),
            probability,
        };
        match choice.draw(u)? {
            Draw::Delta { .. } if !HAS_DELTA => None,
            Draw::Delta { wi, value, eta } => Some(LobeSample {
                wi: mirrored(wi, mirror),
                value: value * entry.weight,
                pdf: INFINITE,
                probability,
                is_delta: true,
                eta,
            }),
            Draw::Direction { wi, eta } => {
                let evaluation = entry.component.evaluate(local, choice.wo, wi, mirror < 0.0);
                (evaluation.pdf > 0.0).then(|| LobeSample {
                    wi: mirrored(wi, mirror),
                    value: evaluation.value * entry.weight,
                    pdf: Density::new(evaluation.pdf * probability),
                    probability,
                    is_delta: false,
                    eta,
                })
            }
        }
    }

    /// The lobe in whose interval of cumulative probability `u_lobe` lies.
    #[inline]
    fn choose(&self, wo: Vec3, u_lobe: f32) -> Option<Choice<'_>> {
        let total = self.total_importance(wo);
        let mut chosen = None;
        let mut cumulative = 0.0;
        let mut first = 0;
        for entry in self.entries() {
            let count = entry.component.lobe_count();
            if let Some(mirror) = entry.side.mirror(wo) {
                let wo = mirrored(wo, mirror);
                let share = share(entry.importance, total);
                let probabilities = entry.component.probabilities(wo, mirror < 0.0);
                for local in 0..count {
                    let probability = share * probabilities[local as usize];
                    if probability <= 0.0 {
                        continue;
                    }
                    cumulative += probability;
                    chosen = Some(Choice {
                        entry,
                        lobe: first + local,
                        local,
                        mirror,
                        wo,
                        probability,
                    });
                    if u_lobe < cumulative {
                        return chosen;
                    }
                }
            }
            first += count;
        }
        // The sum of the probabilities may round to less than 1: the last possible lobe takes the
        // rest.
        chosen
    }
}

/// A lobe chosen for sampling.
struct Choice<'a> {
    entry: &'a Entry,
    lobe: u8,
    local: u8,
    mirror: f32,
    /// Above the surface.
    wo: Vec3,
    probability: f32,
}

impl Choice<'_> {
    #[inline]
    fn draw(&self, u: Vec2) -> Option<Draw> {
        self.entry
            .component
            .sample(self.local, self.wo, u, self.mirror < 0.0)
    }
}

/// `importance / total`, 0 for 0/0.
#[inline(always)]
fn share(importance: f32, total: f32) -> f32 {
    if total > 0.0 { importance / total } else { 0.0 }
}

#[inline(always)]
fn evaluate_diffuse(reflectance: Rgb, side: Side, wo: Vec3, wi: Vec3) -> BsdfValue {
    let Some(mirror) = side.mirror(wo) else {
        return BsdfValue::default();
    };
    let density = (wi.z * mirror).max(0.0) * FRAC_1_PI;
    BsdfValue {
        value: reflectance * density,
        pdf: Density::new(density),
    }
}

#[inline(always)]
fn sample_diffuse(side: Side, wo: Vec3, u: Vec2) -> Option<(Vec3, Density<SolidAngle>)> {
    let mirror = side.mirror(wo)?;
    let wi = CosineHemisphere::sample(u.to_array());
    (wi.z > 0.0).then(|| (mirrored(wi, mirror), Density::new(wi.z * FRAC_1_PI)))
}

/// A component has few lobes, so a flat lobe number fits `u8`.
const _: () = assert!(MAX_COMPONENTS * MAX_COMPONENT_LOBES < 256);
/// Copied once a path vertex: it stays within a few cache lines.
const _: () = assert!(size_of::<Bsdf>() <= 320);
