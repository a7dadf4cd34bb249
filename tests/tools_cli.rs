//! The real binary: `eval`, `profile` and `materials`, their files, messages and exit codes.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // a test that cannot run its program has failed

use marmor::Rgb;
use marmor::bssrdf::Slab;
use marmor::optics::Medium;
use std::io::{Read, Write};
use std::process::{Command, Output, Stdio};

fn marmor(args: &[&str], input: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_marmor"))
        .args(args)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_owned();
    // In its own thread, so that a full output pipe does not stop the input; a program that stops early is fine.
    let writer = std::thread::spawn(move || drop(stdin.write_all(input.as_bytes())));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    output
}

fn stdout(output: &Output) -> String {
    assert!(output.status.success(), "{}", stderr(output));
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// M(r) of the standard dipole in f64, with A for η = 1.3 from the exact moment of the reflectance.
fn standard(s: f64, a: f64, r: f64) -> f64 {
    let f_dr = 0.444_457_4;
    let (t, lift) = (s + a, 4.0 / 3.0 * (1.0 + f_dr) / (1.0 - f_dr));
    let decay = (3.0 * a * t).sqrt();
    let pole = |z: f64| {
        let d = r.hypot(z);
        z * (1.0 + decay * d) * (-decay * d).exp() / (d * d * d)
    };
    s / t / (4.0 * std::f64::consts::PI) * (pole(1.0 / t) + pole((1.0 + lift) / t))
}

#[test]
fn eval_appends_s_d_and_exitance_to_each_row() {
    let mut input = String::from("# a comment\nid,r,g,eta,sigma_s,sigma_a,note\n");
    let mut expected = Vec::new();
    for i in 0..2000 {
        let (s, a, r) = (1.0 + f64::from(i % 7), 0.001 * f64::from(1 + i % 5), 0.01 * f64::from(i));
        input += &format!("{i},{r},0.75,1.3,{},{a},\"one, two\"\n", 4.0 * s);
        expected.push(standard(s, a, r));
    }
    let out = stdout(&marmor(&["eval", "--model", "standard"], &input));
    let mut lines = out.lines();
    assert_eq!(lines.next(), Some("# a comment"));
    assert_eq!(lines.next(), Some("id,r,g,eta,sigma_s,sigma_a,note,S_d,exitance"));
    let mut rows = 0;
    for ((line, row), m) in lines.zip(input.lines().skip(2)).zip(expected) {
        let added: Vec<f64> = line.strip_prefix(row).unwrap()[1..].split(',').map(|v| v.parse().unwrap()).collect();
        assert!((added[1] / m - 1.0).abs() < 4e-6, "{line}: {m}");
        // S_d over the plane and the hemisphere outside, behind T21, is M.
        assert!((added[1] / (added[0] * std::f64::consts::PI * 0.938_868) - 1.0).abs() < 2e-6, "{line}");
        rows += 1;
    }
    assert_eq!(rows, 2000);
}

#[test]
fn eval_without_exit_normalisation_is_the_printed_formula() {
    let out = stdout(&marmor(
        &["eval", "--model", "standard", "--no-exit-normalisation"],
        "sigma_s,sigma_a,g,eta,r\n1,0.1,0,1.3,2\n",
    ));
    let row: Vec<f64> = out.lines().nth(1).unwrap().split(',').map(|v| v.parse().unwrap()).collect();
    let m = standard(1.0, 0.1, 2.0);
    assert!((row[5] * std::f64::consts::PI / m - 1.0).abs() < 2e-6 && (row[6] / m - 1.0).abs() < 2e-6, "{out}");
}

/// One column of a CSV as text.
fn column<'a>(table: &'a str, name: &str) -> Vec<&'a str> {
    let at = table.lines().next().unwrap().split(',').position(|n| n == name).unwrap_or_else(|| panic!("no `{name}`"));
    table.lines().skip(1).map(|row| row.split(',').nth(at).unwrap()).collect()
}

