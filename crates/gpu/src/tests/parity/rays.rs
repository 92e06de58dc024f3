//! Rays through the compressed tree against a test of all triangles.

use crate::GpuScene;
use crate::tests::parity::harness::{Shader, Tier, check};
use crate::tests::support::exact_gpu;
use glam::Vec3;
use lightshed_sampling::{CounterRng, UniformSphere};
use lightshed_scene::{Ray, Scene, SkySampling, builtin, intersect_triangle};

/// The nearest hit by testing all triangles; of those at the same distance, that of the lowest
/// number.
fn nearest(corners: &[[Vec3; 3]], ray: &Ray, step: usize) -> Option<(f32, u32, [f32; 2])> {
    let mut best: Option<(f32, u32, [f32; 2])> = None;
    for (primitive, corners) in (0..).zip(corners).step_by(step) {
        let t_max = best.map_or(ray.t_max, |hit| hit.0);
        if let Some(hit) = intersect_triangle(ray, corners, primitive, t_max) {
            best = Some((hit.t, primitive, hit.barycentric));
        }
    }
    best
}

/// Rays at random, along axes, in planes of axes, at corners and at middles of edges, from near and
/// far; directions of any length.
fn rays(corners: &[[Vec3; 3]], count: usize) -> Vec<[u32; 7]> {
    let mut rng = CounterRng::new(77, 0, 0);
    let pick = |rng: &mut CounterRng| {
        let corners = corners[rng.next_u32() as usize % corners.len()];
        match rng.next_u32() % 3 {
            0 => corners[0],
            1 => (corners[0] + corners[1]) * 0.5,
            _ => (corners[0] + corners[1] + corners[2]) / 3.0,
        }
    };
    (0..count)
        .map(|i| {
            let mut direction = UniformSphere::sample(rng.next_2d());
            match i % 6 {
                0 => direction = Vec3::AXES[i / 6 % 3] * if i % 4 < 2 { 1.0 } else { -1.0 },
                1 => direction[i / 6 % 3] = if i % 4 < 2 { 0.0 } else { -0.0 },
                2 => direction[i / 6 % 3] *= 1e-20,
                _ => {}
            }
            let at = pick(&mut rng);
            let back = [0.3, 3.0, 30.0][i / 2 % 3] * rng.next_f32();
            let origin = if i % 5 == 0 {
                pick(&mut rng)
            } else {
                at - direction * back
            };
            let scale = [1.0, 1e-3, 250.0][i % 3];
            let t_max = if i % 7 == 0 { back / scale } else { f32::MAX };
            let d = direction * scale;
            [origin.x, origin.y, origin.z, d.x, d.y, d.z, t_max].map(f32::to_bits)
        })
        .collect()
}

#[test]
fn hits_are_those_of_a_test_of_all_triangles() {
    for (name, description) in [
        ("cornell", builtin::cornell()),
        ("many-lights", builtin::many_lights()),
    ] {
        let scene = Scene::new(&description).expect("built-in scenes are sound");
        let flat = lightshed_scene::FlatScene::new(&scene, SkySampling::Luminance).expect("it is flat");
        let corners: Vec<[Vec3; 3]> = flat.corners().collect();
        let on_device = match exact_gpu() {
            Some(gpu) => GpuScene::new(gpu, &scene).expect("it is flat"),
            None => return,
        };
        let [nodes, slots, triangles] = on_device.tree_buffers();
        let shader = Shader {
            host: "import package::lightshed::cwbvh::{CwbvhNode, TriangleCorners};
                   import package::lightshed::surface::Triangle;
                   @group(0) @binding(2) var<storage, read> nodes: array<CwbvhNode>;
                   @group(0) @binding(3) var<storage, read> slots: array<u32>;
                   @group(0) @binding(4) var<storage, read> triangles: array<Triangle>;
                   fn lets_pass(primitive: u32) -> bool { return (primitive & 1u) == 1u; }
                   fn load_cwbvh_node(index: u32) -> CwbvhNode { return nodes[index]; }
                   fn load_cwbvh_primitive(slot: u32) -> u32 { return slots[slot]; }
                   fn load_triangle_corners(index: u32) -> TriangleCorners {
                       let t = triangles[index];
                       return TriangleCorners(t.a, vec3f(t.b_x, t.b_yz), vec3f(t.c_xy, t.c_z));
                   }",
            buffers: &[nodes, slots, triangles],
            ..Shader::new(
                "import package::lightshed::cwbvh::{intersect, intersect_opaque, occluded};
                 import package::lightshed::ray::{NOTHING, Ray};",
                "let ray = Ray(vec3f(number(0u), number(1u), number(2u)), number(6u),
                               vec3f(number(3u), number(4u), number(5u)), 0u);
                 let hit = intersect(ray);
                 put(0u, select(0u, 1u, hit.primitive != NOTHING));
                 put_f(1u, hit.t); put_2(2u, hit.barycentric); put(4u, hit.primitive);
                 put(5u, select(0u, 1u, occluded(ray)));
                 // As if light passed every other triangle.
                 put(6u, intersect_opaque(ray).primitive);",
            )
        };
        // Many triangles are many tests for the host.
        let count = if corners.len() < 100 { 1 << 16 } else { 1 << 12 };
        check::<7, 7>(name, Tier::Exact, &shader, &rays(&corners, count), |words| {
            let [ox, oy, oz, dx, dy, dz, t_max] = words.map(f32::from_bits);
            let ray = Ray::segment(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz), t_max);
            let even = nearest(&corners, &ray, 2).map_or(u32::MAX, |(_, primitive, _)| primitive);
            match nearest(&corners, &ray, 1) {
                Some((t, primitive, [v, w])) => {
                    [1, t.to_bits(), v.to_bits(), w.to_bits(), primitive, 1, even]
                }
                None => [0, t_max.to_bits(), 0, 0, u32::MAX, 0, u32::MAX],
            }
        });
    }
}
