//! A wgpu program of one's own with shader modules of the library in it: no linker.
//!
//! `cargo run --release --manifest-path examples/users/Cargo.toml -p own_shader`
use std::error::Error;
use wgpu::util::{DeviceExt, DownloadBuffer};

/// Our own shader: each invocation samples the cosine over the hemisphere, whose integral is π.
const MAIN: &str = "
@group(0) @binding(0) var<storage, read_write> estimates: array<f32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let words = random_block(vec2u(1u, 0u), id.x, 0u, 0u);
    let direction = uniform_hemisphere(unit_square(words.xy));
    estimates[id.x] = 6.2831853 * direction.z;
}
";

/// Our shader with the modules that it uses.
fn shader() -> Result<String, lightshed_shaders::BundleError> {
    Ok(lightshed_shaders::bundle(&["rng", "uniform", "warp"])? + MAIN)
}

/// Estimates by the first device; `None` if there is none.
fn estimates(count: u32) -> Result<Option<Vec<f32>>, Box<dyn Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let Ok(adapter) = pollster::block_on(instance.request_adapter(&Default::default())) else {
        return Ok(None);
    };
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let source = wgpu::ShaderSource::Wgsl(shader()?.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
    let contents = &vec![0; 4 * count as usize];
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage });
    let layout = &pipeline.get_bind_group_layout(0);
    let entries = &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }];
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(count / 64, 1, 1);
    drop(pass);
    queue.submit([encoder.finish()]);
    let (sender, receiver) = std::sync::mpsc::channel();
    DownloadBuffer::read_buffer(&device, &queue, &buffer.slice(..), move |data| drop(sender.send(data)));
    device.poll(wgpu::PollType::wait_indefinitely())?;
    Ok(Some(bytemuck::cast_slice(&receiver.recv()??).to_vec()))
}

fn main() -> Result<(), Box<dyn Error>> {
    match estimates(1 << 16)? {
        Some(all) => println!("{:.4}, and π is 3.1416", all.iter().sum::<f32>() / all.len() as f32),
        None => println!("no device: {} lines of WGSL", shader()?.lines().count()),
    }
    Ok(())
}

#[cfg(test)]
mod tests;
