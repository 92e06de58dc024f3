//! Scenes in strings: what they become, and what is said of those that cannot.

use super::*;
use crate::{EmitterDescription, Geometry, Ray, Rgb, Scene, TriangleMesh};
use glam::{Vec2, Vec3};
use lightshed_testkit::check_faults;
use proptest::prelude::*;

fn parse(text: &str) -> Result<Loaded, ImportError> {
    parse_pbrt(text, "dir/s.pbrt", &LoadLimits::default())
}

fn read(text: &str) -> Loaded {
    parse(text).unwrap_or_else(|error| panic!("{}", error.chain()))
}

fn message(text: &str) -> String {
    match parse(text) {
        Ok(_) => panic!("accepted: {text}"),
        Err(error) => error.chain(),
    }
}

fn mesh(shape: &ShapeDescription) -> &TriangleMesh {
    match &shape.geometry {
        Geometry::Mesh(mesh) => mesh,
        _ => panic!("{} is no mesh", shape.name),
    }
}

const TRIANGLE: &str = r#"Shape "trianglemesh" "point3 P" [0 0 0  1 0 0  0 1 0] "integer indices" [0 1 2]"#;

/// A camera at (0, 0, −5) that looks at a lamp to the upper right: pbrt's +X is to the right of
/// the image where it looks along +Z.
#[test]
fn what_is_right_is_right() {
    let text = r#"LookAt 0 0 -5  0 0 0  0 1 0
        Camera "perspective" "float fov" 60
        Film "rgb" "integer xresolution" 200 "integer yresolution" [100]
        Integrator "volpath" "integer maxdepth" 7
        Sampler "zsobol" "integer pixelsamples" [ 32 ]
        WorldBegin
        AttributeBegin
            AreaLightSource "diffuse" "rgb L" [1 2 3] "float scale" 2
            Translate 2 1 0
            Shape "sphere" "float radius" 0.25
        AttributeEnd"#;
    check_faults(&["camera mirrored"], |fault| {
        let mut loaded = read(text);
        if fault.is_some() {
            let axes = &mut loaded.description.camera.to_world.matrix3;
            axes.x_axis = -axes.x_axis;
        }
        let settings = loaded.description.settings;
        assert_eq!(
            (
                settings.width,
                settings.height,
                settings.samples_per_pixel,
                settings.max_depth
            ),
            (200, 100, 32, Some(8))
        );
        let scene = Scene::new(&loaded.description).unwrap();
        // tan 30° = 0.577 is the upper edge, at 50 pixels from the middle: 2/5 and 1/5 from it.
        let per_pixel = 30.0_f32.to_radians().tan() / 50.0;
        let pixel = Vec2::new(100.0 + 0.4 / per_pixel, 50.0 - 0.2 / per_pixel);
        let seen = scene.intersect(&scene.camera().ray(pixel, [0.5; 2]));
        let shape = &loaded.description.shapes[0];
        assert_eq!(shape.emission, Some(Rgb::new(2.0, 4.0, 6.0)));
        seen.map(|_| ()).ok_or_else(|| "the lamp is elsewhere".to_owned())
    })
    .unwrap();
}

#[test]
fn transforms_follow_each_other_from_the_inside_out() {
    let moved = |directives: &str| {
        let text = format!("WorldBegin {directives} {TRIANGLE}");
        mesh(&read(&text).description.shapes[0]).positions[1]
    };
    for (directives, expected) in [
        ("", Vec3::X),
        ("Translate 1 2 3 Scale 2 1 1", Vec3::new(3.0, 2.0, 3.0)),
        ("Scale 2 1 1 Translate 1 2 3", Vec3::new(4.0, 2.0, 3.0)),
        ("Rotate 90 0 0 1", Vec3::Y),
        (
            "Transform [0 1 0 0  -1 0 0 0  0 0 1 0  5 6 7 1]",
            Vec3::new(5.0, 7.0, 7.0),
        ),
        (
            "Translate 1 0 0 ConcatTransform [2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1]",
            Vec3::new(3.0, 0.0, 0.0),
        ),
        ("AttributeBegin Scale 9 9 9 AttributeEnd", Vec3::X),
        (
            "CoordinateSystem \"a\" Scale 9 9 9 CoordSysTransform \"a\"",
            Vec3::X,
        ),
        ("Scale 9 9 9 Identity", Vec3::X),
    ] {
        let found = moved(directives);
        assert!(found.abs_diff_eq(expected, 1e-5), "{directives}: {found}");
    }
}

