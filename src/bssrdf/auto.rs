//! The model for a medium: what the validity chart of `optics` trusts most, or a slab where both faces count.

use super::{ModelKind, ModelName, ModelOption, ModelOptions};
use crate::optics::{ChannelOptics, Medium, Trust};
use crate::words::{albedo, digits};

/// Whichever [`choose`] finds best.
pub(super) static MODEL: ModelKind = ModelKind {
    takes: &[ModelOption::Thickness],
    ..ModelKind::new("auto", |medium, options| choose_behind(medium, options).name.build(medium, options))
};

/// A model and the reason for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The model; never [`ModelName::AUTO`].
    pub name: ModelName,
    /// One sentence for the log: what decided, and what remains doubtful.
    pub why: String,
    /// Whether a model is to be trusted at all here; else paths are to be traced.
    pub trusted: bool,
}

/// Thickness from which a slab is trusted [transport mean free paths].
const LEAST_THICKNESS: f64 = 2.0;

/// Thickness from which a slab is a half space [transport mean free paths].
const MOST_THICKNESS: f64 = 1e4;

impl std::fmt::Display for Choice {
    /// `auto -> beam (why)`: for logs and file headers.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "auto -> {} ({})", self.name.name(), self.why)
    }
}

/// What [`choose`] finds, or `standard` where that model has no rough boundary and `options` ask for one.
pub fn choose_behind(medium: &Medium, options: &ModelOptions) -> Choice {
    let choice = choose(medium, options.thickness);
    if options.boundary.is_none() || choice.name.takes(ModelOption::Boundary) {
        return choice;
    }
    let why = format!("`{}`, which would be nearer, knows of smooth boundaries alone", choice.name.name());
    Choice { name: ModelName::STANDARD, why, trusted: choice.trusted }
}

/// The best model there is for `medium`, in a slab of `thickness` \[unit\] if the object is one.
pub fn choose(medium: &Medium, thickness: Option<f32>) -> Choice {
    let scattering = || medium.channels().into_iter().filter(|k| k.alpha_prime > 0.0);
    if scattering().next().is_none() {
        let why = "nothing scatters: every model is black".into();
        return Choice { name: ModelName::STANDARD, why, trusted: true };
    }
    let optics = ChannelOptics::of(medium);
    let trust = Trust::of(&optics);
    let trusted = trust != Trust::PathTracing;
    if let Some(thickness) = thickness {
        let in_paths = |sigma: f64| sigma * f64::from(thickness);
        let relative = in_paths(scattering().map(|k| k.sigma_t_prime).fold(f64::INFINITY, f64::min));
        let densest = in_paths(scattering().map(|k| k.sigma_t_prime).fold(0.0, f64::max));
        if relative > LEAST_THICKNESS && densest < MOST_THICKNESS {
            let why = format!("{relative:.1} transport mean free paths thick: both faces count");
            return Choice { name: ModelName::SLAB, why, trusted };
        }
        if relative <= LEAST_THICKNESS {
            let why = format!("{} transport mean free paths thick, below 2: no model is near", digits(relative, 3));
            return Choice { name: ModelName::BEAM, why, trusted: false };
        }
    }
    let least = optics.iter().map(|k| k.alpha_prime).fold(f64::INFINITY, f64::min);
    let numbers = format!("least reduced albedo {}, g {}", albedo(least), medium.g);
    let verdict = match trust {
        Trust::Diffusion | Trust::WithSingleScattering => "the nearest model to transport",
        Trust::Marginal => "the nearest model to transport, marginal here",
        Trust::PathTracing => "outside diffusion theory: no model is near",
    };
    // Photon beam diffusion with single scattering is first wherever the chart trusts any; where it trusts none, too.
    Choice { name: ModelName::BEAM, why: format!("{numbers}: {verdict}"), trusted }
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
        assert!(milk.trusted && milk.name == ModelName::BEAM, "{milk:?}");
        let dark = choose(&medium(0.07, 0.97, 0.0), None);
        assert!(!dark.trusted && dark.why.contains("no model is near"), "{dark:?}");
        let forward = choose(&medium(20.0, 2.0, 0.95), None);
        assert!(!forward.trusted && forward.why.contains("g 0.95:"), "{forward:?}");
        let slab = choose(&medium(2.55, 0.0011, 0.0), Some(4.0));
        assert!(slab.trusted && slab.name == ModelName::SLAB, "{slab:?}");
        assert!(!choose(&medium(2.55, 0.0011, 0.0), Some(0.5)).trusted);
        assert_eq!(choose(&medium(2.55, 0.0011, 0.0), Some(1e6)).name, ModelName::BEAM);
        assert!(!choose(&medium(2.55, 0.0011, 0.0), Some(f32::NAN)).why.is_empty());
        assert_ne!(choose(&medium(0.0, 1.0, 0.0), None).name, ModelName::AUTO);
    }

    #[test]
    fn choice_and_chart_agree_on_every_medium_of_the_catalogue() {
        for row in crate::optics::CATALOGUE {
            let medium = row.medium(1.0);
            let (choice, trust) = (choose(&medium, None), Trust::of(&ChannelOptics::of(&medium)));
            assert_eq!(choice.trusted, trust != Trust::PathTracing, "{}", row.name);
            if let Some(best) = trust.models().first() {
                assert_eq!(*best, choice.name.name(), "{}", row.name);
            }
        }
    }
}
