//! Meshes compressed by Draco, as `KHR_draco_mesh_compression` embeds them in glTF.
//!
//! The reader follows Google's "Draco Bitstream Specification", version 2.2, the only version that
//! the extension allows. It reads triangle meshes, both ways of storing triangles (in sequence and
//! by Edgebreaker, plain or by valence), and attributes as they are, as integers, quantised, or as
//! octahedral normals, with all predictions of that version. Point clouds and older versions are
//! refused.
//!
//! Sizes come from the file. Each is spent before memory of that size is taken, and each loop is
//! bounded by what was spent.

mod attributes;
mod bits;
mod corners;
mod edgebreaker;
mod layout;
mod normals;
mod octahedron;
mod order;
mod prediction;
mod sequential;
mod symbol;
mod texture_coordinates;
mod undo;
mod valence;

use super::error::ImportError;
use super::limits::LoadResource;
use bits::Reader;
use corners::Corners;

/// What is wrong with a compressed mesh.
#[derive(Debug)]
pub(super) enum Fault {
    /// The data, and how.
    Data(&'static str),
    /// It needs more than it may.
    Budget(Box<ImportError>),
}

impl From<&'static str> for Fault {
    fn from(what: &'static str) -> Self {
        Self::Data(what)
    }
}

impl From<ImportError> for Fault {
    fn from(error: ImportError) -> Self {
        Self::Budget(Box::new(error))
    }
}

const CUT_SHORT: &str = "compressed data ends too early";
const INVALID: &str = "compressed data is invalid";

/// Asked before memory is taken.
pub(super) type Spend<'a> = dyn Fn(LoadResource, u64) -> Result<(), ImportError> + 'a;

/// Triangles and attributes, the latter by point.
#[derive(Debug, PartialEq)]
pub(super) struct Mesh {
    /// Indices of points.
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) point_count: usize,
    pub(super) attributes: Vec<Attribute>,
}

/// An attribute of every point.
#[derive(Debug, PartialEq)]
pub(super) struct Attribute {
    /// The number by which a glTF file refers to it.
    pub(super) id: u32,
    pub(super) kind: Kind,
    /// Components of a value.
    pub(super) width: usize,
    /// Little-endian numbers of the kind, `width` for each point.
    pub(super) bytes: Vec<u8>,
}

/// Types of numbers that glTF knows as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
}

impl Kind {
    fn of(number: u8) -> Option<Self> {
        Some(match number {
            1 => Self::I8,
            // The last one is of booleans.
            2 | 11 => Self::U8,
            3 => Self::I16,
            4 => Self::U16,
            5 => Self::I32,
            6 => Self::U32,
            9 => Self::F32,
            _ => return None,
        })
    }

    /// Bytes of a number.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
        }
    }
}

/// Decodes a mesh.
pub(super) fn decode(data: &[u8], spend: &Spend) -> Result<Mesh, Fault> {
    let mut reader = Reader::new(data);
    if reader.take(5)? != b"DRACO" {
        return Err("compressed data does not begin with `DRACO`".into());
    }
    if [reader.u8()?, reader.u8()?] != [2, 2] {
        return Err("only version 2.2 of Draco's format is supported".into());
    }
    if reader.u8()? != 1 {
        return Err("compressed data is a point cloud, not a mesh".into());
    }
    let method = reader.u8()?;
    let has_metadata = reader.u16()? & 0x8000 != 0;
    if has_metadata {
        skip_metadata(&mut reader)?;
    }
    let connectivity = match method {
        0 => sequential::decode(&mut reader, spend)?,
        1 => edgebreaker::decode(&mut reader, spend)?,
        _ => return Err("an unknown way of storing triangles".into()),
    };
    attributes::decode(&mut reader, connectivity, spend)
}

/// Which points the triangles have, and by which corners attributes are stored.
struct Connectivity {
    triangles: Vec<[u32; 3]>,
    point_count: usize,
    /// Of Edgebreaker; without it attributes are in the order of the points.
    corners: Option<EdgebreakerCorners>,
}

/// The triangles of positions, and what other attributes cut them into.
struct EdgebreakerCorners {
    base: Corners,
    /// By number of the attribute data.
    cut: Vec<Corners>,
    /// A corner of each point.
    corner_of_point: Vec<u32>,
}

/// Passes over names and values that applications add.
fn skip_metadata(reader: &mut Reader) -> Result<(), Fault> {
    let count = reader.variable()?;
    for _ in 0..count {
        reader.variable()?;
        skip_element(reader, 0)?;
    }
    skip_element(reader, 0)
}

fn skip_element(reader: &mut Reader, depth: usize) -> Result<(), Fault> {
    if depth > 32 {
        return Err("metadata is nested too deeply".into());
    }
    let skip_text = |reader: &mut Reader| -> Result<(), Fault> {
        let length = reader.u8()?;
        reader.take(usize::from(length))?;
        Ok(())
    };
    for _ in 0..reader.variable()? {
        skip_text(reader)?;
        let length = reader.variable()?;
        reader.take(length as usize)?;
    }
    for _ in 0..reader.variable()? {
        skip_text(reader)?;
        skip_element(reader, depth + 1)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
