// Linked from uniform.wesl.

const ONE_MINUS_EPSILON: f32 = 0.99999994;

fn f32_from_u32(bits: u32) -> f32 {
    return f32(bits >> 8u) * 5.9604645e-8;
}

fn unit_square(bits: vec2u) -> vec2f {
    return vec2f(bits >> vec2u(8u)) * 5.9604645e-8;
}

fn remap(u: f32, low: f32, high: f32) -> f32 {
    let fraction = (u - low) / (high - low);
    return select(0.0, min(fraction, ONE_MINUS_EPSILON), fraction > 0.0);
}
