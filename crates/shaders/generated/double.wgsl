// Linked from double.wesl.

const SIGN: u32 = 2147483648u;

const INFINITE: u32 = 2146435072u;

const NAN: vec2u = vec2u(0u, 2146959360u);

const ONE: vec2u = vec2u(0u, 1072693248u);

const ZERO: vec2u = vec2u(0u, 0u);

fn double_negate(a: vec2u) -> vec2u {
    return a ^ vec2u(0u, SIGN);
}

fn double_abs(a: vec2u) -> vec2u {
    return a & vec2u(4294967295u, 2147483647u);
}

fn double_is_nan(a: vec2u) -> bool {
    return package_lightshed_wide__1wide_less(vec2u(0u, INFINITE), double_abs(a));
}

fn double_is_finite(a: vec2u) -> bool {
    return (a.y & INFINITE) != INFINITE;
}

fn biased_exponent(a: vec2u) -> i32 {
    return i32((a.y >> 20u) & 2047u);
}

fn significand(a: vec2u) -> vec2u {
    let bits = vec2u(a.x, (a.y & 1048575u) | 1048576u);
    return select(bits, vec2u(0u), (a.y & INFINITE) == 0u);
}

fn rounded(sign: u32, exponent: i32, bits: vec2u) -> vec2u {
    if exponent <= 0 {
        return vec2u(0u, sign);
    }
    if exponent >= 2047 {
        return vec2u(0u, sign | INFINITE);
    }
    let rest = bits.x & 2047u;
    let kept = package_lightshed_wide__2wide_shift_right(bits, 11u);
    let up = rest > 1024u || (rest == 1024u && (kept.x & 1u) == 1u);
    let sum = package_lightshed_wide__1wide_add(vec2u(kept.x, kept.y + (u32(exponent - 1) << 20u)), vec2u(select(0u, 1u, up), 0u));
    return vec2u(sum.x, sum.y | sign);
}

fn double_add(a: vec2u, b: vec2u) -> vec2u {
    let exchanged = package_lightshed_wide__1wide_less(double_abs(a), double_abs(b));
    let large = select(a, b, exchanged);
    let small = select(b, a, exchanged);
    let opposite = ((large.y ^ small.y) & SIGN) != 0u;
    if !double_is_finite(large) {
        return select(large, NAN, double_is_nan(large) || (opposite && !double_is_finite(small)));
    }
    let exponent = biased_exponent(large);
    let apart = u32(exponent - biased_exponent(small));
    let high = package_lightshed_wide__2wide_shift_left(significand(large), 10u);
    var low = package_lightshed_wide__2wide_shift_left(significand(small), 10u);
    if apart > 63u {
        low = vec2u(select(0u, 1u, (low.x | low.y) != 0u), 0u);
    }
    else {
        let shifted = package_lightshed_wide__2wide_shift_right(low, apart);
        let back = package_lightshed_wide__2wide_shift_left(shifted, apart);
        low = vec2u(shifted.x | select(0u, 1u, any(back != low)), shifted.y);
    }
    let sum = package_lightshed_wide__1wide_add(high, select(low, package_lightshed_wide__1wide_negate(low), opposite));
    let zeros = package_lightshed_wide__2wide_leading_zeros(sum);
    if zeros == 64u {
        return vec2u(0u, large.y & small.y & SIGN);
    }
    return rounded(large.y & SIGN, exponent + 1 - i32(zeros), package_lightshed_wide__2wide_shift_left(sum, zeros));
}

