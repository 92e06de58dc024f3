//! Quads without a tree against one triangle after the other, where a line passes through both
//! triangles, or along an edge.

use super::*;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Coordinates that are small whole numbers, so that signed areas are exact, and often zero.
fn on_grid(rng: &mut impl Rng) -> Vec3 {
    Vec3::from_array([(); 3].map(|_| rng.random_range(-2..=2) as f32))
}

/// Triangles `abc` and `acd`: planes, folded ones, ones turned against each other, ones in one
/// place, and ones of no area; some next to a triangle that has no part in a quad.
fn quads(rng: &mut impl Rng) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for _ in 0..8 {
        let [a, b, c, mut d] = [(); 4].map(|_| on_grid(rng));
        match rng.random_range(0..4) {
            0 => d = a + c - b,
            1 => d = b,
            2 => d = a.midpoint(c),
            _ => {}
        }
        triangles.extend([[a, b, c], [a, c, d]]);
        if rng.random() {
            triangles.push([c, d, on_grid(rng)]);
        }
    }
    triangles
}

/// The nearest hit, of the lowest number.
pub(super) fn one_by_one(triangles: &[[Vec3; 3]], ray: &Ray) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    for (number, corners) in (0..).zip(triangles) {
        let t_max = best.map_or(ray.t_max, |hit| hit.t);
        best = intersect_triangle(ray, corners, number, t_max).or(best);
    }
    best
}

/// Planted faults: the second triangle is left out where a line passes through both; the areas of
/// one have the sign of the common edge in the other; a common area of zero counts as positive; the
/// number of the second is that of the first.
#[test]
fn quads_are_their_triangles() {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let mut hits = 0;
    for _ in 0..60 {
        let triangles = quads(&mut rng);
        let best = Flat::build(&triangles).unwrap();
        let array = best.clone().on_array_lanes();
        let rays: Vec<Ray> = (0..RayBatch::CAPACITY)
            .map(|_| {
                let origin = on_grid(&mut rng) * 1.5;
                // Along coordinates, to corners, and to edges and diagonals.
                let [a, b, c] = triangles[rng.random_range(0..triangles.len())];
                let target = match rng.random_range(0..4) {
                    0 => origin + Vec3::AXES[rng.random_range(0..3)],
                    1 => a,
                    2 => a.midpoint(c),
                    _ => (a + b + c) / 3.0,
                };
                let direction = target - origin;
                Ray::new(
                    origin,
                    if direction == Vec3::ZERO {
                        Vec3::Z
                    } else {
                        direction
                    },
                )
            })
            .collect();
        let (mut batch, mut found) = (RayBatch::NOWHERE, HitBatch::NONE);
        batch.fill(&rays);
        for flat in [&best, &array] {
            flat.intersect_batch(&batch, rays.len(), &mut found);
            let occluded = flat.occluded_batch(&batch, rays.len());
            for (index, ray) in rays.iter().enumerate() {
                let expected = one_by_one(&triangles, ray);
                hits += u32::from(expected.is_some());
                assert_eq!(found.get(index), expected, "{ray:?} {triangles:?}");
                assert_eq!(occluded >> index & 1 == 1, expected.is_some(), "{ray:?}");
            }
        }
    }
    assert!(hits > 3000, "{hits} hits say little");
}
