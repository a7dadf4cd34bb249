//! Film files: what is written comes back, parts join to the whole, and what is damaged or foreign is refused.
#![allow(clippy::unwrap_used)] // a fixture that cannot be made is a failed test

use marmor::ErrorKind;
use marmor::film::{Checkpoint, Film, Identity, Window};
use marmor::math::{Rgb, hash_combine};
use std::fs;
use std::path::Path;

const WINDOW: Window = Window { x0: 1, y0: 2, x1: 9, y1: 7 };

/// Samples over many decades, with a NaN and a negative one here and there.
fn sample(pass: u32, pixel: usize) -> Rgb {
    let bits = hash_combine(u64::from(pass), pixel as u64);
    match bits % 31 {
        0 => Rgb([f32::NAN, 1.0, 1.0]),
        1 => Rgb::splat(-0.25),
        k => Rgb::from_fn(|c| (bits >> (16 + 8 * c)) as u16 as f32 * 2_f32.powi(k as i32 - 16)),
    }
}

fn film(passes: std::ops::Range<u32>) -> Film {
    let mut film = Film::new([10, 8], WINDOW).unwrap().starting_at(passes.start);
    for pass in passes {
        let samples: Vec<Rgb> = (0..WINDOW.area()).map(|i| sample(pass, i)).collect();
        film.add(WINDOW, &samples);
        film.end_pass();
    }
    film
}

fn identity() -> Identity {
    let facts = [("version", "1"), ("seed", "7"), ("scene", "a = 1\nb = 2\n")];
    Identity(facts.map(|(name, value)| (name.to_string(), value.to_string())).to_vec())
}

fn write(path: &Path, film: &Film) {
    let attributes = [("method".to_string(), "direct".to_string())];
    Checkpoint::write(path, film, &identity(), &attributes, serde_json::json!({ "seconds": 1.5 })).unwrap();
}

#[test]
fn a_film_comes_back_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.film");
    for passes in [0..0, 0..1, 3..20] {
        let film = film(passes);
        write(&path, &film);
        let read = Checkpoint::read(&path).unwrap();
        assert_eq!(read.film, film);
        assert_eq!((read.identity, read.attributes.len()), (identity(), 1));
        assert_eq!(read.progress["seconds"], 1.5);
    }
}

#[test]
fn any_split_joins_to_the_film_of_all_passes() {
    let whole = film(0..40);
    assert!(whole.counts().non_finite > 0 && whole.counts().negative > 0);
    for cuts in [vec![0, 1, 40], vec![0, 7, 8, 9, 31, 40], vec![0, 20, 40]] {
        let mut parts: Vec<Film> = cuts.windows(2).map(|w| film(w[0]..w[1])).collect();
        for turn in 0..parts.len() {
            parts.rotate_left(1);
            let mut joined = parts[0].clone();
            parts[1..].iter().for_each(|part| joined.join(part).unwrap());
            assert_eq!(joined, whole, "{cuts:?}, {turn}");
            assert_eq!(joined.half_images(), whole.half_images());
        }
    }
}

/// All tiles of a pass at once give what one after the other gives.
#[test]
fn a_pass_of_tiles_is_its_tiles() {
    let window = Window { x0: 1, y0: 2, x1: 9, y1: 7 };
    let tile = |x0, y0, x1, y1| Window { x0, y0, x1, y1 };
    let cuts = [tile(1, 2, 4, 4), tile(4, 2, 9, 4), tile(1, 4, 4, 7), tile(4, 4, 9, 7)];
    let (mut single, mut together) = (film(0..0), film(0..0));
    for pass in 0..9 {
        let of = |t: Window| (0..t.area()).map(|i| sample(pass, window.index(t.pixel(i)[0], t.pixel(i)[1]))).collect();
        let tiles: Vec<(Window, Vec<Rgb>)> = cuts.iter().map(|&t| (t, of(t))).collect();
        tiles.iter().for_each(|(t, samples)| single.add(*t, samples));
        together.add_pass(&tiles);
        single.end_pass();
        together.end_pass();
    }
    assert_eq!(single, together);
    assert_eq!(single, film(0..9));
}

#[test]
fn passes_count_once_and_gaps_are_known() {
    let mut a = film(0..4);
    let error = a.join(&film(3..5)).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Usage);
    assert!(error.to_string().contains("3..4 are in both"), "{error}");
    assert_eq!(a, film(0..4), "a refused part changes nothing");
    a.join(&film(8..9)).unwrap();
    assert_eq!((a.ranges_text().as_str(), a.passes()), ("0..4,8..9", 5));
    a.join(&film(4..8)).unwrap();
    assert_eq!(a, film(0..9));
    let other = Film::new([10, 8], Window::full([10, 8])).unwrap();
    assert!(a.join(&other).unwrap_err().to_string().contains("different pictures"));
}

