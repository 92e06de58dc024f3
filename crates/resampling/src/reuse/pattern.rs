//! Which pixels reuse from which: topologies of an image.

use super::topology::{Topology, for_each_within};

/// A grid of domains, stored row by row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Extent {
    /// How many domains.
    #[inline]
    pub fn len(self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Whether there is none.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// The index of a place, if it lies in the grid.
    #[inline]
    pub fn index(self, x: i64, y: i64) -> Option<usize> {
        let inside = x >= 0 && y >= 0 && x < i64::from(self.width) && y < i64::from(self.height);
        inside.then(|| y as usize * self.width as usize + x as usize)
    }

    /// The place of an index, column first.
    #[inline]
    pub fn place(self, index: usize) -> [i64; 2] {
        let width = self.width.max(1) as usize;
        [(index % width) as i64, (index / width) as i64]
    }
}

/// Why parameters give no pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PatternError {
    /// A radius must be positive and finite.
    Radius,
    /// At least one neighbour, and at most 65,536.
    Count,
    /// Block sides are powers of two from 2 to 32,768.
    Block,
}

impl core::fmt::Display for PatternError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Radius => "neighbour radius must be positive and finite",
            Self::Count => "neighbour count must lie between 1 and 65536",
            Self::Block => "block side must be a power of two between 2 and 32768",
        })
    }
}

impl core::error::Error for PatternError {}

/// The neighbours of a pixel. Neighbours beyond the grid's border are left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pattern(Kind);

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Window { radius: u32 },
    Disk { radius: f32, count: u32 },
    Rooks { side: u32 },
}

/// Places of a disk that are computed once.
const REMEMBERED: usize = 32;

/// The golden angle, `π (3 − √5)`: successive points of a Vogel spiral keep apart at any
/// count.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

impl Pattern {
    /// The square window of side `2 · radius + 1`, dense (Lin 2022 §B.7.1; radius 3 is the 7 × 7
    /// of fig. 6.6).
    ///
    /// # Errors
    /// [`PatternError::Count`] beyond 65,536 neighbours, or without any.
    pub fn window(radius: u32) -> Result<Self, PatternError> {
        if (1..=127).contains(&radius) {
            Ok(Self(Kind::Window { radius }))
        } else {
            Err(PatternError::Count)
        }
    }

    /// `count` places of a low-discrepancy disk (a Vogel spiral), turned by a random angle for each
    /// pixel; duplicates and the centre may fall out when the disk is small. Lin 2022 §6.7.3 takes
    /// 3 within 20 pixels in real time, §B.7.2 6 within 10 offline.
    ///
    /// # Errors
    /// [`PatternError`] for a radius or count out of range.
    pub const fn disk(radius: f32, count: u32) -> Result<Self, PatternError> {
        if !(radius > 0.0 && radius < f32::INFINITY) {
            Err(PatternError::Radius)
        } else if matches!(count, 1..=65_536) {
            Ok(Self(Kind::Disk { radius, count }))
        } else {
            Err(PatternError::Count)
        }
    }

    /// N-rooks tiles: squares of `side × side` pixels fall into `side` groups of `side` pixels, one
    /// in each row and column of the square; a group reuses among itself. The arrangement of path
    /// reuse (Bekaert et al. 2002, Lin 2022 §6.8.3 with 16 pixels), as a baseline.
    ///
    /// Pixels of a group have errors in common. So each square has rows in a random order of its
    /// own: groups of one shape in all squares would show as a regular texture.
    ///
    /// # Errors
    /// [`PatternError::Count`] unless `2 ≤ side ≤ 256`.
    pub const fn rooks_tiles(side: u32) -> Result<Self, PatternError> {
        if matches!(side, 2..=256) {
            Ok(Self(Kind::Rooks { side }))
        } else {
            Err(PatternError::Count)
        }
    }

    /// The neighbours of the pixels of an image, in the round with random bits `key`.
    #[inline]
    pub fn over(self, extent: Extent, key: u32) -> PixelNeighbours {
        PixelNeighbours {
            pattern: self,
            extent,
            key,
        }
    }

    /// An upper bound on the number of neighbours.
    pub fn max_neighbours(&self) -> usize {
        match self.0 {
            Kind::Window { radius } => (2 * radius as usize + 1).pow(2) - 1,
            Kind::Disk { count, .. } => count as usize,
            Kind::Rooks { side, .. } => side as usize - 1,
        }
    }

