//! The part of Embree 4's C interface that is used here, loaded at run time. The names are Embree's own.
//!
//! Based on: the Embree 4.4 API reference and its headers `rtcore_ray.h`, `rtcore_scene.h` and `rtcore_geometry.h`.

use std::ffi::{c_char, c_int, c_uint, c_void};
use std::mem::ManuallyDrop;
use std::path::Path;

use libloading::Library;

use crate::Result;

pub(crate) type RtcDevice = *mut c_void;
pub(crate) type RtcScene = *mut c_void;
pub(crate) type RtcGeometry = *mut c_void;

pub(crate) const RTC_DEVICE_PROPERTY_VERSION: c_int = 0;
pub(crate) const RTC_GEOMETRY_TYPE_TRIANGLE: c_int = 0;
pub(crate) const RTC_BUFFER_TYPE_INDEX: c_int = 0;
pub(crate) const RTC_BUFFER_TYPE_VERTEX: c_int = 1;
pub(crate) const RTC_FORMAT_UINT3: c_int = 0x5003;
pub(crate) const RTC_FORMAT_FLOAT3: c_int = 0x9003;
pub(crate) const RTC_BUILD_QUALITY_LOW: c_int = 0;
pub(crate) const RTC_BUILD_QUALITY_MEDIUM: c_int = 1;
pub(crate) const RTC_BUILD_QUALITY_HIGH: c_int = 2;
pub(crate) const RTC_SCENE_FLAG_NONE: c_int = 0;
pub(crate) const RTC_SCENE_FLAG_DYNAMIC: c_int = 1 << 0;
pub(crate) const RTC_SCENE_FLAG_ROBUST: c_int = 1 << 2;
pub(crate) const RTC_FEATURE_FLAG_ALL: c_uint = 0xFFFF_FFFF;
pub(crate) const RTC_RAY_QUERY_FLAG_INCOHERENT: c_int = 0;
pub(crate) const RTC_RAY_QUERY_FLAG_COHERENT: c_int = 1 << 16;
pub(crate) const RTC_INVALID_GEOMETRY_ID: c_uint = c_uint::MAX;

/// `RTCRay8` and `RTCRay16`: N rays, component by component. 64 bytes of alignment suit both.
#[repr(C, align(64))]
#[derive(Debug, Clone)]
pub(crate) struct RtcRay<const N: usize> {
    pub(crate) org_x: [f32; N],
    pub(crate) org_y: [f32; N],
    pub(crate) org_z: [f32; N],
    pub(crate) tnear: [f32; N],
    pub(crate) dir_x: [f32; N],
    pub(crate) dir_y: [f32; N],
    pub(crate) dir_z: [f32; N],
    pub(crate) time: [f32; N],
    pub(crate) tfar: [f32; N],
    pub(crate) mask: [c_uint; N],
    pub(crate) id: [c_uint; N],
    pub(crate) flags: [c_uint; N],
}

/// `RTCRayHit8` and `RTCRayHit16`: N rays and their hits.
#[repr(C, align(64))]
#[derive(Debug, Clone)]
#[expect(non_snake_case, reason = "Embree's names")]
pub(crate) struct RtcRayHit<const N: usize> {
    pub(crate) ray: RtcRay<N>,
    pub(crate) Ng_x: [f32; N],
    pub(crate) Ng_y: [f32; N],
    pub(crate) Ng_z: [f32; N],
    pub(crate) u: [f32; N],
    pub(crate) v: [f32; N],
    pub(crate) primID: [c_uint; N],
    pub(crate) geomID: [c_uint; N],
    pub(crate) instID: [c_uint; N],
    /// Libraries built with instance arrays write it; others end before it.
    pub(crate) instPrimID: [c_uint; N],
}

/// `RTCRayHit`: one ray and its hit.
#[repr(C, align(16))]
#[derive(Debug, Clone)]
#[expect(non_snake_case, reason = "Embree's names")]
pub(crate) struct RtcRayHit1 {
    pub(crate) org: [f32; 3],
    pub(crate) tnear: f32,
    pub(crate) dir: [f32; 3],
    pub(crate) time: f32,
    pub(crate) tfar: f32,
    pub(crate) mask: c_uint,
    pub(crate) id: c_uint,
    pub(crate) flags: c_uint,
    pub(crate) Ng: [f32; 3],
    pub(crate) uv: [f32; 2],
    pub(crate) primID: c_uint,
    pub(crate) geomID: c_uint,
    pub(crate) instID: c_uint,
    /// Libraries built with instance arrays write it; others end before it.
    pub(crate) instPrimID: c_uint,
}

/// -1 for each ray that is to be traced, 0 for the others.
#[repr(C, align(64))]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Valid<const N: usize>(pub(crate) [c_int; N]);

