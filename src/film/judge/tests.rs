use super::super::{Film, Image, SelfError, Window};
use super::{Bias, Judgement, Truth, brightness, judge};
use crate::math::{Rgb, hash};

/// Uniform in -0.5..0.5.
fn noise(seed: u64, pass: u32, i: usize) -> f32 {
    (hash(seed << 40 | u64::from(pass) << 20 | i as u64) >> 40) as f32 / 16_777_216.0 - 0.5
}

/// A film of `passes` whose samples are `sample(pass, pixel)`, and its error after each pass.
fn film(passes: u32, sample: impl Fn(u32, usize) -> f32) -> (Film, SelfError) {
    let window = Window::full([64, 48]);
    let (mut film, mut error) = (Film::new([64, 48], window).unwrap(), SelfError::new());
    for pass in 0..passes {
        film.add(window, &(0..window.area()).map(|i| Rgb::splat(sample(pass, i))).collect::<Vec<_>>());
        film.end_pass();
        if pass % 8 == 7 || pass < 8 {
            error.measure(&film);
        }
    }
    (film, error)
}

fn truth(passes: u32, sample: impl Fn(u32, usize) -> f32) -> Truth {
    let (film, mut error) = film(passes, sample);
    Truth::of_film(&film, &mut error)
}

fn judged(one: &mut (Film, SelfError), truth: &Truth) -> Judgement {
    judge(&one.0, &mut one.1, truth, None).unwrap().unwrap()
}

/// 1.2 times its reference, both with noise of 50 % a sample: the square of 0.2 comes out, and only then.
#[test]
fn a_bias_is_told_from_noise() {
    let reference = truth(64, |pass, i| 1.0 + noise(1, pass, i));
    let bias = |level: f32| {
        let mut one = film(16, |pass, i| level * (1.0 + noise(2, pass, i)));
        judged(&mut one, &reference).trimmed.bias.unwrap()
    };
    let (none, some) = (bias(1.0), bias(1.2));
    assert!(!none.is_seen() && none.value.abs() <= none.half_width, "{none:?}");
    assert!(some.is_seen() && (some.value - 0.04 / 1.01).abs() <= some.half_width, "{some:?}");
    assert!(some.half_width < 0.01, "{some:?}");
}

/// A brightness that wanders from pass to pass is noise that all pixels share: no spread between blocks knows of it.
#[test]
fn noise_that_all_pixels_share_is_no_bias() {
    let reference = truth(64, |pass, i| 1.0 + noise(1, pass, i));
    for seed in 2..22 {
        let mut one = film(16, |pass, i| (1.0 + noise(seed, pass, 1 << 19)) * (1.0 + 0.1 * noise(seed, pass, i)));
        let judged = judged(&mut one, &reference).trimmed;
        assert!(!judged.bias.unwrap().is_seen(), "seed {seed}: {judged:?}");
    }
}

/// 40 pixels with one bright sample in 500: the reference has met them, the film not yet.
#[test]
fn light_that_was_not_met_is_no_bias() {
    let sample = |seed: u64| {
        move |pass: u32, i: usize| {
            let met = i.is_multiple_of(77) && noise(seed, pass, (1 << 18) + i) > 0.498;
            if met { 500.0 } else { 1.0 + 0.1 * noise(seed, pass, i) }
        }
    };
    let reference = truth(2048, sample(1));
    for seed in 2..12 {
        let judged = judged(&mut film(8, sample(seed)), &reference);
        assert!(!judged.trimmed.bias.unwrap().is_seen(), "seed {seed}: {:?}", judged.trimmed);
        assert!(!judged.all.bias.unwrap().is_seen(), "seed {seed}: {:?}", judged.all);
    }
}

