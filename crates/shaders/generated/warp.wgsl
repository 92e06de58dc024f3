// Linked from warp.wesl.

const INVERSE_PI: f32 = 0.31830987;

const INVERSE_FOUR_PI: f32 = 0.07957747;

const TAU: f32 = 6.2831855;

const F32_EPSILON: f32 = 1.1920929e-7;

fn concentric_disk_with_radius(u: vec2f) -> vec3f {
    let a = 2.0 * u.x - 1.0;
    let b = 2.0 * u.y - 1.0;
    let along_x = abs(a) > abs(b);
    let radius = select(b, a, along_x);
    let other = select(a, b, along_x);
    var ratio = 0.0;
    if radius != 0.0 {
        ratio = other / radius;
    }
    let part = package_lightshed_turn__2sin_cos_quarter(0.5 * ratio);
    let xy = select(part, part.yx, along_x);
    return vec3f(radius * xy.x, radius * xy.y, radius);
}

fn concentric_disk(u: vec2f) -> vec2f {
    return concentric_disk_with_radius(u).xy;
}

fn polar_disk(u: vec2f) -> vec2f {
    let radius = sqrt(u.x);
    let turn = package_lightshed_turn__2sin_cos_turns(u.y);
    return vec2f(radius * turn.y, radius * turn.x);
}

fn cosine_hemisphere(u: vec2f) -> vec3f {
    let point = concentric_disk_with_radius(u);
    let radius = abs(point.z);
    return vec3f(point.xy, sqrt(max((1.0 - radius) * (1.0 + radius), F32_EPSILON)));
}

fn cosine_hemisphere_density(cos_theta: f32) -> f32 {
    return select(0.0, cos_theta, cos_theta > 0.0) * INVERSE_PI;
}

fn uniform_hemisphere(u: vec2f) -> vec3f {
    let sin_theta = sqrt(u.x * (2.0 - u.x));
    let turn = package_lightshed_turn__2sin_cos_turns(u.y);
    return vec3f(sin_theta * turn.y, sin_theta * turn.x, 1.0 - u.x);
}

fn uniform_sphere(u: vec2f) -> vec3f {
    let sin_theta = 2.0 * sqrt(u.x * (1.0 - u.x));
    let turn = package_lightshed_turn__2sin_cos_turns(u.y);
    return vec3f(sin_theta * turn.y, sin_theta * turn.x, 1.0 - 2.0 * u.x);
}

fn cone_from(one_minus_cos_theta_max: f32) -> f32 {
    return package_lightshed_vector__2clamp_or_low(one_minus_cos_theta_max, 1e-30, 2.0);
}

fn cone_of_sphere(radius_squared: f32, distance_squared: f32) -> f32 {
    let sin_squared = radius_squared / distance_squared;
    if sin_squared < 1.0 {
        return cone_from(sin_squared / (1.0 + sqrt(1.0 - sin_squared)));
    }
    return -1.0;
}

fn uniform_cone(one_minus_cos_theta_max: f32, u: vec2f) -> vec3f {
    let one_minus_cos = u.x * one_minus_cos_theta_max;
    let sin_theta = sqrt(one_minus_cos * (2.0 - one_minus_cos));
    let turn = package_lightshed_turn__2sin_cos_turns(u.y);
    return vec3f(sin_theta * turn.y, sin_theta * turn.x, 1.0 - one_minus_cos);
}

fn uniform_cone_density(one_minus_cos_theta_max: f32) -> f32 {
    return 1.0 / (TAU * one_minus_cos_theta_max);
}

fn uniform_triangle(u: vec2f) -> vec3f {
    let half = 0.5 * min(u.x, u.y);
    let b = u - half;
    return vec3f(b, 1.0 - b.x - b.y);
}

fn tent(u: vec2f) -> vec2f {
    let tail = max(min(u, 1.0 - u), vec2f(0.25 * F32_EPSILON));
    let magnitude = 1.0 - sqrt(2.0 * tail);
    return vec2f(package_lightshed_vector__1copy_sign(magnitude.x, u.x - 0.5), package_lightshed_vector__1copy_sign(magnitude.y, u.y - 0.5));
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
