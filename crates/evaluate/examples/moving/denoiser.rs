//! Filters for frames.

use super::guides::View;
use lightshed::scene::Rgb;
use lightshed_evaluate::{EvaluateError, Svgf, SvgfOptions};

/// What filters frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum DenoiserKind {
    /// Spatiotemporal variance-guided filtering, the `Svgf` of this crate.
    #[default]
    Svgf,
    /// Intel's Open Image Denoise: each frame alone, by a neural network. Needs the feature `oidn`.
    Oidn,
}

impl std::fmt::Display for DenoiserKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Svgf => "spatiotemporal variance-guided filtering (SVGF)",
            Self::Oidn => "Intel's Open Image Denoise, which sees each frame alone",
        })
    }
}

/// A filter for the frames of one chain.
pub struct Denoiser {
    /// Knows for how long surfaces have been in view, whatever filters.
    svgf: Svgf,
    #[cfg(feature = "oidn")]
    oidn: Option<lightshed_evaluate::Oidn>,
}

impl Denoiser {
    pub fn new(kind: DenoiserKind, size: [u32; 2]) -> Result<Self, EvaluateError> {
        #[cfg(not(feature = "oidn"))]
        if kind == DenoiserKind::Oidn {
            let reason = "this program was built without the feature `oidn`";
            return Err(EvaluateError::Filter(reason.into()));
        }
        Ok(Self {
            svgf: Svgf::new(size, SvgfOptions::default()),
            #[cfg(feature = "oidn")]
            oidn: match kind {
                DenoiserKind::Svgf => None,
                DenoiserKind::Oidn => Some(lightshed_evaluate::Oidn::new(size)?),
            },
        })
    }

    /// The next frame after the filter, which sees it without the emission that is seen directly.
    pub fn filter(&mut self, view: &View, frame: &[Rgb]) -> Result<Vec<Rgb>, EvaluateError> {
        let lit = frame.iter().zip(&view.emission);
        let reflected: Vec<Rgb> = lit.map(|(all, own)| all - own).collect();
        let another_size = || EvaluateError::Filter("a frame of another size".into());
        let mut filtered = self
            .svgf
            .filter(&reflected, view.guides())
            .ok_or_else(another_size)?;
        #[cfg(feature = "oidn")]
        if let Some(oidn) = &self.oidn {
            filtered = oidn.filter(&reflected, view.guides())?;
        }
        filtered
            .iter_mut()
            .zip(&view.emission)
            .for_each(|(value, own)| *value += own);
        Ok(filtered)
    }

    /// For how many frames each pixel's surface has been in view.
    pub fn ages(&self) -> impl Iterator<Item = f32> + '_ {
        self.svgf.ages()
    }
}
