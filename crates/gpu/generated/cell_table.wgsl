// Linked from cell_table.wesl.

struct Table {
    grid: package_lightshed__1hash_grid_LevelGrid,
    visitors: u32,
    slots: u32,
    frame: u32,
    max_age: u32,
    most: u32,
    renewal: u32,
    padding0: u32,
    padding1: u32
}

@group(0) @binding(0)
var<storage, read> table: Table;

@group(0) @binding(1)
var<storage, read> visitors: array<package_memory_visits_Visitor>;

@group(0) @binding(2)
var<storage, read_write> table_words: array<vec2u>;

@group(0) @binding(3)
var<storage, read_write> claims: array<atomic<u32>>;

@group(0) @binding(4)
var<storage, read_write> used: array<atomic<u32>>;

@group(0) @binding(5)
var<storage, read_write> sited: array<u32>;

@group(0) @binding(6)
var<storage, read_write> codes: array<vec2u>;

@group(0) @binding(7)
var<storage, read_write> indices: array<u32>;

@group(0) @binding(8)
var<storage, read_write> visits: array<package_memory_visits_Visit>;

@group(0) @binding(9)
var<storage, read_write> visit_count: atomic<u32>;

const RENEWAL_SEED: vec2u = vec2u(1685285236u, 2003792492u);

const RANK_BITS: u32 = 16u;

fn is_below(a: vec2u, b: vec2u) -> bool {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
}

@compute @workgroup_size(64)
fn claim(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let visitor = package_threads__1thread_number(id, groups);
    if visitor >= table.visitors || visitors[visitor].word.y == 0u {
        return;
    }
    var word = visitors[visitor].word;
    let slot = package_lightshed__1hash_grid__1word_slot(table.grid, word);
    if slot != package_lightshed_ray_NOTHING {
        atomicStore(&used[slot], table.frame);
        return;
    }
    var mine = visitor + 1u;
    var next = 0u;
    while (next < package_lightshed__1hash_grid_LINE * package_lightshed__1hash_grid_LINES) {
        let line = (word.x + next / package_lightshed__1hash_grid_LINE) & table.grid.last_line;
        let place = package_lightshed__1hash_grid_LINE * line + next % package_lightshed__1hash_grid_LINE;
        if table_words[place].y != 0u {
            next++;
            continue;
        }
        let there = atomicLoad(&claims[place]);
        var other = vec2u(0u);
        if there != 0u {
            other = visitors[there - 1u].word;
            if all(other == word) {
                return;
            }
            if is_below(word, other) {
                next++;
                continue;
            }
        }
        if atomicCompareExchangeWeak(&claims[place], there, mine).exchanged {
            if there == 0u {
                return;
            }
            next = package_lightshed__1hash_grid_LINE * ((line - other.x) & table.grid.last_line) + next % package_lightshed__1hash_grid_LINE + 1u;
            word = other;
            mine = there;
        }
    }
}

@compute @workgroup_size(64)
fn settle(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let slot = package_threads__1thread_number(id, groups);
    if slot >= table.slots {
        return;
    }
    let claimed = atomicLoad(&claims[slot]);
    if claimed != 0u {
        table_words[slot] = visitors[claimed - 1u].word;
        atomicStore(&used[slot], table.frame);
        atomicStore(&claims[slot], 0u);
        sited[slot] = 0u;
    }
    else if table_words[slot].y != 0u && table.frame + 1u - atomicLoad(&used[slot]) > table.max_age {
        table_words[slot] = vec2u(0u);
        sited[slot] = 0u;
    }
}

@compute @workgroup_size(64)
fn locate(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let number = package_threads__1thread_number(id, groups);
    if number >= table.visitors {
        return;
    }
    let visitor = visitors[number];
    var slot = package_lightshed_ray_NOTHING;
    if visitor.word.y != 0u {
        slot = package_lightshed__1hash_grid__1word_slot(table.grid, visitor.word);
    }
    slot = min(slot, table.slots);
    codes[number] = vec2u((slot << RANK_BITS) | (visitor.rank >> (32u - RANK_BITS)), slot >> (32u - RANK_BITS));
    indices[number] = number;
}

fn slot_of(code: vec2u) -> u32 {
    return (code.x >> RANK_BITS) | (code.y << (32u - RANK_BITS));
}

@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let first = package_threads__1thread_number(id, groups);
    if first >= table.visitors {
        return;
    }
    let slot = slot_of(codes[first]);
    if slot >= table.slots || (first > 0u && slot_of(codes[first - 1u]) == slot) {
        return;
    }
    var count = 1u;
    while (count < table.most && first + count < table.visitors && slot_of(codes[first + count]) == slot) {
        count++;
    }
    let moves = package_lightshed_rng__1random_word(RENEWAL_SEED, slot, table.frame + 1u, 0u) % table.renewal == 0u;
    visits[atomicAdd(&visit_count, 1u)] = package_memory_visits_Visit(slot, first, count, select(0u, 1u, moves || sited[slot] == 0u));
}

fn package_cells__2load_cell_word(slot: u32) -> vec2u {
    return table_words[slot];
}

const package_lightshed__1hash_grid_LINE: u32 = 8u;

const package_lightshed__1hash_grid_LINES: u32 = 4u;

struct package_lightshed__1hash_grid_LevelGrid {
    per_length: vec2u,
    cell: f32,
    per_distance: f32,
    faces: u32,
    last_line: u32,
    padding0: u32,
    padding1: u32
}

fn package_lightshed__1hash_grid__1word_slot(grid: package_lightshed__1hash_grid_LevelGrid, word: vec2u) -> u32 {
    for (var next = 0u; next < package_lightshed__1hash_grid_LINES; next++) {
        let first = package_lightshed__1hash_grid_LINE * ((word.x + next) & grid.last_line);
        for (var slot = first; slot < first + package_lightshed__1hash_grid_LINE; slot++) {
            if all(package_cells__2load_cell_word(slot) == word) {
                return slot;
            }
        }
    }
    return package_lightshed_ray_NOTHING;
}

const package_lightshed_ray_NOTHING: u32 = 4294967295u;

const package_lightshed_rng_PARITY: u32 = 466688986u;

fn package_lightshed_rng__1random_block(seed: vec2u, pixel: u32, sample: u32, block: u32) -> vec4u {
    return package_lightshed_rng__1threefry4x32_12(vec4u(block, 0u, 0u, 0u), vec4u(seed, pixel, sample));
}

fn package_lightshed_rng__1random_word(seed: vec2u, pixel: u32, sample: u32, dimension: u32) -> u32 {
    return package_lightshed_rng__1random_block(seed, pixel, sample, dimension / 4u)[dimension % 4u];
}

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

struct package_memory_visits_Visit {
    slot: u32,
    first: u32,
    count: u32,
    moves: u32
}

struct package_memory_visits_Visitor {
    word: vec2u,
    rank: u32,
    padding: u32
}

const package_threads_GROUP: u32 = 64u;

fn package_threads__1thread_number(id: vec3u, groups: vec3u) -> u32 {
    return id.x + id.y * groups.x * package_threads_GROUP;
}
