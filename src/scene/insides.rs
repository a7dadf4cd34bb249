//! What is inside what, once somebody has asked.

use super::Obstacle;
use std::sync::OnceLock;

/// What is inside what in a scene, once somebody has asked; see [`super::Scene::obstacles`].
#[derive(Debug, Default)]
pub struct Insides(pub(super) OnceLock<Found>);

/// What was found.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub obstacles: Vec<Obstacle>,
    pub camera_in: Option<u32>,
}
