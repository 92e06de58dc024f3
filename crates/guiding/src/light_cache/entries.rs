//! A region's records of units: deduplicated samples, kept from update to update.

use super::options::LightCacheOptions;
use super::record::LightRecord;

/// A region's record of a unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Entry {
    pub unit: u32,
    /// Samples that asked for it.
    pub count: f32,
    /// The number of these samples that saw it.
    pub seen_count: f32,
    /// `Σ 1/p` of both: their ratio estimates the share of the region's points that see the light.
    asked: f32,
    seen: f32,
    /// Updates with samples in the region since the last sample that saw it.
    unseen_for: u32,
}

/// Share of its evidence that a divided or joined region keeps.
const INHERITED: f32 = 0.5;
/// Number of samples for which the records of neighbours count.
const PRIOR_COUNT: f32 = 2.0;
/// Least share of points for a light to count as visible.
const MIN_VISIBILITY: f32 = 1.0 / 64.0;

impl Entry {
    pub fn is_visible(&self) -> bool {
        self.seen_count > 0.0
    }

    fn scale(&mut self, factor: f32) {
        self.count *= factor;
        self.seen_count *= factor;
        self.asked *= factor;
        self.seen *= factor;
    }

    /// For a region that has become another part of space.
    pub fn inherited(mut self) -> Self {
        self.scale(INHERITED);
        self
    }

    fn add(&mut self, record: &LightRecord) {
        let weight = 1.0 / record.pmf;
        self.count += 1.0;
        self.asked += weight;
        if record.visible {
            self.seen_count += 1.0;
            self.seen += weight;
            self.unseen_for = 0;
        }
    }
}

/// Adds the records `inside` a region, sorted by unit, to its entries, sorted by unit. Returns how
/// many units it sees for the first time.
pub(super) fn collect(
    entries: &mut Vec<Entry>,
    records: &[LightRecord],
    inside: &[u32],
    unit_of: impl Fn(u32) -> u32,
    options: &LightCacheOptions,
) -> usize {
    if inside.is_empty() {
        // Without samples, what was learnt stays.
        return 0;
    }
    let mut found = 0;
    for entry in entries.iter_mut() {
        entry.scale(options.persistence);
        entry.unseen_for += 1;
    }
    let mut new = Vec::new();
    let unit = |record: u32| unit_of(records[record as usize].light);
    for group in inside.chunk_by(|&a, &b| unit(a) == unit(b)) {
        let unit = unit(group[0]);
        let mut fresh = Entry {
            unit,
            ..Entry::default()
        };
        let known = entries.binary_search_by_key(&unit, |entry| entry.unit);
        let entry = match known {
            Ok(place) => &mut entries[place],
            Err(_) => &mut fresh,
        };
        let was_visible = entry.is_visible();
        group.iter().for_each(|&i| entry.add(&records[i as usize]));
        found += usize::from(entry.is_visible() && !was_visible);
        if known.is_err() {
            new.push(fresh);
        }
    }
    entries.append(&mut new);
    entries.retain(|entry| {
        let forgotten = entry.unseen_for > options.max_age;
        // A hidden light is remembered as long as samples select it.
        entry.count > 0.05 && !(forgotten && entry.is_visible())
    });
    entries.sort_unstable_by_key(|entry| entry.unit);
    found
}

/// A unit in a region's cache.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Visible {
    pub unit: u32,
    /// Estimated share of the region's points that see it.
    pub visibility: f32,
    /// Samples that saw it, those of neighbours included.
    pub seen_count: f32,
}

/// The units that a region or one of its neighbours sees, sorted by number.
pub(super) fn merge<'a>(
    own: &[Entry],
    neighbours: impl Iterator<Item = &'a [Entry]>,
    visible: &mut Vec<Visible>,
) {
    visible.clear();
    let mut all: Vec<(u32, bool, Entry)> = own.iter().map(|&entry| (entry.unit, true, entry)).collect();
    for entries in neighbours {
        all.extend(entries.iter().map(|&entry| (entry.unit, false, entry)));
    }
    // Stable: entries of a unit keep their order, so sums have the same bits.
    all.sort_by_key(|&(unit, ..)| unit);
    for group in all.chunk_by(|a, b| a.0 == b.0) {
        let (mut here, mut around, mut seen_count) = (Entry::default(), Entry::default(), 0.0);
        for (_, is_own, entry) in group {
            seen_count += entry.seen_count;
            if *is_own {
                here = *entry;
            } else {
                around.asked += entry.asked;
                around.seen += entry.seen;
            }
        }
        if seen_count > 0.0 {
            visible.push(Visible {
                unit: group[0].0,
                visibility: visibility(&here, &around),
                seen_count,
            });
        }
    }
}

/// Share of points that see a light, with the records of neighbours as a prior.
fn visibility(here: &Entry, around: &Entry) -> f32 {
    let share = |entry: &Entry, unknown: f32| {
        if entry.asked > 0.0 {
            entry.seen / entry.asked
        } else {
            unknown
        }
    };
    let prior = share(around, 0.5);
    let mixed = (here.count * share(here, 0.0) + PRIOR_COUNT * prior) / (here.count + PRIOR_COUNT);
    mixed.clamp(MIN_VISIBILITY, 1.0)
}
