//! Materials, shapes and spectra beyond the first ones, and how scenes refer to them.

use super::*;

#[test]
fn masks_and_principled_materials_are_expressed() {
    let first = |bsdf: &str| read(&format!(r#"<shape type="cube">{bsdf}</shape>"#));
    let mask = r#"<bsdf type="mask"><float name="opacity" value="0.3"/><bsdf type="diffuse"/></bsdf>"#;
    match &first(mask).description.materials[0] {
        Material::Blend {
            weight: FloatTexture::Constant(0.3),
            first,
            second,
        } => {
            assert!(matches!(
                (&**first, &**second),
                (Material::Null, Material::Diffuse { .. })
            ));
        }
        other => panic!("{other:?}"),
    }
    let principled = r#"<bsdf type="principled"><rgb name="base_color" value="0.1 0.2 0.3"/>
        <float name="roughness" value="0.4"/><float name="clearcoat" value="1"/></bsdf>"#;
    let loaded = first(principled);
    assert!(matches!(
        &loaded.description.materials[0],
        Material::MetallicRoughness { roughness: FloatTexture::Constant(0.4), ior, .. } if (ior - 1.5).abs() < 1e-6
    ));
    assert!(loaded.warnings.iter().any(|w| w.message.contains("`clearcoat`")));
}

/// Maps of normals and heights end up around all else.
#[test]
fn reliefs_are_around_materials() {
    let material = |bsdf: &str| {
        let loaded = read(&format!(r#"<shape type="cube">{bsdf}</shape>"#));
        (loaded.description.materials[0].clone(), loaded.warnings)
    };
    let map =
        r#"<texture type="rawconstant" name="normalmap"><vector name="value" value="0.5 0.5 1"/></texture>"#;
    let normals = format!(r#"<bsdf type="normalmap">{map}<bsdf type="diffuse"/></bsdf>"#);
    for (around, bsdf) in [
        ("", normals.clone()),
        ("TwoSided", format!(r#"<bsdf type="twosided">{normals}</bsdf>"#)),
        (
            "Blend",
            format!(r#"<bsdf type="mask"><float name="opacity" value="0.5"/>{normals}</bsdf>"#),
        ),
        (
            "Blend",
            format!(
                r#"<bsdf type="blendbsdf"><float name="weight" value="0.5"/>{normals}<bsdf type="diffuse"/></bsdf>"#
            ),
        ),
    ] {
        let (Material::Relief { relief, base }, warnings) = material(&bsdf) else {
            panic!("no relief: {bsdf}")
        };
        assert!(matches!(
            *relief,
            Relief::Normals {
                scale: 1.0,
                follows_mirroring: false,
                ..
            }
        ));
        assert!(format!("{base:?}").starts_with(around), "{base:?}");
        assert!(
            warnings.iter().all(|w| !w.message.contains("map")),
            "{warnings:?}"
        );
    }
    let heights = r#"<bsdf type="bumpmap"><texture type="checkerboard" name="any"/><float name="scale" value="3"/>
        <bsdf type="diffuse"/></bsdf>"#;
    let (Material::Relief { relief, .. }, _) = material(heights) else {
        panic!("no relief")
    };
    assert!(matches!(*relief, Relief::Heights { scale: 3.0, .. }));
    let (_, warnings) = material(&format!(r#"<bsdf type="normalmap">{map}{normals}</bsdf>"#));
    assert!(
        warnings
            .iter()
            .any(|w| w.message.contains("the second is left out"))
    );
}

/// Spheres that are none any more, and textured ones that are turned, are meshes on the same
/// surface.
#[test]
fn ellipsoids_and_turned_globes_are_meshes() {
    let board = r#"<bsdf type="diffuse"><texture type="checkerboard" name="reflectance"/></bsdf>"#;
    let of = |bsdf: &str, steps: &str| {
        let text = format!(
            r#"<shape type="sphere"><float name="radius" value="2"/><transform name="to_world">{steps}</transform>{bsdf}</shape>"#
        );
        read(&text).description.shapes[0].geometry.clone()
    };
    let stretch = r#"<scale x="3"/><translate y="1"/>"#;
    let Geometry::Mesh(mesh) = of("", stretch) else {
        panic!("a mesh")
    };
    for position in &mesh.positions {
        let unit = (*position - Vec3::Y) / Vec3::new(6.0, 2.0, 2.0);
        assert!((unit.length() - 1.0).abs() < 1e-5);
    }
    let [a, b, c] = mesh.indices[500].map(|i| mesh.positions[i as usize]);
    assert!((b - a).cross(c - a).dot(a - Vec3::Y) > 0.0);
    assert!(matches!(
        of(board, r#"<rotate x="1" angle="90"/>"#),
        Geometry::Mesh(_)
    ));
    assert!(matches!(of(board, r#"<scale value="2"/>"#), Geometry::Sphere(_)));
}

#[test]
fn spectra_have_types() {
    let of = |spectrum: &str| {
        let text = format!(r#"<shape type="cube"><bsdf type="diffuse">{spectrum}</bsdf></shape>"#);
        match &read(&text).description.materials[0] {
            Material::Diffuse {
                reflectance: ColorTexture::Constant(color),
            } => *color,
            other => panic!("{other:?}"),
        }
    };
    let listed = of(r#"<spectrum name="reflectance" value="400:0.1, 500:0.8, 700:0.3"/>"#);
    let irregular = of(
        r#"<spectrum name="reflectance" type="irregular"><string name="wavelengths" value="400, 500, 700"/>
        <string name="values" value="0.1, 0.8, 0.3"/></spectrum>"#,
    );
    assert_eq!(irregular, listed);
    let regular = of(
        r#"<spectrum name="reflectance" type="regular"><float name="wavelength_min" value="400"/>
        <float name="wavelength_max" value="600"/><string name="values" value="0.1, 0.8, 0.3"/></spectrum>"#,
    );
    assert_eq!(
        regular,
        of(r#"<spectrum name="reflectance" value="400:0.1, 500:0.8, 600:0.3"/>"#)
    );
    let uniform =
        of(r#"<spectrum name="reflectance" type="uniform"><float name="value" value="0.25"/></spectrum>"#);
    assert_eq!(uniform, Rgb::splat(0.25));
    // A lamp of 2856 K (illuminant A) has the chromaticity (0.4476, 0.4074); one of 6500 K is
    // nearly white, and 5777 K have 26 MW/(m² sr µm) at 550 nm.
    let lamp = |temperature: u32| {
        let text = format!(
            r#"<emitter type="constant"><spectrum name="radiance" type="blackbody"><float name="temperature" value="{temperature}"/></spectrum></emitter>"#
        );
        match read(&text).description.emitters[0] {
            EmitterDescription::Constant { radiance } => radiance,
            ref other => panic!("{other:?}"),
        }
    };
    let rgb = lamp(2856);
    let x = 0.412_453 * rgb.x + 0.357_580 * rgb.y + 0.180_423 * rgb.z;
    let y = 0.212_671 * rgb.x + 0.715_160 * rgb.y + 0.072_169 * rgb.z;
    let z = 0.019_334 * rgb.x + 0.119_193 * rgb.y + 0.950_227 * rgb.z;
    let sum = x + y + z;
    assert!(
        (x / sum - 0.4476).abs() < 0.003 && (y / sum - 0.4074).abs() < 0.003,
        "{rgb}"
    );
    let white = lamp(6500);
    assert!(white.max_element() / white.min_element() < 1.1, "{white}");
    assert!((lamp(5777).y / 2.6e4 - 1.0).abs() < 0.05, "{}", lamp(5777));
}

/// Samplers, films and filters beside the sensor that refers to them, `True` for `true`.
#[test]
fn what_a_sensor_refers_to_is_its_own() {
    let body = r#"<sampler type="independent" id="s"><integer name="sample_count" value="7"/></sampler>
        <film type="hdrfilm" id="f"><integer name="width" value="5"/><integer name="height" value="3"/><ref id="r"/></film>
        <rfilter type="box" id="r"/><medium type="homogeneous" id="m"/>
        <sensor type="perspective"><ref id="s"/><ref id="f"/><ref id="m"/></sensor>
        <shape type="sphere"><boolean name="flip_normals" value="True"/></shape>"#;
    let loaded = read(body);
    let settings = loaded.description.settings;
    assert_eq!(
        [settings.width, settings.height, settings.samples_per_pixel],
        [5, 3, 7]
    );
    assert_eq!(loaded.description.camera_medium, Some(0));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let twice = body.replace(r#"<ref id="f"/>"#, r#"<ref id="f"/><ref id="f"/>"#);
    assert!(message(&twice).contains("a second <film>"));
    let missing = body.replace(r#"<ref id="s"/>"#, r#"<ref id="t"/>"#);
    assert!(message(&missing).contains("nothing has the id `t`"));
}

/// What is rendered otherwise than a file asks is said, and the rest goes on.
#[test]
fn what_changes_little_is_a_warning() {
    for (body, said) in [
        (
            r#"<integrator type="path"><boolean name="hide_emitters" value="true"/></integrator>"#,
            "emitters are seen",
        ),
        (
            r#"<sensor type="perspective"><film type="hdrfilm"><integer name="crop_width" value="3"/></film></sensor>"#,
            "the whole image",
        ),
        (
            r#"<sensor type="perspective"><film type="hdrfilm"><integer name="crop_width" value="3"/><integer name="crop_height" value="3"/><integer name="crop_offset_x" value="3"/></film></sensor>"#,
            "the whole image",
        ),
        (
            r#"<sensor type="perspective"><spectrum name="srf" type="d65"/></sensor>"#,
            "response by wavelength",
        ),
        (
            r#"<emitter type="spot"><texture name="texture" type="checkerboard"/></emitter>"#,
            "texture of a spot light",
        ),
        (
            r#"<sensor type="orthographic"><transform name="to_world"><scale value="2"/></transform></sensor>"#,
            "orthographic",
        ),
        (
            r#"<shape type="cube"><bsdf type="conductor"><string name="material" value="Cr"/></bsdf></shape>"#,
            "its reflectance alone",
        ),
        (
            r#"<shape type="cube"><bsdf type="polarizer"/></shape>"#,
            "no polarization",
        ),
    ] {
        let warnings = read(body).warnings;
        assert!(
            warnings.iter().any(|w| w.message.contains(said)),
            "{body}: {warnings:?}"
        );
    }
    let merged = read(r#"<shape type="merge"><shape type="cube"/><shape type="sphere"/></shape>"#);
    assert_eq!(merged.description.shapes.len(), 2);
}

/// An instance is what its shapes would be with both transforms.
#[test]
fn instances_are_copies_that_are_moved_twice() {
    let group = r#"<shape type="shapegroup" id="g"><shape type="rectangle"><transform name="to_world">
        <translate x="1"/></transform></shape><shape type="sphere"/></shape>"#;
    let placed = r#"<shape type="instance"><ref id="g"/><transform name="to_world"><scale value="2"/>
        <translate y="3"/></transform></shape>"#;
    let loaded = read(&format!("{group}{placed}{placed}"));
    assert_eq!(loaded.description.shapes.len(), 4);
    let direct = r#"<shape type="rectangle"><transform name="to_world"><translate x="1"/><scale value="2"/>
        <translate y="3"/></transform></shape>"#;
    let expected = read(direct);
    for copy in [0, 2] {
        assert_eq!(
            mesh(&loaded.description.shapes[copy]).positions,
            mesh(&expected.description.shapes[0]).positions
        );
    }
    let Geometry::Sphere(sphere) = loaded.description.shapes[1].geometry else {
        panic!("a sphere")
    };
    assert_eq!((sphere.center, sphere.radius), (Vec3::Y * 3.0, 2.0));
    assert!(read(group).description.shapes.is_empty());
    assert!(
        message(r#"<shape type="cube" id="c"/><shape type="instance"><ref id="c"/></shape>"#)
            .contains("shapegroup")
    );
}

/// Its area is the cylinder's, its normals point away from the axis.
#[test]
fn cylinders_have_the_area_of_cylinders() {
    let text = r#"<shape type="cylinder"><point name="p0" x="1" y="2" z="3"/><point name="p1" x="1" y="4" z="3"/>
        <float name="radius" value="0.5"/></shape>"#;
    let loaded = read(text);
    let mesh = mesh(&loaded.description.shapes[0]);
    let area: f32 = mesh
        .indices
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            0.5 * (b - a).cross(c - a).length()
        })
        .sum();
    assert!(
        (area / (std::f32::consts::TAU * 0.5 * 2.0) - 1.0).abs() < 1e-3,
        "{area}"
    );
    for (index, triangle) in mesh.indices.iter().enumerate() {
        let from_axis = (mesh.positions[triangle[0] as usize] - Vec3::new(1.0, 0.0, 3.0)).with_y(0.0);
        assert!(normal(mesh, index).dot(from_axis) > 0.0);
        assert!(mesh.normals[triangle[0] as usize].dot(from_axis) > 0.0);
    }
}

#[test]
fn top_level_samplers_and_references_to_emitters_are_read() {
    let emitter = r#"<shape type="cube"/><sampler type="independent"/>"#;
    assert_eq!(read(emitter).description.shapes.len(), 1);
    assert!(message(r#"<bsdf type="diffuse" id="d"/><ref id="d"/>"#).contains("cannot refer to <bsdf>"));
}
