//! Written, and read by this crate and by another one.

use super::*;
use crate::{OutputTarget, PixelStatistics};
use exr::prelude::{FlatSamples, ReadChannels, ReadLayers};

fn write(folder: &Folder, name: &str, shard: &Shard) -> PathBuf {
    let path = folder.file(name);
    shard.write(&OutputTarget::prepare(&path).unwrap()).unwrap();
    path
}

#[test]
fn files_read_back_bit_for_bit_and_merge_as_in_memory() {
    let folder = Folder::new("files");
    // Rows whose pixels have the same number of samples, rows where some were left out, and both in
    // turns.
    let cases = [
        ([1, 1], 1, 7),
        ([19, 8], 3, 8),
        ([37, 29], 7, 8),
        ([37, 29], 7, 7),
        ([3, 50], 9, 7),
    ];
    for (size, count, seed) in cases {
        let image = ImageKey {
            seed,
            frame: (count == 3).then_some(12),
            ..key(size, 40)
        };
        let shards = parts(&image, count);
        let mut files = Vec::new();
        for (index, shard) in shards.iter().enumerate() {
            let file = ShardFile::open(write(&folder, &format!("{index}.exr"), shard)).unwrap();
            assert_eq!(file.header(), shard.header());
            assert_eq!(&file.read().unwrap(), shard);
            files.push(file);
        }
        let merged = merge_shards(shards.clone()).unwrap();
        files.rotate_left(count as usize / 2);
        let set = ShardSet::new(files.clone()).unwrap();
        assert_eq!((set.samples(), set.missing()), (40, None));
        assert_eq!(set.merge().unwrap(), merged);
        assert_eq!(set.image(), &image);
        if count > 1 {
            let last = ShardPart::new(count - 1, count).unwrap();
            files.retain(|file| file.header().part() != last);
            let set = ShardSet::new(files).unwrap();
            assert!(matches!(set.merge(), Err(ShardError::Missing(_))));
            assert_eq!(set.missing().unwrap().parts, [last]);
            let there = set.merge_present().unwrap();
            let pixels = u64::from(size[0] * size[1]);
            assert_eq!(
                there.samples() + there.non_finite(),
                pixels * u64::from(set.samples())
            );
        }
    }
}

#[test]
fn another_reader_finds_the_statistics() {
    let folder = Folder::new("other-reader");
    let image = key([13, 10], 30);
    let part = ShardPart::new(1, 2).unwrap();
    let shard = shard(&image, part, part.of(30));
    let path = write(&folder, "shard.exr", &shard);
    // As an image it is the mean.
    assert_eq!(crate::read_exr(&path).unwrap(), shard.film().mean_image());
    let file = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(&path)
        .unwrap();
    let layer = &file.layer_data;
    let attribute = |name: &str| match &layer.attributes.other[&exr::prelude::Text::from(name)] {
        exr::prelude::AttributeValue::Text(text) => text.to_string(),
        other => panic!("{name} is {other:?}"),
    };
    assert_eq!(attribute("lightshed.range"), "15..30");
    assert_eq!(attribute("lightshed.sceneHash"), "123456789abcdef0");
    let words = |name: &str| {
        let channel = layer
            .channel_data
            .list
            .iter()
            .find(|channel| channel.name.eq(name))
            .unwrap();
        match &channel.sample_data {
            FlatSamples::U32(words) => words.clone(),
            other => panic!("{name} is {other:?}"),
        }
    };
    let real = |name: &str, place: usize| {
        let [high, low] = ["high", "low"].map(|half| u64::from(words(&format!("{name}.{half}"))[place]));
        f64::from_bits(high << 32 | low)
    };
    for place in [0, 12, 13, 77, 129] {
        let pixel: &PixelStatistics = shard.film().get(place as u32 % 13, place as u32 / 13).unwrap();
        assert_eq!(u64::from(words("count")[place]), pixel.count());
        assert_eq!(u64::from(words("nonFinite")[place]), pixel.non_finite());
        for (channel, name) in ["R", "G", "B"].into_iter().enumerate() {
            assert_eq!(real(&format!("mean.{name}"), place), pixel.mean()[channel]);
            assert_eq!(
                real(&format!("deviations.{name}"), place),
                pixel.squared_deviations()[channel]
            );
        }
    }
}

#[test]
fn what_cannot_be_a_shards_file_is_refused() {
    let folder = Folder::new("refused");
    let image = key([3, 2], 4);
    let sound = shard(&image, ShardPart::WHOLE, 0..4);
    let png = OutputTarget::prepare(folder.file("shard.png")).unwrap();
    let error = sound.write(&png).unwrap_err();
    assert!(error.to_string().ends_with("must end in .exr"), "{error}");
    let long = ImageKey {
        options: "x".repeat(1 << 16),
        ..image.clone()
    };
    let target = OutputTarget::prepare(folder.file("long.exr")).unwrap();
    let error = shard(&long, ShardPart::WHOLE, 0..4).write(&target).unwrap_err();
    assert!(error.to_string().contains("header"), "{error}");
    // An image is no shard.
    let target = OutputTarget::prepare(folder.file("image.exr")).unwrap();
    target.write(&sound.film().mean_image()).unwrap();
    let error = ShardFile::open(target.path()).unwrap_err();
    assert!(
        error.to_string().contains("no attribute lightshed.shard"),
        "{error}"
    );
    assert!(matches!(
        ShardFile::open(folder.file("none.exr")),
        Err(ShardError::Io { .. })
    ));
    assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), 1);
}
