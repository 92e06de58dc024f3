//! Files on disk: every format by its extension, images of every kind, includes, and what is said
//! of broken ones.

use lightshed_scene::import::{Encoding, ImportError, load, parse_image, parse_mitsuba, read_image};
use lightshed_scene::{DensityDescription, Geometry, Material, Rgb, Scene, builtin};
use std::path::PathBuf;

/// A fresh folder for one test.
fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

const TRIANGLE_OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const TRIANGLE_PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

#[test]
fn built_in_scenes_are_valid() {
    for name in builtin::NAMES {
        let description = builtin::by_name(name).unwrap();
        if let Err(error) = Scene::new(&description) {
            panic!("{name}: {error}");
        }
    }
}

#[test]
fn lone_meshes_get_light_and_a_view() {
    let folder = folder("lone_meshes");
    for (name, text) in [("tri.obj", TRIANGLE_OBJ), ("tri.PLY", TRIANGLE_PLY)] {
        std::fs::write(folder.join(name), text).unwrap();
        let loaded = load(folder.join(name), &[]).unwrap();
        let scene = &loaded.description;
        let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else {
            panic!("{name} is no mesh")
        };
        assert_eq!(
            (mesh.indices.len(), mesh.normals.len(), scene.emitters.len()),
            (1, 3, 1)
        );
        assert_eq!(loaded.warnings.len(), 1);
        // Every vertex is inside the picture's cone, and between the clipping planes.
        let inverse = scene.camera.to_world.inverse();
        for &position in &mesh.positions {
            let local = inverse.transform_point3(position);
            assert!(local.z > scene.camera.near_clip && local.z < scene.camera.far_clip);
            let limit = (0.5 * scene.camera.fov_x).tan() * local.z;
            assert!(local.x.abs() < limit && local.y.abs() < limit, "{name}: {local}");
        }
        assert!(Scene::new(scene).is_ok());
    }
}

#[test]
fn unknown_and_missing_files_are_named() {
    let folder = folder("unknown_files");
    let said = |name: &str| load(folder.join(name), &[]).unwrap_err().chain();
    assert!(
        said("scene.blend")
            .contains("unknown file extension, expected one of xml, gltf, glb, pbrt, ply, obj")
    );
    assert!(said("scene").contains("unknown file extension"));
    for name in ["no.xml", "no.gltf", "no.glb", "no.ply", "no.obj"] {
        let message = said(name);
        assert!(
            message.contains(&format!("cannot read {}", folder.join(name).display())),
            "{message}"
        );
    }
    let define = [("n".to_owned(), "1".to_owned())];
    std::fs::write(folder.join("tri.obj"), TRIANGLE_OBJ).unwrap();
    let error = load(folder.join("tri.obj"), &define).unwrap_err();
    assert!(matches!(error, ImportError::UnusedDefine { .. }), "{error}");
}

#[test]
fn includes_and_references_resolve_beside_their_file() {
    let folder = folder("includes");
    std::fs::create_dir_all(folder.join("parts/meshes")).unwrap();
    std::fs::write(folder.join("parts/meshes/tri.obj"), TRIANGLE_OBJ).unwrap();
    let part = r#"<scene version="3.0.0"><default name="mesh" value="tri"/>
        <shape type="obj"><string name="filename" value="meshes/$mesh.obj"/><ref id="grey"/></shape></scene>"#;
    std::fs::write(folder.join("parts/part.xml"), part).unwrap();
    let main = r#"<scene version="3.0.0"><include filename="parts/part.xml"/><bsdf type="diffuse" id="grey"/></scene>"#;
    std::fs::write(folder.join("main.xml"), main).unwrap();
    assert_eq!(
        load(folder.join("main.xml"), &[])
            .unwrap()
            .description
            .shapes
            .len(),
        1
    );
    // A chain of causes: the shape, the mesh, the operating system.
    let define = [("mesh".to_owned(), "other".to_owned())];
    let message = load(folder.join("main.xml"), &define).unwrap_err().chain();
    assert!(message.contains("part.xml:2 (scene/shape)"), "{message}");
    assert!(
        message.contains("cannot read") && message.contains("other.obj: "),
        "{message}"
    );
    // A broken mesh is named with its own place.
    std::fs::write(folder.join("parts/meshes/other.obj"), "v 0 0 0\nf 1 2 3\n").unwrap();
    let message = load(folder.join("main.xml"), &define).unwrap_err().chain();
    assert!(
        message.contains("other.obj:2: `2`: index 2 of 1 positions"),
        "{message}"
    );
    // Without end.
    std::fs::write(
        folder.join("loop.xml"),
        r#"<scene version="3.0.0"><include filename="loop.xml"/></scene>"#,
    )
    .unwrap();
    let message = load(folder.join("loop.xml"), &[]).unwrap_err().chain();
    assert!(
        message.ends_with("files include each other without end"),
        "{message}"
    );
}

