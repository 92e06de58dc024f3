//! Meshes that a file places many times: the first times copied, then instances.

use crate::{Geometry, SceneDescription};
#[cfg(any(feature = "mitsuba", feature = "pbrt"))]
use crate::{Material, ShapeDescription};
use glam::{Affine3A, DAffine3};

/// The map of an instance in single precision; `None` if it is singular there, so that the mesh is
/// copied.
pub(super) fn instance_map(to_world: &DAffine3) -> Option<Affine3A> {
    let map = to_world.as_affine3a();
    (map.is_finite() && map.inverse().is_finite()).then_some(map)
}

/// Whether instances of a shape may stay what they are: it neither emits nor lets all light pass.
#[cfg(any(feature = "mitsuba", feature = "pbrt"))]
pub(super) fn may_stay(description: &SceneDescription, shape: &ShapeDescription) -> bool {
    let material = description.materials.get(shape.material as usize);
    shape.emission.is_none() && !matches!(material, Some(Material::Null))
}

impl SceneDescription {
    /// Places the instances of shape `shape` once more.
    pub(super) fn place_again(&mut self, shape: u32, map: Affine3A) {
        if let Some(Geometry::Instances(instances)) = self
            .shapes
            .get_mut(shape as usize)
            .map(|shape| &mut shape.geometry)
        {
            instances.to_world.push(map);
        }
    }
}

#[cfg(all(test, feature = "gltf", feature = "mitsuba", feature = "pbrt"))]
mod tests {
    use crate::import::{LoadLimits, Loaded, parse_gltf_with, parse_mitsuba_with, parse_pbrt};
    use crate::{Geometry, Ray, Scene};
    use base64::Engine;
    use glam::Vec3;
    use lightshed_sampling::{CounterRng, UniformSphere};

    const MITSUBA: &str = r#"<scene version="3.0.0">
      <emitter type="constant"/>
      <shape type="shapegroup" id="group">
        <shape type="cube"><transform name="to_world"><scale x="0.3" y="0.2" z="0.5"/><translate z="0.4"/></transform></shape>
        <shape type="sphere"><float name="radius" value="0.4"/></shape>
        <shape type="rectangle"><transform name="to_world"><translate y="0.9"/></transform>
          <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>
      </shape>
      <shape type="instance"><ref id="group"/></shape>
      <shape type="instance"><transform name="to_world"><translate x="2"/></transform><ref id="group"/></shape>
      <shape type="instance"><transform name="to_world"><scale x="-1" y="2" z="0.5"/><translate x="4"/></transform><ref id="group"/></shape>
      <shape type="instance"><transform name="to_world"><rotate y="1" angle="40"/><translate x="6"/></transform><ref id="group"/></shape>
    </scene>"#;

