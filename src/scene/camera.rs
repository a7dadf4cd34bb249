//! From a place in the picture to a ray: pinhole, lens or parallel rays.

use super::lens::Lens;
use crate::math::{DVec3, Vec3};
use crate::query::Ray;
use crate::sampling::{PixelFilter, PixelStream};

/// A camera; the film's row 0 is at the top, x grows to the right.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Pixels across and down.
    pub resolution: [u32; 2],
    /// Pinhole, or the lens's middle; of parallel rays the middle of the plane they start on \[unit\], relative to the scene's centre.
    pub origin: DVec3,
    /// How samples lie around a pixel.
    pub filter: PixelFilter,
    /// Unit direction of view.
    forward: Vec3,
    /// The film's middle: of a perspective at distance 1, of parallel rays from `origin` \[unit\].
    middle: Vec3,
    /// Film axis to the right, its length half the film's width at distance 1; of parallel rays \[unit\].
    right: Vec3,
    /// Film axis upwards, its length half the film's height, as `right`.
    up: Vec3,
    /// Unit directions to the right and upwards.
    axes: [Vec3; 2],
    /// Whether all rays through the lens's middle are parallel.
    parallel: bool,
    /// `None`: a pinhole.
    lens: Option<Lens>,
}

/// Key of the numbers of grids.
const GRID: u64 = 0x6c65_6e73;

impl Camera {
    /// A pinhole at `origin` looking along `forward`; `up` need not be orthogonal. `half_width` and `half_height`
    /// are the tangents of half the angles of view. `None` if `forward` and `up` are parallel or zero.
    pub fn new(
        resolution: [u32; 2],
        origin: DVec3,
        forward: Vec3,
        up: Vec3,
        half_width: f32,
        half_height: f32,
    ) -> Option<Self> {
        let forward = forward.try_normalize()?;
        let right = forward.cross(up).try_normalize()?;
        let up = right.cross(forward);
        let (axes, filter) = ([right, up], PixelFilter::default());
        let (right, up) = (right * half_width, up * half_height);
        Some(Self {
            resolution,
            origin,
            filter,
            forward,
            middle: forward,
            right,
            up,
            axes,
            parallel: false,
            lens: None,
        })
    }

    /// The same with parallel rays; half of the width and height are now those of what is seen \[unit\].
    #[must_use]
    pub fn orthographic(self) -> Self {
        Self { middle: self.middle - self.forward, parallel: true, ..self }
    }

    /// The same with the picture moved over the film, by shares of its width to the right and of its height upwards.
    #[must_use]
    pub fn shifted(self, [x, y]: [f32; 2]) -> Self {
        if [x, y] == [0.0; 2] {
            return self;
        }
        Self { middle: self.middle + self.right * (2.0 * x) + self.up * (2.0 * y), ..self }
    }

    /// The same with a lens in place of the pinhole.
    #[must_use]
    pub fn with_lens(self, lens: Lens) -> Self {
        Self { lens: Some(lens), ..self }
    }

    /// Unit direction of view.
    pub fn forward(&self) -> Vec3 {
        self.forward
    }

    /// Whether its rays are parallel.
    pub fn is_orthographic(&self) -> bool {
        self.parallel
    }

    /// A place of the film, relative to `origin`.
    #[inline]
    fn film(&self, pixel: [u32; 2], offset: [f32; 2]) -> Vec3 {
        let [x, y] = [0, 1].map(|a| (pixel[a] as f32 + offset[a]) / self.resolution[a] as f32 * 2.0 - 1.0);
        self.middle + self.right * x - self.up * y
    }

    /// The ray through the lens's middle and `offset` of a pixel: from 0 to 1 in the pixel itself.
    #[inline]
    pub fn ray(&self, pixel: [u32; 2], offset: [f32; 2]) -> Ray {
        let film = self.film(pixel, offset);
        if self.parallel {
            return Ray::new(self.origin + film.as_dvec3(), self.forward);
        }
        Ray::new(self.origin, film.normalize())
    }

    /// The ray through a place `eye` of the lens, in its radii to the right and upwards, that meets [`Self::ray`] in focus.
    #[inline]
    pub fn ray_from(&self, pixel: [u32; 2], offset: [f32; 2], eye: [f32; 2]) -> Ray {
        let Some(lens) = &self.lens else { return self.ray(pixel, offset) };
        let film = self.film(pixel, offset);
        let place = (self.axes[0] * eye[0] + self.axes[1] * eye[1]) * lens.radius;
        let (from, towards) = if self.parallel { (film, self.forward) } else { (Vec3::ZERO, film) };
        // Both meet at towards x focus, whose distance along the view is the focus: that of `towards` is 1.
        Ray::new(self.origin + (from + place).as_dvec3(), (towards - place / lens.focus).normalize())
    }

    /// The ray of a sample of a pixel: by the filter from `place` in [0,1)², the first pair of `stream`; through a place of the lens
    /// from the second, which lies in the same set of four: both are stratified together. A pinhole leaves that pair to others.
    #[inline]
    pub fn sample(&self, pixel: [u32; 2], place: [f32; 2], stream: &mut PixelStream) -> Ray {
        let offset = self.filter.offset(place);
        match &self.lens {
            None => self.ray(pixel, offset),
            Some(lens) => self.ray_from(pixel, offset, lens.place(stream.next_2d())),
        }
    }

    /// [`Self::ray`] for a grid over the picture; the rays of a lens go through places of it that lie evenly over any run of numbers.
    #[inline]
    pub fn grid_ray(&self, pixel: [u32; 2], offset: [f32; 2], number: u32) -> Ray {
        match &self.lens {
            None => self.ray(pixel, offset),
            Some(lens) => self.ray_from(pixel, offset, lens.place(PixelStream::new(GRID, 0, number).next_2d())),
        }
    }

    /// Places of the lens between which all of it lies, its middle first; of a pinhole that alone.
    pub fn eyes(&self) -> Vec<[f32; 2]> {
        std::iter::once([0.0; 2]).chain(self.lens.iter().flat_map(Lens::rim)).collect()
    }

    /// Middle and half edges of the rectangle in which all rays start \[unit\]; `None` where that is one point.
    pub fn window(&self) -> Option<[DVec3; 3]> {
        let radius = self.lens.map_or(0.0, |lens| lens.radius);
        if !self.parallel && radius == 0.0 {
            return None;
        }
        let reach = self.filter.reach();
        let edge = |a: usize, film: Vec3| {
            let half =
                if self.parallel { film.length() * (1.0 + 2.0 * reach / self.resolution[a] as f32) } else { 0.0 };
            (self.axes[a] * (half + radius)).as_dvec3()
        };
        let middle = if self.parallel { self.origin + self.middle.as_dvec3() } else { self.origin };
        Some([middle, edge(0, self.right), edge(1, self.up)])
    }
}
