//! Placeholder.
use super::{Hit, Ray, RayQuery};
use crate::geometry::Mesh;
pub struct Bvh;
impl Bvh {
    pub fn new(_meshes: &[&Mesh]) -> Self {
        Self
    }
}
impl RayQuery for Bvh {
    fn closest(&self, _ray: &Ray) -> Option<Hit> {
        None
    }
    fn occluded(&self, _ray: &Ray) -> bool {
        false
    }
    fn description(&self) -> String {
        String::new()
    }
}
