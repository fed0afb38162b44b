//! `_core`: what this build is and which SIMD level it uses.

use pyo3::prelude::*;

use super::run::to_py;
use crate::math::lanes;

/// SIMD levels of this machine, lowest first.
#[pyfunction]
pub(crate) fn simd_levels() -> Vec<&'static str> {
    lanes::available()
}

/// The SIMD level in use.
#[pyfunction]
pub(crate) fn simd_level() -> &'static str {
    lanes::current()
}

/// Use one SIMD level for every later call (`None`: the best).
#[pyfunction]
#[pyo3(signature = (level))]
pub(crate) fn force_simd_level(level: Option<&str>) -> PyResult<()> {
    lanes::force(level).map_err(|e| to_py(&e))
}

/// Version, profile and target of this build.
#[pyfunction]
pub(crate) fn build_info() -> Vec<(&'static str, &'static str)> {
    vec![
        ("version", env!("CARGO_PKG_VERSION")),
        ("profile", if cfg!(debug_assertions) { "debug" } else { "release" }),
        ("target", std::env::consts::ARCH),
        ("os", std::env::consts::OS),
    ]
}
