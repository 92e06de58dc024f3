//! An XML file as an owned tree with line numbers, `<default>` and `$name` resolved and `<include>`
//! spliced in.

use super::error::{ImportError, Location, read_file};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Deepest nesting of elements, and of includes: far more than any scene has, and little for the
/// stack.
const DEEPEST: usize = 64;

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
    /// the element's file or, if nothing is there, at the current directory, as in Mitsuba.
    pub(crate) fn resolve(&self, name: &str) -> PathBuf {
        let beside = self.file.parent().unwrap_or(Path::new("")).join(name);
        if !beside.exists() && Path::new(name).exists() {
            return PathBuf::from(name);
        }
        beside
    }
}

/// Definitions of `$name`s: those given by the caller, then the file's defaults.
struct Definitions {
    values: BTreeMap<String, (String, bool)>,
}

impl Definitions {
    /// `text` with every `$name` replaced.
    fn substitute(&mut self, text: &str) -> Result<String, String> {
        let mut result = String::with_capacity(text.len());
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
            rest = &rest[length..];
        }
        result.push_str(rest);
        Ok(result)
    }
}

/// Reads `path` with `defines` taking precedence over the file's own defaults.
pub(crate) fn read_xml(path: &Path, defines: &[(String, String)]) -> Result<Node, ImportError> {
    parse_xml(&read_file(path)?, path, defines)
}

/// Parses `bytes` as the contents of `path`.
pub(crate) fn parse_xml(
    bytes: &[u8],
    path: &Path,
    defines: &[(String, String)],
) -> Result<Node, ImportError> {
    let given = |(name, value): &(String, String)| (name.clone(), (value.clone(), false));
    let mut definitions = Definitions {
        values: defines.iter().map(given).collect(),
    };
    let root = parse_document(bytes, path, &mut definitions, 0)?;
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

fn parse_document(
    bytes: &[u8],
    path: &Path,
    definitions: &mut Definitions,
    includes: usize,
) -> Result<Node, ImportError> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        ImportError::malformed(
            Location::byte(path, error.valid_up_to() as u64),
            "the file is not UTF-8 text",
        )
    })?;
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
        includes,
    };
    builder.node(document.root_element(), "", 0)
}

struct Builder<'a> {
    file: Rc<Path>,
    newlines: Vec<usize>,
    definitions: &'a mut Definitions,
    includes: usize,
}

impl Builder<'_> {
    fn node(&mut self, source: roxmltree::Node, parent: &str, depth: usize) -> Result<Node, ImportError> {
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
        if depth > DEEPEST {
            return Err(ImportError::malformed(
                Location::line(&self.file, node.line),
                format!("elements are nested more than {DEEPEST} deep"),
            ));
        }
        for attribute in source.attributes() {
            let value = self
                .definitions
                .substitute(attribute.value())
                .map_err(|message| node.malformed(message))?;
            node.attributes.push((attribute.name().to_owned(), value));
        }
        if let Some(label) = node.attribute("id").or(node.attribute("name")) {
            node.element = format!("{}[{label}]", node.element);
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
                "include" => node.children.extend(self.include(&child)?),
                _ => node.children.push(child),
            }
        }
        Ok(node)
    }

    /// The elements of an included scene.
    fn include(&mut self, child: &Node) -> Result<Vec<Node>, ImportError> {
        if self.includes >= DEEPEST {
            return Err(child.malformed("files include each other without end"));
        }
        let path = child.resolve(child.require("filename")?);
        let included = read_file(&path)
            .and_then(|bytes| parse_document(&bytes, &path, self.definitions, self.includes + 1));
        match included {
            Ok(root) => Ok(root.children),
            Err(source) => Err(ImportError::Referenced {
                location: child.location(),
                source: Box::new(source),
            }),
        }
    }
}
