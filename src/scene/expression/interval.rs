//! Interval arithmetic: bounds on all values that an expression takes in a box of x, y and t.
//!
//! The natural interval extension (Moore, Kearfott, Cloud, *Introduction to Interval Analysis*, 2009,
//! chapter 5): each instruction maps intervals that contain its arguments to an interval that contains its
//! values. The bounds are sharp if each variable occurs once; otherwise their overestimation decreases with the size
//! of the box. They ignore rounding errors.

use super::{
    Expression, HIGHEST,
    Instruction::{self, Binary, Choose, Compare, Number, Table, Unary, Variable},
    truth,
};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A lower and an upper bound.
pub(super) type Interval = [f64; 2];
/// Bounds on a function, given itself and bounds on its argument.
pub(super) type Enclosure = fn(fn(f64) -> f64, Interval) -> Interval;
/// The same for two arguments.
pub(super) type Enclosure2 = fn(fn(f64, f64) -> f64, Interval, Interval) -> Interval;

/// The bounds of an unknown number.
const EVERYTHING: Interval = [f64::NEG_INFINITY, f64::INFINITY];
/// The bounds of a condition that is true in a part of the box only.
const UNDECIDED: Interval = [0.0, 1.0];

impl Expression {
    /// A lower and an upper bound on all values of the expression in the box `[x, y, t]`, with each variable
    /// between two numbers. Points where the expression is not defined do not count. Bounds may be infinite.
    /// They hold up to rounding.
    ///
    /// ```
    /// use signorini::scene::Expression;
    /// let load = Expression::parse("if(abs(x - 0.6) < 0.001, -500*t, 0)")?;
    /// assert_eq!(load.range([[0.0, 0.5], [1.0, 1.0], [0.0, 1.0]]), [0.0, 0.0]);
    /// assert_eq!(load.range([[0.0, 1.0], [1.0, 1.0], [0.0, 1.0]]), [-500.0, 0.0]);
    /// # Ok::<(), signorini::scene::ExpressionError>(())
    /// ```
    pub fn range(&self, variables: [[f64; 2]; 3]) -> [f64; 2] {
        match self.height {
            ..=8 => self.enclose::<8>(variables),
            _ => self.enclose::<HIGHEST>(variables),
        }
    }

    /// Runs the program with a stack of `N` intervals.
    fn enclose<const N: usize>(&self, variables: [Interval; 3]) -> Interval {
        let mut stack = [[0.0; 2]; N];
        let mut height = 0;
        for instruction in &self.program {
            height -= instruction.takes();
            stack[height] = instruction.enclosed(variables, &stack[height..]);
            height += 1;
        }
        stack[0]
    }
}

impl Instruction {
    /// Bounds on its value, from bounds on the variables and on its arguments.
    pub(super) fn enclosed(&self, variables: [Interval; 3], arguments: &[Interval]) -> Interval {
        match (self, arguments) {
            (Number(value), _) => hull([*value]),
            (Variable(i), _) => variables[*i],
            (Unary(apply, enclose, _), [a, ..]) => enclose(*apply, *a),
            (Binary(apply, enclose, _), [a, b, ..]) => enclose(*apply, *a, *b),
            (Compare(holds), [a, b, ..]) => compared(*holds, *a, *b),
            (Choose, [[0.0, 0.0], _, otherwise, ..]) => *otherwise,
            (Choose, [[low, high], then, ..]) if *low > 0.0 || *high < 0.0 => *then,
            (Choose, [_, a, b, ..]) => hull([*a, *b].concat()),
            (Table(table), [a, ..]) => hull(table.within(*a)),
            _ => EVERYTHING,
        }
    }
}

/// The smallest interval with all `values`; all numbers if one of them is NaN.
pub(super) fn hull(values: impl IntoIterator<Item = f64>) -> Interval {
    let mut bounds = [f64::INFINITY, f64::NEG_INFINITY];
    for value in values {
        if value.is_nan() {
            return EVERYTHING;
        }
        bounds = [bounds[0].min(value), bounds[1].max(value)];
    }
    bounds
}

