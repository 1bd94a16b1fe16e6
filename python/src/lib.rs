//! The module `taut._taut`: arrays in, arrays out. The Python classes that users see stand on it.

mod ends;
mod run;
mod surface;

use pyo3::prelude::*;

#[pymodule(gil_used = false)]
fn _taut(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<surface::Surface>()
}
