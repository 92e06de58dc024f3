//! The choice of a method, and what is said of it.

use super::Folder;
use serde_json::Value;

/// Without a method one is chosen, and said; with options it is one that takes them; in parts it is
/// the same, and tasks need not choose again.
#[test]
fn a_method_is_chosen_and_told() {
    let folder = Folder::new("auto");
    let tiny = ["--size", "40x30", "--out", "a.exr"];
    let told = |more: &[&str]| {
        let work = ["corridor", "--spp", "1400", "--explain"];
        folder.json(&[&work[..], &tiny, more].concat())
    };
    let (one, other) = (
        told(&["--threads", "1"]),
        told(&["--threads", "3", "--seed", "7"]),
    );
    let choice = &one["choice"];
    // Light around corners is found by sharing it, by whichever method.
    assert_eq!(one["method"], choice["method"]);
    assert_ne!(one["method"], "path");
    assert!(choice["trials"].as_array().unwrap().len() >= 2, "{choice}");
    assert!(choice["cost"].as_f64().unwrap() > 1.01, "{choice}");
    assert!(choice["pilot"]["seconds"].as_f64().unwrap() > 0.0);
    assert_eq!(
        (&other["choice"]["trials"], &other["choice"]["why"]),
        (&choice["trials"], &choice["why"])
    );
    let little = folder.json(&[&["many-lights", "--spp", "1", "--lights", "tree"][..], &tiny].concat());
    assert_eq!(little["choice"]["method"], "path:tree");
    let media = folder.json(&[&["cloud", "--spp", "1"][..], &tiny].concat());
    assert_eq!(media["method"], "volpath");
    let given = folder.json(&[&["cornell", "--spp", "1", "--method", "path"][..], &tiny].concat());
    assert_eq!(given["choice"], Value::Null);
    let job = [
        "many-lights",
        "--spp",
        "4",
        "--shards",
        "2",
        "--submit",
        "slurm",
        "--job",
        "job",
    ];
    assert!(folder.run(&[&job[..], &tiny].concat()).status.success());
    let task = std::fs::read_to_string(folder.file("job/task.sh")).unwrap();
    assert!(task.contains("--method path --lights bvh"), "{task}");
    let output = folder.run(&["cornell", "--method", "auto", "--cap", "2"]);
    assert_eq!(output.status.code(), Some(2));
}

/// A pilot ends when it is told to; nothing has been rendered then.
#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_pilot_writes_nothing() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    let folder = Folder::new("pilot");
    let mut child = folder
        .command(&["cornell", "--seconds", "600", "--threads", "1", "--out", "a.exr"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    super::wait_for_handler(&mut child);
    let (signalled, process) = (Instant::now(), child.id().to_string());
    assert!(
        Command::new("kill")
            .args(["-INT", &process])
            .status()
            .unwrap()
            .success()
    );
    let output = child.wait_with_output().unwrap();
    assert!(signalled.elapsed() < Duration::from_secs(60), "it went on");
    assert_eq!(output.status.code(), Some(130));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(
        message.contains("interrupted before the first pass was done"),
        "{message}"
    );
    assert!(folder.names().is_empty());
}

/// What is said to run or to be left out is what the counted rays say.
#[test]
fn explanations_are_true() {
    let folder = Folder::new("explain");
    let explained = |scene: &str, method: &str| -> Vec<(String, bool)> {
        let report = folder.json(&[scene, "--method", method, "--explain"]);
        assert_eq!(
            (&report["scene"], &report["method"]),
            (&Value::from(scene), &Value::from(method))
        );
        let passes = report["passes"].as_array().unwrap();
        passes
            .iter()
            .map(|pass| {
                assert!(pass["why"].as_str().unwrap().len() > 3);
                (
                    pass["pass"].as_str().unwrap().to_owned(),
                    pass["runs"].as_bool().unwrap(),
                )
            })
            .collect()
    };
    let runs =
        |passes: &[(String, bool)], name: &str| passes.iter().find(|(pass, _)| pass == name).unwrap().1;
    for (scene, replays) in [("cornell", false), ("cornell-glossy", true)] {
        let passes = explained(scene, "restir-pt");
        assert_eq!(runs(&passes, "random replay"), replays);
        assert!(!runs(&passes, "media") && !runs(&passes, "tree traversal"));
        let arguments = [scene, "--method", "restir-pt", "--size", "16x16", "--spp", "1"];
        let rays = folder.json(&arguments)["rays_per_sample"]["replay"].as_f64();
        assert_eq!(rays > Some(0.0), replays, "{rays:?}");
    }
    // Pixels share all but what smooth surfaces scatter.
    for (scene, replays) in [("cornell-glossy", false), ("pool", true)] {
        let passes = explained(scene, "restir-pt-offline");
        assert_eq!(runs(&passes, "random replay"), replays, "{scene}");
    }
    let cloud = explained("cloud", "volpath");
    assert!(runs(&cloud, "media") && runs(&cloud, "light from all around"));
    assert!(!runs(&cloud, "emission of media") && runs(&explained("fire", "volpath"), "emission of media"));
    let lights = explained("many-lights", "direct");
    assert!(runs(&lights, "tree traversal") && !runs(&lights, "indirect light"));
    assert!(
        folder.names().iter().all(|name| name == "out"),
        "nothing but what was rendered is written"
    );
}
