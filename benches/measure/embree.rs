//! Intel's Embree, from its shared library: one scene of triangles, and rays alone or in packets.
//!
//! The layouts are those of the documented C interface of Embree 4 (Apache-2.0). The library is
//! opened by the system's loader, so nothing needs to be there when this is compiled.
//!
//! Soundness: pointers go to Embree from here only. A packet has room for the longest form of its
//! structure and the alignment of the widest one. Scenes keep their device, and queries their
//! scene.
#![allow(unsafe_code)]

use lightshed::scene::Ray;
use lightshed::scene::glam::Vec3;
use std::error::Error;
use std::ffi::{CString, c_char, c_int, c_void};
use std::path::Path;

#[cfg(unix)]
unsafe extern "C" {
    fn dlopen(file: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
    fn dlerror() -> *const c_char;
}

/// Anything of Embree's, by its address.
type Handle = *mut c_void;
type OfHandle = unsafe extern "C" fn(Handle);
type OneRay = unsafe extern "C" fn(Handle, *mut c_void, *const Arguments);
type ManyRays = unsafe extern "C" fn(*const i32, Handle, *mut c_void, *const Arguments);

const INDEX_BUFFER: c_int = 0;
const VERTEX_BUFFER: c_int = 1;
const UINT3: c_int = 0x5003;
const FLOAT3: c_int = 0x9003;
const TRIANGLES: c_int = 0;
const QUALITY_HIGH: c_int = 2;
const ROBUST: c_int = 1 << 2;
const COHERENT: u32 = 1 << 16;

/// `RTCIntersectArguments` and `RTCOccludedArguments`, with room for what may follow.
#[repr(C)]
struct Arguments {
    flags: u32,
    feature_mask: u32,
    context: *const c_void,
    filter: *const c_void,
    function: *const c_void,
    rest: [u64; 4],
}

/// Which rays of a packet count: minus one for those, zero for the others.
#[repr(C, align(64))]
struct Valid([i32; 16]);

/// The loaded library with a device.
pub struct Embree {
    library: Handle,
    device: Handle,
}

impl Embree {
    /// Opens the library and makes a device with this configuration.
    pub fn open(file: &Path, configuration: &str) -> Result<Self, Box<dyn Error>> {
        let library = open_library(file)?;
        let mut embree = Self {
            library,
            device: std::ptr::null_mut(),
        };
        let configuration = CString::new(configuration)?;
        // SAFETY: the function has this type, and the text ends with a zero.
        embree.device = unsafe {
            let new: unsafe extern "C" fn(*const c_char) -> Handle = embree.function("rtcNewDevice")?;
            new(configuration.as_ptr())
        };
        if embree.device.is_null() {
            return Err("Embree makes no device".into());
        }
        Ok(embree)
    }

    /// The library's function of this name.
    ///
    /// # Safety
    /// `F` must be the type of that function.
    unsafe fn function<F: Copy>(&self, name: &str) -> Result<F, Box<dyn Error>> {
        assert_eq!(size_of::<F>(), size_of::<Handle>());
        let address = symbol(self.library, name)?;
        // SAFETY: an address of a function of that type, says the caller.
        Ok(unsafe { std::mem::transmute_copy(&address) })
    }

    /// Embree's version.
    pub fn version(&self) -> Result<String, Box<dyn Error>> {
        const VERSION: c_int = 0;
        // SAFETY: the function has this type.
        let number = unsafe {
            let property: unsafe extern "C" fn(Handle, c_int) -> isize =
                self.function("rtcGetDeviceProperty")?;
            property(self.device, VERSION)
        };
        Ok(format!(
            "{}.{}.{}",
            number / 10_000,
            number / 100 % 100,
            number % 100
        ))
    }

    /// Builds the tree of these triangles, of high quality.
    pub fn scene(&self, triangles: &[[Vec3; 3]], robust: bool) -> Result<EmbreeScene<'_>, Box<dyn Error>> {
        // SAFETY: the functions have these types. The buffers have room for what is written: nine
        // numbers and three indices a triangle.
        unsafe {
            let new_scene: unsafe extern "C" fn(Handle) -> Handle = self.function("rtcNewScene")?;
            let set: [unsafe extern "C" fn(Handle, c_int); 2] = [
                self.function("rtcSetSceneBuildQuality")?,
                self.function("rtcSetSceneFlags")?,
            ];
            let new_geometry: unsafe extern "C" fn(Handle, c_int) -> Handle =
                self.function("rtcNewGeometry")?;
            let new_buffer: unsafe extern "C" fn(Handle, c_int, u32, c_int, usize, usize) -> *mut c_void =
                self.function("rtcSetNewGeometryBuffer")?;
            let attach: unsafe extern "C" fn(Handle, Handle) -> u32 = self.function("rtcAttachGeometry")?;
            let commit_geometry: OfHandle = self.function("rtcCommitGeometry")?;
            let release_geometry: OfHandle = self.function("rtcReleaseGeometry")?;
            let commit_scene: OfHandle = self.function("rtcCommitScene")?;
            let error: unsafe extern "C" fn(Handle) -> c_int = self.function("rtcGetDeviceError")?;

            let scene = EmbreeScene {
                embree: self,
                handle: new_scene(self.device),
            };
            set[0](scene.handle, QUALITY_HIGH);
            set[1](scene.handle, if robust { ROBUST } else { 0 });
            let geometry = new_geometry(self.device, TRIANGLES);
            let count = triangles.len();
            let corners = new_buffer(geometry, VERTEX_BUFFER, 0, FLOAT3, 12, 3 * count).cast::<[f32; 3]>();
            let indices = new_buffer(geometry, INDEX_BUFFER, 0, UINT3, 12, count).cast::<u32>();
            if corners.is_null() || indices.is_null() {
                return Err("Embree has no buffers".into());
            }
            for (place, corner) in triangles.iter().flatten().enumerate() {
                corners.add(place).write(corner.to_array());
                indices.add(place).write(place as u32);
            }
            commit_geometry(geometry);
            attach(scene.handle, geometry);
            release_geometry(geometry);
            commit_scene(scene.handle);
            match error(self.device) {
                0 => Ok(scene),
                code => Err(format!("Embree's error {code}").into()),
            }
        }
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: the device is released once, after its scenes, which borrow this.
        unsafe {
            if let Ok(release) = self.function::<OfHandle>("rtcReleaseDevice")
                && !self.device.is_null()
            {
                release(self.device);
            }
        }
    }
}

