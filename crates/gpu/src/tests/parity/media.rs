//! Densities, majorants along rays, and trackers.

use crate::tests::parity::harness::{COUNT, Shader, Tier, bits, check, compare, floats, gpu};
use crate::tests::support::exact_gpu;
use crate::{Buffer, Gpu};
use glam::Vec3;
use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_volume::{
    Control, DenseGrid, DensityField, FieldRay, Filter, Interval, MajorantGrid, Segment, delta_tracking,
    ratio_tracking, residual_ratio_tracking, unbiased_ray_marching, unbiased_ray_marching_lookups,
};

struct Medium {
    grid: DenseGrid,
    majorants: MajorantGrid,
    filter: Filter,
    cell: f32,
    voxels: Buffer,
    bounds: Buffer,
}

impl Medium {
    /// Blobs, with voxels of nothing between them.
    fn new(gpu: &Gpu, size: [u32; 3], filter: Filter, cell: f32) -> Self {
        let mut rng = CounterRng::new(70, size[0], size[2]);
        let count = size.iter().product::<u32>() as usize;
        let values: Vec<f32> = (0..count)
            .map(|i| {
                let wave = (i as f32 * 0.07).sin() * (i as f32 * 0.011).cos();
                (wave * 3.0 + rng.next_f32()).max(0.0)
            })
            .collect();
        let grid = DenseGrid::new(size, &values, filter).expect("the grid is sound");
        let majorants = MajorantGrid::new(&grid, cell).expect("majorants are sound");
        let ranges: Vec<[f32; 2]> = majorants.ranges().iter().map(|r| [r.min, r.max]).collect();
        Self {
            voxels: gpu.buffer("voxels", &values).expect("it is small"),
            bounds: gpu.buffer("majorants", &ranges).expect("it is small"),
            grid,
            majorants,
            filter,
            cell,
        }
    }

    fn host(&self) -> String {
        let [x, y, _] = self.grid.size();
        format!(
            "@group(0) @binding(2) var<storage, read> voxels: array<f32>;
             @group(0) @binding(3) var<storage, read> bounds: array<vec2f>;
             fn load_density(v: vec3u) -> f32 {{ return voxels[(v.z * {y}u + v.y) * {x}u + v.x]; }}
             fn load_majorant(cell: u32) -> vec2f {{ return bounds[cell]; }}"
        )
    }

    /// The medium as shaders know it.
    fn constant(&self) -> String {
        let [x, y, z] = self.grid.size();
        let [i, j, k] = self.majorants.counts();
        assert_eq!(self.majorants.cell_size(), self.cell);
        let filtering = match self.filter {
            Filter::Nearest => 0,
            Filter::Trilinear => 1,
        };
        format!(
            "let grid = MajorantGrid(vec3f(0.0), {:?}, vec3f({x}.0, {y}.0, {z}.0), 0u, vec3u({i}u, {j}u, {k}u), 0u);
             let medium = Medium(grid, vec3u({x}u, {y}u, {z}u), {filtering}u);
             let ray = FieldRay(vec3f(number(0u), number(1u), number(2u)), vec3f(number(3u), number(4u), number(5u)));
             let interval = vec2f(number(6u), number(7u));",
            self.cell
        )
    }

    fn media(gpu: &Gpu) -> Vec<Self> {
        [
            ([16, 16, 16], Filter::Trilinear, 8.0),
            ([13, 7, 40], Filter::Trilinear, 3.0),
            ([9, 20, 5], Filter::Nearest, 2.5),
            ([1, 1, 1], Filter::Trilinear, 1.0),
            ([33, 1, 2], Filter::Nearest, 0.7),
        ]
        .map(|(size, filter, cell)| Self::new(gpu, size, filter, cell))
        .into()
    }
}

const IMPORTS: &str = "import package::lightshed::density::density_at;
    import package::lightshed::majorant::{FieldRay, MajorantGrid, dda_new, dda_step};
    import package::lightshed::stream::stream_of_sample;
    import package::lightshed::tracking::{Medium, delta_tracking, ratio_tracking, residual_ratio_tracking};
    fn plus(x: f32) -> u32 { return bitcast<u32>(select(x, 0.0, x == 0.0)); }";

