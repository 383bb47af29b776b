//! Views in a JSON file: a list, or a table by name, of what the camera options say on the command line.
//!
//! ```json
//! [{"eye": [0, 2, 5], "target": [0, 1, 0], "fov": 60, "size": [640, 480]},
//!  {"eye": [0, 2, 0], "camera": "cube", "cube_size": 256}]
//! ```
//!
//! What is left out has the value that it has on the command line, but an eye is needed, and a target unless the camera
//! is a cube. Names that are not known, and
//! names given twice, are refused.

use std::fmt;
use std::path::Path;

use glam::DVec3;
use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::value::RawValue;
use umbel::{Camera, Error, Scene};

use crate::options::camera::{CameraArgs, LensArg, ViewArgs};
use crate::refusal::message;

/// One view of the file, under the names of the command line.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct View {
    eye: [f64; 3],
    target: Option<[f64; 3]>,
    up: Option<[f64; 3]>,
    fov: Option<f64>,
    height: Option<f64>,
    size: Option<[u32; 2]>,
    cube_size: Option<u32>,
    camera: Option<LensArg>,
}

/// The views of a file as text, and what a message calls each. Names that are given twice stay two.
struct Entries(Vec<(String, Box<RawValue>)>);

impl<'de> Deserialize<'de> for Entries {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(EntriesVisitor)
    }
}

/// Takes a list or a table.
struct EntriesVisitor;

impl<'de> Visitor<'de> for EntriesVisitor {
    type Value = Entries;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a list or a table of views")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Entries, A::Error> {
        let mut entries = Vec::new();
        while let Some(view) = list.next_element()? {
            entries.push((format!("view {}, counted from 0", entries.len()), view));
        }
        Ok(Entries(entries))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut table: A) -> Result<Entries, A::Error> {
        let mut entries = Vec::new();
        while let Some((name, view)) = table.next_entry::<String, _>()? {
            entries.push((format!("view {name:?}"), view));
        }
        Ok(Entries(entries))
    }
}

/// The views of a file.
pub(crate) struct Views<'a> {
    path: &'a Path,
    /// What a message calls each.
    names: Vec<String>,
    pub(crate) cameras: Vec<Camera>,
}

impl<'a> Views<'a> {
    /// Reads a file.
    pub(crate) fn read(path: &'a Path, scene: &Scene) -> Result<Self, Error> {
        let mut views = Self { path, names: Vec::new(), cameras: Vec::new() };
        let bytes = std::fs::read(path).map_err(|error| Error::Input {
            path: path.to_owned(),
            line: None,
            problem: error.to_string(),
            remedy: "check the name and the permissions".into(),
        })?;
        let Entries(entries) = serde_json::from_slice(&bytes).map_err(|error| {
            let line = u64::try_from(error.line()).ok().filter(|&line| line > 0);
            views.refused(line, error.to_string())
        })?;
        if entries.is_empty() {
            return Err(views.refused(None, "there is no view in it".into()));
        }
        for (name, text) in entries {
            if views.names.contains(&name) {
                return Err(views.refused(None, format!("{name}: two views have this name")));
            }
            let view: Result<View, _> = serde_json::from_str(text.get());
            let view = view.map_err(|error| format!("{error} of {}", text.get()));
            let camera = view.and_then(|view| view.camera(scene));
            let camera = camera.map_err(|problem| views.refused(None, format!("{name}: {problem}")))?;
            views.cameras.push(camera);
            views.names.push(name);
        }
        Ok(views)
    }

    /// An error about the rays of view number `view`, as one about the file.
    pub(crate) fn explain(&self, view: usize, error: Error) -> Error {
        let about_the_view = match &error {
            Error::Usage(_) | Error::Argument(_) => true,
            Error::Engine(error) => error.is_about_rays(),
            _ => false,
        };
        match self.names.get(view) {
            Some(name) if about_the_view => {
                self.refused(None, format!("{name}: {}", in_words_of_the_file(&error)))
            }
            _ => error,
        }
    }

    /// Refuses the file.
    fn refused(&self, line: Option<u64>, problem: String) -> Error {
        let remedy = "views are a list such as [{\"eye\": [0,2,5], \"target\": [0,1,0], \"fov\": 60, \"size\": [640,480]}]";
        Error::Input { path: self.path.to_owned(), line, problem, remedy: remedy.into() }
    }
}

impl View {
    /// The camera, made as that of the command line is.
    fn camera(self, scene: &Scene) -> Result<Camera, String> {
        let lens = self.camera.unwrap_or(LensArg::Pinhole);
        if self.target.is_none() && lens != LensArg::Cube {
            return Err("missing field `target`".into());
        }
        if let Some(size) = self.size.filter(|size| size.iter().any(|side| !(1..=65536).contains(side))) {
            return Err(format!("size is {size:?}; each side has 1 to 65536 pixels"));
        }
        if let Some(side) = self.cube_size.filter(|side| !(1..=32768).contains(side)) {
            return Err(format!("cube_size is {side}; it has 1 to 32768 pixels"));
        }
        let args = CameraArgs {
            eye: Some(DVec3::from_array(self.eye)),
            named_view: None,
            azimuth: None,
            elevation: None,
            height: self.height,
            lens,
            view: ViewArgs {
                target: self.target.map(DVec3::from_array),
                up: self.up.map(DVec3::from_array),
                fov: self.fov,
                size: self.size.map(|[width, height]| (width, height)),
                cube_size: self.cube_size,
            },
        };
        args.camera(scene).map_err(|error| in_words_of_the_file(&error))
    }
}

/// A message of the command line without the dashes of its options.
fn in_words_of_the_file(error: &Error) -> String {
    message(error).replace("--cube-size", "cube_size").replace("--", "")
}
