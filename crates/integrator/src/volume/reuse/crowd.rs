//! The first collisions of a tile side by side, and what all of them see of one flight.

use super::TILE_PIXELS;
use super::flight::Nulls;
use super::tree::{Behind, First};
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, LaneWords, Lanes, Vec3Lanes};
use lightshed_scene::glam::Vec3;
use lightshed_scene::volume::{DensityAccessor, DensityField};
use lightshed_scene::{GridField, Medium, MediumDensity, Ray, Scene};

/// The first collisions of a tile, one a lane.
#[derive(Default)]
pub struct Crowd {
    count: usize,
    /// Numbers of pixels in the tile.
    pixels: [usize; TILE_PIXELS],
    medium: [u32; TILE_PIXELS],
    /// Whether all are in the same medium.
    together: bool,
    position: [[f32; TILE_PIXELS]; 3],
    /// The same in the space of the medium's grid.
    place: [[f32; TILE_PIXELS]; 3],
    incoming: [Vec3; TILE_PIXELS],
    survival: [f32; TILE_PIXELS],
}

impl Crowd {
    /// Those of a tile: of each pixel that has one.
    pub fn gather<'f, K: 'f>(&mut self, firsts: impl Iterator<Item = Option<&'f First<K>>>) {
        self.count = 0;
        for (pixel, first) in firsts.take(TILE_PIXELS).enumerate() {
            let Some(first) = first else {
                continue;
            };
            let lane = self.count;
            (self.pixels[lane], self.medium[lane]) = (pixel, first.medium);
            for axis in 0..3 {
                self.position[axis][lane] = first.position[axis];
                self.place[axis][lane] = first.place[axis];
            }
            (self.incoming[lane], self.survival[lane]) = (first.incoming, first.survival);
            self.count += 1;
        }
        let media = &self.medium[..self.count];
        self.together = media.iter().all(|medium| *medium == media[0]);
        // Lanes without a collision repeat the first one, so that they compute something finite.
        let whole = self.count.next_multiple_of(LANES).min(TILE_PIXELS);
        for lane in self.count..whole {
            for axis in 0..3 {
                self.position[axis][lane] = self.position[axis][0];
                self.place[axis][lane] = self.place[axis][0];
            }
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The number of a lane's pixel.
    pub fn pixel(&self, lane: usize) -> usize {
        self.pixels[lane]
    }

    /// Direction of travel of the camera ray.
    pub fn incoming(&self, lane: usize) -> Vec3 {
        self.incoming[lane]
    }

    /// Probability that roulette lets a path go on.
    pub fn survival(&self, lane: usize) -> f32 {
        self.survival[lane]
    }

    /// Whether this collision is in the same medium.
    pub fn is_in(&self, lane: usize, medium: u32) -> bool {
        self.together || self.medium[lane] == medium
    }

    /// The position of a lane's collision.
    pub fn position(&self, lane: usize) -> Vec3 {
        let [x, y, z] = &self.position;
        Vec3::new(x[lane], y[lane], z[lane])
    }

    /// Direction from a lane's collision to what is behind.
    pub fn direction(&self, lane: usize, behind: &Behind) -> Vec3 {
        match behind {
            Behind::Collision(second) => (second.position - self.position(lane)).normalize_or_zero(),
            Behind::Escape(escape) => escape.direction,
        }
    }

    /// For each lane, the density of the flight to what is behind the collision of lane `own`,
    /// with its null collisions: `e^{−∫σ̄} Π σ_n`, of a collision times `d^{|n|} / d²`, all in a
    /// unit of this flight. 0 if the lane could not have made it.
    /// Returns the medium.
    pub fn densities<'s>(
        &self,
        scene: &'s Scene,
        own: usize,
        behind: &Behind,
        densities: &mut [f32; TILE_PIXELS],
    ) -> &'s Medium {
        let index = self.medium[own];
        let medium = &scene.media()[index as usize];
        let (end, nulls) = match behind {
            Behind::Collision(second) => {
                let distance = second.position.distance(self.position(own));
                let end = End::Place {
                    position: second.position,
                    place: second.place,
                    unit: distance.recip(),
                };
                (end, Some(&second.nulls))
            }
            Behind::Escape(escape) => (End::Away(escape.movement), escape.nulls.as_ref()),
        };
        let Some(nulls) = nulls else {
            densities.fill(0.0);
            return medium;
        };
        self.fly(medium, end, nulls, densities);
        for (lane, density) in densities[..self.count].iter_mut().enumerate() {
            let sees = || lane == own || sees(scene, index, self.position(lane), behind);
            let usable = *density > 0.0 && *density < f32::INFINITY;
            if !(usable && self.is_in(lane, index) && sees()) {
                *density = 0.0;
            }
        }
        medium
    }

