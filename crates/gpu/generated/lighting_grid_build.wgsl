// Linked from lighting_grid_build.wesl.

struct Settings {
    lights: u32,
    levels: u32,
    boxes: u32,
    alpha: f32,
    low: vec3f,
    capacity: u32,
    high: vec3f,
    words: u32,
    first_word: array<u32, 12>
}

@group(0) @binding(0)
var<storage, read> settings: Settings;

@group(0) @binding(1)
var<storage, read> lights: array<f32>;

@group(0) @binding(2)
var<storage, read_write> boxes: array<package_group_Box>;

@group(0) @binding(3)
var<storage, read_write> lighting_frame: package_lightshed__1grid_light_GridFrame;

@group(0) @binding(4)
var<storage, read_write> codes: array<vec2u>;

@group(0) @binding(5)
var<storage, read_write> indices: array<u32>;

@group(0) @binding(6)
var<storage, read_write> grid_points: array<package_lightshed__1grid_light_GridPoint>;

@group(0) @binding(7)
var<storage, read_write> grid_keys: array<u32>;

@group(0) @binding(8)
var<storage, read_write> marks: array<atomic<u32>>;

@group(0) @binding(9)
var<storage, read_write> grid_words: array<vec2u>;

@group(0) @binding(10)
var<storage, read_write> tiles: array<u32>;

@group(0) @binding(11)
var<storage, read_write> grid_vertices: array<u32>;

@group(0) @binding(12)
var<storage, read> level: u32;

@group(0) @binding(13)
var<storage, read_write> grid_moments: array<package_lightshed__1grid_moments_Moments>;

@group(0) @binding(14)
var<storage, read_write> grid_lights: array<package_lightshed__1grid_light_GridLight>;

const WORDS: u32 = 9u;

const TILE: u32 = 1024u;

const LEAST_SIZE: vec2u = vec2u(2167269905u, 1030854553u);

const LEAST_PART: vec2u = vec2u(0u, 1053818880u);

@compute @workgroup_size(256)
fn bounds(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u) {
    var own = package_group_Box(settings.low, 0u, settings.high, 0u);
    for (var i = group.x * package_group_GROUP + lane; i < settings.lights; i += settings.boxes * package_group_GROUP) {
        let k = WORDS * i;
        let position = vec3f(lights[k], lights[k + 1u], lights[k + 2u]);
        own = package_group_Box(min(own.low, position), 0u, max(own.high, position), 0u);
    }
    let all = package_group__2box_of_group(lane, own);
    if lane == 0u {
        boxes[group.x] = all;
    }
}

fn greater(a: vec2u, b: vec2u) -> vec2u {
    return select(a, b, package_lightshed_double__1double_less(a, b));
}

fn extent(low: f32, high: f32) -> vec2u {
    return package_lightshed_double__1double_subtract(package_lightshed_double__2double_from_f32(high), package_lightshed_double__2double_from_f32(low));
}

@compute @workgroup_size(256)
fn place_cube(@builtin(local_invocation_index) lane: u32) {
    var own = package_group_Box(settings.low, 0u, settings.high, 0u);
    for (var i = lane; i < settings.boxes; i += package_group_GROUP) {
        own = package_group_Box(min(own.low, boxes[i].low), 0u, max(own.high, boxes[i].high), 0u);
    }
    let all = package_group__2box_of_group(lane, own);
    if lane > 0u {
        return;
    }
    let diagonal = greater(greater(extent(all.low.x, all.high.x), extent(all.low.y, all.high.y)), extent(all.low.z, all.high.z));
    let farthest = max(abs(all.low), abs(all.high));
    let magnitude = package_lightshed_double__2double_from_f32(max(farthest.x, max(farthest.y, farthest.z)));
    let size = greater(greater(diagonal, package_lightshed_double__1double_multiply(magnitude, LEAST_PART)), LEAST_SIZE);
    lighting_frame.origin = all.low;
    lighting_frame.levels = settings.levels;
    lighting_frame.size = size;
    lighting_frame.per_size = package_lightshed_double__1double_divide(package_lightshed_double_ONE, size);
    let half_cell = package_lightshed_double__2double_to_f32(scaled(size, -i32(settings.levels)));
    lighting_frame.radius_0 = settings.alpha * half_cell;
    lighting_frame.lights = settings.lights;
    lighting_frame.padding = vec2u(0u);
    lighting_frame.first_word = settings.first_word;
}

