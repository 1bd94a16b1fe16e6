//! The surface, with arrays for answers.

use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use taut::{CloudOptions, Distances, End, Error, FieldOptions, Logarithms, PathOptions};

use crate::ends::Ends;
use crate::run::run;

/// A surface of the library.
#[pyclass(frozen, module = "taut._taut")]
pub struct Surface {
    surface: taut::Surface,
}

/// The error by its name in `taut._errors`, which speaks of an input of the user's.
fn raise(py: Python<'_>, error: &Error) -> PyErr {
    let name = match error {
        Error::NoPlace { .. } => "NoPlaceError",
        Error::NoRows => "NoRowsError",
        Error::Formula(_) | Error::Shape(_) => "FormulaError",
        _ => "BadInputError",
    };
    let made = py
        .import("taut._errors")
        .and_then(|module| module.getattr(name))
        .and_then(|class| class.call1((error.to_string(),)));
    match made {
        Ok(error) => PyErr::from_value(error),
        Err(error) => error,
    }
}

fn path_options(tol: f64, max_nodes: usize, prove_shortest: bool) -> PathOptions {
    PathOptions {
        tolerance: tol,
        most_nodes: max_nodes,
        prove_shortest,
    }
}

fn field_options(tol: f64, max_distance: f64) -> FieldOptions {
    FieldOptions {
        tolerance: tol,
        max_distance,
    }
}

/// Values as rows of an array.
fn rows(py: Python<'_>, values: Vec<f64>, width: usize) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let count = values.len() / width.max(1);
    values.into_pyarray(py).reshape([count, width])
}

/// Indices as an array, -1 for none.
fn indices(py: Python<'_>, values: Vec<Option<u32>>) -> Bound<'_, PyArray1<i64>> {
    let values: Vec<i64> = values
        .into_iter()
        .map(|v| v.map_or(-1, i64::from))
        .collect();
    values.into_pyarray(py)
}

fn path_dict<'py>(py: Python<'py>, path: taut::Path) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("status", path.status.word())?;
    found.set_item("length", path.length)?;
    found.set_item("length_error", path.length_error)?;
    found.set_item("surface_error", path.surface_error)?;
    found.set_item("shortest", path.shortest)?;
    found.set_item("stable", path.stable)?;
    found.set_item("points", rows(py, path.points, path.dimension)?)?;
    found.set_item("arc_length", path.arc_length.into_pyarray(py))?;
    found.set_item("moved", (path.moved[0], path.moved[1]))?;
    found.set_item("doubts", path.doubts)?;
    Ok(found)
}

fn distances_dict<'py>(py: Python<'py>, found: Distances) -> PyResult<Bound<'py, PyDict>> {
    let columns = PyDict::new(py);
    columns.set_item("distance", found.distance.into_pyarray(py))?;
    columns.set_item("error", found.error.into_pyarray(py))?;
    columns.set_item("source", indices(py, found.source))?;
    Ok(columns)
}

fn logarithms_dict<'py>(
    py: Python<'py>,
    found: Logarithms,
    coordinates: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let columns = PyDict::new(py);
    let vectors: Vec<f64> = found.vectors.as_flattened().to_vec();
    columns.set_item("vectors", rows(py, vectors, 2)?)?;
    columns.set_item("error", found.error.into_pyarray(py))?;
    columns.set_item("source", indices(py, found.source))?;
    let sources = found.tangents.len();
    let tangents: Vec<f64> = found.tangents.concat().concat();
    let tangents = tangents
        .into_pyarray(py)
        .reshape([sources, 2, coordinates])?;
    columns.set_item("tangents", tangents)?;
    let points = found.transported.len();
    let transported: Vec<f64> = found.transported.into_iter().flatten().flatten().collect();
    let transported = transported
        .into_pyarray(py)
        .reshape([points, 2, coordinates])?;
    columns.set_item("transported", transported)?;
    Ok(columns)
}

