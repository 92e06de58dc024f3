//! Errors of a scene description.

use crate::CameraError;

/// Why a scene could not be built. Shapes are named as the description names them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// There is nothing visible: no shape at all, and no environment.
    #[error("the scene is empty: it has neither shapes nor an environment")]
    Empty,
    /// A vertex position, normal or texture coordinate is NaN or infinite.
    #[error("shape '{shape}': the {attribute} of vertex {vertex} is not finite")]
    NonFiniteVertex {
        /// Name of the shape.
        shape: String,
        /// `position`, `normal` or `texture coordinate`.
        attribute: &'static str,
        /// Index of the vertex.
        vertex: usize,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("shape '{shape}': triangle {triangle} refers to vertex {index}, but there are only {vertices}")]
    IndexOutOfRange {
        /// Name of the shape.
        shape: String,
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it refers to.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// Normals or texture coordinates are not as many as positions.
    #[error("shape '{shape}': {found} {attribute}s for {vertices} vertices")]
    AttributeCount {
        /// Name of the shape.
        shape: String,
        /// `normal` or `texture coordinate`.
        attribute: &'static str,
        /// How many there are.
        found: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// A mesh has no triangle, or none with an area.
    #[error("shape '{shape}': none of its {triangles} triangles has an area")]
    NoArea {
        /// Name of the shape.
        shape: String,
        /// How many triangles there are.
        triangles: usize,
    },
    /// The map of an instance is not finite or flattens the mesh.
    #[error("shape '{shape}': instance {instance} is placed by a map that is not finite or not regular")]
    Instance {
        /// Name of the shape.
        shape: String,
        /// Index of the instance.
        instance: usize,
    },
    /// A sphere's centre or radius is not finite, or its radius not positive.
    #[error("shape '{shape}': a sphere needs a finite centre and a positive, finite radius")]
    Sphere {
        /// Name of the shape.
        shape: String,
    },
    /// A shape refers to a material that does not exist.
    #[error("shape '{shape}' refers to material {material}, but there are only {materials}")]
    MaterialIndex {
        /// Name of the shape.
        shape: String,
        /// The material it refers to.
        material: u32,
        /// Number of materials.
        materials: usize,
    },
    /// A material has an impossible parameter.
    #[error("material {material}: {reason}")]
    Material {
        /// Index of the material.
        material: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A medium has an impossible parameter.
    #[error("medium '{medium}': {reason}")]
    Medium {
        /// Name of the medium.
        medium: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Something refers to a medium that does not exist.
    #[error("{place} refers to medium {medium}, but there are only {media}")]
    MediumIndex {
        /// What refers to it.
        place: String,
        /// The medium it refers to.
        medium: u32,
        /// Number of media.
        media: usize,
    },
    /// A boundary of media refers to a shape that does not exist.
    #[error("boundary {boundary} refers to shape {shape}, but there are only {shapes}")]
    BoundaryShape {
        /// Index of the boundary.
        boundary: usize,
        /// The shape it refers to.
        shape: u32,
        /// Number of shapes.
        shapes: usize,
    },
    /// A shape is named by two boundaries.
    #[error("{place} bounds media twice")]
    SecondBoundary {
        /// The shape.
        place: String,
    },
    /// An emitter has an impossible parameter.
    #[error("{emitter}: {reason}")]
    Emitter {
        /// Which emitter.
        emitter: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// More than one emitter claims to surround the scene.
    #[error("the scene has {0} environments; there can be one")]
    SeveralEnvironments(usize),
    /// More primitives than the acceleration structure can number.
    #[error("{0} primitives are more than the 2^30 that can be traced")]
    TooManyPrimitives(usize),
    /// The camera is unusable.
    #[error(transparent)]
    Camera(#[from] CameraError),
}
