//! The shift of paths through volumes, over fog in which everything has a closed form.

mod candidates;
mod definition;
mod fog;
mod laws;
mod merges;
