// Linked from quadtree_learn.wesl.

struct Learning {
    samples: u32,
    regions: u32,
    tree_words: u32,
    stride: u32,
    least_samples: u32,
    eagerness: f32,
    by_variance: u32,
    of_scattering: f32,
    of_tree: f32,
    padding0: u32,
    padding1: u32,
    padding3: u32,
    prior: vec2u,
    even_scattering: vec2u,
    even_tree: vec2u,
    padding2: vec2u
}

struct LearningRegion {
    pivot: vec3f,
    side: f32,
    first: u32,
    samples: u32,
    record: u32,
    padding: u32
}

struct TrainingSample {
    position: vec3f,
    code: u32,
    weight: f32,
    pdf: f32,
    scattering_pdf: f32,
    distance: f32
}

@group(0) @binding(0)
var<storage, read> learning: Learning;

@group(0) @binding(1)
var<storage, read> learning_regions: array<LearningRegion>;

@group(0) @binding(2)
var<storage, read> training: array<TrainingSample>;

@group(0) @binding(3)
var<storage, read_write> codes: array<vec2u>;

@group(0) @binding(4)
var<storage, read_write> indices: array<u32>;

@group(0) @binding(5)
var<storage, read_write> learning_samples: array<vec4u>;

@group(0) @binding(6)
var<storage, read_write> learning_nodes: array<vec4u>;

@group(0) @binding(7)
var<storage, read_write> records: array<u32>;

@group(0) @binding(8)
var<storage, read_write> totals: array<vec2u>;

@group(0) @binding(9)
var<storage, read> moves: u32;

const SCALE: vec2u = vec2u(0u, 1106247680u);

const MOST_ENERGY: f32 = 1.8446743e19;

fn load_learning_word(index: u32) -> u32 {
    return records[index];
}

fn store_learning_word(index: u32, word: u32) {
    records[index] = word;
}

fn load_learning_sample(index: u32) -> vec4u {
    return learning_samples[index];
}

fn load_learning_node(index: u32) -> vec4u {
    return learning_nodes[index];
}

fn store_learning_node(index: u32, node: vec4u) {
    learning_nodes[index] = node;
}

@compute @workgroup_size(256)
fn learn_parallax(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let own = package_group__1index_of(group, groups, lane);
    if own >= learning.regions || learning.stride == learning.tree_words {
        return;
    }
    let region = learning_regions[own];
    if region.samples == 0u {
        return;
    }
    let end = region.first + region.samples;
    var largest = 0.0;
    for (var i = region.first; i < end; i++) {
        largest = max(largest, training[i].weight);
    }
    let side = package_lightshed_double__2double_from_f32(region.side);
    var sum = vec2u(0u);
    var total = vec2u(0u);
    for (var i = region.first; i < end; i++) {
        let weight = package_lightshed_double__2double_from_f32(training[i].weight / largest);
        var nearness = package_lightshed_double__1double_divide(side, package_lightshed_double__2double_from_f32(training[i].distance));
        if package_lightshed_double__1double_less(package_lightshed_double_ONE, nearness) {
            nearness = package_lightshed_double_ONE;
        }
        total = package_lightshed_wide__1wide_add(total, package_lightshed_double__3double_to_wide_signed(package_lightshed_double__1double_multiply(weight, SCALE)));
        sum = package_lightshed_wide__1wide_add(sum, package_lightshed_double__3double_to_wide_signed(package_lightshed_double__1double_multiply(package_lightshed_double__1double_multiply(weight, nearness), SCALE)));
    }
    var inverse = package_lightshed_double_ZERO;
    if any(total != vec2u(0u)) {
        inverse = package_lightshed_double__1double_divide(package_lightshed_double__2double_from_wide(sum), package_lightshed_double__1double_multiply(package_lightshed_double__2double_from_wide(total), side));
    }
    let word = region.record * learning.stride + learning.tree_words;
    records[word] = bitcast<u32>(region.pivot.x);
    records[word + 1u] = bitcast<u32>(region.pivot.y);
    records[word + 2u] = bitcast<u32>(region.pivot.z);
    records[word + 3u] = select(0u, bitcast<u32>(package_lightshed_double__2double_to_f32(inverse)), package_lightshed_double__2double_is_finite(inverse));
}

