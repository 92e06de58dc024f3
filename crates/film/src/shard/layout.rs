//! A shard's file, byte by byte: an uncompressed OpenEXR file of scan lines.
//!
//! | bytes | what |
//! |---|---|
//! | magic number, version 2 | a single part of scan lines |
//! | attributes | those that every file has, then those of [`ShardHeader`], then two checksums; a zero byte |
//! | 8 for each row | where the row begins |
//! | 8 + 68 · width for each row | its number, its length, and a value of each pixel for each channel |
//!
//! A header has one form: after reading, it is written again and must give the same bytes.

use super::checksum::{Checksum, DIGITS, digits};
use super::header::{ImageKey, ShardHeader};
use super::part::ShardPart;
use crate::film::{TotalsSum, narrowed};
use crate::image::pixel_count;
use crate::{PixelStatistics, TILE_SIZE};
use std::ops::Range;

const MAGIC: [u8; 8] = [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];

/// Channels in the order of the file, which is that of their names: the mean for viewers, then what
/// is merged.
const CHANNELS: [(&str, ChannelType); CHANNEL_COUNT] = [
    ("B", ChannelType::Float),
    ("G", ChannelType::Float),
    ("R", ChannelType::Float),
    ("count", ChannelType::Uint),
    ("deviations.B.high", ChannelType::Uint),
    ("deviations.B.low", ChannelType::Uint),
    ("deviations.G.high", ChannelType::Uint),
    ("deviations.G.low", ChannelType::Uint),
    ("deviations.R.high", ChannelType::Uint),
    ("deviations.R.low", ChannelType::Uint),
    ("mean.B.high", ChannelType::Uint),
    ("mean.B.low", ChannelType::Uint),
    ("mean.G.high", ChannelType::Uint),
    ("mean.G.low", ChannelType::Uint),
    ("mean.R.high", ChannelType::Uint),
    ("mean.R.low", ChannelType::Uint),
    ("nonFinite", ChannelType::Uint),
];
const CHANNEL_COUNT: usize = 17;
const COUNT: usize = 3;
const DEVIATIONS: usize = 4;
const MEAN: usize = 10;
const NON_FINITE: usize = 16;

/// Longest header that is read or written.
pub const MOST_HEADER_BYTES: usize = 1 << 16;

/// Format of this module; every change gets a new number.
const FORMAT: &str = "1";

#[derive(Clone, Copy)]
enum ChannelType {
    Uint = 0,
    Float = 2,
}

/// Where things are in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// The header up to and with its last zero byte; zeros for checksums.
    pub header: Vec<u8>,
    /// Where the digits of the two checksums are: of the header, of the content.
    pub checksums: [usize; 2],
    width: usize,
    height: usize,
}

impl Layout {
    /// The layout of a shard's file; `Err` says why there is none.
    pub fn new(shard: &ShardHeader) -> Result<Self, String> {
        let [width, height] = shard.image().size;
        pixel_count(width, height).map_err(|error| error.to_string())?;
        let mut header = MAGIC.to_vec();
        let mut channels = Vec::new();
        for (name, kind) in CHANNELS {
            channels.extend_from_slice(name.as_bytes());
            channels.push(0);
            for word in [kind as u32, 0, 1, 1] {
                channels.extend_from_slice(&word.to_le_bytes());
            }
        }
        channels.push(0);
        let window: Vec<u8> = [0, 0, width - 1, height - 1]
            .iter()
            .flat_map(|side| side.to_le_bytes())
            .collect();
        for (name, kind, value) in [
            ("channels", "chlist", channels.as_slice()),
            ("compression", "compression", &[0]),
            ("dataWindow", "box2i", &window),
            ("displayWindow", "box2i", &window),
            ("lineOrder", "lineOrder", &[0]),
            ("pixelAspectRatio", "float", &1f32.to_le_bytes()),
            ("screenWindowCenter", "v2f", &[0; 8]),
            ("screenWindowWidth", "float", &1f32.to_le_bytes()),
        ] {
            put(&mut header, name, kind, value);
        }
        for (name, value) in texts(shard) {
            put(&mut header, name, "string", value.as_bytes());
        }
        let checksums = ["lightshed.headerChecksum", "lightshed.checksum"].map(|name| {
            put(&mut header, name, "string", &[b'0'; DIGITS]);
            header.len() - DIGITS
        });
        header.push(0);
        if header.len() > MOST_HEADER_BYTES {
            return Err(format!("its header would have {} bytes", header.len()));
        }
        Ok(Self {
            header,
            checksums,
            width: width as usize,
            height: height as usize,
        })
    }

