//! Files that appear whole or not at all.
//!
//! A draft is filled beside its target and takes the target's place when it is complete and on the
//! disk. On Linux it has no name until then, so that nothing is left of a process that is killed;
//! where the file system knows no files without a name it is a hidden file, which goes when the
//! process is told to end, and is swept up by the next one if it was killed.

use std::fs::{self, File, Metadata};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use tempfile::{Builder, NamedTempFile};

use super::unfinished::Unfinished;
use crate::error::WriteError;

/// Writes a file that appears only when it is complete and on the disk; until then what stood there
/// stays. Access rights are kept, and where `path` is a link the file that it leads to is replaced.
/// What is no plain file (a pipe, a terminal) is written directly.
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
    is_place(path)?;
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
    draft.put(&target)?;
    sync_folder(folder)
}

/// Says whether a file could be put in a place: its folder must be there, and neither a folder in
/// its stead nor a file that nobody may write.
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
        Ok(found) if found.permissions().readonly() => Err(io::ErrorKind::PermissionDenied.into()),
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

/// Gives a draft the owner, as far as that is allowed, and the access rights of the file that it
/// replaces.
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

    /// A file without a name to which the system gives none, copied into one that has a name.
    #[cfg(target_os = "linux")]
    fn copied(mut file: File, folder: &Path) -> io::Result<Self> {
        let named = Self::named(folder)?;
        keep_rights(named.file(), &file.metadata()?)?;
        io::Seek::rewind(&mut file)?;
        io::copy(&mut file, &mut named.file())?;
        named.file().sync_all()?;
        Ok(named)
    }

    fn file(&self) -> &File {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => file,
            Self::Named(file, _) => file.as_file(),
        }
    }

    fn put(self, target: &Path) -> io::Result<()> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => linux::put(&file, target)
                .or_else(|_| Self::copied(file, folder_of(target))?.put(target)),
            Self::Named(file, unfinished) => {
                file.persist(target)?;
                unfinished.keep();
                Ok(())
            }
        }
    }
}

/// Takes away what killed processes left in a folder: hidden files of ours that are older than a
/// minute and that nobody holds.
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
    use super::{PREFIX, SUFFIX, folder_of};

    const DESCRIPTORS: &str = "/proc/self/fd";

    /// A file without a name in a folder; `None` where the file system knows none, or where it
    /// could not be named later.
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
    pub(super) fn put(file: &File, target: &Path) -> io::Result<()> {
        match name(file, target) {
            Err(Errno::EXIST) => {}
            named => return Ok(named?),
        }
        // No call puts a file without a name in the place of another: it gets a name of its own for
        // that moment.
        let (own, unfinished) = loop {
            let own = own_name(folder_of(target));
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
mod tests;
