//! NanoVDB files (`.nvdb`, version 32 of the format): a grid of densities as a dense one.
//!
//! Little-endian. A file is a row of segments: 16 bytes (the magic number `NanoVDB0`, or `NanoVDB2`
//! of later writers, the version, `u16` number of grids, `u16` codec), then for each grid 176 bytes
//! of metadata and its name, then the data of each grid, which is what the library has in memory: a
//! head of 672 bytes, the tree's of 64, and nodes of four levels. Keys and offsets lead down: the
//! root has a table of nodes of 4096³ voxels, which have 32³ children of 128³ voxels; these have
//! 16³ children, the leaves, of 8³ voxels. What has no child has one value.
//!
//! Read are grids of 32-bit floats, as they are or compressed by zip. Grids of other types, level
//! sets, and data compressed by blosc are refused. Every offset is checked.

use super::error::{ImportError, Location};
use super::limits::{LoadLimits, LoadResource};
use super::loading::Loading;
use crate::{GridDescription, GridFilter};
use glam::{DAffine3, DMat3, DVec3, IVec3};
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use std::path::Path;

const SEGMENT: usize = 16;
const METADATA: usize = 176;
const GRID: usize = 672;
const TREE: usize = 64;
const ROOT: usize = 64;
const ROOT_TILE: usize = 32;
const LEAF_VALUES: usize = 96;

/// Where the map of indices to the world lies in a grid: nine numbers by rows, and behind them and
/// the nine of the inverse a vector.
const MATRIX: usize = 296 + 88;
const VECTOR: usize = MATRIX + 144;

const FLOAT: u32 = 1;
const LEVEL_SET: u32 = 1;

/// An inner level: bits of a child's extent, bits of the number of children along an axis, and
/// where masks and table lie in a node.
struct Level {
    child: u32,
    side: u32,
    child_mask: usize,
    table: usize,
}

const UPPER: Level = Level {
    child: 7,
    side: 5,
    child_mask: 32 + 4096,
    table: 8256,
};

const LOWER: Level = Level {
    child: 3,
    side: 4,
    child_mask: 32 + 512,
    table: 1088,
};

/// Parses a NanoVDB file in memory: the grid of that name, or the first. The grid reaches one voxel
/// beyond those that are active, where the file's background is. `path` is for messages.
///
/// # Errors
///
/// Another format or version, no such grid, a grid of another type than 32-bit floats, a level set,
/// data compressed by blosc, offsets that lead nowhere, negative or infinite values, more bytes
/// than `limits` allow: the box of active voxels is one grid here, however few they are.
pub fn parse_nanovdb(
    bytes: &[u8],
    name: Option<&str>,
    path: impl AsRef<Path>,
    limits: &LoadLimits,
) -> Result<GridDescription, ImportError> {
    let path = path.as_ref();
    parse_within(bytes, name, path, &Loading::new(path, limits))
}

