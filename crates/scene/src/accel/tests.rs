//! Every tree against brute force, and the guarantees of the wide one.

use super::*;
use lightshed_lanes::LaneChoice;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// The wide tree also where there are too few triangles to need one.
fn with_tree(triangles: &[[Vec3; 3]], spheres: &[Sphere], quality: Preset) -> Accelerator {
    Accelerator {
        tree: wide_tree(triangles, spheres, quality),
    }
}

/// The wide tree for given lanes.
pub(super) fn tree_for(lanes: LaneChoice, triangles: &[[Vec3; 3]], preset: Preset) -> WideBvh {
    let primitives = Primitives {
        triangles,
        spheres: &[],
        instances: Instances::default(),
    };
    let tree = Bvh::build(triangles, preset.options()).unwrap();
    wide::build_for(lanes, tree, triangles, primitives)
}

/// The naive oracle.
pub(super) fn brute_force(triangles: &[[Vec3; 3]], spheres: &[Sphere], ray: &Ray) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    for (i, corners) in triangles.iter().enumerate() {
        let t_max = best.map_or(ray.t_max, |hit| hit.t);
        best = triangle::intersect_ahead(ray, corners, i as u32, t_max).or(best);
    }
    for (i, sphere) in spheres.iter().enumerate() {
        let t_max = best.map_or(ray.t_max, |hit| hit.t);
        let primitive = (triangles.len() + i) as u32;
        if let Some(t) = sphere.intersect(ray.origin, ray.direction, t_max) {
            best = Some(Hit {
                t,
                primitive,
                barycentric: [0.0; 2],
            });
        }
    }
    best
}

pub(super) fn uniform(rng: &mut impl Rng) -> Vec3 {
    Vec3::from_array([(); 3].map(|_| rng.random::<f32>() * 2.0 - 1.0))
}

pub(super) fn soup(rng: &mut impl Rng, count: usize, size: f32) -> Vec<[Vec3; 3]> {
    (0..count)
        .map(|_| {
            let center = uniform(rng);
            [(); 3].map(|_| center + uniform(rng) * size)
        })
        .collect()
}

fn random_ray(rng: &mut impl Rng, axis_parallel: f32) -> Ray {
    let origin = uniform(rng) * 1.5;
    let mut direction = uniform(rng);
    // Axis-parallel directions are where slab tests go wrong.
    for axis in 0..3 {
        if rng.random::<f32>() < axis_parallel {
            direction[axis] = if rng.random() { 0.0 } else { -0.0 };
        }
    }
    if direction == Vec3::ZERO {
        direction.z = 1.0;
    }
    let t_max = if rng.random() {
        f32::INFINITY
    } else {
        rng.random::<f32>() * 3.0
    };
    Ray::segment(origin, direction, t_max)
}

/// The wide tree must return what brute force returns, to the bit, axis-parallel rays included.
/// obvhs' box tests are not conservative: rays in general position alone are held against it, and
/// one in a thousand may be lost.
fn agree_with_brute_force(triangles: &[[Vec3; 3]], spheres: &[Sphere], seed: u64) {
    for quality in [Preset::Fast, Preset::High] {
        let ours = with_tree(triangles, spheres, quality);
        let by_kind = AcceleratorKind::ALL
            .iter()
            .map(|&(_, kind)| (kind, Accelerator::build(triangles, spheres, kind, quality)));
        for (kind, tree) in by_kind.chain([(AcceleratorKind::Wide, ours)]) {
            let mut rng = Pcg64Mcg::seed_from_u64(seed);
            let (mut hits, mut differences) = (0, 0);
            let rays = 3_000;
            for _ in 0..rays {
                let wide = kind == AcceleratorKind::Wide;
                let ray = random_ray(&mut rng, if wide { 0.15 } else { 0.0 });
                let expected = brute_force(triangles, spheres, &ray);
                let found = tree.intersect(&ray);
                let same = expected.map(|hit| hit.t) == found.map(|hit| hit.t)
                    && tree.occluded(&ray) == expected.is_some();
                differences += i32::from(!same);
                hits += i32::from(expected.is_some());
                if kind == AcceleratorKind::Wide {
                    assert!(same, "{ray:?}: {found:?} for {expected:?}");
                }
            }
            assert!(
                differences * 10_000 <= rays.max(10_000),
                "{kind:?}: {differences} rays differ"
            );
            assert!(hits > 0, "the scene is too empty to say anything");
        }
    }
}

