//! Rays against every primitive.

use crate::{builds, triangles};
use lightshed_bvh::glam::{DVec3, Vec3};
use lightshed_bvh::{Bvh, Method, Ray};
use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_testkit::check_faults;

/// Where a ray hits a triangle, in `f64` (Möller and Trumbore 1997).
pub fn hit(ray: &Ray, [a, b, c]: &[Vec3; 3]) -> Option<f32> {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    let (e, f): (DVec3, DVec3) = (b - a, c - a);
    let p = direction.cross(f);
    let determinant = e.dot(p);
    let s = origin - a;
    let q = s.cross(e);
    let (u, v) = (s.dot(p) / determinant, direction.dot(q) / determinant);
    let t = (f.dot(q) / determinant) as f32;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < ray.t_max).then_some(t)
}

fn ray(index: u32) -> Ray {
    let mut rng = CounterRng::new(17, index, 0);
    let origin = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 3.0 - 1.5;
    let direction = match index % 8 {
        // Within planes of boxes.
        0 => Vec3::X,
        1 => -Vec3::Y,
        2 => Vec3::new(0.0, 1.0, -1.0),
        _ => UniformSphere::sample(rng.next_2d()) * 10f32.powi(index as i32 % 7 - 3),
    };
    let t_max = if index.is_multiple_of(3) {
        1.0
    } else {
        f32::INFINITY
    };
    Ray {
        origin,
        direction,
        t_max,
    }
}

/// The nearest hit is that of brute force. A tree whose boxes were made for other triangles is
/// noticed.
#[test]
fn hits_are_those_of_brute_force() {
    for (count, size) in [(1, 1.0), (40, 0.5), (1500, 0.08)] {
        let mut triangles = triangles(count, size, 5);
        // Neighbours often have nearly the same box.
        for i in (1..count as usize).step_by(2) {
            triangles[i] = triangles[i - 1].map(|corner| corner + 0.02 * size);
        }
        // Some of them twice, without area, or flat along an axis.
        for i in 0..count as usize / 10 {
            triangles[i * 10] = match i % 3 {
                0 => triangles[(i * 7 + 1) % count as usize],
                1 => [triangles[i * 10][0]; 3],
                _ => triangles[i * 10].map(|corner| corner.with_x(0.25)),
            };
        }
        let expected: Vec<Option<f32>> = (0..400)
            .map(|index| {
                let ray = ray(index);
                triangles
                    .iter()
                    .filter_map(|triangle| hit(&ray, triangle))
                    .min_by(f32::total_cmp)
            })
            .collect();
        assert!(count == 1 || expected.iter().flatten().count() > 10);
        let found_by = |tree: &Bvh| {
            for (index, expected) in (0..).zip(&expected) {
                let ray = ray(index);
                let test = |index: u32, t_max| hit(&Ray { t_max, ..ray }, &triangles[index as usize]);
                let found = tree.nearest(&ray, test);
                if found.map(|(_, t)| t) != *expected {
                    return Err(format!("{found:?} in place of {expected:?}"));
                }
            }
            Ok(())
        };
        for (name, options) in builds() {
            let tree = Bvh::build(&triangles, options).unwrap();
            found_by(&tree).unwrap_or_else(|error| panic!("{name}: {error}"));
        }
        check_faults(&[()], |fault| {
            let mut others = triangles.clone();
            if fault.is_some() {
                others.iter_mut().for_each(|corners| corners[1] = corners[0]);
            }
            found_by(&Bvh::build(&others, Method::Binned).unwrap())
        })
        .expect("boxes that are too small are noticed");
    }
}

/// Trees of `obvhs` hold the same primitives and find the same hits.
#[cfg(feature = "obvhs")]
#[test]
fn trees_of_obvhs_find_the_same() {
    use lightshed_bvh::glam::Vec3A;
    use lightshed_bvh::obvhs::ray::{Ray as ObvhsRay, RayHit};
    for count in [1, 2, 5, 700] {
        let triangles = triangles(count, 0.2, 9);
        let tree = Bvh::build(&triangles, Method::Binned).unwrap();
        let (two, eight) = (tree.to_obvhs_bvh2(4), tree.to_obvhs_cwbvh(3));
        assert_eq!(two.primitive_indices.len(), count as usize);
        let mut found = 0;
        for index in 0..300 {
            let ray = Ray {
                t_max: f32::INFINITY,
                ..ray(index)
            };
            let ray = Ray {
                direction: ray.direction.normalize(),
                ..ray
            };
            let own = tree.nearest(&ray, |i, t_max| {
                hit(&Ray { t_max, ..ray }, &triangles[i as usize])
            });
            let theirs = || ObvhsRay::new_inf(Vec3A::from(ray.origin), Vec3A::from(ray.direction));
            let test = |order: &[u32], slot: usize| {
                hit(&ray, &triangles[order[slot] as usize]).unwrap_or(f32::INFINITY)
            };
            let mut of_two = RayHit::none();
            two.ray_traverse(theirs(), &mut of_two, |_, slot| {
                test(&two.primitive_indices, slot)
            });
            let mut of_eight = RayHit::none();
            eight.ray_traverse(theirs(), &mut of_eight, |_, slot| {
                test(&eight.primitive_indices, slot)
            });
            let own = own.map_or(f32::INFINITY, |(_, t)| t);
            assert_eq!(own, of_two.t, "{count} {index} {ray:?}");
            // Rays along an axis are lost there at times, by its own trees too.
            assert!(own == of_eight.t || index % 8 < 3, "{count} {index} {ray:?}");
            found += u32::from(own < f32::INFINITY);
        }
        assert!(found > 0 || count < 10);
    }
    let none = Bvh::default();
    assert!(none.to_obvhs_bvh2(4).nodes.is_empty() && none.to_obvhs_cwbvh(3).nodes.is_empty());
}
