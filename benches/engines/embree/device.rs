//! Embree made safe: a device, scenes of one triangle mesh, and packets of rays.

use std::ffi::CString;
use std::path::Path;
use std::ptr;
use std::sync::Arc;

use crate::Result;
use crate::engines::embree::api::*;
use crate::subjects::answer::MISS;

/// How well the tree is built, and whether it is rebuilt often.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Build {
    /// `RTC_BUILD_QUALITY_LOW` and `RTC_SCENE_FLAG_DYNAMIC`: by Morton codes, for scenes that change every frame.
    LowDynamic,
    /// `RTC_BUILD_QUALITY_MEDIUM`: Embree's default, by binned SAH.
    Medium,
    /// `RTC_BUILD_QUALITY_HIGH`: SAH with spatial splits.
    High,
    /// Medium and `RTC_SCENE_FLAG_ROBUST`.
    MediumRobust,
}

/// An Embree device and its worker threads.
#[derive(Debug)]
pub(crate) struct Device {
    api: Api,
    raw: RtcDevice,
}

// SAFETY: Embree allows calls on a device from any thread; only objects that are being changed need exclusive access.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

impl Device {
    /// Loads the library and starts a device with so many threads.
    pub(crate) fn new(path: &Path, threads: usize) -> Result<Arc<Self>> {
        let api = Api::load(path)?;
        let config = CString::new(format!("threads={threads},user_threads=0"))?;
        // SAFETY: the text ends with a zero byte and lives through the call.
        let raw = unsafe { (api.new_device)(config.as_ptr()) };
        if raw.is_null() {
            // SAFETY: a null device asks for the error of this thread.
            let code = unsafe { (api.get_device_error)(ptr::null_mut()) };
            return Err(format!("{}: no Embree device, error {code}", path.display()).into());
        }
        Ok(Arc::new(Self { api, raw }))
    }

    /// The version as text, such as 4.4.0.
    pub(crate) fn version(&self) -> String {
        // SAFETY: the device is alive.
        let version = unsafe { (self.api.get_device_property)(self.raw, RTC_DEVICE_PROPERTY_VERSION) };
        format!("{}.{}.{}", version / 10_000, version / 100 % 100, version % 100)
    }

    /// Whether any call has failed since the last time.
    fn check(&self) -> Result<()> {
        // SAFETY: the device is alive.
        match unsafe { (self.api.get_device_error)(self.raw) } {
            0 => Ok(()),
            code => Err(format!("Embree reports error {code}").into()),
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the reference is given back once; scenes keep the device alive until they are gone.
        unsafe { (self.api.release_device)(self.raw) };
    }
}

/// A scene of one mesh that shares the vertices and indices kept here.
#[derive(Debug)]
pub(crate) struct Mesh {
    device: Arc<Device>,
    scene: RtcScene,
    geometry: RtcGeometry,
    /// One vertex more than the mesh has: Embree reads 16 bytes at each.
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

// SAFETY: tracing a committed scene is allowed from many threads; building takes `&mut self`.
unsafe impl Sync for Mesh {}

impl Mesh {
    /// Prepares a scene without building it. The copies are not what is timed.
    pub(crate) fn new(
        device: &Arc<Device>,
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        build: Build,
    ) -> Result<Self> {
        let device = Arc::clone(device);
        let mut positions = positions.to_vec();
        positions.push([0.0; 3]);
        let (quality, flags) = match build {
            Build::LowDynamic => (RTC_BUILD_QUALITY_LOW, RTC_SCENE_FLAG_DYNAMIC),
            Build::Medium => (RTC_BUILD_QUALITY_MEDIUM, RTC_SCENE_FLAG_NONE),
            Build::High => (RTC_BUILD_QUALITY_HIGH, RTC_SCENE_FLAG_NONE),
            Build::MediumRobust => (RTC_BUILD_QUALITY_MEDIUM, RTC_SCENE_FLAG_ROBUST),
        };
        // SAFETY: the device is alive.
        let scene = unsafe { (device.api.new_scene)(device.raw) };
        // SAFETY: the device is alive.
        let geometry = unsafe { (device.api.new_geometry)(device.raw, RTC_GEOMETRY_TYPE_TRIANGLE) };
        let mesh = Self { device, scene, geometry, positions, triangles: triangles.to_vec() };
        mesh.share_buffers();
        let api = &mesh.device.api;
        // SAFETY: scene and geometry are alive; so below.
        unsafe { (api.set_scene_flags)(scene, flags) };
        // SAFETY: as above.
        unsafe { (api.set_scene_build_quality)(scene, quality) };
        // SAFETY: as above.
        unsafe { (api.set_geometry_build_quality)(geometry, quality) };
        // SAFETY: as above; both belong to one device.
        unsafe { (api.attach_geometry)(scene, geometry) };
        mesh.device.check()?;
        Ok(mesh)
    }

