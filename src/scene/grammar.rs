//! Reads the text of an expression by the usual rules of precedence.
//!
//! exmex binds a leading minus tighter than `^`, takes `2^3^2` from the left and
//! loses count in `min(1, max(2, 0))`. So the text is read here, names and numbers
//! are checked where they stand, and exmex receives it with every bracket written out.

use super::error::ExpressionError;

/// The variables of an expression, in the order of exmex (alphabetical).
pub(super) const VARIABLES: [&str; 3] = ["t", "x", "y"];
/// π.
pub(super) const PI: &str = "pi";
/// Functions of one argument.
pub(super) const UNARY: [&str; 7] = ["sin", "cos", "tan", "sqrt", "exp", "log", "abs"];
/// Functions of two arguments.
pub(super) const BINARY: [&str; 3] = ["min", "max", "atan2"];

/// Deeper nesting is refused: it would exhaust the stack long before it means anything.
const DEEPEST: usize = 64;

/// The number at the start of `text`: digits with an optional point and exponent.
pub(super) fn leading_number(text: &str) -> Option<&str> {
    let bytes = text.as_bytes();
    let digits = |from: usize| {
        let rest = bytes.get(from..).unwrap_or_default();
        rest.iter().take_while(|b| b.is_ascii_digit()).count()
    };
    let whole = digits(0);
    let mut end = whole;
    if bytes.get(end) == Some(&b'.') {
        let fraction = digits(end + 1);
        if whole + fraction == 0 {
            return None;
        }
        end += 1 + fraction;
    }
    if end == 0 {
        return None;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    text.get(..end)
}

/// Rewrites `text` with every bracket written out: `-x^2+1` becomes `((-(x^2))+1)`.
///
/// # Errors
/// A syntax error with its column, or a name that is not known.
pub(super) fn with_all_brackets(text: &str) -> Result<String, ExpressionError> {
    let mut reader = Reader { text, at: 0, depth: 0 };
    let whole = reader.sum()?;
    match reader.peek() {
        None => Ok(whole),
        Some(_) => Err(reader.unexpected("an operator or the end")),
    }
}

struct Reader<'a> {
    text: &'a str,
    /// Byte offset of what is read next.
    at: usize,
    depth: usize,
}

impl<'a> Reader<'a> {
    /// `a + b - c …`, from the left.
    fn sum(&mut self) -> Result<String, ExpressionError> {
        self.chain(['+', '-'], Self::product)
    }

    /// `a * b / c …`, from the left.
    fn product(&mut self) -> Result<String, ExpressionError> {
        self.chain(['*', '/'], Self::factor)
    }

    fn chain(
        &mut self,
        operators: [char; 2],
        operand: fn(&mut Self) -> Result<String, ExpressionError>,
    ) -> Result<String, ExpressionError> {
        let mut written = operand(self)?;
        let mut single = true;
        while let Some(operator) = self.peek().filter(|c| operators.contains(c)) {
            self.take(operator);
            written.push(operator);
            written.push_str(&operand(self)?);
            single = false;
        }
        Ok(if single { written } else { format!("({written})") })
    }

    /// `-a`, `+a`, `a^b`: a sign binds looser than the power to its right, so
    /// `-x^2` is −(x²) and `2^-1` is ½.
    fn factor(&mut self) -> Result<String, ExpressionError> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(ExpressionError::TooDeep { deepest: DEEPEST });
        }
        let written = if self.take('-') {
            format!("(-{})", self.factor()?)
        } else if self.take('+') {
            self.factor()?
        } else {
            let base = self.atom()?;
            if self.take('^') {
                // From the right: 2^3^2 is 2^(3^2).
                format!("({base}^{})", self.factor()?)
            } else {
                base
            }
        };
        self.depth -= 1;
        Ok(written)
    }

    fn atom(&mut self) -> Result<String, ExpressionError> {
        let Some(first) = self.peek() else {
            return Err(self.unexpected("a number, a name or `(`"));
        };
        let rest = &self.text[self.at..];
        if self.take('(') {
            let inside = self.sum()?;
            self.expect(')')?;
            Ok(inside)
        } else if let Some(number) = leading_number(rest) {
            if !number.parse().is_ok_and(f64::is_finite) {
                return Err(ExpressionError::NumberTooLarge { number: number.into() });
            }
            self.at += number.len();
            Ok(number.to_owned())
        } else if first.is_alphabetic() || first == '_' {
            let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next();
            self.name(name.unwrap_or(rest))
        } else {
            Err(self.unexpected("a number, a name or `(`"))
        }
    }

    /// A variable, π, or a function with its arguments.
    fn name(&mut self, name: &'a str) -> Result<String, ExpressionError> {
        self.at += name.len();
        let called = self.peek() == Some('(');
        let arity = match name {
            _ if UNARY.contains(&name) => 1,
            _ if BINARY.contains(&name) => 2,
            _ if VARIABLES.contains(&name) || name == PI => 0,
            _ if called => return Err(ExpressionError::unknown_function(name)),
            _ => return Err(ExpressionError::unknown_variable(name)),
        };
        let mut arguments = Vec::new();
        if called && arity > 0 {
            self.take('(');
            arguments.push(self.sum()?);
            while self.take(',') {
                arguments.push(self.sum()?);
            }
            self.expect(')')?;
        } else if called {
            return Err(self.unexpected("an operator (a product is written with `*`)"));
        }
        match (arity, arguments.as_slice()) {
            (0, _) => Ok(name.to_owned()),
            (1, [a]) => Ok(format!("({name}({a}))")),
            (2, [a, b]) => Ok(format!("({a} {name} {b})")),
            _ => Err(ExpressionError::Arguments {
                function: name.into(),
                needed: arity,
                given: arguments.len(),
            }),
        }
    }

    /// The next character that is not a blank; `at` is moved to it.
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        self.at = self.text.len() - rest.trim_start().len();
        self.text[self.at..].chars().next()
    }

    fn take(&mut self, symbol: char) -> bool {
        let found = self.peek() == Some(symbol);
        if found {
            self.at += symbol.len_utf8();
        }
        found
    }

    fn expect(&mut self, symbol: char) -> Result<(), ExpressionError> {
        if self.take(symbol) {
            Ok(())
        } else {
            Err(self.unexpected(if symbol == ')' { "`)`" } else { "`(`" }))
        }
    }

    fn unexpected(&mut self, expected: &'static str) -> ExpressionError {
        let found = self.peek();
        ExpressionError::Syntax {
            found: found.map_or_else(|| "the end".into(), |c| format!("`{c}`")),
            column: self.text[..self.at].chars().count() + 1,
            expected,
        }
    }
}
