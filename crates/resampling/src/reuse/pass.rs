//! Passes of reuse over a grid.

use super::pattern::{Extent, PairedPattern, Pattern};
use crate::choose::Choose;
use crate::domain::{Domain, ShiftMapping};
use crate::merge::{
    Carried, Contribution, DomainReservoir, Input, MergeError, MergeReport, Merged, PairwiseStream, merge,
    merge_and_integrate,
};
use crate::mis::{Mis, Pairwise};
use crate::storage::Storage;

/// Why a pass cannot run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReuseError {
    /// A slice does not have one entry for each domain of the grid.
    Length,
    /// Some pixel could not be merged.
    Merge(MergeError),
    /// Paired reuse knows pairwise families only.
    NotPairwise,
}

impl core::fmt::Display for ReuseError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Length => f.write_str("slices must have one entry for each domain of the grid"),
            Self::Merge(error) => error.fmt(f),
            Self::NotPairwise => f.write_str("paired reuse needs a pairwise MIS family"),
        }
    }
}

impl core::error::Error for ReuseError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Merge(error) => Some(error),
            _ => None,
        }
    }
}

/// The domains that the previous frame's reservoirs live in.
#[derive(Debug)]
pub enum TemporalDomains<'a, D> {
    /// The previous frame's, with its surfaces, lights and visibility. Unbiased.
    Previous(&'a [D]),
    /// Those of this frame, at the corresponding pixel: saves keeping and re-evaluating the old ones.
    /// **Biased** where anything moved: MIS weights then ask the wrong domain what it could have produced.
    BiasedCurrent,
}

/// Reuse over a grid of domains: what all passes of a frame share.
///
/// ```
/// use lightshed_resampling::{
///     Counting, Domain, DomainReservoir, Extent, IdentityShift, Mis, Pattern, Reuse, Ris, TemporalDomains, Tractable,
/// };
/// use lightshed_sampling::CounterRng;
///
/// /// Eight lights, each pixel nearest to one of them.
/// struct Pixel(u32);
/// impl Domain for Pixel {
///     type Sample = u32;
///     type Space = Counting;
///     fn target(&self, &light: &u32) -> f64 {
///         1.0 / (1.0 + f64::from(light.abs_diff(self.0)))
///     }
/// }
///
/// let extent = Extent { width: 16, height: 8 };
/// let pixels: Vec<Pixel> = (0..extent.len()).map(|i| Pixel(i as u32 % 16 / 2)).collect();
/// let reuse = Reuse::new(extent, &pixels, &IdentityShift, Mis::PAIRWISE_DEFENSIVE, 20.0)?;
/// let neighbours = Pattern::disk(3.0, 4)?;
/// let uniform = Tractable::<Counting>::from_density(1.0 / 8.0)?.weight();
/// let mut history = vec![DomainReservoir::<Pixel>::empty(0.0); extent.len()];
/// let mut merged = history.clone();
/// for frame in 0..4 {
///     // One stream of random numbers for each pass of each pixel.
///     let rng = |pass| move |pixel: usize| CounterRng::new(pass, pixel as u32, frame);
///     let fresh: Vec<DomainReservoir<Pixel>> = (0..extent.len())
///         .map(|i| {
///             let (mut ris, mut rng) = (Ris::new(), rng(0)(i));
///             let light = rng.next_u32() % 8;
///             ris.candidate(light, pixels[i].target(&light), uniform, &mut rng);
///             ris.finish(1.0)
///         })
///         .collect();
///     // A still scene: the previous frame's domains are this one's, and so is each pixel's place.
///     let previous = TemporalDomains::Previous(&pixels);
///     reuse.temporal(&fresh, &previous, &history, Some, &mut merged, rng(1), &|_, _| ())?;
///     reuse.spatial(&neighbours, frame, &merged, &mut history, rng(2), &|_, _| ())?;
/// }
/// assert!(history.iter().all(|reservoir| reservoir.confidence() == 20.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// A pixel whose own reservoir has no confidence (background) takes no part: its reservoir passes through,
/// and others give it no weight.
pub struct Reuse<'a, D: Domain, T> {
    extent: Extent,
    domains: &'a [D],
    shift: &'a T,
    mis: Mis,
    confidence_cap: f32,
    similar: Option<Similar<'a, D>>,
}

