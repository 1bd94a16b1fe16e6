//! Building the atlas: a chart for each sheet in each cell of the search tree.
//!
//! A cell's points are split by sheet, and each sheet gets a chart with a suitable scale and degree
//! (`scale`). Points are put between rows that lie far apart (`rows`), charts that continue each
//! other are linked (`links`), and charts that agree with none are dropped. The draft then becomes
//! an atlas with its rims, trusts and owners of points.

use rayon::slice::ParallelSliceMut;

use crate::cloud::Cloud;
use crate::error::Error;
use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::atlas::chart::Chart;
use crate::surface::atlas::links::{Link, median};
use crate::surface::atlas::polynomial::Monomials;
use crate::surface::atlas::rim::Rim;
use crate::surface::atlas::scale::{Gains, NOISY};
use crate::surface::atlas::sheets::Workspace;
use crate::surface::atlas::{Atlas, Lists, UNEVEN_ERRORS, links, rows, scale, smooth, trust};
use crate::{Vector, parallel};

/// A chart with the points that it was fitted to and the points of its cell, as tree indices.
#[derive(Clone)]
pub(super) struct Built<const D: usize> {
    pub chart: Chart<D>,
    pub members: Vec<u32>,
    pub own: Vec<u32>,
}

impl<const D: usize> Built<D> {
    /// Makes the chart take part in the blend well beyond the points of its cell.
    pub fn new(tree: &Tree<D>, mut chart: Chart<D>, members: Vec<u32>, own: Vec<u32>) -> Self {
        let extent = own
            .iter()
            .map(|i| (tree.points[*i as usize] - chart.origin).norm())
            .fold(2.0 * chart.spacing, f64::max);
        chart.radius = chart.radius.max(SUPPORT_MARGIN * extent);
        Self {
            chart,
            members,
            own,
        }
    }
}

/// Charts, and which of them continue each other, before they are put together.
pub(super) struct Draft<const D: usize> {
    pub cloud: Cloud<D>,
    /// A tree of the cloud's points and of those put between rows of them.
    pub tree: Tree<D>,
    pub monomials: Monomials,
    pub built: Vec<Built<D>>,
    /// For each chart, the charts that continue it.
    pub linked: Vec<Vec<Link>>,
}

/// Length that one element of a path may span where charts are noisy, in radii of charts.
const DETAIL_RADII: f64 = 2.0;
/// Most points of a cell of a grid that are looked at together.
const MOST_POINTS: usize = 512;
/// Most turns in which charts that agree with none are dropped: where some are gone, others may be
/// left alone.
const MOST_TURNS: usize = 3;
/// Number of points near a point without a chart; those that have a chart say which chart it goes
/// to.
const ADOPTERS: usize = 32;
/// Factor by which a chart's support reaches farther than its own points.
const SUPPORT_MARGIN: f64 = 1.25;

impl<const D: usize> Atlas<D> {
    /// Makes a smooth surface of dimension `intrinsic_dimension` through the points. Its cells are
    /// the leaves of the search tree, with 8 to 16 points each, or up to four leaves where one
    /// polynomial follows their points.
    ///
    /// # Errors
    /// [`Error::TooFewPoints`] or [`Error::NoTangentPlane`] where the points carry no such surface.
    ///
    /// O(n log n) time, O(n) memory.
    pub fn new(cloud: Cloud<D>, intrinsic_dimension: usize) -> Result<Self, Error> {
        Ok(Draft::of_leaves(cloud, intrinsic_dimension)?.finish())
    }

    /// Makes the surface that [`new`](Self::new) makes, but on the cells of a grid of the given
    /// intervals, in the input's units, as in Algorithm 2 of the paper. A corner of the grid lies
    /// at the cloud's centre. Each sheet in a cell gets at least one chart.
    ///
    /// # Errors
    /// [`Error::BadInterval`] for an interval that is not a positive number, and the errors of
    /// `new`.
    pub fn with_cells(
        cloud: Cloud<D>,
        intrinsic_dimension: usize,
        intervals: &[f64; D],
    ) -> Result<Self, Error> {
        if let Some(found) = intervals.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
            return Err(Error::BadInterval { found: *found });
        }
        let draft = Draft::new(cloud, intrinsic_dimension, false, |tree| {
            grid(tree, intervals)
        })?;
        Ok(draft.finish())
    }
}