    /// Tells Embree where vertices and indices are.
    fn share_buffers(&self) {
        let share = self.device.api.set_shared_geometry_buffer;
        let (vertices, indices) = (self.positions.as_ptr().cast(), self.triangles.as_ptr().cast());
        let (vertex_count, index_count) = (self.positions.len() - 1, self.triangles.len());
        let (vertex, index) = (RTC_BUFFER_TYPE_VERTEX, RTC_BUFFER_TYPE_INDEX);
        // SAFETY: 12 bytes a vertex, with one more vertex behind the last; the vector lives and stays as long as the scene.
        unsafe { share(self.geometry, vertex, 0, RTC_FORMAT_FLOAT3, vertices, 0, 12, vertex_count) };
        // SAFETY: 12 bytes a triangle; the vector lives and stays as long as the scene.
        unsafe { share(self.geometry, index, 0, RTC_FORMAT_UINT3, indices, 0, 12, index_count) };
    }

    /// Builds the tree, or builds it again in the memory of the last one, as after a change of all vertices.
    pub(crate) fn build(&mut self) -> Result<()> {
        let api = &self.device.api;
        // SAFETY: the geometry is alive and nobody traces: `self` is exclusive. So below.
        unsafe { (api.update_geometry_buffer)(self.geometry, RTC_BUFFER_TYPE_VERTEX, 0) };
        // SAFETY: as above.
        unsafe { (api.commit_geometry)(self.geometry) };
        // SAFETY: as above.
        unsafe { (api.commit_scene)(self.scene) };
        self.device.check()
    }
}

impl Drop for Mesh {
    fn drop(&mut self) {
        // SAFETY: each reference is given back once, before the buffers go.
        unsafe { (self.device.api.release_geometry)(self.geometry) };
        // SAFETY: as above.
        unsafe { (self.device.api.release_scene)(self.scene) };
    }
}

/// N rays whose nearest hits are found together. Embree has packets of 8 and 16.
pub(crate) trait Packet<const N: usize> {
    /// Traces the rays that are valid.
    fn intersect(&mut self, mesh: &Mesh, valid: &Valid<N>, coherence: Coherence);
}

/// N rays of which it is found together whether they hit anything. Embree has packets of 8 and 16.
pub(crate) trait ShadowPacket<const N: usize> {
    /// Traces the rays that are valid.
    fn occlude(&mut self, mesh: &Mesh, valid: &Valid<N>, coherence: Coherence);
}

/// What Embree is told of the rays of a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Coherence {
    /// `RTC_RAY_QUERY_FLAG_COHERENT`: they are traced together.
    Coherent,
    /// `RTC_RAY_QUERY_FLAG_INCOHERENT`, Embree's default: one by one.
    Incoherent,
}

/// The arguments of a query.
pub(crate) fn arguments(coherence: Coherence) -> RtcQueryArguments {
    let flags = match coherence {
        Coherence::Coherent => RTC_RAY_QUERY_FLAG_COHERENT,
        Coherence::Incoherent => RTC_RAY_QUERY_FLAG_INCOHERENT,
    };
    RtcQueryArguments {
        flags,
        feature_mask: RTC_FEATURE_FLAG_ALL,
        context: ptr::null_mut(),
        filter: ptr::null(),
        function: ptr::null(),
        min_width_distance_factor: 0.0,
    }
}

impl Packet<8> for RtcRayHit<8> {
    fn intersect(&mut self, mesh: &Mesh, valid: &Valid<8>, coherence: Coherence) {
        // SAFETY: layout and alignment are those of RTCRayHit8, and all pointers live through the call.
        unsafe { (mesh.device.api.intersect_8)(valid, mesh.scene, self, &mut arguments(coherence)) };
    }
}

impl Packet<16> for RtcRayHit<16> {
    fn intersect(&mut self, mesh: &Mesh, valid: &Valid<16>, coherence: Coherence) {
        // SAFETY: layout and alignment are those of RTCRayHit16, and all pointers live through the call.
        unsafe { (mesh.device.api.intersect_16)(valid, mesh.scene, self, &mut arguments(coherence)) };
    }
}

impl ShadowPacket<8> for RtcRay<8> {
    fn occlude(&mut self, mesh: &Mesh, valid: &Valid<8>, coherence: Coherence) {
        // SAFETY: layout and alignment are those of RTCRay8, and all pointers live through the call.
        unsafe { (mesh.device.api.occluded_8)(valid, mesh.scene, self, &mut arguments(coherence)) };
    }
}

impl ShadowPacket<16> for RtcRay<16> {
    fn occlude(&mut self, mesh: &Mesh, valid: &Valid<16>, coherence: Coherence) {
        // SAFETY: layout and alignment are those of RTCRay16, and all pointers live through the call.
        unsafe { (mesh.device.api.occluded_16)(valid, mesh.scene, self, &mut arguments(coherence)) };
    }
}

impl RtcRayHit1 {
    /// A ray of unlimited length that has hit nothing yet.
    #[inline]
    pub(crate) fn new(org: [f32; 3], dir: [f32; 3], tnear: f32) -> Self {
        let none = RTC_INVALID_GEOMETRY_ID;
        Self {
            org,
            tnear,
            dir,
            time: 0.0,
            tfar: f32::INFINITY,
            mask: u32::MAX,
            id: 0,
            flags: 0,
            Ng: [0.0; 3],
            uv: [0.0; 2],
            primID: none,
            geomID: none,
            instID: none,
            instPrimID: none,
        }
    }

