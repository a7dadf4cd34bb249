//! Which model to trust for a medium, by the validity chart of docs/models.md (analytic models against Monte Carlo
//! transport, 57 half spaces and 10 slabs).

use super::ModelName;
use crate::optics::Medium;

/// A model and the reason for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The model; never [`ModelName::Auto`].
    pub name: ModelName,
    /// One sentence for the log: what decided, and what remains doubtful.
    pub why: String,
    /// Whether an analytic model is to be trusted at all here; else a volume path tracer is.
    pub trusted: bool,
}

/// Reduced albedo above which diffusion is trusted.
const LEAST_ALBEDO: f64 = 0.6;
/// Mean cosine up to which similarity holds for every albedo.
const LARGEST_G: f64 = 0.8;
/// Thickness from which a slab is trusted [transport mean free paths].
const LEAST_THICKNESS: f64 = 2.0;

/// Thickness from which a slab is a half space [transport mean free paths].
const MOST_THICKNESS: f64 = 1e4;

/// The best model there is for `medium`, in a slab of `thickness` [unit] if the object is one.
pub fn choose(medium: &Medium, thickness: Option<f32>) -> Choice {
    let scattering = || medium.channels().into_iter().filter(|k| k.alpha_prime > 0.0);
    let albedo = scattering().map(|k| k.alpha_prime).fold(f64::INFINITY, f64::min);
    if albedo.is_infinite() {
        return Choice {
            name: ModelName::Standard,
            why: "nothing scatters: every model is black".into(),
            trusted: true,
        };
    }
    if let Some(thickness) = thickness {
        let in_paths = |sigma: f64| sigma * f64::from(thickness);
        let relative = in_paths(scattering().map(|k| k.sigma_t_prime).fold(f64::INFINITY, f64::min));
        let densest = in_paths(scattering().map(|k| k.sigma_t_prime).fold(0.0, f64::max));
        if relative > LEAST_THICKNESS && densest < MOST_THICKNESS {
            let why = format!("a slab {relative:.1} transport mean free paths thick: both faces count");
            return Choice { name: ModelName::Slab, why, trusted: albedo > LEAST_ALBEDO };
        }
        if relative <= LEAST_THICKNESS {
            let why = format!("{relative:.2} transport mean free paths thick: below 2, trace the volume instead");
            return Choice { name: half_space(), why, trusted: false };
        }
    }
    let g = medium.g;
    let (trusted, judgement) = if albedo < LEAST_ALBEDO {
        (false, format!("reduced albedo {albedo:.2} is below 0.6, where diffusion fails: trace the volume to be sure"))
    } else if g > LARGEST_G && albedo < 0.99 {
        (false, format!("g = {g} with reduced albedo {albedo:.3} breaks similarity: trace the volume to be sure"))
    } else {
        (true, format!("reduced albedo {albedo:.3}, g = {g}: within the chart"))
    };
    let name = half_space();
    Choice { name, why: format!("`{}` is nearest to transport for a half space; {judgement}", name.name()), trusted }
}

/// The model of a half space that is nearest to transport, of those there are: photon beam diffusion with single
/// scattering is within 5 % of the profile, the standard dipole within 28 % of the profile and 2 % of the total.
fn half_space() -> ModelName {
    ModelName::ALL.into_iter().find(|m| m.name() == "beam").unwrap_or(ModelName::Standard)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;

    fn medium(s: f32, a: f32, g: f64) -> Medium {
        Medium::unreduced(Rgb::splat(s), Rgb::splat(a), g, 1.3).unwrap()
    }

    #[test]
    fn the_chart_decides() {
        let milk = choose(&medium(2.55, 0.0011, 0.0), None);
        assert!(milk.trusted && milk.name == half_space(), "{milk:?}");
        let dark = choose(&medium(0.07, 0.97, 0.0), None);
        assert!(!dark.trusted && dark.why.contains("trace the volume"), "{dark:?}");
        let forward = choose(&medium(20.0, 0.2, 0.95), None);
        assert!(!forward.trusted && forward.why.contains("similarity"), "{forward:?}");
        let slab = choose(&medium(2.55, 0.0011, 0.0), Some(4.0));
        assert!(slab.trusted && slab.name == ModelName::Slab, "{slab:?}");
        assert!(!choose(&medium(2.55, 0.0011, 0.0), Some(0.5)).trusted);
        assert_eq!(choose(&medium(2.55, 0.0011, 0.0), Some(1e6)).name, half_space());
        assert!(!choose(&medium(2.55, 0.0011, 0.0), Some(f32::NAN)).why.is_empty());
        assert_ne!(choose(&medium(0.0, 1.0, 0.0), None).name, ModelName::Auto);
    }
}
