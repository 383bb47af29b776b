//! The parts of EGL and OpenGL that are used here, found at run time. The names are their own, without `egl` and `gl`.
//!
//! Based on: Khronos Group, "EGL 1.5", "EGL_MESA_platform_surfaceless" and "OpenGL 4.5, core profile".

use std::ffi::{CStr, c_char, c_int, c_uint, c_void};
use std::marker::PhantomData;

use crate::Result;

/// `EGLDisplay`, `EGLConfig`, `EGLContext` and `EGLSurface`.
pub(crate) type EglHandle = *mut c_void;

pub(crate) const EGL_PLATFORM_SURFACELESS_MESA: c_uint = 0x31DD;
pub(crate) const EGL_OPENGL_API: c_uint = 0x30A2;
pub(crate) const EGL_SURFACE_TYPE: c_int = 0x3033;
pub(crate) const EGL_PBUFFER_BIT: c_int = 1;
pub(crate) const EGL_RENDERABLE_TYPE: c_int = 0x3040;
pub(crate) const EGL_OPENGL_BIT: c_int = 8;
pub(crate) const EGL_WIDTH: c_int = 0x3057;
pub(crate) const EGL_HEIGHT: c_int = 0x3056;
pub(crate) const EGL_CONTEXT_MAJOR_VERSION: c_int = 0x3098;
pub(crate) const EGL_CONTEXT_MINOR_VERSION: c_int = 0x30FB;
pub(crate) const EGL_CONTEXT_OPENGL_PROFILE_MASK: c_int = 0x30FD;
pub(crate) const EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT: c_int = 1;
pub(crate) const EGL_NONE: c_int = 0x3038;

pub(crate) const GL_RENDERER: c_uint = 0x1F01;
pub(crate) const GL_VERSION: c_uint = 0x1F02;
pub(crate) const GL_VERTEX_SHADER: c_uint = 0x8B31;
pub(crate) const GL_FRAGMENT_SHADER: c_uint = 0x8B30;
pub(crate) const GL_LINK_STATUS: c_uint = 0x8B82;
pub(crate) const GL_ARRAY_BUFFER: c_uint = 0x8892;
pub(crate) const GL_ELEMENT_ARRAY_BUFFER: c_uint = 0x8893;
pub(crate) const GL_STREAM_DRAW: c_uint = 0x88E0;
pub(crate) const GL_FRAMEBUFFER: c_uint = 0x8D40;
pub(crate) const GL_FRAMEBUFFER_COMPLETE: c_uint = 0x8CD5;
pub(crate) const GL_RENDERBUFFER: c_uint = 0x8D41;
pub(crate) const GL_COLOR_ATTACHMENT0: c_uint = 0x8CE0;
pub(crate) const GL_DEPTH_ATTACHMENT: c_uint = 0x8D00;
pub(crate) const GL_R32UI: c_uint = 0x8236;
pub(crate) const GL_DEPTH_COMPONENT32F: c_uint = 0x8CAC;
pub(crate) const GL_COLOR: c_uint = 0x1800;
pub(crate) const GL_DEPTH: c_uint = 0x1801;
pub(crate) const GL_RED_INTEGER: c_uint = 0x8D94;
pub(crate) const GL_DEPTH_COMPONENT: c_uint = 0x1902;
pub(crate) const GL_UNSIGNED_INT: c_uint = 0x1405;
pub(crate) const GL_FLOAT: c_uint = 0x1406;
pub(crate) const GL_TRIANGLES: c_uint = 4;
pub(crate) const GL_DEPTH_TEST: c_uint = 0x0B71;
pub(crate) const GL_GREATER: c_uint = 0x0204;
pub(crate) const GL_LOWER_LEFT: c_uint = 0x8CA1;
pub(crate) const GL_ZERO_TO_ONE: c_uint = 0x935F;

