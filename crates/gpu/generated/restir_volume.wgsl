// Linked from restir_volume.wesl.

const UNSCATTERED: u32 = 16777216u;

@compute @workgroup_size(64)
fn primary(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let pixel = package_threads__1thread_number(id, groups);
    if pixel >= package_memory_scene_settings.pixels {
        return;
    }
    let ray = package__1restir_volume_volume__2camera_ray_of(pixel, package__1restir_volume_volume_frame.number);
    let reach = package__1restir_volume_through__1reach_along(ray, package_memory_medium__1medium_settings().camera_inside == 1u);
    let seen = package__1restir_volume_volume_Primary(reach.hit, reach.interval, u32(reach.inside), 0u);
    package__1restir_volume_volume_primaries[pixel] = seen;
    var emitted = vec3f(0.0);
    if reach.hit.primitive == package_lightshed_ray_NOTHING {
        if package_memory_scene__1HAS_SURROUNDINGS {
            emitted = package_lightshed_emitter__1surroundings_radiance(ray.direction);
        }
    }
    else if package_memory_scene__1HAS_EMITTERS {
        emitted = package_selected__1seen_emission(package_lightshed_surface__1surface_point(package_memory_scene__1load_triangle(reach.hit.primitive), reach.hit), ray.direction);
    }
    if package_lightshed_vector__1max_element(emitted) > 0.0 && seen.reach.x < seen.reach.y {
        var stream = package__1restir_volume_volume__1stream_from(pixel, UNSCATTERED);
        let segment = package__1restir_volume_through__1camera_segment(package__1restir_volume_volume_View(ray, seen), reach.hit.t * package_lightshed_emitter__1SEGMENT_END);
        emitted *= package__1restir_volume_through__1estimate_through(segment, package_memory_medium__1medium_settings().camera_inside == 1u, &stream).transmittance;
    }
    package__1restir_volume_volume_image[pixel] = vec4f(emitted, 0.0);
}

@compute @workgroup_size(64)
fn candidates(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let pixel = package_threads__1thread_number(id, groups);
    if pixel < package_memory_scene_settings.pixels {
        package__1restir_volume_volume_made[pixel] = package__1restir_volume_candidates__1candidate_of(pixel);
    }
}

@compute @workgroup_size(64)
fn temporal(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let pixel = package_threads__1thread_number(id, groups);
    if pixel >= package_memory_scene_settings.pixels {
        return;
    }
    if package__1restir_volume_volume_made[pixel].confidence == 0.0 || package__1restir_volume_volume_given[pixel].confidence == 0.0 {
        return;
    }
    package_inputs__1with_past(pixel);
    package_reuse__1find_targets();
    package__1restir_volume_volume_made[pixel] = package_reuse__1merged_path(package_lightshed_merge__1merge_balance(package_inputs_inputs.count, package__1restir_volume_volume_frame.confidence_cap));
}

@compute @workgroup_size(64)
fn spatial(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let pixel = package_threads__1thread_number(id, groups);
    if pixel >= package_memory_scene_settings.pixels {
        return;
    }
    package__1restir_volume_volume_made[pixel] = package__1restir_volume_volume_given[pixel];
    if package__1restir_volume_volume_given[pixel].confidence == 0.0 {
        return;
    }
    package_reuse__1with_spiral(pixel);
    package_reuse__1find_targets();
    package__1restir_volume_volume_made[pixel] = package_reuse__1merged_path(package_lightshed_merge__1merge_balance(package_inputs_inputs.count, package__1restir_volume_volume_frame.confidence_cap));
    package__1restir_volume_volume_image[pixel] += vec4f(package_reuse_gathered, 0.0);
}

const package__1restir_volume_candidates_CANDIDATES: u32 = 4096u;

struct package__1restir_volume_candidates_Landings {
    distances: vec4f,
    pdfs: vec4f,
    depth: f32
}

const package__1restir_volume_candidates_SEQUENCE: u32 = 16u;

const package__1restir_volume_candidates__1LEAST_SHARE: f32 = 0.01;

const package__1restir_volume_candidates__1STEP_X: vec2u = vec2u(3516067075u, 3518319154u);

const package__1restir_volume_candidates__1STEP_Y: vec2u = vec2u(4220496899u, 2882110344u);

const package__1restir_volume_candidates__1STEP_Z: vec2u = vec2u(792563159u, 2360945575u);

fn package__1restir_volume_candidates__1candidate_of(pixel: u32) -> package__1restir_volume_volume_Scattered {
    let view = package__1restir_volume_volume__1view_of(pixel);
    let nothing_lit = !(package_memory_scene__1HAS_EMITTERS || package_memory_scene__1HAS_SURROUNDINGS);
    let has_surface = package_memory_scene__1HAS_SURFACES && view.seen.hit.primitive != package_lightshed_ray_NOTHING;
    var selection = package_lightshed_reservoir_Selection(0u, 0u, 0.0, 0.0);
    var kept = package__1restir_volume_volume__1nothing_held(0.0);
    var can_scatter = has_surface;
    let by = package_memory_pixels__1pixel_block(pixel, 0u, package__1restir_volume_candidates_SEQUENCE).xyz;
    let first = package_lightshed_wide__1wide_product(package__1restir_volume_volume_frame.number, package__1restir_volume_volume_frame.walks);
    for (var start = 0u; start < package__1restir_volume_volume_frame.walks; start += 4u) {
        var goals = vec4f(0.0);
        for (var k = 0u; k < 4u; k++) {
            let u = package_lightshed_uniform__2f32_from_u32(package__1restir_volume_candidates__1sequence_point(by, package_lightshed_wide__1wide_add(first, vec2u(start + k, 0u))).x);
            goals[k] = select(0.0, package_lightshed_exponential_exponential(u), start + k < package__1restir_volume_volume_frame.walks);
        }
        let landings = package__1restir_volume_candidates_fly(view, goals);
        can_scatter = can_scatter || landings.depth > 0.0;
        for (var k = 0u; k < 4u && start + k < package__1restir_volume_volume_frame.walks && !nothing_lit; k++) {
            var distance = landings.distances[k];
            var pdf = landings.pdfs[k];
            var transmittance = exp(-goals[k]);
            if !(pdf > 0.0) {
                if !has_surface {
                    continue;
                }
                distance = package__1restir_volume_volume__1ON_SURFACE;
                transmittance = exp(-landings.depth);
                pdf = transmittance;
            }
            let vertex = package__1restir_volume_scattered__1vertex_of(view, distance);
            if !vertex.some {
                continue;
            }
            let point = package__1restir_volume_candidates__1sequence_point(by, package_lightshed_wide__1wide_add(first, vec2u(start + k, 0u)));
            let u_light = package_lightshed_uniform__1unit_square(point.yz);
            let choice = package__1restir_volume_volume_block(pixel, package__1restir_volume_candidates_CANDIDATES + start + k);
            var emitter = package_lightshed_emitter_SURROUNDINGS;
            var place: vec3f;
            if vertex.in_medium && package_lightshed_uniform__2f32_from_u32(choice.x) < package__1restir_volume_volume_frame.phase_share {
                place = package_lightshed_phase__1scattered_direction(vertex.incoming, package_medium__1sample_angle(u_light.x), u_light.y);
            }
            else {
                emitter = package_lightshed_emitter__1choose_emitter(choice.yz);
                if emitter == package_lightshed_ray_NOTHING {
                    continue;
                }
                if emitter == package_lightshed_emitter_SURROUNDINGS {
                    let around = package_lightshed_emitter__1sample_around(u_light);
                    if !(around.pdf > 0.0) {
                        continue;
                    }
                    place = around.direction;
                }
                else {
                    place = vec3f(package_lightshed_warp__1uniform_triangle(u_light).xy, 0.0);
                }
            }
            var sky = vec3f(0.0);
            var pdf_endpoint = 0.0;
            if emitter == package_lightshed_emitter_SURROUNDINGS {
                sky = package_lightshed_emitter__1surroundings_radiance(place);
                pdf_endpoint = package__1restir_volume_scattered__1direction_pdf(vertex, place);
            }
            let lit = package__1restir_volume_scattered__1lit_by(vertex, emitter, place, sky);
            if !(package_lightshed_vector__1max_element(lit.value) > 0.0) {
                continue;
            }
            pdf_endpoint += lit.pdf;
            let value = lit.value * (transmittance * package__1restir_volume_through__1coarse_transmittance(lit.shadow, lit.inside));
            let weight = package__1restir_volume_volume__1target_of(value) / (pdf * pdf_endpoint * f32(package__1restir_volume_volume_frame.walks));
            let offered = package_lightshed_reservoir_offer(selection, 1u, weight, package_lightshed_uniform__2f32_from_u32(choice.w));
            selection = offered.selection;
            if offered.accepted {
                kept = package__1restir_volume_volume_Scattered(place, emitter, sky, distance, package__1restir_volume_volume__1target_of(value), 0.0, 0.0, 0u);
            }
        }
    }
    kept.weight = package_lightshed_reservoir__1contribution_weight(selection, kept.p_hat);
    if kept.weight > 0.0 {
        kept.p_hat = package__1restir_volume_scattered__1target_in(view, kept);
    }
    if !(kept.weight > 0.0 && kept.p_hat > 0.0) {
        kept = package__1restir_volume_volume__1nothing_held(0.0);
    }
    kept.confidence = select(0.0, 1.0, can_scatter);
    return kept;
}