fn double_add_positive(a: vec2u, b: vec2u) -> vec2u {
    let exchanged = package_lightshed_wide__1wide_less(a, b);
    let large = select(a, b, exchanged);
    let small = select(b, a, exchanged);
    let exponent = large.y >> 20u;
    let apart = exponent - (small.y >> 20u);
    if apart > 31u || exponent > 2045u || small.y < 1048576u {
        return double_add(a, b);
    }
    let low = vec2u(small.x << 10u, (((small.y & 1048575u) | 1048576u) << 10u) | (small.x >> 22u));
    let lost = (low.x << 1u) << (31u - apart);
    let carried = (low.y << 1u) << (31u - apart);
    let shifted = vec2u((low.x >> apart) | carried | select(0u, 1u, lost != 0u), low.y >> apart);
    let high = vec2u(large.x << 10u, (((large.y & 1048575u) | 1048576u) << 10u) | (large.x >> 22u));
    let sum = package_lightshed_wide__1wide_add(high, shifted);
    let more = sum.y >> 31u;
    let half = 512u << more;
    let rest = sum.x & (2u * half - 1u);
    let kept = (sum.x >> (10u + more)) | (sum.y << (22u - more));
    let up = rest > half || (rest == half && (kept & 1u) == 1u);
    let bits = vec2u(kept, (sum.y >> (10u + more)) + ((exponent + more - 1u) << 20u));
    return package_lightshed_wide__1wide_add(bits, vec2u(select(0u, 1u, up), 0u));
}

fn double_subtract(a: vec2u, b: vec2u) -> vec2u {
    return double_add(a, double_negate(b));
}

fn double_multiply(a: vec2u, b: vec2u) -> vec2u {
    let sign = (a.y ^ b.y) & SIGN;
    let p = package_lightshed_wide__2wide_shift_left(significand(a), 11u);
    let q = package_lightshed_wide__2wide_shift_left(significand(b), 11u);
    if !double_is_finite(a) || !double_is_finite(b) {
        let none = double_is_nan(a) || double_is_nan(b) || p.y == 0u || q.y == 0u;
        return select(vec2u(0u, sign | INFINITE), NAN, none);
    }
    if p.y == 0u || q.y == 0u {
        return vec2u(0u, sign);
    }
    let low = package_lightshed_wide__1wide_product(p.x, q.x);
    let cross = package_lightshed_wide__1wide_product(p.x, q.y);
    let other = package_lightshed_wide__1wide_product(p.y, q.x);
    let high = package_lightshed_wide__1wide_product(p.y, q.y);
    let middle = package_lightshed_wide__1wide_add(vec2u(low.y, 0u), cross);
    let middle_sum = package_lightshed_wide__1wide_add(middle, other);
    let carry = select(0u, 1u, package_lightshed_wide__1wide_less(middle_sum, other));
    var product = package_lightshed_wide__1wide_add(high, vec2u(middle_sum.y, carry));
    let rest = (low.x | middle_sum.x) != 0u;
    var exponent = biased_exponent(a) + biased_exponent(b) - 1022;
    if product.y < SIGN {
        product = package_lightshed_wide__2wide_shift_left(product, 1u);
        exponent -= 1;
    }
    return rounded(sign, exponent, vec2u(product.x | select(0u, 1u, rest), product.y));
}

fn eighteen_bits(rest: vec2u, by: vec2u, scale: f32) -> vec3u {
    var bits = u32((f32(rest.y) * 4294967296.0 + f32(rest.x)) * scale);
    let taken = package_lightshed_wide__1wide_product(bits, by.x);
    var left = package_lightshed_wide__1wide_subtract(package_lightshed_wide__2wide_shift_left(rest, 18u), vec2u(taken.x, taken.y + bits * by.y));
    if left.y >= SIGN {
        left = package_lightshed_wide__1wide_add(left, by);
        bits -= 1u;
    }
    else if !package_lightshed_wide__1wide_less(left, by) {
        left = package_lightshed_wide__1wide_subtract(left, by);
        bits += 1u;
    }
    return vec3u(left, bits);
}

fn double_divide(a: vec2u, b: vec2u) -> vec2u {
    let sign = (a.y ^ b.y) & SIGN;
    var p = significand(a);
    let q = significand(b);
    let a_finite = double_is_finite(a);
    let b_finite = double_is_finite(b);
    if !a_finite || !b_finite || p.y == 0u || q.y == 0u {
        let none = double_is_nan(a) || double_is_nan(b) || (a_finite == b_finite && (!a_finite || p.y == q.y));
        let infinite = b_finite && (!a_finite || q.y == 0u);
        return select(vec2u(0u, sign | select(0u, INFINITE, infinite)), NAN, none);
    }
    var exponent = biased_exponent(a) - biased_exponent(b) + 1023;
    if package_lightshed_wide__1wide_less(p, q) {
        p = package_lightshed_wide__2wide_shift_left(p, 1u);
        exponent -= 1;
    }
    let scale = 262144.0 / (f32(q.y) * 4294967296.0 + f32(q.x));
    let first = eighteen_bits(package_lightshed_wide__1wide_subtract(p, q), q, scale);
    let second = eighteen_bits(first.xy, q, scale);
    let third = eighteen_bits(second.xy, q, scale);
    let quotient = vec2u(((second.z & 31u) << 27u) | (third.z << 9u) | select(0u, 1u, (third.x | third.y) != 0u), SIGN | (first.z << 13u) | (second.z >> 5u));
    return rounded(sign, exponent, quotient);
}

