//! pbrt-v4 scenes, the part of the format that the materials, lights and media here can express.
//!
//! | directive | types |
//! |---|---|
//! | `Shape` | `trianglemesh`, `plymesh`, `bilinearmesh` (two triangles each), `sphere`, `disk`, `cylinder`; `loopsubdiv` as its control mesh |
//! | `Material` | `diffuse`, `coateddiffuse`, `conductor`, `dielectric`, `thindielectric`, `mix`, `interface`; `coatedconductor`, `diffusetransmission`, `subsurface`, `hair` and `measured` by what is nearest |
//! | `Texture` | `constant`, `imagemap`, `checkerboard` and `scale` of constants |
//! | `LightSource` | `point`, `spot`, `distant`, `infinite` |
//! | `AreaLightSource` | `diffuse` |
//! | `MakeNamedMedium` | `homogeneous`, `uniformgrid`, `nanovdb` (the grid `density`) |
//! | `Camera` | `perspective`, `orthographic` (from afar) |
//!
//! Transforms, attributes, `Include`, `Import` and objects with instances work as in
//! pbrt; files are looked for beside the scene's own. What is left out or taken otherwise is a
//! warning; what is not known of the above, and a directive that is not pbrt's, is an error with
//! file and line. Spectra become RGB, those of lights are scaled to luminance 1 as in pbrt.

mod light;
mod material;
mod medium;
mod parameters;
mod shape;
mod tokens;
mod view;

use super::error::{ImportError, Location};
use super::image::Encoding;
use super::limits::{LoadLimits, LoadResource};
use super::loading::Loading;
use super::{Loaded, Warning, fit, gz, spd};
use crate::{
    ColorTexture, FloatTexture, Image, Material, RenderSettings, SceneDescription, ShapeDescription,
};
use glam::{DAffine3, DMat3, DVec3};
use parameters::{Parameter, Parameters, number};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tokens::{Token, Word, tokens};

/// What is said of names that version 4 does not have.
const UPGRADE: &str = " (`pbrt --upgrade` changes files of version 3)";

/// Reads a pbrt scene.
pub(super) fn load(path: &Path, loading: &Loading) -> Result<Loaded, ImportError> {
    parse_within(&loading.read_main(path)?, path, loading)
}

/// Parses a pbrt-v4 scene in memory. `path` is where it would lie: the folder of files that it
/// refers to.
///
/// # Errors
///
/// As [`load_with`](super::load_with).
pub fn parse_pbrt(text: &str, path: impl AsRef<Path>, limits: &LoadLimits) -> Result<Loaded, ImportError> {
    let path = path.as_ref();
    parse_within(text.as_bytes(), path, &Loading::new(path, limits))
}

fn parse_within(bytes: &[u8], path: &Path, loading: &Loading) -> Result<Loaded, ImportError> {
    let mut importer = Importer {
        folder: path.parent().unwrap_or(Path::new("")).to_path_buf(),
        loading,
        description: SceneDescription {
            settings: RenderSettings {
                width: 1280,
                height: 720,
                samples_per_pixel: 16,
                max_depth: Some(6),
                roulette_depth: 5,
            },
            ..SceneDescription::default()
        },
        warnings: Vec::new(),
        state: State::default(),
        stack: Vec::new(),
        in_world: false,
        named_materials: HashMap::new(),
        colors: HashMap::new(),
        floats: HashMap::new(),
        images: HashMap::new(),
        media: HashMap::new(),
        systems: HashMap::new(),
        camera: None,
        view_is_chosen: false,
        object: None,
        objects: HashMap::new(),
        placed: HashSet::new(),
        instances: HashMap::new(),
    };
    importer.file(bytes, path, 0)?;
    importer.finish(path)?;
    Ok(Loaded {
        description: importer.description,
        warnings: importer.warnings,
        view_is_chosen: importer.view_is_chosen,
    })
}

/// What attributes hold.
#[derive(Clone)]
struct State {
    /// From the current space to the world's; before the world's begin to the camera's.
    map: DAffine3,
    reverses: bool,
    material: Option<u32>,
    area_light: Option<Parameters>,
    interior: Option<u32>,
    exterior: Option<u32>,
    /// What `Attribute` sets, by the kind of its target.
    defaults: Vec<(String, Vec<Parameter>)>,
}

