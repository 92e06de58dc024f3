//! What must hold of all that importers let through.
#![allow(dead_code)]

use lightshed_scene::import::{LoadLimits, Loaded};
use lightshed_scene::{Scene, TriangleMesh};

/// What an input may cost: none should need 256 MB or two seconds.
pub fn limits() -> LoadLimits {
    LoadLimits {
        bytes: 32 << 20,
        vertices: 100_000,
        // Few, so that there are instances.
        copies: 8,
        nodes: 50_000,
        includes: 10,
        depth: 100,
        seconds: 2.0,
        folders: Vec::new(),
    }
}

/// Every triangle has three corners, and what vertices have all have.
pub fn mesh(mesh: &TriangleMesh) {
    let vertices = mesh.positions.len();
    assert!(
        mesh.indices
            .iter()
            .flatten()
            .all(|&corner| (corner as usize) < vertices)
    );
    assert!(mesh.positions.iter().all(|position| position.is_finite()));
    assert!([0, vertices].contains(&mesh.normals.len()));
    assert!([0, vertices].contains(&mesh.uvs.len()));
}

/// A description becomes a scene or an error, and rays through a scene meet something finite.
pub fn scene(loaded: &Loaded) {
    let size = loaded.description.settings;
    let pixels = u64::from(size.width) * u64::from(size.height);
    let Ok(scene) = Scene::new(&loaded.description) else {
        return;
    };
    assert!(pixels > 0);
    let [width, height] = [size.width, size.height].map(|side| side as f32);
    for [x, y] in [[0.5, 0.5], [0.1, 0.9]] {
        let ray = scene.camera().ray([x * width, y * height].into(), [0.5; 2]);
        if let Some(point) = scene.intersect(&ray) {
            assert!(point.position.is_finite(), "{point:?} on {ray:?}");
        }
    }
}
