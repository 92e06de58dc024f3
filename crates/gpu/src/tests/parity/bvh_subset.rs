//! Trees built on the device by a stochastic subset are those of the library.

use super::bvh_build::{bits, boxes, hostile, read};
use crate::programs::BVH_SUBSET;
use crate::tests::parity::harness::gpu;
use crate::tests::support::{exact_gpu, faulty};
use crate::{BvhBuilder, BvhSubsetBuilder, Gpu, GpuBvh, GpuBvhSubset, GpuError};
use lightshed_bvh::{Bounds, Bvh, Insertion, Interior, Method, SubsetOptions};
use lightshed_scene::{Geometry, builtin};

fn options() -> SubsetOptions {
    SubsetOptions {
        interior: Interior::Curve,
        ..SubsetOptions::windowed()
    }
}

/// Options that differ from each other in everything.
fn all_options() -> Vec<SubsetOptions> {
    let of = |fraction, uniform, window, cluster, seed| SubsetOptions {
        fraction,
        uniform,
        window,
        cluster,
        seed,
        ..options()
    };
    vec![
        options(),
        of(0.05, 0.2, 1, 1, 1),
        of(0.3, 0.0, 8, 16, 2),
        of(1e-9, 0.1, 4, 4, 3),
        of(1.0, 0.1, 3, 9, 4),
    ]
}

fn built(
    gpu: &Gpu,
    builder: &BvhSubsetBuilder,
    boxes: &[Bounds],
    options: &SubsetOptions,
) -> (GpuBvh, GpuBvhSubset, [Vec<u32>; 2]) {
    let buffer = gpu.buffer("boxes", boxes).expect("they are few");
    let tree = GpuBvh::new(gpu, boxes.len()).expect("it is small");
    let subset = GpuBvhSubset::new(gpu, &tree, options).expect("it is small");
    let mut work = gpu.work();
    // Twice, as a tree must not depend on what it was.
    for _ in 0..2 {
        builder
            .build(&mut work, &buffer, &tree, &subset)
            .expect("the memory is for these");
    }
    work.submit();
    let found = read(gpu, &tree);
    (tree, subset, found)
}

fn truth(boxes: &[Bounds], options: &SubsetOptions) -> [Vec<u32>; 2] {
    let tree = Bvh::build(boxes, Method::Subset(*options)).expect("they are boxes");
    bits(tree.nodes(), tree.order())
}

fn compare(
    gpu: &Gpu,
    builder: &BvhSubsetBuilder,
    name: &str,
    boxes: &[Bounds],
    options: &SubsetOptions,
) -> Result<(), String> {
    let (tree, subset, found) = built(gpu, builder, boxes, options);
    assert_eq!(tree.wrong(gpu), Ok(None));
    for (part, (found, truth)) in ["nodes", "order"]
        .iter()
        .zip(found.iter().zip(&truth(boxes, options)))
    {
        if let Some(first) = found.iter().zip(truth).position(|(a, b)| a != b) {
            let drawn = subset.drawn(gpu).expect("the device answers");
            return Err(format!(
                "{name}: {part} of {} boxes differ from word {first} on, drawn {drawn:?}, {options:?}",
                boxes.len()
            ));
        }
    }
    Ok(())
}

/// Boxes of the triangles of a built-in scene.
fn of_scene(name: &str) -> Vec<Bounds> {
    let scene = builtin::by_name(name).expect("it is built in");
    let mut boxes = Vec::new();
    for shape in &scene.shapes {
        if let Geometry::Mesh(mesh) = &shape.geometry {
            let of = |corners: &[u32; 3]| {
                let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
                Bounds::new(a.min(b).min(c), a.max(b).max(c))
            };
            boxes.extend(mesh.indices.iter().map(of));
        }
    }
    boxes
}

#[test]
fn subset_trees_are_the_same_node_for_node() {
    let Some(gpu) = exact_gpu() else { return };
    let builder = BvhSubsetBuilder::new(gpu).expect("the device takes the kernels");
    let check = |name: &str, boxes: &[Bounds], options: &SubsetOptions| {
        compare(gpu, &builder, name, boxes, options).unwrap_or_else(|error| panic!("{error}"));
    };
    for count in [1, 2, 3, 8, 9, 65, 513, 2049, 8191, 8192, 8193, 60_000] {
        check("random", &boxes(count, 1), &options());
    }
    for options in all_options() {
        for count in [1, 5, 3000, 20_000] {
            check("random", &boxes(count, 2), &options);
        }
    }
    for (name, boxes) in hostile() {
        check(name, &boxes, &options());
        check(name, &boxes, &all_options()[1]);
    }
    for name in builtin::NAMES.into_iter().chain(["city:20", "hairball:20"]) {
        let boxes = of_scene(name);
        if !boxes.is_empty() {
            check(name, &boxes, &options());
        }
    }
}

