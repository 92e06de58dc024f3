//! Points and lines, which have no size in glTF: small octahedra and thin prisms that emit their
//! colour, about as large as a pixel of a small image of the whole scene.

use super::Importer;
use crate::import::error::ImportError;
use crate::import::fit;
use crate::{ColorTexture, Geometry, Material, Rgb, ShapeDescription, TriangleMesh};
use glam::{DAffine3, Vec3};
use gltf::Semantic;
use gltf::mesh::Mode;

/// Radius of a mark as a share of the diagonal of the box around the scene.
const RADIUS: f32 = 0.0015;

/// Points or lines in the world.
pub(super) struct Marks {
    name: String,
    positions: Vec<Vec3>,
    /// One for each position.
    colors: Vec<Rgb>,
    /// Ends of lines; none for points.
    segments: Option<Vec<[u32; 2]>>,
}

impl Importer<'_> {
    /// Keeps the points or lines of a primitive until the size of the scene is known. `element` is
    /// the primitive.
    pub(super) fn mark(
        &mut self,
        primitive: &gltf::Primitive,
        to_world: &DAffine3,
        name: String,
        element: &str,
    ) -> Result<(), ImportError> {
        // At most so many vertices and triangles come of each corner.
        let count = |accessor| self.buffers.count(&accessor);
        let vertices = primitive.get(&Semantic::Positions).map_or(0, count);
        let corners = primitive.indices().map_or(vertices, count);
        self.loading
            .spend_mesh(corners.saturating_mul(8), corners.saturating_mul(8), || {
                self.location(element)
            })?;
        let base = primitive.material().pbr_metallic_roughness();
        let [r, g, b, _] = base.base_color_factor().map(|factor| factor.clamp(0.0, 1.0));
        let base = Rgb::new(r, g, b);
        let read = || -> Result<Marks, String> {
            let positions = primitive
                .get(&Semantic::Positions)
                .ok_or("the attribute POSITION is missing")?;
            let positions = self.buffers.vectors::<3>(self.document, &positions)?;
            let place = |p: [f32; 3]| {
                to_world
                    .transform_point3(Vec3::from_array(p).as_dvec3())
                    .as_vec3()
            };
            let positions: Vec<Vec3> = positions.into_iter().map(place).collect();
            if !positions.iter().all(|position| position.is_finite()) {
                return Err("a vertex attribute is not finite".to_owned());
            }
            let colors = match primitive.get(&Semantic::Colors(0)) {
                Some(accessor) if self.buffers.count(&accessor) == positions.len() => {
                    self.colors(&accessor)?
                }
                _ => vec![Rgb::ONE; positions.len()],
            };
            let corners = match primitive.indices() {
                Some(accessor) => self.buffers.indices(&accessor)?,
                None => (0..positions.len() as u32).collect(),
            };
            if let Some(index) = corners.iter().find(|&&i| i as usize >= positions.len()) {
                return Err(format!("index {index} of {} vertices", positions.len()));
            }
            let strip = || corners.array_windows::<2>().copied();
            let segments = match primitive.mode() {
                Mode::Lines => Some(corners.as_chunks::<2>().0.to_vec()),
                Mode::LineStrip => Some(strip().collect()),
                Mode::LineLoop => {
                    let closing = corners
                        .last()
                        .zip(corners.first())
                        .map(|(&last, &first)| [last, first]);
                    Some(strip().chain(closing).collect())
                }
                _ => None,
            };
            Ok(Marks {
                name,
                colors: colors.into_iter().map(|color| color * base).collect(),
                positions,
                segments,
            })
        };
        match read() {
            Ok(marks) => self.marks.push(marks),
            Err(what) => self.leave_out(element, what),
        }
        Ok(())
    }

    /// Makes shapes of the points and lines.
    pub(super) fn place_marks(&mut self) {
        let marks = std::mem::take(&mut self.marks);
        if marks.is_empty() {
            return;
        }
        let (mut low, mut high) =
            fit::bounds(&self.description).unwrap_or((Vec3::INFINITY, Vec3::NEG_INFINITY));
        for position in marks.iter().flat_map(|marks| &marks.positions) {
            low = low.min(*position);
            high = high.max(*position);
        }
        let diagonal = (high - low).length();
        let radius = if diagonal > 0.0 && diagonal.is_finite() {
            RADIUS * diagonal
        } else {
            1.0
        };
        self.description.materials.push(Material::Diffuse {
            reflectance: ColorTexture::Constant(Rgb::ZERO),
        });
        let material = self.description.materials.len() as u32 - 1;
        self.glimmering.insert(material);
        for marks in marks {
            let mut mesh = TriangleMesh::default();
            match &marks.segments {
                None => {
                    for (position, color) in marks.positions.iter().zip(&marks.colors) {
                        octahedron(&mut mesh, *position, radius, *color);
                    }
                }
                Some(segments) => {
                    for segment in segments {
                        let [a, b] = segment.map(|i| i as usize);
                        let color = 0.5 * (marks.colors[a] + marks.colors[b]);
                        prism(&mut mesh, [marks.positions[a], marks.positions[b]], radius, color);
                    }
                }
            }
            if !mesh.indices.is_empty() {
                self.description.shapes.push(ShapeDescription {
                    name: marks.name,
                    geometry: Geometry::Mesh(mesh),
                    material,
                    emission: Some(Rgb::ONE),
                });
            }
        }
        self.warn(
            "meshes",
            "points and lines are small bodies that emit their colour",
        );
    }
}

