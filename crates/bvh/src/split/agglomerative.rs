//! Groups joined from the bottom up.
//!
//! Again and again two groups that are each other's best partners become one: the union with no
//! other costs less (Walter et al. 2008, *Fast agglomerative clustering for rendering*, the locally
//! ordered algorithm). Partners are found by descending a hierarchy of boxes over the groups that
//! are left, as far as a union with something in a box could still be the cheapest.

use super::extent::Extent;
use super::group::{SplitGroup, SplitSource};
use glam::Vec3A;

/// Boxes below a box.
const STEP: usize = 8;
/// Boxes waiting to be searched: seven at each of up to ten levels, and the eight of the last.
const WAITING: usize = STEP * 10;
/// In place of a group's node.
const NONE: u32 = u32::MAX;

/// What is kept from one build to the next.
#[derive(Clone, Debug)]
pub struct Merges<E: Extent> {
    groups: Vec<E>,
    /// The node of each group; [`NONE`] where there is no group any more.
    nodes: Vec<u32>,
    /// Boxes over eight groups, eight boxes, …
    levels: Vec<Vec<Region>>,
    /// How many of them there are this time.
    height: usize,
    /// Both parts of each node that is not an item.
    parts: Vec<[u32; 2]>,
    /// Extents of these nodes, and how many items each has.
    joined: Vec<(E, u32)>,
    items: Vec<E::Item>,
    waiting: Vec<u32>,
}

/// Where some groups are, and the least of their weights.
#[derive(Clone, Copy, Debug)]
struct Region {
    min: Vec3A,
    max: Vec3A,
    least: f64,
}

impl Region {
    const EMPTY: Self = Self {
        min: Vec3A::INFINITY,
        max: Vec3A::NEG_INFINITY,
        least: f64::INFINITY,
    };

    fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            least: self.least.min(other.least),
        }
    }

    /// No union of `group` with one of this region's costs less.
    fn least_cost<E: Extent>(&self, group: &E) -> f64 {
        if self.least == f64::INFINITY {
            return f64::INFINITY;
        }
        // A union reaches from the group's far side to at least the region's near side.
        let size = (group.max() - group.min())
            .max(group.max() - self.max)
            .max(self.min - group.min());
        // Rounded down.
        (1.0 - 1e-6) * group.cost_of(group.weight() + self.least, size)
    }
}

impl<E: Extent> Default for Merges<E> {
    fn default() -> Self {
        Self {
            groups: Vec::new(),
            nodes: Vec::new(),
            levels: Vec::new(),
            height: 0,
            parts: Vec::new(),
            joined: Vec::new(),
            items: Vec::new(),
            waiting: Vec::new(),
        }
    }
}

impl<E: Extent> Merges<E> {
    /// Joins `items` until one group is left, and puts them in the order of its leaves.
    pub fn join(&mut self, items: &mut [E::Item]) {
        let count = items.len();
        self.start(items);
        if count == 0 {
            return;
        }
        let mut own = 0;
        for joined in 1..count {
            // The next group that is left, where the last one has no partner.
            while self.nodes[own] == NONE {
                own += 1;
            }
            let mut best = self.partner(own);
            let [low, high] = loop {
                let Some((cost, other)) = best else { return };
                let back = self.partner(other);
                // The costs of the chain only fall, so it ends.
                match back {
                    Some((least, next)) if least < cost && next != own => (own, best) = (other, back),
                    _ => break [own, other],
                }
            };
            let union = self.groups[low].union(&self.groups[high]);
            let size = self.size(self.nodes[low]) + self.size(self.nodes[high]);
            self.parts.push([self.nodes[low], self.nodes[high]]);
            self.joined.push((union, size));
            self.put(high, E::EMPTY, NONE);
            self.put(low, union, (count + joined - 1) as u32);
            own = low;
        }
        self.order(items);
    }

    fn start(&mut self, items: &[E::Item]) {
        self.groups.clear();
        self.groups
            .extend(items.iter().map(|item| E::of(core::slice::from_ref(item))));
        self.nodes.clear();
        self.nodes.extend(0..items.len() as u32);
        self.parts.clear();
        self.joined.clear();
        self.items.clear();
        self.items.extend_from_slice(items);
        let (mut level, mut below) = (0, items.len());
        while below > 1 {
            if self.levels.len() == level {
                self.levels.push(Vec::new());
            }
            below = below.div_ceil(STEP);
            self.levels[level].clear();
            self.levels[level].resize(below, Region::EMPTY);
            for place in 0..below {
                self.levels[level][place] = self.region(level, place);
            }
            level += 1;
        }
        self.height = level;
    }

    /// Region `place` of a level, from what is below it.
    fn region(&self, level: usize, place: usize) -> Region {
        let below = place * STEP..(place + 1) * STEP;
        match level {
            0 => below
                .take_while(|&place| place < self.groups.len())
                .filter(|&place| self.nodes[place] != NONE)
                .map(|place| {
                    let group = &self.groups[place];
                    Region {
                        min: group.min(),
                        max: group.max(),
                        least: group.weight(),
                    }
                })
                .fold(Region::EMPTY, |all, region| all.union(&region)),
            _ => below
                .filter_map(|place| self.levels[level - 1].get(place))
                .fold(Region::EMPTY, |all, region| all.union(region)),
        }
    }

