//! Rays through the trees of every preset, each primitive in a leaf of its own: million rays a
//! second of CPU time on one thread, and that beside the binned tree. Primary rays come from a
//! camera, those of ambient occlusion from what it sees, in all directions, a tenth of the scene
//! long, and those of paths follow each other from there.
//!
//! `cargo bench -p lightshed-bvh --bench rays -- [scene …]`: as `builders` does. The best of five
//! turns, each of which goes through all trees. `COUNT=1` measures no time and counts what rays
//! test, boxes and triangles for each ray: these numbers are the same on any machine.
//! `ALSO=ploc8/0.05/16,…` adds other methods and re-insertion.

mod cpu;
mod scenes;
mod ways;

use cpu::cpu_seconds;
use lightshed_bvh::glam::Vec3;
use lightshed_bvh::{BuildOptions, Bvh, Insertion, Method, Preset, Ray, SubsetOptions};
use lightshed_sampling::{CounterRng, UniformSphere};

const SIDE: u32 = 256;
const TURNS: usize = 5;
const BOUNCES: u32 = 3;

/// Möller and Trumbore 1997.
fn hit(ray: &Ray, [a, b, c]: &[Vec3; 3], t_max: f32) -> Option<f32> {
    let (e, f) = (*b - *a, *c - *a);
    let p = ray.direction.cross(f);
    let determinant = e.dot(p);
    let s = ray.origin - *a;
    let q = s.cross(e);
    let (u, v) = (s.dot(p) / determinant, ray.direction.dot(q) / determinant);
    let t = f.dot(q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < t_max).then_some(t)
}

fn nearest(tree: &Bvh, triangles: &[[Vec3; 3]], ray: &Ray) -> Option<f32> {
    let found = tree.nearest(ray, |index, t_max| hit(ray, &triangles[index as usize], t_max));
    found.map(|(_, t)| t)
}

/// Boxes and triangles that a ray tests: what [`Bvh::nearest`] does, and counts.
fn tested(tree: &Bvh, triangles: &[[Vec3; 3]], ray: &Ray) -> [u64; 2] {
    let inverse = ray.direction.recip();
    let enter = |node: usize, t_max: f32| {
        let node = &tree.nodes()[node];
        let (a, b) = (
            (node.min - ray.origin) * inverse,
            (node.max - ray.origin) * inverse,
        );
        let (near, far) = (a.min(b).max_element().max(0.0), a.max(b).min_element().min(t_max));
        (near <= far * (1.0 + 4.0 * f32::EPSILON)).then_some(near)
    };
    let (mut boxes, mut tests, mut t_max) = (1, 0, ray.t_max);
    let mut waiting = Vec::new();
    waiting.extend(enter(0, t_max).map(|t| (0, t)));
    while let Some((node, entered)) = waiting.pop() {
        if entered > t_max {
            continue;
        }
        let Some([low, high]) = tree.children(node) else {
            tests += 1;
            let triangle = tree.order()[tree.nodes()[node].first as usize];
            t_max = hit(ray, &triangles[triangle as usize], t_max).unwrap_or(t_max);
            continue;
        };
        boxes += 2;
        let mut entered = [low, high].map(|child| enter(child, t_max).map(|t| (child, t)));
        // The nearer one is searched first.
        if let [Some((_, a)), Some((_, b))] = entered
            && a <= b
        {
            entered.swap(0, 1);
        }
        waiting.extend(entered.into_iter().flatten());
    }
    [boxes, tests]
}

/// Prints what the rays of each kind test in each tree, and the sum beside the first tree's.
fn count(names: &[(String, BuildOptions)], trees: &[Bvh], triangles: &[[Vec3; 3]], kinds: &[Vec<Ray>; 3]) {
    let mut first = [0.0; 3];
    for ((name, _), tree) in names.iter().zip(trees) {
        print!("  {name:22}");
        for (rays, first) in kinds.iter().zip(&mut first) {
            let mut sum = [0; 2];
            for ray in rays {
                let tested = tested(tree, triangles, ray);
                sum = [sum[0] + tested[0], sum[1] + tested[1]];
            }
            let [boxes, tests] = sum.map(|n| n as f64 / rays.len() as f64);
            if *first == 0.0 {
                *first = boxes + tests;
            }
            print!("  {boxes:7.2} + {tests:5.2} ({:.3})", (boxes + tests) / *first);
        }
        println!("  cost {:.2}", tree.sah_cost(1.0, 1.0));
    }
}

