//! Samples from many threads.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Number of lists; threads usually have one each.
const LISTS: usize = 32;

static THREADS: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    /// Number of this thread among the recording ones.
    static THREAD: usize = THREADS.fetch_add(1, Ordering::Relaxed);
}

/// Collects samples from any number of threads at the same time. Their readers must not depend on
/// their order.
#[derive(Debug)]
pub(crate) struct Recorder<T> {
    lists: Vec<Mutex<Vec<T>>>,
}

impl<T> Default for Recorder<T> {
    fn default() -> Self {
        let lists = (0..LISTS).map(|_| Mutex::default()).collect();
        Self { lists }
    }
}

impl<T> Recorder<T> {
    /// Adds samples.
    #[inline]
    pub fn record(&self, samples: impl Iterator<Item = T>) {
        let list = &self.lists[THREAD.with(|number| *number) % LISTS];
        // A list is valid after each element: a panic elsewhere breaks nothing here.
        let mut list = list.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        list.extend(samples);
    }

    /// Samples that were recorded.
    pub fn count(&self) -> usize {
        let count = |list: &Mutex<Vec<T>>| list.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).len();
        self.lists.iter().map(count).sum()
    }

    /// Moves all samples behind those of `samples`, in any order.
    pub fn take(&mut self, samples: &mut Vec<T>) {
        for list in &mut self.lists {
            let list = list.get_mut().unwrap_or_else(|poisoned| poisoned.into_inner());
            samples.append(list);
        }
    }
}
