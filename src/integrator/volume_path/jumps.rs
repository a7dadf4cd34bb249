//! Far from any surface, from a collision to the surface of a ball around it at once, whatever lies between.
//!
//! Where collisions send light all ways alike, it leaves the ball anywhere with the same density, and at an angle to the normal that
//! [`Ball`] knows for each channel. So one path is as good for all channels there, which flights of one of them are not.

use super::draws::PathSampler;
use super::spectrum::Spectrum;
use crate::geometry::Clearance;
use crate::math::{DVec3, Rgb, Vec3, frame};
use crate::optics::{ANGLES, Ball, Medium};
use rayon::prelude::*;
use std::f32::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

/// Radius of the smallest ball [mean free paths of the mean extinction]: it has some three collisions.
const LEAST: f64 = 1.5;
/// And of the largest, in any channel: some hundreds.
const MOST: f64 = 24.0;
/// From one radius to the next.
const RATIO: f64 = 1.25;

/// Balls of a medium.
pub struct Balls(Vec<Radius>);

/// Balls for one body.
pub struct Jumps {
    balls: Arc<Balls>,
    /// For each level of clearance how many of them fit.
    fits: Vec<u8>,
}

/// One ball.
struct Radius {
    /// [unit].
    radius: f32,
    /// Share that leaves it, of each channel.
    leaves: Rgb,
    /// Chance of each outcome, of each channel: straight through, then by steps of the angle.
    chance: Vec<Rgb>,
    /// Their sums, channel by channel.
    sums: [Vec<f32>; 3],
}

/// Where a jump ends.
pub struct Landing {
    /// On the ball.
    pub x: DVec3,
    /// Direction out of it.
    pub w: Vec3,
    /// Whether there was no collision on the way.
    pub straight: bool,
}

impl Balls {
    /// For `medium`, up to a radius of `room` [unit]; none where it does not scatter all ways alike, or there is no room.
    pub fn new(medium: &Medium, room: f32) -> Option<Self> {
        let sigma_t = medium.sigma_t().0.map(f64::from);
        let (mean, largest) = (sigma_t.iter().sum::<f64>() / 3.0, sigma_t.into_iter().fold(0.0, f64::max));
        if medium.g != 0.0 || mean <= 0.0 {
            return None;
        }
        let most = f64::from(room).min(MOST / largest);
        let radii: Vec<f64> =
            std::iter::successors(Some(LEAST / mean), |r| Some(r * RATIO)).take_while(|r| *r <= most).collect();
        let balls: Vec<Radius> = radii.into_par_iter().map(|radius| Radius::new(medium, radius)).collect();
        (!balls.is_empty()).then_some(Self(balls))
    }
}

impl Jumps {
    /// By these balls, where `clearance` has room for them.
    pub fn new(balls: Arc<Balls>, clearance: &Clearance) -> Self {
        let fit = |level| balls.0.partition_point(|ball| ball.radius <= clearance.distance(level)) as u8;
        Self { fits: (0..=u8::MAX).map(fit).collect(), balls }
    }

    /// From a collision at `x`, whose clearance has this level, where there is a ball for it.
    #[inline]
    pub fn jump(&self, x: DVec3, level: u8, spectrum: &mut Spectrum, draws: &mut PathSampler) -> Option<Landing> {
        let ball = &self.balls.0[usize::from(self.fits[usize::from(level)]).checked_sub(1)?];
        let sums = &ball.sums[spectrum.hero()];
        let [u, v] = draws.pair();
        let outcome = sums.partition_point(|sum| *sum <= u).min(sums.len() - 1);
        spectrum.pass(ball.leaves, ball.chance[outcome]);
        let n = draws.direction();
        let x = x + n.as_dvec3() * f64::from(ball.radius);
        let Some(step) = outcome.checked_sub(1) else { return Some(Landing { x, w: n, straight: true }) };
        // What is left of the number is one of its own.
        let left = ((u - sums[step]) / (sums[outcome] - sums[step])).clamp(0.0, 1.0);
        let (sin, cos) = (FRAC_PI_2 * (step as f32 + left) / ANGLES as f32).sin_cos();
        let (across, along) = (TAU * v).sin_cos();
        let w = frame(n) * Vec3::new(sin * along, sin * across, cos);
        Some(Landing { x, w: w.normalize(), straight: false })
    }
}

