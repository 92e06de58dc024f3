//! References that grow until their noise is small beside what they judge.

use crate::arguments::Arguments;
use crate::blocks::{Blocks, Place, mixed};
use lightshed::film::{Progress, RgbImage};
use lightshed::integrator::{Method, Stage};
use lightshed::scene::SceneDescription;
use lightshed_evaluate::{EvaluateError, Reference};
use std::error::Error;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::atomic::AtomicBool;

/// Samples that a reference starts with if it may grow.
const FIRST: u32 = 1024;

/// Samples of the plain method at which a second one goes on.
const ENOUGH: u32 = 4096;

/// Share of an error that the reference's own may be.
const SHARE: f64 = 0.1;

/// Probability of a difference of two methods below which they do not estimate the same.
const DIFFERENT: f64 = 1e-4;

/// More lamps than this are chosen by a tree.
const FEW_LAMPS: usize = 8;

/// A reference of two independent halves that can double its samples: those of the plain method,
/// and from [`ENOUGH`] on those of another, if there is one that is faster. Each weighs as much as
/// its noise allows, and the plain one's means test the other's.
pub struct Growing<'a, 's> {
    stage: &'a Stage<'s>,
    place: Place<'a>,
    plain: Blocks<'a, 's>,
    faster: Option<Blocks<'a, 's>>,
    /// Why a faster method was left out.
    refused: Option<String>,
    limit: u32,
}

/// The method of a reference: the plain one, with a tree for the choice among many lamps.
fn method(arguments: &Arguments, description: &SceneDescription) -> Result<Method, Box<dyn Error>> {
    let lamps = description
        .shapes
        .iter()
        .filter(|shape| shape.emission.is_some())
        .count();
    Ok(match &arguments.reference_method {
        Some(method) => method.clone(),
        None if !description.media.is_empty() => "volpath".parse()?,
        None if lamps + description.emitters.len() > FEW_LAMPS => "path:bvh".parse()?,
        None => "path".parse()?,
    })
}

impl<'a, 's> Growing<'a, 's> {
    /// Of a scene called `name`, with the first samples.
    pub fn new(
        arguments: &Arguments,
        (name, description): (&str, &SceneDescription),
        stage: &'a Stage<'s>,
        observer: &'a (dyn Fn(&Progress) + Sync),
        cancel: &'a AtomicBool,
    ) -> Result<Self, Box<dyn Error>> {
        let settings = stage.scene().settings();
        let mut key = DefaultHasher::new();
        (description.fingerprint(), settings.width, settings.height).hash(&mut key);
        fs::create_dir_all(&arguments.references)?;
        let place = Place {
            stem: arguments.references.join(name),
            key: key.finish(),
            observer,
            cancel,
        };
        let mut plain = Blocks::new(method(arguments, description)?, stage, place.clone())?;
        plain.add(arguments.reference_spp.unwrap_or(FIRST).div_ceil(2))?;
        let limit = match arguments.reference_spp {
            Some(_) => 0,
            None => arguments.reference_limit,
        };
        Ok(Self {
            stage,
            place,
            plain,
            faster: None,
            refused: None,
            limit,
        })
    }

    /// Whether it may have more samples.
    pub fn may_grow(&self) -> bool {
        let samples = self.faster.as_ref().map_or(self.plain.samples, |own| own.samples);
        samples.saturating_mul(2) <= self.limit
    }

    /// As it is now.
    pub fn reference(&self) -> Result<Reference, Box<dyn Error>> {
        let halves = match &self.faster {
            Some(faster) => together(&self.plain, faster)?,
            None => self.plain.halves()?.clone(),
        };
        Ok(Reference::of_halves(halves)?)
    }

    /// Doubles its samples until its noise is a tenth of `error`, or they are as many as allowed;
    /// those of `faster`, where there are many of the plain method.
    pub fn grow_for(&mut self, error: f64, faster: Option<&Method>) -> Result<Reference, Box<dyn Error>> {
        loop {
            let reference = self.reference()?;
            let noise = reference.noise().unwrap_or(0.0);
            if noise <= SHARE * error || !self.may_grow() {
                return Ok(reference);
            }
            match (&mut self.faster, faster) {
                (Some(own), _) => own.double()?,
                (None, Some(method)) if self.plain.samples >= ENOUGH && self.refused.is_none() => {
                    let mut own = Blocks::new(method.clone(), self.stage, self.place.clone())?;
                    own.add(FIRST / 2)?;
                    self.faster = Some(own);
                }
                (None, _) => self.plain.double()?,
            }
            self.test()?;
        }
    }

    /// Leaves out a second method whose means are others.
    fn test(&mut self) -> Result<(), Box<dyn Error>> {
        let Some(faster) = &self.faster else {
            return Ok(());
        };
        let (p, different) = difference(&self.plain, faster)?;
        if different {
            self.refused = Some(format!(
                "{} has other means than {}: p = {p:.0e}",
                faster.method, self.plain.method
            ));
            self.faster = None;
        }
        Ok(())
    }

    /// Samples and methods, in words.
    pub fn about(&self) -> Result<String, Box<dyn Error>> {
        let Blocks { samples, method, .. } = &self.plain;
        let mut text = format!("{samples} samples of {method}");
        if let Some(faster) = &self.faster {
            let (p, _) = difference(&self.plain, faster)?;
            text += &format!(
                " and {} of {}, whose means agree (p = {p:.2})",
                faster.samples, faster.method
            );
        }
        if let Some(refused) = &self.refused {
            text += &format!("; {refused}");
        }
        Ok(text)
    }
}

/// Probability that the means of the image or of one of its tiles differ as much by chance, and
/// whether that is too small.
fn difference(plain: &Blocks<'_, '_>, faster: &Blocks<'_, '_>) -> Result<(f64, bool), EvaluateError> {
    let agreement = plain.means.compare(&faster.means)?;
    // Three colours, and what they make together.
    let whole = agreement.whole.iter().filter_map(|mean| mean.p_value());
    let whole = (4.0 * whole.fold(1.0, f64::min)).min(1.0);
    let tiles = agreement.worst_tile().map_or(1.0, |(_, _, p)| p);
    // The less probable of two.
    let p = (2.0 * whole.min(tiles)).min(1.0);
    Ok((p, p < DIFFERENT))
}

/// The halves of both, each method with a weight in inverse proportion to its noise.
fn together(plain: &Blocks<'_, '_>, faster: &Blocks<'_, '_>) -> Result<[RgbImage; 2], Box<dyn Error>> {
    let both = [plain.halves()?, faster.halves()?];
    let mut noise = [0.0; 2];
    for (noise, halves) in noise.iter_mut().zip(both) {
        *noise = Reference::of_halves(halves.clone())?.noise().unwrap_or(0.0);
    }
    let sum = noise[0] + noise[1];
    let weight = if sum > 0.0 { noise[0] / sum } else { 0.5 };
    let [[a, b], [c, d]] = both;
    Ok([mixed(a, c, weight as f32)?, mixed(b, d, weight as f32)?])
}
