//! What a crate makes public, as text that can be compared.
//!
//! A name is public if the crate's root, or a public module, defines it as `pub` or re-exports it.
//! Blocks list each such item with its fields, variants and functions, and each implementation of a
//! trait. Traits that the compiler implements by itself (`Send`, `Sync`, …) are not listed.

use crate::items::{Item, Kind, after_generics, attributes, closing, items, split};
use crate::modules::{ModulePath, Modules};
use crate::packages::Package;
use crate::scan::{mentions, tokens};
use crate::spacing::spaced;
use std::collections::{BTreeMap, BTreeSet};

/// A head and what belongs to it: a type and its fields, an implementation and its functions.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Block {
    /// The public name that it is about.
    pub about: String,
    /// First what an item is, then what is implemented for it.
    order: u8,
    /// The item or `impl`, without what is in its body.
    pub head: String,
    /// Public fields, variants, functions, associated types and constants.
    pub lines: BTreeSet<String>,
}

/// A public function or field, for tests of types in signatures.
pub struct Signature {
    /// `function`, `Type::function` or `Type::field`.
    pub name: String,
    /// Names and types of parameters; of a field, itself.
    pub parameters: Vec<(String, String)>,
    /// What it returns, if anything.
    pub result: Option<String>,
}

/// What a crate makes public.
pub struct Interface {
    /// In the order of the names that they are about.
    pub blocks: Vec<Block>,
    /// Of all public functions and fields.
    pub signatures: Vec<Signature>,
    /// Public names and the modules that define them.
    pub names: BTreeMap<String, ModulePath>,
}

/// Which names can be reached.
pub struct Reach {
    /// Names without a way to them.
    pub unreached: Vec<String>,
}

type Place = (ModulePath, String);

/// Items of the modules of a crate.
struct Crate {
    modules: Modules,
    items: BTreeMap<ModulePath, Vec<Item>>,
    /// Conditions of modules, those of the modules around them included.
    conditions: BTreeMap<ModulePath, Vec<String>>,
    /// Public paths.
    exported: BTreeMap<Place, String>,
    blocks: Vec<Block>,
    signatures: Vec<Signature>,
}

impl Interface {
    /// Reads what `package` makes public.
    pub fn of(package: &Package) -> Self {
        let modules = Modules::new(&package.sources);
        let parsed: BTreeMap<ModulePath, Vec<Item>> = modules
            .codes()
            .map(|(path, code)| (path.clone(), items(code)))
            .collect();
        let mut of = Crate {
            modules,
            conditions: conditions(&parsed),
            items: parsed,
            exported: BTreeMap::new(),
            blocks: Vec::new(),
            signatures: Vec::new(),
        };
        of.export(&Vec::new(), "", &[]);
        of.list_items();
        of.list_implementations();
        of.list_macros();
        let mut names = BTreeMap::new();
        for ((module, _), path) in &of.exported {
            names.insert(path.clone(), module.clone());
        }
        of.blocks.sort();
        of.blocks.dedup();
        Self {
            blocks: of.blocks,
            signatures: of.signatures,
            names,
        }
    }

    /// All of it, one line a head, and one line, indented, for what belongs to it.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for block in &self.blocks {
            text += &format!("{}\n", block.head);
            for line in &block.lines {
                text += &format!("    {line}\n");
            }
        }
        text
    }

    /// Which public names can be reached from `entry`, the words of a guide: those that it names,
    /// and those that the documentation or the signatures of a reached name's module name.
    pub fn reach(&self, package: &Package, entry: &str) -> Reach {
        let last = |path: &str| path.rsplit("::").next().unwrap().to_owned();
        let mut named: BTreeSet<String> = words(entry);
        let mut reached = BTreeSet::new();
        let texts = self.texts(package);
        loop {
            let before = reached.len();
            for (path, module) in &self.names {
                let own = path.split("::").next().unwrap();
                if reached.contains(path) || !(named.contains(&last(path)) || named.contains(own)) {
                    continue;
                }
                reached.insert(path.clone());
                named.extend(texts.get(module).into_iter().flat_map(|text| words(text)));
                let of_it = |block: &&Block| &block.about == path;
                for block in self.blocks.iter().filter(of_it) {
                    named.extend(words(&block.head));
                    named.extend(block.lines.iter().flat_map(|line| words(line)));
                }
            }
            if reached.len() == before {
                break;
            }
        }
        let unreached = self.names.keys().filter(|name| !reached.contains(*name));
        Reach {
            unreached: unreached.cloned().collect(),
        }
    }

    /// The documentation in each module.
    fn texts(&self, package: &Package) -> BTreeMap<ModulePath, String> {
        let mut texts = BTreeMap::new();
        for (file, text) in &package.sources {
            let documentation = text
                .lines()
                .map(str::trim_start)
                .filter(|line| line.starts_with("//"));
            let documentation: Vec<&str> = documentation.collect();
            texts.insert(Modules::path_of(file), documentation.join("\n"));
        }
        texts
    }
}

