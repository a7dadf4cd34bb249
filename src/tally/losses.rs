//! Paths that came where no light can be, or to no end: how many, at which object, and why.

use serde::{Deserialize, Serialize};

/// Why a path was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// It went through a hole of the object's mesh.
    Hole,
    /// It met the back of a face of a mesh whose faces disagree about the outside.
    WrongSide,
    /// The object's surface passes through itself, or parts of it lie in others.
    Blemish,
    /// Inside the object it met another medium.
    OtherMedium,
    /// It was given up: nothing absorbed it, surface after surface.
    Endless,
    /// The mesh is sound: a rounded coordinate came to lie on the other side of a face.
    Rounding,
}

/// Paths lost at one object for one cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Loss {
    /// Index of the object; of several objects beyond those that are counted apart, `u32::MAX`.
    pub object: u32,
    /// Why.
    pub cause: Cause,
    /// How many.
    pub paths: u64,
}

/// Counted apart.
const APART: usize = 8;

/// Counts of lost paths by object and cause; those of the first eight pairs, the rest together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Vec<Loss>", into = "Vec<Loss>")]
pub struct Losses {
    counts: [Option<Loss>; APART],
    others: u64,
}

/// More than this share of the paths lost is a warning, and an error for `--strict`.
pub const TOLERATED: f64 = 1e-3;

impl Losses {
    /// Those beyond the pairs that are counted apart.
    pub fn others(&self) -> u64 {
        self.others
    }

    /// One more.
    pub fn add(&mut self, object: u32, cause: Cause) {
        self.count(Loss { object, cause, paths: 1 });
    }

    fn count(&mut self, loss: Loss) {
        for place in &mut self.counts {
            match place {
                Some(known) if (known.object, known.cause) == (loss.object, loss.cause) => {
                    known.paths += loss.paths;
                    return;
                }
                None => {
                    *place = Some(loss);
                    return;
                }
                Some(_) => {}
            }
        }
        self.others += loss.paths;
    }

    /// Each object and cause apart.
    pub fn each(&self) -> impl Iterator<Item = &Loss> {
        self.counts.iter().flatten()
    }

    /// All of them.
    pub fn total(&self) -> u64 {
        self.each().map(|l| l.paths).sum::<u64>() + self.others
    }

    /// Whether that is more than [`TOLERATED`] of `paths`.
    pub fn are_many(&self, paths: u64) -> bool {
        self.total() as f64 > TOLERATED * paths as f64
    }
}

impl std::ops::AddAssign for Losses {
    fn add_assign(&mut self, other: Self) {
        other.each().for_each(|loss| self.count(*loss));
        self.others += other.others;
    }
}

impl From<Vec<Loss>> for Losses {
    fn from(list: Vec<Loss>) -> Self {
        let mut losses = Self::default();
        for loss in list {
            if loss.object == u32::MAX { losses.others += loss.paths } else { losses.count(loss) }
        }
        losses
    }
}

impl From<Losses> for Vec<Loss> {
    fn from(losses: Losses) -> Self {
        let others = Loss { object: u32::MAX, cause: Cause::Rounding, paths: losses.others };
        losses.each().copied().chain((losses.others > 0).then_some(others)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_forgotten_in_sums_and_files() {
        let mut losses = Losses::default();
        for object in 0..20 {
            for _ in 0..=object {
                losses.add(object, if object % 2 == 0 { Cause::Hole } else { Cause::Rounding });
            }
        }
        assert_eq!((losses.total(), losses.each().count()), (210, APART));
        let text = serde_json::to_string(&losses).unwrap();
        assert_eq!(serde_json::from_str::<Losses>(&text).unwrap(), losses);
        let mut twice = losses;
        twice += losses;
        assert_eq!(twice.total(), 420);
        assert!(losses.are_many(209_999) && !losses.are_many(210_000));
    }
}
