// Linked from morton.wesl.

fn spread_10(x: vec3u) -> vec3u {
    var y = x & vec3u(1023u);
    y = (y | (y << vec3u(16u))) & vec3u(50331903u);
    y = (y | (y << vec3u(8u))) & vec3u(50393103u);
    y = (y | (y << vec3u(4u))) & vec3u(51130563u);
    return (y | (y << vec3u(2u))) & vec3u(153391689u);
}

fn gather_10(x: vec3u) -> vec3u {
    var y = x & vec3u(153391689u);
    y = (y | (y >> vec3u(2u))) & vec3u(51130563u);
    y = (y | (y >> vec3u(4u))) & vec3u(50393103u);
    y = (y | (y >> vec3u(8u))) & vec3u(50331903u);
    return (y | (y >> vec3u(16u))) & vec3u(1023u);
}

fn morton30_encode(cell: vec3u) -> u32 {
    let spread = spread_10(cell);
    return spread.x | (spread.y << 1u) | (spread.z << 2u);
}

fn morton30_decode(code: u32) -> vec3u {
    return gather_10(vec3u(code, code >> 1u, code >> 2u));
}

fn morton63_encode(cell: vec3u) -> vec2u {
    let low = morton30_encode(cell);
    let middle = morton30_encode(cell >> vec3u(10u));
    let top = morton30_encode((cell >> vec3u(20u)) & vec3u(1u));
    return vec2u(low | (middle << 30u), (middle >> 2u) | (top << 28u));
}

fn morton63_decode(code: vec2u) -> vec3u {
    let low = morton30_decode(code.x & 1073741823u);
    let middle = morton30_decode(((code.x >> 30u) | (code.y << 2u)) & 1073741823u);
    let top = morton30_decode((code.y >> 28u) & 7u);
    return low | (middle << vec3u(10u)) | (top << vec3u(20u));
}
