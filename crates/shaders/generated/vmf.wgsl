// Linked from vmf.wesl.

const MAX_CONCENTRATION: f32 = 1000000.0;

const UNIFORM_BELOW: f32 = 1e-7;

const INVERSE_TAU: f32 = 0.15915494;

const LOG2_E: f32 = 1.442695;

struct VmfLobe {
    mean: vec3f,
    concentration: f32,
    peak: f32,
    span: f32
}

fn exp_negative(y: f32) -> f32 {
    return package_lightshed_exponential__1exp2_negative(y * LOG2_E);
}

fn one_minus_exp_negative(y: f32) -> f32 {
    if y > 1.0 {
        return 1.0 - exp_negative(y);
    }
    var series = 1.0;
    for (var n = 11.0; n > 1.0; n -= 1.0) {
        series = 1.0 - y / n * series;
    }
    return y * series;
}

fn minus_log_of_rest(x: f32) -> f32 {
    let rounded = 1.0 - package_lightshed_float__2as_it_is(1.0 - x);
    if rounded > 0.0 {
        return package_lightshed_exponential_exponential(rounded) * (x / rounded);
    }
    return x;
}

fn vmf_peak(concentration: f32) -> f32 {
    if concentration > UNIFORM_BELOW {
        return INVERSE_TAU * concentration / one_minus_exp_negative(2.0 * concentration);
    }
    return package_lightshed_warp__2INVERSE_FOUR_PI;
}

fn vmf_lobe(mean: vec3f, concentration: f32) -> VmfLobe {
    let span = one_minus_exp_negative(2.0 * concentration);
    return VmfLobe(mean, concentration, vmf_peak(concentration), span);
}

fn vmf_concentration(r: f32, gap: f32) -> f32 {
    let bounded = max(gap, 1.0 / MAX_CONCENTRATION);
    return min(r * (3.0 - r * r) / (bounded * (2.0 - bounded)), MAX_CONCENTRATION);
}

fn vmf_sample(lobe: VmfLobe, u: vec2f) -> vec3f {
    var one_minus_cos = 2.0 * u.x;
    if lobe.concentration > UNIFORM_BELOW {
        one_minus_cos = min(minus_log_of_rest(u.x * lobe.span) / lobe.concentration, 2.0);
    }
    let sin_theta = sqrt(one_minus_cos * (2.0 - one_minus_cos));
    let turn = package_lightshed_turn__2sin_cos_turns(u.y);
    let local = vec3f(sin_theta * turn.y, sin_theta * turn.x, 1.0 - one_minus_cos);
    return package_lightshed_frame__1to_world(package_lightshed_frame__2frame_from_normal(lobe.mean), local);
}

fn vmf_pdf(lobe: VmfLobe, direction: vec3f) -> f32 {
    let chord = direction - lobe.mean;
    return lobe.peak * exp_negative(0.5 * lobe.concentration * package_lightshed_vector_dot3(chord, chord));
}

const package_lightshed_exponential__1LEAST_FRACTION: u32 = 1060439283u;

const package_lightshed_exponential__1LN_2: f32 = 0.6931472;

const package_lightshed_exponential__1VANISHES_FROM: f32 = 126.0;

fn package_lightshed_exponential__1exp2_negative(y: f32) -> f32 {
    if !(y < package_lightshed_exponential__1VANISHES_FROM) {
        return 0.0;
    }
    let whole = u32(y);
    let t = (0.5 - (y - f32(whole))) * package_lightshed_exponential__1LN_2;
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

fn package_lightshed_exponential_exponential(u: f32) -> f32 {
    let bits = bitcast<u32>(1.0 - u);
    let exponent = bitcast<i32>(bits - package_lightshed_exponential__1LEAST_FRACTION) >> 23u;
    let f = bitcast<f32>(bits - (bitcast<u32>(exponent) << 23u)) - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let p = z * (0.33333334 + z * (0.1999992 + z * (0.14290866 + z * 0.1134)));
    let log = 2.0 * (s + s * p) + f32(exponent) * package_lightshed_exponential__1LN_2;
    return -log;
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;

fn package_lightshed_float__2as_it_is(x: f32) -> f32 {
    return min(x, package_lightshed_float__1F32_MAX);
}

struct package_lightshed_frame_Frame {
    tangent: vec3f,
    bitangent: vec3f,
    normal: vec3f
}

fn package_lightshed_frame__1to_world(frame: package_lightshed_frame_Frame, v: vec3f) -> vec3f {
    return frame.tangent * v.x + frame.bitangent * v.y + frame.normal * v.z;
}

fn package_lightshed_frame__2frame_from_normal(normal: vec3f) -> package_lightshed_frame_Frame {
    let sign = package_lightshed_vector__1copy_sign(1.0, normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    return package_lightshed_frame_Frame(vec3f(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x), vec3f(b, sign + normal.y * normal.y * a, -normal.y), normal);
}

fn package_lightshed_turn__2sin_cos_quarter(r: f32) -> vec2f {
    let t = r * r;
    let sine = r * (1.5707964 + t * (-0.6459635 + t * (0.07968022 + t * -0.004602149)));
    let cosine = 1.0 - t * (1.2337005 + t * (-0.2536694 + t * (0.020861529 + t * -0.0009067399)));
    return vec2f(sine, cosine);
}

fn package_lightshed_turn__2sin_cos_turns(t: f32) -> vec2f {
    let quarters = 4.0 * package_lightshed_vector__2clamp_or_low(t, 0.0, 1.0);
    let below = floor(quarters);
    let rest = quarters - below;
    let quadrant = u32(below);
    let nearest = quadrant + select(0u, 1u, rest > 0.5 || (rest == 0.5 && quadrant % 2u == 1u));
    let part = package_lightshed_turn__2sin_cos_quarter(quarters - f32(nearest));
    let turned = select(part, part.yx, nearest % 2u == 1u);
    let negative = vec2u((nearest & 2u) << 30u, ((nearest + 1u) & 2u) << 30u);
    return bitcast<vec2f>(bitcast<vec2u>(turned) ^ negative);
}

fn package_lightshed_vector__1copy_sign(magnitude: f32, sign: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(magnitude) & 2147483647u) | (bitcast<u32>(sign) & 2147483648u));
}

fn package_lightshed_vector__2clamp_or_low(x: f32, low: f32, high: f32) -> f32 {
    return select(low, min(x, high), x > low);
}

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

const package_lightshed_warp__2INVERSE_FOUR_PI: f32 = 0.07957747;
