// Linked from material.wesl.

struct MaterialAt {
    index: u32,
    uv: vec2f
}
