//! Every published scene that should load does, with the counts that its files hold.
//!
//! The scenes are no part of this repository: the folder is named by `LIGHTSHED_SCENES`.

use lightshed_scene::glam::Vec3;
use lightshed_scene::import::{Encoding, LoadLimits, load, parse_mitsuba_with, read_image, read_ply};
use lightshed_scene::{
    ColorTexture, DensityDescription, EmitterDescription, Geometry, Material, Scene, SceneDescription,
    builtin,
};
use std::path::PathBuf;

fn scenes() -> Option<PathBuf> {
    let folder = std::env::var_os("LIGHTSHED_SCENES").map(PathBuf::from);
    if folder.is_none() {
        println!("SKIPPED: LIGHTSHED_SCENES is not set");
    }
    folder
}

/// Triangles, emissive triangles, points, directional lights, environments.
fn counts(scene: &SceneDescription) -> [usize; 5] {
    let mut counts = [0; 5];
    for shape in &scene.shapes {
        let Geometry::Mesh(mesh) = &shape.geometry else {
            continue;
        };
        counts[0] += mesh.indices.len();
        if shape.emission.is_some() {
            counts[1] += mesh.indices.len();
        }
        assert!(mesh.normals.is_empty() || mesh.normals.len() == mesh.positions.len());
        assert!(mesh.uvs.is_empty() || mesh.uvs.len() == mesh.positions.len());
    }
    for emitter in &scene.emitters {
        counts[match emitter {
            EmitterDescription::Point { .. } | EmitterDescription::Spot { .. } => 2,
            EmitterDescription::Directional { .. } => 3,
            EmitterDescription::Constant { .. } | EmitterDescription::Environment(_) => 4,
        }] += 1;
    }
    counts
}

#[test]
fn counts_are_those_of_the_files() {
    let Some(folder) = scenes() else { return };
    let cases = [
        ("cornell/scene.xml", [36, 2, 0, 0, 0]),
        ("cornell_rough/scene.xml", [36, 2, 0, 0, 0]),
        ("many_lights_1000/scene.xml", [2 + 40 * 12 + 4000, 4000, 0, 0, 0]),
        ("environment/scene.xml", [14, 0, 0, 0, 1]),
        ("veach_ajar/scene.xml", [382_690, 2, 0, 0, 0]),
        ("classroom/scene.xml", [583_833, 20_166, 7, 1, 0]),
        ("oacmpctf3/scene.xml", [104_293, 69_380, 1_916, 0, 0]),
        ("oacmpdm9/scene.xml", [42_457, 2_336, 891, 0, 0]),
        ("sponza_crytek/scene.xml", [262_167, 0, 0, 1, 1]),
    ];
    for (file, expected) in cases {
        let loaded = load(folder.join(file), &[]).unwrap_or_else(|e| panic!("{}", e.chain()));
        assert_eq!(counts(&loaded.description), expected, "{file}");
        assert_eq!(loaded.warnings, [], "{file}");
        // Those that build quickly are held to the scene's own checks.
        if expected[0] < 10_000 {
            assert!(Scene::new(&loaded.description).is_ok(), "{file}");
        }
        for shape in &loaded.description.shapes {
            assert!((shape.material as usize) < loaded.description.materials.len());
        }
    }
}

/// The suite's scenes name their files from the folder above, where they were rendered.
#[test]
fn the_reference_suite_loads() {
    let Some(folder) = scenes() else { return };
    let suite = folder.join("ignis_reference_suite/evaluation");
    let limits = LoadLimits {
        folders: vec![folder.join("ignis_reference_suite")],
        ..LoadLimits::default()
    };
    let cases = [
        ("emissive-plane", [4, 2, 0, 0, 0]),
        ("emissive-plane-scale", [4, 2, 0, 0, 0]),
        ("env", [2, 0, 0, 0, 1]),
        ("multilight", [4, 2, 2, 0, 1]),
        ("plane", [2, 0, 0, 0, 1]),
        ("point", [2, 0, 1, 0, 0]),
        ("room", [28, 0, 0, 0, 1]),
        ("sphere-light", [16_130, 16_128, 0, 0, 0]),
    ];
    for (name, expected) in cases {
        let file = format!("{name}.xml");
        let text = std::fs::read_to_string(suite.join("mitsuba").join(&file)).unwrap();
        let loaded = parse_mitsuba_with(&text, suite.join(&file), &[], &limits)
            .unwrap_or_else(|e| panic!("{}", e.chain()));
        assert_eq!(counts(&loaded.description), expected, "{name}");
        assert_eq!(loaded.warnings, [], "{name}");
    }
}

