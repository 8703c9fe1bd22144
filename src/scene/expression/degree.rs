//! The degree of an expression as a polynomial in x and y, by its form.
//!
//! Values at some points do not tell it: a load may vary between them. Bounds on the arguments decide which argument `min`, `max`
//! and `if` take. What depends on space in any other way, as `exp(x)`, is no polynomial.

use super::{
    Expression,
    Instruction::{self, Binary, Choose, Variable},
    interval::Interval,
};

/// How the degree of an operator's value follows from those of its arguments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rule {
    Sum,
    Product,
    Quotient,
    Power,
    Smaller,
    Larger,
    /// Not differentiable at 0, as `abs`.
    KinkAtZero,
    Other,
}

impl Instruction {
    /// The argument that `min`, `max` or `if` takes within these bounds `of` its arguments, if they decide.
    pub(super) fn taken(&self, of: &[Interval]) -> Option<usize> {
        match (self, of) {
            (Binary(.., Rule::Smaller), [p, q]) if p[1] <= q[0] => Some(0),
            (Binary(.., Rule::Smaller), [p, q]) if q[1] <= p[0] => Some(1),
            (Binary(.., Rule::Larger), [p, q]) if p[0] >= q[1] => Some(0),
            (Binary(.., Rule::Larger), [p, q]) if q[0] >= p[1] => Some(1),
            (Choose, [[low, high], ..]) if *low > 0.0 || *high < 0.0 => Some(1),
            (Choose, [[0.0, 0.0], ..]) => Some(2),
            _ => None,
        }
    }
}

impl Expression {
    /// The degree in x and y in the box `[x, y, t]`, with each variable between two numbers. `None` if the form of the expression does
    /// not show that it is a polynomial there.
    ///
    /// ```
    /// use signorini::scene::Expression;
    /// let water = Expression::parse("9810*max(0, 5 - y)")?;
    /// assert_eq!(water.degree([[0.0, 1.0], [2.0, 4.0], [0.0, 0.0]]), Some(1));
    /// assert_eq!(water.degree([[0.0, 1.0], [6.0, 7.0], [0.0, 0.0]]), Some(0));
    /// assert_eq!(water.degree([[0.0, 1.0], [4.0, 6.0], [0.0, 0.0]]), None);
    /// # Ok::<(), signorini::scene::ExpressionError>(())
    /// ```
    pub fn degree(&self, variables: [[f64; 2]; 3]) -> Option<u32> {
        self.by_form::<Option<u32>>(variables, |instruction, value, degrees, of| {
            match (instruction, degrees, of) {
                _ if value[0] == value[1] => Some(0),
                (Variable(0 | 1), ..) => Some(1),
                (_, degrees, _) if degrees.iter().all(|degree| *degree == Some(0)) => Some(0),
                (Binary(.., Rule::Sum), [a, b], _) => a.zip(*b).map(|(a, b)| a.max(b)),
                (Binary(.., Rule::Product), [a, b], _) => a.zip(*b).map(|(a, b)| a + b),
                (Binary(.., Rule::Quotient), [a, Some(0)], _) => *a,
                (Binary(.., Rule::Power), [a, _], [_, [n, m]]) => {
                    let is_whole = n == m && n.fract() == 0.0 && (0.0..=9.0).contains(n);
                    a.filter(|_| is_whole).map(|a| a * *n as u32)
                }
                (_, degrees, of) => instruction.taken(of).and_then(|i| degrees[i]),
            }
        })?
    }

    /// The property of the expression in the box that follows, instruction by instruction, from the bounds of the value, the
    /// properties of the arguments and their bounds.
    pub(super) fn by_form<T>(
        &self,
        variables: [Interval; 3],
        property: impl Fn(&Instruction, Interval, &[T], &[Interval]) -> T,
    ) -> Option<T> {
        let (mut bounds, mut properties) = (Vec::<Interval>::new(), Vec::new());
        for instruction in &self.program {
            let first = bounds.len() - instruction.takes();
            let (of, properties_of) = (bounds.split_off(first), properties.split_off(first));
            let value = instruction.enclosed(variables, &of);
            properties.push(property(instruction, value, &properties_of, &of));
            bounds.push(value);
        }
        properties.pop()
    }
}
