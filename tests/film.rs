//! The film, its files, and the figures that compare pictures.
#![allow(clippy::unwrap_used)] // a fixture that cannot be made is a failed test

use marmor::ErrorKind;
use marmor::film::metrics::{compare, from_halves};
use marmor::film::{
    Attribute, BadSample, Film, Format, Image, Metadata, PngOptions, Window, check_writable, read_attributes, save,
    write_atomically,
};
use marmor::math::{Rgb, hash_combine, unit_f64};
use std::fs;
use std::path::Path;

fn noise(seed: u64, index: u64) -> f64 {
    unit_f64((hash_combine(seed, index) >> 32) as u32)
}

fn picture(resolution: [u32; 2], seed: u64) -> Image {
    Image::from_fn(resolution, |x, y| {
        Rgb::from_fn(|c| noise(seed, u64::from(y) << 32 | u64::from(x) << 2 | c as u64) as f32)
    })
}

fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

// --- sums -------------------------------------------------------------------------------------------------

#[test]
fn the_mean_and_both_halves_are_those_of_the_samples() {
    let window = Window { x0: 2, y0: 1, x1: 5, y1: 3 };
    let mut film = Film::new([8, 4], window).unwrap();
    // Values that are exact in binary, so that equality is exact.
    for pass in 0..4_u32 {
        for y in window.y0..window.y1 {
            let row = Window { y0: y, y1: y + 1, ..window };
            let samples: Vec<_> =
                (window.x0..window.x1).map(|x| Rgb([(x * 8 + y) as f32, pass as f32, -0.5])).collect();
            film.add(row, &samples);
        }
        film.end_pass();
    }
    let (mean, [even, odd]) = (film.image(), film.half_images().unwrap());
    assert_eq!((mean.resolution, mean.window), ([8, 4], window));
    assert_eq!(mean.get(3, 2), Some(Rgb([26.0, 1.5, -0.5])));
    assert_eq!(even.get(3, 2), Some(Rgb([26.0, 1.0, -0.5]))); // passes 0 and 2
    assert_eq!(odd.get(3, 2), Some(Rgb([26.0, 2.0, -0.5]))); // passes 1 and 3
    // Of 0, 1, 2, 3: sample variance 5/3, of the mean a quarter of that.
    let variance = film.variance().unwrap().get(3, 2).unwrap();
    assert_eq!(variance[0], 0.0);
    assert!((variance[1] - 5.0 / 12.0).abs() < 1e-6);
    assert_eq!((film.counts().samples, film.counts().negative, film.passes()), (24, 24, 4));
}

#[test]
fn a_sample_that_is_no_number_is_left_out_whole_and_counted() {
    let mut film = Film::new([2, 2], Window::full([2, 2])).unwrap();
    let (good, full) = (Rgb([1.0, 2.0, 3.0]), Window::full([2, 2]));
    film.add(full, &[good; 4]);
    film.end_pass();
    film.add(full, &[good, good, Rgb([f32::NAN, 100.0, 100.0]), Rgb([100.0, 100.0, f32::INFINITY])]);
    film.end_pass();
    assert!(film.image().pixels.iter().all(|&p| p == good), "{:?}", film.image().pixels);
    let counts = film.counts();
    assert_eq!((counts.samples, counts.non_finite), (6, 2));
    assert_eq!(counts.first_non_finite, Some(BadSample { pass: 1, pixel: [0, 1] }));
    assert_eq!(film.empty_pixels(), 0);
}

#[test]
fn the_order_of_tiles_within_a_pass_does_not_matter() {
    let full = Window::full([7, 5]);
    let tiles: Vec<_> =
        (0..full.area()).map(|i| full.pixel(i)).map(|[x, y]| Window { x0: x, y0: y, x1: x + 1, y1: y + 1 }).collect();
    let render = |order: &dyn Fn(usize) -> usize| {
        let mut film = Film::new([7, 5], full).unwrap();
        for pass in 0..3 {
            for i in 0..tiles.len() {
                let i = order(i);
                let value = if i % 11 == 4 { f32::NAN } else { noise(pass, i as u64) as f32 - 0.1 };
                film.add(tiles[i], &[Rgb::splat(value)]);
            }
            film.end_pass();
        }
        (film.image(), film.half_images(), film.counts())
    };
    assert_eq!(render(&|i| i), render(&|i| (i * 12 + 5) % 35));
}

