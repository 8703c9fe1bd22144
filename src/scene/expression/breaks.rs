//! The times of pulses, jumps and kinks of an expression.

use super::{Expression, interval::hull};

/// The number of parts of a run whose ends are evaluated first. Adaptive steps find longer events themselves;
/// this search finds the shorter ones.
const SEARCHED_PARTS: usize = 512;
/// The smallest change that counts, over the whole range of the expression in the run.
const CHANGE: f64 = 0.05;
/// The largest number of intervals that are bisected in one part. A jump takes about 50 down to neighbouring numbers, a
/// smooth pulse about 100.
const MAX_BISECTED: usize = 400;

/// A time, s, with the bounds of the expression at it.
#[derive(Clone, Copy)]
struct Knot {
    time: f64,
    bounds: [f64; 2],
}

/// The bounds of an expression over a box in space, as functions of time.
struct Envelope<'a> {
    expression: &'a Expression,
    space: [[f64; 2]; 2],
    /// The smallest change that counts.
    least: f64,
    /// The length of a part, s.
    part: f64,
}

impl Expression {
    /// Times in (0, `end`), s, increasing, between which the bounds of the expression over the box `space`
    /// are nearly linear in time. They are the ends and peaks of pulses shorter than 1/512 of `end`, kinks, and
    /// jumps (the first time with the new value).
    ///
    /// An interval [a, b] is bisected in two cases: its bounds by [`Expression::range`] exceed the values at
    /// a, b and the middle, or the bounds at the middle are not the mean of those at a and b.
    pub fn breaks(&self, space: [[f64; 2]; 2], end: f64) -> Vec<f64> {
        if !self.depends_on_time() {
            return Vec::new();
        }
        let part = end / SEARCHED_PARTS as f64;
        let mut envelope = Envelope { expression: self, space, least: 0.0, part };
        let time = |i: usize| end * i as f64 / SEARCHED_PARTS as f64;
        let knots: Vec<_> = (0..=SEARCHED_PARTS).map(time).map(|t| envelope.knot(t)).collect();
        let within = knots.windows(2).map(|pair| envelope.within([pair[0].time, pair[1].time]));
        let all: Vec<_> = within.chain(knots.iter().map(|knot| knot.bounds)).collect();
        let changes = [0, 1].map(|k| {
            let values = all.iter().map(|bounds| bounds[k]).filter(|value| value.is_finite());
            let [low, high] = hull(values);
            high - low
        });
        envelope.least = CHANGE * changes[0].max(changes[1]);
        let mut found = vec![knots[0]];
        for pair in knots.windows(2) {
            envelope.bisect(pair[0], pair[1], &mut { MAX_BISECTED }, &mut found);
        }
        envelope.needed(&found)
    }
}

impl Envelope<'_> {
    fn within(&self, times: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.space;
        self.expression.range([x, y, times])
    }

    fn knot(&self, time: f64) -> Knot {
        Knot { time, bounds: self.within([time, time]) }
    }

    /// Whether two bounds differ by more than `part` of the smallest change that counts. Infinite bounds do
    /// not count.
    fn differ(&self, a: [f64; 2], b: [f64; 2], part: f64) -> bool {
        (0..2).any(|k| (a[k] - b[k]).abs() > part * self.least)
    }

    /// Adds the knots between two knots and the last one.
    fn bisect(&self, first: Knot, last: Knot, bisections_left: &mut usize, found: &mut Vec<Knot>) {
        let middle = self.knot(0.5 * (first.time + last.time));
        let shown = hull([first.bounds, middle.bounds, last.bounds].concat());
        let mean = [0, 1].map(|k| 0.5 * (first.bounds[k] + last.bounds[k]));
        let changes = self.differ(self.within([first.time, last.time]), shown, 1.0)
            || self.differ(mean, middle.bounds, 1.0);
        let is_between = first.time < middle.time && middle.time < last.time;
        if changes && is_between && *bisections_left > 0 {
            *bisections_left -= 1;
            self.bisect(first, middle, bisections_left, found);
            self.bisect(middle, last, bisections_left, found);
        } else {
            found.push(last);
        }
    }

    /// The times of the knots in bisected parts that are not on the line between their neighbours. Both sides of a jump
    /// are neighbouring numbers; the second one is the time of the jump.
    fn needed(&self, knots: &[Knot]) -> Vec<f64> {
        let mut times = Vec::new();
        let Some(mut last) = knots.first() else { return times };
        for triple in knots.windows(3) {
            let [before, knot, next] = triple else { continue };
            let short = 0.75 * self.part;
            if knot.time - before.time > short && next.time - knot.time > short {
                last = knot;
                continue;
            }
            let part = (knot.time - last.time) / (next.time - last.time);
            let line = [0, 1].map(|k| (1.0 - part) * last.bounds[k] + part * next.bounds[k]);
            if self.differ(knot.bounds, line, 0.5) {
                let jumps = next.time - knot.time <= f64::EPSILON * next.time
                    && self.differ(knot.bounds, next.bounds, 0.5);
                times.push(if jumps { next.time } else { knot.time });
                last = knot;
            }
        }
        times.dedup();
        times
    }
}
