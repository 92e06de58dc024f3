//! Shards that are rendered into their files, without a film of the whole image.

use super::Shard;
use super::file::RowWriter;
use super::header::ShardHeader;
use super::layout::Layout;
use crate::film::TotalsSum;
use crate::strips::StripLoop;
use crate::{
    Budget, FilmTotals, OutputError, OutputTarget, PixelEstimator, Progress, RenderError, RenderOptions,
    ShardError, render,
};
use std::io;
use std::sync::atomic::AtomicBool;

/// Why a shard was not rendered into its file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderShardError {
    /// The rendering could not start, or the options are of another size than the header.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The film is none of the shard's.
    #[error(transparent)]
    Shard(#[from] ShardError),
}

/// What [`render_shard`] gave.
#[derive(Clone, Copy, Debug)]
pub struct RenderedShard {
    /// Figures of all pixels together: [`Film::totals`](crate::Film::totals). `None` if `cancel`
    /// ended the rendering: nothing was written.
    pub totals: Option<FilmTotals>,
    /// Wall time of rendering, seconds; without writing.
    pub seconds: f64,
    /// Processor time of the process during the rendering, seconds, if the platform reports it.
    pub cpu_seconds: Option<f64>,
}

/// Renders the samples of a shard and writes its file: the bits of [`render()`] and
/// [`Shard::write`].
///
/// Rows are written as soon as they are complete. Memory is that of some rows and not of a film
/// (133 MB at 1920×1080), and the processor time to fill and read that memory is saved. Until the
/// shard is complete the file has no name, so that nothing is left of a process that is killed. On
/// systems without files of no name (all but Linux, and some network file systems) a film is used.
///
/// `options` say size, seed, first sample and threads; the number of samples is the header's.
///
/// # Errors
///
/// Those of [`render()`], a size other than the header's, and those of [`Shard::write`]; the path
/// then holds what it held before.
pub fn render_shard<E: PixelEstimator>(
    estimator: &E,
    header: &ShardHeader,
    options: &RenderOptions,
    target: &OutputTarget,
    observer: &(dyn Fn(&Progress) + Sync),
    cancel: &AtomicBool,
) -> Result<RenderedShard, RenderShardError> {
    let order = ShardOrder {
        estimator,
        header,
        options,
        target,
        observer,
        cancel,
    };
    order.render()
}

/// What [`render_shard`] is asked for; its functions are compiled once and not for every estimator.
pub(super) struct ShardOrder<'a> {
    pub estimator: &'a dyn PixelEstimator,
    pub header: &'a ShardHeader,
    pub options: &'a RenderOptions,
    pub target: &'a OutputTarget,
    pub observer: &'a (dyn Fn(&Progress) + Sync),
    pub cancel: &'a AtomicBool,
}

impl ShardOrder<'_> {
    /// Writes rows as soon as they are complete, where a file may be without a name.
    pub fn render(&self) -> Result<RenderedShard, RenderShardError> {
        let Self {
            estimator,
            header,
            options,
            target,
            observer,
            cancel,
        } = *self;
        let size = [options.width, options.height];
        if size != header.image().size {
            let method = header.image().size;
            return Err(RenderError::OtherSize {
                method,
                options: size,
            }
            .into());
        }
        let samples = header.end() - header.first();
        let layout =
            Layout::new(header).map_err(|reason| OutputError::Shard(target.path().to_owned(), reason))?;
        let strips = StripLoop::new(options, samples)?;
        let Some(file) = target.unnamed_exr(layout.file_bytes())? else {
            drop(strips);
            return self.with_film();
        };
        let io_error = |error: io::Error| OutputError::Io(target.path().to_owned(), error);
        let mut totals = TotalsSum::default();
        let mut rows = RowWriter::new(&layout, file.file()).map_err(io_error)?;
        let times = strips.run(estimator, observer, cancel, |top, film| {
            rows.add(top, film, |row| row.add_to(&mut totals, u64::from(samples)))
        });
        let Some(times) = times.map_err(io_error)? else {
            return Ok(RenderedShard {
                totals: None,
                seconds: 0.0,
                cpu_seconds: None,
            });
        };
        rows.finish().map_err(io_error)?;
        file.publish(target.path()).map_err(io_error)?;
        Ok(RenderedShard {
            totals: Some(totals.finish().0),
            seconds: times.seconds,
            cpu_seconds: times.cpu_seconds,
        })
    }

    /// The same by way of a film.
    pub fn with_film(&self) -> Result<RenderedShard, RenderShardError> {
        let header = self.header;
        let options = RenderOptions {
            budget: Budget::Samples(header.end() - header.first()),
            whole: true,
            ..*self.options
        };
        let outcome = render(&self.estimator, &options, self.observer, self.cancel)?;
        let (seconds, cpu_seconds) = (outcome.seconds, outcome.cpu_seconds);
        let totals = match outcome.interrupted {
            true => None,
            false => {
                let shard = Shard::new(header.clone(), outcome.film)?;
                shard.write(self.target)?;
                Some(shard.totals())
            }
        };
        Ok(RenderedShard {
            totals,
            seconds,
            cpu_seconds,
        })
    }
}
