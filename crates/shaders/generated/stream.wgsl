// Linked from stream.wesl.

struct Stream {
    key: vec4u,
    kind: u32,
    dimension: u32,
    block: vec4u
}

fn stream_at(key: vec4u, kind: u32, dimension: u32) -> Stream {
    return Stream(key, kind, dimension, package_lightshed_rng__1threefry4x32_12(vec4u(dimension / 4u, kind, 0u, 0u), key));
}

fn stream_of_sample(seed: vec2u, pixel: u32, sample: u32, dimension: u32) -> Stream {
    return stream_at(vec4u(seed, pixel, sample), 0u, dimension);
}

fn stream_of_path(seed: vec2u, dimension: u32) -> Stream {
    return stream_at(vec4u(seed, 0u, 0u), 1u, dimension);
}

fn after_eights(stream: ptr<function, Stream>, first: u32, used: u32) {
    let s = *stream;
    *stream = stream_at(s.key, s.kind, first + (used + 7u) / 8u * 8u);
}

fn next_word(stream: ptr<function, Stream>) -> u32 {
    let dimension = (*stream).dimension;
    (*stream).dimension = dimension + 1u;
    let word = (*stream).block[dimension % 4u];
    if dimension % 4u == 3u {
        (*stream).block = package_lightshed_rng__1threefry4x32_12(vec4u((dimension + 1u) / 4u, (*stream).kind, 0u, 0u), (*stream).key);
    }
    return word;
}

fn next_number(stream: ptr<function, Stream>) -> f32 {
    return package_lightshed_uniform__2f32_from_u32(next_word(stream));
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

fn package_lightshed_uniform__2f32_from_u32(bits: u32) -> f32 {
    return f32(bits >> 8u) * 5.9604645e-8;
}