fn double_sqrt(a: vec2u) -> vec2u {
    if all(double_abs(a) == vec2u(0u)) || (a.y & INFINITE) == 0u {
        return vec2u(0u, a.y & SIGN);
    }
    if a.y >= SIGN || !double_is_finite(a) {
        return select(a, NAN, a.y >= SIGN || double_is_nan(a));
    }
    let exponent = biased_exponent(a) - 1023;
    let odd = exponent & 1;
    var pairs = package_lightshed_wide__2wide_shift_left(significand(a), 10u + u32(odd));
    var root = vec2u(0u);
    var rest = vec2u(0u);
    for (var k = 0u; k < 55u; k++) {
        rest = package_lightshed_wide__2wide_shift_left(rest, 2u);
        rest.x |= pairs.y >> 30u;
        pairs = package_lightshed_wide__2wide_shift_left(pairs, 2u);
        var trial = package_lightshed_wide__2wide_shift_left(root, 2u);
        trial.x |= 1u;
        root = package_lightshed_wide__2wide_shift_left(root, 1u);
        if !package_lightshed_wide__1wide_less(rest, trial) {
            rest = package_lightshed_wide__1wide_subtract(rest, trial);
            root.x |= 1u;
        }
    }
    let bits = package_lightshed_wide__2wide_shift_left(root, 9u);
    let inexact = select(0u, 1u, any(rest != vec2u(0u)));
    return rounded(0u, (exponent - odd) / 2 + 1023, vec2u(bits.x | inexact, bits.y));
}

fn double_less(a: vec2u, b: vec2u) -> bool {
    if double_is_nan(a) || double_is_nan(b) || all(double_abs(a | b) == vec2u(0u)) {
        return false;
    }
    let a_negative = a.y >= SIGN;
    let b_negative = b.y >= SIGN;
    if a_negative != b_negative {
        return a_negative;
    }
    return select(package_lightshed_wide__1wide_less(a, b), package_lightshed_wide__1wide_less(b, a), a_negative);
}

fn double_less_equal(a: vec2u, b: vec2u) -> bool {
    return !double_less(b, a) && !double_is_nan(a) && !double_is_nan(b);
}

fn double_from_f32_bits(bits: u32) -> vec2u {
    let sign = bits & SIGN;
    let exponent = (bits >> 23u) & 255u;
    let fraction = bits & 8388607u;
    if exponent == 255u {
        return select(vec2u(0u, sign | INFINITE), NAN, fraction != 0u);
    }
    if exponent == 0u {
        if fraction == 0u {
            return vec2u(0u, sign);
        }
        let up = countLeadingZeros(fraction) - 8u;
        let whole = (fraction << up) & 8388607u;
        return vec2u(whole << 29u, sign | ((897u - up) << 20u) | (whole >> 3u));
    }
    return vec2u(fraction << 29u, sign | ((exponent + 896u) << 20u) | (fraction >> 3u));
}

fn double_from_f32(x: f32) -> vec2u {
    return double_from_f32_bits(bitcast<u32>(x));
}

