//! What is compared if nothing else is asked for.

use crate::arguments::Arguments;
use lightshed::integrator::{Method, MethodRequest, PathDepth};
use lightshed::scene::{SceneDescription, builtin, import};
use std::error::Error;
use std::path::Path;

/// A scene, and methods to compare on it.
pub struct Subject {
    pub name: String,
    pub about: String,
    pub description: SceneDescription,
    pub methods: Vec<MethodRequest>,
}

impl Subject {
    /// The methods that are given, each as it is.
    pub fn given(&self) -> impl Iterator<Item = &Method> {
        self.methods.iter().filter_map(given)
    }
}

fn given(request: &MethodRequest) -> Option<&Method> {
    match request {
        MethodRequest::Method(method) => Some(method),
        MethodRequest::Auto(_) => None,
    }
}

/// Built-in scenes, what they show, methods of which the first is the baseline, and the longest
/// path.
const DEFAULT: [(&str, &str, &[&str], Option<u32>); 3] = [
    (
        "doorway",
        "A room lit through a door: path tracing against paths that pixels share.",
        &["path", "auto", "path-reuse", "restir-pt-offline", "restir-pt"],
        None,
    ),
    (
        "many-lights",
        "Direct light of many lamps: choosing them by power against choosing them for the point, and against reuse among frames.",
        &["direct", "auto", "direct:bvh", "lightcuts", "restir-di"],
        Some(2),
    ),
    (
        "cloud",
        "A cloud under a sky: path tracing through media against paths that pixels share, and that frames share.",
        &["volpath", "auto", "volpath-reuse", "restir-volume"],
        None,
    ),
];

/// As the arguments ask.
pub fn subjects(arguments: &Arguments) -> Result<Vec<Subject>, Box<dyn Error>> {
    let mut subjects = match &arguments.scene {
        Some(scene) => vec![asked_for(scene, arguments)?],
        None => DEFAULT
            .iter()
            .filter_map(|(name, about, methods, depth)| {
                let mut description = builtin::by_name(name)?;
                description.settings.max_depth = depth.or(description.settings.max_depth);
                Some(Subject {
                    name: (*name).to_owned(),
                    about: (*about).to_owned(),
                    description,
                    methods: methods.iter().filter_map(|name| name.parse().ok()).collect(),
                })
            })
            .collect(),
    };
    for subject in &mut subjects {
        let settings = &mut subject.description.settings;
        (settings.width, settings.height) = (arguments.size[0], arguments.size[1]);
        settings.max_depth = arguments.max_depth.or(settings.max_depth);
    }
    Ok(subjects)
}

fn asked_for(scene: &str, arguments: &Arguments) -> Result<Subject, Box<dyn Error>> {
    let (name, mut description) = match builtin::by_name(scene) {
        Some(description) => (scene.to_owned(), description),
        None => {
            let path = Path::new(scene);
            let stem = path.parent().and_then(Path::file_name).or(path.file_stem());
            let name = stem.map_or("scene".into(), |stem| stem.to_string_lossy().into_owned());
            (name, import::load(path, &[])?.description)
        }
    };
    let methods = if arguments.methods.is_empty() {
        ["path", "auto", "path-reuse", "restir-pt-offline"]
            .map(str::parse)
            .into_iter()
            .collect::<Result<_, _>>()?
    } else {
        arguments.methods.clone()
    };
    let methods: Vec<MethodRequest> = methods;
    if methods.first().and_then(given).is_none() {
        return Err("the baseline is a method, not auto".into());
    }
    let is_direct = |method: &Method| method.capabilities().depth == PathDepth::Direct;
    let direct = methods
        .iter()
        .filter_map(given)
        .filter(|method| is_direct(method))
        .count();
    // With paths of two edges the others have direct light alone, too.
    let is_mixed = direct != 0 && direct != methods.iter().filter_map(given).count();
    if is_mixed && arguments.max_depth != Some(2) {
        return Err("methods of direct light are only compared with others with --max-depth 2".into());
    }
    if direct != 0 {
        description.settings.max_depth = Some(2);
    }
    Ok(Subject {
        about: format!("{} against {}.", list(&methods[1..]), methods[0]),
        name,
        description,
        methods,
    })
}

fn list(methods: &[MethodRequest]) -> String {
    methods
        .iter()
        .map(MethodRequest::to_string)
        .collect::<Vec<_>>()
        .join(", ")
}
