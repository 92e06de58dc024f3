//! Affine maps in `f64` and what they do to meshes.

use crate::TriangleMesh;
#[cfg(feature = "mitsuba")]
use crate::builtin::turn;
#[cfg(feature = "mitsuba")]
use glam::Vec3;
use glam::{DAffine3, DMat3, DVec3};

/// Moves a mesh by `map`, in `f64` with one rounding a coordinate. Normals move by the inverse
/// transpose; where `map` mirrors they are negated, so that they stay on the side that the winding
/// calls the front. `None` if `map` is singular or a vertex leaves the range of `f32`.
pub(crate) fn move_mesh(mesh: &mut TriangleMesh, map: &DAffine3) -> Option<()> {
    if *map == DAffine3::IDENTITY {
        return Some(());
    }
    let determinant = map.matrix3.determinant();
    if determinant == 0.0 || !determinant.is_finite() {
        return None;
    }
    for position in &mut mesh.positions {
        *position = map.transform_point3(position.as_dvec3()).as_vec3();
        if !position.is_finite() {
            return None;
        }
    }
    let cofactors = normal_map(map);
    for normal in &mut mesh.normals {
        *normal = (cofactors * normal.as_dvec3()).try_normalize()?.as_vec3();
    }
    Some(())
}

/// Cofactor matrix `det(M) M⁻ᵀ`: maps normals, and turns them where `M` mirrors, as
/// `M a × M b` does.
pub(crate) fn normal_map(map: &DAffine3) -> DMat3 {
    let [a, b, c] = map.matrix3.to_cols_array_2d().map(DVec3::from_array);
    DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b))
}

/// Reverses the winding if the first triangle of `mesh` faces away from `front`.
#[cfg(feature = "mitsuba")]
pub(crate) fn face_towards(mesh: &mut TriangleMesh, front: Vec3) {
    if let Some(triangle) = mesh.indices.first() {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        if (b - a).cross(c - a).dot(front) < 0.0 {
            turn(mesh);
        }
    }
}

/// The nearest orthonormal axes by Gram–Schmidt, the third axis leading; `None` if `matrix` is
/// singular.
#[cfg(any(feature = "gltf", feature = "mitsuba", feature = "pbrt"))]
pub(crate) fn orthonormal(matrix: &DMat3) -> Option<DMat3> {
    let z = matrix.z_axis.try_normalize()?;
    let y = (matrix.y_axis - z * z.dot(matrix.y_axis)).try_normalize()?;
    let x = (matrix.x_axis - z * z.dot(matrix.x_axis) - y * y.dot(matrix.x_axis)).try_normalize()?;
    Some(DMat3::from_cols(x, y, z))
}

/// Camera or light frame looking from `origin` to `target`: columns left, up, forward, as Mitsuba's
/// `lookat`. `None` if the points coincide or `up` is parallel to the view.
pub(crate) fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Option<DAffine3> {
    let forward = (target - origin).try_normalize()?;
    let left = up.cross(forward).try_normalize()?;
    let map = DAffine3::from_mat3_translation(DMat3::from_cols(left, forward.cross(left), forward), origin);
    map.is_finite().then_some(map)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normals must stay at right angles to the surface and on its front, under maps that stretch,
    /// shear and mirror.
    #[test]
    fn normals_stay_normal_to_the_moved_surface() {
        let triangle = || TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::new(1.0, 0.2, 0.3), Vec3::new(-0.1, 1.0, 0.7)],
            indices: vec![[0, 1, 2]],
            ..TriangleMesh::default()
        };
        let front = |mesh: &TriangleMesh| {
            let [a, b, c] = [0, 1, 2].map(|i| mesh.positions[i]);
            (b - a).cross(c - a).normalize()
        };
        for rows in [
            [[2.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 3.0]],
            [[1.0, 0.8, 0.0], [0.0, 1.0, -0.4], [0.0, 0.0, 1.0]],
            [[-1.0, 0.3, 0.0], [0.2, 2.0, 0.1], [0.0, 0.5, 0.7]],
        ] {
            let map = DAffine3::from_mat3_translation(DMat3::from_cols_array_2d(&rows), DVec3::ONE);
            let mut mesh = triangle();
            mesh.normals = vec![front(&mesh); 3];
            move_mesh(&mut mesh, &map).expect("the map is regular");
            let expected = front(&mesh);
            for normal in &mesh.normals {
                assert!(
                    normal.abs_diff_eq(expected, 1e-6),
                    "{rows:?}: {normal} against {expected}"
                );
            }
        }
    }

    #[test]
    fn maps_that_flatten_or_overflow_are_refused() {
        let moved = |scale: DVec3| {
            let mut mesh = TriangleMesh {
                positions: vec![Vec3::ONE],
                ..TriangleMesh::default()
            };
            move_mesh(&mut mesh, &DAffine3::from_scale(scale))
        };
        assert_eq!(moved(DVec3::new(1.0, 2.0, 0.0)), None);
        assert_eq!(moved(DVec3::splat(1e39)), None);
        assert_eq!(moved(DVec3::splat(1e30)), Some(()));
    }
}