/// Zeros of one sign.
fn plus(x: f32) -> u32 {
    (if x == 0.0 { 0.0 } else { x }).to_bits()
}

/// Rays through a field, at random, and along faces, edges and diagonals of its cells; their
/// origins, directions and intervals.
fn rays(size: [u32; 3], cell: f32, salt: u32, count: usize) -> Vec<[u32; 8]> {
    let size = Vec3::from_array(size.map(|n| n as f32));
    let mut rng = CounterRng::new(71, salt, 0);
    (0..count)
        .map(|i| {
            let inside = Vec3::from_array([(); 3].map(|()| rng.next_f32())) * size;
            let snapped = (inside / cell).round() * cell;
            let whole = inside.round();
            let direction = UniformSphere::sample(rng.next_2d());
            let axis = Vec3::AXES[rng.next_u32() as usize % 3]
                * if rng.next_u32().is_multiple_of(2) {
                    1.0
                } else {
                    -1.0
                };
            let signs =
                Vec3::from_array([(); 3].map(|()| [1.0, -1.0, 0.0, -0.0][rng.next_u32() as usize % 4]));
            let (origin, direction) = match i % 16 {
                // Along faces and edges; from corner to corner; nowhere.
                0 => (snapped - axis * 50.0, axis),
                1 => (snapped, signs),
                2 => (whole - signs * 64.0, signs),
                3 => (snapped, direction),
                // Slow and fast, far away, nearly along an axis.
                4 => (inside, direction * 1e-3),
                5 => (inside - direction * 1e4, direction * 300.0),
                6 => (inside, axis + direction * 1e-7),
                7 => (inside, axis + signs * 1e-40),
                8 => (snapped - axis * 2.0, axis + signs * 1e-30),
                // Towards a corner.
                9 => (inside * 3.0 - size, snapped - (inside * 3.0 - size)),
                _ => (inside - direction * (20.0 * rng.next_f32()), direction),
            };
            let interval = match rng.next_u32() % 4 {
                0 => [0.0, f32::INFINITY],
                1 => [0.0, 30.0 * rng.next_f32()],
                2 => [-5.0, 1e9],
                _ => [10.0 * rng.next_f32(), 20.0],
            };
            let [ox, oy, oz] = origin.to_array();
            let [dx, dy, dz] = direction.to_array();
            bits([ox, oy, oz, dx, dy, dz, interval[0], interval[1]])
        })
        .collect()
}

fn ray_of(words: [u32; 8]) -> (FieldRay, Interval) {
    let [ox, oy, oz, dx, dy, dz, t0, t1] = floats(&words);
    (
        FieldRay::new(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz)),
        Interval { t0, t1 },
    )
}

#[test]
fn densities() {
    let Some(device) = gpu() else { return };
    let media = Medium::media(device);
    for medium in &media {
        let size = Vec3::from_array(medium.grid.size().map(|n| n as f32));
        let mut rng = CounterRng::new(72, 0, 0);
        let places: Vec<[u32; 3]> = (0..COUNT / 4)
            .map(|i| {
                let p = Vec3::from_array([(); 3].map(|()| rng.next_f32() * 1.1 - 0.05)) * size;
                // Faces and centres of voxels.
                let p = match i % 4 {
                    0 => p.round(),
                    1 => (2.0 * p).round() * 0.5,
                    _ => p,
                };
                bits(p.to_array())
            })
            .collect();
        check::<3, 1>(
            "density",
            Tier::Exact,
            &Shader {
                host: &medium.host(),
                buffers: &[&medium.voxels, &medium.bounds],
                ..Shader::new(
                    "import package::lightshed::density::density_at;",
                    &format!(
                        "put(0u, bitcast<u32>(density_at(vec3u({}), {}u, vec3f(number(0u), number(1u), number(2u)))));",
                        medium.grid.size().map(|n| format!("{n}u")).join(", "),
                        u32::from(medium.filter == Filter::Trilinear),
                    ),
                )
            },
            &places,
            |words| bits([medium.grid.density(Vec3::from_array(floats(words)))]),
        );
    }
}

