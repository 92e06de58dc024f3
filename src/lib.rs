//! # lightshed
//!
//! Reusable sampling libraries for light transport. This package re-exports the workspace's crates,
//! one feature a crate; a renderer usually depends on the single crate it needs.
//!
//! | module | crate | what is in it |
//! |---|---|---|
//! | `lanes` | `lightshed-lanes` | eight `f32` lanes in AVX-512, AVX2 or arrays; feature `lanes` |
//! | [`sampling`] | `lightshed-sampling` | random numbers, densities that carry their measure, warps, discrete distributions |
//! | [`spatial`] | `lightshed-spatial` | curve orders, sparse and hash grids, neighbour search, indices of surface sites |
//! | [`bvh`] | `lightshed-bvh` | bounding volume hierarchies over boxes, built fast; refits, instances |
//! | [`resampling`] | `lightshed-resampling` | reservoirs, RIS, MIS families, GRIS merges, spatiotemporal reuse |
//! | [`lights`] | `lightshed-lights` | choosing among many lights: trees, cuts, light BVH, lighting grid |
//! | [`caching`] | `lightshed-caching` | radiance caches with variance and bias, where paths end |
//! | [`guiding`] | `lightshed-guiding` | guides that learn from paths where light comes from, caches of visible lights |
//! | [`shift`] | `lightshed-shift` | paths, shift mappings and their Jacobians for ReSTIR path tracing |
//! | [`volume`] | `lightshed-volume` | density grids, majorants, free flight, transmittance, phase functions |
//! | [`scene`] | `lightshed-scene` | geometry, materials, emitters, cameras, importers, ray queries |
//! | [`film`] | `lightshed-film` | film with variances, render loops, image files and metrics; knows no scene |
//! | [`integrator`] | `lightshed-integrator` | rendering methods: path tracing, direct light, reuse, volumes |
//! | `evaluate` | `lightshed-evaluate` | run time against error: races, intervals, reports; with the feature `evaluate` |
//! | `gpu` | `lightshed-gpu` | methods on a GPU by wgpu; with the feature `gpu` |
//! | `shaders` | `lightshed-shaders` | the libraries as WESL and WGSL; with the feature `shaders`, without wgpu |
//! | `testkit` | `lightshed-testkit` | tests of estimators; with the feature `testkit` |
//!
//! The feature `parallel` runs builds and passes on threads, `serde` stores options and what guides
//! learnt; both are handed on to every crate that has them.
//!
//! # Example
//!
//! The Cornell box in a few lines; the example `render` is the same with a command line around it.
//!
//! ```
//! # #[cfg(feature = "integrator")] {
//! use lightshed::film::{Budget, RenderOptions, render};
//! use lightshed::integrator::PathTracer;
//! use lightshed::scene::{Scene, builtin};
//! use std::sync::atomic::AtomicBool;
//!
//! let mut description = builtin::by_name("cornell").expect("it is built in");
//! (description.settings.width, description.settings.height) = (16, 16);
//! let scene = Scene::new(&description)?;
//! let options = RenderOptions::new(16, 16, Budget::Samples(4));
//! let method = PathTracer::new(&scene, scene.emitters_by_power());
//! let outcome = render(&method, &options, &|_| (), &AtomicBool::new(false))?;
//!
//! let [red, green, _] = outcome.film.mean_image().mean();
//! assert!(red > green && green > 0.05);
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#[cfg(feature = "bvh")]
pub use lightshed_bvh as bvh;
#[cfg(feature = "caching")]
pub use lightshed_caching as caching;
#[cfg(feature = "evaluate")]
pub use lightshed_evaluate as evaluate;
#[cfg(feature = "film")]
pub use lightshed_film as film;
#[cfg(feature = "gpu")]
pub use lightshed_gpu as gpu;
#[cfg(feature = "guiding")]
pub use lightshed_guiding as guiding;
#[cfg(feature = "integrator")]
pub use lightshed_integrator as integrator;
#[cfg(feature = "lanes")]
pub use lightshed_lanes as lanes;
#[cfg(feature = "lights")]
pub use lightshed_lights as lights;
#[cfg(feature = "resampling")]
pub use lightshed_resampling as resampling;
#[cfg(feature = "sampling")]
pub use lightshed_sampling as sampling;
#[cfg(feature = "scene")]
pub use lightshed_scene as scene;
#[cfg(feature = "shaders")]
pub use lightshed_shaders as shaders;
#[cfg(feature = "shift")]
pub use lightshed_shift as shift;
#[cfg(feature = "spatial")]
pub use lightshed_spatial as spatial;
#[cfg(feature = "testkit")]
pub use lightshed_testkit as testkit;
#[cfg(feature = "volume")]
pub use lightshed_volume as volume;
