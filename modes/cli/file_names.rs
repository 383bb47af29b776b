//! Names of files on the command line: no output may destroy another output, or a file that is read.
//!
//! Two names are the same file when they lead to the same place once links, `.` and `..` are resolved, however they are
//! spelled. Devices and pipes hold nothing that could be lost: any number of outputs may go there.

use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use umbel::Error;

/// What a name of a scene begins with that is no file.
const BUILTIN: &str = "builtin:";

/// The files that a run reads and writes, as far as the command line names them.
#[derive(Debug, Default)]
pub(crate) struct FileNames {
    pub(crate) inputs: Vec<PathBuf>,
    pub(crate) outputs: Vec<PathBuf>,
}

impl FileNames {
    /// Those of a run that reads some scenes.
    pub(crate) fn of_scenes<'a>(scenes: impl IntoIterator<Item = &'a OsString>) -> Self {
        let is_file =
            |name: &&OsString| !name.to_str().is_some_and(|name| name == "-" || name.starts_with(BUILTIN));
        let files = scenes.into_iter().filter(is_file);
        Self { inputs: files.map(PathBuf::from).collect(), outputs: Vec::new() }
    }

    /// Adds files that are read.
    pub(crate) fn reading<'a>(mut self, files: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        self.inputs.extend(files.into_iter().cloned());
        self
    }

    /// Adds files that are written.
    pub(crate) fn writing<'a>(mut self, files: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        self.outputs.extend(files.into_iter().cloned());
        self
    }

    /// Refuses two outputs in one place, and an output in the place of an input.
    pub(crate) fn refuse_collisions(&self) -> Result<(), Error> {
        let mut written: HashMap<PathBuf, &Path> = HashMap::new();
        for output in &self.outputs {
            let Some(place) = place(output) else { continue };
            if let Some(other) = written.insert(place, output) {
                let (is_spelled_alike, one, other) = (output == other, output.display(), other.display());
                return Err(Error::Usage(if is_spelled_alike {
                    format!("{one}: two outputs have this name; give each a name of its own")
                } else {
                    format!("{other} and {one} are the same file; give each output a name of its own")
                }));
            }
        }
        for input in &self.inputs {
            let output = place(input).and_then(|place| written.get(&place).copied());
            if let Some(output) = output {
                let (input, output) = (input.display(), output.display());
                return Err(Error::Usage(format!(
                    "{output}: this would be written over {input}, which is read; choose another name for the output"
                )));
            }
        }
        Ok(())
    }
}

/// Where a name leads to; `None` for what is no file and cannot be replaced.
fn place(path: &Path) -> Option<PathBuf> {
    if let Ok(found) = path.metadata() {
        return if found.is_file() { path.canonicalize().ok() } else { None };
    }
    // There is no such file yet: its directory says where it will be. What cannot be resolved is refused when it is opened.
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Some(directory.canonicalize().ok()?.join(path.file_name()?))
}
