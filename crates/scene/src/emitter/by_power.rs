//! Selection of emitters by power, independent of the point that they light.

use super::area::AreaEmitter;
use super::{EmitterConnection, EmitterEndpoint, EmitterSample, Emitters, EnvironmentChoice, SkySampling};
use crate::{FlatDelta, FlatEmitter, SceneError, SurfacePoint};
use glam::Vec3;
use lightshed_sampling::{AliasEntry, AliasTable, Density, SolidAngle};

/// The data by which [`EmittersByPower`] selects.
pub struct PowerTable {
    /// Emitters `0 ..` by index, chosen with their probability.
    areas: Vec<AreaEmitter>,
    /// Over all finite emitters; `None` where there are none.
    finite: Option<AliasTable>,
    /// Emitters at infinity, and one more if there are finite ones.
    groups: u32,
    /// One over `groups`.
    group_probability: f32,
}

impl PowerTable {
    pub fn new(emitters: &Emitters) -> Result<Self, SceneError> {
        let power: Vec<f64> = emitters.power().collect();
        let finite = power
            .iter()
            .any(|&p| p > 0.0)
            .then(|| AliasTable::new(&power))
            .transpose()
            .map_err(|_| SceneError::Emitter {
                emitter: "all emitters".to_owned(),
                reason: "their power overflows",
            })?;
        let groups = emitters.infinite_count() as u32 + u32::from(finite.is_some());
        let group_probability = if groups > 0 { 1.0 / groups as f32 } else { 0.0 };
        let pmf = |index| finite.as_ref().map_or(0.0, |table| table.pmf(index));
        let areas = (0..).zip(&emitters.areas);
        let areas = areas.map(|(index, area)| area.clone().chosen_with(pmf(index) * group_probability));
        Ok(Self {
            areas: areas.collect(),
            finite,
            groups,
            group_probability,
        })
    }
}

/// A scene's emitters, chosen by power.
///
/// An emitter is selected in two steps: uniformly among the emitters at infinity and, as one more
/// entry, all finite ones together (the power of an emitter at infinity depends on the size of the
/// scene and cannot be compared with that of a lamp); then among the finite ones in proportion to
/// their power (luminous flux). So every emitter that emits has a positive probability `p_sel`, the
/// same at every point. All densities include it.
#[derive(Clone, Copy)]
pub struct EmittersByPower<'a> {
    emitters: &'a Emitters,
    pub(super) table: &'a PowerTable,
    sky: SkySampling,
}

/// A chosen emitter.
pub(super) enum Selected {
    /// By index, with its probability among the finite ones.
    Finite { index: u32, pmf: f32 },
    /// By its number among those at infinity, the environment last.
    Infinite(usize),
}

/// The kind of a chosen emitter.
pub(super) enum SelectedKind<'a> {
    /// A surface and its index.
    Area(u32, &'a AreaEmitter),
    Environment,
    /// A point, a direction or nothing.
    Other,
}

impl<'a> EmittersByPower<'a> {
    pub(crate) fn new(emitters: &'a Emitters, table: &'a PowerTable) -> Self {
        Self {
            emitters,
            table,
            sky: SkySampling::Luminance,
        }
    }

    /// The same, with the environment sampled in this way.
    #[must_use]
    pub fn with_sky(self, sky: SkySampling) -> Self {
        Self { sky, ..self }
    }

