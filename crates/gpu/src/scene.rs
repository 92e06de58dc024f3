//! A scene on the device.

use crate::bindings::SceneBindings;
use crate::medium::SceneMedium;
use crate::programs::overrides;
use crate::{Buffer, Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use lightshed_bvh::obvhs::cwbvh::node::CwBvhNode;
use lightshed_bvh::{Bvh, Preset};
use lightshed_integrator::spatial::LevelGridOptions;
use lightshed_integrator::{WorldReuse, scene_lights};
use lightshed_lights::LightRecord;
use lightshed_scene::glam::Vec3;
use lightshed_scene::{
    ComponentRow, FlatCamera, FlatError, FlatScene, FlatSky, FlatTexture, RenderSettings, Scene, SkySampling,
};
use std::ops::RangeInclusive;

/// A scene in buffers, with a compressed eight-wide tree over its triangles.
pub struct GpuScene {
    /// In the order of [`SceneBindings`].
    buffers: [Buffer; SceneBindings::TABLE.bindings.len()],
    flat: FlatScene,
    /// First words of what lies in the tables after the choice of emitters.
    places: TablePlaces,
    render: RenderSettings,
    extent: f32,
    /// Cells of space, as large as a pixel.
    pixel_cells: LevelGridOptions,
    lights: Vec<LightRecord>,
    medium: Option<SceneMedium>,
    sky: SkySampling,
}

/// The data of a scene and of the current request for kernels: `settings`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Settings {
    pub camera: FlatCamera,
    pub surroundings: Vec3,
    pub groups: u32,
    pub seed: [u32; 2],
    pub max_depth: u32,
    pub roulette_depth: u32,
    pub emitters: u32,
    pub pixels: u32,
    pub sky_words: u32,
    pub finite_emitters: u32,
    pub first_direction: u32,
    pub directions: u32,
    pub uv_words: u32,
    pub texture_words: u32,
    pub coat_words: u32,
    pub padding: [u32; 3],
    pub sky: SkyRow,
}

/// The struct of the shader module `sky`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SkyRow {
    x_axis: Vec3,
    scale: f32,
    y_axis: Vec3,
    last_row: u32,
    z_axis: Vec3,
    padding: u32,
    size: [u32; 2],
    more_padding: [u32; 2],
}

// As in the shaders; held to it by a test.
const _: () = assert!(size_of::<Settings>() == 240 && size_of::<SkyRow>() == 64);

impl From<&FlatSky> for SkyRow {
    fn from(sky: &FlatSky) -> Self {
        let [x_axis, y_axis, z_axis] = sky.axes;
        Self {
            x_axis,
            scale: sky.scale,
            y_axis,
            last_row: sky.last_row,
            z_axis,
            padding: 0,
            size: sky.size,
            more_padding: [0; 2],
        }
    }
}

/// Deepest tree that the traversal's stack holds, one entry a level.
const CWBVH_STACK: usize = 32;

