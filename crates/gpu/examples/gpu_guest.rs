//! A guest: a wgpu program of its own that takes random numbers, an alias table and reservoirs from `lightshed-shaders` and brings the
//! rest itself. A floor is lit by a thousand small lamps; each of its points draws lamps by power and keeps one of them in proportion to
//! what it gives there (resampled importance sampling). Noise is printed against the number of draws.
//!
//! ```text
//! cargo run --release -p lightshed-gpu --example gpu_guest
//! ```

use lightshed_sampling::{AliasTable, CounterRng};
use lightshed_shaders::Linker;
use wgpu::util::DeviceExt;

const LAMPS: u32 = 1000;
const SIDE: u32 = 256;

/// What the library asks of us: an entry of our table.
const HOST: &str = "
import package::lightshed::alias::AliasEntry;
@group(0) @binding(1) var<storage, read> entries: array<AliasEntry>;
fn load_alias_entry(table: u32, index: u32) -> AliasEntry { return entries[index]; }
";

/// Our own program; a lamp is its position and its power.
const MAIN: &str = "
import package::lightshed::alias::alias_sample;
import package::lightshed::reservoir::{Selection, contribution_weight, offer};
import package::lightshed::rng::random_block;
import package::lightshed::uniform::f32_from_u32;

override LAMPS: u32; override SIDE: u32; override DRAWS: u32;
@group(0) @binding(0) var<storage, read> lamps: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> image: array<f32>;

fn light_at(x: vec3f, lamp: vec4f) -> f32 {
    let d = lamp.xyz - x;
    return lamp.w * d.y / (dot(d, d) * length(d));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let x = vec3f(f32(id.x), 0.0, f32(id.y)) * (20.0 / f32(SIDE)) - vec3f(10.0, 0.0, 10.0);
    var selection: Selection;
    for (var i = 0u; i < DRAWS; i++) {
        let words = random_block(vec2u(7u, 0u), id.y * SIDE + id.x, 0u, i);
        let lamp = alias_sample(0u, LAMPS, words.xy);
        // Lamps are drawn with p = power / (sum of all powers, 1): w = p_hat / (p DRAWS).
        let weight = light_at(x, lamps[lamp]) / (lamps[lamp].w * f32(DRAWS));
        selection = offer(selection, lamp, weight, f32_from_u32(words.z)).selection;
    }
    let chosen = light_at(x, lamps[selection.item]);
    image[id.y * SIDE + id.x] = chosen * contribution_weight(selection, chosen);
}
";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Our scene.
    let mut rng = CounterRng::new(1, 0, 0);
    let mut lamps: Vec<[f32; 4]> = (0..LAMPS)
        .map(|_| {
            let ([x, z], [h, p]) = (rng.next_2d(), rng.next_2d());
            [20.0 * x - 10.0, 0.3 + h, 20.0 * z - 10.0, 0.01 + p * p * p]
        })
        .collect();
    let total: f32 = lamps.iter().map(|lamp| lamp[3]).sum();
    lamps.iter_mut().for_each(|lamp| lamp[3] /= total);
    let table = AliasTable::new(&lamps.iter().map(|lamp| lamp[3]).collect::<Vec<_>>())?;

    // Our device, and the library linked into our program.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    println!("{}", adapter.get_info().name);
    let wgsl = Linker::new()
        .module("package::host", HOST)
        .module("package::main", MAIN)
        .link("package::main")?;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(wgsl.into()),
    });
    let buffer = |contents: &[u8]| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        })
    };
    let image = buffer(&vec![0; 4 * (SIDE * SIDE) as usize]);
    let bound = [
        buffer(bytemuck::cast_slice(&lamps)),
        buffer(bytemuck::cast_slice(table.entries())),
        image.clone(),
    ];

    let mut before: Option<f64> = None;
    for draws in [1u32, 4, 16, 64, 256] {
        let constants = [("LAMPS", LAMPS), ("SIDE", SIDE), ("DRAWS", draws)].map(|(k, v)| (k, f64::from(v)));
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            },
            cache: None,
        });
        let entries: Vec<_> = (0..)
            .zip(&bound)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
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
        let (sender, receiver) = std::sync::mpsc::channel();
        queue.submit([encoder.finish()]);
        wgpu::util::DownloadBuffer::read_buffer(&device, &queue, &image.slice(..), move |data| {
            // The receiver waits below.
            sender.send(data).ok();
        });
        device.poll(wgpu::PollType::wait_indefinitely())?;
        let data = receiver.recv()??;
        let found: &[f32] = bytemuck::cast_slice(&data);

        // Against the sum over all lamps.
        let mut squares = 0.0;
        for (i, &value) in (0..).zip(found) {
            let at = |k: u32| k as f32 * (20.0 / SIDE as f32) - 10.0;
            let truth: f32 = lamps
                .iter()
                .map(|l| light_at([at(i % SIDE), 0.0, at(i / SIDE)], l))
                .sum();
            squares += f64::from(value / truth - 1.0).powi(2);
        }
        let noise = (squares / f64::from(SIDE * SIDE)).sqrt();
        println!("{draws:>4} draws: relative noise {noise:.3}");
        assert!(
            before.is_none_or(|before| noise < before),
            "more draws, less noise"
        );
        before = Some(noise);
    }
    Ok(())
}

fn light_at(x: [f32; 3], lamp: &[f32; 4]) -> f32 {
    let d = [lamp[0] - x[0], lamp[1] - x[1], lamp[2] - x[2]];
    let squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    lamp[3] * d[1] / (squared * squared.sqrt())
}
