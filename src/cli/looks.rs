//! What `marmor materials` says of looks.

use marmor::optics::{ChannelOptics, NamedLook, Trust};
use marmor::words::digits;
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Channels of a look, lengths in mm.
fn optics(look: &NamedLook) -> [ChannelOptics; 3] {
    let medium = look.medium(1.0, None).expect("looks of the program are in range: a test has them all");
    ChannelOptics::of(&medium)
}

fn list(values: [f64; 3]) -> String {
    values.map(|v| format!("{:>6}", digits(v, 3))).join(" ")
}

/// All looks, a line each.
pub fn table(looks: &[&NamedLook]) -> String {
    let mut out = String::from("[looks] made up, not measured\n");
    let _ = writeln!(out, "{:<27} {:>4} {:^20}  {:^20}  meant to be", "look", "eta", "colour", "l' [mm]");
    for named in looks {
        let look = &named.look;
        let (colour, length) = (list(look.colour), list(look.mean_free_path));
        let _ = writeln!(out, "{:<27} {:>4} {colour}  {length}  {}", named.name, look.eta, named.what);
    }
    out.push_str(
        "\nThe colour is what a thick body gives back of even light, the mirror image aside. Looks of your own:\n\
         `colour` and `mean_free_path` of a translucent material.",
    );
    out
}

/// One look with its coefficients.
pub fn details(named: &NamedLook) -> String {
    let (look, optics) = (&named.look, optics(named));
    let mut out = format!("{}: a look, not measured: {}; eta {}\n", named.name, named.what, look.eta);
    let columns = |v: [f64; 3]| v.map(|v| format!("{:>12}", digits(v, 4))).join("");
    let each = |f: &dyn Fn(&ChannelOptics) -> f64| columns(std::array::from_fn(|c| f(&optics[c])));
    let _ = writeln!(out, "                           {:>12}{:>12}{:>12}", "red", "green", "blue");
    let _ = writeln!(out, "colour                     {}", columns(look.colour));
    let _ = writeln!(out, "transport mfp l' [mm]      {}", columns(look.mean_free_path));
    let _ = writeln!(out, "g                          {}", columns([look.g; 3]));
    let _ = writeln!(out, "sigma_s' [1/mm]            {}", each(&|k| k.alpha_prime / k.transport_mean_free_path));
    let _ = writeln!(out, "sigma_a [1/mm]             {}", each(&|k| k.absorbed_prime / k.transport_mean_free_path));
    let _ = writeln!(out, "reduced albedo             {}", each(&|k| k.alpha_prime));
    let _ = writeln!(out, "1/sigma_tr [mm]            {}", each(&|k| k.diffusion_length));
    let _ = write!(out, "models to trust: {}", Trust::of(&optics));
    out
}

pub fn to_json(named: &NamedLook) -> Value {
    let (look, optics) = (&named.look, optics(named));
    let over = |f: fn(&ChannelOptics) -> f64| optics.map(|k| f(&k) / k.transport_mean_free_path);
    json!({
        "name": named.name,
        "look": true,
        "what": named.what,
        "eta": look.eta,
        "g": look.g,
        "colour": look.colour,
        "transport_mean_free_path_mm": look.mean_free_path,
        "sigma_s_prime_per_mm": over(|k| k.alpha_prime),
        "sigma_a_per_mm": over(|k| k.absorbed_prime),
        "outside_diffusion": optics.iter().any(ChannelOptics::outside_diffusion),
        "trusted_models": Trust::of(&optics).models(),
    })
}
