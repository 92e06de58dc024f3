//! Reservoirs of pixels merged by the shift have the pixel's mean.

use super::candidates::candidate;
use super::definition::define;
use super::fog::{End, Fog, Pixel};
use super::laws::{fogs, shift_of};
use crate::volume::{PathCoordinates, VolumePath, VolumePathShift};
use lightshed_resampling::{
    ContributionWeight, DomainReservoir, Input, Jacobian, Mis, MixtureRis, Pulled, ShiftMapping, Shifted,
    Undefined, merge,
};
use lightshed_sampling::CounterRng;
use lightshed_sampling::glam::Vec2;
use lightshed_testkit::{MeanTest, check_faults};

/// Candidates of a reservoir.
const CANDIDATES: u32 = 4;

#[derive(Clone, Copy, Debug)]
enum Fault {
    NoJacobian,
    InverseJacobian,
}

struct Wrapped {
    shift: VolumePathShift<Fog>,
    fault: Option<Fault>,
}

impl Wrapped {
    fn jacobian(&self, jacobian: Jacobian) -> Result<Jacobian, Undefined> {
        match self.fault {
            None => Ok(jacobian),
            Some(Fault::NoJacobian) => Ok(Jacobian::IDENTITY),
            Some(Fault::InverseJacobian) => Jacobian::new(jacobian.value().recip()),
        }
    }
}

impl ShiftMapping<Pixel> for Wrapped {
    fn shift(
        &self,
        x: &VolumePath<End>,
        from: &Pixel,
        to: &Pixel,
    ) -> Result<Shifted<VolumePath<End>>, Undefined> {
        let image = self.shift.shift(x, from, to)?;
        Ok(Shifted {
            jacobian: self.jacobian(image.jacobian)?,
            ..image
        })
    }

    fn pull(&self, y: &VolumePath<End>, to: &Pixel, from: &Pixel) -> Result<Pulled, Undefined> {
        let pulled = self.shift.pull(y, to, from)?;
        Ok(Pulled {
            jacobian: self.jacobian(pulled.jacobian)?,
            ..pulled
        })
    }
}

/// A path's light, in the sum over the channels, if it scatters first in the fog and is connected
/// by a short edge there: there Jacobians are mostly large, and what is wrong with them does not
/// cancel against edges where they are small.
fn light(fog: &Fog, pixel: &Pixel, path: &VolumePath<End>) -> f64 {
    let is_counted =
        path.connected_vertex() == Some(1) && path.connection.length < 0.8 && path.vertices() == 2;
    if !is_counted {
        return 0.0;
    }
    define(fog, pixel, path, 1.0).map_or(0.0, |defined| defined.value.element_sum())
}

/// What a pixel's paths are worth on average, and those merged with a pixel's far away.
/// False-positive rate 10⁻⁵.
#[test]
fn merges_have_the_mean_of_their_pixel() {
    let [near, far] = [[0.0, 4.0], [3.0, 1.0]].map(|corner| Pixel {
        corner: Vec2::from(corner),
        is_odd: false,
    });
    let [homogeneous, linear] = fogs();
    for (fog, faults) in [
        (homogeneous, &[][..]),
        (linear, &[Fault::NoJacobian, Fault::InverseJacobian]),
    ] {
        let mut truth = MeanTest::new();
        for sample in 0..1_000_000 {
            let mut rng = CounterRng::new(7, 0, sample);
            let value =
                candidate(&fog, &near, &mut rng).map_or(0.0, |(path, pdf)| light(&fog, &near, &path) / pdf);
            truth.push(value);
        }
        check_faults(faults, |fault| {
            let shift = Wrapped {
                shift: shift_of(&fog),
                fault,
            };
            let mut mean = MeanTest::new();
            for sample in 0..200_000 {
                let mut rng = CounterRng::new(8, 0, sample);
                let found = [&near, &far].map(|pixel| -> DomainReservoir<Pixel, f64> {
                    let (mut ris, share) = (MixtureRis::new(), 1.0 / f64::from(CANDIDATES));
                    for _ in 0..CANDIDATES {
                        if let Some((path, pdf)) = candidate(&fog, pixel, &mut rng) {
                            let weight =
                                ContributionWeight::<PathCoordinates, f64>::new(pdf.recip()).unwrap();
                            ris.candidate(path, f64::from(path.target), share, weight, &mut rng);
                        }
                    }
                    ris.finish(1.0)
                });
                let inputs = [
                    Input::canonical(&near, &found[0]),
                    Input::neighbour(&far, &found[1]),
                ];
                let merged = merge(&near, &shift, &inputs, Mis::Balance, &mut rng)
                    .unwrap()
                    .reservoir;
                mean.push(merged.estimate(|path| light(&fog, &near, path)));
            }
            println!(
                "{fault:?}: {:.4} ± {:.4} against {:.4} ± {:.4}",
                mean.mean(),
                mean.standard_error(),
                truth.mean(),
                truth.standard_error()
            );
            mean.test_equal(&truth, 1e-5)
        })
        .unwrap();
    }
}
