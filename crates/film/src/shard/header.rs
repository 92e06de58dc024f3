//! What a shard says of itself.

use super::part::ShardPart;
use std::fmt::Write;
use std::ops::Range;

/// The common data of all shards of one image. Shards that differ in any of it are not merged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageKey {
    /// The scene's name, for people.
    pub scene: String,
    /// A fingerprint of what the scene contains.
    pub scene_hash: u64,
    /// The method's name.
    pub method: String,
    /// Everything else that the samples depend on, in one canonical form: options of the method,
    /// motion, the program's version.
    pub options: String,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Whether samples are independent of each other. Samples of a point set are not: shards of one
    /// seed then have parts of one set.
    pub independent: bool,
    /// Number of the frame in a sequence; `None` for a single image.
    pub frame: Option<u32>,
    /// Samples of every pixel in all shards together.
    pub samples: u32,
    /// Width and height in pixels.
    pub size: [u32; 2],
}

/// Which samples of which image a shard has: `first … end − 1` of every pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShardHeader {
    image: ImageKey,
    part: ShardPart,
    first: u32,
    end: u32,
}

impl ImageKey {
    /// The differences to `other`, in words; `None` if there are none.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let mut text = String::new();
        let mut note = |what: &str, own: &dyn std::fmt::Display, others: &dyn std::fmt::Display| {
            let separator = if text.is_empty() { "" } else { ", " };
            // Writing to a string does not fail.
            let _ = write!(text, "{separator}{what} {others} instead of {own}");
        };
        if self.scene_hash != other.scene_hash {
            let name = |key: &Self| format!("{} ({:016x})", key.scene, key.scene_hash);
            note("scene", &name(self), &name(other));
        }
        if self.method != other.method {
            note("method", &self.method, &other.method);
        }
        if self.options != other.options {
            note(
                "options",
                &format!("'{}'", self.options),
                &format!("'{}'", other.options),
            );
        }
        if self.seed != other.seed {
            note("seed", &self.seed, &other.seed);
        }
        if self.independent != other.independent {
            let name = |key: &Self| {
                if key.independent {
                    "independent"
                } else {
                    "of a point set"
                }
            };
            note("samples", &name(self), &name(other));
        }
        if self.frame != other.frame {
            let name = |frame: Option<u32>| frame.map_or("none".to_owned(), |frame| frame.to_string());
            note("frame", &name(self.frame), &name(other.frame));
        }
        if self.samples != other.samples {
            note("samples in all", &self.samples, &other.samples);
        }
        if self.size != other.size {
            let name = |[width, height]: [u32; 2]| format!("{width}x{height}");
            note("size", &name(self.size), &name(other.size));
        }
        (!text.is_empty()).then_some(text)
    }
}

impl ShardHeader {
    /// The header of a part of an image's samples.
    pub fn of_part(image: ImageKey, part: ShardPart) -> Self {
        let Range { start, end } = part.of(image.samples);
        Self {
            image,
            part,
            first: start,
            end,
        }
    }

    /// The header of any range of an image's samples: `None` unless it lies within them. `part` is
    /// only for display.
    pub fn of_samples(image: ImageKey, part: ShardPart, samples: Range<u32>) -> Option<Self> {
        let Range { start: first, end } = samples;
        (first <= end && end <= image.samples).then_some(Self {
            image,
            part,
            first,
            end,
        })
    }

    /// The data that it shares with the other shards of the image.
    pub fn image(&self) -> &ImageKey {
        &self.image
    }

    /// The part that was requested.
    pub fn part(&self) -> ShardPart {
        self.part
    }

    /// Number of its first sample.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// Number after that of its last sample.
    pub fn end(&self) -> u32 {
        self.end
    }

    /// Seed of a chain of frames that starts with the shard's first sample, for methods whose
    /// frames depend on earlier ones. Such a method renders each shard as its own chain; chains of
    /// different seeds are independent. The first shard has the image's own seed.
    pub fn chain_seed(&self) -> u64 {
        match self.first {
            0 => self.image.seed,
            first => mixed(
                self.image
                    .seed
                    .wrapping_add(u64::from(first).wrapping_mul(0x9e37_79b9_7f4a_7c15)),
            ),
        }
    }

    /// Its name in messages.
    pub fn name(&self) -> String {
        format!("shard {} (samples {}..{})", self.part, self.first, self.end)
    }
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014), a bijection.
fn mixed(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_difference_is_named() {
        let key = ImageKey {
            scene: "a".into(),
            scene_hash: 1,
            method: "path".into(),
            options: "--max-depth 3".into(),
            seed: 5,
            independent: true,
            frame: None,
            samples: 100,
            size: [3, 2],
        };
        assert_eq!(key.difference(&key.clone()), None);
        // Two names of one scene are no difference.
        assert_eq!(
            key.difference(&ImageKey {
                scene: "./a".into(),
                ..key.clone()
            }),
            None
        );
        let others = [
            (
                ImageKey {
                    scene_hash: 2,
                    ..key.clone()
                },
                "scene a (0000000000000002)",
            ),
            (
                ImageKey {
                    method: "direct".into(),
                    ..key.clone()
                },
                "method direct instead of path",
            ),
            (
                ImageKey {
                    options: String::new(),
                    ..key.clone()
                },
                "options '' instead of '--max-depth 3'",
            ),
            (
                ImageKey {
                    seed: 6,
                    ..key.clone()
                },
                "seed 6 instead of 5",
            ),
            (
                ImageKey {
                    independent: false,
                    ..key.clone()
                },
                "samples of a point set instead of independent",
            ),
            (
                ImageKey {
                    frame: Some(4),
                    ..key.clone()
                },
                "frame 4 instead of none",
            ),
            (
                ImageKey {
                    samples: 99,
                    ..key.clone()
                },
                "samples in all 99 instead of 100",
            ),
            (
                ImageKey {
                    size: [2, 3],
                    ..key.clone()
                },
                "size 2x3 instead of 3x2",
            ),
        ];
        for (other, message) in others {
            let found = key.difference(&other).unwrap();
            assert!(found.starts_with(message), "{found}");
        }
    }

    #[test]
    fn ranges_lie_within_the_image() {
        let key = ImageKey {
            scene: String::new(),
            scene_hash: 0,
            method: String::new(),
            options: String::new(),
            seed: 0,
            independent: true,
            frame: None,
            samples: 10,
            size: [1, 1],
        };
        let part = ShardPart::new(1, 3).unwrap();
        let header = ShardHeader::of_part(key.clone(), part);
        assert_eq!((header.first(), header.end()), (3, 6));
        assert_eq!(header.name(), "shard 1/3 (samples 3..6)");
        let seeds = ShardPart::all(3).map(|part| ShardHeader::of_part(key.clone(), part).chain_seed());
        let seeds: Vec<u64> = seeds.collect();
        assert!(
            seeds[0] == 0 && seeds[1] != 0 && seeds[2] != 0 && seeds[1] != seeds[2],
            "{seeds:?}"
        );
        assert!(ShardHeader::of_samples(key.clone(), part, 3..10).is_some());
        assert!(ShardHeader::of_samples(key, part, 3..11).is_none());
    }
}