    /// Reads the header at the start of `bytes`: the shard's, its layout, and the checksums of
    /// header and content that it states.
    pub fn read(bytes: &[u8]) -> Result<(ShardHeader, Self, [u32; 2]), String> {
        let attributes = Attributes::read(bytes)?;
        let shard = attributes.shard()?;
        let layout = Self::new(&shard)?;
        let stated = [
            attributes.text("lightshed.headerChecksum")?,
            attributes.text("lightshed.checksum")?,
        ];
        let mut found = bytes[..attributes.end].to_vec();
        let mut values = [0; 2];
        for ((text, value), &place) in stated.iter().zip(&mut values).zip(&layout.checksums) {
            *value = u32::from_str_radix(text, 16).map_err(|_| "a checksum is no number".to_owned())?;
            if let Some(place) = found.get_mut(place..place + DIGITS) {
                place.fill(b'0');
            }
        }
        let same = found == layout.header;
        same.then_some((shard, layout, values))
            .ok_or_else(|| "its header has another form".to_owned())
    }

    /// Checksum of the header.
    pub fn header_checksum(&self) -> u32 {
        let mut checksum = Checksum::default();
        checksum.update(&self.header);
        checksum.value()
    }

    /// Where the rows begin, 8 bytes each, after the header.
    pub fn offsets(&self) -> Vec<u8> {
        let first = self.rows_at();
        let places = (0..self.height).map(|row| (first + row * self.row_bytes()) as u64);
        places.flat_map(u64::to_le_bytes).collect()
    }

    /// Where the first row begins.
    pub fn rows_at(&self) -> usize {
        self.header.len() + 8 * self.height
    }

    /// Bytes of a row.
    pub fn row_bytes(&self) -> usize {
        8 + 4 * CHANNEL_COUNT * self.width
    }

    /// Bytes of the file.
    pub fn file_bytes(&self) -> u64 {
        (self.rows_at() + self.height * self.row_bytes()) as u64
    }

    /// Writes the rows from `top` on into `bytes`, [`Layout::row_bytes`] each. Their pixels are
    /// those of a band of the film.
    pub fn write_band(&self, top: usize, band: &[PixelStatistics], bytes: &mut [u8]) {
        let rows = band.len() / self.width;
        let mut bytes: Vec<&mut [u8]> = bytes.chunks_exact_mut(self.row_bytes()).collect();
        for (y, bytes) in bytes.iter_mut().enumerate() {
            let length = (bytes.len() - 8) as u32;
            bytes[..4].copy_from_slice(&((top + y) as u32).to_le_bytes());
            bytes[4..8].copy_from_slice(&length.to_le_bytes());
        }
        // Some tiles at a time: their pixels are read once, and the words of a channel lie side by
        // side.
        for (block, tiles) in band.chunks(BLOCK * rows).enumerate() {
            for (y, bytes) in bytes.iter_mut().enumerate() {
                let words = bytes[8..].as_chunks_mut::<4>().0;
                let mut x = block * BLOCK;
                for tile in tiles.chunks(GROUP * rows) {
                    let columns = tile.len() / rows;
                    self.write_group(x, &tile[y * columns..][..columns], words);
                    x += columns;
                }
            }
        }
    }

    /// Writes the pixels from column `x` on into a row's words.
    #[inline]
    fn write_group(&self, x: usize, pixels: &[PixelStatistics], words: &mut [[u8; 4]]) {
        if let Ok(pixels) = <&[PixelStatistics; GROUP]>::try_from(pixels) {
            let columns = columns_of(pixels);
            for (channel, column) in columns.iter().enumerate() {
                let at = channel * self.width + x;
                words[at..at + GROUP].copy_from_slice(&column.map(u32::to_le_bytes));
            }
        } else {
            // At the right edge.
            for (x, pixel) in (x..).zip(pixels) {
                for (channel, [word]) in columns_of(&[*pixel]).into_iter().enumerate() {
                    words[channel * self.width + x] = word.to_le_bytes();
                }
            }
        }
    }

    /// A row to read pixels from; `bytes` are [`Layout::row_bytes`].
    pub fn row<'a>(&self, bytes: &'a [u8]) -> Row<'a> {
        let values = bytes[8..].as_chunks::<4>().0;
        Row(std::array::from_fn(|channel| {
            &values[channel * self.width..][..self.width]
        }))
    }
}

/// Pixels that are written together: as many as a tile has in a row.
const GROUP: usize = TILE_SIZE as usize;

/// Columns of pixels that are written before the next row is.
const BLOCK: usize = 8 * GROUP;

