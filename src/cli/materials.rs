//! `marmor materials`: measured media, and looks.

use super::{looks, stdout};
use marmor::Result;
use marmor::optics::{CATALOGUE, ChannelOptics, Coefficients, LOOKS, Measured, NamedLook, Preset};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::process::ExitCode;

/// Options.
#[derive(clap::Args)]
pub struct Args {
    /// Only this material or look, with its coefficients and where they come from
    name: Option<String>,
    /// Everything about each row as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: Args) -> Result<ExitCode> {
    let one = args.name.as_deref().map(Preset::find_or_explain).transpose();
    let one = one.map_err(|e| marmor::Error::usage(e.to_string()))?;
    let (rows, looks): (Vec<&Measured>, Vec<&NamedLook>) = match one {
        None => (CATALOGUE.iter().collect(), LOOKS.iter().collect()),
        Some(Preset::Measured(row)) => (vec![row], Vec::new()),
        Some(Preset::Look(look)) => (Vec::new(), vec![look]),
    };
    let mut text = if args.json {
        let list: Vec<Value> = rows.into_iter().map(to_json).chain(looks.into_iter().map(looks::to_json)).collect();
        serde_json::to_string_pretty(&list).expect("plain values have a JSON form")
    } else {
        match one {
            Some(Preset::Measured(row)) => details(row),
            Some(Preset::Look(look)) => looks::details(look),
            None => format!("{}\n\n{}", table(&rows), looks::table(&looks)),
        }
    };
    text.push('\n');
    stdout::write(format_args!("{text}"));
    Ok(ExitCode::SUCCESS)
}

/// True if any channel is outside diffusion theory.
fn outside(row: &Measured) -> bool {
    row.optics().iter().any(ChannelOptics::outside_diffusion)
}

/// A table of at most 100 columns, a section for each source.
fn table(rows: &[&Measured]) -> String {
    let mut out = String::new();
    let mut source = "";
    for row in rows {
        if row.source != source {
            let blank = if source.is_empty() { "" } else { "\n" };
            source = row.source;
            let _ = writeln!(out, "{blank}[{source}] {}", row.table);
            let _ = writeln!(
                out,
                "{:<27} {:>4} {:^20}  {:^20}  models to trust",
                "material", "eta", "reduced albedo", "l' [mm]"
            );
        }
        let optics = row.optics();
        let lengths = optics.map(|k| short(k.transport_mean_free_path)).join(" ");
        let outside: String =
            optics.iter().zip("rgb".chars()).filter(|(k, _)| k.outside_diffusion()).map(|(_, c)| c).collect();
        let trust = match (row.trust().models(), outside.as_str()) {
            ([], "") => "trace paths".to_owned(),
            ([], _) => format!("trace paths ({outside})"),
            _ => row.trust().to_string(),
        };
        let albedos = optics.map(|k| albedo(&k)).join(" ");
        let _ = writeln!(out, "{:<27} {:>4} {albedos}  {lengths}  {trust}", row.name, row.eta);
    }
    let outside = rows.iter().filter(|row| outside(row)).count();
    let _ = write!(
        out,
        "\nRed, green, blue; l' is the transport mean free path 1/(sigma_s (1 - g) + sigma_a).\n\
         {outside} of {} materials are outside diffusion theory in some channel (reduced albedo below 0.5), named in\n\
         brackets: no BSSRDF model is near the truth there, only paths traced through the volume are.\n\
         `marmor materials NAME` shows one row: coefficients, g, source, diffusion length, reflectance.",
        rows.len()
    );
    out
}

