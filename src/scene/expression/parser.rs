//! Parses the text of an expression into its program.

use super::{
    DEEPEST, Expression,
    Instruction::{self, Binary, Choose, Compare, Number, Unary, Variable},
    MAX_LENGTH, Rule, Scope, Shape, Table, interval, truth,
};
use crate::suggestion::suggestion;
use std::{
    f64::consts::{FRAC_PI_2, PI},
    ops::Range,
    sync::Arc,
};
use toml::Value;

/// All names with their instructions.
const NAMES: [(&str, Instruction); 15] = [
    ("x", Variable(0)),
    ("y", Variable(1)),
    ("t", Variable(2)),
    ("pi", Number(PI)),
    ("sin", Unary(f64::sin, |f, a| interval::wave(f, a, FRAC_PI_2), Rule::Other)),
    ("cos", Unary(f64::cos, |f, a| interval::wave(f, a, 0.0), Rule::Other)),
    ("tan", Unary(f64::tan, interval::tangent, Rule::Other)),
    ("sqrt", Unary(f64::sqrt, interval::from_zero, Rule::KinkAtZero)),
    ("exp", Unary(f64::exp, interval::monotone, Rule::Other)),
    ("log", Unary(f64::ln, interval::from_zero, Rule::Other)),
    ("abs", Unary(f64::abs, interval::absolute, Rule::KinkAtZero)),
    (
        "min",
        Binary(|a, b| if a < b || a.is_nan() { a } else { b }, interval::corners, Rule::Smaller),
    ),
    (
        "max",
        Binary(|a, b| if a > b || a.is_nan() { a } else { b }, interval::corners, Rule::Larger),
    ),
    ("atan2", Binary(f64::atan2, interval::angle, Rule::Other)),
    ("if", Choose),
];
/// The end of a message about a constant that cannot be evaluated.
pub(in crate::scene) const WITHOUT_VALUE: &str =
    "without a value: it is wrong, or needs itself by way of others";
/// The functions given by points in a file.
const TABLES: [(&str, Shape); 3] =
    [("table", Shape::Linear), ("spline", Shape::Cubic), ("pchip", Shape::Monotone)];
/// Per operator: its text, its instruction, its precedence, and the smallest precedence of operators in its
/// right operand: `a - b - c` groups from the left, `a^b^c` from the right. A longer operator stands before
/// the shorter one with which it begins.
const OPERATORS: [(&str, Instruction, u8, u8); 13] = [
    (
        "or",
        Binary(|a, b| truth(a, b, |a, b| a != 0.0 || b != 0.0), interval::logical, Rule::Other),
        1,
        2,
    ),
    (
        "and",
        Binary(|a, b| truth(a, b, |a, b| a != 0.0 && b != 0.0), interval::logical, Rule::Other),
        2,
        3,
    ),
    ("<=", Compare(f64::le), 3, 4),
    (">=", Compare(f64::ge), 3, 4),
    ("==", Compare(f64::eq), 3, 4),
    ("!=", Compare(f64::ne), 3, 4),
    ("<", Compare(f64::lt), 3, 4),
    (">", Compare(f64::gt), 3, 4),
    ("+", Binary(|a, b| a + b, interval::corners, Rule::Sum), 4, 5),
    ("-", Binary(|a, b| a - b, interval::corners, Rule::Sum), 4, 5),
    ("*", Binary(|a, b| a * b, interval::corners, Rule::Product), 5, 6),
    ("/", Binary(|a, b| a / b, interval::quotient, Rule::Quotient), 5, 6),
    ("^", Binary(f64::powf, interval::power, Rule::Power), 6, 6),
];
/// The tokens that may follow a number, in messages.
const AN_OPERATOR: &str = "a decimal point, an operator (`*`, `^`, `==`, `and`, `or`, …)";
/// The precedence of a sign. Only `^` has a higher one: `-x^2` is −(x²), and `2^-1` is ½.
const SIGN: u8 = 6;