#[test]
fn trees_agree_with_brute_force_on_triangles() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    for (count, size) in [(1, 2.0), (2, 1.0), (9, 0.8), (100, 0.5), (2_000, 0.1)] {
        agree_with_brute_force(&soup(&mut rng, count, size), &[], count as u64);
    }
}

#[test]
fn trees_agree_with_brute_force_on_triangles_and_spheres() {
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    let spheres: Vec<Sphere> = (0..50)
        .map(|_| Sphere {
            center: uniform(&mut rng),
            radius: 0.02 + 0.2 * rng.random::<f32>(),
        })
        .collect();
    agree_with_brute_force(&soup(&mut rng, 200, 0.3), &spheres, 7);
    agree_with_brute_force(&soup(&mut rng, 1, 2.0), &spheres[..1], 8);
}

#[test]
fn degenerate_input_builds_and_traces() {
    let point = Vec3::splat(0.25);
    let quad = [Vec3::ZERO, Vec3::X, Vec3::Y];
    // A thousand equal triangles make a binary tree of any depth; a point and a needle have no
    // area.
    let mut triangles = vec![quad; 1_000];
    triangles.push([point; 3]);
    triangles.push([Vec3::ZERO, Vec3::X, Vec3::X * 0.5]);
    let tree = Accelerator::build(&triangles, &[], AcceleratorKind::Wide, Preset::Medium);
    let hit = tree
        .intersect(&Ray::new(Vec3::new(0.2, 0.2, 1.0), -Vec3::Z))
        .unwrap();
    assert_eq!(hit.t, 1.0);
    assert_eq!(hit.primitive, 0);
    assert!(
        tree.intersect(&Ray::new(Vec3::new(2.0, 2.0, 1.0), -Vec3::Z))
            .is_none()
    );
    for &(_, kind) in AcceleratorKind::ALL {
        let empty = Accelerator::build(&[], &[], kind, Preset::High);
        assert!(empty.intersect(&Ray::new(Vec3::ZERO, Vec3::Z)).is_none());
        assert!(!empty.occluded(&Ray::new(Vec3::ZERO, Vec3::Z)));
    }
}

/// Of triangles and spheres at one place the lowest index is hit, whatever the tree: as brute force
/// does.
#[test]
fn equal_distances_go_to_the_lowest_index() {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let mut triangles = soup(&mut rng, 200, 0.3);
    // Three copies of each, far apart in the order; and many in one plane.
    for _ in 0..2 {
        triangles.extend_from_within(..200);
    }
    for triangle in &mut triangles[..90] {
        triangle.iter_mut().for_each(|corner| corner.z = 0.125);
    }
    let balls: Vec<Sphere> = (0..20)
        .map(|_| Sphere {
            center: uniform(&mut rng),
            radius: 0.1,
        })
        .collect();
    let balls = [&balls[..], &balls[..]].concat();
    let trees = Preset::ALL.map(|preset| with_tree(&triangles, &balls, preset));
    let mut copies = 0;
    for _ in 0..5_000 {
        let ray = random_ray(&mut rng, 0.2);
        let expected = brute_force(&triangles, &balls, &ray);
        copies += u32::from(expected.is_some());
        for tree in &trees {
            assert_eq!(
                tree.intersect(&ray).map(|hit| (hit.t, hit.primitive)),
                expected.map(|hit| (hit.t, hit.primitive))
            );
        }
    }
    assert!(copies > 300, "{copies}");
}

