// Linked from fresnel.wesl.

const LEAST_NORMAL: f32 = 1.1754944e-38;

fn fresnel_conductor(cos_incident: f32, eta: vec3f, k: vec3f) -> vec3f {
    let c2 = cos_incident * cos_incident;
    let s2 = max(1.0 - c2, 0.0);
    let eta2_k2 = eta * eta * k * k;
    let t = eta * eta - (k * k + s2);
    let modulus = sqrt(t * t + 4.0 * eta2_k2);
    let larger = 0.5 * (modulus + abs(t));
    let smaller = min(eta2_k2 / max(larger, vec3f(LEAST_NORMAL)), larger);
    let positive = t >= vec3f(0.0);
    let a = sqrt(select(smaller, larger, positive));
    let b2 = select(larger, smaller, positive);
    let less = a - cos_incident;
    let more = a + cos_incident;
    let senkrecht = (less * less + b2) / max(more * more + b2, vec3f(LEAST_NORMAL));
    let below = a * cos_incident - s2;
    let above = a * cos_incident + s2;
    let ratio = (below * below + b2 * c2) / max(above * above + b2 * c2, vec3f(LEAST_NORMAL));
    return 0.5 * senkrecht * (1.0 + ratio);
}

fn fresnel_dielectric(cos_incident: f32, eta: f32) -> vec2f {
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