impl<const D: usize> Draft<D> {
    /// Makes a draft on the leaves of the search tree.
    pub fn of_leaves(cloud: Cloud<D>, intrinsic_dimension: usize) -> Result<Self, Error> {
        Self::new(cloud, intrinsic_dimension, true, |tree| {
            let leaves = tree.leaves().into_iter();
            leaves
                .map(|leaf| leaf.map(|i| i as u32).collect())
                .collect()
        })
    }

    /// Makes a draft on cells. Successive cells may share a chart if `may_join`, which they may
    /// where they are leaves of the tree.
    fn new(
        cloud: Cloud<D>,
        intrinsic_dimension: usize,
        may_join: bool,
        cells: impl Fn(&Tree<D>) -> Vec<Vec<u32>>,
    ) -> Result<Self, Error> {
        let monomials = Monomials::new(intrinsic_dimension);
        let needed = intrinsic_dimension + 2;
        if cloud.points.len() < needed {
            return Err(Error::TooFewPoints {
                found: cloud.points.len(),
                needed,
            });
        }
        let charted = |tree: &Tree<D>| -> Vec<Built<D>> {
            let cells = cells(tree);
            let gains = scale::gains(tree, &monomials, &cells);
            let together = if may_join {
                smooth::leaves_a_chart(tree, &monomials, &cells)
            } else {
                1
            };
            let groups: Vec<&[Vec<u32>]> = cells.chunks(together).collect();
            let built = parallel::map_with(groups.len(), Workspace::default, |workspace, i| {
                subtree(tree, &monomials, gains, groups[i], workspace)
            });
            built.into_iter().flatten().collect()
        };
        let mut tree = Tree::new(&cloud.points);
        let mut built = charted(&tree);
        let added = rows::between(&tree, &unresolved(&built, tree.points.len()));
        // Charts are made anew with the points that were put between rows, if there are any.
        if !added.is_empty() {
            tree = Tree::new(&[cloud.points.as_slice(), &added].concat());
            built = charted(&tree);
        }
        if built.is_empty() {
            return Err(Error::NoTangentPlane {
                dimension: intrinsic_dimension,
            });
        }
        let mut owners = owners(&built, tree.points.len());
        let mut linked = links::links(&built, &owners, &monomials, &tree);
        // Where charts are dropped, others may no longer agree with any.
        let mut turns = 0;
        while turns < MOST_TURNS && links::drop_stray(&mut built, &linked, &owners) {
            owners = self::owners(&built, tree.points.len());
            linked = links::links(&built, &owners, &monomials, &tree);
            turns += 1;
        }
        Ok(Draft {
            cloud,
            tree,
            monomials,
            built,
            linked,
        })
    }
}

impl<const D: usize> Draft<D> {
    /// The atlas of these charts.
    fn finish(self) -> Atlas<D> {
        let (neighbours, sides) = self.neighbours();
        let rim = Rim::new(&self, &neighbours);
        self.with_rim(neighbours, sides, rim)
    }

    /// For each chart, the charts that may overlap its cell, and on which side their normals are.
    pub fn neighbours(&self) -> (Lists, Vec<i8>) {
        let lists = links::neighbours(&self.built, &self.linked, &self.tree);
        let neighbours = Lists::new(lists.iter().map(|list| list.iter().map(|link| link.0)));
        let sides = lists.iter().flatten().map(|link| link.1);
        (neighbours, sides.collect())
    }