fn double_to_f32_bits(a: vec2u) -> u32 {
    let sign = a.y & SIGN;
    if !double_is_finite(a) {
        return select(sign | 2139095040u, 2143289344u, double_is_nan(a));
    }
    let exponent = biased_exponent(a) - 896;
    if exponent < -24 {
        return sign;
    }
    if exponent > 254 {
        return sign | 2139095040u;
    }
    let bits = significand(a);
    let down = u32(select(29, 30 - exponent, exponent < 1));
    let kept = package_lightshed_wide__2wide_shift_right(bits, down).x;
    let rest = package_lightshed_wide__2wide_shift_left(bits, 64u - down);
    let half = vec2u(0u, SIGN);
    let up = package_lightshed_wide__1wide_less(half, rest) || (all(rest == half) && (kept & 1u) == 1u);
    return sign | ((u32(max(exponent - 1, 0)) << 23u) + kept + select(0u, 1u, up));
}

fn double_to_f32(a: vec2u) -> f32 {
    return bitcast<f32>(double_to_f32_bits(a));
}

fn double_from_wide(a: vec2u) -> vec2u {
    let zeros = package_lightshed_wide__2wide_leading_zeros(a);
    if zeros == 64u {
        return ZERO;
    }
    return rounded(0u, 1086 - i32(zeros), package_lightshed_wide__2wide_shift_left(a, zeros));
}

fn double_from_u32(a: u32) -> vec2u {
    return double_from_wide(vec2u(a, 0u));
}

fn double_to_wide_signed(a: vec2u) -> vec2u {
    let exponent = biased_exponent(a);
    let negative = a.y >= SIGN;
    if double_is_nan(a) || exponent < 1023 {
        return vec2u(0u);
    }
    if exponent > 1085 {
        return select(vec2u(4294967295u, 2147483647u), vec2u(0u, SIGN), negative);
    }
    let bits = significand(a);
    let magnitude = select(package_lightshed_wide__2wide_shift_right(bits, u32(max(1075 - exponent, 0))), package_lightshed_wide__2wide_shift_left(bits, u32(max(exponent - 1075, 0))), exponent > 1075);
    return select(magnitude, package_lightshed_wide__1wide_negate(magnitude), negative);
}

fn double_to_u32(a: vec2u) -> u32 {
    let whole = double_to_wide_signed(a);
    if a.y >= SIGN {
        return 0u;
    }
    return select(whole.x, 4294967295u, whole.y != 0u);
}

fn package_lightshed_wide__1wide_add(a: vec2u, b: vec2u) -> vec2u {
    let low = a.x + b.x;
    return vec2u(low, a.y + b.y + select(0u, 1u, low < a.x));
}

fn package_lightshed_wide__1wide_less(a: vec2u, b: vec2u) -> bool {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
}

fn package_lightshed_wide__1wide_negate(a: vec2u) -> vec2u {
    return package_lightshed_wide__1wide_subtract(vec2u(0u), a);
}

fn package_lightshed_wide__1wide_product(a: u32, b: u32) -> vec2u {
    let a_low = a & 65535u;
    let a_high = a >> 16u;
    let b_low = b & 65535u;
    let b_high = b >> 16u;
    let low = a_low * b_low;
    let middle = a_high * b_low + (low >> 16u);
    let other = a_low * b_high + (middle & 65535u);
    return vec2u(a * b, a_high * b_high + (middle >> 16u) + (other >> 16u));
}

fn package_lightshed_wide__1wide_subtract(a: vec2u, b: vec2u) -> vec2u {
    return vec2u(a.x - b.x, a.y - b.y - select(0u, 1u, a.x < b.x));
}

fn package_lightshed_wide__2wide_leading_zeros(a: vec2u) -> u32 {
    return select(countLeadingZeros(a.y), 32u + countLeadingZeros(a.x), a.y == 0u);
}

fn package_lightshed_wide__2wide_shift_left(a: vec2u, by: u32) -> vec2u {
    let bits = by & 31u;
    let carried = (a.x >> 1u) >> (31u - bits);
    let shifted = vec2u(a.x << bits, (a.y << bits) | carried);
    return select(shifted, vec2u(0u, shifted.x), by > 31u);
}

fn package_lightshed_wide__2wide_shift_right(a: vec2u, by: u32) -> vec2u {
    let bits = by & 31u;
    let carried = (a.y << 1u) << (31u - bits);
    let shifted = vec2u((a.x >> bits) | carried, a.y >> bits);
    return select(shifted, vec2u(shifted.y, 0u), by > 31u);
}