fn octahedron(mesh: &mut TriangleMesh, center: Vec3, radius: f32, color: Rgb) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(
        Vec3::AXES
            .into_iter()
            .flat_map(|axis| [center + radius * axis, center - radius * axis]),
    );
    for [x, y, z] in [
        [0, 2, 4],
        [2, 1, 4],
        [1, 3, 4],
        [3, 0, 4],
        [2, 0, 5],
        [1, 2, 5],
        [3, 1, 5],
        [0, 3, 5],
    ] {
        mesh.indices.push([first + x, first + y, first + z]);
        mesh.glow.push(color);
    }
}

/// A tube of four sides, open at its ends.
fn prism(mesh: &mut TriangleMesh, [start, end]: [Vec3; 2], radius: f32, color: Rgb) {
    let Some(along) = (end - start).try_normalize() else {
        return;
    };
    let (u, v) = along.any_orthonormal_pair();
    let first = mesh.positions.len() as u32;
    for corner in [start, end] {
        mesh.positions
            .extend([u, v, -u, -v].map(|side| corner + radius * side));
    }
    for side in 0..4 {
        let next = (side + 1) % 4;
        mesh.indices.push([first + side, first + next, first + 4 + next]);
        mesh.indices
            .push([first + side, first + 4 + next, first + 4 + side]);
        mesh.glow.extend([color; 2]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::signed_volume;

    /// Both emit outwards: an octahedron of radius r has the volume 4/3 r³, a prism's sides have
    /// two thirds of its volume as seen from its middle.
    #[test]
    fn marks_face_outwards() {
        let mut mesh = TriangleMesh::default();
        octahedron(&mut mesh, Vec3::ZERO, 2.0, Rgb::ONE);
        assert!((signed_volume(&mesh) - 32.0 / 3.0).abs() < 1e-5);
        let mut mesh = TriangleMesh::default();
        prism(&mut mesh, [Vec3::NEG_Z, Vec3::Z], 0.5, Rgb::ONE);
        // The cross-section is 2 r², the height 2.
        assert!(
            (signed_volume(&mesh) - 2.0 / 3.0).abs() < 1e-5,
            "{}",
            signed_volume(&mesh)
        );
        assert_eq!((mesh.indices.len(), mesh.glow.len()), (8, 8));
    }
}
