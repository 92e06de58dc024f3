//! Shards, and the programs that make images of them.

use super::Folder;
use lightshed::film::{RgbImage, read_exr};
use serde_json::Value;
use std::process::Output;

const SCENE: [&str; 5] = ["cornell", "--size", "20x12", "--spp", "7"];

impl Folder {
    /// Runs an example and gives its lines of the standard output and of the error stream.
    fn words(&self, program: &str, arguments: &[&str]) -> (Option<i32>, String, String) {
        let output: Output = self.command_of(program, arguments).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (output.status.code(), text(output.stdout), text(output.stderr))
    }

    fn image(&self, name: &str) -> RgbImage {
        read_exr(self.file(name)).unwrap()
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.file(name)).unwrap()
    }
}

/// One process that renders several shards writes the bytes of one for each.
#[test]
fn shards_of_one_process_are_those_of_several() {
    let folder = Folder::new("several");
    for method in ["path", "path-reuse", "restir-di"] {
        let common = [&SCENE[..], &["--method", method]].concat();
        let run = |out: &str, part: &str| {
            let output = folder.run(&[&common[..], &["--json", "--out", out, "--shard", part]].concat());
            assert!(output.status.success());
            String::from_utf8(output.stdout).unwrap()
        };
        run("alone.exr", "1/4");
        run("alone.exr", "3/4");
        run("all.exr", "2/4");
        let said = run("all.exr", "1..4/4");
        let reports: Vec<Value> = said
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect();
        let skipped: Vec<bool> = reports.iter().map(|report| report["skipped"] == true).collect();
        assert_eq!(skipped, [true, false, false], "{said}");
        for part in [1, 3] {
            let [alone, all] = ["alone", "all"].map(|name| format!("{name}.shard-{part}-of-4.exr"));
            assert!(folder.bytes(&alone) == folder.bytes(&all), "{method} {part}");
        }
        assert!(!folder.file("all.shard-0-of-4.exr").exists());
    }
    for part in ["2..2/4", "1..5/4", "1../4", "1..2"] {
        let (code, _, error) = folder.words("render", &["--shard", part]);
        assert!(code == Some(2) && error.contains("--shard"), "{part}: {error}");
    }
}

/// Samples, independent frames, and frames that follow from each other.
#[test]
fn merged_shards_are_the_image_of_one_process_by_shards() {
    let folder = Folder::new("shards");
    for (method, chain) in [("path", false), ("path-reuse", false), ("restir-di", true)] {
        let common = [&SCENE[..], &["--method", method, "--seed", "3"]].concat();
        let out = format!("{method}.exr");
        let mut names = Vec::new();
        for part in ["2/3", "0/3", "1/3"] {
            let report = folder.json(&[&common[..], &["--out", &out, "--shard", part]].concat());
            assert_eq!(report["shard"]["part"], part);
            let name = format!("{method}.shard-{}-of-3.exr", &part[..1]);
            assert_eq!(report["output"], name.as_str());
            names.push(name);
        }
        let files: Vec<&str> = names.iter().map(String::as_str).collect();
        for (count, files) in [files.clone(), files.iter().rev().copied().collect()]
            .iter()
            .enumerate()
        {
            let merged = format!("merged-{count}.exr");
            let (code, _, error) = folder.words("merge", &[&files[..], &["--out", &merged]].concat());
            assert_eq!(code, Some(0), "{error}");
        }
        assert!(
            folder.bytes("merged-0.exr") == folder.bytes("merged-1.exr"),
            "{method}: the order matters"
        );
        folder.json(
            &[
                &common[..],
                &["--out", "by-shards.exr", "--shards", "3", "--threads", "2"],
            ]
            .concat(),
        );
        assert!(
            folder.bytes("merged-0.exr") == folder.bytes("by-shards.exr"),
            "{method}"
        );
        // All at once has the same samples, but of chains, which begin anew.
        folder.json(&[&common[..], &["--out", "plain.exr"]].concat());
        let (merged, plain) = (folder.image("merged-0.exr"), folder.image("plain.exr"));
        let pairs = merged
            .pixels()
            .as_flattened()
            .iter()
            .zip(plain.pixels().as_flattened());
        let worst = pairs
            .map(|(a, b)| (a - b).abs() / b.abs().max(1e-30))
            .fold(0.0, f32::max);
        assert_eq!(worst <= 2.0 * f32::EPSILON, !chain, "{method}: {worst}");
    }
}

