// Linked from light_tree_build.wesl.

struct LightRecord {
    low: vec3f,
    intensity: f32,
    high: vec3f,
    normals: u32
}

struct Settings {
    lights: u32,
    depth: u32,
    curve: u32,
    boxes: u32,
    levels: array<u32, 32>
}

@group(0) @binding(0)
var<storage, read> settings: Settings;

@group(0) @binding(1)
var<storage, read> lights: array<LightRecord>;

@group(0) @binding(2)
var<storage, read_write> boxes: array<package_group_Box>;

@group(0) @binding(3)
var<storage, read_write> cube: package_lightshed_curve_Cube;

@group(0) @binding(4)
var<storage, read_write> codes: array<vec2u>;

@group(0) @binding(5)
var<storage, read_write> indices: array<u32>;

@group(0) @binding(6)
var<storage, read_write> rows: array<u32>;

@group(0) @binding(7)
var<storage, read_write> light_at: array<u32>;

@group(0) @binding(8)
var<storage, read_write> leaf_of: array<u32>;

@group(0) @binding(9)
var<storage, read> level_below: array<u32>;

const ROWS: u32 = 8u;

const WIDTH: u32 = 8u;

fn no_box() -> package_group_Box {
    return package_group_Box(vec3f(package_lightshed_float__1F32_MAX), 0u, vec3f(-package_lightshed_float__1F32_MAX), 0u);
}

@compute @workgroup_size(256)
fn center_bounds(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u) {
    var own = no_box();
    for (var i = group.x * package_group_GROUP + lane; i < settings.lights; i += settings.boxes * package_group_GROUP) {
        let center = lights[i].low * 0.5 + lights[i].high * 0.5;
        own = package_group_Box(min(own.low, center), 0u, max(own.high, center), 0u);
    }
    let all = package_group__2box_of_group(lane, own);
    if lane == 0u {
        boxes[group.x] = all;
    }
}

@compute @workgroup_size(256)
fn bounding_cube(@builtin(local_invocation_index) lane: u32) {
    var own = no_box();
    for (var i = lane; i < settings.boxes; i += package_group_GROUP) {
        own = package_group_Box(min(own.low, boxes[i].low), 0u, max(own.high, boxes[i].high), 0u);
    }
    let all = package_group__2box_of_group(lane, own);
    if lane == 0u {
        cube = package_lightshed_curve__1cube_around(all.low, all.high);
    }
}

@compute @workgroup_size(256)
fn encode(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    if i < settings.lights {
        codes[i] = package_lightshed_curve__1curve_code(settings.curve, package_lightshed_curve__1cube_cell(cube, lights[i].low, lights[i].high));
        indices[i] = i;
    }
}

fn place_of(level_start: u32, node: u32) -> u32 {
    return (level_start + node / WIDTH) * ROWS * WIDTH + node % WIDTH;
}

@compute @workgroup_size(256)
fn leaves(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let leaf = package_group__1index_of(group, groups, lane);
    let end = (settings.lights + WIDTH - 1u) / WIDTH * WIDTH;
    if leaf >= end {
        return;
    }
    var record = LightRecord();
    if leaf < settings.lights {
        let light = indices[leaf];
        light_at[leaf] = light;
        leaf_of[light] = leaf;
        record = lights[light];
        if !(record.intensity > 0.0) {
            record = LightRecord();
        }
    }
    let place = place_of(settings.levels[settings.depth], leaf);
    rows[place] = bitcast<u32>(record.low.x);
    rows[place + WIDTH] = bitcast<u32>(record.low.y);
    rows[place + 2u * WIDTH] = bitcast<u32>(record.low.z);
    rows[place + 3u * WIDTH] = bitcast<u32>(record.high.x);
    rows[place + 4u * WIDTH] = bitcast<u32>(record.high.y);
    rows[place + 5u * WIDTH] = bitcast<u32>(record.high.z);
    rows[place + 6u * WIDTH] = bitcast<u32>(record.intensity);
    rows[place + 7u * WIDTH] = record.normals;
}

fn number_at(place: u32) -> f32 {
    return bitcast<f32>(rows[place]);
}

