//! Angular moments of the Fresnel reflectance, which fix the boundary condition of every diffusion model.

use crate::math::GaussLegendre;

/// Constants of a boundary, by quadrature in f64, once per material. `eta` = n_inside / n_outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FresnelMoments {
    /// 2 C_1 met from inside: the diffuse internal reflectance F_dr.
    pub two_c1: f64,
    /// 3 C_2 met from inside.
    pub three_c2: f64,
    /// C_phi = (1 - 2 C_1) / 4, the weight of the fluence in the exitance.
    pub c_phi: f64,
    /// C_e = (1 - 3 C_2) / 2, the weight of the flux in the exitance.
    pub c_e: f64,
    /// 4 C_phi(1/eta) = 1 - 2 C_1(1/eta): what T21 keeps of a cosine-weighted hemisphere outside.
    pub four_c_phi_outside: f64,
}

impl FresnelMoments {
    /// The moments of a boundary with relative index `eta` > 0, to 1e-12 or better for `eta` in 0.2..5.
    ///
    /// The fits of \[dEI11\] are not used: they miss 0 at eta = 1, and their terms cancel in f32.
    pub fn new(eta: f64) -> Self {
        debug_assert!(eta > 0.0);
        if eta >= 1.0 {
            let outer = Outer::new(eta, (eta - 1.0) * (eta + 1.0));
            let cut2 = (eta - 1.0) * (eta + 1.0) / (eta * eta);
            // The totally reflected part of C_1 and the 1 - 2 C_1 of the rest cancel exactly on paper.
            let inside = (1.0 - 2.0 * outer.c1) / (eta * eta);
            let three_c2 = 3.0 * outer.c2_inside + cut2 * cut2.sqrt();
            Self::from_parts(2.0 * outer.c1 / (eta * eta) + cut2, three_c2, inside, 1.0 - 2.0 * outer.c1)
        } else {
            let outer = Outer::new(1.0 / eta, (1.0 - eta) * (1.0 + eta) / (eta * eta));
            let inside = 1.0 - 2.0 * outer.c1;
            Self::from_parts(2.0 * outer.c1, 3.0 * outer.c2, inside, inside * eta * eta)
        }
    }

    /// Of a boundary of index `eta` that lets the share `passed`(μ) of light inside through, by the cosine, and `outside` of even light from
    /// outside.
    pub fn of_transmittance(outside: f64, eta: f64, passed: impl Fn(f64) -> f64) -> Self {
        let inside = outside / (eta * eta);
        // Most of a polished boundary lies beyond the critical angle: panels that are not in step with it.
        let three_c2 = 1.0 - GaussLegendre::new(4).integrate_panels(0.0, 1.0, 256, |mu| 3.0 * mu * mu * passed(mu));
        Self::from_parts(1.0 - inside, three_c2, inside, outside)
    }

    fn from_parts(two_c1: f64, three_c2: f64, one_minus_two_c1: f64, four_c_phi_outside: f64) -> Self {
        Self { two_c1, three_c2, c_phi: 0.25 * one_minus_two_c1, c_e: 0.5 * (1.0 - three_c2), four_c_phi_outside }
    }

    /// A of the extrapolated boundary after Groenhuis, (1 + F_dr) / (1 - F_dr) \[JMLH01\].
    pub fn a_groenhuis(&self) -> f64 {
        (1.0 + self.two_c1) / (4.0 * self.c_phi)
    }

    /// A with both moments, (1 + 3 C_2) / (1 - 2 C_1) \[dEo12\].
    pub fn a_mixed(&self) -> f64 {
        (1.0 + self.three_c2) / (4.0 * self.c_phi)
    }
}

/// Integrals over the cosine m on the rare side of a boundary with index ratio n ≥ 1.
struct Outer {
    /// ∫ R m dm = C_1(1/n).
    c1: f64,
    /// ∫ R m² dm = C_2(1/n).
    c2: f64,
    /// ∫ R μ m dm / n², μ the cosine on the dense side: C_2(n) without its totally reflected part.
    c2_inside: f64,
}

