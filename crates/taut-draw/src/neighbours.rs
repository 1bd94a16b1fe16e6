//! Spacing and normals of a cloud from each point's nearest neighbours.
//!
//! Good enough for pictures: no sheet is told from another. Callers who know the surface pass its
//! normals.

use nalgebra::{Matrix3, SymmetricEigen};
use rayon::prelude::*;

use crate::error::DrawError;
use crate::scene::{is_finite, subtract};

/// Neighbours of which the covariance gives the normal.
const NEIGHBOURS: usize = 12;
/// The disc reaches to this neighbour: on uniform random samples discs of that size leave about
/// one surface point in 500 uncovered.
const COVERING_NEIGHBOUR: usize = 7;
/// Where the points lie on a curve, this neighbour is the next one along it.
const NEXT_ON_CURVE: usize = 2;
/// Neighbours lie on a curve where their second variance is this share of the first or less.
const CURVE: f64 = 0.003;
/// No disc is larger than this many median ones: a point far from all others stays a dot.
const LARGEST_DISC: f64 = 3.0;
/// Subtrees of at most this many points are searched one by one.
const LEAF: usize = 12;
/// Subtrees of more points are built in parallel.
const PARALLEL_BUILD: usize = 1 << 14;

/// One normal and one disc radius for each point, finite or not.
pub(crate) struct LocalShape {
    pub normals: Vec<[f64; 3]>,
    pub radii: Vec<f64>,
}

/// Estimates normals and disc radii.
pub(crate) fn local_shape(points: &[[f64; 3]]) -> Result<LocalShape, DrawError> {
    let tree = Tree::build(points).ok_or(DrawError::Empty {
        points: points.len(),
    })?;
    let found: Vec<(u32, [f64; 3], f64)> = tree
        .sites
        .par_iter()
        .map_init(Vec::new, |nearest, site| {
            tree.nearest(site.position, nearest);
            let normal = normal(&tree, nearest);
            let neighbour = if normal == [0.0; 3] {
                NEXT_ON_CURVE
            } else {
                COVERING_NEIGHBOUR
            };
            let radius = nearest[neighbour.min(nearest.len() - 1)].0.sqrt();
            (site.index, normal, radius)
        })
        .collect();
    let mut shape = LocalShape {
        normals: vec![[0.0; 3]; points.len()],
        radii: vec![1.0; points.len()],
    };
    let cap = LARGEST_DISC * typical_radius(&found, tree.extent);
    let floor = cap * 1e-3;
    for (index, normal, radius) in found {
        shape.normals[index as usize] = normal;
        shape.radii[index as usize] = radius.clamp(floor, cap);
    }
    Ok(shape)
}

