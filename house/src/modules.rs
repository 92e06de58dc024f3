//! The modules of a crate and the arrows between them.

use crate::scan::{Mention, mentions, without_comments, without_tests};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The names of a module from the crate's root on.
pub type ModulePath = Vec<String>;

/// A module that has a file.
struct Module {
    /// Its source without comments, literals and tests.
    code: String,
    mentions: Vec<Mention>,
}

/// The modules of a crate that are files, without tests.
pub struct Modules(BTreeMap<ModulePath, Module>);

impl Modules {
    /// Reads the modules from files below `src` and their texts.
    pub fn new(sources: &[(PathBuf, String)]) -> Self {
        let mut modules = BTreeMap::new();
        let mut tests = BTreeSet::new();
        for (file, text) in sources {
            let path = Self::path_of(file);
            let (code, test_modules) = without_tests(&without_comments(text));
            tests.extend(
                test_modules
                    .into_iter()
                    .map(|name| [path.clone(), vec![name]].concat()),
            );
            let mentions = mentions(&code);
            modules.insert(path, Module { code, mentions });
        }
        modules.retain(|path: &ModulePath, _| !tests.iter().any(|test| path.starts_with(test)));
        Self(modules)
    }

    /// The module that a file below `src` is.
    pub fn path_of(file: &Path) -> ModulePath {
        let mut path: ModulePath = file
            .with_extension("")
            .iter()
            .map(|part| part.to_str().unwrap().to_owned())
            .collect();
        if path.last().is_some_and(|last| last == "mod" || last == "lib") {
            path.pop();
        }
        path
    }

    /// Each module's code.
    pub fn codes(&self) -> impl Iterator<Item = (&ModulePath, &str)> {
        self.0.iter().map(|(path, module)| (path, module.code.as_str()))
    }

    /// The module that defines what `path` names when it stands in module `at`, and the item's name
    /// there; no name if it is the module itself, and `None` outside the crate.
    pub fn definition(&self, at: &[String], path: &[String]) -> Option<(ModulePath, Option<String>)> {
        self.follow(at, path, &mut BTreeSet::new())
    }

    fn follow(
        &self,
        at: &[String],
        path: &[String],
        visited: &mut BTreeSet<(ModulePath, String)>,
    ) -> Option<(ModulePath, Option<String>)> {
        let (first, mut rest) = path.split_first()?;
        let mut module = match first.as_str() {
            "crate" => Vec::new(),
            "self" => at.to_vec(),
            "super" => at.split_last()?.1.to_vec(),
            _ => {
                rest = path;
                let is_known = self.0.contains_key(&[at, &path[..1]].concat())
                    || self.0[at]
                        .mentions
                        .iter()
                        .any(|mention| mention.name.as_ref() == Some(first));
                is_known.then(|| at.to_vec())?
            }
        };
        while let Some((name, after)) = rest.split_first() {
            if name == "super" {
                module.pop()?;
            } else {
                let child = [&module[..], std::slice::from_ref(name)].concat();
                if self.0.contains_key(&child) {
                    module = child;
                } else {
                    // Defined here, or known here by a `use`.
                    let of_name = |mention: &&Mention| mention.name.as_ref() == Some(name);
                    let used = self.0.get(&module)?.mentions.iter().find(of_name);
                    let Some(used) = used.filter(|_| visited.insert((module.clone(), name.clone()))) else {
                        return Some((module, Some(name.clone())));
                    };
                    let path = [&used.path[..], after].concat();
                    return self.follow(&module, &path, visited);
                }
            }
            rest = after;
        }
        Some((module, None))
    }

    /// Arrows between siblings at every level, by parent.
    fn arrows(&self) -> BTreeMap<ModulePath, Siblings> {
        let mut arrows: BTreeMap<ModulePath, Siblings> = BTreeMap::new();
        for (from, module) in &self.0 {
            for mention in &module.mentions {
                let Some((to, _)) = self.definition(from, &mention.path) else {
                    continue;
                };
                let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
                if common < from.len() && common < to.len() {
                    let level = arrows.entry(from[..common].to_vec()).or_default();
                    let reason = format!("{} names {}", from.join("::"), mention.path.join("::"));
                    let reasons = level.entry(from[common].clone()).or_default();
                    reasons.entry(to[common].clone()).or_insert(reason);
                }
            }
        }
        arrows
    }

    /// For each sibling that reaches itself and is on no circle before, a shortest one.
    pub fn circles(&self) -> Vec<Circle> {
        let mut circles = Vec::new();
        for (parent, siblings) in self.arrows() {
            let mut seen = BTreeSet::new();
            for start in siblings.keys() {
                if seen.contains(start) {
                    continue;
                }
                if let Some(way) = shortest_circle(&siblings, start) {
                    seen.extend(way.iter().cloned());
                    let ends = way.iter().zip(way.iter().cycle().skip(1));
                    let reasons = ends.map(|(from, to)| siblings[from][to].clone()).collect();
                    let full = |name: &String| [&parent[..], std::slice::from_ref(name)].concat().join("::");
                    let modules = way.iter().map(full).collect();
                    circles.push(Circle { modules, reasons });
                }
            }
        }
        circles
    }
}

/// Arrows between modules of one parent: from, to, and where one stands.
type Siblings = BTreeMap<String, BTreeMap<String, String>>;

/// Modules that name each other in turn.
pub struct Circle {
    modules: Vec<String>,
    /// Where each arrow stands.
    pub reasons: Vec<String>,
}

impl Circle {
    /// `a → b → a`.
    pub fn names(&self) -> String {
        let names = self.modules.iter().chain(self.modules.first());
        names.cloned().collect::<Vec<_>>().join(" → ")
    }
}

/// The names on a shortest way from `start` back to it.
fn shortest_circle(arrows: &Siblings, start: &String) -> Option<Vec<String>> {
    let mut ways = vec![vec![start.clone()]];
    let mut reached = BTreeSet::new();
    let mut next = 0;
    while next < ways.len() {
        let way = ways[next].clone();
        next += 1;
        for to in arrows.get(way.last()?).into_iter().flat_map(BTreeMap::keys) {
            if to == start {
                return Some(way);
            }
            if reached.insert(to.clone()) {
                ways.push([&way[..], std::slice::from_ref(to)].concat());
            }
        }
    }
    None
}