fn words(text: &str) -> BTreeSet<String> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_'))
        .filter(|word| !word.is_empty())
        .map(str::to_owned)
        .collect()
}

/// Conditions under which modules are there.
fn conditions(items: &BTreeMap<ModulePath, Vec<Item>>) -> BTreeMap<ModulePath, Vec<String>> {
    let mut conditions: BTreeMap<ModulePath, Vec<String>> = BTreeMap::new();
    // Parents are before their children.
    for (path, items) in items {
        let around = conditions.get(path).cloned().unwrap_or_default();
        for item in items.iter().filter(|item| item.kind == Kind::Module) {
            let child = [&path[..], std::slice::from_ref(&item.name)].concat();
            let own = item.conditions().cloned();
            conditions.insert(child, around.iter().cloned().chain(own).collect());
        }
    }
    conditions
}

impl Crate {
    /// The place of what `path` names in module `at`.
    fn resolve(&self, at: &ModulePath, path: &[String]) -> Option<Place> {
        let is_here = |item: &Item| {
            item.name == path[0] && !matches!(item.kind, Kind::Use | Kind::Module | Kind::Macro)
        };
        if path.is_empty() {
            return None;
        }
        if path.len() == 1 && self.items[at].iter().any(is_here) {
            return Some((at.clone(), path[0].clone()));
        }
        let (module, name) = self.modules.definition(at, path)?;
        // Without a name, a module; it may re-export a function of its own name.
        let name = name.or_else(|| module.last().cloned())?;
        let has_it = self.items.get(&module)?.iter().any(|item| item.name == name);
        has_it.then_some((module, name))
    }

    /// Finds what module `at` makes public under `prefix`.
    fn export(&mut self, at: &ModulePath, prefix: &str, around: &[String]) {
        for item in self.items[at].clone() {
            if !item.is_public {
                continue;
            }
            let conditions: Vec<String> = around.iter().chain(item.conditions()).cloned().collect();
            match item.kind {
                Kind::Module => {
                    let child = [&at[..], std::slice::from_ref(&item.name)].concat();
                    let path = format!("{prefix}{}", item.name);
                    self.add(&path, 0, &conditions, &format!("pub mod {path}"), BTreeSet::new());
                    if self.items.contains_key(&child) {
                        self.export(&child, &format!("{path}::"), &conditions);
                    }
                }
                Kind::Use => {
                    for mention in mentions(&spaced(&item.head)) {
                        let name = mention.name.clone().unwrap_or_default();
                        let path = format!("{prefix}{name}");
                        match self.resolve(at, &mention.path) {
                            Some(place) => {
                                self.exported.entry(place).or_insert(path);
                            }
                            None => {
                                let head = format!("pub use {} as {path}", mention.path.join("::"));
                                self.add(&path, 0, &conditions, &head, BTreeSet::new());
                            }
                        }
                    }
                }
                Kind::Impl | Kind::Macro | Kind::Invocation => (),
                _ => {
                    let path = format!("{prefix}{}", item.name);
                    self.exported.insert((at.clone(), item.name.clone()), path);
                }
            }
        }
    }

    fn add(&mut self, about: &str, order: u8, conditions: &[String], head: &str, lines: BTreeSet<String>) {
        let conditions: String = conditions.iter().map(|text| format!("{text} ")).collect();
        self.blocks.push(Block {
            about: about.to_owned(),
            order,
            head: conditions + head,
            lines,
        });
    }

    fn conditions_of(&self, module: &ModulePath) -> Vec<String> {
        self.conditions.get(module).cloned().unwrap_or_default()
    }

