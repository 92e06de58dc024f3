// Linked from direct.wesl.

struct Direct {
    tree: package_lightshed__1light_tree_LightTree,
    sample: u32,
    emitter_samples: u32,
    bsdf_samples: u32,
    groups: u32,
    stratum: vec2u,
    has_tree: u32,
    padding: u32
}

@group(2) @binding(1)
var<storage, read_write> image: array<vec4f>;

@group(2) @binding(2)
var<storage, read> asked: Direct;

const BATCH: u32 = 16u;

fn finite_probability() -> f32 {
    return f32(asked.has_tree) / f32(max(asked.groups, 1u));
}

fn surroundings_probability() -> f32 {
    let infinite = asked.groups - asked.has_tree;
    return f32(infinite) / f32(max(asked.groups, 1u)) / f32(max(infinite, 1u));
}

fn choose_light(at: package_lightshed_importance_ShadingPoint, u: vec2u) -> package_lightshed__1light_tree_LightChoice {
    if package_memory__1light_cache__1BY_CACHE {
        return package_lightshed__1light_cache__2light_cache_sample(at, u);
    }
    return package_lightshed__1light_tree__2light_tree_sample(asked.tree, at, u);
}

fn light_pmf(at: package_lightshed_importance_ShadingPoint, light: u32) -> f32 {
    if package_memory__1light_cache__1BY_CACHE {
        return package_lightshed__1light_cache__2light_cache_pmf(at, light);
    }
    return package_lightshed__1light_tree__2light_tree_pmf(asked.tree, at, light);
}

fn stratified(i: u32, word: u32) -> vec2u {
    let low = package_lightshed_wide__1wide_product(word, asked.stratum.x);
    let within = package_lightshed_wide__1wide_add(package_lightshed_wide__1wide_product(word, asked.stratum.y), vec2u(low.y, 0u));
    return package_lightshed_wide__1wide_add(package_lightshed_wide__1wide_multiply(asked.stratum, vec2u(i, 0u)), within);
}

@compute @workgroup_size(64)
fn direct(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let pixel = package_threads__1thread_number(id, groups);
    if pixel >= package_memory_scene_settings.pixels {
        return;
    }
    var stream = package_memory_pixels__1pixel_stream(pixel, asked.sample);
    var ray = package_memory_pixels__1streamed_ray(pixel, &stream);
    let hit = package_lightshed_cwbvh_intersect(ray);
    if hit.primitive == package_lightshed_ray_NOTHING {
        image[pixel] = vec4f(package_lightshed_emitter__1surroundings_radiance(ray.direction), 0.0);
        return;
    }
    let point = package_lightshed_surface__1surface_point(package_memory_scene__1load_triangle(hit.primitive), hit);
    let wo = package_lightshed_frame__1to_local(point.shading, -ray.direction);
    let at = package_selected__1shading_point(point, wo);
    let n = f32(asked.emitter_samples);
    var m = f32(asked.bsdf_samples);
    if package_lightshed_bsdf__2is_diffuse_alone(point.material) {
        m = 0.0;
    }
    var value = package_selected__1seen_emission(point, ray.direction);
    var scattered = vec3f(0.0);
    var words: array<u32, 16>;
    let samples = select(0u, asked.emitter_samples, asked.groups > 0u && package_lightshed_bsdf__2has_non_delta(point.material));
    for (var i = 0u; i < samples; i++) {
        if i % BATCH == 0u {
            for (var k = 0u; k < min(samples - i, BATCH); k++) {
                words[k] = package_lightshed_stream__1next_word(&stream);
            }
        }
        let u = stratified(i, words[i % BATCH]);
        let low = package_lightshed_wide__1wide_product(asked.groups, u.x);
        let high = package_lightshed_wide__1wide_product(asked.groups, u.y);
        let middle = high.x + low.y;
        let group = high.y + select(0u, 1u, middle < low.y);
        var light = package_selected__1no_light();
        if package_memory_scene__1HAS_EMITTERS && asked.has_tree == 1u && group == 0u {
            let choice = choose_light(at, vec2u(low.x, middle));
            if !(choice.pmf > 0.0) {
                continue;
            }
            let a = package_lightshed_stream__1next_number(&stream);
            let b = package_lightshed_stream__1next_number(&stream);
            light = package_selected_towards(choice.light, choice.pmf * finite_probability(), point.position, vec2f(a, b));
        }
        else {
            let a = package_lightshed_stream__1next_number(&stream);
            let b = package_lightshed_stream__1next_number(&stream);
            let direction = group - asked.has_tree;
            if package_memory_scene__2has_delta_emitters() && direction < package_memory_scene_settings.directions {
                light = package_lightshed_emitter__2towards_delta_emitter(package_memory_scene_settings.first_direction + direction, 1.0 / f32(max(asked.groups, 1u)), point.position);
            }
            else if package_memory_scene__1HAS_SURROUNDINGS {
                let around = package_lightshed_emitter__1sample_around(vec2f(a, b));
                let pdf = around.pdf * surroundings_probability();
                light = package_lightshed_emitter_EmitterSample(around.direction, pdf, around.radiance / pdf, false, vec3f(0.0));
            }
        }
        if !(light.pdf > 0.0) {
            continue;
        }
        let found = package_lightshed_bsdf__1evaluate_bsdf(point.material, wo, package_lightshed_frame__1to_local(point.shading, light.direction));
        if all(found.value == vec3f(0.0)) {
            continue;
        }
        var weight = 1.0;
        if m > 0.0 {
            weight = package_lightshed_measure__1power_heuristic(light.pdf * n, found.pdf * m);
        }
        if !package_lightshed_cwbvh_occluded(package_lightshed_emitter__1shadow_ray(point, light)) {
            scattered += found.value * light.weight * weight;
        }
    }
    var by_bsdf = vec3f(0.0);
    let draws = u32(m);
    for (var i = 0u; i < draws; i++) {
        let u_lobe = package_lightshed_stream__1next_number(&stream);
        let a = package_lightshed_stream__1next_number(&stream);
        let b = package_lightshed_stream__1next_number(&stream);
        let drawn = package_lightshed_bsdf__1sample_bsdf(point.material, wo, u_lobe, vec2f(a, b));
        if !drawn.some {
            continue;
        }
        ray = package_lightshed_surface_spawn(point, package_lightshed_frame__1to_world(point.shading, drawn.wi));
        let met = package_lightshed_cwbvh_intersect(ray);
        var emitted: vec3f;
        var pdf: f32;
        if met.primitive == package_lightshed_ray_NOTHING {
            emitted = package_lightshed_emitter__1surroundings_radiance(ray.direction);
            pdf = package_lightshed_emitter__1surroundings_density(ray.direction) * surroundings_probability();
        }
        else {
            let end = package_lightshed_surface__1surface_point(package_memory_scene__1load_triangle(met.primitive), met);
            emitted = package_selected__1seen_emission(end, ray.direction);
            if all(emitted == vec3f(0.0)) {
                continue;
            }
            pdf = 0.0;
            if !drawn.is_delta && package_memory_scene__1HAS_EMITTERS {
                let probability = light_pmf(at, end.emitter) * finite_probability();
                pdf = package_selected__1pdf_towards(end.emitter, probability, point.position, end.position);
            }
        }
        var weight = 1.0;
        if !drawn.is_delta {
            weight = package_lightshed_measure__1power_heuristic(drawn.pdf * m, pdf * n);
        }
        by_bsdf += drawn.weight * emitted * weight;
    }
    if m > 0.0 {
        value += by_bsdf / m;
    }
    image[pixel] = vec4f(value + scattered / n, 0.0);
}

struct package_lightshed__1light_bvh_FactorRows {
    first: u32,
    count: u32
}

const package_lightshed__1light_bvh__1BVH_LEAF: u32 = 2147483648u;

fn package_lightshed__1light_bvh__1bvh_shares(at: package_lightshed_importance_ShadingPoint, block: u32, row: u32) -> package_lightshed_importance_Eight {
    let weighting = package_lightshed_importance__2WEIGHTING_MIN_MAX + (block >> 31u);
    let ends = package_lightshed_importance__1surface_ends(at, package_lightshed_importance__1load_rows(block, 0u), package_lightshed_importance__1load_rows(block, 1u), weighting);
    if row == package_lightshed_ray_NOTHING {
        return ends;
    }
    let factors = package_memory__1light_cache__1load_factors(row);
    let low = package_lightshed__1light_bvh_opaque(ends.low, row);
    let high = package_lightshed__1light_bvh_opaque(ends.high, row);
    let own_low = package_lightshed__1light_bvh_opaque(low - vec4f(0.0, low.xyz), row);
    let own_high = package_lightshed__1light_bvh_opaque(high - vec4f(low.w, high.xyz), row);
    return package_lightshed_importance__1running_sums(package_lightshed_importance_Eight(package_lightshed__1light_bvh_opaque(own_low * factors.low, row), package_lightshed__1light_bvh_opaque(own_high * factors.high, row)));
}

const package_lightshed__1light_bvh__2MAX_BVH_DEPTH: u32 = 64u;

fn package_lightshed__1light_bvh__2factor_row_below(rows: package_lightshed__1light_bvh_FactorRows, row: u32, lane: u32) -> u32 {
    if row == package_lightshed_ray_NOTHING {
        return package_lightshed_ray_NOTHING;
    }
    let below = package_memory__1light_cache__3load_factor_row_below(row, lane);
    return select(package_lightshed_ray_NOTHING, rows.first + below, below < rows.count);
}

fn package_lightshed__1light_bvh__2first_factor_row(rows: package_lightshed__1light_bvh_FactorRows) -> u32 {
    return select(package_lightshed_ray_NOTHING, rows.first, rows.count > 0u);
}

fn package_lightshed__1light_bvh__2light_bvh_pmf(at: package_lightshed_importance_ShadingPoint, light: u32, rows: package_lightshed__1light_bvh_FactorRows) -> f32 {
    if !(at.reflectance_bound > 0.0) {
        return 0.0;
    }
    var places: array<u32, 64>;
    var count = 0u;
    var place = package_memory__1light_cache__2load_bvh_leaf(light);
    while (place != package_lightshed_ray_NOTHING && count < package_lightshed__1light_bvh__2MAX_BVH_DEPTH) {
        places[count] = place;
        count++;
        place = package_memory__1light_cache__2load_bvh_parent(place / 8u);
    }
    var probability = select(package_lightshed_double_ZERO, package_lightshed_double_ONE, count > 0u);
    var row = package_lightshed__1light_bvh__2first_factor_row(rows);
    while (count > 0u) {
        count--;
        let lane = places[count] % 8u;
        let ends = package_lightshed__1light_bvh__1bvh_shares(at, places[count] / 8u, row);
        if !(ends.high.w > 0.0) {
            return 0.0;
        }
        let share = package_lightshed__1light_tree__1share_of(ends, lane);
        let width = package_lightshed_double__1double_subtract(package_lightshed_double__2double_from_f32(share.end), package_lightshed_double__2double_from_f32(share.begin));
        probability = package_lightshed_double__1double_multiply(probability, package_lightshed_double__1double_divide(width, package_lightshed_double__2double_from_f32(ends.high.w)));
        row = package_lightshed__1light_bvh__2factor_row_below(rows, row, lane);
    }
    return package_lightshed_double__2double_to_f32(probability);
}

fn package_lightshed__1light_bvh__2light_bvh_sample(at: package_lightshed_importance_ShadingPoint, u: vec2u, rows: package_lightshed__1light_bvh_FactorRows) -> package_lightshed__1light_tree_LightChoice {
    if !(at.reflectance_bound > 0.0) {
        return package_lightshed__1light_tree_LightChoice(0u, 0.0);
    }
    var route = package_lightshed__1light_tree__1route_new(u);
    var block = 0u;
    var row = package_lightshed__1light_bvh__2first_factor_row(rows);
    for (var depth = 0u; depth < package_lightshed__1light_bvh__2MAX_BVH_DEPTH; depth++) {
        let step = package_lightshed__1light_tree__1route_step(route, package_lightshed__1light_bvh__1bvh_shares(at, block, row));
        if !step.alive {
            break;
        }
        route = step.route;
        let child = package_memory__1light_cache__2load_bvh_child(8u * block + step.lane);
        if (child & package_lightshed__1light_bvh__1BVH_LEAF) != 0u {
            return package_lightshed__1light_tree_LightChoice(child & ~package_lightshed__1light_bvh__1BVH_LEAF, package_lightshed_double__2double_to_f32(route.probability));
        }
        row = package_lightshed__1light_bvh__2factor_row_below(rows, row, step.lane);
        block = child;
    }
    return package_lightshed__1light_tree_LightChoice(0u, 0.0);
}

fn package_lightshed__1light_bvh_opaque(x: vec4f, row: u32) -> vec4f {
    return bitcast<vec4f>(bitcast<vec4u>(x) ^ vec4u(row >> 31u));
}

struct package_lightshed__1light_cache_CacheHead {
    buckets: u32,
    share: f32,
    explore_below: vec2u,
    first_block: u32,
    starts: u32,
    first_group: u32,
    groups: u32
}

struct package_lightshed__1light_cache_LightCache {
    octree: package_lightshed_octree_Octree,
    list_root: u32,
    factor_root: u32,
    heads: u32,
    row_starts: u32,
    unit_of: u32,
    unit_light: u32,
    unit_blocks: u32,
    lights: u32
}

struct package_lightshed__1light_cache_Listed {
    light: u32,
    probability: f32
}

const package_lightshed__1light_cache__1ALL_EXPLORE: vec2u = vec2u(4294967295u);

fn package_lightshed__1light_cache__1bucket_of(head: package_lightshed__1light_cache_CacheHead, unit: u32) -> u32 {
    if head.buckets == 1u {
        return 0u;
    }
    let firsts = head.starts + head.buckets + 1u;
    var low = 0u;
    var high = head.buckets;
    while (low < high) {
        let middle = (low + high) / 2u;
        if package_memory__1light_cache__2load_cache_word(firsts + middle) <= unit {
            low = middle + 1u;
        }
        else {
            high = middle;
        }
    }
    return max(low, 1u) - 1u;
}

fn package_lightshed__1light_cache__1cache_head(cache: package_lightshed__1light_cache_LightCache, position: vec3f) -> package_lightshed__1light_cache_CacheHead {
    let slot = package_lightshed__1light_cache__1cache_slot(cache, cache.list_root, position);
    if slot == package_lightshed_ray_NOTHING {
        return package_lightshed__1light_cache__1unknown_head();
    }
    let word = cache.heads + 8u * slot;
    return package_lightshed__1light_cache_CacheHead(package_memory__1light_cache__2load_cache_word(word), bitcast<f32>(package_memory__1light_cache__2load_cache_word(word + 1u)), vec2u(package_memory__1light_cache__2load_cache_word(word + 2u), package_memory__1light_cache__2load_cache_word(word + 3u)), package_memory__1light_cache__2load_cache_word(word + 4u), package_memory__1light_cache__2load_cache_word(word + 5u), package_memory__1light_cache__2load_cache_word(word + 6u), package_memory__1light_cache__2load_cache_word(word + 7u));
}

fn package_lightshed__1light_cache__1cache_slot(cache: package_lightshed__1light_cache_LightCache, root: u32, position: vec3f) -> u32 {
    let at = package_lightshed_octree__1octree_units(cache.octree, position);
    if root == package_lightshed_ray_NOTHING || !at.inside {
        return package_lightshed_ray_NOTHING;
    }
    return package_lightshed_octree__1octree_descend(root, 0u, at.units) - 8u * root;
}

fn package_lightshed__1light_cache__1explored_pmf(cache: package_lightshed__1light_cache_LightCache, at: package_lightshed_importance_ShadingPoint, light: u32) -> f32 {
    return package_lightshed__1light_bvh__2light_bvh_pmf(at, light, package_lightshed__1light_cache__1factor_rows(cache, at.position));
}

fn package_lightshed__1light_cache__1factor_rows(cache: package_lightshed__1light_cache_LightCache, position: vec3f) -> package_lightshed__1light_bvh_FactorRows {
    let slot = package_lightshed__1light_cache__1cache_slot(cache, cache.factor_root, position);
    if slot == package_lightshed_ray_NOTHING {
        return package_lightshed__1light_bvh_FactorRows(0u, 0u);
    }
    let first = package_memory__1light_cache__2load_cache_word(cache.row_starts + slot);
    return package_lightshed__1light_bvh_FactorRows(first, package_memory__1light_cache__2load_cache_word(cache.row_starts + slot + 1u) - first);
}

fn package_lightshed__1light_cache__1follow_lists(walk: ptr<function, package_lightshed__1light_walk_Walk>, cache: package_lightshed__1light_cache_LightCache, at: package_lightshed_importance_ShadingPoint, head: package_lightshed__1light_cache_CacheHead, wanted: u32, u: vec2u) -> package_lightshed__1light_cache_Listed {
    let chooses = wanted == package_lightshed_ray_NOTHING;
    var unit = package_lightshed_ray_NOTHING;
    if !chooses {
        unit = package_memory__1light_cache__2load_cache_word(cache.unit_of + wanted);
    }
    var light = wanted;
    var rest = u;
    var probability = 1.0;
    for (var stage = select(1u, 0u, head.buckets > 1u); stage < 3u; stage++) {
        var place = 0u;
        if chooses {
            if !(package_lightshed__1light_walk__1walk_total(walk) > 0.0) {
                return package_lightshed__1light_cache_Listed(package_lightshed_ray_NOTHING, 0.0);
            }
            let chosen = package_lightshed__1light_walk__1walk_choose(walk, rest);
            place = chosen.place;
            rest = chosen.rest;
        }
        else if stage == 0u {
            place = package_lightshed__1light_cache__1bucket_of(head, unit);
        }
        else {
            place = package_lightshed__1light_walk__1walk_find(walk, select(wanted, unit, stage == 1u));
            if place == package_lightshed_ray_NOTHING {
                return package_lightshed__1light_cache_Listed(wanted, 0.0);
            }
        }
        probability *= package_lightshed__1light_walk__1walk_probability(walk, place);
        var first = 0u;
        var end = 0u;
        if stage == 0u {
            first = head.first_block + package_memory__1light_cache__2load_cache_word(head.starts + place);
            end = head.first_block + package_memory__1light_cache__2load_cache_word(head.starts + place + 1u);
        }
        else {
            if chooses {
                let number = package_lightshed__1light_walk__1walk_light(walk, place);
                if stage == 1u {
                    unit = number;
                    light = package_memory__1light_cache__2load_cache_word(cache.unit_light + unit);
                }
                else {
                    light = number;
                }
            }
            if stage == 1u {
                first = package_memory__1light_cache__2load_cache_word(cache.unit_blocks + unit);
                end = package_memory__1light_cache__2load_cache_word(cache.unit_blocks + unit + 1u);
            }
            if stage == 2u || first == end || (!chooses && !(probability > 0.0)) {
                return package_lightshed__1light_cache_Listed(light, probability);
            }
        }
        package_lightshed__1light_walk__1walk_over(walk, at, first, end - first);
    }
    return package_lightshed__1light_cache_Listed(package_lightshed_ray_NOTHING, 0.0);
}

