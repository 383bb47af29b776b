//! Output files: written beside their name and renamed, so that a name holds the old file or the whole new one.
//!
//! A failure on the way, a full disk say, leaves the old file as it was and no temporary file. A name that is a link
//! keeps it: what it points to is replaced. Devices and pipes (`/dev/null`, `/dev/stdout`) cannot be replaced by a
//! rename; they get the bytes themselves, all at the end. So does the standard output, whose name is `-`. The file is synced before the rename, the directory is not:
//! after a power cut the old file may be back, but never half a file.
//!
//! Who ends the process on a signal holds a [`WritingPause`] meanwhile: then there is no temporary file that would stay.

use std::fs::{self, File, Permissions};
use std::io::{self, BufWriter, Cursor, ErrorKind, Seek, Write};
use std::path::Path;
use std::sync::{PoisonError, RwLock, RwLockWriteGuard};

use tempfile::{Builder, NamedTempFile};

use crate::error::Error;

/// Bytes that are gathered before the system is asked to write them.
const BUFFER_BYTES: usize = 1 << 18;

/// What stands for the standard output.
const STDOUT: &str = "-";

/// Read by those who have a temporary file, written by who wants that there is none: as files belong to the process, so does
/// this.
static TEMPORARY_FILES: RwLock<()> = RwLock::new(());

/// No file is being written, and none is begun, while this lives.
#[derive(Debug)]
pub struct WritingPause(
    #[expect(dead_code, reason = "it is dropped, and nothing else")] RwLockWriteGuard<'static, ()>,
);

/// Waits until the files that are being written are whole, and keeps others from being begun.
#[must_use]
pub fn pause_writing() -> WritingPause {
    // Nothing is behind the lock that could be left in disorder.
    WritingPause(TEMPORARY_FILES.write().unwrap_or_else(PoisonError::into_inner))
}

/// Where the bytes of an output go. Every writer that can seek is one.
pub trait WriteSeek: Write + Seek {}

impl<T: Write + Seek + ?Sized> WriteSeek for T {}

/// What stands under the name of an output before it is written.
enum Place {
    /// Nothing.
    Free,
    /// A file, with the permissions its successor gets.
    File(Permissions),
    /// A device, a pipe: something that cannot be replaced.
    Stream,
}

/// Writes a file as a whole or not at all.
///
/// `write` gets a buffered writer at position 0. When it fails, or anything after it does, nothing has changed under
/// `path`. A new file has the permissions of any file the user makes, a replaced one keeps those it had.
///
/// # Errors
///
/// [`Error::Write`] says what stood in the way and what to do about it.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn WriteSeek) -> io::Result<()>,
) -> Result<(), Error> {
    let outcome = match place(path) {
        Ok(Place::Free) => replace(path, None, write),
        Ok(Place::File(permissions)) => replace(path, Some(permissions), write),
        Ok(Place::Stream) => stream(path, write),
        Err(error) => Err(error),
    };
    outcome.map_err(|error| refused(path, explain(path, &error)))
}

/// Finds out before long work whether a file can be written: whether a temporary file can be made beside `path`, and an old file
/// under that name be replaced. Nothing is changed.
///
/// # Errors
///
/// As [`write_atomically`].
pub fn check_output(path: &Path) -> Result<(), Error> {
    let replace_nothing = || match place(path)? {
        Place::Stream => Ok(()),
        Place::Free | Place::File(_) => {
            let _lock = TEMPORARY_FILES.read().unwrap_or_else(PoisonError::into_inner);
            create_beside(path, None).map(drop)
        }
    };
    replace_nothing().map_err(|error: io::Error| refused(path, explain(path, &error)))
}

/// The error of an output that cannot be written, in the caller's words.
pub(crate) fn refused(path: &Path, problem: impl Into<String>) -> Error {
    Error::Write { path: path.to_owned(), problem: problem.into() }
}

