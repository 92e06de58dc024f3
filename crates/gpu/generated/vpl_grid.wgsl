// Linked from vpl_grid.wesl.

struct VplGrid {
    frame: u32,
    first_level: u32,
    shadow_samples: u32,
    spread: u32,
    least_distance_squared: f32,
    has_lights: u32,
    padding0: u32,
    padding1: u32
}

@group(2) @binding(1)
var<storage, read_write> pixels: array<package__1vpl_pixel_Pixel>;

@group(2) @binding(2)
var<storage, read_write> visibility: array<f32>;

@group(2) @binding(3)
var<storage, read> asked: VplGrid;

const MOST_MIRRORS: u32 = 16u;

fn scattering_probability(material: package_lightshed_material_MaterialAt, wo: vec3f) -> f32 {
    let rows = package_memory_scene__1load_material(material.index);
    if rows.y == 1u {
        return 1.0;
    }
    let total = package_lightshed_bsdf__1total_importance(material, wo);
    var mirrors = 0.0;
    for (var i = 0u; i < rows.y; i++) {
        let component = package_lightshed_bsdf__1component_at(material, rows, i);
        if package_lightshed_bsdf__1is_delta(component) && package_lightshed_bsdf__1mirror_of(component.side, wo) != 0.0 {
            mirrors += package_lightshed_bsdf__1share_of(component.importance, total);
        }
    }
    return max(1.0 - mirrors, 1.1920929e-7);
}

struct Bounce {
    exists: bool,
    is_delta: bool,
    start: vec3f,
    pdf: f32
}

fn weighed(emitted: vec3f, bounce: Bounce, pdf: f32) -> vec3f {
    if bounce.exists && !bounce.is_delta {
        return emitted * package_lightshed_measure__1power_heuristic(bounce.pdf, pdf);
    }
    return emitted;
}