/// A tree over triangles.
pub struct EmbreeScene<'e> {
    embree: &'e Embree,
    handle: Handle,
}

impl EmbreeScene<'_> {
    /// How packets of `N` rays ask for the nearest hit, or for any. They may be announced as
    /// coherent.
    ///
    /// # Errors
    /// If `N` is not 1, 4, 8 or 16.
    pub fn queries<const N: usize>(
        &self,
        any: bool,
        coherent: bool,
    ) -> Result<Queries<'_, N>, Box<dyn Error>> {
        let name = format!("rtc{}{N}", if any { "Occluded" } else { "Intersect" });
        // SAFETY: the function of one ray has the one type, those of packets have the other.
        let function = unsafe {
            match N {
                1 => Function::One(self.embree.function(&name)?),
                4 | 8 | 16 => Function::Many(self.embree.function(&name)?),
                _ => return Err(format!("there are no packets of {N} rays").into()),
            }
        };
        Ok(Queries {
            scene: self,
            function,
            arguments: Arguments {
                flags: if coherent { COHERENT } else { 0 },
                feature_mask: u32::MAX,
                context: std::ptr::null(),
                filter: std::ptr::null(),
                function: std::ptr::null(),
                rest: [0; 4],
            },
        })
    }
}

impl Drop for EmbreeScene<'_> {
    fn drop(&mut self) {
        // SAFETY: the scene is released once, before its device.
        unsafe {
            if let Ok(release) = self.embree.function::<OfHandle>("rtcReleaseScene") {
                release(self.handle);
            }
        }
    }
}

enum Function {
    One(OneRay),
    Many(ManyRays),
}

/// Rows of `RTCRay`.
const T_MIN: usize = 3;
const TIME: usize = 7;
const T_MAX: usize = 8;
const MASK: usize = 9;
/// Row of `RTCHit`, which follows.
const GEOMETRY: usize = 18;
/// Twelve of the ray and up to nine of the hit, rounded up to the alignment of the two.
const ROWS: usize = 24;