fn region_of(sample: u32) -> u32 {
    var low = 0u;
    var high = learning.regions;
    while (low + 1u < high) {
        let middle = low + (high - low) / 2u;
        if learning_regions[middle].first <= sample {
            low = middle;
        }
        else {
            high = middle;
        }
    }
    return low;
}

fn gather_16(x: vec2u) -> vec2u {
    var y = x & vec2u(1431655765u);
    y = (y | (y >> vec2u(1u))) & vec2u(858993459u);
    y = (y | (y >> vec2u(2u))) & vec2u(252645135u);
    y = (y | (y >> vec2u(4u))) & vec2u(16711935u);
    return (y | (y >> vec2u(8u))) & vec2u(65535u);
}

fn direction_of_code(code: u32) -> vec3f {
    let cell = vec2f(gather_16(vec2u(code, code >> 1u)));
    return package_lightshed_octahedral__1octahedral_decode((cell + 0.5) / 65536.0);
}

fn from_pivot(i: u32, region: u32) -> package_lightshed_parallax_FromPivot {
    let direction = direction_of_code(training[i].code);
    if learning.stride == learning.tree_words {
        return package_lightshed_parallax__2parallax_at_pivot(vec3f(0.0), direction);
    }
    let word = learning_regions[region].record * learning.stride + learning.tree_words;
    let pivot = bitcast<vec3f>(vec3u(records[word], records[word + 1u], records[word + 2u]));
    let inverse = bitcast<f32>(records[word + 3u]);
    return package_lightshed_parallax__2parallax_at_pivot(package_lightshed_parallax__1parallax_offset(pivot, inverse, training[i].position), direction);
}

@compute @workgroup_size(256)
fn encode(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    if i >= learning.samples {
        return;
    }
    let region = region_of(i);
    var code = training[i].code;
    if learning.by_variance == 1u {
        code = package_lightshed_quadtree__1quadtree_code(package_lightshed_octahedral__1octahedral_encode(from_pivot(i, region).direction));
    }
    codes[i] = vec2u(code, region);
    indices[i] = i;
}

fn factor_of(i: u32, region: u32) -> f32 {
    let seen = from_pivot(i, region);
    return seen.factor * package_lightshed_octahedral__3octahedral_to_solid_angle(1.0, seen.direction);
}

fn rest_of(i: u32, region: u32) -> vec4u {
    let sample = training[i];
    let weight = bitcast<u32>(sample.weight);
    if learning.by_variance == 0u {
        return vec4u(weight, 0u, 0u, 0u);
    }
    let densities = bitcast<vec2u>(vec2f(sample.pdf, sample.scattering_pdf));
    return vec4u(weight, densities, bitcast<u32>(factor_of(i, region)));
}

fn comes_before(a: vec4u, b: vec4u) -> bool {
    if a.x != b.x {
        return a.x < b.x;
    }
    if a.y != b.y {
        return a.y < b.y;
    }
    if a.z != b.z {
        return a.z < b.z;
    }
    return a.w < b.w;
}

@compute @workgroup_size(256)
fn order_equal(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let start = package_group__1index_of(group, groups, lane);
    if start >= learning.samples || (start > 0u && all(codes[start - 1u] == codes[start])) {
        return;
    }
    let region = codes[start].y;
    for (var end = start + 1u; end < learning.samples && all(codes[end] == codes[start]); end++) {
        let own = indices[end];
        let rest = rest_of(own, region);
        var place = end;
        while (place > start && comes_before(rest, rest_of(indices[place - 1u], region))) {
            indices[place] = indices[place - 1u];
            place--;
        }
        indices[place] = own;
    }
}