/// Where the front is: by the winding, the other way round with `ReverseOrientation`, and kept by
/// maps that mirror.
#[test]
fn fronts_turn_as_they_should() {
    let front = |directives: &str| {
        let loaded = read(&format!("WorldBegin {directives} {TRIANGLE}"));
        let mesh = mesh(&loaded.description.shapes[0]);
        let [a, b, c] = mesh.indices[0].map(|i| mesh.positions[i as usize]);
        (b - a).cross(c - a).normalize()
    };
    assert_eq!(front(""), Vec3::Z);
    assert_eq!(front("ReverseOrientation"), Vec3::NEG_Z);
    assert_eq!(front("Scale -1 1 1"), Vec3::Z);
    assert_eq!(front("Scale -1 1 1 ReverseOrientation"), Vec3::NEG_Z);
}

#[test]
fn objects_are_placed_again() {
    let text = format!(
        r#"WorldBegin ObjectBegin "o" Translate 1 0 0 {TRIANGLE} Shape "sphere" ObjectEnd
        AttributeBegin Translate 0 5 0 ObjectInstance "o" AttributeEnd
        Scale 2 2 2 ObjectInstance "o" Scale 1 3 1 ObjectInstance "o""#
    );
    let shapes = read(&text).description.shapes;
    assert_eq!(shapes.len(), 6);
    assert_eq!(mesh(&shapes[0]).positions[1], Vec3::new(2.0, 5.0, 0.0));
    assert_eq!(mesh(&shapes[2]).positions[1], Vec3::new(4.0, 0.0, 0.0));
    let Geometry::Sphere(sphere) = &shapes[3].geometry else {
        panic!("a sphere")
    };
    assert_eq!((sphere.center, sphere.radius), (Vec3::X * 2.0, 2.0));
    // No sphere any more.
    mesh(&shapes[5]);
}

