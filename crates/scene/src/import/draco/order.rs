//! In which order the values of an attribute are stored: that in which a walk over the triangles
//! meets its vertices.

use super::corners::{Corners, NONE, next, previous};

/// The order of values.
pub(super) struct Order {
    /// By value, the corner at which its vertex was met.
    pub(super) corners: Vec<u32>,
    /// By vertex.
    pub(super) values: Vec<u32>,
}

impl Order {
    fn meet(&mut self, vertex: u32, corner: u32) -> bool {
        let value = &mut self.values[vertex as usize];
        let is_new = *value == NONE;
        if is_new {
            *value = self.corners.len() as u32;
            self.corners.push(corner);
        }
        is_new
    }
}

struct Walk<'a> {
    corners: &'a Corners,
    order: Order,
    is_visited: Vec<bool>,
}

impl<'a> Walk<'a> {
    fn new(corners: &'a Corners) -> Self {
        Self {
            corners,
            order: Order {
                corners: Vec::new(),
                values: vec![NONE; corners.leftmost.len()],
            },
            is_visited: vec![false; corners.triangle_count()],
        }
    }

    fn meet(&mut self, corner: u32) -> bool {
        self.order.meet(self.corners.vertex(corner), corner)
    }

    /// The corner across an edge, in a triangle that was not visited.
    fn fresh(&self, corner: u32) -> Option<u32> {
        let across = self.corners.across(corner)?;
        (!self.is_visited[across as usize / 3]).then_some(across)
    }

    fn is_visited(&self, corner: u32) -> bool {
        self.is_visited[corner as usize / 3]
    }
}

/// From each triangle in turn, to the right and to the left where both are possible.
pub(super) fn depth_first(corners: &Corners) -> Order {
    let mut walk = Walk::new(corners);
    let mut stack = Vec::new();
    for triangle in 0..corners.triangle_count() as u32 {
        let start = 3 * triangle;
        if walk.is_visited(start) {
            continue;
        }
        stack.push(start);
        walk.meet(next(start));
        walk.meet(previous(start));
        while let Some(mut corner) = stack.pop() {
            if walk.is_visited(corner) {
                continue;
            }
            loop {
                walk.is_visited[corner as usize / 3] = true;
                if walk.meet(corner) && !corners.is_at_boundary(corners.vertex(corner)) {
                    // Around a new vertex, all triangles are to come.
                    match corners.across(next(corner)) {
                        Some(right) => corner = right,
                        None => break,
                    }
                    continue;
                }
                let (right, left) = (walk.fresh(next(corner)), walk.fresh(previous(corner)));
                match (right, left) {
                    (Some(right), Some(left)) => {
                        stack.extend([left, right]);
                        break;
                    }
                    (Some(one), None) | (None, Some(one)) => corner = one,
                    (None, None) => break,
                }
            }
        }
    }
    walk.order
}

/// To triangles first whose last vertex has most neighbours that were met.
pub(super) fn by_degree(corners: &Corners) -> Order {
    let mut walk = Walk::new(corners);
    let mut degrees = vec![0_u32; corners.leftmost.len()];
    let mut stacks: [Vec<u32>; 3] = Default::default();
    for triangle in 0..corners.triangle_count() as u32 {
        let start = 3 * triangle;
        if walk.is_visited(start) {
            continue;
        }
        stacks[0].push(start);
        let mut best = 0;
        walk.meet(next(start));
        walk.meet(previous(start));
        walk.meet(start);
        while let Some(level) = (best..3).find(|&level| !stacks[level].is_empty()) {
            best = level;
            let Some(mut corner) = stacks[level].pop() else {
                break;
            };
            if walk.is_visited(corner) {
                continue;
            }
            loop {
                walk.is_visited[corner as usize / 3] = true;
                walk.meet(corner);
                let (right, left) = (walk.fresh(next(corner)), walk.fresh(previous(corner)));
                let mut priority = |walk: &Walk, corner: u32| {
                    let vertex = corners.vertex(corner) as usize;
                    if walk.order.values[vertex] != NONE {
                        return 0;
                    }
                    degrees[vertex] += 1;
                    if degrees[vertex] > 1 { 1 } else { 2 }
                };
                let mut go = None;
                if let Some(left) = left {
                    let level = priority(&walk, left);
                    if right.is_none() && level <= best {
                        go = Some(left);
                    } else {
                        stacks[level].push(left);
                        best = best.min(level);
                    }
                }
                if let Some(right) = right {
                    let level = priority(&walk, right);
                    if level <= best {
                        go = Some(right);
                    } else {
                        stacks[level].push(right);
                        best = best.min(level);
                    }
                }
                match go {
                    Some(next) => corner = next,
                    None => break,
                }
            }
        }
    }
    walk.order
}
