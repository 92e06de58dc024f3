//! Features of materials and cameras, each in a small document: what the scene made of it shows.

use super::*;
use crate::{AxisWrap, Bsdf, Ray, Relief, Scene, SurfacePoint, Wrap};
use lightshed_testkit::check_faults;

/// A document of the square with these materials, images and attributes.
fn with(attributes: &str, more: &str) -> String {
    let json = embedded(r#"{"mesh":0}"#, more);
    json.replacen(r#""TEXCOORD_0":2"#, &format!(r#""TEXCOORD_0":2{attributes}"#), 1)
}

fn image(bytes: &[u8]) -> String {
    format!(
        r#","images":[{{"uri":"data:image/png;base64,{}"}}],"textures":[{{"source":0}}]"#,
        base64(bytes)
    )
}

/// A PNG of one pixel.
fn pixel(rgba: [u8; 4]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let buffer = image::RgbaImage::from_pixel(1, 1, image::Rgba(rgba));
    buffer
        .write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png)
        .unwrap();
    bytes
}

/// What a ray down onto the square meets at (0.25, 0.75).
fn met(loaded: &Loaded) -> (SurfacePoint, Bsdf) {
    let scene = Scene::new(&loaded.description).unwrap();
    let ray = Ray::new(Vec3::new(0.25, 0.75, 1.0), Vec3::NEG_Z);
    let point = scene.intersect(&ray).expect("the square is there");
    let bsdf = scene.bsdf(&point);
    (point, bsdf)
}

fn expect(name: &str, found: bool) -> Result<(), String> {
    found.then_some(()).ok_or_else(|| name.to_owned())
}

/// The colours of the vertices are the normals, (0, 0, 1): what is red or green is gone.
#[test]
fn colours_of_vertices_multiply_the_base_colour() {
    let json = with(
        r#","COLOR_0":1"#,
        r#","materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.75,1],"metallicFactor":0}}]"#,
    );
    check_faults(&["left out"], |fault| {
        let mut loaded = read(&json);
        if fault.is_some()
            && let Geometry::Mesh(mesh) = &mut loaded.description.shapes[0].geometry
        {
            mesh.colors.clear();
        }
        let (_, bsdf) = met(&loaded);
        let (wo, wi) = (Vec3::Z, Vec3::new(0.6, 0.0, 0.8));
        let value = bsdf.evaluate(wo, wi).value;
        // What is specular is grey, and the same in the channel without base colour.
        expect(
            "blue alone is diffuse",
            value.x == value.y && value.z > value.x + 0.1,
        )
    })
    .unwrap();
}

#[test]
fn alpha_makes_holes() {
    let of = |more: &str, rgba: [u8; 4]| {
        let loaded = read(&with("", &format!("{}{more}", image(&pixel(rgba)))));
        loaded.description.materials[0].clone()
    };
    let textured = |mode: &str, factor: f32| {
        format!(
            r#","materials":[{{"alphaMode":"{mode}","pbrMetallicRoughness":{{"baseColorFactor":[1,1,1,{factor}],
            "baseColorTexture":{{"index":0}}}}}}]"#
        )
    };
    let opacity = |material: &Material| match material {
        Material::Blend { weight, first, .. } => {
            assert!(matches!(**first, Material::Null));
            weight.at(Vec2::splat(0.5))
        }
        _ => 1.0,
    };
    // Half-opaque texels: above the cutoff of one half or below it, and blended.
    for (mode, factor, alpha, expected) in [
        ("OPAQUE", 0.5, 0, 1.0),
        ("MASK", 1.0, 128, 1.0),
        ("MASK", 0.5, 128, 0.0),
        ("MASK", 1.0, 100, 0.0),
        ("BLEND", 1.0, 255, 1.0),
        ("BLEND", 1.0, 51, 0.2),
        ("BLEND", 0.5, 51, 0.1),
    ] {
        let found = opacity(&of(&textured(mode, factor), [255, 255, 255, alpha]));
        assert!(
            (found - expected).abs() < 1e-6,
            "{mode} {factor} {alpha}: {found}"
        );
    }
    let plain =
        r#","materials":[{"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.25]}}]"#;
    assert_eq!(opacity(&of(plain, [0; 4])), 0.25);
    // Through a clear surface everything is seen.
    let clear = plain.replace("0.25", "0");
    let (_, bsdf) = met(&read(&with("", &format!("{}{clear}", image(&pixel([0; 4]))))));
    let sample = bsdf
        .sample(Vec3::Z, 0.5, Vec2::splat(0.5))
        .expect("light goes on");
    assert_eq!((sample.wi, sample.weight), (Vec3::NEG_Z, Rgb::ONE));
}

