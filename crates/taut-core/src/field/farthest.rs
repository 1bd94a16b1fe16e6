//! Farthest point sampling: points of a cloud, each the farthest from all points before it (T. F.
//! Gonzalez, "Clustering to minimize the maximum intercluster distance", Theoretical Computer
//! Science 38, 1985; with geodesic distances C. Moenning, N. A. Dodgson, "Fast marching farthest
//! point sampling", 2003).

use crate::error::Error;
use crate::field::{Fields, Settings, Source};
use crate::guess::Guide;
use crate::surface::atlas::ChartIndex;

/// Points of a cloud that are far from each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Farthest {
    /// Indices of the points among [`Cloud::points`](crate::cloud::Cloud::points), in the order in
    /// which they were found.
    pub points: Vec<usize>,
    /// The largest distance of any point of the cloud from the nearest of these points, in the
    /// input's units; infinite where a component of the surface has none of them.
    pub cover: f64,
    /// Largest estimated error of the distances from which the cover was found, in the input's
    /// units.
    pub error: f64,
}

impl<const D: usize, S: Guide<D, Place: From<ChartIndex>>> Fields<'_, D, S> {
    /// Finds `count` points, of which `first` are given. Each of the others is farther from those
    /// before it than any other point of the cloud is; a component of the surface without any comes
    /// first. `done` is told the index of each point that is found.
    ///
    /// # Errors
    /// The same errors as [`from`](Self::from), [`Error::NoCloud`] where the surface is no atlas,
    /// and [`Error::NoSuchPoint`] where a given point is not among the cloud's.
    ///
    /// Each point takes one field, no farther than the cover so far.
    pub fn farthest(
        &self,
        first: &[usize],
        count: usize,
        settings: &Settings,
        done: impl Fn(usize),
    ) -> Result<Farthest, Error> {
        let atlas = self.geodesics.surface().atlas().ok_or(Error::NoCloud)?;
        let rows = &atlas.cloud().rows;
        let mut distances = vec![f64::INFINITY; rows.len()];
        let mut errors = vec![0.0; rows.len()];
        let mut points: Vec<usize> = Vec::new();
        let count = count.min(rows.len());
        let mut given = first.iter().copied();
        while points.len() < count {
            let asked = given.next();
            let (next, cover) = match asked {
                Some(next) if next < rows.len() => (next, f64::INFINITY),
                Some(row) => {
                    let reason = "the cloud has fewer points";
                    return Err(Error::NoSuchPoint { row, reason });
                }
                None => largest(&distances),
            };
            if cover <= 0.0 {
                break;
            }
            let node = atlas.node_of_row(rows[next] as usize);
            // A point without a place on the surface is no source. It is an error only if it was
            // asked for.
            let node = match (node, asked) {
                (Ok(node), _) => node,
                (Err(error), Some(_)) => return Err(error),
                (Err(_), None) => {
                    distances[next] = 0.0;
                    continue;
                }
            };
            let source = Source {
                node: node.into_kind(),
                start: 0.0,
            };
            let settings = Settings {
                max_distance: settings.max_distance.min(cover),
                ..*settings
            };
            let values = self.at_points(&self.from(&[source], &settings)?);
            let held = distances.iter_mut().zip(&mut errors);
            for ((distance, error), value) in held.zip(values) {
                if value.distance < *distance {
                    (*distance, *error) = (value.distance, value.error);
                }
            }
            distances[next] = 0.0;
            points.push(next);
            done(next);
        }
        Ok(Farthest {
            points,
            cover: largest(&distances).1,
            error: largest(&errors).1,
        })
    }
}

/// The first of the largest values, with its index.
fn largest(values: &[f64]) -> (usize, f64) {
    let mut best = (0, f64::NEG_INFINITY);
    for (i, value) in values.iter().enumerate() {
        if *value > best.1 {
            best = (i, *value);
        }
    }
    best
}
