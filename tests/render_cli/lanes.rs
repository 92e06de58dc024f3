//! The kinds of lanes: every image has the same bits on all of them.

use super::Folder;

/// Scenes, small enough, and methods that run most of the code in lanes: tables of a few triangles
/// and trees, instances and spheres, light trees, guides, caches, reservoirs and media.
const MATRIX: [&str; 18] = [
    "cornell --method path",
    "cornell --method path --points independent",
    "cornell-glossy --method restir-pt",
    "doorway --method path-reuse",
    "lighthouse --method path --guide vmf --spp 4",
    "lighthouse --method path --guide cdq --spp 4",
    "corridor --method path --lights vlc",
    "many-lights --method direct --lights open-bvh",
    "many-lights --method restir-di --lights tree",
    "many-lights --method lightcuts",
    "candles --method path --lights bvh",
    "pool --method mcmm",
    "furnace --method restir-gi",
    "city:2 --method path",
    "cloud --method volpath",
    "cloud --method volpath-reuse",
    "smoke-in-cornell --method restir-volume",
    "fire --method volpath",
];

#[test]
fn images_have_the_same_bits_on_all_lanes() {
    let folder = Folder::new("lanes");
    let named: Vec<&str> = ["array", "avx2", "avx512"]
        .into_iter()
        .filter(|name| {
            let is_there = used(&folder, name, "cornell --method direct").0 == *name;
            if !is_there {
                println!("SKIPPED: this processor has no lanes {name}");
            }
            is_there
        })
        .collect();
    assert_eq!(named.first(), Some(&"array"));
    for row in MATRIX {
        let (_, expected) = used(&folder, "array", row);
        for name in &named[1..] {
            assert!(
                used(&folder, name, row).1 == expected,
                "{row}: {name} differs from array"
            );
        }
    }
}

/// Renders on the lanes that are asked for: the name of those that were used, and the image.
fn used(folder: &Folder, lanes: &str, row: &str) -> (String, Vec<u8>) {
    let mut arguments: Vec<&str> = row.split(' ').collect();
    if !arguments.contains(&"--spp") {
        arguments.extend(["--spp", "2"]);
    }
    arguments.extend(["--size", "16x12", "--out", "a.exr", "--json"]);
    let mut command = folder.command(&arguments);
    let output = command.env("LIGHTSHED_LANES", lanes).output().unwrap();
    assert!(
        output.status.success(),
        "{row}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let name = report["lanes"].as_str().unwrap().to_owned();
    (name, std::fs::read(folder.file("a.exr")).unwrap())
}
