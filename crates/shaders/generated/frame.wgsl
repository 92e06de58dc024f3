// Linked from frame.wesl.

struct Frame {
    tangent: vec3f,
    bitangent: vec3f,
    normal: vec3f
}

fn frame_from_normal(normal: vec3f) -> Frame {
    let sign = package_lightshed_vector__1copy_sign(1.0, normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    return Frame(vec3f(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x), vec3f(b, sign + normal.y * normal.y * a, -normal.y), normal);
}

fn to_local(frame: Frame, v: vec3f) -> vec3f {
    return vec3f(package_lightshed_vector_dot3(frame.tangent, v), package_lightshed_vector_dot3(frame.bitangent, v), package_lightshed_vector_dot3(frame.normal, v));
}

fn to_world(frame: Frame, v: vec3f) -> vec3f {
    return frame.tangent * v.x + frame.bitangent * v.y + frame.normal * v.z;
}

fn package_lightshed_vector__1copy_sign(magnitude: f32, sign: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(magnitude) & 2147483647u) | (bitcast<u32>(sign) & 2147483648u));
}

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