#[test]
fn a_speck_is_told_by_its_pixel_and_left_out() {
    let reference = truth(64, |pass, i| 1.0 + noise(1, pass, i));
    let mut one = film(16, |pass, i| if (pass, i) == (5, 3 * 64 + 10) { 3000.0 } else { 1.0 + noise(2, pass, i) });
    let judged = judged(&mut one, &reference);
    assert!(judged.all.hangs_on_one_pixel() && judged.all.worst_pixel == [10, 3], "{:?}", judged.all);
    assert!(!judged.trimmed.hangs_on_one_pixel() && judged.trimmed.pixels == 64 * 48 - 3);
    let [low, high] = judged.trimmed.error().interval.unwrap();
    // (1 / 12) / 16 over 1.01, the noise of the reference taken off, a little less for what is left out.
    assert!((low..high).contains(&(1.0 / 12.0 / 16.0 / 1.01)), "{low} {high}");
    let [low, high] = judged.all.error().interval.unwrap();
    assert!(high / low > 100.0, "one pixel says nothing of the next render: {low} {high}");
}

/// A speck in the reference makes that pixel and the mean bright, for the error and the noise alike.
#[test]
fn a_speck_in_the_reference_is_no_bias() {
    let reference = truth(64, |pass, i| if (pass, i) == (5, 300) { 1e5 } else { 1.0 + noise(1, pass, i) });
    let mut one = film(16, |pass, i| 1.0 + noise(2, pass, i));
    let judged = judged(&mut one, &reference);
    assert!(!judged.all.bias.unwrap().is_seen() && !judged.trimmed.bias.unwrap().is_seen(), "{judged:?}");
}

#[test]
fn a_copy_is_known_and_a_picture_tells_no_noise() {
    let sample = |pass, i| 1.0 + noise(1, pass, i);
    let (mut copy, mut other) = (film(16, sample), film(16, |pass, i| 1.0 + noise(2, pass, i)));
    let exact = Truth::picture(copy.0.image());
    assert!(!exact.tells_noise() && exact.noise().is_none());
    assert!(judged(&mut copy, &exact).shares_numbers() && !judged(&mut other, &exact).shares_numbers());
    // As noisy as what it judges: no error is told.
    let same = Truth::of_film(&copy.0, &mut copy.1);
    assert!(same.tells_noise() && judged(&mut copy, &same).shares_numbers());
    let noisy = truth(4, |pass, i| 1.0 + noise(3, pass, i));
    let mut clean = film(16, |pass, i| 1.0 + 1e-3 * noise(4, pass, i));
    assert!(!judged(&mut clean, &noisy).trimmed.is_told());
    let black = Truth::picture(Image::from_fn([64, 48], |_, _| Rgb::BLACK));
    assert!(black.check(&other.0).is_err() && judge(&other.0, &mut other.1, &black, None).unwrap().is_none());
}

/// Brightness that wanders by 29 % a pass: the interval of 16 passes is to hold 1 in 95 % of seeds.
#[test]
fn brightness_has_an_interval_that_holds() {
    let exact = Truth::picture(Image::from_fn([64, 48], |_, _| Rgb::splat(1.0)));
    let held = (1..=100).filter(|&seed| {
        let (film, error) = film(16, |pass, _| 1.0 + noise(seed, pass, 1 << 19));
        let [low, high] = brightness(&film, &error, &exact, None).unwrap().mean.unwrap().interval.unwrap();
        assert!(high - low < 1.0, "{low} {high}");
        low <= 1.0 && 1.0 <= high
    });
    // 95 of 100, 4 standard errors of 2.2 below.
    let held = held.count();
    assert!(held >= 87, "{held}");
}

/// A bound of 0 is none that can be written: chance has put the whole interval below it.
#[test]
fn a_bias_that_is_not_seen_has_a_bound_in_words() {
    let bias = |value, half_width| Bias { value, half_width };
    assert_eq!(bias(1e-6, 4e-6).at_most(), "below 5e-6");
    assert_eq!(bias(-5e-6, 4e-6).at_most(), "none told");
}
