//! The system's Embree 3 or 4 through the C layer in `wrapper/`, which owns Embree's types and checks the library at start.

use std::ffi::{CStr, c_char, c_int};
use std::ptr::NonNull;

use super::{Hit, Ray, RayQuery, has_area, rounded};
use crate::error::{Error, Result};
use crate::geometry::Mesh;
use crate::math::Vec3;

/// Declarations that `bindgen` made of `wrapper/marmor_embree.h`.
mod ffi {
    #![allow(dead_code, missing_docs, non_camel_case_types, non_upper_case_globals, clippy::all)] // generated
    include!(concat!(env!("OUT_DIR"), "/marmor_embree.rs"));
}

// The wrapper asserts the same sizes; positions and indices go over as plain arrays.
const _: () = assert!(size_of::<ffi::MarmorRay>() == 32 && size_of::<ffi::MarmorHit>() == 20);
const _: () = assert!(size_of::<Vec3>() == 12 && align_of::<Vec3>() == align_of::<f32>());

/// Rays that cross the border together.
const BATCH: usize = 64;

/// A committed Embree scene.
pub struct Embree {
    scene: Scene,
}

impl Embree {
    /// Copies the meshes into Embree and builds its tree, on Embree's own threads.
    ///
    /// # Errors
    /// A usage error with Embree's own text if the library fails its self-check or reports an error.
    pub fn new(meshes: &[&Mesh]) -> Result<Self> {
        let sizes = meshes.iter().flat_map(|m| &m.positions).map(|p| p.abs().max_element());
        let mut scene = Scene::open(sizes.fold(0.0, f64::max) as f32)?;
        for (number, mesh) in meshes.iter().enumerate() {
            scene.add(number as u32, mesh)?;
        }
        scene.commit()?;
        Ok(Self { scene })
    }
}

impl RayQuery for Embree {
    #[inline]
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        let ray = ffi::MarmorRay::from(ray);
        let mut hit = ffi::MarmorHit::default();
        // SAFETY: the scene is committed, unchanged since, and lives until `drop`; `ray` and `hit` are valid for the
        // call, and the wrapper keeps neither pointer.
        let found = unsafe { ffi::marmor_scene_closest(self.scene.0.as_ptr(), &ray, &mut hit) };
        (found as u32 == ffi::MARMOR_HIT).then(|| hit.into())
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        let ray = ffi::MarmorRay::from(ray);
        // SAFETY: as in `closest`.
        let found = unsafe { ffi::marmor_scene_occluded(self.scene.0.as_ptr(), &ray) };
        found as u32 == ffi::MARMOR_HIT
    }

    fn closest_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let empty = (ffi::MarmorRay::default(), ffi::MarmorHit::default());
        for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            let (mut asked, mut told, mut found) = ([empty.0; BATCH], [empty.1; BATCH], [0_u8; BATCH]);
            for (asked, ray) in asked.iter_mut().zip(rays) {
                *asked = ray.into();
            }
            let (asked, count) = (asked.as_ptr(), rays.len() as u32);
            let (to, flags) = (told.as_mut_ptr(), found.as_mut_ptr());
            // SAFETY: as in `closest`; all three arrays have room for `BATCH` entries, and `count` is no more.
            unsafe { ffi::marmor_scene_closest_batch(self.scene.0.as_ptr(), asked, count, to, flags) };
            for (i, hit) in hits.iter_mut().enumerate() {
                *hit = (u32::from(found[i]) == ffi::MARMOR_HIT).then(|| told[i].into());
            }
        }
    }

    fn occluded_batch(&self, rays: &[Ray], out: &mut [bool]) {
        for (rays, out) in rays.chunks(BATCH).zip(out.chunks_mut(BATCH)) {
            let (mut asked, mut found) = ([ffi::MarmorRay::default(); BATCH], [0_u8; BATCH]);
            for (asked, ray) in asked.iter_mut().zip(rays) {
                *asked = ray.into();
            }
            let (asked, flags, count) = (asked.as_ptr(), found.as_mut_ptr(), rays.len() as u32);
            // SAFETY: as in `closest_batch`.
            unsafe { ffi::marmor_scene_occluded_batch(self.scene.0.as_ptr(), asked, count, flags) };
            for (out, found) in out.iter_mut().zip(found) {
                *out = u32::from(found) == ffi::MARMOR_HIT;
            }
        }
    }

    fn description(&self) -> String {
        // SAFETY: the scene lives until `drop`; the call only reads it.
        let version = unsafe { ffi::marmor_scene_version(self.scene.0.as_ptr()) };
        format!("embree {}.{}.{} (robust)", version / 10_000, version / 100 % 100, version % 100)
    }

    fn bytes(&self) -> Option<usize> {
        // SAFETY: as in `description`; the count is atomic.
        Some(unsafe { ffi::marmor_scene_bytes(self.scene.0.as_ptr()) } as usize)
    }
}

