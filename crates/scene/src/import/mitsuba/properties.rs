//! An element's children as named properties. Whatever is never asked for is an error in the end,
//! not a guess.

use super::values;
use crate::Rgb;
use crate::import::error::ImportError;
use crate::import::spectrum::{self, SpectrumOf};
use crate::import::xml::Node;
use glam::{DAffine3, DVec3};
use std::cell::RefCell;
use std::collections::HashSet;

/// Attributes that an element may have, by tag; `None` for a tag that means nothing in a scene.
fn known_attributes(tag: &str) -> Option<&'static [&'static str]> {
    Some(match tag {
        "scene" => &["version"],
        "integrator" | "sensor" | "emitter" | "shape" | "bsdf" | "texture" | "film" | "sampler"
        | "rfilter" | "medium" | "phase" | "volume" => &["type", "id", "name"],
        "ref" => &["id", "name"],
        "alias" => &["id", "as"],
        "float" | "integer" | "boolean" | "string" | "rgb" => &["name", "value"],
        "spectrum" => &["name", "value", "filename", "type", "id"],
        "point" | "vector" => &["name", "value", "x", "y", "z"],
        "transform" => &["name"],
        "translate" | "scale" => &["value", "x", "y", "z"],
        "rotate" => &["value", "x", "y", "z", "angle"],
        "lookat" => &["origin", "target", "up"],
        "matrix" => &["value"],
        _ => return None,
    })
}

/// Rejects unknown elements and attributes anywhere below `node`.
pub(super) fn check_tree(node: &Node) -> Result<(), ImportError> {
    let known = known_attributes(&node.tag)
        .ok_or_else(|| node.unsupported(format!("the element <{}> is not supported", node.tag)))?;
    for (name, _) in &node.attributes {
        if !known.contains(&name.as_str()) {
            return Err(node.malformed(format!("<{}> has no attribute `{name}`", node.tag)));
        }
    }
    node.children.iter().try_for_each(check_tree)
}

/// An element that describes an object, and which of its children have been asked for.
pub(super) struct Properties<'a> {
    pub(super) node: &'a Node,
    asked: RefCell<Vec<bool>>,
}

impl<'a> Properties<'a> {
    /// Wraps `node`.
    ///
    /// # Errors
    ///
    /// Two children have the same name.
    pub(super) fn new(node: &'a Node) -> Result<Self, ImportError> {
        let mut names = HashSet::new();
        for child in &node.children {
            if child.attribute("name").is_some_and(|name| !names.insert(name)) {
                return Err(child.malformed("the name is taken by an earlier element"));
            }
        }
        Ok(Self {
            node,
            asked: RefCell::new(vec![false; node.children.len()]),
        })
    }

