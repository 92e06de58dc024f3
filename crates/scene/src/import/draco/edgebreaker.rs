//! Triangles by Edgebreaker (Rossignac 1999), decoded backwards as Isenburg and Snoeyink (2001)
//! do: each symbol says how the next triangle is attached to the active edge.

use super::bits::{Bits, Reader};
use super::corners::{Corners, NONE, next, previous};
use super::symbol::Symbol;
use super::valence::Valences;
use super::{Connectivity, EdgebreakerCorners, Fault, INVALID, Spend};
use crate::import::limits::LoadResource;
use std::collections::HashMap;

/// Where a part that was cut off is attached later.
struct SplitEvent {
    source: u32,
    split: u32,
    is_right: bool,
}

/// Where symbols come from.
enum Symbols<'a> {
    Plain(Bits<'a>),
    ByValence(Valences),
}

impl Symbols<'_> {
    fn next(&mut self) -> Result<Symbol, Fault> {
        match self {
            Self::Plain(bits) => {
                if bits.take(1)? == 0 {
                    return Ok(Symbol::Close);
                }
                let symbols = [Symbol::Split, Symbol::Left, Symbol::Right, Symbol::End];
                Ok(symbols[bits.take(2)? as usize])
            }
            Self::ByValence(valences) => valences.next(),
        }
    }
}

pub(super) fn decode(reader: &mut Reader, spend: &Spend) -> Result<Connectivity, Fault> {
    let method = reader.u8()?;
    let (vertex_count, triangle_count) = (reader.variable()?, reader.variable()?);
    let data_count = usize::from(reader.u8()?);
    let (symbol_count, split_count) = (reader.variable()?, reader.variable()?);
    if symbol_count > triangle_count || triangle_count > u32::MAX / 4 || split_count > symbol_count {
        return Err(INVALID.into());
    }
    // Corners may all become points, and are kept for each of the attributes.
    spend(
        LoadResource::Bytes,
        36 * u64::from(triangle_count) * (1 + data_count as u64),
    )?;
    let most_vertices = vertex_count.saturating_add(split_count) as usize;
    let events = events(reader, triangle_count)?;
    let plain = (method == 0).then(|| reader.sized()).transpose()?;
    let mut starts = reader.coded_bits()?;
    let mut seams = Vec::with_capacity(data_count);
    for _ in 0..data_count {
        seams.push(reader.coded_bits()?);
    }
    let symbols = match (plain, method) {
        (Some(bytes), _) => Symbols::Plain(Bits::new(bytes)),
        (None, 2) => Symbols::ByValence(Valences::read(reader, triangle_count, spend)?),
        _ => return Err("an unknown form of Edgebreaker".into()),
    };
    let mut builder = Builder {
        base: Corners::of_triangles(triangle_count as usize),
        triangle_count: 0,
        symbols,
        active: Vec::new(),
        events,
        split_off: HashMap::new(),
        steps: 0,
    };
    for symbol in 0..symbol_count {
        builder.attach(symbol, symbol_count)?;
        if builder.base.leftmost.len() > most_vertices {
            return Err(INVALID.into());
        }
    }
    while let Some(corner) = builder.active.pop() {
        if starts.next() {
            builder.close_last(corner)?;
        }
    }
    if builder.triangle_count != triangle_count || builder.base.vertex.contains(&NONE) {
        return Err(INVALID.into());
    }
    let base = builder.base;
    let mut cut = Vec::with_capacity(data_count);
    for is_cut in cuts(&base, &mut seams) {
        let corners = base.cut(&is_cut);
        if corners.vertex.contains(&NONE) {
            return Err(INVALID.into());
        }
        cut.push(corners);
    }
    points(base, cut)
}

/// Events in the order of the file.
fn events(reader: &mut Reader, most: u32) -> Result<Vec<SplitEvent>, Fault> {
    let count = reader.variable()?;
    if count > most || count as usize > reader.left() {
        return Err(INVALID.into());
    }
    let mut events = Vec::with_capacity(count as usize);
    let mut source = 0_u32;
    for _ in 0..count {
        source = source.checked_add(reader.variable()?).ok_or(INVALID)?;
        let split = source.checked_sub(reader.variable()?).ok_or(INVALID)?;
        events.push(SplitEvent {
            source,
            split,
            is_right: false,
        });
    }
    if count > 0 {
        let mut bits = reader.bits();
        for event in &mut events {
            event.is_right = bits.take(1)? == 1;
        }
        reader.skip_bits(&bits)?;
    }
    Ok(events)
}