impl Default for State {
    fn default() -> Self {
        Self {
            map: DAffine3::IDENTITY,
            reverses: false,
            material: None,
            area_light: None,
            interior: None,
            exterior: None,
            defaults: Vec::new(),
        }
    }
}

/// A shape of an object, and the media on its sides.
#[derive(Clone)]
struct Part {
    shape: ShapeDescription,
    sides: [Option<u32>; 2],
}

/// State of an import.
struct Importer<'a> {
    folder: PathBuf,
    loading: &'a Loading,
    description: SceneDescription,
    warnings: Vec<Warning>,
    state: State,
    /// States that attributes keep, and whether `ObjectBegin` has.
    stack: Vec<State>,
    in_world: bool,
    named_materials: HashMap<String, u32>,
    colors: HashMap<String, ColorTexture>,
    floats: HashMap<String, FloatTexture>,
    images: HashMap<(PathBuf, Encoding), Arc<Image>>,
    media: HashMap<String, u32>,
    systems: HashMap<String, DAffine3>,
    /// Parameters of the camera and the map from its space to the world.
    camera: Option<(Parameters, DAffine3)>,
    view_is_chosen: bool,
    /// The object that is being described.
    object: Option<(String, Vec<Part>)>,
    objects: HashMap<String, Vec<Part>>,
    /// Objects that some instance has placed.
    placed: HashSet<String>,
    /// Shapes of instances by object, part and whether they are mirrored.
    instances: HashMap<(String, usize, bool), u32>,
}

