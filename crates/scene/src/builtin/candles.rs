//! A hall of candles in niches.

use super::mesh::{cuboid, quad, tetrahedron};
use super::sequence::Sequence;
use super::view::{seen_along, without_roulette};
use crate::{ColorTexture, Geometry, Material, Rgb, SceneDescription, ShapeDescription, TriangleMesh};
use glam::{Affine3A, Vec3, Vec3A};

/// Niches along each side, and candles in each.
const NICHES: u32 = 12;
const CANDLES: u32 = 12;

/// 288 candles in 24 niches along a hall of 24 × 8, the flames' radiance spread log-uniformly over
/// 40…4,000.
///
/// Partitions of 2.2 × 1.8 stand every 2 units along both sides, so that a point of the floor sees
/// the candles of few niches. A candle is a thin box of wax, 0.1 to 0.6 high, on a step of 0.3, and
/// a tetrahedron of circumradius 0.02 to 0.035 above it: 1,152 emissive triangles. The random
/// figures come from a fixed sequence: the scene is the same everywhere, but for the last bit of a
/// platform's power. 256 × 256 pixels, direct light only (`max_depth` 2).
pub fn candles() -> SceneDescription {
    let mut draw = Sequence(0x0063_616e_646c_6573);
    let mut shapes = Vec::new();
    let mut add = |name: String, mesh: TriangleMesh, material, emission| {
        shapes.push(ShapeDescription {
            name,
            geometry: Geometry::Mesh(mesh),
            material,
            emission,
        });
    };
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let floor = [
        corner(-4.0, 0.0, 0.0),
        corner(4.0, 0.0, 0.0),
        corner(4.0, 0.0, -24.0),
        corner(-4.0, 0.0, -24.0),
    ];
    add("floor".to_owned(), quad(floor), 0, None);
    let back = [
        corner(-4.0, 0.0, -24.0),
        corner(4.0, 0.0, -24.0),
        corner(4.0, 5.0, -24.0),
        corner(-4.0, 5.0, -24.0),
    ];
    add("back wall".to_owned(), quad(back), 1, None);
    let block = |from: Vec3, to: Vec3| {
        let to_world =
            Affine3A::from_translation(0.5 * (from + to)) * Affine3A::from_scale(0.5 * (to - from));
        cuboid(to_world)
    };
    for side in [-1.0f32, 1.0] {
        let name = if side < 0.0 { "left" } else { "right" };
        // Inwards from the side.
        let at = |depth: f32, y: f32, z: f32| Vec3::new(side * (4.0 - depth), y, z);
        let ordered = |a: Vec3, b: Vec3| block(a.min(b), a.max(b));
        let wall = ordered(at(-0.1, 0.0, 0.0), at(0.0, 5.0, -24.0));
        add(format!("{name} wall"), wall, 1, None);
        for niche in 0..NICHES {
            let front = -2.0 * niche as f32;
            let partition = ordered(at(0.0, 0.0, front - 0.05), at(1.8, 2.2, front + 0.05));
            add(format!("{name} partition {niche}"), partition, 1, None);
            let step = ordered(at(0.0, 0.0, front - 1.95), at(0.9, 0.3, front - 0.05));
            add(format!("{name} step {niche}"), step, 0, None);
            for candle in 0..CANDLES {
                let (depth, z) = (draw.between(0.1, 0.8), front - draw.between(0.2, 1.8));
                let (height, half) = (draw.between(0.1, 0.6), draw.between(0.02, 0.03));
                let base = at(depth, 0.3, z);
                let wax = block(
                    base - Vec3::new(half, 0.0, half),
                    base + Vec3::new(half, height, half),
                );
                add(format!("{name} wax {niche}.{candle}"), wax, 0, None);
                let radius = draw.between(0.02, 0.035);
                let flame = tetrahedron(base + Vec3::Y * (height + 0.05), radius);
                let radiance = 40.0 * 100.0_f32.powf(draw.between(0.0, 1.0));
                let emission = Rgb::new(1.0, 0.65, 0.3) * radiance;
                add(format!("{name} flame {niche}.{candle}"), flame, 2, Some(emission));
            }
        }
    }
    let diffuse = |r, g, b| Material::Diffuse {
        reflectance: ColorTexture::Constant(Rgb::new(r, g, b)),
    };
    SceneDescription {
        shapes,
        materials: vec![
            diffuse(0.6, 0.55, 0.5),
            diffuse(0.5, 0.5, 0.55),
            diffuse(0.0, 0.0, 0.0),
        ],
        emitters: Vec::new(),
        // Towards (0, 0.6, −8).
        camera: seen_along(Vec3::new(0.0, 3.0, 5.0), Vec3A::new(0.0, -2.4, -13.0), 60.0),
        settings: without_roulette(2),
        ..SceneDescription::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::signed_volume;

    #[test]
    fn candles_are_as_described() {
        let scene = candles();
        let flames: Vec<f32> = scene
            .shapes
            .iter()
            .filter_map(|s| s.emission.map(|e| e.x))
            .collect();
        assert_eq!(flames.len(), 288);
        assert!(flames.iter().all(|radiance| (40.0..=4000.0).contains(radiance)));
        // Log-uniform: 400 halves them. 144 ± 8.5 (one standard deviation).
        let dim = flames.iter().filter(|&&radiance| radiance < 400.0).count();
        assert!((100..190).contains(&dim), "{dim}");
        for shape in scene
            .shapes
            .iter()
            .filter(|shape| !["floor", "back wall"].contains(&&*shape.name))
        {
            let Geometry::Mesh(mesh) = &shape.geometry else {
                panic!("{} is no mesh", shape.name)
            };
            assert!(signed_volume(mesh) > 0.0, "{}", shape.name);
        }
    }
}
