//! Ellipsoids of revolution by the series of C. F. F. Karney, "Algorithms for geodesics", J.
//! Geodesy 87 (2013).

use geographiclib_rs::{Geodesic, InverseGeodesic};

/// Ellipsoid of revolution round the z axis, oblate or prolate.
pub struct Spheroid {
    equatorial: f64,
    polar: f64,
    series: Geodesic,
}

impl Spheroid {
    /// Semi-axes across and along the z axis. The series is cut off at order 6 in the flattening f
    /// = 1 - polar / equatorial. Largest difference from shooting over 200 random pairs, relative
    /// to the equatorial semi-axis: 4e-15 for |f| up to 0.02, 7e-13 at 0.05, 1e-10 at 0.1, 2e-8 at
    /// 0.2, 6e-5 at 0.5. Shoot on an [`Ellipsoid`](crate::surface::Ellipsoid) where that is not
    /// enough.
    pub fn new(equatorial: f64, polar: f64) -> Self {
        let series = Geodesic::new(1.0, 1.0 - polar / equatorial);
        Spheroid {
            equatorial,
            polar,
            series,
        }
    }

    /// Shortest distance between two points of the surface.
    pub fn distance(&self, p: &[f64; 3], q: &[f64; 3]) -> f64 {
        let ([lat1, lon1], [lat2, lon2]) = (self.degrees(p), self.degrees(q));
        let length: f64 = self.series.inverse(lat1, lon1, lat2, lon2);
        self.equatorial * length
    }

    /// Geographic latitude and longitude.
    fn degrees(&self, p: &[f64; 3]) -> [f64; 2] {
        let squash = (self.equatorial / self.polar).powi(2);
        let latitude = (p[2] * squash).atan2(p[0].hypot(p[1]));
        [latitude.to_degrees(), p[1].atan2(p[0]).to_degrees()]
    }
}