/// Words of some pixels in the order of [`CHANNELS`].
#[inline]
fn columns_of<const N: usize>(pixels: &[PixelStatistics; N]) -> [[u32; N]; CHANNEL_COUNT] {
    let mut words = [[0; N]; CHANNEL_COUNT];
    words[COUNT] = pixels.each_ref().map(|pixel| pixel.count() as u32);
    words[NON_FINITE] = pixels.each_ref().map(|pixel| pixel.non_finite() as u32);
    // Blue, green, red.
    for (place, channel) in [2, 1, 0].into_iter().enumerate() {
        let mean = pixels.each_ref().map(|pixel| pixel.mean()[channel]);
        let deviations = pixels.each_ref().map(|pixel| pixel.squared_deviations()[channel]);
        words[place] = narrowed(mean).map(f32::to_bits);
        for (first, values) in [(DEVIATIONS, deviations), (MEAN, mean)] {
            let bits = values.map(f64::to_bits);
            words[first + 2 * place] = bits.map(|bits| (bits >> 32) as u32);
            words[first + 2 * place + 1] = bits.map(|bits| bits as u32);
        }
    }
    words
}

/// The values of a row, channel by channel.
pub struct Row<'a>([&'a [[u8; 4]]; CHANNEL_COUNT]);

impl<'a> Row<'a> {
    /// Whether every pixel has this number of samples, none of them left out.
    pub fn has_all(&self, samples: u64) -> bool {
        let wanted = (samples as u32).to_le_bytes();
        let all = |channel: usize, wanted: [u8; 4]| {
            let others = self.0[channel]
                .iter()
                .map(|bytes| u32::from_le_bytes(*bytes) ^ u32::from_le_bytes(wanted));
            others.fold(0, |all, other| all | other) == 0
        };
        all(COUNT, wanted) && all(NON_FINITE, [0; 4])
    }

    /// Adds the pixels to `totals`; `samples` is the number that each should have.
    pub fn add_to(&self, totals: &mut TotalsSum, samples: u64) {
        let word = |channel: usize, x: usize| u32::from_le_bytes(self.0[channel][x]);
        let width = self.0[COUNT].len();
        if self.has_all(samples) {
            totals.add_counts(samples, 0, width);
        } else {
            for x in 0..width {
                totals.add_counts(word(COUNT, x).into(), word(NON_FINITE, x).into(), 1);
            }
        }
        // The first channels are blue, green, red.
        totals.add_means((0..width).map(|x| [2, 1, 0].map(|channel| f32::from_bits(word(channel, x)))));
    }

    /// Higher and lower words of the means of a channel: red, green, blue.
    pub fn mean(&self, channel: usize) -> [&'a [[u8; 4]]; 2] {
        [0, 1].map(|half| self.0[MEAN + 2 * (2 - channel) + half])
    }

    /// The same of the sums of squared deviations.
    pub fn deviations(&self, channel: usize) -> [&'a [[u8; 4]]; 2] {
        [0, 1].map(|half| self.0[DEVIATIONS + 2 * (2 - channel) + half])
    }

    /// The statistics of the pixel in column `x`; `None` if they are not those of `samples`
    /// samples.
    #[inline]
    pub fn pixel(&self, x: usize, samples: u64) -> Option<PixelStatistics> {
        let word = |channel: usize| u32::from_le_bytes(self.0[channel][x]);
        let real =
            |channel: usize| f64::from_bits(u64::from(word(channel)) << 32 | u64::from(word(channel + 1)));
        let triple = |first: usize| [real(first + 4), real(first + 2), real(first)];
        let (count, non_finite) = (u64::from(word(COUNT)), u64::from(word(NON_FINITE)));
        PixelStatistics::from_parts(count, non_finite, triple(MEAN), triple(DEVIATIONS))
            .filter(|_| count + non_finite == samples)
    }
}

/// What a header states about the shard, as attributes.
fn texts(shard: &ShardHeader) -> [(&'static str, String); 11] {
    let image = shard.image();
    [
        ("lightshed.shard", FORMAT.to_owned()),
        ("lightshed.scene", image.scene.clone()),
        ("lightshed.sceneHash", format!("{:016x}", image.scene_hash)),
        ("lightshed.method", image.method.clone()),
        ("lightshed.options", image.options.clone()),
        ("lightshed.seed", image.seed.to_string()),
        ("lightshed.independent", image.independent.to_string()),
        (
            "lightshed.frame",
            image.frame.map_or_else(String::new, |frame| frame.to_string()),
        ),
        ("lightshed.samples", image.samples.to_string()),
        ("lightshed.range", format!("{}..{}", shard.first(), shard.end())),
        ("lightshed.part", shard.part().to_string()),
    ]
}

fn put(header: &mut Vec<u8>, name: &str, kind: &str, value: &[u8]) {
    for text in [name, kind] {
        header.extend_from_slice(text.as_bytes());
        header.push(0);
    }
    header.extend_from_slice(&(value.len() as u32).to_le_bytes());
    header.extend_from_slice(value);
}

/// The attributes of an OpenEXR header.
struct Attributes<'a> {
    named: Vec<(&'a [u8], &'a [u8])>,
    /// Length of the header.
    end: usize,
}

