//! Floor 6: the only pyo3 code, one file for each Python module. It converts objects, names and units (degrees, a
//! tree's own unit of length) and releases the GIL through `run.rs`; loops over elements and formulas are in the rooms.

mod arrays;
mod astro;
mod camera;
mod clouds;
mod color;
mod fit;
mod house;
mod image;
mod io;
mod paint;
mod plants;
mod run;
mod scene;
mod sky;
mod surfaces;
mod tone;
mod weather;

use pyo3::prelude::*;

/// The compiled core of pleinair. Private: use the Python modules.
#[pymodule(gil_used = false)]
#[pyo3(name = "_core")]
fn core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    // Loads numpy's C API now: loaded lazily, it would panic when Ctrl-C arrives during the first call.
    let _ = numpy::PyArray1::<u8>::zeros(module.py(), 0, false);
    module.add_function(wrap_pyfunction!(house::simd_levels, module)?)?;
    module.add_function(wrap_pyfunction!(house::simd_level, module)?)?;
    module.add_function(wrap_pyfunction!(house::force_simd_level, module)?)?;
    module.add_function(wrap_pyfunction!(house::build_info, module)?)?;
    module.add_function(wrap_pyfunction!(run::get_num_threads, module)?)?;
    module.add_function(wrap_pyfunction!(run::set_num_threads, module)?)?;
    module.add_function(wrap_pyfunction!(run::_spin, module)?)?;
    astro::register(module)?;
    camera::register(module)?;
    color::register(module)?;
    image::register(module)?;
    io::register(module)?;
    clouds::register(module)?;
    fit::register(module)?;
    paint::register(module)?;
    plants::register(module)?;
    surfaces::register(module)?;
    scene::register(module)?;
    sky::register(module)?;
    tone::register(module)?;
    weather::register(module)?;
    Ok(())
}
