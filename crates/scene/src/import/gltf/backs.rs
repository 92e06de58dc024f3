//! Which meshes show their back.

use crate::builtin::signed_volume;
use crate::{Material, TriangleMesh};
use std::collections::HashMap;

/// Largest mesh that is looked at; larger ones are taken as closed.
const MOST_TRIANGLES: usize = 1_000_000;

/// Whether the back of a mesh can be seen from outside of it: it has an edge that not as many
/// triangles run along one way as the other, or it is turned inside out. Vertices at the same place
/// are one.
pub(super) fn shows_back(mesh: &TriangleMesh) -> bool {
    if mesh.indices.len() > MOST_TRIANGLES {
        return false;
    }
    let mut places = HashMap::with_capacity(mesh.positions.len());
    let of_vertex: Vec<u32> = (mesh.positions.iter())
        .map(|position| {
            // Zeros of both signs are the same place.
            let key = position.to_array().map(|x| (x + 0.0).to_bits());
            let next = places.len() as u32;
            *places.entry(key).or_insert(next)
        })
        .collect();
    let mut edges = HashMap::new();
    for triangle in &mesh.indices {
        let places = triangle.map(|i| of_vertex[i as usize]);
        for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (places[a], places[b])) {
            if a != b {
                *edges.entry((a.min(b), a.max(b))).or_insert(0_i32) += if a < b { 1 } else { -1 };
            }
        }
    }
    edges.values().any(|&sum| sum != 0) || signed_volume(mesh) < 0.0
}

/// The material that lets light pass unchanged from behind; `None` where it has two sides already.
pub(super) fn culled(material: &Material) -> Option<Material> {
    Some(match material {
        Material::Relief { relief, base } => Material::Relief {
            relief: relief.clone(),
            base: Box::new(culled(base)?),
        },
        Material::Blend {
            weight,
            first,
            second,
        } if matches!(**first, Material::Null) => Material::Blend {
            weight: weight.clone(),
            first: Box::new(Material::Null),
            second: Box::new(culled(second)?),
        },
        Material::MetallicRoughness { transmission, .. }
            if !matches!(transmission, crate::FloatTexture::Constant(0.0)) =>
        {
            return None;
        }
        Material::MetallicRoughness { .. } | Material::Layered { .. } | Material::Diffuse { .. } => {
            Material::TwoSided {
                front: Box::new(material.clone()),
                back: Some(Box::new(Material::Null)),
            }
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::{self, turn};
    use glam::{Affine3A, Vec3};

    #[test]
    fn open_and_inverted_meshes_show_their_back() {
        let mut mesh = builtin::cuboid(Affine3A::IDENTITY);
        assert!(!shows_back(&mesh));
        turn(&mut mesh);
        assert!(shows_back(&mesh));
        turn(&mut mesh);
        let lost = mesh.indices.pop();
        assert!(lost.is_some() && shows_back(&mesh));
        let square = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        assert!(shows_back(&builtin::quad(square)));
        // A sheet of two sides is closed.
        let mut sheet = builtin::quad(square);
        sheet.indices.extend([[0, 2, 1], [0, 3, 2]]);
        assert!(!shows_back(&sheet));
    }
}
