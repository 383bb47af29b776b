//! A mesh drawn by OpenGL: for each picture one indexed draw into a target of ids and one of depths.
//!
//! A corner p becomes v = p − eye in f32, and v = w·(F + X·R + Y·U) gives w, which is the ray's t, and the film's wX and wY.
//! The depth is near/w in f32 with the far plane at infinity: a float has as many digits far away as near by, and t is
//! near/depth. OpenGL's row 0 is umbel's, because Y is negated.
//!
//! Based on: Marc Olano and Trey Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997; Eugene Lapidous
//! and Guofang Jiao, "Optimal Depth Buffer for Low-Cost Graphics Hardware", 1999 (reversed float depth).

use std::ffi::{CStr, c_int, c_uint};
use std::ptr;
use std::rc::Rc;

use crate::Result;
use crate::engines::llvmpipe::gl_api::*;
use crate::engines::llvmpipe::gl_context::Context;
use crate::subjects::answer::{Hits, MISS};

const VERTEX_SHADER: &CStr = c"#version 450 core
layout(location = 0) in vec3 position;
uniform vec3 eye, to_x, to_y, to_w;
uniform float near;
void main() {
    vec3 v = position - eye;
    gl_Position = vec4(dot(to_x, v), dot(to_y, v), near, dot(to_w, v));
}
";

const FRAGMENT_SHADER: &CStr = c"#version 450 core
layout(location = 0) out uint id;
void main() {
    id = uint(gl_PrimitiveID);
}
";

/// How corners become clip coordinates: rows of a matrix, applied to p − eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Projection {
    pub(crate) eye: [f32; 3],
    pub(crate) to_x: [f32; 3],
    pub(crate) to_y: [f32; 3],
    pub(crate) to_w: [f32; 3],
    /// The t of the near plane.
    pub(crate) near: f32,
}

/// One picture that is drawn: its camera and the pixels along its sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct View {
    pub(crate) projection: Projection,
    pub(crate) size: [u32; 2],
}

/// OpenGL's objects for one mesh and some pictures of it.
#[derive(Debug)]
pub(crate) struct Raster {
    context: Rc<Context>,
    program: c_uint,
    /// Of the eye, of the rows to x, y and w, and of the near plane.
    uniforms: [c_int; 5],
    vertex_array: c_uint,
    /// Of positions and of indices.
    buffers: [c_uint; 2],
    /// Three a triangle.
    corners: c_int,
    pictures: Vec<Picture>,
}

/// OpenGL's objects for one picture.
#[derive(Debug)]
struct Picture {
    projection: Projection,
    size: [c_int; 2],
    framebuffer: c_uint,
    /// Of ids and of depths.
    targets: [c_uint; 2],
}

