//! Stiff, extreme, broken: every case has a declared outcome, which is the end of its name. `ok`: renders without a word;
//! `warns`: renders, and says what is odd; `refused`: an error that names it, before anything is rendered. Each case that
//! renders does so with every method on every backend of the build; what is known of its light, closed forms and bounds, is
//! asserted (`furnace.rs`). docs/robustness.md lists them all, with how each is known to be right.
#![allow(clippy::unwrap_used)] // a scene of this file that does not load where it should has failed

mod cameras;
mod files;
mod furnace;
mod harness;
mod insides;
mod lights;
mod list;
mod media;
mod meshes;
#[path = "../parts/mod.rs"]
mod parts;
#[path = "../rendering/mod.rs"]
mod rendering;
mod sizes;