fn scaled(a: vec2u, power: i32) -> vec2u {
    return vec2u(a.x, a.y + (u32(power) << 20u));
}

fn in_cells(frame: package_lightshed__1grid_light_GridFrame, position: f32, origin: f32) -> vec2u {
    let per_cell = scaled(frame.per_size, i32(frame.levels) - 1);
    return package_lightshed_double__1double_multiply(package_lightshed_double__1double_subtract(package_lightshed_double__2double_from_f32(position), package_lightshed_double__2double_from_f32(origin)), per_cell);
}

@compute @workgroup_size(256)
fn find_cells(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    if i >= lighting_frame.lights {
        return;
    }
    let frame = lighting_frame;
    let side = 1u << (frame.levels - 1u);
    let k = WORDS * i;
    let x = min(package_lightshed_double__2double_to_u32(in_cells(frame, lights[k], frame.origin.x)), side - 1u);
    let y = min(package_lightshed_double__2double_to_u32(in_cells(frame, lights[k + 1u], frame.origin.y)), side - 1u);
    let z = min(package_lightshed_double__2double_to_u32(in_cells(frame, lights[k + 2u], frame.origin.z)), side - 1u);
    codes[i] = vec2u((z * side + y) * side + x, 0u);
    indices[i] = i;
}

fn occupy(first: u32, side: u32, vertex: vec3u) {
    let word = first + (vertex.z * side + vertex.y) * (side / 32u + 1u) + vertex.x / 32u;
    atomicOr(&marks[2u * word], 1u << (vertex.x % 32u));
}

fn within(frame: package_lightshed__1grid_light_GridFrame, position: f32, origin: f32, cell: u32) -> f32 {
    return package_lightshed_double__2double_to_f32(package_lightshed_double__1double_subtract(in_cells(frame, position, origin), package_lightshed_double__2double_from_u32(cell)));
}

@compute @workgroup_size(256)
fn order_points(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = package_group__1index_of(group, groups, lane);
    if i >= lighting_frame.lights {
        return;
    }
    let frame = lighting_frame;
    let key = codes[i].x;
    grid_keys[i] = key;
    let cells = 1u << (frame.levels - 1u);
    let cell = vec3u(key % cells, key / cells % cells, key / cells / cells);
    let k = WORDS * indices[i];
    let position = vec3f(lights[k], lights[k + 1u], lights[k + 2u]);
    grid_points[i] = package_lightshed__1grid_light_GridPoint(position, within(frame, position.x, frame.origin.x, cell.x), vec3f(lights[k + 3u], lights[k + 4u], lights[k + 5u]), within(frame, position.y, frame.origin.y, cell.y), vec3f(lights[k + 6u], lights[k + 7u], lights[k + 8u]), within(frame, position.z, frame.origin.z, cell.z));
    if i > 0u && codes[i - 1u].x == key {
        return;
    }
    for (var corner = 0u; corner < 8u; corner++) {
        occupy(0u, cells + 1u, cell + vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u));
    }
}

fn side_of(levels: u32, level: u32) -> u32 {
    return (1u << (levels - level)) + 1u;
}

@compute @workgroup_size(256)
fn mark_coarser(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let finer_side = side_of(settings.levels, level - 1u);
    let finer_row = finer_side / 32u + 1u;
    let i = package_group__1index_of(group, groups, lane);
    if i >= finer_side * finer_side * finer_row {
        return;
    }
    let row = i / finer_row;
    let y = row % finer_side;
    let z = row / finer_side;
    let side = side_of(settings.levels, level);
    let coarse_row = side / 32u + 1u;
    var bits = atomicLoad(&marks[2u * (settings.first_word[level - 2u] + i)]);
    while (bits != 0u) {
        let x = i % finer_row * 32u + countTrailingZeros(bits);
        bits &= bits - 1u;
        for (var cz = z / 2u; cz <= (z + 1u) / 2u; cz++) {
            for (var cy = y / 2u; cy <= (y + 1u) / 2u; cy++) {
                for (var cx = x / 2u; cx <= (x + 1u) / 2u; cx++) {
                    let word = settings.first_word[level - 1u] + (cz * side + cy) * coarse_row + cx / 32u;
                    atomicOr(&marks[2u * word], 1u << (cx % 32u));
                }
            }
        }
    }
}

