//! NPZ: arrays in a ZIP archive, stored as they are. Sparse matrices as SciPy's `save_npz` writes
//! them.

use std::io::{self, Seek, Write};
use std::path::Path;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::atomic;
use super::npy::{header, write_values};
use crate::error::WriteError;

/// A sparse matrix in compressed rows.
#[derive(Debug, Clone, Copy)]
pub struct SparseRows<'a> {
    /// Number of rows and of columns.
    pub shape: [usize; 2],
    /// Where each row begins in `columns` and `values`, and behind the last where it ends: rows + 1
    /// numbers.
    pub starts: &'a [u64],
    /// The column of each value, ascending in every row.
    pub columns: &'a [u64],
    /// The values.
    pub values: &'a [f64],
}

/// Writes a sparse matrix for `scipy.sparse.load_npz`: the arrays `indices`, `indptr`, `format`
/// (`csr`), `shape` and `data`. The same matrix gives the same bytes. The file appears only when it
/// is complete, as with [`write_whole`](crate::write_whole).
///
/// # Errors
/// [`WriteError::Io`] with what the system says.
pub fn write_sparse(path: &Path, matrix: &SparseRows<'_>) -> Result<(), WriteError> {
    atomic::replace(path, |file| write_archive(file, matrix)).map_err(|source| WriteError::Io {
        file: path.to_path_buf(),
        source,
    })
}

fn write_archive(out: impl Write + Seek, matrix: &SparseRows<'_>) -> io::Result<()> {
    let mut archive = ZipWriter::new(out);
    let mut array = |name: &str, header: &[u8], fill: &dyn Fn(&mut dyn Write) -> io::Result<()>| {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(true);
        archive.start_file(format!("{name}.npy"), options)?;
        let mut buffered = io::BufWriter::new(&mut archive);
        buffered.write_all(header)?;
        fill(&mut buffered)?;
        buffered.flush()
    };
    let integers = |out: &mut dyn Write, values: &[u64]| -> io::Result<()> {
        values
            .iter()
            .try_for_each(|value| out.write_all(&value.to_le_bytes()))
    };
    let shape = matrix.shape.map(|size| size as u64);
    let vector = |kind: &str, length: usize| header(kind, &format!("({length},)"));
    array("indices", &vector("<i8", matrix.columns.len()), &|out| {
        integers(out, matrix.columns)
    })?;
    array("indptr", &vector("<i8", matrix.starts.len()), &|out| {
        integers(out, matrix.starts)
    })?;
    array("format", &header("|S3", "()"), &|out| out.write_all(b"csr"))?;
    array("shape", &vector("<i8", 2), &|out| integers(out, &shape))?;
    array("data", &vector("<f8", matrix.values.len()), &|out| {
        write_values(out, matrix.values)
    })?;
    archive.finish()?.flush()
}