pub(super) fn parse_within(
    bytes: &[u8],
    name: Option<&str>,
    path: &Path,
    loading: &Loading,
) -> Result<GridDescription, ImportError> {
    let location = || Location::file(path).element(format!("the grid `{}`", name.unwrap_or("")));
    let unsupported = |what: String| ImportError::unsupported(location(), what);
    let ends = || ImportError::malformed(location(), "the file ends in the middle of its data");
    let (metadata, codec, data) = find(Reader(bytes), name, path)?;
    let (kind, class) = (
        metadata.word(32).ok_or_else(ends)?,
        metadata.word(36).ok_or_else(ends)?,
    );
    if kind != FLOAT {
        let message = format!("values of type {kind} are not supported, only 32-bit floats (type {FLOAT})");
        return Err(unsupported(message));
    }
    if class == LEVEL_SET {
        return Err(unsupported(
            "a level set is a surface, and no density: not supported".to_owned(),
        ));
    }
    let inflated;
    let data = match codec {
        0 => data,
        1 => {
            // Deflate makes of a byte 1,032 at most.
            let stream = data.0.get(8..).ok_or_else(ends)?;
            let most = (stream.len() as u64)
                .saturating_mul(1032)
                .min(loading.bytes_left());
            let most = usize::try_from(most).unwrap_or(usize::MAX);
            let found = decompress_to_vec_zlib_with_limit(stream, most);
            inflated = found.map_err(|error| {
                ImportError::malformed(location(), format!("it cannot be decompressed: {error}"))
            })?;
            loading.spend(LoadResource::Bytes, inflated.len() as u64, location)?;
            Reader(&inflated)
        }
        2 => {
            let message = "compression by blosc is not supported: `nanovdb_convert --zip` changes it";
            return Err(unsupported(message.to_owned()));
        }
        _ => {
            return Err(ImportError::malformed(location(), format!("codec {codec}")));
        }
    };
    // Of the active voxels, in the metadata behind the sizes, the types and the world's box.
    let corner = |at: usize| {
        let axis = |axis: usize| metadata.word(at + 4 * axis).map(|word| word as i32);
        Some(IVec3::new(axis(0)?, axis(1)?, axis(2)?))
    };
    let low = corner(88).ok_or_else(ends)?;
    let high = corner(100).ok_or_else(ends)?;
    let wrong_box = || ImportError::malformed(location(), "the box of its voxels is empty or out of range");
    // Beyond it, one voxel of the background.
    let range = -(1 << 30)..1 << 30;
    let in_range = (low.to_array().iter().chain(&high.to_array())).all(|place| range.contains(place));
    if !in_range || high.cmplt(low).any() {
        return Err(wrong_box());
    }
    let low = low - IVec3::ONE;
    let size = high - low + IVec3::splat(2);
    let count = (size.to_array().iter()).fold(1_u64, |count, &side| count.saturating_mul(side as u64));
    loading.spend(LoadResource::Bytes, count.saturating_mul(4), location)?;
    let count = usize::try_from(count).map_err(|_| wrong_box())?;
    let tree = Tree::new(data).ok_or_else(ends)?;
    let mut values = vec![0.0; count];
    tree.fill(low, size, &mut values).ok_or_else(|| {
        let message = "its tree leads beyond the end of its data or has two nodes at one place";
        ImportError::malformed(location(), message)
    })?;
    if values.iter().any(|value| !(value.is_finite() && *value >= 0.0)) {
        return Err(ImportError::malformed(
            location(),
            "a density is negative or not finite",
        ));
    }
    let to_world = index_to_world(data).ok_or_else(ends)?
        * DAffine3::from_translation(low.as_dvec3() - 0.5)
        * DAffine3::from_scale(size.as_dvec3());
    let flat = to_world.matrix3.determinant() == 0.0;
    // Numbers that are finite in the file's precision may not be in ours.
    let [to_world, inverse] = [to_world, to_world.inverse()].map(|map| map.as_affine3a());
    if flat || !to_world.is_finite() || !inverse.is_finite() {
        return Err(ImportError::malformed(
            location(),
            "its map is flat or out of range",
        ));
    }
    Ok(GridDescription {
        resolution: size.to_array().map(|side| side as u32),
        values: values.into(),
        filter: GridFilter::Trilinear,
        to_world,
    })
}

/// Metadata, codec and data of a grid, as they are in the file.
fn find<'a>(
    file: Reader<'a>,
    name: Option<&str>,
    path: &Path,
) -> Result<(Reader<'a>, u16, Reader<'a>), ImportError> {
    let location = || Location::file(path);
    let ends = || ImportError::malformed(location(), "the file ends in the middle of its data");
    let mut rest = file;
    let mut names = Vec::new();
    while !rest.0.is_empty() {
        let magic = rest.0.get(..8).ok_or_else(ends)?;
        if !matches!(magic, b"NanoVDB0" | b"NanoVDB2") {
            let message = match magic {
                [0x20, 0x42, 0x44, 0x56, ..] => {
                    "an OpenVDB file: `nanovdb_convert` makes a NanoVDB file of it"
                }
                b"NanoVDB1" => "a grid without a file's head is not supported",
                _ => "no NanoVDB file: it does not start with `NanoVDB0` or `NanoVDB2`",
            };
            return Err(ImportError::unsupported(location(), message));
        }
        let major = rest.word(8).ok_or_else(ends)? >> 21;
        if major != 32 {
            let message = format!("version {major} of the format is not supported, only 32");
            return Err(ImportError::unsupported(location(), message));
        }
        let half = |at: usize| Some(u16::from_le_bytes(*rest.0.get(at..)?.first_chunk()?));
        let (grids, codec) = (half(12).ok_or_else(ends)?, half(14).ok_or_else(ends)?);
        let mut list = rest.skip(SEGMENT).ok_or_else(ends)?;
        let mut found = Vec::new();
        for _ in 0..grids {
            let metadata = list.part(0, METADATA).ok_or_else(ends)?;
            let length = metadata.word(136).ok_or_else(ends)? as usize;
            let own = list.part(METADATA, length).ok_or_else(ends)?;
            let own = own.0.split(|&byte| byte == 0).next().unwrap_or_default();
            let size = usize::try_from(metadata.long(8).ok_or_else(ends)?).map_err(|_| ends())?;
            found.push((metadata, String::from_utf8_lossy(own).into_owned(), size));
            list = list.skip(METADATA + length).ok_or_else(ends)?;
        }
        for (metadata, own, size) in found {
            let data = list.part(0, size).ok_or_else(ends)?;
            if name.is_none_or(|name| name == own) {
                return Ok((metadata, codec, data));
            }
            names.push(format!("`{own}`"));
            list = list.skip(size).ok_or_else(ends)?;
        }
        rest = list;
    }
    let name = name.unwrap_or_default();
    let message = format!("no grid is named `{name}`, there is {}", names.join(", "));
    Err(ImportError::malformed(location(), message))
}

