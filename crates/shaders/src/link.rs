//! Linking: from modules with imports to one text of plain WGSL.

use crate::MODULES;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use wesl::syntax::GlobalDeclaration;
use wesl::{CompileOptions, EscapeMangler, Feature, Features, ModulePath, VirtualResolver, compile};

/// Puts [`MODULES`] and a program's own modules together.
///
/// The modules of this crate are in `package::lightshed`, the program's where it says;
/// `package::host` has the functions that they call.
///
/// ```
/// use lightshed_shaders::Linker;
///
/// let wgsl = Linker::new()
///     .module("package::main", "
///         import package::lightshed::rng::random_word;
///         import package::lightshed::uniform::f32_from_u32;
///
///         @group(0) @binding(0) var<storage, read_write> numbers: array<f32>;
///
///         @compute @workgroup_size(64)
///         fn main(@builtin(global_invocation_id) id: vec3u) {
///             numbers[id.x] = f32_from_u32(random_word(vec2u(1u, 0u), id.x, 0u, 0u));
///         }")
///     .link("package::main")?;
/// assert!(wgsl.contains("fn main("));
/// # Ok::<(), lightshed_shaders::LinkError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Linker<'a> {
    modules: Vec<(String, Cow<'a, str>)>,
    features: BTreeMap<String, bool>,
    keep: bool,
}

/// Why modules could not be linked, in the linker's words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkError {
    message: String,
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "shader modules could not be linked: {}", self.message)
    }
}

impl std::error::Error for LinkError {}

impl LinkError {
    fn new(error: impl fmt::Display) -> Self {
        Self {
            message: without_escapes(&error.to_string()),
        }
    }
}

/// The text without the escape sequences (`ESC [ … m`) that the linker uses to colour it in a
/// terminal.
fn without_escapes(text: &str) -> String {
    let mut parts = text.split('\u{1b}');
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| c.is_ascii_alphabetic());
        plain += end.map_or("", |end| &part[end + 1..]);
    }
    plain
}

#[test]
fn messages_have_no_escapes() {
    assert_eq!(without_escapes("a \u{1b}[1;31mred\u{1b}[0m word"), "a red word");
    let error = Linker::new()
        .module("package::main", "fn main( {")
        .link("package::main");
    let message = error.unwrap_err().to_string();
    assert!(!message.contains('\u{1b}'), "{message:?}");
}

impl<'a> Linker<'a> {
    /// The modules of this crate alone.
    pub fn new() -> Self {
        Self::default()
    }

    /// With a module of the program; `path` is absolute, as in `package::host`.
    #[must_use]
    pub fn module(mut self, path: &str, wesl: impl Into<Cow<'a, str>>) -> Self {
        self.modules.push((path.to_owned(), wesl.into()));
        self
    }

    /// Switches a feature on or off: the code behind `@if(name)`. Features that are not named are
    /// off.
    #[must_use]
    pub fn feature(mut self, name: &str, on: bool) -> Self {
        self.features.insert(name.to_owned(), on);
        self
    }

    /// With all declarations of the module that is linked, also those that no entry point needs.
    #[must_use]
    pub fn keep_all(mut self) -> Self {
        self.keep = true;
        self
    }

    /// Plain WGSL of the module at `root` and of everything it needs. Its own declarations keep
    /// their names, others get the path of their module in front.
    ///
    /// # Errors
    ///
    /// [`LinkError`]: a module or an item that is not there, or a text that is no WESL.
    pub fn link(&self, root: &str) -> Result<String, LinkError> {
        let mut resolver = VirtualResolver::new();
        for module in MODULES {
            let path = format!("package::lightshed::{}", module.name);
            resolver.add_module(parsed(&path)?, module.wesl.into());
        }
        for (path, text) in &self.modules {
            resolver.add_module(parsed(path)?, Cow::Borrowed(text));
        }
        let flags = self
            .features
            .iter()
            .map(|(name, &on)| (name.clone(), Feature::from(on)))
            .collect();
        let options = CompileOptions {
            validate: false,
            keep_root: self.keep,
            features: Features {
                default: Feature::Disable,
                flags,
            },
            ..CompileOptions::default()
        };
        let mut linked =
            compile(&parsed(root)?, &resolver, &EscapeMangler, &options).map_err(LinkError::new)?;
        // Modules come in an order that changes from run to run; the meaning of a text does not
        // depend on it.
        linked
            .syntax
            .global_declarations
            .sort_by_cached_key(|declaration| {
                let name = name_of(declaration);
                // The root's own declarations have no path in their names; they stay first and in
                // their order.
                if name.starts_with("package_") {
                    name
                } else {
                    String::new()
                }
            });
        Ok(linked.to_string())
    }
}

fn name_of(declaration: &GlobalDeclaration) -> String {
    let ident = match declaration {
        GlobalDeclaration::Declaration(declaration) => &declaration.ident,
        GlobalDeclaration::TypeAlias(alias) => &alias.ident,
        GlobalDeclaration::Struct(structure) => &structure.ident,
        GlobalDeclaration::Function(function) => &function.ident,
        GlobalDeclaration::Void | GlobalDeclaration::ConstAssert(_) => return String::new(),
    };
    ident.name().clone()
}

fn parsed(path: &str) -> Result<ModulePath, LinkError> {
    path.parse()
        .map_err(|_| LinkError::new(format_args!("{path} is no path of a module")))
}
