//! The traversal's stack: fixed, uninitialised until written, filled a row of lanes at a time.
//!
//! The crate's only module with `unsafe` code: clearing the stacks of the rays in flight for every
//! batch took 4 % of a render of the Cornell box.
#![allow(unsafe_code)]

use core::mem::MaybeUninit;
use lightshed_lanes::{AnyLanes, MOST_LANES};

/// Entries that a traversal may hold at once.
pub const STACK_CAPACITY: usize = 256;

/// Room for a whole row of lanes above the last entry.
const ROOM: usize = STACK_CAPACITY + MOST_LANES;

/// Memory of a [`Stack`]. Apart from its length, so that making one costs nothing.
pub struct StackMemory {
    /// Child references, as bits.
    children: [MaybeUninit<u32>; ROOM],
    entered: [MaybeUninit<f32>; ROOM],
}

impl StackMemory {
    /// Memory with nothing in it.
    #[inline(always)]
    pub const fn new() -> Self {
        Self {
            children: [const { MaybeUninit::uninit() }; ROOM],
            entered: [const { MaybeUninit::uninit() }; ROOM],
        }
    }
}

/// A stack of at most [`STACK_CAPACITY`] children still to be visited, each with the ray parameter
/// at which its box is entered. An overflow is a bug of the builder, and panics.
pub struct Stack<'a> {
    memory: &'a mut StackMemory,
    len: usize,
}

impl<'a> Stack<'a> {
    /// An empty stack.
    #[inline(always)]
    pub fn new(memory: &'a mut StackMemory) -> Self {
        Self { memory, len: 0 }
    }

    /// Forgets all entries.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Puts the children of the set bits of `mask` on top, in the order of the bits.
    #[inline(always)]
    pub fn push<M: AnyLanes>(&mut self, children: M, entered: M, mask: u32) {
        assert!(
            self.len <= STACK_CAPACITY,
            "the tree is deeper than its builder allows"
        );
        let (mut first, mut second) = ([0; MOST_LANES], [0; MOST_LANES]);
        children.compress(mask).write(&mut first);
        entered.compress(mask).write(&mut second);
        // SAFETY: `M::COUNT <= MOST_LANES` and `len + MOST_LANES <= ROOM`, so the rows lie within
        // the arrays; a copy initialises them, whatever was there.
        unsafe {
            let row = self.memory.children.as_mut_ptr().add(self.len);
            row.cast::<u32>()
                .copy_from_nonoverlapping(first.as_ptr(), M::COUNT);
            let row = self.memory.entered.as_mut_ptr().add(self.len);
            row.cast::<u32>()
                .copy_from_nonoverlapping(second.as_ptr(), M::COUNT);
        }
        self.len += mask.count_ones() as usize;
    }

    /// Takes the top entry: the child and where it is entered.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<(u32, f32)> {
        if self.len == 0 {
            return None;
        }
        self.len -= 1;
        // SAFETY: all entries below the old `len` have been written by `push` since `len` was last
        // zero, and `len` never exceeds the capacity by more than a row.
        unsafe {
            Some((
                self.memory.children.get_unchecked(self.len).assume_init(),
                self.memory.entered.get_unchecked(self.len).assume_init(),
            ))
        }
    }
}
