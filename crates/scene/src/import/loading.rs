//! A loading under way: what it has cost so far, and the files that it may read.

use super::error::{ImportError, Location};
use super::limits::{LoadLimits, LoadResource};
use std::cell::Cell;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Deepest nesting whatever the limits say: what the stack of a thread holds.
const DEEPEST: u64 = 1_000;

/// Counts what a scene costs and reads its files.
pub(crate) struct Loading {
    limits: LoadLimits,
    bytes: Cell<u64>,
    vertices: Cell<u64>,
    #[cfg(any(feature = "gltf", feature = "mitsuba", feature = "pbrt"))]
    copies: Cell<u64>,
    nodes: Cell<u64>,
    includes: Cell<u64>,
    start: Instant,
    /// Folder of the scene's file, as given.
    folder: PathBuf,
    /// Folders, links followed, that files may lie in; `None` where any will do.
    permitted: Option<Vec<PathBuf>>,
    /// Folders that names are looked up in, the first one first.
    #[cfg(feature = "mitsuba")]
    search: std::cell::RefCell<Vec<PathBuf>>,
}

impl Loading {
    /// Of the scene in the file `path`, or of a text that would lie there.
    pub(crate) fn new(path: &Path, limits: &LoadLimits) -> Self {
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let folders = std::iter::once(folder).chain(limits.folders.iter().map(PathBuf::as_path));
        // A folder that does not exist has no files.
        let permitted = folders.filter_map(|folder| folder.canonicalize().ok()).collect();
        Self {
            permitted: Some(permitted),
            ..Self::anywhere(folder, limits)
        }
    }

    /// Of a single file that the caller has chosen.
    pub(crate) fn of_file() -> Self {
        Self::anywhere(Path::new("."), &LoadLimits::default())
    }

    fn anywhere(folder: &Path, limits: &LoadLimits) -> Self {
        Self {
            limits: limits.clone(),
            bytes: Cell::new(0),
            vertices: Cell::new(0),
            #[cfg(any(feature = "gltf", feature = "mitsuba", feature = "pbrt"))]
            copies: Cell::new(0),
            nodes: Cell::new(0),
            includes: Cell::new(0),
            start: Instant::now(),
            folder: folder.to_path_buf(),
            permitted: None,
            #[cfg(feature = "mitsuba")]
            search: Default::default(),
        }
    }

    /// Spends `amount` of a resource that is counted. `location` is asked for in the case of an
    /// error.
    pub(crate) fn spend(
        &self,
        resource: LoadResource,
        amount: u64,
        location: impl Fn() -> Location,
    ) -> Result<(), ImportError> {
        let (spent, limit) = match resource {
            LoadResource::Bytes => (&self.bytes, self.limits.bytes),
            LoadResource::Vertices => (&self.vertices, self.limits.vertices),
            LoadResource::Nodes => (&self.nodes, self.limits.nodes),
            LoadResource::Includes => (&self.includes, self.limits.includes),
            LoadResource::Depth => return self.check_depth(amount, location),
            LoadResource::Seconds => return self.check_time(location),
        };
        let total = spent.get().saturating_add(amount);
        if total > limit {
            return Err(over(location(), resource, limit as f64));
        }
        spent.set(total);
        self.check_time(location)
    }

    /// Errs if the time is over.
    fn check_time(&self, location: impl Fn() -> Location) -> Result<(), ImportError> {
        if self.start.elapsed().as_secs_f64() > self.limits.seconds {
            return Err(over(location(), LoadResource::Seconds, self.limits.seconds));
        }
        Ok(())
    }

    /// Errs at a level of nesting, counted from 0, that is too deep.
    pub(crate) fn check_depth(&self, depth: u64, location: impl Fn() -> Location) -> Result<(), ImportError> {
        let limit = self.limits.depth.min(DEEPEST);
        if depth > limit {
            return Err(over(location(), LoadResource::Depth, limit as f64));
        }
        Ok(())
    }

    /// Spends what an image of `size` takes before it is decoded: what of each pixel is kept.
    /// Errs too if what is needed on the way there, `decoded` bytes more a pixel, is not left.
    #[cfg(feature = "images")]
    pub(crate) fn spend_image(
        &self,
        size: [usize; 2],
        decoded: usize,
        kept: usize,
        path: &Path,
    ) -> Result<(), ImportError> {
        let [width, height] = size;
        let pixels = (width as u64).saturating_mul(height as u64);
        let location = || Location::file(path).element(format!("an image of {width} × {height} pixels"));
        let left = self.bytes_left();
        if pixels.saturating_mul((decoded + kept) as u64) > left {
            return Err(over(location(), LoadResource::Bytes, self.limits.bytes as f64));
        }
        self.spend(LoadResource::Bytes, pixels.saturating_mul(kept as u64), location)
    }

