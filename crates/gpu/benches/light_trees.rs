//! Light trees on a GPU: builds kernel by kernel and choices, by its own clock, beside those of the
//! CPU.
//!
//! ```text
//! cargo bench -p lightshed-gpu --bench light_trees -- [LIGHTS]...
//! ```
//!
//! 100,000 and 1,000,000 lights where none are given. Where a processor stands in for a GPU, its
//! time tells more than the clock. Says SKIPPED where there is no adapter, or none with a clock.

mod builds;
mod opening;

use builds::{BUILDS, Fastest, counts, cpu_seconds, fastest_on_cpu};
use lightshed_gpu::{Access, Gpu, GpuLightTree, Kernel, LightTreeBuilder};
use lightshed_lights::glam::Vec3;
use lightshed_lights::{
    Bounds, Curve, Light, LightRecord, LightSampler, OrientationCone, PerfectTree, ShadingPoint,
};
use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_shaders::Linker;

/// Choices, each for a point of its own.
const CHOICES: u32 = 1 << 18;

/// Small emitting triangles' boxes all over a cube.
fn lights(count: usize) -> Vec<Light> {
    let mut rng = CounterRng::new(1, count as u32, 0);
    (0..count)
        .map(|_| {
            let center = Vec3::from_array([(); 3].map(|()| rng.next_f32())) * 100.0;
            Light {
                bounds: Bounds::new(center - 0.05, center + 0.05),
                intensity: rng.next_f32(),
                cone: Some(OrientationCone::diffuse(UniformSphere::sample(rng.next_2d()))),
            }
        })
        .collect()
}

/// One choice a thread, for points all over the lights' cube.
const SAMPLE: &str = "
    import package::lightshed::importance::{FACING_FRONT, ShadingPoint};
    import package::lightshed::light_tree::{LightTree, light_tree_sample};
    import package::lightshed::rng::random_block;
    import package::lightshed::uniform::f32_from_u32;
    @group(0) @binding(0) var<storage, read> tree: LightTree;
    @group(0) @binding(1) var<storage, read_write> choices: array<vec2u>;
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3u) {
        let a = random_block(vec2u(2u, 0u), id.x, 0u, 0u);
        let b = random_block(vec2u(2u, 0u), id.x, 0u, 1u);
        let place = 100.0 * vec3f(f32_from_u32(a.x), f32_from_u32(a.y), f32_from_u32(a.z));
        let at = ShadingPoint(place, 1.0, vec3f(0.0, 0.0, 1.0), FACING_FRONT);
        let choice = light_tree_sample(tree, at, b.xy);
        choices[id.x] = vec2u(choice.light, bitcast<u32>(choice.pmf));
    }";
const HOST: &str = "
    @group(0) @binding(2) var<storage, read> rows: array<vec4u>;
    @group(0) @binding(3) var<storage, read> levels: array<u32>;
    @group(0) @binding(4) var<storage, read> light_at: array<u32>;
    fn load_light_row(place: u32) -> vec4u { return rows[place]; }
    fn load_light_level(level: u32) -> u32 { return levels[level]; }
    fn load_light_at(leaf: u32) -> u32 { return light_at[leaf]; }
    // Probabilities are not asked for.
    fn load_leaf_of(light: u32) -> u32 { return 0u; }";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let Some(gpu) = opening::clocked_gpu() else {
        return Ok(());
    };
    let wgsl = Linker::new()
        .module("package::main", SAMPLE)
        .module("package::host", HOST)
        .link("package::main")?;
    let bindings = [
        Access::Read,
        Access::Write,
        Access::Read,
        Access::Read,
        Access::Read,
    ];
    let sample = gpu.kernel("sample", &wgsl, "main", &bindings, &[])?;
    let builder = LightTreeBuilder::new(&gpu)?;
    println!("{}, fastest of {BUILDS} builds\n", gpu.description());
    println!(
        "| lights | build (ms) | processor time of it (ms) | kernels (ms) | CPU build (ms) | choices (M/s) | CPU, one thread (M/s) | tree (MB) | scratch (MB) |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for count in counts() {
        row(&gpu, &builder, &sample, count)?;
    }
    Ok(())
}

fn row(
    gpu: &Gpu,
    builder: &LightTreeBuilder,
    sample: &Kernel,
    count: usize,
) -> Result<(), Box<dyn std::error::Error>> {
    let lights = lights(count);
    let records: Vec<LightRecord> = lights.iter().map(LightRecord::new).collect();
    let records = gpu.buffer("lights", &records)?;
    let tree = GpuLightTree::new(gpu, count, Curve::Hilbert)?;
    let build = Fastest::of(gpu, |work| builder.build(work, &records, &tree))?;

    let mut cpu = PerfectTree::new(&lights)?;
    let cpu_build = fastest_on_cpu(|| cpu.rebuild(&lights))?;

    let header = gpu.buffer("tree", &[tree.lights(), tree.depth(), 3, 1])?;
    let choices = gpu.zeros("choices", 8 * u64::from(CHOICES))?;
    let mut seconds = f64::INFINITY;
    for _ in 0..10 * BUILDS {
        let mut work = gpu.timed_work();
        let buffers = [&header, &choices, &tree.rows, &tree.levels, &tree.light_at];
        work.dispatch(sample, &buffers, [CHOICES / 64, 1, 1]);
        let passes = work.finish()?;
        seconds = seconds.min(passes.iter().map(|pass| pass.seconds).sum());
    }
    let found: Vec<[u32; 2]> = gpu.read(&choices, CHOICES as usize)?;

    let start = cpu_seconds();
    let (mut other, mut off) = (0, 0);
    for (i, found) in (0..).zip(&found) {
        let mut rng = CounterRng::new(2, i, 0);
        let place = 100.0 * Vec3::from_array([(); 3].map(|()| rng.next_f32()));
        rng.set_dimension(4);
        let at = ShadingPoint::new(place, Vec3::Z, 1.0);
        let choice = cpu.sample(&at, rng.next_u64());
        let (light, pmf) = choice.map_or((0, 0.0), |choice| (choice.light, choice.pmf));
        let differs = (f32::from_bits(found[1]) - pmf).abs() > 1e-5 * pmf;
        other += u32::from(light != found[0]);
        off += u32::from(light == found[0] && differs);
    }
    let cpu_seconds = cpu_seconds() - start;
    let millions = |seconds: f64| f64::from(CHOICES) / seconds / 1e6;
    println!(
        "| {count} | {:.1} | {:.1} | {} | {cpu_build:.1} | {:.2} | {:.2} | {:.1} | {:.1} |",
        build.device,
        build.processor,
        build.kernels(),
        millions(seconds),
        millions(cpu_seconds),
        tree.bytes() as f64 / 1e6,
        tree.scratch_bytes() as f64 / 1e6,
    );
    println!(
        "\nOf {CHOICES} choices {other} are of other lights than the CPU's; of the rest {off} have probabilities off by \
         more than 10⁻⁵.\n"
    );
    if count == 100_000 {
        println!(
            "Beside an RTX 2080 (Lin 2022, chapter 4): build {:.2} ms for 0.43 ms; four choices for each of 1920x1080 pixels {:.1} ms, for \
             11.5 ms with their shadow rays and shading.\n",
            build.device,
            1e3 * f64::from(1920 * 1080 * 4) * seconds / f64::from(CHOICES),
        );
    }
    Ok(())
}
