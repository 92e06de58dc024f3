//! The units of a region's records: single lights, or groups of lights that are near each other.
//!
//! A cache of groups needs far fewer samples to learn visibility than one of single lights, and a
//! bucket holds many more of them. Groups are runs of a curve through all lights that fit into a
//! small box: a cut of a tree along that curve. `p_c(l) = p_c(unit) · w_l / Σ_unit w`.

use super::block::{LightBlock, Receiver, WeighedLight};
use super::options::{BucketRule, LightCacheOptions, MAX_BUCKET};
use super::walk::{Walk, find};
use lightshed_lanes::{LANES, Lanes};
use lightshed_lights::{Bounds, Light};
use lightshed_spatial::{Curve, CurveOrder};

#[derive(Clone, Debug)]
pub(super) struct Units {
    /// How each is weighed.
    pub lights: Vec<WeighedLight>,
    /// The unit of each light.
    pub of: Vec<u32>,
    /// The light of a unit that has only one, otherwise any of its lights.
    pub single: Vec<u32>,
    /// First block of the members of each unit, and the end of the last one. Units of one light
    /// have none.
    pub starts: Vec<u32>,
    pub blocks: Vec<LightBlock>,
}

impl Units {
    /// Units of these lights, in the order of the curve; where buckets are hashed, in that of the
    /// lights.
    pub fn new(lights: &[Light], options: &LightCacheOptions) -> Self {
        let weighed: Vec<WeighedLight> = lights.iter().map(WeighedLight::new).collect();
        let mut units = Self {
            lights: Vec::new(),
            of: vec![0; lights.len()],
            single: Vec::new(),
            starts: vec![0],
            blocks: Vec::new(),
        };
        if options.rule == BucketRule::Hashed {
            (0..lights.len() as u32).for_each(|light| units.push(&[light], &weighed));
            return units;
        }
        let all = lights
            .iter()
            .fold(Bounds::EMPTY, |all, light| all.union(&light.bounds));
        let largest = options.unit_size * all.diagonal().length();
        let mut order = CurveOrder::default();
        order.encode(lights, |light| light.bounds, Curve::Hilbert);
        let order: Vec<u32> = order.sort().iter().map(|light| light as u32).collect();
        let mut run: Vec<u32> = Vec::new();
        let mut bounds = Bounds::EMPTY;
        for &light in &order {
            let with = bounds.union(&lights[light as usize].bounds);
            let fits = run.len() < MAX_BUCKET / 2 && with.diagonal().length() <= largest;
            if !run.is_empty() && !fits {
                units.push(&run, &weighed);
                run.clear();
                bounds = Bounds::EMPTY;
            }
            run.push(light);
            bounds = bounds.union(&lights[light as usize].bounds);
        }
        units.push(&run, &weighed);
        units
    }

    /// The same units for lights that have moved or changed: the records of regions keep their
    /// meaning.
    pub fn moved(&self, lights: &[Light]) -> Self {
        let weighed: Vec<WeighedLight> = lights.iter().map(WeighedLight::new).collect();
        let mut units = Self {
            lights: Vec::with_capacity(self.lights.len()),
            of: vec![0; self.of.len()],
            single: Vec::with_capacity(self.single.len()),
            starts: vec![0],
            blocks: Vec::with_capacity(self.blocks.len()),
        };
        for unit in 0..self.lights.len() as u32 {
            let members: Vec<u32> = self.lights_of(unit).collect();
            units.push(&members, &weighed);
        }
        units
    }

    fn push(&mut self, members: &[u32], weighed: &[WeighedLight]) {
        let unit = self.lights.len() as u32;
        members.iter().for_each(|&light| self.of[light as usize] = unit);
        self.single.push(members[0]);
        if let [light] = members {
            self.lights.push(weighed[*light as usize]);
        } else {
            let lights: Vec<WeighedLight> = members.iter().map(|&light| weighed[light as usize]).collect();
            self.lights.push(WeighedLight::group(&lights));
            LightBlock::push_all(&mut self.blocks, members.iter().copied().zip(&lights));
        }
        self.starts.push(self.blocks.len() as u32);
    }

    /// The unit of an existing light.
    #[inline(always)]
    pub fn of(&self, light: u32) -> u32 {
        self.of[light as usize]
    }

    /// Number of lights.
    pub fn light_count(&self) -> usize {
        self.of.len()
    }

    #[inline(always)]
    fn members(&self, unit: u32) -> &[LightBlock] {
        &self.blocks[self.starts[unit as usize] as usize..self.starts[unit as usize + 1] as usize]
    }

    /// The lights of a unit.
    pub fn lights_of(&self, unit: u32) -> impl Iterator<Item = u32> + '_ {
        let members = self.members(unit);
        let single = members.is_empty().then(|| self.single[unit as usize]);
        let numbers = members.iter().flat_map(|block| block.lights);
        single
            .into_iter()
            .chain(numbers.filter(|&light| light != LightBlock::NONE))
    }

    /// Probability of a light within its unit.
    #[inline(always)]
    pub fn probability<L: Lanes>(&self, to: &Receiver<'_>, light: u32) -> f32 {
        let members = self.members(self.of(light));
        if members.is_empty() {
            return 1.0;
        }
        let walk = Walk::new::<L>(members, to);
        find(members, light).map_or(0.0, |i| walk.probability(i))
    }

    /// A light of a unit, selected by `u`, with its probability within the unit; `None` if no light
    /// of the unit has a weight.
    #[inline(always)]
    pub fn choose<L: Lanes>(&self, to: &Receiver<'_>, unit: u32, u: f64) -> Option<(u32, f32)> {
        let members = self.members(unit);
        if members.is_empty() {
            return Some((self.single[unit as usize], 1.0));
        }
        let walk = Walk::new::<L>(members, to);
        if !(walk.total() > 0.0) {
            return None;
        }
        let (i, _) = walk.choose::<L>(u);
        Some((members[i / LANES].lights[i % LANES], walk.probability(i)))
    }
}