@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let pixel = package_threads__1thread_number(id, groups);
    if pixel >= package_memory_scene_settings.pixels {
        return;
    }
    var stream = package_memory_pixels__1pixel_stream(pixel, asked.frame);
    var ray = package_memory_pixels__1streamed_ray(pixel, &stream);
    var direct = vec3f(0.0);
    var throughput = vec3f(1.0);
    var bounce = Bounce(false, false, vec3f(0.0), 0.0);
    var distance = 0.0;
    var found = false;
    var receiver: package_lightshed_surface_SurfacePoint;
    var receiver_wo: vec3f;
    var receiver_throughput: vec3f;
    var seen = package__1vpl_pixel_Pixel(vec3f(0.0), 1.0, vec3f(0.0), 0u, vec3f(0.0), 0u, vec3f(0.0), 0u);
    for (var depth = 0u; depth <= MOST_MIRRORS; depth++) {
        let hit = package_lightshed_cwbvh_intersect(ray);
        if hit.primitive == package_lightshed_ray_NOTHING {
            if package_memory_scene__1HAS_SURROUNDINGS {
                let around = package_lightshed_emitter__1surroundings_radiance(ray.direction);
                direct += throughput * weighed(around, bounce, package_lightshed_emitter__1surroundings_pdf(ray.direction));
            }
            break;
        }
        let point = package_lightshed_surface__1surface_point(package_memory_scene__1load_triangle(hit.primitive), hit);
        if package_memory_scene__1HAS_EMITTERS && point.emitter != package_lightshed_ray_NOTHING && package_lightshed_vector_dot3(ray.direction, point.geometric_normal) < 0.0 {
            let emitted = package_lightshed_emitter__1emitter_radiance(package_memory_scene__1load_emitter(point.emitter));
            direct += throughput * weighed(emitted, bounce, package_lightshed_emitter__1emitter_pdf(point.emitter, bounce.start, point.position));
        }
        distance += package_lightshed_vector_length3(point.position - ray.origin);
        let wo = package_lightshed_frame__1to_local(point.shading, -ray.direction);
        let u_lobe = package_lightshed_stream__1next_number(&stream);
        let a = package_lightshed_stream__1next_number(&stream);
        let b = package_lightshed_stream__1next_number(&stream);
        let next = package_lightshed_bsdf__1sample_bsdf(point.material, wo, u_lobe, vec2f(a, b));
        let by_mirror = (next.some && next.is_delta) || !package_lightshed_bsdf__2has_non_delta(point.material);
        let receives = !found && !by_mirror;
        if receives {
            found = true;
            receiver = point;
            receiver_wo = wo;
            receiver_throughput = throughput / scattering_probability(point.material, wo);
            seen.distance = distance;
            let low = package_lightshed_stream__1next_word(&stream);
            let high = package_lightshed_stream__1next_word(&stream);
            let c = package_lightshed_stream__1next_number(&stream);
            let d = package_lightshed_stream__1next_number(&stream);
            if package_memory_scene__1HAS_EMITTERS || package_memory_scene__1HAS_SURROUNDINGS {
                let light = package_lightshed_emitter__1sample_emitter(point.position, vec2u(low, high), vec2f(c, d));
                if light.pdf > 0.0 {
                    let scattered = package_lightshed_bsdf__1evaluate_bsdf(point.material, wo, package_lightshed_frame__1to_local(point.shading, light.direction));
                    if any(scattered.value != vec3f(0.0)) && !package_lightshed_cwbvh_occluded(package_lightshed_emitter__1shadow_ray(point, light)) {
                        let weight = package_lightshed_measure__1power_heuristic(light.pdf, scattered.pdf);
                        direct += receiver_throughput * (scattered.value * light.weight * weight);
                    }
                }
            }
        }
        if !next.some || !(receives || by_mirror) {
            break;
        }
        throughput *= next.weight;
        if all(throughput == vec3f(0.0)) {
            break;
        }
        bounce = Bounce(true, next.is_delta, point.position, next.pdf);
        ray = package_lightshed_surface_spawn(point, package_lightshed_frame__1to_world(point.shading, next.wi));
    }
    seen.direct = direct;
    var share = 1.0;
    if found && asked.has_lights != 0u {
        package_gathering__1begin_gathering(package_gathering_Gatherer(receiver.material, receiver_wo, receiver.shading, receiver_throughput, asked.least_distance_squared, asked.shadow_samples), stream);
        package_lightshed__1lighting_grid__1grid_visit(receiver.position, package_lightshed__1lighting_grid_GridQuery(asked.first_level, 1u, 0u));
        seen.unshadowed = min(package_gathering_unshadowed, vec3f(package_lightshed_float__1F32_MAX));
        seen.position = receiver.position;
        let side = select(1.0, -1.0, receiver_wo.z < 0.0);
        seen.normal = package_lightshed_frame__1to_world(receiver.shading, vec3f(0.0, 0.0, side));
        stream = package_gathering_numbers;
        var reached = 0.0;
        var tested = 0.0;
        for (var i = 0u; i < asked.shadow_samples; i++) {
            let selection = package_gathering_chosen[i];
            if selection.weight_sum == 0.0 {
                continue;
            }
            var goal: vec3f;
            if asked.spread != 0u {
                goal = package_lightshed__1grid_shadow__1shadow_target(selection.item.x, selection.item.y, &stream);
            }
            else {
                let light = package_lightshed__1grid_shadow__1represented_light(selection.item.x, selection.item.y, receiver.position, &stream);
                goal = package_memory__1lighting_grid__2load_grid_point(light).position;
            }
            tested += 1.0;
            let origin = package_lightshed_surface__1origin_towards(receiver, goal - receiver.position);
            if !package_lightshed_cwbvh_occluded(package_lightshed_ray_Ray(origin, package_lightshed_emitter__1SEGMENT_END, goal - origin, 0u)) {
                reached += 1.0;
            }
        }
        if tested > 0.0 {
            share = reached / tested;
        }
    }
    pixels[pixel] = seen;
    visibility[pixel] = share;
}

struct package__1vpl_pixel_Pixel {
    direct: vec3f,
    distance: f32,
    unshadowed: vec3f,
    padding0: u32,
    position: vec3f,
    padding1: u32,
    normal: vec3f,
    padding2: u32
}

struct package_gathering_Gatherer {
    material: package_lightshed_material_MaterialAt,
    wo: vec3f,
    shading: package_lightshed_frame_Frame,
    throughput: vec3f,
    least_distance_squared: f32,
    samples: u32
}

fn package_gathering__1begin_gathering(by: package_gathering_Gatherer, stream: package_lightshed_stream_Stream) {
    package_gathering_gatherer = by;
    package_gathering_unshadowed = vec3f(0.0);
    package_gathering_numbers = stream;
    for (var i = 0u; i < package_gathering__2MOST_SHADOW_SAMPLES; i++) {
        package_gathering_chosen[i] = package_lightshed__1jump_selection__2no_jump_selection();
    }
}

fn package_gathering__1visit_influence(influence: package_lightshed__1lighting_grid_Influence) {
    let wi = package_lightshed_frame__1to_local(package_gathering_gatherer.shading, influence.direction);
    let response = package_gathering_gatherer.throughput * package_lightshed_bsdf__1evaluate_bsdf(package_gathering_gatherer.material, package_gathering_gatherer.wo, wi).value;
    let falloff = 1.0 / max(influence.distance_squared, package_gathering_gatherer.least_distance_squared);
    let light = response * influence.intensity * falloff;
    package_gathering_unshadowed += light;
    let weight = package_lightshed_color_luminance(light);
    for (var i = 0u; i < package_gathering_gatherer.samples; i++) {
        let selection = package_lightshed__1jump_selection__1jump_added(package_gathering_chosen[i], weight);
        package_gathering_chosen[i] = selection;
        if package_lightshed__1jump_selection__2jump_is_due(selection, weight) {
            var stream = package_gathering_numbers;
            let low = package_lightshed_stream__1next_word(&stream);
            let u = package_lightshed__1jump_selection__1jump_number(vec2u(low, package_lightshed_stream__1next_word(&stream)));
            package_gathering_numbers = stream;
            package_gathering_chosen[i] = package_lightshed__1jump_selection__1jump_selected(selection, vec2u(influence.level, influence.index), u);
        }
    }
}

