//! What a result depends on: the contents of the input files and the options.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hasher};
use std::path::Path;

use taut::equations::Implicit;
use taut_io::ReadError;

use crate::exit::Failure;
use crate::matrix::settings::Settings;
use crate::source::{CloudSettings, Source};

/// Values by the flags that they were given with.
pub type Identity = BTreeMap<String, String>;

/// What the table depends on.
pub fn of(settings: &Settings) -> Result<Identity, Failure> {
    let mut identity = Identity::new();
    let mut add = |name: &str, value: String| identity.insert(name.to_owned(), value);
    add("taut", env!("CARGO_PKG_VERSION").to_owned());
    match &settings.source {
        Source::Cloud(cloud) => {
            let CloudSettings {
                file,
                options,
                model,
            } = cloud;
            add("SURFACE", contents(file)?);
            add("--class", format!("{:?}", options.classes));
            add("--format", format!("{:?}", options.format));
            add("--dimension", format!("{:?}", model.dimension));
            add("--cell", format!("{:?}", model.cells));
            add("--surface", format!("{:?}", model.reconstruction));
        }
        Source::Model(file) => {
            add("SURFACE", contents(file)?);
        }
        Source::Equations(Implicit { law, bounds, .. }) => {
            add("SURFACE", law.to_string());
            add("--bounds", format!("{bounds:?}"));
        }
    }
    add("--sources", contents(&settings.sources)?);
    let to = settings.to.as_deref().map(contents).transpose()?;
    add("--to", to.unwrap_or_else(none));
    add("--tol", format!("{:?}", settings.correction.tolerance));
    add("--most-nodes", settings.correction.most_nodes.to_string());
    add("--correction", format!("{:?}", settings.correction.scheme));
    add("--radius", format!("{:?}", settings.radius));
    add("--errors", name(settings.errors.as_deref()));
    add(
        "--paths",
        name(settings.paths.as_ref().map(|paths| &*paths.folder)),
    );
    let format = settings.paths.as_ref().map(|paths| paths.format.clone());
    add("--paths-format", format.unwrap_or_else(none));
    Ok(identity)
}

fn none() -> String {
    "none".to_owned()
}

fn name(file: Option<&Path>) -> String {
    file.map_or_else(none, |file| file.display().to_string())
}

/// Length and hash of a file.
fn contents(file: &Path) -> Result<String, Failure> {
    let bytes = std::fs::read(file).map_err(|source| ReadError::Io {
        file: file.to_path_buf(),
        source,
    })?;
    let mut hasher = DefaultHasher::new();
    hasher.write(&bytes);
    Ok(format!(
        "{} bytes, hash {:016x}",
        bytes.len(),
        hasher.finish()
    ))
}