impl From<&Ray> for ffi::MarmorRay {
    #[inline]
    fn from(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.as_vec3().to_array(),
            t_min: ray.t_min,
            direction: ray.direction.to_array(),
            t_max: ray.t_max,
        }
    }
}

impl From<ffi::MarmorHit> for Hit {
    #[inline]
    fn from(hit: ffi::MarmorHit) -> Self {
        Self { t: hit.t, mesh: hit.mesh, triangle: hit.triangle, u: hit.u.into(), v: hit.v.into() }
    }
}

/// The wrapper's scene; closed on drop.
struct Scene(NonNull<ffi::MarmorScene>);

// SAFETY: the wrapper's scene belongs to no thread: Embree's objects may be used and released on any.
unsafe impl Send for Scene {}
// SAFETY: shared references allow queries and counters alone, which Embree documents as safe on many threads at once
// after the commit; what changes the scene takes `&mut`.
unsafe impl Sync for Scene {}

impl Scene {
    /// A device that passed its checks, with an empty scene for coordinates of up to `largest` [unit].
    fn open(largest: f32) -> Result<Self> {
        let mut scene = std::ptr::null_mut();
        // SAFETY: `scene` and the message buffer are valid for the call.
        checked(|message, bytes| unsafe { ffi::marmor_scene_open(&mut scene, largest, message, bytes) })?;
        let scene =
            NonNull::new(scene).ok_or_else(|| Error::usage("backend `embree`: no scene and no reason given"))?;
        Ok(Self(scene))
    }

    /// Copies a mesh in; its triangles without area cannot be hit.
    fn add(&mut self, number: u32, mesh: &Mesh) -> Result<()> {
        let count = |what: &str, n: usize| {
            u32::try_from(n).map_err(|_| Error::usage(format!("backend `embree`: mesh {number} has too many {what}")))
        };
        let (vertices, triangle_count) =
            (count("vertices", mesh.positions.len())?, count("triangles", mesh.triangles.len())?);
        // In single precision a triangle without area can get some: three equal corners cannot, and numbers stay.
        let triangles: Vec<[u32; 3]> = (0..triangle_count)
            .map(|t| {
                let corners = mesh.triangles[t as usize];
                if has_area(rounded(mesh, t)) { corners } else { [corners[0]; 3] }
            })
            .collect();
        let positions: Vec<Vec3> = mesh.positions.iter().map(|p| p.as_vec3()).collect();
        let (positions, indices) = (positions.as_ptr().cast::<f32>(), triangles.as_ptr().cast::<u32>());
        // SAFETY: the scene is open. `positions` has three floats for each of `vertices` and `indices` three numbers for
        // each of `triangle_count` (sizes asserted above), each below `vertices`, as `rounded` has read every corner;
        // the wrapper copies both and keeps no pointer.
        checked(|message, bytes| unsafe {
            ffi::marmor_scene_add(self.0.as_ptr(), number, positions, vertices, indices, triangle_count, message, bytes)
        })
        .map_err(|e| e.within(format!("mesh {number}")))
    }

    /// Builds the tree.
    fn commit(&mut self) -> Result<()> {
        // SAFETY: the scene is open and nobody else uses it: `&mut`.
        checked(|message, bytes| unsafe { ffi::marmor_scene_commit(self.0.as_ptr(), message, bytes) })
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: the pointer came from `marmor_scene_open` and is closed once.
        unsafe { ffi::marmor_scene_close(self.0.as_ptr()) }
    }
}

/// Turns a status and the text in the message buffer into a usage error.
fn checked(call: impl FnOnce(*mut c_char, u32) -> c_int) -> Result<()> {
    let mut message = [0_u8; 1024];
    let status = call(message.as_mut_ptr().cast(), message.len() as u32);
    if status as u32 == ffi::MARMOR_OK {
        return Ok(());
    }
    let text = CStr::from_bytes_until_nul(&message).unwrap_or_default().to_string_lossy();
    Err(Error::usage(format!("backend `embree`: {text}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;

    #[test]
    fn a_device_error_comes_back_as_embrees_own_text() {
        let mut scene = Scene::open(1.0).unwrap();
        // More vertices than Embree can count bytes for is refused by Embree, not by us.
        let message = checked(|message, bytes| {
            // SAFETY: Embree fails before anything is read: no buffer of this size can be made.
            unsafe {
                ffi::marmor_scene_add(
                    scene.0.as_ptr(),
                    0,
                    std::ptr::null(),
                    u32::MAX,
                    std::ptr::null(),
                    u32::MAX,
                    message,
                    bytes,
                )
            }
        })
        .unwrap_err()
        .to_string();
        assert!(message.starts_with("backend `embree`: ") && message.contains('('), "{message}");
        // The scene goes on, without the error.
        scene.commit().unwrap();
    }

    #[test]
    fn memory_is_counted() {
        let mesh = Mesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![[0, 1, 2]; 1000],
            ..Mesh::default()
        };
        let backend = Embree::new(&[&mesh]).unwrap();
        assert!(backend.bytes().unwrap() > 1000 * 12);
        assert!(backend.description().starts_with("embree "));
    }
}
