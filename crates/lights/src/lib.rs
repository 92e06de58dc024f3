//! Choosing among many lights: light trees, cuts, light BVHs and lighting grids.
//!
//! Scene-agnostic: a light is known by its [`Bounds`], its intensity and, where it does not shine all around, an
//! [`OrientationCone`]; what receives light by position, normal and a bound of its reflectance ([`ShadingPoint`]).
//! Positions are in any unit of length, the same for all.
//!
//! Equation numbers refer to Lin 2022 (*High-Quality Sampling for Complex Effects in Real-Time Ray Tracing*, ch. 3
//! and 4).
//!
//! # Features
//!
//! - `parallel`: builds over a rayon pool. Same result, bit for bit.
#![forbid(unsafe_code)]

mod bounds;
mod cone;
mod light;
mod receiver;

pub use bounds::Bounds;
pub use cone::OrientationCone;
pub use glam;
pub use light::{Light, LightError, MAX_LIGHTS, check_lights};
pub use receiver::{Facing, ShadingPoint};