@compute @workgroup_size(256)
fn prepare(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    if i >= learning.samples {
        return;
    }
    let sample = training[indices[i]];
    var row = vec4u(codes[i].x, bitcast<u32>(sample.weight), 0u, 0u);
    if learning.by_variance == 1u {
        let energy = min(sample.weight * sample.weight * sample.pdf, MOST_ENERGY);
        let factor = learning.of_tree * factor_of(indices[i], codes[i].y);
        let rest = vec3f(energy, learning.of_scattering * sample.scattering_pdf, factor);
        row = vec4u(codes[i].x, bitcast<vec3u>(rest));
    }
    learning_samples[i] = row;
}

fn learning_of(own: u32) -> package_lightshed__1quadtree_learning_QuadtreeLearning {
    let region = learning_regions[own];
    return package_lightshed__1quadtree_learning_QuadtreeLearning(region.record * learning.stride, learning.tree_words, region.first, region.samples, own * 32u * learning.tree_words, learning.least_samples, learning.eagerness, learning.by_variance == 1u, totals[own], learning.prior, learning.even_scattering, learning.even_tree);
}

@compute @workgroup_size(256)
fn load_nodes(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let own = package_group__1index_of(group, groups, lane);
    if own >= learning.regions {
        return;
    }
    let region = learning_regions[own];
    var total = package_lightshed_double_ZERO;
    for (var i = region.first; i < region.first + region.samples; i++) {
        let row = learning_samples[i];
        if learning.by_variance == 0u {
            learning_samples[i] = vec4u(row.x, total, 0u);
        }
        total = package_lightshed_double__1double_add(total, package_lightshed_double__2double_from_f32(bitcast<f32>(row.y)));
    }
    if learning.by_variance == 1u && region.samples > 0u {
        total = package_lightshed_double__1double_divide(total, package_lightshed_double__2double_from_u32(region.samples));
    }
    totals[own] = total;
    if package_lightshed_double__1double_less(package_lightshed_double_ZERO, total) {
        package_lightshed__1quadtree_learning__2quadtree_load_nodes(learning_of(own));
    }
}

@compute @workgroup_size(256)
fn move_leaves(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let own = package_group__1index_of(group, groups, lane);
    if own < learning.regions && package_lightshed_double__1double_less(package_lightshed_double_ZERO, totals[own]) {
        package_lightshed__1quadtree_learning__2quadtree_move_leaves(learning_of(own), moves);
    }
}

const package_group_GROUP: u32 = 256u;

fn package_group__1index_of(group: vec3u, groups: vec3u, lane: u32) -> u32 {
    return (group.y * groups.x + group.x) * package_group_GROUP + lane;
}

const package_lightshed__1quadtree_learning_FOUR: vec2u = vec2u(0u, 1074790400u);

const package_lightshed__1quadtree_learning_ONE: vec2u = vec2u(0u, 1072693248u);

struct package_lightshed__1quadtree_learning_QuadtreeLearning {
    first_word: u32,
    words: u32,
    first_sample: u32,
    samples: u32,
    first_node: u32,
    least_samples: u32,
    eagerness: f32,
    by_variance: bool,
    total: vec2u,
    prior: vec2u,
    of_scattering: vec2u,
    of_tree: vec2u
}

struct package_lightshed__1quadtree_learning_QuadtreeMove {
    taken: u32,
    put: u32,
    split: u32
}

const package_lightshed__1quadtree_learning_THREE: vec2u = vec2u(0u, 1074266112u);

