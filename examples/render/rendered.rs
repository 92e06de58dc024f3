//! What a rendering gave: a film, a shard, or a shard's file.

use crate::failure::Failure;
use lightshed::film::{
    Film, FilmTotals, OutputTarget, RayCounts, RenderOutcome, RenderedShard, Shard, ShardHeader,
};

/// Where the samples are.
enum Samples {
    /// An image's.
    Image(Film),
    /// A shard's, all of them.
    Shard(Shard),
    /// A shard's, in its file already.
    Written,
    /// A part of a shard's: no use to anybody.
    Nowhere,
}

/// Figures of a rendering, and its samples.
pub struct Rendered {
    samples: Samples,
    /// Samples and mean of all pixels.
    pub totals: FilmTotals,
    /// Samples of every pixel.
    pub samples_per_pixel: u32,
    /// Wall time of rendering, seconds.
    pub seconds: f64,
    /// Processor time of all threads, seconds.
    pub cpu_seconds: Option<f64>,
    /// Whether it ended before its budget was spent.
    pub interrupted: bool,
    /// Rays by kind, where the method counts them.
    pub rays: Option<RayCounts>,
}

impl Rendered {
    /// Of the film of an image or of a shard.
    pub fn by_film(outcome: RenderOutcome, header: Option<&ShardHeader>) -> Result<Self, Failure> {
        let RenderOutcome {
            film,
            samples_per_pixel,
            seconds,
            cpu_seconds,
            interrupted,
            rays,
        } = outcome;
        let (samples, totals) = match header {
            None => {
                let totals = film.totals();
                (Samples::Image(film), totals)
            }
            // A shard is whole or not there.
            Some(header) if samples_per_pixel == header.end() - header.first() => {
                let shard = Shard::new(header.clone(), film)?;
                let totals = shard.totals();
                (Samples::Shard(shard), totals)
            }
            Some(_) => (Samples::Nowhere, film.totals()),
        };
        Ok(Self {
            samples,
            totals,
            samples_per_pixel,
            seconds,
            cpu_seconds,
            interrupted,
            rays,
        })
    }

    /// Of a shard that was rendered into its file.
    pub fn by_file(rendered: RenderedShard, header: &ShardHeader) -> Self {
        let (samples, count) = match rendered.totals {
            Some(_) => (Samples::Written, header.end() - header.first()),
            None => (Samples::Nowhere, 0),
        };
        Self {
            samples,
            totals: rendered.totals.unwrap_or_default(),
            samples_per_pixel: count,
            seconds: rendered.seconds,
            cpu_seconds: rendered.cpu_seconds,
            interrupted: rendered.totals.is_none(),
            rays: None,
        }
    }

    /// Writes what is not written yet; whether there is a file.
    pub fn write(&self, target: &OutputTarget) -> Result<bool, Failure> {
        match &self.samples {
            Samples::Image(_) if self.samples_per_pixel == 0 => return Ok(false),
            Samples::Nowhere => return Ok(false),
            Samples::Image(film) => target.write(&film.mean_image())?,
            Samples::Shard(shard) => shard.write(target)?,
            Samples::Written => (),
        }
        Ok(true)
    }

    /// The film, where there is one.
    pub fn film(&self) -> Option<&Film> {
        match &self.samples {
            Samples::Image(film) => Some(film),
            Samples::Shard(shard) => Some(shard.film()),
            Samples::Written | Samples::Nowhere => None,
        }
    }
}
