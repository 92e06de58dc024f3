// Linked from path_numbers.wesl.

fn path_block(seed: vec2u, block: u32) -> vec4u {
    return package_lightshed_rng__1threefry4x32_12(vec4u(block, 1u, 0u, 0u), vec4u(seed, 0u, 0u));
}

fn emitter_words(seed: vec2u, index: u32) -> vec4u {
    return path_block(seed, 2u * index);
}

struct ScatterNumbers {
    lobe: f32,
    direction: vec2f,
    roulette: f32
}

fn scatter_numbers(seed: vec2u, index: u32) -> ScatterNumbers {
    let words = path_block(seed, 2u * index + 1u);
    return ScatterNumbers(package_lightshed_uniform__2f32_from_u32(words.x), package_lightshed_uniform__1unit_square(words.yz), package_lightshed_uniform__2f32_from_u32(words.w));
}

const package_lightshed_rng_PARITY: u32 = 466688986u;

fn package_lightshed_rng__1rotate_left(x: vec2u, by: vec2u) -> vec2u {
    return (x << by) | (x >> (vec2u(32u) - by));
}

fn package_lightshed_rng__1threefry4x32_12(counter: vec4u, key: vec4u) -> vec4u {
    let parity = package_lightshed_rng_PARITY ^ key.x ^ key.y ^ key.z ^ key.w;
    var x = counter + key;
    x = package_lightshed_rng__1two_rounds(x, vec2u(10u, 26u), vec2u(11u, 21u));
    x = package_lightshed_rng__1two_rounds(x, vec2u(13u, 27u), vec2u(23u, 5u));
    x += vec4u(key.y, key.z, key.w, parity + 1u);
    x = package_lightshed_rng__1two_rounds(x, vec2u(6u, 20u), vec2u(17u, 11u));
    x = package_lightshed_rng__1two_rounds(x, vec2u(25u, 10u), vec2u(18u, 20u));
    x += vec4u(key.z, key.w, parity, key.x + 2u);
    x = package_lightshed_rng__1two_rounds(x, vec2u(10u, 26u), vec2u(11u, 21u));
    x = package_lightshed_rng__1two_rounds(x, vec2u(13u, 27u), vec2u(23u, 5u));
    x += vec4u(key.w, parity, key.x, key.y + 3u);
    return x;
}

fn package_lightshed_rng__1two_rounds(x: vec4u, even: vec2u, odd: vec2u) -> vec4u {
    let sum_even = x.xz + x.yw;
    let mixed_even = package_lightshed_rng__1rotate_left(x.yw, even) ^ sum_even;
    let sum_odd = sum_even + mixed_even.yx;
    let mixed_odd = package_lightshed_rng__1rotate_left(mixed_even.yx, odd) ^ sum_odd;
    return vec4u(sum_odd.x, mixed_odd.y, sum_odd.y, mixed_odd.x);
}

fn package_lightshed_uniform__1unit_square(bits: vec2u) -> vec2f {
    return vec2f(bits >> vec2u(8u)) * 5.9604645e-8;
}

fn package_lightshed_uniform__2f32_from_u32(bits: u32) -> f32 {
    return f32(bits >> 8u) * 5.9604645e-8;
}
