//! Scenes made in code: no file is read, and each is the same every time.

mod cornell;
mod doorway;
mod furnace;
mod many_lights;
mod mesh;
mod noise;
mod volumes;

use crate::SceneDescription;

pub use cornell::{cornell, cornell_glossy};
pub use doorway::doorway;
pub use furnace::furnace;
pub use many_lights::many_lights;
#[cfg(any(feature = "gltf", feature = "mitsuba"))]
pub(crate) use mesh::turn;
pub use mesh::{cuboid, icosphere, quad, signed_volume, tetrahedron};
pub use volumes::{cloud, fire, smoke_in_cornell};

/// Names that [`by_name`] knows.
pub const NAMES: [&str; 8] = [
    "cloud",
    "cornell",
    "cornell-glossy",
    "doorway",
    "fire",
    "furnace",
    "many-lights",
    "smoke-in-cornell",
];

/// The built-in scene of that name, or `None`.
pub fn by_name(name: &str) -> Option<SceneDescription> {
    Some(match name {
        "cloud" => cloud(),
        "cornell" => cornell(),
        "cornell-glossy" => cornell_glossy(),
        "doorway" => doorway(),
        "fire" => fire(),
        "furnace" => furnace(),
        "many-lights" => many_lights(),
        "smoke-in-cornell" => smoke_in_cornell(),
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
        assert!(super::by_name("cornel").is_none());
    }
}
