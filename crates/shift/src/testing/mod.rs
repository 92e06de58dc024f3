//! Tests of whole paths over a small analytic world. The checks are generic over
//! [`World`](crate::World).

mod alcove;
mod checks;
mod determinants;
mod directions;
mod evaluation;
mod integrals;
mod mutations;
mod naive;
mod pairs;
mod prefixes;
mod round_trips;
mod shapes;
mod suffixes;
mod volume;
