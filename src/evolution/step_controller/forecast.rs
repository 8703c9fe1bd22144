//! A forecast of the damage that the loads ahead will do.

use crate::evolution::LoadCurve;

/// The loads of a run in time. Strains are about proportional to the size s of the loads, and the damage source is
/// about ½ λ_U |ε|². With the rate ζ' at t, the loads ahead add a damage of about ζ' ∫_t^T s(τ)² dτ / s(t)².
pub(super) struct Forecast {
    /// Increasing times, s, and ∫_t^T s² from each of them to the end, s.
    ahead: Vec<(f64, f64)>,
}

/// The number of evenly spread times at which loads are sampled, besides the times at which they are not smooth.
///
/// Tuned on the 13 adapted runs. Half: nothing changes. Twice: nothing changes.
const FORECAST_TIMES: usize = 200;
/// Minimum s² in a forecast: smaller loads say little about the damage by larger ones.
const SMALL: f64 = 0.01;

impl Forecast {
    /// Samples the whole run, which ends at `end`, s; without a curve the loads are constant.
    pub(super) fn new(curve: Option<&LoadCurve>, end: f64) -> Self {
        let mut times = vec![0.0, end];
        if let Some(curve) = curve {
            times.extend((1..FORECAST_TIMES).map(|i| end * i as f64 / FORECAST_TIMES as f64));
            times.extend(curve.breaks(0.0, end));
            times.sort_by(f64::total_cmp);
        }
        let mut after = (end, 0.0);
        let mut ahead: Vec<_> = (times.iter().rev())
            .map(|&time| {
                let mean = 0.5 * (square(curve, time) + square(curve, after.0));
                after = (time, after.1 + (after.0 - time) * mean);
                after
            })
            .collect();
        ahead.reverse();
        Self { ahead }
    }

    /// ∫_t^T s² / s(t)², s: the time in which the present rate would cause the damage ahead.
    pub(super) fn time_ahead(&self, curve: Option<&LoadCurve>, time: f64) -> f64 {
        let next =
            self.ahead.partition_point(|(other, _)| *other <= time).min(self.ahead.len() - 1);
        let ((start, from), (end, to)) = (self.ahead[next.max(1) - 1], self.ahead[next]);
        let part = if end > start { (time - start) / (end - start) } else { 1.0 };
        (from + part * (to - from)) / square(curve, time).max(SMALL)
    }
}

/// s(t)².
fn square(curve: Option<&LoadCurve>, time: f64) -> f64 {
    curve.map_or(1.0, |curve| curve.sizes(time).iter().map(|size| size * size).sum())
}