/// From voxels, with their centres at whole numbers, to the world.
fn index_to_world(grid: Reader) -> Option<DAffine3> {
    let number = |at: usize| grid.long(at).map(f64::from_bits);
    let row = |row: usize| {
        let at = MATRIX + 24 * row;
        Some(DVec3::new(number(at)?, number(at + 8)?, number(at + 16)?))
    };
    let translation = DVec3::new(number(VECTOR)?, number(VECTOR + 8)?, number(VECTOR + 16)?);
    let matrix = DMat3::from_cols(row(0)?, row(1)?, row(2)?).transpose();
    Some(DAffine3::from_mat3_translation(matrix, translation))
}

/// Bytes, looked at within their bounds.
#[derive(Clone, Copy)]
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn word(self, at: usize) -> Option<u32> {
        Some(u32::from_le_bytes(*self.0.get(at..)?.first_chunk()?))
    }

    fn long(self, at: usize) -> Option<u64> {
        Some(u64::from_le_bytes(*self.0.get(at..)?.first_chunk()?))
    }

    fn real(self, at: usize) -> Option<f32> {
        self.word(at).map(f32::from_bits)
    }

    fn skip(self, count: usize) -> Option<Self> {
        self.0.get(count..).map(Self)
    }

    fn part(self, start: usize, length: usize) -> Option<Self> {
        self.0.get(start..start.checked_add(length)?).map(Self)
    }

    /// What lies a signed offset, which is stored at `at`, behind `base`.
    fn follow(self, base: usize, at: usize) -> Option<usize> {
        let offset = i64::try_from(self.long(at)?).ok().filter(|&offset| offset > 0)?;
        base.checked_add(usize::try_from(offset).ok()?)
    }
}

/// The tree of a grid.
struct Tree<'a> {
    grid: Reader<'a>,
    root: usize,
    tiles: usize,
    background: f32,
}

impl<'a> Tree<'a> {
    fn new(grid: Reader<'a>) -> Option<Self> {
        // Offsets of leaves, lower and upper nodes, then of the root.
        let root = grid.follow(GRID, GRID + 24)?;
        // At least the tree's own head lies before it.
        if root < GRID + TREE {
            return None;
        }
        Some(Self {
            grid,
            root,
            tiles: grid.word(root + 24)? as usize,
            background: grid.real(root + 28)?,
        })
    }

    /// Sets all voxels of the box of `size` voxels from `low` on; `None` where the data ends
    /// or two tiles have one place.
    fn fill(&self, low: IVec3, size: IVec3, values: &mut [f32]) -> Option<()> {
        let mut target = Target { low, size, values };
        let high = low + size - 1;
        target.values.fill(self.background);
        // Each place once: a file of many tiles at one place would fill the box over and over.
        let mut filled = std::collections::HashSet::new();
        for tile in 0..self.tiles {
            let at = self.root.checked_add(ROOT + ROOT_TILE.checked_mul(tile)?)?;
            let key = self.grid.long(at)?;
            // 21 bits an axis, of coordinates in units of 4096.
            let axis = |shift: u32| (((key >> shift) & 0x1f_ffff) << 12) as u32 as i32;
            let origin = IVec3::new(axis(42), axis(21), axis(0));
            let end = origin.saturating_add(IVec3::splat(4095));
            if origin.cmpgt(high).any() || end.cmplt(low).any() {
                continue;
            }
            if !filled.insert(origin) {
                return None;
            }
            if self.grid.long(at + 8)? == 0 {
                target.fill(origin, 4096, self.grid.real(at + 20)?);
            } else {
                let node = self.grid.follow(self.root, at + 8)?;
                self.inner(node, origin, &UPPER, &mut target)?;
            }
        }
        Some(())
    }

