//! The worst of many errors.

use crate::hostile_unit::hostile_unit_f32;
use lightshed::sampling::glam::Vec3;
use lightshed::sampling::{CounterRng, UniformSphere};

/// How errors are measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// `|found − truth|`.
    Absolute,
    /// `|found − truth| / |truth|`; truths that `f32` cannot hold are left out.
    Relative,
}

/// A function's worst error.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The crate.
    pub part: &'static str,
    /// The function.
    pub function: &'static str,
    /// What it was given.
    pub inputs: &'static str,
    /// How the error is measured.
    pub kind: Kind,
    /// The error.
    pub worst: f64,
}

impl Row {
    /// A line of the table.
    pub fn line(&self) -> String {
        let kind = match self.kind {
            Kind::Absolute => "absolute",
            Kind::Relative => "relative",
        };
        format!(
            "| `{}` | {} | {kind} | {:.1e} |",
            self.function, self.inputs, self.worst
        )
    }
}

/// Collects pairs of what was found and the truth.
pub struct Worst {
    row: Row,
}

impl Worst {
    pub fn new(part: &'static str, function: &'static str, inputs: &'static str, kind: Kind) -> Self {
        let worst = 0.0;
        Self {
            row: Row {
                part,
                function,
                inputs,
                kind,
                worst,
            },
        }
    }

    /// A value and the truth; a value that is not finite is infinitely wrong.
    pub fn add(&mut self, found: f64, truth: f64) {
        let error = match self.row.kind {
            _ if !found.is_finite() => f64::INFINITY,
            Kind::Absolute => (found - truth).abs(),
            Kind::Relative
                if truth.abs() < f64::from(f32::MIN_POSITIVE) || truth.abs() > f64::from(f32::MAX) =>
            {
                0.0
            }
            Kind::Relative => ((found - truth) / truth).abs(),
        };
        self.row.worst = self.row.worst.max(error);
    }

    /// What must be the same bits, or hold without exception: no error or an infinite one.
    pub fn exactly(&mut self, holds: bool) {
        self.add(if holds { 0.0 } else { f64::INFINITY }, 0.0);
    }

    /// The row that `fill` makes.
    pub fn row(
        part: &'static str,
        function: &'static str,
        inputs: &'static str,
        kind: Kind,
        fill: impl FnOnce(&mut Self),
    ) -> Row {
        let mut worst = Self::new(part, function, inputs, kind);
        fill(&mut worst);
        worst.done()
    }

    pub fn done(self) -> Row {
        self.row
    }
}

/// A unit direction.
pub fn direction(rng: &mut CounterRng) -> Vec3 {
    UniformSphere::sample(rng.next_2d())
}

/// Random numbers of a row; the same every time.
pub fn rng(salt: u32) -> CounterRng {
    CounterRng::new(0x7072_6563, salt, 0)
}

/// Pairs of hostile uniforms, then random ones.
pub fn squares(salt: u32) -> impl Iterator<Item = [f32; 2]> {
    let hostile = hostile_unit_f32().flat_map(|a| hostile_unit_f32().map(move |b| [a, b]));
    let mut rng = rng(salt);
    hostile.chain((0..200_000).map(move |_| rng.next_2d()))
}

/// Hostile uniforms, then random ones.
pub fn units(salt: u32) -> impl Iterator<Item = f32> {
    let mut rng = rng(salt);
    hostile_unit_f32().chain((0..200_000).map(move |_| rng.next_f32()))
}

/// A positive number whose logarithm is uniform between those of `low` and `high`.
pub fn log_uniform(rng: &mut CounterRng, low: f64, high: f64) -> f32 {
    (low * (high / low).powf(f64::from(rng.next_f32()))) as f32
}
