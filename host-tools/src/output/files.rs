//! Files that are whole or absent: written under a temporary name beside the target, then renamed.

use std::{
    fs,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use tempfile::NamedTempFile;

/// Why a file or directory could not be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot write: {source}", path.display())]
pub struct OutputError {
    /// The file or directory.
    pub path: PathBuf,
    /// What the system says.
    pub source: io::Error,
}

/// Writes a file through `write`; on any error the target is left as it was.
///
/// # Errors
/// When the directory does not exist, or writing fails.
pub fn write_file(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), OutputError> {
    let error = |source| OutputError {
        path: path.to_owned(),
        source,
    };
    let directory = check_target(path)?;
    let mut file = NamedTempFile::new_in(directory).map_err(error)?;
    let mut buffered = BufWriter::new(file.as_file_mut());
    write(&mut buffered)
        .and_then(|()| buffered.flush())
        .map_err(error)?;
    drop(buffered);
    make_readable(file.as_file()).map_err(error)?;
    file.persist(path).map_err(|persist| error(persist.error))?;
    Ok(())
}

/// Checks that a file of that name could be written: before long work, not after it. Gives its directory.
///
/// # Errors
/// When its directory does not exist, or the name is a directory's.
pub fn check_target(path: &Path) -> Result<&Path, OutputError> {
    let error = |kind: io::ErrorKind| OutputError {
        path: path.to_owned(),
        source: kind.into(),
    };
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if path.is_dir() {
        return Err(error(io::ErrorKind::IsADirectory));
    }
    if !directory.is_dir() {
        return Err(error(io::ErrorKind::NotFound));
    }
    Ok(directory)
}

/// Checks that a directory of that name exists or could be created.
///
/// # Errors
/// When something else has the name.
pub fn check_directory(path: &Path) -> Result<(), OutputError> {
    if path.exists() && !path.is_dir() {
        return Err(OutputError {
            path: path.to_owned(),
            source: io::ErrorKind::NotADirectory.into(),
        });
    }
    Ok(())
}

/// Creates a directory and its parents, if need be.
///
/// # Errors
/// When that fails, or something else has the name.
pub fn create_dir(path: &Path) -> Result<(), OutputError> {
    fs::create_dir_all(path).map_err(|source| OutputError {
        path: path.to_owned(),
        source,
    })
}

/// Temporary files are private; results are as readable as any new file would usually be.
#[cfg(unix)]
fn make_readable(file: &fs::File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn make_readable(_: &fs::File) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_what_was_there() {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("atlas");
        write_file(&path, |file| file.write_all(b"old")).expect("writable");
        let failed = write_file(&path, |file| {
            file.write_all(b"new")?;
            Err(io::Error::other("disk full"))
        });
        assert!(
            failed
                .expect_err("fails")
                .to_string()
                .ends_with("atlas: cannot write: disk full")
        );
        assert_eq!(fs::read(&path).expect("still there"), b"old");
        assert_eq!(
            fs::read_dir(directory.path()).expect("readable").count(),
            1,
            "no temporary file is left"
        );
    }

    #[test]
    fn a_missing_directory_is_named() {
        let error = write_file(Path::new("no/such/place/file"), |_| Ok(())).expect_err("fails");
        assert!(
            error
                .to_string()
                .starts_with("no/such/place/file: cannot write")
        );
    }
}