/// What of the published R and T is scattered in the slab of row `i` of the output `text`.
fn slab_shares(text: &str, i: usize) -> [f64; 2] {
    let number = |name: &str| column(text, name)[i].parse::<f64>().unwrap();
    let splat = |name: &str| Rgb::splat(number(name) as f32);
    let medium = Medium { sigma_s: splat("sigma_s"), sigma_a: splat("sigma_a"), g: 0.0, eta: number("eta") as f32 };
    let slab = Slab::between(&medium, number("thickness") as f32, number("eta_far") as f32, true).unwrap();
    slab.scattered().map(|share| f64::from(share[0]))
}

/// Rows of high-precision tables through the program: the columns, the unit and the geometry, not only the models.
#[test]
fn eval_reproduces_the_reference_rows() {
    let standard = include_str!("data/standard.csv");
    let beam = include_str!("data/pbd_normal.csv");
    let slab = include_str!("data/multipole.csv");
    let directional = include_str!("data/directional.csv");
    for (options, table, value) in [
        (&["standard"][..], standard, "Rd"),
        (&["beam"], beam, "M_multiple_kappa"),
        (&["slab"], slab, "Rd"),
        (&["slab", "--transmitted"], slab, "Td"),
        (&["directional"], directional, "S_d"),
    ] {
        // The tables' names for our columns, and a g where they list reduced scattering. The wanted value goes last,
        // so that it is the field before the results.
        let header = table.lines().next().unwrap().replace("_red", "").replace("eta_top", "eta");
        let reduced = !header.contains(",g,");
        let mut input = header.replace("eta_bottom", "eta_far") + if reduced { ",g,wanted\n" } else { ",wanted\n" };
        for (row, wanted) in table.lines().skip(1).zip(column(table, value)) {
            input += &format!("{row}{},{wanted}\n", if reduced { ",0" } else { "" });
        }
        let output = marmor(&[&["eval", "--model"], options].concat(), &input);
        let text = stdout(&output);
        let result = column(&text, if value == "S_d" { "wanted" } else { "exitance" });
        // `S_d` is also a column of the table: ours is the last.
        let last: Vec<&str> = text.lines().skip(1).map(|row| row.rsplit(',').next().unwrap()).collect();
        let results = if value == "S_d" { last } else { result };
        let (s, a, wanted) = (column(&text, "sigma_s"), column(&text, "sigma_a"), column(&text, "wanted"));
        let g = column(&text, "g");
        let (mut compared, mut loose) = (0, 0);
        for i in 0..results.len() {
            let number = |text: &str| text.parse::<f64>().unwrap();
            let (scattered, absorbed) = (number(s[i]) * (1.0 - number(g[i])), number(a[i]));
            // The tables of the slab are of the published formula, whose light is not all scattered in the slab.
            let share = if table == slab { slab_shares(&text, i)[usize::from(value == "Td")] } else { 1.0 };
            let (result, exact) = (number(results[i]), number(wanted[i]) * share);
            assert!(result.is_finite());
            // Below, f32 has no digits left.
            if exact.abs() < 1e-30 * (scattered + absorbed).powi(2) {
                continue;
            }
            let error = (result / exact - 1.0).abs();
            assert!(error < 1e-3, "{options:?}: {}", text.lines().nth(i + 1).unwrap());
            loose += usize::from(error > 2e-5);
            compared += 1;
        }
        assert!(compared > 30 && loose * 200 <= compared, "{options:?}: {loose} of {compared} rows are off by 2e-5");
    }
}

