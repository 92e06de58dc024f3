//! Rows of a node: a number for each child.

/// As many words as a node has children, at an alignment at which lanes read them at once.
pub trait Row: Copy {
    /// Their number, a power of two: that of the lanes which read the row.
    const COUNT: usize;
    /// The same word for each child.
    fn splat(word: u32) -> Self;
    fn words(&self) -> &[u32];
    fn words_mut(&mut self) -> &mut [u32];
    /// Exclusive-ors the slots to the order in which a ray meets them, the farthest first. The
    /// upper bits of a slot are the octant of the node in which the child lies, a bit an axis; two
    /// children of an octant are told apart by how far they lie along (1, 1, 1). Bit `a` of
    /// `octant` says whether the ray goes to the positive side of axis `a`, and `along`, 0 or 1,
    /// whether it goes along (1, 1, 1).
    fn flip(octant: u32, along: u32) -> u32;
}

/// For eight children, one an octant.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Eight([u32; 8]);

/// For sixteen children, two an octant.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Sixteen([u32; 16]);

impl Row for Eight {
    const COUNT: usize = 8;
    #[inline(always)]
    fn splat(word: u32) -> Self {
        Self([word; 8])
    }
    #[inline(always)]
    fn words(&self) -> &[u32] {
        &self.0
    }
    #[inline(always)]
    fn words_mut(&mut self) -> &mut [u32] {
        &mut self.0
    }
    #[inline(always)]
    fn flip(octant: u32, _: u32) -> u32 {
        octant
    }
}

impl Row for Sixteen {
    const COUNT: usize = 16;
    #[inline(always)]
    fn splat(word: u32) -> Self {
        Self([word; 16])
    }
    #[inline(always)]
    fn words(&self) -> &[u32] {
        &self.0
    }
    #[inline(always)]
    fn words_mut(&mut self) -> &mut [u32] {
        &mut self.0
    }
    #[inline(always)]
    fn flip(octant: u32, along: u32) -> u32 {
        octant << 1 | along
    }
}