#[test]
fn a_film_that_cannot_be_is_an_error_not_a_crash() {
    let error = |resolution, window| Film::new(resolution, window).unwrap_err();
    let huge = [u32::MAX, u32::MAX];
    let memory = error(huge, Window::full(huge));
    assert_eq!(memory.kind(), ErrorKind::Memory);
    assert!(memory.to_string().contains("needs") && memory.to_string().contains("--crop"), "{memory}");
    for window in [Window { x0: 1, y0: 0, x1: 1, y1: 2 }, Window { x0: 0, y0: 0, x1: 3, y1: 2 }] {
        assert_eq!(error([2, 2], window).kind(), ErrorKind::Usage);
    }
}

// --- EXR --------------------------------------------------------------------------------------------------

#[test]
fn an_exr_gives_back_every_bit_and_every_attribute() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut image = picture([37, 21], 1);
    image.pixels[5] = Rgb([-1.5, f32::MAX, f32::MIN_POSITIVE / 4.0]);
    image.pixels[6] = Rgb([f32::INFINITY, -0.0, 1e-30]);
    let scene = "material = \"Wei\u{df} \u{4f60}\"\n".repeat(200);
    let metadata = Metadata {
        samples_per_pixel: 64,
        render_seconds: Some(2.5),
        created: None,
        attributes: vec![
            ("marmor:scene".into(), Attribute::Text(scene.clone())),
            ("marmor:seed".into(), Attribute::Count(u64::MAX)),
            ("marmor:scale".into(), Attribute::Number(0.1)),
        ],
    };
    save(&image, &path, &metadata, PngOptions::default()).unwrap();
    assert_eq!(Image::read_exr(&path).unwrap(), image);
    let read = read_attributes(&path).unwrap();
    assert_eq!(read["marmor:scene"], Attribute::Text(scene));
    assert_eq!(read["marmor:seed"], Attribute::Text(u64::MAX.to_string()));
    assert_eq!(read["marmor:scale"], Attribute::Number(0.1));
    assert_eq!(read["samplesPerPixel"], Attribute::Number(64.0));
    assert_eq!(read["renderTimeSeconds"], Attribute::Number(2.5));
    assert!(matches!(&read["software"], Attribute::Text(t) if t.starts_with("marmor ")));
    assert!(!read.contains_key("capDate"));
}

#[test]
fn a_crop_keeps_its_place_in_the_whole_picture() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("crop.exr");
    let crop = picture([40, 30], 2).cropped(Window { x0: 7, y0: 11, x1: 24, y1: 30 });
    save(&crop, &path, &Metadata::default(), PngOptions::default()).unwrap();
    assert_eq!(Image::read_exr(&path).unwrap(), crop);
}

#[test]
fn a_date_appears_only_where_it_is_given_and_then_no_time_spent() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let metadata = Metadata { created: Some(951_782_400), render_seconds: Some(1.0), ..Default::default() };
    save(&picture([4, 4], 3), &path, &metadata, PngOptions::default()).unwrap();
    let read = read_attributes(&path).unwrap();
    assert_eq!(read["capDate"], Attribute::Text("2000:02:29 00:00:00".into()));
    assert!(!read.contains_key("renderTimeSeconds"));
}

// --- PNG --------------------------------------------------------------------------------------------------

fn read_png(path: &Path) -> (u32, u32, bool, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::BufReader::new(fs::File::open(path).unwrap())).read_info().unwrap();
    let mut codes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut codes).unwrap();
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
    (info.width, info.height, reader.info().srgb.is_some(), codes)
}