const package_gathering__2MOST_SHADOW_SAMPLES: u32 = 16u;

var<private> package_gathering_chosen: array<package_lightshed__1jump_selection_JumpSelection, 16>;

var<private> package_gathering_gatherer: package_gathering_Gatherer;

var<private> package_gathering_numbers: package_lightshed_stream_Stream;

var<private> package_gathering_unshadowed: vec3f;

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

const package_lightshed__1grid_light__1CORRECTION_BOUND: f32 = 0.2;

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

fn package_lightshed__1grid_light__1grid_emission(light: package_lightshed__1grid_light_GridLight, d: vec3f) -> f32 {
    let across = light.moment_across;
    let square = light.moment_xx * d.x * d.x + light.moment_yy * d.y * d.y + light.moment_zz * d.z * d.z + 2.0 * (across.x * d.x * d.y + across.y * d.y * d.z + across.z * d.z * d.x);
    let mean = package_lightshed_vector_dot3(light.mean_normal, d);
    return light.isotropic + 0.5 * (mean + max(abs(mean), sqrt(max(square, 0.0))));
}

fn package_lightshed__1grid_light__1level_radius(frame: package_lightshed__1grid_light_GridFrame, level: u32) -> f32 {
    return frame.radius_0 * f32(1u << level);
}

fn package_lightshed__1grid_light__1point_emission(normal: vec3f, direction: vec3f) -> f32 {
    if all(normal == vec3f(0.0)) {
        return 1.0;
    }
    return max(package_lightshed_vector_dot3(normal, direction), 0.0);
}

fn package_lightshed__1grid_light__2blending_distance_squared(light: package_lightshed__1grid_light_GridLight, to_light: vec3f) -> f32 {
    let variance = light.spread * light.spread;
    let squares = to_light * to_light;
    let distance_squared = squares.x + squares.y + squares.z;
    let across = package_lightshed_vector_dot3(variance, squares / distance_squared);
    let correction = variance.x + variance.y + variance.z - package_lightshed_float__2as_it_is(4.0 * across);
    let bound = package_lightshed__1grid_light__1CORRECTION_BOUND * distance_squared;
    return distance_squared + min(max(correction, -bound), bound);
}

fn package_lightshed__1grid_light__2offset_from_vertex(light: package_lightshed__1grid_light_GridPoint, key: u32, row: package_lightshed__1grid_light_CellRow, vertex: vec3u) -> vec3f {
    let fraction = vec3f(light.fraction_x, light.fraction_y, light.fraction_z);
    return fraction - vec3f(vertex - vec3u(key - row.start, row.y, row.z));
}

