// Linked from grid_light.wesl.

struct GridFrame {
    origin: vec3f,
    levels: u32,
    size: vec2u,
    per_size: vec2u,
    radius_0: f32,
    lights: u32,
    padding: vec2u,
    first_word: array<u32, 12>
}

struct GridLight {
    position: vec3f,
    isotropic: f32,
    intensity: vec3f,
    moment_xx: f32,
    mean_normal: vec3f,
    moment_yy: f32,
    spread: vec3f,
    moment_zz: f32,
    moment_across: vec3f,
    padding: u32
}

struct GridPoint {
    position: vec3f,
    fraction_x: f32,
    intensity: vec3f,
    fraction_y: f32,
    normal: vec3f,
    fraction_z: f32
}

const CORRECTION_BOUND: f32 = 0.2;

fn level_radius(frame: GridFrame, level: u32) -> f32 {
    return frame.radius_0 * f32(1u << level);
}

fn blending(frame: GridFrame, level: u32, first_level: u32, distance_squared: f32) -> f32 {
    let radius = level_radius(frame, level);
    let t = distance_squared * (1.0 / (radius * radius));
    let up = select(1.0, (package_lightshed_float__2as_it_is(4.0 * t) - 1.0) / 3.0, level > first_level);
    let down = select(1.0, (4.0 - t) / 3.0, level < frame.levels);
    return clamp(min(up, down), 0.0, 1.0);
}

fn blending_distance_squared(light: GridLight, to_light: vec3f) -> f32 {
    let variance = light.spread * light.spread;
    let squares = to_light * to_light;
    let distance_squared = squares.x + squares.y + squares.z;
    let across = package_lightshed_vector_dot3(variance, squares / distance_squared);
    let correction = variance.x + variance.y + variance.z - package_lightshed_float__2as_it_is(4.0 * across);
    let bound = CORRECTION_BOUND * distance_squared;
    return distance_squared + min(max(correction, -bound), bound);
}

fn grid_emission(light: GridLight, d: vec3f) -> f32 {
    let across = light.moment_across;
    let square = light.moment_xx * d.x * d.x + light.moment_yy * d.y * d.y + light.moment_zz * d.z * d.z + 2.0 * (across.x * d.x * d.y + across.y * d.y * d.z + across.z * d.z * d.x);
    let mean = package_lightshed_vector_dot3(light.mean_normal, d);
    return light.isotropic + 0.5 * (mean + max(abs(mean), sqrt(max(square, 0.0))));
}

fn point_emission(normal: vec3f, direction: vec3f) -> f32 {
    if all(normal == vec3f(0.0)) {
        return 1.0;
    }
    return max(package_lightshed_vector_dot3(normal, direction), 0.0);
}

struct CellRow {
    y: u32,
    z: u32,
    start: u32,
    first: u32,
    end: u32
}

fn cells_beside(vertex: vec3u, row: u32, levels: u32) -> CellRow {
    let cells = 1u << (levels - 1u);
    let y = vertex.y - 1u + (row & 1u);
    let z = vertex.z - 1u + (row >> 1u);
    if y >= cells || z >= cells {
        return CellRow(y, z, 0u, 0u, 0u);
    }
    let start = (z * cells + y) * cells;
    return CellRow(y, z, start, start + max(vertex.x, 1u) - 1u, start + min(vertex.x + 1u, cells));
}

fn offset_from_vertex(light: GridPoint, key: u32, row: CellRow, vertex: vec3u) -> vec3f {
    let fraction = vec3f(light.fraction_x, light.fraction_y, light.fraction_z);
    return fraction - vec3f(vertex - vec3u(key - row.start, row.y, row.z));
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;

fn package_lightshed_float__2as_it_is(x: f32) -> f32 {
    return min(x, package_lightshed_float__1F32_MAX);
}

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