#[test]
fn a_shard_that_is_there_is_kept_and_a_damaged_one_rendered_again() {
    let folder = Folder::new("kept");
    let arguments = [&SCENE[..], &["--out", "a.exr", "--shard", "1/2"]].concat();
    let name = "a.shard-1-of-2.exr";
    assert_eq!(folder.json(&arguments)["skipped"], Value::Null);
    let sound = folder.bytes(name);
    assert_eq!(folder.json(&arguments)["skipped"], true);
    assert_eq!(
        folder.json(&[&arguments[..], &["--again"]].concat())["skipped"],
        Value::Null
    );
    assert!(folder.bytes(name) == sound, "the same samples have other bits");
    let mut damaged = sound.clone();
    *damaged.last_mut().unwrap() ^= 1;
    folder.write(name, &damaged);
    assert_eq!(folder.json(&arguments)["skipped"], Value::Null);
    assert!(folder.bytes(name) == sound);
    // Another seed is another image.
    assert_eq!(
        folder.json(&[&arguments[..], &["--seed", "1"]].concat())["skipped"],
        Value::Null
    );
    assert!(folder.bytes(name) != sound);
    assert_eq!(folder.names(), [name]);
}

#[test]
fn merging_refuses_and_names_what_does_not_fit() {
    let folder = Folder::new("merge");
    for part in ["0/3", "1/3", "2/3"] {
        folder.json(&[&SCENE[..], &["--out", "a.exr", "--shard", part]].concat());
    }
    folder.json(&[&SCENE[..], &["--out", "b.exr", "--shard", "1/3", "--seed", "1"]].concat());
    folder.json(&[&SCENE[..], &["--out", "c.exr", "--shard", "1/2"]].concat());
    let [first, middle, last] = [0, 1, 2].map(|index| format!("a.shard-{index}-of-3.exr"));
    let mut bytes = folder.bytes(&middle);
    let place = bytes.len() / 2;
    bytes[place] ^= 4;
    folder.write("d.exr", &bytes);
    folder.write("e.exr", &bytes[..place]);
    let names = folder.names();
    let refused = |files: &[&str], words: &[&str]| {
        let (code, said, error) = folder.words("merge", &[files, &["--out", "image.exr"]].concat());
        assert_eq!((code, said.as_str()), (Some(1), ""), "{files:?}: {error}");
        assert!(error.lines().all(|line| line.starts_with("error: ")), "{error}");
        for word in words {
            assert!(error.contains(word), "{files:?}: no {word:?} in {error}");
        }
        assert_eq!(folder.names(), names);
    };
    refused(
        &[&first, &last],
        &["missing: shards 1/3", "2..4", "--allow-missing"],
    );
    refused(
        &[&first, "b.shard-1-of-3.exr", &last],
        &["b.shard-1-of-3.exr", "seed 1 instead of 0"],
    );
    refused(&[&first, "d.exr", &last], &["d.exr is damaged"]);
    refused(&[&first, "e.exr", &last], &["e.exr is truncated"]);
    refused(
        &[&first, &middle, "c.shard-1-of-2.exr"],
        &[&middle, "c.shard-1-of-2.exr", "samples 3 to 3"],
    );
    refused(&[&first, &middle, &middle, &last], &["samples 2 to 3 both"]);
    refused(&["nothing.exr", "d.exr", "e.exr"], &["nothing.exr", "e.exr"]);
    // What is there, and only if asked.
    let (code, said, _) = folder.words("merge", &["--status", &first, &last]);
    assert!(
        code == Some(1) && said.contains("2 shards, 5 of 7 samples (71 %), missing: shards 1/3"),
        "{said}"
    );
    let (code, said, _) = folder.words("merge", &["--status", "--json", &first, &middle, &last]);
    let status: Value = serde_json::from_str(&said).unwrap();
    assert!(
        code == Some(0) && status[0]["missing"].is_null() && status[0]["samples"] == 7,
        "{said}"
    );
    let (code, said, _) = folder.words(
        "merge",
        &[
            "--allow-missing",
            &first,
            &last,
            "--out",
            "some.exr",
            "--variance",
            "variance.exr",
        ],
    );
    assert!(
        code == Some(0) && said.contains("5 samples; missing: shards 1/3 (samples 2..4)"),
        "{said}"
    );
    assert!(folder.image("variance.exr").mean()[0] > 0.0);
    assert_eq!(folder.image("some.exr").width(), 20);
}