fn build_node(level: u32, node: u32) {
    let child = place_of(settings.levels[level + 1u], 2u * node);
    let place = place_of(settings.levels[level], node);
    let a_intensity = number_at(child + 6u * WIDTH);
    let b_intensity = number_at(child + 6u * WIDTH + 1u);
    let no_a = a_intensity == 0.0;
    let no_b = b_intensity == 0.0;
    for (var row = 0u; row < 6u; row++) {
        let a = number_at(child + row * WIDTH);
        let b = number_at(child + row * WIDTH + 1u);
        let both = select(b, a, select(a > b, a < b, row < 3u));
        rows[place + row * WIDTH] = bitcast<u32>(select(select(both, a, no_b), b, no_a));
    }
    rows[place + 6u * WIDTH] = bitcast<u32>(min(a_intensity + b_intensity, package_lightshed_float__1F32_MAX));
    let a_normals = rows[child + 7u * WIDTH];
    let b_normals = rows[child + 7u * WIDTH + 1u];
    rows[place + 7u * WIDTH] = select(select(package_lightshed__1normal_ball__1ball_union(a_normals, b_normals), a_normals, no_b), b_normals, no_a);
}

@compute @workgroup_size(256)
fn levels(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let first = group.y * groups.x + group.x;
    for (var up = 1u; up <= 9u; up++) {
        let share = 512u >> up;
        if lane < share && up <= level_below[0] {
            let level = level_below[0] - up;
            let node = first * share + lane;
            if node < nodes_of(level) {
                build_node(level, node);
            }
        }
        storageBarrier();
    }
}

fn nodes_of(level: u32) -> u32 {
    return ((settings.lights - 1u) >> (settings.depth - level)) + 1u;
}

struct package_group_Box {
    low: vec3f,
    padding: u32,
    high: vec3f,
    more_padding: u32
}

const package_group_GROUP: u32 = 256u;

fn package_group__1index_of(group: vec3u, groups: vec3u, lane: u32) -> u32 {
    return (group.y * groups.x + group.x) * package_group_GROUP + lane;
}

fn package_group__2box_of_group(lane: u32, own: package_group_Box) -> package_group_Box {
    package_group_lows[lane] = own.low;
    package_group_highs[lane] = own.high;
    workgroupBarrier();
    for (var half = package_group_GROUP / 2u; half > 0u; half /= 2u) {
        if lane < half {
            package_group_lows[lane] = min(package_group_lows[lane], package_group_lows[lane + half]);
            package_group_highs[lane] = max(package_group_highs[lane], package_group_highs[lane + half]);
        }
        workgroupBarrier();
    }
    return package_group_Box(package_group_lows[0], 0u, package_group_highs[0], 0u);
}

var<workgroup> package_group_highs: array<vec3f, 256>;

var<workgroup> package_group_lows: array<vec3f, 256>;

struct package_lightshed__1normal_ball_NormalBall {
    center: vec3f,
    radius: f32
}

const package_lightshed__1normal_ball_SLACK: f32 = 0.000127;

const package_lightshed__1normal_ball__1ALL_NORMALS: u32 = 2139062271u;

const package_lightshed__1normal_ball__1CENTER_STEPS: f32 = 127.0;

const package_lightshed__1normal_ball__1RADIUS_STEP: f32 = 0.49803925;

const package_lightshed__1normal_ball__1RADIUS_STEPS: f32 = 2.007874;

const package_lightshed__1normal_ball__1TO_INTEGER: f32 = 8388608.0;

fn package_lightshed__1normal_ball__1ball_pack(ball: package_lightshed__1normal_ball_NormalBall) -> u32 {
    let counted = min(ball.center, vec3f(package_lightshed_float__1F32_MAX)) + package_lightshed__1normal_ball__1CENTER_STEPS;
    let wanted = min(max(counted, vec3f(0.0)), vec3f(2.0 * package_lightshed__1normal_ball__1CENTER_STEPS));
    let step = min(wanted + package_lightshed__1normal_ball__1TO_INTEGER, vec3f(package_lightshed_float__1F32_MAX));
    let off = min(step - package_lightshed__1normal_ball__1TO_INTEGER, vec3f(package_lightshed_float__1F32_MAX)) - wanted;
    let radius = package_lightshed_float__2as_it_is(ball.radius + sqrt(package_lightshed_vector_dot3(off, off))) + package_lightshed__1normal_ball_SLACK;
    let radius_steps = package_lightshed_float__2as_it_is(package_lightshed_float__2as_it_is(radius) * package_lightshed__1normal_ball__1RADIUS_STEPS);
    if !(radius_steps <= 255.0) {
        return package_lightshed__1normal_ball__1ALL_NORMALS;
    }
    let radius_byte = bitcast<u32>(package_lightshed_float__2as_it_is(radius_steps + 0.5) + package_lightshed__1normal_ball__1TO_INTEGER) & 255u;
    let bytes = bitcast<vec3u>(step) & vec3u(255u);
    return (bytes.x << 24u) | (bytes.y << 16u) | (bytes.z << 8u) | radius_byte;
}

