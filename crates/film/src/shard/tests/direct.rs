//! Shards rendered into their files are those of the film's way.

use super::*;
use crate::shard::direct::ShardOrder;
use crate::{Budget, OutputTarget, PixelEstimator, RenderError, RenderOptions, render};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

struct Noise;

impl PixelEstimator for Noise {
    fn sample(&self, x: u32, y: u32, s: u32, seed: u64) -> Rgb {
        sample(seed, x, y, s)
    }
}

/// Sets the flag with its hundredth sample.
struct Interrupting<'a>(&'a AtomicBool, AtomicU32);

impl PixelEstimator for Interrupting<'_> {
    fn sample(&self, x: u32, y: u32, s: u32, seed: u64) -> Rgb {
        if self.1.fetch_add(1, Ordering::Relaxed) == 100 {
            self.0.store(true, Ordering::Relaxed);
        }
        sample(seed, x, y, s)
    }
}

fn options(header: &ShardHeader, threads: usize) -> RenderOptions {
    let [width, height] = header.image().size;
    RenderOptions {
        first: header.first(),
        seed: header.image().seed,
        threads,
        ..RenderOptions::new(width, height, Budget::Samples(1))
    }
}

#[test]
fn a_file_has_the_bits_of_the_way_by_a_film() {
    let folder = Folder::new("direct");
    let never = AtomicBool::new(false);
    // One strip, and several, of which the last is shorter and ends within a tile.
    for (size, seed, threads) in [([13, 10], 7, 1), ([300, 700], 8, 2), ([300, 444], 7, 3)] {
        let image = ImageKey { seed, ..key(size, 5) };
        let header = ShardHeader::of_part(image, ShardPart::new(1, 2).unwrap());
        let target = |name: &str| OutputTarget::prepare(folder.file(name)).unwrap();
        let (direct, by_film, plain) = (target("direct.exr"), target("film.exr"), target("plain.exr"));
        let options = options(&header, threads);
        let done = AtomicU32::new(0);
        let observer = |progress: &crate::Progress| {
            assert_eq!(progress.samples_total, Some(u64::from(size[0] * size[1]) * 3));
            done.fetch_max(progress.samples_done as u32, Ordering::Relaxed);
        };
        let rendered = render_shard(&Noise, &header, &options, &direct, &observer, &never).unwrap();
        assert_eq!(done.load(Ordering::Relaxed), size[0] * size[1] * 3);
        let other = ShardOrder {
            estimator: &Noise,
            header: &header,
            options: &options,
            target: &by_film,
            observer: &|_| (),
            cancel: &never,
        };
        let other = other.with_film().unwrap();
        let budget = Budget::Samples(3);
        let outcome = render(&Noise, &RenderOptions { budget, ..options }, &|_| (), &never).unwrap();
        let shard = Shard::new(header.clone(), outcome.film).unwrap();
        shard.write(&plain).unwrap();
        let bytes = |target: &OutputTarget| std::fs::read(target.path()).unwrap();
        assert!(
            bytes(&direct) == bytes(&plain) && bytes(&by_film) == bytes(&plain),
            "{size:?}"
        );
        assert_eq!(rendered.totals, Some(shard.totals()));
        assert_eq!(other.totals, Some(shard.film().totals()));
        assert!(rendered.seconds > 0.0 && rendered.cpu_seconds.is_none_or(|cpu| cpu >= 0.0));
        let read = ShardFile::open(direct.path()).unwrap().read().unwrap();
        assert_eq!(read, shard);
    }
}

#[test]
fn what_is_interrupted_or_refused_leaves_nothing() {
    let folder = Folder::new("direct-nothing");
    let header = ShardHeader::of_part(key([300, 700], 4), ShardPart::WHOLE);
    let target = OutputTarget::prepare(folder.file("shard.exr")).unwrap();
    let options = options(&header, 2);
    for by_film in [false, true] {
        let cancel = AtomicBool::new(false);
        let estimator = Interrupting(&cancel, AtomicU32::new(0));
        let order = ShardOrder {
            estimator: &estimator,
            header: &header,
            options: &options,
            target: &target,
            observer: &|_| (),
            cancel: &cancel,
        };
        let rendered = match by_film {
            true => order.with_film(),
            false => order.render(),
        };
        assert_eq!(rendered.unwrap().totals, None);
        assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), 0);
    }
    let never = AtomicBool::new(false);
    let other = RenderOptions {
        width: 299,
        ..options
    };
    let error = render_shard(&Noise, &header, &other, &target, &|_| (), &never).unwrap_err();
    let found = matches!(error, RenderShardError::Render(RenderError::OtherSize { .. }));
    assert!(found, "{error}");
    let png = OutputTarget::prepare(folder.file("shard.png")).unwrap();
    let error = render_shard(&Noise, &header, &options, &png, &|_| (), &never).unwrap_err();
    assert!(error.to_string().contains(".exr"), "{error}");
    assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), 0);
}
