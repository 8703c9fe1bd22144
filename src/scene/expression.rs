//! Expressions in x, y and t: parsed once, evaluated often.

use std::f64::consts;
use std::fmt;

use exmex::{BinOp, Express, FlatEx, MakeOperators, MatchLiteral, Operator};

use super::error::ExpressionError;
use super::grammar;

/// A real function of x, y (m) and t (s), read from a scene.
///
/// Known are the variables `x`, `y`, `t`, the constant `pi`, the operators
/// `+ - * / ^` and the functions `sin cos tan sqrt exp log abs min max atan2`
/// (`log` is natural; `min`, `max` and `atan2` take two arguments). Precedence is
/// that of mathematics: `-x^2` is −(x²) and `2^3^2` is 2^(3²). `min` and `max` keep
/// a NaN rather than hide it.
///
/// ```
/// use signorini::scene::Expression;
/// let load = Expression::parse("-80*t*(1 - x^2)")?;
/// assert_eq!(load.eval(0.5, 0.0, 1.0), -60.0);
/// assert!(load.depends_on_time() && !load.is_constant());
/// # Ok::<(), signorini::scene::ExpressionError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Expression {
    text: String,
    code: Code,
}

#[derive(Debug, Clone)]
enum Code {
    Constant(f64),
    Formula {
        program: Box<FlatEx<f64, Operators, Numbers>>,
        /// Which of (t, x, y) the program takes, in its order.
        arguments: Vec<usize>,
    },
}

impl Expression {
    /// Parses `text`.
    ///
    /// # Errors
    /// A syntax error with its column, or a name or function that is not known.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        if text.trim().is_empty() {
            return Err(ExpressionError::Empty);
        }
        let bracketed = grammar::with_all_brackets(text)?;
        let refused = |e: exmex::ExError| ExpressionError::Refused { reason: e.to_string() };
        let program = FlatEx::<f64, Operators, Numbers>::parse(&bracketed).map_err(refused)?;
        let code = if program.var_names().is_empty() {
            Code::Constant(program.eval(&[]).map_err(refused)?)
        } else {
            let names = program.var_names().iter();
            let slot = |name: &String| grammar::VARIABLES.iter().position(|v| v == name);
            Code::Formula {
                arguments: names.filter_map(slot).collect(),
                program: Box::new(program),
            }
        };
        Ok(Self { text: text.trim().to_owned(), code })
    }

    /// The expression that is `value` everywhere.
    pub fn constant(value: f64) -> Self {
        Self { text: value.to_string(), code: Code::Constant(value) }
    }

    /// The value at the point (x, y), m, and time t, s; NaN or infinite where the
    /// expression is not defined.
    pub fn eval(&self, x: f64, y: f64, t: f64) -> f64 {
        match &self.code {
            Code::Constant(value) => *value,
            Code::Formula { program, arguments } => {
                let given = [t, x, y];
                let mut values = [0.0; 3];
                for (value, &slot) in values.iter_mut().zip(arguments) {
                    *value = given[slot];
                }
                // The count is right by construction, so there is no error to lose.
                let values = &values[..arguments.len()];
                program.eval(values).unwrap_or(f64::NAN)
            }
        }
    }

    /// The value if the expression names no variable.
    pub fn as_constant(&self) -> Option<f64> {
        match self.code {
            Code::Constant(value) => Some(value),
            Code::Formula { .. } => None,
        }
    }

    /// Whether the expression names no variable.
    pub fn is_constant(&self) -> bool {
        self.as_constant().is_some()
    }

    /// Whether the expression names t.
    pub fn depends_on_time(&self) -> bool {
        self.names(|variable| variable == "t")
    }

    /// Whether the expression names x or y.
    pub fn depends_on_space(&self) -> bool {
        self.names(|variable| variable != "t")
    }

    fn names(&self, which: impl Fn(&str) -> bool) -> bool {
        match &self.code {
            Code::Constant(_) => false,
            Code::Formula { arguments, .. } => {
                arguments.iter().any(|&slot| which(grammar::VARIABLES[slot]))
            }
        }
    }
}

/// The text as it was written.
impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Our operators and no others: exmex's own factory also knows PI, E, τ and many more.
#[derive(Debug, Clone)]
struct Operators;

impl MakeOperators<f64> for Operators {
    fn make<'a>() -> Vec<Operator<'a, f64>> {
        // Brackets are all written out, so only `+ -` and `* /` ever stand side by
        // side. Nothing is declared commutative: exmex would reorder the sums.
        let binary = |apply, prio| BinOp { apply, prio, is_commutative: false };
        let smaller = |a: f64, b: f64| if a < b || a.is_nan() { a } else { b };
        let larger = |a: f64, b: f64| if a > b || a.is_nan() { a } else { b };
        vec![
            Operator::make_bin("+", binary(|a, b| a + b, 0)),
            Operator::make_bin_unary("-", binary(|a, b| a - b, 0), |a| -a),
            Operator::make_bin("*", binary(|a, b| a * b, 1)),
            Operator::make_bin("/", binary(|a, b| a / b, 1)),
            Operator::make_bin("^", binary(f64::powf, 2)),
            Operator::make_bin("min", binary(smaller, 2)),
            Operator::make_bin("max", binary(larger, 2)),
            Operator::make_bin("atan2", binary(f64::atan2, 2)),
            Operator::make_unary("sin", f64::sin),
            Operator::make_unary("cos", f64::cos),
            Operator::make_unary("tan", f64::tan),
            Operator::make_unary("sqrt", f64::sqrt),
            Operator::make_unary("exp", f64::exp),
            Operator::make_unary("log", f64::ln),
            Operator::make_unary("abs", f64::abs),
            Operator::make_constant(grammar::PI, consts::PI),
        ]
    }
}

/// Numbers as the grammar reads them; exmex's own know no exponent.
#[derive(Debug, Clone)]
struct Numbers;

impl MatchLiteral for Numbers {
    fn is_literal(text: &str) -> Option<&str> {
        grammar::leading_number(text)
    }
}
