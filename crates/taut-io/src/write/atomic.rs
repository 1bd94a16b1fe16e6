//! Files that appear whole or not at all.
//!
//! A draft is filled beside its target and takes the target's place when it is complete and on the disk. On Linux it has
//! no name until then, so that nothing is left of a process that is killed; where the file system knows no files without
//! a name it is a hidden file, which goes when the process is told to end, and is swept up by the next one if it was
//! killed.

use std::fs::{self, File, Metadata};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use tempfile::{Builder, NamedTempFile};

use super::unfinished::Unfinished;
use crate::error::WriteError;

/// Writes a file that appears only when it is complete and on the disk; until then what stood there stays. Access
/// rights are kept, and where `path` is a link the file that it leads to is replaced. What is no plain file (a pipe, a
/// terminal) is written directly.
///
/// # Errors
/// [`WriteError::Io`] with what the system or `fill` says.
pub fn write_whole(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    replace(path, |file| fill(file)).map_err(|source| WriteError::Io {
        file: path.to_path_buf(),
        source,
    })
}

/// The same for what is written out of order.
pub(super) fn replace(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let target = target_of(path)?;
    let before = fs::metadata(&target).ok();
    if before.as_ref().is_some_and(|found| !found.is_file()) {
        let mut file = BufWriter::new(File::options().write(true).open(&target)?);
        fill(&mut file)?;
        return file.flush();
    }
    let folder = folder_of(&target);
    let draft = Draft::new(folder)?;
    if let Some(before) = &before {
        keep_rights(draft.file(), before)?;
    }
    let mut file = BufWriter::new(draft.file().try_clone()?);
    fill(&mut file)?;
    let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.sync_all()?;
    draft.put(&target, folder)?;
    sync_folder(folder)
}

/// Says whether a file could be put in a place: its folder must be there, and no folder in its stead.
///
/// # Errors
/// [`WriteError::Io`] with what the system would say.
pub fn check_place(path: &Path) -> Result<(), WriteError> {
    is_place(path).map_err(|source| WriteError::Io {
        file: path.to_path_buf(),
        source,
    })
}

fn is_place(path: &Path) -> io::Result<()> {
    let target = target_of(path)?;
    match fs::metadata(&target) {
        Ok(found) if found.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(_) => Ok(()),
        Err(_) => match fs::metadata(folder_of(&target)) {
            Ok(found) if !found.is_dir() => Err(io::ErrorKind::NotADirectory.into()),
            found => found.map(|_| ()),
        },
    }
}

/// The file that a path leads to through symbolic links, which need not be there.
///
/// # Errors
/// What the system says, also of links that lead round in a circle.
pub fn target_of(path: &Path) -> io::Result<PathBuf> {
    /// As many as Linux follows.
    const MOST_LINKS: usize = 40;
    let mut target = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&target) {
            Ok(next) => target = folder_of(&target).join(next),
            // No link, or nothing at all.
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::InvalidInput | io::ErrorKind::NotFound
                ) =>
            {
                return Ok(target);
            }
            // Systems without links have other names for that.
            Err(error) => {
                return if target.exists() {
                    Ok(target)
                } else {
                    Err(error)
                };
            }
        }
    }
    Err(io::Error::other("found links that lead round in a circle"))
}

/// The folder that a file lies in.
fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Waits until the names in a folder are on the disk, where the system can do that.
///
/// # Errors
/// What the system says.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::InvalidInput
                    | io::ErrorKind::Unsupported
                    | io::ErrorKind::PermissionDenied
            ) =>
        {
            Ok(())
        }
        synced => synced,
    }
}

/// Gives a draft the owner, as far as that is allowed, and the access rights of the file that it replaces.
fn keep_rights(draft: &File, before: &Metadata) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt, fchown};
        let made = draft.metadata()?;
        if (made.uid(), made.gid()) != (before.uid(), before.gid()) {
            // Only the administrator may give files away.
            let _ = fchown(draft, Some(before.uid()), Some(before.gid()));
        }
    }
    draft.set_permissions(before.permissions())
}

/// A file on its way.
enum Draft {
    /// Without a name.
    #[cfg(target_os = "linux")]
    Unnamed(File),
    /// With a name of its own until it has that of the target.
    Named(NamedTempFile, Unfinished),
}

const PREFIX: &str = ".taut-";
const SUFFIX: &str = ".tmp";

impl Draft {
    fn new(folder: &Path) -> io::Result<Self> {
        #[cfg(target_os = "linux")]
        if let Some(file) = linux::unnamed(folder)? {
            return Ok(Self::Unnamed(file));
        }
        Self::named(folder)
    }

    fn named(folder: &Path) -> io::Result<Self> {
        sweep(folder);
        let mut builder = Builder::new();
        builder.prefix(PREFIX).suffix(SUFFIX);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // What a file usually gets; the process's mask takes away from it.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let file = builder.tempfile_in(folder)?;
        let unfinished = Unfinished::new(file.path());
        // A lock tells the sweeper that somebody is at work.
        let _ = file.as_file().try_lock();
        Ok(Self::Named(file, unfinished))
    }

    fn file(&self) -> &File {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => file,
            Self::Named(file, _) => file.as_file(),
        }
    }

    fn put(self, target: &Path, folder: &Path) -> io::Result<()> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => linux::put(&file, target, folder),
            Self::Named(file, unfinished) => {
                file.persist(target)?;
                unfinished.keep();
                Ok(())
            }
        }
    }
}

