//! The octree that follows samples, against lists of all its leaves.

use lightshed_sampling::CounterRng;
use lightshed_spatial::glam::Vec3;
use lightshed_spatial::{
    AdaptiveOctree, Bounds, Correspondence, MAX_OCTREE_DEPTH, OctreeCell, OctreeError, OctreeNeighbours,
    OctreeNode, OctreeOptions,
};
use lightshed_testkit::check_faults;

const UNIT: Bounds = Bounds {
    min: Vec3::ZERO,
    max: Vec3::ONE,
};

const OPTIONS: OctreeOptions = OctreeOptions {
    split_above: 40,
    collapse_below: 20,
    max_depth: MAX_OCTREE_DEPTH,
    max_nodes: 1 << 12,
};

/// Positions of frame number `frame`: a dense ball that wanders, a plane, and a few anywhere.
fn positions(frame: u32, count: u32) -> Vec<Vec3> {
    let centre = Vec3::new(
        0.5 + 0.4 * (frame as f32).sin(),
        0.3,
        0.5 + 0.4 * (frame as f32).cos(),
    );
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(u64::from(frame), i, 0);
            let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            match i % 4 {
                0 | 1 => centre + 0.01 * place,
                2 => place.with_y(0.25),
                _ => place,
            }
        })
        .collect()
}

fn count(tree: &AdaptiveOctree, positions: &[Vec3]) -> Vec<u32> {
    let mut counts = vec![0; tree.slot_count()];
    for slot in positions.iter().filter_map(|&position| tree.slot(position)) {
        counts[slot as usize] += 1;
    }
    counts
}

/// Lower corner and end of a cell in units of the finest cells.
fn span(cell: OctreeCell) -> [[u32; 2]; 3] {
    let shift = MAX_OCTREE_DEPTH - cell.depth;
    cell.coordinates.map(|c| [c << shift, (c + 1) << shift])
}

/// The leaf that has a position, by looking at all.
fn naive_slot(tree: &AdaptiveOctree, position: Vec3) -> Option<u32> {
    let units = (position - tree.min()) * ((1 << MAX_OCTREE_DEPTH) as f32 / tree.side());
    let inside = |slot: &u32| {
        let span = span(tree.cell(*slot));
        (0..3).all(|axis| (span[axis][0] as f32..span[axis][1] as f32).contains(&units[axis]))
    };
    let mut found = tree.leaves().filter(inside);
    let slot = found.next();
    assert_eq!(found.next(), None, "two leaves have {position}");
    slot
}

/// Leaves whose faces share an area, by looking at all pairs.
fn naive_neighbours(tree: &AdaptiveOctree, slot: u32) -> Vec<u32> {
    let own = span(tree.cell(slot));
    let touches = |other: &u32| {
        let other = span(tree.cell(*other));
        let overlaps = |axis: usize| own[axis][0].max(other[axis][0]) < own[axis][1].min(other[axis][1]);
        let meets = |axis: usize| own[axis][0] == other[axis][1] || own[axis][1] == other[axis][0];
        (0..3).any(|axis| meets(axis) && (0..3).all(|a| a == axis || overlaps(a)))
    };
    tree.leaves().filter(touches).collect()
}

/// What holds for every tree.
fn check_tree(tree: &AdaptiveOctree) -> Result<(), String> {
    let leaves: Vec<u32> = tree.leaves().collect();
    if leaves.len() != tree.leaf_count() {
        return Err(format!("{} leaves, not {}", leaves.len(), tree.leaf_count()));
    }
    // Together they fill the cube.
    let volume: f64 = leaves
        .iter()
        .map(|&slot| 0.125f64.powi(tree.depth(slot) as i32))
        .sum();
    if volume != 1.0 {
        return Err(format!("leaves fill {volume} of the cube"));
    }
    // Breadth first: depths do not fall, inner children stand where their parents say.
    let mut inner = 1;
    let mut depth = 0;
    for (index, node) in (0u32..).zip(tree.nodes()) {
        if tree.depth(8 * index) < depth {
            return Err(format!("node {index} is out of order"));
        }
        depth = tree.depth(8 * index);
        for child in (0..8).filter(|&child| !node.is_leaf(child)) {
            if node.inner(child) != inner {
                return Err(format!("child {child} of node {index} is not at {inner}"));
            }
            inner += 1;
        }
    }
    match tree.with_nodes(tree.nodes()) {
        Ok(again) if again.nodes() == tree.nodes() => Ok(()),
        other => Err(format!("saved nodes give {other:?}")),
    }
}