/// A slat of 6 m by 2 mm, and a ray that leaves it, as a path in a real scene did: the eight-wide
/// test alone says that it is hit ahead. Many more such rays, from both sides of both triangles; in
/// trees of all kinds, without one, and together. A ray towards the slat still hits it.
#[test]
fn rays_do_not_hit_the_needle_that_they_leave() {
    let mut rng = Pcg64Mcg::seed_from_u64(19);
    let [a, b, c, d] = [
        Vec3::new(3.5843267, -4.5806537, 1.0826423),
        Vec3::new(-2.4997847, -4.580654, 1.082643),
        Vec3::new(-2.4997847, -4.580654, 1.080683),
        Vec3::new(3.5843267, -4.5806537, 1.0806823),
    ];
    let slat = [[a, b, c], [a, c, d]];
    let far = soup(&mut rng, 60, 0.1)
        .into_iter()
        .map(|t| t.map(|p| p + 20.0 * Vec3::Y));
    let many: Vec<[Vec3; 3]> = slat.into_iter().chain(far).collect();
    let flat = Flat::build(&slat).unwrap();
    let trees = Preset::ALL.map(|preset| with_tree(&many, &[], preset));
    let mut rays = vec![Ray::new(
        Vec3::new(0.8600038, -4.580633, 1.082402),
        Vec3::new(0.68968266, 0.2827454, -0.666628),
    )];
    let normal = (b - a).cross(c - a).normalize();
    for _ in 0..20_000 {
        let at = a
            .lerp(b, rng.random())
            .lerp(d.lerp(c, rng.random()), rng.random());
        let direction = uniform(&mut rng).normalize();
        let side = 2e-5_f32.copysign(direction.dot(normal));
        rays.push(Ray::segment(at + normal * side, direction, 1.0));
    }
    // The test of areas alone, without the look at planes.
    let unsure = |ray: &Ray| {
        let triangle = block::TriangleRay::new(ray, (1.0 / ray.direction).to_array());
        let block = block::TriangleBlock::new((0..).zip(slat));
        triangle
            .hits::<lightshed_lanes::ArrayLanes>(&block, ray.t_max, 0.0)
            .0
            != 0
    };
    let wrong = rays.iter().filter(|ray| unsure(ray)).count();
    assert!(unsure(&rays[0]) && wrong > 20, "{wrong} rays would be wrong");
    let mut batch = RayBatch::NOWHERE;
    let mut hits = HitBatch::NONE;
    for rays in rays.chunks(RayBatch::CAPACITY) {
        batch.fill(rays);
        flat.intersect_batch(&batch, rays.len(), &mut hits);
        assert_eq!(flat.occluded_batch(&batch, rays.len()), 0);
        for (index, ray) in rays.iter().enumerate() {
            assert_eq!((hits.get(index), flat.intersect(ray)), (None, None));
            assert!(!flat.occluded(ray) && brute_force(&slat, &[], ray).is_none());
            for tree in &trees {
                assert!(tree.intersect(ray).is_none_or(|hit| hit.primitive >= 2));
                assert!(!tree.occluded(ray), "{ray:?}");
            }
            // From a millimetre away, back through where it started.
            let back = Ray::new(ray.origin + normal * 1e-3, -normal);
            let expected = brute_force(&slat, &[], &back);
            for tree in &trees {
                assert_eq!(tree.intersect(&back), expected);
            }
        }
    }
}

#[test]
fn lanes_give_the_same_bits() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let triangles = soup(&mut rng, 3_000, 0.1);
    let trees: Vec<WideBvh> = LaneChoice::all()
        .into_iter()
        .map(|lanes| tree_for(lanes, &triangles, Preset::Medium))
        .collect();
    for _ in 0..20_000 {
        let ray = random_ray(&mut rng, 0.15);
        for tree in &trees[1..] {
            assert_eq!(tree.intersect(&ray), trees[0].intersect(&ray));
            assert_eq!(tree.occluded(&ray), trees[0].occluded(&ray));
        }
    }
}

/// Without a tree, alone and together, on every kind of lanes: the hit of brute force to the last
/// bit, where triangles share vertices and edges and where they do not.
#[test]
fn a_few_triangles_are_brute_force() {
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    let mut scenes = vec![
        closed_mesh(5, 5, 1.0, Vec3::ZERO),
        closed_mesh(3, 5, 1e-3, Vec3::splat(0.25)),
    ];
    scenes.extend([1, 7, 8, 9, 40].map(|count| soup(&mut rng, count, 0.9)));
    for triangles in scenes {
        let best = Flat::build(&triangles).unwrap();
        let array = best.clone().on_array_lanes();
        let mut rays: Vec<Ray> = (0..2_000).map(|_| random_ray(&mut rng, 0.15)).collect();
        // Through vertices and along edges, where areas are zero.
        for ray in rays.iter_mut().step_by(3) {
            let [a, b, _] = triangles[rng.random_range(0..triangles.len())];
            let target = if rng.random() { a } else { a.midpoint(b) };
            ray.direction = target - ray.origin;
        }
        let (mut batch, mut found) = (RayBatch::NOWHERE, HitBatch::NONE);
        let mut hits = 0;
        for rays in rays.chunks(RayBatch::CAPACITY) {
            let expected: Vec<Option<Hit>> =
                rays.iter().map(|ray| brute_force(&triangles, &[], ray)).collect();
            hits += expected.iter().flatten().count();
            batch.fill(rays);
            for flat in [&best, &array] {
                flat.intersect_batch(&batch, rays.len(), &mut found);
                let occluded = flat.occluded_batch(&batch, rays.len());
                for (index, (ray, &expected)) in rays.iter().zip(&expected).enumerate() {
                    assert_eq!(flat.intersect(ray), expected, "{ray:?} alone");
                    assert_eq!(found.get(index), expected, "{ray:?} together");
                    assert_eq!(flat.occluded(ray), expected.is_some());
                    assert_eq!(occluded >> index & 1 == 1, expected.is_some());
                }
            }
        }
        assert!(hits > 20, "{hits} hits say little");
    }
}

