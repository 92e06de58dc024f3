//! An XML file as an owned tree with line numbers, `<default>` and `$name` resolved and `<include>`
//! spliced in.

use super::error::{ImportError, Location};
use super::limits::LoadResource;
use super::loading::Loading;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Most attributes of an element: far more than any has that means something. The parser compares
/// them pair by pair.
const MOST_ATTRIBUTES: usize = 64;

/// Longest attribute with its definitions replaced, in bytes.
const LONGEST_VALUE: usize = 1 << 20;

/// Longest part of an element's path that is taken from an id or a name, in bytes.
const LONGEST_LABEL: usize = 64;

/// An element.
#[derive(Debug)]
pub(crate) struct Node {
    pub(crate) tag: String,
    pub(crate) attributes: Vec<(String, String)>,
    pub(crate) children: Vec<Node>,
    pub(crate) file: Rc<Path>,
    pub(crate) line: u32,
    /// Tags from the root, with ids or names: `scene/shape[floor]/bsdf`.
    pub(crate) element: String,
}

impl Node {
    pub(crate) fn attribute(&self, name: &str) -> Option<&str> {
        let mut attributes = self.attributes.iter();
        attributes
            .find(|(key, _)| key == name)
            .map(|(_, value)| value.as_str())
    }

    /// The attribute, or an error that says that it is missing.
    pub(crate) fn require(&self, name: &str) -> Result<&str, ImportError> {
        self.attribute(name)
            .ok_or_else(|| self.malformed(format!("attribute `{name}` is missing")))
    }

    pub(crate) fn location(&self) -> Location {
        Location::line(&self.file, self.line).element(&self.element)
    }

    pub(crate) fn malformed(&self, message: impl Into<String>) -> ImportError {
        ImportError::malformed(self.location(), message)
    }

    pub(crate) fn unsupported(&self, message: impl Into<String>) -> ImportError {
        ImportError::unsupported(self.location(), message)
    }

    /// A path in an attribute or property of this element. A relative one starts at the folder of
    /// the element's file or, if nothing is there, at a folder that a `<path>` names, at the
    /// scene's own folder, or at the current directory.
    pub(crate) fn resolve(&self, name: &str, loading: &Loading) -> PathBuf {
        loading.resolve(self.file.parent().unwrap_or(Path::new("")), name)
    }
}

/// Definitions of `$name`s: those given by the caller, then the file's defaults.
struct Definitions {
    values: BTreeMap<String, (String, bool)>,
}

impl Definitions {
    /// `text` with every `$name` replaced.
    fn substitute(&mut self, text: &str) -> Result<String, String> {
        let mut result = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            result.push_str(&rest[..at]);
            rest = &rest[at + 1..];
            let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
            let length = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
            let name = &rest[..length];
            let (value, used) = self
                .values
                .get_mut(name)
                .ok_or_else(|| format!("`${name}` is not defined"))?;
            *used = true;
            result.push_str(value);
            // Definitions of definitions can double it each time.
            if result.len() > LONGEST_VALUE {
                return Err(format!(
                    "a value of more than {LONGEST_VALUE} bytes once `${name}` is replaced"
                ));
            }
            rest = &rest[length..];
        }
        result.push_str(rest);
        Ok(result)
    }
}

/// Parses `bytes` as the contents of `path`, with `defines` taking precedence over the file's own
/// defaults.
pub(crate) fn parse_xml(
    bytes: &[u8],
    path: &Path,
    defines: &[(String, String)],
    loading: &Loading,
) -> Result<Node, ImportError> {
    let given = |(name, value): &(String, String)| (name.clone(), (value.clone(), false));
    let mut definitions = Definitions {
        values: defines.iter().map(given).collect(),
    };
    let within = Within {
        depth: 0,
        files: &[path.to_path_buf()],
    };
    let root = parse_document(bytes, path, &mut definitions, &within, loading)?;
    for (name, _) in defines {
        if !definitions.values[name].1 {
            return Err(ImportError::UnusedDefine {
                path: path.to_path_buf(),
                name: name.clone(),
            });
        }
    }
    Ok(root)
}

/// What a document is included by.
struct Within<'a> {
    /// Elements around it.
    depth: u64,
    /// Files around it, and its own.
    files: &'a [PathBuf],
}

fn parse_document(
    bytes: &[u8],
    path: &Path,
    definitions: &mut Definitions,
    within: &Within,
    loading: &Loading,
) -> Result<Node, ImportError> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        ImportError::malformed(
            Location::byte(path, error.valid_up_to() as u64),
            "the file is not UTF-8 text",
        )
    })?;
    check_markup(text, path, within.depth, loading)?;
    let document = roxmltree::Document::parse(text).map_err(|error| {
        let message = format!("not well-formed XML: {error}");
        ImportError::malformed(Location::line(path, error.pos().row), message)
    })?;
    let newlines = text
        .bytes()
        .enumerate()
        .filter(|(_, b)| *b == b'\n')
        .map(|(i, _)| i);
    let mut builder = Builder {
        file: path.into(),
        newlines: newlines.collect(),
        definitions,
        within,
        loading,
    };
    builder.node(document.root_element(), "", within.depth)
}

