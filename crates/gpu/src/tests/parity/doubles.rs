//! Double precision made of words: the bits of `f64`.

use crate::tests::parity::harness::{COUNT, HOSTILE, Shader, Tier, check, compare, gpu, words};
use lightshed_sampling::CounterRng;

/// Numbers below 2⁻¹⁰²² are zeros, and there is one NaN.
fn plain(x: f64) -> f64 {
    if x.is_nan() {
        f64::from_bits(0x7ff8 << 48)
    } else if x.is_subnormal() {
        0.0f64.copysign(x)
    } else {
        x
    }
}

fn split(x: f64) -> [u32; 2] {
    let bits = plain(x).to_bits();
    [bits as u32, (bits >> 32) as u32]
}

fn joined(low: u32, high: u32) -> f64 {
    plain(f64::from_bits(u64::from(low) | u64::from(high) << 32))
}

/// Pairs of doubles: any bits; numbers near each other, so that sums cancel and quotients are near
/// one; few bits, so that halves have to be rounded to even; and the ends of the range.
fn pairs() -> Vec<[u32; 4]> {
    const ENDS: [u64; 16] = [
        0,
        1 << 63,
        2 << 52,
        (2 << 52) + 1,
        0x7fef_ffff_ffff_ffff,
        0x7fe0_0000_0000_0000,
        0x7ff0_0000_0000_0000,
        0xfff0_0000_0000_0000,
        0x7ff8_0000_0000_0000,
        0x3ff0_0000_0000_0000,
        0xbff0_0000_0000_0000,
        0x3fef_ffff_ffff_ffff,
        0x3ff0_0000_0000_0001,
        0x4340_0000_0000_0001,
        0x3ca0_0000_0000_0000,
        0x4008_0000_0000_0000,
    ];
    let mut rng = CounterRng::new(50, 0, 0);
    let mut all: Vec<[u64; 2]> = Vec::new();
    for a in ENDS {
        all.extend(ENDS.map(|b| [a, b]));
    }
    while all.len() < COUNT {
        let [a, b] = [rng.next_u64(), rng.next_u64()];
        let near = |a: u64| a & 0x800f_ffff_ffff_ffff | (1000 + (a >> 52) % 48) << 52;
        let few = |a: u64| near(a) & !((1 << 45) - 1) | (a & 1);
        all.push(match all.len() % 4 {
            0 => [a, b],
            1 => [near(a), near(b)],
            2 => [near(a), near(a) ^ (1 << 63) ^ (b & 0xffff)],
            _ => [few(a), few(b)],
        });
    }
    all.iter()
        .map(|pair| [pair[0], pair[1]].map(|bits| split(f64::from_bits(bits))))
        .map(|[a, b]| [a[0], a[1], b[0], b[1]])
        .collect()
}

const IMPORTS: &str = "import package::lightshed::double::{double_abs, double_add, double_add_positive, double_divide, double_less, double_less_equal, double_multiply,
    double_sqrt, double_subtract};";
const BODY: &str = "let a = vec2u(word(0u), word(1u));
    let b = vec2u(word(2u), word(3u));
    let sum = double_add(a, b); put(0u, sum.x); put(1u, sum.y);
    let difference = double_subtract(a, b); put(2u, difference.x); put(3u, difference.y);
    let product = double_multiply(a, b); put(4u, product.x); put(5u, product.y);
    let quotient = double_divide(a, b); put(6u, quotient.x); put(7u, quotient.y);
    put(8u, select(0u, 1u, double_less(a, b)) + select(0u, 2u, double_less_equal(a, b)));
    let root = double_sqrt(a); put(9u, root.x); put(10u, root.y);
    let positive = double_add_positive(double_abs(a), double_abs(b)); put(11u, positive.x); put(12u, positive.y);";

fn truth(&[a0, a1, b0, b1]: &[u32; 4]) -> [u32; 13] {
    let (a, b) = (joined(a0, a1), joined(b0, b1));
    let [sum, difference, product, quotient] = [a + b, a - b, a * b, a / b].map(split);
    let order = u32::from(a < b) + 2 * u32::from(a <= b);
    let mut all = [order; 13];
    for (k, number) in [sum, difference, product, quotient].iter().enumerate() {
        all[2 * k..2 * k + 2].copy_from_slice(number);
    }
    all[9..11].copy_from_slice(&split(a.sqrt()));
    all[11..].copy_from_slice(&split(a.abs() + b.abs()));
    all
}

#[test]
fn arithmetic() {
    check::<4, 13>(
        "double",
        Tier::Words,
        &Shader::new(IMPORTS, BODY),
        &pairs(),
        truth,
    );
}

/// A last bit that is rounded up where it is halfway and should be even.
#[test]
fn a_halfway_case_is_seen() {
    let Some(gpu) = gpu() else { return };
    let inputs = pairs();
    let found = Shader::new(IMPORTS, BODY).run::<4, 13>(gpu, &inputs);
    let rounded_up = |a: f64, b: f64| {
        let sum = a + b;
        // The exact error of the sum (Knuth): halfway if it is half a unit in the last place.
        let from_b = sum - a;
        let error = (a - (sum - from_b)) + (b - from_b);
        let unit = f64::from_bits((sum.abs().to_bits() & (0x7ff << 52)).saturating_sub(52 << 52));
        (error > 0.0 && error == 0.5 * unit).then(|| split(sum + unit))
    };
    // Of the sum, and of that of numbers that are not negative.
    for (place, is_positive) in [(0, false), (11, true)] {
        let away = |input: &[u32; 4]| {
            let mut all = truth(input);
            let (a, b) = (joined(input[0], input[1]), joined(input[2], input[3]));
            let (a, b) = if is_positive { (a.abs(), b.abs()) } else { (a, b) };
            if let Some(bits) = rounded_up(a, b) {
                all[place..place + 2].copy_from_slice(&bits);
            }
            all
        };
        assert!(compare("planted", Tier::Words, &inputs, &found, away).is_err());
    }
}

