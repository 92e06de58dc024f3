// Linked from restir_di_world.wesl.

const MOST_INPUTS: u32 = 24u;

fn site_of(seen: package_primaries_Primary) -> package_lightshed__1hash_grid_SurfaceSite {
    let point = package_lightshed_surface__1surface_point(package_memory_scene__1load_triangle(seen.hit.primitive), seen.hit);
    let is_outside = package_lightshed_vector_dot3(point.geometric_normal, -seen.direction) >= 0.0;
    return package_lightshed__1hash_grid_SurfaceSite(point.position, select(-point.geometric_normal, point.geometric_normal, is_outside), seen.hit.t);
}

@compute @workgroup_size(64)
fn visit(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let pixel = package_threads__1thread_number(id, groups);
    if pixel >= package_memory_scene_settings.pixels {
        return;
    }
    package_world_memory__1world_visitors[pixel] = package_memory_visits_Visitor(vec2u(0u), 0u, 0u);
    let seen = package_primaries_primaries[pixel];
    if seen.hit.primitive == package_lightshed_ray_NOTHING || !package_samples__1takes_part(seen) {
        return;
    }
    let key = package_lightshed__1hash_grid__1site_key(package_world_memory_world.grid, site_of(seen));
    if key.some {
        package_world_memory__1world_visitors[pixel] = package_memory_visits_Visitor(package_lightshed__1hash_grid__1cell_word(key.bits), package_world_memory_block(pixel, package_world_memory_RANK).x, 0u);
    }
}

@compute @workgroup_size(64)
fn bring(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let thread = package_threads__1thread_number(id, groups);
    let all = package_world_memory_world.each + package_world_memory_world.most;
    if thread / all < package_world_memory__2world_visit_count {
        package_world_memory_terms[thread] = package_world_terms__1term_of(package_world_memory__1world_visits[thread / all], thread % all);
    }
}

@compute @workgroup_size(64)
fn fill(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let number = package_threads__1thread_number(id, groups);
    if number >= package_world_memory__2world_visit_count {
        return;
    }
    let visit = package_world_memory__1world_visits[number];
    let each = package_world_memory_world.each;
    let all = min(each + package_world_memory_world.most, MOST_INPUTS);
    let first_term = (each + package_world_memory_world.most) * number;
    var weights: array<f32, 24>;
    var contributions: array<f32, 24>;
    var total = 0.0;
    var last = 0u;
    for (var i = 0u; i < all; i++) {
        let term = package_world_memory_terms[first_term + i];
        let contribution = package_samples__1sample_weight(term);
        let weight = contribution * package_samples__1sample_target(term);
        weights[i] = 0.0;
        contributions[i] = 0.0;
        if !(weight > 0.0 && package_lightshed_vector__1is_finite(weight)) {
            continue;
        }
        var pool = i;
        for (var j = 0u; j < i; j++) {
            if weights[j] > 0.0 && package_samples__2is_same_sample(package_world_memory_terms[first_term + j], term) {
                pool = j;
                break;
            }
        }
        last = max(last, pool);
        weights[pool] += weight;
        contributions[pool] += contribution;
        total += weight;
    }
    let before = package_world_terms__1held_confidence(visit);
    let site = package_world_terms__1merged_in(visit);
    let first_cell = each * visit.slot;
    for (var k = 0u; k < each; k++) {
        package_world_memory_cells[first_cell + k] = package_samples__1no_sample(0.0);
    }
    if total > 0.0 && package_lightshed_vector__1is_finite(total) {
        let words = package_lightshed_rng__1random_block(package_memory_scene_settings.seed, visit.slot, package_world_memory_world.number, package_world_memory_COPIES);
        let offset = package_lightshed_uniform__2f32_from_u32(words.x);
        var chosen = 0u;
        var sum = 0.0;
        for (var i = 0u; i < all && chosen < each; i++) {
            sum += weights[i];
            if !(weights[i] > 0.0) {
                continue;
            }
            while (chosen < each && (i == last || (f32(chosen) + offset) * (total / f32(each)) < sum)) {
                let weight = min(contributions[i] * (total / weights[i]), package_lightshed_float__1F32_MAX);
                let place = first_cell + (chosen + words.y % each) % each;
                package_world_memory_cells[place] = package_samples__1sample_with(package_world_memory_terms[first_term + i], weight, 0.0);
                chosen++;
            }
        }
    }
    package_world_memory_confidences[visit.slot] = min(before + f32(visit.count), package_world_memory_world.cap);
    package_world_memory_sites[visit.slot] = site;
    package_world_memory__1world_sited[visit.slot] = 1u;
}

fn serving(site: package_lightshed__1hash_grid_SurfaceSite) -> u32 {
    let slot = package_lightshed__1hash_grid__1site_slot(package_world_memory_world.grid, site);
    if slot == package_lightshed_ray_NOTHING || package_world_memory__1world_sited[slot] == 0u {
        return package_lightshed_ray_NOTHING;
    }
    return slot;
}

