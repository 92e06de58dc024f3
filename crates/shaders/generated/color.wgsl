// Linked from color.wesl.

const LUMINANCE: vec3f = vec3f(0.212671, 0.71516, 0.072169);

fn luminance(rgb: vec3f) -> f32 {
    return package_lightshed_vector_dot3(rgb, LUMINANCE);
}

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
