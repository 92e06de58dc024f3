//! A pixel's way to what a tree has found.

use super::flight::{Way, flight_density};
use super::tree::{Behind, First};
use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::PhaseFunction;
use lightshed_scene::{Medium, Ray, Scene};

/// A pixel's flight to the second collision of a tree, or in the direction of its escape.
#[derive(Clone, Copy, Debug, Default)]
pub struct Connection {
    /// What the pixel sees of it but for albedos: `p(ω) e^{−∫σ̄} Π σ_n`, of a collision times
    /// `d^{|n|} / d²`.
    pub value: f64,
    /// The density with which the pixel makes it.
    pub pdf: f64,
    /// The phase function at the second collision towards the emitter that it has seen.
    pub to_emitter: f32,
    /// The same in the direction in which the path goes on.
    pub onward: f32,
    /// The phase function at the first collision.
    pub phase: f32,
}

impl Connection {
    /// `None` if the pixel could not have made it. `look` says whether surfaces may be in the way.
    pub fn new<K>(scene: &Scene, first: &First<K>, behind: &Behind, look: bool) -> Option<Self> {
        let medium = &scene.media()[first.medium as usize];
        let (direction, flight) = match behind {
            Behind::Collision(second) => {
                let between = second.position - first.position;
                let squared = between.length_squared();
                let (distance, direction) = (squared.sqrt(), between / squared.sqrt());
                let segment = Ray::segment(first.position, direction, distance);
                let look = look && !scene.medium_is_clear(first.medium);
                if !(squared > 0.0) || look && scene.nearest(&segment).is_some() {
                    return None;
                }
                let way = Way {
                    from: first.place,
                    along: second.place - first.place,
                    distance: Some(distance),
                };
                let density = flight_density(medium, &way, &second.nulls);
                (direction, density / f64::from(squared))
            }
            Behind::Escape(escape) => {
                let (nulls, direction) = (escape.nulls.as_ref()?, escape.direction);
                let ray = Ray::new(first.position, direction);
                if look && scene.passes_grid_alone(&ray, first.medium) != Some(true) {
                    return None;
                }
                let way = Way {
                    from: first.place,
                    along: escape.movement,
                    distance: None,
                };
                (direction, flight_density(medium, &way, nulls))
            }
        };
        let phase = medium.phase().phase_between(first.incoming, direction);
        let value = f64::from(phase) * flight;
        (value > 0.0 && value.is_finite()).then(|| Self::of(medium, first, behind, direction, value))
    }

    /// Of the tree's own pixel, if no other uses it.
    pub fn alone<K>(scene: &Scene, first: &First<K>, behind: &Behind) -> Self {
        let medium = &scene.media()[first.medium as usize];
        let direction = match behind {
            Behind::Collision(second) => (second.position - first.position).normalize_or_zero(),
            Behind::Escape(escape) => escape.direction,
        };
        Self::of(medium, first, behind, direction, 1.0)
    }

    fn of<K>(medium: &Medium, first: &First<K>, behind: &Behind, direction: Vec3, value: f64) -> Self {
        let phase = medium.phase();
        let scattered = |to| phase.phase_between(direction, to);
        let (to_emitter, onward) = match behind {
            Behind::Collision(second) => (
                second
                    .emitter
                    .as_ref()
                    .map_or(0.0, |seen| scattered(seen.direction)),
                second
                    .onward
                    .as_ref()
                    .map_or(0.0, |onward| scattered(onward.direction)),
            ),
            Behind::Escape(_) => (0.0, 0.0),
        };
        Self {
            value,
            pdf: value * f64::from(first.survival),
            to_emitter,
            onward,
            phase: phase.phase_between(first.incoming, direction),
        }
    }

    /// Density of the flight and then of the direction in which the path goes on.
    pub fn onward_pdf(&self) -> f64 {
        self.pdf * f64::from(self.onward)
    }
}