fn package_lightshed__1normal_ball__1ball_union(a: u32, b: u32) -> u32 {
    let ball_a = package_lightshed__1normal_ball__1ball_unpack(a);
    let ball_b = package_lightshed__1normal_ball__1ball_unpack(b);
    let across = ball_b.center - ball_a.center;
    let distance = package_lightshed_float__2as_it_is(sqrt(package_lightshed_vector_dot3(across, across)) * 1.0000005);
    if package_lightshed_float__2as_it_is(distance + ball_b.radius) <= ball_a.radius {
        return a;
    }
    if package_lightshed_float__2as_it_is(distance + ball_a.radius) <= ball_b.radius {
        return b;
    }
    let radius = package_lightshed_float__2as_it_is((distance + ball_a.radius + ball_b.radius) * 0.5);
    let part = (radius - ball_a.radius) / max(distance, 1.0);
    return package_lightshed__1normal_ball__1ball_pack(package_lightshed__1normal_ball_NormalBall(ball_a.center + across * part, radius));
}

fn package_lightshed__1normal_ball__1ball_unpack(bits: u32) -> package_lightshed__1normal_ball_NormalBall {
    let steps = vec3f((vec3u(bits) >> vec3u(24u, 16u, 8u)) & vec3u(255u)) - package_lightshed__1normal_ball__1CENTER_STEPS;
    return package_lightshed__1normal_ball_NormalBall(min(steps, vec3f(package_lightshed_float__1F32_MAX)), package_lightshed_float__2as_it_is(f32(bits & 255u) * package_lightshed__1normal_ball__1RADIUS_STEP));
}

const package_lightshed_curve_BITS: u32 = 21u;

const package_lightshed_curve_CELLS: vec2u = vec2u(0u, 1094713344u);

struct package_lightshed_curve_Cube {
    low: vec3f,
    padding: u32,
    scale: vec2u,
    more_padding: vec2u
}

const package_lightshed_curve__1CURVE_HILBERT: u32 = 1u;

fn package_lightshed_curve__1cell_along(cube_low: f32, scale: vec2u, low: f32, high: f32) -> u32 {
    let center = package_lightshed_double__1double_add(package_lightshed_double__2double_from_f32(low), package_lightshed_double__2double_from_f32(high));
    let cell = package_lightshed_double__1double_multiply(package_lightshed_double__1double_subtract(center, package_lightshed_curve_doubled(cube_low)), scale);
    return min(package_lightshed_double__2double_to_u32(cell), (1u << package_lightshed_curve_BITS) - 1u);
}

fn package_lightshed_curve__1cube_around(low: vec3f, high: vec3f) -> package_lightshed_curve_Cube {
    let x = package_lightshed_double__1double_subtract(package_lightshed_curve_doubled(high.x), package_lightshed_curve_doubled(low.x));
    let y = package_lightshed_double__1double_subtract(package_lightshed_curve_doubled(high.y), package_lightshed_curve_doubled(low.y));
    let z = package_lightshed_double__1double_subtract(package_lightshed_curve_doubled(high.z), package_lightshed_curve_doubled(low.z));
    var side = select(x, y, package_lightshed_double__1double_less(x, y));
    side = select(side, z, package_lightshed_double__1double_less(side, z));
    var scale = vec2u(0u);
    if package_lightshed_double__1double_less(vec2u(0u), side) {
        scale = package_lightshed_double__1double_divide(package_lightshed_curve_CELLS, side);
    }
    return package_lightshed_curve_Cube(low, 0u, scale, vec2u(0u));
}

fn package_lightshed_curve__1cube_cell(cube: package_lightshed_curve_Cube, low: vec3f, high: vec3f) -> vec3u {
    return vec3u(package_lightshed_curve__1cell_along(cube.low.x, cube.scale, low.x, high.x), package_lightshed_curve__1cell_along(cube.low.y, cube.scale, low.y, high.y), package_lightshed_curve__1cell_along(cube.low.z, cube.scale, low.z, high.z));
}