fn package_lightshed__1quadtree_learning__1best_move(tree: package_lightshed__1quadtree_learning_QuadtreeLearning) -> vec2u {
    let bits = 32u * tree.words;
    var leaf = package_lightshed_ray_NOTHING;
    var most = 0.0;
    for (var place = 0u; place < bits; place++) {
        if package_lightshed__1quadtree_learning__1tree_bit(tree.first_word, place) {
            continue;
        }
        let node = load_learning_node(tree.first_node + place);
        let is_known = node.w - node.z >= tree.least_samples && package_lightshed__1quadtree_learning__1node_depth(node) < package_lightshed__1quadtree_learning__2MAX_QUADTREE_DEPTH;
        let load = bitcast<f32>(node.y);
        if is_known && (leaf == package_lightshed_ray_NOTHING || load > most) {
            leaf = place;
            most = load;
        }
    }
    var inner = package_lightshed_ray_NOTHING;
    var least = 0.0;
    var number = 0u;
    for (var place = 0u; place < bits && leaf != package_lightshed_ray_NOTHING; place++) {
        if !package_lightshed__1quadtree_learning__1tree_bit(tree.first_word, place) {
            continue;
        }
        number++;
        let children = (load_learning_word(tree.first_word + number / 8u) >> (4u * (number % 8u))) & 15u;
        if children == 0u && number != leaf / 4u {
            let load = package_lightshed__1quadtree_learning__1node_load(tree, place);
            if inner == package_lightshed_ray_NOTHING || load < least {
                inner = place;
                least = load;
            }
        }
    }
    return vec2u(inner, leaf);
}

fn package_lightshed__1quadtree_learning__1insert_four(first: u32, words: u32, place: u32) {
    let start = place >> 5u;
    for (var index = words - 1u; index > start; index--) {
        let below = load_learning_word(first + index - 1u) >> 28u;
        store_learning_word(first + index, (load_learning_word(first + index) << 4u) | below);
    }
    let word = load_learning_word(first + start);
    let low = (1u << (place & 31u)) - 1u;
    store_learning_word(first + start, (word & low) | ((word & ~low) << 4u));
}

fn package_lightshed__1quadtree_learning__1load_of(tree: package_lightshed__1quadtree_learning_QuadtreeLearning, range: vec2u, depth: u32) -> f32 {
    let area = vec2u(0u, (1023u - 2u * depth) << 20u);
    if !tree.by_variance {
        let sum = package_lightshed_double__1double_subtract(package_lightshed__1quadtree_learning__1weight_before(tree, range.y), package_lightshed__1quadtree_learning__1weight_before(tree, range.x));
        let share = package_lightshed_double__1double_divide(sum, tree.total);
        let prior = package_lightshed_double__1double_divide(tree.prior, package_lightshed_double__1double_add(package_lightshed_double__2double_from_u32(tree.samples), tree.prior));
        let own = package_lightshed_double__1double_multiply(package_lightshed_double__1double_subtract(package_lightshed__1quadtree_learning_ONE, prior), share);
        return package_lightshed_double__2double_to_f32(package_lightshed_double__1double_add(own, package_lightshed_double__1double_multiply(prior, area)));
    }
    let fineness = bitcast<f32>((127u + 2u * depth) << 23u);
    var sum = vec2u(0u);
    for (var i = range.x; i < range.y; i++) {
        let sample = load_learning_sample(tree.first_sample + i);
        let a = bitcast<f32>(sample.z);
        let b = package_lightshed_float__2as_it_is(bitcast<f32>(sample.w) * fineness);
        let both = package_lightshed_float__2as_it_is(package_lightshed_float__2as_it_is(a + b) * package_lightshed_float__2as_it_is(a + package_lightshed_float__2as_it_is(4.0 * b)));
        let term = bitcast<f32>(sample.y) * package_lightshed_float__2as_it_is(package_lightshed_float__2as_it_is(3.0 * b) / both);
        sum = package_lightshed_double__1double_add(sum, package_lightshed_double__2double_from_f32(term));
    }
    let b = package_lightshed_double__1double_multiply(tree.of_tree, package_lightshed_double__2double_from_f32(fineness));
    let both = package_lightshed_double__1double_multiply(package_lightshed_double__1double_add(tree.of_scattering, b), package_lightshed_double__1double_add(tree.of_scattering, package_lightshed_double__1double_multiply(package_lightshed__1quadtree_learning_FOUR, b)));
    let even = package_lightshed_double__1double_divide(package_lightshed_double__1double_multiply(package_lightshed__1quadtree_learning_THREE, b), both);
    let of_prior = package_lightshed_double__1double_multiply(package_lightshed_double__1double_multiply(package_lightshed_double__1double_multiply(tree.prior, area), tree.total), even);
    return package_lightshed_double__2double_to_f32(package_lightshed_double__1double_add(sum, of_prior));
}