#[pymethods]
impl Surface {
    /// Put through points, or fitted to them within an accuracy.
    #[staticmethod]
    #[pyo3(signature = (points, dimension, fitted, accuracy, threads))]
    fn of_points(
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        dimension: Option<usize>,
        fitted: bool,
        accuracy: Option<f64>,
        threads: usize,
    ) -> PyResult<Self> {
        let coordinates = points.shape()[1];
        let values = points.as_slice()?.to_vec();
        let options = CloudOptions { dimension };
        let made = run(py, threads, move || {
            if fitted {
                taut::Surface::fit(&values, coordinates, &options, accuracy)
            } else {
                taut::Surface::from_cloud(&values, coordinates, &options)
            }
        })?;
        Self::made(py, made)
    }

    /// Where all equations hold, within a box if one is given.
    #[staticmethod]
    #[pyo3(signature = (texts, coordinates, bounds, threads))]
    fn of_equations(
        py: Python<'_>,
        texts: Vec<String>,
        coordinates: usize,
        bounds: Option<(Vec<f64>, Vec<f64>)>,
        threads: usize,
    ) -> PyResult<Self> {
        let made = run(py, threads, move || {
            let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
            let bounds = bounds.as_ref();
            let bounds = bounds.map(|(low, high)| [low.as_slice(), high.as_slice()]);
            taut::Surface::from_equations(&texts, coordinates, bounds)
        })?;
        Self::made(py, made)
    }

    /// A shape by its name.
    #[staticmethod]
    #[pyo3(signature = (text, threads))]
    fn of_shape(py: Python<'_>, text: String, threads: usize) -> PyResult<Self> {
        let made = run(py, threads, move || taut::Surface::from_shape(&text))?;
        Self::made(py, made)
    }

    #[getter]
    fn coordinates(&self) -> usize {
        self.surface.coordinates()
    }

    #[getter]
    fn intrinsic_dimension(&self) -> usize {
        self.surface.intrinsic_dimension()
    }

