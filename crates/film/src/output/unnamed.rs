//! Files that have no name until they are complete, so that nothing is left of a process that is
//! killed.

use std::fs::File;
use std::io;
use std::path::Path;

/// A file without a name.
#[cfg(any(target_os = "linux", target_os = "android"))]
pub struct UnnamedFile(File);

#[cfg(any(target_os = "linux", target_os = "android"))]
impl UnnamedFile {
    /// A file in the folder of `path`; `None` if its file system, or the system, has none such.
    pub fn in_folder_of(path: &Path) -> Option<Self> {
        use super::names::{final_path, folder_of};
        use rustix::fs::{CWD, Mode, OFlags, openat};
        // It is by this folder that the file gets a name in the end.
        if !Path::new(DESCRIPTORS).is_dir() {
            return None;
        }
        let path = final_path(path);
        let flags = OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC;
        let file = openat(CWD, folder_of(&path), flags, Mode::from_raw_mode(0o666)).ok()?;
        Some(Self(file.into()))
    }

    /// The file, to write to.
    pub fn file(&self) -> &File {
        &self.0
    }

    /// Replaces any file at `path`, which is that given to [`UnnamedFile::in_folder_of`], in one
    /// step.
    pub fn publish(self, path: &Path) -> io::Result<()> {
        use super::names::{final_path, temporary_name};
        use rustix::fs::{AtFlags, CWD, linkat};
        use rustix::io::Errno;
        use std::os::fd::AsRawFd;
        self.0.sync_all()?;
        let path = final_path(path);
        let own = Path::new(DESCRIPTORS).join(self.0.as_raw_fd().to_string());
        // A link replaces nothing, a rename does.
        loop {
            let name = temporary_name(&path);
            match linkat(CWD, &own, CWD, &name, AtFlags::SYMLINK_FOLLOW) {
                Ok(()) => {
                    return std::fs::rename(&name, &path).inspect_err(|_| {
                        std::fs::remove_file(&name).ok();
                    });
                }
                // Left by a process of the same number that was killed.
                Err(Errno::EXIST) => (),
                Err(error) => return Err(error.into()),
            }
        }
    }
}

/// The folder in which the process finds its open files.
#[cfg(any(target_os = "linux", target_os = "android"))]
const DESCRIPTORS: &str = "/proc/self/fd";

/// There are no such files.
#[cfg(not(any(target_os = "linux", target_os = "android")))]
pub enum UnnamedFile {}

#[cfg(not(any(target_os = "linux", target_os = "android")))]
impl UnnamedFile {
    pub fn in_folder_of(_: &Path) -> Option<Self> {
        None
    }

    pub fn file(&self) -> &File {
        match *self {}
    }

    pub fn publish(self, _: &Path) -> io::Result<()> {
        match self {}
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_file_has_no_name_until_it_is_complete() {
        let folder = std::env::temp_dir().join(format!("lightshed-unnamed-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let count = || std::fs::read_dir(&folder).unwrap().count();
        let path = folder.join("file.exr");
        for content in ["first", "second"] {
            let before = count();
            let Some(unnamed) = UnnamedFile::in_folder_of(&path) else {
                println!("SKIPPED: no files without names here");
                break;
            };
            unnamed.file().write_all(content.as_bytes()).unwrap();
            assert_eq!(count(), before);
            unnamed.publish(&path).unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), content);
            assert_eq!(count(), 1);
            // One that is not completed leaves nothing.
            drop(UnnamedFile::in_folder_of(&path));
            assert_eq!(count(), 1);
        }
        // What is in the way stays.
        std::fs::remove_file(&path).ok();
        std::fs::create_dir_all(path.join("inside")).unwrap();
        if let Some(unnamed) = UnnamedFile::in_folder_of(&folder.join("other.exr")) {
            assert!(unnamed.publish(&path).is_err());
            assert_eq!(count(), 1);
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
