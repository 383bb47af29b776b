//! Openness back into the glTF file that the scene was read from: as a texture, or at the vertices.

use std::ffi::OsStr;
use std::path::Path;

use umbel::formats::{GltfFile, GltfOptions, VertexTarget};
use umbel::{Error, LoadOptions, Scene};

use crate::bake::into::{FORMATS, IntoArg};
use crate::common::Common;
use crate::options::parse::extension;
use crate::report::{Times, timed};
use crate::run::{print_warnings, say};

/// The file of the scene, that becomes an output.
pub(crate) struct Patched(GltfFile);

impl Patched {
    /// Reads the scene with its file, if the output is such a file. Nothing else is read then.
    pub(crate) fn load(
        scene: &OsStr,
        output: Option<&Path>,
        common: &Common,
        times: &mut Times,
    ) -> Result<Option<(Self, Scene)>, Error> {
        let Some(output) = output.filter(|path| FORMATS.contains(&extension(path).as_str())) else {
            return Ok(None);
        };
        let scene = Path::new(scene);
        if !FORMATS.contains(&extension(scene).as_str()) {
            return Err(Error::Usage(format!(
                "{}: openness goes back into the file of the scene, and {} is no glTF; take .png or .ply",
                output.display(),
                scene.display()
            )));
        }
        let LoadOptions { drop_non_finite, allow_outside, max_memory } = common.load_options();
        let options = GltfOptions { drop_non_finite, uv_set: 0, allow_outside, max_memory };
        let (file, scene) = timed(&mut times.load, || GltfFile::read(scene, &options))?;
        file.check_output(output)?;
        print_warnings(&scene, common);
        Ok(Some((Self(file), scene)))
    }

    /// Writes the file with an occlusion texture.
    pub(crate) fn write_texture(mut self, path: &Path, png: &[u8], common: &Common) -> Result<(), Error> {
        say(&self.0.add_occlusion_texture(png)?, common);
        self.0.write(path)
    }

    /// Writes the file with openness at its vertices.
    pub(crate) fn write_vertices(
        mut self,
        path: &Path,
        openness: &[f32],
        (into, common): (IntoArg, &Common),
    ) -> Result<(), Error> {
        let target = match into {
            IntoArg::Ao => VertexTarget::Ao,
            IntoArg::Color0 => VertexTarget::Color0,
        };
        say(&self.0.add_vertex_occlusion(openness, target)?, common);
        self.0.write(path)
    }
}
