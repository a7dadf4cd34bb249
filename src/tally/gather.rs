//! What gathering over cached samples cost.

/// What gathering cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct GatherTally {
    /// Samples attempted by all fills.
    pub samples: u64,
    /// Of these, samples that carry light.
    pub lit: u64,
    /// Samples of light that came over other surfaces.
    pub indirect: u64,
    /// Exit points gathered at.
    pub exits: u64,
    /// Nodes of trees visited.
    pub nodes: u64,
    /// Pairs of exit point and cached sample looked at.
    pub pairs: u64,
    /// Points of the near field found along the lines of some exits.
    pub near_points: u64,
    /// Pairs of an exit and a point of the near field, where S_d was evaluated.
    pub near: u64,
    /// Pairs where S_d was evaluated: those kept by rejection control, all of a plain sum, or those in a cut.
    pub evaluated: u64,
    /// Samples left out because a number of theirs is NaN or infinite.
    pub non_finite: u64,
    /// Values of S_d below zero that were taken as 0, one for each pair and channel.
    pub clamped: u64,
}

adds_up!(GatherTally {
    samples,
    lit,
    indirect,
    exits,
    nodes,
    pairs,
    evaluated,
    near_points,
    near,
    non_finite,
    clamped
});
