//! Points as a file holds them.

/// Points as a file holds them, before anything is dropped for being not finite or double.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointSet {
    /// Number of coordinates of a point, at least 2.
    pub dimension: usize,
    /// Row-major, rows x `dimension`, in the file's units; rows that are not finite are kept.
    pub coordinates: Vec<f64>,
    /// Where the file has rows that were left out (class filter, points marked invalid): the file's
    /// row of each row here.
    pub rows_kept: Option<Vec<usize>>,
    /// Surface normals where the file has them, in the shape of `coordinates`.
    pub normals: Option<Vec<f64>>,
    /// The column asked for, one a row.
    pub column: Option<Vec<f64>>,
    /// What the reader left out or assumed, in sentences.
    pub notes: Vec<String>,
}

impl PointSet {
    /// Number of points.
    pub fn rows(&self) -> usize {
        self.coordinates
            .len()
            .checked_div(self.dimension)
            .unwrap_or(0)
    }

    pub(crate) fn three_dimensional(coordinates: Vec<f64>, normals: Option<Vec<f64>>) -> Self {
        Self {
            dimension: 3,
            coordinates,
            normals,
            ..Self::default()
        }
    }

    /// Notes that a file has `count` of `what`, of which the reader takes only the points.
    pub(crate) fn note_ignored(&mut self, count: usize, what: &str) {
        if count > 0 {
            let note = format!("{count} {what} ignored: only the points are read");
            self.notes.push(note);
        }
    }
}
