//! Items that go to a field together.

/// Passes items on, some at once, without allocation.
pub(crate) struct Together<T, F: FnMut(&[T])> {
    held: [T; TOGETHER],
    count: usize,
    pass_on: F,
}

/// Items that go to the field together.
const TOGETHER: usize = 16;

impl<T: Copy, F: FnMut(&[T])> Together<T, F> {
    /// `empty` is any item; none that was not pushed is passed on.
    #[inline]
    pub fn new(empty: T, pass_on: F) -> Self {
        Self {
            held: [empty; TOGETHER],
            count: 0,
            pass_on,
        }
    }

    #[inline]
    pub fn push(&mut self, item: T) {
        self.held[self.count] = item;
        self.count += 1;
        if self.count == TOGETHER {
            (self.pass_on)(&self.held);
            self.count = 0;
        }
    }

    /// Passes on what is left.
    #[inline]
    pub fn finish(mut self) {
        if self.count > 0 {
            (self.pass_on)(&self.held[..self.count]);
        }
    }
}
