//! Builders beside each other and beside obvhs: million primitives a second, one thread and two, and the cost of the trees by the surface area
//! heuristic (a node costs 1, a triangle 1; single triangles in leaves).
//!
//! `cargo bench -p lightshed-bvh --features parallel --bench builders -- [scene …]`: `hairball:N`, `city:N` (thousands of
//! triangles), or a PLY file.

mod scenes;

use lightshed_bvh::glam::{Vec3, Vec3A};
use lightshed_bvh::{Builder, Bvh, Method, SubsetOptions};
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};
use std::time::{Duration, Instant};

struct Triangle([Vec3; 3]);

impl Boundable for Triangle {
    fn aabb(&self) -> Aabb {
        Aabb::from_points(&self.0.map(Vec3A::from))
    }
}

/// CPU time of this process so far, in seconds.
fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// CPU seconds of the fastest of several runs.
fn seconds<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let mut best = f64::INFINITY;
    let mut result = None;
    let start = Instant::now();
    let mut runs = 0;
    while runs < 2 || (start.elapsed() < Duration::from_secs(1) && runs < 20) {
        let start = cpu_seconds();
        let value = run();
        best = best.min(cpu_seconds() - start);
        drop(result.replace(value));
        runs += 1;
    }
    (best, result.expect("at least three runs"))
}

fn obvhs_cost(bvh: &obvhs::bvh2::Bvh2) -> f64 {
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
        for threads in [1] {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            for (name, method) in methods() {
                if !name.contains(only.as_str()) {
                    continue;
                }
                let (time, tree) = pool.install(|| seconds(|| Bvh::build(&triangles, method).unwrap()));
                let fault = tree.check(&triangles);
                let (mut builder, mut again) = (Builder::new(method.into()).unwrap(), Bvh::default());
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

fn methods() -> Vec<(String, Method)> {
    let mut all = vec![
        ("curve".to_string(), Method::Curve),
        ("ploc 8".to_string(), Method::Ploc { radius: 8 }),
        ("binned".to_string(), Method::Binned),
    ];
    for (fraction, cluster, window) in [
        (0.2, 1, 4),
        (0.2, 1, 8),
        (0.2, 1, 16),
        (0.2, 4, 8),
        (0.2, 4, 16),
        (0.2, 8, 16),
        (0.2, 8, 32),
        (0.1, 4, 16),
        (0.1, 8, 16),
        (0.1, 8, 32),
        (0.05, 4, 16),
        (0.3, 16, 16),
        (0.3, 16, 32),
    ] {
        all.push((
            format!("subset {fraction} {cluster} {window}"),
            Method::Subset(SubsetOptions {
                fraction,
                cluster,
                window,
                ..SubsetOptions::default()
            }),
        ));
    }
    all
}
