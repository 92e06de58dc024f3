//! What a ray costs in a scene, beside one in a scene of few triangles.

use lightshed_scene::SceneFeatures;

/// The cost where rays go through no tree.
const RAY_WITHOUT_TREE: f64 = 0.6;

/// Doublings of the number of triangles from which on the cost grows, and how much with each more:
/// caches hold no larger tree.
const RAY_OF_LARGE: [f64; 2] = [16.0, 0.55];

/// What the cost grows by with the share of glossy materials that are shaded one by one: lobes take
/// longer to sample and to evaluate. Shaded in lanes they cost no more than diffuse ones.
const GLOSSY: f64 = 1.6;

/// The cost of a ray with the shading at its end on diffuse surfaces, and what glossy ones add to
/// it, where paths shade those in lanes that can be or where they do not. The unit is the cost in a
/// scene of few triangles.
pub(crate) fn ray_cost(features: &SceneFeatures, in_lanes: bool) -> (f64, f64) {
    let doublings = (features.triangles.max(1) as f64).log2();
    let ray = match features.tree {
        true => 1.0 + RAY_OF_LARGE[1] * (doublings - RAY_OF_LARGE[0]).max(0.0),
        false => RAY_WITHOUT_TREE,
    };
    let together = if in_lanes { features.glossy_in_lanes } else { 0 };
    let alone = features.glossy_materials.saturating_sub(together);
    (ray, GLOSSY * alone as f64 / features.materials.max(1) as f64)
}
