//! Paths on the device are the CPU's paths.

use crate::tests::support::gpu;
use crate::{
    Gpu, GpuDirectLight, GpuError, GpuMixture, GpuPathTracer, GpuRestirDi, GpuRestirPt, GpuRestirVolume,
    GpuScene, GpuVolumePathTracer, GpuVplGrid,
};
use lightshed_film::PixelEstimator;
use lightshed_integrator::PathTracer;
use lightshed_scene::import::load;
use lightshed_scene::{
    Checkerboard, ColorTexture, ConductorIor, EmitterDescription, Filter, FlatError, Geometry, Image,
    ImageTexture, Material, Microfacet, Projection, Rgb, Roughness, Scene, SceneDescription,
    ShapeDescription, SkySampling, Wrap, builtin,
};
use std::path::PathBuf;
use std::sync::Arc;

fn sized(mut description: SceneDescription, side: u32) -> Scene {
    (description.settings.width, description.settings.height) = (side, side);
    Scene::new(&description).expect("built-in scenes are sound")
}

/// Share of the pixels whose sample `index` on the device is not the host's with `depths`: in any
/// bit where the device and what is asked of it are exact, else by more than a thousandth.
fn different(
    gpu: &Gpu,
    scene: &Scene,
    [sky, sky_of_host]: [SkySampling; 2],
    index: u32,
    depths: (Option<u32>, u32),
) -> f64 {
    let has_image = scene
        .emitters()
        .environment()
        .is_some_and(|around| around.constant_radiance().is_none());
    let flat = GpuScene::with_sky(gpu, scene, sky).expect("the scene is flat");
    let mut device = GpuPathTracer::with_depths(gpu, &flat, Some(6), 3).expect("the programs are sound");
    let found = device.sample(index, 7).expect("the device answers");
    let emitters = scene.emitters_by_power().with_sky(sky_of_host);
    let host = PathTracer::new(scene, emitters).with_depths(depths.0, depths.1);
    let [width, _] = flat.size();
    let mut lit = 0;
    let mut differing = 0;
    for (i, found) in (0..).zip(&found) {
        let truth = host.sample(i % width, i / width, index, 7);
        lit += usize::from(truth.max_element() > 0.0);
        let differs = |c: usize| {
            if gpu.is_exact() && !has_image {
                found[c].to_bits() != truth[c].to_bits()
            } else {
                (found[c] - truth[c]).abs() > 1e-3 * truth[c].abs() + 1e-6
            }
        };
        differing += usize::from((0..3).any(differs));
    }
    assert!(lit > found.len() / 400, "the scene is dark");
    differing as f64 / found.len() as f64
}

/// The same bits, path by path, on a device that is exact; on others all but a few of a hundred
/// paths, which took another branch, to a thousandth. Other lengths and another sample are noticed.
#[test]
fn paths_are_those_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let allowed = if gpu.is_exact() { 0.0 } else { 0.05 };
    for (name, description) in [
        ("cornell", builtin::cornell()),
        ("many-lights", builtin::many_lights()),
        ("cornell-glossy", builtin::cornell_glossy()),
        ("doorway", builtin::doorway()),
        ("surrounded", surrounded()),
        ("under a sky", under_a_sky()),
        ("points", lit_by_points()),
        ("glass", glass()),
        ("images", images()),
        ("under a sky above its mean", under_a_sky()),
    ] {
        let scene = sized(description, 96);
        let (above, all) = (SkySampling::AboveMean, SkySampling::Luminance);
        let is_above = name == "under a sky above its mean";
        let sky = [if is_above { above } else { all }; 2];
        let found = different(gpu, &scene, sky, 3, (Some(6), 3));
        println!("{name}: {found}");
        // Directions to an image are the host's to rounding.
        let allowed = if name.starts_with("under a sky") {
            0.05
        } else {
            allowed
        };
        assert!(found <= allowed, "{name}: {found} of all paths differ");
        if is_above {
            let planted = different(gpu, &scene, [all, above], 3, (Some(6), 3));
            assert!(
                planted > 0.2,
                "{name}: another sampling is not noticed: {planted}"
            );
        }
        if name != "many-lights" {
            // Nothing but direct light is seen there by most paths.
            let planted = different(gpu, &scene, sky, 3, (Some(5), 3));
            assert!(planted > 1e-3, "{name}: a shorter path is not noticed: {planted}");
            let planted = different(gpu, &scene, sky, 3, (Some(6), 2));
            assert!(planted > 1e-3, "{name}: roulette is not noticed: {planted}");
        }
    }
}