    fn inner(&self, node: usize, origin: IVec3, level: &Level, target: &mut Target) -> Option<()> {
        let extent = 1 << level.child;
        let last = (1 << level.side) - 1;
        // Children that reach into the box.
        let first = ((target.low - origin) >> level.child).max(IVec3::ZERO);
        let end = ((target.low + target.size - 1 - origin) >> level.child).min(IVec3::splat(last));
        for x in first.x..=end.x {
            for y in first.y..=end.y {
                for z in first.z..=end.z {
                    let index = ((x << (2 * level.side)) | (y << level.side) | z) as usize;
                    let mask = self.grid.0.get(node.checked_add(level.child_mask + index / 8)?)?;
                    let entry = node.checked_add(level.table + 8 * index)?;
                    let corner = origin + IVec3::new(x, y, z) * extent;
                    if mask >> (index % 8) & 1 == 0 {
                        target.fill(corner, extent, self.grid.real(entry)?);
                        continue;
                    }
                    let child = self.grid.follow(node, entry)?;
                    if level.child == LOWER.child {
                        self.leaf(child, corner, target)?;
                    } else {
                        self.inner(child, corner, &LOWER, target)?;
                    }
                }
            }
        }
        Some(())
    }

    fn leaf(&self, leaf: usize, origin: IVec3, target: &mut Target) -> Option<()> {
        let values = self.grid.part(leaf.checked_add(LEAF_VALUES)?, 4 * 512)?;
        // Only voxels of the box: many nodes may refer to one leaf.
        let first = (target.low - origin).max(IVec3::ZERO);
        let end = (target.low + target.size - origin).min(IVec3::splat(8));
        for x in first.x..end.x {
            for y in first.y..end.y {
                for z in first.z..end.z {
                    let index = (x << 6 | y << 3 | z) as usize;
                    target.fill(origin + IVec3::new(x, y, z), 1, values.real(4 * index)?);
                }
            }
        }
        Some(())
    }
}

/// A box of voxels that is being filled.
struct Target<'a> {
    low: IVec3,
    size: IVec3,
    values: &'a mut [f32],
}

