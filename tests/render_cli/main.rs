//! The example `render` as a user meets it: as a program with arguments, streams, files and an exit
//! status.

mod choice;
mod lanes;
mod safety;
mod shards;

use lightshed::film::{RgbImage, read_exr, write_exr};
use serde_json::Value;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The binary of an example, which cargo builds beside the tests.
fn binary(name: &str) -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let profile = test.ancestors().nth(2).unwrap();
    let path = profile
        .join("examples")
        .join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    assert!(
        path.is_file(),
        "{} is missing: run `cargo build --example {name}`",
        path.display()
    );
    path
}

/// A folder to work in, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lightshed-render-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.file(name), content).unwrap();
    }

    /// Names of all files and folders in it.
    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        let mut names: Vec<_> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn command(&self, arguments: &[&str]) -> Command {
        self.command_of("render", arguments)
    }

    /// Another example.
    fn command_of(&self, program: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(binary(program));
        command.current_dir(&self.0).args(arguments);
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// Runs with `--json` and gives the object that must be all there is on the standard output.
    fn json(&self, arguments: &[&str]) -> Value {
        let output = self.run(&[arguments, &["--json"]].concat());
        assert!(
            output.status.success(),
            "{arguments:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        serde_json::from_slice(&output.stdout).unwrap()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).ok();
    }
}

#[test]
fn without_a_scene_it_renders_the_cornell_box_and_says_where() {
    let folder = Folder::new("default");
    let output = folder.run(&["--spp", "2", "--size", "32x32"]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        text.contains("cornell: 32x32 pixels, 2 samples each, path"),
        "{text}"
    );
    let place = Path::new("out").join("cornell.png");
    assert!(text.contains(&format!("wrote {}", place.display())), "{text}");
    assert!(
        std::fs::read(folder.0.join(place))
            .unwrap()
            .starts_with(b"\x89PNG")
    );
    // No bar without a terminal.
    assert!(
        output.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn json_holds_every_figure() {
    let folder = Folder::new("json");
    let common = ["cornell", "--spp", "4", "--size", "24x16", "--max-depth", "3"];
    let first = folder.json(&[&common[..], &["--out", "a.exr"]].concat());
    assert_eq!(first["reference"], Value::Null);
    let arguments = [
        "--out",
        "b.exr",
        "--reference",
        "a.exr",
        "--seed",
        "7",
        "--method",
        "path",
    ];
    let report = folder.json(&[&common[..], &arguments].concat());
    for (key, expected) in [
        ("width", 24),
        ("height", 16),
        ("spp", 4),
        ("max_depth", 3),
        ("seed", 7),
    ] {
        assert_eq!(report[key], expected, "{key}");
    }
    assert_eq!(
        (&report["method"], &report["scene"]),
        (&"path".into(), &"cornell".into())
    );
    assert_eq!(
        (&report["non_finite_samples"], &report["interrupted"]),
        (&0.into(), &false.into())
    );
    assert_eq!(
        (&report["output"], &report["warnings"]),
        (&"b.exr".into(), &Value::Array(Vec::new()))
    );
    let number = |key: &str| report[key].as_f64().unwrap();
    for key in ["seconds", "setup_seconds", "paths_per_second"] {
        assert!(number(key) > 0.0, "{key}: {report}");
    }
    // Two parts of one whole.
    let (reading, building) = (number("reading_seconds"), number("building_seconds"));
    assert!(reading > 0.0 && building > 0.0, "{report}");
    assert!(reading + building < number("setup_seconds"), "{report}");
    if cfg!(target_os = "linux") {
        for key in ["cpu_seconds", "reading_cpu_seconds", "building_cpu_seconds"] {
            assert!(number(key) > 0.0, "{key}: {report}");
        }
        assert!(report["paths_per_cpu_second"].as_f64().unwrap() > 0.0);
    }
    let image = read_exr(folder.file("b.exr")).unwrap();
    for (c, mean) in image.mean().into_iter().enumerate() {
        assert!((report["mean_rgb"][c].as_f64().unwrap() - mean).abs() < 1e-9 && mean > 0.0);
    }
    // Another seed gives another image, so errors are there and positive, but no more than noise.
    let reference = &report["reference"];
    assert_eq!(reference["path"], "a.exr");
    for key in ["mse", "relative_mse", "mape"] {
        assert!(reference[key].as_f64().unwrap() > 0.0, "{key}: {reference}");
    }
    let similarity = reference["ssim"].as_f64().unwrap();
    assert!((0.01..0.999).contains(&similarity), "{similarity}");
    assert_eq!(reference["flip"].is_null(), !cfg!(feature = "flip"));
    for c in 0..3 {
        assert!(reference["relative_mean"][c].as_f64().unwrap().abs() < 0.5);
    }
    // The same seed again is the same image.
    let same = folder.json(&[&common[..], &["--out", "c.exr", "--reference", "a.exr"]].concat());
    assert_eq!(
        (&same["reference"]["mse"], &same["reference"]["ssim"]),
        (&0.0.into(), &1.0.into())
    );
}

#[test]
fn the_image_does_not_depend_on_the_threads() {
    let folder = Folder::new("threads");
    for method in ["path", "direct"] {
        let render = |name: &str, seed: &str, threads: &str| {
            let arguments = ["cornell", "--spp", "3", "--size", "41x30", "--method", method];
            folder.json(
                &[
                    &arguments[..],
                    &["--seed", seed, "--threads", threads, "--out", name],
                ]
                .concat(),
            );
            std::fs::read(folder.file(name)).unwrap()
        };
        let one = render("one.exr", "5", "1");
        assert!(
            one == render("two.exr", "5", "2"),
            "{method}: two threads differ from one"
        );
        assert!(
            one == render("three.exr", "5", "3"),
            "{method}: three threads differ from one"
        );
        assert!(
            one != render("other.exr", "6", "1"),
            "{method}: the seed changes nothing"
        );
    }
}

#[test]
fn a_time_budget_is_kept() {
    let folder = Folder::new("seconds");
    let report = folder.json(&["cornell", "--seconds", "0.5", "--size", "16x16", "--out", "a.exr"]);
    let (spp, seconds) = (
        report["spp"].as_u64().unwrap(),
        report["seconds"].as_f64().unwrap(),
    );
    assert!(spp > 1, "{report}");
    // Late on a machine that is busy otherwise, but never early by more than half a pass.
    assert!(seconds > 0.25, "{seconds}");
    assert_eq!(report["interrupted"], false);
}

/// Whether the process has installed a handler for SIGINT.
#[cfg(target_os = "linux")]
fn catches_interrupts(process: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let mask = caught
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or(0);
    mask & (1 << (2 - 1)) != 0
}

/// Waits until the process has installed its handler.
#[cfg(target_os = "linux")]
#[track_caller]
fn wait_for_handler(child: &mut std::process::Child) {
    use std::time::{Duration, Instant};

    let start = Instant::now();
    while !catches_interrupts(child.id()) {
        assert!(
            start.elapsed() < Duration::from_secs(120),
            "no handler was installed"
        );
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn an_interruption_writes_the_whole_passes_done_so_far() {
    use std::process::Stdio;
    use std::time::{Duration, Instant};

    let folder = Folder::new("interruption");
    let work = ["cornell", "--method", "path", "--size", "16x16"];
    let common = [&work[..], &["--threads", "1", "--json"]].concat();
    let mut child = folder
        .command(&[&common[..], &["--seconds", "600", "--out", "interrupted.exr"]].concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for_handler(&mut child);
    // Time for the first pass, which takes milliseconds.
    std::thread::sleep(Duration::from_millis(500));
    let signalled = Instant::now();
    let killed = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    assert!(signalled.elapsed() < Duration::from_secs(60), "it went on");
    assert_eq!(output.status.code(), Some(130));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(
        message.contains("interrupted; interrupted.exr holds the passes done so far"),
        "{message}"
    );
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["interrupted"], true);
    assert_eq!(folder.names(), ["interrupted.exr"]);
    // What was written is what asking for as many samples gives, bit for bit.
    let spp = report["spp"].as_u64().unwrap();
    assert!(spp >= 1);
    let arguments = ["--spp", &spp.to_string(), "--out", "whole.exr"];
    assert!(folder.run(&[&common[..], &arguments].concat()).status.success());
    let bytes = |name| std::fs::read(folder.file(name)).unwrap();
    assert!(
        bytes("interrupted.exr") == bytes("whole.exr"),
        "the interrupted image holds part of a pass"
    );
}

/// A Mitsuba scene of one mesh file under a constant sky.
const SCENE: &str = r#"<scene version="3.0.0">
    <default name="side" value="8"/>
    <sensor type="perspective">
        <float name="fov" value="45"/>
        <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm">
            <integer name="width" value="$side"/>
            <integer name="height" value="8"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    <emitter type="constant"><rgb name="radiance" value="1"/></emitter>
    <shape type="ply">
        <string name="filename" value="mesh.ply"/>
        <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></bsdf>
    </shape>
</scene>
"#;

/// A scene of nothing but a camera.
const EMPTY: &str =
    r#"<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="45"/></sensor></scene>"#;

fn ply(vertices: &str, face: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n{vertices}\n{face}\n"
    )
}

#[test]
fn a_mitsuba_scene_renders_and_takes_definitions() {
    let folder = Folder::new("mitsuba");
    folder.write("scene.xml", SCENE);
    folder.write("mesh.ply", ply("-1 -1 0\n1 -1 0\n0 1 0", "3 0 1 2"));
    let arguments = [
        "scene.xml",
        "--spp",
        "16",
        "--define",
        "side=12",
        "--out",
        "a.exr",
    ];
    let report = folder.json(&arguments);
    assert_eq!((&report["width"], &report["height"]), (&12.into(), &8.into()));
    let image = read_exr(folder.file("a.exr")).unwrap();
    // The sky is 1; the triangle before it sends half of it back, to the camera from half of all
    // directions or from all.
    assert_eq!(image.get(0, 0), Some([1.0; 3]));
    let middle = image.get(6, 4).unwrap()[0];
    assert!((0.2..0.6).contains(&middle), "{middle}");
}

#[test]
fn bad_input_is_one_line_before_rendering_and_leaves_nothing() {
    let folder = Folder::new("errors");
    let sound = ply("-1 -1 0\n1 -1 0\n0 1 0", "3 0 1 2");
    folder.write("empty.xml", EMPTY);
    folder.write("malformed.xml", &SCENE[..SCENE.len() - 20]);
    folder.write("no_mesh.xml", SCENE.replace("mesh.ply", "missing.ply"));
    let meshes = [
        ("truncated", sound[..sound.len() - 12].to_owned()),
        ("nan", ply("-1 -1 0\n1 nan 0\n0 1 0", "3 0 1 2")),
        ("index", ply("-1 -1 0\n1 -1 0\n0 1 0", "3 0 1 7")),
    ];
    for (name, mesh) in meshes {
        folder.write(&format!("{name}.ply"), mesh);
        folder.write(
            &format!("{name}.xml"),
            SCENE.replace("mesh.ply", &format!("{name}.ply")),
        );
    }
    folder.write("truncated.glb", b"glTF\x02\0\0\0");
    folder.write("unknown.scene", "");
    folder.write("half.exr", b"\x76\x2f\x31\x01\x02");
    let mut reference = Cursor::new(Vec::new());
    write_exr(&RgbImage::from_fn(5, 4, |_, _| [1.0; 3]).unwrap(), &mut reference).unwrap();
    folder.write("five.exr", reference.into_inner());
    std::fs::create_dir(folder.file("folder.png")).unwrap();
    let names = folder.names();

    let refused = |arguments: &[&str], status: i32, words: &[&str]| {
        let output = folder.run(arguments);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(status), "{arguments:?}: {message}");
        assert!(
            message.starts_with("error: ") && message.lines().count() == 1,
            "{arguments:?}: {message}"
        );
        for word in words {
            assert!(message.contains(word), "{arguments:?}: no {word:?} in {message}");
        }
        assert!(output.stdout.is_empty(), "{arguments:?} rendered");
        assert_eq!(folder.names(), names, "{arguments:?} left something behind");
    };

    // Scenes.
    refused(&["missing.xml"], 1, &["missing.xml", "no file", "cornell"]);
    refused(&["cornel"], 1, &["cornel", "no built-in scene"]);
    refused(&["cornell", "--adaptive", "--spp", "1"], 1, &["--adaptive"]);
    refused(&["unknown.scene"], 1, &["unknown.scene"]);
    refused(&["empty.xml"], 1, &["empty.xml"]);
    refused(&["malformed.xml"], 1, &["malformed.xml"]);
    refused(&["no_mesh.xml"], 1, &["missing.ply"]);
    refused(&["truncated.xml"], 1, &["truncated.ply"]);
    refused(&["nan.xml"], 1, &["nan"]);
    refused(&["index.xml"], 1, &["index"]);
    refused(&["truncated.glb"], 1, &["truncated.glb"]);
    refused(&["folder.png"], 1, &["folder.png"]);
    refused(&["cornell", "--define", "a=b"], 1, &["cornell", "a"]);
    // Outputs.
    refused(
        &["--out", "missing/image.exr"],
        1,
        &["missing/image.exr", "folder"],
    );
    refused(&["--out", "image.jpg"], 1, &["image.jpg", ".exr"]);
    refused(&["--out", "folder.png"], 1, &["folder.png"]);
    if cfg!(target_os = "linux") {
        refused(&["--out", "/proc/image.exr"], 1, &["/proc/image.exr"]);
    }
    // References.
    refused(&["--reference", "missing.exr"], 1, &["missing.exr"]);
    refused(&["--reference", "half.exr"], 1, &["half.exr"]);
    refused(
        &["--reference", "five.exr", "--size", "4x5"],
        1,
        &["five.exr", "5x4", "4x5"],
    );
    // Numbers and names.
    refused(&["--size", "0x5"], 2, &["--size", "pixel"]);
    refused(&["--size", "5"], 2, &["--size", "640x480"]);
    refused(&["--size", "1000000x1000000"], 1, &["too large"]);
    refused(&["--spp", "0"], 2, &["--spp"]);
    refused(&["--spp", "4", "--seconds", "1"], 2, &["--spp", "--seconds"]);
    refused(&["--seconds", "nan"], 2, &["--seconds", "positive"]);
    refused(&["--seconds", "-1"], 2, &["-1"]);
    refused(&["--max-depth", "0"], 2, &["--max-depth"]);
    refused(
        &["--max-depth", "3", "--method", "direct"],
        1,
        &["--max-depth", "direct"],
    );
    refused(&["--threads", "1000000"], 2, &["--threads", "1024"]);
    refused(&["--method", "magic"], 2, &["magic", "path", "direct"]);
    refused(&["--define", "key"], 2, &["key=value"]);
    refused(&["--frobnicate"], 2, &["--frobnicate"]);
    // Motion and sequences.
    refused(&["--sequence"], 1, &["--sequence", "auto"]);
    let moving = ["--media-motion", "orbit:5"];
    let with = |more: &[&'static str]| [&moving[..], more].concat();
    refused(&with(&[]), 1, &["--media-motion", "auto"]);
    refused(
        &with(&["cloud", "--method", "volpath"]),
        1,
        &["--frame", "volpath"],
    );
    let reused = ["cloud", "--method", "restir-volume"];
    refused(
        &with(&[&reused[..], &["--frame", "2"]].concat()),
        1,
        &["--frame", "restir-volume"],
    );
    refused(
        &with(&[&reused[..], &["--seconds", "2"]].concat()),
        1,
        &["--seconds"],
    );
    refused(
        &with(&[&reused[..], &["--frames", "100000"]].concat()),
        1,
        &["100000", "memory"],
    );
    refused(&with(&["cornell", "--method", "restir-volume"]), 1, &["media"]);
    refused(&["cloud", "--frame", "2"], 2, &["--media-motion"]);
    // Shards and frames.
    let shard =
        |part: &'static str, more: &[&'static str]| [&["--out", "a.exr", "--shard", part], more].concat();
    refused(&shard("3/3", &[]), 2, &["--shard", "3/3", "from 0"]);
    refused(&shard("3", &[]), 2, &["--shard", "2/8"]);
    refused(&shard("0/2", &["--seconds", "1"]), 2, &["--shard", "--seconds"]);
    refused(&shard("4/9", &["--spp", "3"]), 1, &["4/9", "3 samples"]);
    refused(&["--shard", "0/2", "--out", "a.png"], 1, &[".exr"]);
    refused(&["--shards", "4", "--spp", "3"], 1, &["0/4", "3 samples"]);
    refused(
        &["--shards", "4", "--spp", "3", "--submit", "ray"],
        1,
        &["3 samples", "4 shards"],
    );
    refused(
        &["--shards", "2", "--spp", "3", "--submit", "ray", "--out", "a.png"],
        1,
        &[".exr"],
    );
    refused(&["--submit", "cron"], 2, &["slurm", "ray", "openjd"]);
    refused(&["--frames", "2..2"], 2, &["no frame"]);
    refused(&["--frames", "2", "--spp", "2"], 2, &["--spp"]);
    refused(&["--frames", "2..4"], 1, &["moves"]);
    refused(
        &["--frames", "2..4", "--motion", "orbit:1", "--method", "restir-pt"],
        1,
        &["restir-pt", "follow"],
    );
    let offline = [
        "--shard",
        "0/2",
        "--motion",
        "orbit:1",
        "--method",
        "restir-pt-offline",
    ];
    refused(&[&offline[..], &["--spp", "4"]].concat(), 1, &["--frames A..B"]);
}

/// Smoke that drifts up: each frame is written, the last one is the image, and it is the light of
/// the place where the smoke is by then.
#[test]
fn media_move_and_frames_are_written() {
    let folder = Folder::new("media-motion");
    let common = [
        "smoke-in-cornell",
        "--size",
        "12x12",
        "--max-depth",
        "2",
        "--media-motion",
        "translate:0.5,-0.2,0",
    ];
    let run = |more: &[&str]| folder.json(&[&common[..], more].concat());
    let report = run(&[
        "--method",
        "restir-volume",
        "--points",
        "independent",
        "--frames",
        "3",
        "--sequence",
        "--out",
        "smoke.exr",
    ]);
    assert_eq!(report["spp"], 3);
    assert_eq!(
        folder.names(),
        ["smoke-0000.exr", "smoke-0001.exr", "smoke-0002.exr", "smoke.exr"]
    );
    let image = |name: &str| read_exr(folder.file(name)).unwrap();
    assert_eq!(image("smoke.exr"), image("smoke-0002.exr"));
    assert_ne!(image("smoke-0000.exr"), image("smoke-0001.exr"));
    for (frame, name) in [("0", "first.exr"), ("2", "last.exr")] {
        run(&[
            "--method", "volpath", "--spp", "256", "--frame", frame, "--out", name,
        ]);
    }
    // Of unlike pictures, that of the right frame is much the nearer, though it is one sample of
    // each pixel.
    let distance = |a: &str, b: &str| {
        let (a, b) = (image(a), image(b));
        let pixels = (0..144).map(|i| [a.get(i % 12, i / 12).unwrap(), b.get(i % 12, i / 12).unwrap()]);
        // The light itself is left out.
        let seen = pixels.filter(|[a, _]| a[0] < 2.0);
        seen.map(|[a, b]| f64::from((a[1] - b[1]).abs())).sum::<f64>()
    };
    let (near, far) = (
        distance("smoke.exr", "last.exr"),
        distance("smoke.exr", "first.exr"),
    );
    println!("{near} to the frame's own, {far} to the first");
    assert!(near < 0.8 * far, "{near} and {far}");
}

#[test]
fn help_is_no_error() {
    let folder = Folder::new("help");
    let output = folder.run(&["--help"]);
    assert!(output.status.success() && output.stderr.is_empty());
    let text = String::from_utf8(output.stdout).unwrap();
    for option in [
        "--method",
        "--spp",
        "--seconds",
        "--size",
        "--reference",
        "--json",
        "--define",
        "--shard",
        "--submit",
        "[default: cornell]",
    ] {
        assert!(text.contains(option), "no {option} in {text}");
    }
}

/// Where to render: with the feature `gpu` the image is that of the threads, and seconds by kernel
/// are there if there is a device; without it the option says what it lacks.
#[test]
fn a_gpu_renders_the_same_image() {
    let folder = Folder::new("gpu");
    let arguments = ["cornell", "--size", "32x32", "--spp", "4", "--out"];
    let on_gpu = [&arguments[..], &["gpu.exr", "--device", "gpu", "--json"]].concat();
    let output = folder.run(&on_gpu);
    let message = String::from_utf8_lossy(&output.stderr);
    if !cfg!(feature = "gpu") {
        assert!(
            !output.status.success() && message.contains("feature gpu"),
            "{message}"
        );
        return;
    }
    if message.contains("no GPU adapter") {
        let required = std::env::var("LIGHTSHED_REQUIRE_GPU").is_ok_and(|value| value == "1");
        assert!(!required, "{message}");
        println!("SKIPPED: {message}");
        return;
    }
    assert!(output.status.success(), "{message}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(report["device"].is_string(), "{report}");
    // The device draws independent numbers, and paths find the emission that the camera sees.
    let as_on_device = ["cpu.exr", "--reference", "gpu.exr"];
    let options = ["--points", "independent", "--visible", "paths"];
    let compared = folder.json(&[&arguments[..], &as_on_device, &options].concat());
    assert!(compared["reference"]["mape"].as_f64() < Some(1e-3), "{compared}");
    // What the device does not know is said in one line.
    for other in [
        ["fire", "volpath"],
        ["cloud", "restir-volume"],
        ["cornell", "restir-gi"],
    ] {
        let output = folder.run(&[other[0], "--method", other[1], "--device", "gpu"]);
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(
            !output.status.success() && message.lines().count() >= 1,
            "{message}"
        );
    }
}
