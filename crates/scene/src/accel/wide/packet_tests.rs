//! Rays side by side find what each of them finds alone.

use super::packet::Packet;
use super::row::Sixteen;
use super::{Instances, Placed, Primitives, WideBvh};
use crate::accel::block::{TriangleBlock, TriangleRay};
use crate::accel::tests::{soup, tree_for, uniform};
use crate::accel::{HitBatch, Ray, RayBatch, Sphere};
use glam::{Affine3A, Vec3};
use lightshed_bvh::{Bounds, Bvh, Preset};
use lightshed_lanes::{ArrayLanes, LaneChoice, LaneKernel, Lanes};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Whether rays are a packet, with as many lanes as these lanes have at most.
struct IsPacket<'a>(&'a RayBatch, usize);

impl LaneKernel for IsPacket<'_> {
    const HOT: bool = true;
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        Packet::new::<L::Long, Sixteen>(self.0, self.1, 0.0).is_some()
    }
}

/// Traces the rays together, on all kinds of lanes, and alone; returns how many hit, if they are a
/// packet.
fn compare(trees: &[WideBvh], batch: &mut RayBatch, rays: &[Ray]) -> Option<usize> {
    batch.fill(rays);
    let mut hits = 0;
    for tree in trees {
        let choice = tree.lanes;
        let mut found = HitBatch::NONE;
        tree.intersect_batch(batch, rays.len(), &mut found);
        hits = 0;
        for (index, ray) in rays.iter().enumerate() {
            let alone = tree.intersect(ray);
            assert_eq!(found.get(index), alone, "{choice:?}: {ray:?} of {}", rays.len());
            hits += usize::from(alone.is_some());
        }
    }
    let mut choices = LaneChoice::all().into_iter();
    let is_packet = LaneChoice::ARRAY.run(IsPacket(batch, rays.len()));
    assert!(choices.all(|choice| choice.run(IsPacket(batch, rays.len())) == is_packet));
    is_packet.then_some(hits)
}

/// Trees for all kinds of lanes.
fn trees(triangles: &[[Vec3; 3]]) -> Vec<WideBvh> {
    let build = |lanes| tree_for(lanes, triangles, Preset::High);
    LaneChoice::all().into_iter().map(build).collect()
}

/// Rays from about one point, in directions that are up to `spread` apart; some end early, and some
/// go through corners of triangles or along their edges. In half of all companies all but one or
/// two are close together, so that these alone make the ranges.
fn rays_one_way(rng: &mut impl Rng, triangles: &[[Vec3; 3]], count: usize, spread: f32) -> Vec<Ray> {
    let origin = uniform(rng) * 1.5;
    let towards = uniform(rng) * 0.7 - origin;
    let close = if rng.random() { 0.01 } else { 1.0 };
    let apart: [usize; 2] = [(); 2].map(|_| rng.random_range(0..count));
    let ray = |index| {
        let spread = if apart.contains(&index) {
            spread
        } else {
            spread * close
        };
        let origin = origin + uniform(rng) * 0.1 * spread;
        let direction = match rng.random_range(0..4) {
            0 => {
                let near = |corners: &&[Vec3; 3]| (corners[0] - origin).angle_between(towards) < spread;
                let [a, b, _] = triangles.iter().find(near).unwrap_or(&triangles[0]);
                let target = if rng.random() { *a } else { a.midpoint(*b) };
                if (target - origin).angle_between(towards) < spread {
                    target - origin
                } else {
                    towards
                }
            }
            _ => towards + uniform(rng) * spread,
        };
        let end = if rng.random() {
            f32::INFINITY
        } else {
            rng.random::<f32>() * 3.0
        };
        Ray::segment(origin, direction, end)
    };
    (0..count).map(ray).collect()
}

/// Triangles, some in one plane, and copies of them in any order so that distances are equal: more
/// of some than a leaf can hold.
fn copies(rng: &mut impl Rng) -> Vec<[Vec3; 3]> {
    let mut triangles = soup(rng, 1_000, 0.15);
    for triangle in &mut triangles[..100] {
        triangle.iter_mut().for_each(|corner| corner.z = 0.125);
    }
    for _ in 0..3_000 {
        let of = if rng.random() { 30 } else { 1_000 };
        triangles.push(triangles[rng.random_range(0..of)]);
    }
    // Larger ones, so that rays hit them together.
    for triangle in &mut triangles {
        triangle[1] += triangle[1] - triangle[0];
    }
    triangles
}

