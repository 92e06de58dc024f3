//! The target of an image: checked before rendering, replaced in one step after it.

use super::names::{final_path, folder_of, temporary_name};
use super::unnamed::UnnamedFile;
use super::{write_exr, write_png};
use crate::RgbImage;
use std::fmt;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Format of an image file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// OpenEXR, linear `f32`.
    Exr,
    /// PNG, sRGB with 8 bits a channel.
    Png,
}

impl ImageFormat {
    /// The format that the extension of `path` names, `.exr` or `.png` in any case.
    pub fn from_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?;
        if extension.eq_ignore_ascii_case("exr") {
            Some(Self::Exr)
        } else if extension.eq_ignore_ascii_case("png") {
            Some(Self::Png)
        } else {
            None
        }
    }
}

/// Why an image cannot be written; each names the path, and the cause is the
/// [`source`](std::error::Error::source).
#[derive(Debug)]
#[non_exhaustive]
pub enum OutputError {
    /// The extension is neither `.exr` nor `.png`.
    Format(PathBuf),
    /// The folder does not exist, or is no folder.
    Folder(PathBuf),
    /// The path is that of a folder, a device or another thing that must not be replaced.
    NotAFile(PathBuf),
    /// The file system refuses.
    Io(PathBuf, io::Error),
    /// Encoding as OpenEXR failed.
    Exr(PathBuf, exr::error::Error),
    /// A shard cannot be written to this target: the file is no OpenEXR file, or its header would
    /// be too long.
    Shard(PathBuf, String),
}

impl fmt::Display for OutputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Format(path) => write!(
                f,
                "cannot write {}: the name must end in .exr or .png",
                path.display()
            ),
            Self::Folder(path) => write!(f, "cannot write {}: its folder does not exist", path.display()),
            Self::NotAFile(path) => write!(f, "cannot write {}: it exists and is no file", path.display()),
            Self::Shard(path, reason) => write!(f, "cannot write the shard {}: {reason}", path.display()),
            Self::Io(path, _) | Self::Exr(path, _) => write!(f, "cannot write {}", path.display()),
        }
    }
}

impl std::error::Error for OutputError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io(_, error) => Some(error),
            Self::Exr(_, error) => Some(error),
            _ => None,
        }
    }
}

/// A path that an image can be written to.
///
/// [`OutputTarget::prepare`] checks the path before anything is rendered. [`OutputTarget::write`]
/// writes a temporary file in the same folder and renames it, so that the path holds either its old
/// content or the complete new image, never a part of one.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputTarget {
    path: PathBuf,
    format: ImageFormat,
    exposure: f32,
}

