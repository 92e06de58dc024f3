// Linked from radix_sort.wesl.

struct Pass {
    count: u32,
    shift: u32,
    tiles: u32,
    padding: u32
}

@group(0) @binding(0)
var<storage, read> sorting: Pass;

@group(0) @binding(1)
var<storage, read> from_codes: array<vec2u>;

@group(0) @binding(2)
var<storage, read> from_indices: array<u32>;

@group(0) @binding(3)
var<storage, read_write> to_codes: array<vec2u>;

@group(0) @binding(4)
var<storage, read_write> to_indices: array<u32>;

@group(0) @binding(5)
var<storage, read_write> counts: array<u32>;

const EACH: u32 = 8u;

const DIGITS: u32 = 16u;

struct Counts {
    low: vec4u,
    high: vec4u
}

var<workgroup> sums: array<Counts, 256>;

fn digit_of(code: vec2u, shift: u32) -> u32 {
    return (select(code.x >> (shift & 31u), code.y >> (shift & 31u), shift > 31u)) & 15u;
}

fn one_at(digit: u32) -> Counts {
    let one = 1u << (16u * (digit & 1u));
    let word = digit / 2u;
    return Counts(select(vec4u(0u), vec4u(one), vec4u(0u, 1u, 2u, 3u) == vec4u(word)), select(vec4u(0u), vec4u(one), vec4u(4u, 5u, 6u, 7u) == vec4u(word)));
}

fn plus(a: Counts, b: Counts) -> Counts {
    return Counts(a.low + b.low, a.high + b.high);
}

fn count_of(counts: Counts, digit: u32) -> u32 {
    let word = digit / 2u;
    let both = select(counts.high[word & 3u], counts.low[word & 3u], word < 4u);
    return (both >> (16u * (digit & 1u))) & 65535u;
}

fn scan(lane: u32, own: Counts) -> Counts {
    sums[lane] = own;
    workgroupBarrier();
    for (var step = 1u; step < package_group_GROUP; step *= 2u) {
        var sum = sums[lane];
        if lane >= step {
            sum = plus(sum, sums[lane - step]);
        }
        workgroupBarrier();
        sums[lane] = sum;
        workgroupBarrier();
    }
    return sums[lane];
}

@compute @workgroup_size(256)
fn count_digits(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let tile = group.y * groups.x + group.x;
    var own = Counts();
    for (var k = 0u; k < EACH; k++) {
        let i = (tile * package_group_GROUP + lane) * EACH + k;
        if i < sorting.count {
            own = plus(own, one_at(digit_of(from_codes[i], sorting.shift)));
        }
    }
    sums[lane] = own;
    workgroupBarrier();
    for (var half = package_group_GROUP / 2u; half > 0u; half /= 2u) {
        if lane < half {
            sums[lane] = plus(sums[lane], sums[lane + half]);
        }
        workgroupBarrier();
    }
    if lane < DIGITS && tile < sorting.tiles {
        counts[lane * sorting.tiles + tile] = count_of(sums[0], lane);
    }
}

@compute @workgroup_size(256)
fn scan_counts(@builtin(local_invocation_index) lane: u32) {
    let total = DIGITS * sorting.tiles;
    let each = (total + package_group_GROUP - 1u) / package_group_GROUP;
    let first = lane * each;
    let end = min(first + each, total);
    var own = 0u;
    for (var i = first; i < end; i++) {
        own += counts[i];
    }
    var before = package_group__2sum_up_to(lane, own) - own;
    for (var i = first; i < end; i++) {
        let count = counts[i];
        counts[i] = before;
        before += count;
    }
}

@compute @workgroup_size(256)
fn move_codes(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let tile = group.y * groups.x + group.x;
    let first = (tile * package_group_GROUP + lane) * EACH;
    var own = Counts();
    for (var k = 0u; k < EACH; k++) {
        if first + k < sorting.count {
            own = plus(own, one_at(digit_of(from_codes[first + k], sorting.shift)));
        }
    }
    let through = scan(lane, own);
    var before = Counts(through.low - own.low, through.high - own.high);
    for (var k = 0u; k < EACH; k++) {
        if first + k < sorting.count {
            let code = from_codes[first + k];
            let digit = digit_of(code, sorting.shift);
            let to = counts[digit * sorting.tiles + tile] + count_of(before, digit);
            to_codes[to] = code;
            to_indices[to] = from_indices[first + k];
            before = plus(before, one_at(digit));
        }
    }
}

const package_group_GROUP: u32 = 256u;

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
