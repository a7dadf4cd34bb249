//! `[camera]` as typed, and the camera made of it.

use super::options::named;
use super::tree::{Fields, Node};
use super::values::{named_value, unit_vector, vector};
use super::{Camera, Lens};
use crate::error::{Error, Result};
use crate::math::{DVec3, Vec3};
use crate::sampling::PixelFilter;

/// `[camera]`.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraEntry {
    /// Pinhole or middle of the lens; of an orthographic camera the middle of the plane that rays start on \[unit\].
    pub position: DVec3,
    /// A point in the middle of the picture, but for `shift` \[unit\].
    pub look_at: DVec3,
    /// Upwards in the picture, of any length; need not be orthogonal to the view.
    pub up: DVec3,
    /// How much is seen.
    pub projection: Projection,
    /// A lens in place of a pinhole.
    pub lens: Option<LensEntry>,
    /// How far the picture is moved over the film, in shares of its width to the right and of its height upwards; -10 to 10.
    pub shift: [f64; 2],
    /// Pixels across and down, 1 to 65536 each.
    pub resolution: [u32; 2],
    /// File and line of what makes rays start in more places than one, else of `[camera]`; for messages.
    pub at: String,
}

/// How much is seen, and how it becomes a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Projection {
    /// All rays through one point.
    Perspective {
        /// Full angle of view \[degrees\], in (0, 180).
        fov: f64,
        /// The side of the picture that `fov` spans.
        fov_axis: FovAxis,
    },
    /// All rays parallel.
    Orthographic {
        /// Of what is seen \[unit\], above 0.
        height: f64,
    },
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensEntry {
    /// Diameter; with blades that of the circle through their corners \[unit\], above 0.
    pub aperture: f64,
    /// Distance along the view of what is sharp \[unit\], above 0.
    pub focus: f64,
    /// Sides of the polygon that it is, 3 to 64; 0 for a round one.
    pub blades: u32,
    /// Angle of the polygon's first corner, counterclockwise from upwards as seen from behind the camera \[degrees\].
    pub blade_turn: f64,
}

named! {
    /// A side of the picture.
    FovAxis, "side of the picture",
    /// Bottom to top.
    Vertical = "vertical",
    /// Left to right.
    Horizontal = "horizontal",
    /// Whichever has fewer pixels.
    Smaller = "smaller"
}

named! {
    /// [`Projection`] by name.
    ProjectionName, "projection",
    /// All rays through one point.
    Perspective = "perspective",
    /// All rays parallel.
    Orthographic = "orthographic"
}

const POINT: &str = "three numbers [x, y, z]";
/// A lens's radius over its focus, at most: rays beyond are all but parallel to the lens.
const WIDEST: f64 = 1000.0;

/// `[camera]` of a file.
pub(super) fn read(top: &Fields<'_>) -> Result<CameraEntry> {
    let expected = "a [camera] with position, look_at, fov and resolution";
    let c = top.table("camera")?.ok_or_else(|| top.missing("camera", expected))?;
    let keys = [
        "position",
        "look_at",
        "up",
        "projection",
        "fov",
        "fov_axis",
        "height",
        "aperture",
        "focus",
        "blades",
        "blade_turn",
        "shift",
        "resolution",
    ];
    c.only("[camera]", &keys)?;
    let side = |v: f64| (1.0..=65536.0).contains(&v) && v.fract() == 0.0;
    let position = c.need("position", POINT, vector)?;
    let look_at = c.need("look_at", POINT, vector)?;
    let up = c.get("up", "three numbers [x, y, z], not all 0", |n| vector(n).filter(|v| *v != DVec3::ZERO))?;
    let projection = projection(&c)?;
    let resolution = c.need("resolution", "[width, height], each a whole number from 1 to 65536", |n| {
        n.numbers::<2>().filter(|wh| wh.iter().all(|v| side(*v))).map(|wh| wh.map(|v| v as u32))
    })?;
    let view = unit_vector(look_at - position).ok_or_else(|| {
        c.error_at("look_at", "is the same point as `camera.position`; expected a point in front of the camera")
    })?;
    let up = up.unwrap_or(DVec3::Y);
    let aside = unit_vector(up).map_or(0.0, |up| up.cross(view).length());
    if aside < 1e-6 {
        return Err(c.error_at(
            if c.has("up") { "up" } else { "look_at" },
            format_args!("leaves the view parallel to up ({up}); set `up` to another direction"),
        ));
    }
    let lens = lens(&c, position, look_at, view)?;
    let shares = "[x, y], shares of the picture's width and height from -10 to 10";
    let moved = |n: &Node| n.numbers::<2>().filter(|xy| xy.iter().all(|v| v.abs() <= 10.0));
    let shift = c.get("shift", shares, moved)?.unwrap_or([0.0; 2]);
    let at = c.at_key(if lens.is_some() { "aperture" } else { "projection" });
    Ok(CameraEntry { position, look_at, up, projection, lens, shift, resolution, at })
}

