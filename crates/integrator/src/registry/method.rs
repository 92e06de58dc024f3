//! A method with values of its options.

use super::capabilities::{MethodCapabilities, PathDepth};
use super::entry::MethodEntry;
use super::error::MethodError;
use super::idle::idle_option;
use super::methods::{METHODS, PATH_REUSE, RESTIR_PT_OFFLINE};
use super::option::{MethodOption, MethodValues};
use super::options::CACHE_ALWAYS;
use super::stage::{Motion, Stage, Started};
use super::starts::{compared_short_look, path_reuse, short_look};
use crate::guided::GuideKind;
use crate::path::short::{LongPaths, ShortLook};
use crate::{AnyEmitters, OfflineSplit, PathReuse};
use std::fmt;
use std::str::FromStr;

/// A method of the registry with values of its options, by the text `name[:option=value]…`.
///
/// A value without a name belongs to the first option that accepts it, and the name of a switch
/// alone turns it on. Values are checked when they are set.
///
/// ```
/// use lightshed_integrator::Method;
/// let method: Method = "direct:bvh:light-samples=2".parse()?;
/// assert_eq!(method.to_string(), "direct:bvh:2");
/// assert!("direct:hybrid".parse::<Method>().is_err());
/// # Ok::<(), lightshed_integrator::MethodError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Method {
    entry: &'static MethodEntry,
    values: MethodValues,
}

impl Method {
    /// The method of this name, with no option given.
    ///
    /// # Errors
    /// [`MethodError::Unknown`].
    pub fn named(name: &str) -> Result<Self, MethodError> {
        let entry = METHODS.iter().find(|entry| entry.name == name);
        let entry = entry.ok_or_else(|| MethodError::Unknown(name.to_owned()))?;
        let values = MethodValues::default();
        Ok(Self { entry, values })
    }

