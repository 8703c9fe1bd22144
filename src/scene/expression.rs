//! Expressions in x, y and t, which are parsed once and evaluated often.

mod breaks;
mod degree;
mod interval;
mod kinks;
mod parser;
mod table;

use degree::Rule;
use interval::{Enclosure, Enclosure2};
use parser::Parser;
use serde::Deserialize;
use std::{
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
};
use table::{Shape, Table};
use toml::Value;

pub(super) use parser::{WITHOUT_VALUE, refused_name};

/// The message if an expression of x, y or t stands for a number.
pub(super) const NOT_CONSTANT: &str = "must be a constant, without x, y and t";
/// The largest allowed length of an expression, bytes. A run evaluates it at many points and times.
const MAX_LENGTH: usize = 20_000;
/// The deepest allowed nesting, so that parsing cannot exhaust the stack of the program.
const DEEPEST: usize = 128;
/// The largest number of values on the stack of an expression. In each level of nesting at most two values
/// wait: the first two arguments of `if`.
const HIGHEST: usize = 2 * DEEPEST;

/// A real function of x, y (m) and t (s), read from a scene.
///
/// Known are the variables `x`, `y`, `t`, the constant `pi`, the operators `+ - * / ^`, the
/// comparisons `< <= > >= == !=`, `and`, `or`, and the functions `sin cos tan sqrt exp log abs min max
/// atan2 if table spline pchip` (`log` is natural; `min`, `max` and `atan2` take two arguments). Precedence is that
/// of mathematics: `-x^2` is −(x²), `2^3^2` is 2^(3²), and `t < 1 and x > 2` needs no brackets.
///
/// A true comparison is 1, a false one 0, and any number except 0 counts as true. `if(c, a, b)` is a where c
/// is true and b elsewhere; the value of the other one does not matter there. `table("file.csv")` is
/// piecewise linear in t, `table("file.csv", a)` in a, through the two columns of a file. It is constant
/// before the first row and after the last. Two rows with the same first number make a jump, at which the
/// second row counts. `spline` is the same with a cubic function between two rows, whose second derivative is continuous
/// except at jumps; that of `pchip` is monotone, and its first derivative is continuous. A NaN in an argument gives NaN, except in the argument that `if` does not use.
///
/// ```
/// use signorini::scene::Expression;
/// let load = Expression::parse("-80*t*(1 - x^2)")?;
/// assert_eq!(load.eval(0.5, 0.0, 1.0), -60.0);
/// assert!(load.depends_on_time() && load.as_constant().is_none());
/// # Ok::<(), signorini::scene::ExpressionError>(())
/// ```
#[derive(Debug, Clone, Deserialize)]
#[serde(try_from = "(Value, PathBuf, toml::Table)")]
pub struct Expression {
    /// Instructions in postfix order. A number or variable is pushed on a stack. A function or operator pops
    /// its arguments and pushes its value.
    program: Vec<Instruction>,
    /// The largest number of values on the stack.
    height: usize,
}

/// The variables, constants and functions that the names in an expression refer to.
#[derive(Debug, Clone, Default)]
pub(super) struct Scope {
    /// The folder to which paths of tables are relative.
    pub(super) folder: PathBuf,
    /// The constants by name. One that is not a finite float has no value.
    pub(super) constants: toml::Table,
}

impl Scope {
    /// The scope of a scene in a `folder` with `constants` as written. Numbers take the place of their expressions, which may
    /// name each other in any order, as a table of TOML has none. A constant without a value stays as it is.
    pub(super) fn new(folder: &Path, constants: toml::Table) -> Self {
        let mut scope = Self { folder: folder.to_owned(), constants };
        loop {
            let open = scope.constants.iter().filter(|(_, written)| !written.is_float());
            let number = |written| Expression::number(written, &scope).ok();
            let found = open.filter_map(|(name, of)| Some((name.clone(), number(of)?.into())));
            let found: Vec<(String, Value)> = found.collect();
            if found.is_empty() {
                return scope;
            }
            scope.constants.extend(found);
        }
    }
}

/// An expression as written, the folder of its tables, and the constants of its scene.
impl TryFrom<(Value, PathBuf, toml::Table)> for Expression {
    type Error = ExpressionError;

    fn try_from(
        (written, folder, constants): (Value, PathBuf, toml::Table),
    ) -> Result<Self, ExpressionError> {
        Self::from_toml(&written, &Scope { folder, constants })
    }
}

/// The reason why a text is not an expression, and what to write instead.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ExpressionError(String);

