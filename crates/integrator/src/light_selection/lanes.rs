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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EmitterSampler, LightChoosing};
    use lightshed_lanes::{LaneChoice, LaneKernel, LaneMask, LaneWords, Lanes, Vec3Lanes};
    use lightshed_sampling::CounterRng;
    use lightshed_scene::glam::{Affine3A, Vec3};
    use lightshed_scene::{EmitterDescription, EmitterSample, EnvironmentMap, Image, Rgb, Scene, builtin};
    use std::sync::Arc;

    /// Samples at the origin, each with all numbers.
    struct Samples<'a, 'b>(&'a LightSelection<'b>, [u64; LANES], [[f32; LANES]; 2], u32);

    /// Direction, weight and density.
    type Row = [[f32; LANES]; 7];

    impl LaneKernel for Samples<'_, '_> {
        type Output = (Row, u32, u32);

        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let Self(selection, u_select, u, wanted) = self;
            let zero = L::splat(0.0);
            let samples = selection.sample_lanes::<L>(
                Vec3Lanes::new(zero, zero, zero),
                &[ShadingPoint::default(); LANES],
                [
                    L::Words::load(&u_select.map(|u| u as u32)),
                    L::Words::load(&u_select.map(|u| (u >> 32) as u32)),
                ],
                [L::load(&u[0]), L::load(&u[1])],
                wanted,
            );
            let ([x, y, z], [r, g, b]) = (samples.direction.store(), samples.weight.store());
            let row = [x, y, z, r, g, b, samples.pdf_solid_angle.store()];
            (row, samples.found.bits(), samples.is_delta.bits())
        }
    }

    /// Lamps, a sun and a sky: eight samples are those alone, bit for bit, and where the sky is
    /// left out none is of the sky.
    #[test]
    fn samples_in_lanes_are_those_alone() {
        let mut description = builtin::by_name("cornell").unwrap();
        let texels = (0..8 * 4).map(|i| [(i % 7) as f32, (i % 3) as f32, 1.0]);
        description.emitters.extend([
            EmitterDescription::Environment(EnvironmentMap {
                image: Arc::new(Image::from_linear(8, 4, texels.collect()).unwrap()),
                scale: 2.0,
                to_world: Affine3A::from_rotation_x(0.3),
            }),
            EmitterDescription::Directional {
                direction: Vec3::NEG_Y,
                irradiance: Rgb::ONE,
            },
        ]);
        let scene = Scene::new(&description).unwrap();
        for choosing in [LightChoosing::Power, LightChoosing::Bvh, LightChoosing::Unfound] {
            let selection = LightSelection::new(&scene, choosing).unwrap();
            let (mut of_sky, mut others) = (0, 0);
            for number in 0..200 {
                let mut rng = CounterRng::new(8, number, 0);
                let u_select = std::array::from_fn(|_| rng.next_u64());
                let u = [(); 2].map(|()| std::array::from_fn(|_| rng.next_f32()));
                let wanted = rng.next_u32() & 0xff;
                for lanes in LaneChoice::all() {
                    let (row, found, is_delta) = lanes.run(Samples(&selection, u_select, u, wanted));
                    for lane in (0..LANES).filter(|lane| wanted >> lane & 1 == 1) {
                        let u = u.map(|row: [f32; LANES]| row[lane]);
                        let at = ShadingPoint::default();
                        let alone = selection.sample(Vec3::ZERO, &at, u_select[lane], u);
                        assert_eq!(found >> lane & 1 == 1, alone.is_some());
                        let Some(alone) = alone else { continue };
                        let EmitterSample {
                            direction, weight, ..
                        } = alone;
                        let [[x, y, z], [r, g, b]] = [direction, weight].map(|v| v.to_array());
                        let expected = [x, y, z, r, g, b, alone.pdf.value()];
                        assert_eq!(row.map(|row| row[lane]), expected, "{alone:?}");
                        assert_eq!(is_delta >> lane & 1 == 1, alone.is_delta);
                        let environment = scene.emitters().infinite_count() as u32 - 1;
                        let is_sky = alone.emitter == scene.emitters().finite_count() as u32 + environment;
                        *(if is_sky { &mut of_sky } else { &mut others }) += 1;
                    }
                }
            }
            assert_eq!(of_sky > 0, choosing != LightChoosing::Unfound);
            // The density that is known of the sky alone is that of the selection.
            let choice = selection.environment_choice().unwrap();
            let (sky, at) = (scene.emitters().environment().unwrap(), ShadingPoint::default());
            for direction in [Vec3::X, Vec3::Y, Vec3::new(-0.6, 0.0, 0.8)] {
                let by_choice = choice.pdf(sky.pdf_by(choice.sky(), direction));
                assert_eq!(by_choice, selection.pdf_environment(Vec3::ZERO, &at, direction));
                assert_eq!(by_choice.is_positive(), choosing != LightChoosing::Unfound);
            }
            assert!(others > 200, "{others}");
        }
    }
}
