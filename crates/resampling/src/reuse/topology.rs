//! Which domains reuse from which.

/// The neighbours of a domain, by index: those it reuses from.
///
/// # Laws
/// * Neighbours may depend on the index, on the *domains* and on random bits, never on samples:
///   choosing neighbours by what they hold would be bias.
/// * No index is its own neighbour, and none is visited twice: that would be one technique counted
///   twice.
///
/// Patterns of pixels on an extent ([`Pattern::over`](crate::Pattern::over)), pairs of pixels
/// ([`PairedPattern::over`](crate::PairedPattern::over)), [`CellGrid`] and [`NeighbourLists`] are
/// topologies.
pub trait Topology: Sync {
    /// An upper bound on the number of neighbours of any index.
    fn max_neighbours(&self) -> usize;

    /// Calls `visit` with each neighbour of `index`.
    fn for_each(&self, index: usize, visit: impl FnMut(usize));

    /// Those neighbours alone for which `keep(index, neighbour)` holds: domains that resemble each
    /// other, say.
    fn filtered<F: Fn(usize, usize) -> bool + Sync>(self, keep: F) -> Filtered<Self, F>
    where
        Self: Sized,
    {
        Filtered { topology: self, keep }
    }
}

impl<T: Topology> Topology for &T {
    #[inline]
    fn max_neighbours(&self) -> usize {
        (**self).max_neighbours()
    }

    #[inline]
    fn for_each(&self, index: usize, visit: impl FnMut(usize)) {
        (**self).for_each(index, visit);
    }
}

/// See [`Topology::filtered`].
#[derive(Clone, Copy, Debug)]
pub struct Filtered<T, F> {
    topology: T,
    keep: F,
}

impl<T: Topology, F: Fn(usize, usize) -> bool + Sync> Topology for Filtered<T, F> {
    #[inline]
    fn max_neighbours(&self) -> usize {
        self.topology.max_neighbours()
    }

    #[inline]
    fn for_each(&self, index: usize, mut visit: impl FnMut(usize)) {
        self.topology.for_each(index, |neighbour| {
            if (self.keep)(index, neighbour) {
                visit(neighbour);
            }
        });
    }
}

/// At most one neighbour each.
pub(super) struct AtMostOne<F>(pub F);

impl<F: Fn(usize) -> Option<usize> + Sync> Topology for AtMostOne<F> {
    fn max_neighbours(&self) -> usize {
        1
    }

    #[inline(always)]
    fn for_each(&self, index: usize, visit: impl FnMut(usize)) {
        (self.0)(index).into_iter().for_each(visit);
    }
}

/// Why a topology is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TopologyError {
    /// The domain with this index is listed as its own neighbour.
    Itself(usize),
    /// The domain with this index lists a neighbour twice.
    Twice(usize),
    /// The domain with this index lists a neighbour that does not exist.
    Beyond(usize),
    /// More than 2³² − 1 domains or neighbours.
    Size,
    /// A radius of 0, or above 127.
    Radius,
}

impl core::fmt::Display for TopologyError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Itself(index) => write!(f, "domain {index} is listed as its own neighbour"),
            Self::Twice(index) => write!(f, "domain {index} lists a neighbour twice"),
            Self::Beyond(index) => write!(f, "domain {index} lists a neighbour that does not exist"),
            Self::Size => f.write_str("domains and neighbours must number less than 2^32"),
            Self::Radius => f.write_str("a radius in cells must lie between 1 and 127"),
        }
    }
}

impl core::error::Error for TopologyError {}

/// Neighbours listed for each domain: any graph, also a directed one.
///
/// ```
/// use lightshed_resampling::{NeighbourLists, Topology};
/// // A chain of four domains.
/// let chain = NeighbourLists::new([vec![1], vec![0, 2], vec![1, 3], vec![2]])?;
/// let mut found = Vec::new();
/// chain.for_each(2, |neighbour| found.push(neighbour));
/// assert_eq!(found, [1, 3]);
/// # Ok::<(), lightshed_resampling::TopologyError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NeighbourLists {
    /// Where the list of each domain ends.
    ends: Vec<u32>,
    neighbours: Vec<u32>,
    most: usize,
}

impl NeighbourLists {
    /// One list for each domain.
    ///
    /// # Errors
    /// [`TopologyError`] for lists that break the laws of [`Topology`].
    pub fn new<L: IntoIterator<Item = usize>>(
        lists: impl IntoIterator<Item = L>,
    ) -> Result<Self, TopologyError> {
        let (mut ends, mut neighbours, mut most) = (Vec::new(), Vec::new(), 0);
        let mut sorted = Vec::new();
        for (index, list) in lists.into_iter().enumerate() {
            let first = neighbours.len();
            for neighbour in list {
                if neighbour == index {
                    return Err(TopologyError::Itself(index));
                }
                neighbours.push(u32::try_from(neighbour).map_err(|_| TopologyError::Size)?);
            }
            sorted.clear();
            sorted.extend_from_slice(&neighbours[first..]);
            sorted.sort_unstable();
            if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
                return Err(TopologyError::Twice(index));
            }
            most = most.max(sorted.len());
            ends.push(u32::try_from(neighbours.len()).map_err(|_| TopologyError::Size)?);
        }
        let lists = Self {
            ends,
            neighbours,
            most,
        };
        for index in 0..lists.ends.len() {
            if lists.list(index).iter().any(|&n| n as usize >= lists.ends.len()) {
                return Err(TopologyError::Beyond(index));
            }
        }
        Ok(lists)
    }

    /// None for an index out of range.
    fn list(&self, index: usize) -> &[u32] {
        let Some(&end) = self.ends.get(index) else {
            return &[];
        };
        let start = index.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.neighbours[start as usize..end as usize]
    }
}