fn package_lightshed_curve__1curve_code(curve: u32, cell: vec3u) -> vec2u {
    if curve == package_lightshed_curve__1CURVE_HILBERT {
        return package_lightshed_morton__1morton63_encode(package_lightshed_curve__1hilbert_coordinates(cell).zyx);
    }
    return package_lightshed_morton__1morton63_encode(cell);
}

fn package_lightshed_curve__1hilbert_coordinates(cell: vec3u) -> vec3u {
    var c = cell;
    for (var bit = package_lightshed_curve_BITS - 1u; bit > 0u; bit--) {
        let low = (1u << bit) - 1u;
        let is_set = vec3u(0u) - ((c >> vec3u(bit)) & vec3u(1u));
        c.x ^= low & is_set.x;
        let y_exchanged = (c.x ^ c.y) & low & ~is_set.y;
        c.x ^= y_exchanged | (low & is_set.y);
        c.y ^= y_exchanged;
        let z_exchanged = (c.x ^ c.z) & low & ~is_set.z;
        c.x ^= z_exchanged | (low & is_set.z);
        c.z ^= z_exchanged;
    }
    c.y ^= c.x;
    c.z ^= c.y;
    var inverted = 0u;
    for (var bit = package_lightshed_curve_BITS - 1u; bit > 0u; bit--) {
        inverted ^= ((1u << bit) - 1u) & (0u - ((c.z >> bit) & 1u));
    }
    return c ^ vec3u(inverted);
}

fn package_lightshed_curve_doubled(x: f32) -> vec2u {
    let double = package_lightshed_double__2double_from_f32(x);
    return package_lightshed_double__1double_add(double, double);
}

const package_lightshed_double_INFINITE: u32 = 2146435072u;

const package_lightshed_double_NAN: vec2u = vec2u(0u, 2146959360u);

const package_lightshed_double_SIGN: u32 = 2147483648u;

fn package_lightshed_double__1biased_exponent(a: vec2u) -> i32 {
    return i32((a.y >> 20u) & 2047u);
}

fn package_lightshed_double__1double_abs(a: vec2u) -> vec2u {
    return a & vec2u(4294967295u, 2147483647u);
}

fn package_lightshed_double__1double_add(a: vec2u, b: vec2u) -> vec2u {
    let exchanged = package_lightshed_wide__1wide_less(package_lightshed_double__1double_abs(a), package_lightshed_double__1double_abs(b));
    let large = select(a, b, exchanged);
    let small = select(b, a, exchanged);
    let opposite = ((large.y ^ small.y) & package_lightshed_double_SIGN) != 0u;
    if !package_lightshed_double__2double_is_finite(large) {
        return select(large, package_lightshed_double_NAN, package_lightshed_double__2double_is_nan(large) || (opposite && !package_lightshed_double__2double_is_finite(small)));
    }
    let exponent = package_lightshed_double__1biased_exponent(large);
    let apart = u32(exponent - package_lightshed_double__1biased_exponent(small));
    let high = package_lightshed_wide__2wide_shift_left(package_lightshed_double_significand(large), 10u);
    var low = package_lightshed_wide__2wide_shift_left(package_lightshed_double_significand(small), 10u);
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
        return vec2u(0u, large.y & small.y & package_lightshed_double_SIGN);
    }
    return package_lightshed_double_rounded(large.y & package_lightshed_double_SIGN, exponent + 1 - i32(zeros), package_lightshed_wide__2wide_shift_left(sum, zeros));
}