fn package__1restir_volume_candidates__1sequence_point(by: vec3u, index: vec2u) -> vec3u {
    return by + vec3u(package_lightshed_wide__1wide_multiply(package__1restir_volume_candidates__1STEP_X, index).y, package_lightshed_wide__1wide_multiply(package__1restir_volume_candidates__1STEP_Y, index).y, package_lightshed_wide__1wide_multiply(package__1restir_volume_candidates__1STEP_Z, index).y);
}

fn package__1restir_volume_candidates_fly(view: package__1restir_volume_volume_View, goals: vec4f) -> package__1restir_volume_candidates_Landings {
    let m = package_memory_medium__1medium_settings();
    let ray = package_medium__1field_ray(view.ray);
    let furthest = max(max(goals.x, goals.y), max(goals.z, goals.w));
    let pace = package_lightshed_vector_length3(ray.direction);
    var landings = package__1restir_volume_candidates_Landings(vec4f(0.0), vec4f(0.0), 0.0);
    if !(view.seen.reach.x < view.seen.reach.y) {
        return landings;
    }
    var dda = package_lightshed_majorant__1dda_new(m.medium.grid, ray, view.seen.reach);
    while (landings.depth <= furthest) {
        let crossing = package_lightshed_majorant__1dda_step(dda);
        if !crossing.found {
            break;
        }
        dda = crossing.dda;
        let segment = crossing.segment;
        let length = segment.t1 - segment.t0;
        if !(segment.majorant > 0.0 && length > 0.0) {
            continue;
        }
        let count = clamp(ceil(length * pace), 1.0, 64.0);
        let step = length / count;
        for (var i = 0u; i < u32(count) && landings.depth <= furthest; i++) {
            let begin = segment.t0 + f32(i) * step;
            let density = package_lightshed_density__1density_at(m.medium.size, m.medium.filtering, package_lightshed_majorant__1ray_at(ray, begin + 0.5 * step));
            let sigma = m.extinction * (density + package__1restir_volume_candidates__1LEAST_SHARE * (segment.majorant - density));
            let whole = sigma * step;
            let past = goals - landings.depth;
            let ends = (past >= vec4f(0.0)) & (past < vec4f(whole)) & (landings.pdfs == vec4f(0.0));
            landings.distances = select(landings.distances, begin + min(past / sigma, vec4f(step)), ends);
            landings.pdfs = select(landings.pdfs, sigma * exp(-goals), ends);
            landings.depth += whole;
        }
    }
    return landings;
}

struct package__1restir_volume_scattered_Lit {
    value: vec3f,
    pdf: f32,
    shadow: package_lightshed_ray_Ray,
    inside: bool
}

struct package__1restir_volume_scattered_Vertex {
    some: bool,
    in_medium: bool,
    position: vec3f,
    incoming: vec3f,
    scattering: vec3f,
    point: package_lightshed_surface_SurfacePoint,
    primitive: u32,
    inside: bool
}

fn package__1restir_volume_scattered__1coarse_value(view: package__1restir_volume_volume_View, path: package__1restir_volume_volume_Scattered, depth: f32) -> vec3f {
    let vertex = package__1restir_volume_scattered__1vertex_of(view, path.distance);
    let lit = package__1restir_volume_scattered__1lit_by(vertex, path.emitter, path.place, path.sky);
    if !(package_lightshed_vector__1max_element(lit.value) > 0.0) {
        return vec3f(0.0);
    }
    return lit.value * (exp(-depth) * package__1restir_volume_through__1coarse_transmittance(lit.shadow, lit.inside));
}

fn package__1restir_volume_scattered__1direction_pdf(vertex: package__1restir_volume_scattered_Vertex, direction: vec3f) -> f32 {
    var pdf = 0.0;
    if package_memory_scene__1HAS_SURROUNDINGS {
        pdf = package_lightshed_emitter__1surroundings_pdf(direction);
    }
    if !vertex.in_medium || package__1restir_volume_volume_frame.phase_share == 0.0 {
        return pdf;
    }
    return pdf + package__1restir_volume_volume_frame.phase_share * (package_medium__1phase_at(package_lightshed_phase__1angle_between(vertex.incoming, direction)) - pdf);
}

fn package__1restir_volume_scattered__1distance_of(view: package__1restir_volume_volume_View, path: package__1restir_volume_volume_Scattered) -> f32 {
    return select(path.distance, view.seen.hit.t, path.distance == package__1restir_volume_volume__1ON_SURFACE);
}

fn package__1restir_volume_scattered__1estimated_value(view: package__1restir_volume_volume_View, path: package__1restir_volume_volume_Scattered, stream: ptr<function, package_lightshed_stream_Stream>) -> vec3f {
    let vertex = package__1restir_volume_scattered__1vertex_of(view, path.distance);
    let lit = package__1restir_volume_scattered__1lit_by(vertex, path.emitter, path.place, path.sky);
    if !(package_lightshed_vector__1max_element(lit.value) > 0.0) {
        return vec3f(0.0);
    }
    let end = select(1.0, package_lightshed_emitter__1SEGMENT_END, path.distance == package__1restir_volume_volume__1ON_SURFACE) * package__1restir_volume_scattered__1distance_of(view, path);
    var segments = array<package_lightshed_ray_Ray, 2>(package__1restir_volume_through__1camera_segment(view, end), lit.shadow);
    var starts = array<bool, 2>(package_memory_medium__1medium_settings().camera_inside == 1u, lit.inside);
    var value = lit.value;
    for (var leg = 0u; leg < 2u; leg++) {
        let through = package__1restir_volume_through__1estimate_through(segments[leg], starts[leg], stream);
        let is_elsewhere = leg == 0u && vertex.in_medium && !through.inside;
        if through.transmittance == 0.0 || is_elsewhere {
            return vec3f(0.0);
        }
        value *= through.transmittance;
    }
    return value;
}

fn package__1restir_volume_scattered__1lit_by(vertex: package__1restir_volume_scattered_Vertex, emitter: u32, place: vec3f, sky: vec3f) -> package__1restir_volume_scattered_Lit {
    let none = package__1restir_volume_scattered_Lit(vec3f(0.0), 0.0, package_lightshed_ray_Ray(vec3f(0.0), 0.0, vec3f(0.0), 0u), false);
    if !vertex.some || emitter == package_lightshed_ray_NOTHING {
        return none;
    }
    let share = select(0.0, package__1restir_volume_volume_frame.phase_share, vertex.in_medium);
    var light = package_lightshed_emitter_EmitterSample(place, 1.0, vec3f(0.0), false, vec3f(0.0));
    var radiance = sky;
    var per_endpoint = 1.0;
    var pdf = 0.0;
    if emitter != package_lightshed_emitter_SURROUNDINGS {
        let triangle = package_memory_scene__1load_emitter(emitter);
        let aim = package_lightshed_emitter__1aim_at(triangle, vertex.position, place.xy);
        if !(aim.cos_theta > 0.0) {
            return none;
        }
        light = package_lightshed_emitter_EmitterSample(aim.direction, 1.0, vec3f(0.0), true, aim.goal);
        radiance = package_lightshed_emitter__1emitter_radiance(triangle);
        per_endpoint = aim.cos_theta / aim.distance_squared;
        pdf = (1.0 - share) * triangle.pdf_area;
    }
    let value = package__1restir_volume_scattered__1scattered_towards(vertex, light.direction) * radiance * per_endpoint;
    let largest = package_lightshed_vector__1max_element(value);
    if !(largest > 0.0) || !package_lightshed_vector__1is_finite(largest) {
        return none;
    }
    var shadow = package_lightshed_ray_Ray(vertex.position, package_lightshed_ray__1NO_END, light.direction, 0u);
    var inside = true;
    if vertex.in_medium {
        if light.finite {
            shadow = package_lightshed_ray_Ray(vertex.position, package_lightshed_emitter__1SEGMENT_END, light.goal - vertex.position, 0u);
        }
    }
    else if package_memory_scene__1HAS_SURFACES {
        shadow = package_lightshed_emitter__1shadow_ray(vertex.point, light);
        inside = package_medium__1medium_towards(vertex.primitive, package_lightshed_vector_dot3(shadow.direction, vertex.point.geometric_normal), vertex.inside);
    }
    return package__1restir_volume_scattered_Lit(value, pdf, shadow, inside);
}

fn package__1restir_volume_scattered__1scattered_towards(vertex: package__1restir_volume_scattered_Vertex, direction: vec3f) -> vec3f {
    if !package_memory_scene__1HAS_SURFACES || vertex.in_medium {
        return vertex.scattering * package_medium__1phase_at(package_lightshed_phase__1angle_between(vertex.incoming, direction));
    }
    let wo = package_lightshed_frame__1to_local(vertex.point.shading, -vertex.incoming);
    return package_lightshed_bsdf__1evaluate_bsdf(vertex.point.material, wo, package_lightshed_frame__1to_local(vertex.point.shading, direction)).value;
}

