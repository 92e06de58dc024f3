//! Octrees adapted on the device are those of the library.

use crate::programs::OCTREE_ADAPT;
use crate::tests::parity::harness::gpu;
use crate::tests::support::faulty;
use crate::{Gpu, GpuError, GpuOctree, OctreeAdapter, OctreeChange};
use glam::Vec3;
use lightshed_sampling::CounterRng;
use lightshed_spatial::{AdaptiveOctree, Bounds, Correspondence, OctreeOptions};

/// Nodes that the device has room for.
const CAPACITY: usize = 1 << 12;
/// Words of a record.
const STRIDE: usize = 3;

fn tree() -> AdaptiveOctree {
    let bounds = Bounds {
        min: Vec3::NEG_ONE,
        max: Vec3::ONE,
    };
    AdaptiveOctree::new(bounds).expect("it is a cube")
}

/// What a program of random counts does to a tree here and on the device; the first difference as
/// an error.
fn compare(gpu: &Gpu, adapter: &OctreeAdapter, seed: u64, steps: u32) -> Result<[u32; 2], String> {
    let options = OctreeOptions {
        split_above: 100,
        collapse_below: 60,
        max_depth: if seed.is_multiple_of(3) { 4 } else { 20 },
        max_nodes: CAPACITY,
    };
    let mut library = tree();
    let new = || GpuOctree::new(gpu, &tree(), CAPACITY).expect("it is small");
    let records = || {
        gpu.zeros("records", (4 * STRIDE * 8 * CAPACITY) as u64)
            .expect("they are few")
    };
    let (mut former, mut next) = (new(), new());
    let (mut former_records, mut next_records) = (records(), records());
    let mut known: Vec<[u32; STRIDE]> = (0..8).map(|slot| [slot, slot + 100, 7]).collect();
    gpu.write(&former_records, &known);
    let (mut splits, mut joins) = (0, 0);
    for step in 0..steps {
        let mut rng = CounterRng::new(seed, step, 0);
        // A random set of leaves is full, most are nearly empty; in some steps all are empty.
        let full = match step % 7 {
            5 => 0.0,
            _ => 0.5 / (1.0 + library.nodes().len() as f32 / 40.0),
        };
        // In some steps sums do not fit into a word.
        let many = if step % 5 == 2 { 1 << 31 } else { 100 };
        let counts: Vec<u32> = (0..library.slot_count())
            .map(|_| match rng.next_f32() < full {
                true => many + rng.next_u32() % 3,
                false => rng.next_u32() % 14,
            })
            .collect();
        let counts_buffer = gpu.buffer("counts", &counts).expect("they are few");
        let mut work = gpu.work();
        adapter
            .adapt(&mut work, &former, &counts_buffer, &options, &next)
            .expect("a tree can satisfy them");
        adapter
            .populate(
                &mut work,
                (&former, &former_records),
                (&next, &next_records),
                STRIDE as u32,
            )
            .expect("there is room");
        work.submit();
        let changed = library.adapt(&counts, &options).expect("there is room");
        let nodes = library.nodes().len();
        let expected = OctreeChange {
            nodes: nodes as u32,
            changed,
        };
        let found = next.change(gpu).map_err(|error| error.to_string())?;
        if found != expected {
            return Err(format!("step {step}: {found:?}, but {expected:?}"));
        }
        let words: Vec<u32> = gpu.read(&next.nodes, nodes).expect("the device answers");
        if words != bytemuck::cast_slice::<_, u32>(library.nodes()) {
            return Err(format!("step {step}: nodes of {nodes}"));
        }
        let parents: Vec<u32> = gpu.read(&next.parents, nodes).expect("the device answers");
        let depths: Vec<u32> = gpu.read(&next.depths, nodes).expect("the device answers");
        let was: Vec<u32> = gpu
            .read(&next.correspondences, 8 * nodes)
            .expect("the device answers");
        for slot in 0..library.slot_count() as u32 {
            let node = slot as usize / 8;
            let is_placed = depths[node] + 1 == library.depth(slot)
                && (node == 0 || !library.is_leaf(parents[node]) && parents[node] / 8 < node as u32);
            let expected = match library.correspondence(slot) {
                None => u32::MAX,
                Some(Correspondence::Same(slot)) => slot,
                Some(Correspondence::PartOf(slot)) => slot | 1 << 27,
                Some(Correspondence::Joined(slot)) => slot | 2 << 27,
            };
            splits += u32::from(expected >> 27 == 1);
            joins += u32::from(expected >> 27 == 2);
            if !is_placed || was[slot as usize] != expected {
                return Err(format!("step {step}: slot {slot} of {nodes} nodes"));
            }
        }
        // The parents say where each node is, once more by the way down.
        for (node, &parent) in parents.iter().enumerate().take(nodes).skip(1) {
            let above = library.nodes()[parent as usize / 8];
            if above.is_leaf(parent % 8) || above.inner(parent % 8) != node as u32 {
                return Err(format!("step {step}: the parent of node {node}"));
            }
        }
        known = library.populate(&known);
        let records: Vec<[u32; STRIDE]> = gpu.read(&next_records, 8 * nodes).expect("the device answers");
        if records != known {
            return Err(format!("step {step}: records of {nodes} nodes"));
        }
        // What nobody else has: new leaves differ in the next step.
        for (slot, record) in known.iter_mut().enumerate() {
            record[0] ^= (slot as u32).wrapping_mul(0x9e37_79b9);
        }
        gpu.write(&next_records, &known);
        (former, next) = (next, former);
        (former_records, next_records) = (next_records, former_records);
    }
    Ok([splits, joins])
}

