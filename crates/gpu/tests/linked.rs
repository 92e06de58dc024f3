//! The WGSL that is checked in is what the programs link to.
//!
//! `LIGHTSHED_RELINK=1 cargo test -p lightshed-gpu --test linked` writes it anew.

use lightshed_shaders::Linker;
use std::path::Path;

const PROGRAMS: [&str; 4] = ["light_tree_build", "path", "radix_sort", "restir_di"];

#[test]
fn checked_in_wgsl_is_what_programs_link_to() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let source = |name: &str| {
        let path = folder.join("wesl").join(name).with_extension("wesl");
        std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    };
    for name in PROGRAMS {
        let linked = Linker::new()
            .module("package::host", source("host"))
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
        let path = folder.join("wgsl").join(name).with_extension("wgsl");
        if std::env::var_os("LIGHTSHED_RELINK").is_some() {
            std::fs::write(&path, &wgsl).expect("the folder can be written to");
        } else {
            let checked_in = std::fs::read_to_string(&path).expect("it is checked in");
            assert!(checked_in == wgsl, "{name}: link it again");
        }
    }
}