#[test]
fn a_foreign_film_is_refused_by_its_first_difference() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.film");
    write(&path, &film(0..2));
    let read = Checkpoint::read(&path).unwrap();
    read.belongs_to(&identity(), &path).unwrap();
    let with = |name: &str, value: &str| {
        let mut other = identity();
        match other.0.iter_mut().find(|(n, _)| n == name) {
            Some(fact) => fact.1 = value.into(),
            None => other.0.push((name.into(), value.into())),
        }
        let error = read.belongs_to(&other, &path).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Usage);
        assert_ne!(other.hash(), identity().hash());
        error.to_string()
    };
    assert!(with("seed", "8").contains("seed: `7` there, `8` here"));
    assert!(with("scene", "a = 1\nb = 3\n").contains("scene, line 2: `b = 2` there, `b = 3` here"));
    assert!(with("scene", "a = 1\n").contains("scene, line 2: `b = 2` there, nothing here"));
    assert!(with("mesh of x", "3").contains("mesh of x: here, but not there"));
}

/// Prefixes, and bytes changed, all over the file: an error with the path, never a panic, never another film.
#[test]
fn a_damaged_film_is_refused_wherever_the_damage_is() {
    let folder = tempfile::tempdir().unwrap();
    let (good, bad) = (folder.path().join("good.film"), folder.path().join("bad.film"));
    write(&good, &film(0..3));
    let bytes = fs::read(&good).unwrap();
    let refused = |bytes: &[u8], what: &str| {
        fs::write(&bad, bytes).unwrap();
        let error = Checkpoint::read(&bad).err().unwrap_or_else(|| panic!("accepted: {what}"));
        assert!(matches!(error.kind(), ErrorKind::File | ErrorKind::Memory), "{what}: {error}");
        assert!(error.to_string().contains("bad.film"), "{what}: {error}");
    };
    for length in (0..bytes.len()).step_by(23) {
        refused(&bytes[..length], &format!("{length} bytes"));
    }
    for at in (0..bytes.len()).step_by(5) {
        let mut changed = bytes.clone();
        changed[at] ^= 1 << (at % 8);
        refused(&changed, &format!("byte {at}"));
    }
    refused(&[&bytes[..], b"x"].concat(), "one byte more");
    refused(b"marmor film 2\n and so on", "another version");
    assert!(Checkpoint::read(folder.path()).unwrap_err().to_string().contains("no regular file"));
}

/// A header of a picture that the file cannot fill is refused before memory is taken.
#[test]
fn sizes_are_checked_before_memory_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.film");
    write(&path, &film(0..1));
    let text = String::from_utf8_lossy(&fs::read(&path).unwrap()).into_owned();
    let start = text.find('{').unwrap();
    let header = &text[start..text.find("1.5}}").unwrap() + 5];
    let forged = header
        .replace("[10,8]", "[60000,60000]")
        .replace(r#"{"x0":1,"y0":2,"x1":9,"y1":7}"#, r#"{"x0":0,"y0":0,"x1":60000,"y1":60000}"#);
    assert_ne!(forged, header);
    let bytes = [b"marmor film 1\n", &(forged.len() as u64).to_le_bytes()[..], forged.as_bytes(), &[0; 64]].concat();
    fs::write(&path, bytes).unwrap();
    let error = Checkpoint::read(&path).unwrap_err();
    assert!(error.to_string().contains("too small for its picture"), "{error}");
}

/// A scene of many objects is a long header: what is written can be read.
#[test]
fn a_long_scene_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.film");
    let mut long = identity();
    long.0.push(("scene of many".into(), "x = 1\n".repeat(4 << 20)));
    Checkpoint::write(&path, &film(0..1), &long, &[], serde_json::json!({})).unwrap();
    let read = Checkpoint::read(&path).unwrap();
    assert!(read.identity == long && read.film == film(0..1));
    // 100 000 facts are compared one by one, not each with all.
    let many = |last: usize| Identity((0..100_000).map(|i| (format!("mesh of {i}"), (i / last).to_string())).collect());
    assert_eq!(many(99_999).difference(&many(99_998)).as_deref(), Some("mesh of 99998: `0` there, `1` here"));
}

#[test]
#[ignore = "a measurement: cargo test --release --test film_files -- --ignored --nocapture"]
fn time_of_exact_sums() {
    let full = Window::full([1000, 1000]);
    let mut film = Film::new([1000, 1000], full).unwrap();
    let samples: Vec<Rgb> = (0..full.area()).map(|i| sample(1, i)).collect();
    let tiles = [(full, samples)];
    for (what, all) in [("one thread", false), ("all threads", true)] {
        let start = std::time::Instant::now();
        for _ in 0..10 {
            if all {
                film.add_pass(&tiles)
            } else {
                film.add(full, &tiles[0].1)
            }
            film.end_pass();
        }
        println!("{:.1} ns a pixel and pass on {what}", start.elapsed().as_secs_f64() * 100.0);
    }
}
