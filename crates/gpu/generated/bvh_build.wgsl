// Linked from bvh_build.wesl.

struct Settings {
    count: u32,
    index_bits: u32,
    parts: u32,
    clustered: u32
}

struct Part {
    low: vec3u,
    wrong: u32,
    high: vec3u,
    padding: u32
}

struct Frame {
    center_low: vec3f,
    exponent: i32,
    scale: f32,
    wrong: u32,
    padding: u32,
    more_padding: u32
}

struct Node {
    low: vec3u,
    first: u32,
    high: vec3u,
    count: u32
}

@group(0) @binding(0)
var<storage, read> settings: Settings;

@group(0) @binding(1)
var<storage, read> bounds: array<u32>;

@group(0) @binding(2)
var<storage, read_write> parts: array<Part>;

@group(0) @binding(3)
var<storage, read_write> frame: Frame;

@group(0) @binding(4)
var<storage, read_write> codes: array<vec2u>;

@group(0) @binding(5)
var<storage, read_write> indices: array<u32>;

@group(0) @binding(6)
var<storage, read_write> ranges: array<vec2u>;

@group(0) @binding(7)
var<storage, read_write> parents: array<u32>;

@group(0) @binding(8)
var<storage, read_write> nodes: array<Node>;

@group(0) @binding(9)
var<storage, read_write> order: array<u32>;

@group(0) @binding(10)
var<storage, read_write> pyramid: array<u32>;

@group(0) @binding(11)
var<storage, read> level_below: u32;

@group(0) @binding(12)
var<storage, read> grouping: array<u32>;

const INFINITE: u32 = 2139095040u;

const NONE: u32 = 4294967295u;

const LARGEST: vec2u = vec2u(2684354560u, 1114446484u);

const SMALLEST: vec2u = vec2u(3758096384u, 1041313291u);

const DOUBLE_BIAS: i32 = 1023;

const ROUND: f32 = 8388608.0;

const CELLS: f32 = 2097151.0;

const CELL_MASK: u32 = 2097151u;

const MOST: u32 = 8u;

const STEP: u32 = 8u;

fn key_of(bits: u32) -> u32 {
    let number = select(bits, 0u, (bits << 1u) == 0u);
    return select(number | package_lightshed_double_SIGN, ~number, number >= package_lightshed_double_SIGN);
}

fn bits_of(key: u32) -> u32 {
    return select(~key, key ^ package_lightshed_double_SIGN, key >= package_lightshed_double_SIGN);
}

fn keys_of(number: vec3f) -> vec3u {
    let bits = bitcast<vec3u>(number);
    return vec3u(key_of(bits.x), key_of(bits.y), key_of(bits.z));
}

fn numbers_of(keys: vec3u) -> vec3f {
    return bitcast<vec3f>(vec3u(bits_of(keys.x), bits_of(keys.y), bits_of(keys.z)));
}

fn no_part() -> Part {
    return Part(vec3u(NONE), NONE, vec3u(0u), 0u);
}

fn both(a: Part, b: Part) -> Part {
    return Part(min(a.low, b.low), min(a.wrong, b.wrong), max(a.high, b.high), 0u);
}

var<workgroup> of_group: array<Part, 256>;

fn part_of_group(lane: u32, own: Part) -> Part {
    of_group[lane] = own;
    workgroupBarrier();
    for (var half = package_group_GROUP / 2u; half > 0u; half /= 2u) {
        if lane < half {
            of_group[lane] = both(of_group[lane], of_group[lane + half]);
        }
        workgroupBarrier();
    }
    return of_group[0];
}

fn part_of_all(lane: u32) -> Part {
    var own = no_part();
    for (var i = lane; i < settings.parts; i += package_group_GROUP) {
        own = both(own, parts[i]);
    }
    return part_of_group(lane, own);
}

fn corner_bits(box: u32, corner: u32) -> vec3u {
    let at = 6u * box + 3u * corner;
    return vec3u(bounds[at], bounds[at + 1u], bounds[at + 2u]);
}

fn keys_of_corner(box: u32, corner: u32) -> vec3u {
    let bits = corner_bits(box, corner);
    return vec3u(key_of(bits.x), key_of(bits.y), key_of(bits.z));
}

@compute @workgroup_size(256)
fn bound_parts(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u) {
    var own = no_part();
    for (var i = group.x * package_group_GROUP + lane; i < settings.count; i += settings.parts * package_group_GROUP) {
        let low = corner_bits(i, 0u);
        let high = corner_bits(i, 1u);
        let low_keys = keys_of_corner(i, 0u);
        let high_keys = keys_of_corner(i, 1u);
        let infinite = vec3u(INFINITE);
        let is_box = all((low & infinite) != infinite) && all((high & infinite) != infinite) && all(low_keys <= high_keys);
        own = both(own, Part(low_keys, select(i, NONE, is_box), high_keys, 0u));
    }
    let all = part_of_group(lane, own);
    if lane == 0u {
        parts[group.x] = all;
    }
}

