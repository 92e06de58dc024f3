//! Moments, trees and reservoirs in cells by enumeration, and caches in a sphere whose light is
//! known.

mod bounds;
mod facets;
mod moments;
mod refinement;
mod sphere;
mod spread;
mod tree;
mod trees;
mod world;
