// Linked from bvh_subset.wesl.

struct Drawing {
    strata: u32,
    cluster: u32,
    window: u32,
    chunks: u32,
    stratum: vec2u,
    all_uniform: vec2u,
    uniform: vec2u,
    by_weight: vec2u,
    offset: vec2u,
    padding: vec2u,
    ends: array<vec2u, 128>
}

struct Drawn {
    clamp: vec2u,
    uniform: vec2u,
    by_weight: vec2u,
    clusters: u32,
    padding: u32
}

@group(1) @binding(0)
var<storage, read> drawing: Drawing;

@group(1) @binding(1)
var<storage, read_write> drawn: Drawn;

@group(1) @binding(2)
var<storage, read_write> subset_settings: package__1bvh_build_Settings;

@group(1) @binding(3)
var<storage, read_write> weights: array<u32>;

@group(1) @binding(4)
var<storage, read_write> bins: array<atomic<u32>>;

@group(1) @binding(5)
var<storage, read_write> sums: array<vec2u>;

@group(1) @binding(6)
var<storage, read_write> picked: array<u32>;

@group(1) @binding(7)
var<storage, read_write> places: array<u32>;

@group(1) @binding(8)
var<storage, read_write> subset_codes: array<vec2u>;

@group(1) @binding(9)
var<storage, read_write> subset_indices: array<u32>;

@group(1) @binding(10)
var<storage, read_write> subset_nodes: array<package__1bvh_build_Node>;

@group(1) @binding(11)
var<storage, read_write> subset_order: array<u32>;

@group(1) @binding(12)
var<storage, read_write> subset_parents: array<u32>;

@group(1) @binding(13)
var<storage, read_write> clusters: array<u32>;

@group(1) @binding(14)
var<storage, read_write> keys: array<vec2u>;

@group(1) @binding(15)
var<storage, read_write> key_places: array<u32>;

@group(1) @binding(16)
var<storage, read_write> cluster_codes: array<vec2u>;

@group(1) @binding(17)
var<storage, read_write> cluster_boxes: array<u32>;

@group(1) @binding(18)
var<storage, read_write> clustered: array<u32>;

@group(1) @binding(19)
var<storage, read_write> tree_nodes: array<package__1bvh_build_Node>;

const BINS: u32 = 128u;

const OFFSET: i32 = 64;

const CHUNK: u32 = 8192u;

var<workgroup> of_group: array<atomic<u32>, 128>;

@compute @workgroup_size(256)
fn weigh(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    if lane < BINS {
        atomicStore(&of_group[lane], 0u);
    }
    workgroupBarrier();
    if i < package__1bvh_build_settings.count {
        let box = package__1bvh_build_indices[i];
        let d = package__1bvh_build_kept(package__1bvh_build__1scaled_corner(box, 0u) - package__1bvh_build__1scaled_corner(box, 1u));
        let squares = package__1bvh_build_kept(d * d);
        let bits = bitcast<u32>(min(squares.x + squares.y, package_lightshed_float__1F32_MAX) + squares.z);
        weights[i] = bits;
        let bin = clamp(i32(bits >> 23u) - 127 + OFFSET, 0, i32(BINS) - 1);
        atomicAdd(&of_group[bin], 1u);
    }
    workgroupBarrier();
    if lane < BINS {
        let own = atomicLoad(&of_group[lane]);
        if own > 0u {
            atomicAdd(&bins[lane], own);
        }
    }
}

@compute @workgroup_size(1)
fn choose_clamp() {
    var below = package_lightshed_double_ZERO;
    var above = package__1bvh_build_settings.count;
    drawn.clamp = vec2u(0u, 2146435072u);
    for (var bin = 0u; bin < BINS; bin++) {
        let end = drawing.ends[bin];
        let count = atomicLoad(&bins[bin]);
        let all = package_lightshed_double__1double_add(below, package_lightshed_double__1double_multiply(end, package_lightshed_double__2double_from_u32(above)));
        if !package_lightshed_double__1double_less(end, package_lightshed_double__1double_multiply(drawing.stratum, all)) {
            drawn.clamp = end;
            break;
        }
        below = package_lightshed_double__1double_add(below, package_lightshed_double__1double_multiply(package_lightshed_double__2double_from_u32(count), end));
        above -= count;
    }
}

