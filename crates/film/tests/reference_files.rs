//! OpenEXR files that other renderers wrote.

mod common;

use common::{ReferenceMoments, data_folder};
use lightshed_film::{ImageComparison, RgbImage, read_exr};
use std::path::{Path, PathBuf};

fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = paths
        .filter(|path| path.extension().is_some_and(|e| e == extension))
        .collect();
    files.sort();
    files
}

/// Means of Mitsuba's images as measured by other software.
const MEANS: [(&str, [f64; 3]); 4] = [
    ("cornell_d8", [0.24014, 0.14111, 0.05997]),
    ("oacmpctf3_d2", [0.16722, 0.17642, 0.26944]),
    ("veach_ajar_d13", [1.21749, 0.85100, 0.74086]),
    ("sponza_crytek_d6", [0.02479, 0.01904, 0.01110]),
];

#[test]
fn images_by_mitsuba_agree_with_their_moments() {
    let Some(folder) = data_folder("LIGHTSHED_REFERENCES") else {
        return;
    };
    let archives = files(&folder, "npz");
    assert!(!archives.is_empty(), "no references in {}", folder.display());
    for archive in archives {
        let moments = ReferenceMoments::read(&archive);
        let image = read_exr(archive.with_extension("exr")).unwrap();
        assert_eq!(
            (image.width() as usize, image.height() as usize),
            (moments.width, moments.height)
        );
        // Masks of directly seen emitters have one sample, images have many.
        let mask = archive.to_string_lossy().ends_with("_emitters.npz");
        assert!(
            mask || moments.samples_per_pixel >= 1_000,
            "{} samples",
            moments.samples_per_pixel
        );
        assert!(
            moments
                .variance_of_mean
                .iter()
                .all(|v| v.is_finite() && *v >= 0.0)
        );
        let pixels = moments
            .mean
            .chunks(3)
            .map(|p| [p[0] as f32, p[1] as f32, p[2] as f32])
            .collect();
        let mean = RgbImage::new(image.width(), image.height(), pixels).unwrap();
        // The same floats: channels swapped or rows turned would show.
        assert_eq!(image, mean, "{}", archive.display());
        let comparison = ImageComparison::new(&image, &mean).unwrap();
        assert_eq!((comparison.mse, comparison.mape), (0.0, Some(0.0)));
    }
}

#[test]
fn means_are_those_of_other_software() {
    let Some(folder) = data_folder("LIGHTSHED_REFERENCES") else {
        return;
    };
    for (name, expected) in MEANS {
        let found = read_exr(folder.join(name).with_extension("exr")).unwrap().mean();
        for c in 0..3 {
            assert!(
                (found[c] - expected[c]).abs() < 6e-6,
                "{name}: {found:?} against {expected:?}"
            );
        }
    }
}

#[test]
fn images_of_several_writers_can_be_read() {
    let Some(scenes) = data_folder("LIGHTSHED_SCENES") else {
        return;
    };
    let mut images = files(&scenes.join("ignis_reference_suite/evaluation/references"), "exr");
    assert!(images.len() >= 10, "only {} images", images.len());
    images.push(scenes.join("veach_ajar/TungstenRender.exr"));
    images.push(scenes.join("environment/env.exr"));
    for path in images {
        let image = read_exr(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(
            image.width() > 1 && image.mean().iter().any(|&v| v > 0.0),
            "{} is black",
            path.display()
        );
    }
}