#[test]
fn eval_says_what_is_wrong_and_where() {
    let eval = |model: &str, input: &str| marmor(&["eval", "--model", model], input);
    let bad_row = eval("standard", "sigma_s,sigma_a,g,eta,r\n1,0.1,0,1.3,2\n1,0.1,0,1.3\n1,0.1,0,1.3,3\n");
    assert_eq!(bad_row.status.code(), Some(3));
    assert_eq!(
        stderr(&bad_row),
        "marmor: standard input, line 3: 4 fields where the header has 5\n",
        "one message, with the line"
    );
    assert_eq!(String::from_utf8(bad_row.stdout).unwrap().lines().count(), 2, "what came before is still there");
    let bad_header = eval("standard", "sigma_s,sigma_a,g,eat,r\n1,0.1,0,1.3,2\n");
    assert_eq!(bad_header.status.code(), Some(2));
    assert!(stderr(&bad_header).contains("lacks `eta` (did you mean `eat`?)"), "{}", stderr(&bad_header));
    let bad_model = eval("standrad", "");
    assert_eq!(bad_model.status.code(), Some(2));
    assert!(stderr(&bad_model).contains("did you mean `standard`?"), "{}", stderr(&bad_model));
    let no_thickness = eval("slab", "sigma_s,sigma_a,g,eta,r\n1,0.1,0,1.3,2\n");
    assert_eq!(no_thickness.status.code(), Some(2));
    assert!(stderr(&no_thickness).contains("`thickness`"), "{}", stderr(&no_thickness));
    let wrong_option = marmor(&["eval", "--model", "standard", "--calibrated"], "");
    assert_eq!(wrong_option.status.code(), Some(2));
}

#[test]
fn eval_takes_empty_input_and_windows_line_ends() {
    assert_eq!(stdout(&marmor(&["eval", "--model", "standard"], "")), "");
    let header = stdout(&marmor(&["eval", "--model", "standard"], "\u{feff}r,sigma_s,sigma_a,g,eta\r\n"));
    assert_eq!(header, "r,sigma_s,sigma_a,g,eta,S_d,exitance\n");
    let row = stdout(&marmor(&["eval", "--model", "standard"], "r,sigma_s,sigma_a,g,eta\r\n1,1,0,0,1.3\r\n\r\n"));
    assert_eq!(row.lines().count(), 3);
    assert!(!row.contains('\r'));
}

#[test]
fn eval_is_quiet_when_its_reader_leaves() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_marmor"))
        .args(["eval", "--model", "standard"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut stdin = child.stdin.take().unwrap();
    let rows = "sigma_s,sigma_a,g,eta,r\n".to_owned() + &"1,0.1,0,1.3,2\n".repeat(100_000);
    let _ = stdin.write_all(rows.as_bytes());
    drop(stdin);
    let mut message = String::new();
    child.stderr.take().unwrap().read_to_string(&mut message).unwrap();
    assert!(child.wait().unwrap().success());
    assert_eq!(message, "");
}

#[test]
fn profile_writes_a_table_and_a_plot() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let common = ["profile", "--material", "Marble", "--model", "standard,better", "--r", "0.1:10:20"];
    let table = stdout(&marmor(&common, ""));
    let file = path("marble.csv");
    assert!(marmor(&[&common[..], &["-o", &file]].concat(), "").status.success());
    assert_eq!(std::fs::read_to_string(&file).unwrap(), table, "the same table to a file and to standard output");
    let header = table.lines().position(|l| l == "curve,channel,r,exitance,standard_error").unwrap();
    let rows: Vec<Vec<&str>> = table.lines().skip(header + 1).map(|l| l.split(',').collect()).collect();
    assert_eq!(rows.iter().filter(|r| r[0] == "standard" && r[1] == "blue").count(), 20);
    assert!(rows.iter().filter(|r| r[0] == "monte_carlo" && r[1] == "green").count() > 40);
    let first: f64 = rows.iter().find(|r| r[0] == "standard").unwrap()[3].parse().unwrap();
    assert!(first > 0.0);
    let plot = path("marble.svg");
    assert!(marmor(&[&common[..], &["-o", &plot]].concat(), "").status.success());
    let svg = std::fs::read_to_string(&plot).unwrap();
    assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n") && !svg.contains("NaN"));
    for word in ["red", "green", "blue", "standard", "Monte Carlo", "distance r [mm]"] {
        assert!(svg.contains(word), "the plot lacks `{word}`");
    }
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 2, "no partial files stay behind");
}