    /// The atlas of these charts with their neighbours and rim.
    pub fn with_rim(self, neighbours: Lists, sides: Vec<i8>, rim: Rim<D>) -> Atlas<D> {
        let mut owner_in_tree = owners(&self.built, self.tree.points.len());
        let mut charts: Vec<Chart<D>> = self.built.into_iter().map(|b| b.chart).collect();
        trust::judge(&mut charts, &neighbours);
        let (cloud, tree) = (self.cloud, self.tree);
        let given = owner_in_tree.iter().zip(&tree.order);
        let given = given.filter(|(_, index)| (**index as usize) < cloud.points.len());
        let outliers = given.filter(|(owner, _)| **owner == u32::MAX).count();
        adopt(&tree, &self.monomials, &mut owner_in_tree, &charts);
        let mut owners = vec![0; tree.points.len()];
        for (owner, index) in owner_in_tree.iter().zip(&tree.order) {
            owners[*index as usize] = *owner;
        }
        Atlas {
            detail: detail(&charts),
            uneven: uneven(&charts),
            roughness: roughness(&charts),
            cloud,
            charts,
            owners,
            neighbours,
            sides,
            monomials: self.monomials,
            rim,
            outliers,
            has_points: true,
            supports: None,
            tree,
        }
    }
}

/// The wavelength of the finest detail of the surface that charts make; see
/// [`Surface::detail`](crate::surface::Surface::detail).
pub(super) fn detail<const D: usize>(charts: &[Chart<D>]) -> f64 {
    if roughness(charts) > NOISY {
        DETAIL_RADII * median(charts.iter().map(|c| c.radius))
    } else {
        0.0
    }
}

/// The usual residual of charts, in spacings.
pub(super) fn roughness<const D: usize>(charts: &[Chart<D>]) -> f64 {
    median(charts.iter().map(|c| c.residual / c.spacing))
}

/// Whether the heights of some charts err by far more than those of others.
pub(super) fn uneven<const D: usize>(charts: &[Chart<D>]) -> bool {
    let usual = median(charts.iter().map(|c| c.height_error));
    charts
        .iter()
        .any(|c| c.height_error > UNEVEN_ERRORS * usual)
}

/// The tree's points by the cell of a grid that holds them; cells of very many points come in
/// pieces.
fn grid<const D: usize>(tree: &Tree<D>, intervals: &[f64; D]) -> Vec<Vec<u32>> {
    let cell = |i: u32| -> [f64; D] {
        let point = &tree.points[i as usize];
        std::array::from_fn(|axis| (point[axis] / intervals[axis]).floor())
    };
    let order = |a: &[f64; D], b: &[f64; D]| {
        let axes = a.iter().zip(b).map(|(a, b)| a.total_cmp(b));
        axes.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
    };
    let mut placed: Vec<([f64; D], u32)> = (0..tree.points.len() as u32)
        .map(|i| (cell(i), i))
        .collect();
    placed.par_sort_unstable_by(|a, b| order(&a.0, &b.0).then(a.1.cmp(&b.1)));
    placed
        .chunk_by(|a, b| order(&a.0, &b.0).is_eq())
        .flat_map(|cell| cell.chunks(MOST_POINTS))
        .map(|piece| piece.iter().map(|(_, i)| *i).collect())
        .collect()
}

/// The charts of some leaves: a single one where the surface is smooth, and else those of either
/// half.
fn subtree<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    gains: Gains,
    leaves: &[Vec<u32>],
    workspace: &mut Workspace<D>,
) -> Vec<Built<D>> {
    if let [leaf] = leaves {
        return cell(tree, monomials, gains, leaf.clone(), workspace);
    }
    if let Some(built) = smooth::large(tree, monomials, leaves, workspace) {
        return vec![built];
    }
    let (low, high) = leaves.split_at(leaves.len() / 2);
    let mut built = subtree(tree, monomials, gains, low, workspace);
    built.extend(subtree(tree, monomials, gains, high, workspace));
    built
}

