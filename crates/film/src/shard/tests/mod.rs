//! Shards of made-up samples: merged in every order, written, read by somebody else, damaged.

mod damages;
mod direct;
mod files;
mod properties;

use super::*;
use lightshed_sampling::{CounterRng, Rgb};
use std::ops::Range;
use std::path::PathBuf;

/// A folder of this process's own, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lightshed-shard-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).ok();
    }
}

fn key(size: [u32; 2], samples: u32) -> ImageKey {
    ImageKey {
        scene: "cornell".into(),
        scene_hash: 0x1234_5678_9abc_def0,
        method: "path".into(),
        options: "--max-depth 5".into(),
        seed: 7,
        independent: true,
        frame: None,
        samples,
        size,
    }
}

/// Sample `s` of a pixel: of order one, now and then large, and with odd seeds rarely not finite.
fn sample(seed: u64, x: u32, y: u32, s: u32) -> Rgb {
    let mut rng = CounterRng::new(seed, y << 16 | x, s);
    let [a, b] = rng.next_2d();
    match rng.next_u32() % 97 {
        0 if seed % 2 == 1 => Rgb::new(f32::NAN, a, b),
        1..8 => Rgb::new(40.0 * a, 0.0, 3.0),
        _ => Rgb::new(a, b, a * b),
    }
}

/// The film of samples `range` of the image.
fn film(image: &ImageKey, range: Range<u32>) -> Film {
    let [width, height] = image.size;
    let mut film = Film::new(width, height).unwrap();
    for s in range {
        for y in 0..height {
            (0..width).for_each(|x| film.add(x, y, sample(image.seed, x, y, s)));
        }
    }
    film
}

fn shard(image: &ImageKey, part: ShardPart, range: Range<u32>) -> Shard {
    let film = film(image, range.clone());
    let header = ShardHeader::of_samples(image.clone(), part, range).unwrap();
    Shard::new(header, film).unwrap()
}

fn parts(image: &ImageKey, count: u32) -> Vec<Shard> {
    ShardPart::all(count)
        .map(|part| shard(image, part, part.of(image.samples)))
        .collect()
}
