//! Vertex normals: computed where a file has none, mended where one has no direction.

use crate::TriangleMesh;
use glam::Vec3;

/// Unit vertex normals, each the mean of its triangles' normals weighted by their angles at the vertex (Thürmer and
/// Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets"). A vertex of degenerate triangles only, or of none,
/// gets +Z.
pub(crate) fn angle_weighted_normals(positions: &[Vec3], indices: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for triangle in indices {
        let corners = triangle.map(|i| positions[i as usize]);
        let Some(normal) = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .try_normalize()
        else {
            continue;
        };
        for (k, &index) in triangle.iter().enumerate() {
            let to_next = (corners[(k + 1) % 3] - corners[k]).try_normalize();
            let to_last = (corners[(k + 2) % 3] - corners[k]).try_normalize();
            if let (Some(a), Some(b)) = (to_next, to_last) {
                // Kahan's form: exact for small angles, where `acos` of the dot product is not.
                let angle = 2.0 * (a - b).length().atan2((a + b).length());
                normals[index as usize] += normal * angle;
            }
        }
    }
    for normal in &mut normals {
        *normal = normal.try_normalize().unwrap_or(Vec3::Z);
    }
    normals
}

/// Brings vertex normals to unit length; those of no length are computed from the triangles around.
pub(crate) fn mend_normals(mesh: &mut TriangleMesh) {
    let mut lost = false;
    for normal in &mut mesh.normals {
        // Normals that are already unit to rounding keep their bits.
        if (normal.length_squared() - 1.0).abs() > 1e-6 {
            *normal = normal.try_normalize().unwrap_or(Vec3::ZERO);
            lost |= *normal == Vec3::ZERO;
        }
    }
    if lost {
        let computed = angle_weighted_normals(&mesh.positions, &mesh.indices);
        for (normal, computed) in mesh.normals.iter_mut().zip(computed) {
            if *normal == Vec3::ZERO {
                *normal = computed;
            }
        }
    }
}