    /// Lists what items are.
    fn list_items(&mut self) {
        for ((module, name), path) in self.exported.clone() {
            let found: Vec<Item> = self.items[&module]
                .iter()
                .filter(|item| item.name == name && !matches!(item.kind, Kind::Invocation | Kind::Macro))
                .cloned()
                .collect();
            let conditions = self.conditions_of(&module);
            for item in found {
                let lines = match item.kind {
                    Kind::Struct | Kind::Union => self.fields(&item, &path),
                    Kind::Enum => variants(&item),
                    Kind::Trait => self.members(&item, &path, true),
                    _ => BTreeSet::new(),
                };
                if item.kind == Kind::Function {
                    self.signatures.push(signature(&item, &path));
                }
                let head = item.text().replacen(&format!(" {name}"), &format!(" {path}"), 1);
                self.add(&path, 0, &conditions, &head, lines);
            }
        }
    }

    /// Public fields, and whether there are others.
    fn fields(&mut self, item: &Item, path: &str) -> BTreeSet<String> {
        let Some(body) = &item.body else {
            return BTreeSet::new();
        };
        let mut body: Vec<&str> = body.iter().map(String::as_str).collect();
        let is_tuple = body.first() == Some(&"(");
        if is_tuple {
            body = body[1..body.len() - 1].to_vec();
        }
        let mut lines = BTreeSet::new();
        for (index, field) in split(&body, ",").into_iter().enumerate() {
            let (seen, length) = attributes(&field);
            let rest = &field[length..];
            if rest.first() != Some(&"pub") || rest.get(1) == Some(&"(") && is_restricted(rest) {
                lines.insert("(private fields)".to_owned());
                continue;
            }
            let text = spaced(&rest[1..]);
            let seen: String = seen.iter().map(|text| format!("{text} ")).collect();
            let (name, of) = match is_tuple {
                true => (index.to_string(), text.clone()),
                false => text
                    .split_once(": ")
                    .map(|(a, b)| (a.to_owned(), b.to_owned()))
                    .unwrap(),
            };
            lines.insert(format!("{seen}pub {name}: {of}"));
            self.signatures.push(Signature {
                name: format!("{path}::{name}"),
                parameters: vec![(name, of)],
                result: None,
            });
        }
        lines
    }

    /// Functions, types and constants in the body of a trait or an implementation.
    fn members(&mut self, item: &Item, path: &str, all: bool) -> BTreeSet<String> {
        let mut lines = BTreeSet::new();
        for member in item.items() {
            if !(all || member.is_public) {
                continue;
            }
            let provided = if all && member.kind == Kind::Function && member.body.is_some() {
                " (provided)"
            } else {
                ""
            };
            lines.insert(member.text() + provided);
            if member.kind == Kind::Function {
                self.signatures
                    .push(signature(&member, &format!("{path}::{}", member.name)));
            }
        }
        lines
    }

    /// Lists implementations for what is public.
    fn list_implementations(&mut self) {
        for (module, items) in self.items.clone() {
            let around = self.conditions_of(&module);
            for item in items.iter().filter(|item| item.kind == Kind::Impl) {
                let head: Vec<&str> = item.head.iter().map(String::as_str).collect();
                let (of_trait, of_type) = implemented(&head);
                let find = |path: &[String]| {
                    let place = self.resolve(&module, path)?;
                    Some(self.exported.get(&place).cloned())
                };
                // Outside the crate, or generic: listed, as long as the trait is not private.
                let about = match find(&of_type) {
                    Some(Some(path)) => path,
                    Some(None) => continue,
                    None => of_type.join("::"),
                };
                match of_trait {
                    None => {
                        let lines = self.members(item, &about, false);
                        if !lines.is_empty() {
                            self.add(&about, 1, &around, &item.text(), lines);
                        }
                    }
                    Some(of_trait) => {
                        if find(&of_trait) == Some(None) {
                            continue;
                        }
                        let types = item.items().into_iter().filter(|item| item.kind == Kind::Alias);
                        let lines = types.map(|item| item.text()).collect();
                        self.add(&about, 2, &around, &item.text(), lines);
                    }
                }
            }
        }
    }

    /// Lists items that macros make, as they stand in the macro, and where these are called.
    fn list_macros(&mut self) {
        let mut making = BTreeSet::new();
        for (module, items) in self.items.clone() {
            for item in items.iter().filter(|item| item.kind == Kind::Macro) {
                let made = items_of_macro(item);
                let defines = made.iter().any(|item| item.is_public && item.kind != Kind::Impl);
                let is_seen = |made: &&Item| match made.kind {
                    Kind::Impl => {
                        let head: Vec<&str> = made.head.iter().map(String::as_str).collect();
                        match implemented(&head) {
                            (None, _) => defines,
                            (Some(of_trait), _) => {
                                let place = self.resolve(&module, &of_trait);
                                place.is_none_or(|place| self.exported.contains_key(&place))
                            }
                        }
                    }
                    _ => made.is_public,
                };
                let lines: BTreeSet<String> = made.iter().filter(is_seen).map(Item::text).collect();
                if !lines.is_empty() {
                    making.insert(item.name.clone());
                    self.add("", 3, &[], &format!("macro_rules! {}", item.name), lines);
                }
            }
        }
        for items in self.items.clone().into_values() {
            let calls = |item: &&Item| item.kind == Kind::Invocation && making.contains(&item.name);
            for item in items.iter().filter(calls) {
                let body = spaced(item.body.as_deref().unwrap_or_default());
                self.add("", 4, &[], &format!("{}!({body})", item.name), BTreeSet::new());
            }
        }
    }
}

