//! Lighting grids on a GPU: builds kernel by kernel, by its own clock, beside those of the CPU.
//!
//! ```text
//! cargo bench -p lightshed-gpu --bench lighting_grids -- [LIGHTS]...
//! ```
//!
//! 100,000 and 1,000,000 lights where none are given, with as many levels as the CPU's automatic
//! choice has for them, or as the device has memory for. Where a processor stands in for a GPU, its
//! time tells more than the clock. Says SKIPPED where there is no adapter, or none with a clock.

mod builds;
mod opening;

use builds::{BUILDS, Fastest, counts, fastest_on_cpu};
use lightshed_gpu::{Gpu, GpuError, GpuLightingGrid, LightingGridBuilder};
use lightshed_lights::glam::Vec3;
use lightshed_lights::{GridOptions, Levels, LightingGrid, PointLight};
use lightshed_sampling::CounterRng;

/// Lights on the walls of a room, as light paths leave them.
fn lights(count: usize) -> Vec<PointLight> {
    let mut rng = CounterRng::new(1, count as u32, 0);
    (0..count)
        .map(|i| {
            let mut position = Vec3::from_array([(); 3].map(|()| rng.next_f32())) * 10.0;
            let (axis, side) = (i % 3, (i / 3 % 2) as f32);
            position[axis] = 10.0 * side;
            PointLight::lambertian(
                position,
                Vec3::AXES[axis] * (1.0 - 2.0 * side),
                Vec3::splat(rng.next_f32()),
            )
        })
        .collect()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let Some(gpu) = opening::clocked_gpu() else {
        return Ok(());
    };
    let builder = LightingGridBuilder::new(&gpu)?;
    println!("{}, fastest of {BUILDS} builds\n", gpu.description());
    println!(
        "| lights | levels | vertices | build (ms) | processor time of it (ms) | CPU's of its own (ms) | kernels (ms) | look-up (MB) | scratch (MB) |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for count in counts() {
        row(&gpu, &builder, &lights(count))?;
    }
    Ok(())
}

fn row(
    gpu: &Gpu,
    builder: &LightingGridBuilder,
    lights: &[PointLight],
) -> Result<(), Box<dyn std::error::Error>> {
    let with_levels = |levels| GridOptions {
        levels: Levels::Count(levels),
        ..GridOptions::default()
    };
    let mut levels = LightingGrid::new(lights, &GridOptions::default())?.level_count();
    // There is memory for as many vertices as a level can have, which may be more than the device
    // binds.
    let grid = loop {
        match GpuLightingGrid::new(gpu, lights.len(), &with_levels(levels)) {
            Err(GpuError::TooLarge { .. }) if levels > 1 => levels -= 1,
            made => break made?,
        }
    };
    let mut cpu = LightingGrid::new(lights, &with_levels(levels))?;
    let cpu_build = fastest_on_cpu(|| cpu.rebuild(lights))?;
    let on_device = gpu.buffer("lights", lights)?;
    let build = Fastest::of(gpu, |work| builder.build(work, &on_device, &grid))?;
    let vertices: usize = (1..=cpu.level_count())
        .map(|level| cpu.grid_lights(level).len())
        .sum();
    println!(
        "| {} | {} | {vertices} | {:.1} | {:.1} | {cpu_build:.1} | {} | {:.1} | {:.1} |",
        lights.len(),
        grid.level_count(),
        build.device,
        build.processor,
        build.kernels(),
        grid.bytes() as f64 / 1e6,
        grid.scratch_bytes() as f64 / 1e6,
    );
    Ok(())
}
