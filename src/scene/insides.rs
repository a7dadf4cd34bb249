//! What is inside what, once somebody has asked.

use super::Obstacle;
use crate::geometry::Union;
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

/// What is inside what in a scene, once somebody has asked; see [`super::Scene::obstacles`].
#[derive(Default)]
pub struct Insides(pub(super) OnceLock<Found>);

/// What was found.
#[derive(Default)]
pub(super) struct Found {
    pub obstacles: Vec<Obstacle>,
    pub camera_in: Vec<(u32, u32)>,
    pub nests: Nests,
    /// For each object whose closed parts meet, what of them is the surface of their union.
    pub unions: Vec<Option<Arc<Union>>>,
}

/// Bodies that overlap or touch: which of them is where. One entry in each list for each object.
#[derive(Debug, Default)]
pub struct Nests {
    /// The place among all, from the weakest to the strongest: where bodies overlap, the strongest is there. The higher
    /// priority is stronger, of equals the body of smaller volume, of equal volumes the later in the file.
    pub rank: Vec<u32>,
    /// Whether a body has something in common with another, or with itself.
    pub meets: Vec<bool>,
    /// Its triangles that lie in those of other bodies.
    pub contacts: Vec<Contacts>,
    /// What lies in each other is no farther apart [unit].
    pub gap: f64,
}

/// For triangles of one body, those that lie in them.
pub type Contacts = HashMap<u32, Vec<Partner>>;

/// A triangle that lies in another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Partner {
    /// Its object.
    pub object: u32,
    /// The part of the object that it belongs to.
    pub part: u32,
    /// Its number in the object's mesh.
    pub triangle: u32,
}
