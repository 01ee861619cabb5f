//! Even steps of time behind stamps that a program rounded.

use lagrangian_motion::statistics::upper_median;

/// Fewer samples than this do not tell that steps are even.
const FEWEST: usize = 16;
/// The finest stamps that are looked at, in decimal places.
const PLACES: i32 = 7;
/// Stamps are whole numbers of their last place up to this part.
const WHOLE: f64 = 1e-4;
/// The coarsest stamps of even steps, in steps.
const COARSEST: f64 = 0.4;
/// Stamps are those of even steps where none is farther from them than this part of the last place.
const NEAR: f64 = 0.55;
/// Less than this part of a step is no error.
const EXACT: f64 = 1e-6;

/// The step and the times of even steps that these stamps are rounded from, whatever samples are missing, with the last place of the stamps;
/// `None` where they are exact, or of other times.
pub(super) fn steps(t: &[f64]) -> Option<(f64, f64, Vec<f64>)> {
    if t.len() < FEWEST || !t.windows(2).all(|own| own[1] > own[0]) {
        return None;
    }
    let mut all: Vec<f64> = t.windows(2).map(|own| own[1] - own[0]).collect();
    let usual = upper_median(&mut all);
    let is_whole = |x: f64| (x - x.round()).abs() < WHOLE;
    let place = (0..=PLACES)
        .map(|k| 10f64.powi(-k))
        .find(|place| t.iter().all(|t| is_whole(t / place)))?;
    if place > COARSEST * usual {
        return None;
    }
    let near = all
        .iter()
        .filter(|step| (*step - usual).abs() < 1.5 * place);
    let (sum, count) = near.fold((0.0, 0.0), |(sum, count), step| (sum + step, count + 1.0));
    let mut step: f64 = sum / count;
    let mut first = t[0];
    let mut places: Vec<f64> = Vec::with_capacity(t.len());
    // The mean of a few steps counts the others only roughly.
    for _ in 0..2 {
        places.clear();
        places.push(0.0);
        for own in t.windows(2) {
            let last = places[places.len() - 1];
            places.push(last + ((own[1] - own[0]) / step).round().max(1.0));
        }
        (first, step) = line(&places, t);
    }
    let times: Vec<f64> = places.iter().map(|k| first + step * k).collect();
    let off = times.iter().zip(t).map(|(a, b)| (a - b).abs());
    let off = off.fold(0.0, f64::max);
    (off <= NEAR * place && off > EXACT * step).then_some((step, place, times))
}

/// The line through these points by least squares: its value at 0, its slope.
fn line(x: &[f64], y: &[f64]) -> (f64, f64) {
    let count = x.len() as f64;
    let [mx, my] = [x, y].map(|all| all.iter().sum::<f64>() / count);
    let pairs = || x.iter().map(|x| x - mx).zip(y.iter().map(|y| y - my));
    let slope = pairs().map(|(x, y)| x * y).sum::<f64>() / pairs().map(|(x, _)| x * x).sum::<f64>();
    (my - slope * mx, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rounded(places: i32, times: impl Iterator<Item = f64>) -> Vec<f64> {
        let unit = 10f64.powi(places);
        times.map(|t| (t * unit).round() / unit).collect()
    }

    #[test]
    fn rounded_stamps_are_those_of_even_steps() {
        let kept = || (0..400).filter(|k| k % 37 != 5).map(f64::from);
        for (rate, places) in [(120.0, 3), (60.0, 4), (30.0, 2), (29.97, 3), (240.0, 5)] {
            let stamps = rounded(places, kept().map(|k| 1.3 + k / rate));
            let (step, _, times) = steps(&stamps).unwrap_or_default();
            assert!((step * rate - 1.0).abs() < 1e-4, "{rate} {step}");
            let off = times
                .iter()
                .zip(kept())
                .map(|(t, k)| (t - 1.3 - k / rate).abs());
            let unit = 10f64.powi(-places);
            assert!(off.fold(0.0, f64::max) < 0.15 * unit, "{rate}");
        }
    }

    #[test]
    fn other_stamps_are_as_they_are() {
        let even = |rate: f64| (0..200).map(move |k| f64::from(k) / rate);
        // Exact, by a clock that shakes, with a pause of no whole number of steps, and coarser than the steps.
        assert!(steps(&rounded(2, even(50.0))).is_none());
        assert!(steps(&even(60.0).collect::<Vec<_>>()).is_none());
        let shaken = |k: i32| f64::from(k) / 60.0 + 0.002 * f64::from(k * 7919 % 101) / 101.0;
        assert!(steps(&rounded(4, (0..200).map(shaken))).is_none());
        let paused = even(60.0).map(|t| if t > 1.0 { t + 0.057 } else { t });
        assert!(steps(&rounded(4, paused)).is_none());
        assert!(steps(&rounded(2, even(120.0))).is_none());
    }
}
