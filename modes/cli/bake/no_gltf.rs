//! What stands for [`crate::bake::gltf`] in a build without glTF: no file takes openness back.

use std::path::Path;

use umbel::{Error, Scene};

use crate::bake::args::{BakeArgs, IntoArg};
use crate::common::Common;
use crate::report::Times;

/// The formats that can take openness: none.
pub(crate) const FORMATS: &[&str] = &[];

/// There is no such file.
pub(crate) enum Patched {}

impl Patched {
    pub(crate) fn load(_: &BakeArgs, _: &Common, _: &mut Times) -> Result<Option<(Self, Scene)>, Error> {
        Ok(None)
    }

    pub(crate) fn write_texture(self, _: &Path, _: &[u8], _: &Common) -> Result<(), Error> {
        match self {}
    }

    pub(crate) fn write_vertices(self, _: &Path, _: &[f32], _: (IntoArg, &Common)) -> Result<(), Error> {
        match self {}
    }
}
