//! The multipole: a slab between two boundaries.

use super::gather::BLOCK;
use super::multipole::Multipole;
use super::radial::{Batch, Formula, Radial, finite, in_mean_free_paths, left};
use super::standard::length_log2;
use super::{Bssrdf, Claims, Entry, Exit, ModelKind, ModelName, ModelOption};
use crate::error::{Error, Result};
use crate::math::{Level, Rgb, dispatch_at, times_exp2};
use crate::optics::{FresnelMoments, Medium};
use crate::words::digits;
use std::f64::consts::{LOG2_E, PI};

pub(super) static MODEL: ModelKind = ModelKind {
    takes: &[ModelOption::Thickness, ModelOption::EtaFar, ModelOption::Transmitted],
    evidence: |_| Some("slab"),
    ..ModelKind::new("slab", |medium, options| {
        let thickness = options.thickness.ok_or_else(|| Error::scene("the model `slab` needs a `thickness`"))?;
        let eta_far = options.eta_far.unwrap_or(medium.eta);
        Ok(Box::new(Slab::between(medium, thickness, eta_far, options.exit_normalisation)?))
    })
};

/// The multipole of a flat slab \[DJ05\]: the point source at depth l′ and its images in both extrapolated boundaries,
/// without end. With lengths in l′ = 1/σ_t′, s = sqrt(3 (1 - α′)), z_b = 2/3 A at each face, period
/// P = 2 (H + z_bt + z_bb), z_ri = i P + 1, z_vi = i P - 1 - 2 z_bt:
///
///   R(r) = α′ σ_t′² / 4π Σ_i [g1(z_ri) - g1(z_vi)],   T(r) = α′ σ_t′² / 4π Σ_i [g1(H - z_ri) - g1(H - z_vi)]
///   g1(z) = z (1 + s d) exp(-s d) / d³,  d² = r² + z²
///
/// S_d = R / π or T / π, over 4 C_phi(1/η) of the face it leaves by with exit normalisation [1/(unit² sr)]. Light
/// leaves by the other face where the normals of entry and exit look apart (n_i · n_o < 0); r is then the distance
/// across the slab's mean normal, else the straight distance. Reciprocal. Thicker than one
/// transport mean free path by definition (the source must lie inside), to be trusted from two upwards: R within 2 %,
/// T within 5 % from twenty.
///
/// All orders of scattering from the first on. \[DJ05\]'s source stands for all light that has entered, what comes through unscattered
/// included, so that beside this R + T would be more than 1, and T of a thin leaf twice the truth. Here R and T have what is scattered
/// in the slab: each is \[DJ05\]'s times a share of its own, [`Self::scattered`], see `Multipole::scattered`.
///
/// Both sums are done once, in f64, to all their images (directly near the axis, by their Fourier series in K_0 far
/// out); what remains per evaluation is one exponential times a tabulated smooth factor, good to 1e-6.
pub struct Slab {
    reflected: [Face; 3],
    transmitted: [Face; 3],
    grey: bool,
    decay: f32,
    total_reflected: Rgb,
    total_transmitted: Rgb,
    scattered: [Rgb; 2],
    /// M over S_d [sr] at the lit face and at the other.
    exitance: [f32; 2],
}

/// Pieces of a table per doubling of d², as a power of two.
const PIECES_LOG2: u32 = 4;
/// Pieces of a table: 64 doublings of d².
const PIECES: usize = 1024;
/// Thinnest slab [transport mean free paths]: the source must lie inside, and the table must resolve the gap.
const THINNEST: f64 = 1.001;
/// Thickest slab [transport mean free paths] that the table reaches.
const THICKEST: f64 = 3e7;

/// Exitance through one face, one channel, as a function of r.
#[derive(Clone, Debug)]
pub struct Face {
    /// σ_t′² [1/unit²].
    sigma_squared: f32,
    /// log2 e / σ_t′ [unit]: of a rate, what it takes off `decay_log2`.
    length_log2: f32,
    /// Square of the depth of the nearest pole.
    depth_squared: f32,
    /// Decay far out: that of the slab's slowest mode.
    decay: f32,
    /// The same, times log2 e.
    decay_log2: f32,
    /// α′ σ_t′² / 4π, over π and the exit normalisation [1/(unit² sr)].
    scale: f32,
    /// Upper bits of `depth_squared`: the first piece.
    first: u32,
    /// A cubic for each piece in the lower bits of d², so that the sum is the cubic times (1 + q d) exp(-q d) / d³.
    cubics: Box<[[f32; 4]; PIECES]>,
}

