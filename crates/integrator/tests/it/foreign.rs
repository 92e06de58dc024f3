//! Mitsuba's own test scenes against its reference images.
//!
//! Neither is part of this repository. `LIGHTSHED_FOREIGN` names the folder that has Mitsuba's
//! data as `mitsuba-data`. Its scenes lie in `tests/scenes`. Beside each of them, `refs` has an
//! image of means and one of the variance of a sample.
//!
//! **What is asked** is what Mitsuba asks of its integrators. With `n` samples in a pixel, each
//! channel has `z = |mean − reference| √(n/v)`, where `v` is the variance of a sample, at least
//! 10⁻⁴. Two-sided probabilities of `z` are above `α = 1 − 0.99^(1/pixels)` in 99.75 % of
//! all values. `v` is the greater of Mitsuba's and what the samples here show, since a right image
//! may have more noise. Beyond that, the mean of each channel is off by no more than 5 standard
//! errors and half a percent.
//!
//! A right renderer fails a case with probability 10⁻⁴ at most as far as the central limit
//! holds. Seeds are fixed.

use crate::common::data_folder;
use crate::rendered::Rendered;
use lightshed_film::read_exr;
use lightshed_integrator::{PathTracer, VolumePathTracer};
use lightshed_scene::import::{LoadLimits, load_with};
use lightshed_scene::{Material, Scene, SceneDescription};
use lightshed_testkit::check_faults;
use std::path::{Path, PathBuf};

/// Samples in each pixel.
const SAMPLES: u32 = 64;

/// Share of the values that must be likely.
const LIKELY: f64 = 0.9975;

/// A scene and its reference.
struct Case {
    /// Folder and file, without their endings.
    scene: &'static str,
    /// What the image differs by, of a channel's mean, for a reason that is known.
    known: f64,
}

/// Images in the order of their folders. Those without a reference must load.
const CASES: [Case; 18] = [
    Case::new("bsdf_spheres/test_arealight_path"),
    Case::new("bsdf_spheres/test_constant_path"),
    Case::new("bsdf_spheres/test_envmap_path"),
    Case::new("bsdf_spheres/test_normalmap_path"),
    Case::new("bsdf_spheres/test_pointlight_path"),
    Case::new("bsdf_spheres/test_roughdielectric_path"),
    Case::new("bsdf_spheres/test_roughplastic_linear_path"),
    Case::new("bsdf_spheres/test_textured_diffuse_path"),
    Case::new("instancing/test_instancing_path"),
    Case::new("mesh_attributes/test_mesh_attributes_1_face_direct"),
    Case::new("mesh_attributes/test_mesh_attributes_3_face_direct"),
    Case::new("mesh_attributes/test_mesh_attributes_3_vertex_direct"),
    Case::new("participating_media/test_hetero_sigmat_albedo_volpath"),
    Case::new("participating_media/test_hetero_sigmat_volpath"),
    Case::new("participating_media/test_homo_area_light_volpath"),
    Case::new("participating_media/test_homo_dielectric_envmap_volpath"),
    Case::new("participating_media/test_homo_obj_inside_medium_volpath"),
    Case::new("participating_media/test_surf_area_light_volpath"),
];

impl Case {
    const fn new(scene: &'static str) -> Self {
        Self { scene, known: 0.0 }
    }

    /// The case with this name.
    fn named(name: &str) -> &'static Self {
        CASES.iter().find(|case| case.scene.contains(name)).unwrap()
    }

    fn description(&self, folder: &Path) -> SceneDescription {
        read(
            folder,
            &folder
                .join("mitsuba-data/tests/scenes")
                .join(self.scene)
                .with_extension("xml"),
        )
    }

    /// Renders and compares.
    fn compare(&self, folder: &Path, description: &SceneDescription) -> Result<(), String> {
        let (file, integrator) = self.scene.rsplit_once('_').unwrap();
        let (group, file) = file.rsplit_once('/').unwrap();
        let references = folder.join("mitsuba-data/tests/scenes").join(group).join("refs");
        let image = |kind: &str| read_exr(references.join(format!("{file}_ref_{kind}.exr"))).unwrap();
        let (mean, variance) = (image("rgb"), image("rgb_var"));
        let size = [description.settings.width, description.settings.height];
        assert_eq!(size, [mean.width(), mean.height()]);
        let scene = Scene::new(description).unwrap();
        let (emitters, depths) = (scene.emitters_by_power(), description.settings);
        let rendered = if integrator == "volpath" {
            let tracer =
                VolumePathTracer::new(&scene, emitters).with_depths(depths.max_depth, depths.roulette_depth);
            Rendered::new(&tracer, size, SAMPLES, 1)
        } else {
            let tracer =
                PathTracer::new(&scene, emitters).with_depths(depths.max_depth, depths.roulette_depth);
            Rendered::new(&tracer, size, SAMPLES, 1)
        };
        let values: Vec<Value> = mean
            .pixels()
            .as_flattened()
            .iter()
            .zip(variance.pixels().as_flattened())
            .zip(rendered.mean.iter().zip(&rendered.variance_of_mean))
            .map(|((&reference, &variance), (&found, &own))| Value {
                reference: f64::from(reference),
                found,
                variance: f64::from(variance).max(own * f64::from(SAMPLES)),
            })
            .collect();
        self.judge(&values, (size[0] * size[1]) as f64)
    }

    fn judge(&self, values: &[Value], pixels: f64) -> Result<(), String> {
        let samples = f64::from(SAMPLES);
        // Of the probability α/2 beyond z on either side.
        let least = 1.0 - 0.99_f64.powf(1.0 / pixels);
        let likely = values.iter().filter(|value| {
            let z = (value.found - value.reference).abs() * (samples / value.variance.max(1e-4)).sqrt();
            two_sided(z) > least
        });
        let share = likely.count() as f64 / values.len() as f64;
        println!("{}: {:.2} % of the values are likely", self.scene, 100.0 * share);
        if share < LIKELY {
            return Err(format!(
                "{}: {:.2} % of the values are likely",
                self.scene,
                100.0 * share
            ));
        }
        for channel in 0..3 {
            let of_channel = || values.iter().skip(channel).step_by(3);
            let reference: f64 = of_channel().map(|value| value.reference).sum();
            let found: f64 = of_channel().map(|value| value.found).sum();
            let variance: f64 = of_channel().map(|value| value.variance.max(0.0) / samples).sum();
            let allowed = 5.0 * variance.sqrt() + (5e-3 + self.known) * reference;
            println!(
                "    channel {channel}: {:+.3} %",
                100.0 * (found / reference - 1.0)
            );
            if (found - reference).abs() > allowed {
                let off = 100.0 * (found / reference - 1.0);
                return Err(format!("{}: channel {channel} is off by {off:.2} %", self.scene));
            }
        }
        Ok(())
    }
}

