//! An OpenGL context without a window, on the processor: EGL and Mesa's llvmpipe, loaded at run time.
//!
//! Based on: the extension `EGL_MESA_platform_surfaceless`; Mesa's documentation of `LP_NUM_THREADS`, `GALLIUM_DRIVER` and
//! `LIBGL_ALWAYS_SOFTWARE`.

use std::ffi::{CStr, c_int, c_uint, c_void};
use std::ptr;
use std::rc::Rc;

use libloading::Library;

use crate::Result;
use crate::engines::llvmpipe::gl_api::*;

/// glvnd's or Mesa's EGL; it finds OpenGL by itself.
const LIBRARY: &str = "libEGL.so.1";

/// `glClipControl` came with 4.5.
const CONTEXT: [c_int; 7] = [
    EGL_CONTEXT_MAJOR_VERSION,
    4,
    EGL_CONTEXT_MINOR_VERSION,
    5,
    EGL_CONTEXT_OPENGL_PROFILE_MASK,
    EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
    EGL_NONE,
];

/// A context that is current on the thread that opened it, to the end of the process: Mesa's threads outlive it.
#[derive(Debug)]
pub(crate) struct Context {
    gl: Gl,
}

impl Context {
    /// Loads EGL and makes a context current. To be called once, before other libraries start threads: the environment changes.
    pub(crate) fn open(threads: usize) -> Result<Rc<Self>> {
        choose_llvmpipe(threads);
        // SAFETY: loading runs the initialisers of the system's EGL.
        let library = unsafe { Library::new(LIBRARY) }.map_err(|error| format!("{LIBRARY}: {error}"))?;
        let library: &'static Library = Box::leak(Box::new(library));
        let of_library = |name: &CStr| {
            // SAFETY: a symbol read as a pointer is its address; it is used with the type of the function.
            let symbol = unsafe { library.get::<*const c_void>(name.to_bytes_with_nul()) };
            Ok(*symbol.map_err(|error| format!("{LIBRARY}: {error}"))?)
        };
        // SAFETY: the functions are EGL's, and the library stays.
        let egl = unsafe { Egl::load(of_library) }?;
        make_current(&egl)?;
        let of_egl = |name: &CStr| {
            // SAFETY: the name ends with a zero byte and lives through the call.
            let address = unsafe { (egl.get_proc_address)(name.as_ptr()) };
            if address.is_null() { Err(format!("no {}", name.to_string_lossy()).into()) } else { Ok(address) }
        };
        // SAFETY: the functions are OpenGL's, the libraries stay, and the context is current from here on.
        let gl = unsafe { Gl::load(of_egl) }?;
        Ok(Rc::new(Self { gl }))
    }

    /// The functions of OpenGL.
    pub(crate) fn gl(&self) -> &Gl {
        &self.gl
    }

    /// Who renders, and the version of Mesa; where it is not llvmpipe, that is said first.
    pub(crate) fn version(&self) -> String {
        let (renderer, version) = (self.text(GL_RENDERER), self.text(GL_VERSION));
        let warning = if renderer.contains("llvmpipe") { "" } else { "NOT llvmpipe: " };
        format!("{warning}{renderer}, {version}")
    }

    /// What `glGetString` says.
    fn text(&self, what: c_uint) -> String {
        // SAFETY: the context is current.
        let text = unsafe { (self.gl.get_string)(what) };
        if text.is_null() {
            return String::new();
        }
        // SAFETY: what is not null is a text that ends with a zero byte and belongs to OpenGL.
        unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
    }

    /// Whether any call has failed since the last time.
    pub(crate) fn check(&self, what: &str) -> Result<()> {
        match self.gl.get_error() {
            0 => Ok(()),
            code => Err(format!("{what}: OpenGL reports error {code:#06x}").into()),
        }
    }
}

/// Asks Mesa for llvmpipe with so many threads that rasterize. With one, the calling thread does it: the worker would come
/// on top of it. What the user has set stays.
fn choose_llvmpipe(threads: usize) {
    let workers = if threads > 1 { threads } else { 0 }.to_string();
    let wishes =
        [("LIBGL_ALWAYS_SOFTWARE", "1"), ("GALLIUM_DRIVER", "llvmpipe"), ("LP_NUM_THREADS", &workers)];
    for (name, value) in wishes {
        if std::env::var_os(name).is_none() {
            // SAFETY: the only other threads are rayon's, which have nothing to do and read no environment.
            unsafe { std::env::set_var(name, value) };
        }
    }
}

/// Makes a context current: without a surface where Mesa's platform for that is there, else with a surface of one pixel on
/// the default display.
fn make_current(egl: &Egl) -> Result<()> {
    // SAFETY: no attributes are given.
    let surfaceless =
        unsafe { (egl.get_platform_display)(EGL_PLATFORM_SURFACELESS_MESA, ptr::null_mut(), ptr::null()) };
    make_current_on(egl, surfaceless, false).or_else(|reason| {
        // SAFETY: null is the default display.
        let display = unsafe { (egl.get_display)(ptr::null_mut()) };
        make_current_on(egl, display, true).map_err(|_| reason)
    })
}

/// Makes a context current on one display.
fn make_current_on(egl: &Egl, display: EglHandle, pbuffer: bool) -> Result<()> {
    let failed = |call: &str| Err(format!("{call}: EGL reports error {:#06x}", egl.get_error()).into());
    if display.is_null() {
        return Err("EGL has no such display".into());
    }
    // SAFETY: the display is EGL's; nobody asks for the version.
    if unsafe { (egl.initialize)(display, ptr::null_mut(), ptr::null_mut()) } == 0 {
        return failed("eglInitialize");
    }
    egl.bind_api(EGL_OPENGL_API);
    let surface_type = if pbuffer { EGL_PBUFFER_BIT } else { 0 };
    let wanted = [EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, surface_type, EGL_NONE];
    let (mut config, mut count) = (ptr::null_mut(), 0);
    // SAFETY: the list ends with EGL_NONE, and there is room for one config and the count.
    let chosen = unsafe { (egl.choose_config)(display, wanted.as_ptr(), &mut config, 1, &mut count) };
    if chosen == 0 || count == 0 {
        return failed("eglChooseConfig");
    }
    // SAFETY: display and config belong together; the list ends with EGL_NONE.
    let context = unsafe { (egl.create_context)(display, config, ptr::null_mut(), CONTEXT.as_ptr()) };
    if context.is_null() {
        return failed("eglCreateContext");
    }
    let surface = if pbuffer {
        let size = [EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE];
        // SAFETY: as above.
        unsafe { (egl.create_pbuffer_surface)(display, config, size.as_ptr()) }
    } else {
        ptr::null_mut()
    };
    // SAFETY: all belong to the display; no surface is allowed with EGL_KHR_surfaceless_context.
    if unsafe { (egl.make_current)(display, surface, surface, context) } == 0 {
        return failed("eglMakeCurrent");
    }
    Ok(())
}
