//! Typed data of glTF accessors, every offset checked against the buffers.

use super::mend::CompressedView;
use super::meshopt::{Compressed, decode};
use gltf::Document;
use gltf::accessor::{DataType, Dimensions};
use gltf::buffer::View;
use std::collections::HashMap;

/// Reads accessors out of the loaded buffers. Messages of errors say what is wrong with the
/// accessor.
pub(super) struct Buffers {
    buffers: Vec<Vec<u8>>,
    /// Views that were compressed.
    decompressed: HashMap<usize, Vec<u8>>,
}

impl Buffers {
    /// Over buffers as they are.
    pub(super) fn new(buffers: Vec<Vec<u8>>) -> Self {
        Self {
            buffers,
            decompressed: HashMap::new(),
        }
    }

    /// Decompresses a view.
    pub(super) fn decompress(&mut self, view: &CompressedView) -> Result<(), String> {
        let buffer = self.buffers.get(view.buffer).map_or(&[][..], Vec::as_slice);
        let end = view.offset.checked_add(view.length);
        let data = end.and_then(|end| buffer.get(view.offset..end));
        let data = data.ok_or("compressed data reaches beyond its buffer")?;
        let form = Compressed {
            mode: &view.mode,
            filter: &view.filter,
            count: view.count,
            stride: view.stride,
        };
        self.decompressed.insert(view.view, decode(data, form)?);
        Ok(())
    }

    /// Bytes of a view.
    pub(super) fn view(&self, view: &View) -> Result<&[u8], String> {
        if let Some(bytes) = self.decompressed.get(&view.index()) {
            return Ok(bytes);
        }
        let buffer = self
            .buffers
            .get(view.buffer().index())
            .map_or(&[][..], Vec::as_slice);
        let end = view.offset().checked_add(view.length());
        let bytes = end.and_then(|end| buffer.get(view.offset()..end));
        bytes.ok_or_else(|| format!("buffer view {} reaches beyond its buffer", view.index()))
    }

