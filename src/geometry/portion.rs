//! A part of a mesh as a mesh of its own.

use super::parts::Label;
use super::{RawMesh, RawNormals};
use crate::math::DVec3;

impl RawMesh {
    /// The triangles whose label `keep` takes, over their own vertices, at the same places to the bit; without parts and remarks.
    #[must_use]
    pub fn portion(&self, keep: impl Fn(&Label) -> bool) -> Self {
        let spans: Vec<_> = self.parts.spans(self.triangles.len(), keep).collect();
        let spans = || spans.iter().cloned();
        let mut out = Self::default();
        let mut vertices = Kept::new(self.positions.len());
        for t in spans().flat_map(|span| &self.triangles[span]) {
            out.triangles.push(t.map(|i| vertices.number(i)));
        }
        out.positions = vertices.of(&self.positions);
        if let Some(normals) = &self.normals {
            let mut kept = Kept::new(normals.vectors.len());
            let triangles = spans().flat_map(|span| &normals.triangles[span]);
            let triangles = triangles.map(|t| t.map(|t| t.map(|i| kept.number(i)))).collect();
            out.normals = Some(RawNormals { triangles, vectors: kept.of(&normals.vectors) });
            // As of a file that has no normals at all.
            out.normals = out.normals.filter(|n| n.triangles.iter().any(Option::is_some));
        }
        out.uv = self.uv.as_ref().map(|uv| spans().flat_map(|span| &uv[span]).copied().collect());
        out
    }
}

/// New numbers of what is kept of a list, in the order of first use.
struct Kept {
    numbers: Vec<u32>,
    old: Vec<u32>,
}

impl Kept {
    fn new(all: usize) -> Self {
        Self { numbers: vec![u32::MAX; all], old: Vec::new() }
    }

    fn number(&mut self, i: u32) -> u32 {
        let number = &mut self.numbers[i as usize];
        if *number == u32::MAX {
            *number = self.old.len() as u32;
            self.old.push(i);
        }
        *number
    }

    fn of(&self, all: &[DVec3]) -> Vec<DVec3> {
        self.old.iter().map(|&i| all[i as usize]).collect()
    }
}