impl Importer<'_> {
    fn warn(&mut self, parameters: &Parameters, message: impl Into<String>) {
        Warning::push(&mut self.warnings, parameters.location(), message.into());
    }

    /// Says which parameters were not used.
    fn warn_left_over(&mut self, parameters: &Parameters) {
        for name in parameters.left_over() {
            self.warn(parameters, format!("the parameter `{name}` is left out"));
        }
    }

    /// The bytes of a file that a directive names.
    fn bytes_of(&self, parameters: &Parameters, file: &str) -> Result<(Vec<u8>, PathBuf), ImportError> {
        let path = self.folder.join(file);
        let read = self.loading.read(&path);
        let bytes = read
            .and_then(|bytes| gz::contents(bytes, &path, self.loading))
            .map_err(|source| ImportError::Referenced {
                location: parameters.location(),
                source: Box::new(source),
            })?;
        Ok((bytes, path))
    }

    /// A spectrum in a file: values by wavelength.
    fn spectrum_file(&self, parameters: &Parameters, file: &str) -> Result<Vec<(f64, f64)>, ImportError> {
        let (bytes, path) = self.bytes_of(parameters, file)?;
        let values = spd::values(&bytes, &path).map_err(|source| ImportError::Referenced {
            location: parameters.location(),
            source: Box::new(source),
        })?;
        let numbers = values.iter().flatten().map(|text| text.parse().ok());
        let numbers: Option<Vec<f64>> = numbers.collect();
        let points = numbers
            .filter(|numbers| numbers.iter().all(|number| number.is_finite()))
            .and_then(|numbers| light::spectrum_points(&numbers));
        points
            .ok_or_else(|| parameters.malformed(format!("`{file}` is no spectrum: wavelengths must ascend")))
    }

    fn file(&mut self, bytes: &[u8], path: &Path, depth: u64) -> Result<(), ImportError> {
        self.loading.check_depth(depth, || Location::file(path))?;
        let tokens = tokens(bytes, path)?;
        let mut rest = &tokens[..];
        while let [Token { line, word }, after @ ..] = rest {
            let Word::Bare(name) = word else {
                return Err(ImportError::malformed(
                    Location::line(path, *line),
                    "a value without a directive",
                ));
            };
            self.loading
                .spend(LoadResource::Nodes, 1, || Location::line(path, *line))?;
            let directive = Directive {
                name,
                path,
                line: *line,
            };
            rest = self.directive(&directive, after, depth)?;
        }
        Ok(())
    }

    /// Carries out a directive; the tokens behind it.
    fn directive<'t>(
        &mut self,
        directive: &Directive,
        mut rest: &'t [Token],
        depth: u64,
    ) -> Result<&'t [Token], ImportError> {
        match directive.name {
            "WorldBegin" => {
                self.in_world = true;
                self.state.map = DAffine3::IDENTITY;
                self.systems.insert("world".to_owned(), DAffine3::IDENTITY);
            }
            "AttributeBegin" | "TransformBegin" => {
                self.loading
                    .check_depth(self.stack.len() as u64, || directive.location())?;
                self.stack.push(self.state.clone());
            }
            "AttributeEnd" | "TransformEnd" => {
                let state = self.stack.pop();
                let state = state.ok_or_else(|| directive.malformed("nothing has begun that could end"))?;
                if directive.name == "TransformEnd" {
                    self.state.map = state.map;
                } else {
                    self.state = state;
                }
            }
            "ReverseOrientation" => self.state.reverses = !self.state.reverses,
            "Identity" => self.state.map = DAffine3::IDENTITY,
            "Translate" | "Scale" | "Rotate" | "LookAt" | "Transform" | "ConcatTransform" => {
                let map = directive.transform(&mut rest)?;
                self.state.map = match directive.name {
                    "Transform" => map,
                    _ => self.state.map * map,
                };
                if !self.state.map.is_finite() {
                    return Err(directive.malformed("the transform overflows"));
                }
            }
            "CoordinateSystem" => {
                let name = directive.text(&mut rest)?;
                self.systems.insert(name.to_owned(), self.state.map);
            }
            "CoordSysTransform" => {
                let name = directive.text(&mut rest)?;
                let system = self.systems.get(name);
                self.state.map = *system
                    .ok_or_else(|| directive.malformed(format!("no coordinate system is named `{name}`")))?;
            }
            "Include" | "Import" => {
                let name = directive.text(&mut rest)?;
                self.loading
                    .spend(LoadResource::Includes, 1, || directive.location())?;
                let own = Parameters::none(directive.path, directive.line, directive.name);
                let (bytes, path) = self.bytes_of(&own, name)?;
                self.file(&bytes, &path, depth + 1)?;
            }
            "Option" => {
                // Some have a type before their name, some a name alone and a value.
                match rest {
                    [
                        Token {
                            word: Word::Quoted(name),
                            ..
                        },
                        Token {
                            word: Word::Bare(_) | Word::Quoted(_),
                            ..
                        },
                        after @ ..,
                    ] if !name.trim().contains(char::is_whitespace) => rest = after,
                    _ => {
                        let none = Parameters::none(directive.path, directive.line, directive.name);
                        rest = none.read(rest)?.1;
                    }
                }
            }
            "ColorSpace" => {
                directive.text(&mut rest)?;
            }
            "ActiveTransform" => {
                if let [
                    Token {
                        word: Word::Bare(_), ..
                    },
                    after @ ..,
                ] = rest
                {
                    rest = after;
                }
            }
            "TransformTimes" => {
                directive.numbers::<2>(&mut rest)?;
            }
            "MediumInterface" => {
                let inside = directive.text(&mut rest)?;
                let outside = match rest {
                    [
                        Token {
                            word: Word::Quoted(_),
                            ..
                        },
                        ..,
                    ] => directive.text(&mut rest)?,
                    _ => inside,
                };
                self.state.interior = self.medium_named(directive, inside)?;
                self.state.exterior = self.medium_named(directive, outside)?;
            }
            "NamedMaterial" => {
                let name = directive.text(&mut rest)?;
                let material = self.named_materials.get(name).copied();
                self.state.material = Some(
                    material.ok_or_else(|| directive.malformed(format!("no material is named `{name}`")))?,
                );
            }
            "ObjectBegin" => {
                let name = directive.text(&mut rest)?.to_owned();
                if self.object.is_some() {
                    return Err(directive.malformed("an object within another"));
                }
                self.stack.push(self.state.clone());
                self.object = Some((name, Vec::new()));
            }
            "ObjectEnd" => {
                let object = self.object.take().zip(self.stack.pop());
                let ((name, parts), state) =
                    object.ok_or_else(|| directive.malformed("no object has begun"))?;
                self.objects.insert(name, parts);
                self.state = state;
            }
            "ObjectInstance" => {
                let name = directive.text(&mut rest)?;
                self.instance(directive, name)?;
            }
            "Attribute" => {
                let target = directive.text(&mut rest)?.to_owned();
                let none = Parameters::none(directive.path, directive.line, directive.name);
                let (parameters, after) = none.read(rest)?;
                rest = after;
                self.state.defaults.push((target, parameters.into_list()));
            }
            "Texture" => {
                let (name, kind) = (directive.text(&mut rest)?, directive.text(&mut rest)?);
                let (parameters, after) = self.parameters(directive, &mut rest, "texture")?;
                rest = after;
                self.texture(name, kind, &parameters)?;
            }
            "Camera" | "Film" | "Sampler" | "Integrator" | "Accelerator" | "PixelFilter" | "Shape"
            | "Material" | "LightSource" | "AreaLightSource" | "MakeNamedMedium" | "MakeNamedMaterial" => {
                let target = match directive.name {
                    "LightSource" | "AreaLightSource" => "light",
                    "Shape" => "shape",
                    "Material" | "MakeNamedMaterial" => "material",
                    "MakeNamedMedium" => "medium",
                    _ => "",
                };
                let (parameters, after) = self.parameters(directive, &mut rest, target)?;
                rest = after;
                self.object_of(directive, &parameters)?;
            }
            other => {
                return Err(
                    directive.unsupported(format!("the directive `{other}` is not supported{UPGRADE}"))
                );
            }
        }
        Ok(rest)
    }

    /// Type and parameters of a directive.
    fn parameters<'t>(
        &self,
        directive: &Directive,
        rest: &mut &'t [Token],
        target: &str,
    ) -> Result<(Parameters, &'t [Token]), ImportError> {
        let kind = directive.text(rest)?;
        let what = format!("{} \"{kind}\"", directive.name);
        let (mut parameters, after) = Parameters::none(directive.path, directive.line, &what).read(rest)?;
        for (of, defaults) in &self.state.defaults {
            if of == target {
                parameters = parameters.with_defaults(defaults);
            }
        }
        Ok((parameters, after))
    }

    fn object_of(&mut self, directive: &Directive, parameters: &Parameters) -> Result<(), ImportError> {
        let kind = parameters.what.split('"').nth(1).unwrap_or_default().to_owned();
        match directive.name {
            "Camera" => {
                // The map so far is from the world to the camera.
                let to_world = self.state.map.inverse();
                if !to_world.is_finite() {
                    return Err(parameters.malformed("the camera's transform is singular"));
                }
                self.systems.insert("camera".to_owned(), to_world);
                self.camera = Some((parameters.clone(), to_world));
                Ok(())
            }
            "Film" => self.film(parameters),
            "Sampler" => {
                if let Some(count) = parameters.count("pixelsamples")? {
                    self.description.settings.samples_per_pixel = count;
                }
                Ok(())
            }
            "Integrator" => {
                let depth = parameters.number("maxdepth")?.unwrap_or(5.0);
                if !(depth >= 0.0 && depth < f64::from(u32::MAX) && depth.fract() == 0.0) {
                    return Err(parameters.malformed(format!("`maxdepth` of {depth}")));
                }
                // pbrt counts vertices that scatter, here edges count.
                self.description.settings.max_depth = Some(depth as u32 + 1);
                Ok(())
            }
            "Accelerator" | "PixelFilter" => Ok(()),
            "Shape" => self.shape(&kind, parameters),
            "Material" => {
                let material = self.material(&kind, parameters)?;
                self.state.material = Some(self.push_material(material));
                Ok(())
            }
            "MakeNamedMaterial" => {
                let own = parameters.text("type")?.unwrap_or("diffuse").to_owned();
                let material = self.material(&own, parameters)?;
                let index = self.push_material(material);
                self.named_materials.insert(kind, index);
                Ok(())
            }
            "LightSource" => self.light(&kind, parameters),
            "AreaLightSource" if kind == "diffuse" => {
                self.state.area_light = Some(parameters.clone());
                Ok(())
            }
            "MakeNamedMedium" => self.medium(&kind, parameters),
            _ => Err(parameters.unsupported("it is not supported")),
        }
    }

    fn push_material(&mut self, material: Material) -> u32 {
        self.description.materials.push(material);
        self.description.materials.len() as u32 - 1
    }

    /// What is known only at the end: camera and light.
    fn finish(&mut self, path: &Path) -> Result<(), ImportError> {
        let location = Location::file(path);
        if !self.stack.is_empty() {
            return Err(ImportError::malformed(
                location,
                "an attribute or object does not end",
            ));
        }
        match self.camera.take() {
            Some((parameters, to_world)) => self.view(&parameters, &to_world)?,
            None => {
                fit::camera(&mut self.description);
                self.view_is_chosen = true;
                let message = "no camera: it looks at the whole scene".to_owned();
                Warning::push(&mut self.warnings, location.clone(), message);
            }
        }
        if fit::light(&mut self.description) {
            let message = format!("no light in the scene: {}", fit::STUDIO);
            Warning::push(&mut self.warnings, location, message);
        }
        Ok(())
    }
}

