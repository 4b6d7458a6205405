//! Small statistics of small sets.

/// The mean; NaN of nothing.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The slope of the least-squares line through points, and Pearson's correlation: 0 where nothing varies.
pub fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let of = |value: fn(&(f64, f64)) -> f64| points.iter().map(value).collect::<Vec<f64>>();
    let (x, y) = (mean(&of(|p| p.0)), mean(&of(|p| p.1)));
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>();
    let (xx, yy) = (sum(&|p| (p.0 - x).powi(2)), sum(&|p| (p.1 - y).powi(2)));
    let xy = sum(&|p| (p.0 - x) * (p.1 - y));
    let share = |of: f64| if of > 0.0 { xy / of } else { 0.0 };
    (share(xx), share((xx * yy).sqrt()))
}

/// Spearman's rank correlation of the coordinates of points, ties averaged.
pub fn rank_correlation(points: &[(f64, f64)]) -> f64 {
    let ranks = |of: fn(&(f64, f64)) -> f64| ranks(&points.iter().map(of).collect::<Vec<f64>>());
    let ranked: Vec<(f64, f64)> = ranks(|p| p.0).into_iter().zip(ranks(|p| p.1)).collect();
    line(&ranked).1
}

fn ranks(values: &[f64]) -> Vec<f64> {
    let rank = |value: &f64| {
        let below = values.iter().filter(|other| *other < value).count();
        let equal = values.iter().filter(|other| *other == value).count();
        below as f64 + (equal as f64 + 1.0) / 2.0
    };
    values.iter().map(rank).collect()
}

/// The middle value, the mean of the two middle ones for an even number; NaN of nothing.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let half = sorted.len() / 2;
    match sorted.len() {
        0 => f64::NAN,
        len if len % 2 == 1 => sorted[half],
        _ => (sorted[half - 1] + sorted[half]) / 2.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_ranks_are_those_of_a_small_example() {
        let (slope, correlation) = line(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]);
        assert_eq!((slope, correlation), (2.0, 1.0));
        // Ranks 1, 2, 3 and 1, 2.5, 2.5: 1.5/√(2·1.5).
        let found = rank_correlation(&[(1.0, 4.0), (10.0, 9.0), (11.0, 9.0)]);
        assert!((found - 0.75_f64.sqrt()).abs() < 1e-12);
        assert_eq!(line(&[(1.0, 2.0), (2.0, 2.0)]), (0.0, 0.0));
    }

    #[test]
    fn medians_are_in_the_middle() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&[]).is_nan());
    }
}
