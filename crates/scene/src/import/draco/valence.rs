//! Symbols of Edgebreaker by the valence of the vertex that the active edge starts from.

use super::bits::Reader;
use super::corners::{Corners, next, previous};
use super::symbol::Symbol;
use super::{Fault, INVALID, Spend};

/// Valences have a list of symbols each, smaller ones share the first, greater ones the last.
const VALENCES: [u32; 2] = [2, 7];

pub(super) struct Valences {
    /// By vertex.
    valence: Vec<u32>,
    /// By valence, the last symbol first.
    symbols: Vec<Vec<u32>>,
    /// The list that the next symbol comes from.
    context: Option<usize>,
}

impl Valences {
    pub(super) fn read(reader: &mut Reader, most: u32, spend: &Spend) -> Result<Self, Fault> {
        let mut symbols = Vec::new();
        for _ in VALENCES[0]..=VALENCES[1] {
            let count = reader.variable()?;
            if count > most {
                return Err(INVALID.into());
            }
            symbols.push(match count {
                0 => Vec::new(),
                _ => reader.symbols(count as usize, 1, spend)?,
            });
        }
        Ok(Self {
            valence: Vec::new(),
            symbols,
            context: None,
        })
    }

    pub(super) fn next(&mut self) -> Result<Symbol, Fault> {
        let Some(context) = self.context else {
            return Ok(Symbol::End);
        };
        let order = [
            Symbol::Close,
            Symbol::Split,
            Symbol::Left,
            Symbol::Right,
            Symbol::End,
        ];
        let symbol = self.symbols[context].pop().ok_or(INVALID)?;
        order.get(symbol as usize).copied().ok_or(INVALID.into())
    }

    fn add(&mut self, vertex: u32, count: u32) {
        let vertex = vertex as usize;
        if self.valence.len() <= vertex {
            self.valence.resize(vertex + 1, 0);
        }
        self.valence[vertex] = self.valence[vertex].saturating_add(count);
    }

    /// After a triangle was attached of which `corner` is the first corner.
    pub(super) fn attached(&mut self, symbol: Symbol, corners: &Corners, corner: u32) {
        let vertices = [corner, next(corner), previous(corner)].map(|corner| corners.vertex(corner));
        let added = match symbol {
            Symbol::Close | Symbol::Split => [0, 1, 1],
            Symbol::Right => [1, 1, 2],
            Symbol::Left => [1, 2, 1],
            Symbol::End => [2, 2, 2],
        };
        for (vertex, count) in vertices.into_iter().zip(added) {
            self.add(vertex, count);
        }
        let valence = self.valence[vertices[1] as usize].clamp(VALENCES[0], VALENCES[1]);
        self.context = Some((valence - VALENCES[0]) as usize);
    }

    /// When a vertex becomes one with another.
    pub(super) fn merge(&mut self, kept: u32, merged: u32) {
        let count = self.valence.get(merged as usize).copied().unwrap_or(0);
        self.add(kept, count);
    }
}
