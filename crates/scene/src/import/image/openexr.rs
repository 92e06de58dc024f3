//! OpenEXR.

use super::{broken, check_size, unusable};
use crate::Image;
use crate::import::error::{ImportError, Location};
use crate::import::loading::Loading;
use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
use std::io::Cursor;
use std::path::Path;

/// The first layer of an OpenEXR file with channels R, G, B, or with Y alone.
pub(super) fn decode(bytes: &[u8], path: &Path, loading: &Loading) -> Result<Image, ImportError> {
    let broken = |source: exr::error::Error| broken(path, source);
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(broken)?;
    for header in reader.headers() {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        check_size(width, height, bytes, path)?;
        // Every channel is decoded, then three floats are kept.
        let channels = header.channels.list.iter();
        let decoded: usize = channels
            .map(|channel| channel.sample_type.bytes_per_sample())
            .sum();
        loading.spend_image([width, height], decoded, 12, path)?;
    }
    let file = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_chunks(reader)
        .map_err(broken)?;
    let layer = &file.layer_data;
    let find = |name: &str| {
        let mut list = layer.channel_data.list.iter();
        list.find(|channel| channel.name.to_string().eq_ignore_ascii_case(name))
    };
    let rgb = ["R", "G", "B"].map(find);
    let channels = match (rgb, find("Y")) {
        ([Some(r), Some(g), Some(b)], _) => [r, g, b],
        (_, Some(y)) => [y, y, y],
        _ => {
            return Err(ImportError::unsupported(
                Location::file(path),
                "the image has neither channels R, G, B nor Y",
            ));
        }
    };
    let value = |samples: &FlatSamples, index: usize| -> Option<f32> {
        match samples {
            FlatSamples::F16(v) => v.get(index).map(|h| h.to_f32()),
            FlatSamples::F32(v) => v.get(index).copied(),
            FlatSamples::U32(v) => v.get(index).map(|&u| u as f32),
        }
    };
    let (width, height) = (layer.size.width(), layer.size.height());
    let pixel = |index| -> Option<[f32; 3]> {
        let [r, g, b] = channels.map(|channel| value(&channel.sample_data, index));
        Some([r?, g?, b?])
    };
    let pixels: Option<Vec<_>> = (0..width * height).map(pixel).collect();
    let size = (u32::try_from(width), u32::try_from(height));
    match (size, pixels) {
        ((Ok(width), Ok(height)), Some(pixels)) => {
            Image::from_linear(width, height, pixels).ok_or_else(|| unusable(path))
        }
        _ => Err(unusable(path)),
    }
}
