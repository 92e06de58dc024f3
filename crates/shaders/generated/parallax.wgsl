// Linked from parallax.wesl.

const LARGEST_OFFSET: f32 = 0.5;

struct FromPivot {
    direction: vec3f,
    factor: f32
}

fn parallax_offset(pivot: vec3f, inverse: f32, position: vec3f) -> vec3f {
    let offset = (position - pivot) * inverse;
    let length = package_lightshed_vector_length3(offset);
    if length <= LARGEST_OFFSET {
        return offset;
    }
    if package_lightshed_vector__1is_finite(length) {
        return offset * (LARGEST_OFFSET / length);
    }
    return vec3f(0.0);
}

fn parallax_at_pivot(offset: vec3f, direction: vec3f) -> FromPivot {
    let along = package_lightshed_vector_dot3(offset, direction);
    let r = sqrt(along * along + package_lightshed_float__2as_it_is(1.0 - package_lightshed_vector_dot3(offset, offset)));
    let s = r - along;
    return FromPivot(package_lightshed_vector_unit3(offset + s * direction), s * s / r);
}

fn parallax_seen(offset: vec3f, from_pivot: vec3f) -> vec3f {
    return package_lightshed_vector_unit3(from_pivot - offset);
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;

fn package_lightshed_float__2as_it_is(x: f32) -> f32 {
    return min(x, package_lightshed_float__1F32_MAX);
}

fn package_lightshed_vector__1is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 2139095040u) != 2139095040u;
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