fn package_lightshed__1light_cache__1no_choice() -> package_lightshed__1light_tree_LightChoice {
    return package_lightshed__1light_tree_LightChoice(0u, 0.0);
}

fn package_lightshed__1light_cache__1unknown_head() -> package_lightshed__1light_cache_CacheHead {
    return package_lightshed__1light_cache_CacheHead(0u, 1.0, package_lightshed__1light_cache__1ALL_EXPLORE, 0u, 0u, 0u, 0u);
}

fn package_lightshed__1light_cache__2light_cache_pmf(at: package_lightshed_importance_ShadingPoint, light: u32) -> f32 {
    let cache = package_memory__1light_cache__1light_cache();
    if !(at.reflectance_bound > 0.0) || light >= cache.lights {
        return 0.0;
    }
    let head = package_lightshed__1light_cache__1cache_head(cache, at.position);
    var share = 1.0;
    var walk: package_lightshed__1light_walk_Walk;
    if !all(head.explore_below == package_lightshed__1light_cache__1ALL_EXPLORE) && !package_lightshed__1light_cache__2lists_are_black(&walk, at, head) {
        let listed = package_lightshed__1light_cache__1follow_lists(&walk, cache, at, head, light, vec2u(0u));
        if listed.probability > 0.0 {
            return (1.0 - head.share) * listed.probability;
        }
        share = head.share;
    }
    return share * package_lightshed__1light_cache__1explored_pmf(cache, at, light);
}

fn package_lightshed__1light_cache__2light_cache_sample(at: package_lightshed_importance_ShadingPoint, u: vec2u) -> package_lightshed__1light_tree_LightChoice {
    if !(at.reflectance_bound > 0.0) {
        return package_lightshed__1light_cache__1no_choice();
    }
    let cache = package_memory__1light_cache__1light_cache();
    let head = package_lightshed__1light_cache__1cache_head(cache, at.position);
    var is_unlisted = all(head.explore_below == package_lightshed__1light_cache__1ALL_EXPLORE);
    var walk: package_lightshed__1light_walk_Walk;
    if !is_unlisted {
        is_unlisted = package_lightshed__1light_cache__2lists_are_black(&walk, at, head);
    }
    let explores = is_unlisted || package_lightshed_wide__1wide_less(u, head.explore_below);
    var found = package_lightshed__1light_cache__1no_choice();
    var wanted = package_lightshed_ray_NOTHING;
    var rest = vec2u(0u);
    if explores {
        var number = u;
        if !is_unlisted {
            number = package_lightshed_wide__1wide_fraction(u, head.explore_below);
        }
        found = package_lightshed__1light_bvh__2light_bvh_sample(at, number, package_lightshed__1light_cache__1factor_rows(cache, at.position));
        if is_unlisted || !(found.pmf > 0.0) {
            return found;
        }
        wanted = found.light;
    }
    else {
        let above = package_lightshed_double__2double_from_wide(package_lightshed_wide__1wide_subtract(u, head.explore_below));
        rest = package_lightshed__1light_walk__1below_one(package_lightshed_double__1double_divide(above, package_lightshed_double__2double_from_wide(package_lightshed_wide__1wide_subtract(package_lightshed__1light_cache__1ALL_EXPLORE, head.explore_below))));
    }
    let listed = package_lightshed__1light_cache__1follow_lists(&walk, cache, at, head, wanted, rest);
    if explores {
        let pmf = select(head.share * found.pmf, 0.0, listed.probability > 0.0);
        return package_lightshed__1light_tree_LightChoice(found.light, pmf);
    }
    if listed.light == package_lightshed_ray_NOTHING {
        return package_lightshed__1light_cache__1no_choice();
    }
    if listed.probability > 0.0 {
        return package_lightshed__1light_tree_LightChoice(listed.light, (1.0 - head.share) * listed.probability);
    }
    return package_lightshed__1light_tree_LightChoice(listed.light, head.share * package_lightshed__1light_cache__1explored_pmf(cache, at, listed.light));
}

fn package_lightshed__1light_cache__2lists_are_black(walk: ptr<function, package_lightshed__1light_walk_Walk>, at: package_lightshed_importance_ShadingPoint, head: package_lightshed__1light_cache_CacheHead) -> bool {
    let has_groups = head.buckets > 1u;
    var first = head.first_group;
    var blocks = head.groups;
    if !has_groups {
        first = head.first_block + package_memory__1light_cache__2load_cache_word(head.starts);
        blocks = package_memory__1light_cache__2load_cache_word(head.starts + 1u) - package_memory__1light_cache__2load_cache_word(head.starts);
    }
    package_lightshed__1light_walk__1walk_over(walk, at, first, blocks);
    return !(package_lightshed__1light_walk__1walk_total(walk) > 0.0);
}

struct package_lightshed__1light_tree_LightChoice {
    light: u32,
    pmf: f32
}

struct package_lightshed__1light_tree_LightTree {
    lights: u32,
    depth: u32,
    stride: u32,
    weighting: u32
}

struct package_lightshed__1light_tree_Route {
    u: vec2u,
    probability: vec2u,
    used: vec2u,
    bits: vec2u
}

struct package_lightshed__1light_tree_Share {
    lane: u32,
    begin: f32,
    end: f32
}

struct package_lightshed__1light_tree_Step {
    alive: bool,
    lane: u32,
    route: package_lightshed__1light_tree_Route
}

const package_lightshed__1light_tree__1LARGEST_U: vec2u = vec2u(4294967294u, 1072693247u);

const package_lightshed__1light_tree__1REFRESH_BELOW: vec2u = vec2u(0u, 1045430272u);

fn package_lightshed__1light_tree__1leaf_probability(tree: package_lightshed__1light_tree_LightTree, at: package_lightshed_importance_ShadingPoint, leaf: u32, start_level: u32, before: vec2u) -> f32 {
    var probability = before;
    var level = start_level;
    while (level < tree.depth) {
        let below = package_lightshed__1light_tree__1level_below(tree, level);
        let node = leaf >> (tree.depth - below);
        let first = (leaf >> (tree.depth - level)) << (below - level);
        let ends = package_lightshed__1light_tree__1light_shares(tree, at, below, first);
        if !(ends.high.w > 0.0) {
            return 0.0;
        }
        let share = package_lightshed__1light_tree__1share_of(ends, node - first);
        let width = package_lightshed_double__1double_subtract(package_lightshed_double__2double_from_f32(share.end), package_lightshed_double__2double_from_f32(share.begin));
        probability = package_lightshed_double__1double_multiply(probability, package_lightshed_double__1double_divide(width, package_lightshed_double__2double_from_f32(ends.high.w)));
        if probability.y == 0u {
            return 0.0;
        }
        level = below;
    }
    return package_lightshed_double__2double_to_f32(probability);
}

fn package_lightshed__1light_tree__1level_below(tree: package_lightshed__1light_tree_LightTree, level: u32) -> u32 {
    let left = (tree.depth - level) % tree.stride;
    return level + select(left, tree.stride, left == 0u);
}

fn package_lightshed__1light_tree__1light_descent(tree: package_lightshed__1light_tree_LightTree, at: package_lightshed_importance_ShadingPoint, start_level: u32, start: u32, before: package_lightshed__1light_tree_Route) -> package_lightshed__1light_tree_LightChoice {
    var route = before;
    var level = start_level;
    var node = start;
    while (level < tree.depth) {
        let below = package_lightshed__1light_tree__1level_below(tree, level);
        let first = node << (below - level);
        let step = package_lightshed__1light_tree__1route_step(route, package_lightshed__1light_tree__1light_shares(tree, at, below, first));
        if !step.alive {
            return package_lightshed__1light_tree_LightChoice(0u, 0.0);
        }
        route = step.route;
        node = first + step.lane;
        level = below;
    }
    return package_lightshed__1light_tree_LightChoice(package_memory__1light_tree__2load_light_at(node), package_lightshed_double__2double_to_f32(route.probability));
}

fn package_lightshed__1light_tree__1light_shares(tree: package_lightshed__1light_tree_LightTree, at: package_lightshed_importance_ShadingPoint, level: u32, first: u32) -> package_lightshed_importance_Eight {
    let block = package_memory__1light_tree__2load_light_level(level) + first / 8u;
    if tree.stride == 1u {
        return package_lightshed_importance__1receiver_ends(at, package_lightshed_importance__1load_pair(block, first % 8u), package_lightshed_importance__1no_rows(), tree.weighting);
    }
    return package_lightshed_importance__1receiver_ends(at, package_lightshed_importance__1load_rows(block, 0u), package_lightshed_importance__1load_rows(block, 1u), tree.weighting);
}

fn package_lightshed__1light_tree__1route_new(bits: vec2u) -> package_lightshed__1light_tree_Route {
    return package_lightshed__1light_tree_Route(package_lightshed__1light_tree__1unit_double(bits), package_lightshed_double_ONE, package_lightshed_double_ONE, bits);
}

fn package_lightshed__1light_tree__1route_step(before: package_lightshed__1light_tree_Route, ends: package_lightshed_importance_Eight) -> package_lightshed__1light_tree_Step {
    if !(ends.high.w > 0.0) {
        return package_lightshed__1light_tree_Step(false, 0u, before);
    }
    var route = before;
    let total = package_lightshed_double__2double_from_f32(ends.high.w);
    let place = package_lightshed_double__1double_multiply(route.u, total);
    let share = package_lightshed__1light_tree__1share_at(ends, package_lightshed_double__2double_to_f32(place & vec2u(3758096384u, 4294967295u)));
    let begin = package_lightshed_double__2double_from_f32(share.begin);
    let width = package_lightshed_double__1double_subtract(package_lightshed_double__2double_from_f32(share.end), begin);
    let probability = package_lightshed_double__1double_divide(width, total);
    let rest = package_lightshed_double__1double_divide(package_lightshed_double__1double_subtract(place, begin), width);
    route.probability = package_lightshed_double__1double_multiply(route.probability, probability);
    route.used = package_lightshed_double__1double_multiply(route.used, probability);
    route.u = select(rest, vec2u(0u), rest.y >= 2147483648u);
    if package_lightshed_double__1double_less(package_lightshed__1light_tree__1LARGEST_U, route.u) {
        route.u = package_lightshed__1light_tree__1LARGEST_U;
    }
    if package_lightshed_double__1double_less(route.used, package_lightshed__1light_tree__1REFRESH_BELOW) {
        route.bits = package_lightshed__1light_tree_mixed(route.bits);
        route.u = package_lightshed__1light_tree__1unit_double(route.bits);
        route.used = package_lightshed_double_ONE;
    }
    return package_lightshed__1light_tree_Step(true, share.lane, route);
}

fn package_lightshed__1light_tree__1share_at(ends: package_lightshed_importance_Eight, below: f32) -> package_lightshed__1light_tree_Share {
    var share = package_lightshed__1light_tree_Share(0u, 0.0, ends.low.x);
    let passed = array<f32, 7>(ends.low.x, ends.low.y, ends.low.z, ends.low.w, ends.high.x, ends.high.y, ends.high.z);
    let next = array<f32, 7>(ends.low.y, ends.low.z, ends.low.w, ends.high.x, ends.high.y, ends.high.z, ends.high.w);
    for (var k = 0u; k < 7u; k++) {
        if passed[k] <= below {
            share = package_lightshed__1light_tree_Share(k + 1u, passed[k], next[k]);
        }
    }
    return share;
}

fn package_lightshed__1light_tree__1share_of(ends: package_lightshed_importance_Eight, lane: u32) -> package_lightshed__1light_tree_Share {
    let all = array<f32, 8>(ends.low.x, ends.low.y, ends.low.z, ends.low.w, ends.high.x, ends.high.y, ends.high.z, ends.high.w);
    return package_lightshed__1light_tree_Share(lane, select(all[max(lane, 1u) - 1u], 0.0, lane == 0u), all[lane]);
}

fn package_lightshed__1light_tree__1unit_double(bits: vec2u) -> vec2u {
    let whole = package_lightshed_double__2double_from_wide(package_lightshed_wide__2wide_shift_right(bits, 12u));
    return select(vec2u(whole.x, whole.y - (52u << 20u)), whole, whole.y == 0u);
}

fn package_lightshed__1light_tree__2light_tree_pmf(tree: package_lightshed__1light_tree_LightTree, at: package_lightshed_importance_ShadingPoint, light: u32) -> f32 {
    if !(at.reflectance_bound > 0.0) || light >= tree.lights {
        return 0.0;
    }
    return package_lightshed__1light_tree__1leaf_probability(tree, at, package_memory__1light_tree__2load_leaf_of(light), 0u, package_lightshed_double_ONE);
}

fn package_lightshed__1light_tree__2light_tree_sample(tree: package_lightshed__1light_tree_LightTree, at: package_lightshed_importance_ShadingPoint, u: vec2u) -> package_lightshed__1light_tree_LightChoice {
    if !(at.reflectance_bound > 0.0) {
        return package_lightshed__1light_tree_LightChoice(0u, 0.0);
    }
    return package_lightshed__1light_tree__1light_descent(tree, at, 0u, 0u, package_lightshed__1light_tree__1route_new(u));
}

fn package_lightshed__1light_tree_mixed(bits: vec2u) -> vec2u {
    var z = package_lightshed_wide__1wide_add(bits, vec2u(2135587861u, 2654435769u));
    z = package_lightshed_wide__1wide_multiply(z ^ package_lightshed_wide__2wide_shift_right(z, 30u), vec2u(484763065u, 3210233709u));
    z = package_lightshed_wide__1wide_multiply(z ^ package_lightshed_wide__2wide_shift_right(z, 27u), vec2u(321982955u, 2496678331u));
    return z ^ package_lightshed_wide__2wide_shift_right(z, 31u);
}

struct package_lightshed__1light_walk_Walk {
    ends: array<f32, 64>,
    count: u32,
    first_block: u32
}

struct package_lightshed__1light_walk_WalkChoice {
    place: u32,
    rest: vec2u
}

fn package_lightshed__1light_walk__1below_one(x: vec2u) -> vec2u {
    let positive = select(x, package_lightshed_double_ZERO, x.y >= 2147483648u);
    return select(positive, package_lightshed__1light_tree__1LARGEST_U, package_lightshed_double__1double_less(package_lightshed__1light_tree__1LARGEST_U, positive));
}

fn package_lightshed__1light_walk__1cache_row(block: u32, row: u32, half: u32) -> vec4f {
    return bitcast<vec4f>(package_memory__1light_cache__2load_cache_row(20u * block + 2u * row + half));
}

fn package_lightshed__1light_walk__1walk_before(walk: ptr<function, package_lightshed__1light_walk_Walk>, place: u32) -> f32 {
    if place == 0u {
        return 0.0;
    }
    return package_lightshed__1light_walk__1walk_end(walk, place - 1u);
}

fn package_lightshed__1light_walk__1walk_choose(walk: ptr<function, package_lightshed__1light_walk_Walk>, u: vec2u) -> package_lightshed__1light_walk_WalkChoice {
    let bound = package_lightshed_double__1double_multiply(u, package_lightshed_double__2double_from_f32(package_lightshed__1light_walk__1walk_total(walk)));
    let below = package_lightshed_double__2double_to_f32(bound & vec2u(3758096384u, 4294967295u));
    var place = 0u;
    for (var k = 0u; k < (*walk).count; k++) {
        if (*walk).ends[k] <= below {
            place = k + 1u;
        }
    }
    place = min(place, (*walk).count - 1u);
    let before = package_lightshed_double__2double_from_f32(package_lightshed__1light_walk__1walk_before(walk, place));
    let width = package_lightshed_double__1double_subtract(package_lightshed_double__2double_from_f32(package_lightshed__1light_walk__1walk_end(walk, place)), before);
    return package_lightshed__1light_walk_WalkChoice(place, package_lightshed__1light_walk__1below_one(package_lightshed_double__1double_divide(package_lightshed_double__1double_subtract(bound, before), width)));
}

fn package_lightshed__1light_walk__1walk_end(walk: ptr<function, package_lightshed__1light_walk_Walk>, place: u32) -> f32 {
    return (*walk).ends[min(place, 63u)];
}

fn package_lightshed__1light_walk__1walk_find(walk: ptr<function, package_lightshed__1light_walk_Walk>, light: u32) -> u32 {
    for (var half = 0u; half < (*walk).count / 4u; half++) {
        let numbers = package_memory__1light_cache__2load_cache_row(20u * ((*walk).first_block + half / 2u) + 18u + half % 2u);
        let same = numbers == vec4u(light);
        if any(same) {
            return 4u * half + select(select(select(3u, 2u, same.z), 1u, same.y), 0u, same.x);
        }
    }
    return package_lightshed_ray_NOTHING;
}

fn package_lightshed__1light_walk__1walk_light(walk: ptr<function, package_lightshed__1light_walk_Walk>, place: u32) -> u32 {
    let numbers = package_memory__1light_cache__2load_cache_row(20u * ((*walk).first_block + place / 8u) + 18u + (place % 8u) / 4u);
    return numbers[place % 4u];
}

fn package_lightshed__1light_walk__1walk_over(walk: ptr<function, package_lightshed__1light_walk_Walk>, at: package_lightshed_importance_ShadingPoint, first_block: u32, blocks: u32) {
    let count = min(blocks, package_lightshed__1light_walk__2MAX_WALK_BLOCKS);
    (*walk).count = 8u * count;
    (*walk).first_block = first_block;
    var before = 0.0;
    for (var block = 0u; block < count; block++) {
        let weights = package_lightshed_importance_Eight(package_lightshed__1light_walk__1walk_weights(at, first_block + block, 0u), package_lightshed__1light_walk__1walk_weights(at, first_block + block, 1u));
        let sums = package_lightshed_importance__1running_sums(weights);
        let low = package_lightshed_importance__2as_it_is(sums.low) + before;
        let high = package_lightshed_importance__2as_it_is(sums.high) + before;
        for (var lane = 0u; lane < 4u; lane++) {
            (*walk).ends[8u * block + lane] = low[lane];
            (*walk).ends[8u * block + 4u + lane] = high[lane];
        }
        before = high.w;
    }
}

