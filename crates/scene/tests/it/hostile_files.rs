//! Files that would take all memory, all time, or what does not belong to them: each is refused by
//! a message that names the file and the limit, before it costs much.

use lightshed_scene::import::{
    ImportError, LoadLimits, LoadResource, Loaded, load, load_with, parse_gltf, parse_gltf_with,
    parse_mitsuba, parse_mitsuba_with, parse_obj, parse_ply,
};
use lightshed_scene::{Geometry, Scene};
use std::fmt::Write;
use std::path::{Path, PathBuf};

fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"))
        .join("hostile")
        .join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Default limits but for one.
fn limit(name: &str, value: f64) -> LoadLimits {
    let mut limits = LoadLimits::default();
    assert!(limits.set(name, value), "{name}");
    limits
}

fn error(outcome: Result<Loaded, ImportError>) -> ImportError {
    match outcome {
        Ok(_) => panic!("it was loaded"),
        Err(error) => error,
    }
}

#[track_caller]
fn is_over(outcome: Result<Loaded, ImportError>, expected: LoadResource) {
    let error = error(outcome);
    match error.innermost() {
        ImportError::OverBudget { resource, .. } => assert_eq!(*resource, expected, "{}", error.chain()),
        _ => panic!("{}", error.chain()),
    }
}

#[track_caller]
fn says(outcome: Result<Loaded, ImportError>, text: &str) {
    let message = error(outcome).chain();
    assert!(message.contains(text), "{message} lacks {text}");
}

fn xml(body: &str) -> String {
    format!(r#"<scene version="3.0.0">{body}</scene>"#)
}

#[test]
fn definitions_that_double_are_refused() {
    let mut body = r#"<default name="n0" value="0123456789"/>"#.to_owned();
    for i in 1..64 {
        let before = i - 1;
        write!(body, r#"<default name="n{i}" value="$n{before}$n{before}"/>"#).unwrap();
    }
    says(parse_mitsuba(&xml(&body), "a.xml", &[]), "a.xml:1");
    says(
        parse_mitsuba(&xml(&body), "a.xml", &[]),
        "more than 1048576 bytes once `$n",
    );
    // Values that are each short enough are counted together.
    let long = "x".repeat(1000);
    let mut body = format!(r#"<default name="n" value="{long}"/>"#);
    (0..100).for_each(|i| write!(body, r#"<bsdf type="diffuse" id="{i}$n"/>"#).unwrap());
    is_over(
        parse_mitsuba_with(&xml(&body), "a.xml", &[], &limit("bytes", 50_000.0)),
        LoadResource::Bytes,
    );
}

#[test]
fn includes_that_double_are_refused() {
    let folder = folder("includes");
    for i in 0..30 {
        let next = format!(r#"<include filename="f{}.xml"/>"#, i + 1);
        std::fs::write(folder.join(format!("f{i}.xml")), xml(&next.repeat(2))).unwrap();
    }
    std::fs::write(folder.join("f30.xml"), xml("")).unwrap();
    is_over(load(folder.join("f0.xml"), &[]), LoadResource::Includes);
    is_over(
        load_with(folder.join("f0.xml"), &[], &limit("depth", 20.0)),
        LoadResource::Depth,
    );
    let few = load_with(folder.join("f25.xml"), &[], &limit("includes", 62.0));
    assert!(few.is_ok());
    is_over(
        load_with(folder.join("f25.xml"), &[], &limit("includes", 61.0)),
        LoadResource::Includes,
    );
}

#[test]
fn markup_that_costs_more_than_its_length_is_refused() {
    let attributes: String = (0..200_000).map(|i| format!("a{i}='' ")).collect();
    says(
        parse_mitsuba(&xml(&format!("<bsdf {attributes}/>")), "a.xml", &[]),
        "more than 64 attributes",
    );
    let deep = "<bsdf>".repeat(100_000);
    is_over(parse_mitsuba(&xml(&deep), "a.xml", &[]), LoadResource::Depth);
    let many = r#"<ref id="a"/>"#.repeat(5_000);
    is_over(
        parse_mitsuba_with(&xml(&many), "a.xml", &[], &limit("nodes", 5_000.0)),
        LoadResource::Nodes,
    );
    // What stands in comments is not counted.
    let comment = format!("<!-- {} -->", "<a b='c'>".repeat(100));
    assert!(parse_mitsuba_with(&xml(&comment), "a.xml", &[], &limit("nodes", 2.0)).is_ok());
    says(
        parse_mitsuba("<!DOCTYPE a [<!ENTITY b 'c'>]><scene/>", "a.xml", &[]),
        "XML",
    );
    let objects = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{}{{}}]}}"#,
        "{},".repeat(1_000_000)
    );
    is_over(parse_gltf(objects.as_bytes(), "a.gltf"), LoadResource::Nodes);
}

/// Two references to the next BSDF in each: 2¹⁵ of them at the end.
#[test]
fn references_that_double_are_refused() {
    let mut body = String::new();
    for i in 0..14 {
        let next = i + 1;
        write!(
            body,
            r#"<bsdf type="blendbsdf" id="b{i}"><float name="weight" value="0.5"/><ref id="b{next}"/><ref id="b{next}"/></bsdf>"#
        )
        .unwrap();
    }
    body += r#"<bsdf type="diffuse" id="b14"/><shape type="sphere"><ref id="b0"/></shape>"#;
    is_over(
        parse_mitsuba_with(&xml(&body), "a.xml", &[], &limit("nodes", 20_000.0)),
        LoadResource::Nodes,
    );
}

/// A triangle that `count` nodes place.
fn placed(count: usize) -> String {
    let nodes = vec![r#"{"mesh":0}"#; count].join(",");
    let indices: Vec<String> = (0..count).map(|i| i.to_string()).collect();
    let mut bytes = Vec::new();
    for number in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend(number.to_le_bytes());
    }
    // Nine numbers that are 0 or 1 in base64.
    let data = bytes
        .chunks(3)
        .map(|three| {
            let word = three
                .iter()
                .fold(0_u32, |word, &byte| (word << 8) | u32::from(byte));
            (0..4)
                .map(|i| {
                    let six = (word >> (18 - 6 * i)) as u8 & 63;
                    let code = match six {
                        0..26 => b'A' + six,
                        26..52 => b'a' + six - 26,
                        52..62 => b'0' + six - 52,
                        62 => b'+',
                        _ => b'/',
                    };
                    char::from(code)
                })
                .collect::<String>()
        })
        .collect::<String>();
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[{}]}}],"nodes":[{nodes}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,{data}"}}]}}"#,
        indices.join(",")
    )
}

