//! Scenes that are measured beside other renderers.

use lightshed::scene::{SceneDescription, builtin, import};
use std::error::Error;
use std::path::{Path, PathBuf};

/// Name, width, height, longest path in edges.
pub type Case = (&'static str, u32, u32, u32);

/// All of them.
pub const CASES: [Case; 5] = [
    ("cornell", 256, 256, 8),
    ("sponza_crytek", 240, 135, 6),
    ("classroom", 240, 135, 6),
    ("veach_ajar", 240, 135, 13),
    ("environment", 256, 256, 8),
];

/// The scene's file in the folder that `LIGHTSHED_SCENES` names, if it is there.
pub fn file(name: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(std::env::var_os("LIGHTSHED_SCENES")?);
    Some(folder.join(name).join("scene.xml")).filter(|path| path.is_file())
}

/// The scene in its file where there is one, else the built-in of that name.
pub fn describe(name: &str, file: Option<&Path>) -> Result<Option<SceneDescription>, Box<dyn Error>> {
    Ok(match file {
        Some(file) => Some(import::load(file, &[])?.description),
        None => builtin::by_name(name),
    })
}