fn clamped(i: u32) -> vec2u {
    let weight = package_lightshed_double__2double_from_f32(sqrt(bitcast<f32>(weights[i])));
    return select(weight, drawn.clamp, package_lightshed_double__1double_less(drawn.clamp, weight));
}

var<workgroup> row_sums: array<vec2u, 256>;

var<workgroup> row_points: array<u32, 256>;

fn add_in_order(before: vec2u, count: u32) -> vec2u {
    var sum = before;
    for (var k = 0u; k < count; k++) {
        sum = package_lightshed_double__2double_add_positive(sum, row_sums[k]);
        row_sums[k] = sum;
    }
    return sum;
}

fn row_length(first: u32, end: u32) -> u32 {
    return min(max(end, first) - first, package_group_GROUP);
}

@compute @workgroup_size(256)
fn sum_chunks(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let chunk = group.y * groups.x + group.x;
    let end = min((chunk + 1u) * CHUNK, package__1bvh_build_settings.count);
    var sum = package_lightshed_double_ZERO;
    for (var row = 0u; row < CHUNK; row += package_group_GROUP) {
        let first = chunk * CHUNK + row;
        let length = row_length(first, end);
        if lane < length {
            row_sums[lane] = clamped(first + lane);
        }
        workgroupBarrier();
        if lane == 0u {
            sum = add_in_order(sum, length);
        }
        workgroupBarrier();
    }
    if lane == 0u && chunk < drawing.chunks {
        sums[chunk] = sum;
    }
}

@compute @workgroup_size(1)
fn sum_all() {
    var all = package_lightshed_double_ZERO;
    for (var chunk = 0u; chunk < drawing.chunks; chunk++) {
        let own = sums[chunk];
        sums[chunk] = all;
        all = package_lightshed_double__1double_add(all, own);
    }
    let some = package_lightshed_double__1double_less(package_lightshed_double_ZERO, all) && package_lightshed_double__2double_is_finite(all);
    drawn.uniform = select(drawing.all_uniform, drawing.uniform, some);
    drawn.by_weight = select(package_lightshed_double_ZERO, package_lightshed_double__1double_divide(drawing.by_weight, all), some);
}

fn stratum_of(i: u32, sum: vec2u) -> vec2u {
    let uniform = package_lightshed_double__1double_multiply(package_lightshed_double__2double_from_u32(i), drawn.uniform);
    return package_lightshed_double__1double_subtract(package_lightshed_double__1double_add(uniform, package_lightshed_double__1double_multiply(sum, drawn.by_weight)), drawing.offset);
}

fn points_before(place: vec2u) -> u32 {
    let whole = package_lightshed_double__2double_to_u32(place);
    return whole + select(0u, 1u, package_lightshed_double__1double_less(package_lightshed_double__2double_from_u32(whole), place));
}

fn points_of_chunks_up_to(chunk: u32, end: u32) -> u32 {
    if chunk + 1u < drawing.chunks {
        return points_before(stratum_of(end, sums[chunk + 1u]));
    }
    return drawing.strata;
}

@compute @workgroup_size(256)
fn choose(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let chunk = group.y * groups.x + group.x;
    let start = chunk * CHUNK;
    let end = min(start + CHUNK, package__1bvh_build_settings.count);
    var sum = package_lightshed_double_ZERO;
    var points = 0u;
    var count = 0u;
    if lane == 0u && chunk < drawing.chunks {
        sum = sums[chunk];
        points = points_before(stratum_of(start, sum));
    }
    for (var row = 0u; row < CHUNK; row += package_group_GROUP) {
        let first = start + row;
        let length = row_length(first, end);
        let own = first + lane;
        if lane < length {
            row_sums[lane] = clamped(own);
        }
        workgroupBarrier();
        if lane == 0u {
            sum = add_in_order(sum, length);
        }
        workgroupBarrier();
        if lane < length {
            if own + 1u < end {
                row_points[lane] = points_before(stratum_of(own + 1u, row_sums[lane]));
            }
            else {
                row_points[lane] = points_of_chunks_up_to(chunk, end);
            }
        }
        workgroupBarrier();
        if lane == 0u {
            for (var k = 0u; k < length; k++) {
                let i = first + k;
                let next = row_points[k];
                if next > points {
                    picked[start + count] = i;
                    count += 1u;
                }
                points = max(next, points);
            }
        }
    }
    if lane == 0u && chunk < drawing.chunks {
        picked[package__1bvh_build_settings.count + chunk] = count;
    }
}

