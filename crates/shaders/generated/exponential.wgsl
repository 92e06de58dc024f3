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

const VANISHES_FROM: f32 = 126.0;

fn exp2_negative(y: f32) -> f32 {
    if !(y < VANISHES_FROM) {
        return 0.0;
    }
    let whole = u32(y);
    let t = (0.5 - (y - f32(whole))) * LN_2;
    var series = 0.0001984127;
    series = series * t + 0.0013888889;
    series = series * t + 0.008333334;
    series = series * t + 0.041666668;
    series = series * t + 0.16666667;
    series = series * t + 0.5;
    series = series * t + 1.0;
    series = series * t + 1.0;
    return series * 0.70710677 * bitcast<f32>((127u - whole) << 23u);
}
