//! Scattering at a vertex of a path: at a surface or in a medium, alone or in a mixture with a
//! guide.

use super::guide::{DirectionGuide, GuidedVertex, usable_share};
use crate::light_selection::{glossy_shading_point, shading_point};
use lightshed_lights::ShadingPoint;
use lightshed_sampling::{Density, DirectionDistribution, SolidAngle};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::volume::PhaseFunction;
use lightshed_scene::{Bsdf, EmitterSample, Medium, Ray, Rgb, Scene, SurfacePoint};

/// A point of a path that scatters light. Directions are unit vectors of the world and point away
/// from it.
pub(crate) trait Vertex {
    /// Whether a lobe is chosen before a direction.
    const HAS_LOBES: bool;

    fn position(&self) -> Vec3;
    /// In the form that the selection of emitters uses, with its gloss if that is asked for.
    fn shading_point(&self, with_gloss: bool) -> ShadingPoint;
    /// As a guide sees it, with what it reflects if that is asked for.
    fn guided(&self, with_reflection: bool) -> GuidedVertex;
    /// Whether there is a lobe that has a width.
    fn has_non_delta(&self) -> bool;
    /// Value and density of the lobes that have a width.
    fn evaluate(&self, direction: Vec3) -> Scattered;
    fn sample(&self, u_lobe: f32, u: [f32; 2]) -> Option<ScatteredDirection>;
    /// The segment that must be free for a sampled emitter to be visible.
    fn shadow_ray(&self, light: &EmitterSample) -> Ray;
    /// `w_e f |cos θ| L_e / p_e`, multiplied in the order of the vertex's kind.
    fn weighted(light: &EmitterLight) -> Rgb;
}

/// A sample of the emitters at a vertex.
pub(crate) struct EmitterLight {
    /// The segment that must be free.
    pub ray: Ray,
    /// Index of the emitter.
    pub emitter: u32,
    /// Towards the emitter, and the density with which it was sampled.
    pub sampled: (Vec3, Density<SolidAngle>),
    /// `f |cos θ|`.
    pub scattered: Rgb,
    /// `L_e / p_e`.
    pub weight: Rgb,
    /// `w_e`.
    pub mis: f32,
}

/// `f |cos θ|` towards a direction, in a medium `p(ω → ω′)`, and the density of sampling it.
#[derive(Clone, Copy)]
pub(crate) struct Scattered {
    pub value: Rgb,
    pub pdf: Density<SolidAngle>,
}

/// A sampled direction.
#[derive(Clone, Copy)]
pub(crate) struct ScatteredDirection {
    pub direction: Vec3,
    /// `f |cos θ| / p`.
    pub weight: Rgb,
    /// Over all lobes that have a width; infinite for a lobe without.
    pub pdf: Density<SolidAngle>,
    /// The same without a guide.
    pub own_pdf: Density<SolidAngle>,
    pub is_delta: bool,
    /// Relative index of refraction, see [`BsdfSample::eta`](lightshed_scene::BsdfSample::eta).
    pub eta: f32,
}

/// On a surface.
#[derive(Clone)]
pub(crate) struct SurfaceVertex {
    pub point: SurfacePoint,
    pub bsdf: Bsdf,
    /// Towards the previous vertex, in the shading frame.
    pub wo: Vec3,
    /// The same in the world.
    outgoing: Vec3,
}

impl SurfaceVertex {
    /// Where `ray` met a surface.
    #[inline(always)]
    pub fn new(scene: &Scene, ray: &Ray, point: SurfacePoint) -> Self {
        Self {
            bsdf: scene.bsdf(&point),
            wo: point.shading.to_local(-ray.direction),
            outgoing: -ray.direction,
            point,
        }
    }
}

impl Vertex for SurfaceVertex {
    const HAS_LOBES: bool = true;

    #[inline(always)]
    fn position(&self) -> Vec3 {
        self.point.position
    }

    #[inline(always)]
    fn shading_point(&self, with_gloss: bool) -> ShadingPoint {
        match with_gloss {
            true => glossy_shading_point(&self.point, &self.bsdf, self.wo),
            false => shading_point(&self.point, &self.bsdf, self.wo),
        }
    }

    #[inline(always)]
    fn guided(&self, with_reflection: bool) -> GuidedVertex {
        GuidedVertex {
            position: self.point.position,
            normal: Some(self.point.shading.normal),
            outgoing: self.outgoing,
            lit: with_reflection.then(|| self.shading_point(true)),
        }
    }

    #[inline(always)]
    fn has_non_delta(&self) -> bool {
        self.bsdf.has_non_delta()
    }

    #[inline(always)]
    fn evaluate(&self, direction: Vec3) -> Scattered {
        let scattered = self
            .bsdf
            .evaluate(self.wo, self.point.shading.to_local(direction));
        Scattered {
            value: scattered.value,
            pdf: scattered.pdf,
        }
    }

    #[inline(always)]
    fn sample(&self, u_lobe: f32, u: [f32; 2]) -> Option<ScatteredDirection> {
        let sample = self.bsdf.sample(self.wo, u_lobe, Vec2::from(u))?;
        Some(ScatteredDirection {
            direction: self.point.shading.to_world(sample.wi),
            weight: sample.weight,
            pdf: sample.pdf,
            own_pdf: sample.pdf,
            is_delta: sample.is_delta,
            eta: sample.eta,
        })
    }

    #[inline(always)]
    fn shadow_ray(&self, light: &EmitterSample) -> Ray {
        light.shadow_ray(&self.point)
    }

