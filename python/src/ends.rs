//! Ends of paths and sources of fields: rows or coordinates.

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use taut::End;

/// Rows, or coordinates in a row for each end.
#[derive(FromPyObject)]
pub enum Ends<'py> {
    Rows(PyReadonlyArray1<'py, i64>),
    Points(PyReadonlyArray2<'py, f64>),
}

impl Ends<'_> {
    /// The ends in the library's words.
    pub fn named(&self) -> PyResult<Vec<End>> {
        match self {
            Self::Rows(rows) => {
                let rows = rows.as_slice()?.iter();
                rows.map(|row| {
                    let row = usize::try_from(*row);
                    let row = row.map_err(|_| PyTypeError::new_err("rows count from 0"))?;
                    Ok(End::Row(row))
                })
                .collect()
            }
            Self::Points(points) => {
                let width = points.shape()[1].max(1);
                let values = points.as_slice()?;
                Ok(values.chunks(width).map(End::from).collect())
            }
        }
    }
}