/// Finds out what `path` is, following links.
fn place(path: &Path) -> io::Result<Place> {
    if path == Path::new(STDOUT) {
        return Ok(Place::Stream);
    }
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => Err(ErrorKind::IsADirectory.into()),
        Ok(found) if found.is_file() => {
            // A rename would replace a file that its owner has protected. Opening it asks the system.
            File::options().write(true).open(path)?;
            Ok(Place::File(found.permissions()))
        }
        Ok(_) => Ok(Place::Stream),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let names_a_file = path.file_name().is_some() && !ends_with_separator(path);
            if names_a_file { Ok(Place::Free) } else { Err(ErrorKind::InvalidFilename.into()) }
        }
        Err(error) => Err(error),
    }
}

/// Whether the path is spelled as a directory. `Path` itself ignores that.
fn ends_with_separator(path: &Path) -> bool {
    let last = path.as_os_str().as_encoded_bytes().last();
    last.is_some_and(|&byte| std::path::is_separator(char::from(byte)))
}

/// Writes a temporary file beside `path` and renames it. It is removed when it goes out of scope before that.
fn replace(
    path: &Path,
    permissions: Option<Permissions>,
    write: impl FnOnce(&mut dyn WriteSeek) -> io::Result<()>,
) -> io::Result<()> {
    let target =
        if path.is_symlink() && permissions.is_some() { fs::canonicalize(path)? } else { path.to_owned() };
    let _lock = TEMPORARY_FILES.read().unwrap_or_else(PoisonError::into_inner);
    let mut temporary = create_beside(&target, permissions)?;
    let mut buffered = BufWriter::with_capacity(BUFFER_BYTES, temporary.as_file_mut());
    write(&mut buffered)?;
    buffered.flush()?;
    drop(buffered);
    temporary.as_file().sync_all()?;
    temporary.persist(&target)?;
    Ok(())
}

/// Creates an empty temporary file in the directory of `target`.
fn create_beside(target: &Path, permissions: Option<Permissions>) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".umbel-").suffix(".tmp");
    let Some(permissions) = permissions else {
        // An ordinary creation: the system applies the user's mask.
        return builder
            .make_in(directory(target), |name| File::options().write(true).create_new(true).open(name));
    };
    // Private from the start: nobody can open the file who could not open the old one.
    let temporary = builder.tempfile_in(directory(target))?;
    temporary.as_file().set_permissions(permissions)?;
    Ok(temporary)
}

/// The directory that a file is or will be in.
fn directory(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Hands the bytes to something that cannot be replaced and often cannot seek.
fn stream(path: &Path, write: impl FnOnce(&mut dyn WriteSeek) -> io::Result<()>) -> io::Result<()> {
    let mut bytes = Cursor::new(Vec::new());
    write(&mut bytes)?;
    if path == Path::new(STDOUT) {
        let mut open = io::stdout().lock();
        open.write_all(bytes.get_ref())?;
        return open.flush();
    }
    let mut open = File::options().write(true).open(path)?;
    open.write_all(bytes.get_ref())?;
    open.flush()
}

/// Says what is wrong and what to do. Other errors, such as an encoder's, speak for themselves.
fn explain(path: &Path, error: &io::Error) -> String {
    let directory = directory(path);
    let named = directory.display();
    match error.kind() {
        ErrorKind::NotFound if !directory.exists() => {
            format!("there is no directory {named}; create it or choose another place")
        }
        ErrorKind::NotADirectory => {
            format!("{named} is not a directory; choose another place")
        }
        ErrorKind::IsADirectory => "this is a directory; add the name of a file".into(),
        ErrorKind::InvalidFilename => {
            "this cannot be the name of a file here; choose another name".into()
        }
        ErrorKind::PermissionDenied if path.exists() && !path.is_dir() => {
            format!(
                "permission denied; choose another name, or allow writing this file and in {named}"
            )
        }
        ErrorKind::PermissionDenied => {
            format!("permission denied; choose another place, or allow writing in {named}")
        }
        ErrorKind::ReadOnlyFilesystem => {
            format!("{named} is on a read-only file system; choose another place")
        }
        ErrorKind::StorageFull => {
            "no space is left there; free some, or choose another place".into()
        }
        ErrorKind::QuotaExceeded => {
            "your disk quota is used up; free some space, or choose another place".into()
        }
        ErrorKind::FileTooLarge => {
            "the file system or a limit does not allow a file of this size; choose another place or a smaller size"
                .into()
        }
        ErrorKind::BrokenPipe => "the program that reads it has ended".into(),
        _ => error.to_string(),
    }
}
