//! The one error of the crate (floor 0).
//!
//! Every public function that can fail returns [`Result`]. The bindings turn [`Error`] into Python's `ValueError`
//! with the same sentence, and [`Error::Interrupted`] into whatever exception the signal handler raised.

use std::fmt;

/// What can go wrong in the core.
#[derive(Debug, Clone, PartialEq)]
pub enum Error {
    /// A number outside its range.
    Range {
        /// Name of the argument.
        name: &'static str,
        /// The value that came.
        got: f64,
        /// Lowest value allowed.
        low: f64,
        /// Highest value allowed.
        high: f64,
        /// Unit, `"1"` for a dimensionless number.
        unit: &'static str,
    },
    /// An array of the wrong shape.
    Shape {
        /// Name of the argument.
        name: &'static str,
        /// The shape that is allowed.
        expected: String,
        /// The shape that came.
        got: String,
    },
    /// An array or a selection without elements.
    Empty {
        /// Name of the argument.
        name: &'static str,
    },
    /// Data that cannot be used, and why.
    Data {
        /// Name of the argument.
        name: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// The work was cancelled through its [`Job`](crate::job::Job).
    Interrupted,
}

/// Result of the crate.
pub type Result<T> = std::result::Result<T, Error>;

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Range { name, got, low, high, unit } => {
                write!(f, "{name} must be in [{low}, {high}] [{unit}], got {got}")
            }
            Self::Shape { name, expected, got } => write!(f, "{name} must have shape {expected}, got {got}"),
            Self::Empty { name } => write!(f, "{name} is empty"),
            Self::Data { name, reason } => write!(f, "{name}: {reason}"),
            Self::Interrupted => f.write_str("interrupted"),
        }
    }
}

impl std::error::Error for Error {}

/// Check that `got` lies in `[low, high]`; NaN does not.
pub fn in_range(name: &'static str, got: f64, low: f64, high: f64, unit: &'static str) -> Result<()> {
    if got >= low && got <= high { Ok(()) } else { Err(Error::Range { name, got, low, high, unit }) }
}