/// The items in the arms of a macro.
fn items_of_macro(item: &Item) -> Vec<Item> {
    let body: Vec<&str> = item.body.iter().flatten().map(String::as_str).collect();
    let (mut made, mut at) = (Vec::new(), 0);
    while at < body.len() {
        let close = if matches!(body[at], "(" | "[" | "{") {
            closing(&body, at)
        } else {
            at
        };
        if at >= 2 && body[at - 2..at] == ["=", ">"] && close > at {
            made.extend(items(&body[at + 1..close].join(" ")));
        }
        at = close + 1;
    }
    made
}

/// Whether `pub (` restricts the field that it is in front of: a tuple type is no restriction.
fn is_restricted(field: &[&str]) -> bool {
    matches!(field[2], "crate" | "super" | "self" | "in")
}

fn variants(item: &Item) -> BTreeSet<String> {
    let body: Vec<&str> = item.body.iter().flatten().map(String::as_str).collect();
    let variant = |tokens: Vec<&str>| {
        let mut kept: Vec<&str> = Vec::new();
        let mut at = 0;
        // Fields have attributes, too.
        while at < tokens.len() {
            let (_, length) = attributes(&tokens[at..]);
            at += length;
            kept.extend(tokens.get(at));
            at += 1;
        }
        spaced(&kept)
    };
    split(&body, ",").into_iter().map(variant).collect()
}

/// The trait, if any, and the type of the head of an `impl`, as paths without arguments.
fn implemented(head: &[&str]) -> (Option<Vec<String>>, Vec<String>) {
    let start = after_generics(head, 1);
    let (mut depth, mut between, mut end) = (0, None, head.len());
    for (at, token) in head.iter().enumerate().skip(start) {
        match *token {
            "<" | "(" | "[" => depth += 1,
            ")" | "]" => depth -= 1,
            ">" if !matches!(head[at - 1], "-" | "=") => depth -= 1,
            "for" if depth == 0 && between.is_none() => between = Some(at),
            "where" if depth == 0 => end = end.min(at),
            _ => (),
        }
    }
    let path = |tokens: &[&str]| -> Vec<String> {
        // A reference to a type, and the like, counts as that type.
        let is_around = |at: usize| {
            matches!(tokens[at], "&" | "mut" | "dyn" | "[" | "(" | "!" | "'")
                || at > 0 && tokens[at - 1] == "'"
        };
        let from = (0..tokens.len()).find(|&at| !is_around(at)).unwrap_or(0);
        let words = tokens[from..]
            .iter()
            .take_while(|token| **token == "::" || is_word(token));
        words
            .filter(|token| **token != "::")
            .map(|&token| token.to_owned())
            .collect()
    };
    match between {
        Some(at) => (Some(path(&head[start..at])), path(&head[at + 1..end])),
        None => (None, path(&head[start..end])),
    }
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphanumeric() || c == '_')
}

/// Parameters and result of a function.
fn signature(item: &Item, name: &str) -> Signature {
    let text = spaced(&item.head);
    let head = tokens(&text);
    let name_at = head.iter().position(|token| *token == "fn").unwrap_or(0) + 1;
    let open = after_generics(&head, name_at + 1);
    let close = closing(&head, open);
    let parameters = split(&head[open + 1..close], ",")
        .into_iter()
        .filter_map(|parameter| {
            let at = parameter.iter().position(|token| *token == ":")?;
            Some((spaced(&parameter[..at]), spaced(&parameter[at + 1..])))
        })
        .collect();
    let rest = &head[close + 1..];
    let end = rest
        .iter()
        .position(|token| *token == "where")
        .unwrap_or(rest.len());
    let result = rest[..end]
        .get(2..)
        .filter(|result| !result.is_empty())
        .map(spaced);
    Signature {
        name: name.to_owned(),
        parameters,
        result,
    }
}