fn package_lightshed__1light_walk__1walk_probability(walk: ptr<function, package_lightshed__1light_walk_Walk>, place: u32) -> f32 {
    let total = package_lightshed__1light_walk__1walk_total(walk);
    if !(total > 0.0) {
        return 0.0;
    }
    let width = package_lightshed_double__1double_subtract(package_lightshed_double__2double_from_f32(package_lightshed__1light_walk__1walk_end(walk, place)), package_lightshed_double__2double_from_f32(package_lightshed__1light_walk__1walk_before(walk, place)));
    return package_lightshed_double__2double_to_f32(package_lightshed_double__1double_divide(width, package_lightshed_double__2double_from_f32(total)));
}

fn package_lightshed__1light_walk__1walk_total(walk: ptr<function, package_lightshed__1light_walk_Walk>) -> f32 {
    return package_lightshed__1light_walk__1walk_before(walk, (*walk).count);
}

fn package_lightshed__1light_walk__1walk_weights(at: package_lightshed_importance_ShadingPoint, block: u32, half: u32) -> vec4f {
    let dx = package_lightshed__1light_walk__1cache_row(block, 0u, half) - at.position.x;
    let dy = package_lightshed__1light_walk__1cache_row(block, 1u, half) - at.position.y;
    let dz = package_lightshed__1light_walk__1cache_row(block, 2u, half) - at.position.z;
    let radius = package_lightshed__1light_walk__1cache_row(block, 6u, half);
    let all_around = package_lightshed__1light_walk__1cache_row(block, 7u, half);
    let intensity = package_lightshed__1light_walk__1cache_row(block, 8u, half);
    let squared = package_lightshed_importance__2as_it_is(package_lightshed_importance__1dot_rows(dx, dy, dz, dx, dy, dz));
    let distance = sqrt(squared);
    let along_light = package_lightshed_importance__2as_it_is(package_lightshed_importance__1dot_rows(package_lightshed__1light_walk__1cache_row(block, 3u, half), package_lightshed__1light_walk__1cache_row(block, 4u, half), package_lightshed__1light_walk__1cache_row(block, 5u, half), dx, dy, dz));
    let emitted = package_lightshed_importance__2as_it_is(package_lightshed_importance__2as_it_is(all_around * distance) - along_light) + radius;
    var received = distance + radius;
    if at.facing != package_lightshed_importance__1FACING_ALL {
        let n = at.normal;
        var along = package_lightshed_importance__2as_it_is(n.x * dx + n.y * dy + n.z * dz);
        if at.facing == package_lightshed_importance__1FACING_BOTH {
            along = abs(along);
        }
        received = along + radius;
    }
    let clamped = max(max(squared, radius * radius), vec4f(package_lightshed__1light_walk__2MIN_WALK_SQUARED));
    let zero = vec4f(0.0);
    let from_light = package_lightshed_importance__2as_it_is(package_lightshed_importance__2as_it_is(intensity * max(emitted, zero)) / clamped);
    let weight = from_light * package_lightshed_importance__2as_it_is(max(received, zero) / clamped);
    let positive = (intensity > zero) & (emitted > zero) & (received > zero);
    return select(zero, max(min(weight, vec4f(package_lightshed__1light_walk__2MAX_WALK_WEIGHT)), vec4f(package_lightshed__1light_walk__2MIN_WALK_WEIGHT)), positive);
}

const package_lightshed__1light_walk__2MAX_WALK_BLOCKS: u32 = 8u;

const package_lightshed__1light_walk__2MAX_WALK_WEIGHT: f32 = 1e30;

const package_lightshed__1light_walk__2MIN_WALK_SQUARED: f32 = 1e-18;

const package_lightshed__1light_walk__2MIN_WALK_WEIGHT: f32 = 1e-30;

const package_lightshed__1normal_ball__1CENTER_STEPS: f32 = 127.0;

const package_lightshed__1normal_ball__1RADIUS_STEP: f32 = 0.49803925;

struct package_lightshed_bsdf_BsdfSample {
    wi: vec3f,
    pdf: f32,
    weight: vec3f,
    is_delta: bool,
    some: bool,
    lobe: u32,
    eta: f32
}

struct package_lightshed_bsdf_BsdfValue {
    value: vec3f,
    pdf: f32
}

struct package_lightshed_bsdf_Component {
    kind: u32,
    side: u32,
    weight: f32,
    importance: f32,
    color: vec3f,
    alpha_u: f32,
    eta: vec3f,
    alpha_v: f32,
    k: vec3f,
    texture: u32
}

const package_lightshed_bsdf_DIFFUSE: u32 = 0u;

struct package_lightshed_bsdf_DeltaDraw {
    wi: vec3f,
    value: vec3f,
    eta: f32,
    some: bool
}

const package_lightshed_bsdf_MIRROR: u32 = 1u;

const package_lightshed_bsdf_PLASTIC: u32 = 7u;

const package_lightshed_bsdf__1GGX_DIELECTRIC: u32 = 5u;

const package_lightshed_bsdf__1GGX_PLASTIC: u32 = 8u;

const package_lightshed_bsdf__1SMOOTH_CONDUCTOR: u32 = 2u;

const package_lightshed_bsdf__1SMOOTH_DIELECTRIC: u32 = 4u;

const package_lightshed_bsdf__1THIN_DIELECTRIC: u32 = 6u;

fn package_lightshed_bsdf__1coat_of(component: package_lightshed_bsdf_Component) -> package_lightshed_coat_RoughCoat {
    return package_lightshed_coat_RoughCoat(vec2f(component.alpha_u, component.alpha_v), component.eta.x, u32(component.eta.z));
}

fn package_lightshed_bsdf__1component_at(material: package_lightshed_material_MaterialAt, rows: vec2u, i: u32) -> package_lightshed_bsdf_Component {
    var component = package_memory_scene__1load_component(rows.x + i);
    if package_memory_scene__1has_textures() && component.texture != 0u {
        component.color = package_lightshed_texture__1texture_color(component.texture - 1u, material.uv);
        if rows.y > 1u {
            component.importance = component.weight * package_lightshed_vector__1max_element(component.color);
        }
    }
    return component;
}

fn package_lightshed_bsdf__1evaluate_bsdf(material: package_lightshed_material_MaterialAt, wo: vec3f, wi: vec3f) -> package_lightshed_bsdf_BsdfValue {
    let rows = package_memory_scene__1load_material(material.index);
    let first = package_lightshed_bsdf__1component_at(material, rows, 0u);
    if rows.y == 1u && first.kind == package_lightshed_bsdf_DIFFUSE {
        let mirror = package_lightshed_bsdf__1mirror_of(first.side, wo);
        if mirror == 0.0 {
            return package_lightshed_bsdf_BsdfValue(vec3f(0.0), 0.0);
        }
        let density = max(wi.z * mirror, 0.0) * package_lightshed_warp__1INVERSE_PI;
        return package_lightshed_bsdf_BsdfValue(first.color * density, density);
    }
    let total = package_lightshed_bsdf__1total_importance(material, wo);
    var sum = package_lightshed_bsdf_BsdfValue(vec3f(0.0), 0.0);
    for (var i = 0u; i < rows.y; i++) {
        let component = package_lightshed_bsdf__1component_at(material, rows, i);
        let mirror = package_lightshed_bsdf__1mirror_of(component.side, wo);
        if mirror == 0.0 || package_lightshed_bsdf__1is_delta(component) {
            continue;
        }
        let above = package_lightshed_bsdf_mirrored(wo, mirror);
        let share = package_lightshed_bsdf__1share_of(component.importance, total);
        let probabilities = package_lightshed_bsdf__1lobe_probabilities(component, above, mirror < 0.0);
        let lobes = package_lightshed_bsdf__1lobe_count(component);
        for (var lobe = 0u; lobe < lobes; lobe++) {
            let found = package_lightshed_bsdf__1evaluate_component(component, lobe, above, package_lightshed_bsdf_mirrored(wi, mirror), mirror < 0.0);
            sum.value += found.value * component.weight;
            sum.pdf += found.pdf * share * select(probabilities.x, probabilities.y, lobe == 1u);
        }
    }
    return sum;
}

fn package_lightshed_bsdf__1evaluate_component(component: package_lightshed_bsdf_Component, lobe: u32, wo: vec3f, wi: vec3f, inside: bool) -> package_lightshed_bsdf_BsdfValue {
    let alpha = vec2f(component.alpha_u, component.alpha_v);
    if package_lightshed_bsdf__1is_dielectric(component) {
        let eta = package_lightshed_dielectric__1relative_eta(component.eta.x, inside);
        if lobe == 0u {
            let found = package_lightshed_dielectric__1boundary_reflection(alpha, wo, wi, eta);
            return package_lightshed_bsdf_BsdfValue(component.color * found.x, found.y);
        }
        let found = package_lightshed_dielectric__1boundary_refraction(alpha, wo, wi, eta);
        return package_lightshed_bsdf_BsdfValue(component.k * found.x, found.y);
    }
    if package_lightshed_bsdf__1is_plastic(component) {
        if wi.z <= 0.0 {
            return package_lightshed_bsdf_BsdfValue(vec3f(0.0), 0.0);
        }
        if lobe == 1u {
            let pdf = wi.z * package_lightshed_warp__1INVERSE_PI;
            var passed: f32;
            if component.kind == package_lightshed_bsdf__1GGX_PLASTIC {
                passed = package_lightshed_coat__1coat_transmittance(package_lightshed_bsdf__1coat_of(component), wo.z) * package_lightshed_coat__1coat_transmittance(package_lightshed_bsdf__1coat_of(component), wi.z);
            }
            else {
                passed = (1.0 - package_lightshed_bsdf__1smooth_reflectance(component, wo, false)) * (1.0 - package_lightshed_bsdf__1smooth_reflectance(component, wi, false));
            }
            return package_lightshed_bsdf_BsdfValue(component.k * (passed * pdf), pdf);
        }
        if component.kind == package_lightshed_bsdf_PLASTIC {
            return package_lightshed_bsdf_BsdfValue(vec3f(0.0), 0.0);
        }
        let found = package_lightshed_coat__1coat_reflection(package_lightshed_bsdf__1coat_of(component), wo, wi);
        return package_lightshed_bsdf_BsdfValue(component.color * found.x, found.y);
    }
    if component.kind == package_lightshed_bsdf_DIFFUSE {
        let pdf = max(wi.z, 0.0) * package_lightshed_warp__1INVERSE_PI;
        return package_lightshed_bsdf_BsdfValue(component.color * pdf, pdf);
    }
    if wi.z <= 0.0 {
        return package_lightshed_bsdf_BsdfValue(vec3f(0.0), 0.0);
    }
    let half = package_lightshed_vector__1normalized_or(wo + wi, vec3f(0.0));
    let facing = package_lightshed_vector_dot3(wo, half);
    var pdf = 0.0;
    if facing > 0.0 {
        pdf = package_lightshed_ggx__3ggx_visible_normal_density(alpha, wo, half) / (4.0 * facing);
    }
    let reflectance = component.color * package_lightshed_fresnel__1fresnel_conductor(clamp(facing, 0.0, 1.0), component.eta, component.k);
    return package_lightshed_bsdf_BsdfValue(reflectance * (pdf * package_lightshed_ggx__1ggx_masking(alpha, wi)), pdf);
}

fn package_lightshed_bsdf__1first_color(material: package_lightshed_material_MaterialAt) -> vec3f {
    return package_lightshed_bsdf__1component_at(material, package_memory_scene__1load_material(material.index), 0u).color;
}

fn package_lightshed_bsdf__1is_delta(component: package_lightshed_bsdf_Component) -> bool {
    return component.kind == package_lightshed_bsdf_MIRROR || component.kind == package_lightshed_bsdf__1SMOOTH_CONDUCTOR || component.kind == package_lightshed_bsdf__1SMOOTH_DIELECTRIC || component.kind == package_lightshed_bsdf__1THIN_DIELECTRIC;
}

fn package_lightshed_bsdf__1is_dielectric(component: package_lightshed_bsdf_Component) -> bool {
    return package_memory_scene__1has_dielectrics() && component.kind >= package_lightshed_bsdf__1SMOOTH_DIELECTRIC && component.kind <= package_lightshed_bsdf__1THIN_DIELECTRIC;
}

fn package_lightshed_bsdf__1is_plastic(component: package_lightshed_bsdf_Component) -> bool {
    return package_memory_scene__1has_plastics() && component.kind >= package_lightshed_bsdf_PLASTIC;
}

fn package_lightshed_bsdf__1lobe_count(component: package_lightshed_bsdf_Component) -> u32 {
    return select(1u, 2u, package_lightshed_bsdf__1is_dielectric(component) || package_lightshed_bsdf__1is_plastic(component));
}

fn package_lightshed_bsdf__1lobe_probabilities(component: package_lightshed_bsdf_Component, wo: vec3f, inside: bool) -> vec2f {
    if package_lightshed_bsdf__1is_dielectric(component) {
        var reflectance = package_lightshed_bsdf__1smooth_reflectance(component, wo, inside);
        if component.kind == package_lightshed_bsdf__1GGX_DIELECTRIC {
            reflectance = clamp(reflectance, 0.1, 0.9);
        }
        return package_lightshed_dielectric__1two_way(reflectance * package_lightshed_vector__1max_element(component.color), (1.0 - reflectance) * package_lightshed_vector__1max_element(component.k));
    }
    if package_lightshed_bsdf__1is_plastic(component) {
        if component.kind == package_lightshed_bsdf__1GGX_PLASTIC {
            let transmitted = clamp(package_lightshed_coat__1coat_transmittance(package_lightshed_bsdf__1coat_of(component), wo.z), 0.05, 0.95);
            return package_lightshed_dielectric__1two_way((1.0 - transmitted) * package_lightshed_vector__1max_element(component.color), transmitted * component.eta.y);
        }
        let reflectance = package_lightshed_bsdf__1smooth_reflectance(component, wo, inside);
        return package_lightshed_dielectric__1two_way(reflectance * package_lightshed_vector__1max_element(component.color), (1.0 - reflectance) * component.eta.y);
    }
    return vec2f(1.0, 0.0);
}

fn package_lightshed_bsdf__1mirror_of(side: u32, wo: vec3f) -> f32 {
    if wo.z > 0.0 && side != 1u {
        return 1.0;
    }
    if wo.z < 0.0 && side != 0u {
        return -1.0;
    }
    return 0.0;
}

fn package_lightshed_bsdf__1sample_bsdf(material: package_lightshed_material_MaterialAt, wo: vec3f, u_lobe: f32, u: vec2f) -> package_lightshed_bsdf_BsdfSample {
    let none = package_lightshed_bsdf_BsdfSample(vec3f(0.0), 0.0, vec3f(0.0), false, false, 0u, 1.0);
    let rows = package_memory_scene__1load_material(material.index);
    let first = package_lightshed_bsdf__1component_at(material, rows, 0u);
    if rows.y == 1u && first.kind == package_lightshed_bsdf_DIFFUSE {
        let mirror = package_lightshed_bsdf__1mirror_of(first.side, wo);
        let wi = package_lightshed_warp__1cosine_hemisphere(u);
        if mirror == 0.0 || !(wi.z > 0.0) {
            return none;
        }
        return package_lightshed_bsdf_BsdfSample(package_lightshed_bsdf_mirrored(wi, mirror), wi.z * package_lightshed_warp__1INVERSE_PI, first.color, false, true, 0u, 1.0);
    }
    let total = package_lightshed_bsdf__1total_importance(material, wo);
    var cumulative = 0.0;
    var probability = 0.0;
    var chosen = 0u;
    var chosen_lobe = 0u;
    var chosen_number = 0u;
    var number = 0u;
    for (var i = 0u; i < rows.y && !(u_lobe < cumulative); i++) {
        let component = package_lightshed_bsdf__1component_at(material, rows, i);
        let mirror = package_lightshed_bsdf__1mirror_of(component.side, wo);
        let lobes = package_lightshed_bsdf__1lobe_count(component);
        if mirror != 0.0 {
            let share = package_lightshed_bsdf__1share_of(component.importance, total);
            let probabilities = package_lightshed_bsdf__1lobe_probabilities(component, package_lightshed_bsdf_mirrored(wo, mirror), mirror < 0.0);
            for (var lobe = 0u; lobe < lobes; lobe++) {
                let part = share * select(probabilities.x, probabilities.y, lobe == 1u);
                if part <= 0.0 {
                    continue;
                }
                cumulative += part;
                probability = part;
                chosen = i;
                chosen_lobe = lobe;
                chosen_number = number + lobe;
                if u_lobe < cumulative {
                    break;
                }
            }
        }
        number += lobes;
    }
    if probability == 0.0 {
        return none;
    }
    let component = package_lightshed_bsdf__1component_at(material, rows, chosen);
    let mirror = package_lightshed_bsdf__1mirror_of(component.side, wo);
    let inside = mirror < 0.0;
    let above = package_lightshed_bsdf_mirrored(wo, mirror);
    if package_lightshed_bsdf__1is_delta(component) || (component.kind == package_lightshed_bsdf_PLASTIC && chosen_lobe == 0u) {
        let drawn = package_lightshed_bsdf__1sample_delta(component, chosen_lobe, above, inside);
        let weight = drawn.value * (component.weight / probability);
        return package_lightshed_bsdf_BsdfSample(package_lightshed_bsdf_mirrored(drawn.wi, mirror), 0.0, weight, true, drawn.some, chosen_number, drawn.eta);
    }
    var wi: vec3f;
    var eta = 1.0;
    if component.kind == package_lightshed_bsdf_DIFFUSE || (package_lightshed_bsdf__1is_plastic(component) && chosen_lobe == 1u) {
        wi = package_lightshed_warp__1cosine_hemisphere(u);
    }
    else {
        let normal = package_lightshed_ggx__2ggx_visible_normal(vec2f(component.alpha_u, component.alpha_v), above, u);
        if package_lightshed_bsdf__1is_dielectric(component) && chosen_lobe == 1u {
            eta = package_lightshed_dielectric__1relative_eta(component.eta.x, inside);
            wi = package_lightshed_dielectric__1refracted_direction(above, normal, eta);
            if !(wi.z < 0.0) {
                return none;
            }
        }
        else {
            wi = 2.0 * package_lightshed_vector_dot3(above, normal) * normal - above;
            if !(wi.z > 0.0) {
                return none;
            }
        }
    }
    wi = package_lightshed_bsdf_mirrored(wi, mirror);
    let found = package_lightshed_bsdf__1evaluate_bsdf(material, wo, wi);
    if !(found.pdf > 0.0) {
        return none;
    }
    return package_lightshed_bsdf_BsdfSample(wi, found.pdf, found.value / found.pdf, false, true, chosen_number, eta);
}