fn package_lightshed__1quadtree_learning__1node_depth(node: vec4u) -> u32 {
    return node.x & 15u;
}

fn package_lightshed__1quadtree_learning__1node_load(tree: package_lightshed__1quadtree_learning_QuadtreeLearning, place: u32) -> f32 {
    return bitcast<f32>(load_learning_node(tree.first_node + place).y);
}

fn package_lightshed__1quadtree_learning__1quadtree_migrate(first: u32, words: u32, inner: u32, leaf: u32) -> package_lightshed__1quadtree_learning_QuadtreeMove {
    let start = 4u * (package_lightshed__1quadtree_learning__1tree_rank(first, inner) + 1u);
    let word = first + (inner >> 5u);
    store_learning_word(word, load_learning_word(word) & ~(1u << (inner & 31u)));
    package_lightshed__1quadtree_learning__1remove_four(first, words, start);
    let split = select(leaf, leaf - 4u, leaf > start);
    let other = first + (split >> 5u);
    store_learning_word(other, load_learning_word(other) | (1u << (split & 31u)));
    let end = 4u * (package_lightshed__1quadtree_learning__1tree_rank(first, split) + 1u);
    package_lightshed__1quadtree_learning__1insert_four(first, words, end);
    return package_lightshed__1quadtree_learning_QuadtreeMove(start, end, split);
}

fn package_lightshed__1quadtree_learning__1remove_four(first: u32, words: u32, place: u32) {
    let start = place >> 5u;
    for (var index = start; index < words; index++) {
        let word = load_learning_word(first + index);
        var after = 0u;
        if index + 1u < words {
            after = load_learning_word(first + index + 1u) << 28u;
        }
        let kept = select(0u, (1u << (place & 31u)) - 1u, index == start);
        store_learning_word(first + index, (word & kept) | ((word >> 4u) & ~kept) | after);
    }
}

fn package_lightshed__1quadtree_learning__1samples_before(tree: package_lightshed__1quadtree_learning_QuadtreeLearning, range: vec2u, code: u32) -> u32 {
    var low = range.x;
    var high = range.y;
    while (low < high) {
        let middle = low + (high - low) / 2u;
        if load_learning_sample(tree.first_sample + middle).x < code {
            low = middle + 1u;
        }
        else {
            high = middle;
        }
    }
    return low;
}

fn package_lightshed__1quadtree_learning__1store_quarters(tree: package_lightshed__1quadtree_learning_QuadtreeLearning, parent: vec4u, place: u32) {
    let depth = package_lightshed__1quadtree_learning__1node_depth(parent) + 1u;
    let least = parent.x & ~15u;
    var start = parent.z;
    for (var quarter = 0u; quarter < 4u; quarter++) {
        let code = least | (quarter << (32u - 2u * depth));
        var end = parent.w;
        if quarter < 3u {
            end = package_lightshed__1quadtree_learning__1samples_before(tree, vec2u(start, parent.w), code + (1u << (32u - 2u * depth)));
        }
        let load = package_lightshed__1quadtree_learning__1load_of(tree, vec2u(start, end), depth);
        store_learning_node(tree.first_node + place + quarter, vec4u(code | depth, bitcast<u32>(load), start, end));
        start = end;
    }
}

