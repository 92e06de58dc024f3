//! The WGSL that is checked in is what the modules link to, and all of it is valid. No GPU is
//! needed.
//!
//! `LIGHTSHED_RELINK=1 cargo test -p lightshed-shaders --test linked` writes it anew.

use lightshed_shaders::{Linker, MODULES, bundle};
use std::collections::BTreeSet;
use std::path::Path;

/// Parses and validates.
fn validate(name: &str, wgsl: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(wgsl)
        .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(wgsl)));
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::empty(),
    );
    if let Err(error) = validator.validate(&module) {
        panic!("{name}: {}", error.emit_to_string(wgsl));
    }
    module
}

fn linked(name: &str) -> String {
    let text = Linker::new()
        .keep_all()
        .link(&format!("package::lightshed::{name}"))
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    format!("// Linked from {name}.wesl.\n\n{}\n", text.trim_end())
}

#[test]
fn checked_in_wgsl_is_what_modules_link_to() {
    for module in MODULES.iter().filter(|module| module.host.is_empty()) {
        let wgsl = linked(module.name);
        if std::env::var_os("LIGHTSHED_RELINK").is_some() {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("generated/{}.wgsl", module.name));
            std::fs::write(path, &wgsl).expect("the folder can be written to");
        } else {
            assert_eq!(Some(&*wgsl), module.wgsl, "{}: link it again", module.name);
        }
        validate(module.name, &wgsl);
    }
}

/// What media and light trees ask of a host, over one buffer of words; what surfaces ask for, their
/// host in `lightshed-gpu` has.
const HOST: &str = "
    import package::lightshed::alias::AliasEntry;
    import package::lightshed::grid_light::{GridFrame, GridLight, GridPoint};
    import package::lightshed::guiding_field::GuidingField;
    import package::lightshed::lightcut::Subtree;
    import package::lightshed::lighting_grid::Influence;
    import package::lightshed::merge::{MergeImage, MergeInput};
    import package::lightshed::radiance_cache::CachedRadiance;
    import package::lightshed::sky::Sky;
    @group(0) @binding(0) var<storage, read> words: array<u32>;
    @group(0) @binding(1) var<storage, read_write> subtrees: array<Subtree>;
    @group(0) @binding(2) var<storage, read> frame: GridFrame;
    @group(0) @binding(3) var<storage, read> grid_lights: array<GridLight>;
    @group(0) @binding(4) var<storage, read> points: array<GridPoint>;
    @group(0) @binding(5) var<storage, read> field: GuidingField;
    var<private> sum: vec3f;
    fn guiding_field() -> GuidingField { return field; }
    fn load_guide_region(slot: u32) -> u32 { return words[slot]; }
    fn load_octree_node(index: u32) -> u32 { return words[index]; }
    fn load_quadtree_word(index: u32) -> u32 { return words[index]; }
    fn grid_frame() -> GridFrame { return frame; }
    fn load_alias_entry(table: u32, index: u32) -> AliasEntry { return AliasEntry(words[index], words[table]); }
    fn load_cached_radiance(slot: u32) -> CachedRadiance {
        let number = vec3f(f32(words[slot]));
        return CachedRadiance(number, number, number, number, number, number.x);
    }
    fn load_cell_word(slot: u32) -> vec2u { return vec2u(words[slot]); }
    fn load_density(voxel: vec3u) -> f32 { return f32(words[voxel.x + voxel.y + voxel.z]); }
    fn load_grid_key(place: u32) -> u32 { return words[place]; }
    fn load_grid_light(place: u32) -> GridLight { return grid_lights[place]; }
    fn load_grid_point(place: u32) -> GridPoint { return points[place]; }
    fn load_grid_word(word: u32) -> vec2u { return vec2u(words[word], words[word + 1u]); }
    fn load_leaf_of(light: u32) -> u32 { return words[light]; }
    fn load_light_at(leaf: u32) -> u32 { return words[leaf]; }
    fn load_light_level(level: u32) -> u32 { return words[level]; }
    fn load_light_row(place: u32) -> vec4u { return vec4u(words[place]); }
    fn load_majorant(cell: u32) -> vec2f { return vec2f(0.0, f32(words[cell])); }
    fn merge_input(i: u32) -> MergeInput { return MergeInput(1.0, f32(words[i]), 1.0); }
    fn merge_keep(i: u32) { sum.x = f32(i); }
    fn merge_number(i: u32) -> f32 { return f32(words[i]); }
    fn merge_shift(i: u32, j: u32) -> MergeImage { return MergeImage(f32(words[i]), f32(words[j])); }
    fn merge_visit(i: u32, weight: f32) { sum += weight; }
    fn load_subtree(place: u32) -> Subtree { return subtrees[place]; }
    fn store_subtree(place: u32, subtree: Subtree) { subtrees[place] = subtree; }
    fn load_sky_word(index: u32) -> u32 { return words[index]; }
    fn sky() -> Sky { return Sky(vec3f(1.0), 1.0, vec3f(1.0), words[0], vec3f(1.0), 0u, vec2u(words[1]), vec2u(0u)); }
    fn visit_influence(influence: Influence) { sum += influence.intensity; }
