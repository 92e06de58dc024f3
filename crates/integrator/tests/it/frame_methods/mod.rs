//! Methods that make whole frames, held to plain estimators by ensembles of independent chains, and
//! to hostile scenes.

mod direct;
mod ensemble;
mod guided_candidates;
mod hostile;
mod indirect;
mod learnt;
mod mixture;
mod path_reuse;
mod points;
mod published;
mod restir_pt;
mod restir_volume;
mod scenes;
mod volume_motion;
mod volume_reuse;
mod world;
mod world_paths;
