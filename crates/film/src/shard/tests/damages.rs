//! A thousand random damages, each refused and named.

use super::*;
use crate::OutputTarget;
use crate::shard::checksum::{Checksum, digits};
use crate::shard::layout::Layout;
use std::path::Path;

/// Opens and merges, as a program does.
fn merge(paths: &[PathBuf]) -> Result<Film, ShardError> {
    let files: Result<Vec<_>, _> = paths.iter().map(ShardFile::open).collect();
    ShardSet::new(files?)?.merge()
}

fn write(path: &Path, shard: &Shard) {
    shard.write(&OutputTarget::prepare(path).unwrap()).unwrap();
}

/// A stream of numbers for choices.
struct Choices(CounterRng);

impl Choices {
    fn below(&mut self, bound: usize) -> usize {
        ((u64::from(self.0.next_u32()) * bound as u64) >> 32) as usize
    }
}

#[test]
fn a_thousand_damages_are_refused_and_named() {
    let folder = Folder::new("damages");
    let image = key([11, 9], 24);
    let paths: Vec<PathBuf> = (0..3)
        .map(|index| folder.file(&format!("shard-{index}.exr")))
        .collect();
    for (path, shard) in paths.iter().zip(parts(&image, 3)) {
        write(path, &shard);
    }
    let sound: Vec<Vec<u8>> = paths.iter().map(|path| std::fs::read(path).unwrap()).collect();
    let merged = merge(&paths).unwrap();
    // Shards that are sound, but not here.
    let others = [
        ImageKey {
            scene_hash: 1,
            ..image.clone()
        },
        ImageKey {
            method: "direct".into(),
            ..image.clone()
        },
        ImageKey {
            options: String::new(),
            ..image.clone()
        },
        ImageKey {
            seed: 8,
            ..image.clone()
        },
        ImageKey {
            independent: false,
            ..image.clone()
        },
        ImageKey {
            samples: 25,
            ..image.clone()
        },
        ImageKey {
            frame: Some(0),
            ..image.clone()
        },
        ImageKey {
            size: [9, 11],
            ..image.clone()
        },
    ];
    let mut foreign: Vec<Vec<u8>> = Vec::new();
    let other = folder.file("other.exr");
    let part = ShardPart::new(1, 3).unwrap();
    for image in &others {
        write(&other, &shard(image, part, part.of(image.samples)));
        foreign.push(std::fs::read(&other).unwrap());
    }
    for range in [7..16, 8..17, 0..24, 10..12] {
        write(&other, &shard(&image, part, range));
        foreign.push(std::fs::read(&other).unwrap());
    }
    std::fs::remove_file(&other).unwrap();

    let mut choices = Choices(CounterRng::new(26, 0, 0));
    let mut kinds = [0; 7];
    for number in 0..1000 {
        let place = choices.below(3);
        let mut bytes = sound[place].clone();
        let length = bytes.len();
        // Half of them one bit, a quarter of those in the header.
        let kind = [0, 0, 0, 1, 2, 3, 4, 5, 6][choices.below(9)];
        match kind {
            0 => bytes[choices.below(length)] ^= 1 << choices.below(8),
            1 => bytes[choices.below(1000)] ^= 1 << choices.below(8),
            2 => bytes.truncate(choices.below(length)),
            3 => bytes.extend(std::iter::repeat_n(0, 1 + choices.below(100))),
            4 => {
                let (from, count) = (choices.below(length), 1 + choices.below(64));
                bytes[from..length.min(from + count)]
                    .iter_mut()
                    .for_each(|byte| *byte = !*byte);
            }
            // Two rows exchanged: the sum of all bytes is the same.
            5 => {
                let row = 8 + 68 * 11;
                let [a, b] = [choices.below(4), 4 + choices.below(5)].map(|y| length - (9 - y) * row);
                let (before, after) = bytes.split_at_mut(b);
                before[a..a + row].swap_with_slice(&mut after[..row]);
            }
            _ => bytes.clone_from(&foreign[choices.below(foreign.len())]),
        }
        kinds[kind] += 1;
        // A foreign shard takes the place of the middle one: a range that is missing is an overlap,
        // a gap, or another image.
        let place = if kind == 6 { 1 } else { place };
        std::fs::write(&paths[place], &bytes).unwrap();
        let mut order = paths.clone();
        order.rotate_left(choices.below(3));
        let error = merge(&order).expect_err(&format!("damage {number} of kind {kind} was not found"));
        let named = error.to_string();
        let name = paths[place].file_name().unwrap().to_str().unwrap();
        let gap = matches!(error, ShardError::Missing(_)) && kind == 6;
        // Of two that differ, the one that came first is the one that the other is compared with;
        // both are named.
        assert!(
            gap || named.contains(name),
            "damage {number} of kind {kind}: {named}"
        );
        std::fs::write(&paths[place], &sound[place]).unwrap();
    }
    assert!(kinds.iter().all(|&count| count > 50), "{kinds:?}");
    assert_eq!(merge(&paths).unwrap(), merged);
}

