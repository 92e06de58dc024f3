//! Small meshes in world space, wound counter-clockwise seen from outside.

use crate::TriangleMesh;
use glam::{Affine3A, Vec2, Vec3};

/// A parallelogram or any planar convex quadrilateral, as two triangles `(0, 1, 2)` and
/// `(0, 2, 3)`; the geometric normal is along `(c₁ − c₀) × (c₂ − c₀)`. Texture
/// coordinates run over the unit square, `(0, 0)` at corner 0.
pub fn quad(corners: [Vec3; 4]) -> TriangleMesh {
    TriangleMesh {
        positions: corners.to_vec(),
        normals: Vec::new(),
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    }
}

/// The image of the cube `[−1, 1]³` under `to_world`: 8 vertices, 12 triangles, normals outwards
/// (also where `to_world` mirrors). Vertex `4a + 2b + c` is the corner of signs `x: a, y: b, z: c`,
/// 0 for −1.
pub fn cuboid(to_world: Affine3A) -> TriangleMesh {
    let sign = |bit: u32| if bit == 0 { -1.0 } else { 1.0 };
    let positions = (0..8)
        .map(|i| to_world.transform_point3(Vec3::new(sign(i & 4), sign(i & 2), sign(i & 1))))
        .collect();
    let mut mesh = TriangleMesh {
        positions,
        indices: CUBOID_TRIANGLES.to_vec(),
        ..TriangleMesh::default()
    };
    if to_world.matrix3.determinant() < 0.0 {
        turn(&mut mesh);
    }
    mesh
}

/// Triangles of a box over the vertex numbers of [`cuboid`].
pub(super) const CUBOID_TRIANGLES: [[u32; 3]; 12] = [
    [0, 1, 3],
    [0, 3, 2],
    [4, 6, 7],
    [4, 7, 5],
    [0, 4, 5],
    [0, 5, 1],
    [2, 3, 7],
    [2, 7, 6],
    [0, 2, 6],
    [0, 6, 4],
    [1, 5, 7],
    [1, 7, 3],
];

/// A regular tetrahedron with its vertices at distance `radius` from `center`.
pub fn tetrahedron(center: Vec3, radius: f32) -> TriangleMesh {
    let s = radius / 3.0_f32.sqrt();
    let corners = [
        Vec3::new(s, s, s),
        Vec3::new(s, -s, -s),
        Vec3::new(-s, s, -s),
        Vec3::new(-s, -s, s),
    ];
    TriangleMesh {
        positions: corners.map(|c| center + c).to_vec(),
        indices: vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
        ..TriangleMesh::default()
    }
}

/// A sphere approximated by an icosahedron whose triangles are split in four `subdivisions` times
/// (at most 8), with vertices on the sphere: `20 · 4ⁿ` triangles, face normals only. The solid
/// lies inside the sphere.
pub fn icosphere(center: Vec3, radius: f32, subdivisions: u32) -> TriangleMesh {
    let golden = 0.5 * (1.0 + 5.0_f32.sqrt());
    let mut directions: Vec<Vec3> = Vec::new();
    for (a, b) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
        directions
            .extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)].map(Vec3::normalize));
    }
    // The icosahedron's faces are the triples of vertices at the shortest mutual distance.
    let mut indices = Vec::new();
    let near = |a: usize, b: usize, directions: &[Vec3]| directions[a].dot(directions[b]) > 0.4;
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b, &directions) && near(b, c, &directions) && near(a, c, &directions) {
                    let [p, q, r] = [a, b, c].map(|i| directions[i]);
                    let outward = (q - p).cross(r - p).dot(p) > 0.0;
                    let (b, c) = if outward { (b, c) } else { (c, b) };
                    indices.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    for _ in 0..subdivisions.min(8) {
        let mut middles = std::collections::HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                directions.push((directions[a as usize] + directions[b as usize]).normalize());
                (directions.len() - 1) as u32
            })
        };
        indices = indices
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    TriangleMesh {
        positions: directions.iter().map(|&d| center + radius * d).collect(),
        indices,
        ..TriangleMesh::default()
    }
}

/// Turns the mesh inside out: reverses the winding, and the shading normals where there are any.
pub(crate) fn turn(mesh: &mut TriangleMesh) {
    for triangle in &mut mesh.indices {
        triangle.swap(1, 2);
    }
    for normal in &mut mesh.normals {
        *normal = -*normal;
    }
}

/// Volume enclosed by a closed mesh, `Σ p₀·(p₁ × p₂) / 6`, summed in `f64`: positive where
/// it is wound outwards. Meaningless for an open mesh, for which it depends on the origin.
pub fn signed_volume(mesh: &TriangleMesh) -> f64 {
    mesh.indices
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// Every edge occurs once in each direction: closed and consistently wound.
    fn is_closed(mesh: &TriangleMesh) -> bool {
        let mut balance: HashMap<(u32, u32), i32> = HashMap::new();
        for &[a, b, c] in &mesh.indices {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *balance.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
            }
        }
        balance.values().all(|&count| count == 0)
    }

    #[test]
    fn closed_meshes_are_wound_outwards() {
        let mirror = Affine3A::from_scale(Vec3::new(-1.0, 2.0, 0.5)) * Affine3A::from_rotation_y(0.3);
        let far = Vec3::new(100.0, -50.0, 20.0);
        let cases = [
            (cuboid(Affine3A::IDENTITY), 8.0, 12),
            (cuboid(mirror), 8.0, 12),
            // V = 8√3/27 r³
            (tetrahedron(far, 1.5), 8.0 * 3.0_f64.sqrt() / 27.0 * 3.375, 4),
            // V = 5(3+√5)/12 a³ with a = 1/sin(2π/5) r
            (icosphere(far, 1.0, 0), 2.536_150_7, 20),
        ];
        for (mesh, volume, triangles) in cases {
            assert_eq!(mesh.indices.len(), triangles);
            assert!(is_closed(&mesh));
            let found = signed_volume(&mesh);
            assert!((found - volume).abs() < 2e-3 * volume, "{found} against {volume}");
            // The fault this must find: the same mesh inside out.
            let mut turned = mesh.clone();
            turn(&mut turned);
            assert!(signed_volume(&turned) < 0.0);
            // And one triangle the wrong way round.
            let mut torn = mesh;
            torn.indices[0].swap(0, 1);
            assert!(!is_closed(&torn));
        }
    }

    #[test]
    fn icospheres_approach_the_sphere() {
        let sphere = 4.0 / 3.0 * std::f64::consts::PI;
        let mut last = f64::INFINITY;
        for subdivisions in 0..4 {
            let mesh = icosphere(Vec3::ZERO, 1.0, subdivisions);
            assert_eq!(mesh.indices.len(), 20 << (2 * subdivisions));
            assert_eq!(mesh.positions.len(), 2 + (10 << (2 * subdivisions)));
            assert!(is_closed(&mesh));
            let missing = sphere - signed_volume(&mesh);
            // The error falls by about four a subdivision.
            assert!(missing > 0.0 && missing < 0.35 * last);
            last = missing;
        }
    }

    #[test]
    fn a_quad_faces_its_normal() {
        let mesh = quad([Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y]);
        for triangle in &mesh.indices {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
            assert_eq!((b - a).cross(c - a), Vec3::Z);
        }
    }
}
