//! Scenes as a renderer's crate reads and traces them.

mod import_files;
mod import_scenes;
mod self_intersection;