/// Each node that places a mesh has its own vertices and triangles.
#[test]
fn meshes_that_many_nodes_place_are_counted_for_each() {
    let text = placed(250);
    let loaded = parse_gltf_with(text.as_bytes(), "a.gltf", &limit("vertices", 1_000.0)).unwrap();
    assert_eq!(loaded.description.shapes.len(), 250);
    let outcome = parse_gltf_with(text.as_bytes(), "a.gltf", &limit("vertices", 999.0));
    says(
        outcome,
        "a.gltf (meshes[0]/primitives[0]): more than 999 vertices and triangles, the limit `vertices`",
    );
    // As instances, the first node and the others have one mesh each.
    let mut few = limit("vertices", 8.0);
    few.copies = 0;
    let loaded = parse_gltf_with(text.as_bytes(), "a.gltf", &few).unwrap();
    let scene = Scene::new(&loaded.description).unwrap();
    assert_eq!((scene.triangle_count(), scene.instance_count()), (1, 249));
}

/// Points on a circle as an OBJ, and as a PLY, of one polygon.
fn polygons(corners: usize) -> [String; 2] {
    let (mut obj, mut vertices) = (String::new(), String::new());
    for i in 0..corners {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / corners as f64).sin_cos();
        writeln!(obj, "v {cos} {sin} 0").unwrap();
        writeln!(vertices, "{cos} {sin} 0").unwrap();
    }
    let list = |first: usize| -> String { (first..first + corners).map(|i| format!(" {i}")).collect() };
    writeln!(obj, "f{}", list(1)).unwrap();
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {corners}\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uint uint vertex_indices\nend_header\n{vertices}{corners}{}\n",
        list(0)
    );
    [obj, ply]
}