    /// Calls `visit` with the index of each neighbour of `pixel`, without `pixel` itself; no
    /// neighbour twice. `key` holds random bits, new for each round; how they differ between pixels
    /// is the pattern's own business.
    pub fn for_each(&self, extent: Extent, pixel: usize, key: u32, mut visit: impl FnMut(usize)) {
        let [x, y] = extent.place(pixel);
        match self.0 {
            Kind::Window { radius } => {
                for_each_within([extent.width, extent.height, 1], pixel, radius, visit);
            }
            Kind::Disk { radius, count } => {
                // In f64: where platforms' sines differ in the last place, rounding to pixels still
                // agrees.
                let turn =
                    f64::from(scramble(pixel as u32, key)) * (core::f64::consts::TAU / 4_294_967_296.0);
                let offset = |k: u32| {
                    let r = f64::from(radius) * ((f64::from(k) + 0.5) / f64::from(count)).sqrt();
                    let (sin, cos) = (turn + GOLDEN_ANGLE * f64::from(k)).sin_cos();
                    [(r * cos).round() as i64, (r * sin).round() as i64]
                };
                // Sines take long: the first places are remembered.
                let mut first = [[0; 2]; REMEMBERED];
                for k in 0..count {
                    let place = offset(k);
                    let known = (k as usize).min(REMEMBERED);
                    // Rounding can merge places; a neighbour taken twice would be one technique
                    // counted twice.
                    let is_new = !first[..known].contains(&place)
                        && (known as u32..k).all(|earlier| offset(earlier) != place);
                    if let Some(first) = first.get_mut(k as usize) {
                        *first = place;
                    }
                    let [dx, dy] = place;
                    let index = extent.index(x + dx, y + dy);
                    if let Some(index) = index.filter(|&index| index != pixel && is_new) {
                        visit(index);
                    }
                }
            }
            Kind::Rooks { side } => {
                let square = scramble(((y as u32 / side) << 16) | (x as u32 / side), key);
                let rows = rows_of_columns(side, square);
                let side = i64::from(side);
                let (column, row) = (x % side, y % side);
                let group = row - i64::from(rows[column as usize]);
                for other in 0..side {
                    let row_of_other = (group + i64::from(rows[other as usize])).rem_euclid(side);
                    let index = extent.index(x - column + other, y - row + row_of_other);
                    if let Some(index) = index.filter(|&index| index != pixel) {
                        visit(index);
                    }
                }
            }
        }
    }
}

/// A [`Pattern`] on an image, for one round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelNeighbours {
    pattern: Pattern,
    extent: Extent,
    key: u32,
}

impl Topology for PixelNeighbours {
    #[inline]
    fn max_neighbours(&self) -> usize {
        self.pattern.max_neighbours()
    }

    #[inline]
    fn for_each(&self, index: usize, visit: impl FnMut(usize)) {
        self.pattern.for_each(self.extent, index, self.key, visit);
    }
}

/// Pairs of pixels: the partner of a pixel's partner is the pixel. So one shift a pixel serves all
/// merges of a round (see [`Carried`](crate::Carried)).
///
/// Within blocks of a random offset, each pixel's coordinates are xor-ed with a random mask: one
/// exclusive or for each partner, the same on a GPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PairedPattern {
    block: u32,
}

impl PairedPattern {
    /// Partners within blocks of `block × block` pixels.
    ///
    /// # Errors
    /// [`PatternError::Block`] unless `block` is a power of two from 2 to 32,768.
    pub fn new(block: u32) -> Result<Self, PatternError> {
        if block.is_power_of_two() && (2..=32_768).contains(&block) {
            Ok(Self { block })
        } else {
            Err(PatternError::Block)
        }
    }

    /// The pairs of the pixels of an image, in the round with random bits `key`.
    #[inline]
    pub fn over(self, extent: Extent, key: u32) -> PixelPairs {
        PixelPairs {
            pattern: self,
            extent,
            key,
        }
    }

    /// The partner of `pixel` in the round with random bits `key`, the same for all pixels; `None`
    /// where it lies beyond the border.
    #[inline]
    pub fn partner(&self, extent: Extent, pixel: usize, key: u32) -> Option<usize> {
        let mask = self.block - 1;
        let (a, b) = (scramble(0, key), scramble(1, key));
        let (offset_x, offset_y) = (i64::from(a & mask), i64::from(a >> 16 & mask));
        let (mut flip_x, flip_y) = (i64::from(b & mask), i64::from(b >> 16 & mask));
        if flip_x == 0 && flip_y == 0 {
            flip_x = 1;
        }
        let [x, y] = extent.place(pixel);
        extent.index(
            ((x + offset_x) ^ flip_x) - offset_x,
            ((y + offset_y) ^ flip_y) - offset_y,
        )
    }
}

/// A [`PairedPattern`] on an image, for one round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelPairs {
    pattern: PairedPattern,
    extent: Extent,
    key: u32,
}

impl Topology for PixelPairs {
    #[inline]
    fn max_neighbours(&self) -> usize {
        1
    }

    #[inline]
    fn for_each(&self, index: usize, mut visit: impl FnMut(usize)) {
        if let Some(partner) = self.pattern.partner(self.extent, index, self.key) {
            visit(partner);
        }
    }
}

/// A random order of the rows of a square, by columns (Fisher and Yates).
fn rows_of_columns(side: u32, key: u32) -> [u8; 256] {
    let mut rows = std::array::from_fn(|row| row as u8);
    for last in (1..side).rev() {
        let other = scramble(last, key) % (last + 1);
        rows.swap(last as usize, other as usize);
    }
    rows
}