/// A ball with interpolated normals on a mirror, in constant light with a lamp, seen through a
/// lens.
fn surrounded() -> SceneDescription {
    let mut scene = builtin::cornell();
    let (center, radius) = (glam::Vec3::new(-0.1, -0.2, 0.5), 0.4);
    let mut ball = builtin::icosphere(center, radius, 3);
    ball.normals = ball.positions.iter().map(|p| *p - center).collect();
    scene.materials.push(Material::Mirror {
        reflectance: Rgb::splat(0.9).into(),
    });
    scene.materials.push(Material::TwoSided {
        front: Box::new(Material::Conductor {
            ior: ConductorIor {
                eta: Rgb::new(0.2, 0.9, 1.1),
                k: Rgb::new(3.9, 2.4, 2.2),
            },
            roughness: None,
            specular_reflectance: Rgb::ONE.into(),
        }),
        back: None,
    });
    let mirror = scene.materials.len() as u32 - 2;
    scene.shapes[0].material = mirror;
    scene.shapes[6].material = mirror + 1;
    scene.shapes[1].material = 1;
    scene.shapes.push(ShapeDescription {
        name: "ball".to_owned(),
        geometry: Geometry::Mesh(ball),
        material: 0,
        emission: None,
    });
    scene.emitters.push(EmitterDescription::Constant {
        radiance: Rgb::new(0.2, 0.3, 0.5),
    });
    scene.camera.projection = Projection::ThinLens {
        aperture_radius: 0.05,
        focus_distance: 3.5,
    };
    scene
}

/// A Cornell box lit by points and directions, too.
fn lit_by_points() -> SceneDescription {
    let mut scene = builtin::cornell();
    scene.emitters = vec![
        EmitterDescription::Point {
            position: glam::Vec3::new(0.3, 0.1, 0.6),
            intensity: Rgb::new(0.3, 0.2, 0.1),
        },
        EmitterDescription::Directional {
            direction: glam::Vec3::new(0.3, -0.4, -1.0),
            irradiance: Rgb::new(1.0, 2.0, 0.5),
        },
        EmitterDescription::Point {
            position: glam::Vec3::new(-0.5, -0.4, 0.8),
            intensity: Rgb::new(0.0, 0.2, 0.5),
        },
        EmitterDescription::Directional {
            direction: glam::Vec3::new(-0.2, 0.1, -1.0),
            irradiance: Rgb::new(0.5, 0.0, 0.0),
        },
    ];
    scene
}

/// A ball of rough glass in a ball of glass, a pane, and plastic walls.
pub(crate) fn glass() -> SceneDescription {
    let mut scene = builtin::cornell();
    let dielectric = |eta, alpha: Option<f32>| Material::Dielectric {
        eta,
        roughness: alpha.map(|alpha| Roughness {
            distribution: Microfacet::Ggx,
            alpha_u: alpha.into(),
            alpha_v: alpha.into(),
        }),
        specular_reflectance: Rgb::ONE.into(),
        specular_transmittance: Rgb::new(0.9, 1.0, 0.95).into(),
    };
    let first = scene.materials.len() as u32;
    scene.materials.extend([
        dielectric(1.5, None),
        dielectric(0.8, Some(0.2)),
        Material::ThinDielectric {
            eta: 1.5,
            specular_reflectance: Rgb::ONE.into(),
            specular_transmittance: Rgb::splat(0.9).into(),
        },
        Material::Plastic {
            eta: 1.5,
            diffuse_reflectance: Rgb::new(0.2, 0.3, 0.7).into(),
            specular_reflectance: Rgb::ONE.into(),
            nonlinear: true,
            roughness: None,
        },
    ]);
    let ball = |center, radius, material| ShapeDescription {
        name: "ball".to_owned(),
        geometry: Geometry::Mesh(builtin::icosphere(center, radius, 3)),
        material,
        emission: None,
    };
    let center = glam::Vec3::new(-0.3, -0.3, 0.4);
    scene.shapes.push(ball(center, 0.35, first));
    scene.shapes.push(ball(center, 0.2, first + 1));
    scene
        .shapes
        .push(ball(glam::Vec3::new(0.4, 0.2, 0.5), 0.3, first + 2));
    scene.shapes[1].material = first + 3;
    scene
}

