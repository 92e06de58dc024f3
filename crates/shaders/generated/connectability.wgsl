// Linked from connectability.wesl.

const REACH_NEVER: u32 = 0u;

const REACH_FIRST: u32 = 1u;

const REACH_ANY: u32 = 2u;

struct Connectability {
    min_roughness: f32,
    min_distance: f32,
    reach: u32,
    padding: u32
}

const RESOLVED: f32 = 0.00390625;

fn reaches(rules: Connectability, second: u32) -> bool {
    return rules.reach == REACH_ANY || (rules.reach == REACH_FIRST && second == 2u);
}

fn replays(rules: Connectability) -> bool {
    return rules.reach != REACH_FIRST;
}

fn rough(rules: Connectability, roughness: f32) -> bool {
    return roughness >= rules.min_roughness;
}

fn far(rules: Connectability, position: vec3f, offset: vec3f) -> bool {
    let resolved = package_lightshed_vector__1max_element(abs(position)) * RESOLVED;
    let least = max(rules.min_distance, resolved);
    let squared = package_lightshed_vector_dot3(offset, offset);
    return squared >= least * least && squared > 0.0;
}

fn package_lightshed_vector__1max_element(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn package_lightshed_vector_dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