/// Declares a table of functions. Those under `values` take values only: they become safe methods, because OpenGL answers
/// wrong values with an error. Those under `pointers` are for callers who know what is behind the pointers.
macro_rules! functions {
    (
        $(#[$doc:meta])*
        $table:ident
        values { $($safe:ident = $safe_symbol:literal($($arg:ident: $arg_type:ty),*) $(-> $returned:ty)?;)* }
        pointers { $($raw:ident = $raw_symbol:literal: $signature:ty;)* }
    ) => {
        $(#[$doc])*
        #[derive(Debug)]
        pub(crate) struct $table {
            $($safe: unsafe extern "system" fn($($arg_type),*) $(-> $returned)?,)*
            $(pub(crate) $raw: $signature,)*
            /// A context is current on one thread.
            _thread: PhantomData<*mut c_void>,
        }

        impl $table {
            /// Finds all functions by their names.
            ///
            /// # Safety
            /// What is found under a name is the function of this name, and stays in memory as long as the table. Where
            /// the functions need a current context, there is one as long as the table is in use.
            pub(crate) unsafe fn load(find: impl Fn(&CStr) -> Result<*const c_void>) -> Result<Self> {
                $(
                    let address = find($safe_symbol)?;
                    // SAFETY: the type is that of the function in Khronos' headers.
                    let $safe = unsafe {
                        std::mem::transmute::<
                            *const c_void,
                            unsafe extern "system" fn($($arg_type),*) $(-> $returned)?,
                        >(address)
                    };
                )*
                $(
                    let address = find($raw_symbol)?;
                    // SAFETY: the type is that of the function in Khronos' headers.
                    let $raw = unsafe { std::mem::transmute::<*const c_void, $signature>(address) };
                )*
                Ok(Self { $($safe,)* $($raw,)* _thread: PhantomData })
            }

            $(
                pub(crate) fn $safe(&self $(, $arg: $arg_type)*) $(-> $returned)? {
                    // SAFETY: only values are handed over; the functions are there, as promised to `load`.
                    unsafe { (self.$safe)($($arg),*) }
                }
            )*
        }
    };
}

functions! {
    /// EGL, as far as a context without a window needs it.
    Egl
    values {
        get_error = c"eglGetError"() -> c_int;
        bind_api = c"eglBindAPI"(api: c_uint) -> c_uint;
    }
    pointers {
        get_proc_address = c"eglGetProcAddress": unsafe extern "system" fn(*const c_char) -> *const c_void;
        get_platform_display = c"eglGetPlatformDisplay":
            unsafe extern "system" fn(c_uint, *mut c_void, *const isize) -> EglHandle;
        get_display = c"eglGetDisplay": unsafe extern "system" fn(*mut c_void) -> EglHandle;
        initialize = c"eglInitialize": unsafe extern "system" fn(EglHandle, *mut c_int, *mut c_int) -> c_uint;
        choose_config = c"eglChooseConfig":
            unsafe extern "system" fn(EglHandle, *const c_int, *mut EglHandle, c_int, *mut c_int) -> c_uint;
        create_context = c"eglCreateContext":
            unsafe extern "system" fn(EglHandle, EglHandle, EglHandle, *const c_int) -> EglHandle;
        create_pbuffer_surface = c"eglCreatePbufferSurface":
            unsafe extern "system" fn(EglHandle, EglHandle, *const c_int) -> EglHandle;
        make_current = c"eglMakeCurrent":
            unsafe extern "system" fn(EglHandle, EglHandle, EglHandle, EglHandle) -> c_uint;
    }
}

functions! {
    /// OpenGL, as far as one indexed draw into a frame buffer object needs it.
    Gl
    values {
        get_error = c"glGetError"() -> c_uint;
        create_shader = c"glCreateShader"(kind: c_uint) -> c_uint;
        compile_shader = c"glCompileShader"(shader: c_uint);
        create_program = c"glCreateProgram"() -> c_uint;
        attach_shader = c"glAttachShader"(program: c_uint, shader: c_uint);
        delete_shader = c"glDeleteShader"(shader: c_uint);
        link_program = c"glLinkProgram"(program: c_uint);
        use_program = c"glUseProgram"(program: c_uint);
        delete_program = c"glDeleteProgram"(program: c_uint);
        uniform_1f = c"glUniform1f"(location: c_int, x: f32);
        uniform_3f = c"glUniform3f"(location: c_int, x: f32, y: f32, z: f32);
        bind_buffer = c"glBindBuffer"(target: c_uint, buffer: c_uint);
        bind_vertex_array = c"glBindVertexArray"(array: c_uint);
        enable_vertex_attrib_array = c"glEnableVertexAttribArray"(index: c_uint);
        bind_renderbuffer = c"glBindRenderbuffer"(target: c_uint, buffer: c_uint);
        renderbuffer_storage = c"glRenderbufferStorage"(target: c_uint, format: c_uint, width: c_int, height: c_int);
        bind_framebuffer = c"glBindFramebuffer"(target: c_uint, buffer: c_uint);
        framebuffer_renderbuffer =
            c"glFramebufferRenderbuffer"(target: c_uint, attachment: c_uint, kind: c_uint, buffer: c_uint);
        check_framebuffer_status = c"glCheckFramebufferStatus"(target: c_uint) -> c_uint;
        viewport = c"glViewport"(x: c_int, y: c_int, width: c_int, height: c_int);
        clip_control = c"glClipControl"(origin: c_uint, depth: c_uint);
        enable = c"glEnable"(what: c_uint);
        depth_func = c"glDepthFunc"(comparison: c_uint);
        finish = c"glFinish"();
    }
    pointers {
        get_string = c"glGetString": unsafe extern "system" fn(c_uint) -> *const c_char;
        shader_source = c"glShaderSource":
            unsafe extern "system" fn(c_uint, c_int, *const *const c_char, *const c_int);
        get_program = c"glGetProgramiv": unsafe extern "system" fn(c_uint, c_uint, *mut c_int);
        get_program_info_log = c"glGetProgramInfoLog":
            unsafe extern "system" fn(c_uint, c_int, *mut c_int, *mut c_char);
        get_uniform_location = c"glGetUniformLocation": unsafe extern "system" fn(c_uint, *const c_char) -> c_int;
        gen_buffers = c"glGenBuffers": GlGen;
        delete_buffers = c"glDeleteBuffers": GlDelete;
        gen_vertex_arrays = c"glGenVertexArrays": GlGen;
        delete_vertex_arrays = c"glDeleteVertexArrays": GlDelete;
        gen_renderbuffers = c"glGenRenderbuffers": GlGen;
        delete_renderbuffers = c"glDeleteRenderbuffers": GlDelete;
        gen_framebuffers = c"glGenFramebuffers": GlGen;
        delete_framebuffers = c"glDeleteFramebuffers": GlDelete;
        buffer_data = c"glBufferData": unsafe extern "system" fn(c_uint, isize, *const c_void, c_uint);
        buffer_sub_data = c"glBufferSubData": unsafe extern "system" fn(c_uint, isize, isize, *const c_void);
        vertex_attrib_pointer = c"glVertexAttribPointer":
            unsafe extern "system" fn(c_uint, c_int, c_uint, u8, c_int, *const c_void);
        clear_uint = c"glClearBufferuiv": unsafe extern "system" fn(c_uint, c_int, *const c_uint);
        clear_float = c"glClearBufferfv": unsafe extern "system" fn(c_uint, c_int, *const f32);
        draw_elements = c"glDrawElements": unsafe extern "system" fn(c_uint, c_int, c_uint, *const c_void);
        read_pixels = c"glReadPixels":
            unsafe extern "system" fn(c_int, c_int, c_int, c_int, c_uint, c_uint, *mut c_void);
    }
}

/// `glGenBuffers` and its like.
pub(crate) type GlGen = unsafe extern "system" fn(c_int, *mut c_uint);
/// `glDeleteBuffers` and its like.
pub(crate) type GlDelete = unsafe extern "system" fn(c_int, *const c_uint);
