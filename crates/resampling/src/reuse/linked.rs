//! Reuse from domains of another row.

use super::domains::Domains;
use super::each::{each, each_pair};
use super::error::ReuseError;
use super::pass::{Held, History, Reuse, Sample, Sums};
use super::topology::Topology;
use crate::choose::Choose;
use crate::domain::ShiftMapping;
use crate::merge::{Contribution, Input};
use crate::reservoir::Reservoir;
use crate::storage::Storage;

impl<'a, Ds, T> Reuse<'a, Ds, T>
where
    Ds: Domains,
    Sample<Ds>: Send + Sync,
    T: ShiftMapping<Ds::Domain> + Sync,
{
    /// Reuse from domains of another row, several at a time: merges each domain's own reservoir
    /// (canonical) with those of `others` that `links` leads to. Examples are cells in space that
    /// serve pixels as reservoirs, or several places of the frame before. [`Reuse::temporal`] is
    /// the case of one link.
    ///
    /// The neighbours that `links` visits for a domain are indices of `others`; there is no
    /// "itself" among them. Those that are out of range or absent are passed over. A domain without
    /// any passes its own reservoir through. The law of [`Topology`] holds: links may depend on
    /// domains and random bits, never on samples, on this side or the other.
    ///
    /// # Errors
    /// As [`Reuse::temporal`].
    pub fn linked<H, R: Storage, C: Choose>(
        &self,
        own: &[Held<Ds, R>],
        others: History<'_, H, R>,
        links: impl Topology,
        output: &mut [Held<Ds, R>],
        choose: impl Fn(usize) -> C + Sync,
    ) -> Result<(), ReuseError>
    where
        H: Domains<Domain = Ds::Domain> + ?Sized,
    {
        self.check([own.len(), output.len()])?;
        others.check()?;
        let inputs = || Vec::with_capacity(links.max_neighbours() + 1);
        each(output, inputs, |inputs, index, output| {
            let Some(domain) = self.linked_inputs(own, &others, &links, index, inputs) else {
                *output = Reservoir::empty(0.0);
                return Ok(());
            };
            if inputs.len() == 1 {
                *output = self.rule.passed(&own[index]);
                return Ok(());
            }
            self.finish(index, inputs, output, || {
                self.rule.merge(domain, inputs, &mut choose(index))
            })
        })
    }

    /// As [`Reuse::linked`], with the sum form of each domain's integral besides, as
    /// [`Reuse::spatial_integrated`] has it. Domains without links add what their own reservoir
    /// contributes.
    ///
    /// # Errors
    /// As [`Reuse::temporal`].
    pub fn linked_integrated<H, R: Storage, C: Choose, A: Send, V>(
        &self,
        own: &[Held<Ds, R>],
        others: History<'_, H, R>,
        links: impl Topology,
        output: &mut [Held<Ds, R>],
        Sums { sums, visit }: Sums<'_, A, V>,
        choose: impl Fn(usize) -> C + Sync,
    ) -> Result<(), ReuseError>
    where
        H: Domains<Domain = Ds::Domain> + ?Sized,
        V: Fn(usize, Contribution<'_, Sample<Ds>>, &mut A) + Sync,
    {
        self.check([own.len(), output.len()])?;
        self.check([sums.len(), output.len()])?;
        others.check()?;
        let inputs = || Vec::with_capacity(links.max_neighbours() + 1);
        each_pair(output, sums, inputs, |inputs, index, output, sum| {
            let Some(domain) = self.linked_inputs(own, &others, &links, index, inputs) else {
                *output = Reservoir::empty(0.0);
                return Ok(());
            };
            self.finish(index, inputs, output, || {
                let visit = |contribution: Contribution<'_, Sample<Ds>>| visit(index, contribution, sum);
                self.rule
                    .merge_and_integrate(domain, inputs, &mut choose(index), visit)
            })
        })
    }

    /// A domain's own reservoir and those that it is linked to; `None` if it is absent.
    #[inline]
    fn linked_inputs<'b, H, R: Storage>(
        &'b self,
        own: &'b [Held<Ds, R>],
        others: &History<'b, H, R>,
        links: &impl Topology,
        index: usize,
        inputs: &mut Vec<Input<'b, Ds::Domain, R>>,
    ) -> Option<&'b Ds::Domain>
    where
        H: Domains<Domain = Ds::Domain> + ?Sized,
    {
        let domain = self.domains.domain(index)?;
        inputs.clear();
        inputs.push(Input::canonical(domain, &own[index]));
        let (domains, reservoirs) = (others.domains, others.reservoirs);
        links.for_each(index, |other| {
            if let (Some(domain), Some(reservoir)) = (domains.domain(other), reservoirs.get(other)) {
                inputs.push(Input::neighbour(domain, reservoir));
            }
        });
        Some(domain)
    }
}