fn exponent_of(a: vec2u) -> i32 {
    return i32((a.y >> 20u) & 2047u) - DOUBLE_BIAS;
}

fn scaling(low: vec3u, high: vec3u) -> i32 {
    var farthest = vec2u(0u);
    var extent = vec2u(0u);
    for (var axis = 0u; axis < 3u; axis++) {
        let a = package_lightshed_double__3double_from_f32_bits(bits_of(low[axis]));
        let b = package_lightshed_double__3double_from_f32_bits(bits_of(high[axis]));
        let length = package_lightshed_double__1double_subtract(b, a);
        if package_lightshed_double__1double_less(extent, length) {
            extent = length;
        }
        let a_size = vec2u(a.x, a.y & ~package_lightshed_double_SIGN);
        let b_size = vec2u(b.x, b.y & ~package_lightshed_double_SIGN);
        if package_lightshed_double__1double_less(farthest, a_size) {
            farthest = a_size;
        }
        if package_lightshed_double__1double_less(farthest, b_size) {
            farthest = b_size;
        }
    }
    let most = exponent_of(package_lightshed_double__1double_divide(LARGEST, farthest));
    if package_lightshed_double__1double_less(LARGEST, farthest) {
        return most;
    }
    if package_lightshed_double__1double_less(vec2u(0u), extent) && package_lightshed_double__1double_less(extent, SMALLEST) {
        return min(exponent_of(package_lightshed_double__1double_divide(package_lightshed_double_ONE, extent)), most);
    }
    return 0;
}

@compute @workgroup_size(256)
fn choose_scale(@builtin(local_invocation_index) lane: u32) {
    let all = part_of_all(lane);
    if lane == 0u {
        frame.exponent = scaling(all.low, all.high);
        frame.wrong = all.wrong;
    }
}

fn scaled(bits: u32) -> f32 {
    if frame.exponent == 0 {
        return bitcast<f32>(select(bits, 0u, (bits << 1u) == 0u));
    }
    let double = package_lightshed_double__3double_from_f32_bits(bits);
    if (double.y & ~package_lightshed_double_SIGN) == 0u {
        return 0.0;
    }
    return bitcast<f32>(package_lightshed_double__3double_to_f32_bits(vec2u(double.x, double.y + (u32(frame.exponent) << 20u))));
}

fn scaled_corner(box: u32, corner: u32) -> vec3f {
    let bits = corner_bits(box, corner);
    return vec3f(scaled(bits.x), scaled(bits.y), scaled(bits.z));
}

fn kept(x: vec3f) -> vec3f {
    return min(x, vec3f(package_lightshed_float__1F32_MAX));
}

fn doubled_center(box: u32) -> vec3f {
    return kept(scaled_corner(box, 0u) + scaled_corner(box, 1u));
}

@compute @workgroup_size(256)
fn center_parts(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u) {
    var own = no_part();
    for (var i = group.x * package_group_GROUP + lane; i < settings.count; i += settings.parts * package_group_GROUP) {
        let center = keys_of(doubled_center(i));
        own = both(own, Part(center, NONE, center, 0u));
    }
    let all = part_of_group(lane, own);
    if lane == 0u {
        parts[group.x] = all;
    }
}

@compute @workgroup_size(256)
fn choose_cells(@builtin(local_invocation_index) lane: u32) {
    let all = part_of_all(lane);
    if lane == 0u {
        let low = numbers_of(all.low);
        let lengths = numbers_of(all.high) - low;
        let extent = max(max(lengths.x, lengths.y), lengths.z);
        var scale = 0.0;
        if extent > 0.0 {
            scale = CELLS / extent;
        }
        frame.center_low = low;
        frame.scale = select(scale, 0.0, (bitcast<u32>(scale) & INFINITE) == INFINITE);
    }
}

@compute @workgroup_size(256)
fn encode(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    if i < settings.count {
        let place = kept((doubled_center(i) - frame.center_low) * frame.scale) + ROUND;
        let code = package_lightshed_morton__1morton63_encode(bitcast<vec3u>(place) & vec3u(CELL_MASK));
        codes[i] = package_lightshed_wide__2wide_shift_right(package_lightshed_wide__2wide_shift_left(code, 1u), settings.index_bits);
        indices[i] = i;
    }
}