    /// Sets an option. Setting it to its default is the same as not setting it.
    ///
    /// # Errors
    /// [`MethodError::Option`] if the method has no such option, or the option does not accept the
    /// value.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), MethodError> {
        let refused = |reason: String| MethodError::Option {
            method: self.entry.name,
            given: name.to_owned(),
            reason,
        };
        let option = self
            .entry
            .option(name)
            .ok_or_else(|| refused("there is no such option".to_owned()))?;
        (option.check)(value).map_err(refused)?;
        // Colons part the options of a method's text.
        self.values.set(option, &value.replace(':', "@"));
        Ok(())
    }

    /// The name.
    pub fn name(&self) -> &'static str {
        self.entry.name
    }

    /// Its entry in the registry.
    pub fn entry(&self) -> &'static MethodEntry {
        self.entry
    }

    /// Its capabilities. With a guide it makes frames that depend on earlier ones. With a cache it
    /// is biased, and its frames depend on earlier ones if the cache continues to learn. The device
    /// has no cache with split cells or records by direction. With decorrelated reuse or samples of
    /// direct light (but beside suffix reuse) the device does not support it, either; nor with
    /// guides, but for paths guided by `cdq` that train for some frames only. Of Markov chain
    /// mixtures it has spatial sets of one step.
    pub fn capabilities(&self) -> MethodCapabilities {
        let own = self.entry.capabilities;
        let own = MethodCapabilities {
            device: own.device
                && !self.values.is_decorrelated()
                && self.values.has_spatial_step()
                && self.values.has_supports_everywhere()
                && (self.values.direct_samples(0) == 0 || self.entry.reuses_suffixes()),
            ..own
        };
        let guided = self.values.guided_paths();
        // The device looks up in guides and caches what the host has learnt.
        let device = own.device
            && guided.as_ref().is_none_or(|guided| {
                !own.media && !own.frames && guided.kind == GuideKind::Quadtree && !guided.every_frame
            });
        if self.values.cache_rule().is_some() {
            let chain = self.values.is_on(&CACHE_ALWAYS);
            return MethodCapabilities {
                frames: true,
                chain,
                biased: true,
                device: device && self.values.cache_has_plain_cells(),
                ..own
            };
        }
        if guided.is_some() {
            return MethodCapabilities {
                frames: true,
                chain: true,
                device,
                ..own
            };
        }
        own
    }

    /// The options that were given, with their values.
    pub fn options(&self) -> impl Iterator<Item = (&'static MethodOption, &str)> {
        self.values.given()
    }

    /// MethodValues of its options.
    pub fn values(&self) -> &MethodValues {
        &self.values
    }

    /// The longest path in edges, where `asked` is asked for and `of_scene` is the scene's own;
    /// `None` without end.
    ///
    /// # Errors
    /// [`MethodError::Depth`] if paths of the method cannot be as long or short as is asked.
    pub fn max_depth(&self, asked: Option<u32>, of_scene: Option<u32>) -> Result<Option<u32>, MethodError> {
        let refused = |reason| MethodError::Depth {
            method: self.entry.name,
            reason,
        };
        match (self.entry.capabilities.depth, asked) {
            (PathDepth::Any, _) => Ok(asked.or(of_scene)),
            (PathDepth::Direct, None | Some(2)) => Ok(Some(2)),
            (PathDepth::Direct, Some(_)) => Err(refused("its paths have two edges".to_owned())),
            (PathDepth::Bounded { default, .. }, None) => Ok(Some(default)),
            (PathDepth::Bounded { least, .. }, Some(depth)) if depth < least => Err(refused(format!(
                "its paths need a longest one of {least} edges at least, not {depth}"
            ))),
            (PathDepth::Bounded { .. }, depth) => Ok(depth),
        }
    }

    /// Whether each given option has an effect beside the others.
    ///
    /// # Errors
    /// [`MethodError::Refused`] by the first that has none.
    pub fn check_options(&self) -> Result<(), MethodError> {
        match idle_option(&self.values) {
            Some(reason) => Err(MethodError::Refused {
                method: self.entry.name,
                reason,
            }),
            None => Ok(()),
        }
    }

    /// Makes the method ready, at its first frame.
    ///
    /// # Errors
    /// [`MethodError::Media`] or [`MethodError::Refused`] where scene or options do not allow it.
    pub fn start<'b>(&self, stage: &'b Stage<'_>, motion: Motion<'b>) -> Result<Started<'b>, MethodError> {
        self.check_start(stage)?;
        (self.entry.start)(stage, &self.values, motion).map_err(|reason| self.refused(reason))
    }

    /// Path reuse as itself, of which more can be asked than of any method; `None` of others.
    ///
    /// # Errors
    /// Those of [`Method::start`].
    pub(crate) fn start_path_reuse<'b, 'a>(
        &self,
        stage: &'b Stage<'a>,
    ) -> Result<Option<PathReuse<'b, &'b AnyEmitters<'a>>>, MethodError> {
        if self.entry.name != PATH_REUSE {
            return Ok(None);
        }
        self.check_start(stage)?;
        let started = path_reuse(stage, &self.values);
        started.map(Some).map_err(|reason| self.refused(reason))
    }

    /// What the method does beside short paths; `None` if it does not know them, or paths do not go
    /// as plain ones do.
    pub(crate) fn long_paths(&self, stage: &Stage<'_>) -> Option<LongPaths> {
        let values = &self.values;
        let is_plain = values.guided_paths().is_none() && values.cached_paths(stage.scene()).is_none();
        match self.entry.name {
            "path" if is_plain => Some(LongPaths::ALONE),
            PATH_REUSE => Some(LongPaths::SHARED),
            RESTIR_PT_OFFLINE if values.shares_paths() => Some(LongPaths::SHARED),
            _ => None,
        }
    }

    /// Frames in which pixels share paths, at most, in each frame of the method.
    pub(crate) fn shared_frames(&self) -> u32 {
        match self.entry.name {
            RESTIR_PT_OFFLINE if self.values.shares_paths() => OfflineSplit::ALL_SHARED.reuse_frames,
            _ => 1,
        }
    }

    /// What a pilot sees of short paths, with so many in each of its sets.
    ///
    /// # Errors
    /// Those of [`Method::start`].
    pub(crate) fn short_look(&self, stage: &Stage<'_>, of_set: usize) -> Result<ShortLook, MethodError> {
        self.check_start(stage)?;
        let look = short_look(stage, &self.values, of_set);
        look.map_err(|reason| self.refused(reason))
    }

    /// A look at paths with one emitter sample, with one beside it at this method's own where short
    /// paths may take their place.
    pub(crate) fn compared_short_look(
        &self,
        stage: &Stage<'_>,
        of_one: &ShortLook,
        long: LongPaths,
    ) -> Result<ShortLook, MethodError> {
        self.check_start(stage)?;
        let look = compared_short_look(stage, &self.values, of_one, long);
        look.map_err(|reason| self.refused(reason))
    }

    fn check_start(&self, stage: &Stage<'_>) -> Result<(), MethodError> {
        if !stage.scene().media().is_empty() && !self.entry.capabilities.media {
            return Err(MethodError::Media(self.entry.name));
        }
        self.check_options()
    }

    fn refused(&self, reason: String) -> MethodError {
        MethodError::Refused {
            method: self.entry.name,
            reason,
        }
    }

    /// The option that a value without a name is for.
    fn taker(&self, value: &str) -> Option<&'static MethodOption> {
        let mut options = self.entry.options.iter();
        options.find(|option| option.value.is_some() && (option.check)(value).is_ok())
    }
}

impl Default for Method {
    /// The plainest: the first of the registry.
    fn default() -> Self {
        let (entry, values) = (&METHODS[0], MethodValues::default());
        Self { entry, values }
    }
}

impl PartialEq for Method {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

impl Eq for Method {}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.entry.name)?;
        // In the entry's order, so that one method has one text.
        for option in self.entry.options {
            let given = self.values.given().find(|(given, _)| given.name == option.name);
            let Some((_, value)) = given.filter(|(_, value)| *value != option.default) else {
                continue;
            };
            match option.value {
                None => write!(f, ":{}", option.name)?,
                Some(_) if self.taker(value).is_some_and(|taker| taker.name == option.name) => {
                    write!(f, ":{value}")?
                }
                Some(_) => write!(f, ":{}={value}", option.name)?,
            }
        }
        Ok(())
    }
}

impl FromStr for Method {
    type Err = MethodError;

    fn from_str(text: &str) -> Result<Self, MethodError> {
        let mut parts = text.split(':');
        let mut method = Self::named(parts.next().unwrap_or_default())?;
        for part in parts {
            match part.split_once('=') {
                Some((name, value)) => method.set(name, value)?,
                None if method
                    .entry
                    .option(part)
                    .is_some_and(|option| option.value.is_none()) =>
                {
                    method.set(part, "true")?;
                }
                None => {
                    let option = method.taker(part).ok_or_else(|| MethodError::Option {
                        method: method.entry.name,
                        given: part.to_owned(),
                        reason: "no option accepts it".to_owned(),
                    })?;
                    method.set(option.name, part)?;
                }
            }
        }
        Ok(method)
    }
}