@compute @workgroup_size(256)
fn count_vertices(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let tile = group.y * groups.x + group.x;
    var own = 0u;
    for (var k = 0u; k < TILE / package_group_GROUP; k++) {
        let word = tile * TILE + lane * (TILE / package_group_GROUP) + k;
        if word < settings.words {
            own += countOneBits(grid_words[word].x);
        }
    }
    let all = package_group__2sum_of_group(lane, own);
    if lane == 0u && tile * TILE < settings.words {
        tiles[tile] = all;
    }
}

@compute @workgroup_size(256)
fn scan_tiles(@builtin(local_invocation_index) lane: u32) {
    let total = (settings.words + TILE - 1u) / TILE;
    let each = (total + package_group_GROUP - 1u) / package_group_GROUP;
    let first = min(lane * each, total);
    let end = min(first + each, total);
    var own = 0u;
    for (var i = first; i < end; i++) {
        own += tiles[i];
    }
    var before = package_group__2sum_up_to(lane, own) - own;
    for (var i = first; i < end; i++) {
        let count = tiles[i];
        tiles[i] = before;
        before += count;
    }
}

@compute @workgroup_size(256)
fn rank_vertices(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let tile = group.y * groups.x + group.x;
    let each = TILE / package_group_GROUP;
    var own = 0u;
    for (var k = 0u; k < each; k++) {
        let word = tile * TILE + lane * each + k;
        if word < settings.words {
            own += countOneBits(grid_words[word].x);
        }
    }
    var before = package_group__2sum_up_to(lane, own) - own;
    if tile * TILE >= settings.words {
        return;
    }
    before += tiles[tile];
    for (var k = 0u; k < each; k++) {
        let word = tile * TILE + lane * each + k;
        if word >= settings.words {
            return;
        }
        var bits = grid_words[word].x;
        grid_words[word].y = before;
        var level = 1u;
        while (level < settings.levels && word >= settings.first_word[level]) {
            level++;
        }
        let side = side_of(settings.levels, level);
        let row_words = side / 32u + 1u;
        let i = word - settings.first_word[level - 1u];
        let row = i / row_words;
        while (bits != 0u) {
            let x = i % row_words * 32u + countTrailingZeros(bits);
            bits &= bits - 1u;
            if before < settings.capacity {
                grid_vertices[before] = ((row / side) << 20u) | ((row % side) << 10u) | x;
            }
            before++;
        }
        if word + 1u == settings.words {
            grid_words[word + 1u] = vec2u(0u, before);
        }
    }
}

fn vertex_at(place: u32) -> vec3u {
    let packed = grid_vertices[place];
    return vec3u(packed & 1023u, (packed >> 10u) & 1023u, packed >> 20u);
}

fn finish(place: u32, vertex: vec3u, sum: package_lightshed__1grid_moments_Moments) {
    grid_moments[place] = sum;
    let cell = package_lightshed_double__2double_to_f32(scaled(lighting_frame.size, i32(level) - i32(lighting_frame.levels)));
    grid_lights[place] = package_lightshed__1grid_moments__1light_of(sum, vec3f(vertex), lighting_frame.origin, cell);
}

fn place_of_key(key: u32) -> u32 {
    var begin = 0u;
    var end = lighting_frame.lights;
    while (begin < end) {
        let middle = (begin + end) / 2u;
        if grid_keys[middle] < key {
            begin = middle + 1u;
        }
        else {
            end = middle;
        }
    }
    return begin;
}

@compute @workgroup_size(256)
fn gather_lights(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let place = package_group__1index_of(group, groups, lane);
    if place >= grid_words[lighting_frame.first_word[1]].y {
        return;
    }
    let vertex = vertex_at(place);
    var sum = package_lightshed__1grid_moments__1no_moments();
    for (var k = 0u; k < 4u; k++) {
        let row = package_lightshed__1grid_light__1cells_beside(vertex, k, lighting_frame.levels);
        if row.first == row.end {
            continue;
        }
        let end = place_of_key(row.end);
        for (var i = place_of_key(row.first); i < end; i++) {
            let light = grid_points[i];
            let offset = package_lightshed__1grid_light__2offset_from_vertex(light, grid_keys[i], row, vertex);
            sum = package_lightshed__1grid_moments__1with_light(sum, offset, light.intensity, light.normal);
        }
    }
    finish(place, vertex, sum);
}

