//! Trees for each kind of lanes.

use super::build::nodes_for;
use super::{Instances, Nodes, Primitives, WideBvh, build_for};
use crate::accel::Ray;
use crate::accel::tests::{soup, uniform};
use glam::Vec3;
use lightshed_bvh::{Bvh, Preset};
use lightshed_lanes::LaneChoice;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

fn build(lanes: LaneChoice, triangles: &[[Vec3; 3]]) -> WideBvh {
    let primitives = Primitives {
        triangles,
        spheres: &[],
        instances: Instances::default(),
    };
    let tree = Bvh::build(triangles, Preset::High.options()).unwrap();
    build_for(lanes, tree, triangles, primitives)
}

#[test]
fn nodes_have_sixteen_children_where_lanes_have() {
    let mut rng = Pcg64Mcg::seed_from_u64(61);
    let triangles = soup(&mut rng, 2_000, 0.1);
    for lanes in LaneChoice::all() {
        let tree = build(lanes, &triangles);
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
        let tree = build(lanes, &triangles);
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
