//! Places: what they learn, what they pass on, and their densities.

use lightshed_guiding::glam::Vec3;
use lightshed_guiding::{FieldOptions, GuidingField, GuidingSample, Interpolation, PlaceModel, PlaceOptions};
use lightshed_sampling::{CounterRng, Density, DirectionDistribution, UniformSphere};
use lightshed_spatial::Bounds;

const LAMPS: [Vec3; 2] = [Vec3::new(0.5, 0.5, 3.0), Vec3::new(3.0, 0.5, 0.5)];

fn field(options: PlaceOptions) -> GuidingField<PlaceModel> {
    let model = PlaceModel::new(options).unwrap();
    let bounds = Bounds::new(Vec3::ZERO, Vec3::ONE);
    let options = FieldOptions {
        interpolation: Interpolation::None,
        ..FieldOptions::default()
    };
    GuidingField::new(bounds, model, options).unwrap()
}

/// A sample at `position` that a lamp's middle or its surroundings brought.
fn sample(position: Vec3, place: Vec3, weight: f32) -> GuidingSample {
    let to = place - position;
    GuidingSample {
        position,
        direction: to.normalize(),
        distance: to.length(),
        weight,
        pdf: Density::new(1.0),
        scattering_pdf: Density::new(1.0),
    }
}

fn positions(count: u32) -> impl Iterator<Item = Vec3> {
    (0..count).map(|i| {
        let mut rng = CounterRng::new(5, i, 0);
        Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32())
    })
}

/// Two lamps, the second three times as bright: from every position of the region directions go to
/// both, in these shares, with the even part.
#[test]
fn directions_lead_to_places_in_proportion_to_weights() {
    let mut field = field(PlaceOptions::default());
    for (i, position) in positions(300).enumerate() {
        let wander = 0.01 * UniformSphere::sample(CounterRng::new(6, i as u32, 0).next_2d());
        let both = LAMPS.map(|lamp| lamp + wander);
        field.record(&[sample(position, both[0], 1.0), sample(position, both[1], 3.0)]);
    }
    field.update().unwrap();
    let mut counts = [0u32; 2];
    for (i, position) in positions(200).enumerate() {
        let guide = field.at(position).unwrap();
        for k in 0..50 {
            let u = CounterRng::new(7, i as u32, k).next_2d();
            let (direction, density) = guide.sample(u).unwrap();
            assert_eq!(density, guide.pdf(direction));
            assert!(density.value() > 0.0);
            let seen = LAMPS.map(|lamp| (lamp - position).normalize().distance(direction));
            let near = (0..2).find(|&lamp| seen[lamp] < 0.1).expect("towards a lamp");
            counts[near] += 1;
        }
    }
    // 0.25/2 + 0.75 · 1/4 of 10,000; four standard deviations are 190.
    let share = f64::from(counts[0]) / 10_000.0;
    assert!((share - 0.3125).abs() < 0.019, "{counts:?}");
}

/// Densities have the integral 1, by uniform samples, for wide places and from near.
#[test]
fn densities_are_normalised() {
    let options = PlaceOptions {
        prior_angle: 0.5,
        ..PlaceOptions::default()
    };
    let mut field = field(options);
    for position in positions(20) {
        field.record(&LAMPS.map(|lamp| sample(position, lamp, 1.0)));
    }
    field.update().unwrap();
    let guide = field.at(Vec3::splat(0.4)).unwrap();
    let (mut sum, mut squares) = (0.0, 0.0);
    let count = 200_000u32;
    for i in 0..count {
        let direction = UniformSphere::sample(CounterRng::new(8, i, 0).next_2d());
        let value = f64::from(guide.pdf(direction).value()) / f64::from(UniformSphere::density().value());
        (sum, squares) = (sum + value, squares + value * value);
    }
    let mean = sum / f64::from(count);
    let error = ((squares / f64::from(count) - mean * mean) / f64::from(count)).sqrt();
    // Five standard errors: one wrong alarm in two million.
    assert!(
        error < 0.01 && (mean - 1.0).abs() < 5.0 * error,
        "{mean} ± {error}"
    );
}

