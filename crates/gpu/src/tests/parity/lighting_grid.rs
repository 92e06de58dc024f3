//! Look-ups in lighting grids: which lights a point gets from which level, and how much of each.

use crate::tests::parity::harness::{COUNT, Shader, Tier, compare, floats};
use crate::tests::support::exact_gpu;
use crate::{Buffer, Gpu};
use glam::{DVec3, Vec3};
use lightshed_lights::{GridOptions, GridQuery, Levels, LightingGrid, PointLight};
use lightshed_sampling::{CounterRng, UniformSphere};

const LEAST_DISTANCE: f32 = 0.05;

/// Point lights on the walls of a box, in its middle, in a cluster; half of them shine all around,
/// some are off.
pub fn point_lights(count: usize, salt: u32) -> Vec<PointLight> {
    let mut rng = CounterRng::new(85, count as u32, salt);
    (0..count)
        .map(|i| {
            let mut position = Vec3::from_array([(); 3].map(|()| rng.next_f32())) * Vec3::new(10.0, 7.0, 4.0);
            let mut normal = UniformSphere::sample(rng.next_2d());
            match i % 8 {
                0..4 => {
                    let axis = i % 3;
                    position[axis] = [10.0, 7.0, 4.0][axis] * (i / 4 % 2) as f32;
                    normal = Vec3::AXES[axis] * (1.0 - 2.0 * (i / 4 % 2) as f32);
                }
                4 => position = Vec3::new(2.0, 3.0, 1.0) + position * 1e-3,
                5 => normal = Vec3::ZERO,
                _ => {}
            }
            let intensity = Vec3::from_array([(); 3].map(|()| rng.next_f32()));
            PointLight {
                position,
                intensity: intensity * if i % 17 == 3 { 0.0 } else { 1.0 },
                normal,
            }
        })
        .collect()
}

/// A grid's memory as the shader module has it, at bindings 2 to 6.
pub struct GridBuffers([Buffer; 5]);

impl GridBuffers {
    /// With `r_0` multiplied by `stretched`, and without the light of a vertex if `lost`.
    fn new(gpu: &Gpu, grid: &LightingGrid, stretched: f32, lost: bool) -> Self {
        let levels = grid.level_count();
        let bounds = grid.bounds();
        let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let magnitude = f64::from(bounds.min.abs().max(bounds.max.abs()).max_element());
        let size = (high - low)
            .max_element()
            .max(magnitude * 2.0f64.powi(-18))
            .max(1e-12);
        let side = |level: u32| (1u32 << (levels - level)) + 1;
        let row_words = |level: u32| side(level) / 32 + 1;
        let mut first_word = [0; 12];
        let mut words = Vec::new();
        let mut lights = Vec::new();
        for level in 1..=levels {
            let first = words.len();
            first_word[level as usize - 1] = first as u32;
            words.resize(
                first + (side(level) * side(level) * row_words(level)) as usize,
                [0u32; 2],
            );
            for [x, y, z] in grid.vertices(level) {
                let word = (z * side(level) + y) * row_words(level) + x / 32;
                words[first + word as usize][0] |= 1 << (x % 32);
            }
            for light in grid.grid_lights(level) {
                let [xx, yy, zz, xy, yz, zx] = light.normal_moment;
                let of = |v: Vec3, w: f32| [v.x, v.y, v.z, w];
                lights.extend(of(light.position, light.isotropic));
                lights.extend(of(light.intensity, xx));
                lights.extend(of(light.mean_normal, yy));
                lights.extend(of(light.spread, zz));
                lights.extend([xy, yz, zx, 0.0]);
            }
        }
        first_word[levels as usize] = words.len() as u32;
        words.push([0; 2]);
        let mut before = 0;
        for word in &mut words {
            word[1] = before;
            before += word[0].count_ones();
        }
        if lost {
            let middle = lights.len() / 40 * 20;
            lights[middle + 4..middle + 7].fill(0.0);
        }
        let cells = 1u32 << (levels - 1);
        let mut points: Vec<(u32, &PointLight)> = grid
            .lights()
            .iter()
            .map(|light| {
                let at = (light.position.as_dvec3() - low) * (f64::from(cells) * (1.0 / size));
                let [x, y, z] = at
                    .clamp(DVec3::ZERO, DVec3::splat(f64::from(cells - 1)))
                    .to_array()
                    .map(|x| x as u32);
                ((z * cells + y) * cells + x, light)
            })
            .collect();
        points.sort_by_key(|&(key, _)| key);
        let keys: Vec<u32> = points.iter().map(|&(key, _)| key).collect();
        let points: Vec<f32> = points
            .iter()
            .flat_map(|(_, light)| {
                [light.position, light.intensity, light.normal]
                    .map(|v| [v.x, v.y, v.z, 0.0])
                    .concat()
            })
            .collect();
        let mut frame = vec![0u32; 24];
        frame[..3].copy_from_slice(&bounds.min.to_array().map(f32::to_bits));
        frame[3] = levels;
        for (place, double) in [(4, size), (6, 1.0 / size)] {
            let bits = double.to_bits();
            frame[place] = bits as u32;
            frame[place + 1] = (bits >> 32) as u32;
        }
        frame[8] = (grid.blending(0).radius(0) * stretched).to_bits();
        frame[9] = keys.len() as u32;
        frame[12..].copy_from_slice(&first_word);
        Self([
            gpu.buffer("frame", &frame).expect("it is small"),
            gpu.buffer("words", &words).expect("it is small"),
            gpu.buffer("lights", &lights).expect("it is small"),
            gpu.buffer("points", &points).expect("it is small"),
            gpu.buffer("keys", &keys).expect("it is small"),
        ])
    }
}

