//! What stands for [`crate::bake::gltf`] in a build without glTF: no file takes openness back.

use std::ffi::OsStr;
use std::path::Path;

use umbel::{Error, Scene};

use crate::bake::into::IntoArg;
use crate::common::Common;
use crate::report::Times;

/// There is no such file.
pub(crate) enum Patched {}

impl Patched {
    pub(crate) fn load(
        _: &OsStr,
        _: Option<&Path>,
        _: &Common,
        _: &mut Times,
    ) -> Result<Option<(Self, Scene)>, Error> {
        Ok(None)
    }

    pub(crate) fn write_texture(self, _: &Path, _: &[u8], _: &Common) -> Result<(), Error> {
        match self {}
    }

    pub(crate) fn write_vertices(self, _: &Path, _: &[f32], _: (IntoArg, &Common)) -> Result<(), Error> {
        match self {}
    }
}