    /// Without a look at surfaces.
    fn fly(&self, medium: &Medium, end: End, nulls: &Nulls, densities: &mut [f32; TILE_PIXELS]) {
        let field = match medium.density() {
            // Nothing is shared in a grid of so many super-voxels.
            MediumDensity::Grid(field) if !field.majorants().fits_lanes() => {
                densities.fill(0.0);
                return;
            }
            MediumDensity::Grid(field) => Some(&**field),
            MediumDensity::Homogeneous => None,
        };
        for start in (0..self.count).step_by(LANES) {
            let eight = |coordinates: &[[f32; TILE_PIXELS]; 3]| {
                coordinates.map(|row| std::array::from_fn(|lane| row[start + lane]))
            };
            let values = LaneChoice::best().run(Eight {
                field,
                k: medium.extinction().x,
                position: eight(&self.position),
                place: eight(&self.place),
                end,
                nulls: nulls.places(),
            });
            densities[start..start + LANES].copy_from_slice(&values);
        }
    }
}

/// Whether no surface is in the way from a first collision.
fn sees(scene: &Scene, medium: u32, position: Vec3, behind: &Behind) -> bool {
    match behind {
        Behind::Collision(second) => {
            if scene.medium_is_clear(medium) {
                return true;
            }
            let between = second.position - position;
            let distance = between.length();
            let segment = Ray::segment(position, between / distance, distance);
            scene.nearest(&segment).is_none()
        }
        Behind::Escape(escape) => {
            let ray = Ray::new(position, escape.direction);
            scene.passes_grid_alone(&ray, medium) == Some(true)
        }
    }
}

/// Where a flight ends.
#[derive(Clone, Copy)]
pub enum End {
    /// In a collision there, in the world and in the grid's space.
    Place {
        position: Vec3,
        place: Vec3,
        /// One over a length: distances are in that unit.
        unit: f32,
    },
    /// Nowhere; movement in the grid's space per unit of distance.
    Away(Vec3),
}

/// The density of one flight from eight places.
pub struct Eight<'a> {
    /// `None` of a homogeneous medium.
    pub field: Option<&'a GridField>,
    /// Extinction where the density is 1.
    pub k: f32,
    pub position: [[f32; LANES]; 3],
    /// In the grid's space.
    pub place: [[f32; LANES]; 3],
    pub end: End,
    /// Shares of the length of a flight that collides, distances of one that passes.
    pub nulls: &'a [f32],
}

impl LaneKernel for Eight<'_> {
    const HOT: bool = true;
    type Output = [f32; LANES];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [f32; LANES] {
        let load = |[x, y, z]: &[[f32; LANES]; 3]| Vec3Lanes::new(L::load(x), L::load(y), L::load(z));
        let (place, one) = (load(&self.place), L::splat(1.0));
        // Length in the world per unit of `t`, the same in the unit of lengths, what ends there.
        let (along, t_max, length, unit, end) = match self.end {
            End::Place {
                position,
                place: end,
                unit,
            } => {
                let between = Vec3Lanes::splat(position.to_array()) - load(&self.position);
                let length = between.length();
                let relative = length * L::splat(unit);
                let along = Vec3Lanes::splat(end.to_array()) - place;
                (along, one, length, relative, one / (relative * relative))
            }
            End::Away(movement) => {
                let along = Vec3Lanes::splat(movement.to_array());
                (along, L::splat(f32::INFINITY), one, one, one)
            }
        };
        let k = L::splat(self.k);
        let Some(field) = self.field else {
            return (end * exp_of_minus::<L>(k * length * t_max)).store();
        };
        let majorants = field.majorants();
        let [depth, leaves] = majorants.depths(place, along, t_max);
        let mut value = end * exp_of_minus::<L>(k * length * depth);
        let mut density = field.grid().accessor();
        let unit = unit * L::splat(majorants.range().max.recip());
        for &t in self.nulls {
            let t = L::splat(t);
            let point = place + along * t;
            let null = majorants.majorants_at(point) - density.densities_of(point);
            // Outside of the grid nothing collides.
            let null = null
                .max(L::splat(0.0))
                .select(t.less_equal(leaves), L::splat(0.0));
            value = value * null * unit;
        }
        value.store()
    }
}

/// `e^{−x}` of `x ≥ 0`, within 3·10⁻⁷ relatively for `x < 1`, and `x` times as much beyond; 0 from
/// 87 on.
#[inline(always)]
fn exp_of_minus<L: Lanes>(x: L) -> L {
    let splat = L::splat;
    let halvings = (x * splat(core::f32::consts::LOG2_E)).min(splat(126.0));
    let whole = (halvings + splat(0.5)).to_integers();
    // From −½ to ½.
    let rest = (L::from_integers(whole) - halvings) * splat(core::f32::consts::LN_2);
    let mut power = splat(1.0 / 720.0);
    for factor in [1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        power = power * rest + splat(factor);
    }
    let exponent = L::Words::splat(127) + whole * L::Words::splat(u32::MAX);
    let power = power * L::from_bits(exponent * L::Words::splat(1 << 23));
    power.select(x.less(splat(87.0)), splat(0.0))
}