fn details(row: &Measured) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "{}: [{}], {}; eta {}", row.name, row.source, row.table, row.eta);
    let list = |v: [f64; 3]| v.map(|v| format!("{:>12}", short(v))).join("");
    match row.coefficients {
        Coefficients::Reduced { .. } => {
            let _ = writeln!(out, "the paper lists reduced scattering in 1/mm; its phase function is unknown, g = 0");
        }
        Coefficients::Tank { volume_ml: Some(volume), .. } => {
            let _ = writeln!(out, "measured diluted, {volume} ml in 23 litres of water; undiluted here");
        }
        Coefficients::Tank { volume_ml: None, .. } => {
            let _ = writeln!(out, "as measured, in 23 litres of water");
        }
    }
    let _ = writeln!(out, "                           {:>12}{:>12}{:>12}", "red", "green", "blue");
    let _ = writeln!(out, "sigma_s' [1/mm]            {}", list(row.sigma_s_prime_per_mm()));
    let _ = writeln!(out, "sigma_a [1/mm]             {}", list(row.sigma_a_per_mm()));
    let _ = writeln!(out, "g                          {}", list(row.g()));
    let optics = row.optics();
    let each = |f: &dyn Fn(&ChannelOptics) -> f64| list(std::array::from_fn(|c| f(&optics[c])));
    let _ = writeln!(out, "reduced albedo             {}", each(&|k| k.alpha_prime));
    let _ = writeln!(out, "mean free path [mm]        {}", each(&|k| k.mean_free_path));
    let _ = writeln!(out, "transport mfp l' [mm]      {}", each(&|k| k.transport_mean_free_path));
    let _ = writeln!(out, "1/sigma_tr [mm]            {}", each(&|k| k.diffusion_length));
    let _ = writeln!(out, "reflectance, isotropic     {}", list(row.reflectance_isotropic()));
    if let Some(listed) = row.reflectance {
        let _ = writeln!(out, "reflectance, listed        {}   [{}]", list(listed.value), listed.source);
    }
    let _ = writeln!(out, "models to trust: {}", row.trust());
    let _ = write!(out, "numbers: {}", row.provenance);
    out
}

fn to_json(row: &Measured) -> Value {
    // JSON has no infinity: a length without an end is null.
    let finite = |v: f64| if v.is_finite() { json!(v) } else { Value::Null };
    let channels: Vec<Value> = row
        .optics()
        .iter()
        .map(|k| {
            json!({
                "reduced_albedo": k.alpha_prime,
                "absorbed_per_transport_event": k.absorbed_prime,
                "albedo": k.alpha,
                "g": k.g,
                "mean_free_path_mm": finite(k.mean_free_path),
                "transport_mean_free_path_mm": finite(k.transport_mean_free_path),
                "diffusion_length_mm": finite(k.diffusion_length),
                "outside_diffusion": k.outside_diffusion(),
            })
        })
        .collect();
    let printed = match row.coefficients {
        Coefficients::Reduced { sigma_s_prime_per_mm, sigma_a_per_mm } => json!({
            "reduced": true,
            "unit": "1/mm",
            "sigma_s_prime_per_mm": sigma_s_prime_per_mm,
            "sigma_a_per_mm": sigma_a_per_mm,
        }),
        Coefficients::Tank { sigma_t_per_100_mm, sigma_s_per_100_mm, g, volume_ml } => json!({
            "reduced": false,
            "unit": "1/(100 mm)",
            "sigma_t_per_100_mm": sigma_t_per_100_mm,
            "sigma_s_per_100_mm": sigma_s_per_100_mm,
            "g": g,
            "volume_ml_in_23_litres": volume_ml,
        }),
    };
    let listed = row.reflectance.map(|l| json!({ "value": l.value, "digits": l.digits, "source": l.source }));
    json!({
        "name": row.name,
        "look": false,
        "source": row.source,
        "table": row.table,
        "eta": row.eta,
        "as_printed": printed,
        "sigma_s_prime_per_mm": row.sigma_s_prime_per_mm(),
        "sigma_a_per_mm": row.sigma_a_per_mm(),
        "channels": channels,
        "outside_diffusion": outside(row),
        "reflectance_isotropic": row.reflectance_isotropic(),
        "reflectance_listed": listed,
        "trusted_models": row.trust().models(),
        "provenance": row.provenance,
    })
}

/// Six columns; what four decimals would round to 1 is shown by what is missing.
fn albedo(k: &ChannelOptics) -> String {
    match k.absorbed_prime {
        0.0 => format!("{:>6}", 1),
        missing if missing < 5e-5 => format!("1-{missing:.0e}"),
        _ => short(k.alpha_prime),
    }
}

/// Six columns: three or four significant digits.
fn short(value: f64) -> String {
    let text = match value {
        v if v.is_infinite() => "inf".to_owned(),
        0.0 => "0".to_owned(),
        v if (0.0995..0.999_95).contains(&v) => format!("{v:.4}"),
        v if v >= 1e5 => format!("{v:.0e}"),
        v if v >= 999.5 => format!("{v:.0}"),
        v if v >= 0.0995 => {
            let digits = (2 - v.log10().floor() as i32).max(0) as usize;
            format!("{v:.digits$}")
        }
        v if v >= 0.001 => format!("{v:.4}"),
        v => format!("{v:.0e}"),
    };
    format!("{text:>6}")
}