#[derive(Debug, Clone)]
enum Instruction {
    Number(f64),
    /// x, y or t, by its index.
    Variable(usize),
    Unary(fn(f64) -> f64, Enclosure, Rule),
    Binary(fn(f64, f64) -> f64, Enclosure2, Rule),
    Compare(fn(&f64, &f64) -> bool),
    /// `if`.
    Choose,
    Table(Arc<Table>),
}
use Instruction::{Binary, Choose, Compare, Number, Unary, Variable};

impl Instruction {
    /// The number of values that it pops from the stack.
    fn takes(&self) -> usize {
        match self {
            Number(_) | Variable(_) => 0,
            Unary(..) | Self::Table(_) => 1,
            Binary(..) | Compare(_) => 2,
            Choose => 3,
        }
    }
}

impl Expression {
    /// Parses `text`. Paths of tables are relative to `folder`.
    ///
    /// # Errors
    /// A syntax error with its column, an unknown name or function, or a table that cannot be read, with its
    /// file and line.
    pub fn parse_in(text: &str, folder: &Path) -> Result<Self, ExpressionError> {
        Self::from_toml(&text.into(), &Scope { folder: folder.to_owned(), ..Scope::default() })
    }

    /// The reason why a text is not an expression, and its part, in bytes, that the reason is about; `None` if it is one.
    pub(super) fn wrong_part(text: &str, scope: &Scope) -> Option<(String, Range<usize>)> {
        Parser::parse(text, scope).err()
    }

    /// The expression in a scene: a number, or a text as for [`Expression::parse_in`].
    pub(super) fn from_toml(written: &Value, scope: &Scope) -> Result<Self, ExpressionError> {
        match written {
            Value::String(text) => {
                let program =
                    Parser::parse(text, scope).map_err(|(error, _)| ExpressionError(error))?;
                let heights = program.iter().scan(0, |height, instruction| {
                    *height = *height + 1 - instruction.takes();
                    Some(*height)
                });
                Ok(Self { height: heights.max().unwrap_or(0), program })
            }
            Value::Float(value) => Ok(Self::constant(*value)),
            Value::Integer(value) => Ok(Self::constant(*value as f64)),
            _ => Err(ExpressionError("must be a number or an expression in quotes".to_owned())),
        }
    }

    /// The number in a scene: itself, or an expression of constants.
    pub(super) fn number(written: &Value, scope: &Scope) -> Result<f64, ExpressionError> {
        let number = Self::from_toml(written, scope)?.as_constant();
        number.ok_or_else(|| ExpressionError(NOT_CONSTANT.to_owned()))
    }

    /// As [`Expression::parse_in`], in the working directory.
    ///
    /// # Errors
    /// See [`Expression::parse_in`].
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        Self::parse_in(text, Path::new(""))
    }

    /// The constant expression `value`.
    pub fn constant(value: f64) -> Self {
        Self { program: vec![Number(value)], height: 1 }
    }

    /// The value at the point (x, y), m, and time t, s; NaN or infinite where the
    /// expression is not defined.
    pub fn eval(&self, x: f64, y: f64, t: f64) -> f64 {
        match self.height {
            ..=8 => self.run::<8>([x, y, t]),
            _ => self.run::<HIGHEST>([x, y, t]),
        }
    }

    /// Runs the program with a stack of `N` values.
    fn run<const N: usize>(&self, variables: [f64; 3]) -> f64 {
        let mut stack = [0.0; N];
        let mut height = 0;
        for instruction in &self.program {
            height -= instruction.takes();
            stack[height] = match instruction {
                Number(value) => *value,
                Variable(i) => variables[*i],
                Unary(apply, ..) => apply(stack[height]),
                Binary(apply, ..) => apply(stack[height], stack[height + 1]),
                Compare(holds) => truth(stack[height], stack[height + 1], |a, b| holds(&a, &b)),
                Choose if stack[height].is_nan() => f64::NAN,
                Choose => stack[height + if stack[height] != 0.0 { 1 } else { 2 }],
                Instruction::Table(table) => table.at(stack[height]),
            };
            height += 1;
        }
        stack[0]
    }

    /// The value, if the expression contains no variable.
    pub fn as_constant(&self) -> Option<f64> {
        match self.program[..] {
            [Number(value)] => Some(value),
            _ => None,
        }
    }

    /// Whether the expression contains t.
    pub fn depends_on_time(&self) -> bool {
        self.program.iter().any(|instruction| matches!(instruction, Variable(2)))
    }

    /// Whether the expression contains x or y.
    pub fn depends_on_space(&self) -> bool {
        self.program.iter().any(|instruction| matches!(instruction, Variable(0 | 1)))
    }
}

/// 1 if `holds` of a and b, else 0; NaN if either is.
fn truth(a: f64, b: f64, holds: impl Fn(f64, f64) -> bool) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { f64::from(u8::from(holds(a, b))) }
}