fn projection(c: &Fields<'_>) -> Result<Projection> {
    let height = c.get("height", "a length above 0", |n| n.number().filter(|v| *v > 0.0))?;
    if named_value(c, "projection")? == Some(ProjectionName::Orthographic) {
        for key in ["fov", "fov_axis"] {
            if c.has(key) {
                return Err(c.error_at(
                    key,
                    "stands beside projection = \"orthographic\", which has no angle of view; give `height`, the \
                     height of what is seen, in its place",
                ));
            }
        }
        let height = height.ok_or_else(|| c.missing("height", "a length above 0, the height of what is seen"))?;
        return Ok(Projection::Orthographic { height });
    }
    if height.is_some() {
        return Err(c.error_at(
            "height",
            "is of an orthographic camera; add projection = \"orthographic\", or give `fov` in its place",
        ));
    }
    let fov = c.need("fov", "degrees above 0 and below 180", |n| n.number().filter(|v| *v > 0.0 && *v < 180.0))?;
    Ok(Projection::Perspective { fov, fov_axis: named_value(c, "fov_axis")?.unwrap_or(FovAxis::Vertical) })
}

fn lens(c: &Fields<'_>, position: DVec3, look_at: DVec3, view: DVec3) -> Result<Option<LensEntry>> {
    let aperture = c.get("aperture", "the diameter of the lens, 0 for a pinhole", |n| {
        n.number().filter(|v| *v == 0.0 || *v > 0.0 && (*v as f32).is_normal())
    })?;
    if aperture.is_none()
        && let Some(key) = ["focus", "blades", "blade_turn"].into_iter().find(|key| c.has(key))
    {
        return Err(c.error_at(
            key,
            "is of a lens, and the camera is a pinhole: add `aperture`, the diameter of the lens, or remove it",
        ));
    }
    let distance = (look_at - position).length();
    let expected = "a distance above 0 along the view, or a point [x, y, z]";
    let focus = c.get("focus", expected, |n| {
        let along = |point: DVec3| (point - position).dot(view);
        n.number().filter(|v| *v > 0.0).or_else(|| vector(n).map(along)).filter(|v| v.is_finite())
    })?;
    let focus = focus.unwrap_or(distance);
    if focus <= 0.0 {
        let what = "is a point that is not in front of the camera";
        return Err(c.error_at("focus", format_args!("{what} ({focus} units along the view); take one that is seen")));
    }
    let expected = "0 for a round lens, or a whole number from 3 to 64";
    let sides = |n: &Node| n.integer().filter(|i| *i == 0 || (3..=64).contains(i)).map(|i| i as u32);
    let blades = c.get("blades", expected, sides)?.unwrap_or(0);
    let turn = c.get("blade_turn", "degrees from -360 to 360", |n| n.number().filter(|v| v.abs() <= 360.0))?;
    let blade_turn = turn.unwrap_or(0.0);
    let Some(aperture) = aperture.filter(|a| *a > 0.0) else { return Ok(None) };
    if 0.5 * aperture > WIDEST * focus || !(focus as f32).is_normal() {
        return Err(c.error_at(
            "aperture",
            format_args!(
                "is {aperture}, more than {} times the distance of what is sharp, {focus}; take a smaller one or set `focus`",
                2.0 * WIDEST
            ),
        ));
    }
    Ok(Some(LensEntry { aperture, focus, blades, blade_turn }))
}

impl CameraEntry {
    /// The camera, relative to the scene's `centre`; `path` is the scene's, for messages.
    ///
    /// # Errors
    /// A scene error if single precision has no place for it.
    pub(super) fn camera(&self, path: &std::path::Path, centre: DVec3, filter: PixelFilter) -> Result<Camera> {
        let [width, height] = self.resolution.map(f64::from);
        let (half_width, half_height) = match self.projection {
            Projection::Perspective { fov, fov_axis } => {
                let tangent = (0.5 * fov).to_radians().tan();
                let vertical = match fov_axis {
                    FovAxis::Vertical => true,
                    FovAxis::Horizontal => false,
                    FovAxis::Smaller => height <= width,
                };
                if vertical { (tangent * width / height, tangent) } else { (tangent, tangent * height / width) }
            }
            Projection::Orthographic { height: seen } => (0.5 * seen * width / height, 0.5 * seen),
        };
        let single = |v: DVec3| unit_vector(v).unwrap_or(DVec3::ZERO).as_vec3();
        let origin = self.position - centre;
        let [half_width, half_height] = [half_width as f32, half_height as f32];
        let (view, up) = (single(self.look_at - self.position), single(self.up));
        let built: Option<Camera> = Camera::new(self.resolution, origin, view, up, half_width, half_height);
        let film = Vec3::new(half_width, half_height, 0.0);
        // Lengths are squared on the way.
        let fits = |v: f32| v.is_finite() && (v * v).is_finite() && (v * v).is_normal();
        let orthographic = matches!(self.projection, Projection::Orthographic { .. });
        let held = origin.as_vec3().is_finite()
            && film.is_finite()
            && (!orthographic || fits(half_width) && fits(half_height));
        let camera = built.filter(|_| held).ok_or_else(|| {
            Error::scene(format!("{}: `camera` cannot be held in single precision; bring it nearer", path.display()))
        })?;
        let camera = if orthographic { camera.orthographic() } else { camera };
        let mut camera = camera.shifted(self.shift.map(|v| v as f32));
        camera.filter = filter;
        Ok(match self.lens {
            None => camera,
            Some(LensEntry { aperture, focus, blades, blade_turn }) => camera.with_lens(Lens {
                radius: (0.5 * aperture) as f32,
                focus: focus as f32,
                blades,
                turn: blade_turn.to_radians() as f32,
            }),
        })
    }
}