#[test]
fn profile_of_numbers_scales_with_the_unit() {
    let value = |unit: &str, s: &str, a: &str, r: &str| -> f64 {
        let args = ["--sigma-s-prime", s, "--sigma-a", a, "--eta", "1.3", "--model", "standard", "--unit-of-r", unit];
        let out = stdout(&marmor(&[&["profile"][..], &args, &["--r", r]].concat(), ""));
        let row = out.lines().find(|l| l.starts_with("standard,grey,")).unwrap().to_owned();
        row.split(',').nth(3).unwrap().parse().unwrap()
    };
    let (mm, cm) = (value("mm", "1", "0.1", "2:3:2"), value("cm", "10", "1", "0.2:0.3:2"));
    assert!((mm / standard(1.0, 0.1, 2.0) - 1.0).abs() < 3e-6 && (cm / mm / 100.0 - 1.0).abs() < 3e-6, "{mm} {cm}");
}

#[test]
fn profile_refuses_what_makes_no_sense() {
    for (args, word) in [
        (&["--material", "marbel"][..], "did you mean `marble`?"),
        (&["--material", "marble", "--sigma-a", "1"], "cannot be used with"),
        (&[], "--material"),
        (&["--sigma-s-prime", "1", "--sigma-a", "-1", "--eta", "1.3"], "-1"),
        (&["--sigma-s-prime", "1,2", "--sigma-a", "1", "--eta", "1.3"], "three"),
        (&["--sigma-s-prime", "1", "--sigma-a", "1", "--eta", "0"], "eta"),
        (&["--material", "marble", "--r", "3:1:9"], "first radius"),
        (&["--material", "marble", "--unit-of-r", "inch"], "um, mm, cm or m"),
        (&["--material", "marble", "-o", "plot.pdf"], ".svg or .csv"),
    ] {
        let output = marmor(&[&["profile"], args].concat(), "");
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(word), "{args:?}: {}", stderr(&output));
    }
    let nowhere = marmor(&["profile", "--material", "marble", "--model", "standard", "-o", "/nowhere/at/all.svg"], "");
    assert_eq!(nowhere.status.code(), Some(4));
    assert!(stderr(&nowhere).contains("/nowhere/at/all.svg"), "{}", stderr(&nowhere));
}

#[test]
fn eval_may_go_on_past_bad_rows() {
    let rows = "sigma_s,sigma_a,g,eta,r\n1,0.1,0,1.3,2\n1,x,0,1.3\n1,0.1,0,1.3,-3\n1,0.1,0,1.3,2\n";
    let output = marmor(&["eval", "--model", "better", "--keep-going"], rows);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        stderr(&output).contains("2 bad rows left empty; the first: standard input, line 3"),
        "{}",
        stderr(&output)
    );
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!((lines.len(), lines[1], lines[3]), (5, lines[4], "1,0.1,0,1.3,-3,,"));
}

/// A line that may never end is not read to its end, whether rows may be bad or not; what came before it is written.
#[test]
fn eval_ends_at_a_line_without_end() {
    let rows = format!("sigma_s,sigma_a,g,eta,r\n1,0.1,0,1.3,2\n{}", "1".repeat(3 << 20));
    for more in [&[][..], &["--keep-going"]] {
        let output = marmor(&[&["eval", "--model", "standard"], more].concat(), &rows);
        assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
        assert!(stderr(&output).contains("standard input, line 3: longer than 1048576 bytes"), "{}", stderr(&output));
        assert_eq!(String::from_utf8(output.stdout).unwrap().lines().count(), 2);
    }
}