fn package__1restir_volume_scattered__1target_in(view: package__1restir_volume_volume_View, path: package__1restir_volume_volume_Scattered) -> f32 {
    let depths = package__1restir_volume_through__1camera_depths(view, vec4f(package__1restir_volume_scattered__1distance_of(view, path)));
    return package__1restir_volume_volume__1target_of(package__1restir_volume_scattered__1coarse_value(view, path, depths.x));
}

fn package__1restir_volume_scattered__1vertex_of(view: package__1restir_volume_volume_View, distance: f32) -> package__1restir_volume_scattered_Vertex {
    if package_memory_scene__1HAS_SURFACES && distance == package__1restir_volume_volume__1ON_SURFACE {
        return package__1restir_volume_scattered__2vertex_on_surface(view);
    }
    return package__1restir_volume_scattered__2vertex_in_medium(view, distance);
}

fn package__1restir_volume_scattered__2vertex_in_medium(view: package__1restir_volume_volume_View, distance: f32) -> package__1restir_volume_scattered_Vertex {
    var vertex: package__1restir_volume_scattered_Vertex;
    let m = package_memory_medium__1medium_settings();
    vertex.in_medium = true;
    vertex.inside = true;
    vertex.incoming = view.ray.direction;
    vertex.position = view.ray.origin + view.ray.direction * distance;
    let place = package_lightshed_majorant__1ray_at(package_medium__1field_ray(view.ray), distance);
    let is_there = distance >= view.seen.reach.x && distance <= view.seen.reach.y && all(place >= m.medium.grid.low) && all(place <= m.medium.grid.high);
    if is_there {
        vertex.scattering = m.albedo * (m.extinction * package_lightshed_density__1density_at(m.medium.size, m.medium.filtering, place));
        vertex.some = package_lightshed_vector__1max_element(vertex.scattering) > 0.0;
    }
    return vertex;
}

fn package__1restir_volume_scattered__2vertex_on_surface(view: package__1restir_volume_volume_View) -> package__1restir_volume_scattered_Vertex {
    var vertex: package__1restir_volume_scattered_Vertex;
    let hit = view.seen.hit;
    if hit.primitive != package_lightshed_ray_NOTHING {
        vertex.some = true;
        vertex.incoming = view.ray.direction;
        vertex.point = package_lightshed_surface__1surface_point(package_memory_scene__1load_triangle(hit.primitive), hit);
        vertex.position = vertex.point.position;
        vertex.primitive = hit.primitive;
        vertex.inside = view.seen.inside == 1u;
    }
    return vertex;
}

const package__1restir_volume_through_DIAGONAL: f32 = 1.7320508;

struct package__1restir_volume_through_March {
    ray: package_lightshed_majorant_FieldRay,
    start: f32,
    step: f32,
    steps: u32
}

struct package__1restir_volume_through_Reach {
    hit: package_lightshed_ray_Hit,
    interval: vec2f,
    inside: bool
}

struct package__1restir_volume_through_Through {
    transmittance: f32,
    inside: bool
}

const package__1restir_volume_through__1LOOKUP_DEPTH: f32 = 0.6;

const package__1restir_volume_through__1OPAQUE_DEPTH: f32 = 10.0;

fn package__1restir_volume_through__1camera_depths(view: package__1restir_volume_volume_View, distances: vec4f) -> vec4f {
    let k = package_memory_medium__1medium_settings().extinction;
    let march = package__1restir_volume_through__1march_along(view.ray, view.seen.reach);
    let furthest = max(max(distances.x, distances.y), max(distances.z, distances.w));
    var depths = vec4f(0.0);
    var total = 0.0;
    for (var i = 0u; i < march.steps; i++) {
        let begin = march.start + f32(i) * march.step;
        if begin > furthest || total > package__1restir_volume_through__1OPAQUE_DEPTH {
            break;
        }
        let density = k * package__1restir_volume_through__1marched_density(march, i);
        depths += clamp(distances - begin, vec4f(0.0), vec4f(march.step)) * density;
        total += march.step * density;
    }
    return depths;
}

fn package__1restir_volume_through__1camera_segment(view: package__1restir_volume_volume_View, distance: f32) -> package_lightshed_ray_Ray {
    return package_lightshed_ray_Ray(view.ray.origin, distance, view.ray.direction, 0u);
}

fn package__1restir_volume_through__1coarse_depth(ray: package_lightshed_ray_Ray, interval: vec2f) -> f32 {
    let k = package_memory_medium__1medium_settings().extinction * package_lightshed_vector_length3(ray.direction);
    let march = package__1restir_volume_through__1march_along(ray, interval);
    var depth = 0.0;
    for (var i = 0u; i < march.steps && depth <= package__1restir_volume_through__1OPAQUE_DEPTH; i++) {
        depth += k * march.step * package__1restir_volume_through__1marched_density(march, i);
    }
    return depth;
}

fn package__1restir_volume_through__1coarse_transmittance(segment: package_lightshed_ray_Ray, inside: bool) -> f32 {
    var interval = vec2f(0.0, segment.t_max);
    if package_memory_scene__1HAS_SURFACES {
        let reach = package__1restir_volume_through__1reach_along(segment, inside);
        if reach.hit.primitive != package_lightshed_ray_NOTHING {
            return 0.0;
        }
        interval = reach.interval;
    }
    return exp(-package__1restir_volume_through__1coarse_depth(segment, interval));
}

fn package__1restir_volume_through__1estimate_part(ray: package_lightshed_ray_Ray, interval: vec2f, stream: ptr<function, package_lightshed_stream_Stream>) -> f32 {
    let m = package_memory_medium__1medium_settings();
    if !(interval.x < interval.y) {
        return 1.0;
    }
    let in_field = package_medium__1field_ray(ray);
    let k = m.extinction * package_lightshed_vector_length3(ray.direction);
    let bounds = package_lightshed__1unbiased_marching__1marching_bounds(m.medium, in_field, interval);
    let lookups = package_lightshed__1unbiased_marching__1marching_lookups(package__1restir_volume_through__1LOOKUP_DEPTH * k * (bounds.control + bounds.residual));
    return package_lightshed__1unbiased_marching__2unbiased_ray_marching(m.medium, in_field, interval, bounds, k, lookups, stream).value;
}

fn package__1restir_volume_through__1estimate_through(segment: package_lightshed_ray_Ray, starts_inside: bool, stream: ptr<function, package_lightshed_stream_Stream>) -> package__1restir_volume_through_Through {
    let end = package_medium__1end_of(segment);
    var ray = segment;
    var result = package__1restir_volume_through_Through(1.0, starts_inside);
    for (var i = 0u; i <= package_medium__1MOST_CROSSINGS; i++) {
        let hit = package_medium_nearest(ray);
        let lost = hit.primitive == package_lightshed_ray_NOTHING;
        if result.inside {
            result.transmittance *= package__1restir_volume_through__1estimate_part(ray, vec2f(0.0, select(hit.t, ray.t_max, lost)), stream);
        }
        if lost {
            return result;
        }
        let triangle = package_memory_scene__1load_triangle(hit.primitive);
        if !package_medium_passes(triangle.material) || result.transmittance == 0.0 {
            break;
        }
        let crossing = package_medium__1cross_surface(package_lightshed_surface__1surface_point(triangle, hit), hit.primitive, ray, result.inside, end);
        ray = crossing.ray;
        result.inside = crossing.inside;
    }
    return package__1restir_volume_through_Through(0.0, false);
}

fn package__1restir_volume_through__1march_along(ray: package_lightshed_ray_Ray, interval: vec2f) -> package__1restir_volume_through_March {
    let grid = package_memory_medium__1medium_settings().medium.grid;
    let in_field = package_medium__1field_ray(ray);
    let clipped = package_lightshed_majorant__2clip_to_box(grid.low, grid.high, in_field, interval);
    if !(clipped.x < clipped.y) {
        return package__1restir_volume_through_March(in_field, 0.0, 0.0, 0u);
    }
    let length = clipped.y - clipped.x;
    let steps = clamp(ceil(length * package_lightshed_vector_length3(in_field.direction) / package__1restir_volume_through_DIAGONAL), 1.0, 65536.0);
    return package__1restir_volume_through_March(in_field, clipped.x, length / steps, u32(steps));
}

fn package__1restir_volume_through__1marched_density(march: package__1restir_volume_through_March, i: u32) -> f32 {
    let m = package_memory_medium__1medium_settings().medium;
    return package_lightshed_density__1density_at(m.size, m.filtering, package_lightshed_majorant__1ray_at(march.ray, march.start + (f32(i) + 0.5) * march.step));
}