/// A polygon of very many corners becomes triangles of which few lie in each other's boxes, so that
/// it can be rendered.
#[test]
fn polygons_of_many_corners_are_no_fans() {
    let corners = 50_000;
    let [obj, ply] = polygons(corners);
    let meshes = [
        parse_obj(obj.as_bytes(), "a.obj").unwrap(),
        parse_ply(ply.as_bytes(), "a.ply").unwrap(),
    ];
    for mesh in meshes {
        assert_eq!(mesh.indices.len(), corners - 2);
        let place = glam::Vec2::new(0.31, 0.17);
        let boxes = mesh.indices.iter().filter(|triangle| {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].truncate());
            a.min(b).min(c).cmple(place).all() && a.max(b).max(c).cmpge(place).all()
        });
        assert!(boxes.count() < 40);
    }
    let folder = folder("polygons");
    for (name, text) in [("a.obj", obj), ("a.ply", ply)] {
        std::fs::write(folder.join(name), text).unwrap();
        is_over(
            load_with(folder.join(name), &[], &limit("vertices", 60_000.0)),
            LoadResource::Vertices,
        );
        is_over(
            load_with(folder.join(name), &[], &limit("bytes", 100_000.0)),
            LoadResource::Bytes,
        );
        is_over(
            load_with(folder.join(name), &[], &limit("seconds", 0.0)),
            LoadResource::Seconds,
        );
    }
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn shape(file: &str) -> String {
    xml(&format!(
        r#"<shape type="obj"><string name="filename" value="{file}"/></shape>"#
    ))
}

/// Names that lead out of the scene's folder, and links that do, are refused; a folder that the
/// caller allows is not.
#[test]
fn files_outside_of_the_folder_are_refused() {
    let outer = folder("outside");
    let inner = outer.join("scene");
    std::fs::create_dir_all(inner.join("meshes")).unwrap();
    std::fs::write(outer.join("secret.obj"), TRIANGLE).unwrap();
    std::fs::write(inner.join("meshes/own.obj"), TRIANGLE).unwrap();
    let secret = outer.join("secret.obj");
    let absolute = secret.to_str().unwrap();
    let mut names = vec!["../secret.obj", "meshes/../../secret.obj", absolute];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.obj", inner.join("link.obj")).unwrap();
        std::os::unix::fs::symlink("..", inner.join("up")).unwrap();
        names.extend(["link.obj", "up/secret.obj"]);
    }
    let allowed = LoadLimits {
        folders: vec![outer.clone()],
        ..LoadLimits::default()
    };
    let path = inner.join("a.xml");
    for name in names {
        let outcome = parse_mitsuba(&shape(name), &path, &[]);
        let refused = error(outcome);
        let is_outside = matches!(refused.innermost(), ImportError::Outside { .. });
        assert!(is_outside, "{name}: {}", refused.chain());
        assert!(
            parse_mitsuba_with(&shape(name), &path, &[], &allowed).is_ok(),
            "{name}"
        );
    }
    for name in ["meshes/own.obj", "meshes/../meshes/own.obj", "./meshes/own.obj"] {
        assert!(parse_mitsuba(&shape(name), &path, &[]).is_ok(), "{name}");
    }
    std::fs::write(outer.join("part.xml"), xml("")).unwrap();
    let include = xml(r#"<include filename="../part.xml"/>"#);
    let refused = error(parse_mitsuba(&include, &path, &[]));
    assert!(
        matches!(refused.innermost(), ImportError::Outside { .. }),
        "{}",
        refused.chain()
    );
    for uri in [
        "../secret.obj",
        "%2e%2e/secret.obj",
        "%2E%2E%2Fsecret.obj",
        absolute,
    ] {
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[]}}],"buffers":[{{"byteLength":4,"uri":"{uri}"}}]}}"#
        );
        let refused = error(parse_gltf(text.as_bytes(), inner.join("a.gltf")));
        assert!(
            matches!(refused.innermost(), ImportError::Outside { .. }),
            "{uri}: {}",
            refused.chain()
        );
        assert!(
            parse_gltf_with(text.as_bytes(), inner.join("a.gltf"), &allowed).is_ok(),
            "{uri}"
        );
    }
}

