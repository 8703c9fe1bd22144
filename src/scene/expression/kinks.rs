//! The kinks of an expression along a line, found by its form.
//!
//! Values at some points do not tell a kink from a strong curvature. `abs` and `sqrt` have a kink where their argument is 0, `min`
//! and `max` where their arguments are equal, `if` where its condition changes, and tables at some of their points. Bounds on
//! the arguments show where this is not so; bisection of the rest finds the kinks.

use super::{
    Expression,
    Instruction::{Binary, Choose, Compare, Table, Unary},
    degree::Rule,
    interval::{Interval, hull},
};

/// Kinks are found to this fraction of the line: far below [`STEP`].
const FOUND_TO: f64 = 1e-9;
/// The difference of one-sided derivatives, as a fraction of the line. Half of the digits are lost to rounding, and half of them to the
/// second derivatives.
const STEP: f64 = 1e-4;
/// The largest number of pieces of a line that are bisected: two for each kink.
const MAX_PIECES: usize = 4096;

impl Expression {
    /// The one-sided derivative of s ↦ f(`at` + s `along`) at 0, for s > 0, per unit of s:
    /// (4 f(δ) − 3 f(0) − f(2δ))/(2δ).
    pub fn slope(&self, [x, y]: [f64; 2], along: [f64; 2], t: f64) -> f64 {
        let [f0, f1, f2] =
            [0.0, STEP, 2.0 * STEP].map(|s| self.eval(x + s * along[0], y + s * along[1], t));
        (4.0 * f1 - 3.0 * f0 - f2) / (2.0 * STEP)
    }

    /// The kinks between p and q at the time t, without these ends: the places p + s (q − p), by s, with the change of the derivative
    /// with respect to s.
    ///
    /// ```
    /// use signorini::scene::Expression;
    /// let gap = Expression::parse("x^2 + 0.1*abs(x - 0.3)")?;
    /// let kinks = gap.kinks([[0.0, 0.0], [1.0, 0.0]], 0.0);
    /// assert!(kinks.len() == 1 && (kinks[0].0 - 0.3).abs() < 1e-8 && (kinks[0].1 - 0.2).abs() < 1e-6);
    /// # Ok::<(), signorini::scene::ExpressionError>(())
    /// ```
    pub fn kinks(&self, [p, q]: [[f64; 2]; 2], t: f64) -> Vec<(f64, f64)> {
        let along = [q[0] - p[0], q[1] - p[1]];
        let point = |s: f64| [0, 1].map(|i| p[i] + s * along[i]);
        // A kink at an end of a piece is inside the wider one.
        let is_smooth = |[a, b]: &[f64; 2]| {
            let wider = 0.25 * (b - a);
            let [p, q] = [a - wider, b + wider].map(point);
            let [x, y] = [0, 1].map(|i| hull([p[i], q[i]]));
            self.is_smooth([x, y, [t, t]])
        };
        let mut pieces = vec![[0.0, 1.0]];
        pieces.retain(|piece| !is_smooth(piece));
        while pieces.first().is_some_and(|[a, b]| b - a > FOUND_TO) && pieces.len() < MAX_PIECES {
            let halves = pieces.iter().flat_map(|&[a, b]| {
                let middle = 0.5 * (a + b);
                [[a, middle], [middle, b]]
            });
            pieces = halves.filter(|piece| !is_smooth(piece)).collect();
        }
        let runs = pieces.chunk_by(|a, b| a[1] == b[0]);
        let ends = runs.map(|run| [run[0][0], run[run.len() - 1][1]]);
        let inside = ends.filter(|[a, b]| *a > 0.0 && *b < 1.0 && b - a < STEP);
        let change = |[a, b]: [f64; 2]| {
            let backwards = self.slope(point(a), along.map(|x| -x), t);
            (0.5 * (a + b), self.slope(point(b), along, t) + backwards)
        };
        inside.map(change).collect()
    }

    /// Does its form show that it has no kink and no jump in the box `[x, y, t]`?
    fn is_smooth(&self, variables: [Interval; 3]) -> bool {
        let is_smooth = self.by_form::<bool>(variables, |instruction, value, smooth, of| {
            if let Some(i) = instruction.taken(of) {
                return smooth[i];
            }
            match (instruction, of) {
                _ if value[0] == value[1] => true,
                _ if smooth.contains(&false) => false,
                (Unary(.., Rule::KinkAtZero), [a]) => a[0] > 0.0 || a[1] < 0.0,
                (Table(table), [a]) => !table.bends_in(*a),
                (Binary(.., Rule::Quotient), [_, b]) => b[0] > 0.0 || b[1] < 0.0,
                (Binary(.., Rule::Power), [a, [n, m]]) => {
                    a[0] > 0.0 || (n == m && n.fract() == 0.0 && *n >= 0.0)
                }
                // This is atan2(y, x), which jumps at y = 0 for x < 0.
                (Binary(.., Rule::Other), [y, x]) => x[0] > 0.0 || y[0] > 0.0 || y[1] < 0.0,
                (Binary(.., Rule::Smaller | Rule::Larger) | Compare(_) | Choose, _) => false,
                _ => true,
            }
        });
        is_smooth == Some(true)
    }
}
