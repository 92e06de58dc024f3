// Linked from wide.wesl.

fn wide_product(a: u32, b: u32) -> vec2u {
    let a_low = a & 65535u;
    let a_high = a >> 16u;
    let b_low = b & 65535u;
    let b_high = b >> 16u;
    let low = a_low * b_low;
    let middle = a_high * b_low + (low >> 16u);
    let other = a_low * b_high + (middle & 65535u);
    return vec2u(a * b, a_high * b_high + (middle >> 16u) + (other >> 16u));
}

fn wide_add(a: vec2u, b: vec2u) -> vec2u {
    let low = a.x + b.x;
    return vec2u(low, a.y + b.y + select(0u, 1u, low < a.x));
}

fn wide_subtract(a: vec2u, b: vec2u) -> vec2u {
    return vec2u(a.x - b.x, a.y - b.y - select(0u, 1u, a.x < b.x));
}

fn wide_multiply(a: vec2u, b: vec2u) -> vec2u {
    let low = wide_product(a.x, b.x);
    return vec2u(low.x, low.y + a.x * b.y + a.y * b.x);
}

fn wide_negate(a: vec2u) -> vec2u {
    return wide_subtract(vec2u(0u), a);
}

fn wide_less(a: vec2u, b: vec2u) -> bool {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
}

fn wide_less_signed(a: vec2u, b: vec2u) -> bool {
    return wide_less(a ^ vec2u(0u, 2147483648u), b ^ vec2u(0u, 2147483648u));
}

fn wide_clamp_signed(a: vec2u, low: vec2u, high: vec2u) -> vec2u {
    let above = select(a, low, wide_less_signed(a, low));
    return select(above, high, wide_less_signed(high, above));
}

fn wide_shift_left(a: vec2u, by: u32) -> vec2u {
    let bits = by & 31u;
    let carried = (a.x >> 1u) >> (31u - bits);
    let shifted = vec2u(a.x << bits, (a.y << bits) | carried);
    return select(shifted, vec2u(0u, shifted.x), by > 31u);
}

fn wide_shift_right(a: vec2u, by: u32) -> vec2u {
    let bits = by & 31u;
    let carried = (a.y << 1u) << (31u - bits);
    let shifted = vec2u((a.x >> bits) | carried, a.y >> bits);
    return select(shifted, vec2u(shifted.y, 0u), by > 31u);
}

fn wide_leading_zeros(a: vec2u) -> u32 {
    return select(countLeadingZeros(a.y), 32u + countLeadingZeros(a.x), a.y == 0u);
}

fn wide_fraction(a: vec2u, b: vec2u) -> vec2u {
    var rest = a;
    var quotient = vec2u(0u);
    for (var k = 0u; k < 64u; k++) {
        let carried = rest.y >> 31u;
        rest = wide_shift_left(rest, 1u);
        quotient = wide_shift_left(quotient, 1u);
        if carried == 1u || !wide_less(rest, b) {
            rest = wide_subtract(rest, b);
            quotient.x |= 1u;
        }
    }
    return quotient;
}
