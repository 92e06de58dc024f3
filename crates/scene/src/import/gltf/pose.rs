//! Skins and morph targets, in the pose that the nodes of a file have.

use super::Importer;
use super::extras::Skin;
use crate::TriangleMesh;
use crate::import::transform::normal_map;
use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3};
use gltf::{Document, Semantic};

/// Where each node lies in the world; those that no other has as a child are roots.
pub(super) fn world(document: &Document) -> Vec<DAffine3> {
    let nodes = &document.as_json().nodes;
    let own: Vec<DAffine3> = document.nodes().map(|node| local(&node)).collect();
    let mut parents = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        for child in node.children.iter().flatten() {
            if let Some(parent) = parents.get_mut(child.value()) {
                *parent = Some(index);
            }
        }
    }
    let mut world: Vec<Option<DAffine3>> = vec![None; nodes.len()];
    for index in 0..nodes.len() {
        // Up to a node that is known, and down again. A circle ends where it has come round.
        let (mut chain, mut at) = (Vec::new(), Some(index));
        while let Some(node) = at.filter(|&node| world[node].is_none() && chain.len() <= nodes.len()) {
            chain.push(node);
            at = parents[node];
        }
        let mut outer = at.and_then(|node| world[node]).unwrap_or(DAffine3::IDENTITY);
        for node in chain.into_iter().rev() {
            outer *= own[node];
            world[node] = Some(outer);
        }
    }
    world
        .into_iter()
        .map(|map| map.unwrap_or(DAffine3::IDENTITY))
        .collect()
}

/// A node's own transform.
pub(super) fn local(node: &gltf::Node) -> DAffine3 {
    let columns = node.transform().matrix().map(|column| column.map(f64::from));
    DAffine3::from_mat4(DMat4::from_cols_array_2d(&columns))
}

