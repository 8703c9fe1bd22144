//! The times of pulses, jumps and kinks of an expression.

use super::Expression;

/// The number of parts of a run whose ends are evaluated first. Adaptive steps find longer events themselves;
/// this search finds the shorter ones.
const PARTS: usize = 512;
/// The smallest change that counts, over the whole range of the expression in the run.
const CHANGE: f64 = 0.05;
/// The time between the two sides of a jump, over the time of the run.
const APART: f64 = 1e-9;
/// The largest number of intervals that are bisected in one part. A jump takes 60, a smooth pulse about 100.
const MAX_BISECTIONS: usize = 400;

/// A time, s, with the bounds of the expression just before it and at it.
struct Knot {
    time: f64,
    before: [f64; 2],
    bounds: [f64; 2],
}

/// The bounds of an expression over a box in space, as functions of time.
struct Envelope<'a> {
    expression: &'a Expression,
    space: [[f64; 2]; 2],
    /// The smallest change that counts.
    least: f64,
    /// The length of a part and of the shortest interval, s.
    part: f64,
    apart: f64,
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
        let (part, apart) = (end / PARTS as f64, APART * end);
        let mut envelope = Envelope { expression: self, space, least: 0.0, part, apart };
        let time = |i: usize| end * i as f64 / PARTS as f64;
        let knots: Vec<_> = (0..=PARTS).map(time).map(|t| envelope.knot(t)).collect();
        let within = knots.windows(2).map(|pair| envelope.within([pair[0].time, pair[1].time]));
        let all: Vec<_> = within.chain(knots.iter().map(|knot| knot.bounds)).collect();
        let changes = [0, 1].map(|k| {
            let values = all.iter().map(|bounds| bounds[k]).filter(|value| value.is_finite());
            let ends = (f64::INFINITY, f64::NEG_INFINITY);
            let (low, high) = values.fold(ends, |(l, h), v| (v.min(l), v.max(h)));
            high - low
        });
        envelope.least = CHANGE * changes[0].max(changes[1]);
        let mut found = Vec::new();
        for knot in knots {
            if let Some(last) = found.pop() {
                let mut bisections_left = MAX_BISECTIONS;
                envelope.bisect(last, knot, &mut bisections_left, &mut found);
            } else {
                found.push(knot);
            }
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
        let bounds = self.within([time, time]);
        Knot { time, before: bounds, bounds }
    }

    /// Whether two bounds differ by more than `part` of the smallest change that counts. Infinite bounds do
    /// not count.
    fn differ(&self, a: [f64; 2], b: [f64; 2], part: f64) -> bool {
        (0..2).any(|k| (a[k] - b[k]).abs() > part * self.least)
    }

    /// Adds the first knot and the knots between the two. The last knot belongs to the next interval.
    fn bisect(&self, first: Knot, last: Knot, bisections_left: &mut usize, found: &mut Vec<Knot>) {
        let length = last.time - first.time;
        let middle = self.knot(0.5 * (first.time + last.time));
        let [low, high] = self.within([first.time, last.time]);
        let values = [first.bounds, middle.bounds, last.bounds];
        let shown = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |shown, bounds| {
            [shown[0].min(bounds[0]), shown[1].max(bounds[1])]
        });
        let mean = [0, 1].map(|k| 0.5 * (first.bounds[k] + last.bounds[k]));
        let quiet = !self.differ([low, high], shown, 1.0) && !self.differ(mean, middle.bounds, 1.0);
        if quiet || *bisections_left == 0 {
            found.extend([first, last]);
        } else if length > self.apart {
            *bisections_left -= 1;
            self.bisect(first, middle, bisections_left, found);
            if let Some(middle) = found.pop() {
                self.bisect(middle, last, bisections_left, found);
            }
        } else if self.differ(first.bounds, last.bounds, 1.0) {
            let jump = self.jump(&first, &last);
            found.extend([jump, last]);
        } else {
            found.extend([first, last]);
        }
    }

    /// The first time between two knots at which the bounds are those of the last one.
    fn jump(&self, first: &Knot, last: &Knot) -> Knot {
        let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() + (a[1] - b[1]).abs();
        let (mut from, mut to) = (first.time, last.time);
        loop {
            let middle = 0.5 * (from + to);
            if middle <= from || middle >= to {
                return Knot { time: to, before: first.bounds, bounds: self.knot(to).bounds };
            }
            let bounds = self.knot(middle).bounds;
            match distance(bounds, first.bounds) < distance(bounds, last.bounds) {
                true => from = middle,
                false => to = middle,
            }
        }
    }

    /// The times of the knots in bisected parts that are not on the line between their neighbours.
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
            let line = [0, 1].map(|k| (1.0 - part) * last.bounds[k] + part * next.before[k]);
            if self.differ(knot.before, line, 0.5) || self.differ(knot.before, knot.bounds, 0.5) {
                times.push(knot.time);
                last = knot;
            }
        }
        times
    }
}