impl GpuScene {
    /// Copies a scene to the device.
    ///
    /// # Errors
    ///
    /// [`GpuError::Scene`] for a scene that is no set of triangles with constant materials, see
    /// [`FlatError`](lightshed_scene::FlatError); [`GpuError::TooDeep`]; [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, scene: &Scene) -> Result<Self, GpuError> {
        Self::with_sky(gpu, scene, SkySampling::Luminance)
    }

    /// [`new`](Self::new) with the environment sampled in this way.
    ///
    /// # Errors
    ///
    /// As [`GpuScene::new`].
    pub fn with_sky(gpu: &Gpu, scene: &Scene, sky: SkySampling) -> Result<Self, GpuError> {
        let flat = FlatScene::new(scene, sky).map_err(GpuError::Scene)?;
        Self::of_flat(gpu, scene, flat, sky, None)
    }

    /// Copies a scene with a medium to the device, for the methods that know media: one grey
    /// medium, a grid of densities without emission, with the isotropic phase function or Henyey
    /// and Greenstein's.
    ///
    /// # Errors
    ///
    /// [`GpuError::Medium`] for no medium, several, or others; else as [`GpuScene::new`].
    pub fn with_medium(gpu: &Gpu, scene: &Scene) -> Result<Self, GpuError> {
        Self::with_medium_and_sky(gpu, scene, SkySampling::Luminance)
    }

    /// [`with_medium`](Self::with_medium) with the environment sampled in this way.
    ///
    /// # Errors
    ///
    /// As [`GpuScene::with_medium`].
    pub fn with_medium_and_sky(gpu: &Gpu, scene: &Scene, sky: SkySampling) -> Result<Self, GpuError> {
        let flat = FlatScene::without_media(scene, sky).map_err(GpuError::Scene)?;
        let medium = SceneMedium::new(gpu, scene, &flat.touching)?;
        Self::of_flat(gpu, scene, flat, sky, Some(medium))
    }

    /// How the environment is sampled.
    pub fn sky(&self) -> SkySampling {
        self.sky
    }

    fn of_flat(
        gpu: &Gpu,
        scene: &Scene,
        flat: FlatScene,
        sky: SkySampling,
        medium: Option<SceneMedium>,
    ) -> Result<Self, GpuError> {
        let (nodes, slots) = build_tree(&flat);
        let depth = depth_of(&nodes);
        if depth > CWBVH_STACK {
            return Err(GpuError::TooDeep(depth));
        }
        let (tables, places) = tables(&flat);
        let mut pixel_cells = WorldReuse::default();
        pixel_cells.cell_pixels = 1.0;
        let buffers = [
            gpu.buffer("nodes", &nodes)?,
            gpu.buffer("slots", &slots)?,
            gpu.buffer("triangles", &flat.triangles)?,
            gpu.buffer("corner normals", &flat.normals)?,
            gpu.buffer("materials", &flat.materials.ranges)?,
            gpu.buffer("components", &flat.materials.components)?,
            gpu.buffer("emitters", &emitter_rows(&flat))?,
            gpu.buffer("tables", &tables)?,
            gpu.buffer("emitter triangles", &emitter_triangles(&flat))?,
        ];
        Ok(Self {
            buffers,
            flat,
            places,
            render: *scene.settings(),
            extent: scene.extent(),
            pixel_cells: pixel_cells.cells(scene),
            lights: scene_lights(scene.emitters())
                .iter()
                .map(LightRecord::new)
                .collect(),
            medium,
            sky,
        })
    }

    /// Width and height of the image.
    pub fn size(&self) -> [u32; 2] {
        self.flat.camera.size
    }

    /// The settings that the description requests.
    pub fn settings(&self) -> &RenderSettings {
        &self.render
    }

    /// The medium.
    pub(crate) fn medium(&self) -> Option<&SceneMedium> {
        self.medium.as_ref()
    }

    /// For methods without media.
    pub(crate) fn refuse_media(&self) -> Result<(), GpuError> {
        match self.medium {
            Some(_) => Err(GpuError::Scene(FlatError::Media)),
            None => Ok(()),
        }
    }

    /// Methods that keep emitter samples apart from directions of scattering need all of the sky.
    pub(crate) fn refuse_part_of_a_sky(&self, name: &str) -> Result<(), GpuError> {
        match self.sky {
            SkySampling::Luminance => Ok(()),
            _ => Err(GpuError::Settings(
                format!("{name} needs the sky of a scene to be sampled in proportion to luminance").into(),
            )),
        }
    }

    /// The emitting triangles as light trees use them.
    pub(crate) fn lights(&self) -> &[LightRecord] {
        &self.lights
    }

    /// Whether light arrives from all around.
    pub(crate) fn has_surroundings(&self) -> bool {
        self.flat.surroundings != Vec3::ZERO || self.flat.sky.is_some()
    }

    /// The scene's size.
    pub(crate) fn extent(&self) -> f32 {
        self.extent
    }

    /// Cells of space for reservoirs, as the host has them for this scene.
    pub(crate) fn world_cells(&self, reuse: &WorldReuse) -> LevelGridOptions {
        LevelGridOptions {
            growth: reuse.cell_pixels * self.pixel_cells.growth,
            ..self.pixel_cells
        }
    }

    /// Whether all materials scatter by diffuse lobes alone.
    pub(crate) fn is_diffuse(&self) -> bool {
        self.components()
            .iter()
            .all(|row| row.kind == ComponentRow::DIFFUSE)
    }

    /// Whether any material scatters.
    pub(crate) fn has_surfaces(&self) -> bool {
        self.flat.materials.ranges.iter().any(|&[_, rows]| rows > 0)
    }

    /// The first material with a lobe for which no emitter sample finds light.
    pub(crate) fn sharp_material(&self) -> Option<u32> {
        let is_sharp = |row: &ComponentRow| row.is_delta() || row.kind == ComponentRow::PLASTIC;
        let place = self.flat.materials.ranges.iter().position(|&[first, rows]| {
            let rows = first as usize..(first + rows) as usize;
            self.components()[rows].iter().any(is_sharp)
        });
        place.map(|index| index as u32)
    }

    fn components(&self) -> &[ComponentRow] {
        &self.flat.materials.components
    }

    fn has_kinds(&self, kinds: RangeInclusive<u32>) -> bool {
        self.components().iter().any(|row| kinds.contains(&row.kind))
    }

    fn has_dielectrics(&self) -> bool {
        self.has_kinds(ComponentRow::SMOOTH_DIELECTRIC..=ComponentRow::THIN_DIELECTRIC)
    }

    fn has_plastics(&self) -> bool {
        self.has_kinds(ComponentRow::PLASTIC..=ComponentRow::GGX_PLASTIC)
    }

    /// How many directions shine.
    pub(crate) fn directions(&self) -> u32 {
        self.flat.deltas.len() as u32 - self.flat.points
    }

    /// For `method`, which knows no points, spots and directions that shine.
    pub(crate) fn refuse_deltas(&self, method: &'static str) -> Result<(), GpuError> {
        if self.flat.deltas.is_empty() {
            return Ok(());
        }
        let what = "points, spots and directions that shine";
        Err(GpuError::Unknown { method, what })
    }

    /// For `method`, which knows no materials with two lobes to a component.
    pub(crate) fn refuse_dielectrics(&self, method: &'static str) -> Result<(), GpuError> {
        if !(self.has_dielectrics() || self.has_plastics()) {
            return Ok(());
        }
        let what = "dielectrics and plastics";
        Err(GpuError::Unknown { method, what })
    }

    /// The tree's nodes, the contents of its slots, and the triangles: the data that the shader
    /// module `cwbvh` needs.
    pub fn tree_buffers(&self) -> [&Buffer; 3] {
        let [nodes, slots, triangles, ..] = &self.buffers;
        [nodes, slots, triangles]
    }

    pub(crate) fn bindings(&self) -> SceneBindings<'_> {
        let [
            nodes,
            slots,
            triangles,
            normals,
            materials,
            components,
            emitters,
            tables,
            emitter_triangles,
        ] = &self.buffers;
        SceneBindings {
            nodes,
            slots,
            triangles,
            normals,
            materials,
            components,
            emitters,
            tables,
            emitter_triangles,
        }
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let medium = self.medium.as_ref().map_or(0, SceneMedium::bytes);
        self.buffers.iter().map(Buffer::bytes).sum::<u64>() + medium
    }

    /// The overridable constants of a program: what the scene lacks, and additional ones of a
    /// method.
    pub(crate) fn constants(&self, program: &str, besides: &[(&str, bool)]) -> Vec<(String, f64)> {
        let of_scene = [
            ("HAS_DELTA_EMITTERS", !self.flat.deltas.is_empty()),
            ("HAS_DIELECTRICS", self.has_dielectrics()),
            (
                "HAS_EMITTERS",
                !(self.flat.emitters.is_empty() && self.flat.deltas.is_empty()),
            ),
            ("HAS_PLASTICS", self.has_plastics()),
            ("HAS_SKY", self.flat.sky.is_some()),
            ("HAS_SURFACES", self.has_surfaces()),
            ("HAS_SURROUNDINGS", self.has_surroundings()),
            ("HAS_TEXTURES", !self.flat.materials.textures.is_empty()),
            (
                "HAS_TOUCHING",
                self.medium.as_ref().is_some_and(|medium| medium.touches),
            ),
        ];
        let known = of_scene.iter().chain(besides);
        overrides(program)
            .filter_map(|(linked, name)| {
                let (_, holds) = known.clone().find(|(known, _)| *known == name)?;
                Some((linked.to_owned(), f64::from(u8::from(*holds))))
            })
            .collect()
    }

    pub(crate) fn kernel_settings(&self, seed: u64, max_depth: u32, roulette_depth: u32) -> Settings {
        let [width, height] = self.size();
        Settings {
            camera: self.flat.camera,
            surroundings: self.flat.surroundings,
            groups: self.flat.groups,
            seed: [seed as u32, (seed >> 32) as u32],
            max_depth,
            roulette_depth,
            emitters: self.flat.emitters.len() as u32,
            pixels: width * height,
            sky_words: self.places.sky,
            finite_emitters: self.flat.emitter_table.len() as u32,
            first_direction: self.flat.emitters.len() as u32 + self.flat.points,
            directions: self.directions(),
            uv_words: self.places.uvs,
            texture_words: self.places.textures,
            coat_words: self.places.coats,
            padding: [0; 3],
            sky: self.flat.sky.as_ref().map(SkyRow::from).unwrap_or_default(),
        }
    }
}

