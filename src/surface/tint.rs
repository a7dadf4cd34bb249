//! Pigment on the boundary of a body.

use super::{Texture, Wrap};
use crate::geometry::SurfacePoint;
use crate::math::Rgb;
use std::sync::Arc;

/// A layer of pigment too thin to scatter, on the inner side of a boundary: of light that is let through, inwards or outwards, it lets this
/// share pass, each time. What the boundary reflects, on either side, has not been through it. So light that enters at x and leaves at y is worth
/// `at(x) at(y)` times what it is without: reciprocal, and never more than has entered.
#[derive(Clone, Debug)]
pub struct Tint {
    shares: Arc<Texture>,
    is_picture: bool,
}

impl Tint {
    /// The same everywhere; each channel in [0, 1].
    pub fn even(share: Rgb) -> Self {
        Self { shares: Arc::new(Texture::new("a colour".into(), 1, vec![share], Wrap::Repeat)), is_picture: false }
    }

    /// By a picture; of bodies with texture coordinates.
    pub fn picture(shares: Arc<Texture>) -> Self {
        Self { shares, is_picture: true }
    }

    /// Share of each channel that passes at a point, in [0, 1].
    #[inline]
    pub fn at(&self, at: &SurfacePoint) -> Rgb {
        self.shares.at(at.uv)
    }

    /// The picture; one texel where it is the same everywhere.
    pub fn shares(&self) -> &Arc<Texture> {
        &self.shares
    }

    /// Whether points need texture coordinates.
    pub fn is_picture(&self) -> bool {
        self.is_picture
    }

    /// What `check` says of it.
    pub fn text(&self) -> String {
        if self.is_picture {
            format!("tint by {}", self.shares.text())
        } else {
            format!("tint {:?}", self.shares.mean().0)
        }
    }
}
