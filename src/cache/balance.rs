//! What a model of a plane sends out on the body it is used for, held to what it sends out on a plane.
//!
//! Under even light from all sides S_d integrates over a plane to the model's total. Over a real surface it does not: in a fold, or
//! through a thin wall, more surface lies within reach, on a ridge less. Where light enters a body again and again that would add up
//! without end. Light in the body has two ends: it leaves, on a plane the share P of it, or is absorbed. With s times the surface within reach it
//! leaves s times as fast, and is absorbed as fast as before: s P / (s P + 1 - P) leave. So what is gathered is divided by s P + 1 - P. No
//! more leaves than has entered, and a white furnace of a body that absorbs nothing is white at every point of any shape.
//!
//! A thin body lets a share q through unscattered, which no model of a half space knows of, and paths bring it beside the model. Of what
//! leaves by the model 1 - q is the most, so that both together are no more than has entered either.

use crate::math::{DVec3, Rgb, Vec3};
use std::collections::HashMap;
use std::f64::consts::PI;

/// Points that a mean is taken over, on a plane.
const NEIGHBOURS: f64 = 12.0;

/// Factors over the surface of a body.
pub struct Balance {
    /// Points by cube of space.
    cells: HashMap<[i32; 3], Vec<Known>>,
    centre: DVec3,
    radius: f32,
}

/// What is known of a point of the surface.
pub struct Known {
    /// The point, relative to the centre of the body.
    pub x: Vec3,
    /// Normal there.
    pub n: Vec3,
    /// What sums here are divided by: s P + 1 - P, s being what even light brings over what it brings on a plane.
    pub divisor: Rgb,
    /// The least that they are divided by, lest too much leaves beside unscattered light. The larger of the means over neighbours counts: that of each would
    /// be too large by their noise.
    pub least: Rgb,
}

impl Balance {
    /// By points that lie evenly on a surface of `area` [unit²].
    pub fn new(known: Vec<Known>, area: f64, centre: DVec3) -> Self {
        let radius = (NEIGHBOURS * area / (PI * known.len() as f64)).sqrt() as f32;
        let mut cells: HashMap<[i32; 3], Vec<Known>> = HashMap::new();
        known.into_iter().for_each(|k| cells.entry(cell(k.x, radius)).or_default().push(k));
        Self { cells, centre, radius }
    }

    /// The factor for what is gathered at a place with normal `n`.
    pub fn at(&self, place: DVec3, n: Vec3) -> Rgb {
        let x = (place - self.centre).as_vec3();
        let [i, j, k] = cell(x, self.radius);
        let (mut sum, mut least, mut weights) = (Rgb::BLACK, Rgb::BLACK, 0.0);
        for d in 0..27 {
            let Some(known) = self.cells.get(&[i + d % 3 - 1, j + d / 3 % 3 - 1, k + d / 9 - 1]) else { continue };
            for known in known {
                let near = 1.0 - (known.x - x).length_squared() / (self.radius * self.radius);
                if near > 0.0 {
                    // A face that looks away is hardly one with this.
                    let weight = near * near * known.n.dot(n).max(0.01);
                    sum += known.divisor * weight;
                    least += known.least * weight;
                    weights += weight;
                }
            }
        }
        let divisor = Rgb::from_fn(|c| sum[c].max(least[c]));
        if weights > 0.0 { divisor.map(|s| weights / s) } else { Rgb::WHITE }
    }
}

fn cell(x: Vec3, edge: f32) -> [i32; 3] {
    (x / edge).floor().as_ivec3().to_array()
}
