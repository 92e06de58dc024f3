//! What shards cost: writing one, and merging many against reading them.
//!
//! ```text
//! cargo bench -p lightshed-film --bench shards -- 64 /a/folder 3
//! ```
//!
//! writes so many shards of 1920×1080 (141 MB each) into the folder, reads their bytes and merges
//! them, three times each in turns, and removes them. With files that memory holds it is the
//! processor that is measured; with more, the disk as well.

use lightshed_film::{
    Film, ImageKey, OutputTarget, Rgb, Shard, ShardFile, ShardHeader, ShardPart, ShardSet,
    process_cpu_seconds,
};
use lightshed_sampling::{CounterRng, parallel};
use std::error::Error;
use std::fs::File;
use std::io::Read;
use std::path::PathBuf;
use std::time::Instant;

const SIZE: [u32; 2] = [1920, 1080];
/// Samples of a shard.
const SAMPLES: u32 = 2;

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo adds --bench.
    let mut words = std::env::args().skip(1).filter(|word| !word.starts_with("--"));
    let count: u32 = words.next().map_or(Ok(8), |word| word.parse())?;
    let folder = words.next().map_or_else(std::env::temp_dir, PathBuf::from);
    let rounds: u32 = words.next().map_or(Ok(3), |word| word.parse())?;
    let folder = folder.join(format!("lightshed-shards-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let measured = measure(count, &folder, rounds);
    std::fs::remove_dir_all(&folder)?;
    measured
}

fn measure(count: u32, folder: &std::path::Path, rounds: u32) -> Result<(), Box<dyn Error>> {
    let image = ImageKey {
        scene: "noise".into(),
        scene_hash: 0,
        method: "none".into(),
        options: String::new(),
        seed: 0,
        independent: true,
        frame: None,
        samples: count * SAMPLES,
        size: SIZE,
    };
    let mut film = noise()?;
    let (start, cpu) = (Instant::now(), process_cpu_seconds().unwrap_or_default());
    let mut files = Vec::new();
    for part in ShardPart::all(count) {
        let shard = Shard::new(ShardHeader::of_part(image.clone(), part), film)?;
        let path = folder.join(format!("{}.exr", part.index()));
        shard.write(&OutputTarget::prepare(&path)?)?;
        film = shard.into_film();
        files.push(path);
    }
    let bytes = std::fs::metadata(&files[0])?.len();
    let cpu = process_cpu_seconds().unwrap_or_default() - cpu;
    let gigabytes = (u64::from(count) * bytes) as f64 * 1e-9;
    println!(
        "{count} shards of {:.1} MB: written in {:.3} s and {:.3} CPU-s each",
        bytes as f64 * 1e-6,
        start.elapsed().as_secs_f64() / f64::from(count),
        cpu / f64::from(count)
    );
    println!(
        "{:>32} {:>32} {:>14}",
        "reading s (GB/s), CPU-s", "merging s (GB/s), CPU-s", "ratio, of CPU"
    );
    for _ in 0..rounds {
        let (reading, ()) = timed(|| Ok(read(&files)?))?;
        let (merging, merged) = timed(|| {
            let opened: Result<Vec<_>, _> = files.iter().rev().map(ShardFile::open).collect();
            Ok(ShardSet::new(opened?)?.merge()?)
        })?;
        assert_eq!(
            merged.samples(),
            u64::from(image.samples) * u64::from(SIZE[0] * SIZE[1])
        );
        let column = |[wall, cpu]: [f64; 2]| format!("{wall:.3} ({:.2}), {cpu:.3}", gigabytes / wall);
        println!(
            "{:>32} {:>32} {:>14}",
            column(reading),
            column(merging),
            format!("{:.2}, {:.2}", merging[0] / reading[0], merging[1] / reading[1])
        );
    }
    Ok(())
}

/// Wall and processor seconds of some work, and its result.
fn timed<R>(work: impl FnOnce() -> Result<R, Box<dyn Error>>) -> Result<([f64; 2], R), Box<dyn Error>> {
    let (start, before) = (Instant::now(), process_cpu_seconds().unwrap_or_default());
    let result = work()?;
    let cpu = process_cpu_seconds().unwrap_or_default() - before;
    Ok(([start.elapsed().as_secs_f64(), cpu], result))
}

/// Reads all files on all threads, a megabyte at a time.
fn read(files: &[PathBuf]) -> std::io::Result<()> {
    let read = parallel::map(files.iter(), |_, path| -> std::io::Result<()> {
        let mut file = File::open(path)?;
        let mut buffer = vec![0; 1 << 20];
        while file.read(&mut buffer)? > 0 {}
        Ok(())
    });
    read.into_iter().collect()
}

/// A film of noise.
fn noise() -> Result<Film, Box<dyn Error>> {
    let mut film = Film::new(SIZE[0], SIZE[1])?;
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            for sample in 0..SAMPLES {
                let mut rng = CounterRng::new(0, y << 16 | x, sample);
                let [a, b] = rng.next_2d();
                film.add(x, y, Rgb::new(a, b, a * b));
            }
        }
    }
    Ok(film)
}
