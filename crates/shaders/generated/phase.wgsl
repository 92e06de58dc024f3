// Linked from phase.wesl.

struct ScatteringAngle {
    one_minus_cos: f32,
    one_plus_cos: f32
}

fn angle_from_cos(cos_theta: f32) -> ScatteringAngle {
    return ScatteringAngle(clamp(1.0 - cos_theta, 0.0, 2.0), clamp(1.0 + cos_theta, 0.0, 2.0));
}

fn angle_between(direction: vec3f, scattered: vec3f) -> ScatteringAngle {
    let difference = scattered - direction;
    let sum = scattered + direction;
    return ScatteringAngle(min(0.5 * package_lightshed_vector_dot3(difference, difference), 2.0), min(0.5 * package_lightshed_vector_dot3(sum, sum), 2.0));
}

fn angle_from_one_minus_cos(one_minus_cos: f32) -> ScatteringAngle {
    return ScatteringAngle(one_minus_cos, 2.0 - one_minus_cos);
}

fn lobe_ahead(angle: ScatteringAngle, g: f32) -> ScatteringAngle {
    if g < 0.0 {
        return ScatteringAngle(angle.one_plus_cos, angle.one_minus_cos);
    }
    return angle;
}

fn angle_cos_theta(angle: ScatteringAngle) -> f32 {
    if angle.one_minus_cos < angle.one_plus_cos {
        return 1.0 - angle.one_minus_cos;
    }
    return angle.one_plus_cos - 1.0;
}

fn angle_sin_theta(angle: ScatteringAngle) -> f32 {
    return sqrt(angle.one_minus_cos * angle.one_plus_cos);
}

fn scattered_direction(direction: vec3f, angle: ScatteringAngle, u: f32) -> vec3f {
    let sin_theta = angle_sin_theta(angle);
    let turn = package_lightshed_turn__2sin_cos_turns(u);
    return package_lightshed_frame__1to_world(package_lightshed_frame__2frame_from_normal(direction), vec3f(sin_theta * turn.y, sin_theta * turn.x, angle_cos_theta(angle)));
}

fn isotropic_phase() -> f32 {
    return package_lightshed_warp__2INVERSE_FOUR_PI;
}

fn isotropic_angle(u: f32) -> ScatteringAngle {
    return angle_from_one_minus_cos(2.0 * u);
}

fn henyey_greenstein_phase(g: f32, angle: ScatteringAngle) -> f32 {
    let magnitude = abs(g);
    let rest = 1.0 - magnitude;
    let squared = rest * rest + 2.0 * magnitude * lobe_ahead(angle, g).one_minus_cos;
    return package_lightshed_warp__2INVERSE_FOUR_PI * rest * (1.0 + magnitude) / (squared * sqrt(squared));
}

fn henyey_greenstein_angle(g: f32, u: f32) -> ScatteringAngle {
    let magnitude = abs(g);
    let rest = 1.0 - magnitude;
    let d = rest + 2.0 * magnitude * (1.0 - u);
    let q = rest * (1.0 + magnitude) / d;
    let one_minus_cos = min(rest * u * (q + rest) / d, 2.0);
    return lobe_ahead(angle_from_one_minus_cos(one_minus_cos), g);
}

fn draine_phase(g: f32, alpha: f32, angle: ScatteringAngle) -> f32 {
    let ahead = lobe_ahead(angle, g);
    let c = angle_cos_theta(ahead);
    let excess = (1.0 + alpha * c * c) / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0);
    return henyey_greenstein_phase(abs(g), ahead) * excess;
}

fn draine_cumulative(g: f32, alpha: f32, s: f32) -> f32 {
    let x0 = 1.0 - g;
    let x = sqrt(x0 * x0 + 2.0 * g * s);
    let part = s / (x + x0);
    let zeroth = 2.0 * part / (x * x0);
    let first = 2.0 * part * part / x;
    let second = 2.0 * part * part * part * (x + 3.0 * x0) / (3.0 * x);
    let sum = (1.0 + alpha) * zeroth - 2.0 * alpha * first + alpha * second;
    return 0.5 * x0 * (1.0 + g) * sum / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0);
}

fn draine_angle(g: f32, alpha: f32, u: f32) -> ScatteringAngle {
    let magnitude = abs(g);
    var low = 0.0;
    var high = 2.0;
    var s = henyey_greenstein_angle(magnitude, u).one_minus_cos;
    for (var i = 0u; i < 32u; i++) {
        let error = draine_cumulative(magnitude, alpha, s) - u;
        if error > 0.0 {
            high = s;
        }
        else {
            low = s;
        }
        let density = 6.2831855 * draine_phase(magnitude, alpha, angle_from_one_minus_cos(s));
        let newton = s - error / density;
        if abs(newton - s) <= 2e-7 * s {
            break;
        }
        s = select(0.5 * (low + high), newton, newton > low && newton < high);
    }
    return lobe_ahead(angle_from_one_minus_cos(clamp(s, 0.0, 2.0)), g);
}

fn blend_phase(first: f32, second: f32, share: f32) -> f32 {
    return (1.0 - share) * first + share * second;
}

struct BlendChoice {
    second: bool,
    u: f32
}

fn blend_choose(share: f32, u: f32) -> BlendChoice {
    if u < share {
        return BlendChoice(true, package_lightshed_uniform_remap(u, 0.0, share));
    }
    return BlendChoice(false, package_lightshed_uniform_remap(u, share, 1.0));
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

const package_lightshed_uniform__2ONE_MINUS_EPSILON: f32 = 0.99999994;

fn package_lightshed_uniform_remap(u: f32, low: f32, high: f32) -> f32 {
    let fraction = (u - low) / (high - low);
    return select(0.0, min(fraction, package_lightshed_uniform__2ONE_MINUS_EPSILON), fraction > 0.0);
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
