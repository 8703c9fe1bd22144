//! What can be wrong with a scene, said to the person who wrote it.

use std::fmt;
use std::path::PathBuf;

use super::grammar;

/// Where in the input something stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The scene file.
    pub path: PathBuf,
    /// Line in the file, from 1; absent when the whole file is meant.
    pub line: Option<usize>,
    /// The `--set` that gave the value, when it did not come from the file.
    pub set: Option<String>,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        match (&self.set, self.line) {
            (Some(set), _) => write!(f, ", --set {set}"),
            (None, Some(line)) => write!(f, ":{line}"),
            (None, None) => Ok(()),
        }
    }
}

/// Why a scene was refused.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file could not be read.
    #[error("{}: the scene cannot be read: {source}", path.display())]
    Read {
        /// The scene file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is not TOML.
    #[error("{place}: not valid TOML: {message}")]
    Syntax {
        /// Where the parser stopped.
        place: Place,
        /// What it found.
        message: String,
    },
    /// A `--set` is not of the form KEY=VALUE.
    #[error("--set {set}: {problem}; write --set KEY=VALUE, for example --set time.step=0.005")]
    Override {
        /// The argument as given.
        set: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A key or boundary that nothing reads.
    #[error("{place}: unknown key {key}{names}")]
    UnknownKey {
        /// Where it stands.
        place: Place,
        /// The key in full.
        key: String,
        /// The keys known at this place.
        names: Box<Names>,
    },
    /// A key that must be there is not.
    #[error("{place}: {key} is required but missing")]
    MissingKey {
        /// The table that lacks it.
        place: Place,
        /// The key in full.
        key: String,
    },
    /// A value is of the wrong type, out of range or in conflict with another.
    #[error("{place}: {key} {problem}")]
    Invalid {
        /// Where the value stands.
        place: Place,
        /// The key in full.
        key: String,
        /// What is wrong and what to write instead, as a predicate of the key.
        problem: String,
    },
    /// A boundary names no physical curve of the mesh.
    #[error("{place}: {key} is no physical curve of the mesh{names}")]
    UnknownCurve {
        /// Where the boundary stands.
        place: Place,
        /// The boundary.
        key: String,
        /// The curves of the mesh.
        names: Box<Names>,
    },
}

/// Why a text is no expression.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExpressionError {
    /// Nothing but blanks.
    #[error("is empty; write a number or an expression in x, y, t")]
    Empty,
    /// A name that is neither a variable nor π.
    #[error("has the unknown variable `{name}`{names}")]
    UnknownVariable {
        /// The name as written.
        name: String,
        /// The known names.
        names: Names,
    },
    /// A call of something that is no function.
    #[error("has the unknown function `{name}`{names}")]
    UnknownFunction {
        /// The name as written.
        name: String,
        /// The known names.
        names: Names,
    },
    /// A function with too few or too many arguments.
    #[error("calls `{function}` with {given} arguments; it takes {needed}, in brackets")]
    Arguments {
        /// The function.
        function: String,
        /// How many it takes.
        needed: usize,
        /// How many it got.
        given: usize,
    },
    /// Something that cannot stand where it stands.
    #[error("has {found} at column {column} of the expression, where {expected} is expected")]
    Syntax {
        /// The character found, or the end.
        found: String,
        /// Its column, from 1.
        column: usize,
        /// What could stand there.
        expected: &'static str,
    },
    /// A number beyond the range of f64.
    #[error("has the number {number}, which is too large")]
    NumberTooLarge {
        /// The number as written.
        number: String,
    },
    /// Brackets, signs or powers nested beyond all use.
    #[error("is nested more than {deepest} deep; simplify it")]
    TooDeep {
        /// The limit.
        deepest: usize,
    },
    /// The evaluator refused what the grammar accepted.
    #[error("cannot be evaluated: {reason}")]
    Refused {
        /// What it said.
        reason: String,
    },
}

impl ExpressionError {
    pub(super) fn unknown_variable(name: &str) -> Self {
        Self::UnknownVariable { name: name.into(), names: known_names(name) }
    }

    pub(super) fn unknown_function(name: &str) -> Self {
        Self::UnknownFunction { name: name.into(), names: known_names(name) }
    }
}

/// What can be named in an expression, by likeness to `name`.
fn known_names(name: &str) -> Names {
    let variables = ["x", "y", "t", grammar::PI];
    let functions = grammar::UNARY.iter().chain(&grammar::BINARY);
    let all = variables.iter().chain(functions);
    Names::like(name, all.map(|n| (*n).to_owned()).collect())
}

/// The names known at some place, and the one that was perhaps meant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Names {
    /// The known name most like the one written, if any is alike at all.
    pub nearest: Option<String>,
    /// All known names.
    pub known: Vec<String>,
}

impl Names {
    /// The `known` names, for someone who wrote `name`.
    pub(super) fn like(name: &str, known: Vec<String>) -> Self {
        let name = name.to_lowercase();
        let alike = |k: &String| strsim::normalized_damerau_levenshtein(&name, &k.to_lowercase());
        let best = known.iter().map(|k| (alike(k), k));
        let best = best.reduce(|a, b| if b.0 > a.0 { b } else { a });
        Self { nearest: best.filter(|b| b.0 >= 0.5).map(|b| b.1.clone()), known }
    }
}

/// The tail of a message: what was perhaps meant, and all that is known.
impl fmt::Display for Names {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(nearest) = &self.nearest {
            write!(f, "; did you mean `{nearest}`?")?;
        }
        match self.known.as_slice() {
            [] => f.write_str(" (there are none)"),
            known => write!(f, " (known: {})", known.join(", ")),
        }
    }
}