fn package_lightshed_double__1double_divide(a: vec2u, b: vec2u) -> vec2u {
    let sign = (a.y ^ b.y) & package_lightshed_double_SIGN;
    var p = package_lightshed_double_significand(a);
    let q = package_lightshed_double_significand(b);
    let a_finite = package_lightshed_double__2double_is_finite(a);
    let b_finite = package_lightshed_double__2double_is_finite(b);
    if !a_finite || !b_finite || p.y == 0u || q.y == 0u {
        let none = package_lightshed_double__2double_is_nan(a) || package_lightshed_double__2double_is_nan(b) || (a_finite == b_finite && (!a_finite || p.y == q.y));
        let infinite = b_finite && (!a_finite || q.y == 0u);
        return select(vec2u(0u, sign | select(0u, package_lightshed_double_INFINITE, infinite)), package_lightshed_double_NAN, none);
    }
    var exponent = package_lightshed_double__1biased_exponent(a) - package_lightshed_double__1biased_exponent(b) + 1023;
    if package_lightshed_wide__1wide_less(p, q) {
        p = package_lightshed_wide__2wide_shift_left(p, 1u);
        exponent -= 1;
    }
    let scale = 262144.0 / (f32(q.y) * 4294967296.0 + f32(q.x));
    let first = package_lightshed_double__1eighteen_bits(package_lightshed_wide__1wide_subtract(p, q), q, scale);
    let second = package_lightshed_double__1eighteen_bits(first.xy, q, scale);
    let third = package_lightshed_double__1eighteen_bits(second.xy, q, scale);
    let quotient = vec2u(((second.z & 31u) << 27u) | (third.z << 9u) | select(0u, 1u, (third.x | third.y) != 0u), package_lightshed_double_SIGN | (first.z << 13u) | (second.z >> 5u));
    return package_lightshed_double_rounded(sign, exponent, quotient);
}

fn package_lightshed_double__1double_less(a: vec2u, b: vec2u) -> bool {
    if package_lightshed_double__2double_is_nan(a) || package_lightshed_double__2double_is_nan(b) || all(package_lightshed_double__1double_abs(a | b) == vec2u(0u)) {
        return false;
    }
    let a_negative = a.y >= package_lightshed_double_SIGN;
    let b_negative = b.y >= package_lightshed_double_SIGN;
    if a_negative != b_negative {
        return a_negative;
    }
    return select(package_lightshed_wide__1wide_less(a, b), package_lightshed_wide__1wide_less(b, a), a_negative);
}