impl Slab {
    /// A slab of `thickness` \[unit\] with the same medium outside both faces. See [`super::ModelOptions`].
    ///
    /// # Errors
    /// As [`Self::between`].
    pub fn new(medium: &Medium, thickness: f32, exit_normalisation: bool) -> Result<Self> {
        Self::between(medium, thickness, medium.eta, exit_normalisation)
    }

    /// A slab lit through a face with `medium.eta` whose other face has the relative index `eta_far`.
    ///
    /// # Errors
    /// A thickness of at most one transport mean free path in a channel that scatters, where the source would lie
    /// outside, or of more than 3e7 of them, and an `eta_far` that is not positive and finite.
    pub fn between(medium: &Medium, thickness: f32, eta_far: f32, exit_normalisation: bool) -> Result<Self> {
        if !(eta_far > 0.0 && eta_far.is_finite()) {
            return Err(Error::scene(format!("eta = {eta_far}: n_inside / n_outside must be positive and finite")));
        }
        let [near, far] = [medium.eta, eta_far].map(|eta| FresnelMoments::new(f64::from(eta)));
        let exit = [near, far].map(|m| if exit_normalisation { m.four_c_phi_outside } else { 1.0 });
        let (mut sums, mut scattered) = (Vec::with_capacity(3), [Rgb::WHITE; 2]);
        for (c, k) in medium.channels().iter().enumerate() {
            let relative = if k.alpha_prime > 0.0 { f64::from(thickness) * k.sigma_t_prime } else { 2.0 };
            check_thickness(thickness, relative, c)?;
            let [z_bt, z_bb] = [near, far].map(|m| 2.0 / 3.0 * m.a_groenhuis());
            let sum = Multipole::new(k.relative_decay(), relative, z_bt, z_bb);
            let unscattered = (-f64::from(thickness) * f64::from(medium.sigma_t()[c])).exp();
            let shares = sum.scattered(z_bb, unscattered);
            (0..2).for_each(|side| scattered[side].0[c] = shares[side] as f32);
            sums.push(sum);
        }
        let grey = medium.is_grey();
        let face = |c: usize, side: usize| {
            let k = medium.channel(c);
            let strength = k.alpha_prime * f64::from(scattered[side][c]);
            let scale = strength * k.sigma_t_prime * k.sigma_t_prime / (4.0 * PI * PI * exit[side]);
            Face {
                sigma_squared: finite(k.sigma_t_prime * k.sigma_t_prime),
                length_log2: length_log2(&k),
                scale: finite(scale),
                ..Face::tabulate(&sums[c], side == 1)
            }
        };
        let faces = |side: usize| {
            let first = face(0, side);
            if grey { [first.clone(), first.clone(), first] } else { [first, face(1, side), face(2, side)] }
        };
        let (reflected, transmitted) = (faces(0), faces(1));
        let total = |side: usize, f: &dyn Fn(&Multipole) -> f64| {
            Rgb::from_fn(|c| (medium.channel(c).alpha_prime * f(&sums[c])) as f32) * scattered[side]
        };
        let decay = (0..3).map(|c| sums[c].slowest() * medium.channel(c).sigma_t_prime).fold(f64::INFINITY, f64::min);
        Ok(Self {
            grey,
            decay: decay as f32,
            total_reflected: total(0, &Multipole::total_reflected),
            total_transmitted: total(1, &Multipole::total_transmitted),
            scattered,
            exitance: exit.map(|e| (PI * e) as f32),
            reflected,
            transmitted,
        })
    }

    /// T(r) [1/unit²]: exitance through the far face at distance `r` \[unit\] along it.
    pub fn transmitted(&self, r: f32) -> Rgb {
        Rgb::from_fn(|c| (&self.transmitted[c]).value(r * r) * self.exitance[1])
    }

    /// [`Self::transmitted`] of one `channel` for each `r`, vectorised.
    pub fn transmitted_batch(&self, channel: usize, r: &[f32], out: &mut [f32]) {
        let batch = Batch { channel: &self.transmitted[channel], exitance: self.exitance[1], r, out };
        dispatch_at(Level::best(), batch);
    }

