//! Lobes whose directions come from a guide, too.

use crate::guided::{FieldDirections, SceneField};
use crate::path::guide::{DirectionGuide, GuidedVertex, usable_share};
use lightshed_sampling::Frame;
use lightshed_sampling::{Density, DirectionDistribution};
use lightshed_scene::Bsdf;
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_shift::{LobeDirection, Scattering};

/// Lobes of at least this width, as GGX's `α`, are guided. Nearly all that a narrower lobe scatters
/// has the directions that it samples itself.
const GUIDED_ROUGHNESS: f32 = 0.2;

/// The lobes of a vertex with a guide `g` of share `α`.
///
/// A lobe `l` is chosen with the probability `P(l | ω_o)` that it has without a guide. Its
/// direction has the density `(1 − α_l) p_l(ω) + α_l p_g(ω)`, with `α_l = α` for wide lobes and 0
/// for others. So the density of a lobe, joint with its choice, is
///
/// > `P(l) ((1 − α_l) p_l(ω) + α_l p_g(ω))`
///
/// per steradian, its value stays `f_l |cos θ|`, and the lobes' densities add up to that of the
/// whole vertex. Whoever asks for lobes (walks, shifts and their Jacobians, weights of emitters)
/// sees this density and needs to know nothing of guides.
pub(crate) struct GuidedLobes<'v, 'g> {
    bsdf: &'v Bsdf,
    frame: &'v Frame,
    /// Towards the viewer, in the shading frame.
    wo: Vec3,
    directions: FieldDirections<'g>,
    share: f32,
}

impl<'v, 'g> GuidedLobes<'v, 'g> {
    /// At a vertex that is seen from the unit direction `outgoing`; `None` where nothing is guided.
    #[cold]
    #[inline(never)]
    pub fn at(
        field: &'g SceneField,
        (position, bsdf, frame): (Vec3, &'v Bsdf, &'v Frame),
        outgoing: Vec3,
    ) -> Option<Self> {
        if !(0..bsdf.lobe_count()).any(|lobe| is_wide(bsdf, lobe)) {
            return None;
        }
        let (directions, share) = field.guide(&GuidedVertex {
            position,
            normal: Some(frame.normal),
            outgoing,
            lit: None,
        })?;
        Some(Self {
            bsdf,
            frame,
            wo: frame.to_local(outgoing),
            directions,
            share: usable_share(share)?,
        })
    }

    /// One lobe towards `wi`, where the guide has the density `guided`.
    #[inline]
    fn lobe(&self, wi: Vec3, guided: Density<lightshed_sampling::SolidAngle>, lobe: u8) -> Scattering {
        let own = self.bsdf.evaluate_lobe(lobe, self.wo, wi);
        let pdf = match is_wide(self.bsdf, lobe) {
            true => {
                let guided = guided.value() * self.bsdf.lobe_probability(lobe, self.wo);
                Density::new(own.pdf.value() * (1.0 - self.share) + guided * self.share)
            }
            false => own.pdf,
        };
        Scattering {
            value: own.value,
            pdf,
        }
    }

    /// All lobes that have a width.
    #[inline]
    fn all(&self, wi: Vec3, guided: Density<lightshed_sampling::SolidAngle>) -> Scattering {
        let mut sum = Scattering::ZERO;
        for lobe in 0..self.bsdf.lobe_count() {
            let one = self.lobe(wi, guided, lobe);
            sum.value += one.value;
            sum.pdf = sum.pdf + one.pdf;
        }
        sum
    }

    /// One lobe towards a direction of the world.
    #[inline(never)]
    pub fn evaluate_lobe(&self, wi: Vec3, lobe: u8) -> Scattering {
        let guided = match is_wide(self.bsdf, lobe) {
            true => self.directions.pdf(wi),
            false => Density::ZERO,
        };
        self.lobe(self.frame.to_local(wi), guided, lobe)
    }

    /// All lobes towards a direction of the world.
    #[inline(never)]
    pub fn evaluate(&self, wi: Vec3) -> Scattering {
        self.all(self.frame.to_local(wi), self.directions.pdf(wi))
    }

    /// A lobe by `u_lobe`, and a direction of it or of the guide by `u`.
    #[inline(never)]
    pub fn sample(&self, u_lobe: f32, [u, v]: [f32; 2]) -> Option<LobeDirection> {
        let lobe = self.choose(u_lobe)?;
        let share = if is_wide(self.bsdf, lobe) { self.share } else { 0.0 };
        let (wi, guided) = if u < share {
            self.directions.sample([(u / share).min(BELOW_ONE), v])?
        } else {
            let u = ((u - share) / (1.0 - share)).min(BELOW_ONE);
            let sample = self.bsdf.sample_lobe(lobe, self.wo, Vec2::new(u, v))?;
            let wi = self.frame.to_world(sample.wi);
            if sample.is_delta {
                return Some(LobeDirection {
                    wi,
                    lobe,
                    // Only the ratio of the radiance share and the probability matters.
                    scattering: Scattering {
                        value: sample.value / sample.probability,
                        pdf: Density::new(1.0),
                    },
                    total_pdf: sample.pdf,
                    is_delta: true,
                });
            }
            (wi, self.directions.pdf(wi))
        };
        let local = self.frame.to_local(wi);
        let scattering = self.lobe(local, guided, lobe);
        Some(LobeDirection {
            wi,
            lobe,
            scattering,
            total_pdf: match self.bsdf.lobe_count() {
                1 => scattering.pdf,
                _ => self.all(local, guided).pdf,
            },
            is_delta: false,
        })
        .filter(|sampled| sampled.scattering.pdf.is_positive())
    }

    /// The lobe in whose interval of cumulative probability `u_lobe` lies; the last possible one
    /// takes what rounding leaves.
    fn choose(&self, u_lobe: f32) -> Option<u8> {
        let (mut chosen, mut cumulative) = (None, 0.0);
        for lobe in 0..self.bsdf.lobe_count() {
            let probability = self.bsdf.lobe_probability(lobe, self.wo);
            if probability > 0.0 {
                cumulative += probability;
                chosen = Some(lobe);
                if u_lobe < cumulative {
                    break;
                }
            }
        }
        chosen
    }
}

/// The largest number below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Whether a lobe is guided.
#[inline(always)]
fn is_wide(bsdf: &Bsdf, lobe: u8) -> bool {
    bsdf.lobe_roughness(lobe) >= GUIDED_ROUGHNESS
}
