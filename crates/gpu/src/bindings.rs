//! Bindings of programs: every binding has one number, one name and one meaning.
//!
//! Programs over a scene have the scene in group 0, its medium, light tree, lighting grid, guide,
//! light cache or radiance cache (each with its own numbers) in group 1, and the buffers
//! of a method in group 2; its cells of space in group 3.
//! Programs without a scene have everything in group 0. A test compares these tables with the
//! linked shaders, names included.

use crate::buffer::{Access, Buffer};

/// Bindings of a group, numbered one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Table {
    /// Number of the group.
    pub group: u32,
    /// Number of the first binding.
    pub first: u32,
    /// Their names in shaders, and how shaders use them.
    pub bindings: &'static [(&'static str, Access)],
}

impl Table {
    /// Numbers and names.
    pub fn numbered(&self) -> impl Iterator<Item = (u32, &'static str, Access)> {
        let bindings = self.bindings.iter();
        (self.first..)
            .zip(bindings)
            .map(|(number, &(name, access))| (number, name, access))
    }
}

/// Buffers for the bindings of a table.
pub(crate) trait Bindings {
    /// Where they are bound.
    fn table(&self) -> Table;
    /// The buffers, in order.
    fn buffers(&self) -> Vec<&Buffer>;
}

/// A struct with a buffer for each binding of a table, by the name that shaders have for it.
macro_rules! bindings {
    ($(#[$about:meta])* $name:ident, $group:literal, $first:literal, $($field:ident: $access:ident),+ $(,)?) => {
        $(#[$about])*
        #[derive(Clone, Copy)]
        pub(crate) struct $name<'a> {
            $(pub $field: &'a Buffer,)+
        }

        impl $name<'_> {
            /// Where they are bound.
            pub const TABLE: Table = Table {
                group: $group,
                first: $first,
                bindings: &[$((stringify!($field), Access::$access)),+],
            };
        }

        impl Bindings for $name<'_> {
            fn table(&self) -> Table {
                Self::TABLE
            }

            fn buffers(&self) -> Vec<&Buffer> {
                vec![$(self.$field),+]
            }
        }
    };
}

#[cfg(test)]
pub(crate) use bindings;

bindings!(
    /// A scene.
    SceneBindings, 0, 0,
    nodes: Read,
    slots: Read,
    triangles: Read,
    normals: Read,
    materials: Read,
    components: Read,
    emitters: Read,
    tables: Read,
    emitter_triangles: Read,
);

bindings!(
    /// A scene's medium.
    MediumBindings, 1, 0,
    medium: Read,
    voxels: Read,
    bounds: Read,
    medium_sides: Read,
);

bindings!(
    /// A light tree over a scene's emitters.
    LightTreeBindings, 1, 4,
    light_rows: Read,
    light_levels: Read,
    light_at: Read,
    leaf_of: Read,
);

bindings!(
    /// A lighting grid hierarchy.
    LightingGridBindings, 1, 8,
    lighting_frame: Read,
    grid_words: Read,
    grid_lights: Read,
    grid_points: Read,
    grid_keys: Read,
    grid_vertices: Read,
    grid_moments: Read,
);

bindings!(
    /// Octrees of a guide and of a light cache.
    OctreeBindings, 1, 15,
    octree_nodes: Read,
);

bindings!(
    /// A guide's field.
    GuideBindings, 1, 16,
    guide: Read,
    guide_regions: Read,
    guide_words: Read,
);

bindings!(
    /// A light cache.
    LightCacheBindings, 1, 19,
    light_cache_parts: Read,
    cache_words: Read,
    cache_rows: Read,
);

bindings!(
    /// A cache of radiance in which paths end.
    RadianceCacheBindings, 1, 22,
    cache_settings: Read,
    cell_words: Read,
    cache_records: Read,
);

bindings!(
    /// Of methods whose memory is an image.
    ImageBindings, 2, 0,
    settings: Read,
    image: Write,
    asked: Read,
);

bindings!(
    /// Of path tracing by wavefronts.
    WavefrontBindings, 2, 0,
    settings: Read,
    paths: Write,
    hits: Write,
    shadows: Write,
    queues: Write,
    counts: Write,
    film: Write,
    step: Read,
    budgets: Write,
);

bindings!(
    /// Of lightcuts.
    LightcutBindings, 2, 0,
    settings: Read,
    image: Write,
    asked: Read,
    subtrees: Write,
    lengths: Write,
    hits: Write,
);

bindings!(
    /// Of gathering from virtual point lights.
    GatherBindings, 2, 0,
    settings: Read,
    pixels: Write,
    visibility: Write,
    asked: Read,
);