/// Red above one half leans to the right, green to the top: where `u` grows, and where glTF's `v`
/// falls.
#[test]
fn normal_maps_turn_the_surface() {
    let map = r#","materials":[{"normalTexture":{"index":0,"scale":0.5}}]"#;
    let json = with("", &format!("{}{map}", image(&pixel([204, 153, 230, 255]))));
    check_faults(&["upside down", "without the scale"], |fault| {
        let mut loaded = read(&json);
        let material = loaded.description.shapes[0].material as usize;
        let Material::Relief { relief, .. } = &mut loaded.description.materials[material] else {
            return Err("no relief".to_owned());
        };
        let Relief::Normals { scale, .. } = relief.as_mut() else {
            return Err("no normals".to_owned());
        };
        match fault {
            Some("upside down") => *scale = -*scale,
            Some(_) => *scale = 1.0,
            None => {}
        }
        let (point, _) = met(&loaded);
        let m = 2.0 * Vec3::new(204.0, 153.0, 230.0) / 255.0 - 1.0;
        let expected = (m * Vec3::new(0.5, 0.5, 1.0)).normalize();
        expect(
            "the normal of the map",
            point.shading.normal.abs_diff_eq(expected, 1e-5) && point.geometric_normal == Vec3::Z,
        )
    })
    .unwrap();
}

#[test]
fn unlit_materials_emit_their_colour() {
    let more = r#","extensionsUsed":["KHR_materials_unlit"],"materials":[{"extensions":{"KHR_materials_unlit":{}},
        "pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,1,1]}}]"#;
    let loaded = read(&with("", more));
    assert_eq!(
        loaded.description.shapes[0].emission,
        Some(Rgb::new(0.5, 0.25, 1.0))
    );
    // It is no lamp.
    assert!(matches!(
        loaded.description.emitters[..],
        [EmitterDescription::Environment(_)]
    ));
    assert!(matches!(
        &loaded.description.materials[0],
        Material::Diffuse {
            reflectance: ColorTexture::Constant(Rgb::ZERO)
        }
    ));
}

