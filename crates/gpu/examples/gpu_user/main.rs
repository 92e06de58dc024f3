//! A user: a wgpu program of its own that takes random numbers, a light tree and reservoirs from
//! `lightshed-shaders` and brings the rest itself. A floor is lit by ten thousand small lamps; each
//! of its points draws lamps, by power or by the tree, and keeps one in proportion to what it gives
//! there (resampled importance sampling). Noise is printed against the number of draws.
//!
//! ```text
//! cargo run --release -p lightshed-gpu --example gpu_user
//! ```

use lightshed_lights::{Bounds, Light, PerfectTree};
use lightshed_sampling::CounterRng;
use lightshed_shaders::Linker;
use wgpu::util::{BufferInitDescriptor, DeviceExt, DownloadBuffer};

const LAMPS: usize = 10_000;
const SIDE: u32 = 128;

/// What the library asks of us: the tree's memory.
const HOST: &str = include_str!("host.wesl");

/// Our own program.
const MAIN: &str = include_str!("main.wesl");

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Our scene, and its tree.
    let mut rng = CounterRng::new(1, 0, 0);
    let mut lamp = || {
        let ([x, z], [h, i]) = (rng.next_2d(), rng.next_2d());
        [20.0 * x - 10.0, 0.3 + h, 20.0 * z - 10.0, 0.01 + i * i * i]
    };
    let lamps: Vec<[f32; 4]> = (0..LAMPS).map(|_| lamp()).collect();
    let light = |&[x, y, z, intensity]: &[f32; 4]| Light {
        bounds: Bounds::of_point([x, y, z].into()),
        intensity,
        cone: None,
    };
    let tree = PerfectTree::new(&lamps.iter().map(light).collect::<Vec<_>>())?;
    let tree = tree.layout();

    // Our device, and the library linked into our program.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let wgsl = Linker::new()
        .module("package::host", HOST)
        .module("package::main", MAIN)
        .link("package::main")?;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(wgsl.into()),
    });
    let buffer = |contents: &[u8]| {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let label = None;
        device.create_buffer_init(&BufferInitDescriptor {
            label,
            contents,
            usage,
        })
    };
    let image = buffer(&[0; 4 * (SIDE * SIDE) as usize]);
    let words = [tree.levels, tree.light_at].map(|words| buffer(bytemuck::cast_slice(words)));
    let rows = buffer(bytemuck::cast_slice(tree.rows));
    let bound = [
        &buffer(bytemuck::cast_slice(&lamps)),
        &rows,
        &words[0],
        &words[1],
        &image,
    ];

    // The sum over all lamps.
    let at = |k: u32| k as f32 * (20.0 / SIDE as f32) - 10.0;
    let sum = |i| {
        lamps
            .iter()
            .map(|lamp| light_at_point([at(i % SIDE), 0.0, at(i / SIDE)], lamp))
            .sum()
    };
    let truth: Vec<f32> = (0..SIDE * SIDE).map(sum).collect();
    println!("{}: relative noise of {LAMPS} lamps", adapter.get_info().name);
    for draws in [1u32, 4, 16, 64] {
        let noise = [0, 1].map(|by_tree| -> Result<f64, Box<dyn std::error::Error>> {
            let depth = tree.levels.len() as u32 - 1;
            let constants = [
                ("LAMPS", LAMPS as u32),
                ("SIDE", SIDE),
                ("DRAWS", draws),
                ("BY_TREE", by_tree),
                ("DEPTH", depth),
                ("STRIDE", tree.stride),
                ("WEIGHTING", tree.weighting),
            ];
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: None,
                layout: None,
                module: &module,
                entry_point: Some("main"),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &constants.map(|(name, value)| (name, f64::from(value))),
                    ..Default::default()
                },
                cache: None,
            });
            let mut entries = Vec::new();
            for (binding, buffer) in (0..).zip(&bound) {
                let resource = buffer.as_entire_binding();
                entries.push(wgpu::BindGroupEntry { binding, resource });
            }
            let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &pipeline.get_bind_group_layout(0),
                entries: &entries,
            });
            let mut encoder = device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bind_group, &[]);
            pass.dispatch_workgroups(SIDE / 8, SIDE / 8, 1);
            drop(pass);
            queue.submit([encoder.finish()]);
            let (sender, receiver) = std::sync::mpsc::channel();
            DownloadBuffer::read_buffer(&device, &queue, &image.slice(..), move |data| {
                sender.send(data).ok();
            });
            device.poll(wgpu::PollType::wait_indefinitely())?;
            let data = receiver.recv()??;
            let found: &[f32] = bytemuck::cast_slice(&data);
            let square = |(found, truth): (&f32, &f32)| f64::from(found / truth - 1.0).powi(2);
            Ok((found.iter().zip(&truth).map(square).sum::<f64>() / f64::from(SIDE * SIDE)).sqrt())
        });
        let [plain, by_tree] = noise;
        println!(
            "{draws:>3} draws: {:.3} all alike, {:.3} by the tree",
            plain?, by_tree?
        );
    }
    Ok(())
}

fn light_at_point(x: [f32; 3], lamp: &[f32; 4]) -> f32 {
    let d = [lamp[0] - x[0], lamp[1] - x[1], lamp[2] - x[2]];
    let squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    lamp[3] * d[1] / (squared * squared.sqrt())
}