/// A monotone function.
pub(super) fn monotone(f: fn(f64) -> f64, a: Interval) -> Interval {
    hull(a.map(f))
}

/// A function that increases from 0 on and is not defined below 0.
pub(super) fn from_zero(f: fn(f64) -> f64, a: Interval) -> Interval {
    monotone(f, [if a[1] < 0.0 { a[0] } else { a[0].max(0.0) }, a[1]])
}

/// The range of abs, which is `f`.
pub(super) fn absolute(f: fn(f64) -> f64, [a, b]: Interval) -> Interval {
    hull([f(a), f(b), f(0.0_f64.clamp(a, b))])
}

/// A wave with the value 1 at `peak` + 2πk and −1 at `peak` + π + 2πk.
pub(super) fn wave(f: fn(f64) -> f64, [a, b]: Interval, peak: f64) -> Interval {
    if !(b - a).is_finite() {
        return [-1.0, 1.0];
    }
    let reached = |phase: f64| ((a - phase) / TAU).ceil() <= ((b - phase) / TAU).floor();
    let [low, high] = monotone(f, [a, b]);
    [if reached(peak + PI) { -1.0 } else { low }, if reached(peak) { 1.0 } else { high }]
}

/// tan, with poles at π/2 + πk.
pub(super) fn tangent(f: fn(f64) -> f64, a: Interval) -> Interval {
    let [from, to] = a.map(|a| ((a + FRAC_PI_2) / PI).floor());
    if from == to { monotone(f, a) } else { EVERYTHING }
}

/// A function that is monotone in each argument.
pub(super) fn corners(f: fn(f64, f64) -> f64, a: Interval, b: Interval) -> Interval {
    hull([f(a[0], b[0]), f(a[0], b[1]), f(a[1], b[0]), f(a[1], b[1])])
}

/// a / b.
pub(super) fn quotient(f: fn(f64, f64) -> f64, a: Interval, b: Interval) -> Interval {
    if b[0] <= 0.0 && b[1] >= 0.0 { EVERYTHING } else { corners(f, a, b) }
}

/// a ^ b; for negative a the exponent must be an integer.
pub(super) fn power(f: fn(f64, f64) -> f64, a: Interval, b: Interval) -> Interval {
    let whole = b[0] == b[1] && b[0].fract() == 0.0;
    match a {
        [low, _] if low >= 0.0 => corners(f, a, b),
        [_, high] if whole && b[0] < 0.0 && high >= 0.0 => EVERYTHING,
        [low, high] if whole => hull([low, high, high.min(0.0)].map(|a| f(a, b[0]))),
        [_, high] if b[0] == b[1] && high >= 0.0 => corners(f, [0.0, high], b),
        _ => EVERYTHING,
    }
}

/// atan2(y, x), which jumps at y = 0 for x < 0.
pub(super) fn angle(f: fn(f64, f64) -> f64, y: Interval, x: Interval) -> Interval {
    let jumps = x[0] <= 0.0 && y[0] <= 0.0 && y[1] >= 0.0;
    if jumps { [-PI, PI] } else { corners(f, y, x) }
}

/// `and`, `or`.
pub(super) fn logical(f: fn(f64, f64) -> f64, a: Interval, b: Interval) -> Interval {
    let mixed = [a, b].iter().any(|[low, high]| *low < 0.0 && *high > 0.0);
    if mixed { UNDECIDED } else { corners(f, a, b) }
}

/// A comparison. The corners of the box decide comparisons of order. `==` and `!=` are symmetric in their
/// arguments.
fn compared(holds: fn(&f64, &f64) -> bool, a: Interval, b: Interval) -> Interval {
    let meet = a[0] <= b[1] && b[0] <= a[1] && (a[0] < a[1] || b[0] < b[1]);
    if meet && holds(&0.0, &1.0) == holds(&1.0, &0.0) {
        return UNDECIDED;
    }
    let corners = [0, 1].map(|i| [0, 1].map(|j| truth(a[i], b[j], |a, b| holds(&a, &b))));
    hull(corners.concat())
}
