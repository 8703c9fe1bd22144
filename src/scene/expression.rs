//! Expressions in x, y and t: parsed once, evaluated often.

use std::f64::consts::PI;

use super::error::suggestion;

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
/// assert!(load.depends_on_time() && load.as_constant().is_none());
/// # Ok::<(), signorini::scene::ExpressionError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Expression {
    term: Term,
    /// Which of `VARIABLES` it names.
    names: [bool; 3],
}

/// Why a text is no expression: what is wrong and what to write instead, as its predicate.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ExpressionError(String);

/// A part of an expression.
#[derive(Debug, Clone)]
enum Term {
    Number(f64),
    /// One of `VARIABLES`.
    Variable(usize),
    /// A term to whose value steps are applied in turn. (A long sum is no deep tree.)
    Chain(Box<Term>, Vec<Step>),
}

#[derive(Debug, Clone)]
enum Step {
    Unary(Unary),
    Binary(Binary, Term),
}

type Unary = fn(f64) -> f64;
type Binary = fn(f64, f64) -> f64;

const VARIABLES: [&str; 3] = ["x", "y", "t"];
const UNARY: [(&str, Unary); 7] = [
    ("sin", f64::sin),
    ("cos", f64::cos),
    ("tan", f64::tan),
    ("sqrt", f64::sqrt),
    ("exp", f64::exp),
    ("log", f64::ln),
    ("abs", f64::abs),
];
const BINARY: [(&str, Binary); 3] = [
    ("min", |a, b| if a < b || a.is_nan() { a } else { b }),
    ("max", |a, b| if a > b || a.is_nan() { a } else { b }),
    ("atan2", f64::atan2),
];
/// What operators do, how strongly they bind, and how strongly an operator in their right operand
/// must bind at least: `a - b` is taken from the left, `a^b` from the right.
const OPERATORS: [(char, Binary, u8, u8); 5] = [
    ('+', |a, b| a + b, 1, 2),
    ('-', |a, b| a - b, 1, 2),
    ('*', |a, b| a * b, 2, 3),
    ('/', |a, b| a / b, 2, 3),
    ('^', f64::powf, 3, 3),
];
/// Of the operators only `^` binds stronger than a sign: `-x^2` is −(x²), and `2^-1` is ½.
const SIGN: u8 = 3;

/// Deeper nesting is refused: it would exhaust the stack long before it means anything.
const DEEPEST: usize = 128;

impl Expression {
    /// Parses `text`.
    ///
    /// # Errors
    /// A syntax error with its column, or a name or function that is not known.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        let mut parser = Parser { text, at: 0, depth: 0, names: [false; 3] };
        let term = parser.whole().map_err(ExpressionError)?;
        match parser.names {
            [false, false, false] => Ok(Self::constant(term.eval(&[0.0; 3]))),
            names => Ok(Self { term, names }),
        }
    }

    /// The expression that is `value` everywhere.
    pub fn constant(value: f64) -> Self {
        Self { term: Term::Number(value), names: [false; 3] }
    }

    /// The value at the point (x, y), m, and time t, s; NaN or infinite where the
    /// expression is not defined.
    pub fn eval(&self, x: f64, y: f64, t: f64) -> f64 {
        self.term.eval(&[x, y, t])
    }

    /// The value if the expression names no variable.
    pub fn as_constant(&self) -> Option<f64> {
        match self.term {
            Term::Number(value) => Some(value),
            _ => None,
        }
    }

    /// Whether the expression names t.
    pub fn depends_on_time(&self) -> bool {
        self.names[2]
    }

    /// Whether the expression names x or y.
    pub fn depends_on_space(&self) -> bool {
        self.names[0] || self.names[1]
    }
}

impl Term {
    fn then(self, step: Step) -> Self {
        match self {
            Self::Chain(first, mut steps) => {
                steps.push(step);
                Self::Chain(first, steps)
            }
            first => Self::Chain(first.into(), vec![step]),
        }
    }

    /// Inlined, so that numbers and variables cost no call.
    #[inline(always)]
    fn eval(&self, variables: &[f64; 3]) -> f64 {
        match self {
            Self::Number(value) => *value,
            Self::Variable(i) => variables[*i],
            Self::Chain(first, steps) => run(first, steps, variables),
        }
    }
}

fn run(first: &Term, steps: &[Step], variables: &[f64; 3]) -> f64 {
    steps.iter().fold(first.eval(variables), |value, step| match step {
        Step::Unary(apply) => apply(value),
        Step::Binary(apply, term) => apply(value, term.eval(variables)),
    })
}

/// Reads a text by precedence climbing.
struct Parser<'a> {
    text: &'a str,
    /// Byte offset of what is read next.
    at: usize,
    depth: usize,
    names: [bool; 3],
}

/// A term, or why there is none.
type Parsed = Result<Term, String>;

impl<'a> Parser<'a> {
    fn whole(&mut self) -> Parsed {
        if self.peek().is_none() {
            return Err("is empty; write a number or an expression in x, y, t".into());
        }
        let term = self.expression(1)?;
        match self.peek() {
            Some(_) => Err(self.unexpected("an operator or the end")),
            None => Ok(term),
        }
    }

