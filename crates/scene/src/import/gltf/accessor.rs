//! Typed data of glTF accessors, every offset checked against the buffers.

use super::mend::{CompressedView, PackedMesh};
use super::meshopt::{Compressed, decode};
use crate::import::draco::{self, Fault, Kind};
use crate::import::error::ImportError;
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
    /// Accessors whose data were in a compressed mesh, or why they have none.
    unpacked: HashMap<usize, Result<Unpacked, String>>,
    /// Views of the meshes that were decompressed.
    unpacked_views: HashMap<usize, Result<draco::Mesh, String>>,
}

/// Data of an accessor.
struct Unpacked {
    kind: DataType,
    /// Numbers an item.
    width: usize,
    bytes: Vec<u8>,
}

impl Unpacked {
    fn item_size(&self) -> usize {
        self.width * self.kind.size()
    }
}

impl Buffers {
    /// Over buffers as they are.
    pub(super) fn new(buffers: Vec<Vec<u8>>) -> Self {
        Self {
            buffers,
            decompressed: HashMap::new(),
            unpacked: HashMap::new(),
            unpacked_views: HashMap::new(),
        }
    }

    /// Decompresses a mesh. What is wrong with one is an error where its accessors are read; errs
    /// only if it needs too much.
    pub(super) fn unpack(
        &mut self,
        document: &Document,
        packed: &PackedMesh,
        spend: &draco::Spend,
    ) -> Result<(), ImportError> {
        if !self.unpacked_views.contains_key(&packed.view) {
            let bytes = match document.views().nth(packed.view) {
                Some(view) => self.view(&view),
                None => Err(format!("there is no buffer view {}", packed.view)),
            };
            let mesh = match bytes.map(|bytes| draco::decode(bytes, spend)) {
                Ok(Ok(mesh)) => Ok(mesh),
                Ok(Err(Fault::Budget(error))) => return Err(*error),
                Ok(Err(Fault::Data(what))) => Err(format!("a mesh compressed by Draco: {what}")),
                Err(what) => Err(what),
            };
            self.unpacked_views.insert(packed.view, mesh);
        }
        let mesh = &self.unpacked_views[&packed.view];
        let failed = |what: &String| -> Result<Unpacked, String> { Err(what.clone()) };
        for &(accessor, id) in &packed.attributes {
            let found = match mesh {
                Err(what) => failed(what),
                Ok(mesh) => match mesh.attributes.iter().find(|attribute| attribute.id == id) {
                    None => Err(format!("the compressed mesh has no attribute {id}")),
                    Some(attribute) => Ok(Unpacked {
                        kind: data_type(attribute.kind),
                        width: attribute.width,
                        bytes: attribute.bytes.clone(),
                    }),
                },
            };
            self.unpacked.insert(accessor, found);
        }
        if let Some(accessor) = packed.indices {
            let corners = |mesh: &draco::Mesh| Unpacked {
                kind: DataType::U32,
                width: 1,
                bytes: bytemuck::cast_slice::<u32, u8>(mesh.triangles.as_flattened()).to_vec(),
            };
            let found = match mesh {
                Err(what) => failed(what),
                Ok(mesh) => Ok(corners(mesh)),
            };
            self.unpacked.insert(accessor, found);
        }
        Ok(())
    }

    /// Items of an accessor: those that a compressed mesh has, whatever the file says.
    pub(super) fn count(&self, accessor: &gltf::Accessor) -> usize {
        match self.unpacked.get(&accessor.index()) {
            Some(Ok(unpacked)) => unpacked.bytes.len() / unpacked.item_size().max(1),
            Some(Err(_)) | None => accessor.count(),
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
        if let Some(unpacked) = self.unpacked.get(&accessor.index()) {
            let unpacked = unpacked.as_ref().map_err(String::clone)?;
            if unpacked.width != N {
                return Err(format!("accessor {} has the wrong dimensions", accessor.index()));
            }
            let size = unpacked.kind.size();
            let item = |bytes: &[u8]| -> [f32; N] {
                std::array::from_fn(|i| component(&bytes[i * size..], unpacked.kind, accessor.normalized()))
            };
            return Ok(unpacked.bytes.chunks_exact(N * size).map(item).collect());
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
        if let Some(unpacked) = self.unpacked.get(&accessor.index()) {
            let unpacked = unpacked.as_ref().map_err(String::clone)?;
            let items = unpacked.bytes.chunks_exact(unpacked.item_size());
            return Ok(items.map(|bytes| index(bytes, unpacked.kind)).collect());
        }
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

fn data_type(kind: Kind) -> DataType {
    match kind {
        Kind::I8 => DataType::I8,
        Kind::U8 => DataType::U8,
        Kind::I16 => DataType::I16,
        Kind::U16 => DataType::U16,
        // glTF has no signed numbers of 32 bits.
        Kind::I32 | Kind::U32 => DataType::U32,
        Kind::F32 => DataType::F32,
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