/// The median positive radius; a hundredth of the cloud's extent where all points coincide.
fn typical_radius(found: &[(u32, [f64; 3], f64)], extent: f64) -> f64 {
    let mut radii: Vec<f64> = found.iter().map(|f| f.2).filter(|&r| r > 0.0).collect();
    if radii.is_empty() {
        return if extent > 0.0 { extent * 0.01 } else { 1.0 };
    }
    let middle = radii.len() / 2;
    *radii.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Direction of least spread; zero where the neighbours span no plane.
fn normal(tree: &Tree, nearest: &[(f64, u32)]) -> [f64; 3] {
    let positions = || {
        nearest
            .iter()
            .map(|&(_, site)| tree.sites[site as usize].position)
    };
    let count = nearest.len() as f64;
    let mut mean = [0.0; 3];
    for position in positions() {
        for axis in 0..3 {
            mean[axis] += position[axis] / count;
        }
    }
    let scale = nearest.last().map_or(0.0, |last| last.0.sqrt());
    if scale <= 0.0 {
        return [0.0; 3];
    }
    let mut covariance = Matrix3::zeros();
    for position in positions() {
        let offset = nalgebra::Vector3::from(subtract(position, mean)) / scale;
        covariance += offset * offset.transpose();
    }
    let Some(eigen) = SymmetricEigen::try_new(covariance, 1e-9, 64) else {
        return [0.0; 3];
    };
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    if eigen.eigenvalues[order[1]] <= CURVE * eigen.eigenvalues[order[2]] {
        return [0.0; 3];
    }
    eigen.eigenvectors.column(order[0]).into_owned().into()
}

#[derive(Clone, Copy)]
struct Site {
    position: [f64; 3],
    index: u32,
}

/// A balanced k-d tree without nodes: the middle site of a range splits it along the axis in
/// which the range is widest.
struct Tree {
    sites: Vec<Site>,
    axes: Vec<u8>,
    extent: f64,
}

impl Tree {
    /// `None` where no point is finite.
    fn build(points: &[[f64; 3]]) -> Option<Self> {
        let mut sites: Vec<Site> = points
            .iter()
            .zip(0..)
            .filter(|(point, _)| is_finite(**point))
            .map(|(&position, index)| Site { position, index })
            .collect();
        if sites.is_empty() {
            return None;
        }
        let mut axes = vec![0; sites.len()];
        let (_, extent) = widest_axis(&sites);
        split(&mut sites, &mut axes);
        Some(Self {
            sites,
            axes,
            extent,
        })
    }

    /// The nearest sites (the point itself among them) as squared distance and site, near to far.
    fn nearest(&self, query: [f64; 3], nearest: &mut Vec<(f64, u32)>) {
        nearest.clear();
        self.search(0, self.sites.len(), query, nearest);
    }

    fn search(&self, low: usize, high: usize, query: [f64; 3], nearest: &mut Vec<(f64, u32)>) {
        if high - low <= LEAF {
            for site in low..high {
                self.visit(site, query, nearest);
            }
            return;
        }
        let middle = low + (high - low) / 2;
        let axis = usize::from(self.axes[middle]);
        let ahead = query[axis] - self.sites[middle].position[axis];
        let (near, far) = if ahead < 0.0 {
            ((low, middle), (middle + 1, high))
        } else {
            ((middle + 1, high), (low, middle))
        };
        self.search(near.0, near.1, query, nearest);
        self.visit(middle, query, nearest);
        if nearest.len() <= NEIGHBOURS || ahead * ahead < nearest[NEIGHBOURS].0 {
            self.search(far.0, far.1, query, nearest);
        }
    }

    /// Inserts `site` if it is among the nearest so far.
    fn visit(&self, site: usize, query: [f64; 3], nearest: &mut Vec<(f64, u32)>) {
        let offset = subtract(self.sites[site].position, query);
        let distance = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
        if nearest.len() > NEIGHBOURS {
            if distance >= nearest[NEIGHBOURS].0 {
                return;
            }
            nearest.pop();
        }
        let place = nearest.partition_point(|&(other, _)| other <= distance);
        nearest.insert(place, (distance, site as u32));
    }
}

fn split(sites: &mut [Site], axes: &mut [u8]) {
    if sites.len() <= LEAF {
        return;
    }
    let (axis, _) = widest_axis(sites);
    let middle = sites.len() / 2;
    sites.select_nth_unstable_by(middle, |a, b| {
        a.position[axis]
            .total_cmp(&b.position[axis])
            .then(a.index.cmp(&b.index))
    });
    axes[middle] = axis as u8;
    let parallel = sites.len() > PARALLEL_BUILD;
    let (left, right) = sites.split_at_mut(middle);
    let (left_axes, right_axes) = axes.split_at_mut(middle);
    let (right, right_axes) = (&mut right[1..], &mut right_axes[1..]);
    if parallel {
        rayon::join(|| split(left, left_axes), || split(right, right_axes));
    } else {
        split(left, left_axes);
        split(right, right_axes);
    }
}

fn widest_axis(sites: &[Site]) -> (usize, f64) {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for site in sites {
        for axis in 0..3 {
            low[axis] = low[axis].min(site.position[axis]);
            high[axis] = high[axis].max(site.position[axis]);
        }
    }
    let mut widest = 0;
    for axis in 1..3 {
        if high[axis] - low[axis] > high[widest] - low[widest] {
            widest = axis;
        }
    }
    (widest, high[widest] - low[widest])
}
