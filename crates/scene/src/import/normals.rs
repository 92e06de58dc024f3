//! Vertex normals: computed where a file has none, mended where one has no direction.

use crate::TriangleMesh;
use glam::Vec3;

/// Unit vertex normals, each the mean of its triangles' normals weighted by their angles at the
/// vertex (Thürmer and Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets"). A vertex
/// of degenerate triangles only, or of none, gets +Z.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The corner of a cube at the origin, where one face is split in two triangles and the others
    /// are not. Weights of angles do not see the split; equal weights would lean towards the split
    /// face.
    fn cube_corner() -> TriangleMesh {
        TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(1.0, 1.0, 0.0)],
            indices: vec![[0, 2, 3], [0, 3, 1], [0, 1, 4], [0, 4, 2]],
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn a_split_face_weighs_no_more_than_a_whole_one() {
        let mesh = cube_corner();
        let normals = angle_weighted_normals(&mesh.positions, &mesh.indices);
        let diagonal = Vec3::ONE.normalize();
        assert!(normals[0].abs_diff_eq(diagonal, 1e-6), "{}", normals[0]);
        assert_eq!(normals[4], Vec3::Z);
    }

    #[test]
    fn vertices_of_no_triangle_or_of_slivers_only_have_a_normal() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0, Vec3::Y];
        assert_eq!(
            angle_weighted_normals(&positions, &[[0, 1, 2], [3, 3, 3]]),
            [Vec3::Z; 4]
        );
    }

    #[test]
    fn only_normals_of_no_length_are_computed() {
        let mut mesh = cube_corner();
        mesh.normals = vec![Vec3::ZERO, Vec3::X * 3.0, Vec3::Y, Vec3::NEG_Z, Vec3::Z * 1e-30];
        mend_normals(&mut mesh);
        assert!(mesh.normals[0].abs_diff_eq(Vec3::ONE.normalize(), 1e-6));
        assert_eq!(mesh.normals[1..], [Vec3::X, Vec3::Y, Vec3::NEG_Z, Vec3::Z]);
    }
}
