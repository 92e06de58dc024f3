//! The programs as plain WGSL: linked from `src/wesl` into the folder `generated`, and compared
//! with a new link by a test.

/// Building trees over boxes.
pub(crate) const BVH_BUILD: &str = include_str!("../generated/bvh_build.wgsl");
/// Building trees over boxes by a stochastic subset.
pub(crate) const BVH_SUBSET: &str = include_str!("../generated/bvh_subset.wgsl");
/// Cells of a hash table that visitors claim.
pub(crate) const CELL_TABLE: &str = include_str!("../generated/cell_table.wgsl");
/// Direct light with emitters chosen by a light tree.
pub(crate) const DIRECT: &str = include_str!("../generated/direct.wgsl");
/// Building light trees.
pub(crate) const LIGHT_TREE_BUILD: &str = include_str!("../generated/light_tree_build.wgsl");
/// Direct light by cuts through a light tree that pixels share.
pub(crate) const LIGHTCUTS: &str = include_str!("../generated/lightcuts.wgsl");
/// Building lighting grids.
pub(crate) const LIGHTING_GRID_BUILD: &str = include_str!("../generated/lighting_grid_build.wgsl");
/// Light by Markov chain mixtures.
pub(crate) const MIXTURE: &str = include_str!("../generated/mixture.wgsl");
/// Adapting octrees.
pub(crate) const OCTREE_ADAPT: &str = include_str!("../generated/octree_adapt.wgsl");
/// Path tracing by wavefronts.
pub(crate) const PATH: &str = include_str!("../generated/path.wgsl");
/// Quadtrees that learn.
pub(crate) const QUADTREE_LEARN: &str = include_str!("../generated/quadtree_learn.wgsl");
/// Sorting by codes.
pub(crate) const RADIX_SORT: &str = include_str!("../generated/radix_sort.wgsl");
/// Direct light by reuse among pixels and frames.
pub(crate) const RESTIR_DI: &str = include_str!("../generated/restir_di.wgsl");
/// Its cells of space.
pub(crate) const RESTIR_DI_WORLD: &str = include_str!("../generated/restir_di_world.wgsl");
/// Supporting prefixes of suffix reuse.
pub(crate) const RESTIR_PREFIX: &str = include_str!("../generated/restir_prefix.wgsl");
/// Paths by reuse among pixels and frames.
pub(crate) const RESTIR_PT: &str = include_str!("../generated/restir_pt.wgsl");
/// Their cells of space.
pub(crate) const RESTIR_PT_WORLD: &str = include_str!("../generated/restir_pt_world.wgsl");
/// Suffixes behind prefixes by reuse among pixels and frames.
pub(crate) const RESTIR_SUFFIX: &str = include_str!("../generated/restir_suffix.wgsl");
/// Single scattering in a medium by reuse among pixels and frames.
pub(crate) const RESTIR_VOLUME: &str = include_str!("../generated/restir_volume.wgsl");
/// The filter of shadows, and the image that follows.
pub(crate) const SHADOW_FILTER: &str = include_str!("../generated/shadow_filter.wgsl");
/// Path tracing through a medium.
pub(crate) const VOLPATH: &str = include_str!("../generated/volpath.wgsl");
/// Light of virtual point lights by a lighting grid.
pub(crate) const VPL_GRID: &str = include_str!("../generated/vpl_grid.wgsl");

/// The overridable constants of a linked program: as it calls them, and as they were called before
/// it was linked.
pub(crate) fn overrides(program: &str) -> impl Iterator<Item = (&str, String)> {
    let declared = program.lines().filter_map(|line| line.strip_prefix("override "));
    let names = declared.filter_map(|rest| rest.split(':').next());
    names.map(|name| (name, linked_name(name)))
}

/// The name that something had before it was linked: behind the path of its module, where an
/// underscore stands for `::` and a number counts the underscores of a part that has some.
pub(crate) fn linked_name(linked: &str) -> String {
    let Some(rest) = linked.strip_prefix("package_") else {
        return linked.to_owned();
    };
    let mut parts = Vec::new();
    let mut words = rest.split('_');
    while let Some(word) = words.next() {
        // `__3a_b_c_d`: the empty word before the count.
        if word.is_empty() {
            let counted = words.next().unwrap_or("");
            let digits = counted.chars().take_while(char::is_ascii_digit).count();
            let count: usize = counted[..digits].parse().unwrap_or(0);
            let mut part = vec![&counted[digits..]];
            part.extend(words.by_ref().take(count));
            parts.push(part.join("_"));
        } else {
            parts.push(word.to_owned());
        }
    }
    parts.pop().unwrap_or_default()
}
