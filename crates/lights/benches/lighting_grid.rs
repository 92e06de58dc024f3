//! The lighting grid hierarchy: construction by gather against scatter, updates against construction, and what a shading point costs, each
//! for growing numbers of lights. Every figure is the least processor time of several runs, on one thread.

use glam::Vec3;
use lightshed_lights::{Bounds, Construction, GridChange, GridOptions, GridQuery, LightingGrid, PointLight};
use lightshed_sampling::{CounterRng, UniformSphere};
use std::hint::black_box;

/// Lights on the walls of a room of 4×3×5 and on a ball in it.
fn light(i: u32) -> PointLight {
    let mut rng = CounterRng::new(1, i, 0);
    let [u, v] = rng.next_2d();
    let intensity = Vec3::new(1.0, rng.next_f32(), rng.next_f32());
    let face = rng.next_u32() % 7;
    if face == 6 {
        let normal = UniformSphere::sample([u, v]);
        return PointLight::lambertian(Vec3::new(1.3, 0.8, 2.0) + 0.7 * normal, normal, intensity);
    }
    let size = Vec3::new(4.0, 3.0, 5.0);
    let (axis, far) = (face as usize / 2, face % 2 == 1);
    let (mut position, mut normal) = (Vec3::ZERO, Vec3::ZERO);
    (position[axis], normal[axis]) = if far { (size[axis], -1.0) } else { (0.0, 1.0) };
    position[(axis + 1) % 3] = u * size[(axis + 1) % 3];
    position[(axis + 2) % 3] = v * size[(axis + 2) % 3];
    PointLight::lambertian(position, normal, intensity)
}

/// Processor time of this process in seconds, so that what else the machine does counts little.
#[cfg(unix)]
fn seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Wall time in seconds where there is no other.
#[cfg(not(unix))]
fn seconds() -> f64 {
    use std::sync::LazyLock;
    static START: LazyLock<std::time::Instant> = LazyLock::new(std::time::Instant::now);
    START.elapsed().as_secs_f64()
}

/// Least time of `runs` runs, in milliseconds.
fn milliseconds(runs: u32, mut f: impl FnMut()) -> f64 {
    let time = |_| {
        let start = seconds();
        f();
        (seconds() - start) * 1e3
    };
    (0..runs).map(time).fold(f64::INFINITY, f64::min)
}

fn options(alpha: f32, construction: Construction) -> GridOptions {
    GridOptions {
        alpha,
        construction,
        bounds: Some(Bounds::new(Vec3::ZERO, Vec3::new(4.0, 3.0, 5.0))),
        ..GridOptions::default()
    }
}

fn lights(count: u32) -> Vec<PointLight> {
    (0..count).map(light).collect()
}

/// Construction, and updates of one light, of a thousandth, a hundredth and a tenth of them.
fn construction(count: u32) {
    let lights = lights(count);
    let runs = if count > 100_000 { 3 } else { 7 };
    let mut gathered = LightingGrid::new(&lights, &options(1.0, Construction::Gather)).unwrap();
    let gather = milliseconds(runs, || gathered.rebuild(black_box(&lights)).unwrap());
    let mut scattered = LightingGrid::new(&lights, &options(1.0, Construction::Scatter)).unwrap();
    let scatter = milliseconds(runs.min(3), || scattered.rebuild(black_box(&lights)).unwrap());
    let (levels, first) = (gathered.level_count(), gathered.grid_lights(1).len());
    let ratio = scatter / gather;
    print!("{count:9} {levels:7} {first:7} {gather:10.3} {scatter:10.3} {ratio:6.1}  ");
    let mut next = count;
    for share in [count, 1_000, 100, 10] {
        let mut least = f64::INFINITY;
        for _ in 0..runs {
            let mut change = |_| {
                next += 1;
                GridChange {
                    index: next.wrapping_mul(7919) % count,
                    light: light(next),
                }
            };
            let changes: Vec<GridChange> = (0..count / share).map(&mut change).collect();
            least = least.min(milliseconds(1, || {
                black_box(gathered.update(&changes).unwrap());
            }));
        }
        print!(" {least:9.3}");
    }
    println!();
}

/// Cost of a shading point on the surfaces, and of the sum over all lights there.
fn queries(count: u32) {
    let lights = lights(count);
    let points: Vec<(Vec3, Vec3)> = (0..400)
        .map(|i| {
            let on = light(1_000_000_000 + i);
            (
                on.position + 1e-3 * on.normal,
                UniformSphere::sample(CounterRng::new(2, i, 0).next_2d()),
            )
        })
        .collect();
    let brute = milliseconds(2, || {
        for &(point, normal) in &points[..4] {
            let mut sum = Vec3::ZERO;
            for light in &lights {
                let to_light = light.position - point;
                let squared = to_light.length_squared().max(1e-6);
                let direction = to_light / squared.sqrt();
                let cosine = normal.dot(direction).max(0.0);
                sum += light.intensity * (light.emission(-direction) * cosine / squared);
            }
            black_box(sum);
        }
    });
    for (alpha, first_level) in [(1.0, 1), (1.0, 0), (2.0, 1)] {
        let grid = LightingGrid::new(&lights, &options(alpha, Construction::Gather)).unwrap();
        let query = GridQuery {
            first_level,
            ..GridQuery::default()
        };
        let mut visited = 0u64;
        points
            .iter()
            .for_each(|&(point, _)| grid.visit(point, &query, |_| visited += 1));
        let time = milliseconds(3, || {
            for &(point, normal) in &points {
                let mut sum = Vec3::ZERO;
                grid.visit(point, &query, |influence| {
                    let cosine = normal.dot(influence.direction).max(0.0);
                    sum += influence.intensity * (cosine / influence.distance_squared.max(1e-6));
                });
                black_box(sum);
            }
        });
        let per_point = points.len() as f64;
        let (visited, us, brute) = (
            visited as f64 / per_point,
            time * 1e3 / per_point,
            brute * 1e3 / 4.0,
        );
        println!("{count:9} {alpha:6} {first_level:6} {visited:11.0} {us:12.2} {brute:14.0}");
    }
}

fn main() {
    println!(
        "   lights  levels      S1  gather ms scatter ms  ratio    moved: 1    0.1 %       1 %      10 %  (ms)"
    );
    [1_000, 10_000, 100_000, 1_000_000]
        .into_iter()
        .for_each(construction);
    println!("\n   lights  alpha  first  lights a point  us a point  brute force us");
    [1_000, 10_000, 100_000, 1_000_000].into_iter().for_each(queries);
}