struct Builder<'a> {
    base: Corners,
    triangle_count: u32,
    symbols: Symbols<'a>,
    /// Corners opposite to active edges.
    active: Vec<u32>,
    events: Vec<SplitEvent>,
    /// By symbol the active edge that it joins.
    split_off: HashMap<u32, u32>,
    /// Corners visited by merging vertices.
    steps: u64,
}

impl Builder<'_> {
    /// The first corner of a new triangle.
    fn triangle(&mut self) -> Result<u32, Fault> {
        if self.triangle_count as usize >= self.base.triangle_count() {
            return Err(INVALID.into());
        }
        self.triangle_count += 1;
        Ok(3 * (self.triangle_count - 1))
    }

    fn top(&self) -> Result<u32, Fault> {
        self.active.last().copied().ok_or(INVALID.into())
    }

    fn set_vertex(&mut self, corner: u32, vertex: u32) {
        self.base.vertex[corner as usize] = vertex;
    }

    fn set_leftmost(&mut self, vertex: u32, corner: u32) {
        self.base.leftmost[vertex as usize] = corner;
    }

    /// The corner opposite to the last edge of the fan around a vertex.
    fn end_of_fan(&self, vertex: u32) -> Result<u32, Fault> {
        match self.base.leftmost[vertex as usize] {
            NONE => Err(INVALID.into()),
            corner => Ok(next(corner)),
        }
    }

    /// Attaches the triangle of a symbol.
    fn attach(&mut self, number: u32, count: u32) -> Result<(), Fault> {
        let corner = self.triangle()?;
        let symbol = self.symbols.next()?;
        match symbol {
            Symbol::Close => self.close(corner)?,
            Symbol::Split => self.join_parts(corner, number)?,
            Symbol::Left | Symbol::Right => self.extend(corner, symbol == Symbol::Right)?,
            Symbol::End => {
                for corner in corner..corner + 3 {
                    self.base.add_vertex(corner);
                }
                self.active.push(corner);
            }
        }
        let top = self.top()?;
        if let Symbols::ByValence(valences) = &mut self.symbols {
            valences.attached(symbol, &self.base, top);
        }
        if matches!(symbol, Symbol::Left | Symbol::Right | Symbol::End) {
            self.split_events(count - 1 - number, count)?;
        }
        Ok(())
    }

    fn close(&mut self, corner: u32) -> Result<(), Fault> {
        let a = self.top()?;
        let vertex = self.base.vertex(next(a));
        let b = self.end_of_fan(vertex)?;
        self.base.join(a, corner + 1)?;
        self.base.join(b, corner + 2)?;
        let (beyond, before) = (self.base.vertex(next(b)), self.base.vertex(previous(a)));
        self.set_vertex(corner, vertex);
        self.set_vertex(corner + 1, beyond);
        self.set_vertex(corner + 2, before);
        self.set_leftmost(before, corner + 2);
        self.replace_top(corner);
        Ok(())
    }

    fn extend(&mut self, corner: u32, is_right: bool) -> Result<(), Fault> {
        let a = self.top()?;
        let [tip, left, right] = match is_right {
            true => [corner + 2, corner + 1, corner],
            false => [corner + 1, corner, corner + 2],
        };
        self.base.join(tip, a)?;
        self.base.add_vertex(tip);
        let vertex = self.base.vertex(previous(a));
        self.set_vertex(right, vertex);
        self.set_leftmost(vertex, right);
        self.set_vertex(left, self.base.vertex(next(a)));
        self.replace_top(corner);
        Ok(())
    }

    fn join_parts(&mut self, corner: u32, number: u32) -> Result<(), Fault> {
        let b = self.active.pop().ok_or(INVALID)?;
        self.active.extend(self.split_off.remove(&number));
        let a = self.top()?;
        self.base.join(a, corner + 2)?;
        self.base.join(b, corner + 1)?;
        let (kept, merged) = (self.base.vertex(previous(a)), self.base.vertex(next(b)));
        if kept == merged {
            return Err(INVALID.into());
        }
        let before = self.base.vertex(previous(b));
        self.set_vertex(corner, kept);
        self.set_vertex(corner + 1, self.base.vertex(next(a)));
        self.set_vertex(corner + 2, before);
        self.set_leftmost(before, corner + 2);
        if let Symbols::ByValence(valences) = &mut self.symbols {
            valences.merge(kept, merged);
        }
        self.set_leftmost(kept, self.base.leftmost[merged as usize]);
        let (first, mut turned) = (next(b), Some(next(b)));
        while let Some(here) = turned {
            self.set_vertex(here, kept);
            turned = self.base.left(here);
            self.steps += 1;
            // A mesh has a few corners around a vertex; what has far more is not a mesh.
            if turned == Some(first) || self.steps > 64 * (self.base.opposite.len() as u64 + 64) {
                return Err(INVALID.into());
            }
        }
        self.set_leftmost(merged, NONE);
        self.replace_top(corner);
        Ok(())
    }

    fn replace_top(&mut self, corner: u32) {
        if let Some(top) = self.active.last_mut() {
            *top = corner;
        }
    }

    /// Keeps active edges of the last triangle for the symbols that join them.
    fn split_events(&mut self, from_end: u32, count: u32) -> Result<(), Fault> {
        while let Some(event) = self.events.pop_if(|event| event.source >= from_end) {
            if event.source > from_end || event.split >= count {
                return Err(INVALID.into());
            }
            let top = self.top()?;
            let corner = if event.is_right { next(top) } else { previous(top) };
            self.split_off.insert(count - 1 - event.split, corner);
        }
        Ok(())
    }

    /// Closes a part by the triangle that the encoder began with.
    fn close_last(&mut self, a: u32) -> Result<(), Fault> {
        let corner = self.triangle()?;
        let n = self.base.vertex(next(a));
        let b = self.end_of_fan(n)?;
        let x = self.base.vertex(next(b));
        let c = self.end_of_fan(x)?;
        let p = self.base.vertex(next(c));
        self.base.join(corner, a)?;
        self.base.join(corner + 1, b)?;
        self.base.join(corner + 2, c)?;
        for (corner, vertex) in (corner..).zip([x, p, n]) {
            self.set_vertex(corner, vertex);
        }
        Ok(())
    }
}