impl Raster {
    /// Makes targets for each view, and buffers with room for the mesh.
    pub(crate) fn new(
        context: &Rc<Context>,
        views: &[View],
        vertices: usize,
        triangles: usize,
    ) -> Result<Self> {
        let gl = context.gl();
        let program = link(gl)?;
        let location = |name: &CStr| {
            // SAFETY: the name ends with a zero byte and lives through the call.
            unsafe { (gl.get_uniform_location)(program, name.as_ptr()) }
        };
        let mut raster = Self {
            program,
            uniforms: [c"eye", c"to_x", c"to_y", c"to_w", c"near"].map(location),
            vertex_array: made(gl.gen_vertex_arrays),
            buffers: [made(gl.gen_buffers), made(gl.gen_buffers)],
            corners: c_int::try_from(triangles * 3)?,
            pictures: Vec::new(),
            context: Rc::clone(context),
        };
        for view in views {
            let [width, height] = view.size;
            raster.pictures.push(Picture {
                projection: view.projection,
                size: [c_int::try_from(width)?, c_int::try_from(height)?],
                framebuffer: made(gl.gen_framebuffers),
                targets: [made(gl.gen_renderbuffers), made(gl.gen_renderbuffers)],
            });
        }
        raster.pictures.iter().try_for_each(|picture| picture.make_targets(gl))?;
        raster.make_buffers(vertices)?;
        // The nearest is kept, of equals the first; nothing is culled.
        gl.clip_control(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
        gl.enable(GL_DEPTH_TEST);
        gl.depth_func(GL_GREATER);
        context.check("preparing")?;
        Ok(raster)
    }

    /// Room for positions and indices, and how positions are read.
    fn make_buffers(&self, vertices: usize) -> Result<()> {
        let gl = self.context.gl();
        gl.bind_vertex_array(self.vertex_array);
        let bytes = [isize::try_from(vertices * 12)?, self.corners as isize * 4];
        for (k, target) in [GL_ARRAY_BUFFER, GL_ELEMENT_ARRAY_BUFFER].into_iter().enumerate() {
            gl.bind_buffer(target, self.buffers[k]);
            // SAFETY: null reserves memory only.
            unsafe { (gl.buffer_data)(target, bytes[k], ptr::null(), GL_STREAM_DRAW) };
        }
        gl.enable_vertex_attrib_array(0);
        // SAFETY: with a bound buffer null is the offset 0.
        unsafe { (gl.vertex_attrib_pointer)(0, 3, GL_FLOAT, 0, 12, ptr::null()) };
        Ok(())
    }

    /// Hands the mesh to OpenGL, in the memory of the last one. It must be as large as `new` was told.
    pub(crate) fn upload(&self, positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<()> {
        let gl = self.context.gl();
        gl.bind_vertex_array(self.vertex_array);
        gl.bind_buffer(GL_ARRAY_BUFFER, self.buffers[0]);
        let bytes = size_of_val(positions) as isize;
        // SAFETY: so many bytes are read from the slice; OpenGL refuses what its buffer has no room for.
        unsafe { (gl.buffer_sub_data)(GL_ARRAY_BUFFER, 0, bytes, positions.as_ptr().cast()) };
        let bytes = size_of_val(triangles) as isize;
        // SAFETY: as above.
        unsafe { (gl.buffer_sub_data)(GL_ELEMENT_ARRAY_BUFFER, 0, bytes, triangles.as_ptr().cast()) };
        self.context.check("uploading")
    }

    /// Clears the targets of all pictures, draws all triangles into each and waits for the end.
    pub(crate) fn draw(&self) -> Result<()> {
        let gl = self.context.gl();
        gl.use_program(self.program);
        gl.bind_vertex_array(self.vertex_array);
        self.pictures.iter().for_each(|picture| self.draw_one(picture));
        gl.finish();
        self.context.check("drawing")
    }

    /// Clears and draws one picture, with program and mesh bound.
    fn draw_one(&self, picture: &Picture) {
        let gl = self.context.gl();
        let Projection { eye, to_x, to_y, to_w, near } = picture.projection;
        let [vectors @ .., near_plane] = self.uniforms;
        for (uniform, [x, y, z]) in vectors.into_iter().zip([eye, to_x, to_y, to_w]) {
            gl.uniform_3f(uniform, x, y, z);
        }
        gl.uniform_1f(near_plane, near);
        gl.bind_framebuffer(GL_FRAMEBUFFER, picture.framebuffer);
        gl.viewport(0, 0, picture.size[0], picture.size[1]);
        // SAFETY: four values are there.
        unsafe { (gl.clear_uint)(GL_COLOR, 0, [MISS; 4].as_ptr()) };
        // SAFETY: one value is there. Depth 0 is infinitely far.
        unsafe { (gl.clear_float)(GL_DEPTH, 0, [0.0].as_ptr()) };
        // SAFETY: the indices begin at the offset 0 of the bound buffer and lie within the vertices: umbel has checked them.
        unsafe { (gl.draw_elements)(GL_TRIANGLES, self.corners, GL_UNSIGNED_INT, ptr::null()) };
    }

    /// Copies ids and distances of all pixels, picture by picture.
    pub(crate) fn read(&self, answer: &mut Hits) -> Result<()> {
        let pixels: usize = self.pictures.iter().map(Picture::pixels).sum();
        if [answer.ids.len(), answer.ts.len()] != [pixels; 2] {
            return Err("the answer has another size than the pictures".into());
        }
        let mut first = 0;
        for picture in &self.pictures {
            let part = first..first + picture.pixels();
            first = part.end;
            picture.read(self.context.gl(), &mut answer.ids[part.clone()], &mut answer.ts[part])?;
        }
        self.context.check("reading")
    }
}

impl Picture {
    /// The number of pixels.
    fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// Ids of 32 bits and depths of 32-bit floats.
    fn make_targets(&self, gl: &Gl) -> Result<()> {
        gl.bind_framebuffer(GL_FRAMEBUFFER, self.framebuffer);
        let [ids, depths] = self.targets;
        for (target, format, attachment) in
            [(ids, GL_R32UI, GL_COLOR_ATTACHMENT0), (depths, GL_DEPTH_COMPONENT32F, GL_DEPTH_ATTACHMENT)]
        {
            gl.bind_renderbuffer(GL_RENDERBUFFER, target);
            gl.renderbuffer_storage(GL_RENDERBUFFER, format, self.size[0], self.size[1]);
            gl.framebuffer_renderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, target);
        }
        match gl.check_framebuffer_status(GL_FRAMEBUFFER) {
            GL_FRAMEBUFFER_COMPLETE => Ok(()),
            status => Err(format!("OpenGL has no frame buffer of this size: {status:#06x}").into()),
        }
    }

    /// Copies ids and distances of all pixels.
    fn read(&self, gl: &Gl, ids: &mut [u32], ts: &mut [f32]) -> Result<()> {
        if [ids.len(), ts.len()] != [self.pixels(); 2] {
            return Err("the answer has another size than the picture".into());
        }
        gl.bind_framebuffer(GL_FRAMEBUFFER, self.framebuffer);
        let [width, height] = self.size;
        let (to_ids, to_depths) = (ids.as_mut_ptr().cast(), ts.as_mut_ptr().cast());
        // SAFETY: four bytes a pixel are written, and there is room for all pixels.
        unsafe { (gl.read_pixels)(0, 0, width, height, GL_RED_INTEGER, GL_UNSIGNED_INT, to_ids) };
        // SAFETY: as above.
        unsafe { (gl.read_pixels)(0, 0, width, height, GL_DEPTH_COMPONENT, GL_FLOAT, to_depths) };
        // Where nothing was drawn this is near/0: infinite.
        ts.iter_mut().for_each(|depth| *depth = self.projection.near / *depth);
        Ok(())
    }
}

impl Drop for Raster {
    fn drop(&mut self) {
        let gl = self.context.gl();
        gl.delete_program(self.program);
        let framebuffers: Vec<c_uint> = self.pictures.iter().map(|picture| picture.framebuffer).collect();
        let targets: Vec<c_uint> = self.pictures.iter().flat_map(|picture| picture.targets).collect();
        for (delete, names) in [
            (gl.delete_vertex_arrays, &[self.vertex_array][..]),
            (gl.delete_buffers, &self.buffers),
            (gl.delete_framebuffers, &framebuffers),
            (gl.delete_renderbuffers, &targets),
        ] {
            // SAFETY: so many names are there, made by OpenGL and given back once.
            unsafe { delete(names.len() as c_int, names.as_ptr()) };
        }
    }
}

/// The name of a new object.
fn made(generate: GlGen) -> c_uint {
    let mut name = 0;
    // SAFETY: there is room for one name, and the function is one of a table, whose context is current.
    unsafe { generate(1, &mut name) };
    name
}

/// Compiles and links both shaders.
fn link(gl: &Gl) -> Result<c_uint> {
    let program = gl.create_program();
    for (kind, source) in [(GL_VERTEX_SHADER, VERTEX_SHADER), (GL_FRAGMENT_SHADER, FRAGMENT_SHADER)] {
        let shader = gl.create_shader(kind);
        // SAFETY: one text that ends with a zero byte.
        unsafe { (gl.shader_source)(shader, 1, &source.as_ptr(), ptr::null()) };
        gl.compile_shader(shader);
        gl.attach_shader(program, shader);
        gl.delete_shader(shader);
    }
    gl.link_program(program);
    let mut linked = 0;
    // SAFETY: there is room for one value.
    unsafe { (gl.get_program)(program, GL_LINK_STATUS, &mut linked) };
    if linked != 0 {
        return Ok(program);
    }
    let mut log = [0_u8; 1024];
    // SAFETY: so many bytes may be written, the last of them zero; nobody asks how many.
    unsafe { (gl.get_program_info_log)(program, 1024, ptr::null_mut(), log.as_mut_ptr().cast()) };
    gl.delete_program(program);
    Err(format!("OpenGL's shaders: {}", String::from_utf8_lossy(&log).trim_end_matches('\0')).into())
}