fn package_lightshed_bsdf__1sample_delta(component: package_lightshed_bsdf_Component, lobe: u32, above: vec3f, inside: bool) -> package_lightshed_bsdf_DeltaDraw {
    let reflected = vec3f(-above.xy, above.z);
    if package_lightshed_bsdf__1is_dielectric(component) || package_lightshed_bsdf__1is_plastic(component) {
        let reflectance = package_lightshed_bsdf__1smooth_reflectance(component, above, inside);
        if lobe == 0u {
            return package_lightshed_bsdf_DeltaDraw(reflected, component.color * reflectance, 1.0, true);
        }
        if component.kind == package_lightshed_bsdf__1THIN_DIELECTRIC {
            return package_lightshed_bsdf_DeltaDraw(-above, component.k * (1.0 - reflectance), 1.0, true);
        }
        let eta = package_lightshed_dielectric__1relative_eta(component.eta.x, inside);
        let cos_transmitted = package_lightshed_fresnel__1fresnel_dielectric(min(above.z, 1.0), eta).y;
        let wi = vec3f(-above.x / eta, -above.y / eta, -cos_transmitted);
        let value = component.k * ((1.0 - reflectance) / (eta * eta));
        return package_lightshed_bsdf_DeltaDraw(package_lightshed_vector_unit3(wi), value, eta, cos_transmitted > 0.0);
    }
    var value = component.color;
    if component.kind == package_lightshed_bsdf__1SMOOTH_CONDUCTOR {
        value = component.color * package_lightshed_fresnel__1fresnel_conductor(above.z, component.eta, component.k);
    }
    return package_lightshed_bsdf_DeltaDraw(reflected, value, 1.0, true);
}

fn package_lightshed_bsdf__1share_of(importance: f32, total: f32) -> f32 {
    if total > 0.0 {
        return importance / total;
    }
    return 0.0;
}

fn package_lightshed_bsdf__1smooth_reflectance(component: package_lightshed_bsdf_Component, wo: vec3f, inside: bool) -> f32 {
    let eta = select(component.eta.x, package_lightshed_dielectric__1relative_eta(component.eta.x, inside), component.kind <= package_lightshed_bsdf__1GGX_DIELECTRIC);
    let face = package_lightshed_fresnel__1fresnel_dielectric(min(wo.z, 1.0), eta).x;
    if component.kind == package_lightshed_bsdf__1THIN_DIELECTRIC {
        return 2.0 * face / (1.0 + face);
    }
    return face;
}

fn package_lightshed_bsdf__1total_importance(material: package_lightshed_material_MaterialAt, wo: vec3f) -> f32 {
    let rows = package_memory_scene__1load_material(material.index);
    var total = 0.0;
    for (var i = 0u; i < rows.y; i++) {
        let component = package_lightshed_bsdf__1component_at(material, rows, i);
        if package_lightshed_bsdf__1mirror_of(component.side, wo) != 0.0 {
            total += component.importance;
        }
    }
    return total;
}

fn package_lightshed_bsdf__2has_non_delta(material: package_lightshed_material_MaterialAt) -> bool {
    let rows = package_memory_scene__1load_material(material.index);
    for (var i = 0u; i < rows.y; i++) {
        if !package_lightshed_bsdf__1is_delta(package_memory_scene__1load_component(rows.x + i)) {
            return true;
        }
    }
    return false;
}

fn package_lightshed_bsdf__2is_diffuse_alone(material: package_lightshed_material_MaterialAt) -> bool {
    let rows = package_memory_scene__1load_material(material.index);
    return rows.y == 1u && package_memory_scene__1load_component(rows.x).kind == package_lightshed_bsdf_DIFFUSE;
}

fn package_lightshed_bsdf_mirrored(v: vec3f, mirror: f32) -> vec3f {
    return vec3f(v.xy, v.z * mirror);
}

struct package_lightshed_camera_Camera {
    x_axis: vec3f,
    aperture_radius: f32,
    y_axis: vec3f,
    focus_distance: f32,
    z_axis: vec3f,
    near_clip: f32,
    position: vec3f,
    far_clip: f32,
    corner: vec2f,
    pixel: vec2f,
    size: vec2u,
    padding: vec2u
}

fn package_lightshed_camera__1camera_ray(camera: package_lightshed_camera_Camera, film: vec2f, u_lens: vec2f) -> package_lightshed_ray_Ray {
    let through = vec3f(camera.corner + camera.pixel * film, 1.0);
    var origin = vec3f(0.0);
    var direction = through;
    if camera.aperture_radius > 0.0 {
        origin = vec3f(package_lightshed_warp__1concentric_disk(u_lens) * camera.aperture_radius, 0.0);
        direction = through * camera.focus_distance - origin;
    }
    direction = direction / package_lightshed_vector_length3(direction);
    let along_axis = direction.z;
    let scaled = package_lightshed_camera_turned(camera, direction);
    let world_origin = package_lightshed_camera_turned(camera, origin) + camera.position;
    let length = package_lightshed_vector_length3(scaled);
    let world_direction = scaled / length;
    let near = camera.near_clip / along_axis * length;
    let far = camera.far_clip / along_axis * length;
    return package_lightshed_ray_Ray(world_origin + world_direction * near, far - near, world_direction, 0u);
}

fn package_lightshed_camera_turned(camera: package_lightshed_camera_Camera, v: vec3f) -> vec3f {
    return camera.x_axis * v.x + camera.y_axis * v.y + camera.z_axis * v.z;
}

struct package_lightshed_coat_RoughCoat {
    alpha: vec2f,
    eta: f32,
    table: u32
}

const package_lightshed_coat__1COAT_STEPS: u32 = 138u;

fn package_lightshed_coat__1coat_reflection(coat: package_lightshed_coat_RoughCoat, wo: vec3f, wi: vec3f) -> vec2f {
    return package_lightshed_dielectric__1boundary_reflection(coat.alpha, wo, wi, coat.eta);
}

fn package_lightshed_coat__1coat_transmittance(coat: package_lightshed_coat_RoughCoat, cos_theta: f32) -> f32 {
    let position = sqrt(clamp(cos_theta, 0.0, 1.0)) * f32(package_lightshed_coat__1COAT_STEPS);
    let node = min(u32(position), package_lightshed_coat__1COAT_STEPS - 1u);
    let place = coat.table * (package_lightshed_coat__1COAT_STEPS + 1u) + node;
    let low = package_memory_scene__1load_coat(place);
    return clamp(low + (package_memory_scene__1load_coat(place + 1u) - low) * (position - f32(node)), 0.0, 1.0);
}

const package_lightshed_color_LUMINANCE: vec3f = vec3f(0.212671, 0.71516, 0.072169);

fn package_lightshed_color_luminance(rgb: vec3f) -> f32 {
    return package_lightshed_vector_dot3(rgb, package_lightshed_color_LUMINANCE);
}

struct package_lightshed_cwbvh_BoxRay {
    origin: vec3f,
    inverse: vec3f,
    backwards: vec3<bool>,
    octant: u32
}

struct package_lightshed_cwbvh_CwbvhNode {
    corner: vec3f,
    exponents_and_inner: u32,
    child_base: u32,
    primitive_base: u32,
    meta_low: u32,
    meta_high: u32,
    x: vec4u,
    y: vec4u,
    z: vec4u
}

struct package_lightshed_cwbvh_TriangleCorners {
    a: vec3f,
    b: vec3f,
    c: vec3f
}

const package_lightshed_cwbvh__1CWBVH_STACK: u32 = 32u;

const package_lightshed_cwbvh__1LARGEST_INVERSE: f32 = 3e38;

fn package_lightshed_cwbvh__1box_ray(ray: package_lightshed_ray_Ray) -> package_lightshed_cwbvh_BoxRay {
    let largest = vec3f(package_lightshed_cwbvh__1LARGEST_INVERSE);
    let inverse = clamp(1.0 / ray.direction, -largest, largest);
    let backwards = (bitcast<vec3u>(ray.direction) >> vec3u(31u)) == vec3u(1u);
    let octant = select(vec3u(4u, 2u, 1u), vec3u(0u), backwards);
    return package_lightshed_cwbvh_BoxRay(ray.origin, inverse, backwards, octant.x | octant.y | octant.z);
}

fn package_lightshed_cwbvh__1byte_of(low: u32, high: u32, index: u32) -> u32 {
    return (select(low, high, index >= 4u) >> ((index & 3u) * 8u)) & 255u;
}

fn package_lightshed_cwbvh__1hit_children(node: package_lightshed_cwbvh_CwbvhNode, ray: package_lightshed_cwbvh_BoxRay, t_max: f32) -> u32 {
    let exponents = node.exponents_and_inner;
    let scale = bitcast<vec3f>((vec3u(exponents, exponents >> 8u, exponents >> 16u) & vec3u(255u)) << vec3u(23u));
    let inner = exponents >> 24u;
    var hits = 0u;
    for (var child = 0u; child < 8u; child++) {
        let about = package_lightshed_cwbvh__1byte_of(node.meta_low, node.meta_high, child);
        if about == 0u {
            continue;
        }
        let low = node.corner + scale * vec3f(vec3u(package_lightshed_cwbvh__1byte_of(node.x.x, node.x.y, child), package_lightshed_cwbvh__1byte_of(node.y.x, node.y.y, child), package_lightshed_cwbvh__1byte_of(node.z.x, node.z.y, child)));
        let high = node.corner + scale * vec3f(vec3u(package_lightshed_cwbvh__1byte_of(node.x.z, node.x.w, child), package_lightshed_cwbvh__1byte_of(node.y.z, node.y.w, child), package_lightshed_cwbvh__1byte_of(node.z.z, node.z.w, child)));
        let x = package_lightshed_cwbvh_slab(low.x, high.x, ray.origin.x, ray.inverse.x, ray.backwards.x);
        let y = package_lightshed_cwbvh_slab(low.y, high.y, ray.origin.y, ray.inverse.y, ray.backwards.y);
        let z = package_lightshed_cwbvh_slab(low.z, high.z, ray.origin.z, ray.inverse.z, ray.backwards.z);
        let near = max(max(x.x, y.x), max(z.x, 0.0));
        let far = min(min(x.y, y.y), min(z.y, t_max));
        if near <= far * 1.0000005 {
            if ((inner >> child) & 1u) == 1u {
                hits |= 1u << (24u + (child ^ ray.octant));
            }
            else {
                hits |= (about >> 5u) << (about & 31u);
            }
        }
    }
    return hits;
}

fn package_lightshed_cwbvh_intersect(ray: package_lightshed_ray_Ray) -> package_lightshed_ray_Hit {
    return package_lightshed_cwbvh_traverse(ray, false, false);
}

fn package_lightshed_cwbvh_occluded(ray: package_lightshed_ray_Ray) -> bool {
    return package_lightshed_cwbvh_traverse(ray, true, false).primitive != package_lightshed_ray_NOTHING;
}

fn package_lightshed_cwbvh_slab(low: f32, high: f32, origin: f32, inverse: f32, backwards: bool) -> vec2f {
    let bottom = low - abs(low) * 2.4e-7;
    let top = high + abs(high) * 2.4e-7;
    if abs(inverse) >= package_lightshed_cwbvh__1LARGEST_INVERSE {
        return select(vec2f(1.0, -1.0), vec2f(-package_lightshed_cwbvh__1LARGEST_INVERSE, package_lightshed_cwbvh__1LARGEST_INVERSE), bottom <= origin && origin <= top);
    }
    let planes = select(vec2f(bottom, top), vec2f(top, bottom), backwards);
    return (planes - origin) * inverse;
}

fn package_lightshed_cwbvh_traverse(ray: package_lightshed_ray_Ray, any: bool, opaque: bool) -> package_lightshed_ray_Hit {
    let boxes = package_lightshed_cwbvh__1box_ray(ray);
    let triangles = package_lightshed_triangle__1triangle_ray(ray);
    var best = package_lightshed_ray_Hit(ray.t_max, package_lightshed_ray_NOTHING, vec2f(0.0));
    var stack: array<vec2u, 32>;
    var depth = 0u;
    var group = vec2u(0u, (1u << (24u + boxes.octant)) | 1u);
    loop {
        if group.y >= 16777216u {
            let bit = firstLeadingBit(group.y);
            group.y &= ~(1u << bit);
            let slot = (bit - 24u) ^ boxes.octant;
            let before = countOneBits(group.y & 255u & ((1u << slot) - 1u));
            let index = group.x + before;
            if group.y >= 16777216u && depth < package_lightshed_cwbvh__1CWBVH_STACK {
                stack[depth] = group;
                depth++;
            }
            let node = package_memory_scene__2load_cwbvh_node(index);
            let hits = package_lightshed_cwbvh__1hit_children(node, boxes, best.t);
            var primitives = hits & 16777215u;
            while (primitives != 0u) {
                let offset = firstTrailingBit(primitives);
                primitives &= primitives - 1u;
                let primitive = package_memory_scene__2load_cwbvh_primitive(node.primitive_base + offset);
                if opaque && package_memory_scene__1lets_pass(primitive) {
                    continue;
                }
                let corners = package_memory_scene__2load_triangle_corners(primitive);
                let hit = package_lightshed_triangle__1intersect_triangle(triangles, corners.a, corners.b, corners.c, primitive, ray.t_max);
                if hit.primitive != package_lightshed_ray_NOTHING && (hit.t < best.t || (hit.t == best.t && hit.primitive < best.primitive)) {
                    best = hit;
                    if any {
                        return best;
                    }
                }
            }
            group = vec2u(node.child_base, (hits & 4278190080u) | (node.exponents_and_inner >> 24u));
        }
        else if depth > 0u {
            depth--;
            group = stack[depth];
        }
        else {
            break;
        }
    }
    return best;
}

fn package_lightshed_dielectric__1boundary_reflection(alpha: vec2f, wo: vec3f, wi: vec3f, eta: f32) -> vec2f {
    if wi.z <= 0.0 {
        return vec2f(0.0);
    }
    let half = package_lightshed_vector__1normalized_or(wo + wi, vec3f(0.0));
    let facing = package_lightshed_vector_dot3(wo, half);
    let reflectance = package_lightshed_fresnel__1fresnel_dielectric(clamp(facing, 0.0, 1.0), eta).x;
    var pdf = 0.0;
    if facing > 0.0 {
        pdf = package_lightshed_ggx__3ggx_visible_normal_density(alpha, wo, half) / (4.0 * facing);
    }
    return vec2f(reflectance * pdf * package_lightshed_ggx__1ggx_masking(alpha, wi), pdf);
}

fn package_lightshed_dielectric__1boundary_refraction(alpha: vec2f, wo: vec3f, wi: vec3f, eta: f32) -> vec2f {
    if wi.z >= 0.0 {
        return vec2f(0.0);
    }
    let unnormalised = wo + eta * wi;
    var half = package_lightshed_vector__1normalized_or(unnormalised, vec3f(0.0));
    half = select(half, -half, half.z < 0.0);
    let cos_o = package_lightshed_vector_dot3(wo, half);
    let cos_i = package_lightshed_vector_dot3(wi, half);
    if !(cos_o > 0.0 && cos_i < 0.0) {
        return vec2f(0.0);
    }
    let reflectance = package_lightshed_fresnel__1fresnel_dielectric(min(cos_o, 1.0), eta).x;
    let jacobian = eta * eta * -cos_i / package_lightshed_vector_dot3(unnormalised, unnormalised);
    let pdf = package_lightshed_ggx__3ggx_visible_normal_density(alpha, wo, half) * jacobian;
    let transmitted = (1.0 - reflectance) / (eta * eta);
    return vec2f(transmitted * pdf * package_lightshed_ggx__1ggx_masking(alpha, wi), pdf);
}

fn package_lightshed_dielectric__1refracted_direction(wo: vec3f, normal: vec3f, eta: f32) -> vec3f {
    let cos_o = clamp(package_lightshed_vector_dot3(wo, normal), 0.0, 1.0);
    let cos_transmitted = package_lightshed_fresnel__1fresnel_dielectric(cos_o, eta).y;
    if cos_transmitted <= 0.0 {
        return vec3f(0.0, 0.0, 1.0);
    }
    return package_lightshed_vector_unit3((cos_o / eta - cos_transmitted) * normal - wo / eta);
}

fn package_lightshed_dielectric__1relative_eta(eta: f32, inside: bool) -> f32 {
    return select(eta, 1.0 / eta, inside);
}

