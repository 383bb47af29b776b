//! From a name to a scene, its camera and its light: scenes.json, files and built-in scenes.

use std::path::{Path, PathBuf};

use serde_json::Value;
use umbel::builtin::builtin_view;
use umbel::glam::DVec3;
use umbel::{Camera, Lens, LoadOptions, Scene, load};

use crate::Result;

/// The vertical angle where nothing else is said, in degrees.
const DEFAULT_FOV: f64 = 45.0;

/// A scene, how it is looked at and how it is lit.
#[derive(Debug, Clone)]
pub(crate) struct View {
    pub(crate) name: String,
    pub(crate) scene: Scene,
    /// Eye, target and up.
    axes: Option<[DVec3; 3]>,
    /// Vertical, in degrees.
    fov: f64,
    /// A point light.
    light: Option<DVec3>,
}

/// The scenes that a folder describes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Folder {
    path: PathBuf,
    entries: serde_json::Map<String, Value>,
}

impl Folder {
    /// Reads scenes.json of a folder.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let file = path.join("scenes.json");
        let text = std::fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
        let entries = serde_json::from_str(&text).map_err(|error| format!("{}: {error}", file.display()))?;
        Ok(Self { path: path.to_owned(), entries })
    }

    /// The names of all scenes.
    pub(crate) fn names(&self) -> Vec<String> {
        self.entries.keys().cloned().collect()
    }
}

impl View {
    /// Finds a name of the folder, a file, or a built-in scene.
    pub(crate) fn find(name: &str, folder: Option<&Folder>) -> Result<Self> {
        let entry = |name: &str| folder.and_then(|folder| Some((folder, folder.entries.get(name)?)));
        if let Some((folder, entry)) = entry(name) {
            let file = entry["file"].as_str().ok_or_else(|| format!("{name}: scenes.json gives no file"))?;
            let scene = load(folder.path.join(file), LoadOptions::default())?;
            return Ok(Self::with_camera_of(name, scene, entry));
        }
        let scene = load(name, LoadOptions::default())?;
        if let Some(view) = name.strip_prefix("builtin:").and_then(builtin_view) {
            let axes = Some([view.eye, view.target, view.up].map(DVec3::from_array));
            return Ok(Self { name: name.to_owned(), scene, axes, fov: view.fov_degrees, light: None });
        }
        let stem = Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let stem = stem.unwrap_or_else(|| name.to_owned());
        let entry = entry(&stem).map_or(&Value::Null, |(_, entry)| entry);
        Ok(Self::with_camera_of(&stem, scene, entry))
    }

    /// A scene with the camera of an entry, as far as the entry has one.
    fn with_camera_of(name: &str, scene: Scene, entry: &Value) -> Self {
        let vector = |key: &str| {
            let numbers: Option<Vec<f64>> = entry[key].as_array()?.iter().map(Value::as_f64).collect();
            <[f64; 3]>::try_from(numbers?).ok().map(DVec3::from_array)
        };
        let axes = vector("eye").zip(vector("target"));
        let axes = axes.map(|(eye, target)| [eye, target, vector("up").unwrap_or(DVec3::Y)]);
        let fov = entry["fov"].as_f64().unwrap_or(DEFAULT_FOV);
        Self { name: name.to_owned(), scene, axes, fov, light: vector("light") }
    }

    /// The given light, or that of scenes.json moved to the nearest f32 point.
    pub(crate) fn light(&self, given: Option<[f32; 3]>) -> Result<[f32; 3]> {
        let known = self.light.map(|light| light.as_vec3().to_array());
        let missing = || format!("{}: there is no light in scenes.json; give --light X,Y,Z", self.name);
        Ok(given.or(known).ok_or_else(missing)?)
    }

    /// The camera of a picture: the given one, or umbel's default framing.
    pub(crate) fn camera(&self, (width, height): (u32, u32)) -> Camera {
        let lens = Lens::Pinhole { fov: self.fov };
        let from = DVec3::new(1.0, 0.7, 1.0);
        let framing = Camera::framing(&self.scene.bounds(), from, lens, width, height);
        match self.axes {
            Some([eye, target, up]) => Camera { eye, target, up, ..framing },
            None => framing,
        }
    }
}