@compute @workgroup_size(256)
fn gather_vertices(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let start = grid_words[lighting_frame.first_word[level - 1u]].y;
    let place = start + package_group__1index_of(group, groups, lane);
    if place >= grid_words[lighting_frame.first_word[level]].y {
        return;
    }
    let vertex = vertex_at(place);
    let side = side_of(lighting_frame.levels, level - 1u);
    let row_words = side / 32u + 1u;
    var sum = package_lightshed__1grid_moments__1no_moments();
    for (var row = 0u; row < 9u; row++) {
        let step = vec2i(i32(row % 3u) - 1, i32(row / 3u) - 1);
        let y = i32(2u * vertex.y) + step.x;
        let z = i32(2u * vertex.z) + step.y;
        if min(y, z) < 0 || max(y, z) >= i32(side) {
            continue;
        }
        let first_word = lighting_frame.first_word[level - 2u] + (u32(z) * side + u32(y)) * row_words;
        for (var dx = -1; dx <= 1; dx++) {
            let x = i32(2u * vertex.x) + dx;
            if x < 0 || x >= i32(side) {
                continue;
            }
            let map_word = grid_words[first_word + u32(x) / 32u];
            let bit = 1u << (u32(x) % 32u);
            if (map_word.x & bit) != 0u {
                let finer = map_word.y + countOneBits(map_word.x & (bit - 1u));
                sum = package_lightshed__1grid_moments__1with_vertex(sum, grid_moments[finer], vec3i(dx, step.x, step.y));
            }
        }
    }
    finish(place, vertex, sum);
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

fn package_group__2sum_of_group(lane: u32, own: u32) -> u32 {
    package_group_parts[lane] = own;
    workgroupBarrier();
    for (var half = package_group_GROUP / 2u; half > 0u; half /= 2u) {
        if lane < half {
            package_group_parts[lane] += package_group_parts[lane + half];
        }
        workgroupBarrier();
    }
    return package_group_parts[0];
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

var<workgroup> package_group_highs: array<vec3f, 256>;

var<workgroup> package_group_lows: array<vec3f, 256>;

var<workgroup> package_group_parts: array<u32, 256>;

struct package_lightshed__1grid_light_CellRow {
    y: u32,
    z: u32,
    start: u32,
    first: u32,
    end: u32
}

struct package_lightshed__1grid_light_GridFrame {
    origin: vec3f,
    levels: u32,
    size: vec2u,
    per_size: vec2u,
    radius_0: f32,
    lights: u32,
    padding: vec2u,
    first_word: array<u32, 12>
}

struct package_lightshed__1grid_light_GridLight {
    position: vec3f,
    isotropic: f32,
    intensity: vec3f,
    moment_xx: f32,
    mean_normal: vec3f,
    moment_yy: f32,
    spread: vec3f,
    moment_zz: f32,
    moment_across: vec3f,
    padding: u32
}

struct package_lightshed__1grid_light_GridPoint {
    position: vec3f,
    fraction_x: f32,
    intensity: vec3f,
    fraction_y: f32,
    normal: vec3f,
    fraction_z: f32
}

fn package_lightshed__1grid_light__1cells_beside(vertex: vec3u, row: u32, levels: u32) -> package_lightshed__1grid_light_CellRow {
    let cells = 1u << (levels - 1u);
    let y = vertex.y - 1u + (row & 1u);
    let z = vertex.z - 1u + (row >> 1u);
    if y >= cells || z >= cells {
        return package_lightshed__1grid_light_CellRow(y, z, 0u, 0u, 0u);
    }
    let start = (z * cells + y) * cells;
    return package_lightshed__1grid_light_CellRow(y, z, start, start + max(vertex.x, 1u) - 1u, start + min(vertex.x + 1u, cells));
}

fn package_lightshed__1grid_light__2offset_from_vertex(light: package_lightshed__1grid_light_GridPoint, key: u32, row: package_lightshed__1grid_light_CellRow, vertex: vec3u) -> vec3f {
    let fraction = vec3f(light.fraction_x, light.fraction_y, light.fraction_z);
    return fraction - vec3f(vertex - vec3u(key - row.start, row.y, row.z));
}

struct package_lightshed__1grid_moments_Moments {
    first: vec3f,
    weight: f32,
    second: vec3f,
    square_xx: f32,
    intensity: vec3f,
    square_yy: f32,
    normal: vec3f,
    square_zz: f32,
    square_across: vec3f,
    padding: u32
}

fn package_lightshed__1grid_moments__1flux_scale(norm_squared: f32) -> f32 {
    let uniform = 0.8660254;
    return uniform + 0.1339746 * (1.5 * norm_squared - 0.5);
}

fn package_lightshed__1grid_moments__1light_of(sum: package_lightshed__1grid_moments_Moments, vertex: vec3f, origin: vec3f, cell: f32) -> package_lightshed__1grid_light_GridLight {
    let zero = vec3f(0.0);
    if !(sum.weight > 0.0) {
        return package_lightshed__1grid_light_GridLight(origin + vertex * cell, 1.0, zero, 0.0, zero, 0.0, zero, 0.0, zero, 0u);
    }
    let mean = sum.first / sum.weight;
    let variance = max(sum.second / sum.weight - mean * mean, zero);
    let trace = sum.square_xx + sum.square_yy + sum.square_zz;
    var isotropic = 1.0;
    var scale = 0.0;
    if trace > 0.0 {
        isotropic = max(1.0 - trace / sum.weight, 0.0);
        let xx = sum.square_xx / trace;
        let yy = sum.square_yy / trace;
        let zz = sum.square_zz / trace;
        let across = sum.square_across / trace;
        let factor = package_lightshed__1grid_moments__1flux_scale(xx * xx + yy * yy + zz * zz + 2.0 * package_lightshed_vector_dot3(across, across));
        scale = (trace / sum.weight) / sum.weight * factor * factor;
    }
    return package_lightshed__1grid_light_GridLight(origin + (vertex + mean) * cell, select(isotropic, 0.0, isotropic < 2e-6), min(sum.intensity, vec3f(package_lightshed_float__1F32_MAX)), sum.square_xx * scale, sum.normal / sum.weight, sum.square_yy * scale, sqrt(variance) * cell, sum.square_zz * scale, sum.square_across * scale, 0u);
}

fn package_lightshed__1grid_moments__1no_moments() -> package_lightshed__1grid_moments_Moments {
    let zero = vec3f(0.0);
    return package_lightshed__1grid_moments_Moments(zero, 0.0, zero, 0.0, zero, 0.0, zero, 0.0, zero, 0u);
}

fn package_lightshed__1grid_moments__1with_light(sum: package_lightshed__1grid_moments_Moments, offset: vec3f, intensity: vec3f, normal: vec3f) -> package_lightshed__1grid_moments_Moments {
    let along_axes = vec3f(1.0) - abs(offset);
    if !(min(along_axes.x, min(along_axes.y, along_axes.z)) > 0.0) {
        return sum;
    }
    let share = along_axes.x * along_axes.y * along_axes.z;
    let weight = share * package_lightshed_color_luminance(intensity);
    let weighted = normal * weight;
    let squares = weighted * normal;
    let first = offset * weight;
    return package_lightshed__1grid_moments_Moments(sum.first + first, sum.weight + weight, sum.second + first * offset, sum.square_xx + squares.x, sum.intensity + intensity * share, sum.square_yy + squares.y, sum.normal + weighted, sum.square_zz + squares.z, sum.square_across + weighted * normal.yzx, 0u);
}

fn package_lightshed__1grid_moments__1with_vertex(sum: package_lightshed__1grid_moments_Moments, finer: package_lightshed__1grid_moments_Moments, half_steps: vec3i) -> package_lightshed__1grid_moments_Moments {
    let along_axes = select(vec3f(0.5), vec3f(1.0), half_steps == vec3i(0));
    let share = along_axes.x * along_axes.y * along_axes.z;
    let s = 0.5 * vec3f(half_steps);
    let first = 0.5 * finer.first + s * finer.weight;
    let second = 0.25 * finer.second + s * finer.first + s * s * finer.weight;
    return package_lightshed__1grid_moments_Moments(sum.first + share * first, sum.weight + share * finer.weight, sum.second + share * second, sum.square_xx + share * finer.square_xx, sum.intensity + share * finer.intensity, sum.square_yy + share * finer.square_yy, sum.normal + share * finer.normal, sum.square_zz + share * finer.square_zz, sum.square_across + share * finer.square_across, 0u);
}

const package_lightshed_color_LUMINANCE: vec3f = vec3f(0.212671, 0.71516, 0.072169);

fn package_lightshed_color_luminance(rgb: vec3f) -> f32 {
    return package_lightshed_vector_dot3(rgb, package_lightshed_color_LUMINANCE);
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