impl<'a> Attributes<'a> {
    fn read(bytes: &'a [u8]) -> Result<Self, String> {
        let mut rest = bytes
            .strip_prefix(&MAGIC)
            .ok_or("it does not begin as an OpenEXR file of scan lines")?;
        let mut named = Vec::new();
        let ended = "its header does not end";
        loop {
            let name = until_zero(&mut rest).ok_or(ended)?;
            if name.is_empty() {
                let end = bytes.len() - rest.len();
                return Ok(Self { named, end });
            }
            until_zero(&mut rest).ok_or(ended)?;
            let (length, after) = rest.split_first_chunk::<4>().ok_or(ended)?;
            let (value, after) = after
                .split_at_checked(u32::from_le_bytes(*length) as usize)
                .ok_or(ended)?;
            rest = after;
            named.push((name, value));
        }
    }

    fn text(&self, name: &str) -> Result<&'a str, String> {
        let found = self.named.iter().find(|(other, _)| *other == name.as_bytes());
        let (_, value) = found.ok_or_else(|| format!("it has no attribute {name}"))?;
        std::str::from_utf8(value).map_err(|_| format!("its attribute {name} is no text"))
    }

    fn number<T: std::str::FromStr>(&self, name: &str) -> Result<T, String> {
        parsed(name, self.text(name)?)
    }

    fn size(&self) -> Result<[u32; 2], String> {
        let found = self.named.iter().find(|(other, _)| *other == b"dataWindow");
        let window: Option<[u8; 16]> = found.and_then(|(_, value)| (*value).try_into().ok());
        let window = window.ok_or("it has no dataWindow")?;
        let side = |place: usize| {
            let last = window[place..]
                .first_chunk::<4>()
                .map_or(0, |bytes| u32::from_le_bytes(*bytes));
            last.checked_add(1).ok_or_else(|| "it is too large".to_owned())
        };
        Ok([side(8)?, side(12)?])
    }

    fn shard(&self) -> Result<ShardHeader, String> {
        let format = self.text("lightshed.shard")?;
        if format != FORMAT {
            return Err(format!("its format is {format}, not {FORMAT}"));
        }
        let hash = self.text("lightshed.sceneHash")?;
        let frame = self.text("lightshed.frame")?;
        let image = ImageKey {
            scene: self.text("lightshed.scene")?.to_owned(),
            scene_hash: u64::from_str_radix(hash, 16).map_err(|_| "its sceneHash is no number".to_owned())?,
            method: self.text("lightshed.method")?.to_owned(),
            options: self.text("lightshed.options")?.to_owned(),
            seed: self.number("lightshed.seed")?,
            independent: self.number("lightshed.independent")?,
            frame: (!frame.is_empty())
                .then(|| parsed("lightshed.frame", frame))
                .transpose()?,
            samples: self.number("lightshed.samples")?,
            size: self.size()?,
        };
        let part: ShardPart = self.number("lightshed.part")?;
        let range = self.text("lightshed.range")?;
        let ends = range.split_once("..").ok_or("its range is none")?;
        let range: Range<u32> = parsed("lightshed.range", ends.0)?..parsed("lightshed.range", ends.1)?;
        ShardHeader::of_samples(image, part, range)
            .ok_or_else(|| "its range is beyond the image's samples".to_owned())
    }
}

fn parsed<T: std::str::FromStr>(name: &str, text: &str) -> Result<T, String> {
    text.parse()
        .map_err(|_| format!("its attribute {name} is '{text}'"))
}

/// The bytes before the next zero byte, which is skipped.
fn until_zero<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let end = rest.iter().position(|&byte| byte == 0)?;
    let (text, after) = rest.split_at(end);
    *rest = &after[1..];
    Some(text)
}

/// A header's bytes with its checksums in place.
pub fn stamped(layout: &Layout, content: u32) -> Vec<u8> {
    let mut header = layout.header.clone();
    for (place, value) in layout
        .checksums
        .into_iter()
        .zip([layout.header_checksum(), content])
    {
        header[place..place + DIGITS].copy_from_slice(&digits(value));
    }
    header
}