/// The charts of one cell: one for each sheet, seeded from the points that are not yet covered.
fn cell<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    gains: Gains,
    mut left: Vec<u32>,
    workspace: &mut Workspace<D>,
) -> Vec<Built<D>> {
    let mut built = Vec::new();
    while !left.is_empty() {
        let Some(seed) = scale::seed(tree, &left) else {
            break;
        };
        let fitted = scale::fit(tree, monomials, gains, seed, workspace);
        let Some((mut chart, members)) = fitted.filter(|(_, members)| members.contains(&seed))
        else {
            // The point is an outlier, or there is no surface here; a chart adopts it later.
            left.retain(|i| *i != seed);
            continue;
        };
        let steep = scale::steep_distance(tree, monomials, &chart, &members);
        let away = |i: &u32| (tree.points[*i as usize] - chart.origin).norm();
        let (own, rest): (Vec<u32>, Vec<u32>) = left.iter().partition(|i| {
            **i == seed || (members.contains(i) && SUPPORT_MARGIN * away(i) <= steep)
        });
        left = rest;
        chart.radius = chart.radius.min(steep);
        built.push(Built::new(tree, chart, members, own));
    }
    built
}

/// The points in no chart, or in a chart that does not fit them well, as ascending tree indices.
fn unresolved<const D: usize>(built: &[Built<D>], count: usize) -> Vec<u32> {
    let clean = built.iter().filter(|b| b.chart.clean());
    let mut left = vec![true; count];
    for point in clean.flat_map(|b| &b.own) {
        left[*point as usize] = false;
    }
    (0..count as u32).filter(|i| left[*i as usize]).collect()
}

/// The chart of each point, by tree index; `u32::MAX` for points of no chart.
fn owners<const D: usize>(built: &[Built<D>], count: usize) -> Vec<u32> {
    let mut owners = vec![u32::MAX; count];
    for (i, b) in built.iter().enumerate() {
        for point in &b.own {
            owners[*point as usize] = i as u32;
        }
    }
    owners
}

/// Gives points that no chart fitted to the chart of a near point whose surface passes nearest to
/// them, because the nearest point may lie on another sheet.
fn adopt<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    owners: &mut [u32],
    charts: &[Chart<D>],
) {
    let orphans: Vec<usize> = (0..owners.len())
        .filter(|i| owners[*i] == u32::MAX)
        .collect();
    let m = D - monomials.variables;
    let mut found: Vec<Neighbour> = Vec::new();
    let miss = |point: &Vector<D>, owner: u32| {
        let mut offsets = [0.0; D];
        charts[owner as usize].offsets(monomials, point, &mut offsets);
        offsets[..m].iter().map(|v| v * v).sum::<f64>()
    };
    let nearest = |point: &Vector<D>, near: &mut dyn Iterator<Item = u32>| {
        let owned = near.filter(|owner| *owner != u32::MAX);
        owned.min_by(|a, b| miss(point, *a).total_cmp(&miss(point, *b)))
    };
    // Where whole regions have no charts, only the points that have one are searched.
    let mut charted: Option<(Tree<D>, Vec<u32>)> = None;
    let mut adopted: Vec<u32> = Vec::with_capacity(orphans.len());
    for orphan in &orphans {
        let point = &tree.points[*orphan];
        tree.nearest(point, ADOPTERS, &mut found);
        let near = found.iter().map(|n| owners[n.index as usize]);
        let owner = nearest(point, &mut near.into_iter()).or_else(|| {
            let (tree, of) = charted.get_or_insert_with(|| owned(tree, owners));
            tree.nearest(point, ADOPTERS, &mut found);
            let near = found
                .iter()
                .map(|n| of[tree.order[n.index as usize] as usize]);
            nearest(point, &mut near.into_iter())
        });
        adopted.push(owner.unwrap_or(0));
    }
    for (orphan, owner) in orphans.into_iter().zip(adopted) {
        owners[orphan] = owner;
    }
}

