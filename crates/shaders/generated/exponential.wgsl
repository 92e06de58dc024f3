// Linked from exponential.wesl.

const LN_2: f32 = 0.6931472;

const LEAST_FRACTION: u32 = 1060439283u;

fn exponential(u: f32) -> f32 {
    let bits = bitcast<u32>(1.0 - u);
    let exponent = bitcast<i32>(bits - LEAST_FRACTION) >> 23u;
    let f = bitcast<f32>(bits - (bitcast<u32>(exponent) << 23u)) - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let p = z * (0.33333334 + z * (0.1999992 + z * (0.14290866 + z * 0.1134)));
    let log = 2.0 * (s + s * p) + f32(exponent) * LN_2;
    return -log;
}
