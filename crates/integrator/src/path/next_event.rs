//! The two ways to find the emitter at the end of a path, weighted against each other.
//!
//! At a surface point `x` seen from `ω_o`, the direct part of the reflected radiance is
//! `L = ∫ f(ω_o, ω) L_e(x, ω) |cos θ| dω`, in the solid-angle measure. `n` samples of the emitters with density `p_e` and
//! `m` of the BSDF with density `p_b` are combined with the power heuristic
//! `w_e = (n p_e)² / ((n p_e)² + (m p_b)²)`, `w_b = 1 − w_e` (Veach 1997 §9.2.2, eq. 9.8, and §9.2.4, eq. 9.10).
//! Where only one of them can find an emitter its weight is 1.

use lightshed_sampling::{CounterRng, Density, SolidAngle, power_heuristic};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Bsdf, Ray, Rgb, Scene, SurfacePoint};

/// Numbers `n` of emitter samples and `m` of BSDF samples at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SampleCounts {
    pub emitter: f32,
    pub bsdf: f32,
}

impl SampleCounts {
    /// One of each: what a path takes.
    pub const ONE_EACH: Self = Self {
        emitter: 1.0,
        bsdf: 1.0,
    };
}

/// How a ray left its surface.
#[derive(Clone, Copy)]
pub(crate) struct Bounce {
    /// The point that it left.
    pub from: Vec3,
    /// Density of its direction over all non-delta lobes.
    pub pdf: Density<SolidAngle>,
    /// Whether it left by a lobe for which no emitter sample counts.
    pub is_delta: bool,
    pub counts: SampleCounts,
}

impl Bounce {
    /// MIS weight of having met an emitter that emitter sampling finds with density `other`.
    #[inline(always)]
    fn weight_against(&self, other: impl FnOnce() -> Density<SolidAngle>) -> f32 {
        if !cfg!(lightshed_without = "specular") && self.is_delta {
            1.0
        } else {
            power_heuristic(self.pdf * self.counts.bsdf, other() * self.counts.emitter)
        }
    }
}

/// Emitted radiance that `ray` meets at `point` (at infinity if that is `None`), times the MIS weight of having found it
/// by `bounce`; `None` for a ray from the camera, of weight 1.
#[inline(always)]
pub(crate) fn met_emission(
    scene: &Scene,
    ray: &Ray,
    point: Option<&SurfacePoint>,
    bounce: Option<Bounce>,
) -> Rgb {
    let emitted = emitted_towards(scene, ray, point);
    match bounce {
        Some(bounce) if emitted != Rgb::ZERO => {
            emitted * bounce.weight_against(|| emitter_pdf(scene, ray, point, bounce.from))
        }
        _ => emitted,
    }
}

/// Emitted radiance that `ray` meets, and the density with which emitter sampling at `from` finds its direction; `None` if
/// nothing is emitted.
pub(crate) fn emitted_radiance(
    scene: &Scene,
    ray: &Ray,
    point: Option<&SurfacePoint>,
    from: Vec3,
) -> Option<(Rgb, Density<SolidAngle>)> {
    let emitted = emitted_towards(scene, ray, point);
    (emitted != Rgb::ZERO).then(|| (emitted, emitter_pdf(scene, ray, point, from)))
}

#[inline(always)]
fn emitted_towards(scene: &Scene, ray: &Ray, point: Option<&SurfacePoint>) -> Rgb {
    let emitters = scene.emitters();
    match (point, emitters.environment()) {
        (Some(point), _) if point.emitter == SurfacePoint::NO_EMITTER => Rgb::ZERO,
        (Some(point), _) => emitters.radiance(point, ray.direction),
        (None, Some(environment)) => environment.radiance(ray.direction),
        (None, None) => Rgb::ZERO,
    }
}

#[inline(always)]
fn emitter_pdf(scene: &Scene, ray: &Ray, point: Option<&SurfacePoint>, from: Vec3) -> Density<SolidAngle> {
    match point {
        Some(point) => scene.emitters().pdf(from, point),
        None => scene.emitters().pdf_environment(ray.direction),
    }
}

/// Light on its way from an emitter to a point and on, if nothing is in between.
pub(crate) struct Shadow {
    /// The segment that must be free.
    pub ray: Ray,
    /// What then arrives.
    pub radiance: Rgb,
}

/// [`emission_sample`] with the next numbers of `rng`: five, whether or not they are used, so that dimensions keep their
/// meaning along a path.
#[inline(always)]
pub(crate) fn sample_emission(
    scene: &Scene,
    point: &SurfacePoint,
    bsdf: &Bsdf,
    wo: Vec3,
    counts: SampleCounts,
    rng: &mut CounterRng,
) -> Option<Shadow> {
    let numbers = (rng.next_u64(), rng.next_2d());
    emission_sample(scene, point, bsdf, wo, counts, numbers)
}

/// One sample of the light that reaches `point` from the emitters and leaves it towards `wo` (in the shading frame):
/// `w_e f |cos θ| L_e / p_e`, to be averaged over the `counts.emitter` samples. `u_select` chooses the emitter, `u` the
/// direction. `None` is a sample of value zero, for which no
/// ray need be traced.
#[inline(always)]
pub(crate) fn emission_sample(
    scene: &Scene,
    point: &SurfacePoint,
    bsdf: &Bsdf,
    wo: Vec3,
    counts: SampleCounts,
    (u_select, u): (u64, [f32; 2]),
) -> Option<Shadow> {
    if !bsdf.has_non_delta() {
        return None;
    }
    let light = scene.emitters().sample(point.position, u_select, u)?;
    let scattered = bsdf.evaluate(wo, point.shading.to_local(light.direction));
    if scattered.value == Rgb::ZERO {
        return None;
    }
    let weight = if light.is_delta {
        1.0
    } else {
        power_heuristic(light.pdf * counts.emitter, scattered.pdf * counts.bsdf)
    };
    Some(Shadow {
        ray: light.shadow_ray(point),
        radiance: scattered.value * light.weight * weight,
    })
}