fn package_lightshed__1grid_light_blending(frame: package_lightshed__1grid_light_GridFrame, level: u32, first_level: u32, distance_squared: f32) -> f32 {
    let radius = package_lightshed__1grid_light__1level_radius(frame, level);
    let t = distance_squared * (1.0 / (radius * radius));
    let up = select(1.0, (package_lightshed_float__2as_it_is(4.0 * t) - 1.0) / 3.0, level > first_level);
    let down = select(1.0, (4.0 - t) / 3.0, level < frame.levels);
    return clamp(min(up, down), 0.0, 1.0);
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

const package_lightshed__1grid_shadow__1LEAST_EMISSION: f32 = 1e-6;

const package_lightshed__1grid_shadow__1SQRT_THREE: f32 = 1.7320508;

fn package_lightshed__1grid_shadow__1occupied_place(first_word: u32, side: u32, vertex: vec3u) -> vec2u {
    let row = first_word + (vertex.z * side + vertex.y) * (side / 32u + 1u);
    let bits = package_memory__1lighting_grid__2load_grid_word(row + vertex.x / 32u).x;
    return vec2u((bits >> (vertex.x % 32u)) & 1u, package_lightshed__1lighting_grid__1rank_at(row, vertex.x));
}

fn package_lightshed__1grid_shadow__1represented_light(level_of_light: u32, index: u32, point: vec3f, stream: ptr<function, package_lightshed_stream_Stream>) -> u32 {
    if level_of_light == 0u {
        return index;
    }
    let frame = package_memory__1lighting_grid__1grid_frame();
    var level = level_of_light;
    var vertex = package_lightshed__1grid_shadow_unpacked(package_memory__1lighting_grid__2load_grid_vertex(package_memory__1lighting_grid__2load_grid_word(frame.first_word[level - 1u]).y + index));
    while (level > 1u) {
        level--;
        let side = (1u << (frame.levels - level)) + 1u;
        let first_word = frame.first_word[level - 1u];
        var chosen = package_lightshed__1jump_selection__2no_jump_selection();
        for (var step = 0u; step < 27u; step++) {
            let away = vec3i(vec3u(step % 3u, step / 3u % 3u, step / 9u)) - 1;
            let finer = vec3i(2u * vertex) + away;
            if any(finer < vec3i(0)) || any(finer >= vec3i(i32(side))) {
                continue;
            }
            let found = package_lightshed__1grid_shadow__1occupied_place(first_word, side, vec3u(finer));
            if found.x == 0u {
                continue;
            }
            let light = package_memory__1lighting_grid__2load_grid_light(found.y);
            let emission = package_lightshed__1grid_light__1grid_emission(light, package_lightshed_vector__1normalized_or(point - light.position, vec3f(0.0)));
            let halves = select(vec3f(1.0), vec3f(0.5), away != vec3i(0));
            let weight = halves.x * halves.y * halves.z * package_memory__1lighting_grid__2load_grid_weight(found.y) * (emission + package_lightshed__1grid_shadow__1LEAST_EMISSION);
            chosen = package_lightshed__1grid_shadow_offered(chosen, vec2u(step, 0u), weight, stream);
        }
        let step = select(13u, chosen.item.x, chosen.weight_sum > 0.0);
        vertex = vec3u(vec3i(2u * vertex) + vec3i(vec3u(step % 3u, step / 3u % 3u, step / 9u)) - 1);
    }
    var chosen = package_lightshed__1jump_selection__2no_jump_selection();
    for (var i = 0u; i < 4u; i++) {
        let row = package_lightshed__1grid_light__1cells_beside(vertex, i, frame.levels);
        if row.first == row.end {
            continue;
        }
        let end = package_lightshed__1lighting_grid__2place_of_key(frame, row.end);
        for (var place = package_lightshed__1lighting_grid__2place_of_key(frame, row.first); place < end; place++) {
            let light = package_memory__1lighting_grid__2load_grid_point(place);
            let away = package_lightshed__1grid_light__2offset_from_vertex(light, package_memory__1lighting_grid__2load_grid_key(place), row, vertex);
            let along = max(vec3f(1.0) - abs(away), vec3f(0.0));
            let emission = package_lightshed__1grid_light__1point_emission(light.normal, package_lightshed_vector__1normalized_or(point - light.position, vec3f(0.0)));
            let weight = along.x * along.y * along.z * package_lightshed_color_luminance(light.intensity);
            chosen = package_lightshed__1grid_shadow_offered(chosen, vec2u(place, 0u), weight * (emission + package_lightshed__1grid_shadow__1LEAST_EMISSION), stream);
        }
    }
    return chosen.item.x;
}

fn package_lightshed__1grid_shadow__1shadow_target(level: u32, index: u32, stream: ptr<function, package_lightshed_stream_Stream>) -> vec3f {
    let x = package_lightshed_stream__1next_number(stream);
    let y = package_lightshed_stream__1next_number(stream);
    let z = package_lightshed_stream__1next_number(stream);
    if level == 0u {
        return package_memory__1lighting_grid__2load_grid_point(index).position;
    }
    let light = package_memory__1lighting_grid__2load_grid_light(package_memory__1lighting_grid__2load_grid_word(package_memory__1lighting_grid__1grid_frame().first_word[level - 1u]).y + index);
    return light.position + light.spread * package_lightshed__1grid_shadow__1SQRT_THREE * (2.0 * vec3f(x, y, z) - 1.0);
}

fn package_lightshed__1grid_shadow_offered(selection: package_lightshed__1jump_selection_JumpSelection, item: vec2u, weight: f32, stream: ptr<function, package_lightshed_stream_Stream>) -> package_lightshed__1jump_selection_JumpSelection {
    let next = package_lightshed__1jump_selection__1jump_added(selection, weight);
    if package_lightshed__1jump_selection__2jump_is_due(next, weight) {
        let low = package_lightshed_stream__1next_word(stream);
        return package_lightshed__1jump_selection__1jump_selected(next, item, package_lightshed__1jump_selection__1jump_number(vec2u(low, package_lightshed_stream__1next_word(stream))));
    }
    return next;
}

fn package_lightshed__1grid_shadow_unpacked(vertex: u32) -> vec3u {
    return vec3u(vertex & 1023u, (vertex >> 10u) & 1023u, vertex >> 20u);
}

struct package_lightshed__1jump_selection_JumpSelection {
    item: vec2u,
    weight_sum: f32,
    weight_sum_low: f32,
    threshold: f32
}

fn package_lightshed__1jump_selection__1jump_added(selection: package_lightshed__1jump_selection_JumpSelection, weight: f32) -> package_lightshed__1jump_selection_JumpSelection {
    if !package_lightshed__1jump_selection__1jump_counts(weight) {
        return selection;
    }
    let larger = max(selection.weight_sum, weight);
    let smaller = min(selection.weight_sum, weight);
    let sum = min(larger + smaller, package_lightshed_float__1F32_MAX);
    let low = min(selection.weight_sum_low + ((larger - sum) + smaller), package_lightshed_float__1F32_MAX);
    let total = min(sum + low, package_lightshed_float__1F32_MAX);
    var next = selection;
    next.weight_sum_low = low - (total - sum);
    next.weight_sum = total;
    return next;
}

fn package_lightshed__1jump_selection__1jump_counts(weight: f32) -> bool {
    return weight > 0.0 && package_lightshed_vector__1is_finite(weight);
}

fn package_lightshed__1jump_selection__1jump_number(words: vec2u) -> f32 {
    return (f32(~words.y) + (1.0 - f32(words.x) * 2.3283064e-10)) * 2.3283064e-10;
}

fn package_lightshed__1jump_selection__1jump_selected(selection: package_lightshed__1jump_selection_JumpSelection, item: vec2u, u: f32) -> package_lightshed__1jump_selection_JumpSelection {
    var next = selection;
    next.item = item;
    next.threshold = min(selection.weight_sum / u, package_lightshed_float__1F32_MAX);
    return next;
}

fn package_lightshed__1jump_selection__2jump_is_due(selection: package_lightshed__1jump_selection_JumpSelection, weight: f32) -> bool {
    return package_lightshed__1jump_selection__1jump_counts(weight) && selection.weight_sum > selection.threshold;
}

fn package_lightshed__1jump_selection__2no_jump_selection() -> package_lightshed__1jump_selection_JumpSelection {
    return package_lightshed__1jump_selection_JumpSelection(vec2u(0u), 0.0, 0.0, 0.0);
}

struct package_lightshed__1lighting_grid_GridQuery {
    first_level: u32,
    stride: u32,
    phase: u32
}

struct package_lightshed__1lighting_grid_Influence {
    level: u32,
    index: u32,
    direction: vec3f,
    distance_squared: f32,
    intensity: vec3f
}

const package_lightshed__1lighting_grid_ROUNDING: f32 = 0.002;

struct package_lightshed__1lighting_grid_Span {
    first: u32,
    end: u32
}

const package_lightshed__1lighting_grid__1REACH_FACTOR: f32 = 1.12;

fn package_lightshed__1lighting_grid__1first_of(query: package_lightshed__1lighting_grid_GridQuery, begin: u32) -> u32 {
    return begin + (query.phase % query.stride + query.stride - begin % query.stride) % query.stride;
}

fn package_lightshed__1lighting_grid__1grid_visit(point: vec3f, asked: package_lightshed__1lighting_grid_GridQuery) {
    let frame = package_memory__1lighting_grid__1grid_frame();
    let query = package_lightshed__1lighting_grid_GridQuery(min(asked.first_level, 1u), max(asked.stride, 1u), asked.phase);
    if query.first_level == 0u {
        package_lightshed__1lighting_grid__1visit_rows(frame, 0u, point, query, 2.0 * package_lightshed__1grid_light__1level_radius(frame, 0u));
    }
    for (var level = 1u; level < frame.levels; level++) {
        package_lightshed__1lighting_grid__1visit_rows(frame, level, point, query, package_lightshed__1lighting_grid__1REACH_FACTOR * (2.0 * package_lightshed__1grid_light__1level_radius(frame, level)));
    }
    let begin = package_memory__1lighting_grid__2load_grid_word(frame.first_word[frame.levels - 1u]).y;
    package_lightshed__1lighting_grid__2visit_grid_lights(frame, frame.levels, point, query, begin, package_memory__1lighting_grid__2load_grid_word(frame.first_word[frame.levels]).y);
}

fn package_lightshed__1lighting_grid__1in_range(to_light: vec3f, weight: f32) -> bool {
    let distance_squared = package_lightshed_vector_dot3(to_light, to_light);
    return weight > 0.0 && distance_squared >= package_lightshed_float__2F32_MIN_POSITIVE && distance_squared <= package_lightshed_float__1F32_MAX;
}

fn package_lightshed__1lighting_grid__1rank_at(word: u32, x: u32) -> u32 {
    let map = package_memory__1lighting_grid__2load_grid_word(word + x / 32u);
    return map.y + countOneBits(map.x & ((1u << (x % 32u)) - 1u));
}

fn package_lightshed__1lighting_grid__1reach_out(level: u32, index: u32, to_light: vec3f, intensity: vec3f, weight: f32, emission: f32) {
    let distance_squared = package_lightshed_vector_dot3(to_light, to_light);
    let seen = min(intensity * (weight * emission), vec3f(package_lightshed_float__1F32_MAX));
    if all(seen == vec3f(0.0)) {
        return;
    }
    package_gathering__1visit_influence(package_lightshed__1lighting_grid_Influence(level, index, to_light / sqrt(distance_squared), distance_squared, seen));
}

fn package_lightshed__1lighting_grid__1visit_points(frame: package_lightshed__1grid_light_GridFrame, point: vec3f, query: package_lightshed__1lighting_grid_GridQuery, begin: u32, end: u32) {
    for (var i = package_lightshed__1lighting_grid__1first_of(query, begin); i < end; i += query.stride) {
        let light = package_memory__1lighting_grid__2load_grid_point(i);
        let to_light = light.position - point;
        let weight = package_lightshed__1grid_light_blending(frame, 0u, 0u, package_lightshed_vector_dot3(to_light, to_light));
        if package_lightshed__1lighting_grid__1in_range(to_light, weight) {
            let direction = to_light / sqrt(package_lightshed_vector_dot3(to_light, to_light));
            let emission = package_lightshed__1grid_light__1point_emission(light.normal, -direction);
            package_lightshed__1lighting_grid__1reach_out(0u, i, to_light, light.intensity, weight * f32(query.stride), emission);
        }
    }
}

fn package_lightshed__1lighting_grid__1visit_rows(frame: package_lightshed__1grid_light_GridFrame, level: u32, point: vec3f, query: package_lightshed__1lighting_grid_GridQuery, radius: f32) {
    let cells = f32(1u << (frame.levels - max(level, 1u)));
    let per_cell = cells * package_lightshed_double__2double_to_f32(frame.per_size);
    let side = u32(cells) + select(1u, 0u, level == 0u);
    let last = f32(side - 1u);
    let center = (point - frame.origin) * per_cell - select(0.0, 0.5, level == 0u);
    let slack = select(1.0, 0.5, level == 0u) + package_lightshed__1lighting_grid_ROUNDING;
    let reach = radius * per_cell;
    let z_span = package_lightshed__1lighting_grid_span(center.z, reach + slack, last);
    for (var z = z_span.first; z < z_span.end; z++) {
        let dz = max(abs(center.z - f32(z)) - slack, 0.0);
        let of_slab = reach * reach - dz * dz;
        if of_slab < 0.0 {
            continue;
        }
        let y_span = package_lightshed__1lighting_grid_span(center.y, sqrt(of_slab) + slack, last);
        for (var y = y_span.first; y < y_span.end; y++) {
            let dy = max(abs(center.y - f32(y)) - slack, 0.0);
            let of_row = of_slab - dy * dy;
            if of_row < 0.0 {
                continue;
            }
            let x_span = package_lightshed__1lighting_grid_span(center.x, sqrt(of_row) + slack, last);
            if x_span.first >= x_span.end {
                continue;
            }
            let row = z * side + y;
            if level == 0u {
                let begin = package_lightshed__1lighting_grid__2place_of_key(frame, row * side + x_span.first);
                package_lightshed__1lighting_grid__1visit_points(frame, point, query, begin, package_lightshed__1lighting_grid__2place_of_key(frame, row * side + x_span.end));
            }
            else {
                let word = frame.first_word[level - 1u] + row * (side / 32u + 1u);
                let begin = package_lightshed__1lighting_grid__1rank_at(word, x_span.first);
                package_lightshed__1lighting_grid__2visit_grid_lights(frame, level, point, query, begin, package_lightshed__1lighting_grid__1rank_at(word, x_span.end));
            }
        }
    }
}

fn package_lightshed__1lighting_grid__2place_of_key(frame: package_lightshed__1grid_light_GridFrame, key: u32) -> u32 {
    var begin = 0u;
    var end = frame.lights;
    while (begin < end) {
        let middle = (begin + end) / 2u;
        if package_memory__1lighting_grid__2load_grid_key(middle) < key {
            begin = middle + 1u;
        }
        else {
            end = middle;
        }
    }
    return begin;
}

fn package_lightshed__1lighting_grid__2visit_grid_lights(frame: package_lightshed__1grid_light_GridFrame, level: u32, point: vec3f, query: package_lightshed__1lighting_grid_GridQuery, begin: u32, end: u32) {
    let start = package_memory__1lighting_grid__2load_grid_word(frame.first_word[level - 1u]).y;
    for (var i = package_lightshed__1lighting_grid__1first_of(query, begin - start); i < end - start; i += query.stride) {
        let light = package_memory__1lighting_grid__2load_grid_light(start + i);
        let to_light = light.position - point;
        let weight = package_lightshed__1grid_light_blending(frame, level, query.first_level, package_lightshed__1grid_light__2blending_distance_squared(light, to_light));
        if package_lightshed__1lighting_grid__1in_range(to_light, weight) {
            let direction = to_light / sqrt(package_lightshed_vector_dot3(to_light, to_light));
            let emission = package_lightshed__1grid_light__1grid_emission(light, -direction);
            package_lightshed__1lighting_grid__1reach_out(level, i, to_light, light.intensity, weight * f32(query.stride), emission);
        }
    }
}

fn package_lightshed__1lighting_grid_span(center: f32, reach: f32, last: f32) -> package_lightshed__1lighting_grid_Span {
    let first = max(ceil(center - reach), 0.0);
    let end = min(floor(center + reach), last);
    if !(end >= first) {
        return package_lightshed__1lighting_grid_Span(0u, 0u);
    }
    return package_lightshed__1lighting_grid_Span(u32(first), u32(end) + 1u);
}

struct package_lightshed_alias_AliasEntry {
    threshold: u32,
    alias_index: u32
}

fn package_lightshed_alias__1alias_route(length: u32, u: vec2u) -> vec2u {
    let low = package_lightshed_wide__1wide_product(length, u.x);
    let high = package_lightshed_wide__1wide_product(length, u.y);
    let coin = high.x + low.y;
    return vec2u(high.y + select(0u, 1u, coin < low.y), coin);
}

fn package_lightshed_alias__1alias_sample(table: u32, length: u32, u: vec2u) -> u32 {
    let route = package_lightshed_alias__1alias_route(length, u);
    let entry = package_memory_scene__2load_alias_entry(table, route.x);
    return select(entry.alias_index, route.x, route.y < entry.threshold);
}

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

const package_lightshed_double_SIGN: u32 = 2147483648u;

fn package_lightshed_double__1biased_exponent(a: vec2u) -> i32 {
    return i32((a.y >> 20u) & 2047u);
}

fn package_lightshed_double__1double_abs(a: vec2u) -> vec2u {
    return a & vec2u(4294967295u, 2147483647u);
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

fn package_lightshed_emitter__1choose_emitter(u_select: vec2u) -> u32 {
    let about = package_memory_scene__1emitter_groups();
    let low = package_lightshed_wide__1wide_product(about.groups, u_select.x);
    let high = package_lightshed_wide__1wide_product(about.groups, u_select.y);
    let middle = high.x + low.y;
    let group = high.y + select(0u, 1u, middle < low.y);
    if about.finite > 0u && group == 0u {
        return package_lightshed_alias__1alias_sample(0u, about.finite, vec2u(low.x, middle));
    }
    if package_memory_scene__2has_delta_emitters() {
        let direction = group - select(0u, 1u, about.finite > 0u);
        if direction < about.directions {
            return about.first_direction + direction;
        }
    }
    return select(package_lightshed_emitter_SURROUNDINGS, package_lightshed_ray_NOTHING, about.groups == 0u);
}

fn package_lightshed_emitter__1emitter_pdf(index: u32, from_position: vec3f, point: vec3f) -> f32 {
    let emitter = package_memory_scene__1load_emitter(index);
    let d = point - from_position;
    let distance_squared = package_lightshed_vector_dot3(d, d);
    let cos_theta = package_lightshed_vector_dot3(emitter.normal, d) / sqrt(distance_squared);
    return package_lightshed_measure__3area_to_solid_angle(emitter.pdf_area, distance_squared, cos_theta);
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

fn package_lightshed_emitter__1sample_emitter(from_position: vec3f, u_select: vec2u, u: vec2f) -> package_lightshed_emitter_EmitterSample {
    let index = package_lightshed_emitter__1choose_emitter(u_select);
    if index == package_lightshed_ray_NOTHING {
        return package_lightshed_emitter_EmitterSample(vec3f(0.0), 0.0, vec3f(0.0), true, vec3f(0.0));
    }
    if index == package_lightshed_emitter_SURROUNDINGS {
        let around = package_lightshed_emitter__1sample_surroundings(u);
        if !(around.pdf > 0.0) {
            return package_lightshed_emitter_EmitterSample(vec3f(0.0), 0.0, vec3f(0.0), false, vec3f(0.0));
        }
        return package_lightshed_emitter_EmitterSample(around.direction, around.pdf, around.radiance / around.pdf, false, vec3f(0.0));
    }
    if package_memory_scene__2has_delta_emitters() && package_lightshed_emitter__2is_delta_emitter(index) {
        return package_lightshed_emitter__2sample_delta_emitter(index, from_position);
    }
    return package_lightshed_emitter__2sample_triangle_emitter(package_memory_scene__1load_emitter(index), from_position, u);
}

fn package_lightshed_emitter__1sample_surroundings(u: vec2f) -> package_lightshed_emitter_Around {
    var around = package_lightshed_emitter__1sample_around(u);
    around.pdf *= 1.0 / f32(package_memory_scene__1emitter_groups().groups);
    return around;
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

fn package_lightshed_emitter__1surroundings_pdf(direction: vec3f) -> f32 {
    return package_lightshed_emitter__1surroundings_density(direction) * (1.0 / f32(package_memory_scene__1emitter_groups().groups));
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

fn package_lightshed_emitter__2sample_delta_emitter(index: u32, from_position: vec3f) -> package_lightshed_emitter_EmitterSample {
    return package_lightshed_emitter__2towards_delta_emitter(index, package_memory_scene__2load_delta_emitter(index).probability, from_position);
}

fn package_lightshed_emitter__2sample_triangle_emitter(emitter: package_lightshed_emitter_Emitter, from_position: vec3f, u: vec2f) -> package_lightshed_emitter_EmitterSample {
    let aim = package_lightshed_emitter__1aim_at(emitter, from_position, package_lightshed_warp__1uniform_triangle(u).xy);
    let pdf = package_lightshed_measure__3area_to_solid_angle(emitter.pdf_area, aim.distance_squared, aim.cos_theta);
    if !(aim.cos_theta > 0.0 && pdf > 0.0) {
        return package_lightshed_emitter_EmitterSample(vec3f(0.0), 0.0, vec3f(0.0), true, vec3f(0.0));
    }
    return package_lightshed_emitter_EmitterSample(aim.direction, pdf, package_lightshed_emitter__1emitter_radiance(emitter) / pdf, true, aim.goal);
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

fn package_lightshed_float__2as_it_is(x: f32) -> f32 {
    return min(x, package_lightshed_float__1F32_MAX);
}

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

fn package_lightshed_wide__1wide_less(a: vec2u, b: vec2u) -> bool {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
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

fn package_memory__1lighting_grid__1grid_frame() -> package_lightshed__1grid_light_GridFrame {
    return package_memory__1lighting_grid__1lighting_frame;
}

@group(1) @binding(12)
var<storage, read> package_memory__1lighting_grid__1grid_keys: array<u32>;

@group(1) @binding(10)
var<storage, read> package_memory__1lighting_grid__1grid_lights: array<package_lightshed__1grid_light_GridLight>;

@group(1) @binding(14)
var<storage, read> package_memory__1lighting_grid__1grid_moments: array<package_lightshed__1grid_moments_Moments>;

@group(1) @binding(11)
var<storage, read> package_memory__1lighting_grid__1grid_points: array<package_lightshed__1grid_light_GridPoint>;

@group(1) @binding(13)
var<storage, read> package_memory__1lighting_grid__1grid_vertices: array<u32>;

@group(1) @binding(9)
var<storage, read> package_memory__1lighting_grid__1grid_words: array<vec2u>;

@group(1) @binding(8)
var<storage, read> package_memory__1lighting_grid__1lighting_frame: package_lightshed__1grid_light_GridFrame;

fn package_memory__1lighting_grid__2load_grid_key(place: u32) -> u32 {
    return package_memory__1lighting_grid__1grid_keys[place];
}

fn package_memory__1lighting_grid__2load_grid_light(place: u32) -> package_lightshed__1grid_light_GridLight {
    return package_memory__1lighting_grid__1grid_lights[place];
}

fn package_memory__1lighting_grid__2load_grid_point(place: u32) -> package_lightshed__1grid_light_GridPoint {
    return package_memory__1lighting_grid__1grid_points[place];
}

fn package_memory__1lighting_grid__2load_grid_vertex(place: u32) -> u32 {
    return package_memory__1lighting_grid__1grid_vertices[place];
}

fn package_memory__1lighting_grid__2load_grid_weight(place: u32) -> f32 {
    return package_memory__1lighting_grid__1grid_moments[place].weight;
}

fn package_memory__1lighting_grid__2load_grid_word(word: u32) -> vec2u {
    return package_memory__1lighting_grid__1grid_words[word];
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

fn package_memory_scene__2load_alias_entry(table: u32, index: u32) -> package_lightshed_alias_AliasEntry {
    return package_lightshed_alias_AliasEntry(package_memory_scene_tables[2u * index], package_memory_scene_tables[2u * index + 1u]);
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

const package_threads_GROUP: u32 = 64u;

fn package_threads__1thread_number(id: vec3u, groups: vec3u) -> u32 {
    return id.x + id.y * groups.x * package_threads_GROUP;
}
