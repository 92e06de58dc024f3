// Linked from ray.wesl.

struct Ray {
    origin: vec3f,
    t_max: f32,
    direction: vec3f,
    padding: u32
}

const NOTHING: u32 = 4294967295u;

const NO_END: f32 = 3.4028235e38;

struct Hit {
    t: f32,
    primitive: u32,
    barycentric: vec2f
}