fn with_cells(pixel: u32, site: package_lightshed__1hash_grid_SurfaceSite) {
    package_inputs_alone(pixel);
    for (var i = 0u; i < min(package_world_memory_world.reads, package_inputs__1MOST_NEIGHBOURS); i++) {
        let words = package_world_memory_block(pixel, package_world_memory_LINKS + i);
        var slot = serving(package_lightshed__1hash_grid__1moved_site(package_world_memory_world.grid, site, package_lightshed_uniform__1unit_square(words.xy)));
        if slot == package_lightshed_ray_NOTHING {
            slot = serving(site);
        }
        if slot == package_lightshed_ray_NOTHING {
            continue;
        }
        let place = package_world_memory_world.each * slot + words.z % package_world_memory_world.each;
        var is_new = true;
        for (var j = 1u; j < package_inputs_inputs.count; j++) {
            is_new = is_new && package_inputs_inputs.pixels[j] != place;
        }
        if is_new {
            package_inputs__1add_input(place);
        }
    }
}

@compute @workgroup_size(64)
fn link(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let pixel = package_threads__1thread_number(id, groups);
    if pixel >= package_memory_scene_settings.pixels {
        return;
    }
    package_world_memory_made[pixel] = package_world_memory_given[pixel];
    let seen = package_primaries_primaries[pixel];
    if seen.hit.primitive == package_lightshed_ray_NOTHING || !package_samples__1takes_part(seen) || !(package_samples__1sample_confidence(package_world_memory_given[pixel]) > 0.0) {
        return;
    }
    with_cells(pixel, site_of(seen));
    let merged = package_lightshed_merge__1merge_pairwise(package_inputs_inputs.count, package_world_memory_world.pixel_cap);
    package_world_memory_made[pixel] = package_samples__1no_sample(merged.confidence);
    if merged.weight > 0.0 {
        package_world_memory_made[pixel] = package_samples__1sample_with(package_reuse_kept, merged.weight, merged.confidence);
    }
    if package_world_memory_world.shades != 0u {
        package_world_memory_image[pixel] += vec4f(package_reuse_gathered, 0.0);
    }
}

struct package__1restir_di_light_Light {
    value: vec3f,
    weight: f32,
    place: vec3f,
    emitter: u32,
    confidence: f32,
    padding0: u32,
    padding1: u32,
    padding2: u32
}

override package__1restir_di_light__1BY_TREE: bool = false;

fn package__1restir_di_light__1no_light(confidence: f32) -> package__1restir_di_light_Light {
    return package__1restir_di_light_Light(vec3f(0.0), 0.0, vec3f(0.0), package_lightshed_ray_NOTHING, confidence, 0u, 0u, 0u);
}

struct package__1restir_di_target_Lit {
    value: vec3f,
    pdf_emitter: f32,
    pdf_bsdf: f32,
    shadow: package_lightshed_ray_Ray
}

struct package__1restir_di_target_Seen {
    point: package_lightshed_surface_SurfacePoint,
    wo: vec3f,
    distance: f32
}

fn package__1restir_di_target__1is_lit(lit: package__1restir_di_target_Lit) -> bool {
    return package_lightshed_vector__1max_element(lit.value) > 0.0;
}

fn package__1restir_di_target__1lit_by(seen: package__1restir_di_target_Seen, emitter: u32, place: vec3f, probability: f32) -> package__1restir_di_target_Lit {
    let none = package__1restir_di_target_Lit(vec3f(0.0), 0.0, 0.0, package_lightshed_ray_Ray(vec3f(0.0), 0.0, vec3f(0.0), 0u));
    var connection = package_lightshed_emitter_EmitterSample(place, 1.0, vec3f(0.0), false, vec3f(0.0));
    var pdf_emitter: f32;
    var radiance: vec3f;
    var per_endpoint = 1.0;
    if emitter == package_lightshed_emitter_SURROUNDINGS {
        pdf_emitter = package_lightshed_emitter__1surroundings_pdf(place);
        radiance = package_lightshed_emitter__1surroundings_radiance(place);
    }
    else {
        let light = package_memory_scene__1load_emitter(emitter);
        let aim = package_lightshed_emitter__1aim_at(light, seen.point.position, place.xy);
        if !(aim.cos_theta > 0.0) {
            return none;
        }
        connection = package_lightshed_emitter_EmitterSample(aim.direction, 1.0, vec3f(0.0), true, aim.goal);
        pdf_emitter = light.pdf_area;
        if package__1restir_di_light__1BY_TREE {
            pdf_emitter = probability / package_selected__1area_of(light);
        }
        radiance = package_lightshed_emitter__1emitter_radiance(light);
        per_endpoint = aim.cos_theta / aim.distance_squared;
    }
    let scattered = package_lightshed_bsdf__1evaluate_bsdf(seen.point.material, seen.wo, package_lightshed_frame__1to_local(seen.point.shading, connection.direction));
    let value = scattered.value * radiance * per_endpoint;
    let pdf_bsdf = scattered.pdf * per_endpoint;
    let largest = package_lightshed_vector__1max_element(value);
    if !(largest > 0.0) || !package_lightshed_vector__1is_finite(largest) || !package_lightshed_vector__1is_finite(pdf_bsdf) {
        return none;
    }
    return package__1restir_di_target_Lit(value, pdf_emitter, pdf_bsdf, package_lightshed_emitter__1shadow_ray(seen.point, connection));
}

fn package__1restir_di_target__1seen_by(primary: package_primaries_Primary) -> package__1restir_di_target_Seen {
    let point = package_lightshed_surface__1surface_point(package_memory_scene__1load_triangle(primary.hit.primitive), primary.hit);
    return package__1restir_di_target_Seen(point, package_lightshed_frame__1to_local(point.shading, -primary.direction), primary.hit.t);
}

