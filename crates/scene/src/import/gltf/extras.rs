//! Members of materials that the `gltf` crate does not read.

use gltf::json::Value;

/// What a material has beside what the crate knows.
#[derive(Clone, Debug, Default)]
pub(super) struct MaterialExtras {
    /// `KHR_materials_unlit`.
    pub unlit: bool,
    /// `KHR_materials_specular`.
    pub specular: Option<Specular>,
    /// `KHR_texture_transform` of the normal map.
    pub normal_transform: Option<TextureTransform>,
    /// `KHR_materials_clearcoat`.
    pub coat: Option<Coat>,
    /// `KHR_materials_sheen`.
    pub sheen: Option<Sheen>,
    /// `KHR_materials_volume`.
    pub volume: Option<Volume>,
}

/// `KHR_materials_clearcoat`.
#[derive(Clone, Debug)]
pub(super) struct Coat {
    pub factor: f32,
    pub texture: Option<TextureInfo>,
    pub roughness: f32,
    pub roughness_texture: Option<TextureInfo>,
    /// Texture of its own normals.
    pub normals: Option<usize>,
}

/// `KHR_materials_sheen`.
#[derive(Clone, Debug)]
pub(super) struct Sheen {
    pub color: [f32; 3],
    pub texture: Option<TextureInfo>,
    pub roughness: f32,
    pub roughness_texture: Option<TextureInfo>,
}

/// `KHR_materials_volume`, without its texture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Volume {
    pub thickness: f32,
    pub color: [f32; 3],
    pub distance: f32,
}

/// A reference to a texture.
#[derive(Clone, Copy, Debug)]
pub(super) struct TextureInfo {
    pub index: usize,
    pub set: u32,
    pub transform: Option<TextureTransform>,
}

/// `KHR_materials_specular`, without its textures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Specular {
    pub factor: f32,
    pub color: [f32; 3],
    /// Whether a texture says more.
    pub is_textured: bool,
}

/// `KHR_texture_transform`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TextureTransform {
    pub offset: [f32; 2],
    pub rotation: f32,
    pub scale: [f32; 2],
    /// The set of coordinates that replaces the texture's.
    pub set: Option<u32>,
}

/// What a node has beside what the crate knows.
#[derive(Clone, Debug, Default)]
pub(super) struct NodeExtras {
    /// The skin of its mesh.
    pub skin: Option<usize>,
    /// Whether `KHR_node_visibility` hides it and what hangs on it.
    pub hidden: bool,
    /// `EXT_mesh_gpu_instancing`: accessors of translations, rotations and scales.
    pub instances: Option<[Option<usize>; 3]>,
}

/// A skin: the nodes that move it and the accessor of what takes the mesh to each of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Skin {
    pub joints: Vec<usize>,
    pub inverse_bind_matrices: Option<usize>,
}

/// Of all nodes, by their indices.
pub(super) fn of_nodes(root: &Value) -> Vec<NodeExtras> {
    let of = |node: &Value| {
        let attributes = node.pointer("/extensions/EXT_mesh_gpu_instancing/attributes");
        NodeExtras {
            skin: index(node, "skin"),
            hidden: node.pointer("/extensions/KHR_node_visibility/visible") == Some(&Value::Bool(false)),
            instances: attributes
                .map(|found| ["TRANSLATION", "ROTATION", "SCALE"].map(|name| index(found, name))),
        }
    };
    let nodes = root.get("nodes").and_then(Value::as_array);
    nodes.into_iter().flatten().map(of).collect()
}

/// All skins.
pub(super) fn skins(root: &Value) -> Vec<Skin> {
    let of = |skin: &Value| {
        let joints = skin.get("joints").and_then(Value::as_array);
        let joints = joints.into_iter().flatten().filter_map(Value::as_u64);
        Skin {
            joints: joints.map(|joint| joint as usize).collect(),
            inverse_bind_matrices: index(skin, "inverseBindMatrices"),
        }
    };
    let skins = root.get("skins").and_then(Value::as_array);
    skins.into_iter().flatten().map(of).collect()
}

fn index(value: &Value, name: &str) -> Option<usize> {
    usize::try_from(value.get(name)?.as_u64()?).ok()
}

/// Of all materials, by their indices.
pub(super) fn of_materials(root: &Value) -> Vec<MaterialExtras> {
    let materials = root.get("materials").and_then(Value::as_array);
    materials.into_iter().flatten().map(MaterialExtras::of).collect()
}

impl MaterialExtras {
    fn of(material: &Value) -> Self {
        let transform = material.pointer("/normalTexture/extensions/KHR_texture_transform");
        Self {
            unlit: material.pointer("/extensions/KHR_materials_unlit").is_some(),
            specular: material
                .pointer("/extensions/KHR_materials_specular")
                .map(Specular::of),
            normal_transform: transform.map(TextureTransform::of),
            coat: material
                .pointer("/extensions/KHR_materials_clearcoat")
                .map(Coat::of),
            sheen: material.pointer("/extensions/KHR_materials_sheen").map(Sheen::of),
            volume: material
                .pointer("/extensions/KHR_materials_volume")
                .map(Volume::of),
        }
    }
}

