//! The tree's structure; what it samples is tested for all samplers alike.

use super::*;
use crate::block::{LightNode, WIDTH};
use crate::normals::BallLanes;
use crate::testing::{Layout, lights_of};
use crate::tree::Tree;
use crate::{Light, LightError};
use lightshed_lanes::{ArrayLanes, LaneWords};

/// A level built from the leaves in one go, by halving again and again.
fn level_from_leaves(tree: &PerfectTree, level: u32) -> Vec<LightNode> {
    let count = tree.lights();
    let mut nodes: Vec<_> = (0..count.next_power_of_two())
        .map(|leaf| match leaf < count {
            true => tree.block(tree.depth(), leaf as u32).node(leaf % WIDTH),
            false => LightNode::BOGUS,
        })
        .collect();
    for _ in level..tree.depth() {
        nodes = nodes.chunks(2).map(|pair| union(&pair[0], &pair[1])).collect();
    }
    nodes
}

/// Both together, one by one; bogus nodes do not count.
fn union(a: &LightNode, b: &LightNode) -> LightNode {
    let lanes = |node: &LightNode, lane: usize| {
        let mut block = crate::block::NodeBlock::BOGUS;
        block.set(lane, node);
        block.normals
    };
    match (a.intensity > 0.0, b.intensity > 0.0) {
        (false, _) => *b,
        (_, false) => *a,
        _ => LightNode {
            bounds: a.bounds.union(&b.bounds),
            intensity: a.intensity + b.intensity,
            normals: BallLanes::<ArrayLanes>::union(&lanes(a, 0), &lanes(b, 0)).store()[0],
        },
    }
}

/// Every node is the union of the lights below it, as found from the leaf level directly.
#[test]
fn every_level_is_that_of_the_leaves() {
    for count in [1, 2, 3, 8, 9, 63, 64, 65, 1000, 4097, 20_000] {
        let lights = lights_of(Layout::Clustered, count, 5);
        let tree = PerfectTree::new(&lights).unwrap();
        for level in 0..=tree.depth() {
            for (node, expected) in level_from_leaves(&tree, level).iter().enumerate() {
                if expected.intensity == 0.0 {
                    continue;
                }
                let found = tree.block(level, node as u32).node(node % WIDTH);
                assert_eq!(&found, expected, "node {node} of level {level} of {count} lights");
            }
        }
    }
}

/// What lies beyond the last light of a level is bogus, also in the block that holds both.
#[test]
fn beyond_the_last_light_nodes_are_bogus() {
    let tree = PerfectTree::new(&lights_of(Layout::Uniform, 1001, 1)).unwrap();
    for level in 0..=tree.depth() {
        let real = 1001usize.div_ceil(1 << (tree.depth() - level));
        let block = tree.block(level, real as u32 - 1);
        for lane in (real - 1) % WIDTH + 1..WIDTH {
            assert_eq!(block.node(lane), LightNode::BOGUS, "level {level}");
        }
    }
}

#[test]
fn total_intensity_is_that_of_all_lights() {
    for count in [1, 100, 30_000] {
        let lights = lights_of(Layout::Clustered, count, 2);
        let tree = PerfectTree::new(&lights).unwrap();
        let total: f64 = lights
            .iter()
            .map(|light| f64::from(light.intensity) * if light.cone.is_some() { 1.0 } else { 4.0 })
            .sum();
        let root = f64::from(tree.block(0, 0).node(0).intensity);
        assert!((root / total - 1.0).abs() < 1e-5, "{root} is not {total}");
    }
}

/// A tree that has been others before is the same as a new one.
#[test]
fn built_again_it_is_as_new() {
    let mut tree = PerfectTree::new(&lights_of(Layout::Uniform, 9000, 1)).unwrap();
    for (layout, count) in [
        (Layout::Clustered, 5000),
        (Layout::Uniform, 3),
        (Layout::Clustered, 9000),
    ] {
        let lights = lights_of(layout, count, 7);
        tree.rebuild(&lights).unwrap();
        let new = PerfectTree::new(&lights).unwrap();
        assert_eq!(tree.blocks, new.blocks);
        assert_eq!((&tree.light_at, &tree.leaf_of), (&new.light_at, &new.leaf_of));
    }
}