impl Radius {
    fn new(medium: &Medium, radius: f64) -> Self {
        let each: [(f64, Vec<f64>); 3] = std::array::from_fn(|c| {
            let (s, a) = (f64::from(medium.sigma_s[c]), f64::from(medium.sigma_a[c]));
            if s + a <= 0.0 {
                return (1.0, std::iter::once(1.0).chain([0.0; ANGLES]).collect());
            }
            let ball = Ball::new(radius * (s + a), s / (s + a));
            let all = ball.straight + ball.scattered.iter().sum::<f64>();
            (all, std::iter::once(ball.straight).chain(ball.scattered).map(|share| share / all).collect())
        });
        let chance = (0..=ANGLES).map(|k| Rgb::from_fn(|c| each[c].1[k] as f32)).collect();
        let sums = each.each_ref().map(|(_, chance)| {
            let mut sum = 0.0;
            let add = |share: &f64| {
                sum += share;
                sum as f32
            };
            chance.iter().map(add).collect()
        });
        Self { radius: radius as f32, leaves: Rgb::from_fn(|c| each[c].0 as f32), chance, sums }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::View;
    use crate::integrator::volume_path::checks::block;
    use crate::integrator::volume_path::spectrum::Coefficients;
    use crate::integrator::volume_path::{VolumePath, VolumePathOptions};
    use crate::query::{self, Backend};
    use crate::tally::Tally;

    /// What comes out of each face of a box, in each channel, and its mean cosine: with jumps as without, to 4.5 standard errors.
    #[test]
    fn jumps_bring_out_what_walks_do() {
        let scene = block("sigma_s = [4, 8, 18]\nsigma_a = [0.004, 0, 0.2]\ng = 0\neta = 1.3", "");
        let rays = query::build(Backend::preferred(), &scene.meshes()).unwrap();
        let view = View { scene: &scene, rays: &*rays };
        let medium = scene.surface(0).medium().unwrap();
        let mut method =
            VolumePath::new(&scene, VolumePathOptions { photons: 0, ..VolumePathOptions::default() }).unwrap();
        let walks = 500_000_u64;
        let mut found = Vec::new();
        for jumps in [false, true] {
            let body = method.bodies[0].as_mut().unwrap();
            let balls = Balls::new(&medium, body.clearance.largest()).filter(|_| jumps);
            body.jumps = balls.map(|balls| Jumps::new(Arc::new(balls), &body.clearance));
            let (mut tally, mut sums) = (Tally::default(), [[[0.0_f64; 2]; 2]; 18]);
            for i in 0..walks {
                let mut own = [[0.0_f64; 2]; 18];
                let from = (DVec3::new(0.3, -0.2, 0.999) - scene.centre, -Vec3::Z);
                let draws = PathSampler::new(&[], 2 * i + u64::from(jumps));
                method.walk_through((view, 0), (from, Rgb::WHITE), None, draws, &mut tally, |out, _| {
                    let n = out.exit.at.n_geometric;
                    let axis = if n.x.abs() > 0.5 {
                        0
                    } else if n.y.abs() > 0.5 {
                        1
                    } else {
                        2
                    };
                    let face = 2 * axis + usize::from(n[axis] > 0.0);
                    for c in 0..3 {
                        let flux = f64::from(out.flux[c]);
                        own[3 * face + c] = [flux, flux * f64::from(out.exit.w.dot(n))];
                    }
                });
                for (sum, own) in sums.iter_mut().zip(own) {
                    (0..2).for_each(|k| sum[k] = [sum[k][0] + own[k], sum[k][1] + own[k] * own[k]]);
                }
            }
            println!("{:?}", tally.walk);
            assert_eq!(tally.walk.jumps > walks, jumps);
            let n = walks as f64;
            let each = |[sum, squares]: [f64; 2]| {
                let mean = sum / n;
                (mean, ((squares / n - mean * mean) / n).sqrt())
            };
            found.push((sums.map(|s| s.map(each)), tally.walk.collisions));
        }
        assert!(2 * found[1].1 < found[0].1, "collisions left");
        for (i, (walked, jumped)) in found[0].0.iter().zip(&found[1].0).enumerate() {
            for (a, b) in walked.iter().zip(jumped) {
                let error = a.1.hypot(b.1);
                println!("face {} channel {}: {:.5} {:.5} +- {error:.5}", i / 3, i % 3, a.0, b.0);
                assert!((a.0 - b.0).abs() < 4.5 * error, "{i}: {a:?} {b:?}");
            }
        }
    }

    /// One jump, by whichever channel is drawn, brings to the sphere what leaves the ball in each: all of it, straight, and by angle.
    #[test]
    fn a_jump_is_right_in_every_channel() {
        let clearance = Clearance::new([], crate::math::Aabb { lower: DVec3::ZERO, upper: DVec3::ONE }, 16);
        let medium = Medium { sigma_s: Rgb([1.0, 4.0, 18.0]), sigma_a: Rgb([0.1, 0.0, 0.5]), g: 0.0, eta: 1.3 };
        let jumps = Jumps::new(Arc::new(Balls::new(&medium, 0.5).unwrap()), &clearance);
        let level = (0..=u8::MAX).find(|level| jumps.fits[usize::from(*level)] == 3).unwrap();
        let radius = f64::from(jumps.balls.0[2].radius);
        let coefficients = Coefficients::new(&medium);
        let n = 300_000;
        let mut sums = [[[0.0_f64; 2]; 3]; 4];
        for i in 0..n {
            let mut draws = PathSampler::new(&[], i);
            let mut spectrum = Spectrum::new(Rgb::WHITE, draws.number());
            let to = jumps.jump(DVec3::ZERO, level, &mut spectrum, &mut draws).unwrap();
            assert!((to.x.length() / radius - 1.0).abs() < 1e-6 && (to.w.length() - 1.0).abs() < 1e-5);
            let cosine = to.x.normalize().dot(to.w.as_dvec3());
            let value = spectrum.value(&coefficients);
            let each = [1.0, f64::from(u8::from(to.straight)), cosine, cosine * cosine];
            for (sum, factor) in sums.iter_mut().zip(each) {
                for c in 0..3 {
                    let v = f64::from(value[c]) * factor;
                    sum[c] = [sum[c][0] + v, sum[c][1] + v * v];
                }
            }
        }
        for c in 0..3 {
            let (s, a) = (f64::from(medium.sigma_s[c]), f64::from(medium.sigma_a[c]));
            let ball = Ball::new(radius * (s + a), s / (s + a));
            let mean = |f: fn(f64) -> f64| {
                let at = |k: usize| f((k as f64 + 0.5) * std::f64::consts::FRAC_PI_2 / ANGLES as f64);
                ball.straight * f(0.0) + ball.scattered.iter().enumerate().map(|(k, s)| s * at(k)).sum::<f64>()
            };
            let expected = [mean(|_| 1.0), ball.straight, mean(f64::cos), mean(|angle| angle.cos().powi(2))];
            for (sum, expected) in sums.iter().zip(expected) {
                let mean = sum[c][0] / n as f64;
                let error = ((sum[c][1] / n as f64 - mean * mean).max(0.0) / n as f64).sqrt();
                println!("channel {c}: {mean:.5} {expected:.5} +- {error:.5}");
                assert!((mean - expected).abs() < 4.5 * error + 1e-4, "channel {c}: {mean} +- {error}, {expected}");
            }
        }
    }

    /// What does not scatter all ways alike, or has no room for a ball, is walked.
    #[test]
    fn there_are_balls_where_they_are_right() {
        let medium = |s: f32, g: f64| Medium { sigma_s: Rgb::splat(s), sigma_a: Rgb::splat(0.01), g, eta: 1.3 };
        assert!(Balls::new(&medium(10.0, 0.0), 0.2).is_some());
        assert!(Balls::new(&medium(10.0, 0.1), 0.2).is_none());
        assert!(Balls::new(&medium(10.0, 0.0), 0.1).is_none());
        assert!(Balls::new(&Medium { sigma_a: Rgb::BLACK, ..medium(0.0, 0.0) }, 0.2).is_none());
    }

    /// Whatever the channels are like: shares of one, none below nothing.
    #[test]
    fn extreme_media_have_balls() {
        for s in [[1e-6, 1.0, 1e6], [1e-30, 1e-3, 1.0], [0.0, 0.0, 5.0]] {
            for a in [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [1e3, 0.0, 1e-6]] {
                let medium = Medium { sigma_s: Rgb(s), sigma_a: Rgb(a), g: 0.0, eta: 1.0 };
                let Some(Balls(balls)) = Balls::new(&medium, 1e9) else { continue };
                for ball in balls {
                    let all = (0..3).all(|c| ball.leaves[c] > -1e-6 && ball.leaves[c] < 1.0 + 1e-5);
                    assert!(all && ball.chance.iter().all(|p| p.0.iter().all(|p| *p >= 0.0)), "{s:?} {a:?}");
                    let ends = ball.sums.iter().all(|sums| (sums[ANGLES] - 1.0).abs() < 1e-4);
                    assert!(ends, "{s:?} {a:?}: {:?}", ball.sums.each_ref().map(|sums| sums[ANGLES]));
                }
            }
        }
    }
}
