//! Builders beside each other and beside obvhs, on pools of one thread and of two, in fresh memory
//! and again: million primitives a second of CPU time, and the cost of the trees by the surface
//! area heuristic (a node costs 1, a triangle 1; single triangles in leaves).
//!
//! `cargo bench -p lightshed-bvh --bench builders -- [scene …]`: `hairball:N`, `city:N`
//! (thousands of triangles), or a PLY file. `ONLY=part` of a name builds in that way alone;
//! `ALSO=ploc8/0.05/16,…` adds other methods and re-insertion, `SUBSETS=0.1/2/8/0,…` subsets of
//! that fraction, clusters, window (0: planes) and sweep.

mod cpu;
mod scenes;
mod ways;

use cpu::cpu_seconds;
use lightshed_bvh::glam::{Vec3, Vec3A};
use lightshed_bvh::obvhs::aabb::Aabb;
use lightshed_bvh::obvhs::bvh2::builder::build_bvh2;
use lightshed_bvh::obvhs::{Boundable, BvhBuildParams};
use lightshed_bvh::{
    Bounds, BuildOptions, Builder, Bvh, Insertion, Method, Preset, Primitive, SubsetOptions,
};
use lightshed_spatial::{Curve, CurveOrder};
use std::time::{Duration, Instant};

struct Triangle([Vec3; 3]);

impl Boundable for Triangle {
    fn aabb(&self) -> Aabb {
        Aabb::from_points(&self.0.map(Vec3A::from))
    }
}

/// CPU seconds of the fastest of several runs.
fn seconds<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let mut best = f64::INFINITY;
    let mut result = None;
    let start = Instant::now();
    let mut runs = 0;
    while runs < 3 || (start.elapsed() < Duration::from_secs(1) && runs < 20) {
        let start = cpu_seconds();
        let value = run();
        best = best.min(cpu_seconds() - start);
        drop(result.replace(value));
        runs += 1;
    }
    (best, result.expect("at least three runs"))
}

fn obvhs_cost(bvh: &lightshed_bvh::obvhs::bvh2::Bvh2) -> f64 {
    let area = |a: &Aabb| {
        let d = (a.max - a.min).as_dvec3();
        d.x * d.y + d.y * d.z + d.z * d.x
    };
    let root = area(bvh.nodes[0].aabb());
    bvh.nodes
        .iter()
        .map(|node| area(node.aabb()) * f64::from(node.prim_count.max(1)))
        .sum::<f64>()
        / root
}

fn main() {
    let mut arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    if arguments.is_empty() {
        arguments = vec!["hairball:1000".into(), "city:1000".into()];
    }
    let only = std::env::var("ONLY").unwrap_or_default();
    for scene in &arguments {
        let triangles = scenes::load(scene);
        let million = triangles.len() as f64 / 1e6;
        println!("{scene}: {} triangles", triangles.len());
        limits(&triangles);
        for threads in threads() {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            for (name, options) in builds() {
                if !name.contains(only.as_str()) {
                    continue;
                }
                let (time, tree) = pool.install(|| seconds(|| Bvh::build(&triangles, options).unwrap()));
                let fault = tree.check(&triangles);
                let (mut builder, mut again) = (Builder::new(options).unwrap(), Bvh::default());
                let (time_again, ()) =
                    pool.install(|| seconds(|| builder.rebuild(&triangles, &mut again).unwrap()));
                println!(
                    "  {threads} {name:18} {:6.2} Mtri/s {:7.1} ms, again {:6.2} {:6.1}, cost {:.2} depth {} {}",
                    million / time,
                    time * 1e3,
                    million / time_again,
                    time_again * 1e3,
                    tree.sah_cost(1.0, 1.0),
                    tree.depth(),
                    if fault.is_err() { "WRONG" } else { "" }
                );
            }
        }
        let wrapped: Vec<Triangle> = triangles.iter().map(|&t| Triangle(t)).collect();
        for (name, parameters) in [
            ("obvhs fastest", BvhBuildParams::fastest_build()),
            ("obvhs v.fast", BvhBuildParams::very_fast_build()),
            ("obvhs fast", BvhBuildParams::fast_build()),
            ("obvhs medium", BvhBuildParams::medium_build()),
            ("obvhs slow", BvhBuildParams::slow_build()),
        ] {
            if !name.contains(only.as_str()) {
                continue;
            }
            let parameters = BvhBuildParams {
                max_prims_per_leaf: 1,
                ..parameters
            };
            let (time, tree) = seconds(|| build_bvh2(&wrapped, parameters, &mut Duration::default()));
            println!(
                "    {name:13} {:6.2} Mtri/s {:8.1} ms  cost {:.2}",
                million / time,
                time * 1e3,
                obvhs_cost(&tree)
            );
        }
    }
}

/// What no build can do without: the copy of all boxes, and the sort of their codes.
fn limits(triangles: &[[Vec3; 3]]) {
    let million = triangles.len() as f64 / 1e6;
    let boxes: Vec<Bounds> = triangles.iter().map(Primitive::bounds).collect();
    let mut copy = boxes.clone();
    let (time, ()) = seconds(|| copy.copy_from_slice(&boxes));
    println!(
        "    copy of 24 bytes {:9.2} Mtri/s {:7.1} ms",
        million / time,
        time * 1e3
    );
    let mut order = CurveOrder::default();
    let (time, _) = seconds(|| {
        order.encode(&boxes, |&bounds| bounds, Curve::Morton);
        order.sort().iter().count()
    });
    println!(
        "    codes, and their sort {:.2} Mtri/s {:7.1} ms",
        million / time,
        time * 1e3
    );
}

/// `THREADS=1` measures on one thread alone.
fn threads() -> Vec<usize> {
    let given = std::env::var("THREADS").ok().and_then(|n| n.parse().ok());
    given.map_or(vec![1, 2], |n| vec![n])
}

/// Every preset, and what they are made of.
fn builds() -> Vec<(String, BuildOptions)> {
    let mut all: Vec<(String, BuildOptions)> = Preset::ALL
        .map(|preset| (format!("{preset:?}"), preset.options()))
        .into();
    all.push(("PLOC 8".to_owned(), Method::Ploc { radius: 8 }.into()));
    all.extend(ways::asked_for());
    let subsets = std::env::var("SUBSETS").unwrap_or_default();
    for text in subsets.split(',').filter(|text| !text.is_empty()) {
        let numbers: Vec<f32> = text.split('/').map(|n| n.parse().expect("a number")).collect();
        let [fraction, cluster, window, sweep] = numbers[..] else {
            panic!("{text}: fraction/cluster/window/sweep");
        };
        let subset = SubsetOptions {
            fraction,
            cluster: cluster as u32,
            window: (window as u32).max(1),
            insertion: if window > 0.0 {
                Insertion::Window
            } else {
                Insertion::Planes
            },
            sweep: sweep as u32,
            ..SubsetOptions::default()
        };
        all.push((format!("subset {text}"), Method::Subset(subset).into()));
    }
    all
}