fn package_lightshed__1quadtree_learning__1tree_bit(first: u32, place: u32) -> bool {
    return ((load_learning_word(first + (place >> 5u)) >> (place & 31u)) & 1u) != 0u;
}

fn package_lightshed__1quadtree_learning__1tree_rank(first: u32, place: u32) -> u32 {
    var ones = 0u;
    for (var index = 0u; index < (place >> 5u); index++) {
        ones += countOneBits(load_learning_word(first + index));
    }
    if (place & 31u) != 0u {
        ones += countOneBits(load_learning_word(first + (place >> 5u)) & ((1u << (place & 31u)) - 1u));
    }
    return ones;
}

fn package_lightshed__1quadtree_learning__1weight_before(tree: package_lightshed__1quadtree_learning_QuadtreeLearning, sample: u32) -> vec2u {
    if sample == tree.samples {
        return tree.total;
    }
    return load_learning_sample(tree.first_sample + sample).yz;
}

const package_lightshed__1quadtree_learning__2MAX_QUADTREE_DEPTH: u32 = 14u;

fn package_lightshed__1quadtree_learning__2quadtree_load_nodes(tree: package_lightshed__1quadtree_learning_QuadtreeLearning) {
    let bits = 32u * tree.words;
    let first = tree.first_node;
    var inner = package_lightshed_ray_NOTHING;
    for (var number = 0u; number < bits / 4u; number++) {
        var parent = vec4u(0u, 0u, 0u, tree.samples);
        if number > 0u {
            inner++;
            while (!package_lightshed__1quadtree_learning__1tree_bit(tree.first_word, inner)) {
                inner++;
            }
            parent = load_learning_node(first + inner);
        }
        package_lightshed__1quadtree_learning__1store_quarters(tree, parent, 4u * number);
    }
}

fn package_lightshed__1quadtree_learning__2quadtree_move_leaves(tree: package_lightshed__1quadtree_learning_QuadtreeLearning, moves: u32) {
    let bits = 32u * tree.words;
    let first = tree.first_node;
    for (var count = 0u; count < moves; count++) {
        let best = package_lightshed__1quadtree_learning__1best_move(tree);
        if best.x == package_lightshed_ray_NOTHING || best.y == package_lightshed_ray_NOTHING {
            return;
        }
        if package_lightshed_float__2as_it_is(package_lightshed__1quadtree_learning__1node_load(tree, best.y) * tree.eagerness) <= package_lightshed__1quadtree_learning__1node_load(tree, best.x) {
            return;
        }
        let moved = package_lightshed__1quadtree_learning__1quadtree_migrate(tree.first_word, tree.words, best.x, best.y);
        for (var place = moved.taken; place + 4u < bits; place++) {
            store_learning_node(first + place, load_learning_node(first + place + 4u));
        }
        for (var place = bits - 1u; place >= moved.put + 4u; place--) {
            store_learning_node(first + place, load_learning_node(first + place - 4u));
        }
        package_lightshed__1quadtree_learning__1store_quarters(tree, load_learning_node(first + moved.split), moved.put);
    }
}

const package_lightshed_double_INFINITE: u32 = 2146435072u;

const package_lightshed_double_NAN: vec2u = vec2u(0u, 2146959360u);

const package_lightshed_double_ONE: vec2u = vec2u(0u, 1072693248u);

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