/// Random bits from an index and a key: two rounds of a 32-bit permutation (Jarzynski & Olano 2020,
/// the PCG output function).
#[inline]
fn scramble(index: u32, key: u32) -> u32 {
    let permute = |value: u32| {
        let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    };
    permute(index ^ permute(key))
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXTENT: Extent = Extent {
        width: 37,
        height: 29,
    };

    fn neighbours(pattern: Pattern, pixel: usize, key: u32) -> Vec<usize> {
        let mut found = Vec::new();
        pattern.for_each(EXTENT, pixel, key, |index| found.push(index));
        found
    }

    #[test]
    fn neighbours_are_distinct_in_the_grid_and_not_the_pixel() {
        let patterns = [
            Pattern::window(3).unwrap(),
            Pattern::disk(1.2, 9).unwrap(),
            Pattern::disk(20.0, 5).unwrap(),
            // More than are remembered.
            Pattern::disk(4.0, 90).unwrap(),
            Pattern::rooks_tiles(16).unwrap(),
        ];
        for pattern in patterns {
            for pixel in 0..EXTENT.len() {
                let mut found = neighbours(pattern, pixel, 99);
                assert!(found.len() <= pattern.max_neighbours());
                assert!(found.iter().all(|&index| index < EXTENT.len() && index != pixel));
                let count = found.len();
                found.sort_unstable();
                found.dedup();
                assert_eq!(found.len(), count, "{pattern:?}");
            }
        }
    }

    #[test]
    fn the_window_is_dense() {
        let centre = EXTENT.index(18, 14).unwrap();
        assert_eq!(neighbours(Pattern::window(3).unwrap(), centre, 0).len(), 48);
        assert_eq!(neighbours(Pattern::window(3).unwrap(), 0, 0).len(), 15);
    }

    #[test]
    fn rooks_groups_are_symmetric_and_hold_one_pixel_a_row_and_column() {
        let pattern = Pattern::rooks_tiles(16).unwrap();
        let extent = Extent {
            width: 32,
            height: 32,
        };
        for key in [0, 1, 7] {
            for pixel in 0..extent.len() {
                let mut group = vec![pixel];
                pattern.for_each(extent, pixel, key, |index| group.push(index));
                assert_eq!(group.len(), 16);
                for axis in [0, 1] {
                    let mut places: Vec<i64> = group.iter().map(|&i| extent.place(i)[axis]).collect();
                    places.sort_unstable();
                    let first = places[0] / 16 * 16;
                    assert!(places.into_iter().eq(first..first + 16));
                }
                for &other in &group[1..] {
                    let mut back = Vec::new();
                    pattern.for_each(extent, other, key, |index| back.push(index));
                    assert!(back.contains(&pixel));
                }
            }
        }
    }

    /// Over many squares a pixel meets all others equally often, as the same offset again and again
    /// would show. Chi-square; 4,000 keys are fixed, and a correct implementation would fail for
    /// one choice of them in a million.
    #[test]
    fn rooks_meet_all_pixels_of_the_square() {
        let pattern = Pattern::rooks_tiles(16).unwrap();
        let extent = Extent {
            width: 48,
            height: 48,
        };
        let keys = 4000;
        for place in [[16, 16], [21, 26]] {
            let pixel = extent.index(place[0], place[1]).unwrap();
            let mut met = vec![0_u32; extent.len()];
            for key in 0..keys {
                pattern.for_each(extent, pixel, key, |other| met[other] += 1);
            }
            let (mut chi_square, mut cells) = (0.0, 0);
            for (other, count) in met.into_iter().enumerate() {
                let [x, y] = extent.place(other);
                let square = (16..32).contains(&x) && (16..32).contains(&y);
                if !square || x == place[0] || y == place[1] {
                    assert_eq!(count, 0);
                    continue;
                }
                let expected = f64::from(keys) / 15.0;
                chi_square += (f64::from(count) - expected).powi(2) / expected;
                cells += 1;
            }
            // A random order: 15 columns of 14 degrees of freedom each, mean 210 and standard
            // deviation 20.
            assert!(cells == 225 && chi_square < 320.0, "{chi_square}");
        }
    }

    #[test]
    fn the_partner_of_the_partner_is_the_pixel() {
        let pattern = PairedPattern::new(16).unwrap();
        let mut paired = 0;
        for key in 0..50 {
            for pixel in 0..EXTENT.len() {
                let Some(partner) = pattern.partner(EXTENT, pixel, key) else {
                    continue;
                };
                assert_ne!(partner, pixel);
                assert_eq!(pattern.partner(EXTENT, partner, key), Some(pixel));
                paired += 1;
            }
        }
        assert!(
            paired > 50 * EXTENT.len() / 2,
            "most pixels have partners: {paired}"
        );
    }

    #[test]
    fn parameters_out_of_range_are_refused() {
        assert_eq!(Pattern::disk(f32::NAN, 3), Err(PatternError::Radius));
        assert_eq!(Pattern::disk(3.0, 0), Err(PatternError::Count));
        assert_eq!(Pattern::window(0), Err(PatternError::Count));
        assert_eq!(Pattern::rooks_tiles(1), Err(PatternError::Count));
        assert_eq!(PairedPattern::new(12), Err(PatternError::Block));
    }
}
