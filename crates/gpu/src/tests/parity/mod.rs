//! What shaders compute is what the library computes.
//!
//! Three tiers: the same bits, for integers and for chains of additions, multiplications, divisions
//! and square roots; within a stated bound, where a function of the device's own is called; and by
//! statistics, for whole images. Without a device the tests say SKIPPED and pass, unless
//! `LIGHTSHED_REQUIRE_GPU=1`.

mod bvh_build;
mod bvh_subset;
mod doubles;
mod guiding;
mod harness;
mod hash_grid;
mod lamps;
mod light_cache;
mod light_tree;
mod light_tree_build;
mod lightcut;
mod lighting_grid;
mod media;
mod merge;
mod mixture;
mod nearest_sites;
mod numbers;
mod octree_adapt;
mod path_budget;
mod phase;
mod planted;
mod quadtree_learn;
mod rays;
mod resampling;
mod scattering;
mod sky;
mod warps;
