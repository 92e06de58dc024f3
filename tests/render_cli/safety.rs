//! Scenes that cannot be trusted, streams that close, signals, options and images of no use.

use super::{Folder, SCENE, ply};
use std::process::{Output, Stdio};

fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[track_caller]
fn refused(folder: &Folder, arguments: &[&str], words: &[&str]) {
    let output = folder.run(arguments);
    let message = message(&output);
    assert!(
        !output.status.success() && message.starts_with("error: ") && message.lines().count() == 1,
        "{arguments:?}: {message}"
    );
    for word in words {
        assert!(message.contains(word), "{arguments:?}: no {word:?} in {message}");
    }
}

/// A scene reads what is in its folder; limits and folders are widened by options that the messages
/// name.
#[test]
fn a_scene_reads_its_own_folder_within_limits() {
    let folder = Folder::new("limits");
    for inner in ["scene", "common"] {
        std::fs::create_dir(folder.file(inner)).unwrap();
    }
    folder.write("common/mesh.ply", ply("-1 -1 0\n1 -1 0\n0 1 0", "3 0 1 2"));
    folder.write("scene/a.xml", SCENE.replace("mesh.ply", "../common/mesh.ply"));
    let common = ["scene/a.xml", "--spp", "1", "--size", "8x8", "--out", "a.exr"];
    refused(
        &folder,
        &common,
        &["a.xml:13", "outside", "scene", "--allow-folder"],
    );
    let with = |more: &[&'static str]| [&common[..], more].concat();
    let allowed = with(&["--allow-folder", "common"]);
    assert!(folder.run(&allowed).status.success());
    refused(
        &folder,
        &with(&["--allow-folder", "none"]),
        &["none", "no such folder"],
    );
    let few = [&allowed[..], &["--load-limit", "vertices=3"]].concat();
    refused(
        &folder,
        &few,
        &["mesh.ply", "vertices", "--load-limit vertices=N"],
    );
    let enough = [
        &allowed[..],
        &["--load-limit", "vertices=4", "--load-limit", "nodes=1e3"],
    ]
    .concat();
    assert!(folder.run(&enough).status.success());
    refused(
        &folder,
        &with(&["--load-limit", "polygons=3"]),
        &["polygons", "bytes, vertices"],
    );
    refused(&folder, &with(&["--load-limit", "bytes=-1"]), &["-1"]);
    refused(
        &folder,
        &["cornell", "--load-limit", "bytes=1"],
        &["--load-limit", "cornell"],
    );
}

#[test]
fn options_without_effect_are_refused() {
    let folder = Folder::new("idle");
    let cases: [(&[&str], &[&str]); 3] = [
        (&["--exposure", "1", "--out", "a.exr"], &["--exposure", "OpenEXR"]),
        (
            &["--guide-training", "3"],
            &["--guide-training", "without --guide"],
        ),
        (
            &["--guide", "sdtree", "--guide-bits", "96"],
            &["--guide-bits", "cdq"],
        ),
    ];
    for (arguments, words) in cases {
        refused(
            &folder,
            &[&["cornell", "--size", "8x8", "--spp", "1"], arguments].concat(),
            words,
        );
    }
}

/// A black image, and one that shows nothing, say why.
#[test]
fn images_of_nothing_are_named() {
    let folder = Folder::new("nothing");
    folder.write("mesh.ply", ply("-1 -1 0\n1 -1 0\n0 1 0", "3 0 1 2"));
    let sky = r#"<emitter type="constant"><rgb name="radiance" value="1"/></emitter>"#;
    let below = r#"<emitter type="point"><point name="position" x="0" y="0" z="-5"/></emitter>"#;
    folder.write("dark.xml", SCENE.replace(sky, ""));
    // The triangle's two sides, one lit and the other seen.
    folder.write("behind.xml", SCENE.replace(sky, below));
    folder.write(
        "away.xml",
        SCENE.replace("target=\"0, 0, 0\"", "target=\"0, 0, 9\""),
    );
    let said = |scene: &str| {
        let output = folder.run(&[scene, "--spp", "1", "--size", "8x8", "--out", "a.exr"]);
        assert!(output.status.success(), "{}", message(&output));
        message(&output)
    };
    assert!(said("dark.xml").contains("warning: the image is black: the scene has no light"));
    assert!(said("behind.xml").contains("warning: the image is black, though the scene has 1 emitters"));
    assert!(said("away.xml").contains("warning: no surface is seen by the camera"));
    folder.write("scene.xml", SCENE);
    assert_eq!(said("scene.xml"), "");
}

/// Whoever reads the figures may have gone.
#[cfg(unix)]
#[test]
fn closed_streams_are_no_reason_to_panic() {
    let folder = Folder::new("streams");
    for arguments in [
        &["cornell", "--size", "8x8", "--spp", "1", "--out", "a.exr"][..],
        &["cornell", "--explain"],
        &["--help"],
    ] {
        let mut child = folder
            .command(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{arguments:?}: {}", message(&output));
        assert_eq!(message(&output), "", "{arguments:?}");
    }
    assert_eq!(folder.names(), ["a.exr"]);
    let mut child = folder
        .command(&["no-scene"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(1));
}

#[cfg(target_os = "linux")]
#[test]
fn a_termination_writes_the_passes_done_so_far_and_leaves_nothing_else() {
    use std::time::Duration;

    let folder = Folder::new("termination");
    let arguments = [
        "cornell",
        "--method",
        "path",
        "--size",
        "16x16",
        "--threads",
        "1",
        "--seconds",
        "600",
        "--out",
        "a.exr",
    ];
    let mut child = folder
        .command(&arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    super::wait_for_handler(&mut child);
    std::thread::sleep(Duration::from_millis(300));
    let kill = std::process::Command::new("kill")
        .args(["-TERM", &child.id().to_string()])
        .status();
    assert!(kill.unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert!(
        message(&output).contains("a.exr holds the passes done so far"),
        "{}",
        message(&output)
    );
    assert_eq!(folder.names(), ["a.exr"]);
}

/// A pipe as a scene or a reference would be waited for without end.
#[cfg(unix)]
#[test]
fn pipes_are_refused() {
    let folder = Folder::new("pipes");
    for name in ["scene.xml", "reference.exr"] {
        let made = std::process::Command::new("mkfifo")
            .arg(folder.file(name))
            .status();
        if !made.is_ok_and(|status| status.success()) {
            println!("SKIPPED: mkfifo is missing");
            return;
        }
    }
    refused(&folder, &["scene.xml"], &["scene.xml", "regular"]);
    refused(
        &folder,
        &["cornell", "--reference", "reference.exr"],
        &["reference.exr", "regular"],
    );
}
