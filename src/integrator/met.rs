//! Lights that a render knows of but has not found: until then its halves agree about a picture that lacks them.

use super::Tally;
use crate::light::{CountedLight, Lights};
use crate::scene::Scene;
use crate::tally::LIGHTS;

/// Times that a light must have come before the render can tell its own error: some tens, for the spread of fewer is
/// not known.
const ENOUGH: u64 = 32;
/// A light that has never come when asked so often is hidden: were it open to one in 10 000 rays, one of them would have
/// found it with a chance of 99.9 %.
const HIDDEN_AFTER: u64 = 1 << 16;
/// So is one that no method can ask for, after so many samples.
const HIDDEN_AFTER_SAMPLES: u64 = 1 << 22;

/// The lights that a method adds to its picture.
#[derive(Clone, Debug, Default)]
pub struct KnownLights {
    lights: Vec<CountedLight>,
    /// Whether paths may meet lights that nothing asks for.
    by_chance: bool,
}

impl KnownLights {
    /// Those of `lights`, for a method that asks for them from every surface and medium that scatters.
    pub fn asked(scene: &Scene, lights: &Lights) -> Self {
        Self { lights: lights.counted(scene), by_chance: false }
    }

    /// The same, for a method whose paths also meet them through clear bodies and on mirrors.
    pub fn met(scene: &Scene, lights: &Lights) -> Self {
        let body = |o: &crate::scene::Object| scene.materials[o.material].surface.is_body();
        Self { lights: lights.counted(scene), by_chance: scene.objects.iter().any(body) }
    }

    /// The names of those that have come too seldom for an error to be told, after `samples` samples of pixels.
    pub fn not_met(&self, tally: &Tally, samples: u64) -> Vec<String> {
        let counts = &tally.rays.lights;
        let all: u64 = (0..LIGHTS).map(|light| counts.of(light)[0]).sum();
        let seldom = |light: &CountedLight| match counts.of(light.number) {
            [0, 0] if all == 0 => self.by_chance && samples < HIDDEN_AFTER_SAMPLES,
            // It has not been drawn yet, or every time it was it turned its dark side.
            [0, 0] => all as f64 * light.chance < HIDDEN_AFTER as f64,
            [asked, 0] => asked < HIDDEN_AFTER,
            [_, met] => met < ENOUGH,
        };
        // Those beyond the last have one count, and one name.
        let seldom = self.lights.iter().filter(|light| light.number < LIGHTS && seldom(light));
        seldom.map(|light| light.name.clone()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_is_not_met_until_it_came_often_or_is_hidden() {
        let light = |number, name: &str, chance| CountedLight { number, name: name.into(), chance };
        let known = KnownLights { lights: vec![light(0, "sun", 1.0), light(1, "lamp", 0.5)], by_chance: true };
        let mut tally = Tally::default();
        assert_eq!(known.not_met(&tally, 1000), ["sun", "lamp"]);
        assert!(known.not_met(&tally, 1 << 22).is_empty());
        assert!(KnownLights { by_chance: false, ..known.clone() }.not_met(&tally, 1000).is_empty());
        for _ in 0..31 {
            tally.rays.lights.ask(0, true);
            tally.rays.lights.meet(1);
        }
        assert_eq!(known.not_met(&tally, 1 << 30), ["sun", "lamp"], "31 of each");
        tally.rays.lights.meet(0);
        assert_eq!(known.not_met(&tally, 1000), ["lamp"]);
        // Behind a wall: held back for a while, then let go; found once, waited for.
        let mut hidden = Tally::default();
        for n in 0..1 << 16 {
            assert!(n == 0 || known.not_met(&hidden, 1).contains(&"lamp".to_string()));
            hidden.rays.lights.ask(1, false);
        }
        assert!(known.not_met(&hidden, 1).is_empty());
        hidden.rays.lights.ask(1, true);
        assert_eq!(known.not_met(&hidden, 1), ["lamp"]);
        // One of a million draws, and never drawn.
        let led = KnownLights { lights: vec![light(2, "led", 1e-6)], by_chance: false };
        assert_eq!(led.not_met(&hidden, 1), ["led"]);
        assert!(led.not_met(&Tally::default(), 1).is_empty(), "nothing asks");
    }
}