    fn signed(&self, entry: &Entry, exit: &Exit, rate: f32) -> Rgb {
        let x = exit.x - entry.x;
        let through = entry.n.dot(exit.n) < 0.0;
        let (mut r2, mut rest) = (x.length_squared(), 0.0);
        if through {
            let across = (entry.n - exit.n).normalize_or_zero();
            let height = x.dot(across);
            // The weight is of the straight distance: what it has more than r joins at the end.
            let straight = r2.sqrt();
            r2 = (x - across * height).length_squared();
            let more = height * height / (straight + r2.sqrt()).max(f32::MIN_POSITIVE);
            rest = (rate * more * std::f32::consts::LOG2_E).min(250.0);
        }
        let faces = if through { &self.transmitted } else { &self.reflected };
        let value = |face: &Face| times_exp2(face.eval::<true>(r2, rate), rest);
        if self.grey { Rgb::splat(value(&faces[0])) } else { Rgb::from_fn(|c| value(&faces[c])) }
    }

    /// R and T over those of \[DJ05\].
    pub fn scattered(&self) -> [Rgb; 2] {
        self.scattered
    }

    /// Diffuse transmittance per entered flux; the reflectance is [`Bssrdf::total`].
    pub fn total_transmitted(&self) -> Rgb {
        self.total_transmitted
    }
}

fn check_thickness(thickness: f32, relative: f64, channel: usize) -> Result<()> {
    let name = ["red", "green", "blue"][channel];
    if relative.is_nan() || relative <= THINNEST {
        return Err(Error::scene(format!(
            "slab of thickness {thickness}: {} transport mean free paths in {name}, and the model needs more than one (two \
             to be trusted); use method `volume_path` or a thicker slab",
            digits(relative, 3)
        )));
    }
    if relative > THICKEST {
        return Err(Error::scene(format!(
            "slab of thickness {thickness}: {relative:.1e} transport mean free paths in {name} are a half space; use \
             the model `standard`"
        )));
    }
    Ok(())
}

impl Face {
    /// The smooth factor of R or T; material constants are left at 0.
    fn tabulate(sum: &Multipole, transmitted: bool) -> Self {
        let depth = if transmitted { sum.thickness() - 1.0 } else { 1.0 };
        let depth_squared = (depth * depth) as f32;
        let (z2, q) = (f64::from(depth_squared), sum.slowest());
        let shift = f32::MANTISSA_DIGITS - 1 - PIECES_LOG2;
        let first = depth_squared.to_bits() >> shift;
        let factor = |d2: f64| {
            let d = d2.sqrt();
            let value = if transmitted { sum.transmitted(d2 - z2) } else { sum.reflected(d2 - z2) };
            value * (q * d).exp() * d2 * d / (1.0 + q * d)
        };
        let mut cubics = Box::new([[0.0; 4]; PIECES]);
        let mut start = None;
        for (i, cubic) in cubics.iter_mut().enumerate() {
            let [lo, hi] = [0, 1].map(|k| f64::from(f32::from_bits((first + i as u32 + k) << shift)));
            // The exponential ends before the table.
            if q * lo.sqrt() > 180.0 {
                break;
            }
            let at = |t: f64| factor(lo + (hi - lo) * t);
            let ends = [start.unwrap_or_else(|| at(0.0)), at(1.0 / 3.0), at(2.0 / 3.0), at(1.0)];
            start = Some(ends[3]);
            *cubic = through_thirds(ends).map(|c| c as f32);
        }
        Self {
            sigma_squared: 0.0,
            length_log2: 0.0,
            scale: 0.0,
            depth_squared,
            decay: q as f32,
            decay_log2: (LOG2_E * q) as f32,
            first,
            cubics,
        }
    }

    /// The first half: (piece of the table, place in it, distance to the nearest pole, exponent).
    #[inline(always)]
    fn locate<const COMPENSATED: bool>(&self, r2: f32, rate: f32) -> (u32, f32, f32, f32) {
        const SHIFT: u32 = f32::MANTISSA_DIGITS - 1 - PIECES_LOG2;
        const BELOW: u32 = (1 << SHIFT) - 1;
        let x2 = in_mean_free_paths(r2, self.sigma_squared);
        let d2 = x2 + self.depth_squared;
        let d = d2.sqrt();
        let mut exponent = self.decay_log2 * d;
        if COMPENSATED {
            let rate = rate * self.length_log2;
            exponent = left(self.decay_log2, rate) * d + rate * self.depth_squared / (d + x2.sqrt());
        }
        let bits = d2.to_bits();
        let t = (bits & BELOW) as i32 as f32 * (1.0 / (BELOW + 1) as f32);
        // Beyond the table the exponential is 0, so that a piece taken round the end does not matter.
        ((bits >> SHIFT).wrapping_sub(self.first) % PIECES as u32, t, d, exponent)
    }

