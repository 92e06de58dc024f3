//! The nearest surface sites by a grid, a k-d tree and a BVH, beside a look at every site: time to
//! build, and time of a search, in CPU time of one thread.
//!
//! Sites are where light arrives in a room seen from one wall: the second vertices of paths from
//! the camera, dense near what it sees. `cargo bench -p lightshed-bvh --bench nearest -- [width
//! height]`.

mod cpu;

use cpu::cpu_seconds;
use lightshed_bvh::glam::Vec3;
use lightshed_bvh::{Bounds, Bvh, Preset};
use lightshed_sampling::{CosineHemisphere, CounterRng, Frame};
use lightshed_spatial::{Nearest, NearestSites, SiteGrid, SiteMetric, SiteTree, SurfaceSite};
use std::hint::black_box;

/// CPU seconds of the fastest of three runs, and its result.
fn seconds<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let mut timed = || {
        let start = cpu_seconds();
        let value = run();
        (cpu_seconds() - start, value)
    };
    let (mut best, mut value) = timed();
    for _ in 0..2 {
        let (again, other) = timed();
        (best, value) = (best.min(again), other);
    }
    (best, value)
}

/// A sphere on the floor of a room, `[−1, 1]³`.
const CENTER: Vec3 = Vec3::new(0.2, -0.6, 0.1);
const RADIUS: f32 = 0.4;

/// Where a ray from inside the room ends.
fn hit(origin: Vec3, direction: Vec3) -> SurfaceSite {
    let walls = (direction.signum() - origin) / direction;
    let t = walls.min_element();
    let (off, b) = (origin - CENTER, (origin - CENTER).dot(direction));
    let discriminant = b * b - off.length_squared() + RADIUS * RADIUS;
    let near = -b - discriminant.max(0.0).sqrt();
    if discriminant > 0.0 && near > 1e-4 && near < t {
        let position = origin + direction * near;
        return SurfaceSite::new(position, (position - CENTER) / RADIUS);
    }
    let mut normal = Vec3::ZERO;
    let axis = if walls.x == t {
        0
    } else if walls.y == t {
        1
    } else {
        2
    };
    normal[axis] = -direction[axis].signum();
    SurfaceSite::new((origin + direction * t).clamp(Vec3::NEG_ONE, Vec3::ONE), normal)
}

/// The second vertex of a path through a pixel.
fn site(x: u32, y: u32, [width, height]: [u32; 2], seed: u64) -> SurfaceSite {
    let mut rng = CounterRng::new(seed, y << 16 | x, 0);
    let film = Vec3::new(
        (x as f32 + rng.next_f32()) / width as f32 - 0.5,
        (y as f32 + rng.next_f32()) / height as f32 - 0.5,
        -0.8,
    );
    let first = hit(Vec3::new(0.0, 0.0, 0.99), film.normalize());
    let local = CosineHemisphere::sample(rng.next_2d());
    let direction = Frame::from_normal(first.normal).to_world(local);
    hit(first.position + first.normal * 1e-4, direction)
}

struct Tree(Bvh, Vec<SurfaceSite>);

impl NearestSites for Tree {
    fn nearest(&self, site: &SurfaceSite, metric: SiteMetric, found: &mut Nearest) {
        found.clear();
        self.0
            .for_each_near(site.position, found.reach_squared(), |index| {
                found.offer(index, metric.distance_squared(site, &self.1[index as usize]));
                found.reach_squared()
            });
    }
}

fn main() {
    let numbers: Vec<u32> = std::env::args()
        .filter_map(|argument| argument.parse().ok())
        .collect();
    let size = match numbers[..] {
        [width, height, ..] => [width, height],
        _ => [1280, 720],
    };
    let pixels: Vec<[u32; 2]> = (0..size[1])
        .flat_map(|y| (0..size[0]).map(move |x| [x, y]))
        .collect();
    let sites: Vec<SurfaceSite> = pixels.iter().map(|&[x, y]| site(x, y, size, 1)).collect();
    let queries: Vec<SurfaceSite> = pixels.iter().map(|&[x, y]| site(x, y, size, 2)).collect();
    let bounds: Vec<Bounds> = sites.iter().map(|site| Bounds::of_point(site.position)).collect();
    println!(
        "{} sites; milliseconds to build, microseconds a search",
        sites.len()
    );
    let (grid_built, grid) = seconds(|| SiteGrid::new(&sites).unwrap());
    let (tree_built, tree) = seconds(|| SiteTree::new(&sites).unwrap());
    let bvh =
        |preset: Preset| seconds(|| Tree(Bvh::build(&bounds, preset.options()).unwrap(), sites.clone()));
    let (fastest_built, fastest) = bvh(Preset::Fastest);
    let (medium_built, medium) = bvh(Preset::Medium);
    let searches: [(&str, f64, &dyn NearestSites, usize); 5] = [
        ("grid", grid_built, &grid, queries.len()),
        ("k-d tree", tree_built, &tree, queries.len()),
        ("BVH, fastest", fastest_built, &fastest, queries.len()),
        ("BVH, medium", medium_built, &medium, queries.len()),
        ("linear scan", 0.0, &sites.as_slice(), 40),
    ];
    println!(
        "{:14} {:>8} {:>10} {:>10} {:>10}",
        "", "build", "1", "3", "3, normals"
    );
    for (name, built, search, count) in searches {
        print!("{name:14} {:8.1}", built * 1e3);
        for (most, scale) in [(1, 0.0), (3, 0.0), (3, 0.2)] {
            let metric = SiteMetric::new(scale).unwrap();
            let mut found = Nearest::new(most, 0.4);
            let (time, _) = seconds(|| {
                for query in &queries[..count] {
                    search.nearest(query, metric, &mut found);
                    black_box(found.found());
                }
            });
            print!(" {:10.2}", time / count as f64 * 1e6);
        }
        println!();
    }
}
