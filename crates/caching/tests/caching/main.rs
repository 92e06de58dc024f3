//! Moments, trees and reservoirs in cells by enumeration, and caches in a sphere whose light is
//! known.

mod moments;
mod sphere;
mod spread;
mod tree;
mod trees;
mod world;
