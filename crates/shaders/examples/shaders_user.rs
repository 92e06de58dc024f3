//! A user's example: a program of its own, linked with modules of the library into plain WGSL.
//!
//! `cargo run -p lightshed-shaders --features link --example shaders_user`
use lightshed_shaders::{Linker, MODULES};
use std::error::Error;

/// What the library asks of a program that uses `light_tree`: where its memory is.
const HOST: &str = "
@group(0) @binding(0) var<storage, read> rows: array<vec4u>;
@group(0) @binding(1) var<storage, read> levels: array<u32>;
@group(0) @binding(2) var<storage, read> light_at: array<u32>;
@group(0) @binding(3) var<storage, read> leaf_of: array<u32>;
fn load_light_row(place: u32) -> vec4u { return rows[place]; }
fn load_light_level(level: u32) -> u32 { return levels[level]; }
fn load_light_at(leaf: u32) -> u32 { return light_at[leaf]; }
fn load_leaf_of(light: u32) -> u32 { return leaf_of[light]; }
";

/// A light for each pixel.
const MAIN: &str = "
import package::lightshed::importance::ShadingPoint;
import package::lightshed::light_tree::{LightTree, LightChoice, light_tree_sample};
import package::lightshed::rng::random_block;

@group(1) @binding(0) var<storage, read> points: array<ShadingPoint>;
@group(1) @binding(1) var<storage, read_write> choices: array<LightChoice>;
@group(1) @binding(2) var<uniform> tree: LightTree;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&points) {
        let words = random_block(vec2u(7u, 0u), id.x, 0u, 0u);
        choices[id.x] = light_tree_sample(tree, points[id.x], words.xy);
    }
}
";

fn main() -> Result<(), Box<dyn Error>> {
    println!("{:<14} asks its host for", "module");
    for module in MODULES {
        println!("{:<14} {}", module.name, module.host.join(", "));
    }
    let wgsl = Linker::new()
        .module("package::host", HOST)
        .module("package::main", MAIN)
        .link("package::main")?;
    println!("\n{} lines of WGSL; its entry point:\n", wgsl.lines().count());
    let entry = wgsl.find("@compute").unwrap_or(0);
    println!("{}", wgsl[entry..].lines().take(8).collect::<Vec<_>>().join("\n"));
    Ok(())
}
