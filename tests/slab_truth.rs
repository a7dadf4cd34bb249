//! What leaves slabs on both faces, ring by ring and by order, as the path code of the renderer has it, against another
//! Monte Carlo program. `MARMOR_REFERENCE_DIR` runs all its slabs; `cargo bench --bench truth` prints half spaces as well.
#![allow(clippy::unwrap_used)] // a table of this repository that cannot be read has failed
#![allow(clippy::print_stdout)] // with --nocapture, the figures of a run

#[path = "support/pencils.rs"]
mod pencils;
#[path = "support/profiles.rs"]
mod profiles;
mod support;

use support::{Row, table, whole_table};

fn slabs(totals: &[Row], bins: &[Row], paths: u64) -> usize {
    let mut run = 0;
    for row in totals {
        let mine: Vec<&Row> = bins.iter().filter(|b| b.text("name") == row.text("name")).collect();
        if mine.is_empty() {
            continue;
        }
        let found = profiles::against(row, &mine, paths, 5);
        println!("{}: chi-square {:.1} of {}, z {:?}", row.text("name"), found.chi_square, found.freedom, found.z);
        // Six standard deviations of the law of chi-square, and of totals.
        let f = f64::from(found.freedom);
        assert!(found.freedom >= 20, "{}: {} bins", row.text("name"), found.freedom);
        assert!(found.chi_square < f + 6.0 * (2.0 * f).sqrt(), "{}: {} of {f}", row.text("name"), found.chi_square);
        assert!(found.z.iter().flatten().all(|z| z.abs() < 6.0), "{}: {:?}", row.text("name"), found.z);
        run += 1;
    }
    run
}

#[test]
fn slabs_reflect_and_transmit_as_another_program_says() {
    assert_eq!(slabs(&table("mc_totals_slab.csv"), &table("mc_profile_slab.csv"), 300_000), 3);
}

#[test]
fn all_slabs() {
    let Some(bins) = whole_table("mc_profile_slab.csv") else { return };
    assert!(slabs(&whole_table("mc_totals.csv").unwrap(), &bins, 400_000) > 15);
}