fn agreeing(a: u32, b: i32) -> i32 {
    if b < 0 || b >= i32(settings.count) {
        return -1;
    }
    if settings.clustered == 1u && grouping[a] != grouping[u32(b)] {
        return -1;
    }
    let differ = codes[a] ^ codes[u32(b)];
    if any(differ != vec2u(0u)) {
        return i32(package_lightshed_wide__2wide_leading_zeros(differ));
    }
    return 64 + i32(countLeadingZeros(indices[a] ^ indices[u32(b)]));
}

@compute @workgroup_size(256)
fn divide(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    let inner = settings.count - 1u;
    if i > inner {
        return;
    }
    let at = i32(i);
    let is_last = agreeing(i, at + 1) < 0;
    if agreeing(i, at - 1) < 0 {
        parents[select(i, inner + i, is_last)] = NONE;
    }
    if is_last {
        return;
    }
    let step = select(-1, 1, agreeing(i, at + 1) > agreeing(i, at - 1));
    let least = agreeing(i, at - step);
    var most = 2;
    while (agreeing(i, at + most * step) > least) {
        most *= 2;
    }
    var length = 0;
    for (var by = most / 2; by > 0; by /= 2) {
        if agreeing(i, at + (length + by) * step) > least {
            length += by;
        }
    }
    let end = at + length * step;
    let agree = agreeing(i, end);
    var before = 0;
    for (var by = most / 2; by > 0; by /= 2) {
        if before + by < length && agreeing(i, at + (before + by) * step) > agree {
            before += by;
        }
    }
    let split = u32(at + before * step + min(step, 0));
    let first = u32(min(at, end));
    let last = u32(max(at, end));
    ranges[i] = vec2u(first, last);
    parents[select(split, inner + split, split == first)] = i;
    parents[select(split + 1u, inner + split + 1u, split + 1u == last)] = i;
}

fn range_of(group: u32) -> vec2u {
    let inner = settings.count - 1u;
    if group < inner {
        return ranges[group];
    }
    return vec2u(group - inner);
}

fn half_area(a_low: vec3f, a_high: vec3f, b_low: vec3f, b_high: vec3f) -> f32 {
    let d = min(a_low, b_low) + min(a_high, b_high);
    let sides = kept(d * d.yzx);
    return min(sides.x + sides.y, package_lightshed_float__1F32_MAX) + sides.z;
}

fn join_few(first: u32, count: u32, base: u32) {
    var lows: array<vec3f, 8>;
    var highs: array<vec3f, 8>;
    var node_of: array<u32, 8>;
    var halves: array<vec2u, 16>;
    var sizes: array<u32, 16>;
    for (var i = 0u; i < count; i++) {
        let box = indices[first + i];
        lows[i] = scaled_corner(box, 0u);
        highs[i] = -scaled_corner(box, 1u);
        node_of[i] = i;
        sizes[i] = 1u;
    }
    var present = (1u << count) - 1u;
    for (var joined = count; joined < 2u * count - 1u; joined++) {
        var least = 0.0;
        var low = NONE;
        var high = NONE;
        for (var i = 0u; i < count; i++) {
            if ((present >> i) & 1u) == 0u {
                continue;
            }
            for (var j = i + 1u; j < count; j++) {
                if ((present >> j) & 1u) == 0u {
                    continue;
                }
                let area = half_area(lows[i], highs[i], lows[j], highs[j]);
                if low == NONE || area < least {
                    least = area;
                    low = i;
                    high = j;
                }
            }
        }
        halves[joined] = vec2u(node_of[low], node_of[high]);
        sizes[joined] = sizes[node_of[low]] + sizes[node_of[high]];
        lows[low] = min(lows[low], lows[high]);
        highs[low] = min(highs[low], highs[high]);
        node_of[low] = joined;
        present &= ~(1u << high);
    }
    var waiting: array<u32, 16>;
    waiting[0] = 2u * count - 2u;
    var left = 1u;
    var node = base;
    var leaf = first;
    while (left > 0u) {
        left -= 1u;
        let part = waiting[left];
        nodes[node].first = leaf;
        nodes[node].count = sizes[part];
        node += 1u;
        if part < count {
            order[leaf] = indices[first + part];
            leaf += 1u;
        }
        else {
            waiting[left] = halves[part].y;
            waiting[left + 1u] = halves[part].x;
            left += 2u;
        }
    }
}

@compute @workgroup_size(256)
fn shape(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let own = package_group__1index_of(group, groups, lane);
    if own >= 2u * settings.count - 1u {
        return;
    }
    if own + 1u < settings.count && agreeing(own, i32(own) + 1) < 0 {
        return;
    }
    let range = range_of(own);
    let count = range.y - range.x + 1u;
    var parent = parents[own];
    if count <= MOST && parent != NONE {
        let above = ranges[parent];
        if above.y - above.x < MOST {
            return;
        }
    }
    var first = range.x;
    var turns_left = 0u;
    while (parent != NONE) {
        let above = ranges[parent].x;
        turns_left += select(0u, 1u, above == first);
        first = above;
        parent = parents[parent];
    }
    if settings.clustered == 1u {
        turns_left += grouping[settings.count + grouping[range.x]];
    }
    let base = 2u * range.x + turns_left;
    if count > MOST {
        nodes[base].first = range.x;
        nodes[base].count = count;
    }
    else {
        join_few(range.x, count, base);
    }
}