fn package_lightshed_double__2double_to_f32(a: vec2u) -> f32 {
    return bitcast<f32>(package_lightshed_double__3double_to_f32_bits(a));
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

fn package_lightshed_octahedral__1octahedral_decode(uv: vec2f) -> vec3f {
    return package_lightshed_vector_unit3(package_lightshed_octahedral_lift(clamp(uv, vec2f(0.0), vec2f(1.0)) * 2.0 - 1.0));
}

fn package_lightshed_octahedral__1octahedral_encode(direction: vec3f) -> vec2f {
    return package_lightshed_octahedral_project(direction) * 0.5 + 0.5;
}

fn package_lightshed_octahedral__3octahedral_to_solid_angle(pdf_square: f32, direction: vec3f) -> f32 {
    let norm = abs(direction.x) + abs(direction.y) + abs(direction.z);
    let q = package_lightshed_float__2as_it_is(package_lightshed_vector_length3(direction / norm));
    return pdf_square / (4.0 / (q * q * q));
}

fn package_lightshed_octahedral_fold(xy: vec2f) -> vec2f {
    return vec2f((1.0 - abs(xy.y)) * package_lightshed_vector__1sign_of(xy.x), (1.0 - abs(xy.x)) * package_lightshed_vector__1sign_of(xy.y));
}

fn package_lightshed_octahedral_lift(xy: vec2f) -> vec3f {
    let z = 1.0 - abs(xy.x) - abs(xy.y);
    if z < 0.0 {
        return vec3f(package_lightshed_octahedral_fold(xy), z);
    }
    return vec3f(xy, z);
}

fn package_lightshed_octahedral_project(direction: vec3f) -> vec2f {
    let norm = abs(direction.x) + abs(direction.y) + abs(direction.z);
    if !(norm > 0.0) {
        return vec2f(0.0);
    }
    let xy = clamp(direction.xy / norm, vec2f(-1.0), vec2f(1.0));
    if direction.z < 0.0 {
        return package_lightshed_octahedral_fold(xy);
    }
    return xy;
}

struct package_lightshed_parallax_FromPivot {
    direction: vec3f,
    factor: f32
}

const package_lightshed_parallax__1LARGEST_OFFSET: f32 = 0.5;

fn package_lightshed_parallax__1parallax_offset(pivot: vec3f, inverse: f32, position: vec3f) -> vec3f {
    let offset = (position - pivot) * inverse;
    let length = package_lightshed_vector_length3(offset);
    if length <= package_lightshed_parallax__1LARGEST_OFFSET {
        return offset;
    }
    if package_lightshed_vector__1is_finite(length) {
        return offset * (package_lightshed_parallax__1LARGEST_OFFSET / length);
    }
    return vec3f(0.0);
}

fn package_lightshed_parallax__2parallax_at_pivot(offset: vec3f, direction: vec3f) -> package_lightshed_parallax_FromPivot {
    let along = package_lightshed_vector_dot3(offset, direction);
    let r = sqrt(along * along + package_lightshed_float__2as_it_is(1.0 - package_lightshed_vector_dot3(offset, offset)));
    let s = r - along;
    return package_lightshed_parallax_FromPivot(package_lightshed_vector_unit3(offset + s * direction), s * s / r);
}

fn package_lightshed_quadtree__1quadtree_code(square: vec2f) -> u32 {
    let spread = package_lightshed_quadtree__1spread_16(vec2u(clamp(square * 65536.0, vec2f(0.0), vec2f(65535.0))));
    return spread.x | (spread.y << 1u);
}

fn package_lightshed_quadtree__1spread_16(x: vec2u) -> vec2u {
    var y = (x | (x << vec2u(8u))) & vec2u(16711935u);
    y = (y | (y << vec2u(4u))) & vec2u(252645135u);
    y = (y | (y << vec2u(2u))) & vec2u(858993459u);
    return (y | (y << vec2u(1u))) & vec2u(1431655765u);
}

const package_lightshed_ray_NOTHING: u32 = 4294967295u;

fn package_lightshed_vector__1is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 2139095040u) != 2139095040u;
}

fn package_lightshed_vector__1sign_of(x: f32) -> f32 {
    return select(1.0, -1.0, x < 0.0);
}

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn package_lightshed_vector_length3(v: vec3f) -> f32 {
    return sqrt(package_lightshed_vector_dot3(v, v));
}

fn package_lightshed_vector_unit3(v: vec3f) -> vec3f {
    return v * (1.0 / package_lightshed_vector_length3(v));
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