fn package_lightshed_double__1double_multiply(a: vec2u, b: vec2u) -> vec2u {
    let sign = (a.y ^ b.y) & package_lightshed_double_SIGN;
    let p = package_lightshed_wide__2wide_shift_left(package_lightshed_double_significand(a), 11u);
    let q = package_lightshed_wide__2wide_shift_left(package_lightshed_double_significand(b), 11u);
    if !package_lightshed_double__2double_is_finite(a) || !package_lightshed_double__2double_is_finite(b) {
        let none = package_lightshed_double__2double_is_nan(a) || package_lightshed_double__2double_is_nan(b) || p.y == 0u || q.y == 0u;
        return select(vec2u(0u, sign | package_lightshed_double_INFINITE), package_lightshed_double_NAN, none);
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
    var exponent = package_lightshed_double__1biased_exponent(a) + package_lightshed_double__1biased_exponent(b) - 1022;
    if product.y < package_lightshed_double_SIGN {
        product = package_lightshed_wide__2wide_shift_left(product, 1u);
        exponent -= 1;
    }
    return package_lightshed_double_rounded(sign, exponent, vec2u(product.x | select(0u, 1u, rest), product.y));
}

fn package_lightshed_double__1double_negate(a: vec2u) -> vec2u {
    return a ^ vec2u(0u, package_lightshed_double_SIGN);
}

fn package_lightshed_double__1double_subtract(a: vec2u, b: vec2u) -> vec2u {
    return package_lightshed_double__1double_add(a, package_lightshed_double__1double_negate(b));
}

fn package_lightshed_double__1eighteen_bits(rest: vec2u, by: vec2u, scale: f32) -> vec3u {
    var bits = u32((f32(rest.y) * 4294967296.0 + f32(rest.x)) * scale);
    let taken = package_lightshed_wide__1wide_product(bits, by.x);
    var left = package_lightshed_wide__1wide_subtract(package_lightshed_wide__2wide_shift_left(rest, 18u), vec2u(taken.x, taken.y + bits * by.y));
    if left.y >= package_lightshed_double_SIGN {
        left = package_lightshed_wide__1wide_add(left, by);
        bits -= 1u;
    }
    else if !package_lightshed_wide__1wide_less(left, by) {
        left = package_lightshed_wide__1wide_subtract(left, by);
        bits += 1u;
    }
    return vec3u(left, bits);
}

fn package_lightshed_double__2double_from_f32(x: f32) -> vec2u {
    return package_lightshed_double__3double_from_f32_bits(bitcast<u32>(x));
}

fn package_lightshed_double__2double_is_finite(a: vec2u) -> bool {
    return (a.y & package_lightshed_double_INFINITE) != package_lightshed_double_INFINITE;
}

fn package_lightshed_double__2double_is_nan(a: vec2u) -> bool {
    return package_lightshed_wide__1wide_less(vec2u(0u, package_lightshed_double_INFINITE), package_lightshed_double__1double_abs(a));
}

fn package_lightshed_double__2double_to_u32(a: vec2u) -> u32 {
    let whole = package_lightshed_double__3double_to_wide_signed(a);
    if a.y >= package_lightshed_double_SIGN {
        return 0u;
    }
    return select(whole.x, 4294967295u, whole.y != 0u);
}

fn package_lightshed_double__3double_from_f32_bits(bits: u32) -> vec2u {
    let sign = bits & package_lightshed_double_SIGN;
    let exponent = (bits >> 23u) & 255u;
    let fraction = bits & 8388607u;
    if exponent == 255u {
        return select(vec2u(0u, sign | package_lightshed_double_INFINITE), package_lightshed_double_NAN, fraction != 0u);
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

fn package_lightshed_double__3double_to_wide_signed(a: vec2u) -> vec2u {
    let exponent = package_lightshed_double__1biased_exponent(a);
    let negative = a.y >= package_lightshed_double_SIGN;
    if package_lightshed_double__2double_is_nan(a) || exponent < 1023 {
        return vec2u(0u);
    }
    if exponent > 1085 {
        return select(vec2u(4294967295u, 2147483647u), vec2u(0u, package_lightshed_double_SIGN), negative);
    }
    let bits = package_lightshed_double_significand(a);
    let magnitude = select(package_lightshed_wide__2wide_shift_right(bits, u32(max(1075 - exponent, 0))), package_lightshed_wide__2wide_shift_left(bits, u32(max(exponent - 1075, 0))), exponent > 1075);
    return select(magnitude, package_lightshed_wide__1wide_negate(magnitude), negative);
}

fn package_lightshed_double_rounded(sign: u32, exponent: i32, bits: vec2u) -> vec2u {
    if exponent <= 0 {
        return vec2u(0u, sign);
    }
    if exponent >= 2047 {
        return vec2u(0u, sign | package_lightshed_double_INFINITE);
    }
    let rest = bits.x & 2047u;
    let kept = package_lightshed_wide__2wide_shift_right(bits, 11u);
    let up = rest > 1024u || (rest == 1024u && (kept.x & 1u) == 1u);
    let sum = package_lightshed_wide__1wide_add(vec2u(kept.x, kept.y + (u32(exponent - 1) << 20u)), vec2u(select(0u, 1u, up), 0u));
    return vec2u(sum.x, sum.y | sign);
}

fn package_lightshed_double_significand(a: vec2u) -> vec2u {
    let bits = vec2u(a.x, (a.y & 1048575u) | 1048576u);
    return select(bits, vec2u(0u), (a.y & package_lightshed_double_INFINITE) == 0u);
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;

fn package_lightshed_float__2as_it_is(x: f32) -> f32 {
    return min(x, package_lightshed_float__1F32_MAX);
}

fn package_lightshed_morton__1morton30_encode(cell: vec3u) -> u32 {
    let spread = package_lightshed_morton__1spread_10(cell);
    return spread.x | (spread.y << 1u) | (spread.z << 2u);
}

fn package_lightshed_morton__1morton63_encode(cell: vec3u) -> vec2u {
    let low = package_lightshed_morton__1morton30_encode(cell);
    let middle = package_lightshed_morton__1morton30_encode(cell >> vec3u(10u));
    let top = package_lightshed_morton__1morton30_encode((cell >> vec3u(20u)) & vec3u(1u));
    return vec2u(low | (middle << 30u), (middle >> 2u) | (top << 28u));
}

fn package_lightshed_morton__1spread_10(x: vec3u) -> vec3u {
    var y = x & vec3u(1023u);
    y = (y | (y << vec3u(16u))) & vec3u(50331903u);
    y = (y | (y << vec3u(8u))) & vec3u(50393103u);
    y = (y | (y << vec3u(4u))) & vec3u(51130563u);
    return (y | (y << vec3u(2u))) & vec3u(153391689u);
}

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
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