@compute @workgroup_size(256)
fn leaf_boxes(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    if i < settings.count {
        put_box(i, keys_of_corner(order[i], 0u), keys_of_corner(order[i], 1u));
    }
}

fn put_box(at: u32, low: vec3u, high: vec3u) {
    for (var axis = 0u; axis < 3u; axis++) {
        pyramid[6u * at + axis] = low[axis];
        pyramid[6u * at + 3u + axis] = high[axis];
    }
}

fn box_with(box: Part, at: u32) -> Part {
    let low = vec3u(pyramid[6u * at], pyramid[6u * at + 1u], pyramid[6u * at + 2u]);
    let high = vec3u(pyramid[6u * at + 3u], pyramid[6u * at + 4u], pyramid[6u * at + 5u]);
    return both(box, Part(low, NONE, high, 0u));
}

@compute @workgroup_size(256)
fn pyramid_level(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    var start = 0u;
    var below = settings.count;
    for (var level = 0u; level < level_below; level++) {
        start += below;
        below = (below + STEP - 1u) / STEP;
    }
    if below == 1u || STEP * i >= below {
        return;
    }
    var box = no_part();
    for (var k = STEP * i; k < min(STEP * (i + 1u), below); k++) {
        box = box_with(box, start + k);
    }
    put_box(start + below + i, box.low, box.high);
}

fn box_of_leaves(first: u32, end: u32) -> Part {
    var box = no_part();
    var left = first;
    var right = end;
    var start = 0u;
    var level = settings.count;
    while (left < right) {
        while (left < right && left % STEP != 0u) {
            box = box_with(box, start + left);
            left++;
        }
        while (left < right && right % STEP != 0u) {
            right--;
            box = box_with(box, start + right);
        }
        left /= STEP;
        right /= STEP;
        start += level;
        level = (level + STEP - 1u) / STEP;
    }
    return box;
}

@compute @workgroup_size(256)
fn fit(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    if i < 2u * settings.count - 1u {
        let box = box_of_leaves(nodes[i].first, nodes[i].first + nodes[i].count);
        nodes[i].low = vec3u(bits_of(box.low.x), bits_of(box.low.y), bits_of(box.low.z));
        nodes[i].high = vec3u(bits_of(box.high.x), bits_of(box.high.y), bits_of(box.high.z));
    }
}

const package_group_GROUP: u32 = 256u;

fn package_group__1index_of(group: vec3u, groups: vec3u, lane: u32) -> u32 {
    return (group.y * groups.x + group.x) * package_group_GROUP + lane;
}

const package_lightshed_double_INFINITE: u32 = 2146435072u;

const package_lightshed_double_NAN: vec2u = vec2u(0u, 2146959360u);

const package_lightshed_double_ONE: vec2u = vec2u(0u, 1072693248u);

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

fn package_lightshed_double__2double_is_finite(a: vec2u) -> bool {
    return (a.y & package_lightshed_double_INFINITE) != package_lightshed_double_INFINITE;
}

fn package_lightshed_double__2double_is_nan(a: vec2u) -> bool {
    return package_lightshed_wide__1wide_less(vec2u(0u, package_lightshed_double_INFINITE), package_lightshed_double__1double_abs(a));
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

fn package_lightshed_double__3double_to_f32_bits(a: vec2u) -> u32 {
    let sign = a.y & package_lightshed_double_SIGN;
    if !package_lightshed_double__2double_is_finite(a) {
        return select(sign | 2139095040u, 2143289344u, package_lightshed_double__2double_is_nan(a));
    }
    let exponent = package_lightshed_double__1biased_exponent(a) - 896;
    if exponent < -24 {
        return sign;
    }
    if exponent > 254 {
        return sign | 2139095040u;
    }
    let bits = package_lightshed_double_significand(a);
    let down = u32(select(29, 30 - exponent, exponent < 1));
    let kept = package_lightshed_wide__2wide_shift_right(bits, down).x;
    let rest = package_lightshed_wide__2wide_shift_left(bits, 64u - down);
    let half = vec2u(0u, package_lightshed_double_SIGN);
    let up = package_lightshed_wide__1wide_less(half, rest) || (all(rest == half) && (kept & 1u) == 1u);
    return sign | ((u32(max(exponent - 1, 0)) << 23u) + kept + select(0u, 1u, up));
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