/// Programs of splits and joins make the library's nodes, depths, parents and correspondences, and
/// move records as it does. What is planted is found.
#[test]
fn octrees_follow_samples_as_the_librarys_do() {
    let Some(gpu) = gpu() else { return };
    let adapter = OctreeAdapter::new(gpu).expect("the device takes the kernels");
    for seed in 0..4 {
        let [splits, joins] =
            compare(gpu, &adapter, seed, 16).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        assert!(splits > 200 && joins > 20, "{splits} and {joins}");
    }
    for fault in [
        ["> thresholds.split_above", ">= thresholds.split_above"],
        ["< thresholds.collapse_below", "<= thresholds.collapse_below"],
        [
            "depth + 1u < thresholds.max_depth",
            "depth < thresholds.max_depth",
        ],
        ["min(count, ~together)", "count"],
        ["count > most", "count >= most"],
        ["let first_inner = next;", "let first_inner = next + 1u;"],
        [
            "octree_depths[next] = depth + 1u;",
            "octree_depths[next] = depth;",
        ],
        ["source < ", "source + 1u < "],
    ] {
        let program = faulty(OCTREE_ADAPT, fault);
        let adapter = OctreeAdapter::of_program(gpu, &program).expect("it is a program");
        let found = (0..4).try_for_each(|seed| compare(gpu, &adapter, seed, 16).map(|_| ()));
        assert!(found.is_err(), "{fault:?}");
    }
}

/// Too many nodes are an error, and the former tree is as it was; so are options that no tree can
/// satisfy, and records without room.
#[test]
fn octrees_without_room_are_refused() {
    let Some(gpu) = gpu() else { return };
    let adapter = OctreeAdapter::new(gpu).expect("the device takes the kernels");
    let new = || GpuOctree::new(gpu, &tree(), CAPACITY).expect("it is small");
    let (former, next) = (new(), new());
    let counts = gpu.buffer("counts", &[1000u32; 8]).expect("they are few");
    let options = OctreeOptions {
        max_nodes: 8,
        ..OctreeOptions::default()
    };
    let options = OctreeOptions {
        split_above: 100,
        collapse_below: 50,
        ..options
    };
    let adapt = |options: &OctreeOptions| {
        let mut work = gpu.work();
        let result = adapter.adapt(&mut work, &former, &counts, options, &next);
        work.submit();
        result
    };
    // Nine nodes are asked for.
    assert_eq!(adapt(&options), Ok(()));
    assert!(matches!(next.change(gpu), Err(GpuError::Settings(_))));
    assert_eq!(former.change(gpu).map(|change| change.nodes), Ok(1));
    let nine = OctreeOptions {
        max_nodes: 9,
        ..options
    };
    assert_eq!(adapt(&nine), Ok(()));
    assert_eq!(next.change(gpu).map(|change| change.nodes), Ok(9));
    let crossed = OctreeOptions {
        collapse_below: 101,
        ..options
    };
    assert!(matches!(adapt(&crossed), Err(GpuError::Settings(_))));
    let records = gpu
        .zeros("records", 8 * 4 * CAPACITY as u64 - 4)
        .expect("they are few");
    let refused = adapter.populate(&mut gpu.work(), (&former, &counts), (&next, &records), 1);
    assert!(matches!(refused, Err(GpuError::Settings(_))));
}