#[test]
fn frames_of_a_sequence_are_those_rendered_alone() {
    let folder = Folder::new("frames");
    let common = [
        "smoke-in-cornell",
        "--method",
        "volpath",
        "--media-motion",
        "orbit:20",
    ];
    let common = [&common[..], &["--size", "8x8", "--spp", "3", "--out", "f.exr"]].concat();
    for part in ["0/2", "1/2"] {
        assert!(
            folder
                .run(&[&common[..], &["--frames", "2..4", "--shard", part]].concat())
                .status
                .success()
        );
    }
    let (code, said, error) = folder.words("merge", &[".", "--out", "m.exr"]);
    assert!(code == Some(0) && said.contains("frame 3"), "{said}{error}");
    for frame in ["2", "3"] {
        let out = format!("alone-{frame}.exr");
        let own = ["--frame", frame, "--shards", "2", "--out", &out];
        let mut alone = common[..common.len() - 2].to_vec();
        alone.extend(own);
        assert!(folder.run(&alone).status.success());
        assert!(
            folder.bytes(&out) == folder.bytes(&format!("m-000{frame}.exr")),
            "frame {frame}"
        );
    }
    assert!(folder.bytes("m-0002.exr") != folder.bytes("m-0003.exr"));
    // Independent frames of a camera that moves: numbers of frames are those of the whole sequence.
    let moving = [
        "cornell",
        "--method",
        "restir-pt-offline",
        "--motion",
        "orbit:3",
        "--size",
        "6x4",
        "--out",
        "o.exr",
    ];
    assert!(
        folder
            .run(&[&moving[..], &["--frames", "3", "--sequence"]].concat())
            .status
            .success()
    );
    let last = folder.bytes("o-0002.exr");
    std::fs::remove_file(folder.file("o-0002.exr")).unwrap();
    assert!(
        folder
            .run(&[&moving[..], &["--frames", "2..3"]].concat())
            .status
            .success()
    );
    assert!(folder.bytes("o-0002.exr") == last);
}

#[cfg(unix)]
#[test]
fn what_schedulers_run_renders_every_task() {
    let folder = Folder::new("submit");
    let common = ["cornell", "--size", "8x6", "--seed", "5", "--frames", "5"];
    let common = [&common[..], &["--out", "it's.exr", "--shards", "2"]].concat();
    for (system, file, words) in [
        (
            "slurm",
            "job.sbatch",
            &["--array=0-1", "--requeue", "task.sh", "SLURM_ARRAY_TASK_ID"][..],
        ),
        ("ray", "job.py", &["max_retries", "retry_exceptions", "TASKS = 2"]),
        (
            "openjd",
            "template.json",
            &["jobtemplate-2023-09", "\"0-1\"", "Task.Param.Task"],
        ),
    ] {
        let output = folder.run(&[&common[..], &["--submit", system]].concat());
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.starts_with("2 tasks: 2 shards of 5 samples"), "{said}");
        let text = std::fs::read_to_string(folder.file("it's.job").join(file)).unwrap();
        words
            .iter()
            .for_each(|word| assert!(text.contains(word), "{file}: no {word}"));
    }
    let script = |name: &str, argument: &[&str]| {
        let mut command = std::process::Command::new(folder.file("it's.job").join(name));
        command.args(argument).current_dir("/").output().unwrap()
    };
    for task in ["1", "0"] {
        let output = script("task.sh", &[task]);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
    assert!(script("merge.sh", &["--status"]).status.success());
    assert!(script("merge.sh", &[]).status.success());
    let whole = [
        "cornell", "--size", "8x6", "--seed", "5", "--spp", "5", "--shards", "2",
    ];
    folder.json(&[&whole[..], &["--out", "whole.exr"]].concat());
    assert!(folder.bytes("it's.exr") == folder.bytes("whole.exr"));
    // Several shards a task: the last has what is left.
    let few = [
        "cornell",
        "--size",
        "4x4",
        "--spp",
        "5",
        "--out",
        "few.exr",
        "--shards",
        "5",
        "--per-task",
        "2",
    ];
    let output = folder.run(&[&few[..], &["--submit", "openjd"]].concat());
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.starts_with("3 tasks: 5 shards of 5 samples, 2 in a task"),
        "{said}"
    );
    for (task, there) in [("2", 1), ("0", 3)] {
        let output = std::process::Command::new(folder.file("few.job/task.sh"))
            .arg(task)
            .output()
            .unwrap();
        assert!(output.status.success());
        let names = folder.names();
        let shards = names.iter().filter(|name| name.contains("few.shard-")).count();
        assert_eq!(shards, there, "{names:?}");
    }
    // Without it: as many as make reading the scene cheap, while there are 64 tasks.
    let many = ["cornell", "--size", "4x4", "--spp", "640", "--out", "many.exr"];
    for (shards, said) in [
        ("640", "64 tasks: 640 shards of 640 samples, 10 in a task"),
        (
            "64",
            "64 tasks: 64 shards of 640 samples.\n\nReading the scene takes",
        ),
    ] {
        let output = folder.run(&[&many[..], &["--shards", shards, "--submit", "slurm"]].concat());
        let found = String::from_utf8(output.stdout).unwrap();
        assert!(found.starts_with(said), "{found}");
    }
    // Frames times shards.
    let moving = [
        "cloud",
        "--method",
        "volpath",
        "--media-motion",
        "translate:0,1,0",
        "--size",
        "4x4",
        "--spp",
        "2",
    ];
    let job = [
        "--frames", "1..4", "--shards", "2", "--out", "c.exr", "--submit", "ray", "--job", "jobs",
    ];
    let output = folder.run(&[&moving[..], &job].concat());
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let task = std::process::Command::new(folder.file("jobs/task.sh"))
        .arg("3")
        .output()
        .unwrap();
    assert!(task.status.success(), "{}", String::from_utf8_lossy(&task.stderr));
    assert!(
        folder.file("c-0002.shard-1-of-2.exr").exists(),
        "{:?}",
        folder.names()
    );
}