/// Primary rays, those of ambient occlusion, and those of paths.
fn rays(tree: &Bvh, triangles: &[[Vec3; 3]]) -> [Vec<Ray>; 3] {
    let bounds = tree.bounds();
    let (center, extent) = ((bounds.min + bounds.max) * 0.5, bounds.max - bounds.min);
    let eye = center + extent * Vec3::new(0.3, 0.35, 0.45);
    let forward = (center - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize_or(Vec3::X);
    let up = right.cross(forward);
    let [mut primary, mut occlusion, mut path] = [const { Vec::new() }; 3];
    for pixel in 0..SIDE * SIDE {
        let mut rng = CounterRng::new(3, pixel, 0);
        let at = |i: u32| (i as f32 + 0.5) / SIDE as f32 * 2.0 - 1.0;
        let (x, y) = (at(pixel % SIDE), at(pixel / SIDE));
        let ray = |origin, direction, t_max| Ray {
            origin,
            direction,
            t_max,
        };
        let mut last = ray(eye, forward + right * x * 0.7 + up * y * 0.7, f32::INFINITY);
        primary.push(last);
        for bounce in 0..=BOUNCES {
            let Some(t) = nearest(tree, triangles, &last) else {
                break;
            };
            let origin = last.origin + last.direction * (t * 0.999);
            let mut direction = || UniformSphere::sample(rng.next_2d());
            if bounce == 0 {
                for _ in 0..2 {
                    occlusion.push(ray(origin, direction(), 0.1 * extent.length()));
                }
            }
            if bounce < BOUNCES {
                last = ray(origin, direction(), f32::INFINITY);
                path.push(last);
            }
        }
    }
    [primary, occlusion, path]
}

fn main() {
    let mut arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    if arguments.is_empty() {
        arguments = vec!["hairball:1000".into(), "city:1000".into()];
    }
    for scene in &arguments {
        let triangles = scenes::load(scene);
        let names: Vec<(String, BuildOptions)> = builds();
        let trees: Vec<Bvh> = names
            .iter()
            .map(|(_, options)| Bvh::build(&triangles, *options).expect("boxes"))
            .collect();
        let kinds = rays(&trees[0], &triangles);
        println!(
            "{scene}: {} triangles, {:?} rays",
            triangles.len(),
            kinds.each_ref().map(Vec::len)
        );
        if std::env::var_os("COUNT").is_some() {
            count(&names, &trees, &triangles, &kinds);
            continue;
        }
        let mut least = vec![[f64::INFINITY; 3]; trees.len()];
        for _ in 0..TURNS {
            for (tree, least) in trees.iter().zip(&mut least) {
                for (rays, least) in kinds.iter().zip(least) {
                    let start = cpu_seconds();
                    let hits = rays.iter().filter(|ray| nearest(tree, &triangles, ray).is_some());
                    std::hint::black_box(hits.count());
                    *least = least.min(cpu_seconds() - start);
                }
            }
        }
        for (((name, _), tree), own) in names.iter().zip(&trees).zip(&least) {
            let cost = tree.sah_cost(1.0, 1.0);
            print!(
                "  {name:22} cost {cost:7.2} ({:.3})",
                cost / trees[0].sah_cost(1.0, 1.0)
            );
            for kind in 0..3 {
                let rate = kinds[kind].len() as f64 / own[kind] / 1e6;
                print!("  {rate:6.3} Mray/s ({:.3})", least[0][kind] / own[kind]);
            }
            println!();
        }
    }
}

/// The binned tree first, then the other presets, and other subsets.
fn builds() -> Vec<(String, BuildOptions)> {
    let mut all: Vec<(String, BuildOptions)> = [
        Preset::Medium,
        Preset::Fastest,
        Preset::Fast,
        Preset::High,
        Preset::Best,
    ]
    .map(|preset| (format!("{preset:?}"), preset.options()))
    .into();
    let mut subset = |name: &str, options: SubsetOptions| {
        all.push((name.to_owned(), Method::Subset(options).into()));
    };
    for sweep in [0, 12] {
        let options = SubsetOptions {
            insertion: Insertion::Planes,
            sweep,
            ..SubsetOptions::default()
        };
        subset(&format!("subset, sweep {sweep}"), options);
    }
    subset("subset, windows", SubsetOptions::windowed());
    all.extend(ways::asked_for());
    all
}