#[test]
fn specular_extensions_change_index_and_metal() {
    let of = |extension: &str| {
        let more = format!(r#","materials":[{{"extensions":{{{extension}}}}}]"#);
        match &read(&with("", &more)).description.materials[0] {
            Material::MetallicRoughness {
                base_color: ColorTexture::Constant(base),
                metallic: FloatTexture::Constant(metallic),
                roughness: FloatTexture::Constant(roughness),
                ior,
                ..
            } => (*base, *metallic, *roughness, *ior),
            other => panic!("{other:?}"),
        }
    };
    let (.., ior) = of(r#""KHR_materials_specular":{"specularFactor":0}"#);
    assert_eq!(ior, 1.0);
    let gloss = |diffuse: &str, specular: &str| {
        of(&format!(
            r#""KHR_materials_pbrSpecularGlossiness":{{"diffuseFactor":[{diffuse},1],"specularFactor":[{specular}],"glossinessFactor":0.75}}"#
        ))
    };
    // Plastic: four hundredths of specular are no metal. Gold: nothing diffuse is all metal.
    let (base, metallic, roughness, _) = gloss("0.8,0.4,0.2", "0.04,0.04,0.04");
    assert!(
        base.abs_diff_eq(Rgb::new(0.8, 0.4, 0.2), 1e-3) && metallic < 1e-3,
        "{base}"
    );
    assert_eq!(roughness, 0.25);
    let (base, metallic, ..) = gloss("0,0,0", "1,0.766,0.336");
    assert!(base.abs_diff_eq(Rgb::new(1.0, 0.766, 0.336), 0.02), "{base}");
    assert!(metallic > 0.99, "{metallic}");
}

#[test]
fn each_axis_wraps_as_it_says() {
    let more = r#","samplers":[{"wrapS":33071,"wrapT":33648}],"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}]"#;
    let json = with("", &format!("{}{more}", image(&pixel([255; 4]))));
    let json = json.replace(r#"{"source":0}"#, r#"{"source":0,"sampler":0}"#);
    match &read(&json).description.materials[0] {
        Material::MetallicRoughness {
            base_color: ColorTexture::Image(texture),
            ..
        } => assert_eq!(texture.wrap, Wrap::Mixed([AxisWrap::Clamp, AxisWrap::Mirror])),
        other => panic!("{other:?}"),
    }
}

#[test]
fn webp_images_are_decoded() {
    let mut bytes = Vec::new();
    let codes = [188, 51, 102, 128];
    image_webp::WebPEncoder::new(&mut bytes)
        .encode(&codes, 1, 1, image_webp::ColorType::Rgba8)
        .unwrap();
    let more =
        r#","materials":[{"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}]"#;
    let json = with("", &format!("{}{more}", image(&bytes)));
    let json = json.replace(
        r#"{"source":0}"#,
        r#"{"extensions":{"EXT_texture_webp":{"source":0}}}"#,
    );
    let loaded = read(&json);
    let Material::Blend { weight, second, .. } = &loaded.description.materials[0] else {
        panic!("{:?}", loaded.description.materials[0])
    };
    assert!((weight.at(Vec2::ZERO) - 128.0 / 255.0).abs() < 1e-6);
    let Material::MetallicRoughness { base_color, .. } = &**second else {
        panic!("{second:?}")
    };
    assert!((base_color.at(Vec2::ZERO).x - 0.502_886_5).abs() < 1e-6);
}

/// The rays of two pixels far apart run along each other, and start as far apart as they should.
#[test]
fn orthographic_cameras_have_no_perspective() {
    let more = format!(
        r#"{PLAIN},"cameras":[{{"type":"orthographic","orthographic":{{"xmag":2,"ymag":1,"znear":0.5,"zfar":9}}}}]"#
    );
    let json = embedded(
        r#"{"children":[1,2]},{"mesh":0},{"camera":0,"translation":[0,0,3]}"#,
        &more,
    );
    let scene = Scene::new(&read(&json).description).unwrap();
    let settings = scene.settings();
    assert_eq!((settings.width, settings.height), (1024, 512));
    let ray = |x| scene.camera().ray(Vec2::new(x, 256.0), [0.5; 2]);
    let (left, right) = (ray(0.0), ray(1024.0));
    assert!(left.direction.dot(right.direction) > 1.0 - 1e-6);
    assert!((left.origin.x + 2.0).abs() < 0.01 && (right.origin.x - 2.0).abs() < 0.01);
    assert!((left.origin.z - 2.5).abs() < 1e-3, "{}", left.origin);
}

/// A coat of half a share with a roughness by the texture's green, and a sheen of the texture's red
/// with a roughness by its alpha.
#[test]
fn coats_and_sheens_are_layers() {
    let more = r#","extensionsUsed":["KHR_materials_clearcoat","KHR_materials_sheen"],"materials":[{"extensions":{
        "KHR_materials_clearcoat":{"clearcoatFactor":0.5,"clearcoatRoughnessFactor":0.5,"clearcoatRoughnessTexture":{"index":0}},
        "KHR_materials_sheen":{"sheenColorFactor":[1,0.5,0],"sheenColorTexture":{"index":0},
        "sheenRoughnessFactor":0.25,"sheenRoughnessTexture":{"index":0}}}}]"#;
    let loaded = read(&with(
        "",
        &format!("{}{more}", image(&pixel([188, 102, 51, 204]))),
    ));
    assert!(
        loaded
            .warnings
            .iter()
            .all(|w| !w.message.contains("not supported"))
    );
    let Material::Layered { layers, .. } = &loaded.description.materials[0] else {
        panic!("{:?}", loaded.description.materials[0])
    };
    let at = |texture: &FloatTexture| texture.at(Vec2::ZERO);
    assert_eq!(at(&layers.coat), 0.5);
    assert!((at(&layers.coat_roughness) - 0.2).abs() < 1e-6);
    assert!((at(&layers.sheen_roughness) - 0.2).abs() < 1e-6);
    let sheen = layers.sheen.at(Vec2::ZERO);
    assert!((sheen.x - 0.502_886_5).abs() < 1e-6 && sheen.z == 0.0, "{sheen}");
    // The coat shows in the mirror's direction.
    let bare = read(&with(
        "",
        &more
            .replace("\"clearcoatFactor\":0.5", "\"clearcoatFactor\":0")
            .replace("{\"index\":0}", "0"),
    ));
    let (wo, wi) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.6, 0.0, 0.8));
    let value = |loaded: &Loaded| met(loaded).1.evaluate(wo, wi).value.x;
    assert!(
        value(&loaded) > 2.0 * value(&bare),
        "{} {}",
        value(&loaded),
        value(&bare)
    );
}