/// A tree over boxes that have moved has the nodes that the library's refit gives it.
#[test]
fn subset_trees_can_be_refitted() {
    let Some(gpu) = gpu() else { return };
    let builder = BvhSubsetBuilder::new(gpu).expect("the device takes the kernels");
    let (at_rest, moved) = (boxes(3000, 1), boxes(3000, 2));
    let (tree, _, before) = built(gpu, &builder, &at_rest, &options());
    let buffer = gpu.buffer("moved boxes", &moved).expect("they are few");
    let mut work = gpu.work();
    BvhBuilder::new(gpu)
        .expect("the device takes the kernels")
        .refit(&mut work, &buffer, &tree);
    work.submit();
    let mut library = Bvh::build(&at_rest, Method::Subset(options())).expect("they are boxes");
    library.refit(&moved).expect("they are boxes");
    let found = read(gpu, &tree);
    assert!(found == bits(library.nodes(), library.order()));
    assert!(found != before);
}

/// Every step matters: what is planted in one changes trees.
#[test]
fn other_steps_make_other_trees() {
    let Some(gpu) = gpu() else { return };
    // Sizes differ, so that weights are clamped, and many costs are equal.
    let boxes: Vec<Bounds> = boxes(20_000, 3)
        .into_iter()
        .enumerate()
        .map(|(i, at)| {
            let size = if i % 50 == 0 { 0.5 } else { 0.01 };
            let low = (at.min * 30.0).round() / 30.0;
            Bounds::new(low, low + size + 0.1 * (at.max - at.min))
        })
        .collect();
    for fault in [
        // Bins, clamping, sums, and the points of the strata.
        ["- 127 + OFFSET", "- 126 + OFFSET"],
        ["above -= count", "above -= 0u"],
        ["select(weight, drawn.clamp", "select(weight, weight"],
        ["sums[chunk] = all", "sums[chunk] = vec2u(0u)"],
        ["drawing.offset", "vec2u(0u)"],
        [
            "picked[start + count] = i;",
            "picked[start + count] = max(i, 1u) - 1u;",
        ],
        // Clusters, and the turns on the way to them.
        [
            "subset_nodes[node].count > drawing.cluster",
            "subset_nodes[node].count > 1u",
        ],
        ["node - 2u * leaf", "node - leaf"],
        // What a cluster costs, and the windows.
        ["f32(count + 1u)", "f32(count)"],
        ["next + drawing.window", "next + drawing.window - 1u"],
        ["cost <= limit", "cost <= 0.5 * limit"],
    ] {
        let program = faulty(BVH_SUBSET, fault);
        let builder = BvhSubsetBuilder::of_program(gpu, &program).expect("it is a program");
        let found = compare(gpu, &builder, "planted", &boxes, &options());
        assert!(found.is_err(), "{fault:?}");
    }
    let builder = BvhSubsetBuilder::new(gpu).expect("the device takes the kernels");
    assert_eq!(compare(gpu, &builder, "none", &boxes, &options()), Ok(()));
}

/// What the device does not build is refused by name.
#[test]
fn other_subsets_are_refused() {
    let Some(gpu) = gpu() else { return };
    let tree = GpuBvh::new(gpu, 100).expect("it is small");
    for options in [
        SubsetOptions::default(),
        SubsetOptions::windowed(),
        SubsetOptions {
            insertion: Insertion::Planes,
            ..options()
        },
        SubsetOptions {
            window: 0,
            ..options()
        },
    ] {
        let refused = GpuBvhSubset::new(gpu, &tree, &options);
        assert!(matches!(refused, Err(GpuError::Settings(_))), "{options:?}");
    }
    let builder = BvhSubsetBuilder::new(gpu).expect("the device takes the kernels");
    let subset = GpuBvhSubset::new(gpu, &tree, &options()).expect("it is small");
    let other = GpuBvh::new(gpu, 101).expect("it is small");
    let buffer = gpu.buffer("boxes", &boxes(101, 1)).expect("they are few");
    let built = builder.build(&mut gpu.work(), &buffer, &other, &subset);
    assert!(matches!(built, Err(GpuError::Settings(_))));
}
