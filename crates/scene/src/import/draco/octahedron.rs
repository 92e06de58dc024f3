//! Normals on an octahedron that is unfolded to a square.

use super::bits::Reader;
use super::{Fault, INVALID};

/// A square of integer coordinates from zero; its middle is the direction +x.
#[derive(Clone, Copy)]
pub(super) struct Octahedron {
    /// Half of the greatest coordinate.
    center: i32,
}

impl Octahedron {
    /// Of so many bits a coordinate.
    pub(super) fn of_bits(bits: u8) -> Result<Self, Fault> {
        if !(2..=30).contains(&bits) {
            return Err(INVALID.into());
        }
        Ok(Self {
            center: (1 << (bits - 1)) - 1,
        })
    }

    /// Of the greatest number that coordinates have bits for.
    pub(super) fn read(reader: &mut Reader) -> Result<Self, Fault> {
        let most = reader.i32()?;
        // The center follows from it.
        reader.i32()?;
        let bits = 32 - u32::try_from(most).map_err(|_| INVALID)?.leading_zeros();
        Self::of_bits(bits as u8)
    }

    fn most(self) -> i32 {
        2 * self.center
    }

    /// The unit vector of a point.
    pub(super) fn direction(self, point: [i32; 2]) -> [f32; 3] {
        let scale = 2.0 / self.most() as f32;
        let [mut y, mut z] = point.map(|v| v as f32 * scale - 1.0);
        let x = 1.0 - y.abs() - z.abs();
        let fold = (-x).max(0.0);
        y += if y < 0.0 { fold } else { -fold };
        z += if z < 0.0 { fold } else { -fold };
        let squared = x * x + y * y + z * z;
        if squared < 1e-6 {
            return [0.0; 3];
        }
        let scale = 1.0 / squared.sqrt();
        [x * scale, y * scale, z * scale]
    }

    /// The vector of whole numbers in this direction whose absolute values sum up to the center.
    pub(super) fn onto(self, vector: [i64; 3]) -> [i32; 3] {
        let sum: i64 = vector.iter().map(|v| v.abs()).sum();
        if sum == 0 {
            return [self.center, 0, 0];
        }
        let [x, y] = [vector[0], vector[1]].map(|v| (v * i64::from(self.center) / sum) as i32);
        let z = self.center - x.abs() - y.abs();
        [x, y, if vector[2] >= 0 { z } else { -z }]
    }

    /// The point of a vector on the octahedron.
    pub(super) fn point(self, [x, y, z]: [i32; 3]) -> [i32; 2] {
        let most = self.most();
        self.on_edge(match x >= 0 {
            true => [y + self.center, z + self.center],
            false => [
                if y < 0 { z.abs() } else { most - z.abs() },
                if z < 0 { y.abs() } else { most - y.abs() },
            ],
        })
    }

    /// Of points at the edges that are the same, the one that files have.
    fn on_edge(self, [s, t]: [i32; 2]) -> [i32; 2] {
        let (center, most) = (self.center, self.most());
        let corners = [[0, 0], [0, most], [most, 0]];
        if corners.contains(&[s, t]) {
            [most, most]
        } else if (s == 0 && t > center) || (s == most && t < center) {
            [s, most - t]
        } else if (t == most && s < center) || (t == 0 && s > center) {
            [most - s, t]
        } else {
            [s, t]
        }
    }

    /// Mirrors a point, seen from the middle, in the edge of the diamond of +x: inside and outside
    /// change places.
    fn inverted(self, [s, t]: [i32; 2]) -> [i32; 2] {
        let [sign_s, sign_t] = if s >= 0 && t >= 0 {
            [1, 1]
        } else if s <= 0 && t <= 0 {
            [-1, -1]
        } else {
            [s, t].map(|v| if v > 0 { 1 } else { -1 })
        };
        let [corner_s, corner_t] = [sign_s, sign_t].map(|sign| sign * self.center);
        let [s, t] = [2 * s - corner_s, 2 * t - corner_t];
        let [s, t] = if sign_s == sign_t { [-t, -s] } else { [t, s] };
        [(s + corner_s) / 2, (t + corner_t) / 2]
    }

    fn wrapped(self, value: i32) -> i32 {
        if value > self.center {
            value - self.most() - 1
        } else if value < -self.center {
            value + self.most() + 1
        } else {
            value
        }
    }

    /// The point of a prediction and a correction, which is stored for predictions turned to the
    /// lower left of the diamond.
    pub(super) fn corrected(self, predicted: [i32; 2], correction: [i32; 2]) -> [i32; 2] {
        let center = self.center;
        // Corrections and predictions of valid data are in range.
        let limit = |v: i32| v.clamp(-self.most() - 1, self.most() + 1);
        let mut p = predicted.map(|v| limit(v.saturating_sub(center)).clamp(-center, center));
        let is_inside = p[0].abs() + p[1].abs() <= center;
        if !is_inside {
            p = self.inverted(p);
        }
        let turns = match (p[0].signum(), p[1].signum()) {
            (0, 0) | (-1, -1 | 0) => 0,
            (0, 1) | (-1, _) => 3,
            (0, _) | (_, -1) => 1,
            _ => 2,
        };
        let turned = |[s, t]: [i32; 2], turns: i32| match turns {
            1 => [t, -s],
            2 => [-s, -t],
            3 => [-t, s],
            _ => [s, t],
        };
        p = turned(p, turns);
        let sum = [p[0] + limit(correction[0]), p[1] + limit(correction[1])];
        let mut point = turned(sum.map(|v| self.wrapped(v)), (4 - turns) % 4);
        if !is_inside {
            point = self.inverted(point);
        }
        point.map(|v| v + center)
    }
}