impl Importer<'_> {
    /// Adds the morph targets of a primitive, each with its weight.
    pub(super) fn morph(
        &self,
        primitive: &gltf::Primitive,
        weights: &[f32],
        mesh: &mut TriangleMesh,
    ) -> Result<(), String> {
        for (target, &weight) in primitive.morph_targets().zip(weights) {
            if weight == 0.0 || !weight.is_finite() {
                continue;
            }
            let parts = [
                (target.positions(), &mut mesh.positions),
                (target.normals(), &mut mesh.normals),
            ];
            for (accessor, values) in parts {
                let Some(accessor) = accessor else { continue };
                if self.buffers.count(&accessor) != values.len() {
                    // Normals may be left out of the mesh itself.
                    continue;
                }
                let moves = self.buffers.vectors::<3>(self.document, &accessor)?;
                for (value, by) in values.iter_mut().zip(moves) {
                    let moved = *value + weight * Vec3::from_array(by);
                    if !moved.is_finite() {
                        return Err("a morph target is out of range".to_owned());
                    }
                    *value = moved;
                }
            }
        }
        Ok(())
    }

    /// Moves a mesh into the world by its skin: a vertex by the mean, over its joints with their
    /// weights, of `world(joint) · inverse bind matrix` (glTF 2.0, §3.7.3.1). Errs where the skin
    /// is unusable; the mesh is unchanged then.
    pub(super) fn skinned(
        &self,
        skin: &Skin,
        primitive: &gltf::Primitive,
        mesh: &mut TriangleMesh,
    ) -> Result<(), String> {
        let binds = match skin.inverse_bind_matrices {
            None => vec![DAffine3::IDENTITY; skin.joints.len()],
            Some(index) => {
                let accessor = self.document.accessors().nth(index);
                let accessor = accessor.ok_or("its matrices are missing")?;
                let columns = self.buffers.matrices(&accessor)?;
                let map = |m: &[f32; 16]| DAffine3::from_mat4(DMat4::from_cols_array(&m.map(f64::from)));
                columns.iter().map(map).collect()
            }
        };
        let mut maps = Vec::with_capacity(skin.joints.len());
        for (joint, bind) in skin.joints.iter().zip(&binds) {
            let joint = self.world.get(*joint).ok_or("a joint is missing")?;
            maps.push(*joint * *bind);
        }
        let count = mesh.positions.len();
        let mut moves: Vec<DAffine3> = vec![DAffine3::ZERO; count];
        let mut totals = vec![0.0; count];
        for set in 0..2 {
            let [joints, weights] =
                [Semantic::Joints(set), Semantic::Weights(set)].map(|s| primitive.get(&s));
            let (Some(joints), Some(weights)) = (joints, weights) else {
                break;
            };
            if [&joints, &weights].iter().any(|a| self.buffers.count(a) != count) {
                return Err("a vertex lacks its joints".to_owned());
            }
            let joints = self.buffers.vectors::<4>(self.document, &joints)?;
            let weights = self.buffers.vectors::<4>(self.document, &weights)?;
            for (index, (joints, weights)) in joints.iter().zip(&weights).enumerate() {
                for (&joint, &weight) in joints.iter().zip(weights) {
                    if weight > 0.0 {
                        let map = maps.get(joint as usize).ok_or("a joint is missing")?;
                        let weight = f64::from(weight);
                        totals[index] += weight;
                        let sum = &mut moves[index];
                        sum.matrix3 += map.matrix3 * weight;
                        sum.translation += map.translation * weight;
                    }
                }
            }
        }
        if totals.iter().any(|&total| !(total > 0.0 && total.is_finite())) {
            return Err("a vertex has no joint".to_owned());
        }
        let scaled =
            |map: &DAffine3, by: f64| DAffine3::from_mat3_translation(map.matrix3 * by, map.translation * by);
        let maps = moves
            .iter()
            .zip(&totals)
            .map(|(map, total)| scaled(map, 1.0 / total));
        let maps: Vec<DAffine3> = maps.collect();
        let position =
            |(map, position): (&DAffine3, &Vec3)| map.transform_point3(position.as_dvec3()).as_vec3();
        let positions: Vec<Vec3> = maps.iter().zip(&mesh.positions).map(position).collect();
        let turned = |(map, normal): (&DAffine3, &Vec3)| {
            let matrix = if map.matrix3.determinant() == 0.0 {
                DMat3::IDENTITY
            } else {
                normal_map(map)
            };
            // The side that the winding gives it is looked at below.
            let side = map.matrix3.determinant().signum();
            (matrix * normal.as_dvec3() * side)
                .try_normalize()
                .unwrap_or(DVec3::Z)
                .as_vec3()
        };
        let normals: Vec<Vec3> = maps.iter().zip(&mesh.normals).map(turned).collect();
        if !positions.iter().chain(&normals).all(|v| v.is_finite()) {
            return Err("it moves a vertex out of range".to_owned());
        }
        mesh.positions = positions;
        mesh.normals = normals;
        if maps.first().is_some_and(|map| map.matrix3.determinant() < 0.0) {
            for triangle in &mut mesh.indices {
                triangle.swap(1, 2);
            }
        }
        Ok(())
    }

    /// Transforms of the instances of a node's mesh; none where it has no such list.
    pub(super) fn instances(&self, lists: &[Option<usize>; 3]) -> Result<Vec<DAffine3>, String> {
        let find = |index: Option<usize>| index.and_then(|index| self.document.accessors().nth(index));
        let [moves, turns, scales] = lists.map(find);
        let moves = moves
            .map(|a| self.buffers.vectors::<3>(self.document, &a))
            .transpose()?;
        let turns = turns
            .map(|a| self.buffers.vectors::<4>(self.document, &a))
            .transpose()?;
        let scales = scales
            .map(|a| self.buffers.vectors::<3>(self.document, &a))
            .transpose()?;
        let counts = [
            moves.as_ref().map(Vec::len),
            turns.as_ref().map(Vec::len),
            scales.as_ref().map(Vec::len),
        ];
        let count = counts.into_iter().flatten().min().unwrap_or(0);
        let of = |index: usize| {
            let vector = |list: &Option<Vec<[f32; 3]>>, default| {
                list.as_ref()
                    .map_or(default, |list| Vec3::from_array(list[index]).as_dvec3())
            };
            let turn = turns.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |list| list[index]);
            let turn = glam::DQuat::from_array(turn.map(f64::from));
            let turn = if turn.length_squared() > 0.0 {
                turn.normalize()
            } else {
                glam::DQuat::IDENTITY
            };
            DAffine3::from_scale_rotation_translation(
                vector(&scales, DVec3::ONE),
                turn,
                vector(&moves, DVec3::ZERO),
            )
        };
        Ok((0..count).map(of).collect())
    }
}