/// Two methods of the same expectation agree, and a method of direct light alone does not.
#[cfg(feature = "evaluate")]
#[test]
fn methods_agree_by_their_shards() {
    let folder = Folder::new("agree");
    let shards = |method: &str, seed: &str, depth: &str, more: &[&str]| {
        let arguments = [
            "cornell", "--size", "16x12", "--spp", "96", "--method", method, "--seed", seed,
        ];
        let out = format!("{method}-{seed}.exr");
        let names = (0..12).map(|index| {
            let part = format!("{index}/12");
            let report = folder.json(
                &[
                    &arguments[..],
                    more,
                    &["--max-depth", depth, "--out", &out, "--shard", &part],
                ]
                .concat(),
            );
            report["output"].as_str().unwrap().to_owned()
        });
        names.collect::<Vec<_>>()
    };
    let independent = ["--points", "independent"];
    let path = shards("path", "1", "4", &independent);
    let reuse = shards("path-reuse", "2", "4", &independent);
    let agree = |a: &[String], b: &[String], more: &[&str]| {
        let mut words: Vec<&str> = a.iter().map(String::as_str).collect();
        words.push("--against");
        words.extend(b.iter().map(String::as_str));
        words.extend(more);
        folder.words("agree", &words)
    };
    // To two per cent they agree, or noise is too large to tell: a difference would be status 3.
    let (code, said, error) = agree(&path, &reuse, &["--within", "2", "--confidence", "0.999"]);
    assert!(matches!(code, Some(0 | 4)), "{said}{error}");
    let (_, said, _) = agree(&path, &reuse, &["--json"]);
    let found: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(
        (&found["baseline"]["shards"], &found["against"]["samples"]),
        (&12.into(), &96.into())
    );
    let mid = found["channels"][3]["relative"]["mid"].as_f64().unwrap();
    assert!(mid.abs() < 0.1, "{said}");
    // Other images, the same random numbers, too few.
    let shorter = shards("path", "3", "2", &independent);
    let (code, _, error) = agree(&path, &shorter, &[]);
    assert!(code == Some(1) && error.contains("different images"), "{error}");
    let (code, _, error) = agree(&path[..6], &path[6..], &[]);
    assert!(
        code == Some(1) && error.contains("both methods have seed 1"),
        "{error}"
    );
    let stratified = shards("path", "4", "4", &[]);
    let (code, _, error) = agree(&stratified, &reuse, &[]);
    assert!(code == Some(1) && error.contains("same point set"), "{error}");
    let (code, _, error) = agree(&path[..1], &reuse, &[]);
    assert!(code == Some(1) && error.contains("two shards"), "{error}");
}
