//! Passes of reuse.

use super::domains::Domains;
use super::each::{each, each_pair};
use super::error::ReuseError;
use super::rule::MergeRule;
use super::topology::{AtMostOne, Topology};
use crate::choose::Choose;
use crate::domain::{Domain, ShiftMapping};
use crate::merge::{
    Carried, Contribution, DomainReservoir, Input, MergeError, MergeReport, Merged, PairwiseStream,
};
use crate::mis::{Mis, Pairwise};
use crate::reservoir::Reservoir;
use crate::storage::Storage;

/// Domains and their reservoirs from the previous frame, or from another place.
///
/// The reservoirs' samples live in the domains of *their* frame, with its surfaces, lights and
/// visibility. To give this frame's domains instead saves keeping the old ones, and is **biased**
/// where anything moved: MIS weights then ask the wrong domain what it could have produced.
pub struct History<'a, Ds: Domains + ?Sized, R: Storage = f32> {
    pub(super) domains: &'a Ds,
    pub(super) reservoirs: &'a [DomainReservoir<Ds::Domain, R>],
}

impl<'a, Ds: Domains + ?Sized, R: Storage> History<'a, Ds, R> {
    /// The previous frame's domains and their reservoirs, one each; a pass refuses slices of other
    /// lengths.
    pub fn new(domains: &'a Ds, reservoirs: &'a [DomainReservoir<Ds::Domain, R>]) -> Self {
        Self { domains, reservoirs }
    }

    pub(super) fn check(&self) -> Result<(), ReuseError> {
        let agree = self.domains.count() == self.reservoirs.len();
        agree.then_some(()).ok_or(ReuseError::Length)
    }
}

/// Where a round that integrates adds up: an element for each domain, and a function that takes
/// each [`Contribution`] to it.
pub struct Sums<'a, A, V> {
    pub(super) sums: &'a mut [A],
    pub(super) visit: V,
}

