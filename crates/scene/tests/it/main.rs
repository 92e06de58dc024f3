//! Scenes as a renderer's crate reads and traces them.

mod hostile_files;
mod import_files;
mod import_scenes;
mod self_intersection;