bindings!(
    /// Of Markov chain mixtures.
    MixtureBindings, 2, 0,
    settings: Read,
    image: Write,
    states_before: Read,
    states: Write,
    mixture: Read,
);

bindings!(
    /// Of methods that reuse among pixels and frames.
    ReuseBindings, 2, 0,
    settings: Read,
    primaries: Write,
    before: Read,
    given: Write,
    made: Write,
    image: Write,
    frame: Read,
);

bindings!(
    /// Of such methods beside those, with reservoirs in cells of space.
    WorldBindings, 3, 0,
    world: Read,
    world_visitors: Write,
    world_words: Read,
    world_sited: Write,
    sites: Write,
    cells: Write,
    confidences: Write,
    terms: Write,
    world_visits: Read,
    world_visit_count: Read,
    world_indices: Read,
);

bindings!(
    /// Of a table of cells that visitors claim.
    CellTableBindings, 0, 0,
    table: Read,
    visitors: Read,
    table_words: Write,
    claims: Write,
    used: Write,
    sited: Write,
    codes: Write,
    indices: Write,
    visits: Write,
    visit_count: Write,
);

bindings!(
    /// Of suffix reuse.
    SuffixBindings, 2, 0,
    settings: Read,
    primaries: Write,
    before: Read,
    prefixes: Write,
    prefixes_before: Read,
    given: Write,
    made: Write,
    image: Write,
    frame: Read,
    site_boxes: Write,
    site_nodes: Read,
    site_order: Read,
    integrations: Write,
    own_suffixes: Write,
);

bindings!(
    /// Of the filter of shadows, which knows no scene.
    FilterBindings, 0, 0,
    taps: Read,
    pixels: Read,
    values: Read,
    filtered: Write,
    image: Write,
);

bindings!(
    /// Of a pass of sorting.
    SortBindings, 0, 0,
    sorting: Read,
    from_codes: Read,
    from_indices: Read,
    to_codes: Write,
    to_indices: Write,
    counts: Write,
);

bindings!(
    /// Of building a light tree.
    TreeBuildBindings, 0, 0,
    settings: Read,
    lights: Read,
    boxes: Write,
    cube: Write,
    codes: Write,
    indices: Write,
    rows: Write,
    light_at: Write,
    leaf_of: Write,
    level_below: Read,
);

bindings!(
    /// Boxes that a tree is built over, along the curve.
    BvhSourceBindings, 0, 0,
    settings: Read,
    bounds: Read,
    parts: Write,
    frame: Write,
    codes: Write,
    indices: Write,
);

bindings!(
    /// Of building a tree over them.
    BvhBuildBindings, 0, 6,
    ranges: Write,
    parents: Write,
    nodes: Write,
    order: Write,
    pyramid: Write,
    level_below: Read,
    grouping: Read,
);

bindings!(
    /// Of building one by a subset of them.
    BvhSubsetBindings, 1, 0,
    drawing: Read,
    drawn: Write,
    subset_settings: Write,
    weights: Write,
    bins: Write,
    sums: Write,
    picked: Write,
    places: Write,
    subset_codes: Write,
    subset_indices: Write,
    subset_nodes: Write,
    subset_order: Write,
    subset_parents: Write,
    clusters: Write,
    keys: Write,
    key_places: Write,
    cluster_codes: Write,
    cluster_boxes: Write,
    clustered: Write,
    tree_nodes: Write,
);

bindings!(
    /// Of adapting an octree; its nodes are bound like those of a guide.
    OctreeAdaptBindings, 0, 0,
    adaptation: Read,
    former_slots: Read,
    former_state: Read,
    octree_state: Write,
    new_nodes: Write,
    octree_parents: Write,
    octree_depths: Write,
    correspondences: Write,
    origins: Write,
);

bindings!(
    /// Of quadtrees that learn.
    QuadtreeLearnBindings, 0, 0,
    learning: Read,
    learning_regions: Read,
    training: Read,
    codes: Write,
    indices: Write,
    learning_samples: Write,
    learning_nodes: Write,
    records: Write,
    totals: Write,
    moves: Read,
);

bindings!(
    /// Of building a lighting grid hierarchy.
    GridBuildBindings, 0, 0,
    settings: Read,
    lights: Read,
    boxes: Write,
    lighting_frame: Write,
    codes: Write,
    indices: Write,
    grid_points: Write,
    grid_keys: Write,
    marks: Write,
    grid_words: Write,
    tiles: Write,
    grid_vertices: Write,
    level: Read,
    grid_moments: Write,
    grid_lights: Write,
);

/// Buffers bound to a group.
pub(crate) struct BoundGroup {
    pub group: u32,
    pub bind_group: wgpu::BindGroup,
}