const HOST: &str = "
    import package::lightshed::grid_light::{GridFrame, GridLight, GridPoint};
    import package::lightshed::lighting_grid::Influence;
    @group(0) @binding(2) var<storage, read> frame: GridFrame;
    @group(0) @binding(3) var<storage, read> grid_words: array<vec2u>;
    @group(0) @binding(4) var<storage, read> grid_lights: array<GridLight>;
    @group(0) @binding(5) var<storage, read> points: array<GridPoint>;
    @group(0) @binding(6) var<storage, read> keys: array<u32>;
    fn grid_frame() -> GridFrame { return frame; }
    fn load_grid_word(word: u32) -> vec2u { return grid_words[word]; }
    fn load_grid_light(place: u32) -> GridLight { return grid_lights[place]; }
    fn load_grid_point(place: u32) -> GridPoint { return points[place]; }
    fn load_grid_key(place: u32) -> u32 { return keys[place]; }
    var<private> normal: vec3f;
    var<private> irradiance: vec3f;
    var<private> count: u32;
    var<private> names: u32;
    fn set_normal(n: vec3f) { normal = n; irradiance = vec3f(0.0); count = 0u; names = 0u; }
    fn visit_influence(seen: Influence) {
        let d = seen.direction;
        let cos_theta = max(normal.x * d.x + normal.y * d.y + normal.z * d.z, 0.0);
        irradiance += seen.intensity * (cos_theta / max(seen.distance_squared, 0.0025000002));
        count += 1u;
        // In level 0 places are the device's own.
        names = names * 31u + seen.level + select(seen.index, 0u, seen.level == 0u) * 7u;
    }
    fn sum() -> vec3f { return irradiance; }
    fn visited() -> vec2u { return vec2u(count, names); }";

const BODY: &str = "
    set_normal(vec3f(number(3u), number(4u), number(5u)));
    grid_visit(vec3f(number(0u), number(1u), number(2u)), GridQuery(word(6u), word(7u), word(8u)));
    let all = visited();
    put_3(0u, sum()); put(3u, all.x); put(4u, all.y);";