#[test]
fn a_png_has_the_srgb_codes_worked_out_by_hand_and_counts_what_it_cut() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.PNG");
    let mut image = Image::from_fn([3, 1], |_, _| Rgb::BLACK);
    image.pixels = vec![Rgb([0.18, 0.5, 0.001]), Rgb([1.0, 1.5, -0.2]), Rgb([f32::NAN, f32::INFINITY, 0.9])];
    let report = save(&image, &path, &Metadata::default(), PngOptions::default()).unwrap().png.unwrap();
    assert_eq!((report.above_one, report.below_zero, report.nan), (2, 1, 1));
    assert_eq!(read_png(&path), (3, 1, true, vec![118, 188, 3, 255, 255, 0, 0, 255, 243]));
    // One stop up: 0.36 -> 1.055 * 0.36^(1/2.4) - 0.055 = 0.634205 -> 161.722; 1.0 -> 255; 0.002 -> 0.02584 -> 6.589.
    save(&image, &path, &Metadata::default(), PngOptions { exposure: 1.0 }).unwrap();
    assert_eq!(read_png(&path).3[..3], [162, 255, 7]);
}

#[test]
fn an_exposure_that_is_no_number_and_an_unknown_ending_are_usage_errors() {
    let folder = tempfile::tempdir().unwrap();
    let image = picture([2, 2], 4);
    let png = folder.path().join("a.png");
    let error = save(&image, &png, &Metadata::default(), PngOptions { exposure: f64::NAN }).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Usage);
    for name in ["a.jpg", "a", ".exr", "exr"] {
        let error = check_writable(&folder.path().join(name)).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Usage, "{name}");
        assert!(error.to_string().contains(".exr") && error.to_string().contains(".png"), "{error}");
    }
    assert_eq!(Format::of(Path::new("x/a.EXR")).unwrap(), Format::Exr);
    assert!(names_in(folder.path()).is_empty());
}

// --- files are whole or not there -------------------------------------------------------------------------

#[test]
fn a_write_that_fails_midway_leaves_the_old_file_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    fs::write(&path, "old").unwrap();
    let error = write_atomically(&path, |file| {
        file.write_all(&[0; 100_000])?; // more than any buffer: some of it has reached the disk
        Err(std::io::Error::other("the disk is full"))
    })
    .unwrap_err();
    assert_eq!(error.kind(), ErrorKind::File);
    assert!(error.to_string().contains("the disk is full") && error.to_string().contains("a.exr"), "{error}");
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(names_in(folder.path()), ["a.exr"]);
    let panicking = std::panic::catch_unwind(|| write_atomically(&path, |_| panic!("a fault in the writer")));
    assert!(panicking.is_err());
    assert_eq!((fs::read(&path).unwrap(), names_in(folder.path())), (b"old".to_vec(), vec!["a.exr".to_string()]));
    write_atomically(&path, |file| file.write_all(b"new")).unwrap();
    assert_eq!((fs::read(&path).unwrap(), names_in(folder.path())), (b"new".to_vec(), vec!["a.exr".to_string()]));
}

#[test]
fn what_stands_in_the_way_of_a_file_is_said_before_and_after_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("folder.exr")).unwrap();
    fs::write(at("file"), "").unwrap();
    fs::write(at("read_only.exr"), "kept").unwrap();
    let mut permissions = fs::metadata(at("read_only.exr")).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(at("read_only.exr"), permissions).unwrap();
    let before = names_in(folder.path());
    let cases = [
        ("none/a.exr", "does not exist"),
        ("file/a.exr", "is not a folder"),
        ("folder.exr", "it is a folder"),
        ("read_only.exr", "read-only"),
    ];
    for (name, said) in cases {
        let path = at(name);
        let early = check_writable(&path).unwrap_err();
        let late = save(&picture([2, 2], 5), &path, &Metadata::default(), PngOptions::default()).unwrap_err();
        assert_eq!(early.to_string(), late.to_string());
        assert_eq!((early.kind(), late.kind()), (ErrorKind::File, ErrorKind::File));
        let message = early.to_string();
        assert!(message.contains(said) && message.starts_with(&path.display().to_string()), "{message}");
        assert!(!message.contains('\n'), "{message}");
    }
    check_writable(&at("new.exr")).unwrap();
    assert_eq!(names_in(folder.path()), before);
    assert_eq!(fs::read(at("read_only.exr")).unwrap(), b"kept");
}