/// A directive and where it stands.
struct Directive<'a> {
    name: &'a str,
    path: &'a Path,
    line: u32,
}

impl Directive<'_> {
    fn location(&self) -> Location {
        Location::line(self.path, self.line).element(self.name)
    }

    fn malformed(&self, message: impl Into<String>) -> ImportError {
        ImportError::malformed(self.location(), message)
    }

    fn unsupported(&self, message: impl Into<String>) -> ImportError {
        ImportError::unsupported(self.location(), message)
    }

    /// The next token, in quotes.
    fn text<'t>(&self, rest: &mut &'t [Token]) -> Result<&'t str, ImportError> {
        match *rest {
            [
                Token {
                    word: Word::Quoted(text),
                    ..
                },
                after @ ..,
            ] => {
                *rest = after;
                Ok(text)
            }
            _ => Err(self.malformed("expected a name in quotes")),
        }
    }

    /// The next `N` tokens as numbers, in brackets or not.
    fn numbers<const N: usize>(&self, rest: &mut &[Token]) -> Result<[f64; N], ImportError> {
        let wrong = || self.malformed(format!("expected {N} finite numbers"));
        let bracketed = matches!(rest, [Token { word: Word::Open, .. }, ..]);
        let list = &rest[usize::from(bracketed)..];
        let found = list.get(..N).ok_or_else(wrong)?;
        let mut numbers = [0.0; N];
        for (value, token) in numbers.iter_mut().zip(found) {
            *value = number(token).ok_or_else(wrong)?;
        }
        *rest = &list[N..];
        if bracketed {
            match *rest {
                [
                    Token {
                        word: Word::Close, ..
                    },
                    after @ ..,
                ] => *rest = after,
                _ => return Err(wrong()),
            }
        }
        Ok(numbers)
    }

    /// The map of a transform directive.
    fn transform(&self, rest: &mut &[Token]) -> Result<DAffine3, ImportError> {
        Ok(match self.name {
            "Translate" => DAffine3::from_translation(DVec3::from_array(self.numbers(rest)?)),
            "Scale" => DAffine3::from_scale(DVec3::from_array(self.numbers(rest)?)),
            "Rotate" => {
                let [degrees, x, y, z] = self.numbers(rest)?;
                let axis = DVec3::new(x, y, z).try_normalize();
                let axis = axis.ok_or_else(|| self.malformed("the axis of rotation has no length"))?;
                DAffine3::from_axis_angle(axis, degrees.to_radians())
            }
            "LookAt" => {
                let [ex, ey, ez, lx, ly, lz, ux, uy, uz] = self.numbers(rest)?;
                let (eye, look) = (DVec3::new(ex, ey, ez), DVec3::new(lx, ly, lz));
                let wrong = || self.malformed("`up` is parallel to the view, or eye and target coincide");
                let forward = (look - eye).try_normalize().ok_or_else(wrong)?;
                let right = DVec3::new(ux, uy, uz)
                    .cross(forward)
                    .try_normalize()
                    .ok_or_else(wrong)?;
                let axes = DMat3::from_cols(right, forward.cross(right), forward);
                DAffine3::from_mat3_translation(axes, eye).inverse()
            }
            _ => {
                // Column by column.
                let m: [f64; 16] = self.numbers(rest)?;
                if [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0] {
                    return Err(self.malformed("the last row of a matrix must be 0 0 0 1"));
                }
                let column = |index: usize| DVec3::new(m[index], m[index + 1], m[index + 2]);
                DAffine3::from_mat3_translation(DMat3::from_cols(column(0), column(4), column(8)), column(12))
            }
        })
    }
}

#[cfg(test)]
mod tests;