/// A 3 × 2 picture in every format: red, green, blue; black, grey, white.
fn picture() -> image::RgbImage {
    let rows = [
        [[255, 0, 0], [0, 255, 0], [0, 0, 255]],
        [[0; 3], [188; 3], [255; 3]],
    ];
    image::RgbImage::from_fn(3, 2, |x, y| image::Rgb(rows[y as usize][x as usize]))
}

fn encode(picture: &image::DynamicImage, format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn exr_bytes(gray_only: bool) -> Vec<u8> {
    use exr::prelude::*;
    let values = [0.5_f32, 1e4, 0.0, 2.0, 3.0, 4.0];
    let names = if gray_only { &["Y"][..] } else { &["B", "G", "R"] };
    let channel = |name: &&str| {
        let factor = if *name == "G" { 2.0 } else { 1.0 };
        let samples = values.iter().map(|v| v * factor).collect();
        AnyChannel::new(*name, FlatSamples::F32(samples))
    };
    let channels = AnyChannels::sort(names.iter().map(channel).collect());
    let layer = Layer::new(
        (3, 2),
        LayerAttributes::default(),
        Encoding::FAST_LOSSLESS,
        channels,
    );
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .unwrap();
    bytes.into_inner()
}

/// Name, contents.
fn images() -> Vec<(&'static str, Vec<u8>)> {
    use image::{DynamicImage, ImageFormat};
    let rgb8 = DynamicImage::ImageRgb8(picture());
    let float = DynamicImage::ImageRgb32F(rgb8.to_rgb32f());
    vec![
        ("a.png", encode(&rgb8, ImageFormat::Png)),
        (
            "b.png",
            encode(&DynamicImage::ImageRgb16(rgb8.to_rgb16()), ImageFormat::Png),
        ),
        (
            "c.png",
            encode(&DynamicImage::ImageRgba8(rgb8.to_rgba8()), ImageFormat::Png),
        ),
        (
            "d.png",
            encode(&DynamicImage::ImageLuma8(rgb8.to_luma8()), ImageFormat::Png),
        ),
        ("e.jpg", encode(&rgb8, ImageFormat::Jpeg)),
        ("f.hdr", encode(&float, ImageFormat::Hdr)),
        ("g.exr", exr_bytes(false)),
        ("h.exr", exr_bytes(true)),
    ]
}

#[test]
fn images_are_decoded_to_linear() {
    let folder = folder("images");
    for (name, bytes) in images() {
        std::fs::write(folder.join(name), bytes).unwrap();
    }
    let texel = |name: &str, encoding, x, y| {
        let image = read_image(folder.join(name), encoding).unwrap();
        assert_eq!((image.width(), image.height()), (3, 2), "{name}");
        image.texel(x, y).to_array()
    };
    // Row 0 is at the top: its third pixel is blue.
    for name in ["a.png", "b.png", "c.png", "f.hdr"] {
        assert_eq!(texel(name, Encoding::Srgb, 2, 0), [0.0, 0.0, 1.0], "{name}");
    }
    // Code 188 is 0.5029 in sRGB and 0.737 as it stands; floats are linear either way.
    for name in ["a.png", "b.png", "c.png", "d.png", "e.jpg"] {
        let tolerance = if name == "e.jpg" { 0.2 } else { 1e-6 };
        let [srgb, ..] = texel(name, Encoding::Srgb, 1, 1);
        let [linear, ..] = texel(name, Encoding::Linear, 1, 1);
        assert!((srgb - 0.502_886_5).abs() < tolerance, "{name}: {srgb}");
        assert!((linear - 188.0 / 255.0).abs() < tolerance, "{name}: {linear}");
    }
    assert!((texel("f.hdr", Encoding::Srgb, 1, 1)[0] - 188.0 / 255.0).abs() < 0.01);
    assert_eq!(texel("g.exr", Encoding::Srgb, 1, 0), [1e4, 2e4, 1e4]);
    assert_eq!(texel("h.exr", Encoding::Srgb, 2, 1), [4.0; 3]);
    let unknown = read_image(folder.join("a.gif"), Encoding::Srgb)
        .unwrap_err()
        .to_string();
    assert!(
        unknown.contains("expected one of png, jpg, jpeg, bmp, hdr, exr"),
        "{unknown}"
    );
}

/// Eight and sixteen bits, grey, colours, alpha, JPEG and HDR have the bits that the crate `image`
/// decodes.
#[test]
fn images_have_the_bits_of_another_decoder() {
    let noise = |x: u32, y: u32| {
        let hash = (x * 7919 + y * 104_729 + 1).wrapping_mul(2_654_435_761);
        image::Rgba(hash.to_le_bytes())
    };
    let rgba = image::DynamicImage::ImageRgba8(image::RgbaImage::from_fn(37, 23, noise));
    // Sixteen bits whose low bytes are not a copy of the high ones.
    let mut wide = rgba.to_rgba16();
    wide.iter_mut()
        .enumerate()
        .for_each(|(i, word)| *word ^= i as u16 & 0xff);
    let wide = image::DynamicImage::ImageRgba16(wide);
    let (rgb, alpha) = (rgba.to_rgb8(), rgba.to_luma_alpha8());
    use image::DynamicImage as Any;
    let all = [
        ("rgba8.png", rgba.clone()),
        ("rgb8.png", Any::ImageRgb8(rgb.clone())),
        ("grey8.png", Any::ImageLuma8(rgba.to_luma8())),
        ("grey-alpha8.png", Any::ImageLumaA8(alpha)),
        ("rgba16.png", wide.clone()),
        ("rgb16.png", Any::ImageRgb16(wide.to_rgb16())),
        ("grey16.png", Any::ImageLuma16(wide.to_luma16())),
        ("grey-alpha16.png", Any::ImageLumaA16(wide.to_luma_alpha16())),
        ("rgb.jpg", Any::ImageRgb8(rgb.clone())),
        ("grey.jpg", Any::ImageLuma8(rgba.to_luma8())),
        ("rgb.hdr", Any::ImageRgb32F(Any::ImageRgb8(rgb).to_rgb32f())),
    ];
    for (name, picture) in all {
        let format = image::ImageFormat::from_path(name).unwrap();
        let bytes = encode(&picture, format);
        let ours = parse_image(&bytes, name, Encoding::Linear).unwrap();
        let theirs = image::load_from_memory_with_format(&bytes, format).unwrap();
        let (codes, words, floats) = (theirs.to_rgb8(), theirs.to_rgb16(), theirs.to_rgb32f());
        for (x, y) in (0..23).flat_map(|y| (0..37).map(move |x| (x, y))) {
            let expected = if name.ends_with("hdr") {
                floats.get_pixel(x, y).0
            } else if name.contains("16") {
                words.get_pixel(x, y).0.map(|word| f32::from(word) / 65535.0)
            } else {
                codes.get_pixel(x, y).0.map(|code| f32::from(code) / 255.0)
            };
            let found = ours.texel(x, y).to_array();
            assert_eq!(found, expected, "{name}: {x}, {y}");
        }
    }
}

/// Truncated and overwritten images give an error or an image, never a panic.
#[test]
fn damaged_images_never_panic() {
    for (name, bytes) in images() {
        let read = |bytes: &[u8]| parse_image(bytes, name, Encoding::Srgb);
        assert!(read(&[]).is_err() && read(&bytes).is_ok(), "{name}");
        for end in 0..bytes.len() {
            // What is left of JPEG and HDR may still be decodable; of a half file of the others
            // nothing is.
            let outcome = read(&bytes[..end]);
            assert!(
                outcome.is_err() || end > bytes.len() / 2 || name == "f.hdr",
                "{name}: {end} of {}",
                bytes.len()
            );
        }
        for at in 0..bytes.len() {
            for change in [1, 0x80, 0xff] {
                let mut damaged = bytes.clone();
                damaged[at] ^= change;
                if let Ok(image) = read(&damaged) {
                    assert!(image.texels().all(|t| t.is_finite()), "{name}: byte {at}");
                }
            }
        }
    }
}

/// Mitsuba turns the texture coordinates of OBJ over by default and those of PLY not; the published
/// `v` points upwards, which is Mitsuba's turned over. Meshes without normals are smooth unless
/// they are told not to be.
#[test]
fn texture_coordinates_and_normals_follow_mitsubas_defaults() {
    let folder = folder("defaults");
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0.25\nf 1/1 2/1 3/1\n";
    let ply = TRIANGLE_PLY
        .replace("float z\n", "float z\nproperty float u\nproperty float v\n")
        .replace(
            "0 0 0\n1 0 0\n0 1 0\n",
            "0 0 0 0 0.25\n1 0 0 0 0.25\n0 1 0 0 0.25\n",
        );
    std::fs::write(folder.join("m.obj"), obj).unwrap();
    std::fs::write(folder.join("m.ply"), ply).unwrap();
    let mesh = |kind: &str, extra: &str| {
        let text = format!(
            r#"<scene version="3.0.0"><shape type="{kind}"><string name="filename" value="m.{kind}"/>{extra}</shape></scene>"#
        );
        let loaded =
            parse_mitsuba(&text, folder.join("s.xml"), &[]).unwrap_or_else(|e| panic!("{}", e.chain()));
        match &loaded.description.shapes[0].geometry {
            Geometry::Mesh(mesh) => mesh.clone(),
            _ => panic!("{kind} is no mesh"),
        }
    };
    let flag = |name: &str, value: bool| format!(r#"<boolean name="{name}" value="{value}"/>"#);
    for (kind, flip, expected) in [
        ("obj", None, 0.25),
        ("obj", Some(true), 0.25),
        ("obj", Some(false), 0.75),
        ("ply", None, 0.75),
        ("ply", Some(false), 0.75),
        ("ply", Some(true), 0.25),
    ] {
        let extra = flip.map_or(String::new(), |on| flag("flip_tex_coords", on));
        assert_eq!(mesh(kind, &extra).uvs[0].y, expected, "{kind}, {flip:?}");
    }
    for kind in ["obj", "ply"] {
        assert_eq!(mesh(kind, "").normals.len(), 3, "{kind}");
        assert_eq!(
            mesh(kind, &flag("face_normals", false)).normals.len(),
            3,
            "{kind}"
        );
        assert!(
            mesh(kind, &flag("face_normals", true)).normals.is_empty(),
            "{kind}"
        );
    }
}

/// Spectra, compressed meshes and grids of densities in files that scenes name.
#[test]
fn spectra_grids_and_compressed_files_are_found() {
    let folder = folder("spectra_and_grids");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
    // A constant index, and one that is written out.
    write("two.spd", b"# index\n300 2.5\n900 2.5\n");
    write("green.spd", b"380 0\n500 0\n520 1\n560 1\n580 0\n780 0\n");
    write(
        "tile.nvdb",
        include_bytes!("../../../../fuzz/seeds/nanovdb/tile.nvdb"),
    );
    // Stored without compression: a head, one last block, sums that nobody checks.
    let length = TRIANGLE_PLY.len() as u16;
    let mut gz = vec![0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255, 1];
    gz.extend(length.to_le_bytes());
    gz.extend((!length).to_le_bytes());
    gz.extend(TRIANGLE_PLY.as_bytes());
    gz.extend([0; 8]);
    write("tri.ply.gz", &gz);
    write("no.tga", b"");
    write(
        "s.pbrt",
        br#"WorldBegin
        MakeNamedMedium "cloud" "string type" "nanovdb" "string filename" "tile.nvdb" "rgb sigma_s" [1 1 1] "rgb sigma_a" [0 0 0]
        MakeNamedMedium "sky" "string type" "cloud"
        MakeNamedMedium "dye" "string type" "rgbgrid" "integer nx" 2 "rgb sigma_a" [0 0 0 2 2 2] "rgb sigma_s" [1 1 1 1 1 1]
        MakeNamedMedium "milk" "string preset" "Wholemilk" "string type" "homogeneous"
        Texture "t" "spectrum" "imagemap" "string filename" "no.tga"
        Material "conductor" "spectrum eta" "two.spd" "spectrum k" "two.spd"
        Shape "plymesh" "string filename" "tri.ply.gz"
        Material "diffuse" "spectrum reflectance" "green.spd"
        Shape "sphere""#,
    );
    let loaded = load(folder.join("s.pbrt"), &[]).unwrap_or_else(|error| panic!("{}", error.chain()));
    let scene = &loaded.description;
    assert!(Scene::new(scene).is_ok());
    let said: String = loaded.warnings.iter().map(|w| w.message.clone() + "\n").collect();
    for what in [
        "`cloud` is homogeneous",
        "`rgbgrid` is homogeneous",
        "substance",
        "no.tga: unknown file extension",
    ] {
        assert!(said.contains(what), "{what}: {said}");
    }
    let DensityDescription::Grid(grid) = &scene.media[0].density else {
        panic!("a grid is a grid")
    };
    // Four voxels a side, and one more at each end; all in a tile of 2.
    assert_eq!(grid.resolution, [6; 3]);
    assert_eq!((grid.values[0], grid.values[6 * 36 / 2 + 20]), (0.5, 2.0));
    assert!((scene.media[2].extinction - Rgb::splat(2.0)).abs().max_element() < 1e-6);
    let material = |shape: usize| {
        let Material::TwoSided { front, .. } = &scene.materials[scene.shapes[shape].material as usize] else {
            panic!("seen from both sides")
        };
        front
    };
    let Material::Conductor { ior, .. } = &**material(0) else {
        panic!("a metal")
    };
    assert!(
        (ior.eta - Rgb::splat(2.5)).abs().max_element() < 1e-4,
        "{}",
        ior.eta
    );
    let Material::Diffuse { reflectance } = &**material(1) else {
        panic!("diffuse")
    };
    let green = reflectance.mean();
    assert!(green.y > 2.0 * green.x.max(green.z), "{green}");
    // The same spectrum in a Mitsuba scene.
    write(
        "s.xml",
        br#"<scene version="3.0.0"><shape type="sphere"><bsdf type="diffuse"><spectrum name="reflectance" filename="green.spd"/></bsdf></shape></scene>"#,
    );
    let loaded = load(folder.join("s.xml"), &[]).unwrap_or_else(|error| panic!("{}", error.chain()));
    let shape = &loaded.description.shapes[0];
    let Material::Diffuse { reflectance } = &loaded.description.materials[shape.material as usize] else {
        panic!("diffuse")
    };
    assert_eq!(reflectance.mean(), green);
    write("s.pbrt", br#"Material "matte""#);
    let said = load(folder.join("s.pbrt"), &[]).unwrap_err().chain();
    assert!(said.contains("pbrt --upgrade"), "{said}");
}
