//! Run time against error.
//!
//! A method is as good as its error after a given time. [`run`] runs methods on one scene, frame by
//! frame in turns, so that a noisy machine affects all alike. A [`Record`] holds the measurements;
//! it can be written to a file and continued. Its [`standings`](Record::standings) give errors at
//! equal time and time to equal error with intervals, from independent repeats. A [`Reference`] is
//! the truth with its uncertainty: its noise is subtracted from squared errors. [`SingleFrames`]
//! compares a frame of a chain with a plain method in the same time, [`TemporalStudy`] measures the
//! correlation of frames, [`html_report`] shows all of it on a page. [`ShardMeans`] and
//! [`Agreement`] test whether two methods have the same expectation, from independent shards of
//! each.
//!
//! ```
//! use lightshed_evaluate::{ContestOptions, Contestant, Metric, Reference, run};
//! use lightshed_film::SampledFrames;
//! use lightshed_integrator::{DirectLight, DirectLightOptions, PathTracer};
//! use lightshed_scene::{Scene, builtin};
//! use std::sync::atomic::AtomicBool;
//!
//! let mut description = builtin::cornell();
//! (description.settings.width, description.settings.height) = (16, 16);
//! description.settings.max_depth = Some(2);
//! let scene = Scene::new(&description)?;
//! let never = AtomicBool::new(false);
//! let path_tracer = || PathTracer::new(&scene, scene.emitters_by_power());
//! let reference = Reference::rendered(&path_tracer(), [16, 16], 64, &|_| (), &never)?;
//!
//! // Two estimators of direct light.
//! let path = || Ok(Box::new(SampledFrames::new(path_tracer(), [16, 16], 1)) as Box<_>);
//! let direct = || {
//!     let options = DirectLightOptions::default();
//!     let method = DirectLight::new(&scene, scene.emitters_by_power(), options).unwrap();
//!     Ok(Box::new(SampledFrames::new(method, [16, 16], 1)) as Box<_>)
//! };
//! let contestants = [Contestant::new("path", path), Contestant::new("direct", direct)];
//! let options = ContestOptions { seconds: 0.02, repeats: 2, seed: 1 };
//! let contested = run("cornell", &contestants, &reference, options, None, &|_| (), &never)?;
//! let standing = &contested.record.standings()[1];
//! assert_eq!(standing.by_metric[2].metric, Metric::Mape);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Features
//!
//! - `flip`: the image metric FLIP in reports.
//! - `oidn`: Intel's denoiser, which must be installed.
#![forbid(unsafe_code)]

mod agreement;
mod brightness;
mod contest;
mod errors;
mod failure;
mod interval;
#[cfg(feature = "oidn")]
mod oidn;
mod plot;
mod reference;
mod report;
mod single;
mod summary;
mod svgf;
mod temporal;
mod tev;

pub use agreement::{
    AGREEMENT_CHANNELS, Agreement, MeanDifference, RelativeInterval, ShardMeans, TileDifference, Verdict,
};
pub use contest::{
    Checkpoint, ContestOptions, ContestProgress, Contestant, Contested, CurvePoint, Record, Run, run,
    run_watched,
};
pub use errors::{Errors, Metric};
pub use failure::EvaluateError;
pub use interval::Interval;
pub use lightshed_film as film;
pub use lightshed_sampling as sampling;
pub use lightshed_sampling::glam;
#[cfg(feature = "oidn")]
pub use oidn::Oidn;
pub use plot::{Axis, Plot};
pub use reference::Reference;
pub use report::{
    FrameErrors, ReportChain, ReportMotion, ReportScene, ReportSequence, html_report, html_report_so_far,
};
pub use single::SingleFrames;
pub use summary::{MetricStanding, Standing};
pub use svgf::{PixelGuide, Svgf, SvgfOptions};
pub use temporal::{Autocorrelation, Autocovariance, TemporalStudy};
pub use tev::TevViewer;

/// The guide's code is a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/evaluate.md")]
struct Guide;

/// So is that of the package's page.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