/// First words of parts of the tables.
#[derive(Clone, Copy, Debug)]
struct TablePlaces {
    sky: u32,
    uvs: u32,
    textures: u32,
    coats: u32,
}

/// Entries for the choice of an emitter, then the sky's words, texels, textures, texture
/// coordinates and rough coats.
fn tables(flat: &FlatScene) -> (Vec<u32>, TablePlaces) {
    let entries = flat.emitter_table.iter();
    let mut words: Vec<u32> = entries.flat_map(|entry| [entry.threshold, entry.alias]).collect();
    let sky = words.len() as u32;
    words.extend(flat.sky.iter().flat_map(|sky| &sky.words));
    let texels = words.len() as u32;
    words.extend(&flat.materials.texels);
    let textures = words.len() as u32;
    for texture in &flat.materials.textures {
        // Shaders have the tables alone to look in.
        let texture = FlatTexture {
            first: texels + texture.first,
            table: match texture.table {
                FlatTexture::NO_TABLE => FlatTexture::NO_TABLE,
                table => texels + table,
            },
            ..*texture
        };
        words.extend(bytemuck::cast::<FlatTexture, [u32; 16]>(texture));
    }
    let uvs = words.len() as u32;
    if !flat.materials.textures.is_empty() {
        words.extend(flat.uvs.as_flattened().as_flattened().iter().map(|v| v.to_bits()));
    }
    let coats = words.len() as u32;
    words.extend(flat.materials.coats.iter().map(|v| v.to_bits()));
    (
        words,
        TablePlaces {
            sky,
            uvs,
            textures,
            coats,
        },
    )
}

