//! A matrix in an NPY file that is filled by parts.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

use super::npy::header;

/// A matrix of float64 in a file, zero where nothing was written yet.
#[derive(Debug)]
pub struct MatrixFile {
    file: File,
    header: Vec<u8>,
    shape: [usize; 2],
}

impl MatrixFile {
    /// Makes a file of rows x columns zeros, which take no place on most file systems.
    ///
    /// # Errors
    /// The error of the operating system, also for a matrix larger than any file.
    pub fn create(path: &Path, shape: [usize; 2]) -> io::Result<Self> {
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(true)
            .open(path)?;
        let matrix = Self {
            file,
            header: Self::header(shape),
            shape,
        };
        let length = matrix.length()?;
        (&matrix.file).write_all(&matrix.header)?;
        matrix.file.set_len(length)?;
        Ok(matrix)
    }

    /// Opens a file that [`create`](Self::create) made of this shape.
    ///
    /// # Errors
    /// The error of the operating system, and one where the file has another shape or length.
    pub fn open(path: &Path, shape: [usize; 2]) -> io::Result<Self> {
        let file = File::options().read(true).write(true).open(path)?;
        let matrix = Self {
            file,
            header: Self::header(shape),
            shape,
        };
        let mut found = vec![0; matrix.header.len()];
        let as_made = matrix.file.metadata()?.len() == matrix.length()?
            && (&matrix.file).read_exact(&mut found).is_ok()
            && found == matrix.header;
        if as_made {
            Ok(matrix)
        } else {
            let [rows, columns] = shape;
            let text = format!("not a file of {rows} x {columns} numbers");
            Err(io::Error::new(io::ErrorKind::InvalidData, text))
        }
    }

    fn header([rows, columns]: [usize; 2]) -> Vec<u8> {
        header("<f8", &format!("({rows}, {columns})"))
    }

    fn length(&self) -> io::Result<u64> {
        let [rows, columns] = self.shape.map(|size| size as u64);
        let bytes = rows
            .checked_mul(columns)
            .and_then(|count| count.checked_mul(8));
        bytes
            .and_then(|bytes| bytes.checked_add(self.header.len() as u64))
            .ok_or_else(|| io::ErrorKind::FileTooLarge.into())
    }

    /// Writes numbers of a row from a column on.
    ///
    /// # Errors
    /// The error of the operating system.
    ///
    /// # Panics
    /// Where they reach beyond the row or the row beyond the matrix.
    pub fn write(&mut self, row: usize, column: usize, values: &[f64]) -> io::Result<()> {
        self.seek(row, column, values.len())?;
        let bytes: Vec<u8> = values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        self.file.write_all(&bytes)
    }

    /// Reads numbers of a row from a column on.
    ///
    /// # Errors
    /// The error of the operating system.
    ///
    /// # Panics
    /// Where they reach beyond the row or the row beyond the matrix.
    pub fn read(&mut self, row: usize, column: usize, count: usize) -> io::Result<Vec<f64>> {
        self.seek(row, column, count)?;
        let mut bytes = vec![0; 8 * count];
        self.file.read_exact(&mut bytes)?;
        let (numbers, _) = bytes.as_chunks::<8>();
        Ok(numbers
            .iter()
            .map(|bytes| f64::from_le_bytes(*bytes))
            .collect())
    }

    fn seek(&mut self, row: usize, column: usize, count: usize) -> io::Result<()> {
        let [rows, columns] = self.shape;
        assert!(row < rows && column + count <= columns, "inside the matrix");
        let place = self.header.len() + 8 * (row * columns + column);
        self.file.seek(SeekFrom::Start(place as u64))?;
        Ok(())
    }

    /// Waits until what was written is on the disk.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }
}