/// Points within the lights' box, beyond it, at lights, and what to visit.
fn questions(count: usize, lights: &[PointLight], salt: u32) -> Vec<[u32; 9]> {
    let mut rng = CounterRng::new(86, salt, 0);
    (0..count)
        .map(|i| {
            let at = Vec3::from_array([(); 3].map(|()| rng.next_f32()));
            let point = match i % 8 {
                0 => lights[rng.next_u32() as usize % lights.len()].position,
                1 => at * 40.0 - 15.0,
                2 => at.round() * Vec3::new(10.0, 7.0, 4.0),
                3 => (at * 10.0).round(),
                4 => at * 1e4,
                _ => at * Vec3::new(10.0, 7.0, 4.0),
            };
            let [x, y, z] = point.to_array().map(f32::to_bits);
            let [nx, ny, nz] = UniformSphere::sample(rng.next_2d()).to_array().map(f32::to_bits);
            let first_level = rng.next_u32() % 2;
            // Of the lights themselves the order is the device's own.
            let stride = if first_level == 0 {
                1
            } else {
                [1, 1, 4, 7][i / 8 % 4]
            };
            [x, y, z, nx, ny, nz, first_level, stride, rng.next_u32()]
        })
        .collect()
}

fn answers(grid: &LightingGrid, words: &[u32; 9]) -> [u32; 5] {
    let [x, y, z, nx, ny, nz, ..] = floats(words);
    let normal = Vec3::new(nx, ny, nz);
    let query = GridQuery {
        first_level: words[6],
        stride: words[7],
        phase: words[8],
    };
    let (mut sum, mut count, mut names) = (Vec3::ZERO, 0, 0u32);
    let least = LEAST_DISTANCE * LEAST_DISTANCE;
    grid.visit(Vec3::new(x, y, z), &query, |influence| {
        let cos_theta = normal.dot(influence.direction).max(0.0);
        sum += influence.intensity * (cos_theta / influence.distance_squared.max(least));
        count += 1;
        let id = influence.id;
        let index = if id.level == 0 { 0 } else { id.index };
        names = names
            .wrapping_mul(31)
            .wrapping_add(id.level)
            .wrapping_add(index.wrapping_mul(7));
    });
    let [r, g, b] = sum.to_array().map(f32::to_bits);
    [r, g, b, count, names]
}

/// The same lights in the same order, and sums within 2·10⁻⁶ relatively. Levels that serve
/// distances a thousandth farther out, and a light that is lost, are noticed.
#[test]
fn look_ups() {
    let Some(gpu) = exact_gpu() else { return };
    assert_eq!(LEAST_DISTANCE * LEAST_DISTANCE, 0.002_500_000_2);
    for (salt, (count, levels, alpha)) in (0..).zip([
        (1, 1, 1.0),
        (40, 3, 2.0),
        (1000, 5, 1.0),
        (5000, 6, 1.0),
        (5000, 7, 0.5),
        (20_000, 8, 0.7),
    ]) {
        let lights = point_lights(count, salt);
        let options = GridOptions {
            alpha,
            levels: Levels::Count(levels),
            ..GridOptions::default()
        };
        let grid = LightingGrid::new(&lights, &options).expect("lights are sound");
        let inputs = questions(COUNT / 6, &lights, salt);
        let run = |stretched: f32, lost: bool| {
            let buffers = GridBuffers::new(gpu, &grid, stretched, lost);
            let shader = Shader {
                host: HOST,
                buffers: &buffers.0.each_ref(),
                ..Shader::new(
                    "import package::lightshed::lighting_grid::{GridQuery, grid_visit};
                    import package::host::{set_normal, sum, visited};",
                    BODY,
                )
            };
            let found = shader.run::<9, 5>(gpu, &inputs);
            let name = format!("{count} lights");
            // Which lights, in which order; then what of them.
            let places = found.iter().map(|&[.., count, names]| [count, names]);
            let places: Vec<[u32; 2]> = places.collect();
            compare(&name, Tier::Words, &inputs, &places, |words| {
                let [.., count, names] = answers(&grid, words);
                [count, names]
            })?;
            let tier = Tier::Bounded {
                absolute: 0.0,
                relative: 2e-6,
            };
            compare(&name, tier, &inputs, &found, |words| answers(&grid, words))
        };
        assert_eq!(run(1.0, false), Ok(()));
        if levels == 6 {
            assert!(run(1.001, false).is_err(), "another radius");
            assert!(run(1.0, true).is_err(), "a lost light");
        }
    }
}