    /// Spends a mesh that is placed in the scene.
    pub(crate) fn spend_mesh(
        &self,
        vertices: usize,
        triangles: usize,
        location: impl Fn() -> Location,
    ) -> Result<(), ImportError> {
        let count = (vertices as u64).saturating_add(triangles as u64);
        self.spend(LoadResource::Vertices, count, location)
    }

    /// Whether a mesh that is placed again is copied; if not, it becomes an instance.
    #[cfg(any(feature = "gltf", feature = "mitsuba", feature = "pbrt"))]
    pub(crate) fn copies(&self, vertices: usize, triangles: usize) -> bool {
        let count = (vertices as u64).saturating_add(triangles as u64);
        let total = self.copies.get().saturating_add(count);
        let copied = total <= self.limits.copies;
        if copied {
            self.copies.set(total);
        }
        copied
    }

    /// Bytes that may still come.
    pub(crate) fn bytes_left(&self) -> u64 {
        self.limits.bytes - self.bytes.get()
    }

    /// Vertices and triangles that may still come.
    pub(crate) fn vertices_left(&self) -> u64 {
        self.limits.vertices - self.vertices.get()
    }

    /// The error of a mesh of more than [`vertices_left`](Self::vertices_left).
    pub(crate) fn too_many_vertices(&self, location: Location) -> ImportError {
        over(location, LoadResource::Vertices, self.limits.vertices as f64)
    }

    /// The scene's own file as bytes.
    pub(crate) fn read_main(&self, path: &Path) -> Result<Vec<u8>, ImportError> {
        self.read_regular(path, path)
    }

    /// A file that the scene refers to, as bytes.
    pub(crate) fn read(&self, path: &Path) -> Result<Vec<u8>, ImportError> {
        let Some(permitted) = &self.permitted else {
            return self.read_regular(path, path);
        };
        // Without links, `.` and `..`: where the file really is.
        let real = path.canonicalize().map_err(|source| unreadable(path, source))?;
        if !permitted.iter().any(|folder| real.starts_with(folder)) {
            return Err(ImportError::Outside {
                path: path.to_path_buf(),
                folder: self.folder.clone(),
            });
        }
        self.read_regular(path, &real)
    }

    /// Reads `real`, named `path` in messages, if it is a regular file of no more than what is left
    /// of the budget.
    fn read_regular(&self, path: &Path, real: &Path) -> Result<Vec<u8>, ImportError> {
        let unreadable = |source| unreadable(path, source);
        let irregular = || ImportError::NotAFile {
            path: path.to_path_buf(),
        };
        // Asked before it is opened, since opening a pipe waits for a writer.
        if !real.metadata().map_err(unreadable)?.is_file() {
            return Err(irregular());
        }
        let file = File::open(real).map_err(unreadable)?;
        let metadata = file.metadata().map_err(unreadable)?;
        if !metadata.is_file() {
            return Err(irregular());
        }
        let location = || Location::file(path);
        let left = self.bytes_left();
        if metadata.len() > left {
            return Err(over(location(), LoadResource::Bytes, self.limits.bytes as f64));
        }
        let mut bytes = Vec::with_capacity(metadata.len() as usize);
        // Some file systems do not know how long their files are.
        file.take(left.saturating_add(1))
            .read_to_end(&mut bytes)
            .map_err(unreadable)?;
        self.spend(LoadResource::Bytes, bytes.len() as u64, location)?;
        Ok(bytes)
    }

    /// Puts a folder before those that names are looked up in.
    #[cfg(feature = "mitsuba")]
    pub(crate) fn search_first(&self, folder: PathBuf) {
        self.search.borrow_mut().insert(0, folder);
    }

    /// Where a file of this name is, that a file in `beside` refers to: there, in a folder that the
    /// scene names, beside the scene's own file, or in the current directory; in `beside` if it is
    /// nowhere.
    #[cfg(feature = "mitsuba")]
    pub(crate) fn resolve(&self, beside: &Path, name: &str) -> PathBuf {
        let first = beside.join(name);
        if first.exists() {
            return first;
        }
        let search = self.search.borrow();
        let others = search.iter().map(PathBuf::as_path);
        let others = others.chain([self.folder.as_path(), Path::new("")]);
        let mut found = others
            .map(|folder| folder.join(name))
            .filter(|path| path.exists());
        found.next().unwrap_or(first)
    }
}

fn over(location: Location, resource: LoadResource, limit: f64) -> ImportError {
    ImportError::OverBudget {
        location,
        resource,
        limit,
    }
}

fn unreadable(path: &Path, source: std::io::Error) -> ImportError {
    ImportError::Read {
        path: path.to_path_buf(),
        source,
    }
}
