//! A hash table whose content does not depend on the order of work.

use super::error::HashGridError;
use super::key::CellKey;
use super::occupancy::Occupancy;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// Slots of a line, which a cache reads at once.
const LINE: usize = 8;
/// Number of lines that may hold a key: its own and the next ones.
const LINES: usize = 4;
/// Marks a word whose slot is kept; a word without it is a claim.
const KEPT: u64 = 1 << 63;
/// Number of bits that count refused cells.
const REFUSED_BITS: usize = 1 << 16;

#[derive(Default)]
#[repr(align(64))]
struct Line([AtomicU64; LINE]);

/// Slots for cells: a hash table of bounded size and bounded probing, without a lock.
///
/// The user keeps the records: one a slot, in a slice of [`slots`](Self::slots). Work goes in
/// passes:
///
/// 1. any number of threads [`find`](Self::find) slots and [`claim`](Self::claim) cells, in any
///    order;
/// 2. [`settle`](Self::settle) turns the claims into slots, whose records start anew, and
///    [`evict`](Self::evict) frees slots that nobody has claimed for some passes.
///
/// **Nothing is shared by mistake.** A slot holds the whole key of its cell, mixed one to one into
/// 63 bits, so two cells never share a slot.
///
/// **The content is the same for any order of claims.** A cell may be in four lines of eight slots,
/// and tries them one after the other. A slot keeps the largest word that was offered to it (one
/// atomic maximum), and the cell that loses the slot tries its next one. This is deferred
/// acceptance (Gale and Shapley 1962): all slots rank words alike, so the final slot of each cell
/// does not depend on the order of arrival. Kept slots take part in none of it.
///
/// **A full table reports it.** A cell without a slot has no record, and
/// [`occupancy`](Self::occupancy) counts it.
///
/// ```
/// use lightshed_spatial::glam::Vec3;
/// use lightshed_spatial::{CellTable, LevelGrid, LevelGridOptions, SpatialIndex, SurfaceSite};
///
/// let grid = LevelGrid::new(LevelGridOptions::new(0.1))?;
/// let mut table = CellTable::new(1000)?;
/// let floor = grid.locate(&SurfaceSite::new(Vec3::ZERO, Vec3::Y)).unwrap();
/// let wall = grid.locate(&SurfaceSite::new(Vec3::ZERO, Vec3::X)).unwrap();
/// std::thread::scope(|scope| {
///     scope.spawn(|| table.claim(floor));
///     scope.spawn(|| table.claim(wall));
/// });
/// let mut values = vec![0.0; table.slots()];
/// table.settle(|slot| values[slot as usize] = 1.0);
/// let [floor, wall] = [floor, wall].map(|key| table.find(key).unwrap());
/// assert!(floor != wall && values[floor as usize] + values[wall as usize] == 2.0);
/// # Ok::<(), lightshed_spatial::HashGridError>(())
/// ```
pub struct CellTable {
    lines: Box<[Line]>,
    /// The pass in which each slot was last claimed.
    used: Box<[AtomicU32]>,
    /// A bit for each hash of a word that found no slot.
    refused: Box<[AtomicU64]>,
    pass: u32,
    occupancy: Occupancy,
}

impl CellTable {
    /// A table with this number of slots, rounded up to a power of two and at least 32. It takes 12
    /// bytes a slot.
    ///
    /// # Errors
    /// No slots, or more than 2²⁸.
    pub fn new(slots: usize) -> Result<Self, HashGridError> {
        if !(1..=1 << 28).contains(&slots) {
            return Err(HashGridError::Slots(slots));
        }
        let slots = slots.next_power_of_two().max(LINE * LINES);
        let words = |count: usize| (0..count).map(|_| AtomicU64::new(0)).collect();
        Ok(Self {
            lines: (0..slots / LINE).map(|_| Line::default()).collect(),
            used: (0..slots).map(|_| AtomicU32::new(0)).collect(),
            refused: words(REFUSED_BITS / 64),
            pass: 0,
            occupancy: Occupancy {
                slots,
                ..Occupancy::default()
            },
        })
    }

