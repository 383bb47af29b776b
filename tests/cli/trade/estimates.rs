//! Errors that are estimated on samples: intervals hold as often as they say, laws are found again, samples are fair.

use umbel::measure::{ErrorEstimate, PowerLaw, sample_key};

/// Numbers that are spread evenly over 0 to 1.
fn uniform(seed: u64, k: u64) -> f64 {
    (sample_key(seed, k) >> 11) as f64 / (1_u64 << 53) as f64
}

#[test]
fn everything_is_no_sample() {
    let all = ErrorEstimate::of_squares(&[0.0, 0.04, 0.16], 3);
    let rmse = (0.2_f64 / 3.0).sqrt();
    assert!((all.error - rmse).abs() < 1e-15 && (all.upper - rmse).abs() < 1e-15, "{all:?}");
    let all = ErrorEstimate::of_rate(1, 4, 4);
    assert_eq!([all.error, all.lower, all.upper], [0.25; 3]);
}

/// Nothing wrong among n is no proof: about 3.8/n may be.
#[test]
fn no_error_in_a_sample_is_no_certainty() {
    let found = ErrorEstimate::of_rate(0, 1000, 1_000_000);
    assert_eq!([found.error, found.lower], [0.0; 2]);
    assert!(found.upper > 0.0037 && found.upper < 0.0039, "{found:?}");
    // A tenth of that many pixels are asked, the others are right.
    let among = found.among(10_000_000);
    assert!((among.upper - found.upper * 0.1).abs() < 1e-12);
}

/// Skewed squares, as those of ambient occlusion are: most receivers have hardly any error, a few a large one.
#[test]
fn intervals_hold_as_often_as_they_say() {
    let errors: Vec<f64> = (0..100_000).map(|k| uniform(1, k).powi(12)).collect();
    let truth = (errors.iter().sum::<f64>() / errors.len() as f64).sqrt();
    let (mut below, mut above) = (0, 0);
    for trial in 0..1000 {
        let pick = |k: u64| errors[(sample_key(trial + 10, k) % errors.len() as u64) as usize];
        let squares: Vec<f64> = (0..512).map(pick).collect();
        let found = ErrorEstimate::of_squares(&squares, errors.len());
        assert!(found.lower <= found.error && found.error <= found.upper);
        below += usize::from(truth < found.lower);
        above += usize::from(truth > found.upper);
    }
    // 25 are expected on either side.
    assert!(above <= 45 && below <= 60, "{above} above, {below} below");
}

#[test]
fn rates_hold_as_often_as_they_say() {
    let rate = 0.004;
    let mut above = 0;
    for trial in 0..1000 {
        let wrong = (0..2000).filter(|&k| uniform(trial, k) < rate).count();
        let found = ErrorEstimate::of_rate(wrong, 2000, 1_000_000);
        above += usize::from(rate > found.upper);
    }
    assert!(above <= 45, "{above}");
}

#[test]
fn power_laws_are_found_again() {
    let law = |k: f64| (k, 0.3 * k.powf(-0.75));
    let found = PowerLaw::fit(&[law(8.0), law(16.0), law(64.0), (128.0, 0.0)]).expect("a law");
    assert!((found.factor - 0.3).abs() < 1e-12 && (found.exponent - 0.75).abs() < 1e-12, "{found:?}");
    assert!((found.count(found.error(100.0)) - 100.0).abs() < 1e-9);
    assert_eq!(PowerLaw::fit(&[law(8.0)]), None);
    assert_eq!(PowerLaw::fit(&[(8.0, 0.0), (16.0, 0.0)]), None);
    let rising = PowerLaw::fit(&[(8.0, 0.1), (16.0, 0.2)]).expect("a law");
    assert_eq!(rising.count(0.01), f64::INFINITY);
}