@compute @workgroup_size(256)
fn count_drawn(@builtin(local_invocation_index) lane: u32) {
    let each = (drawing.chunks + package_group_GROUP - 1u) / package_group_GROUP;
    let first = lane * each;
    let end = min(first + each, drawing.chunks);
    var own = 0u;
    for (var chunk = first; chunk < end; chunk++) {
        own += picked[package__1bvh_build_settings.count + chunk];
    }
    let up_to = package_group__2sum_up_to(lane, own);
    var before = up_to - own;
    for (var chunk = first; chunk < end; chunk++) {
        let count = picked[package__1bvh_build_settings.count + chunk];
        picked[package__1bvh_build_settings.count + drawing.chunks + chunk] = before;
        before += count;
    }
    if lane == package_group_GROUP - 1u {
        subset_settings = package__1bvh_build_Settings(up_to, package__1bvh_build_settings.index_bits, 0u, 0u);
    }
}

@compute @workgroup_size(256)
fn gather(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    let chunk = i / CHUNK;
    if i < package__1bvh_build_settings.count && i % CHUNK < picked[package__1bvh_build_settings.count + chunk] {
        let number = picked[package__1bvh_build_settings.count + drawing.chunks + chunk] + i % CHUNK;
        let place = picked[i];
        places[number] = place;
        subset_codes[number] = package__1bvh_build_codes[place];
        subset_indices[number] = package__1bvh_build_indices[place];
        weights[package__1bvh_build_indices[place]] = number;
    }
}

@compute @workgroup_size(256)
fn find_clusters(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let leaf = package_group__1index_of(group, groups, lane);
    if leaf >= subset_settings.count {
        return;
    }
    var node = 0u;
    while (subset_nodes[node].count > drawing.cluster) {
        let low = subset_nodes[node + 1u];
        node += select(1u, 2u * low.count, leaf >= low.first + low.count);
    }
    clusters[leaf] = node;
}

fn begins_cluster(leaf: u32) -> bool {
    return subset_nodes[clusters[leaf]].first == leaf;
}

@compute @workgroup_size(256)
fn number_clusters(@builtin(local_invocation_index) lane: u32) {
    let count = subset_settings.count;
    let strata = drawing.strata;
    let each = (count + package_group_GROUP - 1u) / package_group_GROUP;
    let first = lane * each;
    let end = min(first + each, count);
    var own = 0u;
    for (var leaf = first; leaf < end; leaf++) {
        own += select(0u, 1u, begins_cluster(leaf));
    }
    let up_to = package_group__2sum_up_to(lane, own);
    var number = up_to - own;
    for (var leaf = first; leaf < end; leaf++) {
        let node = clusters[leaf];
        if begins_cluster(leaf) {
            clusters[2u * strata + number] = node;
            clustered[package__1bvh_build_settings.count + number] = node - 2u * leaf;
            number += 1u;
        }
        clusters[leaf] = number - 1u;
        clusters[strata + weights[subset_order[leaf]]] = number - 1u;
    }
    if lane == package_group_GROUP - 1u {
        drawn.clusters = up_to;
    }
}

@compute @workgroup_size(256)
fn link_parents(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let node = package_group__1index_of(group, groups, lane);
    if node == 0u {
        subset_parents[0] = package__1bvh_build_NONE;
    }
    if node < 2u * subset_settings.count - 1u && subset_nodes[node].count > drawing.cluster {
        subset_parents[node + 1u] = node;
        subset_parents[node + 2u * subset_nodes[node + 1u].count] = node;
    }
}

struct Corners {
    low: vec3f,
    high: vec3f
}

fn corners_of_box(box: u32) -> Corners {
    return Corners(package__1bvh_build__1scaled_corner(box, 0u), -package__1bvh_build__1scaled_corner(box, 1u));
}

fn corners_of_node(node: u32) -> Corners {
    let low = subset_nodes[node].low;
    let high = subset_nodes[node].high;
    return Corners(vec3f(package__1bvh_build_scaled(low.x), package__1bvh_build_scaled(low.y), package__1bvh_build_scaled(low.z)), -vec3f(package__1bvh_build_scaled(high.x), package__1bvh_build_scaled(high.y), package__1bvh_build_scaled(high.z)));
}

