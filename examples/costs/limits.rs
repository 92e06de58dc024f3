//! What the machine itself costs.

use crate::results::Cost;
use std::collections::BTreeMap;

/// Times in nanoseconds, from the benches `limits` and of parts that others are made of.
pub struct Limits<'a> {
    costs: &'a BTreeMap<String, Cost>,
    word: f64,
}

impl<'a> Limits<'a> {
    pub fn of(costs: &'a BTreeMap<String, Cost>) -> Result<Self, String> {
        let random = costs.iter().find(|(id, _)| id.starts_with("limits/random_word/"));
        let (_, word) = random.ok_or("the bench `limits` has not run")?;
        Ok(Self {
            costs,
            word: word.nanoseconds,
        })
    }

    /// So many words of random numbers.
    pub fn words(&self, count: f64) -> f64 {
        self.word * count
    }

    /// A read from a working set of so many bytes whose address the read before has given.
    pub fn waiting_read(&self, bytes: f64) -> f64 {
        self.of_memory("limits/read_dependent/", bytes)
    }

    /// A read from a working set of so many bytes that need not wait for others.
    pub fn read(&self, bytes: f64) -> f64 {
        self.of_memory("limits/read_independent/", bytes)
    }

    /// A copy of so many bytes within a working set.
    pub fn copy(&self, bytes: f64, working_set: f64) -> f64 {
        bytes * self.of_memory("limits/copy/", working_set)
    }

    /// Another benchmark.
    pub fn part(&self, id: &str) -> Option<f64> {
        Some(self.costs.get(id)?.nanoseconds)
    }

    /// The least measured memory that holds the working set, else the largest.
    fn of_memory(&self, what: &str, bytes: f64) -> f64 {
        let measured = || {
            self.costs
                .iter()
                .filter(|(id, _)| id.starts_with(what))
                .map(|(_, cost)| cost)
        };
        let fitting = measured().filter(|cost| cost.size >= bytes);
        let by_size = |a: &&Cost, b: &&Cost| a.size.total_cmp(&b.size);
        let found = fitting.min_by(by_size).or_else(|| measured().max_by(by_size));
        found.map_or(f64::NAN, |cost| cost.nanoseconds)
    }
}