/// By attribute data, which corners lie opposite to edges where it is cut. Boundaries are cuts.
fn cuts(base: &Corners, seams: &mut [super::bits::CodedBits]) -> Vec<Vec<bool>> {
    let mut cuts = vec![vec![false; base.opposite.len()]; seams.len()];
    for corner in 0..base.opposite.len() as u32 {
        let across = base.across(corner);
        if across.is_some_and(|across| across / 3 < corner / 3) {
            continue;
        }
        for (is_cut, seam) in cuts.iter_mut().zip(&mut *seams) {
            if across.is_none_or(|_| seam.next()) {
                for corner in std::iter::once(corner).chain(across) {
                    is_cut[corner as usize] = true;
                }
            }
        }
    }
    cuts
}

/// Numbers the points: corners of a vertex share one until an attribute changes.
fn points(base: Corners, cut: Vec<Corners>) -> Result<Connectivity, Fault> {
    let mut point_of_corner = vec![NONE; base.opposite.len()];
    let mut corner_of_point = Vec::new();
    let differ = |a: u32, b: u32| cut.iter().any(|corners| corners.vertex(a) != corners.vertex(b));
    for &leftmost in base.leftmost.iter().filter(|&&corner| corner != NONE) {
        let mut first = leftmost;
        if base.left(leftmost).is_some() {
            // Inside: the first seam to the right, of the first attribute that has one.
            let turns = || {
                std::iter::successors(base.right(leftmost), |&c| base.right(c)).take_while(|&c| c != leftmost)
            };
            let seam = |corners: &Corners| turns().find(|&c| corners.vertex(c) != corners.vertex(leftmost));
            first = cut.iter().find_map(seam).unwrap_or(leftmost);
        }
        let mut here = first;
        let mut before = None;
        loop {
            match before {
                Some(before) if !differ(here, before) => {
                    point_of_corner[here as usize] = point_of_corner[before as usize];
                }
                _ => {
                    point_of_corner[here as usize] = corner_of_point.len() as u32;
                    corner_of_point.push(here);
                }
            }
            before = Some(here);
            match base.right(here).filter(|&right| right != first) {
                Some(right) => here = right,
                None => break,
            }
        }
    }
    if point_of_corner.contains(&NONE) {
        return Err(INVALID.into());
    }
    Ok(Connectivity {
        triangles: point_of_corner.as_chunks().0.to_vec(),
        point_count: corner_of_point.len(),
        corners: Some(EdgebreakerCorners {
            base,
            cut,
            corner_of_point,
        }),
    })
}