/// Counts elements, their attributes and their nesting before a tree is made of them.
fn check_markup(text: &str, path: &Path, depth: u64, loading: &Loading) -> Result<(), ImportError> {
    let bytes = text.as_bytes();
    let mut depth = depth;
    let mut at = 0;
    while let Some(start) = text[at..].find('<').map(|offset| at + offset) {
        let location = || {
            let line = bytes[..start].iter().filter(|&&b| b == b'\n').count() as u32 + 1;
            Location::line(path, line)
        };
        let rest = &text[start..];
        let skipped = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
        if let Some((open, close)) = skipped.iter().find(|(open, _)| rest.starts_with(open)) {
            let Some(length) = rest[open.len()..].find(close) else {
                break;
            };
            at = start + open.len() + length + close.len();
            continue;
        }
        let (mut quote, mut quotes) = (None, 0);
        let mut end = start + 1;
        while let Some(&byte) = bytes.get(end) {
            match quote {
                Some(open) if byte == open => quote = None,
                Some(_) => {}
                None if byte == b'>' => break,
                None if byte == b'"' || byte == b'\'' => {
                    quote = Some(byte);
                    quotes += 1;
                }
                None => {}
            }
            end += 1;
        }
        if quotes > MOST_ATTRIBUTES {
            let what = format!("an element of more than {MOST_ATTRIBUTES} attributes");
            return Err(ImportError::malformed(location(), what));
        }
        if rest.starts_with("</") {
            depth = depth.saturating_sub(1);
        } else {
            loading.spend(LoadResource::Nodes, 1, location)?;
            loading.check_depth(depth, location)?;
            depth += u64::from(bytes.get(end - 1) != Some(&b'/'));
        }
        // Both ends are ASCII, or the text's end.
        at = (end + 1).min(bytes.len());
    }
    Ok(())
}

struct Builder<'a> {
    file: Rc<Path>,
    newlines: Vec<usize>,
    definitions: &'a mut Definitions,
    within: &'a Within<'a>,
    loading: &'a Loading,
}

impl Builder<'_> {
    fn node(&mut self, source: roxmltree::Node, parent: &str, depth: u64) -> Result<Node, ImportError> {
        let start = source.range().start;
        let mut node = Node {
            tag: source.tag_name().name().to_owned(),
            attributes: Vec::new(),
            children: Vec::new(),
            file: self.file.clone(),
            line: self.newlines.partition_point(|&at| at < start) as u32 + 1,
            element: String::new(),
        };
        let slash = if parent.is_empty() { "" } else { "/" };
        node.element = format!("{parent}{slash}{}", node.tag);
        let line = || Location::line(&self.file, node.line);
        self.loading.check_depth(depth, line)?;
        for attribute in source.attributes() {
            let value = self
                .definitions
                .substitute(attribute.value())
                .map_err(|message| node.malformed(message))?;
            let bytes = value.len() as u64;
            self.loading
                .spend(LoadResource::Bytes, bytes, || node.location())?;
            node.attributes.push((attribute.name().to_owned(), value));
        }
        if let Some(label) = node.attribute("id").or(node.attribute("name")) {
            let mut end = label.len().min(LONGEST_LABEL);
            while !label.is_char_boundary(end) {
                end -= 1;
            }
            node.element = format!("{}[{}]", node.element, &label[..end]);
        }
        for child in source.children() {
            if child.is_text() && !child.text().unwrap_or_default().trim().is_empty() {
                return Err(node.malformed("text between elements means nothing here"));
            }
            if !child.is_element() {
                continue;
            }
            let child = self.node(child, &node.element, depth + 1)?;
            match child.tag.as_str() {
                "default" => {
                    let (name, value) = (
                        child.require("name")?.to_owned(),
                        child.require("value")?.to_owned(),
                    );
                    self.definitions.values.entry(name).or_insert((value, false));
                }
                "include" => node.children.extend(self.include(&child, depth + 1)?),
                "path" => self.search(&child)?,
                _ => node.children.push(child),
            }
        }
        Ok(node)
    }

    /// The elements of an included scene.
    fn include(&mut self, child: &Node, depth: u64) -> Result<Vec<Node>, ImportError> {
        self.loading
            .spend(LoadResource::Includes, 1, || child.location())?;
        let path = child.resolve(child.require("filename")?, self.loading);
        if self.within.files.contains(&path) {
            return Err(child.malformed("files include each other without end"));
        }
        let mut files = self.within.files.to_vec();
        files.push(path.clone());
        let within = Within { depth, files: &files };
        let included = self
            .loading
            .read(&path)
            .and_then(|bytes| parse_document(&bytes, &path, self.definitions, &within, self.loading));
        match included {
            // An object of its own, too.
            Ok(root) if root.tag != "scene" => Ok(vec![root]),
            Ok(root) => Ok(root.children),
            Err(error @ ImportError::OverBudget { .. }) => Err(error),
            Err(source) => Err(ImportError::Referenced {
                location: child.location(),
                source: Box::new(source),
            }),
        }
    }

    /// Names are also looked up in the folder that a `<path>` names, as in Mitsuba.
    fn search(&mut self, child: &Node) -> Result<(), ImportError> {
        let folder = child.resolve(child.require("value")?, self.loading);
        self.loading.search_first(folder);
        Ok(())
    }
}