    /// A table with the [`words`](Self::words) of another; claims that were not settled there are
    /// lost, and all cells count as used now.
    ///
    /// # Errors
    /// Words that no table has: another number than a power of two of at least 32, one that is no
    /// cell's, a cell in a slot where no look-up finds it, a cell twice.
    pub fn from_words(words: &[u64]) -> Result<Self, HashGridError> {
        let mut table = Self::new(words.len())?;
        if table.slots() != words.len() {
            return Err(HashGridError::Slots(words.len()));
        }
        for (slot, &word) in words.iter().enumerate().filter(|(_, word)| **word & KEPT != 0) {
            let key = CellKey::of_word(word).ok_or(HashGridError::Words)?;
            if table.find(key).is_some() {
                return Err(HashGridError::Words);
            }
            *table.lines[slot / LINE].0[slot % LINE].get_mut() = word;
            if table.find(key) != Some(slot as u32) {
                return Err(HashGridError::Words);
            }
        }
        table.count();
        Ok(table)
    }

    /// The cell that has a slot.
    pub fn key(&self, slot: u32) -> Option<CellKey> {
        let line = self.lines.get(slot as usize / LINE)?;
        let word = line.0[slot as usize % LINE].load(Ordering::Relaxed);
        CellKey::of_word(word).filter(|_| word & KEPT != 0)
    }

    /// Number of slots.
    #[inline(always)]
    pub fn slots(&self) -> usize {
        self.used.len()
    }

    /// The slot of a cell; `None` if it has none. Claims that are not settled yet change nothing.
    #[inline]
    pub fn find(&self, key: CellKey) -> Option<u32> {
        let word = key.word() | KEPT;
        let home = self.home(word);
        for next in 0..LINES {
            let line = self.wrapped(home + next);
            for (place, slot) in self.lines[line].0.iter().enumerate() {
                if slot.load(Ordering::Relaxed) == word {
                    return Some((line * LINE + place) as u32);
                }
            }
        }
        None
    }

    /// Requests a slot for a cell, available from the next [`settle`](Self::settle) on. If the cell
    /// has one, marks it as used. A claim may move other claims that are not settled yet, each to a
    /// later slot.
    pub fn claim(&self, key: CellKey) {
        if let Some(slot) = self.find(key) {
            self.touch(slot);
            return;
        }
        let (mut word, mut next) = (key.word(), 0);
        while next < LINE * LINES {
            let line = self.wrapped(self.home(word) + next / LINE);
            let there = self.lines[line].0[next % LINE].fetch_max(word, Ordering::Relaxed);
            if there == 0 || there == word {
                return;
            }
            if there < word {
                // It lost its slot, and continues from here.
                next = LINE * self.lines_between(there, line) + next % LINE;
                word = there;
            }
            next += 1;
        }
        let bit = self.refused_bit(word);
        self.refused[bit / 64].fetch_or(1 << (bit % 64), Ordering::Relaxed);
    }

    /// Says that a slot is in use.
    #[inline]
    pub fn touch(&self, slot: u32) {
        self.used[slot as usize].store(self.pass, Ordering::Relaxed);
    }

    /// Turns claims into slots: calls `opened` with each new slot, in their order; its record
    /// starts anew. Ends the pass.
    pub fn settle(&mut self, mut opened: impl FnMut(u32)) {
        self.occupancy.opened = 0;
        let mut slot = 0;
        for line in &mut self.lines {
            for word in &mut line.0 {
                let word = word.get_mut();
                if *word != 0 && *word & KEPT == 0 {
                    *word |= KEPT;
                    *self.used[slot].get_mut() = self.pass;
                    self.occupancy.opened += 1;
                    opened(slot as u32);
                }
                slot += 1;
            }
        }
        self.occupancy.refused = self.take_refused();
        self.count();
        self.pass += 1;
    }