/// Takes away what killed processes left in a folder: hidden files of ours that are older than a minute and that
/// nobody holds.
fn sweep(folder: &Path) {
    const AGE: Duration = Duration::from_secs(60);
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_ours = name.starts_with(PREFIX) && name.ends_with(SUFFIX);
        let is_old = || {
            let changed = entry.metadata().and_then(|found| found.modified());
            changed.is_ok_and(|time| time.elapsed().is_ok_and(|age| age > AGE))
        };
        if is_ours && is_old() {
            let path = entry.path();
            if File::open(&path).is_ok_and(|file| file.try_lock().is_ok()) {
                let _ = fs::remove_file(&path);
            }
        }
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use std::fs::{self, File};
    use std::io;
    use std::os::fd::AsRawFd;
    use std::os::unix::fs::OpenOptionsExt;
    use std::path::{Path, PathBuf};

    use rustix::fs::{AtFlags, CWD, OFlags, linkat};
    use rustix::io::Errno;

    use super::super::unfinished::Unfinished;
    use super::{PREFIX, SUFFIX};

    const DESCRIPTORS: &str = "/proc/self/fd";

    /// A file without a name in a folder; `None` where the file system knows none, or where it could not be named later.
    pub(super) fn unnamed(folder: &Path) -> io::Result<Option<File>> {
        if !Path::new(DESCRIPTORS).exists() {
            return Ok(None);
        }
        let opened = File::options()
            .read(true)
            .write(true)
            .custom_flags(OFlags::TMPFILE.bits() as i32)
            .open(folder);
        match opened {
            Ok(file) => Ok(Some(file)),
            // The answers of systems that know no such files.
            Err(error) => match Errno::from_io_error(&error) {
                Some(Errno::OPNOTSUPP | Errno::ISDIR | Errno::INVAL) => Ok(None),
                _ => Err(error),
            },
        }
    }

    /// Gives a file without a name the name of the target.
    pub(super) fn put(file: &File, target: &Path, folder: &Path) -> io::Result<()> {
        match name(file, target) {
            Err(Errno::EXIST) => {}
            named => return Ok(named?),
        }
        // No call puts a file without a name in the place of another: it gets a name of its own for that moment.
        let (own, unfinished) = loop {
            let own = own_name(folder);
            let unfinished = Unfinished::new(&own);
            match name(file, &own) {
                Err(Errno::EXIST) => unfinished.keep(),
                named => {
                    named?;
                    break (own, unfinished);
                }
            }
        };
        fs::rename(own, target)?;
        unfinished.keep();
        Ok(())
    }

    fn name(file: &File, path: &Path) -> Result<(), Errno> {
        let descriptor = format!("{DESCRIPTORS}/{}", file.as_raw_fd());
        linkat(CWD, descriptor, CWD, path, AtFlags::SYMLINK_FOLLOW)
    }

    /// A name that hardly anybody else will think of.
    fn own_name(folder: &Path) -> PathBuf {
        use std::hash::{BuildHasher, RandomState};
        let number = RandomState::new().hash_one(std::process::id());
        folder.join(format!("{PREFIX}{number:016x}{SUFFIX}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn put(draft: Draft, text: &str, target: &Path, folder: &Path) {
        draft.file().write_all(text.as_bytes()).unwrap();
        draft.put(target, folder).unwrap();
    }

    #[test]
    fn both_kinds_of_drafts_replace_and_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let target = folder.join("file");
        for (is_named, text) in [(false, "one"), (false, "two"), (true, "three")] {
            let new = if is_named { Draft::named } else { Draft::new };
            put(new(folder).unwrap(), text, &target, folder);
            assert_eq!(fs::read_to_string(&target).unwrap(), text);
            assert_eq!(names(folder), ["file"]);
        }
        drop(Draft::named(folder).unwrap());
        drop(Draft::new(folder).unwrap());
        assert_eq!(names(folder), ["file"]);
    }

    #[test]
    fn what_fails_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("file");
        fs::write(&target, "old").unwrap();
        let failed = write_whole(&target, |out| {
            out.write_all(b"new")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(matches!(failed, Err(WriteError::Io { .. })));
        assert_eq!(fs::read_to_string(&target).unwrap(), "old");
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[cfg(unix)]
    #[test]
    fn rights_and_links_are_kept() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("deep")).unwrap();
        let (real, link) = (folder.path().join("deep/real"), folder.path().join("link"));
        symlink("deep/real", &link).unwrap();
        let write = |text: &str| {
            write_whole(&link, |out| out.write_all(text.as_bytes())).unwrap();
            assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
            assert_eq!(fs::read_to_string(&real).unwrap(), text);
        };
        write("through a link to nothing");
        fs::set_permissions(&real, fs::Permissions::from_mode(0o600)).unwrap();
        write("replaced");
        let mode = fs::metadata(&real).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        symlink("circle", folder.path().join("circle")).unwrap();
        assert!(write_whole(&folder.path().join("circle"), |_| Ok(())).is_err());
    }

    #[test]
    fn only_old_drafts_that_nobody_holds_are_swept() {
        let folder = tempfile::tempdir().unwrap();
        let old = std::time::SystemTime::now() - Duration::from_secs(3600);
        let make = |name: &str, time| {
            let file = File::create(folder.path().join(name)).unwrap();
            file.set_modified(time).unwrap();
            file
        };
        drop(make(".taut-killed.tmp", old));
        drop(make(".taut-young.tmp", std::time::SystemTime::now()));
        drop(make("other.tmp", old));
        let held = make(".taut-held.tmp", old);
        held.lock().unwrap();
        sweep(folder.path());
        assert_eq!(
            names(folder.path()),
            [".taut-held.tmp", ".taut-young.tmp", "other.tmp"]
        );
    }
}