/// What one region has found, another tries after the update, if it may.
#[test]
fn regions_try_what_others_found() {
    for exchanges in [true, false] {
        let mut field = field(PlaceOptions {
            exchanges,
            ..PlaceOptions::default()
        });
        // Two regions know the first lamp; only those at low x find the second.
        for position in positions(4000) {
            field.record(&[sample(position, LAMPS[0], 1.0)]);
        }
        field.update().unwrap();
        for position in positions(4000) {
            field.record(&[sample(position, LAMPS[0], 1.0)]);
            if position.x < 0.4 {
                field.record(&[sample(position, LAMPS[1], 1.0)]);
            }
        }
        field.update().unwrap();
        let density = |x: f32| {
            let position = Vec3::new(x, 0.3, 0.3);
            let guide = field.at(position).unwrap();
            guide.pdf((LAMPS[1] - position).normalize()).value()
        };
        assert!(density(0.1) > 100.0);
        assert_eq!(density(0.9) > 1.0, exchanges, "{}", density(0.9));
    }
}

/// One place only is kept where there is memory for one: the brighter, in whichever order they
/// come.
#[test]
fn the_budget_of_memory_is_kept() {
    for bright in [0, 1] {
        let mut field = field(PlaceOptions {
            places: 1,
            ..PlaceOptions::default()
        });
        for position in positions(100) {
            field.record(&[
                sample(position, LAMPS[bright], 1000.0),
                sample(position, LAMPS[1 - bright], 1.0),
            ]);
        }
        field.update().unwrap();
        let position = Vec3::splat(0.5);
        let guide = field.at(position).unwrap();
        let density = LAMPS.map(|lamp| guide.pdf((lamp - position).normalize()).value());
        assert!(
            density[1 - bright] == 0.0 && density[bright] > 100.0,
            "{density:?}"
        );
    }
}

/// Light at infinity, at the position itself, and of any weight makes no density that is no number.
#[test]
fn densities_are_finite() {
    let mut field = field(PlaceOptions::default());
    let position = Vec3::splat(0.5);
    for weight in [f32::MIN_POSITIVE, 1.0, f32::MAX] {
        let at_infinity = GuidingSample {
            distance: f32::INFINITY,
            ..sample(position, LAMPS[0], weight)
        };
        let here = GuidingSample {
            distance: 0.0,
            ..at_infinity
        };
        field.record(&[at_infinity, here, sample(position, LAMPS[1], weight)]);
    }
    for _ in 0..3 {
        field.update().unwrap();
        field.record(&[sample(position, LAMPS[1], 1.0)]);
    }
    let guide = field.at(position).unwrap();
    for i in 0..1000 {
        let u = CounterRng::new(9, i, 0).next_2d();
        for direction in [UniformSphere::sample(u), guide.sample(u).unwrap().0] {
            let density = guide.pdf(direction).value();
            assert!(density >= 0.0 && density.is_finite(), "{density}");
        }
    }
}

#[test]
fn wrong_options_are_refused() {
    let refused = |change: &dyn Fn(&mut PlaceOptions)| {
        let mut options = PlaceOptions::default();
        change(&mut options);
        PlaceModel::new(options).is_err()
    };
    assert!(PlaceModel::new(PlaceOptions::default()).is_ok());
    assert!(refused(&|o| o.places = 0) && refused(&|o| o.places = 513));
    assert!(refused(&|o| o.prior_angle = 0.0) && refused(&|o| o.prior_angle = f32::NAN));
    assert!(refused(&|o| o.prior_count = 0.0) && refused(&|o| o.decay = 1.5));
    assert!(refused(&|o| o.even_share = -0.1));
}
