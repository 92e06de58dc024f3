//! Surfaces of a description as pieces, to choose a view of them.
//!
//! Triangles are taken one by one, without regard to what hides them: an estimate that costs
//! nothing beside reading a file.

use crate::{Geometry, Material, MeshInstances, SceneDescription};
use glam::{DVec3, Vec3};

/// Most triangles of a mesh that are looked at.
const MOST_PATCHES: usize = 4_000;

/// Most triangles of all meshes that are looked at, but for one of each.
const MOST_OF_ALL: usize = 200_000;

/// A piece of a surface. Only the search for lamps that glTF files lack asks where it is, and of
/// which shape.
#[cfg_attr(not(feature = "gltf"), expect(dead_code))]
pub(in crate::import) struct Patch {
    pub(in crate::import) position: DVec3,
    /// Unit length, on the front.
    pub(in crate::import) normal: DVec3,
    pub(in crate::import) area: f64,
    pub(in crate::import) two_sided: bool,
    /// Index of its shape.
    pub(in crate::import) shape: usize,
}

/// Pieces of all surfaces: of large meshes one triangle in so many, each for those around it.
pub(in crate::import) fn patches(scene: &SceneDescription) -> Vec<Patch> {
    let mut patches = Vec::new();
    let triangles = scene.shapes.iter().map(|shape| match &shape.geometry {
        Geometry::Mesh(mesh) => mesh.indices.len(),
        Geometry::Sphere(_) => 6,
        Geometry::Instances(instances) => instances
            .mesh
            .indices
            .len()
            .saturating_mul(instances.to_world.len()),
    });
    let step_of_all = triangles.sum::<usize>().div_ceil(MOST_OF_ALL);
    for (index, shape) in scene.shapes.iter().enumerate() {
        let material = scene.materials.get(shape.material as usize);
        let patch = |position, normal, area| Patch {
            position,
            normal,
            area,
            two_sided: material.is_some_and(is_two_sided),
            shape: index,
        };
        match &shape.geometry {
            Geometry::Sphere(sphere) => {
                let radius = f64::from(sphere.radius);
                let side = if sphere.flip_normals { -1.0 } else { 1.0 };
                let area = 4.0 * std::f64::consts::PI * radius * radius / 6.0;
                for axis in DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]) {
                    let position = sphere.center.as_dvec3() + radius * axis;
                    patches.push(patch(position, side * axis, area));
                }
            }
            Geometry::Mesh(mesh) => {
                let step = mesh.indices.len().div_ceil(MOST_PATCHES).max(step_of_all).max(1);
                for triangle in mesh.indices.iter().step_by(step) {
                    let corners = triangle.map(|i| mesh.positions.get(i as usize).copied());
                    let corners = corners.map(|corner| corner.map(|corner| corner.as_dvec3()));
                    if let Some((middle, normal, area)) = middle(corners) {
                        patches.push(patch(middle, normal, area * step as f64));
                    }
                }
            }
            Geometry::Instances(MeshInstances { mesh, to_world }) => {
                let count = mesh.indices.len();
                let all = count.saturating_mul(to_world.len());
                let step = all.div_ceil(MOST_PATCHES).max(step_of_all).max(1);
                for index in (0..all).step_by(step) {
                    let map = &to_world[index / count];
                    let corners = mesh.indices[index % count].map(|i| mesh.positions.get(i as usize));
                    let moved = |corner: &Vec3| map.transform_point3(*corner).as_dvec3();
                    if let Some((middle, normal, area)) = middle(corners.map(|corner| corner.map(moved))) {
                        patches.push(patch(middle, normal, area * step as f64));
                    }
                }
            }
        }
    }
    patches
}

/// Middle, unit normal and area of a triangle; `None` without a corner or area.
fn middle(corners: [Option<DVec3>; 3]) -> Option<(DVec3, DVec3, f64)> {
    let [a, b, c] = corners;
    let (a, b, c) = (a?, b?, c?);
    let double = (b - a).cross(c - a);
    Some(((a + b + c) / 3.0, double.try_normalize()?, 0.5 * double.length()))
}

fn is_two_sided(material: &Material) -> bool {
    match material {
        Material::TwoSided { back, .. } => !matches!(back.as_deref(), Some(Material::Null)),
        Material::Dielectric { .. } | Material::ThinDielectric { .. } => true,
        Material::Relief { base, .. } => is_two_sided(base),
        Material::Blend { first, second, .. } => is_two_sided(first) || is_two_sided(second),
        _ => false,
    }
}

/// The area of fronts that is seen along a direction from which all is looked at.
pub(in crate::import) fn front_area(patches: &[Patch], towards_viewer: DVec3) -> f64 {
    let seen = |patch: &Patch| {
        let cos = patch.normal.dot(towards_viewer);
        patch.area * if patch.two_sided { cos.abs() } else { cos.max(0.0) }
    };
    patches.iter().map(seen).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ColorTexture, Rgb, ShapeDescription, builtin};
    use glam::Vec3;

    /// A unit square is seen from its front alone, unless its back shows as much.
    #[test]
    fn fronts_are_seen_from_their_side() {
        let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
        let mut scene = SceneDescription {
            shapes: vec![ShapeDescription {
                name: String::new(),
                geometry: Geometry::Mesh(builtin::quad(corners)),
                material: 0,
                emission: None,
            }],
            materials: vec![Material::Diffuse {
                reflectance: ColorTexture::Constant(Rgb::splat(0.5)),
            }],
            ..SceneDescription::default()
        };
        let both = |scene: &SceneDescription| {
            let patches = patches(scene);
            [DVec3::Y, DVec3::NEG_Y].map(|view| front_area(&patches, view))
        };
        assert_eq!(both(&scene), [1.0, 0.0]);
        let two_sided = |back| Material::TwoSided {
            front: Box::new(Material::Mirror {
                reflectance: Rgb::ONE.into(),
            }),
            back,
        };
        scene.materials[0] = two_sided(Some(Box::new(Material::Null)));
        assert_eq!(both(&scene), [1.0, 0.0]);
        scene.materials[0] = two_sided(None);
        assert_eq!(both(&scene), [1.0, 1.0]);
    }
}