/// Whether two domains may reuse from each other.
type Similar<'a, D> = &'a (dyn Fn(&D, &D) -> bool + Sync);

/// One observed merge: the pixel and its report.
type Observe<'a> = &'a (dyn Fn(usize, &MergeReport) + Sync);

impl<'a, D, T> Reuse<'a, D, T>
where
    D: Domain + Sync,
    D::Sample: Send + Sync,
    T: ShiftMapping<D> + Sync,
{
    /// Reuse among `domains` with the MIS family `mis`. `confidence_cap` is `M_c` (Lin 2022 §6.5.4): the
    /// output of every pass is trusted by at most it; `f32::INFINITY` for none.
    ///
    /// # Errors
    /// [`ReuseError::Length`] if there is not one domain for each place.
    pub fn new(
        extent: Extent,
        domains: &'a [D],
        shift: &'a T,
        mis: Mis,
        confidence_cap: f32,
    ) -> Result<Self, ReuseError> {
        if domains.len() == extent.len() {
            Ok(Self {
                extent,
                domains,
                shift,
                mis,
                confidence_cap,
                similar: None,
            })
        } else {
            Err(ReuseError::Length)
        }
    }

    /// Leaves out neighbours whose domain is not `similar(own, other)`: other surfaces, say. No bias, because
    /// it judges domains and not samples; keep it so.
    #[must_use]
    pub fn with_similarity(self, similar: Similar<'a, D>) -> Self {
        Self {
            similar: Some(similar),
            ..self
        }
    }

    /// Whether `own` may reuse from `other`.
    fn admits(&self, own: &D, other: &D) -> bool {
        self.similar.is_none_or(|similar| similar(own, other))
    }

    /// Temporal reuse: merges each pixel's fresh reservoir (canonical) with that of the previous frame at
    /// `correspondence(pixel)` (an index into the previous grid; `None` or out of range where there is none,
    /// and the fresh reservoir passes through).
    ///
    /// `choose` makes the decisions' source of each pixel; `observe` sees each merge's report.
    ///
    /// # Errors
    /// [`ReuseError::Length`], or the error of some pixel's merge.
    #[allow(clippy::too_many_arguments)]
    pub fn temporal<R: Storage, C: Choose>(
        &self,
        fresh: &[DomainReservoir<D, R>],
        previous: &TemporalDomains<'_, D>,
        history: &[DomainReservoir<D, R>],
        correspondence: impl Fn(usize) -> Option<usize> + Sync,
        output: &mut [DomainReservoir<D, R>],
        choose: impl Fn(usize) -> C + Sync,
        observe: Observe<'_>,
    ) -> Result<(), ReuseError> {
        let count = self.extent.len();
        let lengths_agree = match previous {
            TemporalDomains::Previous(domains) => domains.len() == history.len(),
            TemporalDomains::BiasedCurrent => history.len() == count,
        };
        if fresh.len() != count || output.len() != count || !lengths_agree {
            return Err(ReuseError::Length);
        }
        each(
            output,
            || (),
            |(), pixel, output| {
                let own = Input::canonical(&self.domains[pixel], &fresh[pixel]);
                let source = correspondence(pixel).filter(|&index| index < history.len());
                let source = source.map(|index| match previous {
                    TemporalDomains::Previous(domains) => (index, &domains[index]),
                    TemporalDomains::BiasedCurrent => (index, &self.domains[index]),
                });
                let admitted = source.filter(|(_, domain)| self.admits(&self.domains[pixel], domain));
                let Some((source, domain)) = admitted else {
                    *output = fresh[pixel].clone().with_confidence_cap(self.confidence_cap);
                    return Ok(());
                };
                let inputs = [own, Input::neighbour(domain, &history[source])];
                self.merge(pixel, &inputs, output, &choose, observe)
            },
        )
    }

    /// One round of spatial reuse: each pixel merges its own reservoir (canonical) with those of its
    /// neighbours. `key` holds random bits for the pattern, new for each round. Run it again on the output
    /// for more rounds.
    ///
    /// # Errors
    /// As [`Reuse::temporal`].
    pub fn spatial<R: Storage, C: Choose>(
        &self,
        pattern: &Pattern,
        key: u32,
        input: &[DomainReservoir<D, R>],
        output: &mut [DomainReservoir<D, R>],
        choose: impl Fn(usize) -> C + Sync,
        observe: Observe<'_>,
    ) -> Result<(), ReuseError> {
        let count = self.extent.len();
        if input.len() != count || output.len() != count {
            return Err(ReuseError::Length);
        }
        let inputs = || Vec::with_capacity(pattern.max_neighbours() + 1);
        each(output, inputs, |inputs, pixel, output| {
            self.gather(pattern, key, pixel, input, inputs);
            self.merge(pixel, inputs, output, &choose, observe)
        })
    }

    /// As [`Reuse::spatial`], with the same reservoirs as a result, and the sum form of each pixel's integral besides: `visit`
    /// is handed each [`Contribution`] to a pixel with that pixel's element of `sums`, which it adds to. A last round that
    /// shades so has no colour noise (Lin 2022 eq. 6.47).
    ///
    /// ```
    /// # use lightshed_resampling::{Counting, Domain, DomainReservoir, Extent, IdentityShift, Mis, Pattern, Reuse};
    /// # use lightshed_sampling::CounterRng;
    /// # struct Pixel;
    /// # impl Domain for Pixel {
    /// #     type Sample = u32;
    /// #     type Space = Counting;
    /// #     fn target(&self, _: &u32) -> f64 {
    /// #         1.0
    /// #     }
    /// # }
    /// # let extent = Extent { width: 2, height: 2 };
    /// # let pixels = [Pixel, Pixel, Pixel, Pixel];
    /// # let reuse = Reuse::new(extent, &pixels, &IdentityShift, Mis::PAIRWISE_DEFENSIVE, 20.0)?;
    /// # let input = vec![DomainReservoir::<Pixel>::from_density(3, 0.5, 1.0)?; 4];
    /// # let mut output = input.clone();
    /// # let rng = |pixel| CounterRng::new(7, pixel as u32, 0);
    /// // Each pixel's light: what its sample (here a number) carries in three channels, times its weight.
    /// let mut image = vec![[0.0; 3]; extent.len()];
    /// let shade = |_pixel: usize, contribution: lightshed_resampling::Contribution<'_, u32>, sum: &mut [f64; 3]| {
    ///     let light = f64::from(*contribution.sample) * contribution.weight;
    ///     *sum = sum.map(|channel| channel + light);
    /// };
    /// let window = Pattern::window(1)?;
    /// reuse.spatial_integrated(&window, 0, &input, &mut output, &mut image, rng, shade, &|_, _| ())?;
    /// assert!(image.iter().all(|[red, ..]| (red - 6.0).abs() < 1e-6));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Reuse::temporal`].
    #[allow(clippy::too_many_arguments)]
    pub fn spatial_integrated<R: Storage, C: Choose, A: Send>(
        &self,
        pattern: &Pattern,
        key: u32,
        input: &[DomainReservoir<D, R>],
        output: &mut [DomainReservoir<D, R>],
        sums: &mut [A],
        choose: impl Fn(usize) -> C + Sync,
        visit: impl Fn(usize, Contribution<'_, D::Sample>, &mut A) + Sync,
        observe: Observe<'_>,
    ) -> Result<(), ReuseError> {
        let count = self.extent.len();
        if input.len() != count || output.len() != count || sums.len() != count {
            return Err(ReuseError::Length);
        }
        let inputs = || Vec::with_capacity(pattern.max_neighbours() + 1);
        each_pair(output, sums, inputs, |inputs, pixel, output, sum| {
            self.gather(pattern, key, pixel, input, inputs);
            self.finish(pixel, inputs, output, &choose, observe, |to, inputs, choose| {
                merge_and_integrate(to, self.shift, inputs, self.mis, choose, |contribution| {
                    visit(pixel, contribution, sum);
                })
            })
        })
    }

    /// A pixel's own reservoir and those of its neighbours.
    fn gather<'b, R: Storage>(
        &'b self,
        pattern: &Pattern,
        key: u32,
        pixel: usize,
        input: &'b [DomainReservoir<D, R>],
        inputs: &mut Vec<Input<'b, D, R>>,
    ) {
        inputs.clear();
        inputs.push(Input::canonical(&self.domains[pixel], &input[pixel]));
        pattern.for_each(self.extent, pixel, key, |index| {
            if self.admits(&self.domains[pixel], &self.domains[index]) {
                inputs.push(Input::neighbour(&self.domains[index], &input[index]));
            }
        });
    }

    /// `rounds` rounds of [`Reuse::spatial`], between two buffers: the result is in `reservoirs`, `scratch`
    /// holds rubbish. `key` and `choose` are asked for each round.
    ///
    /// # Errors
    /// As [`Reuse::spatial`].
    #[allow(clippy::too_many_arguments)]
    pub fn spatial_rounds<R: Storage, C: Choose>(
        &self,
        pattern: &Pattern,
        rounds: u32,
        key: impl Fn(u32) -> u32,
        reservoirs: &mut Vec<DomainReservoir<D, R>>,
        scratch: &mut Vec<DomainReservoir<D, R>>,
        choose: impl Fn(u32, usize) -> C + Sync,
        observe: Observe<'_>,
    ) -> Result<(), ReuseError> {
        for round in 0..rounds {
            let choose = |pixel| choose(round, pixel);
            self.spatial(pattern, key(round), reservoirs, scratch, choose, observe)?;
            core::mem::swap(reservoirs, scratch);
        }
        Ok(())
    }

    /// One round of reuse in pairs: `N` shifts serve `N` pixels, where [`Reuse::spatial`] with one neighbour
    /// takes `2N`. Pixels without a partner keep their reservoir.
    ///
    /// # Errors
    /// As [`Reuse::temporal`], and [`ReuseError::NotPairwise`].
    pub fn paired<R: Storage, C: Choose>(
        &self,
        pattern: &PairedPattern,
        key: u32,
        input: &[DomainReservoir<D, R>],
        output: &mut [DomainReservoir<D, R>],
        choose: impl Fn(usize) -> C + Sync,
        observe: Observe<'_>,
    ) -> Result<(), ReuseError> {
        let count = self.extent.len();
        if input.len() != count || output.len() != count {
            return Err(ReuseError::Length);
        }
        let Mis::Pairwise(pairwise) = self.mis else {
            return Err(ReuseError::NotPairwise);
        };
        // All shifts of the round, one a pixel; merges only read them.
        let mut carried = vec![None; count];
        each(
            &mut carried,
            || (),
            |(), pixel, carried| {
                let partner = pattern.partner(self.extent, pixel, key);
                let both = |a: usize, b: usize| self.admits(&self.domains[a], &self.domains[b]);
                let partner = partner.filter(|&partner| both(pixel, partner) && both(partner, pixel));
                *carried = partner.map(|partner| {
                    let (from, to) = (&self.domains[pixel], &self.domains[partner]);
                    (partner, Carried::new(self.shift, input[pixel].sample(), from, to))
                });
                Ok(())
            },
        )?;
        each(
            output,
            || (),
            |(), pixel, output| {
                let exchange = carried[pixel].as_ref().and_then(|(partner, outgoing)| {
                    carried[*partner]
                        .as_ref()
                        .map(|(_, incoming)| (*partner, outgoing, incoming))
                });
                let exchange = exchange.filter(|_| input[pixel].confidence() > 0.0);
                let Some((partner, outgoing, incoming)) = exchange else {
                    *output = input[pixel].clone().with_confidence_cap(self.confidence_cap);
                    return Ok(());
                };
                let merged = self.pair(
                    pairwise,
                    pixel,
                    partner,
                    input,
                    (incoming, outgoing),
                    &mut choose(pixel),
                );
                let (reservoir, report) = merged.map_err(ReuseError::Merge)?;
                observe(pixel, &report);
                *output = reservoir.with_confidence_cap(self.confidence_cap);
                Ok(())
            },
        )
    }

    /// The merge of one side of a pair.
    fn pair<R: Storage>(
        &self,
        pairwise: Pairwise,
        pixel: usize,
        partner: usize,
        input: &[DomainReservoir<D, R>],
        (incoming, outgoing): (&Carried<D::Sample>, &Carried<D::Sample>),
        choose: &mut impl Choose,
    ) -> Result<(DomainReservoir<D, R>, MergeReport), MergeError> {
        let (own, other) = (&self.domains[pixel], &self.domains[partner]);
        let confidence = f64::from(input[partner].confidence());
        let mut stream = PairwiseStream::new(own, own, &input[pixel], pairwise, confidence)?;
        stream.exchanged(other, &input[partner], incoming, outgoing, choose)?;
        let merged = stream.finish(choose);
        Ok((merged.reservoir, merged.report))
    }

    /// The merge of one pixel.
    fn merge<R: Storage, C: Choose>(
        &self,
        pixel: usize,
        inputs: &[Input<'_, D, R>],
        output: &mut DomainReservoir<D, R>,
        choose: &impl Fn(usize) -> C,
        observe: Observe<'_>,
    ) -> Result<(), ReuseError> {
        self.finish(pixel, inputs, output, choose, observe, |to, inputs, choose| {
            merge(to, self.shift, inputs, self.mis, choose)
        })
    }

    /// One pixel, its inputs merged by `merge`.
    fn finish<R: Storage, C: Choose>(
        &self,
        pixel: usize,
        inputs: &[Input<'_, D, R>],
        output: &mut DomainReservoir<D, R>,
        choose: &impl Fn(usize) -> C,
        observe: Observe<'_>,
        merge: impl FnOnce(&D, &[Input<'_, D, R>], &mut C) -> Result<Merged<D, R>, MergeError>,
    ) -> Result<(), ReuseError> {
        // No confidence of its own: the pixel takes no part (background, say).
        if inputs[0].confidence() == 0.0 {
            *output = inputs[0].reservoir.clone();
            return Ok(());
        }
        let merged = merge(&self.domains[pixel], inputs, &mut choose(pixel));
        let merged = merged.map_err(ReuseError::Merge)?;
        observe(pixel, &merged.report);
        *output = merged.reservoir.with_confidence_cap(self.confidence_cap);
        Ok(())
    }
}

/// [`each_pair`] for one slice.
fn each<X: Send, S>(
    elements: &mut [X],
    scratch: impl Fn() -> S + Sync + Send,
    run: impl Fn(&mut S, usize, &mut X) -> Result<(), ReuseError> + Sync + Send,
) -> Result<(), ReuseError> {
    // Units take no room: this allocates nothing.
    let mut units = vec![(); elements.len()];
    each_pair(elements, &mut units, scratch, |scratch, index, element, ()| {
        run(scratch, index, element)
    })
}

/// Runs `run` for each pair of elements of two slices of one length, with per-thread scratch made by `scratch`. Pairs are
/// independent of each other.
#[cfg(feature = "parallel")]
fn each_pair<X: Send, A: Send, S>(
    elements: &mut [X],
    others: &mut [A],
    scratch: impl Fn() -> S + Sync + Send,
    run: impl Fn(&mut S, usize, &mut X, &mut A) -> Result<(), ReuseError> + Sync + Send,
) -> Result<(), ReuseError> {
    use rayon::prelude::*;
    elements
        .par_iter_mut()
        .zip(others)
        .enumerate()
        .with_min_len(64)
        .try_for_each_init(scratch, |scratch, (index, (element, other))| {
            run(scratch, index, element, other)
        })
}

/// Runs `run` for each pair of elements of two slices of one length, with scratch made by `scratch`. Pairs are independent of
/// each other.
#[cfg(not(feature = "parallel"))]
fn each_pair<X, A, S>(
    elements: &mut [X],
    others: &mut [A],
    scratch: impl Fn() -> S,
    run: impl Fn(&mut S, usize, &mut X, &mut A) -> Result<(), ReuseError>,
) -> Result<(), ReuseError> {
    let mut scratch = scratch();
    elements
        .iter_mut()
        .zip(others)
        .enumerate()
        .try_for_each(|(index, (element, other))| run(&mut scratch, index, element, other))
}
