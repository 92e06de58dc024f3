//! Trees built on the device are those of the library.

use crate::tests::parity::harness::gpu;
use crate::{BvhBuilder, Gpu, GpuBvh};
use glam::Vec3;
use lightshed_bvh::{Bounds, Bvh, Method, Node};
use lightshed_sampling::CounterRng;

pub(super) fn bits(nodes: &[Node], order: &[u32]) -> [Vec<u32>; 2] {
    [bytemuck::cast_slice(nodes).to_vec(), order.to_vec()]
}

/// Nodes and the order of the leaves, as the buffers hold them.
pub(super) fn read(gpu: &Gpu, tree: &GpuBvh) -> [Vec<u32>; 2] {
    let count = tree.boxes() as usize;
    let nodes: Vec<Node> = gpu.read(&tree.nodes, 2 * count - 1).expect("the device answers");
    let order: Vec<u32> = gpu.read(&tree.order, count).expect("the device answers");
    bits(&nodes, &order)
}

fn built(gpu: &Gpu, builder: &BvhBuilder, boxes: &[Bounds]) -> (GpuBvh, [Vec<u32>; 2]) {
    let buffer = gpu.buffer("boxes", boxes).expect("they are few");
    let tree = GpuBvh::new(gpu, boxes.len()).expect("it is small");
    let mut work = gpu.work();
    // Twice, as a tree must not depend on what it was.
    builder.build(&mut work, &buffer, &tree);
    builder.build(&mut work, &buffer, &tree);
    work.submit();
    let found = read(gpu, &tree);
    (tree, found)
}

fn truth(boxes: &[Bounds]) -> [Vec<u32>; 2] {
    let tree = Bvh::build(boxes, Method::Curve).expect("they are boxes");
    bits(tree.nodes(), tree.order())
}

/// Small boxes everywhere.
pub(super) fn boxes(count: u32, seed: u64) -> Vec<Bounds> {
    layout(count, seed, |_, at, size| Bounds::new(at, at + size * 0.05))
}

/// By index, a place in `[−1, 1)³` and a size in `[0, 1)³`.
fn layout(count: u32, seed: u64, of: impl Fn(u32, Vec3, Vec3) -> Bounds) -> Vec<Bounds> {
    (0..count)
        .map(|index| {
            let mut rng = CounterRng::new(seed, index, 7);
            let mut vector = || Vec3::from_array([(); 3].map(|()| rng.next_f32()));
            of(index, vector() * 2.0 - 1.0, vector())
        })
        .collect()
}

/// Sets that a build may stumble over. Coordinates of any size, but no areas that underflow once
/// the boxes are scaled: a device may take those for zero.
pub(super) fn hostile() -> Vec<(&'static str, Vec<Bounds>)> {
    let by = |factor: f32| {
        layout(3000, 3, move |_, at, size| {
            Bounds::new(at * factor, (at + size * 0.05) * factor)
        })
    };
    vec![
        (
            "one box",
            layout(3000, 1, |_, _, _| Bounds::new(Vec3::ONE, Vec3::splat(2.0))),
        ),
        (
            "one point",
            layout(3000, 1, |_, _, _| Bounds::of_point(Vec3::new(1.0, -2.0, 3.0))),
        ),
        (
            "two points",
            layout(3000, 1, |i, _, _| Bounds::of_point(Vec3::splat((i % 2) as f32))),
        ),
        (
            "a line",
            layout(5000, 1, |_, at, _| Bounds::of_point(Vec3::X * at.x)),
        ),
        ("points", layout(5000, 1, |_, at, _| Bounds::of_point(at))),
        (
            "far away",
            layout(5000, 1, |_, at, size| {
                Bounds::new(at + 1e6, at + 1e6 + size * 0.05)
            }),
        ),
        (
            "a crowd",
            layout(9000, 1, |i, at, size| {
                let at = if i % 100 == 0 { at } else { at * 1e-4 };
                Bounds::new(at, at + size * 1e-6)
            }),
        ),
        (
            "a few as large as all",
            layout(3000, 1, |i, at, size| match i % 50 {
                0 => Bounds::new(Vec3::NEG_ONE, Vec3::splat(1.05)),
                _ => Bounds::new(at, at + size * 0.05),
            }),
        ),
        (
            "a lattice",
            layout(5000, 1, |_, at, _| {
                let low = (at * 4.0).round() * 0.25;
                Bounds::new(low, low + 0.25)
            }),
        ),
        (
            "negative zeros",
            layout(600, 1, |i, at, _| {
                let at = (at * 0.6).round() * if i % 2 == 0 { 1.0 } else { -1.0 };
                Bounds::new(at.min(-at), at.max(-at))
            }),
        ),
        ("1e38", by(1e38)),
        ("1e13", by(1e13)),
        ("1e-10", by(1e-10)),
        ("1e-38", by(1e-38)),
        ("subnormal", by(1e-43)),
        (
            "1e38 and zero",
            layout(3000, 1, |i, at, _| match i % 3 {
                0 => Bounds::of_point(Vec3::ZERO),
                _ => Bounds::of_point(at * 3e38),
            }),
        ),
    ]
}