    /// The emitters.
    #[inline(always)]
    pub fn emitters(&self) -> &'a Emitters {
        self.emitters
    }

    /// Whether nothing emits.
    pub fn is_empty(&self) -> bool {
        self.table.groups == 0
    }

    /// Selects an emitter by `u_select` and a direction towards it by `u`. `None` if nothing emits,
    /// or if the selected emitter sends nothing to `from`: that outcome counts as a sample of value
    /// zero.
    #[inline]
    pub fn sample(&self, from: Vec3, u_select: u64, u: [f32; 2]) -> Option<EmitterSample> {
        match self.select(u_select) {
            Selected::Finite { index, pmf } => match self.area(index) {
                Some(area) => area.sample(from, index, u),
                None => self
                    .emitters
                    .sample_point(from, index, pmf * self.group_probability()),
            },
            Selected::Infinite(number) => {
                self.emitters
                    .sample_infinite(self.sky, number, self.group_probability(), u)
            }
        }
    }

    /// Density with which [`sample`](Self::sample) at `from` chooses the direction to `point`,
    /// which lies on an area emitter; zero if it does not.
    #[inline(always)]
    pub fn pdf(&self, from: Vec3, point: &SurfacePoint) -> Density<SolidAngle> {
        match self.area(point.emitter) {
            Some(area) => area.pdf(from, point),
            None => Density::ZERO,
        }
    }

    /// Density with which [`sample`](Self::sample) chooses `direction` towards the environment.
    #[inline(always)]
    pub fn pdf_environment(&self, direction: Vec3) -> Density<SolidAngle> {
        match self.emitters.environment() {
            Some(environment) => self
                .environment_choice()
                .pdf(environment.pdf_by(self.sky, direction)),
            None => Density::ZERO,
        }
    }

    /// How the environment is sampled.
    #[inline(always)]
    pub fn environment_choice(&self) -> EnvironmentChoice {
        EnvironmentChoice::new(self.sky, self.group_probability())
    }

    /// The endpoint that [`sample`](Self::sample) aims at for the same arguments; `None` if nothing
    /// emits or a sphere shines the other way. [`connect`](Self::connect) says whether it sends
    /// anything to `from`.
    #[inline]
    pub fn sample_endpoint(&self, from: Vec3, u_select: u64, u: [f32; 2]) -> Option<EmitterEndpoint> {
        match self.select(u_select) {
            Selected::Finite { index, .. } => self.emitters.endpoint_on(from, index, u),
            Selected::Infinite(number) => self.emitters.endpoint_of_infinite(self.sky, number, u),
        }
    }

    /// Probability with which [`sample_endpoint`](Self::sample_endpoint) selects the emitter of an
    /// endpoint; for one at infinity that of selecting any of those.
    #[inline]
    pub fn endpoint_probability(&self, endpoint: &EmitterEndpoint) -> f32 {
        match self.emitters.finite_emitter(endpoint) {
            Some(emitter) => self.probability(emitter),
            None => self.group_probability() * self.emitters.infinite_count() as f32,
        }
    }

    /// [`Emitters::connect`] with the densities of [`sample`](Self::sample).
    #[inline]
    pub fn connect(&self, from: Vec3, endpoint: &EmitterEndpoint) -> Option<EmitterConnection> {
        let point = |index| self.probability(index);
        let at_infinity = (self.group_probability(), self.sky);
        self.emitters
            .connect_among(&self.table.areas, point, at_infinity, from, endpoint)
    }

    /// Probability with which a finite emitter is chosen, at every point; 0 for any other index.
    #[inline(always)]
    pub fn probability(&self, index: u32) -> f32 {
        match &self.table.finite {
            Some(table) => table.pmf(index) * self.group_probability(),
            None => 0.0,
        }
    }

    /// Chooses an emitter; one at infinity if nothing emits.
    #[inline(always)]
    pub(super) fn select(&self, u_select: u64) -> Selected {
        // The high part of the product is the group, the low part a fresh uniform number within it.
        let routed = u128::from(u_select) * u128::from(self.table.groups);
        let group = (routed >> 64) as usize;
        match &self.table.finite {
            Some(table) if group == 0 => {
                let (index, pmf) = table.sample(routed as u64);
                Selected::Finite { index, pmf }
            }
            Some(_) => Selected::Infinite(group - 1),
            None => Selected::Infinite(group),
        }
    }

    /// What [`select`](Self::select) chooses, as lanes tell emitters apart.
    #[inline(always)]
    pub(super) fn select_kind(&self, u_select: u64) -> SelectedKind<'a> {
        let routed = u128::from(u_select) * u128::from(self.table.groups);
        let mut number = (routed >> 64) as usize;
        if let Some(table) = &self.table.finite {
            if number == 0 {
                let index = table.sample_index(routed as u64);
                return match self.area(index) {
                    Some(area) => SelectedKind::Area(index, area),
                    None => SelectedKind::Other,
                };
            }
            number -= 1;
        }
        match self.emitters.is_environment(number) {
            true => SelectedKind::Environment,
            false => SelectedKind::Other,
        }
    }

    /// An emitting surface with its probability.
    #[inline(always)]
    pub(super) fn area(&self, index: u32) -> Option<&'a AreaEmitter> {
        self.table.areas.get(index as usize)
    }

    /// One over the number of groups.
    #[inline(always)]
    pub(super) fn group_probability(&self) -> f32 {
        self.table.group_probability
    }

    /// An emitting triangle as a shader reads it; `None` if the emitter of this index is none.
    pub(crate) fn flat_triangle(&self, index: u32) -> Option<FlatEmitter> {
        match self.area(index)? {
            AreaEmitter::Triangle(triangle) => Some(triangle.flat()),
            AreaEmitter::Sphere(_) => None,
        }
    }

    /// Emitters at a point, then those of a single direction, as shaders read them.
    pub(crate) fn flat_deltas(&self) -> Vec<FlatDelta> {
        let first = self.emitters.areas.len() as u32;
        let points = (first..)
            .zip(&self.emitters.points)
            .map(|(index, point)| FlatDelta {
                probability: self.probability(index),
                ..point.flat()
            });
        let directions = self.emitters.directionals.iter().map(|light| FlatDelta {
            place: light.towards,
            probability: self.group_probability(),
            intensity: light.irradiance,
            ..FlatDelta::default()
        });
        points.chain(directions).collect()
    }

    /// The table by which one of the finite emitters is chosen; empty if there are none.
    pub(crate) fn finite_table(&self) -> &'a [AliasEntry] {
        self.table.finite.as_ref().map_or(&[], AliasTable::entries)
    }

    /// Emitters at infinity, and one more if there are finite ones.
    pub(crate) fn group_count(&self) -> u32 {
        self.table.groups
    }
}
