//! The list of modules.

/// One module of shader code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Module {
    /// Its name, the last part of its path.
    pub name: &'static str,
    /// The source, with imports.
    pub wesl: &'static str,
    /// Linked with its imports, for programs without a linker; `None` for a module that needs a
    /// host.
    pub wgsl: Option<&'static str>,
    /// What it imports from `package::host`, itself or through others: functions and types that the
    /// program supplies.
    pub host: &'static [&'static str],
}

macro_rules! module {
    ($name:literal) => {
        Module {
            name: $name,
            wesl: include_str!(concat!("wesl/", $name, ".wesl")),
            wgsl: Some(include_str!(concat!("../generated/", $name, ".wgsl"))),
            host: &[],
        }
    };
    ($name:literal, $host:expr) => {
        Module {
            name: $name,
            wesl: include_str!(concat!("wesl/", $name, ".wesl")),
            wgsl: None,
            host: &$host,
        }
    };
}

/// All modules, by name.
pub const MODULES: &[Module] = &[
    module!("alias", ["load_alias_entry"]),
    module!(
        "bsdf",
        [
            "has_dielectrics",
            "has_plastics",
            "has_textures",
            "load_coat",
            "load_component",
            "load_material",
            "load_texel_word",
            "load_texture"
        ]
    ),
    module!("camera"),
    module!("coat", ["load_coat"]),
    module!("color"),
    module!("connectability"),
    module!("curve"),
    module!(
        "cwbvh",
        [
            "lets_pass",
            "load_cwbvh_node",
            "load_cwbvh_primitive",
            "load_triangle_corners"
        ]
    ),
    module!("density", ["load_density"]),
    module!("dielectric"),
    module!("double"),
    module!(
        "emitter",
        [
            "emitter_groups",
            "has_delta_emitters",
            "has_sky",
            "has_textures",
            "load_alias_entry",
            "load_corner_normals",
            "load_corner_uvs",
            "load_delta_emitter",
            "load_emitter",
            "load_sky_word",
            "sky"
        ]
    ),
    module!("exponential"),
    module!("float"),
    module!("frame"),
    module!("fresnel"),
    module!("ggx"),
    module!("grid_light"),
    module!("grid_moments"),
    module!(
        "grid_shadow",
        [
            "grid_frame",
            "load_grid_key",
            "load_grid_light",
            "load_grid_point",
            "load_grid_vertex",
            "load_grid_weight",
            "load_grid_word",
            "visit_influence"
        ]
    ),
    module!(
        "guiding_field",
        [
            "guiding_field",
            "load_guide_region",
            "load_octree_node",
            "load_quadtree_word"
        ]
    ),
    module!("hash_grid", ["load_cell_word"]),
    module!("importance", ["load_light_row"]),
    module!("jump_selection"),
    module!(
        "light_bvh",
        [
            "load_bvh_child",
            "load_bvh_leaf",
            "load_bvh_parent",
            "load_factor_row_below",
            "load_factors",
            "load_leaf_of",
            "load_light_at",
            "load_light_level",
            "load_light_row"
        ]
    ),
    module!(
        "light_cache",
        [
            "light_cache",
            "load_bvh_child",
            "load_bvh_leaf",
            "load_bvh_parent",
            "load_cache_row",
            "load_cache_word",
            "load_factor_row_below",
            "load_factors",
            "load_leaf_of",
            "load_light_at",
            "load_light_level",
            "load_light_row",
            "load_octree_node"
        ]
    ),
    module!(
        "light_tree",
        [
            "load_leaf_of",
            "load_light_at",
            "load_light_level",
            "load_light_row"
        ]
    ),
    module!(
        "light_walk",
        [
            "load_cache_row",
            "load_leaf_of",
            "load_light_at",
            "load_light_level",
            "load_light_row"
        ]
    ),
    module!(
        "lightcut",
        [
            "load_leaf_of",
            "load_light_at",
            "load_light_level",
            "load_light_row",
            "load_subtree",
            "store_subtree"
        ]
    ),
    module!(
        "lighting_grid",
        [
            "grid_frame",
            "load_grid_key",
            "load_grid_light",
            "load_grid_point",
            "load_grid_word",
            "visit_influence"
        ]
    ),
    module!("majorant", ["load_majorant"]),
    module!("markov_state"),
    module!("material"),
    module!("measure"),
    module!(
        "merge",
        [
            "merge_input",
            "merge_keep",
            "merge_number",
            "merge_shift",
            "merge_visit"
        ]
    ),
    module!("mis"),
    module!("morton"),
    module!("nearest_sites", ["load_site_node", "load_surface_site"]),
    module!("normal_ball"),
    module!("octahedral"),
    module!("octree", ["load_octree_node"]),
    module!("octree_adaptation", ["load_octree_count", "load_octree_node"]),
    module!("parallax"),
    module!("path_budget", ["load_cached_radiance", "load_cell_word"]),
    module!("path_numbers"),
    module!(
        "path_prefix",
        [
            "emitter_groups",
            "has_delta_emitters",
            "has_dielectrics",
            "has_plastics",
            "has_sky",
            "has_textures",
            "lets_pass",
            "load_alias_entry",
            "load_coat",
            "load_component",
            "load_corner_normals",
            "load_corner_uvs",
            "load_cwbvh_node",
            "load_cwbvh_primitive",
            "load_delta_emitter",
            "load_emitter",
            "load_emitter_triangle",
            "load_material",
            "load_sky_word",
            "load_texel_word",
            "load_texture",
            "load_triangle",
            "load_triangle_corners",
            "sky"
        ]
    ),
    module!(
        "path_sample",
        [
            "emitter_groups",
            "has_delta_emitters",
            "has_dielectrics",
            "has_plastics",
            "has_sky",
            "has_textures",
            "load_alias_entry",
            "load_coat",
            "load_component",
            "load_corner_normals",
            "load_corner_uvs",
            "load_delta_emitter",
            "load_emitter",
            "load_emitter_triangle",
            "load_material",
            "load_sky_word",
            "load_texel_word",
            "load_texture",
            "load_triangle",
            "sky"
        ]
    ),
    module!(
        "path_shift",
        [
            "emitter_groups",
            "has_delta_emitters",
            "has_dielectrics",
            "has_plastics",
            "has_sky",
            "has_textures",
            "lets_pass",
            "load_alias_entry",
            "load_coat",
            "load_component",
            "load_corner_normals",
            "load_corner_uvs",
            "load_cwbvh_node",
            "load_cwbvh_primitive",
            "load_delta_emitter",
            "load_emitter",
            "load_emitter_triangle",
            "load_material",
            "load_sky_word",
            "load_texel_word",
            "load_texture",
            "load_triangle",
            "load_triangle_corners",
            "sky"
        ]
    ),
    module!(
        "path_vertex",
        [
            "emitter_groups",
            "has_delta_emitters",
            "has_dielectrics",
            "has_plastics",
            "has_sky",
            "has_textures",
            "load_alias_entry",
            "load_coat",
            "load_component",
            "load_corner_normals",
            "load_corner_uvs",
            "load_delta_emitter",
            "load_emitter",
            "load_emitter_triangle",
            "load_material",
            "load_sky_word",
            "load_texel_word",
            "load_texture",
            "load_triangle",
            "sky"
        ]
    ),
    module!(
        "path_walk",
        [
            "emitter_groups",
            "has_delta_emitters",
            "has_dielectrics",
            "has_plastics",
            "has_sky",
            "has_textures",
            "lets_pass",
            "load_alias_entry",
            "load_coat",
            "load_component",
            "load_corner_normals",
            "load_corner_uvs",
            "load_cwbvh_node",
            "load_cwbvh_primitive",
            "load_delta_emitter",
            "load_emitter",
            "load_emitter_triangle",
            "load_material",
            "load_sky_word",
            "load_texel_word",
            "load_texture",
            "load_triangle",
            "load_triangle_corners",
            "sky"
        ]
    ),
    module!("phase"),
    module!("quadtree", ["load_quadtree_word"]),
    module!(
        "quadtree_learning",
        [
            "load_learning_node",
            "load_learning_sample",
            "load_learning_word",
            "store_learning_node",
            "store_learning_word"
        ]
    ),
    module!("radiance_cache", ["load_cached_radiance", "load_cell_word"]),
    module!("ray"),
    module!("reservoir"),
    module!("rng"),
    module!("sky", ["load_sky_word", "sky"]),
    module!("stream"),
    module!(
        "surface",
        ["has_textures", "load_corner_normals", "load_corner_uvs"]
    ),
    module!("texture", ["load_texel_word", "load_texture"]),
    module!("tracking", ["load_density", "load_majorant"]),
    module!("triangle"),
    module!("turn"),
    module!("unbiased_marching", ["load_density", "load_majorant"]),
    module!("uniform"),
    module!("vector"),
    module!("vmf"),
    module!("warp"),
    module!("wide"),
];

/// The module called `name`.
pub fn module(name: &str) -> Option<&'static Module> {
    MODULES.iter().find(|module| module.name == name)
}