fn area_with(own: Corners, other: Corners) -> f32 {
    return package_lightshed_float__2as_it_is(package__1bvh_build__1half_area(own.low, own.high, other.low, other.high));
}

fn cost_of(box: Corners, cluster: u32, limit: f32) -> f32 {
    var own = corners_of_node(cluster);
    let count = subset_nodes[cluster].count;
    let grown = package_lightshed_float__2as_it_is(area_with(own, box) * f32(count + 1u));
    var cost = package_lightshed_float__2as_it_is(grown - package_lightshed_float__2as_it_is(area_with(own, own) * f32(count)));
    var node = subset_parents[cluster];
    while (node != package__1bvh_build_NONE && cost <= limit) {
        own = corners_of_node(node);
        if all(own.low <= box.low) && all(own.high <= box.high) {
            break;
        }
        cost = package_lightshed_float__2as_it_is(cost + package_lightshed_float__2as_it_is(area_with(own, box) - area_with(own, own)));
        node = subset_parents[node];
    }
    return cost;
}

@compute @workgroup_size(256)
fn insert(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    if i >= package__1bvh_build_settings.count {
        return;
    }
    let count = subset_settings.count;
    let strata = drawing.strata;
    var next = 0u;
    var end = count;
    while (next < end) {
        let middle = next + (end - next) / 2u;
        if places[middle] < i {
            next = middle + 1u;
        }
        else {
            end = middle;
        }
    }
    var best = package__1bvh_build_NONE;
    if next < count && places[next] == i {
        best = clusters[strata + next];
    }
    else {
        let box = corners_of_box(package__1bvh_build_indices[i]);
        var least = package_lightshed_float__1F32_MAX;
        for (var at = next - min(next, drawing.window); at < min(next + drawing.window, count); at++) {
            let cluster = clusters[strata + at];
            if cluster == best {
                continue;
            }
            let cost = cost_of(box, clusters[2u * strata + cluster], least);
            if cost < least || best == package__1bvh_build_NONE {
                least = cost;
                best = cluster;
            }
        }
    }
    keys[i] = vec2u(best, 0u);
    key_places[i] = i;
}

@compute @workgroup_size(256)
fn take_clusters(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    if i >= package__1bvh_build_settings.count {
        return;
    }
    let cluster = keys[i].x;
    let place = key_places[i];
    cluster_codes[i] = package__1bvh_build_codes[place];
    cluster_boxes[i] = package__1bvh_build_indices[place];
    clustered[i] = cluster;
    let starts = 3u * drawing.strata;
    if i == 0u || keys[i - 1u].x != cluster {
        clusters[starts + cluster] = i;
    }
    if i + 1u == package__1bvh_build_settings.count {
        clusters[starts + cluster + 1u] = package__1bvh_build_settings.count;
    }
}

@compute @workgroup_size(256)
fn place_upper(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let node = package_group__1index_of(group, groups, lane);
    if node >= 2u * subset_settings.count - 1u || subset_nodes[node].count <= drawing.cluster {
        return;
    }
    let starts = 3u * drawing.strata;
    let leaf = subset_nodes[node].first;
    let first = clusters[starts + clusters[leaf]];
    let end = clusters[starts + clusters[leaf + subset_nodes[node].count - 1u] + 1u];
    let at = 2u * first + node - 2u * leaf;
    tree_nodes[at].first = first;
    tree_nodes[at].count = end - first;
}

struct package__1bvh_build_Frame {
    center_low: vec3f,
    exponent: i32,
    scale: f32,
    wrong: u32,
    padding: u32,
    more_padding: u32
}

const package__1bvh_build_NONE: u32 = 4294967295u;

struct package__1bvh_build_Node {
    low: vec3u,
    first: u32,
    high: vec3u,
    count: u32
}

struct package__1bvh_build_Settings {
    count: u32,
    index_bits: u32,
    parts: u32,
    clustered: u32
}

fn package__1bvh_build__1corner_bits(box: u32, corner: u32) -> vec3u {
    let at = 6u * box + 3u * corner;
    return vec3u(package__1bvh_build_bounds[at], package__1bvh_build_bounds[at + 1u], package__1bvh_build_bounds[at + 2u]);
}

