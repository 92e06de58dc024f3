//! Trees for each kind of lanes.

use super::build::nodes_for;
use super::{Instances, Nodes, Primitives, WideBvh};
use crate::accel::tests::{brute_force, soup, tree_for, uniform};
use crate::accel::{Hit, HitBatch, Ray, RayBatch};
use crate::{Scene, builtin};
use glam::Vec3;
use lightshed_bvh::{Bvh, Preset};
use lightshed_lanes::LaneChoice;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

#[test]
fn nodes_have_sixteen_children_where_lanes_have() {
    let mut rng = Pcg64Mcg::seed_from_u64(61);
    let triangles = soup(&mut rng, 2_000, 0.1);
    for lanes in LaneChoice::all() {
        let tree = tree_for(lanes, &triangles, Preset::High);
        let is_sixteen = matches!(tree.nodes, Nodes::Sixteen(_));
        assert_eq!(is_sixteen, lanes.name() == "avx512", "{lanes:?}");
        assert!(tree.bytes() > 2_000 * 40, "{}", tree.bytes());
    }
}

#[test]
fn trees_too_deep_have_eight_children_or_are_balanced() {
    let mut rng = Pcg64Mcg::seed_from_u64(62);
    let triangles = soup(&mut rng, 2_000, 0.1);
    let primitives = Primitives {
        triangles: &triangles,
        spheres: &[],
        instances: Instances::default(),
    };
    let binary = Bvh::build(&triangles, Preset::High.options()).unwrap();
    for lanes in LaneChoice::all() {
        let tree = tree_for(lanes, &triangles, Preset::High);
        for deepest in [[1, 20], [1, 1]] {
            let (nodes, blocks) = nodes_for(lanes, &binary, &triangles, &primitives, deepest);
            assert!(nodes.sixteen().is_none() && !nodes.eight().is_empty());
            let other = WideBvh {
                nodes,
                blocks,
                ..tree.clone()
            };
            for _ in 0..2_000 {
                let ray = Ray::new(uniform(&mut rng) * 1.5, uniform(&mut rng));
                assert_eq!(other.intersect(&ray), tree.intersect(&ray));
                assert_eq!(other.occluded(&ray), tree.occluded(&ray));
            }
        }
    }
}

/// Where boxes stand on a floor and walls meet, two surfaces are hit at distances that are equal
/// but for rounding. The least one is found in any tree, as brute force does: the rays of one in a
/// thousand depended on the tree before.
#[test]
fn surfaces_in_one_plane_are_hit_in_any_tree() {
    let scene = Scene::new(&builtin::by_name("door-gap").unwrap()).unwrap();
    let records = scene.triangle_records();
    let triangles: Vec<[Vec3; 3]> = records.iter().map(|record| record.corners).collect();
    let mut trees = Vec::new();
    for lanes in LaneChoice::all() {
        for preset in [Preset::Fast, Preset::Best] {
            trees.push(tree_for(lanes, &triangles, preset));
        }
    }
    let mut rng = Pcg64Mcg::seed_from_u64(63);
    let mut batch = RayBatch::NOWHERE;
    let mut found = HitBatch::NONE;
    for _ in 0..1_000 {
        let rays: Vec<Ray> = (0..64)
            .map(|_| {
                let record = &records[rng.random_range(0..records.len())];
                let [a, b, c] = record.corners;
                let at = a.lerp(b.lerp(c, rng.random()), rng.random());
                let side = if rng.random() { 1.0 } else { -1.0 };
                let towards = uniform(&mut rng) + record.normal * side;
                Ray::new(at + record.normal * side * 1e-4, towards)
            })
            .collect();
        batch.fill(&rays);
        let expected: Vec<Option<Hit>> = rays.iter().map(|ray| brute_force(&triangles, &[], ray)).collect();
        for tree in &trees {
            tree.intersect_batch(&batch, rays.len(), &mut found);
            for (i, (ray, &expected)) in rays.iter().zip(&expected).enumerate() {
                assert_eq!(found.get(i), expected, "{:?}: {ray:?}", tree.lanes);
                assert_eq!(tree.intersect(ray), expected, "{:?}: {ray:?}", tree.lanes);
            }
        }
    }
}