    const PBRT: &str = r#"WorldBegin
      LightSource "infinite"
      ObjectBegin "wedge"
        Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0 0 0 1] "integer indices" [0 2 1 0 1 3 1 2 3 2 0 3]
        ReverseOrientation
        Shape "disk" "float radius" 0.5 "float height" 1.2
      ObjectEnd
      ObjectInstance "wedge"
      Translate 2 0 0
      ObjectInstance "wedge"
      Translate 2 0 0
      Scale -1 1 0.5
      ObjectInstance "wedge"
      Rotate 40 0 1 0
      Translate -2 0 0
      ObjectInstance "wedge""#;

    /// A tetrahedron three times by nodes, and three times by `EXT_mesh_gpu_instancing`.
    fn gltf() -> String {
        let corners: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let scales: [[f32; 3]; 3] = [[1.0; 3], [-1.0, 1.0, 0.5], [0.5, 2.0, 1.0]];
        let places: [[f32; 3]; 3] = [[6.0, 0.0, 0.0], [9.0, 0.0, 0.0], [11.0, 0.0, 0.0]];
        let triangles: [u8; 12] = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3];
        let mut bytes: Vec<u8> = [&corners[..], &scales, &places]
            .concat()
            .iter()
            .flatten()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        bytes.extend(triangles);
        let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
        format!(
            r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0, 1, 2, 3]}}],
            "nodes": [{{"mesh": 0}}, {{"mesh": 0, "translation": [2, 0, 0], "rotation": [0, 0.6, 0, 0.8]}},
              {{"mesh": 0, "translation": [4, 0, 0], "scale": [1, -2, 1]}},
              {{"mesh": 0, "extensions": {{"EXT_mesh_gpu_instancing": {{"attributes": {{"SCALE": 2, "TRANSLATION": 3}}}}}}}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
            "accessors": [
              {{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]}},
              {{"bufferView": 0, "byteOffset": 120, "componentType": 5121, "count": 12, "type": "SCALAR"}},
              {{"bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 3, "type": "VEC3"}},
              {{"bufferView": 0, "byteOffset": 84, "componentType": 5126, "count": 3, "type": "VEC3"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 132}}],
            "buffers": [{{"byteLength": 132, "uri": "data:;base64,{data}"}}],
            "extensionsUsed": ["EXT_mesh_gpu_instancing"]}}"#
        )
    }

    fn instances(loaded: &Loaded) -> usize {
        let shapes = loaded.description.shapes.iter();
        let of = |geometry: &Geometry| match geometry {
            Geometry::Instances(instances) => instances.to_world.len(),
            _ => 0,
        };
        shapes.map(|shape| of(&shape.geometry)).sum()
    }

    /// A file whose meshes become instances is the scene that it is with copies.
    #[test]
    fn instances_are_the_copies_that_a_file_means() {
        let none = LoadLimits {
            copies: 0,
            ..LoadLimits::default()
        };
        let gltf = gltf();
        let both = |load: &dyn Fn(&LoadLimits) -> Loaded| [load(&LoadLimits::default()), load(&none)];
        let mitsuba = both(&|limits| parse_mitsuba_with(MITSUBA, "s.xml", &[], limits).unwrap());
        let pbrt = both(&|limits| parse_pbrt(PBRT, "s.pbrt", limits).unwrap());
        let gltf = both(&|limits| parse_gltf_with(gltf.as_bytes(), "s.gltf", limits).unwrap());
        // Of Mitsuba's group the cube alone, of three instances behind the first one.
        for (name, [copied, placed], expected) in
            [("mitsuba", mitsuba, 3), ("pbrt", pbrt, 6), ("gltf", gltf, 5)]
        {
            assert_eq!((instances(&copied), instances(&placed)), (0, expected), "{name}");
            let [copied, placed] = [copied, placed].map(|loaded| Scene::new(&loaded.description).unwrap());
            assert_eq!(copied.emitters().area_count(), placed.emitters().area_count());
            let mut rng = CounterRng::new(9, 0, 0);
            let (mut hits, mut of_instances, mut differ) = (0, 0, 0);
            for _ in 0..20_000 {
                let target =
                    Vec3::new(13.0 * rng.next_f32() - 1.0, 0.3, 0.3) + UniformSphere::sample(rng.next_2d());
                let ray = Ray::new(target + UniformSphere::sample(rng.next_2d()) * 5.0, Vec3::ZERO);
                let ray = Ray::new(ray.origin, target - ray.origin);
                match [&copied, &placed].map(|scene| scene.intersect(&ray)) {
                    [Some(a), Some(b)] => {
                        hits += 1;
                        of_instances += u32::from(
                            b.primitive as usize >= placed.triangle_count() + placed.sphere_count(),
                        );
                        let same = a.position.distance(b.position) < 1e-4
                            && a.geometric_normal.dot(b.geometric_normal) > 0.999
                            && a.shading.normal.dot(b.shading.normal) > 0.999;
                        differ += u32::from(!same);
                    }
                    [None, None] => {}
                    _ => differ += 1,
                }
            }
            assert!(
                hits > 2_000 && of_instances > 400,
                "{name}: {hits}, {of_instances}"
            );
            // At edges.
            assert!(differ < 20, "{name}: {differ} of {hits}");
        }
    }
}
