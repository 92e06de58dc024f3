//! The assignment of random numbers to the vertices of a path.

use lightshed_sampling::{CounterRng, PathSeed};

/// Words reserved for each vertex.
const WORDS: u32 = 8;

/// The random numbers of a path, vertex by vertex, so that replay can start anywhere. Roulette has
/// its own word, which replay never reads.
#[derive(Clone, Debug)]
pub(crate) struct PathNumbers(CounterRng);

/// Numbers that scatter a path.
pub(crate) struct ScatterNumbers {
    pub lobe: f32,
    pub direction: [f32; 2],
}

impl PathNumbers {
    pub fn new(seed: PathSeed) -> Self {
        Self(seed.stream())
    }

    fn at(&mut self, vertex: u32, word: u32) -> &mut CounterRng {
        self.0.set_dimension(vertex * WORDS + word);
        &mut self.0
    }

    /// Numbers of the position on a sensor and on its lens.
    #[inline]
    pub fn sensor(&mut self) -> [f32; 4] {
        let rng = self.at(0, 0);
        let ([a, b], [c, d]) = (rng.next_2d(), rng.next_2d());
        [a, b, c, d]
    }

    /// Numbers of the lobe and the direction at `x_vertex`.
    #[inline]
    pub fn scatter(&mut self, vertex: u32) -> ScatterNumbers {
        let rng = self.at(vertex, 4);
        ScatterNumbers {
            lobe: rng.next_f32(),
            direction: rng.next_2d(),
        }
    }

    /// Numbers of the emitter and the position on it, selected at `x_vertex`.
    #[inline]
    pub fn emitter(&mut self, vertex: u32) -> (u64, [f32; 2]) {
        let rng = self.at(vertex, 0);
        (rng.next_u64(), rng.next_2d())
    }

    /// Of roulette at `x_vertex`.
    #[inline]
    pub fn roulette(&mut self, vertex: u32) -> f32 {
        self.at(vertex, 7).next_f32()
    }
}