/// All parts of a ray: how many there are, and a number made of all their bits.
fn digest(segments: impl Iterator<Item = Segment>) -> [u32; 4] {
    let mut all = [0, 0x811c_9dc5u32, 0, 0];
    for segment in segments {
        all[0] += 1;
        for word in [
            plus(segment.t0),
            plus(segment.t1),
            segment.majorant.to_bits(),
            segment.minorant.to_bits(),
        ] {
            all[1] = (all[1] ^ word).wrapping_mul(0x0100_0193);
        }
        all[2] = plus(segment.t0);
        all[3] = plus(segment.t1);
    }
    all
}

const SEGMENTS: &str = "var dda = dda_new(grid, ray, interval);
    var all = vec4u(0u, 0x811c9dc5u, 0u, 0u);
    while true {
        let crossing = dda_step(dda);
        dda = crossing.dda;
        if !crossing.found { break; }
        let s = crossing.segment;
        all.x += 1u;
        all.z = plus(s.t0);
        all.w = plus(s.t1);
        all.y = (all.y ^ all.z) * 0x01000193u;
        all.y = (all.y ^ all.w) * 0x01000193u;
        all.y = (all.y ^ bitcast<u32>(s.majorant)) * 0x01000193u;
        all.y = (all.y ^ bitcast<u32>(s.minorant)) * 0x01000193u;
    }
    for (var k = 0u; k < 4u; k++) { put(k, all[k]); }";

#[test]
fn segments() {
    let Some(device) = exact_gpu() else { return };
    let media = Medium::media(device);
    for (salt, medium) in (0..).zip(&media) {
        let inputs = rays(medium.grid.size(), medium.cell, salt, COUNT / 4);
        let body = medium.constant() + SEGMENTS;
        let shader = Shader {
            host: &medium.host(),
            buffers: &[&medium.voxels, &medium.bounds],
            ..Shader::new(IMPORTS, &body)
        };
        let found = shader.run::<8, 4>(device, &inputs);
        let truth = |words: &[u32; 8]| {
            let (ray, interval) = ray_of(*words);
            digest(medium.majorants.segments(&ray, interval))
        };
        assert_eq!(compare("segments", Tier::Words, &inputs, &found, truth), Ok(()));
        let crossed: u32 = found.iter().map(|found| found[0]).sum();
        assert!(crossed as usize > COUNT / 16, "{crossed} segments in all");
        // An interval that ends one unit in the last place later.
        let planted = |words: &[u32; 8]| {
            let mut words = *words;
            words[7] += u32::from(f32::from_bits(words[7]).is_finite());
            let (ray, interval) = ray_of(words);
            digest(medium.majorants.segments(&ray, interval))
        };
        assert!(compare("planted", Tier::Words, &inputs, &found, planted).is_err());
    }
}

/// What the library's trackers give for a ray, with the coefficient in word 8.
fn track(medium: &Medium, words: &[u32; 9]) -> [u32; 12] {
    let (ray, interval) = ray_of(core::array::from_fn(|k| words[k]));
    let extinction = f32::from_bits(words[8]);
    let segments = || medium.majorants.segments(&ray, interval);
    let stream = |dimension| {
        let mut rng = CounterRng::new(7 | 9 << 32, words[0], words[4]);
        rng.set_dimension(dimension);
        rng
    };
    let mut accessor = medium.grid.accessor();
    let mut rng = stream(0);
    let flight = delta_tracking(&mut accessor, &ray, segments(), extinction, &mut rng);
    let mut after_ratio = stream(3);
    let ratio = ratio_tracking(&mut accessor, &ray, segments(), extinction, &mut after_ratio);
    let mut after_residual = stream(2);
    let [minorant, middle] = [Control::Minorant, Control::Middle].map(|control| {
        after_residual = stream(2);
        let rng = &mut after_residual;
        residual_ratio_tracking(&mut accessor, &ray, segments(), extinction, control, rng)
    });
    [
        flight.distance.unwrap_or(0.0).to_bits(),
        flight.lookups,
        u32::from(flight.distance.is_some()),
        rng.dimension(),
        ratio.value.to_bits(),
        ratio.lookups,
        minorant.lookups,
        middle.lookups,
        after_ratio.dimension(),
        after_residual.dimension(),
        minorant.value.to_bits(),
        middle.value.to_bits(),
    ]
}