impl Coat {
    fn of(value: &Value) -> Self {
        Self {
            factor: number(value, "clearcoatFactor", 0.0).clamp(0.0, 1.0),
            texture: TextureInfo::of(value, "clearcoatTexture"),
            roughness: number(value, "clearcoatRoughnessFactor", 0.0).clamp(0.0, 1.0),
            roughness_texture: TextureInfo::of(value, "clearcoatRoughnessTexture"),
            normals: TextureInfo::of(value, "clearcoatNormalTexture").map(|info| info.index),
        }
    }
}

impl Sheen {
    fn of(value: &Value) -> Self {
        Self {
            color: numbers(value, "sheenColorFactor", [0.0; 3]).map(|share| share.clamp(0.0, 1.0)),
            texture: TextureInfo::of(value, "sheenColorTexture"),
            roughness: number(value, "sheenRoughnessFactor", 0.0).clamp(0.0, 1.0),
            roughness_texture: TextureInfo::of(value, "sheenRoughnessTexture"),
        }
    }
}

impl Volume {
    fn of(value: &Value) -> Self {
        Self {
            thickness: number(value, "thicknessFactor", 0.0),
            color: numbers(value, "attenuationColor", [1.0; 3]),
            distance: number(value, "attenuationDistance", f32::INFINITY),
        }
    }

    /// What is left of light behind one of the two boundaries that it crosses: the root of
    /// `colour^(thickness / distance)`.
    pub fn tint(&self) -> [f32; 3] {
        if self.distance > 0.0 {
            let crossings = 0.5 * self.thickness / self.distance;
            self.color.map(|share| share.clamp(0.0, 1.0).powf(crossings))
        } else {
            [1.0; 3]
        }
    }
}

impl TextureInfo {
    fn of(value: &Value, name: &str) -> Option<Self> {
        let info = value.get(name)?;
        let transform = info.pointer("/extensions/KHR_texture_transform");
        let set = info.get("texCoord").and_then(Value::as_u64);
        Some(Self {
            index: index(info, "index")?,
            set: set.and_then(|set| u32::try_from(set).ok()).unwrap_or(0),
            transform: transform.map(TextureTransform::of),
        })
    }
}

impl Specular {
    fn of(value: &Value) -> Self {
        Self {
            factor: number(value, "specularFactor", 1.0),
            color: numbers(value, "specularColorFactor", [1.0; 3]),
            is_textured: ["specularTexture", "specularColorTexture"]
                .iter()
                .any(|name| value.get(name).is_some()),
        }
    }

    /// The index of refraction whose reflectance at normal incidence is that of `ior` times the
    /// factor and the mean of the colour, at most one.
    pub fn index(&self, ior: f32) -> f32 {
        let mean = self.color.iter().sum::<f32>() / 3.0;
        let root = (ior - 1.0) / (ior + 1.0);
        let reflectance = (root * root * self.factor * mean).clamp(0.0, 0.99);
        let root = reflectance.sqrt();
        (1.0 + root) / (1.0 - root)
    }
}

impl TextureTransform {
    fn of(value: &Value) -> Self {
        let set = value.get("texCoord").and_then(Value::as_u64);
        Self {
            offset: numbers(value, "offset", [0.0; 2]),
            rotation: number(value, "rotation", 0.0),
            scale: numbers(value, "scale", [1.0; 2]),
            set: set.and_then(|set| u32::try_from(set).ok()),
        }
    }
}

/// A finite number, or the default.
fn number(value: &Value, name: &str, default: f32) -> f32 {
    let number = value.get(name).and_then(Value::as_f64).map(|n| n as f32);
    number.filter(|n| n.is_finite()).unwrap_or(default)
}

/// So many finite numbers, or the default.
fn numbers<const N: usize>(value: &Value, name: &str, default: [f32; N]) -> [f32; N] {
    let list = value.get(name).and_then(Value::as_array);
    let Some(list) = list.filter(|list| list.len() == N) else {
        return default;
    };
    let mut numbers = default;
    for (number, value) in numbers.iter_mut().zip(list) {
        let value = value.as_f64().map(|n| n as f32).filter(|n| n.is_finite());
        *number = value.unwrap_or(*number);
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without a factor the index stays; half the reflectance of glass is 0.02.
    #[test]
    fn specular_factors_scale_the_reflectance() {
        let of = |factor, color| Specular {
            factor,
            color,
            is_textured: false,
        };
        assert!((of(1.0, [1.0; 3]).index(1.5) - 1.5).abs() < 1e-6);
        assert_eq!(of(0.0, [1.0; 3]).index(1.5), 1.0);
        let index = of(1.0, [0.5; 3]).index(1.5);
        let root = (index - 1.0) / (index + 1.0);
        assert!((root * root - 0.02).abs() < 1e-7, "{index}");
    }
}
