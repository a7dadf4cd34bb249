//! Media by name: those measured, and looks.

use super::catalogue::{CATALOGUE, Measured, find, plain};
use super::looks::{LOOKS, NamedLook};
use crate::error::{Error, Result, did_you_mean};

/// A medium that has a name.
#[derive(Clone, Copy, Debug)]
pub enum Preset {
    /// Measured, with its paper.
    Measured(&'static Measured),
    /// Made up.
    Look(&'static NamedLook),
}

impl Preset {
    /// The medium called `name`, compared without case, blanks and punctuation.
    pub fn find(name: &str) -> Option<Self> {
        let look = || LOOKS.iter().find(|look| plain(look.name) == plain(name));
        find(name).map(Self::Measured).or_else(|| look().map(Self::Look))
    }

    /// Like [`Self::find`], with an error that names what may be meant. The caller adds where the name stands.
    ///
    /// # Errors
    /// A scene error if nothing has that name.
    pub fn find_or_explain(name: &str) -> Result<Self> {
        Self::find(name).ok_or_else(|| {
            let hint = meant(name, names());
            Error::scene(format!("no measured medium or look `{name}`{hint}; `marmor materials` lists them"))
        })
    }
}

/// The measured medium called `name`, with an error that names what may be meant. The caller adds where the name stands.
///
/// # Errors
/// A scene error if no row has that name.
pub fn find_or_explain(name: &str) -> Result<&'static Measured> {
    find(name).ok_or_else(|| {
        let hint = match Preset::find(name) {
            Some(Preset::Look(look)) => format!(": `{}` is a look", look.name),
            _ => meant(name, CATALOGUE.iter().map(|m| m.name)),
        };
        Error::scene(format!("no measured medium `{name}`{hint}; `marmor materials` lists them"))
    })
}

/// All names, measured media first.
fn names() -> impl Iterator<Item = &'static str> + Clone {
    CATALOGUE.iter().map(|m| m.name).chain(LOOKS.iter().map(|look| look.name))
}

/// All of `known` that have `name` in theirs, else the nearest one.
fn meant(name: &str, known: impl Iterator<Item = &'static str> + Clone) -> String {
    let wanted = plain(name);
    let with: Vec<String> =
        known.clone().filter(|n| wanted.len() > 2 && plain(n).contains(&wanted)).map(|n| format!("`{n}`")).collect();
    match &with[..] {
        [] => did_you_mean(&name.to_lowercase(), known),
        _ => format!(" (did you mean {}?)", with.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_has_a_name_of_its_own() {
        let all: Vec<String> = names().map(plain).collect();
        for (i, name) in all.iter().enumerate() {
            assert!(!all[..i].contains(name), "{name}");
        }
        assert!(matches!(Preset::find("Milk Glass"), Some(Preset::Look(look)) if look.name == "milk_glass"));
        assert!(matches!(Preset::find("marble"), Some(Preset::Measured(row)) if row.source == "JMLH01"));
    }

    #[test]
    fn part_of_a_name_finds_all_that_have_it() {
        let said = Preset::find_or_explain("milk").unwrap_err().to_string();
        assert!(said.contains("did you mean") && said.contains("`skimmilk`, `wholemilk`"), "{said}");
        assert!(said.contains("`milk_glass`"), "{said}");
        let said = find_or_explain("milk").unwrap_err().to_string();
        assert!(said.contains("`wholemilk`") && !said.contains("milk_glass"), "{said}");
        let said = Preset::find_or_explain("jad").unwrap_err().to_string();
        assert!(said.contains("did you mean `jade`?"), "{said}");
        let said = find_or_explain("ketchp").unwrap_err().to_string();
        assert!(said.contains("did you mean `ketchup`?"), "{said}");
        let said = find_or_explain("jade").unwrap_err().to_string();
        assert!(said.contains("`jade` is a look"), "{said}");
    }
}
