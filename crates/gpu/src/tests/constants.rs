//! Numbers that shaders share with the libraries have one value: both texts are read, and compared
//! by name.
//!
//! The libraries' numbers are read from their sources, since many of them are nobody else's
//! business.

use lightshed_shaders::MODULES;
use std::path::Path;

/// Constants by the same name: a module of shaders, the crate, and names.
const SAME: &[(&str, &str, &[&str])] = &[
    (
        "bsdf",
        "scene",
        &[
            "DIFFUSE",
            "MIRROR",
            "SMOOTH_CONDUCTOR",
            "GGX_CONDUCTOR",
            "SMOOTH_DIELECTRIC",
            "GGX_DIELECTRIC",
            "THIN_DIELECTRIC",
            "PLASTIC",
            "GGX_PLASTIC",
        ],
    ),
    ("connectability", "shift", &["RESOLVED"]),
    ("curve", "spatial", &["BITS"]),
    ("emitter", "scene", &["SEGMENT_END"]),
    ("grid_light", "lights", &["CORRECTION_BOUND"]),
    (
        "importance",
        "lights",
        &[
            "MARGIN",
            "MIN_SQUARED",
            "MIN_RATIO",
            "MIN_RATIO_BETWEEN_BLOCKS",
            "MIN_SHARE",
            "MAX_INVERSE_SQRT_TIMES_ROOT",
        ],
    ),
    ("lighting_grid", "lights", &["REACH_FACTOR"]),
    ("normal_ball", "lights", &["CENTER_STEPS", "TO_INTEGER"]),
    ("exponential", "guiding", &["VANISHES_FROM"]),
    ("octree", "spatial", &["MAX_OCTREE_DEPTH"]),
    ("octree_adaptation", "spatial", &["KIND_SHIFT"]),
    ("parallax", "guiding", &["LARGEST_OFFSET"]),
    ("path_walk", "shift", &["SURVIVAL_CAP"]),
    ("quadtree", "guiding", &["MAX_QUADTREE_DEPTH"]),
    ("quadtree_learning", "guiding", &["MAX_QUADTREE_DEPTH"]),
    ("vmf", "guiding", &["MAX_CONCENTRATION", "UNIFORM_BELOW"]),
    ("reservoir", "resampling", &["TAG_EMPTY", "TAG_SAMPLE"]),
    ("surface", "scene", &["POSITION_ERROR"]),
    (
        "texture",
        "scene",
        &["BILINEAR", "NEAREST", "CHECKERBOARD", "NO_TABLE"],
    ),
    (
        "unbiased_marching",
        "volume",
        &["CORRECTED", "ROULETTE", "MAX_QUERIES"],
    ),
    ("cwbvh", "gpu", &["CWBVH_STACK"]),
    // Of programs.
    ("bvh_build", "bvh", &["CELLS", "MOST", "ROUND"]),
    ("bvh_build", "gpu", &["STEP"]),
    ("bvh_subset", "bvh", &["BINS", "OFFSET"]),
    ("bvh_subset", "gpu", &["BINS", "CHUNK"]),
    ("cell_table::main", "gpu", &["RANK_BITS"]),
    ("group", "gpu", &["GROUP"]),
    ("lighting_grid_build", "gpu", &["TILE"]),
    ("light_tree_build", "gpu", &["WIDTH"]),
    ("inputs", "gpu", &["MOST_NEIGHBOURS"]),
    ("medium", "gpu", &["ABOVE", "BELOW", "BOUNDARY"]),
    (
        "restir_di::target",
        "integrator",
        &["LEAST_COS_NORMALS", "MOST_RELATIVE_DEPTH"],
    ),
    (
        "restir_volume::through",
        "integrator",
        &["DIAGONAL", "OPAQUE_DEPTH", "LOOKUP_DEPTH"],
    ),
    ("restir_volume::candidates", "integrator", &["LEAST_SHARE"]),
    ("shadow_filter", "integrator", &["PLANE_TOLERANCE"]),
    ("world::main", "gpu", &["MOST_INPUTS"]),
];

/// A shader's constant and the variant of the enumeration that it stands for.
type NamedVariant = (&'static str, &'static str);