fn package__1restir_volume_through__1reach_along(whole: package_lightshed_ray_Ray, starts_inside: bool) -> package__1restir_volume_through_Reach {
    var ray = whole;
    var inside = starts_inside;
    let end = package_medium__1end_of(whole);
    var done = 0.0;
    var interval = vec2f(package_lightshed_ray__1NO_END, 0.0);
    for (var i = 0u; i <= package_medium__1MOST_CROSSINGS; i++) {
        var hit = package_medium_nearest(ray);
        let lost = hit.primitive == package_lightshed_ray_NOTHING;
        hit.t = min(done + select(hit.t, ray.t_max, lost), package_lightshed_ray__1NO_END);
        if inside {
            interval = vec2f(min(interval.x, done), hit.t);
        }
        if lost {
            return package__1restir_volume_through_Reach(hit, interval, inside);
        }
        let triangle = package_memory_scene__1load_triangle(hit.primitive);
        if !package_medium_passes(triangle.material) {
            return package__1restir_volume_through_Reach(hit, interval, inside);
        }
        let crossing = package_medium__1cross_surface(package_lightshed_surface__1surface_point(triangle, hit), hit.primitive, ray, inside, end);
        let direction = whole.direction;
        done += package_lightshed_vector_dot3(crossing.ray.origin - ray.origin, direction) / package_lightshed_vector_dot3(direction, direction);
        ray = crossing.ray;
        inside = crossing.inside;
    }
    return package__1restir_volume_through_Reach(package_lightshed_ray_Hit(whole.t_max, package_lightshed_ray_NOTHING, vec2f(0.0)), interval, inside);
}

const package__1restir_volume_volume_CAMERA: u32 = 0u;

struct package__1restir_volume_volume_Frame {
    number: u32,
    walks: u32,
    neighbours: u32,
    radius: f32,
    confidence_cap: f32,
    phase_share: f32,
    padding0: u32,
    padding1: u32
}

struct package__1restir_volume_volume_Primary {
    hit: package_lightshed_ray_Hit,
    reach: vec2f,
    inside: u32,
    padding: u32
}

struct package__1restir_volume_volume_Scattered {
    place: vec3f,
    emitter: u32,
    sky: vec3f,
    distance: f32,
    p_hat: f32,
    weight: f32,
    confidence: f32,
    padding: u32
}

struct package__1restir_volume_volume_View {
    ray: package_lightshed_ray_Ray,
    seen: package__1restir_volume_volume_Primary
}

const package__1restir_volume_volume__1ON_SURFACE: f32 = -1.0;

const package__1restir_volume_volume__1THIRD_ROOT: f32 = 0.57735027;

fn package__1restir_volume_volume__1nothing_held(confidence: f32) -> package__1restir_volume_volume_Scattered {
    return package__1restir_volume_volume_Scattered(vec3f(0.0), package_lightshed_ray_NOTHING, vec3f(0.0), 0.0, 0.0, 0.0, confidence, 0u);
}

fn package__1restir_volume_volume__1stream_from(pixel: u32, index: u32) -> package_lightshed_stream_Stream {
    return package_lightshed_stream__2stream_of_sample(package_memory_scene_settings.seed, package_memory_pixels__1pixel_name(pixel), package__1restir_volume_volume_frame.number, 4u * index);
}

fn package__1restir_volume_volume__1target_of(value: vec3f) -> f32 {
    return min(package_lightshed_vector_length3(value) * package__1restir_volume_volume__1THIRD_ROOT, package_lightshed_float__1F32_MAX);
}

fn package__1restir_volume_volume__1view_of(pixel: u32) -> package__1restir_volume_volume_View {
    return package__1restir_volume_volume_View(package__1restir_volume_volume__2camera_ray_of(pixel, package__1restir_volume_volume_frame.number), package__1restir_volume_volume_primaries[pixel]);
}

fn package__1restir_volume_volume__2camera_ray_of(pixel: u32, number: u32) -> package_lightshed_ray_Ray {
    return package_memory_pixels__1pixel_ray(package_memory_pixels__1pixel_place(pixel), package_memory_pixels__1pixel_block(pixel, number, package__1restir_volume_volume_CAMERA));
}

fn package__1restir_volume_volume__2earlier_view_of(pixel: u32) -> package__1restir_volume_volume_View {
    return package__1restir_volume_volume_View(package__1restir_volume_volume__2camera_ray_of(pixel, package__1restir_volume_volume_frame.number - 1u), package__1restir_volume_volume_before[pixel]);
}

@group(2) @binding(2)
var<storage, read> package__1restir_volume_volume_before: array<package__1restir_volume_volume_Primary>;

fn package__1restir_volume_volume_block(pixel: u32, index: u32) -> vec4u {
    return package_memory_pixels__1pixel_block(pixel, package__1restir_volume_volume_frame.number, index);
}

@group(2) @binding(6)
var<storage, read> package__1restir_volume_volume_frame: package__1restir_volume_volume_Frame;

@group(2) @binding(3)
var<storage, read_write> package__1restir_volume_volume_given: array<package__1restir_volume_volume_Scattered>;

@group(2) @binding(5)
var<storage, read_write> package__1restir_volume_volume_image: array<vec4f>;

@group(2) @binding(4)
var<storage, read_write> package__1restir_volume_volume_made: array<package__1restir_volume_volume_Scattered>;

@group(2) @binding(1)
var<storage, read_write> package__1restir_volume_volume_primaries: array<package__1restir_volume_volume_Primary>;

struct package_inputs_Inputs {
    count: u32,
    temporal: bool,
    pixels: array<u32, 9>
}

fn package_inputs__1add_input(pixel: u32) {
    package_inputs_inputs.pixels[package_inputs_inputs.count] = pixel;
    package_inputs_inputs.count++;
}

fn package_inputs__1with_past(pixel: u32) {
    package_inputs_inputs.count = 2u;
    package_inputs_inputs.temporal = true;
    package_inputs_inputs.pixels[0] = pixel;
    package_inputs_inputs.pixels[1] = pixel;
}

fn package_inputs_alone(pixel: u32) {
    package_inputs_inputs.count = 1u;
    package_inputs_inputs.temporal = false;
    package_inputs_inputs.pixels[0] = pixel;
}

var<private> package_inputs_inputs: package_inputs_Inputs;

const package_lightshed__1unbiased_marching_CORRECTED: f32 = 0.1;

struct package_lightshed__1unbiased_marching_MarchingBounds {
    control: f32,
    residual: f32
}

const package_lightshed__1unbiased_marching_ROULETTE: f32 = 2.0;

const package_lightshed__1unbiased_marching__1MAX_QUERIES: u32 = 26u;

const package_lightshed__1unbiased_marching__1MOST_LOOKUPS: f32 = 65536.0;

fn package_lightshed__1unbiased_marching__1marching_bounds(medium: package_lightshed_tracking_Medium, ray: package_lightshed_majorant_FieldRay, interval: vec2f) -> package_lightshed__1unbiased_marching_MarchingBounds {
    var bounds = package_lightshed__1unbiased_marching_MarchingBounds(0.0, 0.0);
    var dda = package_lightshed_majorant__1dda_new(medium.grid, ray, interval);
    while (true) {
        let crossing = package_lightshed_majorant__1dda_step(dda);
        if !crossing.found {
            break;
        }
        dda = crossing.dda;
        let segment = crossing.segment;
        let length = segment.t1 - segment.t0;
        bounds.control += max(segment.minorant * length, 0.0);
        bounds.residual += max((segment.majorant - segment.minorant) * length, 0.0);
    }
    return bounds;
}

fn package_lightshed__1unbiased_marching__1marching_lookups(depth: f32) -> u32 {
    let d = clamp(depth, 0.0, package_lightshed__1unbiased_marching__1MOST_LOOKUPS);
    return u32(clamp(ceil(pow((0.015 + d) * (0.65 + d) * (60.3 + d), 1.0 / 3.0)), 1.0, package_lightshed__1unbiased_marching__1MOST_LOOKUPS));
}

fn package_lightshed__1unbiased_marching__1residual_share(medium: package_lightshed_tracking_Medium, ray: package_lightshed_majorant_FieldRay, interval: vec2f, residual: f32, lookups: u32, offset: f32) -> f32 {
    let spacing = residual / f32(lookups);
    var before = 0.0;
    var done = 0u;
    var sum = 0.0;
    var next = offset * spacing;
    var dda = package_lightshed_majorant__1dda_new(medium.grid, ray, interval);
    while (done < lookups) {
        let crossing = package_lightshed_majorant__1dda_step(dda);
        if !crossing.found {
            break;
        }
        dda = crossing.dda;
        let segment = crossing.segment;
        let spread = segment.majorant - segment.minorant;
        let end = before + max(spread * (segment.t1 - segment.t0), 0.0);
        while (next < end && done < lookups) {
            let t = min(segment.t0 + (next - before) / spread, segment.t1);
            sum += (package_lightshed_density__1density_at(medium.size, medium.filtering, package_lightshed_majorant__1ray_at(ray, t)) - segment.minorant) / spread;
            done++;
            next = (f32(done) + offset) * spacing;
        }
        before = end;
    }
    return sum / f32(max(done, 1u));
}