/// A tree of the points that have a chart, and the chart of each.
fn owned<const D: usize>(tree: &Tree<D>, owners: &[u32]) -> (Tree<D>, Vec<u32>) {
    let owned = tree.points.iter().zip(owners);
    let owned = owned.filter(|(_, owner)| **owner != u32::MAX);
    let (points, of): (Vec<_>, Vec<_>) = owned.map(|(point, owner)| (*point, *owner)).unzip();
    (Tree::new(&points), of)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A roll of seven turns on a jittered grid of step 0.02, with layers `gap` apart, and the
    /// angle of each point.
    fn roll(gap: f64, turns: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let mut state = seed;
        let mut jitter = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            0.02 * (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let growth = gap / std::f64::consts::TAU;
        let (mut coordinates, mut angles) = (Vec::new(), Vec::new());
        let mut start = 0.0;
        while start < turns * std::f64::consts::TAU {
            for j in 0..50 {
                let angle = start + jitter() / (0.3 + growth * start);
                let radius = 0.3 + growth * angle;
                coordinates.extend([
                    radius * angle.cos(),
                    radius * angle.sin(),
                    0.02 * f64::from(j) + jitter(),
                ]);
                angles.push(angle);
            }
            start += 0.02 / (0.3 + growth * start);
        }
        (coordinates, angles)
    }

    /// How many neighbouring charts lie on different layers, and on how many components the charts
    /// are.
    fn joined(gap: f64, turns: f64, seed: u64) -> (usize, usize) {
        let (coordinates, angles) = roll(gap, turns, seed);
        let cloud = Cloud::<3>::new(&coordinates, 3).expect("finite");
        let atlas = Atlas::new(cloud, 2).expect("a surface");
        let mut angle = vec![f64::NAN; atlas.charts.len()];
        for (owner, a) in atlas.owners.iter().zip(&angles) {
            angle[*owner as usize] = *a;
        }
        let mut wrong = 0;
        for (i, a) in angle.iter().enumerate() {
            let others = atlas.neighbours.of(i as u32).iter();
            wrong += others
                .filter(|j| (angle[**j as usize] - a).abs() > 2.0)
                .count();
        }
        let geodesics = crate::geodesics::Geodesics::of_atlas(atlas);
        (wrong, geodesics.component_sizes().len())
    }

    #[test]
    fn layers_two_nearest_distances_apart_stay_apart() {
        // The median distance to the nearest point of such a grid is 0.01526.
        for gap in [4.3, 3.0, 2.0] {
            assert_eq!(joined(gap * 0.01526, 7.0, 1), (0, 1), "gap {gap}");
        }
    }

    #[test]
    fn layers_stay_apart_where_chance_brings_many_points_of_two_together() {
        // These are seeds of grids in which charts of two layers agree at a quarter of the points
        // that they share.
        for seed in [5, 15, 20] {
            assert_eq!(joined(2.0 * 0.01526, 3.0, seed), (0, 1), "seed {seed}");
        }
    }

    #[test]
    fn a_grid_of_cells_holds_every_point_once_and_serves_as_well() {
        let (coordinates, _) = roll(0.1, 7.0, 1);
        let cloud = || Cloud::<3>::new(&coordinates, 3).expect("finite");
        let tree = Tree::new(&cloud().points);
        let cells = grid(&tree, &[0.1, 0.1, 0.2]);
        let mut points: Vec<u32> = cells.iter().flatten().copied().collect();
        points.sort_unstable();
        assert!(points.iter().copied().eq(0..tree.points.len() as u32));
        for cell in &cells {
            let at = |i: &u32| tree.points[*i as usize][2].div_euclid(0.2);
            assert!(cell.iter().all(|i| at(i) == at(&cell[0])));
        }
        let atlas = Atlas::with_cells(cloud(), 2, &[0.1, 0.1, 0.2]).expect("a surface");
        assert_eq!(
            crate::geodesics::Geodesics::of_atlas(atlas)
                .component_sizes()
                .len(),
            1
        );
        let refused = Atlas::with_cells(cloud(), 2, &[0.1, -1.0, 0.2]).err();
        assert_eq!(refused, Some(Error::BadInterval { found: -1.0 }));
    }
}