/// `RTCIntersectArguments` and `RTCOccludedArguments`, which have the same fields.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct RtcQueryArguments {
    pub(crate) flags: c_int,
    pub(crate) feature_mask: c_uint,
    pub(crate) context: *mut c_void,
    pub(crate) filter: *const c_void,
    /// For geometries with functions of their own: `intersect` or `occluded`.
    pub(crate) function: *const c_void,
    /// Libraries built with a least curve width read it; others end before it.
    pub(crate) min_width_distance_factor: f32,
}

type RtcIntersect1 = unsafe extern "C" fn(RtcScene, *mut RtcRayHit1, *mut RtcQueryArguments);

type RtcIntersectN<const N: usize> =
    unsafe extern "C" fn(*const Valid<N>, RtcScene, *mut RtcRayHit<N>, *mut RtcQueryArguments);

type RtcOccludedN<const N: usize> =
    unsafe extern "C" fn(*const Valid<N>, RtcScene, *mut RtcRay<N>, *mut RtcQueryArguments);

/// `rtcSetSharedGeometryBuffer`: geometry, type, slot, format, address, offset, stride and number of items.
type RtcSetSharedGeometryBuffer =
    unsafe extern "C" fn(RtcGeometry, c_int, c_uint, c_int, *const c_void, usize, usize, usize);

/// Declares the table of functions and how it is filled.
macro_rules! functions {
    ($($field:ident = $symbol:literal: $signature:ty;)*) => {
        /// Embree's functions, as long as the library is loaded.
        #[derive(Debug)]
        pub(crate) struct Api {
            $(pub(crate) $field: $signature,)*
            /// Keeps the functions in memory, to the end of the process: its threads outlive the device.
            _library: ManuallyDrop<Library>,
        }

        impl Api {
            /// Loads the library and finds its functions.
            pub(crate) fn load(path: &Path) -> Result<Self> {
                let named = |error: libloading::Error| match std::error::Error::source(&error) {
                    Some(reason) => format!("{}: {error}: {reason}", path.display()),
                    None => format!("{}: {error}", path.display()),
                };
                // SAFETY: loading runs the library's initialisers; the user names a library that is meant to be Embree.
                let library = unsafe { Library::new(path) }.map_err(named)?;
                $(
                    // SAFETY: the type is that of the function in Embree 4's headers.
                    let $field = *unsafe { library.get::<$signature>($symbol) }.map_err(named)?;
                )*
                Ok(Self { $($field,)* _library: ManuallyDrop::new(library) })
            }
        }
    };
}

functions! {
    new_device = b"rtcNewDevice\0": unsafe extern "C" fn(*const c_char) -> RtcDevice;
    release_device = b"rtcReleaseDevice\0": unsafe extern "C" fn(RtcDevice);
    get_device_error = b"rtcGetDeviceError\0": unsafe extern "C" fn(RtcDevice) -> c_int;
    get_device_property = b"rtcGetDeviceProperty\0": unsafe extern "C" fn(RtcDevice, c_int) -> isize;
    new_scene = b"rtcNewScene\0": unsafe extern "C" fn(RtcDevice) -> RtcScene;
    release_scene = b"rtcReleaseScene\0": unsafe extern "C" fn(RtcScene);
    set_scene_flags = b"rtcSetSceneFlags\0": unsafe extern "C" fn(RtcScene, c_int);
    set_scene_build_quality = b"rtcSetSceneBuildQuality\0": unsafe extern "C" fn(RtcScene, c_int);
    commit_scene = b"rtcCommitScene\0": unsafe extern "C" fn(RtcScene);
    new_geometry = b"rtcNewGeometry\0": unsafe extern "C" fn(RtcDevice, c_int) -> RtcGeometry;
    release_geometry = b"rtcReleaseGeometry\0": unsafe extern "C" fn(RtcGeometry);
    set_geometry_build_quality = b"rtcSetGeometryBuildQuality\0": unsafe extern "C" fn(RtcGeometry, c_int);
    set_shared_geometry_buffer = b"rtcSetSharedGeometryBuffer\0": RtcSetSharedGeometryBuffer;
    update_geometry_buffer = b"rtcUpdateGeometryBuffer\0": unsafe extern "C" fn(RtcGeometry, c_int, c_uint);
    commit_geometry = b"rtcCommitGeometry\0": unsafe extern "C" fn(RtcGeometry);
    attach_geometry = b"rtcAttachGeometry\0": unsafe extern "C" fn(RtcScene, RtcGeometry) -> c_uint;
    intersect_1 = b"rtcIntersect1\0": RtcIntersect1;
    intersect_8 = b"rtcIntersect8\0": RtcIntersectN<8>;
    intersect_16 = b"rtcIntersect16\0": RtcIntersectN<16>;
    occluded_8 = b"rtcOccluded8\0": RtcOccludedN<8>;
    occluded_16 = b"rtcOccluded16\0": RtcOccludedN<16>;
}
