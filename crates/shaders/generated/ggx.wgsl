// Linked from ggx.wesl.

fn stretch(alpha: vec2f, direction: vec3f) -> vec3f {
    return vec3f(alpha * direction.xy, direction.z);
}

fn ggx_normal_density(alpha: vec2f, normal: vec3f) -> f32 {
    if !(normal.z > 0.0) {
        return 0.0;
    }
    let xy = normal.xy / alpha;
    let q = xy.x * xy.x + xy.y * xy.y + normal.z * normal.z;
    return package_lightshed_warp__1INVERSE_PI / (alpha.x * q * (alpha.y * q));
}

fn ggx_masking(alpha: vec2f, direction: vec3f) -> f32 {
    let z = abs(direction.z);
    let length = package_lightshed_vector_length3(stretch(alpha, direction));
    if length > 0.0 {
        return 2.0 * z / (z + length);
    }
    return 0.0;
}

fn ggx_visible_normal(alpha: vec2f, view: vec3f, u: vec2f) -> vec3f {
    let z_axis = vec3f(0.0, 0.0, 1.0);
    let seen = package_lightshed_vector__1normalized_or(stretch(alpha, vec3f(view.xy, max(view.z, 0.0))), z_axis);
    let above = u.y * (1.0 + seen.z);
    let sum_z = max(1.0 - u.y, 5.9604645e-8) * (1.0 + seen.z);
    let one_minus_z = (seen.x * seen.x + seen.y * seen.y) / (1.0 + seen.z);
    let sin_theta = sqrt(above * (sum_z + one_minus_z));
    let turn = package_lightshed_turn__2sin_cos_turns(u.x);
    let half = vec3f(sin_theta * turn.y + seen.x, sin_theta * turn.x + seen.y, sum_z);
    return package_lightshed_vector__1normalized_or(stretch(alpha, half), z_axis);
}

fn ggx_visible_normal_density(alpha: vec2f, view: vec3f, normal: vec3f) -> f32 {
    let above = vec3f(view.xy, max(view.z, 0.0));
    let denominator = above.z + package_lightshed_vector_length3(stretch(alpha, above));
    let facing = package_lightshed_vector_dot3(above, normal);
    if facing > 0.0 && denominator > 0.0 {
        return 2.0 * facing * ggx_normal_density(alpha, normal) / denominator;
    }
    return 0.0;
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

fn package_lightshed_vector__1is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 2139095040u) != 2139095040u;
}

fn package_lightshed_vector__1normalized_or(v: vec3f, otherwise: vec3f) -> vec3f {
    let inverse = 1.0 / package_lightshed_vector_length3(v);
    if package_lightshed_vector__1is_finite(inverse) && inverse > 0.0 {
        return v * inverse;
    }
    return otherwise;
}

fn package_lightshed_vector__2clamp_or_low(x: f32, low: f32, high: f32) -> f32 {
    return select(low, min(x, high), x > low);
}

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn package_lightshed_vector_length3(v: vec3f) -> f32 {
    return sqrt(package_lightshed_vector_dot3(v, v));
}

const package_lightshed_warp__1INVERSE_PI: f32 = 0.31830987;