fn package__1restir_di_target__1visible_value(seen: package__1restir_di_target_Seen, light: package__1restir_di_light_Light) -> vec3f {
    if light.emitter == package_lightshed_ray_NOTHING {
        return vec3f(0.0);
    }
    let lit = package__1restir_di_target__1lit_by(seen, light.emitter, light.place, 0.0);
    if !package__1restir_di_target__1is_lit(lit) || package_lightshed_cwbvh_occluded(lit.shadow) {
        return vec3f(0.0);
    }
    return lit.value;
}

fn package_cells__2load_cell_word(slot: u32) -> vec2u {
    return package_world_memory__1world_words[slot];
}

struct package_inputs_Inputs {
    count: u32,
    temporal: bool,
    pixels: array<u32, 9>
}

const package_inputs__1MOST_NEIGHBOURS: u32 = 8u;

fn package_inputs__1add_input(pixel: u32) {
    package_inputs_inputs.pixels[package_inputs_inputs.count] = pixel;
    package_inputs_inputs.count++;
}

fn package_inputs_alone(pixel: u32) {
    package_inputs_inputs.count = 1u;
    package_inputs_inputs.temporal = false;
    package_inputs_inputs.pixels[0] = pixel;
}

fn package_inputs_decision(i: u32, sample: u32, first: u32) -> f32 {
    if package_inputs_inputs.temporal {
        return package_lightshed_uniform__2f32_from_u32(package_memory_pixels__1pixel_block(package_inputs_inputs.pixels[0], sample, first)[i]);
    }
    let place = select(package_inputs__1MOST_NEIGHBOURS + i - 1u, 2u * package_inputs__1MOST_NEIGHBOURS, i == 0u);
    return package_lightshed_uniform__2f32_from_u32(package_memory_pixels__1pixel_block(package_inputs_inputs.pixels[0], sample, first + place).x);
}

var<private> package_inputs_inputs: package_inputs_Inputs;

struct package_lightshed__1hash_grid_CellKey {
    some: bool,
    bits: vec2u
}

const package_lightshed__1hash_grid_LEVELS: u32 = 32u;

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

struct package_lightshed__1hash_grid_SurfaceSite {
    position: vec3f,
    normal: vec3f,
    eye_distance: f32
}

const package_lightshed__1hash_grid__1LARGEST_PLACE: vec2u = vec2u(0u, 1090519024u);

const package_lightshed__1hash_grid__1NO_FACE: u32 = 6u;

fn package_lightshed__1hash_grid__1cell_face(grid: package_lightshed__1hash_grid_LevelGrid, normal: vec3f) -> u32 {
    let bits = bitcast<vec3u>(normal);
    let size = bits & vec3u(2147483647u);
    let has_length = any(size > vec3u(436207616u)) && all(size <= vec3u(2139095040u));
    if grid.faces == 0u || !has_length {
        return package_lightshed__1hash_grid__1NO_FACE;
    }
    if size.x >= size.y && size.x >= size.z {
        return bits.x >> 31u;
    }
    if size.y >= size.z {
        return 2u + (bits.y >> 31u);
    }
    return 4u + (bits.z >> 31u);
}

fn package_lightshed__1hash_grid__1cell_level(grid: package_lightshed__1hash_grid_LevelGrid, eye_distance: f32) -> u32 {
    let sides = eye_distance * grid.per_distance;
    if sides > 1.0 {
        return min((bitcast<u32>(sides) >> 23u) - 127u, package_lightshed__1hash_grid_LEVELS - 1u);
    }
    return 0u;
}

fn package_lightshed__1hash_grid__1cell_slot(grid: package_lightshed__1hash_grid_LevelGrid, bits: vec2u) -> u32 {
    return package_lightshed__1hash_grid__1word_slot(grid, package_lightshed__1hash_grid__1cell_word(bits));
}

fn package_lightshed__1hash_grid__1cell_word(bits: vec2u) -> vec2u {
    var x = vec2u(bits.x, bits.y | 1073741824u);
    x.x ^= x.y;
    x = package_lightshed_wide__1wide_multiply(x, vec2u(1717173651u, 3605593784u)) & vec2u(4294967295u, 2147483647u);
    x.x ^= x.y;
    x = package_lightshed_wide__1wide_multiply(x, vec2u(2025677871u, 2692095332u)) & vec2u(4294967295u, 2147483647u);
    return vec2u(x.x ^ x.y, x.y | 2147483648u);
}

fn package_lightshed__1hash_grid__1floor_of(a: vec2u) -> i32 {
    let exponent = package_lightshed_double__1biased_exponent(a) - 1023;
    let negative = (a.y >> 31u) != 0u;
    if exponent < 0 {
        return select(0, -1, negative && any(package_lightshed_double__1double_abs(a) != vec2u(0u)));
    }
    let bits = package_lightshed_double_significand(a);
    let down = u32(52 - exponent);
    let whole = package_lightshed_wide__2wide_shift_right(bits, down);
    let has_rest = any(package_lightshed_wide__2wide_shift_left(whole, down) != bits);
    return select(i32(whole.x), -i32(whole.x) - select(0, 1, has_rest), negative);
}