/// It is the checksum that finds them: with one that fits, another value passes for a shard's.
#[test]
fn without_its_checksum_a_changed_value_would_pass() {
    let folder = Folder::new("planted");
    let image = key([11, 9], 24);
    let path = folder.file("shard.exr");
    let shard = shard(&image, ShardPart::WHOLE, 0..24);
    write(&path, &shard);
    let mut bytes = std::fs::read(&path).unwrap();
    let (_, layout, _) = Layout::read(&bytes).unwrap();
    // The lowest bit of a mean.
    let place = layout.rows_at() + 8 + 4 * (15 * 11 + 5);
    bytes[place] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    let error = ShardFile::open(&path).unwrap().read().unwrap_err();
    assert!(
        matches!(error, ShardError::Damaged { part: "content", .. }),
        "{error}"
    );
    restamp(&mut bytes, &layout);
    std::fs::write(&path, &bytes).unwrap();
    let passed = ShardFile::open(&path).unwrap().read().unwrap();
    assert_ne!(passed.film(), shard.film());
    assert_eq!(passed.header(), shard.header());
    // Values that no samples have are found without it, and their file is named: a mean that is not
    // finite, a sum of squares that is negative.
    let sums = [shard_of(&image, 0), shard_of(&image, 1)];
    let paths = [folder.file("first.exr"), folder.file("second.exr")];
    for (path, shard) in paths.iter().zip(&sums) {
        write(path, shard);
    }
    let (_, layout, _) = Layout::read(&std::fs::read(&paths[1]).unwrap()).unwrap();
    let row = layout.rows_at() + 8;
    for (channel, high) in [(14, 0x7ff0_0000_u32), (8, 0xbff0_0000)] {
        let mut bytes = std::fs::read(&paths[1]).unwrap();
        let place = row + 4 * (channel * 11 + 5);
        let sound = bytes[place..place + 4].to_vec();
        bytes[place..place + 4].copy_from_slice(&high.to_le_bytes());
        restamp(&mut bytes, &layout);
        std::fs::write(&paths[1], &bytes).unwrap();
        let error = merge(&paths).unwrap_err();
        assert!(matches!(error, ShardError::Values { y: 0, .. }), "{error}");
        assert!(error.to_string().contains("second.exr"), "{error}");
        bytes[place..place + 4].copy_from_slice(&sound);
        restamp(&mut bytes, &layout);
        std::fs::write(&paths[1], &bytes).unwrap();
        merge(&paths).unwrap();
    }
}

/// One half of the image.
fn shard_of(image: &ImageKey, half: u32) -> Shard {
    let part = ShardPart::new(half, 2).unwrap();
    shard(image, part, part.of(image.samples))
}

/// Gives a file the checksum of what it holds.
fn restamp(bytes: &mut [u8], layout: &Layout) {
    let at = layout.checksums[1];
    let mut checksum = Checksum::default();
    checksum.update_without(bytes, &layout.checksums);
    bytes[at..at + 8].copy_from_slice(&digits(checksum.value()));
}
