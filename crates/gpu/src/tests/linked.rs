//! The WGSL that is checked in is what the programs link to, and binds what the tables of bindings
//! say.
//!
//! `LIGHTSHED_RELINK=1 cargo test -p lightshed-gpu linked` writes it anew.

use crate::bindings::{FilterBindings, Table};
use crate::buffer::Access;
use crate::programs::{linked_name, overrides};
use crate::{
    bvh, bvh_subset, cell_table, direct, light_tree, lightcuts, lighting_grid, mixture, octree, path_tracer,
    quadtree, radix_sort, restir_di, restir_pt, restir_suffix, restir_volume, volpath, vpl_grid,
};
use lightshed_shaders::Linker;
use std::path::{Path, PathBuf};

/// Programs, and what they bind.
const PROGRAMS: [(&str, &[Table]); 22] = [
    ("bvh_build", &bvh::TABLES),
    ("bvh_subset", &bvh_subset::TABLES),
    ("cell_table", &cell_table::TABLES),
    ("direct", &direct::TABLES),
    ("light_tree_build", &light_tree::TABLES),
    ("lightcuts", &lightcuts::TABLES),
    ("lighting_grid_build", &lighting_grid::TABLES),
    ("mixture", &mixture::TABLES),
    ("octree_adapt", &octree::TABLES),
    ("path", &path_tracer::TABLES),
    ("quadtree_learn", &quadtree::TABLES),
    ("radix_sort", &radix_sort::TABLES),
    ("restir_di", &restir_di::TABLES),
    ("restir_di_world", &restir_di::WORLD_TABLES),
    ("restir_prefix", &restir_suffix::TABLES),
    ("restir_pt", &restir_pt::TABLES),
    ("restir_pt_world", &restir_pt::WORLD_TABLES),
    ("restir_suffix", &restir_suffix::TABLES),
    ("restir_volume", &restir_volume::TABLES),
    ("shadow_filter", &vpl_grid::FILTER_TABLES),
    ("volpath", &volpath::TABLES),
    ("vpl_grid", &vpl_grid::GATHER_TABLES),
];

/// Overridable constants that hosts set.
const CONSTANTS: [&str; 13] = [
    "BY_CACHE",
    "BY_TREE",
    "HAS_CACHE",
    "HAS_DELTA_EMITTERS",
    "HAS_DIELECTRICS",
    "HAS_EMITTERS",
    "HAS_GUIDE",
    "HAS_PLASTICS",
    "HAS_SKY",
    "HAS_SURFACES",
    "HAS_SURROUNDINGS",
    "HAS_TEXTURES",
    "HAS_TOUCHING",
];

/// All `.wesl` files under `folder`, by the paths of their modules.
fn modules(folder: &Path, path: &str) -> Vec<(String, String)> {
    let entries = std::fs::read_dir(folder).expect("it is a folder");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("it can be read").path())
        .collect();
    paths.sort();
    let mut found = Vec::new();
    for file in paths {
        let stem = file
            .file_stem()
            .and_then(|stem| stem.to_str())
            .expect("names are plain");
        let path = format!("{path}::{stem}");
        if file.is_dir() {
            found.extend(modules(&file, &path));
        } else {
            found.push((path, std::fs::read_to_string(&file).expect("it is text")));
        }
    }
    found
}

/// With the modules of all programs.
pub(crate) fn linker() -> Linker<'static> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/wesl");
    modules(&folder, "package")
        .into_iter()
        .fold(Linker::new(), |linker, (path, text)| linker.module(&path, text))
}

/// Links a program: `name.wesl`, or `name/main.wesl` with `name/reuse.wesl` for what merges ask
/// for, and `name/cells.wesl` for the table of cells that it looks up.
fn link(modules: &[(String, String)], name: &str) -> String {
    let text = |path: &str| {
        modules
            .iter()
            .find(|(of, _)| of == path)
            .map(|(_, text)| text.as_str())
    };
    let mut linker = Linker::new();
    for (path, text) in modules {
        linker = linker.module(path, text.as_str());
    }
    // Cells of space of a method: programs of their own, with what the method's pixels hold.
    let (folder, method) = match name.strip_suffix("_world") {
        Some(method) => ("world", method),
        None => (name, name),
    };
    for (module, from) in [("reuse", folder), ("cells", folder), ("samples", method)] {
        let own = text(&format!("package::{from}::{module}"));
        let usual = || text(&format!("package::memory::{module}"));
        if let Some(text) = own.or_else(usual) {
            linker = linker.module(&format!("package::{module}"), text);
        }
    }
    let alone = format!("package::{folder}");
    let root = if text(&alone).is_some() {
        alone
    } else {
        format!("package::{folder}::main")
    };
    let linked = linker
        .link(&root)
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    format!("// Linked from {name}.wesl.\n\n{}\n", linked.trim_end())
}