    #[inline(always)]
    fn weighted(light: &EmitterLight) -> Rgb {
        light.scattered * light.weight * light.mis
    }
}

/// A collision in a medium. The path's throughput already contains its albedo.
pub(crate) struct MediumVertex<'a> {
    pub medium: &'a Medium,
    pub position: Vec3,
    /// Unit direction of travel of the ray that came.
    pub incoming: Vec3,
}

impl Vertex for MediumVertex<'_> {
    const HAS_LOBES: bool = false;

    #[inline(always)]
    fn position(&self) -> Vec3 {
        self.position
    }

    #[inline(always)]
    fn shading_point(&self, _with_gloss: bool) -> ShadingPoint {
        ShadingPoint::without_normal(self.position)
    }

    #[inline(always)]
    fn guided(&self, _with_reflection: bool) -> GuidedVertex {
        GuidedVertex {
            position: self.position,
            normal: None,
            outgoing: -self.incoming,
            lit: None,
        }
    }

    #[inline(always)]
    fn has_non_delta(&self) -> bool {
        true
    }

    #[inline(always)]
    fn evaluate(&self, direction: Vec3) -> Scattered {
        let scattered = self.medium.phase().phase_between(self.incoming, direction);
        Scattered {
            value: Rgb::splat(scattered),
            pdf: Density::new(scattered),
        }
    }

    #[inline(always)]
    fn sample(&self, _u_lobe: f32, u: [f32; 2]) -> Option<ScatteredDirection> {
        let sample = self.medium.phase().sample(self.incoming, u);
        Some(ScatteredDirection {
            direction: sample.direction,
            weight: Rgb::ONE,
            pdf: sample.pdf,
            own_pdf: sample.pdf,
            is_delta: false,
            eta: 1.0,
        })
    }

    #[inline(always)]
    fn shadow_ray(&self, light: &EmitterSample) -> Ray {
        light.shadow_ray_from(self.position)
    }

    #[inline(always)]
    fn weighted(light: &EmitterLight) -> Rgb {
        light.weight * (light.scattered * light.mis)
    }
}

/// A vertex with its guide: the mixture `(1 − α) p_s + α p_g` of [`DirectionGuide`].
pub(crate) struct Scattering<'v, V, D> {
    pub vertex: &'v V,
    guide: Option<(D, f32)>,
}

impl<'v, V: Vertex, D: DirectionDistribution> Scattering<'v, V, D> {
    #[inline(always)]
    pub fn new<'g, G: DirectionGuide<Distribution<'g> = D>>(vertex: &'v V, guide: &'g G) -> Self {
        if !G::IS_ACTIVE || cfg!(lightshed_without = "guide") || !vertex.has_non_delta() {
            return Self { vertex, guide: None };
        }
        let guide = guide.guide(&vertex.guided(guide.uses_reflection()));
        Self {
            vertex,
            guide: guide.and_then(|(directions, share)| Some((directions, usable_share(share)?))),
        }
    }

    /// Whether directions come from a guide, too.
    #[inline(always)]
    pub fn is_guided(&self) -> bool {
        self.guide.is_some()
    }

    /// Density of the mixture if that of the BSDF or phase function is `pdf`.
    #[inline(always)]
    fn mixed(&self, direction: Vec3, pdf: Density<SolidAngle>) -> Density<SolidAngle> {
        match &self.guide {
            Some((directions, share)) => {
                Density::new(pdf.value() * (1.0 - share) + directions.pdf(direction).value() * share)
            }
            None => pdf,
        }
    }

    /// What scatters, and the density of the mixture.
    #[inline(always)]
    pub fn evaluate(&self, direction: Vec3) -> Scattered {
        let scattered = self.vertex.evaluate(direction);
        Scattered {
            pdf: self.mixed(direction, scattered.pdf),
            ..scattered
        }
    }

    /// A direction by the mixture. `u_lobe` selects its part, and the rest of it the lobe.
    #[inline(always)]
    pub fn sample(&self, u_lobe: f32, u: [f32; 2]) -> Option<ScatteredDirection> {
        match &self.guide {
            Some((directions, share)) => self.sample_mixture(directions, *share, u_lobe, u),
            None => self.vertex.sample(u_lobe, u),
        }
    }

    fn sample_mixture(
        &self,
        directions: &D,
        share: f32,
        u_lobe: f32,
        u: [f32; 2],
    ) -> Option<ScatteredDirection> {
        if u_lobe < share {
            // The density that comes with a sample is that of its direction.
            let (direction, guided) = directions.sample(u)?;
            let scattered = self.vertex.evaluate(direction);
            let (value, own) = (scattered.value, scattered.pdf.value() * (1.0 - share));
            let pdf = Density::<SolidAngle>::new(own + guided.value() * share);
            let weight = value / pdf.value();
            return (pdf.is_positive() && weight.is_finite()).then_some(ScatteredDirection {
                direction,
                weight,
                pdf,
                own_pdf: scattered.pdf,
                is_delta: false,
                eta: 1.0,
            });
        }
        let own = 1.0 - share;
        let u_lobe = ((u_lobe - share) / own).min(1.0 - f32::EPSILON);
        let sample = self.vertex.sample(u_lobe, u)?;
        if sample.is_delta {
            return Some(ScatteredDirection {
                weight: sample.weight / own,
                ..sample
            });
        }
        let pdf = self.mixed(sample.direction, sample.pdf);
        Some(ScatteredDirection {
            weight: sample.weight * (sample.pdf.value() / pdf.value()),
            pdf,
            ..sample
        })
    }
}