/// Variants of an enumeration, by the names that a module of shaders has for them.
const VARIANTS: &[(&str, &str, &str, &[NamedVariant])] = &[
    (
        "path_shift",
        "resampling",
        "Undefined",
        &[
            ("OUTSIDE_DOMAIN", "OutsideDomain"),
            ("NOT_CONNECTABLE", "NotConnectable"),
            ("NOT_INVERTIBLE", "NotInvertible"),
            ("OCCLUDED", "Occluded"),
            ("DEGENERATE", "Degenerate"),
        ],
    ),
    (
        "path_sample",
        "shift",
        "Technique",
        &[("BY_SCATTERING", "Scattering"), ("BY_EMITTER", "Emitter")],
    ),
    (
        "path_sample",
        "shift",
        "AnchorKind",
        &[
            ("ANCHOR_NONE", "None"),
            ("ANCHOR_VERTEX", "Vertex"),
            ("ANCHOR_EMITTER", "EmitterSurface"),
            ("ANCHOR_DIRECTION", "EmitterDirection"),
        ],
    ),
    (
        "connectability",
        "shift",
        "Reach",
        &[
            ("REACH_NEVER", "Never"),
            ("REACH_FIRST", "First"),
            ("REACH_ANY", "Any"),
        ],
    ),
    (
        "importance",
        "lights",
        "Facing",
        &[
            ("FACING_FRONT", "Front"),
            ("FACING_BOTH", "Both"),
            ("FACING_ALL", "All"),
        ],
    ),
    (
        "importance",
        "lights",
        "Weighting",
        &[
            ("WEIGHTING_CENTER", "Center"),
            ("WEIGHTING_MIN_MAX", "MinMax"),
            ("WEIGHTING_YUKSEL", "Yuksel"),
        ],
    ),
    (
        "curve",
        "spatial",
        "Curve",
        &[("CURVE_MORTON", "Morton"), ("CURVE_HILBERT", "Hilbert")],
    ),
    (
        "density",
        "volume",
        "Filter",
        &[("FILTER_NEAREST", "Nearest"), ("FILTER_TRILINEAR", "Trilinear")],
    ),
];

/// A library's source, all files of it.
fn sources(name: &str) -> String {
    fn read(folder: &Path, text: &mut String) {
        for entry in std::fs::read_dir(folder).expect("it is a folder") {
            let path = entry.expect("it can be read").path();
            if path.is_dir() {
                read(&path, text);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                text.push_str(&std::fs::read_to_string(&path).expect("it is text"));
            }
        }
    }
    let crates = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("it has a parent");
    let mut text = String::new();
    read(&crates.join(name).join("src"), &mut text);
    text
}

/// The text of a module: of the library, or of programs.
fn shader(module: &str) -> String {
    if let Some(module) = MODULES.iter().find(|of| of.name == module) {
        return module.wesl.to_owned();
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("src/wesl")
        .join(module.replace("::", "/"));
    std::fs::read_to_string(path.with_extension("wesl")).unwrap_or_else(|error| panic!("{module}: {error}"))
}

/// Values of all constants of a name, as `f32` where they are fractions; those that are no plain
/// numbers are passed over.
fn constants(text: &str, name: &str) -> Vec<f64> {
    let declared = format!("const {name}: ");
    text.split(&declared)
        .skip(1)
        .filter_map(|rest| {
            let (kind, rest) = rest.split_once('=')?;
            let (value, _) = rest.split_once(';')?;
            let value = evaluate(value)?;
            Some(match kind.trim() {
                "f32" | "f64" => f64::from(value as f32),
                _ => value,
            })
        })
        .collect()
}

/// A sum, shift, product or quotient of numbers, as either language writes it.
fn evaluate(text: &str) -> Option<f64> {
    let text = text.trim();
    for operator in [" - ", " << ", " * ", " / "] {
        if let Some((a, b)) = text.split_once(operator)
            && a.matches('(').count() == a.matches(')').count()
        {
            let (a, b) = (evaluate(a)?, evaluate(b)?);
            return Some(match operator {
                " - " => a - b,
                " << " => a * b.exp2(),
                " * " => a * b,
                _ => a / b,
            });
        }
    }
    let text = text.trim_end_matches(" as f32").trim_end_matches(" as f64");
    if let Some(inner) = text.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')) {
        return evaluate(inner);
    }
    match text {
        "u32::MAX" => return Some(f64::from(u32::MAX)),
        "f32::MAX" => return Some(f64::from(f32::MAX)),
        "f32::EPSILON" => return Some(f64::from(f32::EPSILON)),
        _ => {}
    }
    let digits = text.replace('_', "");
    if let Some(hexadecimal) = digits.strip_prefix("0x") {
        return u64::from_str_radix(hexadecimal.trim_end_matches('u'), 16)
            .ok()
            .map(|n| n as f64);
    }
    digits.trim_end_matches(['u', 'f']).parse().ok()
}