/// A program of frames with other numbers of samples; each tree against the naive searches, and its
/// leaves against those of the tree before.
#[test]
fn the_tree_follows_samples() {
    let mut tree = AdaptiveOctree::new(UNIT).unwrap();
    let mut largest = 0;
    for frame in 0..24 {
        let samples = positions(frame / 6, [3000, 500, 0, 6000][frame as usize / 6]);
        let (before, counts) = (tree.clone(), count(&tree, &samples));
        tree.adapt(&counts, &OPTIONS).unwrap();
        check_tree(&tree).unwrap();
        largest = largest.max(tree.nodes().len());
        for slot in tree.leaves() {
            let own = span(tree.cell(slot));
            let correspondence = tree.correspondence(slot).unwrap();
            let was = before.cell(correspondence.slot());
            let depth = was.depth;
            let (count, together) = (counts[correspondence.slot() as usize], |first: u32| -> u32 {
                counts[first as usize..first as usize + 8].iter().sum()
            });
            let first = correspondence.slot() / 8 * 8;
            match correspondence {
                Correspondence::Same(_) => {
                    assert_eq!(span(was), own);
                    assert!(count <= OPTIONS.split_above);
                }
                Correspondence::PartOf(_) => {
                    assert_eq!(depth + 1, tree.depth(slot));
                    assert!((0..3).all(|a| span(was)[a][0] <= own[a][0] && own[a][1] <= span(was)[a][1]));
                    assert!(count > OPTIONS.split_above);
                }
                Correspondence::Joined(_) => {
                    assert_eq!(depth, tree.depth(slot) + 1);
                    assert!((0..3).all(|a| own[a][0] <= span(was)[a][0] && span(was)[a][1] <= own[a][1]));
                    assert!(together(first) < OPTIONS.collapse_below);
                    assert!(
                        counts[first as usize..first as usize + 8]
                            .iter()
                            .all(|&other| other <= count)
                    );
                }
            }
        }
        // Records go with their leaves.
        let records: Vec<u32> = (0..before.slot_count() as u32).collect();
        let populated = tree.populate(&records);
        assert!(
            tree.leaves()
                .all(|slot| populated[slot as usize] == tree.correspondence(slot).unwrap().slot())
        );
    }
    assert!(largest > 30, "only {largest} nodes");
    // Without samples nothing but the root is left, a level a frame.
    for _ in 0..MAX_OCTREE_DEPTH {
        tree.adapt(&vec![0; tree.slot_count()], &OPTIONS).unwrap();
    }
    assert_eq!(tree.nodes().len(), 1);
}

/// The memory follows the samples of a frame: each inner node over leaves alone has
/// `collapse_below` samples once the tree has settled, and lies on the way to one.
#[test]
fn memory_is_bounded_by_samples() {
    let mut tree = AdaptiveOctree::new(UNIT).unwrap();
    for frame in 0..40 {
        let samples = positions(frame, 4000);
        for _ in 0..3 {
            let counts = count(&tree, &samples);
            tree.adapt(&counts, &OPTIONS).unwrap();
        }
        let lowest = tree
            .nodes()
            .iter()
            .filter(|node| node.leaf_mask() == 0xff)
            .count();
        assert!(
            lowest <= 4000 / 20 + 4000 / 40,
            "{lowest} lowest nodes in frame {frame}"
        );
    }
}

/// Single and paired traversals against a search through all leaves, also on borders and outside. A
/// tree with one wrong offset is found.
#[test]
fn traversals_agree_with_a_naive_search() {
    let mut tree = AdaptiveOctree::new(UNIT).unwrap();
    for frame in 0..6 {
        let counts = count(&tree, &positions(0, 2000 + frame));
        tree.adapt(&counts, &OPTIONS).unwrap();
    }
    let mut probes = positions(0, 150);
    for slot in tree.leaves().step_by(7) {
        let Bounds { min, max } = tree.bounds(slot);
        probes.extend([min, max, 0.5 * (min + max)]);
    }
    probes.extend([-1.0, -0.0, 2.0, f32::NAN, f32::INFINITY].map(Vec3::splat));
    check_faults(&[0u32, 1, 2], |fault| {
        let slot = |position| {
            let slot = tree.slot(position);
            if fault == Some(0) {
                slot.map(|slot| slot ^ 1)
            } else {
                slot
            }
        };
        for (i, &probe) in probes.iter().enumerate() {
            if slot(probe) != naive_slot(&tree, probe) {
                return Err(format!("{probe}"));
            }
            // Near and far.
            for before in [probes[(7 * i) % probes.len()], probe + 1e-4, probe] {
                let mut pair = tree.slots_of_pair(probe, before);
                if fault == Some(1) {
                    pair[1] = pair[0];
                }
                if pair != [tree.slot(probe), tree.slot(before)] {
                    return Err(format!("{probe} and {before}"));
                }
            }
            // Less and more than a leaf away.
            for offset in [Vec3::new(0.4, -0.3, 0.1), Vec3::new(-5.0, 0.0, 2.5), Vec3::ZERO] {
                let expected = tree
                    .slot(probe)
                    .map(|slot| (slot, tree.slot(probe + tree.leaf_side(slot) * offset)));
                let mut moved = tree.slot_moved(probe, offset);
                if let (Some(2), Some((slot, moved))) = (fault, &mut moved) {
                    *moved = Some(*slot);
                }
                if moved != expected {
                    return Err(format!("{probe} moved by {offset}"));
                }
            }
        }
        Ok(())
    })
    .unwrap();
}

