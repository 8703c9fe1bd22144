//! A forecast of the damage that the loads ahead will do.

use crate::evolution::LoadCurve;

/// The loads of a run in time. Strains are about proportional to the size s of the loads, and the damage source is
/// about ½ λ_U |ε|². With the rate ζ' at t, the loads ahead add a damage of about ζ' ∫_t^T s(τ)² dτ / s(t)².
pub(super) struct Forecast {
    /// Increasing times, s, each with s² and with ∫_t^T s² from it to the end, s.
    sizes: Vec<(f64, f64, f64)>,
}

/// Minimum s² in a forecast: smaller loads say little about the damage by larger ones.
const SMALL: f64 = 0.01;

impl Forecast {
    /// For a run that ends at `end`, s; without a curve the loads are constant.
    pub(super) fn new(curve: Option<&LoadCurve>, end: f64) -> Self {
        let squares = curve.map_or(vec![(0.0, 1.0), (end, 1.0)], LoadCurve::squares);
        let mut after = (end, 0.0, 0.0);
        let before = |&(time, square): &(f64, f64)| {
            after = (time, square, after.2 + 0.5 * (square + after.1) * (after.0 - time));
            after
        };
        let mut sizes: Vec<_> = squares.iter().rev().map(before).collect();
        sizes.reverse();
        Self { sizes }
    }

    /// ∫_t^T s² / s(t)², s: the time in which the present rate would cause the damage ahead.
    pub(super) fn time_ahead(&self, time: f64) -> f64 {
        let next = self.sizes.partition_point(|(other, ..)| *other <= time);
        let next = next.clamp(1, self.sizes.len() - 1);
        let ((start, before, from), (end, after, to)) = (self.sizes[next - 1], self.sizes[next]);
        let part = if end > start { (time - start) / (end - start) } else { 1.0 };
        (from + part * (to - from)) / (before + part * (after - before)).max(SMALL)
    }
}
