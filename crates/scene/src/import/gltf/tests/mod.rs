//! Documents built in code.

mod features;
mod viewers;

use super::*;
use crate::{
    Channel, ColorTexture, EmitterDescription, FloatTexture, Geometry, Material, Projection,
    ShapeDescription, TriangleMesh,
};
use glam::{Vec2, Vec3};
use proptest::prelude::*;

/// Standard base64 with padding.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().fold(0_u32, |w, &b| w << 8 | u32::from(b)) << (8 * (3 - chunk.len()));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= chunk.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

/// A unit square in the plane z = 0: positions at 0, normals at 48, texture coordinates at 96,
/// `u16` indices at 128 of two triangles facing +Z, and as `u8` a strip at 140.
fn square() -> Vec<u8> {
    let mut bytes = Vec::new();
    let corners = [[0.0_f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    for [x, y] in corners {
        bytes.extend([x, y, 0.0].iter().flat_map(|v| v.to_le_bytes()));
    }
    for _ in corners {
        bytes.extend([0.0_f32, 0.0, 1.0].iter().flat_map(|v| v.to_le_bytes()));
    }
    for [u, v] in corners {
        bytes.extend([u, 1.0 - v].iter().flat_map(|v: &f32| v.to_le_bytes()));
    }
    bytes.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    bytes.extend([0_u8, 1, 3, 2]);
    bytes
}

/// A document of the square: `nodes` and further members of the root, separated by commas.
fn document(buffer: &str, nodes: &str, more: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "buffers":[{{"byteLength":144{buffer}}}],
        "bufferViews":[{{"buffer":0,"byteLength":128}},{{"buffer":0,"byteOffset":128,"byteLength":16}}],
        "accessors":[
          {{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
          {{"bufferView":0,"byteOffset":48,"componentType":5126,"count":4,"type":"VEC3"}},
          {{"bufferView":0,"byteOffset":96,"componentType":5126,"count":4,"type":"VEC2"}},
          {{"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}},
          {{"bufferView":1,"byteOffset":12,"componentType":5121,"count":4,"type":"SCALAR"}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":3,"material":0}}]}}],
        "nodes":[{nodes}]{more}}}"#
    )
}

fn embedded(nodes: &str, more: &str) -> String {
    let uri = format!(
        r#","uri":"data:application/octet-stream;base64,{}""#,
        base64(&square())
    );
    document(&uri, nodes, more)
}

const PLAIN: &str = r#","materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,1,1]}}]"#;

fn glb(json: &str, blob: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF".to_vec();
    let total = 12 + 8 + json.len() + 8 + blob.len();
    for word in [2, total as u32, json.len() as u32, 0x4e4f_534a] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(json);
    for word in [blob.len() as u32, 0x004e_4942] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(blob);
    bytes
}

fn read(json: &str) -> Loaded {
    parse_gltf(json.as_bytes(), "dir/s.gltf").unwrap_or_else(|e| panic!("{}", e.chain()))
}

fn message(json: &str) -> String {
    match parse_gltf(json.as_bytes(), "dir/s.gltf") {
        Ok(_) => panic!("accepted: {json}"),
        Err(error) => error.chain(),
    }
}

fn mesh(shape: &ShapeDescription) -> &TriangleMesh {
    match &shape.geometry {
        Geometry::Mesh(mesh) => mesh,
        _ => panic!("{} is no mesh", shape.name),
    }
}

fn normal(mesh: &TriangleMesh, triangle: usize) -> Vec3 {
    let [a, b, c] = mesh.indices[triangle].map(|i| mesh.positions[i as usize]);
    (b - a).cross(c - a)
}

#[test]
fn embedded_and_binary_documents_are_the_same() {
    let nodes = r#"{"mesh":0,"name":"sq"}"#;
    let json = embedded(nodes, PLAIN);
    let binary = glb(&document("", nodes, PLAIN), &square());
    for loaded in [read(&json), parse_gltf(&binary, "s.glb").unwrap()] {
        let scene = &loaded.description;
        assert_eq!(scene.shapes[0].name, "sq.0");
        let mesh = mesh(&scene.shapes[0]);
        assert_eq!(mesh.indices, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!((normal(mesh, 0), normal(mesh, 1)), (Vec3::Z, Vec3::Z));
        assert_eq!(mesh.normals, [Vec3::Z; 4]);
        // The file's v of corner 2 is 0, its top.
        assert_eq!((mesh.uvs[0], mesh.uvs[2]), (Vec2::ZERO, Vec2::ONE));
        match &scene.materials[0] {
            Material::MetallicRoughness {
                base_color: ColorTexture::Constant(rgb),
                metallic,
                ior,
                ..
            } => {
                assert_eq!(*rgb, Rgb::new(0.5, 0.25, 1.0));
                assert!(matches!(metallic, FloatTexture::Constant(1.0)));
                assert_eq!(*ior, 1.5);
            }
            other => panic!("{other:?}"),
        }
        // Neither light nor camera: both are filled in, with a warning each.
        assert!(matches!(scene.emitters[..], [EmitterDescription::Environment(_)]));
        let forward = scene.camera.to_world.matrix3.z_axis;
        let to_middle = Vec3::new(0.5, 0.5, 0.0) - Vec3::from(scene.camera.to_world.translation);
        assert!(to_middle.normalize().dot(forward.into()) > 0.9999);
        assert_eq!(loaded.warnings.len(), 2);
    }
}

#[test]
fn nodes_place_and_mirrors_keep_the_front() {
    // The parent moves, the child scales; a mirrored mesh keeps its front and its normals.
    let nodes =
        |scale: &str| format!(r#"{{"translation":[10,0,0],"children":[1]}},{{"mesh":0,"scale":{scale}}}"#);
    let placed = read(&embedded(&nodes("[2,3,1]"), PLAIN));
    let square = mesh(&placed.description.shapes[0]);
    assert_eq!(square.positions[2], Vec3::new(12.0, 3.0, 0.0));
    assert_eq!(normal(square, 0), Vec3::Z * 6.0);
    for (scale, front) in [
        ("[-1,1,1]", Vec3::Z),
        ("[1,1,-1]", Vec3::NEG_Z),
        ("[-1,-1,1]", Vec3::Z),
    ] {
        let mirrored = read(&embedded(&nodes(scale), PLAIN));
        let square = mesh(&mirrored.description.shapes[0]);
        assert_eq!(normal(square, 1), front, "{scale}");
        assert_eq!(square.normals[0], front, "{scale}");
    }
    // A matrix, column by column: a quarter turn about +X and a shift.
    let turned = read(&embedded(
        r#"{"mesh":0,"matrix":[1,0,0,0, 0,0,1,0, 0,-1,0,0, 5,6,7,1]}"#,
        PLAIN,
    ));
    let square = mesh(&turned.description.shapes[0]);
    assert_eq!(square.positions[2], Vec3::new(6.0, 6.0, 8.0));
    assert_eq!(normal(square, 0), Vec3::NEG_Y);
}

#[test]
fn strips_fans_and_lists_without_indices() {
    let with = |primitive: &str| {
        let json = embedded(r#"{"mesh":0}"#, PLAIN);
        let from = r#""indices":3,"material":0"#;
        assert!(json.contains(from));
        read(&json.replace(from, primitive))
    };
    let strip = with(r#""indices":4,"mode":5"#);
    let square = mesh(&strip.description.shapes[0]);
    assert_eq!((normal(square, 0), normal(square, 1)), (Vec3::Z, Vec3::Z));
    let fan = with(r#""mode":6"#);
    let square = mesh(&fan.description.shapes[0]);
    assert_eq!(square.indices, [[1, 2, 0], [2, 3, 0]]);
    let list = with(r#""mode":4"#);
    assert_eq!(mesh(&list.description.shapes[0]).indices, [[0, 1, 2]]);
    // Four octahedra about the corners; a closed line of four sides.
    let points = with(r#""mode":0"#);
    let marks = mesh(&points.description.shapes[0]);
    assert_eq!((marks.indices.len(), marks.positions.len()), (32, 24));
    let center: Vec3 = marks.positions[6..12].iter().sum();
    assert!((center / 6.0).abs_diff_eq(Vec3::X, 1e-6));
    assert!(points.warnings[0].message.contains("points and lines"));
    for (mode, segments) in [(1, 2), (2, 4), (3, 3)] {
        let lines = with(&format!(r#""mode":{mode}"#));
        assert_eq!(
            mesh(&lines.description.shapes[0]).indices.len(),
            8 * segments,
            "{mode}"
        );
    }
}

#[test]
fn sparse_accessors_replace_items() {
    // Item 2 of the positions becomes item 0 of the normals, (0, 0, 1): the index is the third of
    // the `u16` indices.
    let json = embedded(r#"{"mesh":0}"#, PLAIN).replacen(
        r#""type":"VEC3","min""#,
        r#""type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"byteOffset":4,"componentType":5123},
           "values":{"bufferView":0,"byteOffset":48}},"min""#,
        1,
    );
    let loaded = read(&json);
    assert_eq!(mesh(&loaded.description.shapes[0]).positions[2], Vec3::Z);
    assert_eq!(mesh(&loaded.description.shapes[0]).positions[3], Vec3::Y);
}

/// A PNG of 2 × 1 pixels.
fn png(left: [u8; 3], right: [u8; 3]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut buffer = image::RgbImage::new(2, 1);
    buffer.put_pixel(0, 0, image::Rgb(left));
    buffer.put_pixel(1, 0, image::Rgb(right));
    let mut cursor = std::io::Cursor::new(&mut bytes);
    buffer.write_to(&mut cursor, image::ImageFormat::Png).unwrap();
    bytes
}

#[test]
fn textures_are_decoded_for_what_they_hold() {
    let image = base64(&png([188, 51, 102], [0, 0, 0]));
    let more = format!(
        r#","images":[{{"uri":"data:image/png;base64,{image}"}}],"samplers":[{{"magFilter":9728,"wrapS":33071,"wrapT":33071}}],
        "textures":[{{"source":0,"sampler":0}}],"extensionsUsed":["KHR_materials_transmission","KHR_materials_emissive_strength","KHR_texture_transform"],
        "materials":[{{"doubleSided":true,"emissiveFactor":[1,0,0.5],"emissiveTexture":{{"index":0}},
          "extensions":{{"KHR_materials_emissive_strength":{{"emissiveStrength":8}}}},
          "pbrMetallicRoughness":{{"roughnessFactor":0.5,
            "baseColorTexture":{{"index":0,"extensions":{{"KHR_texture_transform":{{"offset":[0.5,0],"rotation":1.5707963,"scale":[2,3]}}}}}},
            "metallicRoughnessTexture":{{"index":0}}}}}}]"#
    );
    let loaded = read(&embedded(r#"{"mesh":0}"#, &more));
    let scene = &loaded.description;
    let Material::TwoSided { front, back: None } = &scene.materials[0] else {
        panic!("{:?}", scene.materials[0])
    };
    let Material::MetallicRoughness {
        base_color: ColorTexture::Image(base),
        metallic: FloatTexture::Image(metallic, Channel::Blue),
        roughness: FloatTexture::Image(roughness, Channel::Green),
        ..
    } = &**front
    else {
        panic!("{front:?}")
    };
    // Colours are sRGB, the others linear.
    assert!((base.image.texel(0, 0).x - 0.502_886_5).abs() < 1e-6);
    assert_eq!(metallic.image.texel(0, 0), Rgb::new(188.0 / 255.0, 0.2, 0.4));
    assert_eq!((metallic.scale.z, roughness.scale.y), (1.0, 0.5));
    assert_eq!(
        (base.filter, base.wrap),
        (crate::Filter::Nearest, crate::Wrap::Clamp)
    );
    // KHR_texture_transform turns counter-clockwise with v downwards: (u, v) goes to (v, −u),
    // after the scale.
    let moved = base.to_uv.transform_point2(Vec2::new(1.0, 10.0));
    assert!(moved.abs_diff_eq(Vec2::new(30.5, -2.0), 1e-4), "{moved}");
    // Emission is factor times strength, and the texture by triangle: its left half is 0.5029 red.
    assert_eq!(scene.shapes[0].emission, Some(Rgb::new(8.0, 0.0, 4.0)));
    let square = mesh(&scene.shapes[0]);
    let areas = (0..square.indices.len()).map(|triangle| 0.5 * normal(square, triangle).length());
    let (mut flux, mut area) = (Rgb::ZERO, 0.0);
    for (share, glow) in areas.zip(&square.glow) {
        flux += share * *glow;
        area += share;
    }
    assert!((area - 1.0).abs() < 1e-4, "{area}");
    assert!((flux.x - 0.251_443).abs() < 0.01, "{flux}");
    assert!(scene.emitters.is_empty());
    let warnings: Vec<_> = loaded.warnings.iter().map(|w| w.message.as_str()).collect();
    assert!(
        warnings.iter().any(|w| w.contains("from its front only")),
        "{warnings:?}"
    );
}

#[test]
fn transmissive_materials_are_not_wrapped() {
    let more = r#","materials":[{"doubleSided":true,"extensions":{"KHR_materials_transmission":{"transmissionFactor":0.75},
        "KHR_materials_ior":{"ior":1.25}}}],"extensionsUsed":["KHR_materials_transmission","KHR_materials_ior"]"#;
    match &read(&embedded(r#"{"mesh":0}"#, more)).description.materials[0] {
        Material::MetallicRoughness {
            transmission: FloatTexture::Constant(t),
            ior,
            ..
        } => {
            assert_eq!((*t, *ior), (0.75, 1.25));
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn cameras_look_along_minus_z() {
    let nodes =
        r#"{"children":[1,2,3]},{"mesh":0},{"camera":0,"translation":[1,2,3],"scale":[2,2,2]},{"camera":0}"#;
    let more = format!(
        r#"{PLAIN},"cameras":[{{"type":"perspective","perspective":{{"yfov":1.5707964,"aspectRatio":2,"znear":0.25}}}}]"#
    );
    let loaded = read(&embedded(nodes, &more));
    let (camera, settings) = (&loaded.description.camera, &loaded.description.settings);
    assert_eq!((settings.width, settings.height), (1024, 512));
    // 90° high, twice as wide.
    assert!(((0.5 * camera.fov_x).tan() - 2.0).abs() < 1e-5);
    assert_eq!(Vec3::from(camera.to_world.translation), Vec3::new(1.0, 2.0, 3.0));
    let axes = [
        camera.to_world.matrix3.x_axis,
        camera.to_world.matrix3.y_axis,
        camera.to_world.matrix3.z_axis,
    ];
    assert_eq!(axes.map(Vec3::from), [Vec3::NEG_X, Vec3::Y, Vec3::NEG_Z]);
    assert_eq!(
        (camera.near_clip, camera.far_clip, camera.projection),
        (0.25, f32::INFINITY, Projection::Pinhole)
    );
    assert!(loaded.warnings[0].message.contains("only the first camera"));
}

#[test]
fn punctual_lights() {
    let lights = r#","extensionsUsed":["KHR_lights_punctual"],"extensions":{"KHR_lights_punctual":{"lights":[
        {"type":"point","color":[1,0.5,0],"intensity":4},{"type":"directional","intensity":3},
        {"type":"spot","spot":{"innerConeAngle":0.25,"outerConeAngle":0.5}}]}}"#;
    let light = |index: u32, more: &str| {
        format!(r#"{{"extensions":{{"KHR_lights_punctual":{{"light":{index}}}}}{more}}}"#)
    };
    let nodes = [
        r#"{"children":[1,2,3,4]}"#.to_owned(),
        r#"{"mesh":0}"#.to_owned(),
        light(0, r#","translation":[0,5,0]"#),
        // A quarter turn about −X takes −Z to −Y.
        light(1, r#","rotation":[-0.70710678,0,0,0.70710678]"#),
        light(2, ""),
    ];
    let scene = read(&embedded(&nodes.join(","), &format!("{PLAIN}{lights}"))).description;
    match scene.emitters[..] {
        [
            EmitterDescription::Point { position, intensity },
            EmitterDescription::Directional {
                direction,
                irradiance,
            },
            EmitterDescription::Spot {
                direction: axis,
                beam_width,
                cutoff_angle,
                ..
            },
            // They reach nothing that the camera sees.
            EmitterDescription::Environment(_),
        ] => {
            assert_eq!((position, intensity), (Vec3::Y * 5.0, Rgb::new(4.0, 2.0, 0.0)));
            assert!(direction.abs_diff_eq(Vec3::NEG_Y, 1e-6), "{direction}");
            assert_eq!((irradiance, axis), (Rgb::splat(3.0), Vec3::NEG_Z));
            assert_eq!((beam_width, cutoff_angle), (0.25, 0.5));
        }
        ref other => panic!("{other:?}"),
    }
}

/// What is wrong with one attribute or node costs no more than that.
#[test]
fn what_is_broken_is_left_out() {
    let good = embedded(r#"{"mesh":0}"#, PLAIN);
    let cases = [
        (
            r#""count":4,"type":"VEC2""#,
            r#""count":3,"type":"VEC2""#,
            "3 of TEXCOORD_0 for 4 of POSITION",
        ),
        (
            r#""type":"VEC2""#,
            r#""type":"VEC3""#,
            "accessor 2 has the wrong dimensions",
        ),
        (
            r#"{"mesh":0}"#,
            r#"{"mesh":0,"children":[0]}"#,
            "(nodes[0]): left out: the node is reached twice",
        ),
        (
            r#"{"mesh":0}"#,
            r#"{"mesh":0,"children":[1]},{"mesh":0,"matrix":[1e39,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}"#,
            "(nodes[1]): left out: the transform is not finite",
        ),
        (
            r#""asset":{"version":"2.0"},"#,
            r#""extras":{"name":[1]},"#,
            "(asset): the version of glTF is missing",
        ),
        (
            r#"{"mesh":0}"#,
            r#"{"mesh":0,"name":5,"children":[0]}"#,
            "(nodes[0]): left out",
        ),
        (
            r#""indices":3,"material":0}"#,
            r#""indices":3,"material":0},{"attributes":{"POSITION":0},"indices":0}"#,
            "(meshes[0]/primitives[1]): left out: accessor 0 is no list",
        ),
    ];
    for (from, to, expected) in cases {
        let loaded = read(&good.replacen(from, to, 1));
        assert_eq!(loaded.description.shapes.len(), 1, "{to}");
        let Geometry::Mesh(mesh) = &loaded.description.shapes[0].geometry else {
            panic!("{to}");
        };
        assert_eq!((mesh.positions.len(), mesh.normals.len()), (4, 4));
        assert_eq!(mesh.uvs.len(), if to.contains("VEC") { 0 } else { 4 }, "{to}");
        let warnings: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
        assert!(
            warnings.iter().any(|warning| warning.contains(expected)),
            "{to}: {warnings:?}"
        );
    }
}

/// The square, compressed by Draco: attributes by their numbers, and data that are broken.
#[test]
fn meshes_compressed_by_draco_are_read() {
    let data = include_bytes!("../../draco/tests/low.drc");
    let file = |data: &[u8], attributes: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
            "extensionsRequired":["KHR_draco_mesh_compression"],
            "extensionsUsed":["KHR_draco_mesh_compression"],
            "buffers":[{{"byteLength":{},"uri":"data:;base64,{}"}}],
            "bufferViews":[{{"buffer":0,"byteLength":{}}}],
            "accessors":[
              {{"componentType":5126,"count":48,"type":"VEC3","min":[0,0,0],"max":[6,5,3]}},
              {{"componentType":5126,"count":48,"type":"VEC3"}},
              {{"componentType":5126,"count":48,"type":"VEC2"}},
              {{"componentType":5121,"normalized":true,"count":48,"type":"VEC4"}},
              {{"componentType":5125,"count":174,"type":"SCALAR"}}],
            "meshes":[{{"primitives":[{{
              "attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2,"COLOR_0":3}},"indices":4,
              "extensions":{{"KHR_draco_mesh_compression":{{"bufferView":0,"attributes":{attributes}}}}}}}]}}],
            "nodes":[{{"mesh":0}}]}}"#,
            data.len(),
            base64(data),
            data.len()
        )
    };
    let numbers = r#"{"POSITION":3,"NORMAL":2,"TEXCOORD_0":1,"COLOR_0":0}"#;
    let loaded = read(&file(data, numbers));
    let Geometry::Mesh(mesh) = &loaded.description.shapes[0].geometry else {
        panic!();
    };
    assert_eq!(mesh.indices.len(), 58);
    for (position, color) in mesh.positions.iter().zip(&mesh.colors) {
        let [x, y] = [position.x, position.y].map(f32::round);
        assert!(color.abs_diff_eq(Rgb::new(x, y, x * y % 4.0) * (10.0 / 255.0), 1e-6));
        assert_eq!(position.z.round(), x * y % 4.0);
    }
    assert_eq!((mesh.normals.len(), mesh.uvs.len()), (48, 48));
    let of_draco = |warning: &Warning| warning.to_string().contains("raco");
    assert!(!loaded.warnings.iter().any(of_draco), "{:?}", loaded.warnings);

    // A number that the mesh does not have: that attribute is left out.
    let loaded = read(&file(data, &numbers.replace(":2", ":7")));
    assert!(
        loaded
            .warnings
            .iter()
            .any(|w| w.to_string().contains("has no attribute 7"))
    );
    // A mesh that is cut short, alone in its file.
    let found = message(&file(&data[..100], numbers));
    assert!(
        found.contains("(meshes[0]/primitives[0]): a mesh compressed by Draco: "),
        "{found}"
    );
}

#[test]
fn everything_wrong_is_named() {
    let good = embedded(r#"{"mesh":0}"#, PLAIN);
    let cases = [
        (
            r#""byteLength":144,"#,
            r#""byteLength":145,"#,
            "(buffers[0]): 144 bytes where 145 are announced",
        ),
        (
            r#""byteLength":128}"#,
            r#""byteLength":999}"#,
            "(meshes[0]/primitives[0]): buffer view 0 reaches beyond",
        ),
        (
            r#""count":6"#,
            r#""count":60"#,
            "60 items reach beyond buffer view 1",
        ),
        (
            r#""componentType":5123,"count":6"#,
            r#""componentType":5126,"count":3"#,
            "no list of unsigned integers",
        ),
        (
            r#""POSITION":0"#,
            r#""POSITION":9"#,
            "(meshes[0]/primitives[0]): attribute refers to accessor 9 of 5",
        ),
        (r#"[0]}],"#, r#"[7]}],"#, "cannot decode"),
        (
            "data:application/octet-stream;base64,AA",
            "data:;base64,?A",
            "(buffers[0]): a data URI",
        ),
        (
            "data:application/octet-stream;base64,AA",
            "https://x.org/AA",
            "is not a file beside the scene",
        ),
        (
            "data:application/octet-stream;base64,AA",
            "no%20file%ff",
            "is not a valid URI",
        ),
        (
            r#""version":"2.0""#,
            r#""version":"1.0""#,
            "glTF version 1.0 is not supported",
        ),
    ];
    for (from, to, expected) in cases {
        assert!(good.contains(from), "{from}");
        let bad = good.replacen(from, to, 1);
        let found = message(&bad);
        assert!(found.contains(expected), "{to}: {found:?} lacks {expected:?}");
    }
    let external = document(r#","uri":"no%20file.bin""#, r#"{"mesh":0}"#, PLAIN);
    assert!(message(&external).contains("cannot read dir/no file.bin"));
    let required = embedded(
        r#"{"mesh":0}"#,
        &format!(r#"{PLAIN},"extensionsRequired":["VENDOR_something"]"#),
    );
    assert!(
        read(&required).warnings[0]
            .message
            .contains("requires the extension VENDOR_something")
    );
    let optional = embedded(
        r#"{"mesh":0}"#,
        &format!(r#"{PLAIN},"extensionsUsed":["EXT_meshopt"]"#),
    );
    assert!(
        read(&optional).warnings[0]
            .message
            .contains("EXT_meshopt is not supported")
    );
    let infinite = embedded(r#"{"mesh":0,"scale":[1e38,1,1]},{"mesh":0}"#, PLAIN);
    assert!(parse_gltf(infinite.as_bytes(), "s.gltf").is_ok());
    assert!(message("{").contains("cannot decode"));
    let spot = format!(
        r#"{PLAIN},"extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot"}}]}}}},"extensionsUsed":["KHR_lights_punctual"]"#
    );
    assert!(
        message(&embedded(r#"{"mesh":0}"#, &spot)).contains("lights[0]): the light lacks the member `spot`")
    );
    let camera = format!(r#"{PLAIN},"cameras":[{{"type":"perspective"}}]"#);
    assert!(message(&embedded(r#"{"mesh":0}"#, &camera)).contains("(cameras[0]): the camera lacks"));
    let image = format!(r#"{PLAIN},"images":[{{"bufferView":0}}],"textures":[{{"source":0}}]"#)
        .replace("1]}", r#"1],"baseColorTexture":{"index":0}}"#);
    let warnings = read(&embedded(r#"{"mesh":0}"#, &image)).warnings;
    assert!(
        warnings[0].to_string().contains("(images[0]): white"),
        "{warnings:?}"
    );

    let binary = glb(&document("", r#"{"mesh":0}"#, PLAIN), &square());
    for (at, new, expected) in [
        (4, 3, "s.glb, byte 4: GLB version 3"),
        (11, 9, "s.glb, byte 8: "),
        (15, 9, "byte 12: a chunk of"),
        (16, 0, "byte 16: expected a chunk of type JSON"),
    ] {
        let mut bad = binary.clone();
        bad[at] = new;
        let found = parse_gltf(&bad, "s.glb").unwrap_err().chain();
        assert!(found.contains(expected), "{found}");
    }
}

#[test]
fn every_proper_prefix_is_an_error() {
    let json = embedded(r#"{"mesh":0}"#, PLAIN);
    for end in 0..json.len() {
        assert!(
            parse_gltf(&json.as_bytes()[..end], "s.gltf").is_err(),
            "prefix of {end} bytes"
        );
    }
    let binary = glb(&document("", r#"{"mesh":0}"#, PLAIN), &square());
    assert!(parse_gltf(&binary, "s.glb").is_ok());
    for end in 0..binary.len() {
        assert!(
            parse_gltf(&binary[..end], "s.glb").is_err(),
            "prefix of {end} bytes"
        );
    }
}

proptest! {
    #[test]
    fn damaged_documents_never_panic(
        cuts in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..5)
    ) {
        let nodes = r#"{"mesh":0,"children":[1]},{"camera":0,"extensions":{"KHR_lights_punctual":{"light":0}}}"#;
        let image = base64(&png([1, 2, 3], [4, 5, 6]));
        let more = format!(
            r#","materials":[{{"emissiveFactor":[1,0,1],"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
            "images":[{{"uri":"data:image/png;base64,{image}"}}],"textures":[{{"source":0}}],
            "cameras":[{{"type":"perspective","perspective":{{"yfov":1,"znear":1}}}}],
            "extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot","spot":{{"outerConeAngle":0.5}}}}]}}}}"#
        );
        let mut bytes = glb(&document("", nodes, &more), &square());
        for (at, new) in cuts {
            let at = at.index(bytes.len());
            bytes[at] = new;
        }
        if let Ok(loaded) = parse_gltf(&bytes, "no/such/folder/s.glb") {
            for shape in &loaded.description.shapes {
                let mesh = mesh(shape);
                let count = mesh.positions.len() as u32;
                prop_assert!(mesh.indices.iter().flatten().all(|&i| i < count));
                prop_assert!(mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite()));
            }
        }
    }

    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(parse_gltf(&bytes, "s.glb").is_err());
    }
}

/// What is legal and was refused: custom attributes, scenes without nodes, files without scenes,
/// animations, extensions of materials that are required, specular-glossiness.
#[test]
fn legal_files_are_mended() {
    let good = embedded(r#"{"mesh":0}"#, PLAIN);
    let shapes = |text: &str| read(text).description.shapes.len();
    assert_eq!(shapes(&good), 1);
    let custom = good.replacen(
        r#""POSITION":"#,
        r#""_BARYCENTRIC":0,"FEATURE_ID_0":0,"POSITION":"#,
        1,
    );
    assert_ne!(custom, good);
    assert_eq!(shapes(&custom), 1);
    let without = good.replacen(r#""scene":0,"scenes":[{"nodes":[0]}],"#, "", 1);
    assert_ne!(without, good);
    assert_eq!(shapes(&without), 1);
    let empty = good.replacen(r#"{"nodes":[0]}"#, "{}", 1);
    assert_eq!(shapes(&empty), 0);
    let more = |text: &str| embedded(r#"{"mesh":0}"#, &format!("{PLAIN},{text}"));
    assert_eq!(
        shapes(&more(
            r#""extensionsRequired":["KHR_materials_sheen","KHR_mesh_quantization"]"#
        )),
        1
    );
    let pointer = r#""animations":[{"channels":[{"sampler":0,"target":{"path":"pointer"}}],"samplers":[{"input":0,"output":0}]}]"#;
    let animated = read(&more(pointer));
    assert!(animated.warnings.iter().any(|w| w.message.contains("animations")));
}