#[test]
fn checked_in_wgsl_is_what_programs_link_to() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let modules = modules(&package.join("src/wesl"), "package");
    for (name, tables) in PROGRAMS {
        let wgsl = link(&modules, name);
        let module = naga::front::wgsl::parse_str(&wgsl)
            .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(&wgsl)));
        let mut validator = naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::empty(),
        );
        if let Err(error) = validator.validate(&module) {
            panic!("{name}: {}", error.emit_to_string(&wgsl));
        }
        check_sizes(name, &module);
        for (_, constant) in overrides(&wgsl) {
            assert!(
                CONSTANTS.contains(&constant.as_str()),
                "nobody sets {constant} of {name}"
            );
        }
        check_bindings(tables, &module).unwrap_or_else(|error| panic!("{name}: {error}"));
        let path = package.join("generated").join(name).with_extension("wgsl");
        if std::env::var_os("LIGHTSHED_RELINK").is_some() {
            std::fs::write(&path, &wgsl).expect("the folder can be written to");
        } else {
            let checked_in = std::fs::read_to_string(&path).expect("it is checked in");
            assert!(checked_in == wgsl, "{name}: link it again");
        }
    }
}

/// Whether everything that a program binds stands in its tables, by group, number, name and access;
/// and whether no two of them have a place in common.
fn check_bindings(tables: &[Table], module: &naga::Module) -> Result<(), String> {
    let all: Vec<_> = tables
        .iter()
        .flat_map(|table| {
            let rows = table.numbered();
            rows.map(|(number, name, access)| (table.group, number, name, access))
        })
        .collect();
    for (i, (group, number, name, _)) in all.iter().enumerate() {
        if all[..i].iter().any(|(g, n, ..)| (g, n) == (group, number)) {
            return Err(format!(
                "two buffers at binding {number} of group {group}, one of them {name}"
            ));
        }
    }
    for (_, variable) in module.global_variables.iter() {
        let Some(binding) = &variable.binding else {
            continue;
        };
        let linked = variable.name.as_deref().unwrap_or("");
        let stands = all.iter().find(|(_, _, name, _)| linked_name(linked) == *name);
        let Some(&(group, number, name, access)) = stands else {
            return Err(format!("{linked} stands in no table"));
        };
        if (binding.group, binding.binding) != (group, number) {
            return Err(format!(
                "{name} is bound to {} of group {}, not to {number} of group {group}",
                binding.binding, binding.group
            ));
        }
        let stored = match variable.space {
            naga::AddressSpace::Storage { access } => access.contains(naga::StorageAccess::STORE),
            _ => return Err(format!("{name} is no storage buffer")),
        };
        if stored != (access == Access::Write) {
            return Err(format!("{name} is declared with another access than {access:?}"));
        }
    }
    Ok(())
}

/// What is planted is found.
#[test]
fn other_bindings_are_noticed() {
    let table = FilterBindings::TABLE;
    let declared = |group: u32, number: u32, name: &str, access: &str| {
        let text = format!("@group({group}) @binding({number}) var<storage, {access}> {name}: array<f32>;");
        naga::front::wgsl::parse_str(&text).expect("it is WGSL")
    };
    let check = |module| check_bindings(&[table], &module);
    assert_eq!(check(declared(0, 2, "values", "read")), Ok(()));
    assert_eq!(
        check(declared(0, 2, "package_memory__1some_where_values", "read")),
        Ok(())
    );
    for module in [
        declared(0, 2, "others", "read"),
        declared(0, 3, "values", "read"),
        declared(1, 2, "values", "read"),
        declared(0, 2, "values", "read_write"),
    ] {
        assert!(check(module).is_err());
    }
    assert!(check_bindings(&[table, table], &declared(0, 2, "values", "read")).is_err());
}