#[test]
fn neighbours_are_all_that_touch() {
    let mut tree = AdaptiveOctree::new(UNIT).unwrap();
    for _ in 0..5 {
        let counts = count(&tree, &positions(3, 1500));
        tree.adapt(&counts, &OPTIONS).unwrap();
    }
    let neighbours = OctreeNeighbours::new(&tree);
    let mut finer = 0;
    for slot in 0..tree.slot_count() as u32 + 3 {
        if !tree.is_leaf(slot) {
            assert!(neighbours.of(slot).is_empty());
            continue;
        }
        let mut found = neighbours.of(slot).to_vec();
        finer += found
            .iter()
            .filter(|&&other| tree.depth(other) > tree.depth(slot))
            .count();
        found.sort_unstable();
        assert_eq!(found, naive_neighbours(&tree, slot), "of {slot}");
    }
    assert!(finer > 50, "only {finer} on finer sides");
}

#[test]
fn limits_are_errors_and_leave_the_tree() {
    let mut tree = AdaptiveOctree::new(UNIT).unwrap();
    let counts = count(&tree, &positions(1, 3000));
    let narrow = OctreeOptions {
        max_nodes: 3,
        ..OPTIONS
    };
    assert_eq!(tree.adapt(&counts, &narrow), Err(OctreeError::TooManyNodes(3)));
    assert_eq!(tree.nodes().len(), 1);
    assert_eq!(
        tree.adapt(&[1], &OPTIONS),
        Err(OctreeError::Counts { counts: 1, slots: 8 })
    );
    for (options, error) in [
        (
            OctreeOptions {
                collapse_below: 41,
                ..OPTIONS
            },
            OctreeError::Thresholds {
                split_above: 40,
                collapse_below: 41,
            },
        ),
        (
            OctreeOptions {
                max_depth: 21,
                ..OPTIONS
            },
            OctreeError::Depth(21),
        ),
        (
            OctreeOptions {
                max_nodes: (1 << 24) + 1,
                ..OPTIONS
            },
            OctreeError::NodeLimit((1 << 24) + 1),
        ),
    ] {
        assert_eq!(tree.adapt(&counts, &options), Err(error));
    }
    // No deeper than asked.
    let shallow = OctreeOptions {
        max_depth: 3,
        ..OPTIONS
    };
    for _ in 0..6 {
        let counts = count(&tree, &positions(1, 3000));
        tree.adapt(&counts, &shallow).unwrap();
    }
    assert_eq!(tree.leaves().map(|slot| tree.depth(slot)).max(), Some(3));
    for bounds in [
        Bounds {
            min: Vec3::ONE,
            max: Vec3::ZERO,
        },
        Bounds {
            min: Vec3::ZERO,
            max: Vec3::ZERO,
        },
        Bounds {
            min: Vec3::ZERO,
            max: Vec3::splat(f32::INFINITY),
        },
        Bounds {
            min: Vec3::splat(f32::NAN),
            max: Vec3::ONE,
        },
    ] {
        assert_eq!(AdaptiveOctree::new(bounds).unwrap_err(), OctreeError::Bounds);
    }
    // Nodes that are no tree: cut off, and such as point at each other.
    let nodes = tree.nodes().to_vec();
    assert_eq!(tree.with_nodes(&nodes[1..]).unwrap_err(), OctreeError::Damaged);
    assert_eq!(tree.with_nodes(&[]).unwrap_err(), OctreeError::Damaged);
    let damaged: Vec<OctreeNode> = nodes.iter().rev().copied().collect();
    assert_eq!(tree.with_nodes(&damaged).unwrap_err(), OctreeError::Damaged);
}