#[test]
fn trees_are_the_same_node_for_node() {
    let Some(gpu) = gpu() else { return };
    let builder = BvhBuilder::new(gpu).expect("the device takes the kernels");
    let check = |name: &str, boxes: &[Bounds]| {
        let (tree, found) = built(gpu, &builder, boxes);
        assert_eq!(tree.wrong(gpu), Ok(None));
        for (part, (found, truth)) in ["nodes", "order"].iter().zip(found.iter().zip(&truth(boxes))) {
            let first = found.iter().zip(truth).position(|(a, b)| a != b);
            assert!(
                found == truth,
                "{name}: {part} of {} boxes differ from word {first:?} on",
                boxes.len()
            );
        }
    };
    for count in [
        1, 2, 3, 7, 8, 9, 16, 63, 64, 65, 511, 512, 513, 2048, 2049, 5000, 60_000,
    ] {
        check("random", &boxes(count, 1));
    }
    for (name, boxes) in hostile() {
        check(name, &boxes);
    }

    // Planted: one box that has grown by a unit in the last place is seen, and so is another order
    // of equal ones.
    let plain = boxes(3000, 3);
    let (_, found) = built(gpu, &builder, &plain);
    let mut grown = plain;
    grown[1234].max.x = grown[1234].max.x.next_up();
    assert!(found != truth(&grown));
    let mut equal = vec![Bounds::of_point(Vec3::ONE); 100];
    let (_, found) = built(gpu, &builder, &equal);
    assert_eq!(found, truth(&equal));
    equal[99].min.x -= 1e-3;
    assert!(found != truth(&equal));
}

/// A tree over boxes that have moved has the nodes that the library's refit gives it.
#[test]
fn refits_are_the_same() {
    let Some(gpu) = gpu() else { return };
    let builder = BvhBuilder::new(gpu).expect("the device takes the kernels");
    for count in [1, 2, 9, 64, 65, 3000] {
        let (at_rest, moved) = (boxes(count, 1), boxes(count, 2));
        let (tree, built) = built(gpu, &builder, &at_rest);
        let buffer = gpu.buffer("moved boxes", &moved).expect("they are few");
        let mut work = gpu.work();
        builder.refit(&mut work, &buffer, &tree);
        work.submit();
        let mut library = Bvh::build(&at_rest, Method::Curve).expect("they are boxes");
        library.refit(&moved).expect("they are boxes");
        let found = read(gpu, &tree);
        assert!(found == bits(library.nodes(), library.order()), "{count} boxes");
        // What a refit that does nothing leaves.
        assert!(found != built, "{count} boxes");
    }
}

/// What is no box is named: the first one.
#[test]
fn what_is_no_box_is_named() {
    let Some(gpu) = gpu() else { return };
    let builder = BvhBuilder::new(gpu).expect("the device takes the kernels");
    for bad in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -5.0] {
        for (count, index) in [(1, 0), (100, 57), (20_000, 19_999)] {
            let mut boxes = boxes(count, 1);
            boxes[index].max.y = bad;
            if index > 50 {
                boxes[index - 7].max.z = bad;
            }
            let wrong = boxes.iter().position(|b| !b.is_valid()).map(|i| i as u32);
            assert!(wrong.is_some());
            let (tree, _) = built(gpu, &builder, &boxes);
            assert_eq!(tree.wrong(gpu), Ok(wrong), "{bad}");
        }
    }
}
