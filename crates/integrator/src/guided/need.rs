//! Whether a scene has anything to guide.

use lightshed_scene::glam::Vec2;
use lightshed_scene::{Scene, SceneFeatures};

/// `Ok` if a guide may help paths in `scene` of as many edges as its settings allow; else why it is
/// left out.
///
/// # Errors
/// What the scene lacks, in words.
pub fn guide_need(scene: &Scene) -> Result<(), &'static str> {
    let features = SceneFeatures::of(scene);
    let has_width = scene.materials().iter().any(|material| {
        let bsdf = material.at(Vec2::splat(0.5));
        (0..bsdf.lobe_count()).any(|lobe| bsdf.lobe_roughness(lobe) > 0.0)
    });
    let longest = scene.settings().max_depth.unwrap_or(u32::MAX);
    if !features.has_light() {
        return Err("nothing emits");
    }
    if !has_width && features.media == 0 {
        return Err("all light is scattered by mirrors and smooth refraction");
    }
    if longest < 2 {
        return Err("paths end where they first meet a surface");
    }
    if longest == 2 && features.area_emitters == 0 && !features.surroundings && features.emitting_media == 0 {
        return Err(
            "lights are points and directions, which scattered rays do not meet, and paths end at direct light",
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_scene::builtin;

    #[test]
    fn scenes_without_need_say_why() {
        let need = |name: &str, max_depth| {
            let mut description = builtin::by_name(name).unwrap();
            description.settings.max_depth = max_depth;
            guide_need(&Scene::new(&description).unwrap())
        };
        assert_eq!(need("cornell", None), Ok(()));
        assert_eq!(need("lighthouse", Some(3)), Ok(()));
        assert!(need("cornell", Some(1)).unwrap_err().contains("end"));
        assert!(need("lighthouse", Some(2)).unwrap_err().contains("points"));
        let mut dark = builtin::lighthouse();
        dark.emitters.clear();
        assert!(
            guide_need(&Scene::new(&dark).unwrap())
                .unwrap_err()
                .contains("emits")
        );
    }
}