fn package_lightshed__1unbiased_marching__2unbiased_ray_marching(medium: package_lightshed_tracking_Medium, ray: package_lightshed_majorant_FieldRay, interval: vec2f, bounds: package_lightshed__1unbiased_marching_MarchingBounds, extinction: f32, lookups: u32, stream: ptr<function, package_lightshed_stream_Stream>) -> package_lightshed_tracking_Transmittance {
    let k = select(0.0, extinction, extinction > 0.0);
    if !(bounds.residual > 0.0) {
        return package_lightshed_tracking_Transmittance(exp(-k * bounds.control), 0u);
    }
    var corrections = 0u;
    if package_lightshed_stream__1next_number(stream) < package_lightshed__1unbiased_marching_CORRECTED {
        corrections = 2u;
        while (package_lightshed_stream__1next_number(stream) < package_lightshed__1unbiased_marching_ROULETTE / f32(corrections + 1u) && corrections + 1u < package_lightshed__1unbiased_marching__1MAX_QUERIES) {
            corrections++;
        }
    }
    var queries: array<f32, 26>;
    for (var i = 0u; i <= corrections; i++) {
        let share = package_lightshed__1unbiased_marching__1residual_share(medium, ray, interval, bounds.residual, lookups, package_lightshed_stream__1next_number(stream));
        queries[i] = k * (bounds.control + bounds.residual * share);
    }
    if corrections == 0u {
        return package_lightshed_tracking_Transmittance(exp(-queries[0]), lookups);
    }
    let count = corrections + 1u;
    var sum = 0.0;
    for (var j = 0u; j < count; j++) {
        sum += exp(-queries[j]) * package_lightshed__1unbiased_marching_corrected(queries, count, j);
    }
    let value = sum / f32(count);
    return package_lightshed_tracking_Transmittance(select(0.0, value, package_lightshed_vector__1is_finite(value)), lookups * count);
}