impl Topology for NeighbourLists {
    #[inline]
    fn max_neighbours(&self) -> usize {
        self.most
    }

    #[inline]
    fn for_each(&self, index: usize, mut visit: impl FnMut(usize)) {
        for &neighbour in self.list(index) {
            visit(neighbour as usize);
        }
    }
}

/// Cells of a regular grid in space, stored with the first axis fastest: the neighbours of a cell
/// are all those within `radius` cells along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellGrid {
    shape: [u32; 3],
    radius: u32,
}

impl CellGrid {
    /// A grid with `shape[a]` cells along axis `a`; 1 along the last for cells of a plane.
    ///
    /// # Errors
    /// [`TopologyError::Radius`], or [`TopologyError::Size`] for too many cells.
    pub fn new(shape: [u32; 3], radius: u32) -> Result<Self, TopologyError> {
        if !(1..=127).contains(&radius) {
            return Err(TopologyError::Radius);
        }
        let [x, y, z] = shape.map(u64::from);
        let count = x.checked_mul(y).and_then(|plane| plane.checked_mul(z));
        match count {
            Some(count) if count <= u64::from(u32::MAX) => Ok(Self { shape, radius }),
            _ => Err(TopologyError::Size),
        }
    }
}

impl Topology for CellGrid {
    #[inline]
    fn max_neighbours(&self) -> usize {
        let within = self.shape.map(|cells| cells.min(2 * self.radius + 1) as usize);
        within.into_iter().product::<usize>().saturating_sub(1)
    }

    #[inline]
    fn for_each(&self, index: usize, visit: impl FnMut(usize)) {
        for_each_within(self.shape, index, self.radius, visit);
    }
}

/// Visits the cells of a grid within `radius` cells of cell `index` along each axis, but not that
/// cell.
#[inline]
pub(super) fn for_each_within(shape: [u32; 3], index: usize, radius: u32, mut visit: impl FnMut(usize)) {
    let [width, height, depth] = shape.map(|cells| cells as usize);
    let (row, plane) = (width.max(1), (width * height).max(1));
    let place = [index % row, index % plane / row, index / plane];
    let range = |axis: usize, cells: usize| {
        let (at, radius) = (place[axis], radius as usize);
        at.saturating_sub(radius)..cells.min(at + radius + 1)
    };
    for z in range(2, depth) {
        for y in range(1, height) {
            for x in range(0, width) {
                let cell = z * plane + y * row + x;
                if cell != index {
                    visit(cell);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn neighbours(topology: &impl Topology, index: usize) -> Vec<usize> {
        let mut found = Vec::new();
        topology.for_each(index, |neighbour| found.push(neighbour));
        found
    }

    #[test]
    fn lists_that_break_a_law_are_refused() {
        let lists = |lists: [&[usize]; 2]| NeighbourLists::new(lists.map(|list| list.to_vec()));
        assert_eq!(lists([&[1], &[1]]), Err(TopologyError::Itself(1)));
        assert_eq!(lists([&[1, 1], &[]]), Err(TopologyError::Twice(0)));
        assert_eq!(lists([&[1], &[2]]), Err(TopologyError::Beyond(1)));
        let fine = lists([&[1], &[]]).unwrap();
        assert_eq!((neighbours(&fine, 0), neighbours(&fine, 1)), (vec![1], vec![]));
        assert_eq!((neighbours(&fine, 9), fine.max_neighbours()), (vec![], 1));
    }

    /// Against the definition, cell by cell.
    #[test]
    fn cells_reach_as_far_as_the_radius_along_each_axis() {
        let shape = [4, 3, 5];
        let place = |cell: usize| [cell % 4, cell / 4 % 3, cell / 12];
        for radius in [1, 2, 9] {
            let grid = CellGrid::new(shape, radius).unwrap();
            for cell in 0..60 {
                let near = |other: &usize| {
                    let (a, b) = (place(cell), place(*other));
                    *other != cell && (0..3).all(|axis| a[axis].abs_diff(b[axis]) <= radius as usize)
                };
                let expected: Vec<usize> = (0..60).filter(near).collect();
                assert_eq!(neighbours(&grid, cell), expected);
                assert!(expected.len() <= grid.max_neighbours());
            }
        }
        assert_eq!(CellGrid::new(shape, 0), Err(TopologyError::Radius));
        assert_eq!(CellGrid::new([1 << 16; 3], 1), Err(TopologyError::Size));
    }

    #[test]
    fn what_is_filtered_out_is_no_neighbour() {
        let grid = CellGrid::new([5, 1, 1], 2).unwrap();
        let up = grid.filtered(|own, other| other > own);
        assert_eq!(neighbours(&up, 2), [3, 4]);
        assert_eq!(neighbours(&&up, 4), []);
    }
}