";

#[test]
fn modules_with_a_host_are_valid() {
    let given = |name: &&str| HOST.contains(&format!("fn {name}("));
    for module in MODULES.iter().filter(|module| module.host.iter().all(given)) {
        let wgsl = Linker::new()
            .module("package::host", HOST)
            .keep_all()
            .link(&format!("package::lightshed::{}", module.name))
            .unwrap_or_else(|error| panic!("{}: {error}", module.name));
        validate(module.name, &wgsl);
    }
}

/// Names that `text` imports from a path that starts with `from`, after which comes the last part
/// of it.
fn imports<'a>(text: &'a str, from: &str) -> Vec<(&'a str, Vec<&'a str>)> {
    text.split("import ")
        .skip(1)
        .filter_map(|rest| rest.split(';').next()?.strip_prefix(from))
        .map(|path| {
            let (module, names) = path.split_once("::").unwrap_or(("", path));
            let names = names.trim_matches(['{', '}', ' ', '\n']).split(',');
            (
                module,
                names.map(str::trim).filter(|name| !name.is_empty()).collect(),
            )
        })
        .collect()
}

/// What a module imports from `package::host`, itself or through others, is what it states.
#[test]
fn hosts_are_stated() {
    for module in MODULES {
        let mut reached = BTreeSet::from([module.name]);
        let mut open = vec![module.name];
        let mut asked = BTreeSet::new();
        while let Some(name) = open.pop() {
            let text = lightshed_shaders::module(name)
                .expect("imports name modules")
                .wesl;
            asked.extend(
                imports(text, "package::host::")
                    .into_iter()
                    .flat_map(|(_, names)| names),
            );
            for (next, _) in imports(text, "super::") {
                if reached.insert(next) {
                    open.push(next);
                }
            }
        }
        let stated: BTreeSet<&str> = module.host.iter().copied().collect();
        assert_eq!(asked, stated, "{}", module.name);
        assert_eq!(module.wgsl.is_none(), !module.host.is_empty(), "{}", module.name);
    }
}

#[test]
fn modules_bind_nothing_and_are_sorted() {
    for module in MODULES {
        assert!(!module.wesl.contains("@group"), "{}", module.name);
        // Contraction is what parity does not survive.
        assert!(!module.wesl.contains("fma("), "{}", module.name);
    }
    assert!(MODULES.is_sorted_by_key(|module| module.name));
}

/// What is planted is found: the tests above can fail.
#[test]
fn faults_are_found() {
    let wrong = "fn f() -> u32 { return 1.0; }";
    assert!(std::panic::catch_unwind(|| validate("wrong", wrong)).is_err());
    assert!(Linker::new().link("package::lightshed::nothing").is_err());
    let missing = Linker::new()
        .module(
            "package::main",
            "import package::lightshed::rng::nothing; fn f() { nothing(); }",
        )
        .keep_all()
        .link("package::main");
    assert!(missing.is_err());
}

/// Any two modules that need no host, and all of them together, make one valid text that has each
/// declaration once and the names of both. Two texts joined as they are do not.
#[test]
fn any_two_modules_make_a_bundle() {
    let plain: Vec<&str> = MODULES
        .iter()
        .filter(|m| m.host.is_empty())
        .map(|m| m.name)
        .collect();
    let (mut pairs, mut clashes) = (0, 0);
    for (i, first) in plain.iter().enumerate() {
        for second in &plain[i + 1..] {
            let text = bundle(&[first, second]).unwrap_or_else(|error| panic!("{error}"));
            let module = validate(&format!("{first} and {second}"), &text);
            for name in [first, second] {
                let own = validate(name, lightshed_shaders::module(name).unwrap().wgsl.unwrap());
                for (_, function) in own.functions.iter() {
                    let name = function.name.as_deref().unwrap();
                    let is_there = module
                        .functions
                        .iter()
                        .any(|(_, f)| f.name.as_deref() == Some(name));
                    assert!(
                        is_there || name.starts_with("package_"),
                        "{first}, {second}: {name}"
                    );
                }
            }
            pairs += 1;
            let texts = [first, second].map(|name| lightshed_shaders::module(name).unwrap().wgsl.unwrap());
            clashes += usize::from(naga::front::wgsl::parse_str(&texts.concat()).is_err());
        }
    }
    println!("{pairs} pairs, {clashes} of which cannot be joined as they are");
    assert!(clashes > 0);
    let all = bundle(&plain).unwrap_or_else(|error| panic!("{error}"));
    validate("all", &all);
    assert!(
        !all.contains("package_lightshed_"),
        "what is asked for has its own name"
    );
}