/// Emitting triangles, then what shines from a point or out of a direction.
fn emitter_rows(flat: &FlatScene) -> Vec<[f32; 16]> {
    let triangles = flat.emitters.iter().map(|&row| bytemuck::cast(row));
    triangles
        .chain(flat.deltas.iter().map(|&row| bytemuck::cast(row)))
        .collect()
}

/// The triangle that each emitter is.
fn emitter_triangles(flat: &FlatScene) -> Vec<u32> {
    let mut triangles = vec![0; flat.emitters.len()];
    for (index, triangle) in flat.triangles.iter().enumerate() {
        if let Some(of_emitter) = triangles.get_mut(triangle.emitter as usize) {
            *of_emitter = index as u32;
        }
    }
    triangles
}

/// Nodes and what their slots hold.
pub(crate) fn build_tree(flat: &FlatScene) -> (Vec<CwBvhNode>, Vec<u32>) {
    if flat.triangles.is_empty() {
        // A node without children.
        return (vec![CwBvhNode::default()], Vec::new());
    }
    let corners: Vec<[Vec3; 3]> = flat.corners().collect();
    // Corners of a scene are finite: there is a tree.
    let tree = Bvh::build(&corners, Preset::High.options()).map(|tree| tree.to_obvhs_cwbvh(3));
    tree.map_or_else(
        |_| (vec![CwBvhNode::default()], Vec::new()),
        |tree| (tree.nodes, tree.primitive_indices),
    )
}

/// Levels of nodes.
fn depth_of(nodes: &[CwBvhNode]) -> usize {
    let mut deepest = 0;
    let mut open = vec![(0usize, 1usize)];
    while let Some((index, depth)) = open.pop() {
        deepest = deepest.max(depth);
        let Some(node) = nodes.get(index) else { continue };
        let inner = node.imask.count_ones() as usize;
        open.extend((0..inner).map(|child| (node.child_base_idx as usize + child, depth + 1)));
    }
    deepest
}