/// A coat follows the normals of its base, which is a deviation unless both have the same map.
#[test]
fn coats_with_other_normals_are_named() {
    let warns = |coat: &str, base: &str| {
        let more = format!(
            r#","extensionsUsed":["KHR_materials_clearcoat"],"materials":[{{"extensions":{{
            "KHR_materials_clearcoat":{{"clearcoatFactor":1{coat}}}}}{base}}}]"#
        );
        let texture = image(&pixel([128, 128, 255, 255]));
        let loaded = read(&with("", &format!("{texture}{more}")));
        let named = |warning: &crate::import::Warning| warning.message.contains("clear coat");
        loaded.warnings.iter().any(named)
    };
    let (coat, base) = (
        r#","clearcoatNormalTexture":{"index":0}"#,
        r#","normalTexture":{"index":0}"#,
    );
    assert!(!warns("", "") && !warns(coat, base));
    assert!(warns(coat, "") && warns("", base));
}

/// What transmits all light and has a thickness refracts; a quarter is left behind both boundaries.
#[test]
fn thick_glass_refracts() {
    let more = r#","materials":[{"pbrMetallicRoughness":{"roughnessFactor":0},"extensions":{
        "KHR_materials_transmission":{"transmissionFactor":1},"KHR_materials_ior":{"ior":1.25},
        "KHR_materials_volume":{"thicknessFactor":2,"attenuationDistance":1,"attenuationColor":[0.5,1,1]}}}]"#;
    match &read(&with("", more)).description.materials[0] {
        Material::Dielectric {
            eta,
            roughness: None,
            specular_transmittance: ColorTexture::Constant(tint),
            ..
        } => assert_eq!((*eta, *tint), (1.25, Rgb::new(0.5, 1.0, 1.0))),
        other => panic!("{other:?}"),
    }
    let part = more.replace("\"transmissionFactor\":1", "\"transmissionFactor\":0.5");
    assert!(matches!(
        read(&with("", &part)).description.materials[0],
        Material::Blend { .. }
    ));
    let thin = more.replace("\"thicknessFactor\":2", "\"thicknessFactor\":0");
    assert!(matches!(
        read(&with("", &thin)).description.materials[0],
        Material::MetallicRoughness { .. }
    ));
}