fn package_lightshed__1hash_grid__1moved_site(grid: package_lightshed__1hash_grid_LevelGrid, site: package_lightshed__1hash_grid_SurfaceSite, u: vec2f) -> package_lightshed__1hash_grid_SurfaceSite {
    if all((bitcast<vec3u>(site.normal) & vec3u(2147483647u)) == vec3u(0u)) {
        return site;
    }
    let side = grid.cell * f32(1u << package_lightshed__1hash_grid__1cell_level(grid, site.eye_distance));
    let frame = package_lightshed_frame__2frame_from_normal(site.normal);
    let by = (u - vec2f(0.5)) * side;
    return package_lightshed__1hash_grid_SurfaceSite(site.position + frame.tangent * by.x + frame.bitangent * by.y, site.normal, site.eye_distance);
}

fn package_lightshed__1hash_grid__1site_key(grid: package_lightshed__1hash_grid_LevelGrid, site: package_lightshed__1hash_grid_SurfaceSite) -> package_lightshed__1hash_grid_CellKey {
    var x = package_lightshed_double__1double_multiply(package_lightshed_double__2double_from_f32(site.position.x), grid.per_length);
    var y = package_lightshed_double__1double_multiply(package_lightshed_double__2double_from_f32(site.position.y), grid.per_length);
    var z = package_lightshed_double__1double_multiply(package_lightshed_double__2double_from_f32(site.position.z), grid.per_length);
    if !(package_lightshed_double__2double_is_finite(x) && package_lightshed_double__2double_is_finite(y) && package_lightshed_double__2double_is_finite(z)) {
        return package_lightshed__1hash_grid_CellKey(false, vec2u(0u));
    }
    var level = package_lightshed__1hash_grid__1cell_level(grid, site.eye_distance);
    var down = level;
    loop {
        x = package_lightshed__1hash_grid_halved(x, down);
        y = package_lightshed__1hash_grid_halved(y, down);
        z = package_lightshed__1hash_grid_halved(z, down);
        down = 1u;
        let within = package_lightshed_double__1double_less(package_lightshed_double__1double_abs(x), package_lightshed__1hash_grid__1LARGEST_PLACE) && package_lightshed_double__1double_less(package_lightshed_double__1double_abs(y), package_lightshed__1hash_grid__1LARGEST_PLACE) && package_lightshed_double__1double_less(package_lightshed_double__1double_abs(z), package_lightshed__1hash_grid__1LARGEST_PLACE);
        if within {
            break;
        }
        level++;
        if level >= package_lightshed__1hash_grid_LEVELS {
            return package_lightshed__1hash_grid_CellKey(false, vec2u(0u));
        }
    }
    let place = vec3u(u32(package_lightshed__1hash_grid__1floor_of(x)), u32(package_lightshed__1hash_grid__1floor_of(y)), u32(package_lightshed__1hash_grid__1floor_of(z))) & vec3u(262143u);
    let rest = level | (package_lightshed__1hash_grid__1cell_face(grid, site.normal) << 5u);
    return package_lightshed__1hash_grid_CellKey(true, vec2u(place.x | (place.y << 18u), (place.y >> 14u) | (place.z << 4u) | (rest << 22u)));
}

