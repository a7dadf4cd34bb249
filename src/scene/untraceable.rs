//! Whether `volume_path` can trace a body: the one place that advice about it asks.

use super::{ObstacleKind, Scene};

impl Scene {
    /// Why `volume_path` cannot trace object number `object` rightly, in a few words; `None` where it can. A scene that is
    /// refused for another object is no better.
    pub fn untraceable(&self, object: u32) -> Option<String> {
        let object = &self.objects[object as usize];
        let own = |names: &[String]| names.contains(&object.name);
        // With small holes paths are traced and lost, a warning says how many: nothing to recommend.
        let loses = |kind| matches!(kind, ObstacleKind::Holes | ObstacleKind::Unknown);
        let bars = self.obstacles().iter().filter(|o| o.refusal().is_some() || loses(o.kind) && own(&o.objects));
        let first = bars.min_by_key(|o| !own(&o.objects));
        let what = first.map(|o| o.what.replacen(&format!("object {:?}: ", object.name), "", 1));
        what.or_else(|| object.findings.inside_out().then(|| "its faces look inwards".into()))
    }
}
