//! Lights on the command line.

use clap::Args;
use glam::DVec3;
use umbel::formats::surface_view;
use umbel::shadow::{point_light, sun_light};
use umbel::{Error, Origin, Pencil, Scene};

use crate::options::parse::parse_vector;

/// Where light comes from.
#[derive(Debug, Args)]
#[command(next_help_heading = "Lights")]
pub(crate) struct LightArgs {
    /// Position of a point light; may be given several times
    #[arg(long = "light", value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    pub(crate) points: Vec<DVec3>,

    /// Direction toward a sun, of any length; may be given several times
    #[arg(long = "sun", value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    pub(crate) suns: Vec<DVec3>,
}

impl LightArgs {
    /// Whether none is given.
    pub(crate) fn is_none(&self) -> bool {
        self.points.is_empty() && self.suns.is_empty()
    }

    /// The lights: points first, each kind in the order of the command line. They are given in the file's frame, from
    /// which `offset` was taken.
    pub(crate) fn lights(&self, offset: DVec3) -> Result<Vec<Origin>, Error> {
        let checked = |option: &str, given: &DVec3, light: Origin| {
            let DVec3 { x, y, z } = *given;
            let refused = |error| Error::Usage(format!("{option} {x},{y},{z}: {error}"));
            Pencil::new(light, Vec::new()).map(|_| light).map_err(refused)
        };
        let points = self.points.iter().map(|given| checked("--light", given, point_light(*given - offset)));
        let suns = self.suns.iter().map(|given| checked("--sun", given, sun_light(*given)));
        points.chain(suns).collect()
    }

    /// The lights for shadows: of one kind, and at least one, if need be that of a built-in scene.
    pub(crate) fn shadow_lights(&self, scene: &Scene) -> Result<Vec<Origin>, Error> {
        let lights = self.lights(scene.offset)?;
        if !lights.is_empty() {
            return Ok(lights);
        }
        let view = scene.name.strip_prefix("builtin:").and_then(surface_view);
        let view = view.ok_or_else(|| {
            Error::Usage("no light: give --light X,Y,Z, a position, or --sun X,Y,Z, a direction".into())
        })?;
        Ok(vec![point_light(DVec3::from_array(view.light))])
    }
}
