//! OpenEXR: linear `f32`.

use crate::{ImageError, RgbImage};
use exr::prelude::{
    AnyChannels, Encoding, FlatSamples, Image, Layer, ReadChannels, ReadLayers, SpecificChannels,
    WritableImage,
};
use std::fmt;
use std::io::{Seek, Write};
use std::path::Path;

/// Why an OpenEXR file could not be read; the cause is the [`source`](std::error::Error::source).
#[derive(Debug)]
#[non_exhaustive]
pub enum ExrError {
    /// The file cannot be opened, is truncated, or is no OpenEXR file of flat pixels.
    File(exr::error::Error),
    /// It has neither the channels `R`, `G`, `B` nor the single channel `Y`; the names it has.
    Channels(Vec<String>),
    /// A channel is subsampled.
    Subsampled,
    /// Its pixels make no image: a value is not finite, or there are too many.
    Image(ImageError),
}

impl fmt::Display for ExrError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(_) => write!(f, "no readable OpenEXR file"),
            Self::Channels(names) => write!(f, "no channels R, G, B among [{}]", names.join(", ")),
            Self::Subsampled => write!(f, "subsampled channels are not supported"),
            Self::Image(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for ExrError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::File(error) => Some(error),
            _ => None,
        }
    }
}

/// Reads the colour of the first layer that has one: channels `R`, `G`, `B` in any order and case,
/// with or without a layer's name before them (`Combined.R`), or otherwise a single luminance
/// channel `Y`; samples of 16 or 32 bits. The image is the file's data window; alpha and other
/// channels are skipped.
///
/// # Errors
///
/// A file that cannot be read, has no such channels, or holds a NaN or infinity.
pub fn read_exr(path: impl AsRef<Path>) -> Result<RgbImage, ExrError> {
    read(path.as_ref())
}

/// [`read_exr`], compiled once and not in every crate that calls it.
fn read(path: &Path) -> Result<RgbImage, ExrError> {
    let file = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_file(path)
        .map_err(ExrError::File)?;
    let Some((layer, channels)) = file
        .layer_data
        .iter()
        .find_map(|layer| Some((layer, find_rgb(layer)?)))
    else {
        let names = file.layer_data.iter().flat_map(|layer| &layer.channel_data.list);
        return Err(ExrError::Channels(
            names.map(|channel| channel.name.to_string()).collect(),
        ));
    };
    let size = |v: usize| u32::try_from(v).unwrap_or(u32::MAX);
    let (width, height) = (size(layer.size.width()), size(layer.size.height()));
    let count = crate::image::pixel_count(width, height).map_err(ExrError::Image)?;
    let mut pixels = vec![[0.0; 3]; count];
    for (c, &channel) in channels.iter().enumerate() {
        let samples = &layer.channel_data.list[channel].sample_data;
        if samples.len() != count {
            return Err(ExrError::Subsampled);
        }
        for (pixel, value) in pixels.iter_mut().zip(samples.values_as_f32()) {
            pixel[c] = value;
        }
    }
    RgbImage::new(width, height, pixels).map_err(ExrError::Image)
}

/// Places of the red, green and blue channels in a layer's list.
fn find_rgb(layer: &Layer<AnyChannels<FlatSamples>>) -> Option<[usize; 3]> {
    let names: Vec<String> = layer
        .channel_data
        .list
        .iter()
        .map(|channel| channel.name.to_string())
        .collect();
    let find = |prefix: &str, wanted: &str| {
        names.iter().position(|name| {
            name.strip_prefix(prefix)
                .is_some_and(|name| name.eq_ignore_ascii_case(wanted))
        })
    };
    // A red channel determines the layer's name; its siblings must share it.
    let prefixes = names.iter().filter_map(|name| {
        let start = name.len().checked_sub(1)?;
        let red =
            name.get(start..)?.eq_ignore_ascii_case("r") && (start == 0 || name[..start].ends_with('.'));
        red.then(|| &name[..start])
    });
    std::iter::once("")
        .chain(prefixes)
        .find_map(|prefix| Some([find(prefix, "R")?, find(prefix, "G")?, find(prefix, "B")?]))
        .or_else(|| find("", "Y").map(|y| [y; 3]))
}

/// Writes `image` as an OpenEXR file of `f32` channels `R`, `G`, `B`. The same image gives the same
/// bytes.
///
/// # Errors
///
/// Those of `writer`.
pub fn write_exr(image: &RgbImage, mut writer: impl Write + Seek) -> Result<(), exr::error::Error> {
    write(image, &mut writer)
}

/// What a file is.
trait WriteSeek: Write + Seek {}

impl<W: Write + Seek> WriteSeek for W {}

