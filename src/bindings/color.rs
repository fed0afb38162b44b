//! `_core`: what `pleinair.color` calls.

use pyo3::prelude::*;

/// Add this file's functions to the module.
pub(crate) fn register(_module: &Bound<'_, PyModule>) -> PyResult<()> {
    Ok(())
}
