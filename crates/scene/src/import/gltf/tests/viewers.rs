//! What files leave to viewers: views, light, backs, poses and instances.

use super::*;
use crate::{Ray, Scene};
use lightshed_testkit::check_faults;

fn warned(loaded: &Loaded, part: &str) -> bool {
    loaded
        .warnings
        .iter()
        .any(|warning| warning.message.contains(part))
}

/// Radiance that goes on along a ray through the square, from its front and from behind.
fn passes(loaded: &Loaded, from: f32) -> bool {
    let scene = Scene::new(&loaded.description).unwrap();
    let ray = Ray::new(Vec3::new(0.25, 0.75, from), Vec3::NEG_Z * from.signum());
    let point = scene.intersect(&ray).expect("the square is there");
    let bsdf = scene.bsdf(&point);
    let wo = point.shading.to_local(-ray.direction);
    let sample = bsdf.sample(wo, 0.5, Vec2::splat(0.5));
    sample.is_some_and(|sample| sample.wi.abs_diff_eq(-wo, 1e-6) && sample.weight == Rgb::ONE)
}

/// An open surface of one side is not there from behind; one of two sides is.
#[test]
fn backs_are_not_drawn() {
    check_faults(&["black from behind"], |fault| {
        let mut loaded = read(&embedded(r#"{"mesh":0}"#, PLAIN));
        if fault.is_some() {
            loaded.description.shapes[0].material = 0;
        }
        match (passes(&loaded, 1.0), passes(&loaded, -1.0)) {
            (false, true) => Ok(()),
            found => Err(format!("{found:?}")),
        }
    })
    .unwrap();
    let both = PLAIN.replacen("{", r#"{"doubleSided":true,"#, 1);
    let loaded = read(&embedded(r#"{"mesh":0}"#, &both));
    assert!(!passes(&loaded, 1.0) && !passes(&loaded, -1.0));
}

/// The square under a lamp that looks at it from the direction of the camera, of so much light.
fn lit(intensity: f64, x: f64) -> Loaded {
    let more = format!(
        r#"{PLAIN},"extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[
        {{"type":"point","intensity":{intensity}}}]}}}}"#
    );
    let lamp =
        format!(r#"{{"extensions":{{"KHR_lights_punctual":{{"light":0}}}},"translation":[{x},0.5,1]}}"#);
    read(&embedded(
        &format!(r#"{{"children":[1,2]}},{{"mesh":0}},{lamp}"#),
        &more,
    ))
}

/// Lamps that light what is seen are the scene's light; those that do not get surroundings beside
/// them; those in candelas are brought into range.
#[test]
fn lamps_are_the_light_if_they_light() {
    let intensity = |loaded: &Loaded| match loaded.description.emitters[0] {
        EmitterDescription::Point { intensity, .. } => intensity.x,
        ref other => panic!("{other:?}"),
    };
    let plain = lit(5.0, 0.5);
    assert_eq!((plain.description.emitters.len(), intensity(&plain)), (1, 5.0));
    let far = lit(5.0, 500.0);
    assert_eq!((far.description.emitters.len(), intensity(&far)), (2, 5.0));
    assert!(warned(&far, "reach less than half"));
    let candelas = lit(2049.0, 0.5);
    assert_eq!(candelas.description.emitters.len(), 1);
    assert!((intensity(&candelas) - 3.0).abs() < 1e-5 && warned(&candelas, "photometric"));
    let glaring = lit(1e6, 0.5);
    // The median irradiance is π.
    assert!(
        intensity(&glaring) > 2.0 && intensity(&glaring) < 6.0,
        "{}",
        intensity(&glaring)
    );
}

/// What glows no more than a lit wall is no lamp; what is brighter is one.
#[test]
fn glowing_surfaces_are_no_lamps() {
    let of = |strength: f64| {
        let more = format!(
            r#","extensionsUsed":["KHR_materials_emissive_strength"],"materials":[{{"emissiveFactor":[1,1,1],
            "extensions":{{"KHR_materials_emissive_strength":{{"emissiveStrength":{strength}}}}}}}]"#
        );
        read(&embedded(r#"{"mesh":0}"#, &more)).description.emitters.len()
    };
    assert_eq!((of(1.0), of(10.0)), (1, 0));
}

/// An unlit sheet of two sides emits towards the camera, wherever that is.
#[test]
fn unlit_sheets_face_the_camera() {
    let more = r#","cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":0.1}}],
        "materials":[{"doubleSided":true,"extensions":{"KHR_materials_unlit":{}}}]"#;
    for (z, turn) in [(3, "[0,0,0,1]"), (-3, "[0,1,0,0]")] {
        let camera = format!(r#"{{"camera":0,"translation":[0.5,0.5,{z}],"rotation":{turn}}}"#);
        let nodes = format!(r#"{{"children":[1,2]}},{{"mesh":0}},{camera}"#);
        let loaded = read(&embedded(&nodes, more));
        let front = normal(mesh(&loaded.description.shapes[0]), 0);
        assert_eq!(front, Vec3::Z * (z as f32).signum());
    }
}

/// Two instances of the square, translated by its own positions 1 and 2 (the first two of a list
/// that starts there) and left unturned.
#[test]
fn instances_are_copies() {
    let instances = r#"{"mesh":0,"translation":[0,0,7],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0}}}}"#;
    let loaded = read(&embedded(
        instances,
        &format!(r#"{PLAIN},"extensionsRequired":["EXT_mesh_gpu_instancing"]"#),
    ));
    let corner = |index: usize| mesh(&loaded.description.shapes[index]).positions[2];
    assert_eq!(loaded.description.shapes.len(), 4);
    assert_eq!(corner(0), Vec3::new(1.0, 1.0, 7.0));
    assert_eq!(corner(2), Vec3::new(2.0, 2.0, 7.0));
}

/// All corners hang on joint 0 (JOINTS are the strip's indices read as bytes where they are 0), so
/// the square goes where the joint is, whatever its own node says.
#[test]
fn skins_have_the_pose_of_their_joints() {
    let skin = |joint: &str, more: &str| {
        let mut bytes = square();
        bytes.extend([0_u8; 16]);
        for _ in 0..4 {
            bytes.extend([1.0_f32, 0.0, 0.0, 0.0].iter().flat_map(|v| v.to_le_bytes()));
        }
        let nodes = format!(r#"{{"children":[1,2]}},{{"mesh":0,"skin":0,"translation":[50,0,0]}},{joint}"#);
        let json = document(
            &format!(
                r#","uri":"data:application/octet-stream;base64,{}""#,
                base64(&bytes)
            ),
            &nodes,
            &format!(r#"{PLAIN},"skins":[{{"joints":[2]{more}}}]"#),
        );
        let json = json
            .replace(r#""byteLength":144,"#, r#""byteLength":224,"#)
            .replace(
                r#""byteOffset":128,"byteLength":16}"#,
                r#""byteOffset":128,"byteLength":16},{"buffer":0,"byteOffset":144,"byteLength":80}"#,
            )
            .replace(
                r#"{"bufferView":1,"byteOffset":12,"#,
                r#"{"bufferView":2,"componentType":5121,"count":4,"type":"VEC4"},
                {"bufferView":2,"byteOffset":16,"componentType":5126,"count":4,"type":"VEC4"},
                {"bufferView":1,"byteOffset":12,"#,
            )
            .replace(
                r#""TEXCOORD_0":2"#,
                r#""TEXCOORD_0":2,"JOINTS_0":4,"WEIGHTS_0":5"#,
            );
        read(&json)
    };
    let loaded = skin(r#"{"translation":[0,0,3],"scale":[2,2,2]}"#, "");
    let square = mesh(&loaded.description.shapes[0]);
    assert_eq!(square.positions[2], Vec3::new(2.0, 2.0, 3.0));
    assert_eq!((square.normals[0], normal(square, 0)), (Vec3::Z, Vec3::Z * 4.0));
    // A joint that mirrors keeps the front where it was.
    let loaded = skin(r#"{"scale":[-1,1,1]}"#, "");
    let square = mesh(&loaded.description.shapes[0]);
    assert_eq!((square.normals[0], normal(square, 0)), (Vec3::Z, Vec3::Z));
    // One that cannot be read leaves the mesh where its node puts it.
    let loaded = skin("{}", r#","inverseBindMatrices":0"#);
    assert_eq!(mesh(&loaded.description.shapes[0]).positions[0], Vec3::X * 50.0);
    assert!(warned(&loaded, "the skin is left out"));
}

/// The target's positions are the normals, +Z: a quarter of them lifts the square by as much.
#[test]
fn morph_targets_have_their_weights() {
    let json = embedded(r#"{"mesh":0,"weights":[0.25]}"#, PLAIN).replacen(
        r#""indices":3"#,
        r#""targets":[{"POSITION":1}],"indices":3"#,
        1,
    );
    let lifted = |json: &str| mesh(&read(json).description.shapes[0]).positions[0].z;
    assert_eq!(lifted(&json), 0.25);
    let of_mesh = json
        .replace(r#","weights":[0.25]"#, "")
        .replace(r#""meshes":[{"#, r#""meshes":[{"weights":[0.5],"#);
    assert_eq!(lifted(&of_mesh), 0.5);
    assert_eq!(lifted(&of_mesh.replace("0.5]", "0]")), 0.0);
}

/// An image that is not there, or of a format that is not read, is white, and named.
#[test]
fn missing_images_are_white() {
    let of = |uri: &str| {
        let more = format!(
            r#","images":[{{"uri":"{uri}"}}],"textures":[{{"source":0}}],
            "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}]"#
        );
        read(&embedded(r#"{"mesh":0}"#, &more))
    };
    let loaded = of("nowhere.png");
    assert!(warned(&loaded, "nowhere.png"));
    match &loaded.description.materials[0] {
        Material::MetallicRoughness { base_color, .. } => assert_eq!(base_color.at(Vec2::ZERO), Rgb::ONE),
        other => panic!("{other:?}"),
    }
    assert!(warned(
        &of("data:;base64,RERTIAAA"),
        "DDS images are not supported"
    ));
}

/// What exporters write beside the specification: whole numbers with a point, nulls, a mark of the
/// byte order, further chunks, angles and factors out of range, and nodes that are hidden.
#[test]
fn loose_files_are_read() {
    let good = embedded(r#"{"mesh":0}"#, PLAIN);
    let shapes = |bytes: &[u8]| match parse_gltf(bytes, "s.gltf") {
        Ok(loaded) => loaded.description.shapes.len(),
        Err(error) => panic!("{}", error.chain()),
    };
    let loose = good
        .replace(r#""count":6"#, r#""count":6.0"#)
        .replace(r#"{"mesh":0}"#, r#"{"mesh":0,"camera":null}"#);
    assert_eq!(shapes(loose.as_bytes()), 1);
    assert_eq!(shapes(format!("\u{feff}{good}").as_bytes()), 1);
    let hidden = good.replace(
        r#"{"mesh":0}"#,
        r#"{"mesh":0,"extensions":{"KHR_node_visibility":{"visible":false}}}"#,
    );
    assert_eq!(shapes(hidden.as_bytes()), 0);
    let mut more = glb(&document("", r#"{"mesh":0}"#, PLAIN), b"");
    // The empty chunk of numbers gets another type, and the numbers follow it.
    let at = more.len() - 4;
    more[at..].copy_from_slice(b"XTRA");
    let bytes = square();
    more.extend((bytes.len() as u32).to_le_bytes());
    more.extend(b"BIN\0");
    more.extend(bytes);
    let total = more.len() as u32;
    more[8..12].copy_from_slice(&total.to_le_bytes());
    assert_eq!(shapes(&more), 1);
    more.extend(b"more");
    assert_eq!(shapes(&more), 1);
    let loaded = read(&good.replace("[0.5,0.25,1,1]", "[1.5,-0.25,1,1]"));
    assert!(crate::Scene::new(&loaded.description).is_ok());
    let light = |text: &str| {
        let more = format!(
            r#"{PLAIN},"extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[{text}]}}}}"#
        );
        read(&embedded(
            r#"{"mesh":0,"extensions":{"KHR_lights_punctual":{"light":0}}}"#,
            &more,
        ))
    };
    let spot = |inner: f32, outer: f32| {
        light(&format!(
            r#"{{"type":"spot","spot":{{"innerConeAngle":{inner},"outerConeAngle":{outer}}}}}"#
        ))
    };
    assert!(!warned(&spot(0.5, 0.5), "outerConeAngle"));
    assert!(warned(&spot(0.7, 0.5), "outerConeAngle") && warned(&spot(0.1, 2.0), "outerConeAngle"));
    assert!(crate::Scene::new(&spot(0.7, 0.5).description).is_ok());
    assert!(warned(&light(""), "no such light"));
    assert!(warned(&light(r#"{"type":"area"}"#), "an unknown type of light"));
    let mended = |from: &str, to: &str, part: &str| {
        assert!(good.contains(from), "{from}");
        let loaded = read(&good.replacen(from, to, 1));
        assert!(warned(&loaded, part), "{to}: {:?}", loaded.warnings);
    };
    mended(
        r#"{"mesh":0}"#,
        r#"{"mesh":0,"camera":3}"#,
        "`camera` refers to nothing",
    );
    mended(
        r#""material":0"#,
        r#""material":9"#,
        "`material` refers to nothing",
    );
    mended(
        r#""primitives":["#,
        r#""primitives":[{"attributes":{}},"#,
        "without positions",
    );
    mended(r#"{"mesh":0}"#, r#"{"mesh":5}"#, "`mesh` refers to nothing");
    mended(
        r#","materials""#,
        r#","samplers":[{"magFilter":1}],"materials""#,
        "an unknown `magFilter`",
    );
}
