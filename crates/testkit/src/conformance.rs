//! The laws of shift mappings, checked on samples.
//!
//! A shift `T_{a→b}` between two domains is a bijection between subsets of them, with
//! `|∂T_{b→a}/∂y| · |∂T_{a→b}/∂x| = 1` at `y = T_{a→b}(x)`. A map that breaks it is
//! biased, often too little to be seen in an image. [`ShiftConformance`] tallies, over as many
//! samples as one likes,
//!
//! - **support**: where the shift is defined, the way back is (gates on Jacobians included: a
//!   one-sided gate shows as a missing way back);
//! - **round trip**: the way back leads to the same sample;
//! - **reciprocity**: the two determinants multiply to 1;
//! - **determinism**: the same arguments give the same image;
//! - **determinants**: they equal those of finite differences in `f64`, which the caller computes
//!   from the geometry.

/// A shift as the kit sees it: an image with its determinant, or nothing where it is undefined.
pub type Shift<'a, X, D> = &'a dyn Fn(&X, &D, &D) -> Option<(X, f64)>;

/// What to hold a shift to.
pub struct ShiftConformance<'a, X, D> {
    shift: Shift<'a, X, D>,
    same: &'a dyn Fn(&X, &X) -> bool,
    tolerance: f64,
    tally: ShiftTally,
}

/// How often a shift kept or broke its laws.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ShiftTally {
    /// Samples whose shift was defined.
    pub defined: u64,
    /// Samples whose shift was undefined, which breaks no law.
    pub undefined: u64,
    /// The shift is defined, its way back is not.
    pub no_way_back: u64,
    /// The way back leads elsewhere.
    pub other_sample: u64,
    /// A second call gave something else.
    pub not_deterministic: u64,
    /// The determinants of the two ways do not multiply to 1 within the tolerance.
    pub not_reciprocal: u64,
    /// A determinant that is not positive and finite.
    pub degenerate: u64,
    /// Determinants compared with finite differences.
    pub compared: u64,
    /// Determinants further from finite differences than the tolerance given with them.
    pub wrong_determinant: u64,
    /// Largest `|J J⁻¹ − 1|`.
    pub worst_reciprocity: f64,
    /// Largest `|J / J_numeric − 1|`.
    pub worst_determinant: f64,
}

impl ShiftTally {
    /// Whether no law was broken, and the shift was defined at least once.
    pub fn is_conformant(&self) -> bool {
        let broken = self.no_way_back
            + self.other_sample
            + self.not_deterministic
            + self.not_reciprocal
            + self.degenerate
            + self.wrong_determinant;
        broken == 0 && self.defined > 0
    }
}

impl<'a, X, D> ShiftConformance<'a, X, D> {
    /// `shift(x, from, to)` is the shift; `same` says when two samples are one, up to rounding;
    /// `tolerance` bounds `|J J⁻¹ − 1|`.
    pub fn new(shift: Shift<'a, X, D>, same: &'a dyn Fn(&X, &X) -> bool, tolerance: f64) -> Self {
        Self {
            shift,
            same,
            tolerance,
            tally: ShiftTally::default(),
        }
    }

    /// Sends `x` from `from` to `to` and back. True where the shift is defined.
    pub fn check(&mut self, x: &X, from: &D, to: &D) -> bool {
        let tally = &mut self.tally;
        let image = (self.shift)(x, from, to);
        let again = (self.shift)(x, from, to);
        let Some((y, jacobian)) = image else {
            tally.undefined += 1;
            tally.not_deterministic += u64::from(again.is_some());
            return false;
        };
        tally.defined += 1;
        let repeated = again.is_some_and(|(second, other)| other == jacobian && (self.same)(&y, &second));
        tally.not_deterministic += u64::from(!repeated);
        if !(jacobian > 0.0 && jacobian.is_finite()) {
            tally.degenerate += 1;
            return true;
        }
        let Some((back, inverse)) = (self.shift)(&y, to, from) else {
            tally.no_way_back += 1;
            return true;
        };
        tally.other_sample += u64::from(!(self.same)(x, &back));
        let deviation = (jacobian * inverse - 1.0).abs();
        tally.not_reciprocal += u64::from(!(deviation <= self.tolerance));
        tally.worst_reciprocity = tally.worst_reciprocity.max(deviation);
        true
    }

    /// Compares the determinant at `x` with `numeric`, that of finite differences, to the relative
    /// `tolerance`.
    pub fn check_determinant(&mut self, x: &X, from: &D, to: &D, numeric: f64, tolerance: f64) {
        if let Some((_, jacobian)) = (self.shift)(x, from, to) {
            let deviation = (jacobian / numeric - 1.0).abs();
            self.tally.compared += 1;
            self.tally.wrong_determinant += u64::from(!(deviation <= tolerance));
            self.tally.worst_determinant = self.tally.worst_determinant.max(deviation);
        }
    }

    /// What was found so far.
    pub fn tally(&self) -> ShiftTally {
        self.tally
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check_faults;
    use core::cell::Cell;

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        OneSidedGate,
        Elsewhere,
        JacobianDropped,
        JacobianClampedOnBothSides,
        Memory,
    }

    /// Domains `[0, d]`; the shift scales, `y = x · to/from`, so `J = to/from`.
    fn run(fault: Option<Fault>) -> Result<(), ShiftTally> {
        let calls = Cell::new(0u32);
        let shift = |&x: &f64, &from: &f64, &to: &f64| {
            calls.set(calls.get() + 1);
            let (y, jacobian) = (x * to / from, to / from);
            match fault {
                Some(Fault::OneSidedGate) if jacobian > 3.0 => None,
                Some(Fault::Elsewhere) if x > 0.9 * from => Some((0.5 * y, jacobian)),
                Some(Fault::JacobianDropped) => Some((y, 1.0)),
                Some(Fault::JacobianClampedOnBothSides) => Some((y, jacobian.clamp(0.5, 2.0))),
                Some(Fault::Memory) if calls.get().is_multiple_of(97) => None,
                _ => Some((y, jacobian)),
            }
        };
        let same = |a: &f64, b: &f64| (a - b).abs() < 1e-12;
        let mut kit = ShiftConformance::new(&shift, &same, 1e-12);
        for i in 0..100 {
            let x = f64::from(i) / 100.0;
            for (from, to) in [(1.0, 2.0), (4.0, 1.0), (1.0, 1.0)] {
                if kit.check(&(x * from), &from, &to) {
                    kit.check_determinant(&(x * from), &from, &to, to / from, 1e-9);
                }
            }
        }
        let tally = kit.tally();
        if tally.is_conformant() { Ok(()) } else { Err(tally) }
    }

    #[test]
    fn sound_shifts_pass_and_broken_ones_do_not() {
        let faults = [
            Fault::OneSidedGate,
            Fault::Elsewhere,
            Fault::JacobianDropped,
            Fault::JacobianClampedOnBothSides,
            Fault::Memory,
        ];
        assert_eq!(check_faults(&faults, run).unwrap().len(), faults.len());
    }

    #[test]
    fn a_shift_that_is_never_defined_proves_nothing() {
        let shift = |_: &f64, _: &f64, _: &f64| None;
        let mut kit = ShiftConformance::new(&shift, &|_, _| true, 0.0);
        assert!(!kit.check(&0.5, &1.0, &1.0));
        assert!(!kit.tally().is_conformant());
        assert_eq!(kit.tally().undefined, 1);
    }
}