#[test]
fn what_is_refused_leaves_the_tree_as_it_was() {
    let lights = lights_of(Layout::Uniform, 100, 1);
    let mut tree = PerfectTree::new(&lights).unwrap();
    let blocks = tree.blocks.clone();
    assert_eq!(tree.rebuild(&[]), Err(LightError::Empty));
    let mut broken = lights.clone();
    broken[3].intensity = f32::NAN;
    assert_eq!(tree.rebuild(&broken), Err(LightError::Intensity(3)));
    assert_eq!(tree.blocks, blocks);
}

/// Lights of which some have moved by up to `by`.
fn moved(lights: &[Light], by: f32, which: impl Fn(usize) -> bool) -> Vec<Light> {
    let mut moved = lights.to_vec();
    for (i, light) in moved.iter_mut().enumerate().filter(|(i, _)| which(*i)) {
        let mut rng = lightshed_sampling::CounterRng::new(8, i as u32, 4);
        let offset = glam::Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * by;
        light.bounds = crate::Bounds::new(light.bounds.min + offset, light.bounds.max + offset);
    }
    moved
}

/// After every kind of update the tree holds the lights as they are now, each once, and every node
/// is the union of its own.
#[test]
fn updated_trees_hold_all_lights() {
    let lights = lights_of(Layout::Uniform, 20_000, 5);
    let first = PerfectTree::new(&lights).unwrap();
    assert_eq!(first.drift(), 1.0);
    // One part's lights exchange their places: a mirror image of the part.
    let own: Vec<u32> = first.light_at[4096..8192].to_vec();
    let mut exchanged = lights.clone();
    for (i, &light) in own.iter().enumerate() {
        let other = own[(i * 1237) % own.len()];
        exchanged[light as usize].bounds = lights[other as usize].bounds;
    }
    let cases = [
        (moved(&lights, 1e-4, |_| true), 2.0, TreeUpdate::Refitted),
        (exchanged, 2.0, TreeUpdate::PartlySorted(1)),
        (moved(&lights, 5.0, |_| true), 2.0, TreeUpdate::Rebuilt),
        (moved(&lights, 5.0, |_| true), f32::INFINITY, TreeUpdate::Refitted),
        (lights_of(Layout::Uniform, 19_999, 5), 2.0, TreeUpdate::Rebuilt),
    ];
    for (lights, limit, expected) in cases {
        let mut tree = first.clone();
        assert!(
            holds(&tree, &lights).is_err(),
            "a tree that did not follow is not noticed"
        );
        assert_eq!(tree.update(&lights, limit), Ok(expected));
        assert!(expected == TreeUpdate::Refitted || tree.drift() <= 2.0);
        holds(&tree, &lights).unwrap_or_else(|e| panic!("{expected:?}: {e}"));
        // Nor is it missed if two lights change places, or a node is not brought up to date.
        let mut wrong = tree.clone();
        wrong.light_at.swap(7, 300);
        assert!(holds(&wrong, &lights).is_err());
        let place = wrong.levels[wrong.depth() as usize - 3] as usize;
        wrong.light_at.swap(7, 300);
        wrong.blocks[place + 1].intensity[2] *= 1.5;
        assert!(holds(&wrong, &lights).is_err());
    }
}

/// Whether a tree holds these lights, each once and in its place, and every node of some levels is
/// the union of its own.
fn holds(tree: &PerfectTree, lights: &[Light]) -> Result<(), String> {
    if tree.light_at.len() != lights.len() {
        return Err("another number of lights".to_owned());
    }
    for (leaf, &light) in tree.light_at.iter().enumerate() {
        let node = tree.block(tree.depth(), leaf as u32).node(leaf % WIDTH);
        let of = &lights[light as usize];
        let same = node.intensity == 0.0 && of.intensity == 0.0 || node.bounds == of.bounds;
        if !same || tree.leaf_of[light as usize] as usize != leaf {
            return Err(format!("leaf {leaf} is not light {light}"));
        }
    }
    for level in [0, 3, tree.depth() - 3] {
        for (node, expected) in level_from_leaves(tree, level).iter().enumerate() {
            let found = tree.block(level, node as u32).node(node % WIDTH);
            if expected.intensity > 0.0 && found != *expected {
                return Err(format!("node {node} of level {level} is not that of its lights"));
            }
        }
    }
    Ok(())
}