#[test]
fn a_medium_in_a_grid_is_read() {
    let Some(folder) = scenes() else { return };
    let loaded = load(folder.join("blob_volume/scene.xml"), &[]).unwrap_or_else(|e| panic!("{}", e.chain()));
    let scene = &loaded.description;
    let [medium] = &scene.media[..] else {
        panic!("{} media", scene.media.len());
    };
    assert_eq!(medium.extinction, lightshed_scene::Rgb::splat(8.0));
    let DensityDescription::Grid(grid) = &medium.density else {
        panic!("no grid");
    };
    assert_eq!((grid.resolution, grid.values.len()), ([32; 3], 32_768));
    // The unit cube becomes the cube of edge 2 around the origin.
    assert_eq!(grid.to_world.transform_point3(Vec3::ONE), Vec3::ONE);
    assert_eq!(scene.boundaries.len(), 1);
    Scene::new(scene).unwrap();
}

#[test]
fn definitions_replace_defaults() {
    let Some(folder) = scenes() else { return };
    let define = |name: &str, value: &str| (name.to_owned(), value.to_owned());
    let defines = [
        define("spp", "3"),
        define("resx", "20"),
        define("max_depth", "-1"),
    ];
    let settings = load(folder.join("cornell/scene.xml"), &defines)
        .unwrap()
        .description
        .settings;
    assert_eq!(
        (settings.samples_per_pixel, settings.width, settings.height),
        (3, 20, 256)
    );
    assert_eq!((settings.max_depth, settings.roulette_depth), (None, 1000));
    let message = load(folder.join("cornell/scene.xml"), &[define("sp", "3")])
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("the definition of `sp` is used nowhere"),
        "{message}"
    );
}

#[test]
fn the_built_in_cornell_box_is_the_published_one() {
    let Some(folder) = scenes() else { return };
    let theirs = load(folder.join("cornell/scene.xml"), &[]).unwrap().description;
    let ours = builtin::cornell();
    assert_eq!(ours.settings, theirs.settings);
    assert_eq!(ours.camera.to_world, theirs.camera.to_world);
    assert!((ours.camera.fov_x - theirs.camera.fov_x).abs() < 1e-7);
    assert_eq!(
        (ours.camera.near_clip, ours.camera.far_clip),
        (theirs.camera.near_clip, theirs.camera.far_clip)
    );
    for (a, b) in ours.shapes.iter().zip(&theirs.shapes) {
        assert_eq!((&a.name, a.emission), (&b.name, b.emission));
        let reflectance = |scene: &SceneDescription, index: u32| match scene.materials[index as usize] {
            Material::Diffuse {
                reflectance: ColorTexture::Constant(rgb),
            } => rgb,
            ref other => panic!("{other:?}"),
        };
        assert_eq!(
            reflectance(&ours, a.material),
            reflectance(&theirs, b.material),
            "{}",
            a.name
        );
    }
}

#[test]
fn every_published_mesh_and_image_is_read() {
    let Some(folder) = scenes() else { return };
    for file in ["dragon_vrip.ply", "dragon_vrip_res3.ply", "dragon_vrip_res4.ply"] {
        let triangles = read_ply(folder.join("stanford_dragon").join(file))
            .unwrap()
            .indices
            .len();
        let expected = [871_414, 47_794, 11_102];
        assert!(expected.contains(&triangles), "{file}: {triangles}");
    }
    let arch = read_ply(folder.join("san_miguel/objects_arch.ply")).unwrap();
    assert_eq!(arch.indices.len(), 650_793);
    for file in ["studio_1k.hdr", "sunset_1k.hdr", "courtyard_1k.hdr"] {
        let image = read_image(folder.join("hdri").join(file), Encoding::Srgb).unwrap();
        assert_eq!((image.width(), image.height()), (1024, 512), "{file}");
    }
    // A black image with one white pixel; and the small hot sun of the environment.
    let suite = folder.join("ignis_reference_suite/textures/environment/single_bright_pixel.png");
    let pixel = read_image(suite, Encoding::Srgb).unwrap();
    assert_eq!(pixel.texels().filter(|t| t.max_element() > 0.0).count(), 1);
    let sun = read_image(folder.join("environment/env.exr"), Encoding::Srgb).unwrap();
    assert!(
        sun.texels()
            .any(|t| t.max_element() > 50.0 * sun.mean().max_element())
    );
}