#[test]
fn conversions() {
    let mut inputs: Vec<[u32; 4]> = pairs();
    let hostile = HOSTILE.map(|word| [word, word ^ 1, word, 0]);
    inputs[1000..1000 + hostile.len()].copy_from_slice(&hostile);
    // Doubles of the size of f32s, whole and with the bits that decide how an f32 is rounded;
    // numbers around 2⁶³.
    let mut rng = CounterRng::new(51, 0, 0);
    for input in inputs.iter_mut().skip(2000).step_by(2) {
        let exponent = 1023 - 155 + rng.next_u32() % 300;
        let keep = [0, !0 << 16, !0 << 29][(rng.next_u32() % 3) as usize];
        input[0] = rng.next_u32() & keep;
        input[1] = rng.next_u32() & 0x800f_ffff | exponent << 20;
    }
    check::<4, 14>(
        "double, conversions",
        Tier::Words,
        &Shader::new(
            "import package::lightshed::double::{double_from_f32_bits, double_from_u32, double_from_wide, double_to_f32_bits, double_to_u32,
                 double_to_wide_signed};",
            "let a = vec2u(word(0u), word(1u));
             put(0u, double_to_f32_bits(a));
             let whole = double_to_wide_signed(a); put(1u, whole.x); put(2u, whole.y);
             put(3u, double_to_u32(a));
             let x = double_from_f32_bits(word(2u)); put(4u, x.x); put(5u, x.y);
             let y = double_from_f32_bits(word(0u)); put(6u, y.x); put(7u, y.y);
             let z = double_from_wide(a); put(8u, z.x); put(9u, z.y);
             let u = double_from_u32(word(1u)); put(10u, u.x); put(11u, u.y);
             let v = double_from_wide(vec2u(word(2u), 0u)); put(12u, v.x); put(13u, v.y);",
        ),
        &inputs,
        |&[low, high, c, _]| {
            let a = joined(low, high);
            let to_f32 = a as f32;
            let whole = a as i64;
            let mut all = [0; 14];
            all[0] = if to_f32.is_nan() { 0x7fc0_0000 } else { to_f32.to_bits() };
            (all[1], all[2], all[3]) = (whole as u32, (whole >> 32) as u32, a as u32);
            let doubles = [
                f64::from(f32::from_bits(c)),
                f64::from(f32::from_bits(low)),
                (u64::from(low) | u64::from(high) << 32) as f64,
                f64::from(high),
                f64::from(c),
            ];
            for (k, double) in doubles.into_iter().enumerate() {
                all[4 + 2 * k..6 + 2 * k].copy_from_slice(&split(double));
            }
            all
        },
    );
}

#[test]
fn wide_integers() {
    check::<5, 13>(
        "wide",
        Tier::Words,
        &Shader::new(
            "import package::lightshed::wide::{wide_add, wide_clamp_signed, wide_leading_zeros, wide_less, wide_less_signed, wide_multiply,
                 wide_shift_left, wide_shift_right, wide_subtract};",
            "let a = vec2u(word(0u), word(1u)); let b = vec2u(word(2u), word(3u));
             let by = word(4u) & 63u;
             let r0 = wide_add(a, b); put(0u, r0.x); put(1u, r0.y);
             let r1 = wide_subtract(a, b); put(2u, r1.x); put(3u, r1.y);
             let r2 = wide_multiply(a, b); put(4u, r2.x); put(5u, r2.y);
             let r3 = wide_shift_left(a, by); put(6u, r3.x); put(7u, r3.y);
             let r4 = wide_shift_right(a, by); put(8u, r4.x); put(9u, r4.y);
             put(10u, select(0u, 1u, wide_less(a, b)) + select(0u, 2u, wide_less_signed(a, b)) + 4u * wide_leading_zeros(a));
             let r5 = wide_clamp_signed(a, vec2u(0u, 0xe0000000u), vec2u(0u, 0x20000000u)); put(11u, r5.x); put(12u, r5.y);",
        ),
        &words(52),
        |&[a0, a1, b0, b1, by]| {
            let (a, b) = (u64::from(a0) | u64::from(a1) << 32, u64::from(b0) | u64::from(b1) << 32);
            let by = by & 63;
            let order = u32::from(a < b) + 2 * u32::from((a as i64) < b as i64) + 4 * a.leading_zeros();
            let numbers = [
                a.wrapping_add(b),
                a.wrapping_sub(b),
                a.wrapping_mul(b),
                a << by,
                a >> by,
                (a as i64).clamp(-(1 << 61), 1 << 61) as u64,
            ]
            .map(|x| [x as u32, (x >> 32) as u32]);
            let mut all = [order; 13];
            for (k, number) in numbers.iter().enumerate() {
                let at = if k < 5 { 2 * k } else { 11 };
                all[at..at + 2].copy_from_slice(number);
            }
            all
        },
    );
}
