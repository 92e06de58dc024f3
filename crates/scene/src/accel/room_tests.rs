//! Few triangles in a room: rays and segments that stay in the room, that leave it, and that come
//! from outside; boxes that few of them enter.

use super::flat::Enclosure;
use super::quad_tests::one_by_one;
use super::tests::soup;
use super::*;
use crate::{TriangleMesh, builtin};
use glam::{Affine3A, DVec3, Quat};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn triangles_of(mesh: &TriangleMesh) -> Vec<[Vec3; 3]> {
    let corner = |index: u32| mesh.positions[index as usize];
    mesh.indices.iter().map(|triangle| triangle.map(corner)).collect()
}

/// A cuboid within the room: turned, or on a wall, with which it then shares a plane.
fn cuboid(rng: &mut impl Rng) -> Vec<[Vec3; 3]> {
    let half = Vec3::from_array([(); 3].map(|_| rng.random_range(0.1..0.3)));
    let on_wall = rng.random();
    let (turn, center) = if on_wall {
        (Quat::IDENTITY, Vec3::new(0.2, half.y - 1.0, -0.3))
    } else {
        let turn = Quat::from_rotation_y(rng.random_range(0.0..3.0));
        (
            turn,
            Vec3::from_array([(); 3].map(|_| rng.random_range(-0.4..0.4))),
        )
    };
    let mut mesh = builtin::cuboid(Affine3A::from_scale_rotation_translation(half, turn, center));
    if on_wall {
        for corner in mesh.positions.iter_mut().filter(|corner| corner.y < center.y) {
            corner.y = -1.0;
        }
    }
    triangles_of(&mesh)
}