    /// Puts a group in a place, and brings the regions above it up to date.
    fn put(&mut self, place: usize, group: E, node: u32) {
        (self.groups[place], self.nodes[place]) = (group, node);
        let mut place = place;
        for level in 0..self.height {
            place /= STEP;
            self.levels[level][place] = self.region(level, place);
        }
    }

    fn size(&self, node: u32) -> u32 {
        match (node as usize).checked_sub(self.items.len()) {
            Some(joined) => self.joined[joined].1,
            None => 1,
        }
    }

    /// The group with which `own` has the cheapest union, and its cost; `None` if there is no
    /// other.
    fn partner(&self, own: usize) -> Option<(f64, usize)> {
        let group = &self.groups[own];
        let mut best: Option<(f64, usize)> = None;
        let mut waiting = [(0.0, 0, 0); WAITING];
        waiting[0] = (0.0, self.height - 1, 0);
        let mut left = 1;
        while left > 0 {
            left -= 1;
            let (bound, level, place) = waiting[left];
            if best.is_some_and(|(least, _)| bound >= least) {
                continue;
            }
            let below = place * STEP..(place + 1) * STEP;
            if level == 0 {
                for place in below.take_while(|&place| place < self.groups.len()) {
                    if place == own || self.nodes[place] == NONE {
                        continue;
                    }
                    let cost = group.union(&self.groups[place]).cost();
                    if best.is_none_or(|(least, _)| cost < least) {
                        best = Some((cost, place));
                    }
                }
                continue;
            }
            let first = left;
            for place in below.take_while(|&place| place < self.levels[level - 1].len()) {
                let bound = self.levels[level - 1][place].least_cost(group);
                if bound < f64::INFINITY && best.is_none_or(|(least, _)| bound < least) {
                    waiting[left] = (bound, level - 1, place);
                    left += 1;
                }
            }
            // The nearest is searched first; of equal ones that with the own group.
            let own_place = own / STEP.pow(level as u32);
            waiting[first..left].sort_unstable_by(|a, b| {
                b.0.total_cmp(&a.0)
                    .then((a.2 == own_place).cmp(&(b.2 == own_place)))
                    .then(b.2.cmp(&a.2))
            });
        }
        best
    }

    /// Items from the first leaf to the last.
    fn order(&mut self, items: &mut [E::Item]) {
        let count = items.len();
        let mut places = items.iter_mut();
        self.waiting.clear();
        self.waiting.push((2 * count - 2) as u32);
        while let Some(node) = self.waiting.pop() {
            match (node as usize).checked_sub(count) {
                Some(joined) => {
                    let [low, high] = self.parts[joined];
                    self.waiting.extend([high, low]);
                }
                None => {
                    if let Some(place) = places.next() {
                        *place = self.items[node as usize];
                    }
                }
            }
        }
    }
}

/// Items in the order of the leaves, divided as they were joined.
pub struct MergedTree<'a, E: Extent> {
    /// The items, as [`Merges::join`] has left them.
    pub items: &'a [E::Item],
    /// How they were joined.
    pub joining: &'a Merges<E>,
}

impl<E: Extent> Clone for MergedTree<'_, E> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<E: Extent> Copy for MergedTree<'_, E> {}

impl<E: Extent> MergedTree<'_, E> {
    /// The node of the whole: the last one.
    pub fn root(&self) -> u32 {
        (2 * self.items.len()).saturating_sub(2) as u32
    }

    fn group(&self, node: u32, start: usize, end: usize) -> SplitGroup<E> {
        let extent = match (node as usize).checked_sub(self.items.len()) {
            Some(joined) => self.joining.joined[joined].0,
            None => E::of(&self.items[start..end]),
        };
        SplitGroup {
            node,
            ..SplitGroup::new(start, end, extent)
        }
    }
}

impl<E: Extent> SplitSource<E> for MergedTree<'_, E> {
    fn item(&self, place: usize) -> &E::Item {
        &self.items[place]
    }

    fn divide(&mut self, group: &SplitGroup<E>, by_half: bool) -> [SplitGroup<E>; 2] {
        let &SplitGroup { start, end, .. } = group;
        let joined = (group.node as usize).checked_sub(self.items.len());
        match joined.and_then(|joined| self.joining.parts.get(joined)) {
            Some(&[low, high]) if !by_half => {
                let place = start + self.joining.size(low) as usize;
                [self.group(low, start, place), self.group(high, place, end)]
            }
            // What has once been halved by number is halved on.
            _ => {
                let place = start + group.len() / 2;
                let half = |start: usize, end| SplitGroup::new(start, end, E::of(&self.items[start..end]));
                [half(start, place), half(place, end)]
            }
        }
    }

    fn apart(self, _: usize) -> (Self, Self) {
        (self, self)
    }
}