const TRACKERS: &str = "let k = number(8u);
    var s0 = stream_of_sample(vec2u(7u, 9u), word(0u), word(4u), 0u);
    let flight = delta_tracking(medium, ray, interval, k, &s0);
    put_f(0u, flight.distance); put(1u, flight.lookups); put(2u, select(0u, 1u, flight.collided)); put(3u, s0.dimension);
    var s1 = stream_of_sample(vec2u(7u, 9u), word(0u), word(4u), 3u);
    let ratio = ratio_tracking(medium, ray, interval, k, &s1);
    put_f(4u, ratio.value); put(5u, ratio.lookups); put(8u, s1.dimension);
    for (var c = 1u; c < 3u; c++) {
        var s2 = stream_of_sample(vec2u(7u, 9u), word(0u), word(4u), 2u);
        let residual = residual_ratio_tracking(medium, ray, interval, k, c, &s2);
        put(5u + c, residual.lookups); put_f(9u + c, residual.value); put(9u, s2.dimension);
    }";

/// Tracking draws the library's random words: collisions are the same, and transmittances by ratio
/// tracking. What residual ratio tracking estimates contains the device's `exp`, and a product that
/// is rounded to `f32`: within 4·10⁻⁶ relatively, or 10⁻³⁷ where it leaves the range.
#[test]
fn trackers() {
    let Some(device) = exact_gpu() else { return };
    for (salt, medium) in (10..).zip(&Medium::media(device)) {
        let mut inputs: Vec<[u32; 9]> = rays(medium.grid.size(), medium.cell, salt, COUNT / 4)
            .iter()
            .zip((0..).map(|i| [0.0f32, 0.05, 0.7, 2.0][i % 4].to_bits()))
            .map(|(ray, k)| core::array::from_fn(|word| if word < 8 { ray[word] } else { k }))
            .collect();
        inputs.retain(|words| {
            // Expected collisions are not too many.
            let (ray, interval) = ray_of(core::array::from_fn(|k| words[k]));
            let segments = medium.majorants.segments(&ray, interval);
            segments.map(|s| s.majorant * (s.t1 - s.t0)).sum::<f32>() < 60.0
        });
        assert!(inputs.len() > COUNT / 8);
        let body = medium.constant() + TRACKERS;
        let shader = Shader {
            host: &medium.host(),
            buffers: &[&medium.voxels, &medium.bounds],
            ..Shader::new(IMPORTS, &body)
        };
        let found = shader.run::<9, 12>(device, &inputs);
        let truths: std::collections::HashMap<[u32; 9], [u32; 12]> = inputs
            .iter()
            .map(|words| (*words, track(medium, words)))
            .collect();
        let split = |all: &[u32; 12]| -> ([u32; 10], [u32; 2]) {
            (core::array::from_fn(|k| all[k]), [all[10], all[11]])
        };
        let (exact, estimates): (Vec<_>, Vec<_>) = found.iter().map(split).unzip();
        let compared = compare("trackers", Tier::Exact, &inputs, &exact, |w| split(&truths[w]).0);
        assert_eq!(compared, Ok(()));
        let tier = Tier::Bounded {
            absolute: 1e-37,
            relative: 4e-6,
        };
        let compared = compare("residual ratio", tier, &inputs, &estimates, |w| {
            split(&truths[w]).1
        });
        assert_eq!(compared, Ok(()));
        // Planted: a coefficient, and estimates, that are off by 10⁻⁴ and 10⁻⁵.
        let another = |words: &[u32; 9]| {
            let mut words = *words;
            words[8] = (f32::from_bits(words[8]) * 1.0001).to_bits();
            split(&track(medium, &words)).0
        };
        assert!(compare("planted", Tier::Exact, &inputs[..4000], &exact[..4000], another).is_err());
        let brighter = |words: &[u32; 9]| {
            split(&truths[words])
                .1
                .map(|w| (f32::from_bits(w) * (1.0 + 1e-5)).to_bits())
        };
        assert!(compare("planted", tier, &inputs, &estimates, brighter).is_err());
    }
}

const MARCHING: &str = "let k = number(8u);
    var stream = stream_of_sample(vec2u(7u, 9u), word(0u), word(4u), 0u);
    let bounds = marching_bounds(medium, ray, interval);
    let found = unbiased_ray_marching(medium, ray, interval, bounds, k, word(9u), &stream);
    put_f(0u, found.value); put(1u, found.lookups); put(2u, stream.dimension);";