#[test]
fn rays_side_by_side_hit_what_they_hit_alone() {
    let mut rng = Pcg64Mcg::seed_from_u64(41);
    let triangles = copies(&mut rng);
    let trees = trees(&triangles);
    let mut batch = RayBatch::NOWHERE;
    let (mut packets, mut hits) = (0, 0);
    for number in 0..600 {
        let spread = [0.0, 1e-3, 0.05, 0.3][number % 4];
        let count = [16, 17, 31, 32, 50, 64][number % 6];
        let rays = rays_one_way(&mut rng, &triangles, count, spread);
        // What the batch has beyond these rays stays from the ones before.
        if let Some(found) = compare(&trees, &mut batch, &rays) {
            packets += 1;
            hits += found;
        }
    }
    assert!(packets > 300 && hits > 5_000, "{packets} packets, {hits} hits");
}

/// Spheres and instances, where each ray goes on alone.
#[test]
fn rays_side_by_side_hit_spheres_and_instances() {
    let mut rng = Pcg64Mcg::seed_from_u64(42);
    let triangles = soup(&mut rng, 300, 0.1);
    let object = soup(&mut rng, 200, 0.2);
    let mut spheres: Vec<Sphere> = (0..30)
        .map(|_| Sphere {
            center: uniform(&mut rng),
            radius: 0.1,
        })
        .collect();
    let mut maps: Vec<Affine3A> = (0..3)
        .map(|_| Affine3A::from_translation(uniform(&mut rng)) * Affine3A::from_scale(Vec3::splat(0.5)))
        .collect();
    // Each twice, so that distances are equal.
    spheres.extend_from_within(..);
    maps.extend_from_within(..);
    let first = (triangles.len() + spheres.len()) as u32;
    let placed = maps.iter().zip(0..).map(|(map, number)| Placed {
        to_object: map.inverse(),
        object: 0,
        first: first + number * object.len() as u32,
    });
    let placed: Vec<Placed> = placed.collect();
    let around = |center: Vec3, radius: f32| Bounds::new(center - radius, center + radius);
    let boxes: Vec<Bounds> = triangles
        .iter()
        .map(|[a, b, c]| Bounds::new(a.min(*b).min(*c), a.max(*b).max(*c)))
        .chain(spheres.iter().map(|sphere| around(sphere.center, 0.101)))
        .chain(maps.iter().map(|map| around(map.translation.into(), 0.7)))
        .collect();
    let build = |object: WideBvh| {
        let lanes = object.lanes;
        let primitives = Primitives {
            triangles: &triangles,
            spheres: &spheres,
            instances: Instances {
                objects: vec![object],
                placed: placed.clone(),
            },
        };
        let tree = Bvh::build(&boxes, Preset::High.options()).unwrap();
        super::build_for(lanes, tree, &boxes, primitives)
    };
    let trees: Vec<WideBvh> = trees(&object).into_iter().map(build).collect();
    let mut batch = RayBatch::NOWHERE;
    let mut of_kinds = [0; 3];
    for _ in 0..200 {
        let rays = rays_one_way(&mut rng, &triangles, 64, 0.2);
        if compare(&trees, &mut batch, &rays).is_some() {
            for hit in rays.iter().filter_map(|ray| trees[0].intersect(ray)) {
                let kind = usize::from(hit.primitive >= 300) + usize::from(hit.primitive >= first);
                of_kinds[kind] += 1;
            }
        }
    }
    assert!(of_kinds.iter().all(|&hits| hits > 300), "{of_kinds:?}");
}

/// Whether the test in lanes says that a ray hits one of the triangles.
fn is_hit(ray: &Ray, triangles: &[[Vec3; 3]]) -> bool {
    let of = TriangleRay::new(ray, (1.0 / ray.direction).to_array());
    let block = TriangleBlock::new((0..).zip(triangles.iter().copied()));
    of.hits::<ArrayLanes>(&block, ray.t_max, 0.0).0 != 0
}

