//! Plugins that something else stands for, and other names for what there is.

use super::{message, read};
use crate::Material;

/// Plugins that something else stands for: the scene loads, and a warning names each.
#[test]
fn something_stands_for_other_plugins() {
    let cases = [
        (
            "<shape type=\"cube\"><bsdf type=\"hair\"><float name=\"eumelanin\" value=\"1\"/></bsdf></shape>",
            "`hair`",
        ),
        (
            "<shape type=\"cube\"><bsdf type=\"measured\"><string name=\"filename\" value=\"x.bsdf\"/></bsdf></shape>",
            "`measured`",
        ),
        (
            "<shape type=\"cube\"><bsdf type=\"principledthin\"><float name=\"spec_trans\" value=\"0.5\"/><float name=\"diff_trans\" value=\"0.6\"/></bsdf></shape>",
            "`principledthin`",
        ),
        (
            "<emitter type=\"projector\"><float name=\"fov\" value=\"30\"/><float name=\"scale\" value=\"4\"/></emitter>",
            "spot light",
        ),
        (
            "<emitter type=\"sunsky\"><float name=\"turbidity\" value=\"3\"/><vector name=\"sun_direction\" value=\"0 0 1\"/></emitter>",
            "`sunsky`",
        ),
        (
            "<shape type=\"rectangle\"><emitter type=\"directionalarea\"><rgb name=\"radiance\" value=\"2\"/></emitter></shape>",
            "along its normal",
        ),
        (
            "<shape type=\"sdfgrid\"><string name=\"filename\" value=\"a\"/></shape>",
            "`sdfgrid`",
        ),
        (
            "<shape type=\"rectangle\"><sensor type=\"irradiancemeter\"/></shape>",
            "sensor on a shape",
        ),
        (
            "<sensor type=\"radiancemeter\"><vector name=\"direction\" value=\"0 0 -1\"/><point name=\"origin\" value=\"0 0 5\"/></sensor>",
            "fiftieth",
        ),
        (
            "<sensor type=\"distant\"><film type=\"specfilm\"/></sensor>",
            "whole scene",
        ),
        (
            "<sensor type=\"batch\"><sensor type=\"perspective\"/></sensor>",
            "batch",
        ),
        ("<integrator type=\"depth\"/>", "`depth`"),
        (
            "<medium type=\"homogeneous\"><phase type=\"sggx\"/></medium>",
            "`sggx`",
        ),
        (
            "<bsdf type=\"diffuse\"><texture type=\"volume\" name=\"reflectance\"><volume name=\"volume\" type=\"constvolume\"><float name=\"value\" value=\"0.25\"/></volume></texture></bsdf>",
            "mean",
        ),
    ];
    for (body, expected) in cases {
        let loaded = read(body);
        let named = loaded
            .warnings
            .iter()
            .any(|warning| warning.message.contains(expected));
        assert!(named, "{body}: {:?}", loaded.warnings);
    }
}

/// A meter looks along its ray, and an alias is another name.
#[test]
fn meters_look_along_their_ray_and_aliases_are_names() {
    let meter = read(
        "<sensor type=\"radiancemeter\"><vector name=\"direction\" value=\"0 2 0\"/><point name=\"origin\" value=\"1 2 3\"/></sensor>",
    );
    let camera = meter.description.camera;
    assert_eq!(
        glam::Vec3::from(camera.to_world.translation),
        glam::Vec3::new(1.0, 2.0, 3.0)
    );
    let forward = glam::Vec3::from(camera.to_world.matrix3.z_axis);
    assert!(forward.abs_diff_eq(glam::Vec3::Y, 1e-6), "{forward}");
    let scene = read(
        "<bsdf type=\"conductor\" id=\"a\"/><alias id=\"a\" as=\"b\"/><shape type=\"cube\"><ref id=\"b\"/></shape>",
    )
    .description;
    let material = &scene.materials[scene.shapes[0].material as usize];
    assert!(matches!(material, Material::Mirror { .. }), "{material:?}");
    assert!(message("<alias id=\"nobody\" as=\"b\"/>").contains("nothing has the id"));
}