#[test]
fn too_many_triangles_need_a_tree() {
    let mut rng = Pcg64Mcg::seed_from_u64(8);
    // Separate triangles have three vertices each; those of a mesh share them.
    assert!(Flat::build(&soup(&mut rng, 40, 0.1)).is_some());
    assert!(Flat::build(&soup(&mut rng, 41, 0.1)).is_none());
    let mesh = closed_mesh(5, 5, 1.0, Vec3::ZERO);
    assert_eq!(mesh.len(), 40);
    assert!(Flat::build(&mesh).is_some());
    let mut one_more = mesh.clone();
    one_more.push(mesh[0]);
    assert!(Flat::build(&one_more).is_none());
    assert!(Flat::build(&soup(&mut rng, 5_000, 0.1)).is_none());
}

/// Rays in batches against single rays, bit for bit, for every number up to more than are in flight
/// at once.
#[test]
fn many_rays_are_traced_as_one_is() {
    let mut rng = Pcg64Mcg::seed_from_u64(6);
    let triangles = soup(&mut rng, 2_000, 0.1);
    let spheres = [Sphere {
        center: Vec3::ZERO,
        radius: 0.4,
    }];
    let of_kinds = AcceleratorKind::ALL
        .iter()
        .map(|&(_, kind)| Accelerator::build(&triangles, &spheres, kind, Preset::Fast));
    // Large ones, so that rays that are no longer asked about would be seen to hit.
    let few = soup(&mut rng, 20, 0.9);
    let few = Accelerator::build(&few, &[], AcceleratorKind::Wide, Preset::Fast);
    assert!(matches!(few.tree, Tree::Flat(_)));
    let (mut batch, mut found) = (RayBatch::NOWHERE, HitBatch::NONE);
    for tree in of_kinds.chain([few]) {
        for count in (0..40).chain([63, 64, 65, 1_000]) {
            let rays: Vec<Ray> = (0..count).map(|_| random_ray(&mut rng, 0.1)).collect();
            let (mut hits, mut occluded) = (vec![None; count], vec![false; count]);
            tree.intersect_many(&rays, &mut hits);
            tree.occluded_many(&rays, &mut occluded);
            for (ray, (hit, occluded)) in rays.iter().zip(hits.iter().zip(&occluded)) {
                assert_eq!(tree.intersect(ray), *hit);
                assert_eq!(tree.occluded(ray), *occluded);
                assert_eq!(*occluded, hit.is_some());
            }
            if count > RayBatch::CAPACITY {
                continue;
            }
            batch.fill(&rays);
            tree.intersect_batch(&batch, count, &mut found);
            let bits = tree.occluded_batch(&batch, count);
            for index in 0..count {
                assert_eq!(batch.get(index), rays[index]);
                assert_eq!(found.get(index), hits[index]);
                assert_eq!(bits >> index & 1 == 1, occluded[index]);
            }
            assert!(
                count == 64 || bits >> count == 0,
                "rays that were not asked about"
            );
        }
    }
}

/// A sphere of triangles, with vertices shared bit for bit; noise and a shear make its edges point
/// everywhere.
fn closed_mesh(rings: u32, segments: u32, scale: f32, offset: Vec3) -> Vec<[Vec3; 3]> {
    let vertex = |ring: u32, segment: u32| {
        let (theta, phi) = (
            std::f32::consts::PI * ring as f32 / rings as f32,
            std::f32::consts::TAU * (segment % segments) as f32 / segments as f32,
        );
        let (sin, cos) = if ring == 0 || ring == rings {
            (0.0, theta.cos())
        } else {
            theta.sin_cos()
        };
        let p = Vec3::new(sin * phi.cos(), sin * phi.sin(), cos);
        (p + Vec3::new(0.3 * p.y, 0.1 * p.z, 0.2 * p.x)) * scale + offset
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for segment in 0..segments {
            let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(r, s)| vertex(ring + r, segment + s));
            if ring != rings - 1 {
                triangles.push([a, b, c]);
            }
            if ring != 0 {
                triangles.push([a, c, d]);
            }
        }
    }
    triangles
}

