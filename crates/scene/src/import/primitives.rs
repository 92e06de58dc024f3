//! Mitsuba's analytic shapes as meshes in their own space, before `to_world`.

use crate::TriangleMesh;
#[cfg(feature = "mitsuba")]
use crate::builtin::quad;
#[cfg(feature = "mitsuba")]
use glam::{DAffine3, DMat3, DVec3};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// The square `[−1, 1]²` at z = 0, normal +Z. In Mitsuba's texture space `(0, 0)` is at (−1,
/// −1); `v` here points upwards, so it is turned over.
#[cfg(feature = "mitsuba")]
pub(crate) fn rectangle() -> TriangleMesh {
    let mut mesh = quad([
        Vec3::new(-1.0, -1.0, 0.0),
        Vec3::new(1.0, -1.0, 0.0),
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(-1.0, 1.0, 0.0),
    ]);
    for uv in &mut mesh.uvs {
        uv.y = 1.0 - uv.y;
    }
    mesh
}

/// The cube `[−1, 1]³`, normals outwards, each face with the whole unit square of texture
/// coordinates.
#[cfg(feature = "mitsuba")]
pub(crate) fn cube() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            // u × v = normal
            let mut frame = [
                Vec3::AXES[axis] * sign,
                Vec3::AXES[(axis + 1) % 3],
                Vec3::AXES[(axis + 2) % 3],
            ];
            if sign < 0.0 {
                frame.swap(1, 2);
            }
            let [n, u, v] = frame;
            let face = quad([n - u - v, n + u - v, n + u + v, n - u + v]);
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(face.positions);
            mesh.uvs.extend(face.uvs);
            let indices = face.indices.iter().map(|triangle| triangle.map(|i| first + i));
            mesh.indices.extend(indices);
        }
    }
    mesh
}

/// Triangles of [`disk`].
pub(crate) const DISK_TRIANGLES: u32 = 128;

/// The unit disk at z = 0, normal +Z, as a fan of 128 triangles of the *same area* as the disk: its
/// rim runs between radius 0.9998 and 1.0001. Texture coordinates are Mitsuba's, `(r, φ/2π)`,
/// with the second turned over.
pub(crate) fn disk() -> TriangleMesh {
    let step = 2.0 * PI / DISK_TRIANGLES as f32;
    // n/2 · sin(2π/n) r² = π
    let radius = (step / step.sin()).sqrt();
    let mut mesh = TriangleMesh::default();
    for i in 0..=DISK_TRIANGLES {
        // The same bits at both ends of the seam.
        let (sin, cos) = (step * (i % DISK_TRIANGLES) as f32).sin_cos();
        mesh.positions.push(Vec3::new(radius * cos, radius * sin, 0.0));
        mesh.uvs
            .push(Vec2::new(1.0, 1.0 - i as f32 / DISK_TRIANGLES as f32));
    }
    for i in 0..DISK_TRIANGLES {
        let center = mesh.positions.len() as u32;
        mesh.positions.push(Vec3::ZERO);
        mesh.uvs
            .push(Vec2::new(0.0, 1.0 - (i as f32 + 0.5) / DISK_TRIANGLES as f32));
        mesh.indices.push([center, i, i + 1]);
    }
    mesh
}

/// The open cylinder of radius 1 around +Z from 0 to 1 with smooth normals, of 128 sides of the
/// *same area* as the cylinder.
pub(crate) fn cylinder() -> TriangleMesh {
    let step = 2.0 * PI / DISK_TRIANGLES as f32;
    // Half a side over its angle.
    let radius = 0.5 * step / (0.5 * step).sin();
    let mut mesh = TriangleMesh::default();
    for i in 0..=DISK_TRIANGLES {
        let (sin, cos) = (step * (i % DISK_TRIANGLES) as f32).sin_cos();
        for z in [0.0, 1.0] {
            mesh.positions.push(Vec3::new(radius * cos, radius * sin, z));
            mesh.normals.push(Vec3::new(cos, sin, 0.0));
            mesh.uvs
                .push(Vec2::new(i as f32 / DISK_TRIANGLES as f32, 1.0 - z));
        }
    }
    for i in 0..DISK_TRIANGLES {
        let [a, b, c, d] = [2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3];
        mesh.indices.extend([[a, c, d], [a, d, b]]);
    }
    mesh
}

/// Steps of [`sphere`] from pole to pole; twice as many around.
const SPHERE_STEPS: u32 = 64;

/// The unit sphere with smooth normals and Mitsuba's texture coordinates `(φ/2π, θ/π)`, the
/// second turned over. Its vertices are on the sphere.
pub(crate) fn sphere() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let around = 2 * SPHERE_STEPS;
    for i in 0..=SPHERE_STEPS {
        let (sin_theta, cos_theta) = (PI * i as f32 / SPHERE_STEPS as f32).sin_cos();
        let sin_theta = if i == SPHERE_STEPS { 0.0 } else { sin_theta };
        for j in 0..=around {
            let (sin_phi, cos_phi) = (2.0 * PI * (j % around) as f32 / around as f32).sin_cos();
            let direction = Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta);
            mesh.positions.push(direction);
            mesh.normals.push(direction);
            mesh.uvs.push(Vec2::new(
                j as f32 / around as f32,
                1.0 - i as f32 / SPHERE_STEPS as f32,
            ));
        }
    }
    for i in 0..SPHERE_STEPS {
        for j in 0..around {
            let upper = i * (around + 1) + j;
            let lower = upper + around + 1;
            // At the poles one of the two has no area.
            if i > 0 {
                mesh.indices.push([upper, lower, upper + 1]);
            }
            if i + 1 < SPHERE_STEPS {
                mesh.indices.push([lower, lower + 1, upper + 1]);
            }
        }
    }
    mesh
}

/// From the unit cylinder to one from `p0` to `p1`; `None` if they coincide.
#[cfg(feature = "mitsuba")]
pub(crate) fn along(p0: DVec3, p1: DVec3, radius: f64) -> Option<DAffine3> {
    let axis = p1 - p0;
    let direction = axis.try_normalize()?;
    let (x, y) = direction.any_orthonormal_pair();
    let axes = DMat3::from_cols(x * radius, y * radius, axis);
    Some(DAffine3::from_mat3_translation(axes, p0))
}
