//! Surface points as light samplers use them.

use lightshed_lights::{Facing, Gloss, ShadingPoint};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{Bsdf, Rgb, SurfacePoint, luminance};
use std::f32::consts::FRAC_1_PI;

/// A surface point with this BSDF, seen from the unit direction `wo` (in the shading frame), as
/// light samplers use it.
#[inline]
pub fn shading_point(point: &SurfacePoint, bsdf: &Bsdf, wo: Vec3) -> ShadingPoint {
    let facing = if bsdf.scatters_through() {
        Facing::Both
    } else {
        Facing::Front
    };
    let side = if wo.z < 0.0 { -Vec3::Z } else { Vec3::Z };
    ShadingPoint {
        position: point.position,
        normal: point.shading.to_world(side),
        facing,
        // Only for a diffuse surface this is a bound; for others only its existence is known.
        reflectance_bound: match bsdf.is_diffuse() {
            true => luminance(bsdf.albedo_hint()) * FRAC_1_PI,
            false => f32::MAX,
        },
        gloss: Gloss::default(),
    }
}

/// [`shading_point`] with what the surface reflects besides its diffuse part, if all of it is on
/// the side of the viewer.
#[inline]
pub(crate) fn glossy_shading_point(point: &SurfacePoint, bsdf: &Bsdf, wo: Vec3) -> ShadingPoint {
    let at = shading_point(point, bsdf, wo);
    if bsdf.is_diffuse() || at.facing != Facing::Front {
        return at;
    }
    // The sampler's own shares stand for what the lobes reflect.
    let (mut glossy, mut all, mut roughness) = (0.0, 0.0, 0.0);
    for lobe in 0..bsdf.lobe_count() {
        let width = bsdf.lobe_roughness(lobe);
        if width > 0.0 {
            let share = bsdf.lobe_probability(lobe, wo);
            all += share;
            if width < 1.0 {
                glossy += share;
                roughness += share * width;
            }
        }
    }
    if !(glossy > 0.0) {
        return at;
    }
    ShadingPoint {
        gloss: Gloss {
            viewer: point.shading.to_world(wo),
            roughness: roughness / glossy,
            share: glossy / all,
        },
        ..at
    }
}

/// [`shading_point`] for any direction: light may come from both sides where it is scattered on
/// both.
#[inline]
pub(crate) fn unseen_shading_point(point: &SurfacePoint, bsdf: &Bsdf) -> ShadingPoint {
    ShadingPoint {
        facing: Facing::Both,
        ..shading_point(point, bsdf, Vec3::Z)
    }
}

/// [`shading_point`] of a diffuse surface, with the unit `normal` on the side of the viewer.
#[inline(always)]
pub(crate) fn diffuse_shading_point(position: Vec3, normal: Vec3, reflectance: Rgb) -> ShadingPoint {
    ShadingPoint {
        position,
        normal,
        facing: Facing::Front,
        reflectance_bound: luminance(reflectance) * FRAC_1_PI,
        gloss: Gloss::default(),
    }
}