/// [`write_exr`], compiled once and not for every writer.
fn write(image: &RgbImage, writer: &mut dyn WriteSeek) -> Result<(), exr::error::Error> {
    let (width, pixels) = (image.width() as usize, image.pixels());
    let channels = SpecificChannels::rgb(|at: exr::prelude::Vec2<usize>| {
        let [r, g, b] = pixels[at.y() * width + at.x()];
        (r, g, b)
    });
    let mut file = Image::from_channels((width, image.height() as usize), channels);
    file.layer_data.encoding = Encoding::SMALL_LOSSLESS;
    file.write().to_buffered(writer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{AnyChannel, Layers, Text, f16};

    /// A folder of this process, removed at the end.
    struct Folder(std::path::PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("lightshed-exr-{name}-{}", std::process::id()));
            std::fs::create_dir_all(&path).unwrap();
            Self(path)
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            std::fs::remove_dir_all(&self.0).ok();
        }
    }

    fn write_channels(path: &Path, channels: Vec<(&str, FlatSamples)>, size: (usize, usize)) {
        let list = channels
            .into_iter()
            .map(|(name, samples)| AnyChannel::new(Text::from(name), samples))
            .collect();
        Image::from_channels(size, AnyChannels::sort(list))
            .write()
            .to_file(path)
            .unwrap();
    }

    #[test]
    fn what_is_written_reads_back_bit_for_bit() {
        let folder = Folder::new("round-trip");
        let value = |x: u32, y: u32| [x as f32 * 1e-30, -(y as f32) * 1e30, 0.1 * (x + y) as f32];
        for (width, height) in [(1, 1), (37, 19), (64, 100)] {
            let image = RgbImage::from_fn(width, height, value).unwrap();
            let path = folder.0.join("image.exr");
            let mut bytes = std::io::Cursor::new(Vec::new());
            write_exr(&image, &mut bytes).unwrap();
            let mut again = std::io::Cursor::new(Vec::new());
            write_exr(&image, &mut again).unwrap();
            assert_eq!(bytes, again);
            std::fs::write(&path, bytes.get_ref()).unwrap();
            assert_eq!(read_exr(&path).unwrap(), image);
            std::fs::write(&path, &bytes.get_ref()[..bytes.get_ref().len() / 2]).unwrap();
            assert!(
                matches!(read_exr(&path), Err(ExrError::File(_))),
                "half a file was read"
            );
        }
    }

    #[test]
    fn any_order_type_and_layer_name_of_channels_is_read() {
        let folder = Folder::new("channels");
        let path = folder.0.join("image.exr");
        let expected = RgbImage::new(2, 1, vec![[1.0, 3.0, 5.0], [2.0, 4.0, 6.0]]).unwrap();
        let half = |a, b| FlatSamples::F16(vec![f16::from_f32(a), f16::from_f32(b)]);
        for [r, g, b] in [
            ["R", "G", "B"],
            ["r", "g", "b"],
            ["View.Combined.R", "View.Combined.G", "View.Combined.B"],
        ] {
            let channels = vec![
                (b, half(5.0, 6.0)),
                ("A", half(9.0, 9.0)),
                (r, FlatSamples::U32(vec![1, 2])),
                (g, FlatSamples::F32(vec![3.0, 4.0])),
                ("Depth.Z", half(7.0, 8.0)),
                ("Other.R", half(7.0, 8.0)),
            ];
            write_channels(&path, channels, (2, 1));
            assert_eq!(read_exr(&path).unwrap(), expected, "channels {r}, {g}, {b}");
        }
        write_channels(&path, vec![("Y", half(0.5, 2.0))], (2, 1));
        assert_eq!(read_exr(&path).unwrap().pixels(), [[0.5; 3], [2.0; 3]]);
    }

    #[test]
    fn the_first_layer_with_a_colour_counts() {
        let folder = Folder::new("layers");
        let path = folder.0.join("image.exr");
        let layer = |name: &str, channels: &[&str], value: f32| {
            let list = channels
                .iter()
                .map(|&c| AnyChannel::new(Text::from(c), FlatSamples::F32(vec![value])));
            let attributes = exr::prelude::LayerAttributes::named(Text::from(name));
            Layer::new(
                (1, 1),
                attributes,
                Encoding::UNCOMPRESSED,
                AnyChannels::sort(list.collect()),
            )
        };
        let layers: Layers<_> = [
            layer("depth", &["Z"], 1.0),
            layer("colour", &["B", "G", "R"], 2.0),
        ]
        .into_iter()
        .collect();
        let attributes =
            exr::prelude::ImageAttributes::new(exr::prelude::IntegerBounds::from_dimensions((1, 1)));
        Image::from_layers(attributes, layers)
            .write()
            .to_file(&path)
            .unwrap();
        assert_eq!(read_exr(&path).unwrap().pixels(), [[2.0; 3]]);
    }

    #[test]
    fn files_without_a_sound_colour_are_errors() {
        let folder = Folder::new("errors");
        let path = folder.0.join("image.exr");
        write_channels(&path, vec![("Z", FlatSamples::F32(vec![1.0]))], (1, 1));
        let message = read_exr(&path).unwrap_err().to_string();
        assert_eq!(message, "no channels R, G, B among [Z]");
        let bad = ["R", "G", "B"].map(|name| (name, FlatSamples::F32(vec![1.0, f32::NAN])));
        write_channels(&path, bad.into(), (2, 1));
        assert!(matches!(
            read_exr(&path),
            Err(ExrError::Image(ImageError::NonFinite { x: 1, y: 0 }))
        ));
        std::fs::write(&path, b"not an image").unwrap();
        assert!(matches!(read_exr(&path), Err(ExrError::File(_))));
        assert!(matches!(
            read_exr(folder.0.join("missing.exr")),
            Err(ExrError::File(_))
        ));
    }
}