    /// `count` items of `size` bytes, `stride` bytes apart, from `offset` of a view.
    fn items<'a>(
        &'a self,
        view: &View,
        offset: usize,
        count: usize,
        size: usize,
        stride: usize,
    ) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, String> {
        let bytes = self.view(view)?;
        let needed = count
            .checked_sub(1)
            .and_then(|steps| steps.checked_mul(stride))
            .and_then(|length| length.checked_add(size))
            .and_then(|length| length.checked_add(offset));
        match needed {
            Some(needed) if needed <= bytes.len() && stride >= size => {}
            _ if count == 0 => {}
            _ => return Err(format!("{count} items reach beyond buffer view {}", view.index())),
        }
        Ok((0..count).map(move |i| {
            let start = offset + i * stride;
            &bytes[start..start + size]
        }))
    }

    /// An accessor of `N` numbers an item. Normalised integers become fractions.
    pub(super) fn vectors<const N: usize>(
        &self,
        document: &Document,
        accessor: &gltf::Accessor,
    ) -> Result<Vec<[f32; N]>, String> {
        let dimensions = [
            Dimensions::Scalar,
            Dimensions::Vec2,
            Dimensions::Vec3,
            Dimensions::Vec4,
        ];
        if dimensions.get(N - 1) != Some(&accessor.dimensions()) {
            return Err(format!("accessor {} has the wrong dimensions", accessor.index()));
        }
        let (kind, normalized) = (accessor.data_type(), accessor.normalized());
        let width = accessor.size() / N;
        let item = |bytes: &[u8]| -> [f32; N] {
            std::array::from_fn(|i| component(&bytes[i * width..(i + 1) * width], kind, normalized))
        };
        let count = accessor.count();
        let mut values = match accessor.view() {
            Some(view) => self.items_of(accessor, &view)?.map(item).collect(),
            // Without a view all items are zero, to be replaced by the sparse ones: so many at most
            // make sense.
            None => {
                let most: usize = document.buffers().map(|b| b.length()).sum();
                if count > most {
                    return Err(format!(
                        "accessor {} has {count} items and no data",
                        accessor.index()
                    ));
                }
                vec![[0.0; N]; count]
            }
        };
        if let Some(sparse) = accessor.sparse() {
            let indices = sparse.indices();
            let kind = match indices.index_type() {
                gltf::accessor::sparse::IndexType::U8 => DataType::U8,
                gltf::accessor::sparse::IndexType::U16 => DataType::U16,
                gltf::accessor::sparse::IndexType::U32 => DataType::U32,
            };
            let size = kind.size();
            let places = self.items(&indices.view(), indices.offset(), sparse.count(), size, size)?;
            let new = sparse.values();
            let size = accessor.size();
            let new = self.items(&new.view(), new.offset(), sparse.count(), size, size)?;
            for (place, value) in places.zip(new) {
                let place = index(place, kind) as usize;
                *values.get_mut(place).ok_or_else(|| {
                    format!("accessor {} replaces item {place} of {count}", accessor.index())
                })? = item(value);
            }
        }
        Ok(values)
    }

    /// The bytes of each item of an accessor in its view.
    fn items_of<'s>(
        &'s self,
        accessor: &gltf::Accessor,
        view: &View,
    ) -> Result<impl Iterator<Item = &'s [u8]> + use<'s>, String> {
        let stride = view.stride().unwrap_or(accessor.size());
        self.items(view, accessor.offset(), accessor.count(), accessor.size(), stride)
    }

    /// An accessor of 4 × 4 matrices of floats, column by column.
    pub(super) fn matrices(&self, accessor: &gltf::Accessor) -> Result<Vec<[f32; 16]>, String> {
        let (Dimensions::Mat4, DataType::F32, Some(view)) =
            (accessor.dimensions(), accessor.data_type(), accessor.view())
        else {
            return Err(format!("accessor {} is no list of matrices", accessor.index()));
        };
        let items = self.items_of(accessor, &view)?;
        let item =
            |bytes: &[u8]| std::array::from_fn(|i| component(&bytes[4 * i..4 * i + 4], DataType::F32, false));
        Ok(items.map(item).collect())
    }

    /// An accessor of vertex indices.
    pub(super) fn indices(&self, accessor: &gltf::Accessor) -> Result<Vec<u32>, String> {
        let kind = accessor.data_type();
        if accessor.dimensions() != Dimensions::Scalar
            || !matches!(kind, DataType::U8 | DataType::U16 | DataType::U32)
        {
            return Err(format!(
                "accessor {} is no list of unsigned integers",
                accessor.index()
            ));
        }
        let (Some(view), None) = (accessor.view(), accessor.sparse()) else {
            return Err(format!(
                "accessor {}: sparse indices are not supported",
                accessor.index()
            ));
        };
        let items = self.items_of(accessor, &view)?;
        Ok(items.map(|bytes| index(bytes, kind)).collect())
    }
}

fn index(bytes: &[u8], kind: DataType) -> u32 {
    match (kind, bytes) {
        (DataType::U8, &[a, ..]) => u32::from(a),
        (DataType::U16, &[a, b, ..]) => u32::from(u16::from_le_bytes([a, b])),
        (_, &[a, b, c, d, ..]) => u32::from_le_bytes([a, b, c, d]),
        _ => 0,
    }
}

/// A number; integers are divided by their largest value if normalised (glTF 2.0, §3.6.2.2).
fn component(bytes: &[u8], kind: DataType, normalized: bool) -> f32 {
    let (value, largest) = match (kind, bytes) {
        (DataType::F32, &[a, b, c, d, ..]) => return f32::from_le_bytes([a, b, c, d]),
        (DataType::I8, &[a, ..]) => (f32::from(a as i8), 127.0),
        (DataType::U8, &[a, ..]) => (f32::from(a), 255.0),
        (DataType::I16, &[a, b, ..]) => (f32::from(i16::from_le_bytes([a, b])), 32767.0),
        (DataType::U16, &[a, b, ..]) => (f32::from(u16::from_le_bytes([a, b])), 65535.0),
        (DataType::U32, &[a, b, c, d, ..]) => (u32::from_le_bytes([a, b, c, d]) as f32, u32::MAX as f32),
        _ => (0.0, 1.0),
    };
    if normalized {
        (value / largest).max(-1.0)
    } else {
        value
    }
}
