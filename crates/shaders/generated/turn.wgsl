// Linked from turn.wesl.

fn sin_cos_quarter(r: f32) -> vec2f {
    let t = r * r;
    let sine = r * (1.5707964 + t * (-0.6459635 + t * (0.07968022 + t * -0.004602149)));
    let cosine = 1.0 - t * (1.2337005 + t * (-0.2536694 + t * (0.020861529 + t * -0.0009067399)));
    return vec2f(sine, cosine);
}

fn sin_cos_turns(t: f32) -> vec2f {
    let quarters = 4.0 * package_lightshed_vector__2clamp_or_low(t, 0.0, 1.0);
    let below = floor(quarters);
    let rest = quarters - below;
    let quadrant = u32(below);
    let nearest = quadrant + select(0u, 1u, rest > 0.5 || (rest == 0.5 && quadrant % 2u == 1u));
    let part = sin_cos_quarter(quarters - f32(nearest));
    let turned = select(part, part.yx, nearest % 2u == 1u);
    let negative = vec2u((nearest & 2u) << 30u, ((nearest + 1u) & 2u) << 30u);
    return bitcast<vec2f>(bitcast<vec2u>(turned) ^ negative);
}

fn turn_of(y: f32, x: f32) -> f32 {
    let high = max(abs(x), abs(y));
    let low = min(abs(x), abs(y));
    var a = 0.0;
    if high > 0.0 {
        a = low / high;
    }
    let s = a * a;
    let odd = -0.02228693 + s * (0.015706787 + s * (-0.009363046 + s * (0.003784787 + s * -0.00072571344)));
    var turn = a * (0.15915492 + s * (-0.05304923 + s * (0.031778406 + s * odd)));
    turn = select(turn, 0.25 - turn, abs(y) > abs(x));
    turn = select(turn, 0.5 - turn, (bitcast<u32>(x) & 2147483648u) != 0u);
    return package_lightshed_vector__1copy_sign(turn, y);
}

fn package_lightshed_vector__1copy_sign(magnitude: f32, sign: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(magnitude) & 2147483647u) | (bitcast<u32>(sign) & 2147483648u));
}

fn package_lightshed_vector__2clamp_or_low(x: f32, low: f32, high: f32) -> f32 {
    return select(low, min(x, high), x > low);
}