    /// Signs, atoms, and operators between them that bind as strongly as `least`.
    fn expression(&mut self, least: u8) -> Parsed {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("is nested more than {DEEPEST} deep; simplify it"));
        }
        let mut term = if self.take('-') {
            self.expression(SIGN)?.then(Step::Unary(|a| -a))
        } else if self.take('+') {
            self.expression(SIGN)?
        } else {
            self.atom()?
        };
        let operators = OPERATORS.iter().filter(|(_, _, strength, _)| *strength >= least);
        while let Some((_, apply, _, right)) = operators.clone().find(|(o, ..)| self.take(*o)) {
            term = term.then(Step::Binary(*apply, self.expression(*right)?));
        }
        self.depth -= 1;
        Ok(term)
    }

    /// A number, a name or a bracket.
    fn atom(&mut self) -> Parsed {
        let first = self.peek();
        let rest = &self.text[self.at..];
        let number = &rest[..number_length(rest)];
        if self.take('(') {
            let inside = self.expression(1)?;
            self.expect_closing_bracket()?;
            Ok(inside)
        } else if let Ok(value) = number.parse::<f64>() {
            self.at += number.len();
            match value.is_finite() {
                true => Ok(Term::Number(value)),
                false => Err(format!("has the number {number}, which is too large")),
            }
        } else if first.is_some_and(|first| first.is_alphabetic() || first == '_') {
            let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next();
            self.name(name.unwrap_or(rest))
        } else {
            Err(self.unexpected("a number, a name or `(`"))
        }
    }

    /// A variable, π, or a function with its arguments.
    fn name(&mut self, name: &'a str) -> Parsed {
        self.at += name.len();
        if let Some((_, apply)) = UNARY.iter().find(|(known, _)| *known == name) {
            let [argument] = self.arguments(name)?;
            return Ok(argument.then(Step::Unary(*apply)));
        }
        if let Some((_, apply)) = BINARY.iter().find(|(known, _)| *known == name) {
            let [a, b] = self.arguments(name)?;
            return Ok(a.then(Step::Binary(*apply, b)));
        }
        let called = self.peek() == Some('(');
        let term = match VARIABLES.iter().position(|known| *known == name) {
            Some(i) => {
                self.names[i] = true;
                Term::Variable(i)
            }
            None if name == "pi" => Term::Number(PI),
            None => return Err(unknown_name(name, called)),
        };
        match called {
            true => Err(self.unexpected("an operator (a product is written with `*`)")),
            false => Ok(term),
        }
    }

    /// The `N` arguments of a function.
    fn arguments<const N: usize>(&mut self, name: &str) -> Result<[Term; N], String> {
        let mut arguments = Vec::new();
        if self.take('(') {
            arguments.push(self.expression(1)?);
            while self.take(',') {
                arguments.push(self.expression(1)?);
            }
            self.expect_closing_bracket()?;
        }
        arguments.try_into().map_err(|given: Vec<_>| {
            let given = given.len();
            format!("calls `{name}` with {given} arguments; it takes {N}, in brackets")
        })
    }

    /// The next character that is not a blank; `at` is moved to it.
    fn peek(&mut self) -> Option<char> {
        let rest = self.text[self.at..].trim_start();
        self.at = self.text.len() - rest.len();
        rest.chars().next()
    }

    fn take(&mut self, symbol: char) -> bool {
        let found = self.peek() == Some(symbol);
        if found {
            self.at += symbol.len_utf8();
        }
        found
    }

    fn expect_closing_bracket(&mut self) -> Result<(), String> {
        if self.take(')') { Ok(()) } else { Err(self.unexpected("`)`")) }
    }

    fn unexpected(&mut self, expected: &str) -> String {
        let found = self.peek().map_or("the end".into(), |c| format!("`{c}`"));
        let column = self.text[..self.at].chars().count() + 1;
        format!("has {found} at column {column} of the expression, where {expected} is expected")
    }
}

/// How many bytes at the start of `text` may be a number: digits with an optional point and
/// exponent.
fn number_length(text: &str) -> usize {
    let digits = |from: usize| text.bytes().skip(from).take_while(u8::is_ascii_digit).count();
    let mut length = digits(0);
    if text[length..].starts_with('.') {
        length += 1 + digits(length + 1);
    }
    if text[length..].starts_with(['e', 'E']) {
        let sign = usize::from(text[length + 1..].starts_with(['+', '-']));
        let exponent = digits(length + 1 + sign);
        length += if exponent > 0 { 1 + sign + exponent } else { 0 };
    }
    length
}

fn unknown_name(name: &str, called: bool) -> String {
    let functions = UNARY.map(|(name, _)| name).into_iter().chain(BINARY.map(|(name, _)| name));
    let known: Vec<&str> = VARIABLES.into_iter().chain(["pi"]).chain(functions).collect();
    let kind = if called { "function" } else { "variable" };
    format!("has the unknown {kind} `{name}`{}", suggestion(name, &known))
}
