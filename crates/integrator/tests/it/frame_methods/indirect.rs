//! ReSTIR GI where its premises hold, so that it has no bias.

use super::ensemble::Ensemble;
use lightshed_integrator::{DirectLight, DirectLightOptions, PathTracer, RestirDiSettings, RestirGi};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{
    ColorTexture, Geometry, Material, Rgb, Scene, SceneDescription, ShapeDescription, builtin,
};

/// A Lambertian floor and a wall under a lamp that is not in view: every point of the one sees
/// every point of the other, nothing is hidden, nothing leaves a horizon.
fn open_corner(side: u32) -> Scene {
    let lambertian = Material::Diffuse {
        reflectance: ColorTexture::Constant(Rgb::new(0.8, 0.6, 0.4)),
    };
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
        materials: vec![lambertian],
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
    let truth = Ensemble::of_estimator(
        &PathTracer::new(&scene, scene.emitters_by_power()),
        [24, 24],
        16,
        100,
    );
    let frames = Ensemble::of_chains(
        || RestirGi::new(&scene, scene.emitters_by_power(), RestirDiSettings::UNBIASED).unwrap(),
        1..3,
        300,
        1,
    );
    let agreement = frames.compare(&truth);
    println!("{agreement:?}");
    agreement.verdict().unwrap();
    // The control: a tenth of the light is indirect, and its absence would be seen.
    let direct = Ensemble::of_estimator(
        &DirectLight::new(&scene, scene.emitters_by_power(), DirectLightOptions::default()).unwrap(),
        [24, 24],
        16,
        100,
    );
    frames.compare(&direct).verdict().unwrap_err();
}
