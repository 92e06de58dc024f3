// Linked from shadow_filter.wesl.

struct Taps {
    size: vec2u,
    step: u32,
    padding: u32
}

@group(0) @binding(0)
var<storage, read> taps: Taps;

@group(0) @binding(1)
var<storage, read> pixels: array<package__1vpl_pixel_Pixel>;

@group(0) @binding(2)
var<storage, read> values: array<f32>;

@group(0) @binding(3)
var<storage, read_write> filtered: array<f32>;

@group(0) @binding(4)
var<storage, read_write> image: array<vec4f>;

const GROUP: u32 = 64u;

const PLANE_TOLERANCE: f32 = 0.01;

fn similarity(a: package__1vpl_pixel_Pixel, b: package__1vpl_pixel_Pixel) -> f32 {
    let cosine = package_lightshed_vector_dot3(a.normal, b.normal);
    if !(cosine > 0.0) {
        return 0.0;
    }
    let between = b.position - a.position;
    let off_plane = max(abs(package_lightshed_vector_dot3(a.normal, between)), abs(package_lightshed_vector_dot3(b.normal, between)));
    let scale = PLANE_TOLERANCE * min(a.distance, b.distance);
    let c = min(cosine, 1.0);
    let c4 = (c * c) * (c * c);
    let c16 = (c4 * c4) * (c4 * c4);
    return c16 * c16 * exp(-off_plane / max(scale, package_lightshed_float__2F32_MIN_POSITIVE));
}

fn kernel_at(d: i32) -> f32 {
    return select(select(0.0625, 0.25, abs(d) == 1), 0.375, d == 0);
}

@compute @workgroup_size(64)
fn filter_shadows(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let pixel = id.x + id.y * groups.x * GROUP;
    if pixel >= taps.size.x * taps.size.y {
        return;
    }
    let here = pixels[pixel];
    let size = vec2i(taps.size);
    let at = vec2i(vec2u(pixel % taps.size.x, pixel / taps.size.x));
    var sum = 0.0;
    var weights = 0.0;
    for (var dy = -2; dy <= 2; dy++) {
        for (var dx = -2; dx <= 2; dx++) {
            let to = at + vec2i(dx, dy) * i32(taps.step);
            if any(to < vec2i(0)) || any(to >= size) {
                continue;
            }
            let place = u32(to.y * size.x + to.x);
            let weight = kernel_at(dx) * kernel_at(dy) * similarity(here, pixels[place]);
            sum += weight * values[place];
            weights += weight;
        }
    }
    filtered[pixel] = select(values[pixel], sum / weights, weights > 0.0);
}

@compute @workgroup_size(64)
fn combine(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let pixel = id.x + id.y * groups.x * GROUP;
    if pixel >= taps.size.x * taps.size.y {
        return;
    }
    image[pixel] = vec4f(pixels[pixel].direct + pixels[pixel].unshadowed * values[pixel], 0.0);
}

struct package__1vpl_pixel_Pixel {
    direct: vec3f,
    distance: f32,
    unshadowed: vec3f,
    padding0: u32,
    position: vec3f,
    padding1: u32,
    normal: vec3f,
    padding2: u32
}

const package_lightshed_float__2F32_MIN_POSITIVE: f32 = 1.1754944e-38;

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