#[test]
fn materials_are_those_that_are_here() {
    let of = |material: &str| {
        let text = format!("WorldBegin {material} {TRIANGLE}");
        read(&text)
            .description
            .materials
            .last()
            .cloned()
            .expect("there is one")
    };
    let inner = |material: Material| match material {
        Material::TwoSided { front, back: None } => *front,
        other => panic!("{other:?}"),
    };
    assert!(matches!(
        inner(of(r#"Material "diffuse" "rgb reflectance" [0.1 0.2 0.3]"#)),
        Material::Diffuse { reflectance: ColorTexture::Constant(color) } if color == Rgb::new(0.1, 0.2, 0.3)
    ));
    // α is the root of the roughness, unless told otherwise.
    let alpha = |text: &str| match of(text) {
        Material::Dielectric { eta, roughness, .. } => (eta, roughness.map(|r| r.alpha_u.mean())),
        other => panic!("{other:?}"),
    };
    assert_eq!(
        alpha(r#"Material "dielectric" "float roughness" 0.25"#),
        (1.5, Some(0.5))
    );
    assert_eq!(
        alpha(r#"Material "dielectric" "float roughness" 0.25 "bool remaproughness" false "float eta" 1.25"#),
        (1.25, Some(0.25))
    );
    assert_eq!(
        alpha(r#"Material "dielectric" "spectrum eta" "glass-BK7""#),
        (1.5168, None)
    );
    assert!(matches!(
        inner(of(r#"Material "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k""#)),
        Material::Conductor { ior, roughness: None, .. } if ior.eta.z > ior.eta.x
    ));
    assert!(matches!(
        inner(of(r#"Material "coateddiffuse" "float roughness" 0.01"#)),
        Material::Plastic {
            roughness: Some(_),
            nonlinear: true,
            ..
        }
    ));
    assert!(matches!(of(r#"Material "interface""#), Material::Null));
    let named = r#"MakeNamedMaterial "a" "string type" "diffuse" MakeNamedMaterial "b" "string type" "thindielectric"
        Material "mix" "string materials" ["a" "b"] "float amount" 0.25"#;
    assert!(matches!(
        of(named),
        Material::Blend { weight: FloatTexture::Constant(0.25), second, .. } if matches!(*second, Material::ThinDielectric { .. })
    ));
    let board = r#"Texture "t" "spectrum" "checkerboard" "rgb tex1" [1 0 0] "float uscale" 4 "float vscale" 4
        Material "diffuse" "texture reflectance" "t""#;
    let Material::Diffuse { reflectance } = inner(of(board)) else {
        panic!("diffuse")
    };
    // Squares are as large as the unit of texture coordinates: a fourth of the mesh.
    let red = |u: f32, v: f32| reflectance.at(Vec2::new(u, v)).y == 0.0;
    assert_eq!(red(0.1, 0.1), red(0.3, 0.3));
    assert_ne!(red(0.1, 0.1), red(0.3, 0.1));
    let holes = format!(r#"WorldBegin {} "float alpha" 0.5"#, TRIANGLE);
    assert!(matches!(
        read(&holes).description.materials.last(),
        Some(Material::Blend {
            weight: FloatTexture::Constant(0.5),
            ..
        })
    ));
}

#[test]
fn lights_and_media() {
    let text = r#"MakeNamedMedium "fog" "string type" "uniformgrid" "rgb sigma_a" [1 1 1] "rgb sigma_s" [3 3 3]
            "integer nx" 2 "integer ny" 1 "integer nz" 1 "float density" [0.5 1] "point3 p1" [2 1 1]
        WorldBegin
        LightSource "point" "rgb I" [1 2 3] "point3 from" [1 0 0]
        LightSource "distant" "blackbody L" 6500 "float scale" 3 "point3 from" [0 1 0] "point3 to" [0 0 0]
        LightSource "infinite" "rgb L" 0.5
        LightSource "spot" "float coneangle" 40 "point3 to" [0 0 -2]
        MediumInterface "fog" ""
        Material "interface" Shape "sphere" "float radius" 3"#;
    let scene = read(text).description;
    let [
        EmitterDescription::Point { position, intensity },
        EmitterDescription::Directional {
            direction,
            irradiance,
        },
        EmitterDescription::Constant { radiance },
        EmitterDescription::Spot {
            direction: axis,
            beam_width,
            ..
        },
    ] = &scene.emitters[..]
    else {
        panic!("{:?}", scene.emitters)
    };
    assert_eq!((*position, *intensity), (Vec3::X, Rgb::new(1.0, 2.0, 3.0)));
    assert_eq!((*direction, *axis), (Vec3::NEG_Y, Vec3::NEG_Z));
    assert!((crate::luminance(*irradiance) - 3.0).abs() < 1e-4, "{irradiance}");
    assert_eq!(*radiance, Rgb::splat(0.5));
    assert!((beam_width.to_degrees() - 35.0).abs() < 1e-4);
    assert_eq!(
        (scene.media[0].extinction, scene.media[0].albedo),
        (Rgb::splat(4.0), Rgb::splat(0.75))
    );
    assert_eq!(
        scene.boundaries,
        [crate::MediumBoundary {
            shape: 0,
            interior: Some(0),
            exterior: None
        }]
    );
    assert!(Scene::new(&scene).is_ok());
    // A ray down onto the boundary starts outside of the fog.
    let built = Scene::new(&scene).unwrap();
    assert!(built.occluded(&Ray::new(Vec3::Z * 9.0, Vec3::NEG_Z)));
    assert_eq!(built.medium_around(Vec3::Z * 9.0), None);
    assert_eq!(built.medium_around(Vec3::ZERO), Some(0));
}

#[test]
fn what_is_unknown_is_left_out_by_name() {
    for (text, expected) in [
        ("Shape \"torus\"", "the shape `torus` is not supported"),
        ("LightSource \"laser\"", "the light `laser` is not supported"),
        (
            "LightSource \"infinite\" \"string filename\" \"no.exr\"",
            "a light from all around is left out: ",
        ),
        (
            "Texture \"a\" \"spectrum\" \"imagemap\" \"string filename\" \"no.png\"",
            "grey is taken for an image: cannot read dir/no.png",
        ),
    ] {
        let loaded = read(&format!("WorldBegin\n{text}\nShape \"sphere\""));
        let warnings: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
        let found = warnings.iter().any(|warning| warning.contains(expected));
        assert!(found, "{text}: {warnings:?} lack {expected:?}");
    }
}

#[test]
fn everything_wrong_is_named() {
    for (text, expected) in [
        (
            "Wibble",
            "s.pbrt:1 (Wibble): the directive `Wibble` is not supported",
        ),
        (
            "\nTranslate 1 2",
            "s.pbrt:2 (Translate): expected 3 finite numbers",
        ),
        ("Translate 1 2 inf", "expected 3 finite numbers"),
        ("[1]", "a value without a directive"),
        ("AttributeEnd", "nothing has begun"),
        ("AttributeBegin", "does not end"),
        ("LookAt 0 0 0 0 0 0 0 1 0", "coincide"),
        ("Rotate 3 0 0 0", "no length"),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0]",
            "`P` is not a list of points",
        ),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0] \"integer indices\" [0 0 7]",
            "index 7 of 1 vertices",
        ),
        (
            "Shape \"sphere\" \"float radius\" -1",
            "`radius` must be positive",
        ),
        ("Shape \"sphere\" \"float\" 1", "no type and name"),
        ("Shape \"sphere\" \"float radius\" [1", "without its end"),
        ("Material \"velvet\"", "the material `velvet` is not supported"),
        ("NamedMaterial \"x\"", "no material is named `x`"),
        ("MediumInterface \"x\"", "no medium is named `x`"),
        ("ObjectInstance \"x\"", "no object is named `x`"),
        ("Include \"no.pbrt\"", "cannot read dir/no.pbrt"),
        ("Include \"../../etc/passwd\"", "passwd"),
        ("Texture \"a\" \"colour\" \"constant\"", "no kind of texture"),
        ("Film \"rgb\" \"integer xresolution\" 0", "a positive integer"),
        ("\"", "without its end"),
        (
            "Material \"diffuse\" \"rgb reflectance\" [1 -1 1]",
            "negative component",
        ),
        (
            "MakeNamedMedium \"a\" \"string type\" \"uniformgrid\" \"float density\" [1 2]",
            "2 densities for 1 voxels",
        ),
    ] {
        let found = message(text);
        assert!(found.contains(expected), "{text}: {found:?} lacks {expected:?}");
    }
}

proptest! {
    #[test]
    fn damaged_scenes_never_panic(
        cuts in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)
    ) {
        let mut bytes = format!(
            r#"LookAt 0 0 5 0 0 0 0 1 0 Camera "perspective" "float fov" [45]
            WorldBegin AttributeBegin AreaLightSource "diffuse" "rgb L" [1 2 3] Rotate 9 1 0 0 {TRIANGLE} AttributeEnd
            Material "conductor" "float roughness" 0.1 ObjectBegin "a" Shape "sphere" ObjectEnd ObjectInstance "a""#
        ).into_bytes();
        for (at, new) in cuts {
            let at = at.index(bytes.len());
            bytes[at] = new;
        }
        if let Ok(text) = std::str::from_utf8(&bytes)
            && let Ok(loaded) = parse_pbrt(text, "no/such/folder/s.pbrt", &LoadLimits::default())
        {
            let _ = Scene::new(&loaded.description);
        }
    }
}

/// Options with and without a type, and lights that stand for others.
#[test]
fn options_and_lights_with_images_are_read() {
    let loaded = read(
        r#"Option "disablepixeljitter" true
        Option "string rendercoordsys" "world"
        WorldBegin
        Translate 0 0 3
        LightSource "goniometric" "string filename" "a.png" "rgb I" [1 2 3]
        LightSource "projection" "string filename" "a.png" "float fov" 60
        Shape "sphere""#,
    );
    match loaded.description.emitters[..] {
        [
            EmitterDescription::Point { position, intensity },
            EmitterDescription::Spot {
                direction,
                cutoff_angle,
                ..
            },
        ] => {
            assert_eq!((position, direction), (Vec3::Z * 3.0, Vec3::Z));
            assert_eq!(intensity, Rgb::new(1.0, 2.0, 3.0));
            assert!((cutoff_angle - 30_f32.to_radians()).abs() < 1e-6);
        }
        ref other => panic!("{other:?}"),
    }
    assert!(loaded.warnings.iter().any(|w| w.message.contains("goniometric")));
}
