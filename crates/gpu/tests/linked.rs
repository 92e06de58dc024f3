//! The WGSL that is checked in is what the programs link to.
//!
//! `LIGHTSHED_RELINK=1 cargo test -p lightshed-gpu --test linked` writes it anew.

use lightshed_shaders::Linker;
use std::path::Path;

const PROGRAMS: [&str; 12] = [
    "direct",
    "light_tree_build",
    "lightcuts",
    "lighting_grid_build",
    "path",
    "radix_sort",
    "restir_di",
    "restir_pt",
    "restir_volume",
    "shadow_filter",
    "volpath",
    "vpl_grid",
];

#[test]
fn checked_in_wgsl_is_what_programs_link_to() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (folder, generated) = (package.join("src"), package.join("generated"));
    let source = |name: &str| {
        let path = folder.join("wesl").join(name).with_extension("wesl");
        std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    };
    for name in PROGRAMS {
        let linked = Linker::new()
            .module("package::host", source("host"))
            .module("package::selected", source("selected"))
            .module("package::medium", source("medium"))
            .module("package::gathering", source("gathering"))
            .module("package::volume", source("volume"))
            .module("package::through", source("through"))
            .module("package::scattered", source("scattered"))
            .module("package::main", source(name))
            .link("package::main")
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let wgsl = format!("// Linked from {name}.wesl.\n\n{}\n", linked.trim_end());
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
        let path = generated.join(name).with_extension("wgsl");
        if std::env::var_os("LIGHTSHED_RELINK").is_some() {
            std::fs::write(&path, &wgsl).expect("the folder can be written to");
        } else {
            let checked_in = std::fs::read_to_string(&path).expect("it is checked in");
            assert!(checked_in == wgsl, "{name}: link it again");
        }
    }
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
        ("direct", "package_lightshed__1light_tree_LightTree", 16),
        ("direct", "Direct", 48),
        ("vpl_grid", "VplGrid", 32),
        ("vpl_grid", "Pixel", 64),
        ("shadow_filter", "Pixel", 64),
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
        ("restir_di", "Light", 48),
        ("restir_di", "Frame", 48),
        ("restir_pt", "package_lightshed__1path_sample_PathReservoir", 64),
        ("restir_pt", "Frame", 48),
        ("restir_volume", "package_volume_Frame", 32),
        ("restir_volume", "package_volume_Primary", 32),
        ("restir_volume", "package_volume_Scattered", 48),
        ("volpath", "package_host_Settings", 240),
        ("volpath", "package_lightshed_sky_Sky", 64),
        ("volpath", "package_lightshed_majorant_MajorantGrid", 48),
        ("volpath", "package_lightshed_tracking_Medium", 64),
        ("volpath", "package_host_MediumSettings", 144),
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