/// Unbiased ray marching draws the library's random words and makes as many queries. Its sums are
/// `f32`, and where a lookup falls on the other side of a jump of the density by rounding its
/// estimate is another: for all but one in a thousand it is within 2·10⁻⁴ of 1.
#[test]
fn unbiased_marching() {
    let Some(device) = gpu() else { return };
    let imports = "import package::lightshed::unbiased_marching::{marching_bounds, unbiased_ray_marching};"
        .to_owned()
        + IMPORTS;
    let mut corrected = 0;
    for (salt, medium) in (20..).zip(&Medium::media(device)) {
        let mut inputs = Vec::new();
        for (i, ray) in (0..).zip(rays(medium.grid.size(), medium.cell, salt, COUNT / 16)) {
            let k = [0.0f32, 0.02, 0.1, 0.5][i % 4];
            let (field_ray, interval) = ray_of(ray);
            let segments = medium.majorants.segments(&field_ray, interval);
            let depth = k * segments.map(|s| s.majorant * (s.t1 - s.t0)).sum::<f32>();
            if depth < 20.0 {
                let lookups = unbiased_ray_marching_lookups(depth);
                let more = [k.to_bits(), lookups];
                inputs.push(core::array::from_fn(|word| {
                    if word < 8 { ray[word] } else { more[word - 8] }
                }));
            }
        }
        assert!(inputs.len() > COUNT / 64);
        let truth = |words: &[u32; 10]| {
            let (ray, interval) = ray_of(core::array::from_fn(|k| words[k]));
            let mut rng = CounterRng::new(7 | 9 << 32, words[0], words[4]);
            let segments = medium.majorants.segments(&ray, interval);
            let (k, lookups) = (f32::from_bits(words[8]), words[9]);
            let estimate =
                unbiased_ray_marching(&mut medium.grid.accessor(), &ray, segments, k, lookups, &mut rng);
            (estimate.value, [estimate.lookups, rng.dimension()])
        };
        let body = medium.constant() + MARCHING;
        let shader = Shader {
            host: &medium.host(),
            buffers: &[&medium.voxels, &medium.bounds],
            ..Shader::new(&imports, &body)
        };
        let found = shader.run::<10, 3>(device, &inputs);
        let (mut off, mut darker) = (0, 0);
        for (input, found) in inputs.iter().zip(&found) {
            let (value, words) = truth(input);
            assert_eq!(found[1..], words, "{input:?}");
            let beyond = |value: f32| (f32::from_bits(found[0]) - value).abs() > 2e-4 * value.abs().max(1.0);
            off += usize::from(beyond(value));
            darker += usize::from(beyond(0.999 * value));
            corrected += usize::from(words[0] > input[9]);
        }
        println!("{off} of {} estimates are others", inputs.len());
        assert!(off * 1000 < inputs.len(), "{off}");
        // Planted: a thousandth is noticed.
        assert!(darker * 4 > inputs.len(), "{darker}");
    }
    assert!(corrected > COUNT / 400, "{corrected} with corrections");
}

/// Numbers of lookups are the library's, or where rounding decides one more or less.
#[test]
fn lookups_of_marching() {
    let Some(device) = gpu() else { return };
    let inputs: Vec<[u32; 1]> = (0..COUNT).map(|i| [(i as f32 * 0.003).to_bits()]).collect();
    let shader = Shader {
        host: "fn load_density(v: vec3u) -> f32 { return 0.0; } fn load_majorant(cell: u32) -> vec2f { return vec2f(0.0); }",
        ..Shader::new(
            "import package::lightshed::unbiased_marching::marching_lookups;",
            "put(0u, marching_lookups(number(0u)));",
        )
    };
    let found = shader.run::<1, 1>(device, &inputs);
    let mut others = 0;
    for (&[depth], &[found]) in inputs.iter().zip(&found) {
        let truth = unbiased_ray_marching_lookups(f32::from_bits(depth));
        assert!(found.abs_diff(truth) <= 1, "{found} for {truth}");
        others += usize::from(found != truth);
    }
    assert!(others * 1000 < COUNT, "{others}");
}
