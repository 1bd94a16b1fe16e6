//! Files of JSON values, one on each line: a header first, then rows.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::{Fault, ReadError, WriteError};
use crate::write::write_whole;

/// Writes a header and rows; the file appears only when it is complete. Numbers read back to the
/// same bits.
///
/// # Errors
/// [`WriteError::Io`].
pub fn write_json_lines<H: Serialize, R: Serialize>(
    path: &Path,
    header: &H,
    rows: &[R],
) -> Result<(), WriteError> {
    write_whole(path, |file| {
        serde_json::to_writer(&mut *file, header)?;
        writeln!(file)?;
        for row in rows {
            serde_json::to_writer(&mut *file, row)?;
            writeln!(file)?;
        }
        Ok(())
    })
}

/// Reads what [`write_json_lines`] wrote; empty lines are skipped.
///
/// # Errors
/// [`ReadError`], naming the line that is no header or row; `remedy` says what to do about it.
pub fn read_json_lines<H: DeserializeOwned, R: DeserializeOwned>(
    path: &Path,
    remedy: &str,
) -> Result<(H, Vec<R>), ReadError> {
    read(path, remedy).map_err(|fault| fault.in_file(path))
}

fn read<H: DeserializeOwned, R: DeserializeOwned>(
    path: &Path,
    remedy: &str,
) -> Result<(H, Vec<R>), Fault> {
    let lines = BufReader::new(File::open(path)?).lines();
    let mut header = None;
    let mut rows = Vec::new();
    for (number, line) in (1..).zip(lines) {
        let line = line?;
        if line.trim().is_empty() {
            continue;
        }
        match header {
            None => header = Some(value::<H>(&line, number, remedy)?),
            Some(_) => rows.push(value::<R>(&line, number, remedy)?),
        }
    }
    Ok((header.ok_or(Fault::Empty)?, rows))
}

fn value<T: DeserializeOwned>(line: &str, number: usize, remedy: &str) -> Result<T, Fault> {
    serde_json::from_str(line).map_err(|error| {
        let expected = "a JSON object as docs/formats.md describes it";
        Fault::line(number, error.to_string(), expected, remedy)
    })
}
