//! Mesa's llvmpipe as an engine: the rasterizer that renders OpenGL where there is no GPU.
//!
//! `build` is the upload of positions and indices; `trace` is clearing, one indexed draw for each film and waiting for the end. The variant
//! `readback` counts copying ids and distances out of the frame buffer as well.

mod gl_api;
pub(crate) mod gl_context;
mod gl_raster;

use std::rc::Rc;

use umbel::engine::{Film, GridFilm};
use umbel::glam::{DMat3, DVec3};

use crate::Result;
use crate::engines::engine::{Engine, Times, Variant, timed};
use crate::engines::llvmpipe::gl_context::Context;
use crate::engines::llvmpipe::gl_raster::{Projection, Raster, View};
use crate::subjects::Model;
use crate::subjects::answer::Hits;
use crate::subjects::picture::Picture;

/// The near plane in parts of the farthest corner of the scene's box, where the eye is in the box.
const NEAR: f64 = 1.0 / 16384.0;

/// All variants: the second reads back in its time.
pub(crate) const NAMES: [&str; 2] = ["llvmpipe", "llvmpipe-readback"];

/// llvmpipe, with or without reading back in its time.
#[derive(Debug)]
pub(crate) struct Llvmpipe {
    name: &'static str,
    raster: Raster,
    reads_back: bool,
}

/// Prepares the variants that are wanted.
pub(crate) fn variants(
    context: &Rc<Context>,
    picture: &Picture,
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<Box<dyn Engine<Picture>>>> {
    let view = |film: &Film| match film {
        Film::Grid(film) => {
            Ok(View { projection: projection(picture, film)?, size: [film.width(), film.height()] })
        }
        Film::Scattered(_) => Err("only films with straight rows are rasterized".into()),
    };
    let views: Vec<View> = picture.pencil.films().iter().map(view).collect::<Result<_>>()?;
    let (vertices, triangles) = (picture.model.positions.len(), picture.model.triangles.len());
    let mut engines: Vec<Box<dyn Engine<Picture>>> = Vec::new();
    for (name, reads_back) in NAMES.into_iter().zip([false, true]) {
        if wanted(name) {
            let raster = Raster::new(context, &views, vertices, triangles)?;
            engines.push(Box::new(Llvmpipe { name, raster, reads_back }));
        }
    }
    Ok(engines)
}

impl Variant for Llvmpipe {
    fn name(&self) -> &str {
        self.name
    }
}

impl Engine<Picture> for Llvmpipe {
    fn run(&mut self, picture: &Picture, answer: &mut Hits) -> Result<Times> {
        let (build, uploaded) =
            timed(|| self.raster.upload(&picture.model.positions, &picture.model.triangles));
        uploaded?;
        let (draw, drawn) = timed(|| self.raster.draw());
        drawn?;
        let (read, copied) = timed(|| self.raster.read(answer));
        copied?;
        Ok(Times { build, trace: if self.reads_back { draw + read } else { draw } })
    }
}

/// The camera of the film. The near plane lies half way to the scene's box, or close to an eye within it.
fn projection(picture: &Picture, film: &GridFilm) -> Result<Projection> {
    let [forward, right, up] = film.span();
    let rays = DMat3::from_cols(forward, right, up);
    if rays.determinant() == 0.0 {
        return Err("the camera's film is flat".into());
    }
    // v = M (w, wX, wY): the rows of the inverse give w, wX and wY.
    let inverse = rays.inverse().transpose();
    let eye = DVec3::from_array(picture.rays.origin.map(f64::from));
    let (nearest, farthest) = extent(&picture.model, eye, inverse.x_axis);
    let near = (nearest / 2.0).max(farthest * NEAR);
    let row = |row: DVec3| row.as_vec3().to_array();
    Ok(Projection {
        eye: picture.rays.origin,
        to_x: row(inverse.y_axis / f64::from(film.width())),
        to_y: row(-inverse.z_axis / f64::from(film.height())),
        to_w: row(inverse.x_axis),
        near: if near > 0.0 { near as f32 } else { 1.0 },
    })
}

/// The least and the greatest w of the corners of the scene's box.
fn extent(model: &Model, eye: DVec3, to_w: DVec3) -> (f64, f64) {
    let corners = model.triangles.iter().flatten().map(|&v| model.positions[v as usize]);
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = corners.fold(empty, |(low, high), corner| {
        let corner = DVec3::from_array(corner.map(f64::from));
        (low.min(corner), high.max(corner))
    });
    let corner = |k: u32| {
        let pick = |axis: usize| if k >> axis & 1 == 0 { low[axis] } else { high[axis] };
        (DVec3::new(pick(0), pick(1), pick(2)) - eye).dot(to_w)
    };
    let depths = (0..8).map(corner);
    depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), w| (least.min(w), most.max(w)))
}
