//! Shards of one method, of any number of seeds.

use crate::error_chain::chain;
use crate::shard_files::files_of;
use lightshed::evaluate::ShardMeans;
use lightshed::film::{ImageKey, ShardFile, ShardSet};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Shards of one method that have no samples in common.
pub struct Shards {
    /// By seed, and by number of samples in all.
    sets: BTreeMap<(u64, u32), ShardSet>,
    key: ImageKey,
}

impl Shards {
    /// Opens files, and all shards in folders.
    pub fn open(paths: &[PathBuf]) -> Result<Self, String> {
        let mut seeds: BTreeMap<(u64, u32), Vec<ShardFile>> = BTreeMap::new();
        for path in paths {
            for file in files_of(path)? {
                let shard = ShardFile::open(file).map_err(|error| chain(&error))?;
                let image = shard.header().image();
                seeds.entry((image.seed, image.samples)).or_default().push(shard);
            }
        }
        let mut sets: BTreeMap<(u64, u32), ShardSet> = BTreeMap::new();
        let mut key: Option<ImageKey> = None;
        for (seed, files) in seeds {
            let set = ShardSet::new(files).map_err(|error| chain(&error))?;
            let first = key.get_or_insert_with(|| set.image().clone());
            let found = ImageKey {
                seed: first.seed,
                samples: first.samples,
                ..set.image().clone()
            };
            if let Some(difference) = first.difference(&found) {
                let path = set.files()[0].path().display();
                return Err(format!("{path} is of another image: {difference}"));
            }
            if sets.keys().any(|(other, _)| *other == seed.0) {
                let path = set.files()[0].path().display();
                return Err(format!(
                    "{path} may have samples of seed {} that others have",
                    seed.0
                ));
            }
            if !found.independent && set.files().len() > 1 {
                let path = set.files()[1].path().display();
                return Err(format!(
                    "{path} has samples of the same point set as others of seed {}: give each shard a seed of its own, or --points independent",
                    seed.0
                ));
            }
            sets.insert(seed, set);
        }
        let key = key.ok_or("there are no shards")?;
        Ok(Self { sets, key })
    }

    /// What the shards have in common, with the seed of the first.
    pub fn key(&self) -> &ImageKey {
        &self.key
    }

    /// Refuses what says nothing of two methods: other scenes, and random numbers in common.
    pub fn check_against(&self, other: &Self) -> Result<(), String> {
        let found = ImageKey {
            method: self.key.method.clone(),
            options: self.key.options.clone(),
            seed: self.key.seed,
            independent: self.key.independent,
            samples: self.key.samples,
            ..other.key.clone()
        };
        if let Some(difference) = self.key.difference(&found) {
            return Err(format!("the shards are of different images: {difference}"));
        }
        match self
            .sets
            .keys()
            .find(|(seed, _)| other.sets.keys().any(|(others, _)| others == seed))
        {
            Some((seed, _)) => Err(format!(
                "both methods have seed {seed}: their random numbers are not independent"
            )),
            None => Ok(()),
        }
    }

    /// Means of all shards, read in the order of seeds and samples.
    pub fn means(&self, tile: u32) -> Result<ShardMeans, String> {
        let mut means = ShardMeans::new(self.key.size, tile);
        for file in self.sets.values().flat_map(ShardSet::files) {
            let shard = file.read().map_err(|error| chain(&error))?;
            means.push(shard.film()).map_err(|error| error.to_string())?;
        }
        Ok(means)
    }
}
