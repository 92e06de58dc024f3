//! Scenes in strings: what they become, and what is said of those that cannot.

mod features;
mod stand_in;
mod zoo;

use super::*;
use crate::{
    Checkerboard, ColorTexture, EmitterDescription, FloatTexture, Geometry, Material, PhaseDescription,
    Projection, Relief, Rgb, ShapeDescription, TriangleMesh,
};
use glam::{Affine3A, Vec2, Vec3};
use proptest::prelude::*;

fn parse(body: &str) -> Result<Loaded, ImportError> {
    parse_mitsuba(
        &format!("<scene version=\"3.0.0\">{body}</scene>"),
        "dir/s.xml",
        &[],
    )
}

fn read(body: &str) -> Loaded {
    parse(body).unwrap_or_else(|e| panic!("{}", e.chain()))
}

fn message(body: &str) -> String {
    match parse(body) {
        Ok(_) => panic!("accepted: {body}"),
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
    (b - a).cross(c - a).normalize()
}

/// Where the transform takes (1, 2, 3), read off a camera-like point light.
fn transformed(steps: &str) -> Vec3 {
    let shape = format!(
        "<shape type=\"sphere\"><point name=\"center\" x=\"1\" y=\"2\" z=\"3\"/>\
         <transform name=\"to_world\">{steps}</transform></shape>"
    );
    match read(&shape).description.shapes[0].geometry {
        Geometry::Sphere(sphere) => sphere.center,
        _ => panic!("a sphere is no mesh"),
    }
}

#[test]
fn transforms_follow_hand_computed_matrices() {
    let cases = [
        ("", [1.0, 2.0, 3.0]),
        (r#"<translate x="1" z="-1"/>"#, [2.0, 2.0, 2.0]),
        (r#"<translate value="1, 2, 3"/>"#, [2.0, 4.0, 6.0]),
        (r#"<scale value="2"/>"#, [2.0, 4.0, 6.0]),
        (r#"<scale x="-1" y="-1" z="-1"/>"#, [-1.0, -2.0, -3.0]),
        // A quarter turn about +Y takes z to x and x to −z.
        (r#"<rotate y="1" angle="90"/>"#, [3.0, 2.0, -1.0]),
        (r#"<rotate value="0 0 1" angle="-90"/>"#, [2.0, -1.0, 3.0]),
        // A third of a turn about the diagonal takes x to y to z, whatever the axis's length.
        (r#"<rotate x="2" y="2" z="2" angle="120"/>"#, [3.0, 1.0, 2.0]),
        // Steps apply in the order in which they stand.
        (r#"<translate x="1"/><scale value="2"/>"#, [4.0, 4.0, 6.0]),
        (r#"<scale value="2"/><translate x="1"/>"#, [3.0, 4.0, 6.0]),
        (
            r#"<matrix value="0 2 0 10  2 0 0 20  0 0 -2 30  0 0 0 1"/>"#,
            [14.0, 22.0, 24.0],
        ),
        (r#"<matrix value="0 1 0 1 0 0 0 0 1"/>"#, [2.0, 1.0, 3.0]),
        // From (0, 0, 5) to the origin, +Y up: left is −X, forward −Z.
        (
            r#"<lookat origin="0,0,5" target="0,0,0" up="0,1,0"/>"#,
            [-1.0, 2.0, 2.0],
        ),
    ];
    for (steps, expected) in cases {
        let found = transformed(steps);
        assert!(
            found.abs_diff_eq(Vec3::from_array(expected), 1e-6),
            "{steps}: {found}"
        );
    }
}

#[test]
fn rectangles_face_their_normal_and_meshes_their_winding() {
    let rectangle = |extra: &str| {
        let scene = read(&format!("<shape type=\"rectangle\">{extra}</shape>")).description;
        let mesh = mesh(&scene.shapes[0]).clone();
        (normal(&mesh, 0), normal(&mesh, 1), mesh)
    };
    let (n0, n1, mesh0) = rectangle("");
    assert_eq!((n0, n1), (Vec3::Z, Vec3::Z));
    assert_eq!(mesh0.positions[2], Vec3::new(1.0, 1.0, 0.0));
    // Mitsuba's texture space has (0, 0) at (−1, −1); `v` here points the other way.
    assert_eq!(
        (mesh0.uvs[0], mesh0.uvs[2]),
        (Vec2::new(0.0, 1.0), Vec2::new(1.0, 0.0))
    );
    let mirror = r#"<transform name="to_world"><scale x="-1"/></transform>"#;
    let flip = r#"<boolean name="flip_normals" value="true"/>"#;
    assert_eq!(rectangle(mirror).0, Vec3::Z);
    assert_eq!(rectangle(flip).0, Vec3::NEG_Z);
    assert_eq!(rectangle(&format!("{mirror}{flip}")).0, Vec3::NEG_Z);
    // The light of the published scene "door ajar": two axes mirrored, facing −Z.
    let two = r#"<transform name="to_world"><scale x="0.7" y="-1.3" z="-1.9"/></transform>"#;
    assert_eq!(rectangle(two).0, Vec3::NEG_Z);

    let volume = |extra: &str| {
        let scene = read(&format!("<shape type=\"cube\">{extra}</shape>")).description;
        crate::builtin::signed_volume(mesh(&scene.shapes[0]))
    };
    assert_eq!(volume(""), 8.0);
    assert_eq!(volume(flip), -8.0);
    assert_eq!(volume(mirror), -8.0);
}

#[test]
fn disks_have_the_area_of_disks() {
    let scene = read(
        r#"<shape type="disk"><transform name="to_world"><scale value="2"/><rotate x="1" angle="-90"/></transform></shape>"#,
    );
    let mesh = mesh(&scene.description.shapes[0]);
    let area: f64 = mesh
        .indices
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        })
        .sum();
    assert!((area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-6, "{area}");
    assert!(normal(mesh, 7).abs_diff_eq(Vec3::Y, 1e-5));
    for position in &mesh.positions {
        let radius = position.length() / 2.0;
        assert!(radius == 0.0 || (radius - 1.0).abs() < 5e-4);
    }
}

#[test]
fn spheres_scale_alike_and_turn_inside_out_when_mirrored() {
    let sphere = |steps: &str| {
        let scene = read(&format!(
            "<shape type=\"sphere\"><float name=\"radius\" value=\"0.5\"/>\
             <transform name=\"to_world\">{steps}</transform></shape>"
        ));
        match scene.description.shapes[0].geometry {
            Geometry::Sphere(sphere) => (sphere.radius, sphere.flip_normals),
            _ => panic!("a sphere is no mesh"),
        }
    };
    assert_eq!(
        sphere(r#"<scale value="3"/><rotate x="1" angle="30"/>"#),
        (1.5, false)
    );
    assert_eq!(sphere(r#"<scale x="-3" y="3" z="3"/>"#), (1.5, true));
}

#[test]
fn cameras_and_fields_of_view() {
    let camera = |body: &str| {
        let film = r#"<film type="hdrfilm"><integer name="width" value="200"/><integer name="height" value="100"/><rfilter type="box"/></film>"#;
        read(&format!("<sensor type=\"perspective\">{body}{film}</sensor>"))
            .description
            .camera
    };
    let fov = |axis: &str| {
        let body = format!("<float name=\"fov\" value=\"90\"/><string name=\"fov_axis\" value=\"{axis}\"/>");
        f64::from((0.5 * camera(&body).fov_x).tan())
    };
    // At 90° the half extent is as long as the distance; the image is twice as wide as high.
    for (axis, expected) in [
        ("x", 1.0),
        ("y", 2.0),
        ("smaller", 2.0),
        ("larger", 1.0),
        ("diagonal", 2.0 / 5.0_f64.sqrt()),
    ] {
        assert!((fov(axis) - expected).abs() < 1e-5, "{axis}: {}", fov(axis));
    }
    // 50 mm against the diagonal of 36 mm × 24 mm, 43.27 mm.
    let focal = camera("<string name=\"focal_length\" value=\"50mm\"/>");
    assert!((f64::from((0.5 * focal.fov_x).tan()) - 0.432_666 * 2.0 / 5.0_f64.sqrt()).abs() < 1e-5);
    assert_eq!(camera("").fov_x, focal.fov_x);
    assert_eq!(focal.to_world, Affine3A::IDENTITY);
    assert_eq!(
        (focal.near_clip, focal.far_clip, focal.projection),
        (0.01, 1e4, Projection::Pinhole)
    );

    let lens = read(
        r#"<sensor type="thinlens"><float name="aperture_radius" value="0.1"/><float name="focus_distance" value="3"/>
           <float name="fov" value="45"/></sensor>"#,
    );
    let expected = Projection::ThinLens {
        aperture_radius: 0.1,
        focus_distance: 3.0,
    };
    assert_eq!(lens.description.camera.projection, expected);
    assert_eq!(
        (lens.description.settings.width, lens.description.settings.height),
        (768, 576)
    );
}

#[test]
fn another_filter_is_a_warning_that_names_its_place() {
    let loaded = read(
        "\n<sensor type=\"perspective\">\n<film type=\"hdrfilm\"><rfilter type=\"gaussian\"/></film></sensor>",
    );
    let [warning] = &loaded.warnings[..] else {
        panic!("{:?}", loaded.warnings)
    };
    assert_eq!(
        warning.to_string(),
        "dir/s.xml:3 (scene/sensor/film/rfilter): the film here uses a box instead of the filter `gaussian`"
    );
}

#[test]
fn integrators_and_depths() {
    let depth = |body: &str| {
        let settings = read(body).description.settings;
        (settings.max_depth, settings.roulette_depth)
    };
    assert_eq!(depth(""), (None, 5));
    assert_eq!(depth("<integrator type=\"direct\"/>"), (Some(2), 5));
    let path = |n: i32| {
        format!("<integrator type=\"volpath\"><integer name=\"max_depth\" value=\"{n}\"/></integrator>")
    };
    assert_eq!(depth(&path(-1)), (None, 5));
    assert_eq!(depth(&path(7)), (Some(7), 5));
}

#[test]
fn materials_carry_mitsubas_defaults() {
    let material = |bsdf: &str| {
        let scene = read(&format!("<shape type=\"sphere\">{bsdf}</shape>")).description;
        scene.materials[scene.shapes[0].material as usize].clone()
    };
    let constant = |texture: &ColorTexture| match texture {
        ColorTexture::Constant(rgb) => *rgb,
        other => panic!("{other:?}"),
    };
    match material("") {
        Material::Diffuse { reflectance } => assert_eq!(constant(&reflectance), Rgb::splat(0.5)),
        other => panic!("{other:?}"),
    }
    match material("<bsdf type=\"dielectric\"/>") {
        Material::Dielectric { eta, roughness, .. } => {
            assert_eq!(eta, 1.5046 / 1.000_277);
            assert!(roughness.is_none());
        }
        other => panic!("{other:?}"),
    }
    match material(
        r#"<bsdf type="roughplastic"><float name="int_ior" value="1.9"/><string name="ext_ior" value="water"/></bsdf>"#,
    ) {
        Material::Plastic {
            eta,
            roughness,
            nonlinear,
            diffuse_reflectance,
            ..
        } => {
            assert_eq!(eta, 1.9 / 1.333);
            assert!(!nonlinear);
            assert_eq!(constant(&diffuse_reflectance), Rgb::splat(0.5));
            let roughness = roughness.unwrap();
            assert_eq!(roughness.distribution, crate::Microfacet::Beckmann);
            assert!(matches!(roughness.alpha_u, FloatTexture::Constant(0.1)));
        }
        other => panic!("{other:?}"),
    }
    assert!(matches!(
        material("<bsdf type=\"conductor\"/>"),
        Material::Mirror { .. }
    ));
    match material(r#"<bsdf type="conductor"><string name="material" value="Au"/></bsdf>"#) {
        Material::Conductor { ior, .. } => assert_eq!(ior.eta.z, 1.442_48),
        other => panic!("{other:?}"),
    }
    match material(r##"<bsdf type="diffuse"><rgb name="reflectance" value="#ff8000"/></bsdf>"##) {
        Material::Diffuse { reflectance } => {
            let rgb = constant(&reflectance);
            assert!(
                (rgb - Rgb::new(1.0, 0.215_860_5, 0.0)).abs().max_element() < 1e-6,
                "{rgb}"
            );
        }
        other => panic!("{other:?}"),
    }
    let nested = r#"<bsdf type="twosided"><bsdf type="blendbsdf"><float name="weight" value="0.25"/>
        <bsdf type="diffuse"/><bsdf type="conductor"/></bsdf></bsdf>"#;
    match material(nested) {
        Material::TwoSided { front, back: None } => match *front {
            Material::Blend {
                weight: FloatTexture::Constant(0.25),
                first,
                second,
            } => {
                assert!(matches!(
                    (*first, *second),
                    (Material::Diffuse { .. }, Material::Mirror { .. })
                ));
            }
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    }
}

#[test]
fn references_share_one_material() {
    let scene = read(
        r#"<shape type="sphere"><ref id="red"/></shape>
           <bsdf type="twosided" id="both"><ref id="red"/></bsdf>
           <bsdf type="diffuse" id="red"><rgb name="reflectance" value="1 0 0"/></bsdf>
           <shape type="cube" id="box"><ref name="bsdf" id="red"/></shape>
           <shape type="cube"><ref id="both"/><emitter type="area"><spectrum name="radiance" value="2"/></emitter></shape>"#,
    )
    .description;
    let materials: Vec<u32> = scene.shapes.iter().map(|s| s.material).collect();
    assert_eq!(materials, [0, 0, 1]);
    assert_eq!(scene.materials.len(), 2);
    assert_eq!(
        (scene.shapes[1].name.as_str(), scene.shapes[2].emission),
        ("box", Some(Rgb::splat(2.0)))
    );
}

#[test]
fn checkerboards_keep_their_own_texture_space() {
    let scene = read(
        r#"<shape type="rectangle"><bsdf type="diffuse"><texture type="checkerboard" name="reflectance">
           <rgb name="color1" value="1"/><transform name="to_uv"><scale x="20" y="80"/><translate x="0.5"/></transform>
           </texture></bsdf></shape>"#,
    )
    .description;
    let Material::Diffuse {
        reflectance:
            ColorTexture::Checkerboard(Checkerboard {
                color0,
                color1,
                to_uv,
            }),
    } = scene.materials[0]
    else {
        panic!("{:?}", scene.materials)
    };
    assert_eq!((color0, color1), (Rgb::splat(0.4), Rgb::ONE));
    assert_eq!(to_uv.transform_point2(Vec2::new(0.25, 0.5)), Vec2::new(5.5, 40.0));
}

#[test]
fn emitters_of_every_kind() {
    let emitters = read(
        r#"<emitter type="point"><point name="position" value="1 2 3"/><rgb name="intensity" value="4"/></emitter>
           <emitter type="point"><transform name="to_world"><translate y="2"/></transform></emitter>
           <emitter type="spot"><transform name="to_world"><lookat origin="0 5 0" target="0 0 0" up="0 0 1"/></transform>
             <float name="cutoff_angle" value="40"/></emitter>
           <emitter type="directional"><vector name="direction" x="0" y="-3" z="0"/>
             <rgb name="irradiance" value="1 2 3"/></emitter>
           <emitter type="constant"/>"#,
    )
    .description
    .emitters;
    match emitters[..] {
        [
            EmitterDescription::Point {
                position: a,
                intensity,
            },
            EmitterDescription::Point { position: b, .. },
            EmitterDescription::Spot {
                position: c,
                direction: d,
                beam_width,
                cutoff_angle,
                ..
            },
            EmitterDescription::Directional {
                direction: e,
                irradiance,
            },
            EmitterDescription::Constant { radiance },
        ] => {
            assert_eq!((a, intensity), (Vec3::new(1.0, 2.0, 3.0), Rgb::splat(4.0)));
            assert_eq!((b, c, d), (Vec3::Y * 2.0, Vec3::Y * 5.0, Vec3::NEG_Y));
            assert_eq!(
                (beam_width, cutoff_angle),
                (30.0_f32.to_radians(), 40.0_f32.to_radians())
            );
            assert_eq!(
                (e, irradiance, radiance),
                (Vec3::NEG_Y, Rgb::new(1.0, 2.0, 3.0), Rgb::ONE)
            );
        }
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn definitions_chain_and_the_callers_win() {
    let text = r#"<scene version="3.0.0"><default name="n" value="7"/><default name="m" value="1$n"/>
        <integrator type="path"><integer name="max_depth" value="$m"/></integrator></scene>"#;
    let depth = |defines: &[(&str, &str)]| {
        let defines: Vec<_> = defines
            .iter()
            .map(|(k, v)| (k.to_string(), v.to_string()))
            .collect();
        parse_mitsuba(text, "s.xml", &defines).map(|loaded| loaded.description.settings.max_depth)
    };
    assert_eq!(depth(&[]).unwrap(), Some(17));
    assert_eq!(depth(&[("n", "5")]).unwrap(), Some(15));
    assert_eq!(depth(&[("m", "-1")]).unwrap(), None);
    let unused = depth(&[("n", "5"), ("x", "1")]).unwrap_err();
    assert!(
        matches!(unused, ImportError::UnusedDefine { ref name, .. } if name == "x"),
        "{unused}"
    );
}

const WHOLE: &str = r##"<scene version="3.0.0"><default name="d" value="4"/><!-- all kinds -->
<integrator type="path"><integer name="max_depth" value="$d"/></integrator>
<sensor type="thinlens"><float name="aperture_radius" value="0.1"/><transform name="to_world"><rotate y="1" angle="30"/></transform>
<film type="hdrfilm"><integer name="width" value="8"/><rfilter type="box"/></film></sensor>
<bsdf type="roughdielectric" id="g"><float name="alpha" value="0.2"/></bsdf>
<shape type="sphere"><ref id="g"/></shape><shape type="disk"><emitter type="area"/></shape>
<shape type="cube"><bsdf type="diffuse"><rgb name="reflectance" value="#102030"/></bsdf></shape></scene>"##;

#[test]
fn every_proper_prefix_is_an_error() {
    assert!(parse_mitsuba(WHOLE, "s.xml", &[]).is_ok());
    for (end, _) in WHOLE.char_indices() {
        assert!(
            parse_mitsuba(&WHOLE[..end], "s.xml", &[]).is_err(),
            "prefix of {end} bytes"
        );
    }
}

proptest! {
    #[test]
    fn damaged_scenes_never_panic(
        cuts in proptest::collection::vec((any::<prop::sample::Index>(), "[ -~]{0,3}"), 1..4)
    ) {
        let mut text = WHOLE.to_owned();
        for (at, new) in cuts {
            let at = at.index(text.len());
            if text.is_char_boundary(at) && text.is_char_boundary(at + 1) {
                text.replace_range(at..at + 1, &new);
            }
        }
        if let Ok(loaded) = parse_mitsuba(&text, "s.xml", &[]) {
            let finite = |shape: &ShapeDescription| match &shape.geometry {
                Geometry::Mesh(mesh) => mesh.positions.iter().all(|p| p.is_finite()),
                Geometry::Sphere(sphere) => sphere.center.is_finite() && sphere.radius > 0.0,
                Geometry::Instances(instances) => instances.box_corners().all(|p| p.is_finite()),
            };
            prop_assert!(loaded.description.shapes.iter().all(finite));
            prop_assert!(loaded.description.camera.to_world.is_finite());
        }
    }
}

#[test]
fn media_are_read_once_and_bound_by_shapes() {
    let scene = read(
        r#"<medium type="homogeneous" id="fog"><rgb name="sigma_t" value="1 2 3"/><float name="scale" value="2"/>
             <phase type="blendphase"><float name="weight" value="0.25"/><phase type="hg"/><phase type="rayleigh"/></phase>
           </medium>
           <medium type="heterogeneous" id="unused"><volume name="albedo" type="constvolume"><float name="value" value="0"/></volume></medium>
           <shape type="cube"><bsdf type="null"/><ref name="interior" id="fog"/></shape>
           <shape type="rectangle"/>
           <shape type="sphere"><bsdf type="null"/><ref name="exterior" id="fog"/>
             <medium type="homogeneous" name="interior"/></shape>
           <sensor type="perspective"><ref id="fog"/></sensor>"#,
    )
    .description;
    let [fog, inner] = &scene.media[..] else {
        panic!("{} media", scene.media.len());
    };
    assert_eq!(
        (&fog.name[..], fog.extinction, fog.albedo),
        ("fog", Rgb::new(2.0, 4.0, 6.0), Rgb::splat(0.75))
    );
    let blend = PhaseDescription::Blend {
        first: Box::new(PhaseDescription::HenyeyGreenstein { g: 0.8 }),
        second: Box::new(PhaseDescription::Draine { g: 0.0, alpha: 1.0 }),
        share: 0.25,
    };
    assert_eq!(fog.phase, blend);
    assert_eq!((&inner.name[..], inner.extinction), ("homogeneous 1", Rgb::ONE));
    let sides = scene.boundaries.iter().map(|b| (b.shape, b.interior, b.exterior));
    assert_eq!(
        sides.collect::<Vec<_>>(),
        [(0, Some(0), None), (2, Some(1), Some(0))]
    );
    assert_eq!(scene.camera_medium, Some(0));
    assert!(matches!(
        scene.materials[scene.shapes[0].material as usize],
        Material::Null
    ));
}

#[test]
fn integrators_that_wrap_others_are_looked_into() {
    for wrapper in ["moment", "aov", "stokes"] {
        let inner = r#"<integrator type="volpath"><integer name="max_depth" value="7"/></integrator>"#;
        let wrapped = read(&format!(r#"<integrator type="{wrapper}">{inner}</integrator>"#));
        assert_eq!(wrapped.description.settings.max_depth, Some(7), "{wrapper}");
    }
    let other = read(r#"<integrator type="moment"><integrator type="bdpt"/></integrator>"#);
    assert!(
        other
            .warnings
            .iter()
            .any(|warning| warning.to_string().contains("`bdpt`"))
    );
}

#[test]
fn old_files_are_sent_to_the_upgrade() {
    let error = parse_mitsuba("<scene version=\"0.5.0\"/>", "a.xml", &[]).unwrap_err();
    assert!(error.chain().contains("mitsuba --update"), "{}", error.chain());
}
