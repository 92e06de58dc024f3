//! How the lamps of a description light what the camera sees.
//!
//! Nothing is hidden by anything here: an estimate to tell a lit scene from a dark one and
//! photometric figures from others.

use crate::import::look::patches;
use crate::{EmitterDescription, SceneDescription, luminance};
use glam::DVec3;

/// How the lamps light what the camera sees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Lighting {
    /// The share of the image's surfaces that lamps light, shadows left aside; of surfaces that do
    /// not emit themselves. 0 where there are none.
    pub lit: f64,
    /// The median irradiance of those that are lit.
    pub irradiance: f64,
}

/// Irradiance below which a surface counts as dark: a white one sends one fiftieth.
const DARK: f64 = 0.02 * std::f64::consts::PI;

/// Most pairs of a surface and a lamp that are looked at.
const MOST_PAIRS: usize = 4_000_000;

/// How the points, spots and directions among the emitters light what the camera sees.
pub(super) fn lighting(scene: &SceneDescription) -> Lighting {
    let camera = &scene.camera;
    let to_camera = camera.to_world.inverse();
    let origin = camera.to_world.translation.as_dvec3();
    let half_x = (0.5 * f64::from(camera.fov_x)).tan();
    let half_y = half_x * f64::from(scene.settings.height) / f64::from(scene.settings.width).max(1.0);
    let (mut total, mut lit) = (0.0, Vec::new());
    let patches = patches(scene);
    let step = patches
        .len()
        .saturating_mul(scene.emitters.len())
        .div_ceil(MOST_PAIRS)
        .max(1);
    for patch in patches.iter().step_by(step) {
        if scene.shapes[patch.shape].emission.is_some() {
            continue;
        }
        let local = to_camera.transform_point3(patch.position.as_vec3()).as_dvec3();
        let in_view = local.z > 0.0 && local.x.abs() <= half_x * local.z && local.y.abs() <= half_y * local.z;
        let to_eye = origin - patch.position;
        let cos = patch.normal.dot(to_eye.normalize_or_zero());
        if !in_view || (cos <= 0.0 && !patch.two_sided) {
            continue;
        }
        let normal = if cos < 0.0 { -patch.normal } else { patch.normal };
        let share = patch.area * cos.abs() / to_eye.length_squared().max(1e-12);
        let irradiance: f64 = (scene.emitters.iter())
            .map(|emitter| irradiance(emitter, patch.position, normal))
            .sum();
        if !(share > 0.0 && share.is_finite()) {
            continue;
        }
        total += share;
        if irradiance > DARK {
            lit.push((irradiance, share));
        }
    }
    lit.sort_by(|a, b| a.0.total_cmp(&b.0));
    let seen: f64 = lit.iter().map(|(_, share)| share).sum();
    let mut below = 0.0;
    let median = lit.iter().find(|(_, share)| {
        below += share;
        below >= 0.5 * seen
    });
    Lighting {
        lit: if total > 0.0 { seen / total } else { 0.0 },
        irradiance: median.map_or(0.0, |(irradiance, _)| *irradiance),
    }
}

/// Irradiance by a point, spot or direction without shadows.
fn irradiance(emitter: &EmitterDescription, position: DVec3, normal: DVec3) -> f64 {
    let from = |lamp: DVec3, intensity: f64, share: &dyn Fn(DVec3) -> f64| {
        let away = lamp - position;
        let squared = away.length_squared();
        let direction = away.normalize_or_zero();
        if squared > 0.0 {
            intensity * share(-direction) * normal.dot(direction).max(0.0) / squared
        } else {
            0.0
        }
    };
    match emitter {
        EmitterDescription::Point {
            position: lamp,
            intensity,
        } => from(lamp.as_dvec3(), f64::from(luminance(*intensity)), &|_| 1.0),
        EmitterDescription::Spot {
            position: lamp,
            direction,
            intensity,
            beam_width,
            cutoff_angle,
        } => from(lamp.as_dvec3(), f64::from(luminance(*intensity)), &|along| {
            let angle = direction.as_dvec3().dot(along).clamp(-1.0, 1.0).acos();
            let (inner, outer) = (f64::from(*beam_width), f64::from(*cutoff_angle));
            ((outer - angle) / (outer - inner).max(1e-9)).clamp(0.0, 1.0)
        }),
        EmitterDescription::Directional {
            direction,
            irradiance,
        } => f64::from(luminance(*irradiance)) * normal.dot(-direction.as_dvec3()).max(0.0),
        EmitterDescription::Constant { .. } | EmitterDescription::Environment(_) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ColorTexture, Geometry, Material, Rgb, ShapeDescription, builtin};
    use glam::Vec3;

    /// Two squares of a floor seen from far above, one under a lamp of 10 W/sr at height 2, the
    /// other far away from it.
    #[test]
    fn half_a_floor_is_lit() {
        let square = |x: f32| ShapeDescription {
            name: String::new(),
            geometry: Geometry::Mesh(builtin::quad(
                [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]].map(|[u, v]| Vec3::new(x + u, 0.0, v)),
            )),
            material: 0,
            emission: None,
        };
        let mut scene = SceneDescription {
            shapes: vec![square(0.0), square(100.0)],
            materials: vec![Material::Diffuse {
                reflectance: ColorTexture::Constant(Rgb::splat(0.5)),
            }],
            emitters: vec![EmitterDescription::Point {
                position: Vec3::new(0.5, 2.0, 0.5),
                intensity: Rgb::splat(10.0),
            }],
            ..SceneDescription::default()
        };
        scene.camera.to_world = glam::Affine3A::from_translation(Vec3::new(50.0, 400.0, 0.0))
            * glam::Affine3A::from_rotation_x(std::f32::consts::FRAC_PI_2);
        let found = lighting(&scene);
        assert!((found.lit - 0.5).abs() < 0.02, "{found:?}");
        // 10/4 on the axis, a little less beside it.
        assert!(found.irradiance > 2.2 && found.irradiance <= 2.5, "{found:?}");
        scene.emitters.clear();
        assert_eq!(lighting(&scene), Lighting::default());
        // Surfaces that emit are no measure of it.
        scene.shapes[1].emission = Some(Rgb::ONE);
        scene.emitters.push(EmitterDescription::Directional {
            direction: Vec3::NEG_Y,
            irradiance: Rgb::splat(3.0),
        });
        let found = lighting(&scene);
        assert!(
            found.lit == 1.0 && (found.irradiance - 3.0).abs() < 1e-6,
            "{found:?}"
        );
    }
}
