//! Scenes made in code: no file is read, and each is the same every time.

mod candles;
mod cornell;
mod corridor;
mod door_gap;
mod doorway;
mod furnace;
mod glossy_bounce;
mod large;
mod lighthouse;
mod many_lights;
mod mesh;
mod noise;
mod pool;
mod room;
mod sequence;
mod view;
mod volumes;
mod warehouse;

use crate::SceneDescription;

pub use candles::candles;
pub use cornell::{cornell, cornell_glossy};
pub use corridor::corridor;
pub use door_gap::door_gap;
pub use doorway::doorway;
pub use furnace::furnace;
pub use glossy_bounce::glossy_bounce;
pub use large::{city, hairball};
pub use lighthouse::{lighthouse, lighthouse_at};
pub use many_lights::many_lights;
#[cfg(any(feature = "gltf", feature = "mitsuba", feature = "pbrt"))]
pub(crate) use mesh::turn;
pub use mesh::{cuboid, icosphere, quad, signed_volume, tetrahedron};
pub use pool::{pool, pool_at};
pub use volumes::{cloud, fire, smoke_in_cornell};
pub use warehouse::warehouse;

/// Names that [`by_name`] knows.
pub const NAMES: [&str; 15] = [
    "candles",
    "cloud",
    "cornell",
    "cornell-glossy",
    "corridor",
    "door-gap",
    "doorway",
    "fire",
    "furnace",
    "glossy-bounce",
    "lighthouse",
    "many-lights",
    "pool",
    "smoke-in-cornell",
    "warehouse",
];

/// The built-in scene of that name, or `None`. `city:1000` and `hairball:1000` are of about so many
/// thousand triangles, up to 16,000.
pub fn by_name(name: &str) -> Option<SceneDescription> {
    if let Some((kind, thousands)) = name.split_once(':') {
        let thousands = thousands.parse().ok().filter(|n| (1..=16_000).contains(n))?;
        return match kind {
            "city" => Some(city(thousands)),
            "hairball" => Some(hairball(thousands)),
            _ => None,
        };
    }
    Some(match name {
        "candles" => candles(),
        "cloud" => cloud(),
        "cornell" => cornell(),
        "cornell-glossy" => cornell_glossy(),
        "corridor" => corridor(),
        "door-gap" => door_gap(),
        "doorway" => doorway(),
        "fire" => fire(),
        "furnace" => furnace(),
        "glossy-bounce" => glossy_bounce(),
        "lighthouse" => lighthouse(),
        "many-lights" => many_lights(),
        "pool" => pool(),
        "smoke-in-cornell" => smoke_in_cornell(),
        "warehouse" => warehouse(),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_name_has_a_scene() {
        for name in super::NAMES {
            let scene = super::by_name(name).unwrap();
            let materials = scene.materials.len() as u32;
            assert!(scene.shapes.iter().all(|shape| shape.material < materials));
            assert!(!scene.emitters.is_empty() || scene.shapes.iter().any(|shape| shape.emission.is_some()));
        }
        for name in ["city:20", "hairball:20"] {
            let scene = super::by_name(name).unwrap();
            let triangles: usize = scene
                .shapes
                .iter()
                .map(|shape| match &shape.geometry {
                    crate::Geometry::Mesh(mesh) => mesh.indices.len(),
                    _ => 0,
                })
                .sum();
            assert!((18_000..=20_100).contains(&triangles), "{name}: {triangles}");
        }
        for name in ["cornel", "city", "city:0", "city:17000", "city:x", "town:5"] {
            assert!(super::by_name(name).is_none());
        }
    }
}
