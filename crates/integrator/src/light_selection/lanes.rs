//! Selections for eight points at a time.

use super::LightSelection;
use super::choosing::{Chosen, TOGETHER};
use super::sampler::{Sampler, with_sampler};
use crate::emitter_sampler::ChosenLanes;
use lightshed_lanes::LANES;
use lightshed_lights::{LightSampler, ShadingPoint};

const _: () = assert!(LANES <= TOGETHER);

impl LightSelection<'_> {
    /// Selects for one number of each point.
    #[inline(never)]
    pub(super) fn choose_eight(
        &self,
        u_select: [[u32; LANES]; 2],
        sites: &[ShadingPoint; LANES],
        wanted: u32,
    ) -> ChosenLanes {
        let (mut lanes, mut u, mut count) = ([0; LANES], [0; LANES], 0);
        for lane in (0..LANES).filter(|lane| wanted >> lane & 1 == 1) {
            let [low, high] = u_select.map(|words| u64::from(words[lane]));
            (lanes[count], u[count]) = (lane, high << 32 | low);
            count += 1;
        }
        let mut chosen = [None; LANES];
        self.choose_together(&u[..count], &mut chosen, |sampler, places, u, choices| {
            let mut at = [ShadingPoint::default(); LANES];
            for (at, place) in at.iter_mut().zip(places) {
                *at = sites[lanes[*place as usize]];
            }
            with_sampler!(sampler, s => s.sample_each(&at[..u.len()], u, choices));
        });
        let mut found = ChosenLanes::NONE;
        for (&lane, chosen) in lanes[..count].iter().zip(chosen) {
            found.set(lane, chosen);
        }
        found
    }

    /// Point by point, and the numbers of one point in order, so that trees share their work.
    #[inline(never)]
    pub(super) fn choose_of_each(
        &self,
        sites: &[ShadingPoint; LANES],
        u_select: &[[[u32; LANES]; 2]],
        wanted: u32,
        found: &mut [ChosenLanes],
    ) {
        found.fill(ChosenLanes::NONE);
        let count = u_select.len().min(found.len());
        let of_lane = |lane: usize| (0..count).map(move |number| (lane, number));
        let lanes = (0..LANES).filter(|lane| wanted >> lane & 1 == 1);
        let mut all = lanes.flat_map(of_lane);
        loop {
            let (mut of, mut u, mut count) = ([(0, 0); TOGETHER], [0; TOGETHER], 0);
            for (lane, number) in all.by_ref().take(TOGETHER) {
                let [low, high] = u_select[number].each_ref().map(|words| u64::from(words[lane]));
                (of[count], u[count]) = ((lane, number), high << 32 | low);
                count += 1;
            }
            if count == 0 {
                return;
            }
            let mut chosen = [None; TOGETHER];
            self.choose_together(&u[..count], &mut chosen, |sampler, places, u, choices| {
                let mut lanes = [0; TOGETHER];
                for (lane, place) in lanes.iter_mut().zip(places) {
                    *lane = of[usize::from(*place)].0 as u8;
                }
                with_sampler!(sampler, s => s.sample_for(sites, &lanes[..u.len()], u, choices));
            });
            for (&(lane, number), chosen) in of[..count].iter().zip(chosen) {
                found[number].set(lane, chosen);
            }
        }
    }
}

impl ChosenLanes {
    #[inline(always)]
    fn set(&mut self, lane: usize, chosen: Option<Chosen>) {
        match chosen {
            Some(Chosen::Finite { emitter, probability }) => {
                (self.emitter[lane], self.probability[lane]) = (emitter, probability);
                self.finite |= 1 << lane;
            }
            Some(Chosen::Infinite { u }) => {
                self.u[lane] = u;
                self.infinite |= 1 << lane;
            }
            None => (),
        }
    }
}
