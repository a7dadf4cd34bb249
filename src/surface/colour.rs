//! A colour of a surface: one for all of it, or a picture.

use super::Texture;
use crate::geometry::SurfacePoint;
use crate::math::Rgb;
use std::sync::Arc;

/// Each channel in [0, 1].
#[derive(Clone, Debug)]
pub enum Colour {
    /// The same everywhere.
    Even(Rgb),
    /// By a picture; of objects with texture coordinates.
    Picture(Arc<Texture>),
}

impl Colour {
    /// At a point.
    #[inline]
    pub fn at(&self, at: &SurfacePoint) -> Rgb {
        match self {
            Self::Even(colour) => *colour,
            Self::Picture(picture) => picture.at(at.uv),
        }
    }

    /// The mean of all of it.
    pub fn mean(&self) -> Rgb {
        match self {
            Self::Even(colour) => *colour,
            Self::Picture(picture) => picture.mean(),
        }
    }

    /// Each value made into another, in [0, 1].
    pub fn map(&self, of: impl Fn(Rgb) -> Rgb) -> Self {
        match self {
            Self::Even(colour) => Self::Even(of(*colour)),
            Self::Picture(picture) => Self::Picture(Arc::new(picture.map(of))),
        }
    }

    /// The picture, if it is one.
    pub fn picture(&self) -> Option<&Arc<Texture>> {
        match self {
            Self::Even(_) => None,
            Self::Picture(picture) => Some(picture),
        }
    }

    /// What `check` says of it.
    pub fn text(&self) -> String {
        match self {
            Self::Even(colour) => format!("{:?}", colour.0),
            Self::Picture(picture) => format!("by {}", picture.text()),
        }
    }
}

impl From<Rgb> for Colour {
    fn from(colour: Rgb) -> Self {
        Self::Even(colour)
    }
}
