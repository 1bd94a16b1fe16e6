use super::*;

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn put(draft: Draft, text: &str, target: &Path) {
    draft.file().write_all(text.as_bytes()).unwrap();
    draft.put(target).unwrap();
}

#[test]
fn both_kinds_of_drafts_replace_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let target = folder.join("file");
    for (is_named, text) in [(false, "one"), (false, "two"), (true, "three")] {
        let new = if is_named { Draft::named } else { Draft::new };
        put(new(folder).unwrap(), text, &target);
        assert_eq!(fs::read_to_string(&target).unwrap(), text);
        assert_eq!(names(folder), ["file"]);
    }
    drop(Draft::named(folder).unwrap());
    drop(Draft::new(folder).unwrap());
    assert_eq!(names(folder), ["file"]);
}

#[cfg(target_os = "linux")]
#[test]
fn what_gets_no_name_is_copied() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let draft = Draft::new(folder).unwrap();
    draft.file().write_all(b"text").unwrap();
    let Draft::Unnamed(file) = draft else {
        println!("skipped: the file system knows no files without a name");
        return;
    };
    let target = folder.join("file");
    Draft::copied(file, folder).unwrap().put(&target).unwrap();
    assert_eq!(fs::read_to_string(&target).unwrap(), "text");
    assert_eq!(names(folder), ["file"]);
}

#[test]
fn what_nobody_may_write_stays() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("file");
    fs::write(&target, "kept").unwrap();
    let mut rights = fs::metadata(&target).unwrap().permissions();
    rights.set_readonly(true);
    fs::set_permissions(&target, rights).unwrap();
    assert!(check_place(&target).is_err());
    assert!(write_whole(&target, |out| out.write_all(b"lost")).is_err());
    assert_eq!(fs::read_to_string(&target).unwrap(), "kept");
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