fn package__1bvh_build__1half_area(a_low: vec3f, a_high: vec3f, b_low: vec3f, b_high: vec3f) -> f32 {
    let d = min(a_low, b_low) + min(a_high, b_high);
    let sides = package__1bvh_build_kept(d * d.yzx);
    return min(sides.x + sides.y, package_lightshed_float__1F32_MAX) + sides.z;
}

fn package__1bvh_build__1scaled_corner(box: u32, corner: u32) -> vec3f {
    let bits = package__1bvh_build__1corner_bits(box, corner);
    return vec3f(package__1bvh_build_scaled(bits.x), package__1bvh_build_scaled(bits.y), package__1bvh_build_scaled(bits.z));
}

@group(0) @binding(1)
var<storage, read> package__1bvh_build_bounds: array<u32>;

@group(0) @binding(4)
var<storage, read_write> package__1bvh_build_codes: array<vec2u>;

@group(0) @binding(3)
var<storage, read_write> package__1bvh_build_frame: package__1bvh_build_Frame;

@group(0) @binding(5)
var<storage, read_write> package__1bvh_build_indices: array<u32>;

fn package__1bvh_build_kept(x: vec3f) -> vec3f {
    return min(x, vec3f(package_lightshed_float__1F32_MAX));
}

fn package__1bvh_build_scaled(bits: u32) -> f32 {
    if package__1bvh_build_frame.exponent == 0 {
        return bitcast<f32>(select(bits, 0u, (bits << 1u) == 0u));
    }
    let double = package_lightshed_double__3double_from_f32_bits(bits);
    if (double.y & ~package_lightshed_double_SIGN) == 0u {
        return 0.0;
    }
    return bitcast<f32>(package_lightshed_double__3double_to_f32_bits(vec2u(double.x, double.y + (u32(package__1bvh_build_frame.exponent) << 20u))));
}

@group(0) @binding(0)
var<storage, read> package__1bvh_build_settings: package__1bvh_build_Settings;

const package_group_GROUP: u32 = 256u;

fn package_group__1index_of(group: vec3u, groups: vec3u, lane: u32) -> u32 {
    return (group.y * groups.x + group.x) * package_group_GROUP + lane;
}

fn package_group__2sum_up_to(lane: u32, own: u32) -> u32 {
    package_group_parts[lane] = own;
    workgroupBarrier();
    for (var step = 1u; step < package_group_GROUP; step *= 2u) {
        var sum = package_group_parts[lane];
        if lane >= step {
            sum += package_group_parts[lane - step];
        }
        workgroupBarrier();
        package_group_parts[lane] = sum;
        workgroupBarrier();
    }
    return package_group_parts[lane];
}

var<workgroup> package_group_parts: array<u32, 256>;

const package_lightshed_double_INFINITE: u32 = 2146435072u;

const package_lightshed_double_NAN: vec2u = vec2u(0u, 2146959360u);

const package_lightshed_double_SIGN: u32 = 2147483648u;

const package_lightshed_double_ZERO: vec2u = vec2u(0u, 0u);

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

fn package_lightshed_double__2double_add_positive(a: vec2u, b: vec2u) -> vec2u {
    let exchanged = package_lightshed_wide__1wide_less(a, b);
    let large = select(a, b, exchanged);
    let small = select(b, a, exchanged);
    let exponent = large.y >> 20u;
    let apart = exponent - (small.y >> 20u);
    if apart > 31u || exponent > 2045u || small.y < 1048576u {
        return package_lightshed_double__1double_add(a, b);
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

fn package_lightshed_double__2double_from_f32(x: f32) -> vec2u {
    return package_lightshed_double__3double_from_f32_bits(bitcast<u32>(x));
}

fn package_lightshed_double__2double_from_u32(a: u32) -> vec2u {
    return package_lightshed_double__2double_from_wide(vec2u(a, 0u));
}

fn package_lightshed_double__2double_from_wide(a: vec2u) -> vec2u {
    let zeros = package_lightshed_wide__2wide_leading_zeros(a);
    if zeros == 64u {
        return package_lightshed_double_ZERO;
    }
    return package_lightshed_double_rounded(0u, 1086 - i32(zeros), package_lightshed_wide__2wide_shift_left(a, zeros));
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