#[cfg(unix)]
#[test]
fn a_link_stays_and_what_it_leads_to_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let (real, link) = (folder.path().join("real.exr"), folder.path().join("link.exr"));
    fs::write(&real, "old").unwrap();
    std::os::unix::fs::symlink("real.exr", &link).unwrap();
    write_atomically(&link, |file| file.write_all(b"new")).unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().file_type().is_symlink());
    assert_eq!(fs::read(&real).unwrap(), b"new");
}

// --- reading what others wrote ----------------------------------------------------------------------------

#[test]
fn an_exr_of_other_layouts_is_read() {
    use exr::prelude::*;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    // Two parts; the second has tiles of half floats, an overscan of one pixel at the left and bottom, and alpha.
    let flat = |n: usize, v: f32| FlatSamples::F32(vec![v; n]);
    let depth = AnyChannels::sort([AnyChannel::new("Z", flat(12, 1.0))].into_iter().collect());
    let plane = |k: f32| FlatSamples::F16((0..20).map(|i| f16::from_f32(i as f32 * k)).collect());
    let colour = [("R", 1.0), ("G", 0.5), ("B", 0.25), ("A", 0.0)].map(|(n, k)| AnyChannel::new(n, plane(k)));
    let encoding = |blocks| Encoding { compression: Compression::PIZ, blocks, line_order: LineOrder::Increasing };
    let first = Layer::new((4, 3), LayerAttributes::named("depth"), encoding(Blocks::ScanLines), depth);
    let named = LayerAttributes { layer_position: Vec2(9, 20), ..LayerAttributes::named("beauty") };
    let tiles = encoding(Blocks::Tiles(Vec2(2, 2)));
    let second = Layer::new((5, 4), named, tiles, AnyChannels::sort(colour.into_iter().collect()));
    let attributes = ImageAttributes::new(IntegerBounds::new((10, 20), (4, 3)));
    Image::from_layers(attributes, vec![first, second]).write().to_file(&path).unwrap();

    let read = marmor::film::Image::read_exr(&path).unwrap();
    assert_eq!((read.resolution, read.window), ([4, 3], Window::full([4, 3])));
    assert_eq!(read.get(0, 0), Some(Rgb([1.0, 0.5, 0.25]))); // second column of the data
    assert_eq!(read.get(3, 2), Some(Rgb([14.0, 7.0, 3.5])));
    assert_eq!(marmor::film::Image::read_exr_layer(&path, Some("beauty")).unwrap(), read);
    let missing = marmor::film::Image::read_exr_layer(&path, Some("depth")).unwrap_err().to_string();
    assert!(missing.contains("depth.R") && missing.contains('Z'), "{missing}");
}

#[test]
fn a_file_that_is_no_whole_exr_is_a_file_error_that_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let error = || {
        let error = Image::read_exr(&path).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::File);
        let message = error.to_string();
        assert!(message.starts_with(&path.display().to_string()) && !message.contains('\n'), "{message}");
        message
    };
    error(); // not there
    for (bytes, said) in [(&b""[..], "empty"), (b"text", "not an EXR"), (b"\x89PNG\r\n", "PNG")] {
        fs::write(&path, bytes).unwrap();
        let message = error();
        assert!(message.contains(said), "{message}");
    }
    save(&picture([40, 40], 6), &path, &Metadata::default(), PngOptions::default()).unwrap();
    let whole = fs::read(&path).unwrap();
    for length in (4..whole.len()).step_by(whole.len() / 97) {
        fs::write(&path, &whole[..length]).unwrap();
        error();
    }
    fs::remove_file(&path).unwrap();
    fs::create_dir(&path).unwrap();
    assert!(error().contains("folder"));
}

#[test]
fn a_damaged_header_is_an_error_or_a_picture_but_no_crash() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    save(&picture([8, 8], 7), &path, &Metadata::default(), PngOptions::default()).unwrap();
    let whole = fs::read(&path).unwrap();
    for at in 4..whole.len().min(700) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x40 | (at % 7) as u8;
        fs::write(&path, damaged).unwrap();
        let _ = Image::read_exr(&path);
    }
}