/// Rays from inside a closed mesh that aim at its edges and vertices.
fn count_leaks(tree: &Accelerator, triangles: &[[Vec3; 3]], center: Vec3, scale: f32, rays: u32) -> u32 {
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    let mut leaks = 0;
    let (mut batch, mut hits) = (RayBatch::NOWHERE, HitBatch::NONE);
    for i in 0..rays {
        let corners = triangles[rng.random_range(0..triangles.len())];
        let target = match i % 4 {
            0 => corners[0],
            1 | 2 => corners[1].lerp(corners[2], rng.random()),
            _ => (corners[0] + corners[1] + corners[2]) / 3.0,
        };
        let origin = center + uniform(&mut rng) * 0.3 * scale;
        batch.set(i as usize, &Ray::new(origin, target - origin));
        let count = i as usize % RayBatch::CAPACITY + 1;
        if count == RayBatch::CAPACITY || i + 1 == rays {
            tree.intersect_batch(&batch, count, &mut hits);
            leaks += (0..count).filter(|&index| hits.get(index).is_none()).count() as u32;
        }
    }
    leaks
}

#[test]
fn no_ray_leaks_through_a_closed_mesh() {
    // The ten million rays are spread over scales and places, all aimed where a leak would be.
    for (scale, offset) in [
        (1.0, Vec3::ZERO),
        (1e-4, Vec3::ZERO),
        (1e6, Vec3::ZERO),
        (1.0, Vec3::splat(100.0)),
    ] {
        let triangles = closed_mesh(24, 40, scale, offset);
        let tree = Accelerator::build(&triangles, &[], AcceleratorKind::Wide, Preset::High);
        assert_eq!(
            count_leaks(&tree, &triangles, offset, scale, 2_500_000),
            0,
            "scale {scale}, offset {offset}"
        );
        let few = closed_mesh(4, 6, scale, offset);
        let flat = Accelerator::build(&few, &[], AcceleratorKind::Wide, Preset::High);
        assert!(matches!(flat.tree, Tree::Flat(_)));
        assert_eq!(
            count_leaks(&flat, &few, offset, scale, 250_000),
            0,
            "without a tree: scale {scale}, offset {offset}"
        );
    }
}

/// The test above can fail: a test of triangles that counts a zero area as outside loses rays.
#[test]
fn a_test_that_excludes_edges_leaks() {
    let triangles = closed_mesh(24, 40, 1.0, Vec3::ZERO);
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let mut leaks = 0;
    for _ in 0..2_000 {
        let target = triangles[rng.random_range(0..triangles.len())][0];
        let origin = uniform(&mut rng) * 0.3;
        let ray = Ray::new(origin, target - origin);
        let strictly_inside = |hit: Hit| {
            let [u, v] = hit.barycentric;
            u > 0.0 && v > 0.0 && u + v < 1.0
        };
        let hit = triangles
            .iter()
            .filter_map(|corners| intersect_triangle(&ray, corners, 0, f32::INFINITY))
            .any(strictly_inside);
        leaks += u32::from(!hit);
    }
    assert!(leaks > 100, "{leaks} leaks");
}

/// Boxes so large that their areas overflow: no cost tells what a leaf is, and leaves still hold
/// eight triangles at most.
#[test]
fn areas_that_overflow_make_a_tree_all_the_same() {
    let mut rng = Pcg64Mcg::seed_from_u64(31);
    for size in [1e18, 1e20, 1e30] {
        let mut triangles = soup(&mut rng, 60, 1.0);
        triangles.iter_mut().flatten().for_each(|corner| *corner *= size);
        let spheres = [Sphere {
            center: Vec3::ZERO,
            radius: 1.0,
        }];
        for quality in [Preset::Fastest, Preset::Best] {
            let accelerator = with_tree(&triangles, &spheres, quality);
            // Crossing it ends.
            accelerator.intersect(&Ray::new(Vec3::Z * 2.0 * size, Vec3::NEG_Z));
        }
    }
}