impl<'a, A, V> Sums<'a, A, V> {
    /// `visit(index, contribution, sum)` adds a contribution to the integral of the domain at
    /// `index` to its element of `sums`.
    pub fn new<X>(sums: &'a mut [A], visit: V) -> Self
    where
        V: Fn(usize, Contribution<'_, X>, &mut A) + Sync,
    {
        Self { sums, visit }
    }
}

/// Reuse among domains: what all passes of a frame share.
///
/// ```
/// use lightshed_resampling::{
///     Counting, Domain, DomainReservoir, Extent, History, IdentityShift, MergeRule, Pattern, Reuse,
///     Ris, Tractable,
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
/// // The lowest row sees no surface.
/// let sees = |i: &usize| *i < 7 * 16;
/// let pixels: Vec<Option<Pixel>> =
///     (0..extent.len()).map(|i| sees(&i).then_some(Pixel(i as u32 % 16 / 2))).collect();
/// let reuse = Reuse::new(&pixels, MergeRule::new(IdentityShift));
/// let neighbours = Pattern::disk(3.0, 4)?;
/// let uniform = Tractable::<Counting>::from_density(1.0 / 8.0)?.weight();
/// let mut held = vec![DomainReservoir::<Pixel>::empty(0.0); extent.len()];
/// let mut merged = held.clone();
/// for frame in 0..4 {
///     // One stream of random numbers for each pass of each pixel.
///     let rng = |pass| move |pixel: usize| CounterRng::new(pass, pixel as u32, frame);
///     let fresh: Vec<DomainReservoir<Pixel>> = (0..extent.len())
///         .map(|i| {
///             let (mut ris, mut rng) = (Ris::new(), rng(0)(i));
///             let light = rng.next_u32() % 8;
///             let target = pixels[i].as_ref().map_or(0.0, |pixel| pixel.target(&light));
///             ris.candidate(light, target, uniform, &mut rng);
///             ris.finish(1.0)
///         })
///         .collect();
///     // A still scene: the previous frame's domains are this one's, and so is each pixel's place.
///     let history = History::new(&pixels, &held);
///     reuse.temporal(&fresh, history, Some, &mut merged, rng(1))?;
///     reuse.spatial(neighbours.over(extent, frame), &merged, &mut held, rng(2))?;
/// }
/// assert!(held.iter().enumerate().all(|(i, reservoir)| sees(&i) == (reservoir.confidence() == 20.0)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// A domain that is absent (see [`Domains`]), or has an own reservoir without confidence, is left
/// out: others give it no weight. The reservoir of an absent domain becomes empty; a reservoir
/// without confidence passes through.
///
/// Each pass makes the source of each domain's decisions by a `choose` of the domain's index.
pub struct Reuse<'a, Ds, T> {
    pub(super) domains: Ds,
    pub(super) rule: MergeRule<T>,
    observer: Option<Observer<'a>>,
}

/// Hears of each merge.
type Observer<'a> = &'a (dyn Fn(usize, &MergeReport) + Sync);

/// A reservoir of one of the domains.
pub(super) type Held<Ds, R> = DomainReservoir<<Ds as Domains>::Domain, R>;

/// What is sampled in the domains.
pub(super) type Sample<Ds> = <<Ds as Domains>::Domain as Domain>::Sample;

impl<'a, Ds, T> Reuse<'a, Ds, T>
where
    Ds: Domains,
    Sample<Ds>: Send + Sync,
    T: ShiftMapping<Ds::Domain> + Sync,
{
    /// Reuse among `domains`, owned, shared or borrowed, that merge by `rule`.
    pub fn new(domains: Ds, rule: MergeRule<T>) -> Self {
        Self {
            domains,
            rule,
            observer: None,
        }
    }

    /// `observer(index, report)` hears of each domain's merge, from any thread.
    #[must_use]
    pub fn with_observer(self, observer: &'a (dyn Fn(usize, &MergeReport) + Sync)) -> Self {
        Self {
            observer: Some(observer),
            ..self
        }
    }

    /// The domains.
    pub fn domains(&self) -> &Ds {
        &self.domains
    }

    /// Temporal reuse: merges each domain's fresh reservoir (canonical) with that of `history` at
    /// `correspondence(index)`. Where that is `None`, out of range or absent, the fresh reservoir
    /// passes through.
    ///
    /// A correspondence may depend on domains and random bits. One that depends on the fresh sample
    /// is biased (Lin 2022 §5.4.4), and so is one that depends on samples of the history.
    ///
    /// # Errors
    /// [`ReuseError::Length`], or the error of some domain's merge.
    pub fn temporal<H, R: Storage, C: Choose>(
        &self,
        fresh: &[Held<Ds, R>],
        history: History<'_, H, R>,
        correspondence: impl Fn(usize) -> Option<usize> + Sync,
        output: &mut [Held<Ds, R>],
        choose: impl Fn(usize) -> C + Sync,
    ) -> Result<(), ReuseError>
    where
        H: Domains<Domain = Ds::Domain> + ?Sized,
    {
        self.linked(fresh, history, AtMostOne(correspondence), output, choose)
    }

    /// One round of spatial reuse: each domain merges its own reservoir (canonical) with those of
    /// its neighbours. Run it again on the output, over a topology with other random bits, for more
    /// rounds.
    ///
    /// # Errors
    /// As [`Reuse::temporal`].
    pub fn spatial<R: Storage, C: Choose>(
        &self,
        topology: impl Topology,
        input: &[Held<Ds, R>],
        output: &mut [Held<Ds, R>],
        choose: impl Fn(usize) -> C + Sync,
    ) -> Result<(), ReuseError> {
        self.check([input.len(), output.len()])?;
        let inputs = || Vec::with_capacity(topology.max_neighbours() + 1);
        each(output, inputs, |inputs, index, output| {
            let Some(own) = self.gather(&topology, index, input, inputs) else {
                *output = Reservoir::empty(0.0);
                return Ok(());
            };
            self.finish(index, inputs, output, || {
                self.rule.merge(own, inputs, &mut choose(index))
            })
        })
    }

    /// As [`Reuse::spatial`], with the same reservoirs as a result, and the sum form of each
    /// domain's integral besides: `sums` is handed each [`Contribution`]. A last round that shades
    /// so has no colour noise (Lin 2022 eq. 6.47).
    ///
    /// ```
    /// # use lightshed_resampling::{
    /// #     Contribution, Counting, Domain, DomainReservoir, Extent, IdentityShift, MergeRule,
    /// #     Pattern, Reuse, Sums,
    /// # };
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
    /// # let reuse = Reuse::new(&pixels, MergeRule::new(IdentityShift));
    /// # let input = vec![DomainReservoir::<Pixel>::from_density(3, 0.5, 1.0)?; 4];
    /// # let mut output = input.clone();
    /// # let rng = |pixel| CounterRng::new(7, pixel as u32, 0);
    /// // Each pixel's light: what its sample (here a number) carries in three channels, times its weight.
    /// let mut image = vec![[0.0; 3]; extent.len()];
    /// let shade = |_pixel: usize, contribution: Contribution<'_, u32>, sum: &mut [f64; 3]| {
    ///     let light = f64::from(*contribution.sample) * contribution.weight;
    ///     *sum = sum.map(|channel| channel + light);
    /// };
    /// let window = Pattern::window(1)?.over(extent, 0);
    /// reuse.spatial_integrated(window, &input, &mut output, Sums::new(&mut image, shade), rng)?;
    /// assert!(image.iter().all(|[red, ..]| (red - 6.0).abs() < 1e-6));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Reuse::temporal`].
    pub fn spatial_integrated<R: Storage, C: Choose, A: Send, V>(
        &self,
        topology: impl Topology,
        input: &[Held<Ds, R>],
        output: &mut [Held<Ds, R>],
        Sums { sums, visit }: Sums<'_, A, V>,
        choose: impl Fn(usize) -> C + Sync,
    ) -> Result<(), ReuseError>
    where
        V: Fn(usize, Contribution<'_, Sample<Ds>>, &mut A) + Sync,
    {
        self.check([input.len(), output.len()])?;
        self.check([sums.len(), output.len()])?;
        let inputs = || Vec::with_capacity(topology.max_neighbours() + 1);
        each_pair(output, sums, inputs, |inputs, index, output, sum| {
            let Some(own) = self.gather(&topology, index, input, inputs) else {
                *output = Reservoir::empty(0.0);
                return Ok(());
            };
            self.finish(index, inputs, output, || {
                let visit = |contribution: Contribution<'_, Sample<Ds>>| visit(index, contribution, sum);
                self.rule
                    .merge_and_integrate(own, inputs, &mut choose(index), visit)
            })
        })
    }

    /// Rounds of [`Reuse::spatial`] between two buffers: the result is in `reservoirs`, `scratch`
    /// holds rubbish. `rounds` gives their numbers (`0..3`); `topology` and `choose` are asked for
    /// each.
    ///
    /// # Errors
    /// As [`Reuse::spatial`].
    pub fn spatial_rounds<R: Storage, C: Choose, P: Topology>(
        &self,
        rounds: impl IntoIterator<Item = u32>,
        topology: impl Fn(u32) -> P,
        reservoirs: &mut Vec<Held<Ds, R>>,
        scratch: &mut Vec<Held<Ds, R>>,
        choose: impl Fn(u32, usize) -> C + Sync,
    ) -> Result<(), ReuseError> {
        for round in rounds {
            self.spatial(topology(round), reservoirs, scratch, |index| choose(round, index))?;
            core::mem::swap(reservoirs, scratch);
        }
        Ok(())
    }

    /// One round of reuse in pairs: `N` shifts serve `N` domains, where [`Reuse::spatial`] with one
    /// neighbour takes `2N`.
    ///
    /// `pairs` is a topology. Only the first neighbour of each domain counts: it is its partner, if
    /// that neighbour's partner is the domain. Domains without a partner keep their reservoir.
    ///
    /// # Errors
    /// As [`Reuse::temporal`], and [`ReuseError::NotPairwise`].
    pub fn paired<R: Storage, C: Choose>(
        &self,
        pairs: impl Topology,
        input: &[Held<Ds, R>],
        output: &mut [Held<Ds, R>],
        choose: impl Fn(usize) -> C + Sync,
    ) -> Result<(), ReuseError> {
        self.check([input.len(), output.len()])?;
        let Mis::Pairwise(pairwise) = self.rule.mis else {
            return Err(ReuseError::NotPairwise);
        };
        let first = |index| {
            let mut first = None;
            pairs.for_each(index, |neighbour| first = first.or(Some(neighbour)));
            first
        };
        // All shifts of the round, one a domain; merges only read them.
        let mut carried = vec![None; input.len()];
        let carry = |(): &mut (), index: usize, carried: &mut Option<_>| {
            let partner = first(index).filter(|&partner| partner != index && first(partner) == Some(index));
            *carried = partner.and_then(|partner| {
                let (from, to) = (self.domains.domain(index)?, self.domains.domain(partner)?);
                let outgoing = Carried::new(&self.rule.shift, input[index].sample(), from, to);
                Some((partner, outgoing))
            });
            Ok(())
        };
        each(&mut carried, || (), carry)?;
        let run = |(): &mut (), index: usize, output: &mut Held<Ds, R>| {
            let Some(own) = self.domains.domain(index) else {
                *output = Reservoir::empty(0.0);
                return Ok(());
            };
            let exchange = carried[index].as_ref().and_then(|(partner, outgoing)| {
                let (_, incoming) = carried[*partner].as_ref()?;
                Some((*partner, self.domains.domain(*partner)?, [incoming, outgoing]))
            });
            let exchange = exchange.filter(|_| input[index].confidence() > 0.0);
            let Some((partner, other, shifts)) = exchange else {
                *output = self.rule.passed(&input[index]);
                return Ok(());
            };
            let reservoirs = [&input[index], &input[partner]];
            let merged = pair(pairwise, [own, other], reservoirs, shifts, &mut choose(index));
            let merged = self.rule.capped(merged.map_err(ReuseError::Merge)?);
            self.keep(index, merged, output);
            Ok(())
        };
        each(output, || (), run)
    }

    pub(super) fn check(&self, lengths: [usize; 2]) -> Result<(), ReuseError> {
        let agree = lengths.iter().all(|&length| length == self.domains.count());
        agree.then_some(()).ok_or(ReuseError::Length)
    }

    /// A domain's own reservoir and those of its neighbours; `None` if it is absent.
    #[inline]
    fn gather<'b, R: Storage>(
        &'b self,
        topology: &impl Topology,
        index: usize,
        input: &'b [Held<Ds, R>],
        inputs: &mut Vec<Input<'b, Ds::Domain, R>>,
    ) -> Option<&'b Ds::Domain> {
        let own = self.domains.domain(index)?;
        inputs.clear();
        inputs.push(Input::canonical(own, &input[index]));
        topology.for_each(index, |neighbour| {
            if neighbour != index
                && let Some(domain) = self.domains.domain(neighbour)
            {
                inputs.push(Input::neighbour(domain, &input[neighbour]));
            }
        });
        Some(own)
    }