/// Structures that the host writes have the sizes that it takes them for.
fn check_sizes(program: &str, module: &naga::Module) {
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).expect("types have layouts");
    for (of, name, size) in [
        (
            "light_tree_build",
            "LightRecord",
            size_of::<lightshed_lights::LightRecord>(),
        ),
        ("light_tree_build", "Settings", 144),
        ("bvh_build", "Settings", 16),
        ("bvh_build", "Frame", 32),
        ("bvh_subset", "Drawing", 1088),
        ("bvh_subset", "Drawn", 32),
        ("bvh_build", "Part", 32),
        ("bvh_build", "Node", size_of::<lightshed_bvh::Node>()),
        ("direct", "package_lightshed__1light_tree_LightTree", 16),
        ("direct", "package_memory__1light_cache_CacheMemory", 80),
        ("direct", "Direct", 48),
        ("vpl_grid", "VplGrid", 32),
        ("vpl_grid", "package__1vpl_pixel_Pixel", 64),
        ("shadow_filter", "package__1vpl_pixel_Pixel", 64),
        ("shadow_filter", "Taps", 16),
        ("lightcuts", "Lightcuts", 48),
        ("lightcuts", "package_lightshed_lightcut_Subtree", 16),
        ("lighting_grid_build", "Settings", 96),
        (
            "lighting_grid_build",
            "package_lightshed__1grid_light_GridFrame",
            96,
        ),
        (
            "lighting_grid_build",
            "package_lightshed__1grid_light_GridLight",
            80,
        ),
        (
            "lighting_grid_build",
            "package_lightshed__1grid_light_GridPoint",
            48,
        ),
        (
            "lighting_grid_build",
            "package_lightshed__1grid_moments_Moments",
            80,
        ),
        ("restir_di", "package__1restir_di_light_Light", 48),
        ("restir_di", "package__1restir_di_light_Frame", 48),
        ("cell_table", "Table", 64),
        ("cell_table", "package_memory_visits_Visitor", 16),
        ("cell_table", "package_memory_visits_Visit", 16),
        ("restir_di_world", "package_world_memory_World", 64),
        ("restir_pt", "package_lightshed__1path_sample_PathReservoir", 64),
        ("restir_di", "package_primaries_Primary", 32),
        ("restir_pt", "package__1restir_pt_domain_Frame", 48),
        ("restir_volume", "package__1restir_volume_volume_Frame", 32),
        ("restir_volume", "package__1restir_volume_volume_Primary", 32),
        ("restir_volume", "package__1restir_volume_volume_Scattered", 48),
        ("volpath", "package_memory_scene_Settings", 240),
        ("volpath", "package_lightshed_sky_Sky", 64),
        ("volpath", "package_lightshed_majorant_MajorantGrid", 48),
        ("volpath", "package_lightshed_tracking_Medium", 64),
        ("volpath", "package_memory_medium_MediumSettings", 144),
        ("path", "package_lightshed__1guiding_field_GuidingField", 48),
        ("path", "package_memory__1radiance_cache_CacheSettings", 96),
        ("path", "package_memory__1radiance_cache_CacheRow", 64),
        ("path", "package_lightshed__1path_budget_PathBudget", 20),
        ("mixture", "Mixture", 80),
        ("mixture", "package_lightshed__1markov_state_MarkovState", 32),
        ("octree_adapt", "OctreeState", 16),
        ("octree_adapt", "Adaptation", 32),
        ("quadtree_learn", "Learning", 80),
        ("quadtree_learn", "LearningRegion", 32),
        (
            "quadtree_learn",
            "TrainingSample",
            size_of::<lightshed_integrator::guiding::TrainingSample>(),
        ),
        ("radix_sort", "Pass", 16),
    ] {
        if of == program {
            let found = module
                .types
                .iter()
                .find(|(_, ty)| ty.name.as_deref() == Some(name));
            let (handle, _) = found.unwrap_or_else(|| panic!("{program} has no {name}"));
            assert_eq!(layouter[handle].size as usize, size, "{name}");
        }
    }
}
