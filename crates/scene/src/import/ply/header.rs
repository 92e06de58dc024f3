//! The header of a PLY file: format, elements and their properties.

use crate::import::error::{ImportError, Location};
use std::path::Path;

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Type of a number in the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    pub(super) fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// One property of an element.
#[derive(Clone, Debug)]
pub(super) enum Property {
    Scalar { name: String, of: Scalar },
    List { name: String, count: Scalar, of: Scalar },
}

impl Property {
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Scalar { name, .. } | Self::List { name, .. } => name,
        }
    }

    /// Least number of bytes that one occurrence takes in the body: what bounds an allocation by
    /// the file's size.
    fn least_bytes(&self, encoding: Encoding) -> usize {
        match (encoding, self) {
            (Encoding::Ascii, _) => 2, // a digit and a separator
            (_, Self::Scalar { of, .. }) => of.bytes(),
            (_, Self::List { count, .. }) => count.bytes(),
        }
    }
}

/// A run of equal records.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// By property the channel of an attribute that it is, and what it is divided by; `None` if
    /// the attribute is not there with one or three channels. Names are Mitsuba's (`color_0` …,
    /// `color_r` …, `r g b` for the attribute `color`) and the usual `red green blue`.
    pub(super) fn channels(&self, attribute: &str) -> Option<Vec<Option<(usize, f32)>>> {
        let channel = |property: &Property| {
            let Property::Scalar { name, of } = property else {
                return None;
            };
            let postfix = match name.strip_prefix(attribute) {
                Some("") => "0",
                Some(rest) => rest.strip_prefix('_')?,
                None if attribute == "color" => name,
                None => return None,
            };
            let channel = match postfix {
                "0" | "r" | "x" | "red" => 0,
                "1" | "g" | "y" | "green" => 1,
                "2" | "b" | "z" | "blue" => 2,
                _ => return None,
            };
            let unit = if *of == Scalar::U8 { 255.0 } else { 1.0 };
            // Positions are no colours.
            (name.len() > 1 || !"xyz".contains(name.as_str())).then_some((channel, unit))
        };
        let channels: Vec<_> = self.properties.iter().map(channel).collect();
        let has = |wanted: usize| channels.iter().flatten().any(|&(channel, _)| channel == wanted);
        (has(0) && has(1) == has(2)).then_some(channels)
    }

    /// Records that `bytes` of body can hold at most: an honest capacity however large the header's
    /// count is.
    pub(super) fn capacity(&self, encoding: Encoding, bytes: usize) -> usize {
        let least: usize = self.properties.iter().map(|p| p.least_bytes(encoding)).sum();
        // One over: the last number of an ASCII file needs no separator.
        self.count.min(bytes / least.max(1) + 1)
    }
}

/// A parsed header.
#[derive(Clone, Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Offset of the body in bytes.
    pub(super) body: usize,
    /// Line number of the body's first line.
    pub(super) body_line: u32,
}

impl Header {
    pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Self, ImportError> {
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut at = 0;
        let mut line = 0;
        loop {
            line += 1;
            let fail = |message: String| ImportError::malformed(Location::line(path, line), message);
            let rest = bytes.get(at..).unwrap_or_default();
            let Some(length) = rest.iter().position(|&b| b == b'\n') else {
                return Err(fail("the header ends before `end_header`".into()));
            };
            at += length + 1;
            let text = std::str::from_utf8(&rest[..length])
                .map_err(|_| fail("the header is not text".into()))?
                .trim();
            if line == 1 {
                if text != "ply" {
                    return Err(fail("not a PLY file: the first line is not `ply`".into()));
                }
                continue;
            }
            let mut words = text.split_ascii_whitespace();
            match words.next() {
                None | Some("comment" | "obj_info") => {}
                Some("format") => {
                    encoding = Some(match (words.next(), words.next()) {
                        (Some("ascii"), Some("1.0")) => Encoding::Ascii,
                        (Some("binary_little_endian"), Some("1.0")) => Encoding::LittleEndian,
                        (Some("binary_big_endian"), Some("1.0")) => Encoding::BigEndian,
                        _ => return Err(fail(format!("unknown format `{text}`"))),
                    });
                }
                Some("element") => {
                    let (Some(name), Some(count), None) = (words.next(), words.next(), words.next()) else {
                        return Err(fail(format!("expected `element <name> <count>`, found `{text}`")));
                    };
                    let count = count
                        .parse()
                        .map_err(|_| fail(format!("`{count}` is not a count of elements")))?;
                    elements.push(Element {
                        name: name.to_owned(),
                        count,
                        properties: Vec::new(),
                    });
                }
                Some("property") => {
                    let property =
                        parse_property(words).map_err(|what| fail(format!("{what} in `{text}`")))?;
                    let Some(element) = elements.last_mut() else {
                        return Err(fail("a property before the first element".into()));
                    };
                    element.properties.push(property);
                }
                Some("end_header") => break,
                Some(word) => return Err(fail(format!("unknown header keyword `{word}`"))),
            }
        }
        let Some(encoding) = encoding else {
            return Err(ImportError::malformed(
                Location::line(path, line),
                "the header has no `format` line",
            ));
        };
        Ok(Self {
            encoding,
            elements,
            body: at,
            body_line: line + 1,
        })
    }
}

fn parse_property<'a>(mut words: impl Iterator<Item = &'a str>) -> Result<Property, &'static str> {
    let scalar = |word: Option<&str>| word.and_then(Scalar::parse).ok_or("unknown number type");
    let first = words.next();
    let property = if first == Some("list") {
        let count = scalar(words.next())?;
        if !count.is_integer() {
            return Err("a list's count must be an integer");
        }
        let of = scalar(words.next())?;
        let name = words.next().ok_or("missing name")?.to_owned();
        Property::List { name, count, of }
    } else {
        let of = scalar(first)?;
        let name = words.next().ok_or("missing name")?.to_owned();
        Property::Scalar { name, of }
    };
    match words.next() {
        None => Ok(property),
        Some(_) => Err("excess words"),
    }
}
