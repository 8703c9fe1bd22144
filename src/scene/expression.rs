//! Expressions in x, y and t: parsed once, evaluated often.

use std::f64::consts::PI;

use super::error::suggestion;
use Instruction::{Binary, Number, Unary, Variable};

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
    /// In postfix order: a number or variable is put on a stack, a function or operator takes its
    /// arguments from there and puts its value in their place.
    program: Vec<Instruction>,
}

/// Why a text is no expression: what is wrong and what to write instead, as its predicate.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ExpressionError(String);

#[derive(Debug, Clone, Copy)]
enum Instruction {
    Number(f64),
    /// x, y or t, by its index.
    Variable(usize),
    Unary(fn(f64) -> f64),
    Binary(fn(f64, f64) -> f64),
}

/// All names, and what they stand for.
const NAMES: [(&str, Instruction); 14] = [
    ("x", Variable(0)),
    ("y", Variable(1)),
    ("t", Variable(2)),
    ("pi", Number(PI)),
    ("sin", Unary(f64::sin)),
    ("cos", Unary(f64::cos)),
    ("tan", Unary(f64::tan)),
    ("sqrt", Unary(f64::sqrt)),
    ("exp", Unary(f64::exp)),
    ("log", Unary(f64::ln)),
    ("abs", Unary(f64::abs)),
    ("min", Binary(|a, b| if a < b || a.is_nan() { a } else { b })),
    ("max", Binary(|a, b| if a > b || a.is_nan() { a } else { b })),
    ("atan2", Binary(f64::atan2)),
];
/// What operators do, how strongly they bind, and how strongly an operator in their right operand
/// must bind at least: `a - b` is taken from the left, `a^b` from the right.
const OPERATORS: [(char, Instruction, u8, u8); 5] = [
    ('+', Binary(|a, b| a + b), 1, 2),
    ('-', Binary(|a, b| a - b), 1, 2),
    ('*', Binary(|a, b| a * b), 2, 3),
    ('/', Binary(|a, b| a / b), 2, 3),
    ('^', Binary(f64::powf), 3, 3),
];
/// Of the operators only `^` binds stronger than a sign: `-x^2` is −(x²), and `2^-1` is ½.
const SIGN: u8 = 3;

/// Deeper nesting is refused: parsing would exhaust the stack long before it means anything.
const DEEPEST: usize = 128;

impl Expression {
    /// Parses `text`.
    ///
    /// # Errors
    /// A syntax error with its column, or a name or function that is not known.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        let mut parser = Parser { text, at: 0, depth: 0, program: Vec::new() };
        parser.whole().map_err(ExpressionError)?;
        let parsed = Self { program: parser.program };
        match parsed.depends_on_space() || parsed.depends_on_time() {
            true => Ok(parsed),
            false => Ok(Self::constant(parsed.eval(0.0, 0.0, 0.0))),
        }
    }

    /// The expression that is `value` everywhere.
    pub fn constant(value: f64) -> Self {
        Self { program: vec![Number(value)] }
    }

    /// The value at the point (x, y), m, and time t, s; NaN or infinite where the
    /// expression is not defined.
    pub fn eval(&self, x: f64, y: f64, t: f64) -> f64 {
        // A program of n instructions has at most (n + 1)/2 values on its stack; and one of any
        // length at most one waiting in each level of nesting: the left operand of an operator, or
        // the first argument of a function.
        match self.program.len() {
            ..32 => self.run::<16>([x, y, t]),
            _ => self.run::<DEEPEST>([x, y, t]),
        }
    }

    /// Runs the program with a stack of `N` values.
    fn run<const N: usize>(&self, variables: [f64; 3]) -> f64 {
        let mut stack = [0.0; N];
        let mut height = 0;
        for instruction in &self.program {
            let (taken, value) = match *instruction {
                Number(value) => (0, value),
                Variable(i) => (0, variables[i]),
                Unary(apply) => (1, apply(stack[height - 1])),
                Binary(apply) => (2, apply(stack[height - 2], stack[height - 1])),
            };
            height -= taken;
            stack[height] = value;
            height += 1;
        }
        stack[0]
    }

    /// The value if the expression names no variable.
    pub fn as_constant(&self) -> Option<f64> {
        match self.program[..] {
            [Number(value)] => Some(value),
            _ => None,
        }
    }

    /// Whether the expression names t.
    pub fn depends_on_time(&self) -> bool {
        self.program.iter().any(|instruction| matches!(instruction, Variable(2)))
    }

    /// Whether the expression names x or y.
    pub fn depends_on_space(&self) -> bool {
        self.program.iter().any(|instruction| matches!(instruction, Variable(0 | 1)))
    }
}

/// Reads a text by precedence climbing.
struct Parser<'a> {
    text: &'a str,
    /// Byte offset of what is read next.
    at: usize,
    depth: usize,
    program: Vec<Instruction>,
}

/// What was read is in the program; or what is wrong with it.
type Parsed = Result<(), String>;

impl Parser<'_> {
    fn whole(&mut self) -> Parsed {
        if self.peek().is_none() {
            return Err("is empty; write a number or an expression in x, y, t".into());
        }
        self.expression(1)?;
        match self.peek() {
            Some(_) => {
                Err(self.unexpected("an operator (a product is written with `*`) or the end"))
            }
            None => Ok(()),
        }
    }

    /// Signs, atoms, and operators between them that bind as strongly as `least`.
    fn expression(&mut self, least: u8) -> Parsed {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("is nested more than {DEEPEST} deep; simplify it"));
        }
        if self.take('-') {
            self.expression(SIGN)?;
            self.program.push(Unary(|a| -a));
        } else if self.take('+') {
            self.expression(SIGN)?;
        } else {
            self.atom()?;
        }
        let operators = OPERATORS.iter().filter(|(_, _, strength, _)| *strength >= least);
        while let Some((_, apply, _, right)) = operators.clone().find(|(o, ..)| self.take(*o)) {
            self.expression(*right)?;
            self.program.push(*apply);
        }
        self.depth -= 1;
        Ok(())
    }

    /// A number, a name or a bracket.
    fn atom(&mut self) -> Parsed {
        let first = self.peek();
        let rest = &self.text[self.at..];
        let number = &rest[..number_length(rest)];
        if self.take('(') {
            self.expression(1)?;
            self.closing_bracket()
        } else if let Ok(value) = number.parse::<f64>() {
            self.at += number.len();
            self.program.push(Number(value));
            match value.is_finite() {
                true => Ok(()),
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
    fn name(&mut self, name: &str) -> Parsed {
        self.at += name.len();
        let Some((_, instruction)) = NAMES.iter().find(|(known, _)| *known == name) else {
            let kind = if self.peek() == Some('(') { "function" } else { "variable" };
            let suggestion = suggestion(name, &NAMES.map(|(name, _)| name));
            return Err(format!("has the unknown {kind} `{name}`{suggestion}"));
        };
        let takes = match instruction {
            Number(_) | Variable(_) => 0,
            Unary(_) => 1,
            Binary(_) => 2,
        };
        let mut given = 0;
        if takes > 0 && self.take('(') {
            while given == 0 || self.take(',') {
                self.expression(1)?;
                given += 1;
            }
            self.closing_bracket()?;
        }
        if given != takes {
            let given = format!("calls `{name}` with {given} arguments");
            return Err(format!("{given}; it takes {takes}, in brackets"));
        }
        self.program.push(*instruction);
        Ok(())
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

    fn closing_bracket(&mut self) -> Parsed {
        if self.take(')') {
            Ok(())
        } else {
            Err(self.unexpected("an operator (a product is written with `*`) or `)`"))
        }
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
