//! Angular moments of the Fresnel reflectance, which fix the boundary condition of every diffusion model.

/// Constants of a boundary, by quadrature in f64, once per material. `eta` = n_inside / n_outside.
#[derive(Clone, Copy, Debug)]
pub struct FresnelMoments {
    /// 2 C_1 met from inside: the diffuse internal reflectance F_dr.
    pub two_c1: f64,
    /// 3 C_2 met from inside.
    pub three_c2: f64,
    /// 4 C_phi(1/eta) = 1 - 2 C_1(1/eta): what T21 keeps of a cosine-weighted hemisphere outside.
    pub four_c_phi_outside: f64,
}

impl FresnelMoments {
    /// The moments of a boundary with relative index `eta` > 0.
    pub fn new(eta: f64) -> Self {
        let (two_c1, three_c2) = inside(eta);
        Self { two_c1, three_c2, four_c_phi_outside: eta * eta * (1.0 - two_c1) }
    }

    /// A of the extrapolated boundary after Groenhuis, (1 + F_dr) / (1 - F_dr) [JMLH01].
    pub fn a_groenhuis(&self) -> f64 {
        (1.0 + self.two_c1) / (1.0 - self.two_c1)
    }

    /// A with both moments, (1 + 3 C_2) / (1 - 2 C_1) [d'Eon 2012].
    pub fn a_mixed(&self) -> f64 {
        (1.0 + self.three_c2) / (1.0 - self.two_c1)
    }
}

/// (2 C_1, 3 C_2) of the reflectance met inside.
fn inside(eta: f64) -> (f64, f64) {
    // For eta > 1 over the outer cosine m, where the integrand is smooth; the totally reflected part is exact.
    let n = 4000;
    let (mut c1, mut c2) = (0.0, 0.0);
    for i in 0..n {
        // m = s²: resolves the square-root behaviour at grazing.
        let s = (f64::from(i) + 0.5) / f64::from(n);
        let (m, dm) = (s * s, 2.0 * s / f64::from(n));
        if eta >= 1.0 {
            let mu = (1.0 - (1.0 - m * m) / (eta * eta)).sqrt();
            let r = fresnel(eta, m);
            c1 += r * m / (eta * eta) * dm;
            c2 += r * mu * m / (eta * eta) * dm;
        } else {
            let r = fresnel(1.0 / eta, m);
            c1 += r * m * dm;
            c2 += r * m * m * dm;
        }
    }
    if eta > 1.0 {
        let mu_c2 = 1.0 - 1.0 / (eta * eta);
        c1 += mu_c2 / 2.0;
        c2 += mu_c2 * mu_c2.sqrt() / 3.0;
    }
    (2.0 * c1, 3.0 * c2)
}

fn fresnel(eta: f64, mu: f64) -> f64 {
    let sin2 = (1.0 - mu * mu) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let mu_t = (1.0 - sin2).sqrt();
    let (s, p) = ((mu - eta * mu_t) / (mu + eta * mu_t), (eta * mu - mu_t) / (eta * mu + mu_t));
    0.5 * (s * s + p * p)
}
