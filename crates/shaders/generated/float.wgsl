// Linked from float.wesl.

const F32_MAX: f32 = 3.4028235e38;

const F32_MIN_POSITIVE: f32 = 1.1754944e-38;

fn as_it_is(x: f32) -> f32 {
    return min(x, F32_MAX);
}