/// A slat that rays leave, as in the tests of other trees: eight-wide tests say that some hit it.
#[test]
fn rays_side_by_side_do_not_hit_the_needle_that_they_leave() {
    let mut rng = Pcg64Mcg::seed_from_u64(43);
    let [a, b, c, d] = [
        Vec3::new(3.5843267, -4.5806537, 1.0826423),
        Vec3::new(-2.4997847, -4.580654, 1.082643),
        Vec3::new(-2.4997847, -4.580654, 1.080683),
        Vec3::new(3.5843267, -4.5806537, 1.0806823),
    ];
    let mut triangles = vec![[a, b, c], [a, c, d]];
    // In the same leaf, so that its box is entered; rays end before they reach it.
    let lid = |x, z| Vec3::new(x, -4.0, z);
    triangles.push([lid(-3.0, 0.0), lid(4.0, 0.0), lid(0.0, 2.0)]);
    let trees = trees(&triangles);
    let mut batch = RayBatch::NOWHERE;
    let mut wrong = 0;
    for _ in 0..400 {
        // As a path in a real scene left it.
        let towards = Vec3::new(0.71, 0.28, -0.65);
        let leave = |_| {
            let at = a
                .lerp(b, rng.random())
                .lerp(d.lerp(c, rng.random()), rng.random());
            Ray::segment(at + Vec3::Y * 2e-5, towards + uniform(&mut rng) * 0.02, 1.0)
        };
        let rays: Vec<Ray> = (0..64).map(leave).collect();
        if let Some(hits) = compare(&trees, &mut batch, &rays) {
            assert_eq!(hits, 0);
            // Without a look at the plane.
            wrong += rays.iter().filter(|ray| is_hit(ray, &triangles[..2])).count();
        }
    }
    assert!(wrong > 5, "{wrong} rays would be wrong");
}

/// What the shared test of boxes is not made for is not a packet, and is traced all the same.
#[test]
fn rays_apart_or_along_a_plane_are_no_packet() {
    let mut rng = Pcg64Mcg::seed_from_u64(44);
    let triangles = soup(&mut rng, 500, 0.3);
    let trees = trees(&triangles);
    let mut batch = RayBatch::NOWHERE;
    let alike = vec![Ray::new(Vec3::new(-1.0, -0.9, -1.1), Vec3::new(0.7, 0.5, 0.6)); 40];
    assert!(compare(&trees, &mut batch, &alike).is_some());
    let odd = [
        Ray::new(Vec3::splat(-1.0), Vec3::new(0.7, -0.5, 0.6)),
        Ray::new(Vec3::splat(-1.0), Vec3::new(0.5, 0.7, 0.6)),
        Ray::new(Vec3::splat(-1.0), Vec3::new(0.5, 0.6, 0.7)),
        Ray::new(Vec3::splat(-1.0), Vec3::new(0.7, 0.0, 0.6)),
        Ray::new(Vec3::splat(-1.0), Vec3::new(0.7, 1e-40, 0.6)),
        Ray::new(Vec3::splat(-1.0), Vec3::new(f32::INFINITY, 0.5, 0.6)),
        Ray::new(Vec3::splat(-1.0), Vec3::new(f32::NAN, 0.5, 0.6)),
        Ray::new(Vec3::new(f32::INFINITY, 0.0, 0.0), Vec3::new(0.7, 0.5, 0.6)),
        Ray::new(Vec3::new(0.0, f32::NAN, 0.0), Vec3::new(0.7, 0.5, 0.6)),
    ];
    for odd in odd {
        for place in [0, 7, 8, 17, 39] {
            let mut rays = alike.clone();
            rays[place] = odd;
            assert!(compare(&trees, &mut batch, &rays).is_none(), "{odd:?} at {place}");
            // It no longer counts once it is not asked about.
            assert_eq!(compare(&trees, &mut batch, &rays[..place]).is_some(), place > 0);
        }
    }
    // Ends that are no numbers hide no one's hits.
    for end in [f32::NAN, -1.0, 0.0] {
        for place in [0, 9, 39] {
            let mut rays = alike.clone();
            rays[place].t_max = end;
            let hits = compare(&trees, &mut batch, &rays).unwrap();
            assert_eq!(hits, 39);
        }
    }
    // One ray that goes far, and in lanes like its own ends that are no numbers.
    let mut rays = vec![Ray::segment(alike[0].origin, alike[0].direction, 1e-3); 40];
    rays[0] = alike[0];
    for place in [8, 16, 24, 32] {
        rays[place].t_max = f32::NAN;
    }
    assert_eq!(compare(&trees, &mut batch, &rays), Some(1));
}
