//! The times of pulses, jumps and kinks of an expression.

use super::Expression;

/// The parts of a run in which an expression is looked at first. Chosen steps look as closely
/// themselves: only what is shorter is found here.
const PARTS: usize = 512;
/// Changes count if they are more than this part of all that happens in a run.
const CHANGE: f64 = 0.05;
/// Two times nearer than this part of the run are one, at which the expression jumps.
const APART: f64 = 1e-9;
/// The intervals looked at in one of the parts, at most. A jump takes 60, a smooth pulse about 100.
const LOOKS: usize = 400;

/// A time, s, with the bounds of the expression just before and at it.
struct Knot {
    time: f64,
    before: [f64; 2],
    bounds: [f64; 2],
}

/// The bounds of an expression over a box in space, as functions of time.
struct Envelope<'a> {
    expression: &'a Expression,
    space: [[f64; 2]; 2],
    /// Changes below this do not count.
    least: f64,
    /// The length of a part and the shortest interval, s.
    part: f64,
    apart: f64,
}

impl Expression {
    /// Times in (0, `end`), s, rising, between which the bounds of the expression over the box `space`
    /// are nearly linear in time, as far as shorter intervals than 1/512 of `end` show it: around pulses, at
    /// jumps (the first time with the new value) and kinks.
    ///
    /// An interval [a, b] is bisected while [`Expression::range`] leaves room in it for values beyond those
    /// at a, b and its middle, or the bounds at the middle are not the mean of those at a and b.
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
                let mut looks = LOOKS;
                envelope.bisect(last, knot, &mut looks, &mut found);
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

    /// Whether two bounds differ by more than a part of what counts. Infinite ones tell nothing.
    fn differ(&self, a: [f64; 2], b: [f64; 2], part: f64) -> bool {
        (0..2).any(|k| (a[k] - b[k]).abs() > part * self.least)
    }

    /// Adds the first knot and those between the two; then the last one, which belongs to what follows.
    fn bisect(&self, first: Knot, last: Knot, looks: &mut usize, found: &mut Vec<Knot>) {
        let length = last.time - first.time;
        let middle = self.knot(0.5 * (first.time + last.time));
        let [low, high] = self.within([first.time, last.time]);
        let values = [first.bounds, middle.bounds, last.bounds];
        let shown = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |shown, bounds| {
            [shown[0].min(bounds[0]), shown[1].max(bounds[1])]
        });
        let mean = [0, 1].map(|k| 0.5 * (first.bounds[k] + last.bounds[k]));
        let quiet = !self.differ([low, high], shown, 1.0) && !self.differ(mean, middle.bounds, 1.0);
        if quiet || *looks == 0 {
            found.extend([first, last]);
        } else if length > self.apart {
            *looks -= 1;
            self.bisect(first, middle, looks, found);
            if let Some(middle) = found.pop() {
                self.bisect(middle, last, looks, found);
            }
        } else if self.differ(first.bounds, last.bounds, 1.0) {
            let jump = self.jump(&first, &last);
            found.extend([jump, last]);
        } else {
            found.extend([first, last]);
        }
    }

    /// The first time between two at which the bounds are those of the last.
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

    /// The times of those knots within bisected parts that are not on the line between their neighbours.
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
