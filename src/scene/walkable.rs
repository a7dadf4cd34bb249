//! Which bodies paths walk through beside their model, and why not the others.

use super::options::Shape;
use super::{Obstacle, ObstacleKind, Scene};
use crate::bssrdf::ModelName;
use crate::words::digits;

/// Collisions of a walk, in the mean, from which a pass takes many seconds.
const LONG: f64 = 3000.0;
/// And from which nobody walks who has not asked for it: a pass takes some.
const LONG_UNASKED: f64 = 1000.0;

/// What decides how much light leaves a body where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExitanceBy {
    /// Its model alone, as asked for; or it is not translucent.
    Model,
    /// Its model alone, for this keeps paths from walking through it.
    ModelFor(String),
    /// Paths that walk through it; the model has what is finer than a patch of its surface.
    Walks,
}

impl Scene {
    /// What decides how much light leaves the object of number `object` under `shape`.
    pub fn exitance_by(&self, object: u32, shape: Shape) -> ExitanceBy {
        let Some(t) = &self.surface(object).inside else { return ExitanceBy::Model };
        match shape {
            Shape::HalfSpace => return ExitanceBy::Model,
            Shape::Walked => return ExitanceBy::Walks,
            Shape::Auto if t.model != ModelName::AUTO => return ExitanceBy::Model,
            Shape::Auto => {}
        }
        let long = || {
            let collisions = digits(self.collisions(object).filter(|c| *c > LONG_UNASKED)?, 2);
            Some(format!("a walk through it has some {collisions} collisions: to a body so thick a plane is near"))
        };
        let barred = self.not_walkable(object).into_iter().next();
        barred.or_else(long).map_or(ExitanceBy::Walks, ExitanceBy::ModelFor)
    }

    /// What keeps paths from walking through the object of number `object`, beside its model; empty where nothing does.
    pub fn not_walkable(&self, object: u32) -> Vec<String> {
        let own = &self.objects[object as usize];
        let mut why = Vec::new();
        let of_it = |o: &&Obstacle| o.objects.contains(&own.name);
        why.extend(self.obstacles().iter().filter(of_it).filter_map(Obstacle::refusal));
        let head = format!("{}: object {:?}", own.at, own.name);
        if why.is_empty() && own.findings.inside_out() {
            why.push(format!("{head} has faces that look inwards: --repair turns them"));
        }
        if self.has(own, ObstacleKind::Holes) {
            why.push(format!("{head} has holes, out of which walks do not come back: close them"));
        }
        let with_another = self.obstacles().iter().filter(of_it).any(|o| o.objects.len() > 1);
        if self.nests().meets[object as usize] && self.union(object).is_none() || with_another {
            why.push(format!(
                "{head} touches or overlaps another body, and is walked through as if alone: take --method volume_path"
            ));
        }
        if self.camera_in().iter().any(|c| c.0 == object) {
            why.push(format!("{head} has the camera in it: take --method volume_path"));
        }
        why
    }

    /// How often a walk through the object of number `object` is scattered in the mean, in the densest channel: in a body of volume V and
    /// surface S light that enters flies η² 4V/S, whatever its shape, if nothing is absorbed.
    fn collisions(&self, object: u32) -> Option<f64> {
        let t = self.surface(object).inside.as_ref()?;
        let shape = self.body(object)?.shape()?;
        let twice_volume_by_surface = shape.thickness / (1.0 + (shape.curvature * shape.thickness).max(0.0));
        Some(2.0 * f64::from(t.medium.eta).powi(2) * twice_volume_by_surface * f64::from(t.medium.sigma_t().max()))
    }

    /// That walks through the object of number `object` take long.
    pub fn long_walks(&self, object: u32) -> Option<String> {
        let collisions = self.collisions(object).filter(|c| *c > LONG)?;
        let own = &self.objects[object as usize];
        Some(format!(
            "{}: object {:?}: a walk through it has some {} collisions, so that passes take long; to a body so thick a plane is near: \
             leave out `shape = \"walked\"`",
            own.at,
            own.name,
            digits(collisions, 2)
        ))
    }
}
