//! The traversal's stack: fixed, uninitialised until written.
//!
//! One of the crate's two modules with `unsafe` code: zeroing the two kilobytes for every ray costs a few per cent
//! of a short ray's time.
#![allow(unsafe_code)]

use core::mem::MaybeUninit;

/// Entries that a traversal may hold at once.
pub const STACK_CAPACITY: usize = 256;

/// A child still to be visited.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Child reference.
    pub child: u32,
    /// Ray parameter at which its box is entered.
    pub t_near: f32,
}

/// A stack of at most [`STACK_CAPACITY`] entries; what does not fit is a bug of the builder, and panics.
pub struct Stack {
    entries: [MaybeUninit<Entry>; STACK_CAPACITY],
    len: usize,
}

impl Stack {
    /// An empty stack.
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            entries: [const { MaybeUninit::uninit() }; STACK_CAPACITY],
            len: 0,
        }
    }

    /// Number of entries.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Puts an entry on top.
    #[inline(always)]
    pub fn push(&mut self, entry: Entry) {
        self.entries[self.len] = MaybeUninit::new(entry);
        self.len += 1;
    }

    /// Takes the top entry.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<Entry> {
        if self.len == 0 {
            return None;
        }
        self.len -= 1;
        // SAFETY: entries below the old `len` have been written by `push`.
        Some(unsafe { self.entries[self.len].assume_init() })
    }

    /// Sorts the entries from `start` on so that the nearest is on top.
    #[inline(always)]
    pub fn sort_from(&mut self, start: usize) {
        // SAFETY: entries below `len` have been written by `push`, and the slice ends there.
        let entries = unsafe { self.entries[start..self.len].assume_init_mut() };
        for i in 1..entries.len() {
            let entry = entries[i];
            let mut j = i;
            while j > 0 && entries[j - 1].t_near < entry.t_near {
                entries[j] = entries[j - 1];
                j -= 1;
            }
            entries[j] = entry;
        }
    }
}