impl OutputTarget {
    /// Checks that an image can be written to `path`: its extension names a format, its folder
    /// exists and accepts a new file (a test file is made and removed), and nothing other than a
    /// file is in the way.
    ///
    /// # Errors
    ///
    /// One of these does not hold.
    pub fn prepare(path: impl Into<PathBuf>) -> Result<Self, OutputError> {
        let path = path.into();
        let Some(format) = ImageFormat::from_path(&path) else {
            return Err(OutputError::Format(path));
        };
        match fs::metadata(&path) {
            Ok(metadata) if !metadata.is_file() => return Err(OutputError::NotAFile(path)),
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(OutputError::Io(path, error));
            }
            _ => (),
        }
        let target = Self {
            path,
            format,
            exposure: 0.0,
        };
        if !folder_of(&target.path).is_dir() {
            return Err(OutputError::Folder(target.path));
        }
        match Temporary::create(&target.path) {
            Ok(_) => Ok(target),
            Err(error) => Err(OutputError::Io(target.path, error)),
        }
    }

    /// With linear values multiplied by `2^stops` in formats that clamp them (PNG); OpenEXR files
    /// keep theirs.
    pub fn with_exposure(mut self, stops: f32) -> Self {
        self.exposure = stops;
        self
    }

    /// Where the image goes.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The format that the path's extension names.
    pub fn format(&self) -> ImageFormat {
        self.format
    }

    /// Writes `image` and replaces any file at the path.
    ///
    /// # Errors
    ///
    /// The file system refuses or is full; the path then holds what it held before.
    pub fn write(&self, image: &RgbImage) -> Result<(), OutputError> {
        let io_error = |error| OutputError::Io(self.path.clone(), error);
        self.replace(|writer| match self.format {
            ImageFormat::Exr => match write_exr(image, writer) {
                Ok(()) => Ok(()),
                Err(exr::error::Error::Io(error)) => Err(io_error(error)),
                Err(error) => Err(OutputError::Exr(self.path.clone(), error)),
            },
            ImageFormat::Png => write_png(image, self.exposure, writer).map_err(io_error),
        })
    }

    /// Replaces any file at the path by the OpenEXR file of `length` bytes that `write` writes.
    pub(crate) fn replace_exr(
        &self,
        length: u64,
        write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
    ) -> Result<(), OutputError> {
        if self.format != ImageFormat::Exr {
            let reason = "the name must end in .exr".to_owned();
            return Err(OutputError::Shard(self.path.clone(), reason));
        }
        self.replace(|writer| {
            let written = reserve(writer.get_ref(), length).and_then(|()| write(writer));
            written.map_err(|error| OutputError::Io(self.path.clone(), error))
        })
    }

    /// A file of no name for an OpenEXR image of `length` bytes, which becomes that of the target
    /// in the end. `None` where there are no such files.
    pub(crate) fn unnamed_exr(&self, length: u64) -> Result<Option<UnnamedFile>, OutputError> {
        if self.format != ImageFormat::Exr {
            let reason = "the name must end in .exr".to_owned();
            return Err(OutputError::Shard(self.path.clone(), reason));
        }
        let Some(file) = UnnamedFile::in_folder_of(&self.path) else {
            return Ok(None);
        };
        reserve(file.file(), length).map_err(|error| OutputError::Io(self.path.clone(), error))?;
        Ok(Some(file))
    }

    /// Writes a temporary file and renames it.
    fn replace(
        &self,
        write: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), OutputError>,
    ) -> Result<(), OutputError> {
        let io_error = |error| OutputError::Io(self.path.clone(), error);
        let path = final_path(&self.path);
        let mut temporary = Temporary::create(&path).map_err(io_error)?;
        let mut writer = BufWriter::new(&mut temporary.file);
        write(&mut writer)?;
        writer.flush().map_err(io_error)?;
        drop(writer);
        temporary.replace(&path).map_err(io_error)
    }
}

/// Reserves room for a file's content: a full disk is known before anything is written, and writing
/// costs less. A file system that cannot do so is no error.
#[cfg(any(target_os = "linux", target_os = "android"))]
fn reserve(file: &File, length: u64) -> io::Result<()> {
    use rustix::fs::{FallocateFlags, fallocate};
    use rustix::io::Errno;
    match fallocate(file, FallocateFlags::empty(), 0, length) {
        Err(error @ (Errno::NOSPC | Errno::DQUOT | Errno::FBIG)) => Err(error.into()),
        _ => Ok(()),
    }
}

#[cfg(not(any(target_os = "linux", target_os = "android")))]
fn reserve(_: &File, _: u64) -> io::Result<()> {
    Ok(())
}

/// A file beside its final place that removes itself unless it is renamed.
struct Temporary {
    file: File,
    path: PathBuf,
}

