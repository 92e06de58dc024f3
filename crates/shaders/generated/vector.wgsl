// Linked from vector.wesl.

fn dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn length3(v: vec3f) -> f32 {
    return sqrt(dot3(v, v));
}

fn unit3(v: vec3f) -> vec3f {
    return v * (1.0 / length3(v));
}

fn cross3(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y);
}

fn clamp_or_low(x: f32, low: f32, high: f32) -> f32 {
    return select(low, min(x, high), x > low);
}

fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 2139095040u) != 2139095040u;
}

fn sign_of(x: f32) -> f32 {
    return select(1.0, -1.0, x < 0.0);
}

fn copy_sign(magnitude: f32, sign: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(magnitude) & 2147483647u) | (bitcast<u32>(sign) & 2147483648u));
}

fn max_element(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn normalized_or(v: vec3f, otherwise: vec3f) -> vec3f {
    let inverse = 1.0 / length3(v);
    if is_finite(inverse) && inverse > 0.0 {
        return v * inverse;
    }
    return otherwise;
}
