//! ReSTIR GI: unbiased where its premises hold, biased where they do not.

use crate::ensemble::Ensemble;
use lightshed_integrator::{DirectLight, PathTracer, RestirGi};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{
    ColorTexture, Geometry, Material, Rgb, Scene, SceneDescription, ShapeDescription, builtin,
};

/// Two Lambertian planes that see each other, one of them emits nothing, and every point of the one sees every point of the
/// other: nothing is hidden, nothing leaves a horizon. Lit by a lamp behind the camera's view.
fn open_corner(side: u32) -> Scene {
    let plane = |name: &str, corners: [Vec3; 4], emission| ShapeDescription {
        name: name.to_owned(),
        geometry: Geometry::Mesh(builtin::quad(corners)),
        material: 0,
        emission,
    };
    let mut description = SceneDescription {
        shapes: vec![
            plane(
                "floor",
                [
                    Vec3::new(-1.0, -1.0, 1.0),
                    Vec3::new(1.0, -1.0, 1.0),
                    Vec3::new(1.0, -1.0, -1.0),
                    Vec3::new(-1.0, -1.0, -1.0),
                ],
                None,
            ),
            plane(
                "wall",
                [
                    Vec3::new(-1.0, -1.0, -1.0),
                    Vec3::new(1.0, -1.0, -1.0),
                    Vec3::new(1.0, 1.0, -1.0),
                    Vec3::new(-1.0, 1.0, -1.0),
                ],
                None,
            ),
            plane(
                "lamp",
                [
                    Vec3::new(-0.5, 1.5, 0.0),
                    Vec3::new(0.5, 1.5, 0.0),
                    Vec3::new(0.5, 1.5, 1.0),
                    Vec3::new(-0.5, 1.5, 1.0),
                ],
                Some(Rgb::splat(4.0)),
            ),
        ],
        materials: vec![Material::Diffuse {
            reflectance: ColorTexture::Constant(Rgb::new(0.8, 0.6, 0.4)),
        }],
        camera: builtin::cornell().camera,
        ..SceneDescription::default()
    };
    description.camera.fov_x = 0.5;
    (description.settings.width, description.settings.height) = (side, side);
    description.settings.max_depth = Some(4);
    Scene::new(&description).unwrap()
}

#[test]
fn an_open_corner_has_no_bias() {
    let scene = open_corner(24);
    let truth = Ensemble::of_estimator(&PathTracer::new(&scene), [24, 24], 16, 40);
    let frames = Ensemble::of_chains(|| RestirGi::new(&scene), 4, 100, 1);
    let agreement = frames.compare(&truth);
    println!("{agreement:?}");
    agreement.verdict().unwrap();
    // The control: a tenth of the light is indirect, and its absence would be seen.
    let direct = Ensemble::of_estimator(&DirectLight::new(&scene), [24, 24], 16, 40);
    frames.compare(&direct).verdict().unwrap_err();
}

/// The control, and what the bias is: glossy boxes send light into directions.
#[test]
fn glossy_boxes_have_a_bias() {
    let mut glossy = builtin::cornell_glossy();
    (glossy.settings.width, glossy.settings.height) = (24, 24);
    glossy.camera.fov_x = 0.4;
    glossy.settings.max_depth = Some(3);
    let scene = Scene::new(&glossy).unwrap();
    let truth = Ensemble::of_estimator(&PathTracer::new(&scene), [24, 24], 16, 40);
    let frames = Ensemble::of_chains(|| RestirGi::new(&scene), 6, 150, 1);
    let agreement = frames.compare(&truth);
    println!("{agreement:?}");
    agreement.verdict().unwrap_err();
    assert!(
        agreement.whole.iter().all(|(bias, _)| bias.abs() < 0.1),
        "{agreement:?}"
    );
}
