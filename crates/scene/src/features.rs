//! Features of a scene, so that absent ones can be skipped.

use crate::Scene;
use crate::material::GlossyRow;
use glam::Vec2;

/// Features of a scene. Methods check them before they do work for a feature.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct SceneFeatures {
    /// Triangles.
    pub triangles: usize,
    /// Spheres.
    pub spheres: usize,
    /// Instances of meshes.
    pub instances: usize,
    /// Whether rays go through a tree; few triangles have none.
    pub tree: bool,
    /// Participating media.
    pub media: usize,
    /// Media that emit.
    pub emitting_media: usize,
    /// Emitting triangles and spheres.
    pub area_emitters: usize,
    /// Emitters that are points or directions, which no scattered ray can hit.
    pub delta_emitters: usize,
    /// Lamps: emitting triangles and spheres that touch, by their boxes, are one, and so is each
    /// emitter that is a point or a direction. Where more than 64 surfaces emit, each is one.
    pub lamps: usize,
    /// Light from all around.
    pub surroundings: bool,
    /// Materials.
    pub materials: usize,
    /// Materials with a mirror or a smooth refraction among their lobes.
    pub delta_materials: usize,
    /// Materials with a lobe that is neither that nor diffuse.
    pub glossy_materials: usize,
    /// Those of them that [`Scene::scatter_glossy`] knows, which shades points eight at a time.
    pub glossy_in_lanes: usize,
    /// Materials with textures.
    pub textured_materials: usize,
    /// Whether the camera has a lens.
    pub lens: bool,
}

impl SceneFeatures {
    /// The features of `scene`. Lobes of textured materials are those at one place of their
    /// textures.
    pub fn of(scene: &Scene) -> Self {
        let emitters = scene.emitters();
        let surroundings = emitters.environment().is_some();
        let mut features = Self {
            triangles: scene.triangle_count(),
            spheres: scene.sphere_count(),
            instances: scene.instance_count(),
            tree: scene.accelerator().has_tree(),
            media: scene.media().len(),
            emitting_media: scene
                .media()
                .iter()
                .filter(|medium| medium.emission().is_some())
                .count(),
            area_emitters: emitters.area_count(),
            delta_emitters: emitters.len() - emitters.area_count() - usize::from(surroundings),
            lamps: emitters.lamps(),
            surroundings,
            materials: scene.materials().len(),
            lens: scene.camera().has_lens(),
            ..Self::default()
        };
        for material in scene.materials() {
            let bsdf = material.at(Vec2::splat(0.5));
            let roughness = || (0..bsdf.lobe_count()).map(|lobe| bsdf.lobe_roughness(lobe));
            features.delta_materials += usize::from(roughness().any(|r| r == 0.0));
            features.glossy_materials += usize::from(roughness().any(|r| r > 0.0 && r < 1.0));
            features.glossy_in_lanes += usize::from(GlossyRow::new(material).is_some());
            features.textured_materials += usize::from(!material.is_constant());
        }
        features
    }

    /// Whether anything emits.
    pub fn has_light(&self) -> bool {
        self.area_emitters > 0 || self.delta_emitters > 0 || self.surroundings || self.emitting_media > 0
    }

    /// Whether all light is scattered diffusely.
    pub fn is_diffuse(&self) -> bool {
        self.delta_materials == 0 && self.glossy_materials == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin;

    #[test]
    fn builtin_scenes_have_what_they_say() {
        let of = |name: &str| {
            let description = builtin::by_name(name).expect("it is built in");
            SceneFeatures::of(&Scene::new(&description).expect("it is sound"))
        };
        let cornell = of("cornell");
        assert!(cornell.is_diffuse() && cornell.has_light() && !cornell.tree && !cornell.surroundings);
        assert_eq!(
            (cornell.triangles, cornell.area_emitters, cornell.media),
            (36, 2, 0)
        );
        // Two triangles make one lamp.
        assert_eq!(cornell.lamps, 1);
        let glossy = of("cornell-glossy");
        assert_eq!((glossy.glossy_materials, glossy.delta_materials), (4, 0));
        assert_eq!((glossy.materials, glossy.glossy_in_lanes), (4, 4));
        let lights = of("many-lights");
        assert!(lights.tree && lights.area_emitters == 4000);
        let cloud = of("cloud");
        assert!(cloud.media == 1 && cloud.emitting_media == 0 && cloud.surroundings);
        assert_eq!(of("fire").emitting_media, 1);
        assert!(of("furnace").spheres > 0);
    }
}
