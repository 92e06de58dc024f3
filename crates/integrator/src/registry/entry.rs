//! An entry of the registry.

use super::capabilities::MethodCapabilities;
use super::option::{MethodOption, MethodValues};
use super::options::PREFIXES;
use super::stage::{Motion, Stage, Started};

/// Prepares a method: for a scene, by values of its options, with its motion. `Err` says why not.
pub type StartMethod = for<'a, 'b> fn(
    stage: &'b Stage<'a>,
    values: &MethodValues,
    motion: Motion<'b>,
) -> Result<Started<'b>, String>;

/// The complete description of a method.
#[derive(Clone, Copy, Debug)]
pub struct MethodEntry {
    /// The name by which it is asked for.
    pub name: &'static str,
    /// What it estimates and how, in a sentence.
    pub help: &'static str,
    /// What it can do.
    pub capabilities: MethodCapabilities,
    /// The options that it takes. A value without a name belongs to the first that accepts it.
    pub options: &'static [MethodOption],
    /// Makes it ready.
    pub start: StartMethod,
}

impl MethodEntry {
    /// The option of this name.
    pub fn option(&self, name: &str) -> Option<&'static MethodOption> {
        self.options.iter().find(|option| option.name == name)
    }

    /// Whether it reuses what is behind prefixes.
    pub(super) fn reuses_suffixes(&self) -> bool {
        self.option(PREFIXES.name).is_some()
    }
}