impl Temporary {
    fn create(beside: &Path) -> io::Result<Self> {
        loop {
            let path = temporary_name(beside);
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok(Self { file, path }),
                // Left by a process of the same number that was killed.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => (),
                Err(error) => return Err(error),
            }
        }
    }

    fn replace(self, path: &Path) -> io::Result<()> {
        self.file.sync_all()?;
        // Once renamed there is nothing left at the old name for `drop` to remove.
        fs::rename(&self.path, path)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        fs::remove_file(&self.path).ok();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("lightshed-output-{name}-{}", std::process::id()));
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        fn names(&self) -> Vec<String> {
            let entries = fs::read_dir(&self.0).unwrap();
            let mut names: Vec<_> = entries
                .map(|e| e.unwrap().file_name().into_string().unwrap())
                .collect();
            names.sort();
            names
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            fs::remove_dir_all(&self.0).ok();
        }
    }

    fn grey(value: f32) -> RgbImage {
        RgbImage::from_fn(3, 2, |_, _| [value; 3]).unwrap()
    }

    #[test]
    fn preparing_leaves_nothing_and_writing_leaves_one_file() {
        let folder = Folder::new("write");
        for name in ["a.exr", "b.PNG"] {
            let target = OutputTarget::prepare(folder.0.join(name)).unwrap();
            assert!(!target.path().exists());
        }
        assert!(folder.names().is_empty());
        let target = OutputTarget::prepare(folder.0.join("a.exr")).unwrap();
        for value in [0.25, 0.5] {
            target.write(&grey(value)).unwrap();
            assert_eq!(super::super::read_exr(target.path()).unwrap(), grey(value));
            assert_eq!(folder.names(), ["a.exr"]);
        }
        let target = OutputTarget::prepare(folder.0.join("b.png")).unwrap();
        assert_eq!(target.format(), ImageFormat::Png);
        target.write(&grey(0.25)).unwrap();
        let dark = fs::read(target.path()).unwrap();
        target.with_exposure(1.0).write(&grey(0.25)).unwrap();
        assert_ne!(fs::read(folder.0.join("b.png")).unwrap(), dark);
        assert_eq!(folder.names(), ["a.exr", "b.png"]);
    }

    #[test]
    fn what_cannot_be_written_is_known_beforehand() {
        let folder = Folder::new("prepare");
        let attempt = |name: &str| OutputTarget::prepare(folder.0.join(name)).unwrap_err();
        assert!(matches!(attempt("image.jpg"), OutputError::Format(_)));
        assert!(matches!(attempt("image"), OutputError::Format(_)));
        assert!(matches!(attempt("missing/image.exr"), OutputError::Folder(_)));
        fs::create_dir(folder.0.join("folder.exr")).unwrap();
        assert!(matches!(attempt("folder.exr"), OutputError::NotAFile(_)));
        fs::write(folder.0.join("file"), "").unwrap();
        assert!(matches!(
            attempt("file/image.exr"),
            OutputError::Io(..) | OutputError::Folder(_)
        ));
        let too_long = format!("{}.exr", "x".repeat(300));
        assert!(matches!(attempt(&too_long), OutputError::Io(..)));
        assert_eq!(folder.names(), ["file", "folder.exr"]);
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = Folder::new("failure");
        let target = OutputTarget::prepare(folder.0.join("image.png")).unwrap();
        target.write(&grey(0.5)).unwrap();
        // A folder that came into the way after `prepare`: the rename is what fails.
        fs::remove_file(target.path()).unwrap();
        fs::create_dir(target.path()).unwrap();
        fs::write(target.path().join("inside"), "").unwrap();
        assert!(matches!(target.write(&grey(0.5)), Err(OutputError::Io(..))));
        assert_eq!(folder.names(), ["image.png"]);
        // The folder itself gone: the temporary file is what fails.
        let target = OutputTarget::prepare(folder.0.join("other.exr")).unwrap();
        fs::remove_dir_all(&folder.0).unwrap();
        assert!(matches!(target.write(&grey(0.5)), Err(OutputError::Io(..))));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link() {
        let folder = Folder::new("link");
        fs::create_dir(folder.0.join("elsewhere")).unwrap();
        let file = folder.0.join("elsewhere/real.exr");
        OutputTarget::prepare(&file).unwrap().write(&grey(0.5)).unwrap();
        let link = folder.0.join("link.exr");
        std::os::unix::fs::symlink(&file, &link).unwrap();
        OutputTarget::prepare(&link).unwrap().write(&grey(2.0)).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(super::super::read_exr(&file).unwrap(), grey(2.0));
    }
}