impl Outer {
    /// From n and b² = n² - 1, of which n alone has lost the digits beside 1. With m = b sinh u, the dense side's n μ is b cosh u and r_s is -exp(-2u): the boundary layer at
    /// grazing, as thin as b, is gone, so that n beside 1 costs some panels more and no digits.
    fn new(n: f64, b2: f64) -> Self {
        if b2 == 0.0 {
            return Self { c1: 0.0, c2: 0.0, c2_inside: 0.0 };
        }
        let b = b2.sqrt();
        let end = (1.0 / b).asinh();
        let panels = 2 + (end / 1.5) as usize;
        let rule = GaussLegendre::new(20);
        let integral = |extra: &dyn Fn(f64) -> f64| {
            rule.integrate_panels(0.0, end, panels, |u| {
                let r_s = (-2.0 * u).exp();
                // n² tanh u ∓ 1; the difference keeps its digits for n beside 1.
                let short = 2.0 * n * n / ((2.0 * u).exp() + 1.0);
                let r_p = (b2 - short) / (b2 + 2.0 - short);
                let reflectance = 0.5 * (r_s * r_s + r_p * r_p);
                reflectance * b2 * u.sinh() * u.cosh() * extra(u)
            })
        };
        Self {
            c1: integral(&|_| 1.0),
            c2: integral(&|u| b * u.sinh()),
            c2_inside: integral(&|u| b * u.cosh() / n) / (n * n),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2 C_1(1/n) in closed form for n > 1.
    fn closed(n: f64) -> f64 {
        let n2 = n * n;
        0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0).powi(2))
            + n2 * (n2 - 1.0).powi(2) / (n2 + 1.0).powi(3) * ((n - 1.0) / (n + 1.0)).ln()
            - 2.0 * n.powi(3) * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n2 * n2 - 1.0))
            + 8.0 * n.powi(4) * (n2 * n2 + 1.0) / ((n2 + 1.0) * (n2 * n2 - 1.0).powi(2)) * n.ln()
    }

    #[test]
    fn the_first_moment_is_its_closed_form() {
        for n in [1.01, 1.05, 1.3, 1.5, 2.0, 2.5, 4.0] {
            let (dense, rare) = (FresnelMoments::new(n), FresnelMoments::new(1.0 / n));
            assert!((rare.two_c1 - closed(n)).abs() < 1e-12, "1/{n}: {} {}", rare.two_c1, closed(n));
            assert!((dense.four_c_phi_outside - (1.0 - closed(n))).abs() < 1e-12, "{n}");
            assert!((dense.two_c1 - (1.0 - (1.0 - closed(n)) / (n * n))).abs() < 1e-12, "{n}");
        }
    }

    #[test]
    fn both_sides_of_a_boundary_let_the_same_light_through() {
        for eta in [0.4, 0.75, 0.999_999, 1.0, 1.000_000_1, 1.3, 4.0] {
            let (here, there) = (FresnelMoments::new(eta), FresnelMoments::new(1.0 / eta));
            let outside = 1.0 - there.two_c1;
            assert!((here.four_c_phi_outside - outside).abs() < 1e-12, "{eta}");
            assert!((4.0 * here.c_phi * eta * eta - outside).abs() < 1e-12, "{eta}");
        }
    }

    #[test]
    fn no_boundary_reflects_nothing() {
        let none = FresnelMoments::new(1.0);
        assert_eq!((none.two_c1, none.three_c2, none.four_c_phi_outside), (0.0, 0.0, 1.0));
        assert_eq!((none.a_groenhuis(), none.a_mixed()), (1.0, 1.0));
    }

    /// The published fits follow the integrals, roughly: kept as a check of both, used nowhere.
    #[test]
    fn the_fits_of_the_literature_follow_the_integrals() {
        let powers = |e: f64, c: &[f64]| c.iter().rev().fold(0.0, |sum, c| sum * e + c);
        let below = [0.919_317, -3.4793, 6.753_35, -7.809_89, 4.985_54, -1.368_81];
        let above = [-9.233_72, 22.2272, -20.9292, 10.2291, -2.543_96, 0.254_913];
        for eta in [0.6, 0.75, 0.9, 1.1, 1.3, 1.5, 1.8] {
            let fit = powers(eta, if eta < 1.0 { &below } else { &above });
            let exact = FresnelMoments::new(eta).two_c1;
            assert!((fit - exact).abs() < 0.005, "{eta}: {fit} {exact}");
        }
    }

    #[test]
    fn printed_values_of_the_second_moment() {
        for (eta, three_c2) in
            [(0.75, 0.039_867), (1.05, 0.035_510), (1.3, 0.300_267), (1.5, 0.464_431), (2.5, 0.820_640)]
        {
            assert!((FresnelMoments::new(eta).three_c2 - three_c2).abs() < 6e-7, "{eta}");
        }
    }
}
