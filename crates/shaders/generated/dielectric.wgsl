// Linked from dielectric.wesl.

fn relative_eta(eta: f32, inside: bool) -> f32 {
    return select(eta, 1.0 / eta, inside);
}

fn two_way(a: f32, b: f32) -> vec2f {
    let sum = a + b;
    if sum > 0.0 {
        let first = a / sum;
        return vec2f(first, 1.0 - first);
    }
    return vec2f(0.0);
}

fn boundary_reflection(alpha: vec2f, wo: vec3f, wi: vec3f, eta: f32) -> vec2f {
    if wi.z <= 0.0 {
        return vec2f(0.0);
    }
    let half = package_lightshed_vector__1normalized_or(wo + wi, vec3f(0.0));
    let facing = package_lightshed_vector_dot3(wo, half);
    let reflectance = package_lightshed_fresnel__1fresnel_dielectric(clamp(facing, 0.0, 1.0), eta).x;
    var pdf = 0.0;
    if facing > 0.0 {
        pdf = package_lightshed_ggx__3ggx_visible_normal_density(alpha, wo, half) / (4.0 * facing);
    }
    return vec2f(reflectance * pdf * package_lightshed_ggx__1ggx_masking(alpha, wi), pdf);
}

fn boundary_refraction(alpha: vec2f, wo: vec3f, wi: vec3f, eta: f32) -> vec2f {
    if wi.z >= 0.0 {
        return vec2f(0.0);
    }
    let unnormalised = wo + eta * wi;
    var half = package_lightshed_vector__1normalized_or(unnormalised, vec3f(0.0));
    half = select(half, -half, half.z < 0.0);
    let cos_o = package_lightshed_vector_dot3(wo, half);
    let cos_i = package_lightshed_vector_dot3(wi, half);
    if !(cos_o > 0.0 && cos_i < 0.0) {
        return vec2f(0.0);
    }
    let reflectance = package_lightshed_fresnel__1fresnel_dielectric(min(cos_o, 1.0), eta).x;
    let jacobian = eta * eta * -cos_i / package_lightshed_vector_dot3(unnormalised, unnormalised);
    let pdf = package_lightshed_ggx__3ggx_visible_normal_density(alpha, wo, half) * jacobian;
    let transmitted = (1.0 - reflectance) / (eta * eta);
    return vec2f(transmitted * pdf * package_lightshed_ggx__1ggx_masking(alpha, wi), pdf);
}

fn refracted_direction(wo: vec3f, normal: vec3f, eta: f32) -> vec3f {
    let cos_o = clamp(package_lightshed_vector_dot3(wo, normal), 0.0, 1.0);
    let cos_transmitted = package_lightshed_fresnel__1fresnel_dielectric(cos_o, eta).y;
    if cos_transmitted <= 0.0 {
        return vec3f(0.0, 0.0, 1.0);
    }
    return package_lightshed_vector_unit3((cos_o / eta - cos_transmitted) * normal - wo / eta);
}

fn package_lightshed_fresnel__1fresnel_dielectric(cos_incident: f32, eta: f32) -> vec2f {
    if eta == 1.0 {
        return vec2f(0.0, cos_incident);
    }
    var radicand: f32;
    if eta > 0.5 {
        radicand = (eta - 1.0) * (eta + 1.0) + cos_incident * cos_incident;
    }
    else {
        radicand = eta * eta - (1.0 - cos_incident) * (1.0 + cos_incident);
    }
    if radicand <= 0.0 {
        return vec2f(1.0, 0.0);
    }
    let cos_transmitted = min(sqrt(radicand) / eta, 1.0);
    let senkrecht = (cos_incident - eta * cos_transmitted) / (cos_incident + eta * cos_transmitted);
    let parallel = (eta * cos_incident - cos_transmitted) / (eta * cos_incident + cos_transmitted);
    return vec2f(0.5 * (senkrecht * senkrecht + parallel * parallel), cos_transmitted);
}

fn package_lightshed_ggx__1ggx_masking(alpha: vec2f, direction: vec3f) -> f32 {
    let z = abs(direction.z);
    let length = package_lightshed_vector_length3(package_lightshed_ggx_stretch(alpha, direction));
    if length > 0.0 {
        return 2.0 * z / (z + length);
    }
    return 0.0;
}

fn package_lightshed_ggx__2ggx_normal_density(alpha: vec2f, normal: vec3f) -> f32 {
    if !(normal.z > 0.0) {
        return 0.0;
    }
    let xy = normal.xy / alpha;
    let q = xy.x * xy.x + xy.y * xy.y + normal.z * normal.z;
    return package_lightshed_warp__1INVERSE_PI / (alpha.x * q * (alpha.y * q));
}

fn package_lightshed_ggx__3ggx_visible_normal_density(alpha: vec2f, view: vec3f, normal: vec3f) -> f32 {
    let above = vec3f(view.xy, max(view.z, 0.0));
    let denominator = above.z + package_lightshed_vector_length3(package_lightshed_ggx_stretch(alpha, above));
    let facing = package_lightshed_vector_dot3(above, normal);
    if facing > 0.0 && denominator > 0.0 {
        return 2.0 * facing * package_lightshed_ggx__2ggx_normal_density(alpha, normal) / denominator;
    }
    return 0.0;
}

fn package_lightshed_ggx_stretch(alpha: vec2f, direction: vec3f) -> vec3f {
    return vec3f(alpha * direction.xy, direction.z);
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

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn package_lightshed_vector_length3(v: vec3f) -> f32 {
    return sqrt(package_lightshed_vector_dot3(v, v));
}

fn package_lightshed_vector_unit3(v: vec3f) -> vec3f {
    return v * (1.0 / package_lightshed_vector_length3(v));
}

const package_lightshed_warp__1INVERSE_PI: f32 = 0.31830987;