/// Walls with an image and a checkerboard.
fn images() -> SceneDescription {
    let mut scene = builtin::cornell();
    let codes = (0..64u32)
        .map(|i| [(4 * i) as u8, (255 - 3 * i) as u8, (50 + i) as u8])
        .collect();
    let image = ImageTexture {
        image: Arc::new(Image::from_srgb8(8, 8, codes).expect("it has 64 texels")),
        to_uv: glam::Affine2::from_scale(glam::Vec2::new(2.0, 1.5)),
        filter: Filter::Bilinear,
        wrap: Wrap::Repeat,
        scale: Rgb::ONE,
    };
    let two_sided = |reflectance| Material::TwoSided {
        front: Box::new(Material::Diffuse { reflectance }),
        back: None,
    };
    let first = scene.materials.len() as u32;
    scene.materials.extend([
        two_sided(ColorTexture::Image(image)),
        two_sided(ColorTexture::Checkerboard(Checkerboard {
            color0: Rgb::new(0.8, 0.3, 0.1),
            color1: Rgb::new(0.1, 0.3, 0.8),
            to_uv: glam::Affine2::from_scale(glam::Vec2::splat(4.0)),
        })),
    ]);
    scene.shapes[0].material = first;
    scene.shapes[1].material = first + 1;
    if let Geometry::Mesh(mesh) = &mut scene.shapes[0].geometry {
        mesh.uvs = mesh
            .positions
            .iter()
            .map(|p| glam::Vec2::new(p.x - 0.3 * p.z, p.z + p.y))
            .collect();
    }
    scene
}

/// The same under an image with a sun.
fn under_a_sky() -> SceneDescription {
    let mut scene = surrounded();
    scene.emitters = builtin::cloud().emitters;
    scene
}

/// A published hall under the sun and a bright sky, of a quarter of a million triangles: paths are
/// the host's, but for one in a thousand that meets two surfaces at once.
#[test]
fn paths_in_a_published_hall_are_those_of_the_cpu() {
    let Some(folder) = std::env::var_os("LIGHTSHED_SCENES").map(PathBuf::from) else {
        println!("SKIPPED: LIGHTSHED_SCENES is not set");
        return;
    };
    let Some(gpu) = gpu() else { return };
    let loaded = load(folder.join("sponza_crytek/scene.xml"), &[]).expect("it is sound");
    let scene = sized(loaded.description, 48);
    let sky = [SkySampling::Luminance; 2];
    let found = different(gpu, &scene, sky, 3, (Some(6), 3));
    println!("{found}");
    let allowed = if gpu.is_exact() { 0.001 } else { 0.05 };
    assert!(found <= allowed, "{found} of all paths differ");
    let planted = different(gpu, &scene, sky, 3, (Some(3), 3));
    println!("planted: {planted}");
    assert!(planted > 0.002, "a shorter path is not noticed: {planted}");
}

/// Sums of many samples, on their way in several waves, against the host's.
#[test]
fn images_are_those_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let scene = sized(builtin::cornell(), 64);
    let flat = GpuScene::new(gpu, &scene).expect("the scene is flat");
    let mut device = GpuPathTracer::new(gpu, &flat).expect("the programs are sound");
    // 64 × 64 pixels of 100 samples are two waves.
    let image = device.render(5, 100, 11).expect("the device answers");
    assert_eq!((image.size(), image.samples()), ([64, 64], 100));
    let host = PathTracer::new(&scene, scene.emitters_by_power());
    let mut worst: f64 = 0.0;
    for (i, (mean, variance)) in (0..).zip(image.mean().iter().zip(image.variance())) {
        let samples: Vec<Rgb> = (5..105).map(|s| host.sample(i % 64, i / 64, s, 11)).collect();
        for c in 0..3 {
            let truth = samples.iter().map(|s| f64::from(s[c])).sum::<f64>() / 100.0;
            let spread = samples
                .iter()
                .map(|s| (f64::from(s[c]) - truth).powi(2))
                .sum::<f64>()
                / 99.0;
            worst = worst.max((f64::from(mean[c]) - truth).abs() / truth.max(1e-3));
            assert!((f64::from(variance[c]) - spread).abs() <= 1e-3 * spread + 1e-4 * truth * truth);
        }
    }
    assert!(worst < if gpu.is_exact() { 1e-6 } else { 0.2 }, "off by {worst}");
}