/// Why a constant cannot have this name, if it cannot.
pub(in crate::scene) fn refused_name(name: &str) -> Option<&'static str> {
    let is_letter = |c: char| c.is_alphabetic() || c == '_';
    let mut known = NAMES.iter().map(|(name, _)| *name).chain(TABLES.map(|(name, _)| name));
    let is_operator = OPERATORS.iter().any(|(symbol, ..)| *symbol == name);
    if is_operator || known.any(|known| known == name) {
        return Some("has a name that expressions use for something else; choose another one");
    }
    (!name.starts_with(is_letter) || !name.chars().all(|c| is_letter(c) || c.is_numeric()))
        .then_some("is no name for expressions; write letters, digits and _, a letter first")
}

/// Reads a text by precedence climbing.
pub(super) struct Parser<'a> {
    text: &'a str,
    scope: &'a Scope,
    /// The byte offset of the next character.
    at: usize,
    /// What an error is about, bytes.
    place: Range<usize>,
    depth: usize,
    program: Vec<Instruction>,
}

/// The outcome of parsing a part of the text; the part is then in the program.
type Parsed = Result<(), String>;

impl<'a> Parser<'a> {
    /// The program of `text`, or what is wrong and where, bytes.
    pub(super) fn parse(
        text: &'a str,
        scope: &'a Scope,
    ) -> Result<Vec<Instruction>, (String, Range<usize>)> {
        let (length, program) = (text.len(), Vec::new());
        let mut parser = Self { text, scope, at: 0, place: 0..length, depth: 0, program };
        parser.whole().map_err(|message| (message, parser.place.clone()))?;
        Ok(parser.program)
    }

    fn whole(&mut self) -> Parsed {
        if self.text.len() > MAX_LENGTH {
            let length = self.text.len();
            return Err(format!(
                "is {length} bytes long, and {MAX_LENGTH} are allowed; shorten it, or use table(\"file.csv\")"
            ));
        }
        if self.peek().is_none() {
            return Err("is empty; write a number or an expression in x, y, t".into());
        }
        self.expression(1)?;
        match self.peek() {
            Some(_) => Err(self.unexpected(&format!("{AN_OPERATOR} or the end"))),
            None => Ok(()),
        }
    }

