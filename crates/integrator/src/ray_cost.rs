//! What a ray costs in a scene, beside one in a scene of few triangles.

use lightshed_scene::SceneFeatures;

/// The cost where rays go through no tree.
const RAY_WITHOUT_TREE: f64 = 0.6;

/// Doublings of the number of triangles from which on the cost grows, and how much with each more:
/// caches hold no larger tree.
const RAY_OF_LARGE: [f64; 2] = [16.0, 0.55];

/// What the cost grows by with the share of glossy materials: lobes take longer to sample and to
/// evaluate.
const GLOSSY: f64 = 1.6;

/// The cost of a ray with the shading at its end on diffuse surfaces, and what glossy ones add to
/// it. The unit is the cost in a scene of few triangles.
pub(crate) fn ray_cost(features: &SceneFeatures) -> (f64, f64) {
    let doublings = (features.triangles.max(1) as f64).log2();
    let ray = match features.tree {
        true => 1.0 + RAY_OF_LARGE[1] * (doublings - RAY_OF_LARGE[0]).max(0.0),
        false => RAY_WITHOUT_TREE,
    };
    let glossy = features.glossy_materials as f64 / features.materials.max(1) as f64;
    (ray, GLOSSY * glossy)
}