impl Target<'_> {
    /// Sets what of a cube of voxels lies in the box.
    fn fill(&mut self, corner: IVec3, extent: i32, value: f32) {
        let first = (corner - self.low).max(IVec3::ZERO);
        let end = (corner - self.low + extent).min(self.size);
        let [width, height] = [self.size.x as usize, self.size.y as usize];
        for z in first.z..end.z {
            for y in first.y..end.y {
                let row = (z as usize * height + y as usize) * width;
                if first.x < end.x {
                    self.values[row + first.x as usize..row + end.x as usize].fill(value);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_testkit::check_faults;

    fn read(bytes: &[u8], name: Option<&str>) -> Result<GridDescription, ImportError> {
        parse_nanovdb(bytes, name, "f.nvdb", &LoadLimits::default())
    }

    fn put(bytes: &mut [u8], at: usize, value: &[u8]) {
        bytes[at..at + value.len()].copy_from_slice(value);
    }

    /// A grid of two leaves, a tile of 8³ voxels and one of 128³, written out number by number: the
    /// voxel (x, y, z) of a leaf is x + 10 y + 100 z, of those at (8, 0, 0) and (-8, 16, 128). The
    /// tiles at (0, 8, 0) and, of 128³, at (128, 0, 0) have 5 and 7, all else the background 0.5.
    fn grid() -> Vec<u8> {
        let root = GRID + TREE;
        let upper = root + ROOT + 2 * ROOT_TILE;
        let upper_size = UPPER.table + 8 * 32_768;
        let lower = upper + 2 * upper_size;
        let lower_size = LOWER.table + 8 * 4_096;
        let leaf = lower + 2 * lower_size;
        let leaf_size = LEAF_VALUES + 2_048;
        let mut bytes = vec![0; leaf + 2 * leaf_size];
        let matrix = [[0.0, 0.25, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 2.0]];
        for (i, x) in matrix
            .as_flattened()
            .iter()
            .chain(&[0.0; 9])
            .chain(&[1.0, 2.0, 3.0])
            .enumerate()
        {
            put(&mut bytes, 384 + 8 * i, &f64::to_le_bytes(*x));
        }
        put(&mut bytes, GRID + 24, &((root - GRID) as u64).to_le_bytes());
        put(&mut bytes, root + 24, &2_u32.to_le_bytes());
        put(&mut bytes, root + 28, &0.5_f32.to_le_bytes());
        // One node at the origin and one at x = -4096.
        for (index, x) in [0_i32, -4096].into_iter().enumerate() {
            let tile = root + ROOT + ROOT_TILE * index;
            let key = u64::from((x as u32) >> 12) << 42;
            put(&mut bytes, tile, &key.to_le_bytes());
            let node = upper + index * upper_size;
            put(&mut bytes, tile + 8, &((node - root) as u64).to_le_bytes());
            for entry in 0..32_768 {
                put(&mut bytes, node + UPPER.table + 8 * entry, &0.5_f32.to_le_bytes());
            }
            let below = lower + index * lower_size;
            for entry in 0..4_096 {
                put(
                    &mut bytes,
                    below + LOWER.table + 8 * entry,
                    &0.5_f32.to_le_bytes(),
                );
            }
            // (0, 0, 0) of the first; of the second 31 along x and 1 along z.
            let entry = if index == 0 { 0 } else { 31 << 10 | 1 };
            bytes[node + UPPER.child_mask + entry / 8] |= 1 << (entry % 8);
            put(
                &mut bytes,
                node + UPPER.table + 8 * entry,
                &((below - node) as u64).to_le_bytes(),
            );
            // (8, 0, 0) is 1 along x; (-8, 16, 128) is 15 along x, 2 along y.
            let entry = if index == 0 { 1 << 8 } else { 15 << 8 | 2 << 4 };
            bytes[below + LOWER.child_mask + entry / 8] |= 1 << (entry % 8);
            let own = leaf + index * leaf_size;
            put(
                &mut bytes,
                below + LOWER.table + 8 * entry,
                &((own - below) as u64).to_le_bytes(),
            );
            for voxel in 0..512_usize {
                let value = (voxel >> 6) + 10 * (voxel >> 3 & 7) + 100 * (voxel & 7);
                put(
                    &mut bytes,
                    own + LEAF_VALUES + 4 * voxel,
                    &(value as f32).to_le_bytes(),
                );
            }
        }
        // Tiles: (0, 8, 0) of the first lower node, (128, 0, 0) of the first upper one.
        put(
            &mut bytes,
            lower + LOWER.table + 8 * (1 << 4),
            &5.0_f32.to_le_bytes(),
        );
        put(
            &mut bytes,
            upper + UPPER.table + 8 * (1 << 10),
            &7.0_f32.to_le_bytes(),
        );
        bytes
    }

    /// The file of a grid of that type and class, its active voxels from (-8, 0, 0) to
    /// (129, 23, 135).
    fn file(data: &[u8], codec: u16, kind: u32, class: u32) -> Vec<u8> {
        let mut bytes = b"NanoVDB0".to_vec();
        bytes.extend((32_u32 << 21 | 3 << 10).to_le_bytes());
        bytes.extend(1_u16.to_le_bytes());
        bytes.extend(codec.to_le_bytes());
        let mut metadata = vec![0; METADATA];
        put(&mut metadata, 8, &(data.len() as u64).to_le_bytes());
        put(&mut metadata, 32, &kind.to_le_bytes());
        put(&mut metadata, 36, &class.to_le_bytes());
        for (index, place) in [-8_i32, 0, 0, 129, 23, 135].into_iter().enumerate() {
            put(&mut metadata, 88 + 4 * index, &place.to_le_bytes());
        }
        put(&mut metadata, 136, &8_u32.to_le_bytes());
        bytes.extend(metadata);
        bytes.extend(b"density\0");
        bytes.extend(data);
        bytes
    }

    fn expected(x: i32, y: i32, z: i32) -> f32 {
        let in_leaf = |a: i32, b: i32, c: i32| {
            let at = [x - a, y - b, z - c];
            at.iter()
                .all(|place| (0..8).contains(place))
                .then(|| (at[0] + 10 * at[1] + 100 * at[2]) as f32)
        };
        in_leaf(8, 0, 0).or(in_leaf(-8, 16, 128)).unwrap_or_else(|| {
            if (0..8).contains(&x) && (8..16).contains(&y) && (0..8).contains(&z) {
                5.0
            } else if x >= 128 && (0..128).contains(&y) && (0..128).contains(&z) {
                7.0
            } else {
                0.5
            }
        })
    }

    /// Every voxel, of data as it is and compressed; and where it lies in the world.
    #[test]
    fn voxels_are_where_the_tree_has_them() {
        let data = grid();
        let zipped = miniz_oxide::deflate::compress_to_vec_zlib(&data, 6);
        let framed = [&(zipped.len() as u64).to_le_bytes()[..], &zipped].concat();
        for file in [file(&data, 0, 1, 2), file(&framed, 1, 1, 2)] {
            let grid = read(&file, Some("density")).unwrap();
            assert_eq!(grid.resolution, [140, 26, 138]);
            check_faults(&["axes exchanged", "a voxel beside"], |fault| {
                for (index, &value) in grid.values.iter().enumerate() {
                    let place = [index % 140, index / 140 % 26, index / (140 * 26)];
                    let [x, y, z] = place.map(|place| place as i32);
                    let at = match fault {
                        Some("axes exchanged") => (z - 9, y - 1, x - 1),
                        Some(_) => (x - 8, y - 1, z - 1),
                        None => (x - 9, y - 1, z - 1),
                    };
                    if value != expected(at.0, at.1, at.2) {
                        return Err(format!("{value} at {at:?}"));
                    }
                }
                Ok(())
            })
            .unwrap();
            // The voxel (0, 0, 0) of the file is the tenth along x, the second along the others.
            let inside = glam::Vec3::new(9.5 / 140.0, 1.5 / 26.0, 1.5 / 138.0);
            let found = grid.to_world.transform_point3(inside);
            assert!(found.abs_diff_eq(glam::Vec3::new(1.0, 2.0, 3.0), 1e-4), "{found}");
            let along = grid.to_world.transform_vector3(glam::Vec3::X / 140.0);
            assert!(along.abs_diff_eq(glam::Vec3::Y * 0.5, 1e-6), "{along}");
        }
    }

    /// What is refused says why, and a file that ends anywhere, or leads anywhere, is no panic.
    #[test]
    fn what_cannot_be_read_is_refused() {
        let data = grid();
        let error = |file: &[u8], name| read(file, name).unwrap_err().to_string();
        assert!(error(&file(&data, 2, 1, 2), None).contains("blosc"));
        assert!(error(&file(&data, 0, 2, 2), None).contains("type 2"));
        assert!(error(&file(&data, 0, 1, 1), None).contains("level set"));
        assert!(error(&file(&data, 0, 1, 2), Some("heat")).contains("`density`"));
        assert!(error(b" BDV\0\0\0\0", None).contains("OpenVDB"));
        let sound = file(&data, 0, 1, 2);
        for length in (0..sound.len()).step_by(997) {
            assert!(read(&sound[..length], None).is_err());
        }
        let start = SEGMENT + METADATA + 8;
        let root = start + GRID + TREE;
        for at in [start + GRID + 24, root + 24, root + ROOT + 8] {
            for value in [u64::MAX, 1 << 62, 1 << 31, 7] {
                let mut broken = sound.clone();
                put(&mut broken, at, &value.to_le_bytes());
                // Some lead to other bytes of the file: values, or an error.
                let _ = read(&broken, None);
            }
        }
        for far in [1e39_f64, f64::INFINITY, 0.0] {
            let mut stretched = sound.clone();
            put(&mut stretched, start + MATRIX, &[far.to_le_bytes(); 3].concat());
            assert!(error(&stretched, None).contains("flat or out of range"), "{far}");
        }
        // Two tiles at one place.
        let mut twice = sound.clone();
        let key = twice[root + ROOT..][..8].to_vec();
        put(&mut twice, root + ROOT + ROOT_TILE, &key);
        assert!(error(&twice, None).contains("place"));
        let mut large = sound.clone();
        put(&mut large, SEGMENT + 100, &(1_i32 << 29).to_le_bytes());
        assert!(error(&large, None).contains("limit `bytes`"));
    }
}