/// Appended to its own input, it would never come to an end.
#[cfg(unix)]
#[test]
fn eval_does_not_read_what_it_writes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rows.csv");
    let rows = "sigma_s,sigma_a,g,eta,r\n1,0.1,0,1.3,2\n";
    std::fs::write(&path, rows).unwrap();
    let open = || std::fs::File::options().read(true).append(true).open(&path).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_marmor"));
    let output = command.args(["eval", "--model", "standard"]).stdin(open()).stdout(open()).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("the file that the rows come from"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), rows);
}

#[test]
fn materials_lists_every_row_and_its_doubts() {
    let table = stdout(&marmor(&["materials"], ""));
    assert!(table.contains("28 of 47 materials are outside diffusion theory"), "{table}");
    let row = |name: &str| table.lines().find(|l| l.starts_with(&format!("{name} "))).unwrap().to_owned();
    assert!(row("wholemilk").contains("beam, better, standard"));
    assert!(row("ketchup").contains("trace paths (gb)"));
    assert!(table.lines().all(|line| line.chars().count() <= 100), "{table}");
    let json: serde_json::Value = serde_json::from_str(&stdout(&marmor(&["materials", "--json"], ""))).unwrap();
    let (looks, rows): (Vec<_>, Vec<_>) = json.as_array().unwrap().iter().partition(|r| r["look"] == true);
    assert_eq!((rows.len(), looks.len()), (47, 7));
    let milk = rows.iter().find(|r| r["name"] == "lowfat_milk").unwrap();
    assert_eq!(milk["as_printed"]["volume_ml_in_23_litres"], 16.0);
    assert_eq!(milk["source"], "NGD06");
    assert!((milk["sigma_s_prime_per_mm"][0].as_f64().unwrap() / 0.89187 - 1.0).abs() < 1e-4);
    assert_eq!(rows.iter().filter(|r| r["outside_diffusion"] == true).count(), 28);
    let spectralon = rows.iter().find(|r| r["name"] == "spectralon").unwrap();
    assert!(spectralon["channels"][0]["diffusion_length_mm"].is_null());
    let one = stdout(&marmor(&["materials", "Lowfat Milk"], ""));
    assert!(one.contains("16 ml in 23 litres") && one.contains("[NGD06]"), "{one}");
    let unknown = marmor(&["materials", "lowfat mlik"], "");
    assert_eq!(unknown.status.code(), Some(2));
}

#[test]
fn looks_are_told_from_what_was_measured() {
    let table = stdout(&marmor(&["materials"], ""));
    let (measured, looks) = table.split_once("[looks] made up, not measured").unwrap();
    for name in ["jade", "wax", "soap", "candle", "grape", "leaf", "milk_glass"] {
        let starts = |text: &str| text.lines().any(|line| line.starts_with(&format!("{name} ")));
        assert!(starts(looks) && !starts(measured), "{name}");
        let one = stdout(&marmor(&["materials", name], ""));
        assert!(one.starts_with(&format!("{name}: a look, not measured")), "{one}");
    }
    let milk = marmor(&["materials", "milk"], "");
    assert_eq!(milk.status.code(), Some(2));
    assert!(stderr(&milk).contains("did you mean `skimmilk`, `wholemilk`"), "{}", stderr(&milk));
    let plot = marmor(&["profile", "--material", "jade"], "");
    assert!(stderr(&plot).contains("`jade` is a look"), "{}", stderr(&plot));
    let json: serde_json::Value = serde_json::from_str(&stdout(&marmor(&["materials", "jade", "--json"], ""))).unwrap();
    let sum = |c: usize| ["sigma_s_prime_per_mm", "sigma_a_per_mm"].map(|key| json[0][key][c].as_f64().unwrap());
    assert!((sum(0).iter().sum::<f64>() * 0.8 - 1.0).abs() < 1e-6, "{json}");
}