/// A folder that a `<path>` names is looked in, and no more allowed for that.
#[test]
fn search_paths_find_files_and_allow_none() {
    let outer = folder("search");
    std::fs::create_dir_all(outer.join("scene/parts")).unwrap();
    std::fs::create_dir_all(outer.join("common/meshes")).unwrap();
    std::fs::write(outer.join("common/meshes/tri.obj"), TRIANGLE).unwrap();
    let part = r#"<shape type="obj"><string name="filename" value="meshes/tri.obj"/></shape>"#;
    std::fs::write(outer.join("scene/parts/inner.xml"), xml(part)).unwrap();
    // Beside the scene's own file rather than beside the file that asks.
    std::fs::write(
        outer.join("scene/parts/outer.xml"),
        xml(r#"<include filename="parts/inner.xml"/>"#),
    )
    .unwrap();
    let text = xml(r#"<path value="../common"/><include filename="parts/outer.xml"/>"#);
    let path = outer.join("scene/a.xml");
    let refused = error(parse_mitsuba(&text, &path, &[]));
    assert!(
        matches!(refused.innermost(), ImportError::Outside { .. }),
        "{}",
        refused.chain()
    );
    let allowed = LoadLimits {
        folders: vec![outer.join("common")],
        ..LoadLimits::default()
    };
    let loaded = parse_mitsuba_with(&text, &path, &[], &allowed).unwrap_or_else(|e| panic!("{}", e.chain()));
    assert!(
        matches!(&loaded.description.shapes[0].geometry, Geometry::Mesh(mesh) if mesh.indices.len() == 1)
    );
}

/// Pipes and devices are not waited for, nor read without end.
#[cfg(unix)]
#[test]
fn only_regular_files_are_read() {
    let folder = folder("irregular");
    for name in ["pipe.obj", "pipe.xml"] {
        let made = std::process::Command::new("mkfifo")
            .arg(folder.join(name))
            .status();
        if !made.is_ok_and(|status| status.success()) {
            println!("SKIPPED: mkfifo is missing");
            return;
        }
    }
    let refused = |outcome| {
        let refused = error(outcome);
        assert!(
            matches!(refused.innermost(), ImportError::NotAFile { .. }),
            "{}",
            refused.chain()
        );
    };
    refused(load(folder.join("pipe.xml"), &[]));
    refused(load(folder.join("pipe.obj"), &[]));
    refused(parse_mitsuba(&shape("pipe.obj"), folder.join("a.xml"), &[]));
    std::fs::create_dir(folder.join("folder.obj")).unwrap();
    refused(load(folder.join("folder.obj"), &[]));
    let device = LoadLimits {
        folders: vec!["/dev".into()],
        ..LoadLimits::default()
    };
    if Path::new("/dev/zero").exists() {
        refused(parse_mitsuba_with(
            &shape("/dev/zero"),
            folder.join("a.xml"),
            &[],
            &device,
        ));
    }
}

/// What an image takes in memory is known from its header, and counted before it is decoded.
#[test]
fn images_are_counted_before_they_are_decoded() {
    let folder = folder("images");
    let side = 256;
    let picture = image::DynamicImage::ImageRgb8(image::RgbImage::new(side, side));
    let wide = image::DynamicImage::ImageRgb16(picture.to_rgb16());
    let float = image::DynamicImage::ImageRgb32F(picture.to_rgb32f());
    picture.save(folder.join("a.png")).unwrap();
    wide.save(folder.join("b.png")).unwrap();
    picture.save(folder.join("c.jpg")).unwrap();
    float.save(folder.join("d.hdr")).unwrap();
    exr::prelude::write_rgb_file(folder.join("e.exr"), side as usize, side as usize, |_, _| {
        (0.0_f32, 0.0_f32, 0.0_f32)
    })
    .unwrap();
    // Bytes of a pixel while it is decoded.
    for (name, bytes) in [
        ("a.png", 7),
        ("b.png", 20),
        ("c.jpg", 14),
        ("d.hdr", 12),
        ("e.exr", 24),
    ] {
        let text = xml(&format!(
            r#"<emitter type="envmap"><string name="filename" value="{name}"/></emitter>"#
        ));
        let length = std::fs::metadata(folder.join(name)).unwrap().len();
        let enough = length + u64::from(side * side) * bytes + 4_000;
        let read = |bytes: u64| {
            let limits = limit("bytes", bytes as f64);
            parse_mitsuba_with(&text, folder.join("a.xml"), &[], &limits)
        };
        assert!(read(enough).is_ok(), "{name}: {}", error(read(enough)).chain());
        let refused = error(read(enough - 8_000)).chain();
        assert!(
            refused.contains(name) && refused.contains("an image of 256 × 256 pixels"),
            "{refused}"
        );
    }
}