    /// The second half.
    #[inline(always)]
    fn finish(&self, [a, b, c, e]: [f32; 4], t: f32, d: f32, exponent: f32) -> f32 {
        let i = 1.0 / d;
        let smooth = a + t * (b + t * (c + t * e));
        times_exp2(self.scale * smooth * ((i + self.decay) * (i * i)), -exponent)
    }
}

/// Coefficients of the cubic through values at t = 0, 1/3, 2/3, 1.
fn through_thirds([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [
        a,
        -5.5 * a + 9.0 * b - 4.5 * c + d,
        9.0 * a - 22.5 * b + 18.0 * c - 4.5 * d,
        -4.5 * a + 13.5 * b - 13.5 * c + 4.5 * d,
    ]
}

impl Formula for &Face {
    #[inline(always)]
    fn eval<const COMPENSATED: bool>(self, r2: f32, rate: f32) -> f32 {
        let (piece, t, d, exponent) = self.locate::<COMPENSATED>(r2, rate);
        self.finish(self.cubics[piece as usize], t, d, exponent)
    }

    /// Vectorised but for the table, whose rows are fetched one by one between the halves.
    #[inline(always)]
    fn values(self, r2: &[f32; BLOCK]) -> [f32; BLOCK] {
        let (mut piece, mut t, mut d, mut exponent) = ([0; BLOCK], [0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
        for i in 0..BLOCK {
            (piece[i], t[i], d[i], exponent[i]) = self.locate::<false>(r2[i], 0.0);
        }
        let mut cubic = [[0.0; BLOCK]; 4];
        for i in 0..BLOCK {
            let [a, b, c, e] = self.cubics[piece[i] as usize % PIECES];
            (cubic[0][i], cubic[1][i], cubic[2][i], cubic[3][i]) = (a, b, c, e);
        }
        let mut out = [0.0; BLOCK];
        for i in 0..BLOCK {
            out[i] = self.finish([cubic[0][i], cubic[1][i], cubic[2][i], cubic[3][i]], t[i], d[i], exponent[i]);
        }
        out
    }
}

impl Bssrdf for Slab {
    fn eval_compensated(&self, entry: &Entry, exit: &Exit, rate: f32) -> Rgb {
        // Images of unlike boundaries can turn the far exitance negative: no light.
        self.signed(entry, exit, rate).map(|value| value.max(0.0))
    }

    fn decay(&self) -> f32 {
        self.decay
    }

    fn total(&self) -> Rgb {
        self.total_reflected
    }

    fn total_of_all_faces(&self) -> Rgb {
        self.total_reflected + self.total_transmitted
    }

    fn clamps(&self) -> bool {
        true
    }

    fn eval_signed(&self, entry: &Entry, exit: &Exit) -> Rgb {
        self.signed(entry, exit, 0.0)
    }

    fn name(&self) -> ModelName {
        ModelName::SLAB
    }

    fn radial(&self) -> Option<&dyn Radial> {
        Some(self)
    }

    fn claims(&self) -> Claims {
        Claims { unscattered: false, first_order: true, reciprocal: true, bounded_energy: true }
    }
}

impl Radial for Slab {
    /// R(r) [1/unit²] on the lit face; [`Slab::transmitted`] is the other. Signed.
    fn exitance(&self, r: f32) -> Rgb {
        Rgb::from_fn(|c| (&self.reflected[c]).value(r * r) * self.exitance[0])
    }

    fn exitance_one(&self, channel: usize, r: f32) -> f32 {
        (&self.reflected[channel]).value(r * r) * self.exitance[0]
    }

    fn exitance_batch_at(&self, level: Level, channel: usize, r: &[f32], out: &mut [f32]) {
        dispatch_at(level, Batch { channel: &self.reflected[channel], exitance: self.exitance[0], r, out });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn milk() -> Medium {
        Medium::reduced(Rgb([2.55, 3.21, 3.77]), Rgb([0.0011, 0.0024, 0.014]), 1.3).unwrap()
    }

    #[test]
    fn thin_and_endless_slabs_are_refused_with_the_number() {
        let thin = Slab::new(&milk(), 0.3, true).err().unwrap().to_string();
        assert!(thin.contains("0.765 transport mean free paths in red"), "{thin}");
        assert!(Slab::new(&milk(), f32::INFINITY, true).is_err());
        assert!(Slab::new(&milk(), f32::NAN, true).is_err());
    }

    #[test]
    fn a_thick_slab_is_a_half_space() {
        let (slab, half) = (Slab::new(&milk(), 1e4, true).unwrap(), super::super::StandardDipole::new(&milk(), true));
        for r in [0.0, 0.1, 1.0, 10.0, 50.0] {
            let (a, b) = (slab.exitance(r), half.exitance(r));
            for c in 0..3 {
                assert!((a[c] / b[c] - 1.0).abs() < 1e-5, "{r}: {a:?} {b:?}");
            }
        }
        assert!((slab.total()[1] / half.total()[1] - 1.0).abs() < 1e-5);
    }

    /// Without absorption all that enters leaves, scattered or not; forward scattering takes the place of light that is not.
    #[test]
    fn what_leaves_by_both_faces_and_what_is_not_scattered_are_all_light_and_no_more() {
        for (eta, eta_far) in [(1.0, 1.0), (1.3, 1.3), (1.5, 1.1), (0.8, 1.3)] {
            for thickness in [1.01_f32, 1.5, 2.0, 5.0, 20.0] {
                for (g, absorbed) in [(0.0, 0.0), (0.5, 0.0), (0.9, 0.0), (-0.5, 0.0), (0.0, 0.1), (0.8, 0.5)] {
                    // σ_t′ = 1.
                    let (scattered, absorbed) = (Rgb::splat((1.0 - absorbed) / (1.0 - g)), Rgb::splat(absorbed));
                    let medium = Medium::unreduced(scattered, absorbed, g.into(), eta).unwrap();
                    let slab = Slab::between(&medium, thickness, eta_far, true).unwrap();
                    let straight = (-thickness * medium.sigma_t()[0]).exp();
                    let all = slab.total_of_all_faces()[0] + straight;
                    let case = format!("{eta} {eta_far}, {thickness}, g {g}, {absorbed:?}: {all}");
                    assert!(all < 1.0 + 1e-5, "{case}");
                    assert!(absorbed[0] > 0.0 || all > 1.0 - 1e-5, "{case}");
                }
            }
        }
    }

    /// R and T of what is scattered, along the normal, by another program (200 000 paths, 0.001).
    #[test]
    fn scattered_light_is_what_paths_say() {
        for (thickness, eta, alpha, g, r, t) in [
            (1.01, 1.3, 0.97, 0.0, 0.284, 0.267),
            (1.5, 1.3, 0.9, 0.0, 0.248, 0.205),
            (2.0, 1.3, 0.8, 0.0, 0.174, 0.118),
            (2.0, 1.3, 0.97, 0.0, 0.391, 0.305),
            (2.0, 1.0, 0.9, 0.0, 0.362, 0.221),
            (3.0, 1.3, 0.97, 0.0, 0.439, 0.268),
            (5.0, 1.3, 0.97, 0.0, 0.477, 0.165),
            (4.0, 1.3, 0.99, 0.5, 0.424, 0.433),
            (5.1, 1.3, 0.99, 0.8, 0.289, 0.560),
            (10.0, 1.3, 0.99, 0.8, 0.356, 0.372),
        ] {
            let medium = Medium::unreduced(Rgb::splat(alpha), Rgb::splat(1.0 - alpha), g, eta).unwrap();
            let slab = Slab::new(&medium, thickness, true).unwrap();
            let ([r, t], found) =
                ([r, t].map(f64::from), [slab.total(), slab.total_transmitted()].map(|v| f64::from(v[0])));
            assert!((found[0] / r - 1.0).abs() < 0.1 && (found[1] / t - 1.0).abs() < 0.12, "{thickness}: {found:?}");
        }
    }

    #[test]
    fn the_face_follows_from_the_normals_and_the_distance_across_them() {
        use crate::math::Vec3;
        let slab = Slab::new(&milk(), 5.0, true).unwrap();
        let entry = Entry { x: Vec3::ZERO, n: Vec3::Z, w: -Vec3::Z };
        let near = Exit { x: Vec3::new(3.0, 4.0, 0.0), n: Vec3::Z, w: Vec3::Z };
        let far = Exit { x: Vec3::new(3.0, 4.0, -5.0), n: -Vec3::Z, w: -Vec3::Z };
        let pi = slab.exitance[0];
        for c in 0..3 {
            assert!((slab.eval(&entry, &near)[c] * pi / slab.exitance(5.0)[c] - 1.0).abs() < 1e-5);
            assert!((slab.eval(&entry, &far)[c] * pi / slab.transmitted(5.0)[c] - 1.0).abs() < 1e-5);
        }
        let rate = slab.decay();
        let kept = slab.eval_compensated(&entry, &far, rate)[0] * (-rate * far.x.length()).exp();
        assert!((kept / slab.eval(&entry, &far)[0] - 1.0).abs() < 1e-5);
    }
}