    /// Parses signs, atoms, and operators between them with at least the precedence `least`.
    fn expression(&mut self, least: u8) -> Parsed {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("is nested more than {DEEPEST} deep; simplify it"));
        }
        if self.take("-") {
            self.expression(SIGN)?;
            self.push(Number(-1.0));
            self.push(Binary(|a, b| a * b, interval::corners, Rule::Product));
        } else if self.take("+") {
            self.expression(SIGN)?;
        } else {
            self.atom()?;
        }
        let mut compared = false;
        while let Some((symbol, apply, strength, right)) = self.operator()
            && *strength >= least
        {
            let compares = matches!(apply, Compare(_));
            if compared && compares {
                let column = self.column();
                self.place = self.at..self.at + symbol.len();
                return Err(format!(
                    "compares a second time by `{symbol}` at column {column}; write `a < b and b < c`"
                ));
            }
            compared = compares;
            self.at += symbol.len();
            self.expression(*right)?;
            self.push(apply.clone());
        }
        self.depth -= 1;
        Ok(())
    }

    /// Parses a number, a name or a bracket.
    fn atom(&mut self) -> Parsed {
        let first = self.peek();
        let rest = &self.text[self.at..];
        let number = &rest[..number_length(rest)];
        if self.take("(") {
            self.expression(1)?;
            self.closing_bracket()
        } else if let Ok(value) = number.parse::<f64>() {
            self.place = self.at..self.at + number.len();
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
            let hint = if first == Some('*') { " (a power is written with `^`)" } else { "" };
            Err(self.unexpected(&format!("a number, a name or `(`{hint}")))
        }
    }

    /// Parses a variable, π, a constant, or a function with its arguments.
    fn name(&mut self, name: &str) -> Parsed {
        let place = self.at..self.at + name.len();
        (self.at, self.place) = (place.end, place.clone());
        if let Some(table) = TABLES.into_iter().find(|(known, _)| *known == name) {
            return self.table(table);
        }
        let known = NAMES.iter().find(|(known, _)| *known == name).map(|(_, known)| known.clone());
        let constant = self.scope.constants.get(name).and_then(Value::as_float);
        let constant = constant.filter(|value| value.is_finite()).map(Number);
        let Some(instruction) = known.or(constant) else {
            if self.scope.constants.contains_key(name) {
                return Err(format!("has the constant `{name}` {WITHOUT_VALUE}"));
            }
            let kind = if self.peek() == Some('(') { "function" } else { "variable" };
            let known = NAMES.iter().map(|(name, _)| *name).chain(TABLES.map(|(name, _)| name));
            let known = known.chain(self.scope.constants.keys().map(String::as_str));
            let suggestion = suggestion(name, &known.collect::<Vec<_>>());
            return Err(format!("has the unknown {kind} `{name}`{suggestion}"));
        };
        let (takes, mut given) = (instruction.takes(), 0);
        if takes > 0 && self.take("(") {
            while given == 0 || self.take(",") {
                self.expression(1)?;
                given += 1;
            }
            self.closing_bracket()?;
        }
        if given != takes {
            self.place = place;
            let given = format!("calls `{name}` with {given} arguments");
            return Err(format!("{given}; it takes {takes}, in brackets"));
        }
        self.push(instruction);
        Ok(())
    }

    /// Parses the rest of a function of [`TABLES`]: `("file")` or `("file", argument)`.
    fn table(&mut self, (name, shape): (&str, Shape)) -> Parsed {
        let usage = format!(
            "has a {name} without a file; write {name}(\"file.csv\"), of t, or {name}(\"file.csv\", x)"
        );
        let quote = if self.take("(") { self.peek() } else { None };
        let rest = self.text[self.at..].strip_prefix(['"', '\'']);
        let file = quote.zip(rest).and_then(|(quote, rest)| rest.split_once(quote));
        let Some((file, _)) = file else { return Err(usage) };
        self.at += file.len() + 2;
        let table = Table::read(&self.scope.folder.join(file), shape);
        let table = table.map_err(|error| format!("has {error}"))?;
        match self.take(",") {
            true => self.expression(1)?,
            false => self.program.push(Variable(2)),
        }
        self.push(Instruction::Table(Arc::new(table)));
        self.closing_bracket()
    }

    /// Adds an instruction, or its value if its arguments are numbers.
    fn push(&mut self, instruction: Instruction) {
        let takes = instruction.takes();
        let first = self.program.len() - takes;
        self.program.push(instruction);
        if takes > 0
            && self.program[first..first + takes]
                .iter()
                .all(|argument| matches!(argument, Number(_)))
        {
            let program = self.program.split_off(first);
            self.program.push(Number(Expression { program, height: takes }.eval(0.0, 0.0, 0.0)));
        }
    }

    /// The next operator.
    fn operator(&mut self) -> Option<&'static (&'static str, Instruction, u8, u8)> {
        self.peek();
        let rest = &self.text[self.at..];
        OPERATORS.iter().find(|(symbol, ..)| rest.starts_with(symbol))
    }

    /// The next character that is not a blank. Moves `at` to it.
    fn peek(&mut self) -> Option<char> {
        let rest = self.text[self.at..].trim_start();
        self.at = self.text.len() - rest.len();
        rest.chars().next()
    }

    fn take(&mut self, symbol: &str) -> bool {
        self.peek();
        let found = self.text[self.at..].starts_with(symbol);
        self.at += if found { symbol.len() } else { 0 };
        found
    }

    fn closing_bracket(&mut self) -> Parsed {
        if self.take(")") { Ok(()) } else { Err(self.unexpected(&format!("{AN_OPERATOR} or `)`"))) }
    }

    /// The column of the next character, counted from 1.
    fn column(&self) -> usize {
        self.text[..self.at].chars().count() + 1
    }

    fn unexpected(&mut self, expected: &str) -> String {
        let next = self.peek();
        self.place = self.at..self.at + next.map_or(1, char::len_utf8);
        let found = next.map_or("the end".into(), |c| format!("`{c}`"));
        let column = self.column();
        format!("has {found} at column {column} of the expression, where {expected} is expected")
    }
}

/// The length of a number at the start of `text`, bytes: digits with an optional point and exponent.
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