// --- metrics ----------------------------------------------------------------------------------------------

#[test]
fn the_figures_of_a_small_pair_are_those_worked_out_by_hand() {
    let reference = Image::from_fn([2, 1], |x, _| Rgb::splat(1.0 + 2.0 * x as f32)); // 1, 3: mean 2
    let image = Image::from_fn([2, 1], |x, _| Rgb([1.5 + 2.0 * x as f32, 1.0 + 2.0 * x as f32, 1.0 + x as f32]));
    let c = compare(&image, &reference, Some(&[true, false])).unwrap();
    // Squares: R 1/4 twice, G 0, B 0 and 1: mean 1.5 / 6.
    assert!((c.whole.rmse.value - 0.5).abs() < 1e-12);
    let relative = (0.25 / 1.04 + 0.25 / 9.04 + 1.0 / 9.04) / 6.0; // floor 0.01 * 2^2
    assert!((c.whole.relmse.unwrap().value - relative).abs() < 1e-12);
    assert_eq!(c.whole.rmse.interval, None); // one block
    let interior = c.interior.unwrap(); // the first pixel: floor 0.01 * 1^2
    assert_eq!(interior.pixels, 1);
    assert!((interior.relmse.unwrap().value - 0.25 / 1.01 / 3.0).abs() < 1e-12);
    assert_eq!(c.mean_ratio.map(|r| r.unwrap().value), [1.25, 1.0, 0.75]);
    assert_eq!((c.max_difference, c.max_pixel, c.max_channel), (1.0, [1, 0], 2));
}

#[test]
fn pixels_that_are_no_numbers_are_counted_and_left_out() {
    let reference = picture([20, 20], 8);
    let mut image = reference.clone();
    image.pixels[3] = Rgb([f32::NAN, 0.0, 0.0]);
    let c = compare(&image, &reference, None).unwrap();
    assert_eq!((c.non_finite, c.non_finite_reference, c.whole.pixels), (1, 0, 399));
    assert_eq!((c.whole.rmse.value, c.whole.rmse.interval, c.max_difference), (0.0, Some([0.0, 0.0]), 0.0));
    image.pixels.fill(Rgb::splat(f32::INFINITY));
    assert_eq!(compare(&image, &reference, None).unwrap_err().kind(), ErrorKind::Numeric);
    assert_eq!(compare(&picture([20, 19], 8), &reference, None).unwrap_err().kind(), ErrorKind::Usage);
    assert!(compare(&reference, &Image::from_fn([20, 20], |_, _| Rgb::BLACK), None).unwrap().whole.relmse.is_none());
}

#[test]
fn trimming_leaves_out_the_worst_pixel_in_a_thousand() {
    let reference = Image::from_fn([50, 40], |_, _| Rgb::WHITE);
    let mut image = Image::from_fn([50, 40], |_, _| Rgb::splat(1.5));
    image.pixels[77] = Rgb::splat(1e6);
    image.pixels[1077] = Rgb::splat(-1e6);
    let whole = compare(&image, &reference, None).unwrap().whole;
    assert!(whole.rmse.value > 1e4 && (whole.rmse_trimmed.value - 0.5).abs() < 1e-12);
    assert!((whole.relmse_trimmed.unwrap().value - 0.25 / 1.01).abs() < 1e-12);
}

/// A picture around 2 whose noise has unit-free standard deviation 0.2 and is shared by squares of 8x8 pixels, as
/// the smooth noise of a sample cache is.
fn blotchy(seed: u64) -> Image {
    Image::from_fn([128, 128], |x, y| {
        let square = u64::from(y / 8) << 16 | u64::from(x / 8);
        Rgb::from_fn(|c| {
            let sum: f64 = (0..12).map(|i| noise(seed, square << 8 | (c as u64) << 4 | i)).sum();
            (2.0 + 0.2 * (sum - 6.0)) as f32
        })
    })
}

