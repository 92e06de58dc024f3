// Linked from rng.wesl.

const PARITY: u32 = 466688986u;

fn rotate_left(x: vec2u, by: vec2u) -> vec2u {
    return (x << by) | (x >> (vec2u(32u) - by));
}

fn two_rounds(x: vec4u, even: vec2u, odd: vec2u) -> vec4u {
    let sum_even = x.xz + x.yw;
    let mixed_even = rotate_left(x.yw, even) ^ sum_even;
    let sum_odd = sum_even + mixed_even.yx;
    let mixed_odd = rotate_left(mixed_even.yx, odd) ^ sum_odd;
    return vec4u(sum_odd.x, mixed_odd.y, sum_odd.y, mixed_odd.x);
}

fn threefry4x32_12(counter: vec4u, key: vec4u) -> vec4u {
    let parity = PARITY ^ key.x ^ key.y ^ key.z ^ key.w;
    var x = counter + key;
    x = two_rounds(x, vec2u(10u, 26u), vec2u(11u, 21u));
    x = two_rounds(x, vec2u(13u, 27u), vec2u(23u, 5u));
    x += vec4u(key.y, key.z, key.w, parity + 1u);
    x = two_rounds(x, vec2u(6u, 20u), vec2u(17u, 11u));
    x = two_rounds(x, vec2u(25u, 10u), vec2u(18u, 20u));
    x += vec4u(key.z, key.w, parity, key.x + 2u);
    x = two_rounds(x, vec2u(10u, 26u), vec2u(11u, 21u));
    x = two_rounds(x, vec2u(13u, 27u), vec2u(23u, 5u));
    x += vec4u(key.w, parity, key.x, key.y + 3u);
    return x;
}

fn random_block(seed: vec2u, pixel: u32, sample: u32, block: u32) -> vec4u {
    return threefry4x32_12(vec4u(block, 0u, 0u, 0u), vec4u(seed, pixel, sample));
}

fn random_word(seed: vec2u, pixel: u32, sample: u32, dimension: u32) -> u32 {
    return random_block(seed, pixel, sample, dimension / 4u)[dimension % 4u];
}