    /// Frees slots that were not used in the last `passes` passes: calls `closed` with each, in
    /// their order. Call it between [`settle`](Self::settle) and the next claim.
    pub fn evict(&mut self, passes: u32, mut closed: impl FnMut(u32)) {
        self.occupancy.evicted = 0;
        for slot in 0..self.slots() {
            let age = self.pass.wrapping_sub(*self.used[slot].get_mut());
            let word = self.lines[slot / LINE].0[slot % LINE].get_mut();
            if *word != 0 && age > passes {
                *word = 0;
                self.occupancy.evicted += 1;
                closed(slot as u32);
            }
        }
        self.count();
    }

    /// Slots in use, in their order.
    pub fn occupied(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.slots() as u32).filter(|&slot| self.is_occupied(slot))
    }

    /// Whether a slot is in use.
    #[inline]
    pub fn is_occupied(&self, slot: u32) -> bool {
        let line = &self.lines[slot as usize / LINE];
        line.0[slot as usize % LINE].load(Ordering::Relaxed) & KEPT != 0
    }

    /// The word of each slot in order: 0 without a cell, otherwise the key mixed one to one to 63
    /// bits, with the highest bit set. Claims that are not settled are without that bit. With these
    /// words a device finds what [`find`](Self::find) does.
    pub fn words(&self) -> impl Iterator<Item = u64> + '_ {
        let slots = self.lines.iter().flat_map(|line| &line.0);
        slots.map(|slot| slot.load(Ordering::Relaxed))
    }

    /// How full the table is since the last [`settle`](Self::settle) or [`evict`](Self::evict).
    pub fn occupancy(&self) -> Occupancy {
        self.occupancy
    }

    /// The line of a word.
    #[inline(always)]
    fn home(&self, word: u64) -> usize {
        self.wrapped(word as usize)
    }

    #[inline(always)]
    fn wrapped(&self, line: usize) -> usize {
        line & (self.lines.len() - 1)
    }

    /// The distance of a line from a word's own line.
    #[inline(always)]
    fn lines_between(&self, word: u64, line: usize) -> usize {
        self.wrapped(line.wrapping_sub(self.home(word)))
    }

    fn refused_bit(&self, word: u64) -> usize {
        (word >> 40) as usize % REFUSED_BITS
    }

    /// The number of refusals since the last call.
    fn take_refused(&mut self) -> usize {
        let set: u32 = self
            .refused
            .iter_mut()
            .map(|bits| bits.get_mut().count_ones())
            .sum();
        self.refused.iter_mut().for_each(|bits| *bits.get_mut() = 0);
        let all = REFUSED_BITS as f64;
        let free = (all - f64::from(set)).max(1.0);
        (all * (all / free).ln()).round() as usize
    }

    fn count(&mut self) {
        let mut lines = [0; LINES];
        for (line, words) in self.lines.iter().enumerate() {
            for word in &words.0 {
                let word = word.load(Ordering::Relaxed);
                if word != 0 {
                    lines[self.lines_between(word, line) % LINES] += 1;
                }
            }
        }
        self.occupancy.lines = lines;
        self.occupancy.occupied = lines.iter().sum();
    }
}

impl Clone for CellTable {
    fn clone(&self) -> Self {
        let copied = |words: &[AtomicU64]| {
            let words = words
                .iter()
                .map(|word| AtomicU64::new(word.load(Ordering::Relaxed)));
            words.collect::<Box<[_]>>()
        };
        let line = |line: &Line| {
            Line(std::array::from_fn(|place| {
                AtomicU64::new(line.0[place].load(Ordering::Relaxed))
            }))
        };
        let used = self
            .used
            .iter()
            .map(|pass| AtomicU32::new(pass.load(Ordering::Relaxed)));
        Self {
            lines: self.lines.iter().map(line).collect(),
            used: used.collect(),
            refused: copied(&self.refused),
            ..*self
        }
    }
}