    /// What the ray hits: an id and a distance.
    #[inline]
    pub(crate) fn intersect(&mut self, mesh: &Mesh, arguments: &mut RtcQueryArguments) -> (u32, f32) {
        // SAFETY: layout and alignment are those of RTCRayHit, and all pointers live through the call.
        unsafe { (mesh.device.api.intersect_1)(mesh.scene, self, arguments) };
        if self.geomID == RTC_INVALID_GEOMETRY_ID { (MISS, f32::INFINITY) } else { (self.primID, self.tfar) }
    }
}

impl<const N: usize> RtcRay<N> {
    /// N rays of all lengths from one origin, without directions yet.
    pub(crate) fn from_origin(origin: [f32; 3]) -> Self {
        let zero = [0.0; N];
        Self {
            org_x: [origin[0]; N],
            org_y: [origin[1]; N],
            org_z: [origin[2]; N],
            tnear: zero,
            dir_x: zero,
            dir_y: zero,
            dir_z: zero,
            time: zero,
            tfar: [f32::INFINITY; N],
            mask: [u32::MAX; N],
            id: [0; N],
            flags: [0; N],
        }
    }

    /// Whether ray n was found to hit something.
    #[inline]
    pub(crate) fn is_blocked(&self, n: usize) -> bool {
        self.tfar[n] < 0.0
    }
}

impl<const N: usize> RtcRayHit<N> {
    /// N rays from one origin, without directions yet.
    pub(crate) fn from_origin(origin: [f32; 3]) -> Self {
        let (zero, none) = ([0.0; N], [RTC_INVALID_GEOMETRY_ID; N]);
        Self {
            ray: RtcRay::from_origin(origin),
            Ng_x: zero,
            Ng_y: zero,
            Ng_z: zero,
            u: zero,
            v: zero,
            primID: none,
            geomID: none,
            instID: none,
            instPrimID: none,
        }
    }

    /// Forgets the hits, for the next directions.
    #[inline]
    pub(crate) fn reset(&mut self) {
        self.ray.tfar = [f32::INFINITY; N];
        self.geomID = [RTC_INVALID_GEOMETRY_ID; N];
        self.instID = [RTC_INVALID_GEOMETRY_ID; N];
    }

    /// What ray n hits: an id and a distance.
    #[inline]
    pub(crate) fn hit(&self, n: usize) -> (u32, f32) {
        if self.geomID[n] == RTC_INVALID_GEOMETRY_ID {
            (MISS, f32::INFINITY)
        } else {
            (self.primID[n], self.ray.tfar[n])
        }
    }
}
