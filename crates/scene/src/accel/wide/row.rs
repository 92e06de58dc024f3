//! Rows of a node: a number for each child.

/// As many words as a node has children, at an alignment at which lanes read them at once.
pub trait Row: Copy {
    /// Their number, that of the lanes which read the row.
    const COUNT: usize;
    /// Children for which an octant of a node has room. A child's slot is its octant, a bit an
    /// axis, times this, and its number in the octant by how far it lies along (1, 1, 1).
    const ROOM: usize = Self::COUNT / 8;

    /// The same word for each child.
    fn splat(word: u32) -> Self;
    fn words(&self) -> &[u32];
    fn words_mut(&mut self) -> &mut [u32];

    /// Exclusive-ors the slots to the order in which a ray meets them, the farthest first. Bit `a`
    /// of `octant` says whether the ray goes to the positive side of axis `a`, and `along`, 0 or 1,
    /// whether it goes along (1, 1, 1).
    #[inline(always)]
    fn flip(octant: u32, along: u32) -> u32 {
        let room = Self::ROOM as u32;
        octant * room + along % room
    }
}

macro_rules! rows {
    ($($name:ident $count:literal $align:literal $doc:literal),+) => {$(
        #[doc = $doc]
        #[derive(Clone, Copy, Debug)]
        #[repr(C, align($align))]
        pub struct $name([u32; $count]);

        impl Row for $name {
            const COUNT: usize = $count;
            #[inline(always)]
            fn splat(word: u32) -> Self {
                Self([word; $count])
            }
            #[inline(always)]
            fn words(&self) -> &[u32] {
                &self.0
            }
            #[inline(always)]
            fn words_mut(&mut self) -> &mut [u32] {
                &mut self.0
            }
        }
    )+};
}

rows! {
    Eight 8 32 "For eight children, one an octant.",
    Sixteen 16 64 "For sixteen children, two an octant."
}
