//! N distinct items from one stream.

use crate::choose::uniform_positive;
use rand::Rng;

/// `N` distinct items out of a stream, drawn one after the other in proportion to weight, in one
/// pass.
///
/// Each item gets a key `e_i ~ Exp(w_i)`; the `N` smallest keys win (Efraimidis & Spirakis 2006, in
/// the logarithmic form). Instead of drawing every key, the pass *jumps*: with `τ` the largest key
/// kept, the weight to skip until the next smaller key is `Exp(1)/τ`, and that item's key follows
/// its exponential law cut off at `τ`. So `O(N log(M/N))` random numbers are drawn.
///
/// With `τ` the `(N+1)`-th smallest key, each item kept had the chance
/// `π_i = 1 − exp(−w_i τ)`, the others' keys given, so
///
/// > `Σ_{i kept} f(x_i) / π_i`  estimates  `Σ_i f(x_i)` over the whole stream without bias
///
/// (Cohen & Kaplan 2007, bottom-k sketches). For RIS with `w_i = m_i p̂(X_i) W_i` the sum over the
/// kept of `f(X_i) m_i W_i / π_i` estimates `∫ f`: no duplicates, so less variance than
/// [`Selections`](crate::Selections) when few candidates dominate.
#[derive(Clone, Debug)]
pub struct WithoutReplacement<X> {
    /// A max-heap by key of at most `capacity + 1` entries: those kept, and the one whose key is
    /// `τ`.
    heap: Vec<Entry<X>>,
    capacity: usize,
    /// Weight still to be skipped, once the heap is full.
    jump: f64,
    weight_sum: f64,
}

#[derive(Clone, Debug)]
struct Entry<X> {
    key: f64,
    weight: f64,
    item: X,
}

/// One item of a sample without replacement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept<'a, X> {
    /// The item.
    pub item: &'a X,
    /// The weight it was offered with.
    pub weight: f64,
    /// `π_i` in (0, 1]: its chance to be kept, the other keys given. Divide by it in estimates.
    pub inclusion: f64,
}

impl<X> WithoutReplacement<X> {
    /// Room for `capacity` items (`N`); allocates once. With `capacity` 0 nothing is ever kept.
    pub fn new(capacity: usize) -> Self {
        Self {
            heap: Vec::with_capacity(capacity + 1),
            capacity,
            jump: 0.0,
            weight_sum: 0.0,
        }
    }

    /// Offers an item; true if it is kept for now. Weights that are zero, negative or not finite
    /// are never kept.
    pub fn offer<R: Rng + ?Sized>(&mut self, item: X, weight: f64, rng: &mut R) -> bool {
        // Also false for NaN.
        if !(weight > 0.0 && weight < f64::INFINITY) {
            return false;
        }
        self.weight_sum = (self.weight_sum + weight).min(f64::MAX);
        if self.heap.len() <= self.capacity {
            let key = exponential(rng, weight);
            self.insert(Entry { key, weight, item }, rng);
            return true;
        }
        self.jump -= weight;
        if self.jump >= 0.0 {
            return false;
        }
        // Exp(weight) given that it is below τ, by inversion; expm1 and ln_1p because weight · τ
        // may be tiny.
        let tau = self.heap[0].key;
        let key = -(uniform_positive(rng) * (-weight * tau).exp_m1()).ln_1p() / weight;
        // Rounding may lead past τ, and to 0/0 where weight · τ underflows.
        let key = if key < tau { key } else { tau };
        self.heap[0] = Entry { key, weight, item };
        self.sift_down(0);
        self.draw_jump(rng);
        true
    }

    /// Appends another stream's sample, as if its items had been offered here. Keys are kept, so
    /// only the next jump needs a random number. Capacities should agree; the smaller one limits
    /// what is exact.
    pub fn merge<R: Rng + ?Sized>(&mut self, other: Self, rng: &mut R) {
        self.weight_sum = (self.weight_sum + other.weight_sum).min(f64::MAX);
        for entry in other.heap {
            if self.heap.len() <= self.capacity {
                self.insert(entry, rng);
            } else if entry.key < self.heap[0].key {
                self.heap[0] = entry;
                self.sift_down(0);
            }
        }
        if self.heap.len() > self.capacity {
            self.draw_jump(rng);
        }
    }

    /// The items kept, in no particular order, with their inclusion probabilities; fewer than `N`
    /// while the stream was shorter.
    pub fn iter(&self) -> impl Iterator<Item = Kept<'_, X>> {
        let full = self.heap.len() > self.capacity;
        let tau = if full { self.heap[0].key } else { f64::INFINITY };
        self.heap.iter().skip(usize::from(full)).map(move |entry| Kept {
            item: &entry.item,
            weight: entry.weight,
            // At least the smallest positive number: weight · τ may underflow.
            inclusion: (-(-entry.weight * tau).exp_m1()).max(f64::MIN_POSITIVE),
        })
    }

    /// How many items are kept.
    pub fn len(&self) -> usize {
        self.heap.len().min(self.capacity)
    }

    /// Whether nothing is kept.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// `Σ w` over the whole stream, of positive finite weights.
    pub fn weight_sum(&self) -> f64 {
        self.weight_sum
    }

    fn insert<R: Rng + ?Sized>(&mut self, entry: Entry<X>, rng: &mut R) {
        self.heap.push(entry);
        let mut child = self.heap.len() - 1;
        while child > 0 {
            let parent = (child - 1) / 2;
            if self.heap[child].key <= self.heap[parent].key {
                break;
            }
            self.heap.swap(child, parent);
            child = parent;
        }
        if self.heap.len() > self.capacity {
            self.draw_jump(rng);
        }
    }

    fn sift_down(&mut self, mut parent: usize) {
        loop {
            let (left, right) = (2 * parent + 1, 2 * parent + 2);
            let mut largest = parent;
            for child in [left, right] {
                if child < self.heap.len() && self.heap[child].key > self.heap[largest].key {
                    largest = child;
                }
            }
            if largest == parent {
                return;
            }
            self.heap.swap(parent, largest);
            parent = largest;
        }
    }

    /// The exponential law has no memory, so a jump may be drawn anew whenever `τ` changed.
    fn draw_jump<R: Rng + ?Sized>(&mut self, rng: &mut R) {
        self.jump = exponential(rng, self.heap[0].key);
    }
}

/// `Exp(rate)`, finite.
#[inline]
fn exponential<R: Rng + ?Sized>(rng: &mut R, rate: f64) -> f64 {
    let value = -uniform_positive(rng).ln() / rate;
    // 0/0 and overflow for vanishing rates.
    if value < f64::MAX { value } else { f64::MAX }
}