fn package_lightshed__1unbiased_marching_corrected(queries: array<f32, 26>, count: u32, j: u32) -> f32 {
    let all = queries;
    var means: array<f32, 26>;
    means[0] = 1.0;
    var added = 0u;
    for (var i = 0u; i < count; i++) {
        if i == j {
            continue;
        }
        let x = all[j] - all[i];
        added++;
        let total = f32(added);
        for (var n = added; n >= 1u; n--) {
            means[n] = ((total - f32(n)) * means[n] + f32(n) * x * means[n - 1u]) / total;
        }
    }
    var sum = 1.0;
    var factor = 1.0 / package_lightshed__1unbiased_marching_CORRECTED;
    for (var n = 1u; n < count; n++) {
        if n == 2u {
            factor /= 2.0;
        }
        else if n > 2u {
            factor /= package_lightshed__1unbiased_marching_ROULETTE;
        }
        sum += means[n] * factor;
    }
    return sum;
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

fn package_lightshed_cwbvh__1intersect_opaque(ray: package_lightshed_ray_Ray) -> package_lightshed_ray_Hit {
    return package_lightshed_cwbvh_traverse(ray, false, true);
}

fn package_lightshed_cwbvh_intersect(ray: package_lightshed_ray_Ray) -> package_lightshed_ray_Hit {
    return package_lightshed_cwbvh_traverse(ray, false, false);
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

const package_lightshed_density__1FILTER_NEAREST: u32 = 0u;

fn package_lightshed_density__1density_at(size: vec3u, filtering: u32, position: vec3f) -> f32 {
    if filtering == package_lightshed_density__1FILTER_NEAREST {
        return package_lightshed_density__1density_nearest(size, position);
    }
    return package_lightshed_density__1density_trilinear(size, position);
}

fn package_lightshed_density__1density_nearest(size: vec3u, position: vec3f) -> f32 {
    return package_memory_medium__1load_density(vec3u(min(max(position, vec3f(0.0)), vec3f(size) - 1.0)));
}

fn package_lightshed_density__1density_trilinear(size: vec3u, position: vec3f) -> f32 {
    let p = min(max(max(position, vec3f(-1.0)) + 0.5, vec3f(0.0)), vec3f(size));
    let cell = vec3u(p);
    let f = p - vec3f(cell);
    let high = min(cell, size - 1u);
    let low = max(cell, vec3u(1u)) - 1u;
    let near_low = package_lightshed_density_linear(package_memory_medium__1load_density(low), package_memory_medium__1load_density(vec3u(high.x, low.yz)), f.x);
    let near_high = package_lightshed_density_linear(package_memory_medium__1load_density(vec3u(low.x, high.y, low.z)), package_memory_medium__1load_density(vec3u(high.xy, low.z)), f.x);
    let far_low = package_lightshed_density_linear(package_memory_medium__1load_density(vec3u(low.xy, high.z)), package_memory_medium__1load_density(vec3u(high.x, low.y, high.z)), f.x);
    let far_high = package_lightshed_density_linear(package_memory_medium__1load_density(vec3u(low.x, high.yz)), package_memory_medium__1load_density(high), f.x);
    let near = package_lightshed_density_linear(near_low, near_high, f.y);
    let far = package_lightshed_density_linear(far_low, far_high, f.y);
    return max(package_lightshed_density_linear(near, far, f.z), 0.0);
}

fn package_lightshed_density_linear(a: f32, b: f32, f: f32) -> f32 {
    return a + f * (b - a);
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

const package_lightshed_exponential__1LEAST_FRACTION: u32 = 1060439283u;

const package_lightshed_exponential__1LN_2: f32 = 0.6931472;

fn package_lightshed_exponential_exponential(u: f32) -> f32 {
    let bits = bitcast<u32>(1.0 - u);
    let exponent = bitcast<i32>(bits - package_lightshed_exponential__1LEAST_FRACTION) >> 23u;
    let f = bitcast<f32>(bits - (bitcast<u32>(exponent) << 23u)) - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let p = z * (0.33333334 + z * (0.1999992 + z * (0.14290866 + z * 0.1134)));
    let log = 2.0 * (s + s * p) + f32(exponent) * package_lightshed_exponential__1LN_2;
    return -log;
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

struct package_lightshed_majorant_Axis {
    cell: u32,
    moves: bool,
    forward: bool,
    next: vec2u,
    delta: vec2u,
    face: vec2u
}

struct package_lightshed_majorant_Crossing {
    found: bool,
    segment: package_lightshed_majorant_Segment,
    dda: package_lightshed_majorant_Dda
}

struct package_lightshed_majorant_Dda {
    now: vec2u,
    last: vec2u,
    next_x: vec2u,
    next_y: vec2u,
    next_z: vec2u,
    delta_x: vec2u,
    delta_y: vec2u,
    delta_z: vec2u,
    start: vec2u,
    unit: vec2u,
    t_now: f32,
    t_end: f32,
    index: u32,
    stride: vec3u
}

struct package_lightshed_majorant_FieldRay {
    origin: vec3f,
    direction: vec3f
}

const package_lightshed_majorant_GREATEST: vec2u = vec2u(4294967295u, 2147483647u);

const package_lightshed_majorant_MARGIN: vec2u = vec2u(16777216u, 0u);

struct package_lightshed_majorant_MajorantGrid {
    low: vec3f,
    cell: f32,
    high: vec3f,
    padding: u32,
    counts: vec3u,
    more_padding: u32
}

struct package_lightshed_majorant_Segment {
    t0: f32,
    t1: f32,
    majorant: f32,
    minorant: f32
}

const package_lightshed_majorant_WHOLE: vec2u = vec2u(0u, 536870912u);

const package_lightshed_majorant__1MINUS_WHOLE: vec2u = vec2u(0u, 3758096384u);

const package_lightshed_majorant__1TWICE_WHOLE: vec2u = vec2u(0u, 1073741824u);

const package_lightshed_majorant__1WHOLE_DOUBLE: vec2u = vec2u(0u, 1136656384u);

fn package_lightshed_majorant__1dda_axis(low: f32, scale: vec2u, cells: u32, origin: f32, direction: f32, t0: vec2u, counts: vec2u) -> package_lightshed_majorant_Axis {
    let begin = package_lightshed_double__1double_multiply(package_lightshed_double__1double_subtract(package_lightshed_double__2double_from_f32(origin), package_lightshed_double__2double_from_f32(low)), scale);
    let towards = package_lightshed_double__1double_multiply(package_lightshed_double__2double_from_f32(direction), scale);
    let start = package_lightshed_double__1double_add(begin, package_lightshed_double__1double_multiply(towards, t0));
    let inverse = package_lightshed_double__1double_divide(package_lightshed_double_ONE, towards);
    let cell = min(package_lightshed_double__2double_to_u32(start), cells - 1u);
    let forward = inverse.y < 2147483648u;
    if !package_lightshed_double__2double_is_finite(inverse) {
        return package_lightshed_majorant_Axis(cell, false, forward, package_lightshed_majorant_GREATEST, vec2u(0u), package_lightshed_majorant_GREATEST);
    }
    let plane = package_lightshed_double__2double_from_u32(cell + select(0u, 1u, forward));
    let crossing = package_lightshed_double__1double_multiply(package_lightshed_double__1double_subtract(plane, begin), inverse);
    let next = package_lightshed_wide__2wide_clamp_signed(package_lightshed_double__3double_to_wide_signed(package_lightshed_double__1double_multiply(package_lightshed_double__1double_subtract(crossing, t0), counts)), package_lightshed_majorant__1MINUS_WHOLE, package_lightshed_majorant_WHOLE);
    let delta = package_lightshed_wide__2wide_clamp_signed(package_lightshed_double__3double_to_wide_signed(package_lightshed_double__1double_multiply(package_lightshed_double__1double_abs(inverse), counts)), vec2u(1u, 0u), package_lightshed_majorant__1TWICE_WHOLE);
    let ahead = select(cell, cells - 1u - cell, forward);
    return package_lightshed_majorant_Axis(cell, true, forward, next, delta, package_lightshed_majorant__1far_plane(next, delta, ahead));
}

fn package_lightshed_majorant__1dda_last(last: vec2u, axis: package_lightshed_majorant_Axis) -> vec2u {
    if !axis.moves {
        return last;
    }
    let face = package_lightshed_wide__1wide_subtract(axis.face, package_lightshed_majorant_MARGIN);
    return select(last, face, package_lightshed_wide__2wide_less_signed(face, last));
}

fn package_lightshed_majorant__1dda_new(grid: package_lightshed_majorant_MajorantGrid, ray: package_lightshed_majorant_FieldRay, interval: vec2f) -> package_lightshed_majorant_Dda {
    let clipped = package_lightshed_majorant__2clip_to_box(grid.low, grid.high, ray, interval);
    var dda: package_lightshed_majorant_Dda;
    dda.now = package_lightshed_majorant_WHOLE;
    if !(clipped.x < clipped.y) {
        return dda;
    }
    let t0 = package_lightshed_double__2double_from_f32(clipped.x);
    let length = package_lightshed_double__1double_subtract(package_lightshed_double__2double_from_f32(clipped.y), t0);
    let scale = package_lightshed_double__1double_divide(package_lightshed_double_ONE, package_lightshed_double__2double_from_f32(grid.cell));
    let counts = package_lightshed_double__1double_divide(package_lightshed_majorant__1WHOLE_DOUBLE, length);
    let x = package_lightshed_majorant__1dda_axis(grid.low.x, scale, grid.counts.x, ray.origin.x, ray.direction.x, t0, counts);
    let y = package_lightshed_majorant__1dda_axis(grid.low.y, scale, grid.counts.y, ray.origin.y, ray.direction.y, t0, counts);
    let z = package_lightshed_majorant__1dda_axis(grid.low.z, scale, grid.counts.z, ray.origin.z, ray.direction.z, t0, counts);
    let strides = vec3u(1u, grid.counts.x, grid.counts.x * grid.counts.y);
    dda.now = package_lightshed_double_ZERO;
    dda.last = package_lightshed_majorant__1dda_last(package_lightshed_majorant__1dda_last(package_lightshed_majorant__1dda_last(package_lightshed_majorant_WHOLE, x), y), z);
    dda.next_x = x.next;
    dda.next_y = y.next;
    dda.next_z = z.next;
    dda.delta_x = x.delta;
    dda.delta_y = y.delta;
    dda.delta_z = z.delta;
    dda.start = t0;
    dda.unit = vec2u(length.x, length.y - (61u << 20u));
    dda.t_now = clipped.x;
    dda.t_end = clipped.y;
    dda.index = x.cell + y.cell * strides.y + z.cell * strides.z;
    dda.stride = select(~strides + 1u, strides, vec3<bool>(x.forward, y.forward, z.forward));
    return dda;
}

fn package_lightshed_majorant__1dda_step(before: package_lightshed_majorant_Dda) -> package_lightshed_majorant_Crossing {
    var dda = before;
    if !package_lightshed_wide__1wide_less(dda.now, package_lightshed_majorant_WHOLE) {
        return package_lightshed_majorant_Crossing(false, package_lightshed_majorant_Segment(), dda);
    }
    let bounds = package_memory_medium__1load_majorant(dda.index);
    var segment = package_lightshed_majorant_Segment(dda.t_now, dda.t_end, bounds.y, bounds.x);
    let yz = select(dda.next_z, dda.next_y, package_lightshed_wide__2wide_less_signed(dda.next_y, dda.next_z));
    let x_first = !package_lightshed_wide__2wide_less_signed(yz, dda.next_x);
    let nearest = select(yz, dda.next_x, x_first);
    if !package_lightshed_wide__2wide_less_signed(nearest, dda.last) {
        dda.now = package_lightshed_majorant_WHOLE;
        return package_lightshed_majorant_Crossing(true, segment, dda);
    }
    if x_first {
        dda.next_x = package_lightshed_wide__1wide_add(dda.next_x, dda.delta_x);
        dda.index += dda.stride.x;
    }
    else if !package_lightshed_wide__2wide_less_signed(dda.next_z, dda.next_y) {
        dda.next_y = package_lightshed_wide__1wide_add(dda.next_y, dda.delta_y);
        dda.index += dda.stride.y;
    }
    else {
        dda.next_z = package_lightshed_wide__1wide_add(dda.next_z, dda.delta_z);
        dda.index += dda.stride.z;
    }
    if package_lightshed_wide__2wide_less_signed(dda.now, nearest) {
        dda.now = nearest;
    }
    dda.t_now = package_lightshed_double__2double_to_f32(package_lightshed_double__1double_add(dda.start, package_lightshed_double__1double_multiply(package_lightshed_double__2double_from_wide(dda.now), dda.unit)));
    segment.t1 = dda.t_now;
    return package_lightshed_majorant_Crossing(true, segment, dda);
}

fn package_lightshed_majorant__1far_plane(near: vec2u, step: vec2u, count: u32) -> vec2u {
    let low = package_lightshed_wide__1wide_product(step.x, count);
    let high = package_lightshed_wide__1wide_product(step.y, count);
    let sum = package_lightshed_wide__1wide_add(vec2u(low.y, 0u), high);
    if sum.y != 0u || sum.x >= 2147483648u {
        return package_lightshed_majorant__1saturating_add(near, package_lightshed_majorant_GREATEST);
    }
    return package_lightshed_majorant__1saturating_add(near, vec2u(low.x, sum.x));
}

fn package_lightshed_majorant__1ray_at(ray: package_lightshed_majorant_FieldRay, t: f32) -> vec3f {
    return ray.origin + ray.direction * t;
}

fn package_lightshed_majorant__1saturating_add(a: vec2u, b: vec2u) -> vec2u {
    let sum = package_lightshed_wide__1wide_add(a, b);
    return select(sum, package_lightshed_majorant_GREATEST, package_lightshed_wide__2wide_less_signed(sum, a));
}

fn package_lightshed_majorant__2clip_to_box(low: vec3f, high: vec3f, ray: package_lightshed_majorant_FieldRay, interval: vec2f) -> vec2f {
    var t = interval;
    for (var axis = 0u; axis < 3u; axis++) {
        let origin = ray.origin[axis];
        let direction = ray.direction[axis];
        if !package_lightshed_vector__1is_finite(origin) || !package_lightshed_vector__1is_finite(direction) {
            return vec2f(0.0);
        }
        let inverse = 1.0 / direction;
        if package_lightshed_vector__1is_finite(inverse) {
            let a = (low[axis] - origin) * inverse;
            let b = (high[axis] - origin) * inverse;
            t = vec2f(max(t.x, min(a, b)), min(t.y, max(a, b)));
        }
        else if !(origin >= low[axis] && origin <= high[axis]) {
            return vec2f(0.0);
        }
    }
    return t;
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

fn package_lightshed_merge__1merge_balance(count: u32, cap: f32) -> package_lightshed_merge_Merged {
    var merging = package_lightshed_merge__1nothing_merged();
    var confidence = 0.0;
    for (var i = 0u; i < count; i++) {
        let input = package_reuse__1merge_input(i);
        confidence += input.confidence;
        if !(input.weight > 0.0 && input.confidence > 0.0) {
            continue;
        }
        var image = package_lightshed_merge_MergeImage(input.p_hat, 1.0);
        var own = input.p_hat;
        var total = 0.0;
        for (var j = 0u; j < count; j++) {
            var density = own;
            if j != i {
                let there = package_reuse__1merge_shift(i, j);
                density = there.p_hat * there.jacobian;
                if j == 0u {
                    image = there;
                    if !package_lightshed_merge__1is_defined(image) {
                        break;
                    }
                    own = input.p_hat / image.jacobian;
                    density = image.p_hat;
                }
            }
            total += package_reuse__1merge_input(j).confidence * density;
        }
        if package_lightshed_merge__1is_defined(image) {
            merging = package_lightshed_merge__1merged_with(merging, i, package_lightshed_mis__1balance_weight(input.confidence, own, total), input.weight, image);
        }
    }
    return package_lightshed_merge__1merge_finished(merging, confidence, cap);
}

fn package_lightshed_merge__1merge_finished(merging: package_lightshed_merge_Merging, confidence: f32, cap: f32) -> package_lightshed_merge_Merged {
    return package_lightshed_merge_Merged(package_lightshed_reservoir__1contribution_weight(merging.selection, merging.p_hat), min(confidence, cap));
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

fn package_lightshed_mis__1balance_weight(confidence: f32, density: f32, total: f32) -> f32 {
    return package_lightshed_mis_share(confidence * density, total);
}

fn package_lightshed_mis_share(part: f32, total: f32) -> f32 {
    if part > 0.0 {
        return min(part / min(total, package_lightshed_float__1F32_MAX), 1.0);
    }
    return 0.0;
}

struct package_lightshed_phase_ScatteringAngle {
    one_minus_cos: f32,
    one_plus_cos: f32
}

fn package_lightshed_phase__1angle_between(direction: vec3f, scattered: vec3f) -> package_lightshed_phase_ScatteringAngle {
    let difference = scattered - direction;
    let sum = scattered + direction;
    return package_lightshed_phase_ScatteringAngle(min(0.5 * package_lightshed_vector_dot3(difference, difference), 2.0), min(0.5 * package_lightshed_vector_dot3(sum, sum), 2.0));
}

fn package_lightshed_phase__1isotropic_angle(u: f32) -> package_lightshed_phase_ScatteringAngle {
    return package_lightshed_phase__4angle_from_one_minus_cos(2.0 * u);
}

fn package_lightshed_phase__1isotropic_phase() -> f32 {
    return package_lightshed_warp__2INVERSE_FOUR_PI;
}

fn package_lightshed_phase__1lobe_ahead(angle: package_lightshed_phase_ScatteringAngle, g: f32) -> package_lightshed_phase_ScatteringAngle {
    if g < 0.0 {
        return package_lightshed_phase_ScatteringAngle(angle.one_plus_cos, angle.one_minus_cos);
    }
    return angle;
}

fn package_lightshed_phase__1scattered_direction(direction: vec3f, angle: package_lightshed_phase_ScatteringAngle, u: f32) -> vec3f {
    let sin_theta = package_lightshed_phase__2angle_sin_theta(angle);
    let turn = package_lightshed_turn__2sin_cos_turns(u);
    return package_lightshed_frame__1to_world(package_lightshed_frame__2frame_from_normal(direction), vec3f(sin_theta * turn.y, sin_theta * turn.x, package_lightshed_phase__2angle_cos_theta(angle)));
}

fn package_lightshed_phase__2angle_cos_theta(angle: package_lightshed_phase_ScatteringAngle) -> f32 {
    if angle.one_minus_cos < angle.one_plus_cos {
        return 1.0 - angle.one_minus_cos;
    }
    return angle.one_plus_cos - 1.0;
}

fn package_lightshed_phase__2angle_sin_theta(angle: package_lightshed_phase_ScatteringAngle) -> f32 {
    return sqrt(angle.one_minus_cos * angle.one_plus_cos);
}

fn package_lightshed_phase__2henyey_greenstein_angle(g: f32, u: f32) -> package_lightshed_phase_ScatteringAngle {
    let magnitude = abs(g);
    let rest = 1.0 - magnitude;
    let d = rest + 2.0 * magnitude * (1.0 - u);
    let q = rest * (1.0 + magnitude) / d;
    let one_minus_cos = min(rest * u * (q + rest) / d, 2.0);
    return package_lightshed_phase__1lobe_ahead(package_lightshed_phase__4angle_from_one_minus_cos(one_minus_cos), g);
}

fn package_lightshed_phase__2henyey_greenstein_phase(g: f32, angle: package_lightshed_phase_ScatteringAngle) -> f32 {
    let magnitude = abs(g);
    let rest = 1.0 - magnitude;
    let squared = rest * rest + 2.0 * magnitude * package_lightshed_phase__1lobe_ahead(angle, g).one_minus_cos;
    return package_lightshed_warp__2INVERSE_FOUR_PI * rest * (1.0 + magnitude) / (squared * sqrt(squared));
}

fn package_lightshed_phase__4angle_from_one_minus_cos(one_minus_cos: f32) -> package_lightshed_phase_ScatteringAngle {
    return package_lightshed_phase_ScatteringAngle(one_minus_cos, 2.0 - one_minus_cos);
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

struct package_lightshed_tracking_Medium {
    grid: package_lightshed_majorant_MajorantGrid,
    size: vec3u,
    filtering: u32
}

struct package_lightshed_tracking_Transmittance {
    value: f32,
    lookups: u32
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

const package_lightshed_warp__1INVERSE_PI: f32 = 0.31830987;

fn package_lightshed_warp__1concentric_disk(u: vec2f) -> vec2f {
    return package_lightshed_warp__3concentric_disk_with_radius(u).xy;
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

fn package_lightshed_wide__2wide_clamp_signed(a: vec2u, low: vec2u, high: vec2u) -> vec2u {
    let above = select(a, low, package_lightshed_wide__2wide_less_signed(a, low));
    return select(above, high, package_lightshed_wide__2wide_less_signed(high, above));
}

fn package_lightshed_wide__2wide_leading_zeros(a: vec2u) -> u32 {
    return select(countLeadingZeros(a.y), 32u + countLeadingZeros(a.x), a.y == 0u);
}

fn package_lightshed_wide__2wide_less_signed(a: vec2u, b: vec2u) -> bool {
    return package_lightshed_wide__1wide_less(a ^ vec2u(0u, 2147483648u), b ^ vec2u(0u, 2147483648u));
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

const package_medium_ABOVE: u32 = 1u;

const package_medium_BELOW: u32 = 2u;

const package_medium_BOUNDARY: u32 = 4u;

struct package_medium_Crossing {
    ray: package_lightshed_ray_Ray,
    inside: bool
}

override package_medium__1HAS_TOUCHING: bool = true;

const package_medium__1MOST_CROSSINGS: u32 = 65536u;

fn package_medium__1cross_surface(point: package_lightshed_surface_SurfacePoint, primitive: u32, ray: package_lightshed_ray_Ray, inside: bool, end: vec3f) -> package_medium_Crossing {
    let origin = package_lightshed_surface__1origin_towards(point, ray.direction);
    var rest = package_lightshed_ray_Ray(origin, ray.t_max, ray.direction, 0u);
    if ray.t_max < package_lightshed_ray__1NO_END {
        rest = package_medium__1rest_of(ray, origin, end);
    }
    let cos_theta = package_lightshed_vector_dot3(ray.direction, point.geometric_normal);
    return package_medium_Crossing(rest, package_medium__1medium_towards(primitive, cos_theta, inside));
}

fn package_medium__1end_of(ray: package_lightshed_ray_Ray) -> vec3f {
    return ray.origin + ray.direction * ray.t_max;
}

fn package_medium__1field_ray(ray: package_lightshed_ray_Ray) -> package_lightshed_majorant_FieldRay {
    let m = package_memory_medium__1medium_settings();
    let direction = m.x_axis * ray.direction.x + m.y_axis * ray.direction.y + m.z_axis * ray.direction.z;
    let origin = m.x_axis * ray.origin.x + m.y_axis * ray.origin.y + m.z_axis * ray.origin.z;
    return package_lightshed_majorant_FieldRay(origin + m.translation, direction);
}

fn package_medium__1medium_towards(primitive: u32, cos_theta: f32, inside: bool) -> bool {
    let sides = package_memory_medium__2load_medium_sides(primitive);
    if (sides & package_medium_BOUNDARY) == 0u {
        return inside;
    }
    return (sides & select(package_medium_BELOW, package_medium_ABOVE, cos_theta > 0.0)) != 0u;
}

fn package_medium__1phase_at(angle: package_lightshed_phase_ScatteringAngle) -> f32 {
    let g = package_memory_medium__1medium_settings().asymmetry;
    if g == 0.0 {
        return package_lightshed_phase__1isotropic_phase();
    }
    return package_lightshed_phase__2henyey_greenstein_phase(g, angle);
}

fn package_medium__1rest_of(ray: package_lightshed_ray_Ray, origin: vec3f, end: vec3f) -> package_lightshed_ray_Ray {
    let rest = end - origin;
    let t_max = sqrt(package_lightshed_vector_dot3(rest, rest) / package_lightshed_vector_dot3(ray.direction, ray.direction));
    if !package_lightshed_vector__1is_finite(t_max) {
        return package_lightshed_ray_Ray(origin, ray.t_max, ray.direction, 0u);
    }
    if t_max > 0.0 && package_lightshed_vector_dot3(rest, ray.direction) > 0.0 {
        return package_lightshed_ray_Ray(origin, t_max, rest / t_max, 0u);
    }
    return package_lightshed_ray_Ray(origin, 0.0, ray.direction, 0u);
}

fn package_medium__1sample_angle(u: f32) -> package_lightshed_phase_ScatteringAngle {
    let g = package_memory_medium__1medium_settings().asymmetry;
    if g == 0.0 {
        return package_lightshed_phase__1isotropic_angle(u);
    }
    return package_lightshed_phase__2henyey_greenstein_angle(g, u);
}

fn package_medium_nearest(ray: package_lightshed_ray_Ray) -> package_lightshed_ray_Hit {
    let hit = package_lightshed_cwbvh_intersect(ray);
    if !package_medium__1HAS_TOUCHING || hit.primitive == package_lightshed_ray_NOTHING {
        return hit;
    }
    let slack = package_memory_medium__1load_touching(hit.primitive);
    if !(slack > 0.0) {
        return hit;
    }
    let triangle = package_memory_scene__1load_triangle(hit.primitive);
    let across = abs(package_lightshed_vector_dot3(vec3f(triangle.normal_x, triangle.normal_yz), ray.direction));
    let below = package_lightshed_cwbvh__1intersect_opaque(package_lightshed_ray_Ray(ray.origin, min(ray.t_max, hit.t + slack / across), ray.direction, 0u));
    if below.primitive == package_lightshed_ray_NOTHING {
        return hit;
    }
    return below;
}

fn package_medium_passes(material: u32) -> bool {
    return package_memory_scene__1load_material(material).y == 0u;
}

struct package_memory_medium_MediumSettings {
    medium: package_lightshed_tracking_Medium,
    x_axis: vec3f,
    extinction: f32,
    y_axis: vec3f,
    asymmetry: f32,
    z_axis: vec3f,
    camera_inside: u32,
    translation: vec3f,
    padding0: u32,
    albedo: vec3f,
    padding1: u32
}

fn package_memory_medium__1load_density(voxel: vec3u) -> f32 {
    return package_memory_medium_voxels[(voxel.z * package_memory_medium_medium.medium.size.y + voxel.y) * package_memory_medium_medium.medium.size.x + voxel.x];
}

fn package_memory_medium__1load_majorant(cell: u32) -> vec2f {
    return package_memory_medium_bounds[cell];
}

fn package_memory_medium__1load_touching(primitive: u32) -> f32 {
    return bitcast<f32>(package_memory_medium__1medium_sides[primitive].y);
}

fn package_memory_medium__1medium_settings() -> package_memory_medium_MediumSettings {
    return package_memory_medium_medium;
}

@group(1) @binding(3)
var<storage, read> package_memory_medium__1medium_sides: array<vec2u>;

fn package_memory_medium__2load_medium_sides(primitive: u32) -> u32 {
    return package_memory_medium__1medium_sides[primitive].x;
}

@group(1) @binding(2)
var<storage, read> package_memory_medium_bounds: array<vec2f>;

@group(1) @binding(0)
var<storage, read> package_memory_medium_medium: package_memory_medium_MediumSettings;

@group(1) @binding(1)
var<storage, read> package_memory_medium_voxels: array<f32>;

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

fn package_memory_pixels__1pixel_ray(pixel: vec2u, words: vec4u) -> package_lightshed_ray_Ray {
    var u_lens = vec2f(0.5);
    if package_memory_scene_settings.camera.aperture_radius > 0.0 {
        u_lens = package_lightshed_uniform__1unit_square(words.zw);
    }
    return package_lightshed_camera__1camera_ray(package_memory_scene_settings.camera, vec2f(pixel) + package_lightshed_uniform__1unit_square(words.xy), u_lens);
}

fn package_memory_pixels__1place_name(place: vec2u) -> u32 {
    return (place.y << 16u) | place.x;
}

fn package_memory_pixels__2pixel_at_offset(pixel: u32, offset: vec2f) -> u32 {
    let size = package_memory_scene_settings.camera.size;
    let place = floor(vec2f(package_memory_pixels__1pixel_place(pixel)) + 0.5 + offset);
    if any(place < vec2f(0.0)) || any(place >= vec2f(size)) {
        return package_lightshed_ray_NOTHING;
    }
    return u32(place.y) * size.x + u32(place.x);
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

override package_memory_scene__1HAS_SURFACES: bool = true;

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

const package_reuse_MOST: u32 = 3u;

const package_reuse_SHADE: u32 = 33554432u;

const package_reuse_SPATIAL: u32 = 48u;

const package_reuse_TEMPORAL: u32 = 32u;

const package_reuse__1GOLDEN_TURN: f32 = 0.38196602;

fn package_reuse__1find_targets() {
    var distances = vec4f(0.0);
    for (var j = 0u; j < package_inputs_inputs.count; j++) {
        let view = package_reuse__1view_by(j);
        for (var i = 0u; i < package_inputs_inputs.count; i++) {
            distances[i] = package__1restir_volume_scattered__1distance_of(view, package_reuse__1held_by(i));
        }
        let depths = package__1restir_volume_through__1camera_depths(view, distances);
        for (var i = 0u; i < package_inputs_inputs.count; i++) {
            let path = package_reuse__1held_by(i);
            var p = path.p_hat;
            if i != j {
                p = 0.0;
                if path.weight > 0.0 {
                    p = package__1restir_volume_volume__1target_of(package__1restir_volume_scattered__1coarse_value(view, path, depths[i]));
                }
            }
            package_reuse_targets[i][j] = p;
        }
    }
}

fn package_reuse__1held_by(i: u32) -> package__1restir_volume_volume_Scattered {
    let pixel = package_inputs_inputs.pixels[i];
    if package_inputs_inputs.temporal && i == 0u {
        return package__1restir_volume_volume_made[pixel];
    }
    return package__1restir_volume_volume_given[pixel];
}

fn package_reuse__1is_new(other: u32) -> bool {
    for (var i = 0u; i < package_inputs_inputs.count; i++) {
        if package_inputs_inputs.pixels[i] == other {
            return false;
        }
    }
    return true;
}

fn package_reuse__1merge_input(i: u32) -> package_lightshed_merge_MergeInput {
    let held = package_reuse__1held_by(i);
    return package_lightshed_merge_MergeInput(held.confidence, held.weight, held.p_hat);
}

fn package_reuse__1merge_keep(i: u32) {
    package_reuse_kept = package_reuse__1held_by(i);
    package_reuse_kept.p_hat = package_reuse_targets[i][0];
}

fn package_reuse__1merge_number(i: u32) -> f32 {
    let place = select(package_reuse_SPATIAL + 1u, package_reuse_TEMPORAL, package_inputs_inputs.temporal);
    return package_lightshed_uniform__2f32_from_u32(package__1restir_volume_volume_block(package_inputs_inputs.pixels[0], place)[i]);
}

fn package_reuse__1merge_shift(i: u32, j: u32) -> package_lightshed_merge_MergeImage {
    return package_lightshed_merge_MergeImage(package_reuse_targets[i][j], 1.0);
}

fn package_reuse__1merge_visit(i: u32, weight: f32) {
    if package_inputs_inputs.temporal {
        return;
    }
    let pixel = package_inputs_inputs.pixels[0];
    var stream = package__1restir_volume_volume__1stream_from(pixel, package_reuse_SHADE + (i << 16u));
    let value = package__1restir_volume_scattered__1estimated_value(package__1restir_volume_volume__1view_of(pixel), package_reuse__1held_by(i), &stream);
    package_reuse_gathered += clamp(value * weight, vec3f(-package_lightshed_float__1F32_MAX), vec3f(package_lightshed_float__1F32_MAX));
}

fn package_reuse__1merged_path(merged: package_lightshed_merge_Merged) -> package__1restir_volume_volume_Scattered {
    var path = package_reuse_kept;
    if merged.weight == 0.0 {
        path = package__1restir_volume_volume__1nothing_held(0.0);
    }
    path.weight = merged.weight;
    path.confidence = merged.confidence;
    return path;
}

fn package_reuse__1view_by(j: u32) -> package__1restir_volume_volume_View {
    let pixel = package_inputs_inputs.pixels[j];
    if package_inputs_inputs.temporal && j == 1u {
        return package__1restir_volume_volume__2earlier_view_of(pixel);
    }
    return package__1restir_volume_volume__1view_of(pixel);
}

fn package_reuse__1with_spiral(pixel: u32) {
    package_inputs_alone(pixel);
    let turn = package_lightshed_uniform__2f32_from_u32(package__1restir_volume_volume_block(pixel, package_reuse_SPATIAL).x);
    let wanted = min(package__1restir_volume_volume_frame.neighbours, package_reuse_MOST);
    for (var i = 0u; i < wanted; i++) {
        let radius = package__1restir_volume_volume_frame.radius * sqrt((f32(i) + 0.5) / f32(wanted));
        let angle = package_lightshed_turn__2sin_cos_turns(fract(turn + f32(i) * package_reuse__1GOLDEN_TURN));
        let other = package_memory_pixels__2pixel_at_offset(pixel, radius * vec2f(angle.y, angle.x));
        if other != package_lightshed_ray_NOTHING && package__1restir_volume_volume_given[other].confidence > 0.0 && package_reuse__1is_new(other) {
            package_inputs__1add_input(other);
        }
    }
}

var<private> package_reuse_gathered: vec3f;

var<private> package_reuse_kept: package__1restir_volume_volume_Scattered;

var<private> package_reuse_targets: array<vec4f, 4>;

fn package_selected__1seen_emission(point: package_lightshed_surface_SurfacePoint, direction: vec3f) -> vec3f {
    if point.emitter != package_lightshed_ray_NOTHING && package_lightshed_vector_dot3(direction, point.geometric_normal) < 0.0 {
        return package_lightshed_emitter__1emitter_radiance(package_memory_scene__1load_emitter(point.emitter));
    }
    return vec3f(0.0);
}

const package_threads_GROUP: u32 = 64u;

fn package_threads__1thread_number(id: vec3u, groups: vec3u) -> u32 {
    return id.x + id.y * groups.x * package_threads_GROUP;
}