    /// The plugin's type.
    pub(super) fn kind(&self) -> Result<&'a str, ImportError> {
        self.node.require("type")
    }

    /// The child of that name, marked as asked for.
    pub(super) fn get(&self, name: &str) -> Option<&'a Node> {
        let mut children = self.node.children.iter();
        let index = children.position(|child| child.attribute("name") == Some(name))?;
        self.asked.borrow_mut()[index] = true;
        Some(&self.node.children[index])
    }

    /// The children that `wanted` accepts, marked as asked for.
    pub(super) fn all(&self, wanted: impl Fn(&Node) -> bool) -> Vec<&'a Node> {
        let mut asked = self.asked.borrow_mut();
        let children = self.node.children.iter().zip(asked.iter_mut());
        let chosen = children.filter(|(child, _)| wanted(child));
        chosen
            .map(|(child, asked)| {
                *asked = true;
                child
            })
            .collect()
    }

    /// Marks properties that change nothing here as asked for.
    pub(super) fn ignore(&self, names: &[&str]) {
        for name in names {
            self.get(name);
        }
    }

    /// The children that nothing has asked for, and what to say of them.
    pub(super) fn left(&self) -> Vec<(&'a Node, String)> {
        let asked = self.asked.borrow();
        let children = self.node.children.iter().zip(asked.iter());
        let kind = self.node.attribute("type").unwrap_or(&self.node.tag);
        let said = |child: &Node| {
            let what = match child.attribute("name") {
                Some(name) => format!("parameter `{name}`"),
                None => format!("element <{}>", child.tag),
            };
            format!("{what} of `{kind}` is not supported")
        };
        children
            .filter(|(_, asked)| !**asked)
            .map(|(child, _)| (child, said(child)))
            .collect()
    }

    /// Errs on the first child that nothing has asked for.
    fn finish(&self) -> Result<(), ImportError> {
        match self.left().into_iter().next() {
            None => Ok(()),
            Some((child, what)) => Err(child.unsupported(what)),
        }
    }

    /// The property of that name, which must be one of `tags`.
    fn typed(&self, name: &str, tags: &[&str]) -> Result<Option<&'a Node>, ImportError> {
        match self.get(name) {
            Some(child) if !tags.contains(&child.tag.as_str()) => Err(child.malformed(format!(
                "`{name}` is <{}>, expected <{}>",
                child.tag,
                tags.join("> or <")
            ))),
            child => Ok(child),
        }
    }

    pub(super) fn string(&self, name: &str) -> Result<Option<&'a str>, ImportError> {
        self.typed(name, &["string"])?
            .map(|child| child.require("value"))
            .transpose()
    }

    pub(super) fn float(&self, name: &str) -> Result<Option<f32>, ImportError> {
        self.typed(name, &["float", "integer"])?
            .map(|child| values::float(child, child.require("value")?))
            .transpose()
    }

    pub(super) fn positive(&self, name: &str) -> Result<Option<f32>, ImportError> {
        match self.float(name)? {
            Some(value) if value <= 0.0 => {
                let child = self.get(name).unwrap_or(self.node);
                Err(child.malformed(format!("`{name}` must be positive, found {value}")))
            }
            value => Ok(value),
        }
    }

    pub(super) fn integer(&self, name: &str) -> Result<Option<i64>, ImportError> {
        let Some(child) = self.typed(name, &["integer"])? else {
            return Ok(None);
        };
        let text = child.require("value")?;
        let value = text.trim().parse();
        value
            .map(Some)
            .map_err(|_| child.malformed(format!("`{text}` is not an integer")))
    }

    /// An integer of at least one.
    pub(super) fn count(&self, name: &str) -> Result<Option<u32>, ImportError> {
        let Some(value) = self.integer(name)? else {
            return Ok(None);
        };
        match u32::try_from(value) {
            Ok(value) if value > 0 => Ok(Some(value)),
            _ => {
                let child = self.get(name).unwrap_or(self.node);
                Err(child.malformed(format!(
                    "`{name}` must be a positive 32-bit integer, found {value}"
                )))
            }
        }
    }

    pub(super) fn boolean(&self, name: &str) -> Result<Option<bool>, ImportError> {
        let Some(child) = self.typed(name, &["boolean"])? else {
            return Ok(None);
        };
        // As in Mitsuba, `True` is one, too.
        match child.require("value")?.trim() {
            value if value.eq_ignore_ascii_case("true") => Ok(Some(true)),
            value if value.eq_ignore_ascii_case("false") => Ok(Some(false)),
            other => Err(child.malformed(format!("`{other}` is neither `true` nor `false`"))),
        }
    }

    /// A colour that must not vary.
    pub(super) fn color(&self, name: &str) -> Result<Option<Rgb>, ImportError> {
        match self.get(name) {
            None => Ok(None),
            Some(child) if matches!(child.tag.as_str(), "rgb" | "spectrum" | "float") => {
                if let Some(kind) = child.attribute("type").filter(|_| child.tag == "spectrum") {
                    return self.plugin(child, kind).map(Some);
                }
                values::color(child, self.spectrum_of()).map(Some)
            }
            Some(child) => {
                Err(child.unsupported(format!("`{name}` must be a constant colour here, no texture")))
            }
        }
    }

    /// The colour of a spectrum that has a type and parameters of its own.
    fn plugin(&self, node: &Node, kind: &str) -> Result<Rgb, ImportError> {
        let own = Properties::new(node)?;
        let color = match kind {
            "uniform" | "rawconstant" => Rgb::splat(own.float("value")?.unwrap_or(1.0)),
            "d65" => match own.color("color")? {
                Some(color) => color * own.float("scale")?.unwrap_or(1.0),
                None => Rgb::splat(own.float("scale")?.or(own.float("value")?).unwrap_or(1.0)),
            },
            "srgb" | "rgb" => own.color("color")?.or(own.color("value")?).unwrap_or(Rgb::ONE),
            "irregular" | "regular" => sampled(&own, kind, self.spectrum_of())?,
            "blackbody" => {
                let temperature = own.positive("temperature")?;
                let temperature = temperature.ok_or_else(|| node.malformed("`temperature` is missing"))?;
                own.ignore(&["wavelength_min", "wavelength_max"]);
                spectrum::blackbody(f64::from(temperature)) * own.float("scale")?.unwrap_or(1.0)
            }
            _ => return Err(node.unsupported(format!("the spectrum `{kind}` is not supported"))),
        };
        own.finish()?;
        if color.is_finite() && color.min_element() >= 0.0 {
            Ok(color)
        } else {
            Err(node.malformed("a spectrum has a negative value or one out of range"))
        }
    }

    /// What spectra of this element are of.
    fn spectrum_of(&self) -> SpectrumOf {
        match self.node.tag.as_str() {
            "emitter" => SpectrumOf::Emission,
            _ => SpectrumOf::Reflectance,
        }
    }

    pub(super) fn transform(&self, name: &str) -> Result<Option<DAffine3>, ImportError> {
        self.typed(name, &["transform"])?
            .map(values::transform)
            .transpose()
    }

    pub(super) fn vector(&self, name: &str) -> Result<Option<DVec3>, ImportError> {
        self.typed(name, &["point", "vector"])?
            .map(|child| values::vector(child, 0.0))
            .transpose()
    }
}

/// The colour of a spectrum given by lists of numbers, at wavelengths of its own or evenly.
fn sampled(properties: &Properties, kind: &str, of: SpectrumOf) -> Result<Rgb, ImportError> {
    let node = properties.node;
    let list = |name: &str| -> Result<Vec<f64>, ImportError> {
        let text = properties.string(name)?;
        values::numbers(
            node,
            text.ok_or_else(|| node.malformed(format!("`{name}` is missing")))?,
        )
    };
    let found = list("values")?;
    let wavelengths = if kind == "irregular" {
        list("wavelengths")?
    } else {
        let (least, greatest) = (
            properties.float("wavelength_min")?.unwrap_or(360.0),
            properties.float("wavelength_max")?.unwrap_or(830.0),
        );
        let steps = (found.len().max(2) - 1) as f64;
        let step = f64::from(greatest - least) / steps;
        (0..found.len())
            .map(|i| f64::from(least) + step * i as f64)
            .collect()
    };
    if wavelengths.len() != found.len() {
        return Err(node.malformed(format!(
            "{} wavelengths for {} values",
            wavelengths.len(),
            found.len()
        )));
    }
    values::from_points(node, wavelengths.into_iter().zip(found).collect(), of)
}