/// Meshes without area, accessors without data and damaged images are left out, and the rest is
/// there.
#[test]
fn what_is_damaged_does_not_hide_the_rest() {
    // All corners of the second mesh are one; the normals of the first have no data.
    let json = with("", PLAIN)
        .replacen(r#""nodes":[0]"#, r#""nodes":[0,1]"#, 1)
        .replacen(r#"{"mesh":0}"#, r#"{"mesh":0},{"mesh":1}"#, 1)
        .replacen(
            r#""meshes":["#,
            r#""meshes":[{"primitives":[{"attributes":{"POSITION":1},"indices":3}]},"#,
            1,
        )
        .replacen(r#""NORMAL":1"#, r#""NORMAL":5"#, 1)
        .replacen(
            r#""accessors":["#,
            r#""accessors":[{"componentType":5126,"count":4,"type":"VEC3"},"#,
            1,
        );
    // The new accessor is the first, so that all others count one more.
    let json = json
        .replacen(r#""POSITION":1"#, r#""POSITION":2"#, 1)
        .replacen(r#""NORMAL":5"#, r#""NORMAL":0"#, 1)
        .replacen(r#""POSITION":0"#, r#""POSITION":1"#, 1)
        .replacen(r#""TEXCOORD_0":2"#, r#""TEXCOORD_0":3"#, 1)
        .replace(r#""indices":3"#, r#""indices":4"#);
    let loaded = read(&json);
    assert_eq!(loaded.description.shapes.len(), 1);
    assert!(mesh(&loaded.description.shapes[0]).normals.is_empty());
    let said = |loaded: &Loaded, what: &str| loaded.warnings.iter().any(|w| w.message.contains(what));
    assert!(said(&loaded, "has an area: left out"), "{:?}", loaded.warnings);
    assert!(Scene::new(&loaded.description).is_ok());

    let mut damaged = pixel([255, 0, 0, 255]);
    let end = damaged.len() - 20;
    damaged.truncate(end);
    let textured = r#","materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}]"#;
    let loaded = read(&with("", &format!("{textured}{}", image(&damaged))));
    assert!(said(&loaded, "damaged image"), "{:?}", loaded.warnings);
}

/// A view that the importer chose still holds the whole scene in a wider image; one of the file
/// keeps its field of view.
#[test]
fn a_wider_image_cuts_nothing_off() {
    let inside = |loaded: &Loaded| {
        let camera = &loaded.description.camera;
        let [width, height] = [
            loaded.description.settings.width,
            loaded.description.settings.height,
        ];
        let half = (0.5 * camera.fov_x).tan();
        let halves = glam::Vec2::new(half, half * height as f32 / width as f32);
        let corners = mesh(&loaded.description.shapes[0]).positions.iter();
        let mut corners = corners.map(|&corner| camera.to_world.inverse().transform_point3(corner));
        corners.all(|place| (place.truncate() / place.z).abs().cmple(halves).all())
    };
    let json = with("", PLAIN);
    check_faults(&["the horizontal field of view stays"], |fault| {
        let mut loaded = read(&json);
        if fault.is_some() {
            loaded.view_is_chosen = false;
        }
        for size in [[300, 300], [1600, 400], [400, 300], [300, 900]] {
            loaded.resize(size);
            let settings = loaded.description.settings;
            assert_eq!([settings.width, settings.height], size);
            expect("cut off", inside(&loaded))?;
        }
        Ok::<(), String>(())
    })
    .unwrap();
    let mut placed = read(&json);
    placed.view_is_chosen = false;
    let before = placed.description.camera.fov_x;
    placed.resize([1600, 400]);
    assert_eq!(placed.description.camera.fov_x, before);
}