/// `RTCRayHit` or that of 4, 8 or 16 rays: one row a value. The beginning is the `RTCRay`.
#[derive(Clone)]
#[repr(C, align(64))]
pub struct Packet<const N: usize>([[f32; N]; ROWS]);

impl<const N: usize> Packet<N> {
    /// Rays that are not there.
    pub const EMPTY: Self = Self([[0.0; N]; ROWS]);

    /// Sets ray number `index`, which has hit nothing yet.
    pub fn set(&mut self, index: usize, ray: &Ray) {
        let Self(rows) = self;
        for axis in 0..3 {
            rows[axis][index] = ray.origin[axis];
            rows[4 + axis][index] = ray.direction[axis];
        }
        rows[T_MIN][index] = 0.0;
        rows[TIME][index] = 0.0;
        rows[T_MAX][index] = ray.t_max;
        rows[MASK][index] = f32::from_bits(u32::MAX);
        rows[MASK + 1][index] = 0.0;
        rows[MASK + 2][index] = 0.0;
        rows[GEOMETRY][index] = f32::from_bits(u32::MAX);
    }

    /// How far ray number `index` has gone to its nearest hit; infinitely far if there is none.
    pub fn distance(&self, index: usize) -> f32 {
        match self.0[GEOMETRY][index].to_bits() {
            u32::MAX => f32::INFINITY,
            _ => self.0[T_MAX][index],
        }
    }

    /// Whether the query for any hit has found one for ray number `index`.
    pub fn is_occluded(&self, index: usize) -> bool {
        self.0[T_MAX][index] == f32::NEG_INFINITY
    }
}

/// A query of a scene.
pub struct Queries<'s, const N: usize> {
    scene: &'s EmbreeScene<'s>,
    function: Function,
    arguments: Arguments,
}

/// By the number of rays that count.
static VALID: [Valid; 17] = {
    let mut all = [const { Valid([0; 16]) }; 17];
    let mut count = 0;
    while count <= 16 {
        let mut index = 0;
        while index < count {
            all[count].0[index] = -1;
            index += 1;
        }
        count += 1;
    }
    all
};

impl<const N: usize> Queries<'_, N> {
    /// Asks for the first `count` rays of a packet.
    #[inline(always)]
    pub fn ask(&self, packet: &mut Packet<N>, count: usize) {
        let rays = std::ptr::from_mut(packet).cast();
        // SAFETY: the scene is alive, and the packet is Embree's structure of as many rays as the
        // function is for. So is the mask, which is as long as the longest.
        unsafe {
            match self.function {
                Function::One(function) => function(self.scene.handle, rays, &self.arguments),
                Function::Many(function) => {
                    function(VALID[count].0.as_ptr(), self.scene.handle, rays, &self.arguments)
                }
            }
        }
    }
}

#[cfg(unix)]
fn open_library(file: &Path) -> Result<Handle, Box<dyn Error>> {
    use std::os::unix::ffi::OsStrExt;
    const RTLD_NOW: c_int = 2;
    let name = CString::new(file.as_os_str().as_bytes())?;
    // SAFETY: the name ends with a zero.
    let library = unsafe { dlopen(name.as_ptr(), RTLD_NOW) };
    match library.is_null() {
        false => Ok(library),
        true => Err(loader_error().into()),
    }
}

#[cfg(unix)]
fn symbol(library: Handle, name: &str) -> Result<Handle, Box<dyn Error>> {
    let text = CString::new(name)?;
    // SAFETY: the library is open, and the name ends with a zero.
    let address = unsafe { dlsym(library, text.as_ptr()) };
    match address.is_null() {
        false => Ok(address),
        true => Err(format!("the library has no {name}").into()),
    }
}

#[cfg(unix)]
fn loader_error() -> String {
    // SAFETY: null or a text that ends with a zero and stays until the next call.
    unsafe {
        let text = dlerror();
        if text.is_null() {
            return String::new();
        }
        std::ffi::CStr::from_ptr(text).to_string_lossy().into_owned()
    }
}

#[cfg(not(unix))]
fn open_library(_file: &Path) -> Result<Handle, Box<dyn Error>> {
    Err("Embree is opened on Unix only".into())
}

#[cfg(not(unix))]
fn symbol(_library: Handle, name: &str) -> Result<Handle, Box<dyn Error>> {
    Err(format!("no {name} without a library").into())
}
