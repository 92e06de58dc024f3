// Linked from measure.wesl.

fn area_to_solid_angle(pdf_area: f32, distance_squared: f32, cos_theta: f32) -> f32 {
    let cosine = abs(cos_theta);
    if cosine > 0.0 {
        return min(pdf_area * distance_squared / cosine, package_lightshed_float__1F32_MAX);
    }
    return 0.0;
}

fn solid_angle_to_area(pdf_solid_angle: f32, distance_squared: f32, cos_theta: f32) -> f32 {
    if distance_squared > 0.0 {
        return min(pdf_solid_angle * abs(cos_theta) / distance_squared, package_lightshed_float__1F32_MAX);
    }
    return 0.0;
}

fn power_heuristic(a: f32, b: f32) -> f32 {
    if !(a > 0.0) {
        return 0.0;
    }
    let ratio = b / a;
    return 1.0 / (1.0 + ratio * ratio);
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;