/// A box of side 2 around the origin without one of its faces, cuboids before and behind it, and
/// some triangles.
fn room(rng: &mut impl Rng, cuboids: usize) -> Vec<[Vec3; 3]> {
    let before = rng.random_range(0..=cuboids);
    let mut triangles = Vec::new();
    (0..before).for_each(|_| triangles.extend(cuboid(rng)));
    let open = rng.random_range(0..6);
    for (face, sign) in (0..6).zip([1.0, -1.0].into_iter().cycle()) {
        if face != open {
            let axis = face / 2;
            let corner = |u: f32, v: f32| {
                let mut corner = Vec3::ZERO;
                corner[axis] = sign;
                corner[(axis + 1) % 3] = u;
                corner[(axis + 2) % 3] = v;
                corner
            };
            let [a, b, c, d] = [
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
            ];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (before..cuboids).for_each(|_| triangles.extend(cuboid(rng)));
    // Some of them reach beyond the walls; one is behind a wall.
    let scale = if rng.random() { 0.6 } else { 1.2 };
    let others = soup(rng, if cuboids == 1 { 11 } else { 4 }, 0.4)
        .into_iter()
        .map(|triangle| triangle.map(|corner| scale * corner));
    triangles.extend(others);
    triangles.push([(2.0, 0.0), (2.0, 1.0), (1.5, 0.0)].map(|(x, y)| Vec3::new(x, y, 0.2)));
    triangles
}

fn enclosure_of(triangles: &[[Vec3; 3]]) -> Enclosure {
    let corners = triangles.iter().flatten();
    let least = corners
        .clone()
        .fold(Vec3::INFINITY, |least, corner| least.min(*corner));
    let most = corners.fold(Vec3::NEG_INFINITY, |most, corner| most.max(*corner));
    Enclosure::of(triangles, [least, most])
}

/// A point within the room, on a wall, or around.
fn place(rng: &mut impl Rng) -> Vec3 {
    let mut point = Vec3::from_array([(); 3].map(|_| rng.random_range(-1.0..1.0)));
    match rng.random_range(0..4) {
        0 => point[rng.random_range(0..3)] = if rng.random() { 1.0 } else { -1.0 },
        1 => point *= 2.0,
        _ => {}
    }
    point
}

/// Planted faults: the origin of a segment is not asked for, the end is not asked for, a triangle
/// with one corner in a face counts as a wall, walls never count, and rays behind the last one
/// count. Of cuboids: answers to shadow rays go to the rays before.
#[test]
fn rays_in_a_room_are_tested_against_what_they_can_meet() {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let (mut stay, mut parts) = ([0; 2], 0);
    for turn in 0..200 {
        let triangles = room(&mut rng, 1 + turn % 4);
        let enclosure = enclosure_of(&triangles);
        // With needles there are no parts, and then these may be too many triangles.
        let Some(best) = Flat::build(&triangles) else {
            continue;
        };
        let array = best.clone().on_array_lanes();
        parts += u32::from(best.has_parts());
        let mut rays = Vec::new();
        while rays.len() < RayBatch::CAPACITY {
            // On a wall a ray may meet the wall, by rounding.
            let (from, to) = (0.9999 * place(&mut rng), place(&mut rng));
            let t_max = [1.0, 0.5, 2.0, f32::INFINITY][rng.random_range(0..4)];
            let ray = Ray::segment(from, to - from, t_max);
            // Batches of every third turn stay in the room altogether.
            if turn % 3 != 0 || enclosure.holds(&ray) {
                rays.push(ray);
            }
        }
        let mut batch = RayBatch::NOWHERE;
        batch.fill(&rays);
        let count = rng.random_range(1..=rays.len());
        let mut found = HitBatch::NONE;
        for flat in [&best, &array] {
            let occluded = flat.occluded_batch(&batch, count);
            flat.intersect_batch(&batch, count, &mut found);
            for (index, ray) in rays.iter().enumerate().take(count) {
                stay[usize::from(enclosure.holds(ray))] += 1;
                let expected = one_by_one(&triangles, ray);
                assert_eq!(found.get(index), expected, "{ray:?} {triangles:?}");
                let expected = expected.is_some();
                assert_eq!(occluded >> index & 1 == 1, expected, "{ray:?} {triangles:?}");
                assert_eq!(flat.occluded(ray), expected, "{ray:?} alone");
            }
        }
    }
    assert!(stay.iter().all(|count| *count > 3_000), "{stay:?} say little");
    assert!(parts > 50, "{parts} rooms with a box say little");
}

/// Planted fault: at equal distances the triangle of a part never counts.
#[test]
fn of_a_box_and_the_floor_below_it_the_first_is_hit() {
    let floor = [
        [[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0]],
        [[-4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]],
    ]
    .map(|triangle| triangle.map(|[x, z]| Vec3::new(x, 0.0, z)));
    let half = Vec3::splat(0.5);
    let to_world = Affine3A::from_scale_rotation_translation(half, Quat::IDENTITY, half);
    let on_it = triangles_of(&builtin::cuboid(to_world));
    // From below, at places and along a coordinate that give exact distances.
    let rays: Vec<Ray> = (1..8)
        .map(|eighths| Ray::new(Vec3::new(0.125 * eighths as f32, -2.0, 0.25), Vec3::Y))
        .collect();
    let (mut batch, mut found) = (RayBatch::NOWHERE, HitBatch::NONE);
    batch.fill(&rays);
    for (triangles, first) in [
        ([&floor[..], &on_it[..]].concat(), 0..2),
        ([&on_it[..], &floor[..]].concat(), 0..12),
    ] {
        let flat = Flat::build(&triangles).unwrap();
        assert!(flat.has_parts());
        flat.intersect_batch(&batch, rays.len(), &mut found);
        for (index, ray) in rays.iter().enumerate() {
            let hit = found.get(index).unwrap();
            assert_eq!(Some(hit), one_by_one(&triangles, ray));
            assert_eq!(hit.t, 2.0);
            assert!(first.contains(&hit.primitive), "{hit:?}");
        }
    }
}

#[test]
fn triangles_of_parts_count_by_half() {
    let mut rng = Pcg64Mcg::seed_from_u64(9);
    let mut boxes: Vec<[Vec3; 3]> = Vec::new();
    for corner in 0..5 {
        let place = Vec3::new(corner as f32, 2.0 * corner as f32, 0.0);
        let own = cuboid(&mut rng).into_iter();
        boxes.extend(own.map(|triangle| triangle.map(|at| 3.0 * at + 9.0 * place)));
    }
    let walls = |count: usize| {
        let wall = [Vec3::ZERO, 90.0 * Vec3::X, 90.0 * Vec3::Y].map(|at| at - 9.0);
        vec![wall; count]
    };
    let four = &boxes[..48];
    assert!(Flat::build(&[four, &walls(16)[..]].concat()).is_some());
    assert!(Flat::build(&[four, &walls(17)[..]].concat()).is_none());
    // The fifth box is no part.
    assert!(Flat::build(&[&boxes[..], &walls(4)[..]].concat()).is_some());
    assert!(Flat::build(&[&boxes[..], &walls(5)[..]].concat()).is_none());
}

/// Planted fault: no slack.
#[test]
fn what_is_said_to_stay_in_the_box_does() {
    let mut rng = Pcg64Mcg::seed_from_u64(6);
    let mut held = 0;
    for _ in 0..200_000 {
        let size = 2f32.powi(rng.random_range(-20..20));
        let mut point = || Vec3::from_array([(); 3].map(|_| size * rng.random_range(-1.0..1.0f32)));
        let (a, b, c) = (point(), point(), point());
        let (least, most) = (a.min(b).min(c), a.max(b).max(c));
        let enclosure = enclosure_of(&[[a, b, c]]);
        // From a corner or near to it, to a face or near to it.
        let from = least + (most - least) * [0.0, 0.5, 1.0][rng.random_range(0..3)];
        let to = least + (most - least) * [0.0, 1e-6, 0.5, 1.0 - 1e-6, 1.0][rng.random_range(0..5)];
        let t_max: f32 = rng.random_range(0.1..10.0);
        let ray = Ray::segment(from, (to - from) / t_max, t_max);
        if enclosure.holds(&ray) {
            held += 1;
            let end: DVec3 = from.as_dvec3() + ray.direction.as_dvec3() * f64::from(t_max);
            let inside = end.cmpge(least.as_dvec3()).all() && end.cmple(most.as_dvec3()).all();
            assert!(inside, "{ray:?} in {enclosure:?}");
        }
    }
    assert!(held > 50_000, "{held} say little");
}