fn package_lightshed_dielectric__1two_way(a: f32, b: f32) -> vec2f {
    let sum = a + b;
    if sum > 0.0 {
        let first = a / sum;
        return vec2f(first, 1.0 - first);
    }
    return vec2f(0.0);
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

struct package_lightshed_emitter_Aim {
    direction: vec3f,
    distance_squared: f32,
    cos_theta: f32,
    goal: vec3f
}

struct package_lightshed_emitter_Around {
    direction: vec3f,
    pdf: f32,
    radiance: vec3f
}

struct package_lightshed_emitter_DeltaEmitter {
    place: vec3f,
    probability: f32,
    intensity: vec3f,
    cos_beam: f32,
    axis: vec3f,
    cos_cutoff: f32,
    cutoff_angle: f32,
    inverse_transition: f32,
    padding0: u32,
    padding1: u32
}

struct package_lightshed_emitter_Emitter {
    corner: vec3f,
    pdf_area: f32,
    edge0: vec3f,
    radiance_r: f32,
    edge1: vec3f,
    radiance_g: f32,
    normal: vec3f,
    radiance_b: f32
}

struct package_lightshed_emitter_EmitterGroups {
    surroundings: vec3f,
    groups: u32,
    triangles: u32,
    finite: u32,
    first_direction: u32,
    directions: u32
}

struct package_lightshed_emitter_EmitterSample {
    direction: vec3f,
    pdf: f32,
    weight: vec3f,
    finite: bool,
    goal: vec3f
}

const package_lightshed_emitter_SURROUNDINGS: u32 = 4294967294u;

const package_lightshed_emitter__1SEGMENT_END: f32 = 0.9999981;

fn package_lightshed_emitter__1aim_at(emitter: package_lightshed_emitter_Emitter, from_position: vec3f, barycentric: vec2f) -> package_lightshed_emitter_Aim {
    let along = emitter.edge0 * barycentric.x;
    let across = emitter.edge1 * barycentric.y;
    let point = emitter.corner + along + across;
    let d = point - from_position;
    let distance_squared = package_lightshed_vector_dot3(d, d);
    let facing = package_lightshed_vector_dot3(-emitter.normal, d);
    if !(facing > 0.0) {
        return package_lightshed_emitter_Aim(vec3f(0.0), 0.0, 0.0, vec3f(0.0));
    }
    let distance = sqrt(distance_squared);
    let magnitude = abs(emitter.corner) + abs(along) + abs(across);
    let extent = package_lightshed_vector__1max_element(max(abs(emitter.edge0), abs(emitter.edge1)));
    let offset = package_lightshed_surface__1offset_for(emitter.normal, magnitude, extent);
    let goal = package_lightshed_surface__1offset_along(point, emitter.normal, offset, from_position - point);
    return package_lightshed_emitter_Aim(d / distance, distance_squared, facing / distance, goal);
}

fn package_lightshed_emitter__1emitter_radiance(emitter: package_lightshed_emitter_Emitter) -> vec3f {
    return vec3f(emitter.radiance_r, emitter.radiance_g, emitter.radiance_b);
}

fn package_lightshed_emitter__1sample_around(u: vec2f) -> package_lightshed_emitter_Around {
    if package_memory_scene__1has_sky() {
        let drawn = package_lightshed_sky__1sky_sample(u);
        return package_lightshed_emitter_Around(drawn.direction, drawn.pdf, drawn.radiance);
    }
    return package_lightshed_emitter_Around(package_lightshed_warp__1uniform_sphere(u), package_lightshed_warp__2INVERSE_FOUR_PI, package_memory_scene__1emitter_groups().surroundings);
}

fn package_lightshed_emitter__1shadow_ray(point: package_lightshed_surface_SurfacePoint, light: package_lightshed_emitter_EmitterSample) -> package_lightshed_ray_Ray {
    let origin = package_lightshed_surface__1origin_towards(point, light.direction);
    if light.finite {
        return package_lightshed_ray_Ray(origin, package_lightshed_emitter__1SEGMENT_END, light.goal - origin, 0u);
    }
    return package_lightshed_ray_Ray(origin, package_lightshed_ray__1NO_END, light.direction, 0u);
}

fn package_lightshed_emitter__1spot_intensity(light: package_lightshed_emitter_DeltaEmitter, direction: vec3f) -> vec3f {
    let cos_theta = package_lightshed_vector_dot3(light.axis, direction);
    if cos_theta >= light.cos_beam {
        return light.intensity;
    }
    if cos_theta <= light.cos_cutoff {
        return vec3f(0.0);
    }
    let chord = direction - light.axis;
    let sine = min(0.5 * package_lightshed_vector_length3(chord), 1.0);
    let angle = 2.0 * package_lightshed_warp_TAU * package_lightshed_turn__1turn_of(sine, sqrt(max(1.0 - sine * sine, 0.0)));
    return light.intensity * max((light.cutoff_angle - angle) * light.inverse_transition, 0.0);
}

fn package_lightshed_emitter__1surroundings_density(direction: vec3f) -> f32 {
    if package_memory_scene__1has_sky() {
        return package_lightshed_sky__1sky_pdf(direction);
    }
    return package_lightshed_warp__2INVERSE_FOUR_PI;
}

fn package_lightshed_emitter__1surroundings_radiance(direction: vec3f) -> vec3f {
    if package_memory_scene__1has_sky() {
        return package_lightshed_sky__1sky_radiance(direction);
    }
    return package_memory_scene__1emitter_groups().surroundings;
}

const package_lightshed_emitter__2NO_OTHER_WAY: f32 = 1e30;

fn package_lightshed_emitter__2is_delta_emitter(index: u32) -> bool {
    let about = package_memory_scene__1emitter_groups();
    return index >= about.triangles && index != package_lightshed_emitter_SURROUNDINGS;
}

fn package_lightshed_emitter__2towards_delta_emitter(index: u32, probability: f32, from_position: vec3f) -> package_lightshed_emitter_EmitterSample {
    let none = package_lightshed_emitter_EmitterSample(vec3f(0.0), 0.0, vec3f(0.0), true, vec3f(0.0));
    let light = package_memory_scene__2load_delta_emitter(index);
    if index >= package_memory_scene__1emitter_groups().first_direction {
        return package_lightshed_emitter_EmitterSample(light.place, package_lightshed_emitter__2NO_OTHER_WAY, light.intensity / probability, false, vec3f(0.0));
    }
    let d = light.place - from_position;
    let distance_squared = package_lightshed_vector_dot3(d, d);
    let inverse = 1.0 / sqrt(distance_squared);
    if !(distance_squared > 0.0) || !package_lightshed_vector__1is_finite(inverse) {
        return none;
    }
    let intensity = package_lightshed_emitter__1spot_intensity(light, -d * inverse);
    let weight = intensity / (distance_squared * probability);
    if all(intensity == vec3f(0.0)) || !(package_lightshed_vector__1is_finite(weight.x) && package_lightshed_vector__1is_finite(weight.y) && package_lightshed_vector__1is_finite(weight.z)) {
        return none;
    }
    return package_lightshed_emitter_EmitterSample(d / sqrt(distance_squared), package_lightshed_emitter__2NO_OTHER_WAY, weight, true, light.place);
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;

const package_lightshed_float__2F32_MIN_POSITIVE: f32 = 1.1754944e-38;

struct package_lightshed_frame_Frame {
    tangent: vec3f,
    bitangent: vec3f,
    normal: vec3f
}

fn package_lightshed_frame__1to_local(frame: package_lightshed_frame_Frame, v: vec3f) -> vec3f {
    return vec3f(package_lightshed_vector_dot3(frame.tangent, v), package_lightshed_vector_dot3(frame.bitangent, v), package_lightshed_vector_dot3(frame.normal, v));
}

fn package_lightshed_frame__1to_world(frame: package_lightshed_frame_Frame, v: vec3f) -> vec3f {
    return frame.tangent * v.x + frame.bitangent * v.y + frame.normal * v.z;
}

fn package_lightshed_frame__2frame_from_normal(normal: vec3f) -> package_lightshed_frame_Frame {
    let sign = package_lightshed_vector__1copy_sign(1.0, normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    return package_lightshed_frame_Frame(vec3f(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x), vec3f(b, sign + normal.y * normal.y * a, -normal.y), normal);
}

const package_lightshed_fresnel__1LEAST_NORMAL: f32 = 1.1754944e-38;

fn package_lightshed_fresnel__1fresnel_conductor(cos_incident: f32, eta: vec3f, k: vec3f) -> vec3f {
    let c2 = cos_incident * cos_incident;
    let s2 = max(1.0 - c2, 0.0);
    let eta2_k2 = eta * eta * k * k;
    let t = eta * eta - (k * k + s2);
    let modulus = sqrt(t * t + 4.0 * eta2_k2);
    let larger = 0.5 * (modulus + abs(t));
    let smaller = min(eta2_k2 / max(larger, vec3f(package_lightshed_fresnel__1LEAST_NORMAL)), larger);
    let positive = t >= vec3f(0.0);
    let a = sqrt(select(smaller, larger, positive));
    let b2 = select(larger, smaller, positive);
    let less = a - cos_incident;
    let more = a + cos_incident;
    let senkrecht = (less * less + b2) / max(more * more + b2, vec3f(package_lightshed_fresnel__1LEAST_NORMAL));
    let below = a * cos_incident - s2;
    let above = a * cos_incident + s2;
    let ratio = (below * below + b2 * c2) / max(above * above + b2 * c2, vec3f(package_lightshed_fresnel__1LEAST_NORMAL));
    return 0.5 * senkrecht * (1.0 + ratio);
}

fn package_lightshed_fresnel__1fresnel_dielectric(cos_incident: f32, eta: f32) -> vec2f {
    if eta == 1.0 {
        return vec2f(0.0, cos_incident);
    }
    var radicand: f32;
    if eta > 0.5 {
        radicand = (eta - 1.0) * (eta + 1.0) + cos_incident * cos_incident;
    }
    else {
        radicand = eta * eta - (1.0 - cos_incident) * (1.0 + cos_incident);
    }
    if radicand <= 0.0 {
        return vec2f(1.0, 0.0);
    }
    let cos_transmitted = min(sqrt(radicand) / eta, 1.0);
    let senkrecht = (cos_incident - eta * cos_transmitted) / (cos_incident + eta * cos_transmitted);
    let parallel = (eta * cos_incident - cos_transmitted) / (eta * cos_incident + cos_transmitted);
    return vec2f(0.5 * (senkrecht * senkrecht + parallel * parallel), cos_transmitted);
}

fn package_lightshed_ggx__1ggx_masking(alpha: vec2f, direction: vec3f) -> f32 {
    let z = abs(direction.z);
    let length = package_lightshed_vector_length3(package_lightshed_ggx_stretch(alpha, direction));
    if length > 0.0 {
        return 2.0 * z / (z + length);
    }
    return 0.0;
}

fn package_lightshed_ggx__2ggx_normal_density(alpha: vec2f, normal: vec3f) -> f32 {
    if !(normal.z > 0.0) {
        return 0.0;
    }
    let xy = normal.xy / alpha;
    let q = xy.x * xy.x + xy.y * xy.y + normal.z * normal.z;
    return package_lightshed_warp__1INVERSE_PI / (alpha.x * q * (alpha.y * q));
}

fn package_lightshed_ggx__2ggx_visible_normal(alpha: vec2f, view: vec3f, u: vec2f) -> vec3f {
    let z_axis = vec3f(0.0, 0.0, 1.0);
    let seen = package_lightshed_vector__1normalized_or(package_lightshed_ggx_stretch(alpha, vec3f(view.xy, max(view.z, 0.0))), z_axis);
    let above = u.y * (1.0 + seen.z);
    let sum_z = max(1.0 - u.y, 5.9604645e-8) * (1.0 + seen.z);
    let one_minus_z = (seen.x * seen.x + seen.y * seen.y) / (1.0 + seen.z);
    let sin_theta = sqrt(above * (sum_z + one_minus_z));
    let turn = package_lightshed_turn__2sin_cos_turns(u.x);
    let half = vec3f(sin_theta * turn.y + seen.x, sin_theta * turn.x + seen.y, sum_z);
    return package_lightshed_vector__1normalized_or(package_lightshed_ggx_stretch(alpha, half), z_axis);
}

fn package_lightshed_ggx__3ggx_visible_normal_density(alpha: vec2f, view: vec3f, normal: vec3f) -> f32 {
    let above = vec3f(view.xy, max(view.z, 0.0));
    let denominator = above.z + package_lightshed_vector_length3(package_lightshed_ggx_stretch(alpha, above));
    let facing = package_lightshed_vector_dot3(above, normal);
    if facing > 0.0 && denominator > 0.0 {
        return 2.0 * facing * package_lightshed_ggx__2ggx_normal_density(alpha, normal) / denominator;
    }
    return 0.0;
}

fn package_lightshed_ggx_stretch(alpha: vec2f, direction: vec3f) -> vec3f {
    return vec3f(alpha * direction.xy, direction.z);
}

struct package_lightshed_importance_Eight {
    low: vec4f,
    high: vec4f
}

const package_lightshed_importance_MARGIN: f32 = 1e-5;

struct package_lightshed_importance_Rows {
    low_x: vec4f,
    low_y: vec4f,
    low_z: vec4f,
    high_x: vec4f,
    high_y: vec4f,
    high_z: vec4f,
    intensity: vec4f,
    normals: vec4u
}

const package_lightshed_importance_STRETCH: u32 = 3u;

struct package_lightshed_importance_Seen {
    positive: vec4<bool>,
    numerator: vec4f,
    denominator: vec4f,
    d_squared: vec4f,
    h_squared: vec4f,
    near_squared: vec4f,
    far_squared: vec4f
}

struct package_lightshed_importance_ShadingPoint {
    position: vec3f,
    reflectance_bound: f32,
    normal: vec3f,
    facing: u32
}

struct package_lightshed_importance_Spans {
    dx: vec4f,
    dy: vec4f,
    dz: vec4f,
    hx: vec4f,
    hy: vec4f,
    hz: vec4f
}

const package_lightshed_importance__1FACING_ALL: u32 = 2u;

const package_lightshed_importance__1FACING_BOTH: u32 = 1u;

const package_lightshed_importance__1FACING_FRONT: u32 = 0u;

const package_lightshed_importance__1MAX_WEIGHT: f32 = 1.329228e36;

const package_lightshed_importance__1MIN_RATIO: f32 = 1e-5;

const package_lightshed_importance__1MIN_SHARE: f32 = 1.9073486e-6;

const package_lightshed_importance__1MIN_SQUARED: f32 = 1e-28;

const package_lightshed_importance__1WEIGHTING_YUKSEL: u32 = 2u;

fn package_lightshed_importance__1about_inverse(x: f32) -> f32 {
    return bitcast<f32>(2129859016u + ~bitcast<u32>(x));
}

fn package_lightshed_importance__1dot_rows(ax: vec4f, ay: vec4f, az: vec4f, bx: vec4f, by: vec4f, bz: vec4f) -> vec4f {
    return ax * bx + ay * by + az * bz;
}

fn package_lightshed_importance__1ends_of(a: package_lightshed_importance_Seen, b: package_lightshed_importance_Seen, weighting: u32) -> package_lightshed_importance_Eight {
    let least = package_lightshed_importance__1least_ends(a.positive, b.positive);
    if weighting == package_lightshed_importance__2WEIGHTING_MIN_MAX {
        let a_max = package_lightshed_importance_over(a, a.far_squared);
        let b_max = package_lightshed_importance_over(b, b.far_squared);
        let a_min = min(a_max * package_lightshed_importance_nearer(a), vec4f(package_lightshed_importance__1MAX_WEIGHT));
        let b_min = min(b_max * package_lightshed_importance_nearer(b), vec4f(package_lightshed_importance__1MAX_WEIGHT));
        return package_lightshed_importance_plus(package_lightshed_importance__1of_one(a_min, b_min), package_lightshed_importance_plus(package_lightshed_importance__1of_one(a_max, b_max), least));
    }
    var a_distance = max(max(a.d_squared, a.h_squared), vec4f(package_lightshed_importance__1MIN_SQUARED));
    var b_distance = max(max(b.d_squared, b.h_squared), vec4f(package_lightshed_importance__1MIN_SQUARED));
    if weighting == package_lightshed_importance__1WEIGHTING_YUKSEL {
        let a_near = (a.near_squared <= max(a.h_squared, vec4f(package_lightshed_importance__1MIN_SQUARED))) & a.positive;
        let b_near = (b.near_squared <= max(b.h_squared, vec4f(package_lightshed_importance__1MIN_SQUARED))) & b.positive;
        let too_near = any(a_near | b_near);
        a_distance = select(a.near_squared, vec4f(1.0), too_near);
        b_distance = select(b.near_squared, vec4f(1.0), too_near);
    }
    return package_lightshed_importance_plus(package_lightshed_importance__1of_one(package_lightshed_importance_over(a, a_distance), package_lightshed_importance_over(b, b_distance)), least);
}

fn package_lightshed_importance__1first_two(row: vec4f, lane: u32) -> vec4f {
    return vec4f(row[lane], row[lane + 1u], 0.0, 0.0);
}

fn package_lightshed_importance__1least_ends(low: vec4<bool>, high: vec4<bool>) -> package_lightshed_importance_Eight {
    let least = vec4f(package_lightshed_importance__1MIN_SHARE);
    return package_lightshed_importance__1running_sums(package_lightshed_importance_Eight(select(vec4f(0.0), least, low), select(vec4f(0.0), least, high)));
}

fn package_lightshed_importance__1load_pair(block: u32, lane: u32) -> package_lightshed_importance_Rows {
    let rows = package_lightshed_importance__1load_rows(block, lane / 4u);
    let k = lane % 4u;
    return package_lightshed_importance_Rows(package_lightshed_importance__1first_two(rows.low_x, k), package_lightshed_importance__1first_two(rows.low_y, k), package_lightshed_importance__1first_two(rows.low_z, k), package_lightshed_importance__1first_two(rows.high_x, k), package_lightshed_importance__1first_two(rows.high_y, k), package_lightshed_importance__1first_two(rows.high_z, k), package_lightshed_importance__1first_two(rows.intensity, k), vec4u(rows.normals[k], rows.normals[k + 1u], 0u, 0u));
}

fn package_lightshed_importance__1load_rows(block: u32, half: u32) -> package_lightshed_importance_Rows {
    let place = 16u * block + half;
    return package_lightshed_importance_Rows(bitcast<vec4f>(package_memory__1light_tree__2load_light_row(place)), bitcast<vec4f>(package_memory__1light_tree__2load_light_row(place + 2u)), bitcast<vec4f>(package_memory__1light_tree__2load_light_row(place + 4u)), bitcast<vec4f>(package_memory__1light_tree__2load_light_row(place + 6u)), bitcast<vec4f>(package_memory__1light_tree__2load_light_row(place + 8u)), bitcast<vec4f>(package_memory__1light_tree__2load_light_row(place + 10u)), bitcast<vec4f>(package_memory__1light_tree__2load_light_row(place + 12u)), package_memory__1light_tree__2load_light_row(place + 14u));
}

fn package_lightshed_importance__1no_rows() -> package_lightshed_importance_Rows {
    let zero = vec4f(0.0);
    return package_lightshed_importance_Rows(zero, zero, zero, zero, zero, zero, zero, vec4u(0u));
}

fn package_lightshed_importance__1of_one(low: vec4f, high: vec4f) -> package_lightshed_importance_Eight {
    let ends = package_lightshed_importance__1running_sums(package_lightshed_importance_Eight(low, high));
    let scale = package_lightshed_importance__1about_inverse(ends.high.w);
    return package_lightshed_importance_Eight(ends.low * scale, ends.high * scale);
}

fn package_lightshed_importance__1receiver_ends(at: package_lightshed_importance_ShadingPoint, low: package_lightshed_importance_Rows, high: package_lightshed_importance_Rows, weighting: u32) -> package_lightshed_importance_Eight {
    if at.facing == package_lightshed_importance_STRETCH {
        return package_lightshed_importance__1segment_ends(at, low, high);
    }
    return package_lightshed_importance__1surface_ends(at, low, high, weighting);
}

fn package_lightshed_importance__1running_sums(x: package_lightshed_importance_Eight) -> package_lightshed_importance_Eight {
    let low_pairs = vec4f(x.low.x, x.low.y + x.low.x, x.low.z, x.low.w + x.low.z);
    let high_pairs = vec4f(x.high.x, x.high.y + x.high.x, x.high.z, x.high.w + x.high.z);
    let low = vec4f(low_pairs.xy, low_pairs.zw + low_pairs.y);
    let high = vec4f(high_pairs.xy, high_pairs.zw + high_pairs.y);
    return package_lightshed_importance_Eight(low, high + low.w);
}

fn package_lightshed_importance__1seen_from(at: package_lightshed_importance_ShadingPoint, rows: package_lightshed_importance_Rows) -> package_lightshed_importance_Seen {
    let spans = package_lightshed_importance__1spans_from(at.position, rows);
    let dx = spans.dx;
    let dy = spans.dy;
    let dz = spans.dz;
    let hx = spans.hx;
    let hy = spans.hy;
    let hz = spans.hz;
    var seen: package_lightshed_importance_Seen;
    seen.d_squared = package_lightshed_importance__1dot_rows(dx, dy, dz, dx, dy, dz);
    seen.h_squared = package_lightshed_importance__1dot_rows(hx, hy, hz, hx, hy, hz);
    let near_x = max(abs(dx) - hx, vec4f(0.0));
    let near_y = max(abs(dy) - hy, vec4f(0.0));
    let near_z = max(abs(dz) - hz, vec4f(0.0));
    seen.near_squared = package_lightshed_importance__1dot_rows(near_x, near_y, near_z, near_x, near_y, near_z);
    let far_x = abs(dx) + hx;
    let far_y = abs(dy) + hy;
    let far_z = abs(dz) + hz;
    seen.far_squared = max(package_lightshed_importance__1dot_rows(far_x, far_y, far_z, far_x, far_y, far_z), vec4f(package_lightshed_importance__1MIN_SQUARED));
    let inverse = package_lightshed_importance__2about_inverse_root(max(seen.d_squared, seen.h_squared));
    let vx = vec4f(rows.normals >> vec4u(24u)) - package_lightshed__1normal_ball__1CENTER_STEPS;
    let vy = vec4f((rows.normals >> vec4u(16u)) & vec4u(255u)) - package_lightshed__1normal_ball__1CENTER_STEPS;
    let vz = vec4f((rows.normals >> vec4u(8u)) & vec4u(255u)) - package_lightshed__1normal_ball__1CENTER_STEPS;
    let radius = package_lightshed_importance__2as_it_is(vec4f(rows.normals & vec4u(255u)) * package_lightshed__1normal_ball__1RADIUS_STEP);
    let emitted_mean = -package_lightshed_importance__1dot_rows(vx, vy, vz, dx, dy, dz);
    let emitted_reach = package_lightshed_importance__1dot_rows(abs(vx), abs(vy), abs(vz), hx, hy, hz) + radius * (hx + hy + hz);
    let emitted_margin = package_lightshed_importance__2as_it_is(radius * package_lightshed_importance__4MAX_INVERSE_SQRT_TIMES_ROOT + package_lightshed_importance_MARGIN * package_lightshed__1normal_ball__1CENTER_STEPS);
    let emitted = package_lightshed_importance__2clamped_mean_4s((emitted_mean + emitted_reach) * inverse + emitted_margin, (emitted_mean - emitted_reach) * inverse - emitted_margin);
    let emitted_spread = emitted_reach * inverse + emitted_margin;
    let shines = rows.intensity > vec4f(0.0);
    if at.facing == package_lightshed_importance__1FACING_ALL {
        seen.numerator = rows.intensity * emitted;
        seen.denominator = emitted_spread * 0.25;
        seen.positive = (emitted > vec4f(0.0)) & shines;
        return seen;
    }
    let n = at.normal;
    let mean = n.x * dx + n.y * dy + n.z * dz;
    let reach = abs(n.x) * hx + abs(n.y) * hy + abs(n.z) * hz;
    let high = package_lightshed_importance__2as_it_is((mean + reach) * inverse + package_lightshed_importance_MARGIN);
    let low = package_lightshed_importance__2as_it_is((mean - reach) * inverse - package_lightshed_importance_MARGIN);
    var received = package_lightshed_importance__2clamped_mean_4s(high, low);
    if at.facing == package_lightshed_importance__1FACING_BOTH {
        received += package_lightshed_importance__2clamped_mean_4s(-low, -high);
    }
    let both = emitted * received;
    seen.numerator = (rows.intensity * received) * emitted;
    seen.denominator = emitted_spread * package_lightshed_importance__2as_it_is(reach * inverse + package_lightshed_importance_MARGIN);
    seen.positive = (both > vec4f(0.0)) & shines;
    return seen;
}

fn package_lightshed_importance__1segment_ends(at: package_lightshed_importance_ShadingPoint, low: package_lightshed_importance_Rows, high: package_lightshed_importance_Rows) -> package_lightshed_importance_Eight {
    let a = package_lightshed_importance__1segment_weights(at, low);
    let b = package_lightshed_importance__1segment_weights(at, high);
    return package_lightshed_importance_plus(package_lightshed_importance__1of_one(a, b), package_lightshed_importance__1least_ends(a > vec4f(0.0), b > vec4f(0.0)));
}

fn package_lightshed_importance__1segment_weights(at: package_lightshed_importance_ShadingPoint, rows: package_lightshed_importance_Rows) -> vec4f {
    let spans = package_lightshed_importance__1spans_from(at.position, rows);
    let dx = spans.dx;
    let dy = spans.dy;
    let dz = spans.dz;
    let hx = spans.hx;
    let hy = spans.hy;
    let hz = spans.hz;
    let to = at.normal;
    let length = 2.0 * at.reflectance_bound;
    let along = dx * to.x + dy * to.y + dz * to.z;
    let off_x = dx - to.x * along;
    let off_y = dy - to.y * along;
    let off_z = dz - to.z * along;
    let h_squared = package_lightshed_importance__1dot_rows(hx, hy, hz, hx, hy, hz);
    let off_squared = max(package_lightshed_importance__1dot_rows(off_x, off_y, off_z, off_x, off_y, off_z), h_squared);
    let off = sqrt(max(off_squared, vec4f(package_lightshed_importance__1MIN_SQUARED)));
    let seen = atan2(off * length, off * off - along * (length - along));
    let vx = (vec4f(rows.normals >> vec4u(24u)) - package_lightshed__1normal_ball__1CENTER_STEPS) / package_lightshed__1normal_ball__1CENTER_STEPS;
    let vy = (vec4f((rows.normals >> vec4u(16u)) & vec4u(255u)) - package_lightshed__1normal_ball__1CENTER_STEPS) / package_lightshed__1normal_ball__1CENTER_STEPS;
    let vz = (vec4f((rows.normals >> vec4u(8u)) & vec4u(255u)) - package_lightshed__1normal_ball__1CENTER_STEPS) / package_lightshed__1normal_ball__1CENTER_STEPS;
    let radius = vec4f(rows.normals & vec4u(255u)) / 255.0;
    let middle_x = dx - to.x * (0.5 * length);
    let middle_y = dy - to.y * (0.5 * length);
    let middle_z = dz - to.z * (0.5 * length);
    let middle = sqrt(package_lightshed_importance__1dot_rows(middle_x, middle_y, middle_z, middle_x, middle_y, middle_z));
    let distance = max(middle, off) + 0.5 * length;
    let mean = -package_lightshed_importance__1dot_rows(vx, vy, vz, middle_x, middle_y, middle_z) / distance;
    let reach = package_lightshed_importance__1dot_rows(abs(vx), abs(vy), abs(vz), hx, hy, hz) + 0.5 * length * abs(vx * to.x + vy * to.y + vz * to.z) + radius * (hx + hy + hz);
    let spread = reach / distance + (radius + package_lightshed_importance_MARGIN);
    let t = clamp(mean + spread, vec4f(0.0), 2.0 * spread);
    let emitted = t * t / (4.0 * spread) + max(mean - spread, vec4f(0.0));
    let weight = rows.intensity * emitted * (seen / off);
    let positive = (emitted > vec4f(0.0)) & (rows.intensity > vec4f(0.0));
    let finite = select(vec4f(package_lightshed_importance__1MAX_WEIGHT), weight, weight < vec4f(package_lightshed_importance__1MAX_WEIGHT));
    return select(vec4f(0.0), max(finite, vec4f(package_lightshed_float__2F32_MIN_POSITIVE)), positive);
}

fn package_lightshed_importance__1spans_from(position: vec3f, rows: package_lightshed_importance_Rows) -> package_lightshed_importance_Spans {
    let low_x = rows.low_x - position.x;
    let low_y = rows.low_y - position.y;
    let low_z = rows.low_z - position.z;
    let high_x = rows.high_x - position.x;
    let high_y = rows.high_y - position.y;
    let high_z = rows.high_z - position.z;
    return package_lightshed_importance_Spans(low_x + high_x, low_y + high_y, low_z + high_z, high_x - low_x, high_y - low_y, high_z - low_z);
}

fn package_lightshed_importance__1surface_ends(at: package_lightshed_importance_ShadingPoint, low: package_lightshed_importance_Rows, high: package_lightshed_importance_Rows, weighting: u32) -> package_lightshed_importance_Eight {
    return package_lightshed_importance__1ends_of(package_lightshed_importance__1seen_from(at, low), package_lightshed_importance__1seen_from(at, high), weighting);
}

const package_lightshed_importance__2WEIGHTING_MIN_MAX: u32 = 1u;

fn package_lightshed_importance__2about_inverse_root(x: vec4f) -> vec4f {
    return bitcast<vec4f>(vec4u(1597463008u) + ~(bitcast<vec4u>(x) >> vec4u(1u)));
}

fn package_lightshed_importance__2as_it_is(x: vec4f) -> vec4f {
    return min(x, vec4f(package_lightshed_float__1F32_MAX));
}

fn package_lightshed_importance__2clamped_mean_4s(high: vec4f, low: vec4f) -> vec4f {
    let above = max(high, vec4f(0.0));
    let below = max(low, vec4f(0.0));
    return (above - below) * (above + below);
}

const package_lightshed_importance__4MAX_INVERSE_SQRT_TIMES_ROOT: f32 = 1.04;

fn package_lightshed_importance_nearer(seen: package_lightshed_importance_Seen) -> vec4f {
    return seen.far_squared / max(seen.near_squared, seen.far_squared * package_lightshed_importance__1MIN_RATIO);
}

fn package_lightshed_importance_over(seen: package_lightshed_importance_Seen, squared: vec4f) -> vec4f {
    let finite = min(seen.numerator / (seen.denominator * squared), vec4f(package_lightshed_importance__1MAX_WEIGHT));
    return select(vec4f(0.0), finite, seen.positive);
}

fn package_lightshed_importance_plus(a: package_lightshed_importance_Eight, b: package_lightshed_importance_Eight) -> package_lightshed_importance_Eight {
    return package_lightshed_importance_Eight(a.low + b.low, a.high + b.high);
}

struct package_lightshed_material_MaterialAt {
    index: u32,
    uv: vec2f
}

fn package_lightshed_measure__1power_heuristic(a: f32, b: f32) -> f32 {
    if !(a > 0.0) {
        return 0.0;
    }
    let ratio = b / a;
    return 1.0 / (1.0 + ratio * ratio);
}

fn package_lightshed_measure__3area_to_solid_angle(pdf_area: f32, distance_squared: f32, cos_theta: f32) -> f32 {
    let cosine = abs(cos_theta);
    if cosine > 0.0 {
        return min(pdf_area * distance_squared / cosine, package_lightshed_float__1F32_MAX);
    }
    return 0.0;
}

struct package_lightshed_octree_Octree {
    min: vec3f,
    per_length: f32,
    side: f32,
    padding0: u32,
    padding1: u32,
    padding2: u32
}

struct package_lightshed_octree_OctreeUnits {
    inside: bool,
    units: vec3u
}

fn package_lightshed_octree__1octree_child(units: vec3u, depth: u32) -> u32 {
    let bits = (units >> vec3u(package_lightshed_octree__2MAX_OCTREE_DEPTH - 1u - depth)) & vec3u(1u);
    return bits.x | (bits.y << 1u) | (bits.z << 2u);
}

fn package_lightshed_octree__1octree_descend(node: u32, depth: u32, units: vec3u) -> u32 {
    var number = node;
    for (var level = depth; level < package_lightshed_octree__2MAX_OCTREE_DEPTH; level++) {
        let inner = package_memory_octree__2load_octree_node(number);
        let child = package_lightshed_octree__1octree_child(units, level);
        if package_lightshed_octree__2is_octree_leaf(inner, child) {
            return 8u * number + child;
        }
        number = package_lightshed_octree__1octree_inner(inner, child);
    }
    return package_lightshed_ray_NOTHING;
}

fn package_lightshed_octree__1octree_inner(node: u32, child: u32) -> u32 {
    return (node >> 8u) + countOneBits(~node & 255u & ((1u << child) - 1u));
}

fn package_lightshed_octree__1octree_units(tree: package_lightshed_octree_Octree, position: vec3f) -> package_lightshed_octree_OctreeUnits {
    let units = (position - tree.min) * tree.per_length;
    let inside = all(units >= vec3f(0.0)) && all(units < vec3f(1048576.0));
    return package_lightshed_octree_OctreeUnits(inside, vec3u(select(vec3f(0.0), units, inside)));
}

const package_lightshed_octree__2MAX_OCTREE_DEPTH: u32 = 20u;

fn package_lightshed_octree__2is_octree_leaf(node: u32, child: u32) -> bool {
    return ((node >> child) & 1u) != 0u;
}

struct package_lightshed_ray_Hit {
    t: f32,
    primitive: u32,
    barycentric: vec2f
}

const package_lightshed_ray_NOTHING: u32 = 4294967295u;

struct package_lightshed_ray_Ray {
    origin: vec3f,
    t_max: f32,
    direction: vec3f,
    padding: u32
}

const package_lightshed_ray__1NO_END: f32 = 3.4028235e38;

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

struct package_lightshed_sky_Owner {
    index: u32,
    words: f32,
    fraction: f32
}

struct package_lightshed_sky_Sky {
    x_axis: vec3f,
    scale: f32,
    y_axis: vec3f,
    last_row: u32,
    z_axis: vec3f,
    padding: u32,
    size: vec2u,
    more_padding: vec2u
}

struct package_lightshed_sky_SkyCell {
    cell: vec2u,
    fraction: vec2f
}

struct package_lightshed_sky_SkySample {
    direction: vec3f,
    pdf: f32,
    radiance: vec3f,
    cell: vec2u
}

fn package_lightshed_sky__1columns_start(cells: vec2u, row: u32) -> u32 {
    return cells.y + row * cells.x;
}

fn package_lightshed_sky__1last_column(cells: vec2u, row: u32) -> u32 {
    return package_memory_scene__2load_sky_word(cells.y + cells.x * cells.y + row);
}

fn package_lightshed_sky__1owner_of(first: u32, last: u32, word: u32) -> package_lightshed_sky_Owner {
    var base = 0u;
    var size = last + 1u;
    while (size > 1u) {
        let half = size / 2u;
        base = select(base, base + half, package_memory_scene__2load_sky_word(first + base + half) <= word);
        size -= half;
    }
    let words = package_lightshed_sky_owned(first, last, base);
    return package_lightshed_sky_Owner(base, words, package_lightshed_uniform_remap(f32(word - package_memory_scene__2load_sky_word(first + base)), 0.0, words));
}

fn package_lightshed_sky__1sky_cell(image: package_lightshed_sky_Sky, uv: vec2f) -> package_lightshed_sky_SkyCell {
    let cells = package_lightshed_sky__1sky_cells(image);
    let scaled = uv * vec2f(cells);
    let cell = min(vec2u(scaled), cells - 1u);
    return package_lightshed_sky_SkyCell(cell, clamp(scaled - vec2f(cell), vec2f(0.0), vec2f(1.0)));
}

fn package_lightshed_sky__1sky_cells(image: package_lightshed_sky_Sky) -> vec2u {
    return vec2u(image.size.x, max(image.size.y, 2u) - 1u);
}

fn package_lightshed_sky__1sky_coordinates(image: package_lightshed_sky_Sky, direction: vec3f) -> vec2f {
    let d = image.x_axis * direction.x + image.y_axis * direction.y + image.z_axis * direction.z;
    let u = package_lightshed_turn__1turn_of(d.x, -d.z) - 0.5 / f32(image.size.x);
    let v = 2.0 * package_lightshed_turn__1turn_of(sqrt(d.x * d.x + d.z * d.z), d.y);
    return vec2f(u - floor(u), v);
}

fn package_lightshed_sky__1sky_density(cells: vec2u, row_words: f32, column_words: f32, sin_theta: f32) -> f32 {
    let share = (row_words / package_lightshed_sky__2TWO_POW_32) * (column_words / package_lightshed_sky__2TWO_POW_32);
    let density = share * f32(cells.x) * f32(cells.y) / (package_lightshed_sky__2TWO_PI_SQUARED * sin_theta);
    return select(0.0, density, sin_theta > 0.0);
}

fn package_lightshed_sky__1sky_pdf(direction: vec3f) -> f32 {
    let image = package_memory_scene_sky();
    let cells = package_lightshed_sky__1sky_cells(image);
    let uv = package_lightshed_sky__1sky_coordinates(image, direction);
    let cell = min(vec2u(uv * vec2f(cells)), cells - 1u);
    let row_words = package_lightshed_sky_owned(0u, image.last_row, cell.y);
    let column_words = package_lightshed_sky_owned(package_lightshed_sky__1columns_start(cells, cell.y), package_lightshed_sky__1last_column(cells, cell.y), cell.x);
    return package_lightshed_sky__1sky_density(cells, row_words, column_words, package_lightshed_turn__2sin_cos_turns(0.5 * uv.y).x);
}

fn package_lightshed_sky__1sky_radiance(direction: vec3f) -> vec3f {
    let image = package_memory_scene_sky();
    return package_lightshed_sky__2sky_radiance_at(image, package_lightshed_sky__1sky_cell(image, package_lightshed_sky__1sky_coordinates(image, direction)));
}

fn package_lightshed_sky__1sky_sample(u: vec2f) -> package_lightshed_sky_SkySample {
    let image = package_memory_scene_sky();
    let cells = package_lightshed_sky__1sky_cells(image);
    let word = vec2u(u * package_lightshed_sky__2TWO_POW_32);
    let row = package_lightshed_sky__1owner_of(0u, image.last_row, word.y);
    let column = package_lightshed_sky__1owner_of(package_lightshed_sky__1columns_start(cells, row.index), package_lightshed_sky__1last_column(cells, row.index), word.x);
    let cell = vec2u(column.index, row.index);
    let place = package_lightshed_sky_SkyCell(cell, vec2f(column.fraction, row.fraction));
    let uv = min((vec2f(cell) + place.fraction) / vec2f(cells), vec2f(package_lightshed_uniform__2ONE_MINUS_EPSILON));
    let polar = package_lightshed_turn__2sin_cos_turns(0.5 * uv.y);
    let turn = uv.x + 0.5 / f32(image.size.x);
    let azimuth = package_lightshed_turn__2sin_cos_turns(select(turn, turn - 1.0, turn >= 1.0));
    let local = vec3f(polar.x * azimuth.x, polar.y, -polar.x * azimuth.y);
    let direction = vec3f(package_lightshed_vector_dot3(image.x_axis, local), package_lightshed_vector_dot3(image.y_axis, local), package_lightshed_vector_dot3(image.z_axis, local));
    let pdf = package_lightshed_sky__1sky_density(cells, row.words, column.words, polar.x);
    return package_lightshed_sky_SkySample(direction, pdf, package_lightshed_sky__2sky_radiance_at(image, place), cell);
}

fn package_lightshed_sky__1sky_texel(image: package_lightshed_sky_Sky, column: u32, row: u32) -> vec3f {
    let cells = package_lightshed_sky__1sky_cells(image);
    let start = 2u * cells.y + cells.x * cells.y + 3u * (row * image.size.x + column);
    return vec3f(bitcast<f32>(package_memory_scene__2load_sky_word(start)), bitcast<f32>(package_memory_scene__2load_sky_word(start + 1u)), bitcast<f32>(package_memory_scene__2load_sky_word(start + 2u)));
}

const package_lightshed_sky__2TWO_PI_SQUARED: f32 = 19.739208;

const package_lightshed_sky__2TWO_POW_32: f32 = 4294967296.0;

fn package_lightshed_sky__2sky_radiance_at(image: package_lightshed_sky_Sky, place: package_lightshed_sky_SkyCell) -> vec3f {
    let right = select(place.cell.x + 1u, 0u, place.cell.x + 1u == image.size.x);
    let below = min(place.cell.y + 1u, image.size.y - 1u);
    let a = package_lightshed_sky__1sky_texel(image, place.cell.x, place.cell.y);
    let b = package_lightshed_sky__1sky_texel(image, right, place.cell.y);
    let c = package_lightshed_sky__1sky_texel(image, place.cell.x, below);
    let d = package_lightshed_sky__1sky_texel(image, right, below);
    let above = a + (b - a) * place.fraction.x;
    let under = c + (d - c) * place.fraction.x;
    return (above + (under - above) * place.fraction.y) * image.scale;
}

fn package_lightshed_sky_owned(first: u32, last: u32, index: u32) -> f32 {
    if index > last {
        return 0.0;
    }
    let start = package_memory_scene__2load_sky_word(first + index);
    if index == last {
        return select(f32(~start + 1u), package_lightshed_sky__2TWO_POW_32, start == 0u);
    }
    return f32(package_memory_scene__2load_sky_word(first + index + 1u) - start);
}

struct package_lightshed_stream_Stream {
    key: vec4u,
    kind: u32,
    dimension: u32,
    block: vec4u
}

fn package_lightshed_stream__1next_number(stream: ptr<function, package_lightshed_stream_Stream>) -> f32 {
    return package_lightshed_uniform__2f32_from_u32(package_lightshed_stream__1next_word(stream));
}

fn package_lightshed_stream__1next_word(stream: ptr<function, package_lightshed_stream_Stream>) -> u32 {
    let dimension = (*stream).dimension;
    (*stream).dimension = dimension + 1u;
    let word = (*stream).block[dimension % 4u];
    if dimension % 4u == 3u {
        (*stream).block = package_lightshed_rng__1threefry4x32_12(vec4u((dimension + 1u) / 4u, (*stream).kind, 0u, 0u), (*stream).key);
    }
    return word;
}

fn package_lightshed_stream__1stream_at(key: vec4u, kind: u32, dimension: u32) -> package_lightshed_stream_Stream {
    return package_lightshed_stream_Stream(key, kind, dimension, package_lightshed_rng__1threefry4x32_12(vec4u(dimension / 4u, kind, 0u, 0u), key));
}

fn package_lightshed_stream__2stream_of_sample(seed: vec2u, pixel: u32, sample: u32, dimension: u32) -> package_lightshed_stream_Stream {
    return package_lightshed_stream__1stream_at(vec4u(seed, pixel, sample), 0u, dimension);
}

struct package_lightshed_surface_CornerNormals {
    a: vec3f,
    b: vec3f,
    c: vec3f
}

struct package_lightshed_surface_CornerUvs {
    a: vec2f,
    b: vec2f,
    c: vec2f
}

struct package_lightshed_surface_SurfacePoint {
    position: vec3f,
    offset: f32,
    geometric_normal: vec3f,
    material: package_lightshed_material_MaterialAt,
    shading: package_lightshed_frame_Frame,
    emitter: u32
}

struct package_lightshed_surface_Triangle {
    a: vec3f,
    b_x: f32,
    b_yz: vec2f,
    c_xy: vec2f,
    c_z: f32,
    normal_x: f32,
    normal_yz: vec2f,
    material: u32,
    emitter: u32,
    normals: u32,
    uvs: u32
}

const package_lightshed_surface__1POSITION_ERROR: f32 = 1.9073486e-6;

fn package_lightshed_surface__1offset_along(position: vec3f, normal: vec3f, offset: f32, direction: vec3f) -> vec3f {
    return position + normal * package_lightshed_vector__1copy_sign(offset, package_lightshed_vector_dot3(direction, normal));
}

fn package_lightshed_surface__1offset_for(geometric_normal: vec3f, terms: vec3f, extent: f32) -> f32 {
    return (package_lightshed_vector_dot3(abs(geometric_normal), terms) + extent) * package_lightshed_surface__1POSITION_ERROR;
}

fn package_lightshed_surface__1origin_towards(point: package_lightshed_surface_SurfacePoint, direction: vec3f) -> vec3f {
    return package_lightshed_surface__1offset_along(point.position, point.geometric_normal, point.offset, direction);
}

fn package_lightshed_surface__1surface_point(triangle: package_lightshed_surface_Triangle, hit: package_lightshed_ray_Hit) -> package_lightshed_surface_SurfacePoint {
    let a = triangle.a;
    let b = vec3f(triangle.b_x, triangle.b_yz);
    let c = vec3f(triangle.c_xy, triangle.c_z);
    let normal = vec3f(triangle.normal_x, triangle.normal_yz);
    let v = hit.barycentric.x;
    let w = hit.barycentric.y;
    let u = max(1.0 - v - w, 0.0);
    let term_a = a * u;
    let term_b = b * v;
    let term_c = c * w;
    let extent = package_lightshed_vector__1max_element(max(max(a, b), c) - min(min(a, b), c));
    var shading_normal = normal;
    if triangle.normals != package_lightshed_ray_NOTHING {
        let normals = package_memory_scene__2load_corner_normals(triangle.normals);
        shading_normal = package_lightshed_vector__1normalized_or(normals.a * u + normals.b * v + normals.c * w, normal);
    }
    var uv = vec2f(v, w);
    if package_memory_scene__1has_textures() && triangle.uvs != package_lightshed_ray_NOTHING {
        let uvs = package_memory_scene__2load_corner_uvs(triangle.uvs);
        uv = uvs.a * u + uvs.b * v + uvs.c * w;
    }
    return package_lightshed_surface_SurfacePoint(term_a + term_b + term_c, package_lightshed_surface__1offset_for(normal, abs(term_a) + abs(term_b) + abs(term_c), extent), normal, package_lightshed_material_MaterialAt(triangle.material, uv), package_lightshed_frame__2frame_from_normal(shading_normal), triangle.emitter);
}

fn package_lightshed_surface_spawn(point: package_lightshed_surface_SurfacePoint, direction: vec3f) -> package_lightshed_ray_Ray {
    return package_lightshed_ray_Ray(package_lightshed_surface__1origin_towards(point, direction), package_lightshed_ray__1NO_END, direction, 0u);
}

const package_lightshed_texture_CHECKERBOARD: u32 = 2u;

const package_lightshed_texture_MIRRORED: u32 = 1u;

const package_lightshed_texture_NEAREST: u32 = 1u;

struct package_lightshed_texture_Neighbours {
    first: u32,
    second: u32,
    share: f32
}

const package_lightshed_texture_REPEAT: u32 = 0u;

struct package_lightshed_texture_Texture {
    x_axis: vec2f,
    y_axis: vec2f,
    translation: vec2f,
    size: vec2u,
    scale: vec3f,
    first: u32,
    filtering: u32,
    wrap: u32,
    table: u32,
    padding: u32
}

const package_lightshed_texture__1NO_TABLE: u32 = 4294967295u;

fn package_lightshed_texture__1number_at(word: u32) -> f32 {
    return bitcast<f32>(package_memory_scene__2load_texel_word(word));
}

fn package_lightshed_texture__1texture_color(index: u32, uv: vec2f) -> vec3f {
    let texture = package_memory_scene__1load_texture(index);
    let x = uv.x;
    let y = min(1.0 - uv.y, package_lightshed_float__1F32_MAX);
    var s = min(texture.x_axis.x * x + texture.y_axis.x * y, package_lightshed_float__1F32_MAX) + texture.translation.x;
    var t = min(texture.x_axis.y * x + texture.y_axis.y * y, package_lightshed_float__1F32_MAX) + texture.translation.y;
    if !(package_lightshed_vector__1is_finite(s) && package_lightshed_vector__1is_finite(t)) {
        s = 0.0;
        t = 0.0;
    }
    if texture.filtering == package_lightshed_texture_CHECKERBOARD {
        let other = (s - floor(s) > 0.5) != (t - floor(t) > 0.5);
        return package_lightshed_texture_texel(texture, select(0u, 1u, other), 0u);
    }
    s = package_lightshed_texture_folded(s, texture.wrap);
    t = package_lightshed_texture_folded(t, texture.wrap);
    if texture.filtering == package_lightshed_texture_NEAREST {
        return package_lightshed_texture_texel(texture, u32(s * f32(texture.size.x)), u32(t * f32(texture.size.y))) * texture.scale;
    }
    let across = package_lightshed_texture_neighbours(s, texture.size.x, texture.wrap);
    let down = package_lightshed_texture_neighbours(t, texture.size.y, texture.wrap);
    let upper = package_lightshed_texture_between(package_lightshed_texture_texel(texture, across.first, down.first), package_lightshed_texture_texel(texture, across.second, down.first), across.share);
    let lower = package_lightshed_texture_between(package_lightshed_texture_texel(texture, across.first, down.second), package_lightshed_texture_texel(texture, across.second, down.second), across.share);
    return package_lightshed_texture_between(upper, lower, down.share) * texture.scale;
}

fn package_lightshed_texture_between(a: vec3f, b: vec3f, share: f32) -> vec3f {
    let rest = min(1.0 - share, package_lightshed_float__1F32_MAX);
    return min(a * rest, vec3f(package_lightshed_float__1F32_MAX)) + b * share;
}

fn package_lightshed_texture_folded(s: f32, wrap: u32) -> f32 {
    if wrap == package_lightshed_texture_REPEAT {
        return s - floor(s);
    }
    if wrap == package_lightshed_texture_MIRRORED {
        let period = s - 2.0 * floor(0.5 * s);
        return select(period, 2.0 - period, period > 1.0);
    }
    return clamp(s, 0.0, 1.0);
}

fn package_lightshed_texture_neighbours(s: f32, count: u32, wrap: u32) -> package_lightshed_texture_Neighbours {
    let position = min(s * f32(count) - 0.5, package_lightshed_float__1F32_MAX);
    let below = floor(position);
    let last = i32(count) - 1;
    let index = i32(below);
    return package_lightshed_texture_Neighbours(package_lightshed_texture_wrapped(index, last, wrap), package_lightshed_texture_wrapped(index + 1, last, wrap), position - below);
}

fn package_lightshed_texture_texel(texture: package_lightshed_texture_Texture, x: u32, y: u32) -> vec3f {
    let place = min(y, texture.size.y - 1u) * texture.size.x + min(x, texture.size.x - 1u);
    if texture.table == package_lightshed_texture__1NO_TABLE {
        let word = texture.first + 3u * place;
        return vec3f(package_lightshed_texture__1number_at(word), package_lightshed_texture__1number_at(word + 1u), package_lightshed_texture__1number_at(word + 2u));
    }
    let codes = package_memory_scene__2load_texel_word(texture.first + place);
    return vec3f(package_lightshed_texture__1number_at(texture.table + (codes & 255u)), package_lightshed_texture__1number_at(texture.table + ((codes >> 8u) & 255u)), package_lightshed_texture__1number_at(texture.table + ((codes >> 16u) & 255u)));
}

fn package_lightshed_texture_wrapped(index: i32, last: i32, wrap: u32) -> u32 {
    if wrap == package_lightshed_texture_REPEAT && index < 0 {
        return u32(last);
    }
    if wrap == package_lightshed_texture_REPEAT && index > last {
        return 0u;
    }
    return u32(clamp(index, 0, last));
}

struct package_lightshed_triangle_TriangleRay {
    origin: vec3f,
    axes: vec3u,
    shear: vec2f,
    inverse_z: f32
}

fn package_lightshed_triangle__1intersect_triangle(ray: package_lightshed_triangle_TriangleRay, a0: vec3f, b0: vec3f, c0: vec3f, primitive: u32, t_max: f32) -> package_lightshed_ray_Hit {
    let none = package_lightshed_ray_Hit(t_max, package_lightshed_ray_NOTHING, vec2f(0.0));
    let a = package_lightshed_triangle_sheared(ray, a0);
    let b = package_lightshed_triangle_sheared(ray, b0);
    let c = package_lightshed_triangle_sheared(ray, c0);
    let area_a = c.x * b.y - c.y * b.x;
    let area_b = a.x * c.y - a.y * c.x;
    let area_c = b.x * a.y - b.y * a.x;
    let inside = (area_a >= 0.0 && area_b >= 0.0 && area_c >= 0.0) || (area_a <= 0.0 && area_b <= 0.0 && area_c <= 0.0);
    if !inside {
        return none;
    }
    let inverse_determinant = 1.0 / (area_a + (area_b + area_c));
    let z = area_a * a.z + (area_b * b.z + area_c * c.z);
    let t = z * ray.inverse_z * inverse_determinant;
    if !(t > 0.0 && t < t_max) {
        return none;
    }
    let u = area_a * inverse_determinant;
    let v = area_b * inverse_determinant;
    return package_lightshed_ray_Hit(t, primitive, vec2f(v, max(1.0 - u - v, 0.0)));
}

fn package_lightshed_triangle__1triangle_ray(ray: package_lightshed_ray_Ray) -> package_lightshed_triangle_TriangleRay {
    var d = ray.direction;
    let m = abs(d);
    var kz = 2u;
    if m.x > m.y {
        kz = select(2u, 0u, m.x > m.z);
    }
    else if m.y > m.z {
        kz = 1u;
    }
    let kx = (kz + 1u) % 3u;
    let ky = (kz + 2u) % 3u;
    let inverse_z = 1.0 / d[kz];
    return package_lightshed_triangle_TriangleRay(ray.origin, vec3u(kx, ky, kz), vec2f(d[kx] * inverse_z, d[ky] * inverse_z), inverse_z);
}

fn package_lightshed_triangle_sheared(ray: package_lightshed_triangle_TriangleRay, corner: vec3f) -> vec3f {
    var p = corner - ray.origin;
    let z = p[ray.axes.z];
    return vec3f(p[ray.axes.x] - ray.shear.x * z, p[ray.axes.y] - ray.shear.y * z, z);
}

fn package_lightshed_turn__1turn_of(y: f32, x: f32) -> f32 {
    let high = max(abs(x), abs(y));
    let low = min(abs(x), abs(y));
    var a = 0.0;
    if high > 0.0 {
        a = low / high;
    }
    let s = a * a;
    let odd = -0.02228693 + s * (0.015706787 + s * (-0.009363046 + s * (0.003784787 + s * -0.00072571344)));
    var turn = a * (0.15915492 + s * (-0.05304923 + s * (0.031778406 + s * odd)));
    turn = select(turn, 0.25 - turn, abs(y) > abs(x));
    turn = select(turn, 0.5 - turn, (bitcast<u32>(x) & 2147483648u) != 0u);
    return package_lightshed_vector__1copy_sign(turn, y);
}

fn package_lightshed_turn__2sin_cos_quarter(r: f32) -> vec2f {
    let t = r * r;
    let sine = r * (1.5707964 + t * (-0.6459635 + t * (0.07968022 + t * -0.004602149)));
    let cosine = 1.0 - t * (1.2337005 + t * (-0.2536694 + t * (0.020861529 + t * -0.0009067399)));
    return vec2f(sine, cosine);
}

fn package_lightshed_turn__2sin_cos_turns(t: f32) -> vec2f {
    let quarters = 4.0 * package_lightshed_vector__2clamp_or_low(t, 0.0, 1.0);
    let below = floor(quarters);
    let rest = quarters - below;
    let quadrant = u32(below);
    let nearest = quadrant + select(0u, 1u, rest > 0.5 || (rest == 0.5 && quadrant % 2u == 1u));
    let part = package_lightshed_turn__2sin_cos_quarter(quarters - f32(nearest));
    let turned = select(part, part.yx, nearest % 2u == 1u);
    let negative = vec2u((nearest & 2u) << 30u, ((nearest + 1u) & 2u) << 30u);
    return bitcast<vec2f>(bitcast<vec2u>(turned) ^ negative);
}

const package_lightshed_uniform__2ONE_MINUS_EPSILON: f32 = 0.99999994;

fn package_lightshed_uniform__2f32_from_u32(bits: u32) -> f32 {
    return f32(bits >> 8u) * 5.9604645e-8;
}

fn package_lightshed_uniform_remap(u: f32, low: f32, high: f32) -> f32 {
    let fraction = (u - low) / (high - low);
    return select(0.0, min(fraction, package_lightshed_uniform__2ONE_MINUS_EPSILON), fraction > 0.0);
}

fn package_lightshed_vector__1copy_sign(magnitude: f32, sign: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(magnitude) & 2147483647u) | (bitcast<u32>(sign) & 2147483648u));
}

fn package_lightshed_vector__1is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 2139095040u) != 2139095040u;
}

