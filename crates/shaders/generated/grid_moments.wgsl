// Linked from grid_moments.wesl.

struct Moments {
    first: vec3f,
    weight: f32,
    second: vec3f,
    square_xx: f32,
    intensity: vec3f,
    square_yy: f32,
    normal: vec3f,
    square_zz: f32,
    square_across: vec3f,
    padding: u32
}

fn no_moments() -> Moments {
    let zero = vec3f(0.0);
    return Moments(zero, 0.0, zero, 0.0, zero, 0.0, zero, 0.0, zero, 0u);
}

fn with_light(sum: Moments, offset: vec3f, intensity: vec3f, normal: vec3f) -> Moments {
    let along_axes = vec3f(1.0) - abs(offset);
    if !(min(along_axes.x, min(along_axes.y, along_axes.z)) > 0.0) {
        return sum;
    }
    let share = along_axes.x * along_axes.y * along_axes.z;
    let weight = share * package_lightshed_color_luminance(intensity);
    let weighted = normal * weight;
    let squares = weighted * normal;
    let first = offset * weight;
    return Moments(sum.first + first, sum.weight + weight, sum.second + first * offset, sum.square_xx + squares.x, sum.intensity + intensity * share, sum.square_yy + squares.y, sum.normal + weighted, sum.square_zz + squares.z, sum.square_across + weighted * normal.yzx, 0u);
}

fn with_vertex(sum: Moments, finer: Moments, half_steps: vec3i) -> Moments {
    let along_axes = select(vec3f(0.5), vec3f(1.0), half_steps == vec3i(0));
    let share = along_axes.x * along_axes.y * along_axes.z;
    let s = 0.5 * vec3f(half_steps);
    let first = 0.5 * finer.first + s * finer.weight;
    let second = 0.25 * finer.second + s * finer.first + s * s * finer.weight;
    return Moments(sum.first + share * first, sum.weight + share * finer.weight, sum.second + share * second, sum.square_xx + share * finer.square_xx, sum.intensity + share * finer.intensity, sum.square_yy + share * finer.square_yy, sum.normal + share * finer.normal, sum.square_zz + share * finer.square_zz, sum.square_across + share * finer.square_across, 0u);
}

fn flux_scale(norm_squared: f32) -> f32 {
    let uniform = 0.8660254;
    return uniform + 0.1339746 * (1.5 * norm_squared - 0.5);
}

fn light_of(sum: Moments, vertex: vec3f, origin: vec3f, cell: f32) -> package_lightshed__1grid_light_GridLight {
    let zero = vec3f(0.0);
    if !(sum.weight > 0.0) {
        return package_lightshed__1grid_light_GridLight(origin + vertex * cell, 1.0, zero, 0.0, zero, 0.0, zero, 0.0, zero, 0u);
    }
    let mean = sum.first / sum.weight;
    let variance = max(sum.second / sum.weight - mean * mean, zero);
    let trace = sum.square_xx + sum.square_yy + sum.square_zz;
    var isotropic = 1.0;
    var scale = 0.0;
    if trace > 0.0 {
        isotropic = max(1.0 - trace / sum.weight, 0.0);
        let xx = sum.square_xx / trace;
        let yy = sum.square_yy / trace;
        let zz = sum.square_zz / trace;
        let across = sum.square_across / trace;
        let factor = flux_scale(xx * xx + yy * yy + zz * zz + 2.0 * package_lightshed_vector_dot3(across, across));
        scale = (trace / sum.weight) / sum.weight * factor * factor;
    }
    return package_lightshed__1grid_light_GridLight(origin + (vertex + mean) * cell, select(isotropic, 0.0, isotropic < 2e-6), min(sum.intensity, vec3f(package_lightshed_float__1F32_MAX)), sum.square_xx * scale, sum.normal / sum.weight, sum.square_yy * scale, sqrt(variance) * cell, sum.square_zz * scale, sum.square_across * scale, 0u);
}

struct package_lightshed__1grid_light_GridLight {
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

const package_lightshed_color_LUMINANCE: vec3f = vec3f(0.212671, 0.71516, 0.072169);

fn package_lightshed_color_luminance(rgb: vec3f) -> f32 {
    return package_lightshed_vector_dot3(rgb, package_lightshed_color_LUMINANCE);
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