#[test]
fn intervals_of_blotchy_noise_cover_the_truth_about_19_times_in_20() {
    let reference = Image::from_fn([128, 128], |_, _| Rgb::splat(2.0));
    let (trials, mut covered) = (400, [0; 3]);
    for seed in 0..trials {
        let c = compare(&blotchy(seed), &reference, None).unwrap();
        let figures =
            [(c.whole.rmse, 0.2), (c.whole.relmse.unwrap(), 0.2 * 0.2 / (4.0 + 0.04)), (c.mean_ratio[1].unwrap(), 1.0)];
        for (covered, (estimate, truth)) in covered.iter_mut().zip(figures) {
            let [low, high] = estimate.interval.unwrap();
            *covered += u32::from(low <= truth && truth <= high);
        }
    }
    // Binomial: mean 380, standard deviation 4.4, 6 of them below. Intervals that take pixels for
    // independent cover the truth about 60 times.
    for covered in covered {
        assert!(covered >= 353, "{covered} of {trials}");
        assert!(covered < 400, "so wide that it says nothing");
    }
}

#[test]
fn halves_estimate_the_error_of_their_mean() {
    // Passes around 2 with standard deviation 0.2; after n of them the mean's error is 0.2 / sqrt(n), odd n too.
    for passes in [2_u32, 5, 8] {
        let mut film = Film::new([128, 128], Window::full([128, 128])).unwrap();
        for pass in 0..passes {
            film.add(film.window(), &blotchy(1000 + u64::from(pass)).pixels);
            film.end_pass();
        }
        let estimated = from_halves(&film, None).unwrap().rmse;
        let truth = 0.2 / f64::from(passes).sqrt();
        // 768 independent values: the standard error of an RMSE is 1 / sqrt(2 * 768) of it.
        assert!((estimated.value / truth - 1.0).abs() < 6.0 / 1536_f64.sqrt(), "{passes}: {estimated:?}, {truth}");
        let [low, high] = estimated.interval.unwrap();
        assert!(low < truth && truth < high, "{passes}: {estimated:?}, {truth}");
    }
    assert!(from_halves(&Film::new([2, 2], Window::full([2, 2])).unwrap(), None).is_none());
}

#[cfg(feature = "cli")]
#[test]
fn diff_prints_a_table_or_json_and_fails_on_files_alone() {
    let folder = tempfile::tempdir().unwrap();
    let diff = |args: &[&str]| {
        let binary = std::process::Command::new(env!("CARGO_BIN_EXE_marmor"));
        let out = { binary }.arg("diff").args(args).current_dir(folder.path()).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (out.status.code().unwrap(), text(out.stdout), text(out.stderr))
    };
    let reference = picture([40, 40], 9);
    let mut image = reference.clone();
    image.pixels.iter_mut().for_each(|p| *p *= 1.5);
    image.pixels[41] = Rgb([f32::NAN, 0.0, 0.0]);
    for (name, image) in [("a.exr", &image), ("b.exr", &reference), ("small.exr", &picture([40, 39], 9))] {
        save(image, &folder.path().join(name), &Metadata::default(), PngOptions::default()).unwrap();
    }
    let (code, table, _) = diff(&["a.exr", "b.exr"]);
    assert_eq!(code, 0);
    assert!(table.starts_with("pixels that are NaN or infinite: 1 in the picture, 0 in the reference"), "{table}");
    assert!(table.contains("reference  b.exr") && table.contains("RMSE"), "{table}");
    assert!(!diff(&["b.exr", "b.exr"]).1.contains("NaN"));
    let (code, json, _) = diff(&["a.exr", "b.exr", "--interior", "b.exr", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &json["reference"]), (0, &serde_json::json!("b.exr")));
    let figures = &json["comparison"];
    assert_eq!((&figures["non_finite"], &figures["interior"]["pixels"]), (&1.into(), &1599.into()));
    for c in 0..3 {
        assert!((figures["mean_ratio"][c]["value"].as_f64().unwrap() - 1.5).abs() < 0.01);
    }
    for (args, expected) in [(["none.exr", "b.exr"], 4), (["a.exr", "small.exr"], 2)] {
        let (code, out, message) = diff(&args);
        assert_eq!((code, out.as_str(), message.lines().count()), (expected, "", 1), "{message}");
        assert!(message.contains(args[0]), "{message}");
    }
}
