//! The files that a scene's file names: found beside it, each read once.
//!
//! Names come from a file that may be anybody's, and what they name may be copied into an output. So a name counts only
//! where it leads into the folder of the scene's file, links resolved, unless the caller allows others. Who reads a scene
//! from memory answers names himself.
//!
//! Based on: MITRE, "CWE-22: Improper Limitation of a Pathname to a Restricted Directory", 2006.

use std::collections::HashMap;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use crate::error::Problem;
use crate::files::budget::Budget;

/// Gives the bytes behind a name in a scene's file, such as `mesh.bin` or `textures/a.mtl`: relative to the file, decoded,
/// with `/` between folders. It is asked once for each name.
pub type Resolver<'a> = dyn FnMut(&str) -> io::Result<Vec<u8>> + 'a;

/// Why there are no bytes behind a name.
#[derive(Debug)]
pub(crate) enum Missing {
    /// It leads out of the folder.
    Outside,
    /// It cannot be read, with what the system says.
    Unreadable(String),
    /// It is too large.
    TooLarge(Problem),
}

/// The files beside a scene's file.
pub(crate) struct Neighbours<'a> {
    place: Place<'a>,
    budget: &'a Budget,
    /// What was read, by resolved path or given name.
    read: HashMap<PathBuf, Arc<Vec<u8>>>,
}

enum Place<'a> {
    Folder { path: PathBuf, allow_outside: bool },
    Given(&'a mut Resolver<'a>),
}

impl<'a> Neighbours<'a> {
    /// Those in the folder of a file.
    pub(crate) fn of(file: &Path, allow_outside: bool, budget: &'a Budget) -> Self {
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
        let path = folder.unwrap_or(Path::new(".")).to_owned();
        Self { place: Place::Folder { path, allow_outside }, budget, read: HashMap::new() }
    }

    /// Those that the caller gives.
    pub(crate) fn given(resolver: &'a mut Resolver<'a>, budget: &'a Budget) -> Self {
        Self { place: Place::Given(resolver), budget, read: HashMap::new() }
    }

    /// The bytes behind a name, and what tells files apart however they are named.
    pub(crate) fn fetch(&mut self, name: &str) -> Result<(PathBuf, Arc<Vec<u8>>), Missing> {
        let key = match &self.place {
            Place::Folder { path, allow_outside } => resolve(path, name, *allow_outside)?,
            Place::Given(_) => PathBuf::from(name),
        };
        if let Some(known) = self.read.get(&key) {
            return Ok((key, known.clone()));
        }
        let what = format!("the bytes of {name}");
        let bytes = match &mut self.place {
            Place::Folder { .. } => read_file(&key, self.budget, &what)?,
            Place::Given(resolver) => {
                let bytes = resolver(name).map_err(|error| Missing::Unreadable(error.to_string()))?;
                self.budget.take(bytes.len() as u64, &what).map_err(Missing::TooLarge)?;
                bytes
            }
        };
        let bytes = Arc::new(bytes);
        self.read.insert(key.clone(), bytes.clone());
        Ok((key, bytes))
    }

    /// How a name is shown to the user.
    pub(crate) fn shown(&self, name: &str) -> String {
        match &self.place {
            Place::Folder { path, .. } if path != Path::new(".") => path.join(name).display().to_string(),
            _ => name.to_owned(),
        }
    }
}

/// The bytes of a regular file, counted before they are read. Devices and pipes may never end.
pub(crate) fn read_file(path: &Path, budget: &Budget, what: &str) -> Result<Vec<u8>, Missing> {
    let unreadable = |error: io::Error| Missing::Unreadable(error.to_string());
    let metadata = fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(Missing::Unreadable("not a file".to_owned()));
    }
    budget.take(metadata.len(), what).map_err(Missing::TooLarge)?;
    fs::read(path).map_err(unreadable)
}

/// The file that a name leads to. One that leads out of the folder is refused whether it is there or not, so that nobody
/// learns from the answer what is there.
fn resolve(folder: &Path, name: &str, allow_outside: bool) -> Result<PathBuf, Missing> {
    let path = folder.join(name);
    if allow_outside {
        return fs::canonicalize(&path).map_err(|error| Missing::Unreadable(error.to_string()));
    }
    let root = fs::canonicalize(folder).map_err(|error| Missing::Unreadable(error.to_string()))?;
    let is_inside = if Path::new(name).has_root() { path.starts_with(&root) } else { stays_below(name) };
    if !is_inside {
        return Err(Missing::Outside);
    }
    let found = fs::canonicalize(&path).map_err(|error| Missing::Unreadable(error.to_string()))?;
    if found.starts_with(&root) { Ok(found) } else { Err(Missing::Outside) }
}

/// Whether no part of a relative name climbs above where it starts.
fn stays_below(name: &str) -> bool {
    let mut depth = 0_usize;
    Path::new(name).components().all(|part| match part {
        Component::ParentDir => depth.checked_sub(1).map(|less| depth = less).is_some(),
        Component::Normal(_) => {
            depth += 1;
            true
        }
        Component::CurDir => true,
        Component::RootDir | Component::Prefix(_) => false,
    })
}
