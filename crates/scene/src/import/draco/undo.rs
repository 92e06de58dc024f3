//! Values from predictions and what is stored of the difference.

use super::bits::Reader;
use super::octahedron::Octahedron;
use super::{Fault, INVALID};

/// Differences from a prediction within bounds, so that a sum beyond them comes back on the other
/// side.
#[derive(Clone, Copy)]
pub(super) struct Wrap {
    least: i32,
    most: i32,
    /// Values from the least to the greatest.
    range: i32,
}

impl Wrap {
    pub(super) fn read(reader: &mut Reader) -> Result<Self, Fault> {
        let (least, most) = (reader.i32()?, reader.i32()?);
        let range = most.checked_sub(least).and_then(|range| range.checked_add(1));
        let range = range.filter(|&range| range > 0).ok_or(INVALID)?;
        Ok(Self { least, most, range })
    }

    pub(super) fn apply(self, predicted: &[i32], stored: &mut [i32]) {
        for (stored, &predicted) in stored.iter_mut().zip(predicted) {
            let sum = predicted.clamp(self.least, self.most).wrapping_add(*stored);
            *stored = if sum > self.most {
                sum.wrapping_sub(self.range)
            } else if sum < self.least {
                sum.wrapping_add(self.range)
            } else {
                sum
            };
        }
    }
}

/// How the difference from a prediction is undone.
#[derive(Clone, Copy)]
pub(super) enum Undo {
    Wrap(Wrap),
    Octahedron(Octahedron),
}

impl Undo {
    pub(super) fn read(reader: &mut Reader, kind: u8) -> Result<Self, Fault> {
        Ok(match kind {
            1 => Self::Wrap(Wrap::read(reader)?),
            3 => Self::Octahedron(Octahedron::read(reader)?),
            _ => return Err("an unknown transformation of predictions".into()),
        })
    }

    /// The value of a prediction and the number that was stored.
    pub(super) fn apply(&self, predicted: &[i32], stored: &mut [i32]) {
        match self {
            Self::Wrap(wrap) => wrap.apply(predicted, stored),
            Self::Octahedron(octahedron) => {
                if let (&[s, t], [u, v]) = (predicted, stored) {
                    [*u, *v] = octahedron.corrected([s, t], [*u, *v]);
                }
            }
        }
    }
}