    /// The paths from each of some ends to the one in the same place of a second list.
    #[pyo3(signature = (start, end, tol, max_nodes, prove_shortest, threads))]
    fn paths<'py>(
        &self,
        py: Python<'py>,
        start: Ends<'py>,
        end: Ends<'py>,
        tol: f64,
        max_nodes: usize,
        prove_shortest: bool,
        threads: usize,
    ) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let pairs: Vec<[End; 2]> = std::iter::zip(start.named()?, end.named()?)
            .map(|(from, to)| [from, to])
            .collect();
        let options = path_options(tol, max_nodes, prove_shortest);
        let surface = self.surface.clone();
        let found = run(py, threads, move || surface.paths(&pairs, &options))?;
        found
            .into_iter()
            .map(|path| path_dict(py, path.map_err(|error| raise(py, &error))?))
            .collect()
    }

    /// Lengths from each source to each target, their errors, and how each query ended.
    #[pyo3(signature = (sources, targets, tol, max_nodes, threads))]
    fn matrix<'py>(
        &self,
        py: Python<'py>,
        sources: Ends<'py>,
        targets: Ends<'py>,
        tol: f64,
        max_nodes: usize,
        threads: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (sources, targets) = (sources.named()?, targets.named()?);
        let options = path_options(tol, max_nodes, false);
        let surface = self.surface.clone();
        let found = run(py, threads, move || {
            surface.matrix(&sources, &targets, &options)
        })?;
        let found = found.map_err(|error| raise(py, &error))?;
        let shape = [found.rows, found.columns];
        let entries = PyDict::new(py);
        entries.set_item("length", found.lengths.into_pyarray(py).reshape(shape)?)?;
        entries.set_item("error", found.errors.into_pyarray(py).reshape(shape)?)?;
        let words: Vec<&str> = found.status.iter().map(|status| status.word()).collect();
        entries.set_item("status", words)?;
        Ok(entries)
    }

    /// Distances from the nearest source, at all rows or at some points.
    #[pyo3(signature = (sources, to, tol, max_distance, threads))]
    fn distances<'py>(
        &self,
        py: Python<'py>,
        sources: Ends<'py>,
        to: Option<Ends<'py>>,
        tol: f64,
        max_distance: f64,
        threads: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let options = field_options(tol, max_distance);
        let found = self.of_field(py, (sources, to), options, threads, |field, to| match to {
            Some(points) => Ok(field.at(&points)),
            None => field.at_rows(),
        })?;
        distances_dict(py, found)
    }

    /// Logarithms at the nearest source, of all rows or of some points.
    #[pyo3(signature = (sources, to, tol, max_distance, threads))]
    fn logarithms<'py>(
        &self,
        py: Python<'py>,
        sources: Ends<'py>,
        to: Option<Ends<'py>>,
        tol: f64,
        max_distance: f64,
        threads: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let options = field_options(tol, max_distance);
        let found = self.of_field(py, (sources, to), options, threads, |field, to| match to {
            Some(points) => field.logarithms_at(&points),
            None => field.logarithms_at_rows(),
        })?;
        logarithms_dict(py, found, self.surface.coordinates())
    }

    /// The geodesic that leaves a point along a vector.
    #[pyo3(signature = (start, vector, tol, threads))]
    fn shoot<'py>(
        &self,
        py: Python<'py>,
        start: Ends<'py>,
        vector: Vec<f64>,
        tol: f64,
        threads: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let start = start.named()?.swap_remove(0);
        let surface = self.surface.clone();
        let shot = run(py, threads, move || {
            surface.exp(start, &vector, &field_options(tol, f64::INFINITY))
        })?;
        let shot = shot.map_err(|error| raise(py, &error))?;
        let found = PyDict::new(py);
        found.set_item("points", rows(py, shot.points, shot.dimension)?)?;
        found.set_item("arc_length", shot.arc_length.into_pyarray(py))?;
        found.set_item("complete", shot.complete)?;
        found.set_item("error", shot.error)?;
        Ok(found)
    }

    /// Orthonormal tangents at some points.
    fn tangents<'py>(
        &self,
        py: Python<'py>,
        points: Ends<'py>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let points = points.named()?;
        let surface = self.surface.clone();
        let shape = [
            points.len(),
            surface.intrinsic_dimension(),
            surface.coordinates(),
        ];
        let found = run(py, threads, move || surface.tangents(&points))?;
        found.into_pyarray(py).reshape(shape)
    }

    /// What is known of the surface.
    fn check<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let surface = self.surface.clone();
        let check = run(py, 0, move || surface.check())?;
        let found = PyDict::new(py);
        found.set_item("coordinates", check.coordinates)?;
        found.set_item("intrinsic_dimension", check.intrinsic_dimension)?;
        found.set_item("parts", check.parts)?;
        found.set_item("spacing", check.spacing)?;
        found.set_item("noise", check.noise)?;
        found.set_item("doubts", check.doubts)?;
        Ok(found)
    }
}

impl Surface {
    /// Finds the field of the sources and asks it about the points `to`, or about all rows without
    /// them.
    fn of_field<T: Send + 'static>(
        &self,
        py: Python<'_>,
        (sources, to): (Ends<'_>, Option<Ends<'_>>),
        options: FieldOptions,
        threads: usize,
        ask: impl FnOnce(taut::Field, Option<Vec<End>>) -> Result<T, Error> + Send + 'static,
    ) -> PyResult<T> {
        let sources = sources.named()?;
        let to = to.map(|to| to.named()).transpose()?;
        let surface = self.surface.clone();
        let found = run(py, threads, move || {
            ask(surface.field(&sources, &options)?, to)
        })?;
        found.map_err(|error| raise(py, &error))
    }

    fn made(py: Python<'_>, made: Result<taut::Surface, Error>) -> PyResult<Self> {
        match made {
            Ok(surface) => Ok(Self { surface }),
            Err(error) => Err(raise(py, &error)),
        }
    }
}
