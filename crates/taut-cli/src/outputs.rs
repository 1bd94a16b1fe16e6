//! The files that a command reads and writes, looked at before any work: an output that is an input
//! would take the user's data away, one that is another output would take that away, and one that
//! cannot be written would cost the work.

use std::fs;
use std::path::{Path, PathBuf};

use taut_io::{Content, check_output};

use crate::exit::Failure;
use crate::source::Source;

/// The files of a command.
#[derive(Default)]
pub struct Files<'a> {
    inputs: Vec<Named<'a>>,
    outputs: Vec<Named<'a>>,
    checks: Vec<Check<'a>>,
}

/// A file, and the flag or the place on the command line that names it.
struct Named<'a> {
    flag: &'static str,
    file: &'a Path,
}

/// What a file is to hold.
struct Check<'a> {
    file: &'a Path,
    holds: Holds<'a>,
}

enum Holds<'a> {
    Content(Content<'a>, Option<usize>),
    Picture,
}

impl<'a> Files<'a> {
    /// Of a command about a surface.
    pub fn of(source: &'a Source) -> Self {
        let file = match source {
            Source::Cloud(cloud) => Some(cloud.file.as_path()),
            Source::Model(file) => Some(file.as_path()),
            Source::Equations(_) => None,
        };
        Self::default().reads("SURFACE", file)
    }

    pub fn reads(mut self, flag: &'static str, file: Option<&'a Path>) -> Self {
        let named = |file| Named { flag, file };
        self.inputs.extend(file.map(named));
        self
    }

    /// A file of points or paths of so many coordinates, where that is known already.
    pub fn writes(
        mut self,
        flag: &'static str,
        file: Option<&'a Path>,
        content: Content<'a>,
        dimension: Option<usize>,
    ) -> Self {
        let holds = |file| Check {
            file,
            holds: Holds::Content(content, dimension),
        };
        self.checks.extend(file.map(holds));
        self.writes_any(flag, file)
    }

    pub fn writes_picture(mut self, file: Option<&'a Path>) -> Self {
        let holds = |file| Check {
            file,
            holds: Holds::Picture,
        };
        self.checks.extend(file.map(holds));
        self.writes_any("--picture", file)
    }

    /// A file whose contents are not looked at here.
    pub fn writes_any(mut self, flag: &'static str, file: Option<&'a Path>) -> Self {
        let named = |file| Named { flag, file };
        self.outputs.extend(file.map(named));
        self
    }

    /// Refuses outputs that are inputs or each other, and those that cannot be written.
    pub fn check(self) -> Result<(), Failure> {
        let standard = |flag, file| Named {
            flag,
            file: Path::new(file),
        };
        let inputs = self.inputs.iter().map(|input| (input, false));
        let outputs = self.outputs.iter().map(|output| (output, true));
        // What the shell redirects is a file as well.
        let redirected = if cfg!(unix) {
            vec![
                (standard("standard input", "/dev/stdin"), false),
                (standard("standard output", "/dev/stdout"), true),
            ]
        } else {
            Vec::new()
        };
        let redirected = redirected
            .iter()
            .map(|(named, is_output)| (named, *is_output));
        let mut known: Vec<(&Named<'_>, bool, Identity)> = Vec::new();
        for (named, is_output) in inputs.chain(redirected).chain(outputs) {
            let Some(identity) = Identity::of(named.file) else {
                continue;
            };
            let same = known.iter().find(|(_, other_is_output, other)| {
                (is_output || *other_is_output) && *other == identity
            });
            if let Some((other, other_is_output, _)) = same {
                let (output, other) = if is_output {
                    (named, *other)
                } else {
                    (*other, named)
                };
                let verb = if is_output && *other_is_output {
                    "writes"
                } else {
                    "reads"
                };
                return Err(Failure::Usage(format!(
                    "{}: found {}, which is the same file that {} {verb}, expected a file of its own; name another file",
                    output.flag,
                    output.file.display(),
                    other.flag,
                )));
            }
            known.push((named, is_output, identity));
        }
        self.checks.iter().try_for_each(Check::run)
    }
}

impl Check<'_> {
    fn run(&self) -> Result<(), Failure> {
        match self.holds {
            Holds::Content(content, dimension) => Ok(check_output(self.file, content, dimension)?),
            Holds::Picture => {
                let extension = self.file.extension();
                if extension.is_none_or(|found| !found.eq_ignore_ascii_case("png")) {
                    return Err(Failure::Usage(format!(
                        "--picture: found {}, expected the extension .png, because pictures are PNG files; rename it",
                        self.file.display()
                    )));
                }
                Ok(taut_io::check_place(self.file)?)
            }
        }
    }
}

/// What two names of one file share.
#[derive(PartialEq, Eq)]
enum Identity {
    /// Device and number of a file that is there.
    #[cfg(unix)]
    Number(u64, u64),
    /// The name without links and detours.
    Path(PathBuf),
}

impl Identity {
    /// `None` for what is neither file nor folder, such as a terminal or a pipe.
    fn of(file: &Path) -> Option<Self> {
        match fs::metadata(file) {
            Ok(found) if !found.is_file() && !found.is_dir() => None,
            #[cfg(unix)]
            Ok(found) => {
                use std::os::unix::fs::MetadataExt;
                Some(Self::Number(found.dev(), found.ino()))
            }
            #[cfg(not(unix))]
            Ok(_) => fs::canonicalize(file).ok().map(Self::Path),
            Err(_) => {
                let target = taut_io::target_of(file).ok()?;
                let folder = target
                    .parent()
                    .filter(|folder| !folder.as_os_str().is_empty());
                let folder = fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()?;
                Some(Self::Path(folder.join(target.file_name()?)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_same(a: &Path, b: &Path) -> bool {
        let [a, b] = [a, b].map(|file| Identity::of(file).expect("a file"));
        a == b
    }

    #[test]
    fn names_of_one_file_are_known_as_such() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = |name: &str| folder.path().join(name);
        fs::write(file("there"), "text").expect("written");
        fs::create_dir(file("deep")).expect("made");
        for name in ["there", "absent"] {
            assert!(is_same(&file(name), &file(&format!("deep/../{name}"))));
            assert!(is_same(&file(name), &file(&format!("./{name}"))));
        }
        assert!(!is_same(&file("there"), &file("absent")));
        #[cfg(unix)]
        {
            use std::os::unix::fs::symlink;
            for name in ["there", "absent"] {
                let link = file(&format!("link-to-{name}"));
                symlink(file(name), &link).expect("linked");
                assert!(is_same(&file(name), &link));
            }
            fs::hard_link(file("there"), file("other-name")).expect("linked");
            assert!(is_same(&file("there"), &file("other-name")));
            assert!(Identity::of(Path::new("/dev/null")).is_none());
        }
    }
}