fn package_lightshed_vector__1max_element(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn package_lightshed_vector__1normalized_or(v: vec3f, otherwise: vec3f) -> vec3f {
    let inverse = 1.0 / package_lightshed_vector_length3(v);
    if package_lightshed_vector__1is_finite(inverse) && inverse > 0.0 {
        return v * inverse;
    }
    return otherwise;
}

fn package_lightshed_vector__2clamp_or_low(x: f32, low: f32, high: f32) -> f32 {
    return select(low, min(x, high), x > low);
}

fn package_lightshed_vector_cross3(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y);
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

const package_lightshed_warp_TAU: f32 = 6.2831855;

const package_lightshed_warp__1F32_EPSILON: f32 = 1.1920929e-7;

const package_lightshed_warp__1INVERSE_PI: f32 = 0.31830987;

fn package_lightshed_warp__1concentric_disk(u: vec2f) -> vec2f {
    return package_lightshed_warp__3concentric_disk_with_radius(u).xy;
}

fn package_lightshed_warp__1cosine_hemisphere(u: vec2f) -> vec3f {
    let point = package_lightshed_warp__3concentric_disk_with_radius(u);
    let radius = abs(point.z);
    return vec3f(point.xy, sqrt(max((1.0 - radius) * (1.0 + radius), package_lightshed_warp__1F32_EPSILON)));
}

fn package_lightshed_warp__1uniform_sphere(u: vec2f) -> vec3f {
    let sin_theta = 2.0 * sqrt(u.x * (1.0 - u.x));
    let turn = package_lightshed_turn__2sin_cos_turns(u.y);
    return vec3f(sin_theta * turn.y, sin_theta * turn.x, 1.0 - 2.0 * u.x);
}

fn package_lightshed_warp__1uniform_triangle(u: vec2f) -> vec3f {
    let half = 0.5 * min(u.x, u.y);
    let b = u - half;
    return vec3f(b, 1.0 - b.x - b.y);
}

const package_lightshed_warp__2INVERSE_FOUR_PI: f32 = 0.07957747;

fn package_lightshed_warp__3concentric_disk_with_radius(u: vec2f) -> vec3f {
    let a = 2.0 * u.x - 1.0;
    let b = 2.0 * u.y - 1.0;
    let along_x = abs(a) > abs(b);
    let radius = select(b, a, along_x);
    let other = select(a, b, along_x);
    var ratio = 0.0;
    if radius != 0.0 {
        ratio = other / radius;
    }
    let part = package_lightshed_turn__2sin_cos_quarter(0.5 * ratio);
    let xy = select(part, part.yx, along_x);
    return vec3f(radius * xy.x, radius * xy.y, radius);
}

fn package_lightshed_wide__1wide_add(a: vec2u, b: vec2u) -> vec2u {
    let low = a.x + b.x;
    return vec2u(low, a.y + b.y + select(0u, 1u, low < a.x));
}

fn package_lightshed_wide__1wide_fraction(a: vec2u, b: vec2u) -> vec2u {
    var rest = a;
    var quotient = vec2u(0u);
    for (var k = 0u; k < 64u; k++) {
        let carried = rest.y >> 31u;
        rest = package_lightshed_wide__2wide_shift_left(rest, 1u);
        quotient = package_lightshed_wide__2wide_shift_left(quotient, 1u);
        if carried == 1u || !package_lightshed_wide__1wide_less(rest, b) {
            rest = package_lightshed_wide__1wide_subtract(rest, b);
            quotient.x |= 1u;
        }
    }
    return quotient;
}

fn package_lightshed_wide__1wide_less(a: vec2u, b: vec2u) -> bool {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
}

fn package_lightshed_wide__1wide_multiply(a: vec2u, b: vec2u) -> vec2u {
    let low = package_lightshed_wide__1wide_product(a.x, b.x);
    return vec2u(low.x, low.y + a.x * b.y + a.y * b.x);
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

struct package_memory__1light_cache_CacheMemory {
    cache: package_lightshed__1light_cache_LightCache,
    children: u32,
    parents: u32,
    leaf_of: u32,
    factors: u32
}

override package_memory__1light_cache__1BY_CACHE: bool = false;

@group(1) @binding(21)
var<storage, read> package_memory__1light_cache__1cache_rows: array<vec4u>;

@group(1) @binding(20)
var<storage, read> package_memory__1light_cache__1cache_words: array<u32>;

fn package_memory__1light_cache__1light_cache() -> package_lightshed__1light_cache_LightCache {
    return package_memory__1light_cache__2light_cache_parts.cache;
}

fn package_memory__1light_cache__1load_factors(row: u32) -> package_lightshed_importance_Eight {
    let first = package_memory__1light_cache__2light_cache_parts.factors + 4u * row;
    return package_lightshed_importance_Eight(bitcast<vec4f>(package_memory__1light_cache__1cache_rows[first]), bitcast<vec4f>(package_memory__1light_cache__1cache_rows[first + 1u]));
}

@group(1) @binding(19)
var<storage, read> package_memory__1light_cache__2light_cache_parts: package_memory__1light_cache_CacheMemory;

fn package_memory__1light_cache__2load_bvh_child(place: u32) -> u32 {
    return package_memory__1light_cache__1cache_words[package_memory__1light_cache__2light_cache_parts.children + place];
}

fn package_memory__1light_cache__2load_bvh_leaf(light: u32) -> u32 {
    return package_memory__1light_cache__1cache_words[package_memory__1light_cache__2light_cache_parts.leaf_of + light];
}

fn package_memory__1light_cache__2load_bvh_parent(block: u32) -> u32 {
    return package_memory__1light_cache__1cache_words[package_memory__1light_cache__2light_cache_parts.parents + block];
}

fn package_memory__1light_cache__2load_cache_row(place: u32) -> vec4u {
    return package_memory__1light_cache__1cache_rows[place];
}

fn package_memory__1light_cache__2load_cache_word(index: u32) -> u32 {
    return package_memory__1light_cache__1cache_words[index];
}

fn package_memory__1light_cache__3load_factor_row_below(row: u32, lane: u32) -> u32 {
    return package_memory__1light_cache__1cache_rows[package_memory__1light_cache__2light_cache_parts.factors + 4u * row + 2u + lane / 4u][lane % 4u];
}

@group(1) @binding(7)
var<storage, read> package_memory__1light_tree__1leaf_of: array<u32>;

@group(1) @binding(6)
var<storage, read> package_memory__1light_tree__1light_at: array<u32>;

@group(1) @binding(5)
var<storage, read> package_memory__1light_tree__1light_levels: array<u32>;

@group(1) @binding(4)
var<storage, read> package_memory__1light_tree__1light_rows: array<vec4u>;

fn package_memory__1light_tree__2load_leaf_of(light: u32) -> u32 {
    return package_memory__1light_tree__1leaf_of[light];
}

fn package_memory__1light_tree__2load_light_at(leaf: u32) -> u32 {
    return package_memory__1light_tree__1light_at[leaf];
}

fn package_memory__1light_tree__2load_light_level(level: u32) -> u32 {
    return package_memory__1light_tree__1light_levels[level];
}

fn package_memory__1light_tree__2load_light_row(place: u32) -> vec4u {
    return package_memory__1light_tree__1light_rows[place];
}

@group(1) @binding(15)
var<storage, read> package_memory_octree__1octree_nodes: array<u32>;

fn package_memory_octree__2load_octree_node(index: u32) -> u32 {
    return package_memory_octree__1octree_nodes[index];
}

fn package_memory_pixels__1pixel_name(pixel: u32) -> u32 {
    return package_memory_pixels__1place_name(package_memory_pixels__1pixel_place(pixel));
}

fn package_memory_pixels__1pixel_place(pixel: u32) -> vec2u {
    let width = package_memory_scene_settings.camera.size.x;
    return vec2u(pixel % width, pixel / width);
}

fn package_memory_pixels__1pixel_stream(pixel: u32, sample: u32) -> package_lightshed_stream_Stream {
    return package_lightshed_stream__2stream_of_sample(package_memory_scene_settings.seed, package_memory_pixels__1pixel_name(pixel), sample, 0u);
}

fn package_memory_pixels__1place_name(place: vec2u) -> u32 {
    return (place.y << 16u) | place.x;
}

fn package_memory_pixels__1streamed_ray(pixel: u32, stream: ptr<function, package_lightshed_stream_Stream>) -> package_lightshed_ray_Ray {
    let dx = package_lightshed_stream__1next_number(stream);
    let dy = package_lightshed_stream__1next_number(stream);
    var u_lens = vec2f(0.5);
    if package_memory_scene_settings.camera.aperture_radius > 0.0 {
        u_lens.x = package_lightshed_stream__1next_number(stream);
        u_lens.y = package_lightshed_stream__1next_number(stream);
    }
    return package_lightshed_camera__1camera_ray(package_memory_scene_settings.camera, vec2f(package_memory_pixels__1pixel_place(pixel)) + vec2f(dx, dy), u_lens);
}

struct package_memory_scene_Settings {
    camera: package_lightshed_camera_Camera,
    surroundings: vec3f,
    groups: u32,
    seed: vec2u,
    max_depth: u32,
    roulette_depth: u32,
    emitters: u32,
    pixels: u32,
    sky_words: u32,
    finite_emitters: u32,
    first_direction: u32,
    directions: u32,
    uv_words: u32,
    texture_words: u32,
    coat_words: u32,
    padding0: u32,
    padding1: u32,
    padding2: u32,
    sky: package_lightshed_sky_Sky
}

override package_memory_scene__1HAS_DIELECTRICS: bool = true;

override package_memory_scene__1HAS_EMITTERS: bool = true;

override package_memory_scene__1HAS_PLASTICS: bool = true;

override package_memory_scene__1HAS_SKY: bool = true;

override package_memory_scene__1HAS_SURROUNDINGS: bool = true;

override package_memory_scene__1HAS_TEXTURES: bool = true;

fn package_memory_scene__1emitter_groups() -> package_lightshed_emitter_EmitterGroups {
    return package_lightshed_emitter_EmitterGroups(package_memory_scene_settings.surroundings, package_memory_scene_settings.groups, package_memory_scene_settings.emitters, package_memory_scene_settings.finite_emitters, package_memory_scene_settings.first_direction, package_memory_scene_settings.directions);
}

fn package_memory_scene__1has_dielectrics() -> bool {
    return package_memory_scene__1HAS_DIELECTRICS;
}

fn package_memory_scene__1has_plastics() -> bool {
    return package_memory_scene__1HAS_PLASTICS;
}

fn package_memory_scene__1has_sky() -> bool {
    return package_memory_scene__1HAS_SKY;
}

fn package_memory_scene__1has_textures() -> bool {
    return package_memory_scene__1HAS_TEXTURES;
}

fn package_memory_scene__1lets_pass(primitive: u32) -> bool {
    return package_memory_scene_materials[package_memory_scene_triangles[primitive].material].y == 0u;
}

fn package_memory_scene__1load_coat(place: u32) -> f32 {
    return package_memory_scene__2number_in_tables(package_memory_scene_settings.coat_words + place);
}

fn package_memory_scene__1load_component(row: u32) -> package_lightshed_bsdf_Component {
    return package_memory_scene_components[row];
}

fn package_memory_scene__1load_emitter(index: u32) -> package_lightshed_emitter_Emitter {
    return package_memory_scene_emitters[index];
}

fn package_memory_scene__1load_material(index: u32) -> vec2u {
    return package_memory_scene_materials[index];
}

fn package_memory_scene__1load_texture(index: u32) -> package_lightshed_texture_Texture {
    let word = package_memory_scene_settings.texture_words + 16u * index;
    return package_lightshed_texture_Texture(package_memory_scene__2pair_in_tables(word), package_memory_scene__2pair_in_tables(word + 2u), package_memory_scene__2pair_in_tables(word + 4u), vec2u(package_memory_scene_tables[word + 6u], package_memory_scene_tables[word + 7u]), vec3f(package_memory_scene__2pair_in_tables(word + 8u), package_memory_scene__2number_in_tables(word + 10u)), package_memory_scene_tables[word + 11u], package_memory_scene_tables[word + 12u], package_memory_scene_tables[word + 13u], package_memory_scene_tables[word + 14u], 0u);
}

fn package_memory_scene__1load_triangle(index: u32) -> package_lightshed_surface_Triangle {
    return package_memory_scene_triangles[index];
}

override package_memory_scene__2HAS_DELTA_EMITTERS: bool = true;

fn package_memory_scene__2has_delta_emitters() -> bool {
    return package_memory_scene__2HAS_DELTA_EMITTERS;
}

fn package_memory_scene__2load_corner_normals(index: u32) -> package_lightshed_surface_CornerNormals {
    return package_lightshed_surface_CornerNormals(package_memory_scene_normals[3u * index].xyz, package_memory_scene_normals[3u * index + 1u].xyz, package_memory_scene_normals[3u * index + 2u].xyz);
}

fn package_memory_scene__2load_corner_uvs(index: u32) -> package_lightshed_surface_CornerUvs {
    let word = package_memory_scene_settings.uv_words + 6u * index;
    return package_lightshed_surface_CornerUvs(package_memory_scene__2pair_in_tables(word), package_memory_scene__2pair_in_tables(word + 2u), package_memory_scene__2pair_in_tables(word + 4u));
}

fn package_memory_scene__2load_cwbvh_node(index: u32) -> package_lightshed_cwbvh_CwbvhNode {
    return package_memory_scene_nodes[index];
}

fn package_memory_scene__2load_cwbvh_primitive(slot: u32) -> u32 {
    return package_memory_scene_slots[slot];
}

fn package_memory_scene__2load_delta_emitter(index: u32) -> package_lightshed_emitter_DeltaEmitter {
    let row = package_memory_scene_emitters[index];
    return package_lightshed_emitter_DeltaEmitter(row.corner, row.pdf_area, row.edge0, row.radiance_r, row.edge1, row.radiance_g, row.normal.x, row.normal.y, 0u, 0u);
}

fn package_memory_scene__2load_sky_word(index: u32) -> u32 {
    return package_memory_scene_tables[package_memory_scene_settings.sky_words + index];
}

fn package_memory_scene__2load_texel_word(index: u32) -> u32 {
    return package_memory_scene_tables[index];
}

fn package_memory_scene__2load_triangle_corners(index: u32) -> package_lightshed_cwbvh_TriangleCorners {
    let triangle = package_memory_scene_triangles[index];
    return package_lightshed_cwbvh_TriangleCorners(triangle.a, vec3f(triangle.b_x, triangle.b_yz), vec3f(triangle.c_xy, triangle.c_z));
}

fn package_memory_scene__2number_in_tables(word: u32) -> f32 {
    return bitcast<f32>(package_memory_scene_tables[word]);
}

fn package_memory_scene__2pair_in_tables(word: u32) -> vec2f {
    return vec2f(package_memory_scene__2number_in_tables(word), package_memory_scene__2number_in_tables(word + 1u));
}

@group(0) @binding(5)
var<storage, read> package_memory_scene_components: array<package_lightshed_bsdf_Component>;

@group(0) @binding(6)
var<storage, read> package_memory_scene_emitters: array<package_lightshed_emitter_Emitter>;

@group(0) @binding(4)
var<storage, read> package_memory_scene_materials: array<vec2u>;

@group(0) @binding(0)
var<storage, read> package_memory_scene_nodes: array<package_lightshed_cwbvh_CwbvhNode>;

@group(0) @binding(3)
var<storage, read> package_memory_scene_normals: array<vec4f>;

@group(2) @binding(0)
var<storage, read> package_memory_scene_settings: package_memory_scene_Settings;

fn package_memory_scene_sky() -> package_lightshed_sky_Sky {
    return package_memory_scene_settings.sky;
}

@group(0) @binding(1)
var<storage, read> package_memory_scene_slots: array<u32>;

@group(0) @binding(7)
var<storage, read> package_memory_scene_tables: array<u32>;

@group(0) @binding(2)
var<storage, read> package_memory_scene_triangles: array<package_lightshed_surface_Triangle>;

fn package_selected__1area_of(emitter: package_lightshed_emitter_Emitter) -> f32 {
    return 0.5 * package_lightshed_vector_length3(package_lightshed_vector_cross3(emitter.edge0, emitter.edge1));
}

fn package_selected__1no_light() -> package_lightshed_emitter_EmitterSample {
    return package_lightshed_emitter_EmitterSample(vec3f(0.0), 0.0, vec3f(0.0), true, vec3f(0.0));
}

fn package_selected__1pdf_towards(index: u32, probability: f32, start: vec3f, end: vec3f) -> f32 {
    let emitter = package_memory_scene__1load_emitter(index);
    let d = end - start;
    let distance_squared = package_lightshed_vector_dot3(d, d);
    let cos_theta = package_lightshed_vector_dot3(emitter.normal, d) / sqrt(distance_squared);
    return package_lightshed_measure__3area_to_solid_angle(probability / package_selected__1area_of(emitter), distance_squared, cos_theta);
}

fn package_selected__1seen_emission(point: package_lightshed_surface_SurfacePoint, direction: vec3f) -> vec3f {
    if point.emitter != package_lightshed_ray_NOTHING && package_lightshed_vector_dot3(direction, point.geometric_normal) < 0.0 {
        return package_lightshed_emitter__1emitter_radiance(package_memory_scene__1load_emitter(point.emitter));
    }
    return vec3f(0.0);
}

fn package_selected__1shading_point(point: package_lightshed_surface_SurfacePoint, wo: vec3f) -> package_lightshed_importance_ShadingPoint {
    var bound = package_lightshed_float__1F32_MAX;
    if package_lightshed_bsdf__2is_diffuse_alone(point.material) {
        let albedo = package_lightshed_bsdf__1first_color(point.material);
        bound = package_lightshed_color_luminance(albedo) * package_lightshed_warp__1INVERSE_PI;
    }
    let side = vec3f(0.0, 0.0, select(1.0, -1.0, wo.z < 0.0));
    return package_lightshed_importance_ShadingPoint(point.position, bound, package_lightshed_frame__1to_world(point.shading, side), package_lightshed_importance__1FACING_FRONT);
}

fn package_selected_towards(index: u32, probability: f32, start: vec3f, u: vec2f) -> package_lightshed_emitter_EmitterSample {
    if package_memory_scene__2has_delta_emitters() && package_lightshed_emitter__2is_delta_emitter(index) {
        return package_lightshed_emitter__2towards_delta_emitter(index, probability, start);
    }
    let emitter = package_memory_scene__1load_emitter(index);
    let aim = package_lightshed_emitter__1aim_at(emitter, start, package_lightshed_warp__1uniform_triangle(u).xy);
    let pdf = package_lightshed_measure__3area_to_solid_angle(probability / package_selected__1area_of(emitter), aim.distance_squared, aim.cos_theta);
    let weight = package_lightshed_emitter__1emitter_radiance(emitter) / pdf;
    if !(aim.cos_theta > 0.0 && pdf > 0.0) || !package_lightshed_vector__1is_finite(weight.x + weight.y + weight.z) {
        return package_selected__1no_light();
    }
    return package_lightshed_emitter_EmitterSample(aim.direction, pdf, weight, true, aim.goal);
}

const package_threads_GROUP: u32 = 64u;

fn package_threads__1thread_number(id: vec3u, groups: vec3u) -> u32 {
    return id.x + id.y * groups.x * package_threads_GROUP;
}
