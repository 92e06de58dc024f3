//! Files that scenes refer to: the first byte says which kind, the rest is the file. The scene is
//! an error, or a description that becomes a scene or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lightshed_scene::import::load_with;
use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

mod checks;

/// Names of the file, and the scenes that refer to it.
const KINDS: [(&str, &str, &str); 14] = [
    ("f.png", "s.xml", BITMAP),
    ("f.jpg", "s.xml", BITMAP),
    ("f.bmp", "s.xml", BITMAP),
    ("f.hdr", "s.xml", BITMAP),
    ("f.exr", "s.xml", BITMAP),
    (
        "f.serialized",
        "s.xml",
        r#"<shape type="serialized"><string name="filename" value="FILE"/></shape>"#,
    ),
    (
        "f.txt",
        "s.xml",
        r#"<shape type="bsplinecurve"><string name="filename" value="FILE"/></shape>"#,
    ),
    (
        "f.spd",
        "s.xml",
        r#"<emitter type="constant"><spectrum name="radiance" filename="FILE"/></emitter>"#,
    ),
    ("f.xml", "s.xml", r#"<include filename="FILE"/>"#),
    ("f.pbrt.gz", "s.pbrt", r#"Include "FILE""#),
    (
        "f.ply",
        "s.pbrt",
        r#"WorldBegin Shape "plymesh" "string filename" "FILE""#,
    ),
    (
        "f.ply.gz",
        "s.pbrt",
        r#"WorldBegin Shape "plymesh" "string filename" "FILE""#,
    ),
    (
        "f.spd",
        "s.pbrt",
        r#"WorldBegin Material "conductor" "spectrum eta" "FILE" Shape "sphere""#,
    ),
    (
        "f.webp",
        "s.gltf",
        r#"{"asset":{"version":"2.0"},"images":[{"uri":"FILE"}],"textures":[{"extensions":{"EXT_texture_webp":{"source":0}}}],
"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"buffers":[{"byteLength":36,"uri":
"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],"bufferViews":[{"buffer":0,"byteLength":36}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
{"bufferView":0,"componentType":5126,"count":3,"type":"VEC2"}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}]}"#,
    ),
];

const BITMAP: &str = r#"<shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="bitmap">
<string name="filename" value="FILE"/></texture></bsdf></shape>"#;

static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(format!("lightshed-fuzz-{}", std::process::id()));
    for (index, (file, scene, text)) in KINDS.iter().enumerate() {
        let own = folder.join(index.to_string());
        fs::create_dir_all(&own).expect("a folder for files");
        let text = text.replace("FILE", file);
        let text = match *scene {
            "s.xml" => format!(r#"<scene version="3.0.0">{text}</scene>"#),
            _ => text,
        };
        fs::write(own.join(scene), text).expect("a scene");
    }
    folder
});

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, bytes)) = bytes.split_first() else {
        return;
    };
    let kind = usize::from(*kind) % KINDS.len();
    let (file, scene, _) = KINDS[kind];
    let folder = FOLDER.join(kind.to_string());
    fs::write(folder.join(file), bytes).expect("a file");
    if let Ok(loaded) = load_with(folder.join(scene), &[], &checks::limits()) {
        checks::scene(&loaded);
    }
});
