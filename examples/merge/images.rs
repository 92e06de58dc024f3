//! Shards sorted into images, and these merged.

use crate::Arguments;
use crate::error_chain::chain;
use crate::report::{Merged, status};
use crate::shard_files::files_of;
use crate::streams::say;
use lightshed::film::{OutputTarget, ShardFile, ShardSet};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The shards of each frame.
pub struct Images {
    frames: BTreeMap<Option<u32>, ShardSet>,
}

impl Images {
    /// Opens all files. `Err` names every one that is refused.
    pub fn open(paths: &[PathBuf]) -> Result<Self, Vec<String>> {
        let mut refusals = Vec::new();
        let mut frames: BTreeMap<Option<u32>, Vec<ShardFile>> = BTreeMap::new();
        for path in paths {
            match files_of(path) {
                Err(refusal) => refusals.push(refusal),
                Ok(files) => {
                    for file in files {
                        match ShardFile::open(file) {
                            Ok(shard) => frames
                                .entry(shard.header().image().frame)
                                .or_default()
                                .push(shard),
                            Err(error) => refusals.push(chain(&error)),
                        }
                    }
                }
            }
        }
        // Frames are images of one sequence.
        let mut keys = frames.values().filter_map(|files| files.first());
        if let Some(first) = keys.next() {
            for other in keys {
                let (key, mut found) = (first.header().image(), other.header().image().clone());
                (found.frame, found.scene_hash) = (key.frame, key.scene_hash);
                if let Some(difference) = key.difference(&found) {
                    let (first, other) = (first.path().display(), other.path().display());
                    refusals.push(format!(
                        "{other} belongs to another sequence than {first}: {difference}"
                    ));
                }
            }
        }
        let mut sets = BTreeMap::new();
        for (frame, files) in frames {
            match ShardSet::new(files) {
                Ok(set) => drop(sets.insert(frame, set)),
                Err(error) => refusals.push(chain(&error)),
            }
        }
        if sets.is_empty() && refusals.is_empty() {
            refusals.push("there is no shard to merge".to_owned());
        }
        match refusals.is_empty() {
            true => Ok(Self { frames: sets }),
            false => Err(refusals),
        }
    }

    /// Says what is there; whether that is all.
    pub fn status(&self, json: bool) -> Result<bool, String> {
        say(status(self.frames.values(), json)).map_err(|error| chain(&error))?;
        Ok(self.frames.values().all(|set| set.missing().is_none()))
    }

    /// Merges and writes each image; whether all were complete, or need not be.
    pub fn merge(&self, arguments: &Arguments) -> Result<bool, String> {
        let Some(out) = &arguments.out else {
            return Err("--out is missing".to_owned());
        };
        let numbered = self.frames.len() > 1;
        // Whatever can be known to fail fails before anything is read.
        let mut targets = Vec::new();
        for (frame, set) in &self.frames {
            if let Some(missing) = set.missing().filter(|_| !arguments.allow_missing) {
                let frame = frame.map_or(String::new(), |frame| format!("frame {frame}: "));
                return Err(format!("{frame}{missing}; --allow-missing merges what is there"));
            }
            let number = frame.filter(|_| numbered);
            let prepared = |path: &Path| {
                OutputTarget::prepare(numbered_file(path, number)).map_err(|error| chain(&error))
            };
            let variance = arguments.variance.as_deref().map(prepared).transpose()?;
            targets.push((set, prepared(out)?.with_exposure(arguments.exposure), variance));
        }
        for (set, target, variance) in targets {
            let film = set.merge_present().map_err(|error| chain(&error))?;
            target.write(&film.mean_image()).map_err(|error| chain(&error))?;
            if let Some(target) = variance {
                let image = film.variance_of_mean().ok_or("a single sample has no variance")?;
                target.write(&image).map_err(|error| chain(&error))?;
            }
            let merged = Merged::new(set, &film, target.path());
            say(merged.text(arguments.json)).map_err(|error| chain(&error))?;
        }
        Ok(true)
    }
}

/// `image-0007.exr` for frame 7 of several.
fn numbered_file(path: &Path, frame: Option<u32>) -> PathBuf {
    let Some(frame) = frame else {
        return path.to_owned();
    };
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{frame:04}."));
    name.push(path.extension().unwrap_or_default());
    path.with_file_name(name)
}
