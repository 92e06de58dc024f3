//! Every published scene that should load does, with the counts that its description states.
//!
//! The scenes are no part of this repository: the folder is named by `LIGHTSHED_SCENES`.

use lightshed_scene::import::{ImportError, load, read_image, read_ply};
use lightshed_scene::{EmitterDescription, Geometry, SceneDescription};
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
        let Geometry::Mesh(mesh) = &shape.geometry else { continue };
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
fn counts_are_as_published() {
    let Some(folder) = scenes() else { return };
    let suite = "ignis_reference_suite/evaluation/mitsuba";
    let cases = [
        ("cornell/scene.xml".to_owned(), [36, 2, 0, 0, 0]),
        ("cornell_rough/scene.xml".to_owned(), [36, 2, 0, 0, 0]),
        ("many_lights_1000/scene.xml".to_owned(), [2 + 40 * 12 + 4000, 4000, 0, 0, 0]),
        ("environment/scene.xml".to_owned(), [14, 0, 0, 0, 1]),
        ("veach_ajar/scene.xml".to_owned(), [382_690, 2, 0, 0, 0]),
        ("classroom/scene.xml".to_owned(), [583_937, 20_166, 7, 1, 0]),
        ("oacmpctf3/scene.xml".to_owned(), [104_521, 69_380, 1_916, 0, 0]),
        ("oacmpdm9/scene.xml".to_owned(), [42_499, 2_336, 891, 0, 0]),
        ("sponza_crytek/scene.xml".to_owned(), [262_191, 0, 0, 1, 1]),
        (format!("{suite}/emissive-plane.xml"), [4, 2, 0, 0, 0]),
        (format!("{suite}/emissive-plane-scale.xml"), [4, 2, 0, 0, 0]),
        (format!("{suite}/env.xml"), [2, 0, 0, 0, 1]),
        (format!("{suite}/multilight.xml"), [4, 2, 2, 0, 1]),
        (format!("{suite}/plane.xml"), [2, 0, 0, 0, 1]),
        (format!("{suite}/point.xml"), [2, 0, 1, 0, 0]),
    ];
    for (file, expected) in cases {
        let loaded = load(folder.join(&file), &[]).unwrap_or_else(|e| panic!("{}", e.chain()));
        assert_eq!(counts(&loaded.description), expected, "{file}");
        assert_eq!(loaded.warnings, [], "{file}");
        for shape in &loaded.description.shapes {
            assert!((shape.material as usize) < loaded.description.materials.len());
        }
    }
}