fn package_lightshed__1hash_grid__1site_slot(grid: package_lightshed__1hash_grid_LevelGrid, site: package_lightshed__1hash_grid_SurfaceSite) -> u32 {
    let key = package_lightshed__1hash_grid__1site_key(grid, site);
    if !key.some {
        return package_lightshed_ray_NOTHING;
    }
    return package_lightshed__1hash_grid__1cell_slot(grid, key.bits);
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

fn package_lightshed__1hash_grid_halved(a: vec2u, down: u32) -> vec2u {
    return select(vec2u(a.x, a.y - (down << 20u)), a, all(package_lightshed_double__1double_abs(a) == vec2u(0u)));
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

const package_lightshed_double_SIGN: u32 = 2147483648u;

fn package_lightshed_double__1biased_exponent(a: vec2u) -> i32 {
    return i32((a.y >> 20u) & 2047u);
}

fn package_lightshed_double__1double_abs(a: vec2u) -> vec2u {
    return a & vec2u(4294967295u, 2147483647u);
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

fn package_lightshed_double__2double_from_f32(x: f32) -> vec2u {
    return package_lightshed_double__3double_from_f32_bits(bitcast<u32>(x));
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

fn package_lightshed_emitter__1shadow_ray(point: package_lightshed_surface_SurfacePoint, light: package_lightshed_emitter_EmitterSample) -> package_lightshed_ray_Ray {
    let origin = package_lightshed_surface__1origin_towards(point, light.direction);
    if light.finite {
        return package_lightshed_ray_Ray(origin, package_lightshed_emitter__1SEGMENT_END, light.goal - origin, 0u);
    }
    return package_lightshed_ray_Ray(origin, package_lightshed_ray__1NO_END, light.direction, 0u);
}

fn package_lightshed_emitter__1surroundings_density(direction: vec3f) -> f32 {
    if package_memory_scene__1has_sky() {
        return package_lightshed_sky__1sky_pdf(direction);
    }
    return package_lightshed_warp__2INVERSE_FOUR_PI;
}

fn package_lightshed_emitter__1surroundings_pdf(direction: vec3f) -> f32 {
    return package_lightshed_emitter__1surroundings_density(direction) * (1.0 / f32(package_memory_scene__1emitter_groups().groups));
}

fn package_lightshed_emitter__1surroundings_radiance(direction: vec3f) -> vec3f {
    if package_memory_scene__1has_sky() {
        return package_lightshed_sky__1sky_radiance(direction);
    }
    return package_memory_scene__1emitter_groups().surroundings;
}

const package_lightshed_float__1F32_MAX: f32 = 3.4028235e38;

struct package_lightshed_frame_Frame {
    tangent: vec3f,
    bitangent: vec3f,
    normal: vec3f
}

fn package_lightshed_frame__1to_local(frame: package_lightshed_frame_Frame, v: vec3f) -> vec3f {
    return vec3f(package_lightshed_vector_dot3(frame.tangent, v), package_lightshed_vector_dot3(frame.bitangent, v), package_lightshed_vector_dot3(frame.normal, v));
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

struct package_lightshed_material_MaterialAt {
    index: u32,
    uv: vec2f
}

struct package_lightshed_merge_MergeImage {
    p_hat: f32,
    jacobian: f32
}

struct package_lightshed_merge_MergeInput {
    confidence: f32,
    weight: f32,
    p_hat: f32
}

struct package_lightshed_merge_Merged {
    weight: f32,
    confidence: f32
}

struct package_lightshed_merge_Merging {
    selection: package_lightshed_reservoir_Selection,
    p_hat: f32
}

fn package_lightshed_merge__1is_defined(image: package_lightshed_merge_MergeImage) -> bool {
    return image.jacobian > 0.0 && image.p_hat > 0.0;
}

fn package_lightshed_merge__1merge_finished(merging: package_lightshed_merge_Merging, confidence: f32, cap: f32) -> package_lightshed_merge_Merged {
    return package_lightshed_merge_Merged(package_lightshed_reservoir__1contribution_weight(merging.selection, merging.p_hat), min(confidence, cap));
}

fn package_lightshed_merge__1merge_pairwise(count: u32, cap: f32) -> package_lightshed_merge_Merged {
    let canonical = package_reuse__1merge_input(0u);
    var neighbours = 0.0;
    for (var i = 1u; i < count; i++) {
        neighbours += package_reuse__1merge_input(i).confidence;
    }
    let pairwise = package_lightshed_mis__1pairwise_defensive(canonical.confidence, neighbours);
    var merging = package_lightshed_merge__1nothing_merged();
    var kept = 0.0;
    for (var k = 2u; k < 2u * count; k++) {
        let i = k / 2u;
        let outward = k % 2u == 0u;
        let input = package_reuse__1merge_input(i);
        var image = package_lightshed_merge_MergeImage(0.0, 0.0);
        if select(input.weight, canonical.weight, outward) > 0.0 && input.confidence > 0.0 {
            image = package_reuse__1merge_shift(select(i, 0u, outward), select(0u, i, outward));
        }
        if outward {
            kept += package_lightshed_mis__1pairwise_kept(pairwise, input.confidence, canonical.p_hat, image.p_hat * image.jacobian);
        }
        else if package_lightshed_merge__1is_defined(image) {
            let m = package_lightshed_mis__1pairwise_neighbour(pairwise, input.confidence, image.p_hat, input.p_hat / image.jacobian);
            merging = package_lightshed_merge__1merged_with(merging, i, m, input.weight, image);
        }
    }
    if canonical.weight > 0.0 {
        let m = package_lightshed_mis__1pairwise_canonical(pairwise, canonical.confidence, kept);
        merging = package_lightshed_merge__1merged_with(merging, 0u, m, canonical.weight, package_lightshed_merge_MergeImage(canonical.p_hat, 1.0));
    }
    return package_lightshed_merge__1merge_finished(merging, canonical.confidence + neighbours, cap);
}

fn package_lightshed_merge__1merged_with(so_far: package_lightshed_merge_Merging, i: u32, m: f32, weight: f32, image: package_lightshed_merge_MergeImage) -> package_lightshed_merge_Merging {
    package_reuse__1merge_visit(i, m * weight * image.jacobian);
    let offered = package_lightshed_reservoir_offer(so_far.selection, i, m * image.p_hat * weight * image.jacobian, package_reuse__1merge_number(i));
    if !offered.accepted {
        return package_lightshed_merge_Merging(offered.selection, so_far.p_hat);
    }
    package_reuse__1merge_keep(i);
    return package_lightshed_merge_Merging(offered.selection, image.p_hat);
}

fn package_lightshed_merge__1nothing_merged() -> package_lightshed_merge_Merging {
    return package_lightshed_merge_Merging(package_lightshed_reservoir_Selection(0u, 0u, 0.0, 0.0), 0.0);
}

struct package_lightshed_mis_Pairwise {
    alpha: f32,
    kappa: f32,
    canonical_confidence: f32,
    neighbour_confidence: f32
}

fn package_lightshed_mis__1pairwise_canonical(pairwise: package_lightshed_mis_Pairwise, confidence: f32, kept: f32) -> f32 {
    return package_lightshed_mis_share(confidence, pairwise.canonical_confidence) * ((1.0 - pairwise.kappa) + pairwise.kappa * kept);
}

fn package_lightshed_mis__1pairwise_defensive(canonical: f32, neighbours: f32) -> package_lightshed_mis_Pairwise {
    return package_lightshed_mis_Pairwise(min(neighbours / canonical, package_lightshed_float__1F32_MAX), package_lightshed_mis_share(neighbours, canonical + neighbours), canonical, neighbours);
}

fn package_lightshed_mis__1pairwise_kept(pairwise: package_lightshed_mis_Pairwise, confidence: f32, p: f32, q: f32) -> f32 {
    let theirs = min(pairwise.alpha * q, package_lightshed_float__1F32_MAX);
    var fraction = 1.0;
    if theirs > 0.0 {
        fraction = package_lightshed_mis_share(p, p + theirs);
    }
    return package_lightshed_mis_share(confidence, pairwise.neighbour_confidence) * fraction;
}

fn package_lightshed_mis__1pairwise_neighbour(pairwise: package_lightshed_mis_Pairwise, confidence: f32, p: f32, q: f32) -> f32 {
    let mine = min(pairwise.alpha * q, package_lightshed_float__1F32_MAX);
    return pairwise.kappa * package_lightshed_mis_share(confidence, pairwise.neighbour_confidence) * package_lightshed_mis_share(mine, p + mine);
}

fn package_lightshed_mis_share(part: f32, total: f32) -> f32 {
    if part > 0.0 {
        return min(part / min(total, package_lightshed_float__1F32_MAX), 1.0);
    }
    return 0.0;
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

struct package_lightshed_reservoir_Offered {
    selection: package_lightshed_reservoir_Selection,
    accepted: bool
}

struct package_lightshed_reservoir_Selection {
    item: u32,
    tag: u32,
    weight_sum: f32,
    weight_sum_low: f32
}

const package_lightshed_reservoir__1TAG_EMPTY: u32 = 0u;

const package_lightshed_reservoir__1TAG_SAMPLE: u32 = 1u;

fn package_lightshed_reservoir__1contribution_weight(selection: package_lightshed_reservoir_Selection, target_value: f32) -> f32 {
    if selection.tag == package_lightshed_reservoir__1TAG_EMPTY || !(target_value > 0.0) {
        return 0.0;
    }
    return min(selection.weight_sum / target_value, package_lightshed_float__1F32_MAX);
}

fn package_lightshed_reservoir_offer(selection: package_lightshed_reservoir_Selection, item: u32, weight: f32, u: f32) -> package_lightshed_reservoir_Offered {
    if !(weight > 0.0) || !package_lightshed_vector__1is_finite(weight) {
        return package_lightshed_reservoir_Offered(selection, false);
    }
    let sum = min(selection.weight_sum + weight, package_lightshed_float__1F32_MAX);
    var lost: f32;
    if selection.weight_sum >= weight {
        lost = (selection.weight_sum - sum) + weight;
    }
    else {
        lost = (weight - sum) + selection.weight_sum;
    }
    let low = min(selection.weight_sum_low + lost, package_lightshed_float__1F32_MAX);
    let total = min(sum + low, package_lightshed_float__1F32_MAX);
    var next = selection;
    next.weight_sum_low = low - (total - sum);
    next.weight_sum = total;
    let accepted = u * next.weight_sum < weight || weight >= next.weight_sum;
    if accepted {
        next.item = item;
        next.tag = package_lightshed_reservoir__1TAG_SAMPLE;
    }
    return package_lightshed_reservoir_Offered(next, accepted);
}

const package_lightshed_rng_PARITY: u32 = 466688986u;

fn package_lightshed_rng__1random_block(seed: vec2u, pixel: u32, sample: u32, block: u32) -> vec4u {
    return package_lightshed_rng__1threefry4x32_12(vec4u(block, 0u, 0u, 0u), vec4u(seed, pixel, sample));
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

fn package_lightshed_sky__1columns_start(cells: vec2u, row: u32) -> u32 {
    return cells.y + row * cells.x;
}

fn package_lightshed_sky__1last_column(cells: vec2u, row: u32) -> u32 {
    return package_memory_scene__2load_sky_word(cells.y + cells.x * cells.y + row);
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

fn package_lightshed_uniform__1unit_square(bits: vec2u) -> vec2f {
    return vec2f(bits >> vec2u(8u)) * 5.9604645e-8;
}

fn package_lightshed_uniform__2f32_from_u32(bits: u32) -> f32 {
    return f32(bits >> 8u) * 5.9604645e-8;
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

const package_lightshed_warp__1INVERSE_PI: f32 = 0.31830987;

const package_lightshed_warp__2INVERSE_FOUR_PI: f32 = 0.07957747;

fn package_lightshed_wide__1wide_add(a: vec2u, b: vec2u) -> vec2u {
    let low = a.x + b.x;
    return vec2u(low, a.y + b.y + select(0u, 1u, low < a.x));
}

fn package_lightshed_wide__1wide_less(a: vec2u, b: vec2u) -> bool {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
}

fn package_lightshed_wide__1wide_multiply(a: vec2u, b: vec2u) -> vec2u {
    let low = package_lightshed_wide__1wide_product(a.x, b.x);
    return vec2u(low.x, low.y + a.x * b.y + a.y * b.x);
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

fn package_memory_pixels__1pixel_block(pixel: u32, sample: u32, index: u32) -> vec4u {
    return package_lightshed_rng__1random_block(package_memory_scene_settings.seed, package_memory_pixels__1pixel_name(pixel), sample, index);
}

fn package_memory_pixels__1pixel_name(pixel: u32) -> u32 {
    return package_memory_pixels__1place_name(package_memory_pixels__1pixel_place(pixel));
}

fn package_memory_pixels__1pixel_place(pixel: u32) -> vec2u {
    let width = package_memory_scene_settings.camera.size.x;
    return vec2u(pixel % width, pixel / width);
}

fn package_memory_pixels__1place_name(place: vec2u) -> u32 {
    return (place.y << 16u) | place.x;
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

override package_memory_scene__1HAS_PLASTICS: bool = true;

override package_memory_scene__1HAS_SKY: bool = true;

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

struct package_primaries_Primary {
    hit: package_lightshed_ray_Hit,
    direction: vec3f,
    padding: u32
}

@group(2) @binding(1)
var<storage, read_write> package_primaries_primaries: array<package_primaries_Primary>;

fn package_reuse__1arrived_from(i: u32) -> package_samples_Sample {
    if i == 0u {
        return package_reuse__1held_by(0u);
    }
    return package_reuse_carried;
}

fn package_reuse__1held_by(i: u32) -> package_samples_Sample {
    if i == 0u {
        return package_world_memory_given[package_inputs_inputs.pixels[0]];
    }
    return package_world_memory_cells[package_inputs_inputs.pixels[i]];
}

fn package_reuse__1merge_input(i: u32) -> package_lightshed_merge_MergeInput {
    let held = package_reuse__1held_by(i);
    var confidence = package_samples__1sample_confidence(held);
    if i > 0u {
        confidence = package_world_memory_confidences[package_inputs_inputs.pixels[i] / package_world_memory_world.each];
    }
    return package_lightshed_merge_MergeInput(confidence, package_samples__1sample_weight(held), package_samples__1sample_target(held));
}

fn package_reuse__1merge_keep(i: u32) {
    package_reuse_kept = package_reuse__1arrived_from(i);
}

fn package_reuse__1merge_number(i: u32) -> f32 {
    return package_inputs_decision(i, package_world_memory_world.number, package_world_memory_LINKS);
}

fn package_reuse__1merge_shift(i: u32, j: u32) -> package_lightshed_merge_MergeImage {
    let arrived = package_samples__1sample_in(package_reuse__1held_by(i), package_reuse__1seen_of(j));
    if j == 0u {
        package_reuse_carried = arrived.sample;
    }
    return arrived.image;
}

fn package_reuse__1merge_visit(i: u32, weight: f32) {
    package_reuse_gathered += package_samples__1sample_value(package_reuse__1arrived_from(i)) * weight;
}

fn package_reuse__1seen_of(j: u32) -> package_primaries_Primary {
    if j == 0u {
        return package_primaries_primaries[package_inputs_inputs.pixels[0]];
    }
    return package_world_memory_sites[package_inputs_inputs.pixels[j] / package_world_memory_world.each];
}

var<private> package_reuse_carried: package_samples_Sample;

var<private> package_reuse_gathered: vec3f;

var<private> package_reuse_kept: package_samples_Sample;

struct package_samples_Arrived {
    sample: package__1restir_di_light_Light,
    image: package_lightshed_merge_MergeImage
}

alias package_samples_Sample = package__1restir_di_light_Light;

fn package_samples__1no_sample(confidence: f32) -> package__1restir_di_light_Light {
    return package__1restir_di_light__1no_light(confidence);
}

fn package_samples__1sample_confidence(light: package__1restir_di_light_Light) -> f32 {
    return light.confidence;
}

fn package_samples__1sample_in(light: package__1restir_di_light_Light, there: package_primaries_Primary) -> package_samples_Arrived {
    var next = light;
    next.value = package__1restir_di_target__1visible_value(package__1restir_di_target__1seen_by(there), light);
    return package_samples_Arrived(next, package_lightshed_merge_MergeImage(package_lightshed_color_luminance(next.value), 1.0));
}

fn package_samples__1sample_target(light: package__1restir_di_light_Light) -> f32 {
    return package_lightshed_color_luminance(light.value);
}

fn package_samples__1sample_value(light: package__1restir_di_light_Light) -> vec3f {
    return light.value;
}

fn package_samples__1sample_weight(light: package__1restir_di_light_Light) -> f32 {
    return light.weight;
}

fn package_samples__1sample_with(light: package__1restir_di_light_Light, weight: f32, confidence: f32) -> package__1restir_di_light_Light {
    var next = light;
    next.weight = weight;
    next.confidence = confidence;
    return next;
}

fn package_samples__1takes_part(seen: package_primaries_Primary) -> bool {
    return package_lightshed_bsdf__2has_non_delta(package_lightshed_surface__1surface_point(package_memory_scene__1load_triangle(seen.hit.primitive), seen.hit).material);
}

fn package_samples__2is_same_sample(a: package__1restir_di_light_Light, b: package__1restir_di_light_Light) -> bool {
    return a.emitter == b.emitter && all(bitcast<vec3u>(a.place) == bitcast<vec3u>(b.place));
}

fn package_selected__1area_of(emitter: package_lightshed_emitter_Emitter) -> f32 {
    return 0.5 * package_lightshed_vector_length3(package_lightshed_vector_cross3(emitter.edge0, emitter.edge1));
}

const package_threads_GROUP: u32 = 64u;

fn package_threads__1thread_number(id: vec3u, groups: vec3u) -> u32 {
    return id.x + id.y * groups.x * package_threads_GROUP;
}

const package_world_memory_COPIES: u32 = 32769u;

const package_world_memory_LINKS: u32 = 33024u;

const package_world_memory_RANK: u32 = 32768u;

struct package_world_memory_World {
    grid: package_lightshed__1hash_grid_LevelGrid,
    number: u32,
    each: u32,
    most: u32,
    reads: u32,
    cap: f32,
    pixel_cap: f32,
    shades: u32,
    padding: u32
}

@group(3) @binding(10)
var<storage, read> package_world_memory__1world_indices: array<u32>;

@group(3) @binding(3)
var<storage, read_write> package_world_memory__1world_sited: array<u32>;

@group(3) @binding(1)
var<storage, read_write> package_world_memory__1world_visitors: array<package_memory_visits_Visitor>;

@group(3) @binding(8)
var<storage, read> package_world_memory__1world_visits: array<package_memory_visits_Visit>;

@group(3) @binding(2)
var<storage, read> package_world_memory__1world_words: array<vec2u>;

@group(3) @binding(9)
var<storage, read> package_world_memory__2world_visit_count: u32;

fn package_world_memory_block(pixel: u32, index: u32) -> vec4u {
    return package_memory_pixels__1pixel_block(pixel, package_world_memory_world.number, index);
}

@group(3) @binding(5)
var<storage, read_write> package_world_memory_cells: array<package_samples_Sample>;

@group(3) @binding(6)
var<storage, read_write> package_world_memory_confidences: array<f32>;

@group(2) @binding(3)
var<storage, read_write> package_world_memory_given: array<package_samples_Sample>;

@group(2) @binding(5)
var<storage, read_write> package_world_memory_image: array<vec4f>;

@group(2) @binding(4)
var<storage, read_write> package_world_memory_made: array<package_samples_Sample>;

@group(3) @binding(4)
var<storage, read_write> package_world_memory_sites: array<package_primaries_Primary>;

@group(3) @binding(7)
var<storage, read_write> package_world_memory_terms: array<package_samples_Sample>;

@group(3) @binding(0)
var<storage, read> package_world_memory_world: package_world_memory_World;

fn package_world_terms__1held_confidence(visit: package_memory_visits_Visit) -> f32 {
    if package_world_memory__1world_sited[visit.slot] == 0u {
        return 0.0;
    }
    return package_world_memory_confidences[visit.slot];
}

fn package_world_terms__1merged_in(visit: package_memory_visits_Visit) -> package_primaries_Primary {
    if visit.moves != 0u {
        return package_world_terms_bringing(visit, 0u);
    }
    return package_world_memory_sites[visit.slot];
}

fn package_world_terms__1term_of(visit: package_memory_visits_Visit, i: u32) -> package_samples_Sample {
    let held = package_world_terms__1held_confidence(visit);
    let moves = visit.moves != 0u;
    let is_held = i < package_world_memory_world.each;
    let brought = i - package_world_memory_world.each;
    var confidence = 1.0;
    if is_held {
        confidence = held / f32(package_world_memory_world.each);
    }
    if !(confidence > 0.0) || (!is_held && brought >= visit.count) {
        return package_samples__1no_sample(0.0);
    }
    var own: package_samples_Sample;
    if is_held {
        own = package_world_memory_cells[package_world_memory_world.each * visit.slot + i];
    }
    else {
        own = package_world_memory_made[package_world_memory__1world_indices[visit.first + brought]];
    }
    let weight = package_samples__1sample_weight(own);
    let p_hat = package_samples__1sample_target(own);
    if !(weight > 0.0 && p_hat > 0.0) {
        return package_samples__1no_sample(0.0);
    }
    let is_canonical = select(is_held, i == package_world_memory_world.each, moves);
    let pixels = visit.count - select(0u, 1u, moves);
    let others = pixels + select(0u, 1u, moves && held > 0.0);
    let pairwise = package_lightshed_mis__1pairwise_defensive(select(held, 1.0, moves), f32(pixels) + select(0.0, held, moves));
    var kept = 0.0;
    var arrived = package_samples__1sample_with(own, 0.0, 0.0);
    var image = package_lightshed_merge_MergeImage(0.0, 0.0);
    for (var k = 0u; k < select(1u, others, is_canonical); k++) {
        var there: package_primaries_Primary;
        if !is_canonical {
            there = package_world_terms__1merged_in(visit);
        }
        else if k < pixels {
            there = package_world_terms_bringing(visit, k + select(0u, 1u, moves));
        }
        else {
            there = package_world_memory_sites[visit.slot];
        }
        let shifted = package_samples__1sample_in(own, there);
        image = shifted.image;
        if is_canonical {
            let theirs = select(held, 1.0, k < pixels);
            kept += package_lightshed_mis__1pairwise_kept(pairwise, theirs, p_hat, image.p_hat * image.jacobian);
        }
        else {
            arrived = shifted.sample;
        }
    }
    if is_canonical {
        return package_samples__1sample_with(own, package_lightshed_mis__1pairwise_canonical(pairwise, confidence, kept) * weight, 0.0);
    }
    if !package_lightshed_merge__1is_defined(image) {
        return package_samples__1no_sample(0.0);
    }
    let m = package_lightshed_mis__1pairwise_neighbour(pairwise, confidence, image.p_hat, p_hat / image.jacobian);
    return package_samples__1sample_with(arrived, m * weight * image.jacobian, 0.0);
}

fn package_world_terms_bringing(visit: package_memory_visits_Visit, k: u32) -> package_primaries_Primary {
    return package_primaries_primaries[package_world_memory__1world_indices[visit.first + k]];
}