#[test]
fn memory_is_what_the_documentation_says() {
    let Some(gpu) = gpu() else { return };
    let scene = sized(builtin::cornell(), 512);
    let flat = GpuScene::new(gpu, &scene).expect("the scene is flat");
    let device = GpuPathTracer::new(gpu, &flat).expect("the programs are sound");
    assert_eq!(device.bytes(), GpuPathTracer::BYTES_PER_PIXEL * 512 * 512);
    assert_eq!(GpuPathTracer::BYTES_PER_PIXEL, 200);
    assert_eq!(GpuDirectLight::BYTES_PER_PIXEL, 16);
    assert_eq!(GpuVolumePathTracer::BYTES_PER_PIXEL, 16);
    assert_eq!(GpuMixture::BYTES_PER_PIXEL, 80);
    assert_eq!(GpuRestirDi::BYTES_PER_PIXEL, 176);
    assert_eq!(GpuRestirPt::BYTES_PER_PIXEL, 208);
    assert_eq!(GpuRestirVolume::BYTES_PER_PIXEL, 176);
    assert_eq!(GpuVplGrid::BYTES_PER_PIXEL, 88);
}

/// Published rooms with points, directions and panes of glass are taken; one with Beckmann's
/// microfacets is refused by the material.
#[test]
fn published_rooms_are_taken_or_refused_by_name() {
    let Some(folder) = std::env::var_os("LIGHTSHED_SCENES").map(PathBuf::from) else {
        println!("SKIPPED: LIGHTSHED_SCENES is not set");
        return;
    };
    let Some(gpu) = gpu() else { return };
    let taken = |name: &str| {
        let loaded = load(folder.join(name).join("scene.xml"), &[]).expect("it is sound");
        GpuScene::new(gpu, &sized(loaded.description, 8)).err()
    };
    assert_eq!(taken("classroom"), None);
    assert_eq!(taken("oacmpdm9"), None);
    assert!(matches!(
        taken("veach_ajar"),
        Some(GpuError::Scene(FlatError::Material(_)))
    ));
}

/// What some methods know and others do not is refused by name.
#[test]
fn what_a_method_does_not_know_is_refused() {
    let Some(gpu) = gpu() else { return };
    let unknown = |method, what| Some(GpuError::Unknown { method, what });
    let scene = sized(lit_by_points(), 8);
    let flat = GpuScene::new(gpu, &scene).expect("the scene is flat");
    let what = "points, spots and directions that shine";
    assert_eq!(GpuRestirDi::new(gpu, &flat).err(), unknown("restir-di", what));
    assert_eq!(GpuRestirPt::new(gpu, &flat).err(), unknown("restir-pt", what));
    assert!(GpuDirectLight::new(gpu, &flat, 1, 1).is_ok());
    let scene = sized(glass(), 8);
    let flat = GpuScene::new(gpu, &scene).expect("the scene is flat");
    let what = "dielectrics and plastics";
    assert_eq!(GpuRestirDi::new(gpu, &flat).err(), unknown("restir-di", what));
    assert_eq!(GpuRestirPt::new(gpu, &flat).err(), unknown("restir-pt", what));
}

#[test]
fn scenes_without_a_flat_form_are_refused() {
    let Some(gpu) = gpu() else { return };
    for (description, what) in [
        (builtin::furnace(), FlatError::Spheres),
        (builtin::cloud(), FlatError::Media),
    ] {
        let scene = sized(description, 8);
        assert_eq!(GpuScene::new(gpu, &scene).err(), Some(GpuError::Scene(what)));
    }
}
