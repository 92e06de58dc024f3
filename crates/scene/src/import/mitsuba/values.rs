//! Attribute values: numbers, vectors, colours, booleans and transforms.

use crate::Rgb;
use crate::import::error::ImportError;
use crate::import::spectrum::{self, SpectrumOf};
use crate::import::transform::look_at;
use crate::import::xml::Node;
use glam::{DAffine3, DMat4, DVec3};

/// Numbers separated by commas or white space, all finite.
pub(super) fn numbers(node: &Node, text: &str) -> Result<Vec<f64>, ImportError> {
    let words = text.split(|c: char| c == ',' || c.is_ascii_whitespace());
    words
        .filter(|word| !word.is_empty())
        .map(|word| number(node, word))
        .collect()
}

/// One finite number.
pub(super) fn number(node: &Node, text: &str) -> Result<f64, ImportError> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(node.malformed(format!("`{text}` is not finite"))),
        Err(_) => Err(node.malformed(format!("`{text}` is not a number"))),
    }
}

/// One finite number in the range of `f32`.
pub(super) fn float(node: &Node, text: &str) -> Result<f32, ImportError> {
    let value = number(node, text)? as f32;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(node.malformed(format!("`{text}` is out of range")))
    }
}

/// A vector as `value="a b c"`, `value="a"` (thrice the same) or `x= y= z=` with `default` for
/// those missing.
pub(super) fn vector(node: &Node, default: f64) -> Result<DVec3, ImportError> {
    if let Some(value) = node.attribute("value") {
        if ["x", "y", "z"].iter().any(|axis| node.attribute(axis).is_some()) {
            return Err(node.malformed("`value` and `x`, `y`, `z` exclude each other"));
        }
        return match numbers(node, value)?[..] {
            [a] => Ok(DVec3::splat(a)),
            [a, b, c] => Ok(DVec3::new(a, b, c)),
            _ => Err(node.malformed(format!("expected one or three numbers, found `{value}`"))),
        };
    }
    let mut axes = [default; 3];
    for (axis, name) in axes.iter_mut().zip(["x", "y", "z"]) {
        if let Some(text) = node.attribute(name) {
            *axis = number(node, text)?;
        }
    }
    Ok(DVec3::from_array(axes))
}

/// A colour from an `rgb`, `spectrum` or `float` element: one number, three, `#rrggbb`, whose codes
/// are taken as sRGB-encoded, or values by wavelength.
pub(super) fn color(node: &Node, of: SpectrumOf) -> Result<Rgb, ImportError> {
    let text = node.require("value")?;
    if let Some(hex) = text.trim().strip_prefix('#') {
        let code = u32::from_str_radix(hex, 16).ok().filter(|_| hex.len() == 6);
        let [_, r, g, b] = code
            .ok_or_else(|| node.malformed(format!("`{text}` is not of the form #rrggbb")))?
            .to_be_bytes();
        return Ok(Rgb::from_array([r, g, b].map(srgb_to_linear)));
    }
    if text.contains(':') {
        return spectrum(node, text, of);
    }
    let color = match numbers(node, text)?[..] {
        [v] => DVec3::splat(v),
        [r, g, b] if node.tag == "rgb" => DVec3::new(r, g, b),
        _ => return Err(node.malformed(format!("`{text}` is not a colour"))),
    };
    let color = color.as_vec3();
    if color.is_finite() && color.min_element() >= 0.0 {
        Ok(color)
    } else {
        Err(node.malformed(format!("`{text}` has a negative component or one out of range")))
    }
}

/// The colour of `400:0.1, 500:0.7, …`.
fn spectrum(node: &Node, text: &str, of: SpectrumOf) -> Result<Rgb, ImportError> {
    let words = text.split(|c: char| c == ',' || c.is_ascii_whitespace());
    let mut points = Vec::new();
    for word in words.filter(|word| !word.is_empty()) {
        let pair = word.split_once(':');
        let (wavelength, value) =
            pair.ok_or_else(|| node.malformed(format!("`{word}` is not of the form wavelength:value")))?;
        points.push((number(node, wavelength)?, number(node, value)?));
    }
    from_points(node, points, of)
}

/// The colour of a spectrum between its points.
pub(super) fn from_points(node: &Node, points: Vec<(f64, f64)>, of: SpectrumOf) -> Result<Rgb, ImportError> {
    if points.is_empty() || !points.is_sorted_by(|a, b| a.0 < b.0) {
        return Err(node.malformed("the wavelengths of a spectrum must ascend"));
    }
    if points.iter().any(|&(_, value)| value < 0.0) {
        return Err(node.malformed("a spectrum has a negative value"));
    }
    let color = spectrum::color(&points, of);
    if color.is_finite() {
        Ok(color)
    } else {
        Err(node.malformed("a spectrum is out of range"))
    }
}

fn srgb_to_linear(code: u8) -> f32 {
    let value = f64::from(code) / 255.0;
    let linear = if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    };
    linear as f32
}

/// The product of a `transform`'s steps: each is applied after the ones before it.
pub(super) fn transform(node: &Node) -> Result<DAffine3, ImportError> {
    let mut map = DAffine3::IDENTITY;
    for step in &node.children {
        map = transform_step(step)? * map;
    }
    if map.is_finite() {
        Ok(map)
    } else {
        Err(node.malformed("the transform overflows"))
    }
}

fn transform_step(step: &Node) -> Result<DAffine3, ImportError> {
    Ok(match step.tag.as_str() {
        "translate" => DAffine3::from_translation(vector(step, 0.0)?),
        "scale" => {
            let scale = vector(step, 1.0)?;
            if scale.min_element() == 0.0 || scale.to_array().contains(&0.0) {
                return Err(step.malformed("a scale of zero"));
            }
            DAffine3::from_scale(scale)
        }
        "rotate" => {
            let axis = vector(step, 0.0)?
                .try_normalize()
                .ok_or_else(|| step.malformed("the axis of rotation has no length"))?;
            let degrees = number(step, step.require("angle")?)?;
            DAffine3::from_axis_angle(axis, degrees.to_radians())
        }
        "lookat" => {
            let point = |name: &str| -> Result<DVec3, ImportError> {
                let text = step.require(name)?;
                match numbers(step, text)?[..] {
                    [x, y, z] => Ok(DVec3::new(x, y, z)),
                    _ => Err(step.malformed(format!("`{name}`: expected three numbers, found `{text}`"))),
                }
            };
            look_at(point("origin")?, point("target")?, point("up")?).ok_or_else(|| {
                step.malformed("`up` is parallel to the view, or origin and target coincide")
            })?
        }
        "matrix" => {
            let values = numbers(step, step.require("value")?)?;
            let rows = match values.len() {
                16 => DMat4::from_cols_slice(&values).transpose(),
                9 => DMat4::from_mat3(glam::DMat3::from_cols_slice(&values).transpose()),
                count => return Err(step.malformed(format!("a matrix of 9 or 16 numbers, found {count}"))),
            };
            if rows.row(3) != glam::DVec4::W {
                return Err(step.malformed("the last row of a matrix must be 0 0 0 1"));
            }
            DAffine3::from_mat4(rows)
        }
        _ => return Err(step.malformed("no step of a transform")),
    })
}