/// Numbers of the variants of an enumeration, in order; a comment may stand before each.
fn variants(text: &str, name: &str) -> Vec<(String, f64)> {
    let (_, rest) = text
        .split_once(&format!("enum {name} {{"))
        .unwrap_or_else(|| panic!("there is no {name}"));
    let (body, _) = rest.split_once('}').expect("declarations end");
    let mut next = 0.0;
    body.lines()
        .map(str::trim)
        .filter(|line| !line.is_empty() && !line.starts_with("//") && !line.starts_with('#'))
        .map(|line| {
            let line = line.trim_end_matches(',');
            let (variant, number) = line.split_once(" = ").unwrap_or((line, ""));
            next = evaluate(number).unwrap_or(next) + 1.0;
            (variant.to_owned(), next - 1.0)
        })
        .collect()
}

fn one(module: &str, text: &str, name: &str) -> f64 {
    match constants(text, name)[..] {
        [value] => value,
        ref values => panic!("{module} has {} of {name}", values.len()),
    }
}

#[test]
fn constants_are_the_libraries() {
    for &(module, library, names) in SAME {
        let (shader, source) = (shader(module), sources(library));
        for name in names {
            let value = one(module, &shader, name);
            let known = constants(&source, name);
            assert!(
                known.contains(&value),
                "{module}: {name} is {value}, in {library} {known:?}"
            );
        }
    }
}

#[test]
fn variants_have_the_libraries_numbers() {
    for &(module, library, of, names) in VARIANTS {
        let (shader, known) = (shader(module), variants(&sources(library), of));
        for &(name, variant) in names {
            let value = one(module, &shader, name);
            let of_library = known.iter().find(|(known, _)| known == variant);
            let (_, number) = of_library.unwrap_or_else(|| panic!("{of} has no {variant}"));
            assert_eq!(value, *number, "{module}: {name} is no {of}::{variant}");
        }
    }
}

/// Shaders weigh colours by the libraries' luminance, and no module by numbers of its own.
#[test]
fn there_is_one_luminance() {
    let weights = |text: &str| -> Vec<Vec<f32>> {
        text.split("const LUMINANCE: vec3f = vec3f(")
            .skip(1)
            .filter_map(|rest| rest.split_once(')'))
            .map(|(numbers, _)| numbers.split(", ").filter_map(|n| n.parse().ok()).collect())
            .collect()
    };
    assert_eq!(
        weights(&shader("color")),
        [lightshed_sampling::LUMINANCE.to_array()]
    );
    assert_ne!(
        weights("const LUMINANCE: vec3f = vec3f(0.2126, 0.7152, 0.0722);"),
        weights(&shader("color"))
    );
    for module in MODULES.iter().filter(|module| module.name != "color") {
        assert!(
            !module.wesl.contains("0.21"),
            "{} has a luminance of its own",
            module.name
        );
    }
}

/// What both languages write is read, and other numbers are noticed.
#[test]
fn numbers_are_read() {
    let text = "const A: u32 = 0xffu; const B: f32 = 1.0 - 16.0 * 0.5; const C: f32 = (1 << 3) as f32; const D: u32 = 1_0;";
    let read = |name| constants(text, name);
    assert_eq!(
        [read("A"), read("B"), read("C"), read("D"), read("E")],
        [vec![255.0], vec![-7.0], vec![8.0], vec![10.0], vec![]]
    );
    let numbers = variants("enum E {\n/// A.\nA = 3,\nB,\n}", "E");
    assert_eq!(numbers, [("A".to_owned(), 3.0), ("B".to_owned(), 4.0)]);
    assert_ne!(
        constants("const A: f32 = 0.2126;", "A"),
        constants("const A: f32 = 0.212671;", "A")
    );
}