impl std::fmt::Debug for CellTable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut table = f.debug_struct("CellTable");
        table.field("occupancy", &self.occupancy).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LevelGrid, LevelGridOptions, SpatialIndex, SurfaceSite};
    use glam::Vec3;
    use lightshed_sampling::CounterRng;
    use std::collections::BTreeSet;

    fn key(number: u32) -> CellKey {
        let options = LevelGridOptions {
            cell: 1.0,
            growth: 0.0,
            faces: false,
            facets: false,
        };
        let place = Vec3::new((number % 1000) as f32, (number / 1000) as f32, 0.5);
        let grid = LevelGrid::new(options).unwrap();
        grid.locate(&SurfaceSite::new(place, Vec3::Y)).unwrap()
    }

    fn words(table: &CellTable) -> Vec<u64> {
        table.words().collect()
    }

    /// The result of claims one after the other, the largest word first.
    fn naive(before: &[u64], claims: &BTreeSet<u64>) -> (Vec<u64>, usize) {
        let (mut slots, lines) = (before.to_vec(), before.len() / LINE);
        let mut refused = 0;
        for &word in claims.iter().rev() {
            if slots.contains(&(word | KEPT)) {
                continue;
            }
            let home = word as usize % lines;
            let mut window = (0..LINE * LINES).map(|next| (home + next / LINE) % lines * LINE + next % LINE);
            match window.find(|&slot| slots[slot] == 0) {
                Some(slot) => slots[slot] = word | KEPT,
                None => refused += 1,
            }
        }
        (slots, refused)
    }

    /// Passes of claims in several orders against the naive table: far from full, and overfull.
    #[test]
    fn claims_are_deferred_acceptance() {
        for (slots, claims) in [(256, 60), (128, 100), (64, 400)] {
            let mut table = CellTable::new(slots).unwrap();
            let mut reversed = CellTable::new(slots).unwrap();
            for pass in 0..30 {
                let numbers: Vec<u32> = (0..claims)
                    .map(|i| CounterRng::new(1, pass, i).next_u32() % 500)
                    .collect();
                let wanted = numbers.iter().map(|&number| key(number).word()).collect();
                let (expected, refused) = naive(&words(&table), &wanted);
                numbers.iter().for_each(|&number| table.claim(key(number)));
                numbers
                    .iter()
                    .rev()
                    .for_each(|&number| reversed.claim(key(number)));
                for table in [&mut table, &mut reversed] {
                    table.settle(|_| ());
                    assert_eq!(words(table), expected, "{slots} slots, pass {pass}");
                    assert!(table.occupancy.refused.abs_diff(refused) <= refused / 50);
                    table.evict(3, |_| ());
                }
                assert_eq!(words(&table), words(&reversed));
            }
        }
    }

    /// A copy, and a table of the same words, find the same slots; words in wrong slots, twice, or
    /// of no key are refused.
    #[test]
    fn tables_are_their_words() {
        let mut table = CellTable::new(256).unwrap();
        (0..180).for_each(|number| table.claim(key(number)));
        table.settle(|_| ());
        let mut found = words(&table);
        let same = CellTable::from_words(&found).unwrap();
        for number in 0..200 {
            let slot = table.find(key(number));
            assert_eq!(
                (same.find(key(number)), table.clone().find(key(number))),
                (slot, slot)
            );
            assert_eq!(slot.and_then(|slot| same.key(slot)), slot.map(|_| key(number)));
        }
        let occupied = table.occupied().next().unwrap() as usize;
        let elsewhere = (occupied + 128) % 256;
        let refused = |words: &[u64]| CellTable::from_words(words).err();
        assert_eq!(refused(&found[..96]), Some(HashGridError::Slots(96)));
        let kept = found[occupied];
        found[elsewhere] = kept;
        assert_eq!(refused(&found), Some(HashGridError::Words));
        found[elsewhere] = 0;
        (found[occupied], found[occupied / 8 * 8 + (occupied + 1) % 8]) = (kept, kept);
        assert_eq!(refused(&found), Some(HashGridError::Words));
        found.fill(0);
        // Without the bit that every key has before it is mixed.
        found[0] = KEPT;
        assert_eq!(refused(&found), Some(HashGridError::Words));
    }
}