    /// One domain, its inputs merged by `merge`.
    #[inline]
    pub(super) fn finish<R: Storage>(
        &self,
        index: usize,
        inputs: &[Input<'_, Ds::Domain, R>],
        output: &mut Held<Ds, R>,
        merge: impl FnOnce() -> Result<Merged<Ds::Domain, R>, MergeError>,
    ) -> Result<(), ReuseError> {
        // No confidence of its own: the domain takes no part.
        if inputs[0].confidence() == 0.0 {
            *output = inputs[0].reservoir.clone();
        } else {
            self.keep(index, merge().map_err(ReuseError::Merge)?, output);
        }
        Ok(())
    }

    #[inline]
    fn keep<R: Storage>(&self, index: usize, merged: Merged<Ds::Domain, R>, output: &mut Held<Ds, R>) {
        if let Some(observer) = self.observer {
            observer(index, &merged.report);
        }
        *output = merged.reservoir;
    }
}

/// The merge of one side of a pair; the domain itself is the first input.
fn pair<D: Domain, R: Storage>(
    pairwise: Pairwise,
    [own, other]: [&D; 2],
    [canonical, neighbour]: [&DomainReservoir<D, R>; 2],
    [incoming, outgoing]: [&Carried<D::Sample>; 2],
    choose: &mut impl Choose,
) -> Result<Merged<D, R>, MergeError> {
    let confidence = f64::from(neighbour.confidence());
    let mut stream = PairwiseStream::new(own, own, canonical, pairwise, confidence)?;
    stream.exchanged(other, neighbour, incoming, outgoing, choose)?;
    Ok(stream.finish(choose))
}
