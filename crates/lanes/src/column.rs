//! One attribute of up to 64 things, side by side.

use crate::{AnyLanes, LANES, LaneWords, Lanes, MOST_LANES};

/// One attribute of up to [`Column::CAPACITY`] things, for kernels that take eight at a time.
/// Groups of eight are loaded and stored whole, or selected lanes are written one behind the other.
/// A column holds words; values are stored as their bits.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub struct Column([u32; Column::CAPACITY + MOST_LANES]);

impl Column {
    /// Number of things that a column has room for.
    pub const CAPACITY: usize = 64;

    /// The same value everywhere.
    #[inline(always)]
    pub const fn splat(value: f32) -> Self {
        Self([value.to_bits(); Self::CAPACITY + MOST_LANES])
    }

    /// The row of lanes that begins at `place`, or at the end of the capacity: there is room for
    /// one beyond.
    #[inline(always)]
    fn row(&self, place: usize) -> &[u32; LANES] {
        let start = place.min(Self::CAPACITY);
        let row = &self.0[start..start + LANES];
        row.first_chunk().expect("a slice of eight")
    }

    #[inline(always)]
    fn row_mut(&mut self, place: usize) -> &mut [u32; LANES] {
        let start = place.min(Self::CAPACITY);
        let row = &mut self.0[start..start + LANES];
        row.first_chunk_mut().expect("a slice of eight")
    }

    /// The values of things `place` to `place + 7`; `place` is at most the capacity.
    #[inline(always)]
    pub fn load<L: Lanes>(&self, place: usize) -> L {
        L::from_bits(self.load_words::<L>(place))
    }

    /// The words of things `place` to `place + 7`; `place` is at most the capacity.
    #[inline(always)]
    pub fn load_words<L: Lanes>(&self, place: usize) -> L::Words {
        L::Words::load(self.row(place))
    }

    /// As many values as there are lanes, from thing `place` on; `place` is at most the capacity.
    #[inline(always)]
    pub fn read<L: AnyLanes>(&self, place: usize) -> L {
        let start = place.min(Self::CAPACITY);
        L::read(&self.0[start..start + MOST_LANES])
    }

    /// Sets as many values as there are lanes, from thing `place` on; `place` is at most the
    /// capacity.
    #[inline(always)]
    pub fn write<L: AnyLanes>(&mut self, place: usize, values: L) {
        let start = place.min(Self::CAPACITY);
        values.write(&mut self.0[start..start + MOST_LANES]);
    }

    /// Sets the values of things `place` to `place + 7`; `place` is at most the capacity.
    #[inline(always)]
    pub fn store<L: Lanes>(&mut self, place: usize, values: L) {
        *self.row_mut(place) = values.to_bits().store();
    }

    /// Sets the values of thing `place` and those that follow to the lanes of the set bits of
    /// `mask`, in their order. Up to thing `place + 7` the others become unspecified. `place` is at
    /// most the capacity.
    #[inline(always)]
    pub fn store_compressed<L: Lanes>(&mut self, place: usize, values: L, mask: u32) {
        self.store(place, values.compress(mask));
    }

    /// [`Column::store_compressed`] of words.
    #[inline(always)]
    pub fn store_words_compressed<L: Lanes>(&mut self, place: usize, words: L::Words, mask: u32) {
        self.store_compressed(place, L::from_bits(words), mask);
    }

    /// The value of thing `index`, taken modulo the capacity.
    #[inline(always)]
    pub fn get(&self, index: usize) -> f32 {
        f32::from_bits(self.get_word(index))
    }

    /// The word of thing `index`, taken modulo the capacity.
    #[inline(always)]
    pub fn get_word(&self, index: usize) -> u32 {
        self.0[index % Self::CAPACITY]
    }

    /// Sets the value of thing `index`, taken modulo the capacity.
    #[inline(always)]
    pub fn set(&mut self, index: usize, value: f32) {
        self.set_word(index, value.to_bits());
    }

    /// Sets the word of thing `index`, taken modulo the capacity.
    #[inline(always)]
    pub fn set_word(&mut self, index: usize, word: u32) {
        self.0[index % Self::CAPACITY] = word;
    }
}