/// A channel of a pixel.
struct Value {
    reference: f64,
    found: f64,
    /// Of a sample.
    variance: f64,
}

/// The probability of a normal deviate beyond `z` standard deviations on either side: Abramowitz
/// and Stegun 7.1.26 for small, the leading term of the tail for large `z`.
fn two_sided(z: f64) -> f64 {
    let x = z / std::f64::consts::SQRT_2;
    if x > 3.0 {
        return (-x * x).exp() / (x * std::f64::consts::PI.sqrt());
    }
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let series = [
        0.254_829_592,
        -0.284_496_736,
        1.421_413_741,
        -1.453_152_027,
        1.061_405_429,
    ];
    let sum = series.iter().rev().fold(0.0, |sum, factor| (sum + factor) * t);
    sum * (-x * x).exp()
}

fn read(folder: &Path, file: &Path) -> SceneDescription {
    let limits = LoadLimits {
        folders: vec![folder.to_path_buf()],
        ..LoadLimits::default()
    };
    load_with(file, &[], &limits)
        .unwrap_or_else(|error| panic!("{}", error.chain()))
        .description
}

fn files(folder: &Path, endings: &[&str], found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, endings, found);
        } else if path
            .extension()
            .is_some_and(|own| endings.iter().any(|ending| own == *ending))
        {
            found.push(path);
        }
    }
    found.sort();
}

#[test]
#[ignore = "takes a minute: cargo test -p lightshed-integrator --test it foreign -- --ignored"]
fn mitsubas_test_scenes_look_as_its_references() {
    let Some(folder) = data_folder("LIGHTSHED_FOREIGN") else {
        return;
    };
    let failed: Vec<String> = CASES
        .iter()
        .filter_map(|case| case.compare(&folder, &case.description(&folder)).err())
        .collect();
    assert!(failed.is_empty(), "{failed:#?}");
}

/// What the verdicts find: surfaces that keep their normals, triangles without their colours, an
/// albedo without its grids, thin glass that counts as an edge.
#[test]
#[ignore = "like the test above"]
fn what_was_left_out_once_is_noticed() {
    let Some(folder) = data_folder("LIGHTSHED_FOREIGN") else {
        return;
    };
    let faults = ["normals", "colours", "albedo", "edges"];
    check_faults(&faults, |fault| {
        let Some(fault) = fault else { return Ok(()) };
        let case = Case::named(match fault {
            "normals" => "test_normalmap_path",
            "colours" => "3_vertex",
            "albedo" => "sigmat_albedo",
            _ => "homo_obj_inside",
        });
        let mut description = case.description(&folder);
        match fault {
            "normals" => {
                for material in &mut description.materials {
                    if let Material::Relief { base, .. } = material {
                        *material = (**base).clone();
                    }
                }
            }
            "colours" => {
                for shape in &mut description.shapes {
                    if let lightshed_scene::Geometry::Mesh(mesh) = &mut shape.geometry {
                        mesh.colors.clear();
                    }
                }
            }
            "albedo" => description.media[0].albedo_grids.clear(),
            // Glass without the share that goes straight on is passed by as many edges as its
            // light has vertices.
            _ => description.settings.max_depth = Some(4),
        }
        case.compare(&folder, &description)
    })
    .unwrap();
}

/// Every foreign scene loads and can be rendered.
#[test]
fn foreign_scenes_load() {
    let Some(folder) = data_folder("LIGHTSHED_FOREIGN") else {
        return;
    };
    let mut found = Vec::new();
    files(&folder, &["gltf", "glb"], &mut found);
    files(&folder.join("mitsuba-data/tests/scenes"), &["xml"], &mut found);
    let is_scene = |path: &&PathBuf| {
        path.extension().is_some_and(|ending| ending != "xml")
            || path
                .file_name()
                .is_some_and(|name| name.to_string_lossy().starts_with("test_"))
                && !path.parent().is_some_and(|folder| folder.ends_with("include"))
    };
    let mut count = 0;
    for file in found.iter().filter(is_scene) {
        let limits = LoadLimits {
            folders: vec![folder.clone()],
            ..LoadLimits::default()
        };
        match load_with(file, &[], &limits) {
            Ok(loaded) => Scene::new(&loaded.description)
                .map(|_| count += 1)
                .unwrap_or_else(|error| panic!("{}: {error}", file.display())),
            // `BoxDraco.gltf` comes without its buffer.
            Err(error) => {
                let what = error.chain();
                assert!(
                    what.contains("BoxDraco.gltf") && what.contains("cannot read"),
                    "{what}"
                );
            }
        }
    }
    println!("{count} of {} scenes", found.len());
    assert!(count >= 30, "{count} scenes");
}
