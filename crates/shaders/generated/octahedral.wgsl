// Linked from octahedral.wesl.

fn fold(xy: vec2f) -> vec2f {
    return vec2f((1.0 - abs(xy.y)) * package_lightshed_vector__1sign_of(xy.x), (1.0 - abs(xy.x)) * package_lightshed_vector__1sign_of(xy.y));
}

fn project(direction: vec3f) -> vec2f {
    let norm = abs(direction.x) + abs(direction.y) + abs(direction.z);
    if !(norm > 0.0) {
        return vec2f(0.0);
    }
    let xy = clamp(direction.xy / norm, vec2f(-1.0), vec2f(1.0));
    if direction.z < 0.0 {
        return fold(xy);
    }
    return xy;
}

fn lift(xy: vec2f) -> vec3f {
    let z = 1.0 - abs(xy.x) - abs(xy.y);
    if z < 0.0 {
        return vec3f(fold(xy), z);
    }
    return vec3f(xy, z);
}

fn octahedral_encode(direction: vec3f) -> vec2f {
    return project(direction) * 0.5 + 0.5;
}

fn octahedral_decode(uv: vec2f) -> vec3f {
    return package_lightshed_vector_unit3(lift(clamp(uv, vec2f(0.0), vec2f(1.0)) * 2.0 - 1.0));
}

fn octahedral_pack32(direction: vec3f) -> u32 {
    let steps = vec2u(vec2i(floor(0.5 + 32767.0 * project(direction))));
    return (steps.x & 65535u) | (steps.y << 16u);
}

fn octahedral_unpack32(bits: u32) -> vec3f {
    let steps = vec2f(vec2i(vec2u(bits << 16u, bits)) >> vec2u(16u));
    return package_lightshed_vector_unit3(lift(max(steps / 32767.0, vec2f(-1.0))));
}

fn octahedral_pack16(direction: vec3f) -> u32 {
    let steps = vec2u(vec2i(floor(0.5 + 127.0 * project(direction))));
    return (steps.x & 255u) | ((steps.y & 255u) << 8u);
}

fn octahedral_unpack16(bits: u32) -> vec3f {
    let steps = vec2f(vec2i(vec2u(bits << 24u, bits << 16u)) >> vec2u(24u));
    return package_lightshed_vector_unit3(lift(max(steps / 127.0, vec2f(-1.0))));
}

fn octahedral_to_solid_angle(pdf_square: f32, direction: vec3f) -> f32 {
    let norm = abs(direction.x) + abs(direction.y) + abs(direction.z);
    let q = package_lightshed_float__2as_it_is(package_lightshed_vector_length3(direction / norm));
    return pdf_square / (4.0 / (q * q * q));
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;

fn package_lightshed_float__2as_it_is(x: f32) -> f32 {
    return min(x, package_lightshed_float__1F32_MAX);
}

fn package_lightshed_vector__1sign_of(x: f32) -> f32 {
    return select(1.0, -1.0, x < 0.0);
}

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn package_lightshed_vector_length3(v: vec3f) -> f32 {
    return sqrt(package_lightshed_vector_dot3(v, v));
}

fn package_lightshed_vector_unit3(v: vec3f) -> vec3f {
    return v * (1.0 / package_lightshed_vector_length3(v));
}
