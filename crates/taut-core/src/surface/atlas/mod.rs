//! The atlas: a point cloud as a smooth implicit surface.
//!
//! Cells of the search tree are split by sheet, and each part gets a *chart*, a polynomial height
//! over its tangent plane. The charts are blended into F(x) = sum_c phi_c(x) s_c f_c(x) / sum_c
//! phi_c(x), phi_c = (1 - r^2/R_c^2)^4, whose zeros are the surface. Charts blend only along the
//! graph of charts that share points, so sheets that merely come close stay apart. A rim is a part
//! of the boundary of the surface, where the data ends.

pub(crate) mod build;
pub(crate) mod chart;
mod checks;
mod cover;
pub mod doubts;
pub(crate) mod fit;
mod fitted;
mod implicit;
mod jet;
mod lattice;
mod links;
mod model;
mod orient;
pub(crate) mod polynomial;
pub mod report;
pub(crate) mod rim;
mod rows;
mod scale;
pub(crate) mod sheets;
mod smooth;
mod supports;
mod trust;

pub use fitted::{Fit, FitSettings};
pub use implicit::Level;
pub use model::{Header, Model, ModelChart, RimDisc};

use crate::cloud::Cloud;
use crate::error::Error;
use crate::geodesics::Geodesics;
use crate::guess::Guide;
use crate::guess::graph::Graph;
use crate::surface::level_set::{self, LevelSet};
use crate::surface::{Geometry, Node, Surface};
use crate::{Vector, parallel};
use chart::Chart;
use jet::Jet;
use polynomial::Monomials;
use rim::Rim;
use supports::Supports;

/// A chart's index, which tells where on an atlas a node lies.
pub type ChartIndex = u32;

/// How far a first guess may lie beyond a rim that it cuts across, in spacings.
pub(crate) const CROSSING: f64 = 0.75;
/// Largest distance of a foot on a model, in distances of the nearest chart.
const FARTHER: f64 = 1.5;
/// Distance that is added to [`FARTHER`] distances of the nearest chart, in residuals of that
/// chart.
const FARTHER_RESIDUALS: f64 = 5.0;
/// Slack of feet on a single chart, in radii.
const FOOT_SLACK: f64 = 1e-6;
/// Error of the worst chart, in median errors of the charts, above which errors are looked at
/// everywhere along paths.
pub(crate) const UNEVEN_ERRORS: f64 = 20.0;
/// Most places between two nodes at which errors are looked at along a path.
const MOST_PIECES: f64 = 64.0;
/// Longest step across the ripples of a chart that does not stand alone, in its radii.
const RIPPLES: f64 = 0.5;
/// Number of charts that are looked at together for those that overlap a point.
const CHARTS_TOGETHER: usize = 32;

/// A smooth surface through a point cloud.
pub struct Atlas<const D: usize> {
    pub(crate) cloud: Cloud<D>,
    pub(crate) charts: Vec<Chart<D>>,
    /// The chart of each point of the cloud, and then of each point put between rows.
    pub(crate) owners: Vec<u32>,
    /// For each chart, the charts that may overlap its cell: itself first, then the others by
    /// distance.
    pub(crate) neighbours: Lists,
    /// For each item of `neighbours`, 1 where the chart's normal points to the same side as that of
    /// the list's first chart, -1 where it does not. It means nothing for several normals.
    sides: Vec<i8>,
    pub(crate) monomials: Monomials,
    pub(crate) rim: Rim<D>,
    /// The number of points that no chart fitted.
    outliers: usize,
    /// Whether some charts err by far more than others.
    uneven: bool,
    /// The usual residual of charts, in spacings.
    roughness: f64,
    /// The wavelength of the finest detail, in the input's units, or 0; see [`Surface::detail`].
    detail: f64,
    /// Whether the cloud's points are those of the input; see [`Atlas::has_points`].
    has_points: bool,
    /// The tree of the charts' supports of a model, whose points do not tell its charts' extent;
    /// `None` for a cloud.
    supports: Option<Supports<D>>,
    /// The tree of the points of the cloud, and then of those put between rows.
    pub(crate) tree: crate::spatial::tree::Tree<D>,
}

/// Lists of indices in one piece of memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lists {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    pub fn new(lists: impl Iterator<Item = impl Iterator<Item = u32>>) -> Self {
        let mut starts = vec![0];
        let mut items = Vec::new();
        for list in lists {
            items.extend(list);
            starts.push(items.len() as u32);
        }
        Self { starts, items }
    }

    /// The items of list i.
    pub fn of(&self, i: u32) -> &[u32] {
        &self.items[self.range(i)]
    }

    /// Where list i lies among the items of all lists.
    pub fn range(&self, i: u32) -> std::ops::Range<usize> {
        self.starts[i as usize] as usize..self.starts[i as usize + 1] as usize
    }

    /// The number of lists.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }
}

impl<const D: usize> Atlas<D> {
    /// The points that the surface was made of.
    #[must_use]
    pub fn cloud(&self) -> &Cloud<D> {
        &self.cloud
    }

    /// Whether the cloud's points are those of the input. The points of a model are its charts'
    /// origins, and its rows mean nothing to a user.
    #[must_use]
    pub fn has_points(&self) -> bool {
        self.has_points
    }

    /// The number of points put between rows of points that lie far apart. The surface that they
    /// make is a guess that no error estimate knows of.
    #[must_use]
    pub fn points_between_rows(&self) -> usize {
        self.tree.points.len() - self.cloud.points.len()
    }

    /// The charts' origins, as nodes all over the surface.
    #[must_use]
    pub fn nodes(&self) -> Vec<Node<D, ChartIndex>> {
        let charts = self.charts.iter().zip(0..);
        let node = |(chart, place): (&Chart<D>, ChartIndex)| Node {
            point: chart.origin,
            place,
        };
        charts.map(node).collect()
    }

    /// The node of an input row, pulled onto the surface.
    ///
    /// # Errors
    /// [`Error::NoSuchPoint`] for rows out of range or dropped, [`Error::NoFoot`] where the
    /// pull-back does not arrive.
    pub fn node_of_row(&self, row: usize) -> Result<Node<D, ChartIndex>, Error> {
        let point = self.cloud.point_of_row.get(row).ok_or(Error::NoSuchPoint {
            row,
            reason: "the cloud has fewer rows",
        })?;
        let point = point.ok_or(Error::NoSuchPoint {
            row,
            reason: self.cloud.why_dropped(),
        })?;
        self.node_of_point(point as usize)
    }

    /// The node of a point of the cloud, pulled onto the surface.
    ///
    /// # Errors
    /// [`Error::NoFoot`] where the pull-back does not arrive.
    pub(crate) fn node_of_point(&self, point: usize) -> Result<Node<D, ChartIndex>, Error> {
        self.pulled_or_refused(&self.cloud.points[point], self.owners[point])
    }

    /// The node nearest to a point given in the input's coordinates.
    ///
    /// # Errors
    /// [`Error::NoFoot`] where the pull-back does not arrive.
    pub fn node_near(&self, x: &Vector<D>) -> Result<Node<D, ChartIndex>, Error> {
        let x = x - self.cloud.centre;
        let (chart, nearest) = self.nearest_chart(&x);
        let node = self.pulled_or_refused(&x, chart);
        if self.supports.is_none() {
            return node;
        }
        // A foot much farther off than the chart passes belongs to another sheet, or to none.
        let close = FARTHER * (nearest - x).norm()
            + FARTHER_RESIDUALS * self.charts[chart as usize].residual;
        if node
            .as_ref()
            .is_ok_and(|node| (node.point - x).norm() <= close)
        {
            return node;
        }
        let other = self.pulled_or_refused(&nearest, chart);
        let gap = |node: &Result<Node<D, ChartIndex>, Error>| {
            let gap = node.as_ref().map(|node| (node.point - x).norm());
            gap.unwrap_or(f64::INFINITY)
        };
        if gap(&other) < gap(&node) {
            other
        } else {
            node
        }
    }

    fn pulled_or_refused(
        &self,
        x: &Vector<D>,
        place: ChartIndex,
    ) -> Result<Node<D, ChartIndex>, Error> {
        let mut scratch = Geometry::new(D - self.monomials.variables);
        let node = self.pulled(x, place, &mut scratch);
        node.ok_or_else(|| Error::NoFoot {
            point: format!("{:?}", (x + self.cloud.centre).as_slice()),
            reason: "it is too far from the points, or the surface is undefined there",
        })
    }

    /// The chart of a point of the cloud.
    pub(crate) fn owner(&self, point: usize) -> ChartIndex {
        self.owners[point]
    }

    /// The charts that may overlap a chart: itself first, then the others by distance.
    pub(crate) fn beside(&self, chart: ChartIndex) -> &[ChartIndex] {
        self.neighbours.of(chart)
    }

    /// A chart's standard error of height, its radius, and how far points lie off it, in the
    /// input's units.
    pub(crate) fn doubt(&self, chart: ChartIndex) -> (f64, f64, f64) {
        let chart = &self.charts[chart as usize];
        (chart.height_error, chart.radius, chart.residual)
    }

    /// Whether the points lie off the surface by more than the surface errs.
    pub(crate) fn is_noisy(&self) -> bool {
        self.detail > 0.0
    }

    /// The foot of `x` seen from a chart. Where the iteration does not arrive from there, it is the
    /// foot seen from the nearest of the chart's neighbours from which it does.
    fn pulled(
        &self,
        x: &Vector<D>,
        place: ChartIndex,
        scratch: &mut Geometry<D>,
    ) -> Option<Node<D, ChartIndex>> {
        self.neighbours.of(place).iter().find_map(|place| {
            let mut place = *place;
            let point = self.foot(x, &mut place, scratch)?;
            Some(Node { point, place })
        })
    }

    /// Whether the straight step between two charts' origins crosses no hole.
    fn within_extent(&self, i: ChartIndex, j: ChartIndex) -> bool {
        let (a, b) = (&self.charts[i as usize], &self.charts[j as usize]);
        [0.25, 0.5, 0.75].iter().all(|t| {
            let x = a.origin + (b.origin - a.origin) * *t;
            let depth = |place| self.beyond_rim(&x, place).map_or(0.0, |d| d.0);
            depth(i).max(depth(j)) <= CROSSING * a.spacing.max(b.spacing)
        })
    }

    /// The mean square of the error of height between two nodes, by the worst chart at each place.
    fn mean_square_error(&self, a: &Node<D, ChartIndex>, b: &Node<D, ChartIndex>) -> f64 {
        let chord = b.point - a.point;
        let step = 0.5 * self.charts[a.place as usize].radius;
        let pieces = (chord.norm() / step).ceil().clamp(1.0, MOST_PIECES) as usize;
        let mut place = a.place;
        let squares = (0..=pieces).map(|i| {
            let x = a.point + chord * (i as f64 / pieces as f64);
            self.locate(&x, &mut place);
            let charts = self.neighbours.of(place).iter();
            let charts = charts.map(|chart| &self.charts[*chart as usize]);
            trust::blend_error(&x, charts, |_| true).powi(2)
        });
        squares.sum::<f64>() / (pieces + 1) as f64
    }

    /// Puts the places in `list` of the charts whose support holds `x` first in `found`; returns
    /// how many there are. The loop has no branch, because which charts these are cannot be
    /// predicted.
    #[inline(always)]
    fn overlapping(
        &self,
        x: &Vector<D>,
        list: &[ChartIndex],
        found: &mut [usize; CHARTS_TOGETHER],
    ) -> usize {
        let mut count = 0;
        for (place, index) in list.iter().enumerate() {
            let chart = &self.charts[*index as usize];
            let squared = (x - chart.origin).norm_squared();
            found[count] = place;
            count += usize::from(squared < chart.radius * chart.radius);
        }
        count
    }

    /// Computes the blend F = sum_c phi_c s_c f_c / sum_c phi_c with its derivatives, of the charts
    /// known at `home`; beyond all supports the home chart alone counts.
    fn blend<const HESSIANS: bool>(&self, x: &Vector<D>, home: ChartIndex, out: &mut Geometry<D>) {
        match out.codimension {
            1 => self.blend_of::<HESSIANS>(1, x, home, out),
            m => self.blend_of::<HESSIANS>(m, x, home, out),
        }
    }

    /// Computes the equations of a chart alone.
    fn single<const HESSIANS: bool>(
        &self,
        x: &Vector<D>,
        place: ChartIndex,
        out: &mut Geometry<D>,
    ) {
        let chart = &self.charts[place as usize];
        let (m, offset) = (out.codimension, x - chart.origin);
        if m == 1 {
            put(
                &chart.equation::<HESSIANS>(&self.monomials, 1, 0, &offset),
                0,
                out,
            );
            return;
        }
        for a in 0..m {
            put(
                &chart.equation::<HESSIANS>(&self.monomials, m, a, &offset),
                a,
                out,
            );
        }
    }

    /// Computes [`blend`](Self::blend) for m equations; it is inlined, so that a known m unrolls
    /// its loops.
    #[inline(always)]
    fn blend_of<const HESSIANS: bool>(
        &self,
        m: usize,
        x: &Vector<D>,
        home: ChartIndex,
        out: &mut Geometry<D>,
    ) {
        let home_chart = &self.charts[home as usize];
        let mut sums = [Jet::<D, HESSIANS>::zero(); D];
        let mut total = Jet::zero();
        let mut found = [0; CHARTS_TOGETHER];
        let lists = self.neighbours.of(home).chunks(CHARTS_TOGETHER);
        let sides = self.sides[self.neighbours.range(home)].chunks(CHARTS_TOGETHER);
        for (list, sides) in lists.zip(sides) {
            let count = self.overlapping(x, list, &mut found);
            for place in &found[..count] {
                let chart = &self.charts[list[*place] as usize];
                let offset = x - chart.origin;
                let weight = Jet::weight(&offset, chart.radius, chart.trust);
                total.add(&weight);
                for b in 0..m {
                    let equation = chart.equation(&self.monomials, m, b, &offset);
                    for a in 0..m {
                        let alignment = if m == 1 {
                            f64::from(sides[*place])
                        } else {
                            home_chart.frame.column(a).dot(&chart.frame.column(b))
                        };
                        sums[a].add_product(alignment, &weight, &equation);
                    }
                }
            }
        }
        for a in 0..m {
            // Beyond all supports there is nothing to blend, and the home chart counts alone.
            let jet = if total.value > 0.0 {
                sums[a].quotient(&total)
            } else {
                home_chart.equation(&self.monomials, m, a, &(x - home_chart.origin))
            };
            put(&jet, a, out);
        }
    }
}

/// Puts an equation's derivatives where those of a surface are looked for.
#[inline(always)]
fn put<const D: usize, const HESSIAN: bool>(
    jet: &Jet<D, HESSIAN>,
    equation: usize,
    out: &mut Geometry<D>,
) {
    out.values[equation] = jet.value;
    out.gradients[equation] = jet.gradient;
    if HESSIAN {
        let hessian = &mut out.hessians[equation];
        for j in 0..D {
            for i in j..D {
                hessian[(i, j)] = jet.hessian[(i, j)];
                hessian[(j, i)] = jet.hessian[(i, j)];
            }
        }
    }
}

impl<const D: usize> LevelSet<D> for Atlas<D> {
    type Place = ChartIndex;

    fn locate(&self, x: &Vector<D>, place: &mut ChartIndex) -> bool {
        loop {
            let home = &self.charts[*place as usize].origin;
            let mut nearest = *place;
            let mut least = (x - home).norm_squared();
            let within = 4.0 * least;
            for index in &self.neighbours.of(*place)[1..] {
                let origin = &self.charts[*index as usize].origin;
                // The charts come nearest first, and those twice as far from home as x are farther
                // from x.
                if (origin - home).norm_squared() > within {
                    break;
                }
                let squared = (x - origin).norm_squared();
                if squared < least {
                    least = squared;
                    nearest = *index;
                }
            }
            if nearest == *place {
                let radius = self.charts[nearest as usize].radius;
                return least <= 4.0 * radius * radius;
            }
            *place = nearest;
        }
    }

    fn gradients(&self, x: &Vector<D>, place: ChartIndex, out: &mut Geometry<D>) {
        self.blend::<false>(x, place, out);
    }

    fn reach(&self, place: ChartIndex) -> f64 {
        self.charts[place as usize].radius
    }
}

/// The charts of an atlas one at a time, without a blend.
struct SingleCharts<'a, const D: usize>(&'a Atlas<D>);

impl<const D: usize> LevelSet<D> for SingleCharts<'_, D> {
    type Place = ChartIndex;

    fn locate(&self, x: &Vector<D>, place: &mut ChartIndex) -> bool {
        self.0.locate(x, place)
    }

    fn gradients(&self, x: &Vector<D>, place: ChartIndex, out: &mut Geometry<D>) {
        self.0.single::<false>(x, place, out);
    }

    fn reach(&self, place: ChartIndex) -> f64 {
        self.0.reach(place)
    }

    fn slack(&self) -> f64 {
        FOOT_SLACK
    }
}

impl<const D: usize> Surface<D> for Atlas<D> {
    type Place = ChartIndex;

    fn intrinsic_dimension(&self) -> usize {
        self.monomials.variables
    }

    fn origin(&self) -> Vector<D> {
        self.cloud.centre
    }

    fn foot(
        &self,
        x: &Vector<D>,
        place: &mut ChartIndex,
        scratch: &mut Geometry<D>,
    ) -> Option<Vector<D>> {
        level_set::foot(self, x, place, scratch)
    }

    fn geometry(&self, x: &Vector<D>, place: ChartIndex, out: &mut Geometry<D>) -> bool {
        self.blend::<true>(x, place, out);
        out.factor()
    }

    fn cheap_geometry(&self, x: &Vector<D>, place: ChartIndex, out: &mut Geometry<D>) -> bool {
        if self.is_noisy() || !self.charts[place as usize].stands_alone {
            return self.geometry(x, place, out);
        }
        self.single::<true>(x, place, out);
        out.factor()
    }

    fn cheap_foot(
        &self,
        x: &Vector<D>,
        place: &mut ChartIndex,
        scratch: &mut Geometry<D>,
    ) -> Option<Vector<D>> {
        if self.is_noisy() {
            return self.foot(x, place, scratch);
        }
        level_set::foot(&SingleCharts(self), x, place, scratch)
    }

    fn has_cheap_view(&self) -> bool {
        !self.is_noisy()
    }

    fn find_place(
        &self,
        x: &Vector<D>,
        place: &mut ChartIndex,
        _scratch: &mut Geometry<D>,
    ) -> bool {
        self.locate(x, place)
    }

    fn beyond_rim(&self, x: &Vector<D>, place: ChartIndex) -> Option<(f64, Vector<D>)> {
        if self.rim.is_empty() {
            return None;
        }
        let mut deepest: Option<(f64, Vector<D>)> = None;
        for chart in self.neighbours.of(place) {
            for found in self.rim.of(*chart).iter().filter_map(|disc| disc.depth(x)) {
                if found.0 > deepest.map_or(0.0, |d| d.0) {
                    deepest = Some(found);
                }
            }
        }
        deepest
    }

    fn has_rims(&self) -> bool {
        !self.rim.is_empty()
    }

    fn rim(&self) -> Vec<(Node<D, ChartIndex>, Vector<D>, f64)> {
        let of_chart = |place: ChartIndex| {
            self.rim.of(place).iter().map(move |disc| {
                let point = disc.touched();
                let spacing = disc.radius / rim::DISC_SPACINGS;
                (Node { point, place }, disc.outward, spacing)
            })
        };
        (0..self.charts.len() as u32).flat_map(of_chart).collect()
    }

    fn detail(&self) -> f64 {
        self.detail
    }

    fn height_error(&self, place: ChartIndex) -> f64 {
        self.charts[place as usize].blend_error
    }

    fn height_error_along(&self, [a, b, c]: [&Node<D, ChartIndex>; 3]) -> f64 {
        if !self.uneven {
            return self.height_error(b.place);
        }
        (0.5 * (self.mean_square_error(a, b) + self.mean_square_error(b, c))).sqrt()
    }

    fn rippled(&self, place: ChartIndex) -> f64 {
        let chart = &self.charts[place as usize];
        if chart.stands_alone {
            f64::INFINITY
        } else {
            RIPPLES * chart.radius
        }
    }

    fn resolution(&self, place: ChartIndex) -> f64 {
        self.charts[place as usize].radius
    }
}

impl<const D: usize> Guide<D> for Atlas<D> {
    fn entrances(&self, node: &Node<D, ChartIndex>, visit: &mut dyn FnMut(u32)) {
        for index in self.neighbours.of(node.place) {
            visit(*index);
        }
    }

    fn atlas(&self) -> Option<&Self> {
        Some(self)
    }
}

impl<const D: usize, S: Guide<D>> Geodesics<D, S> {
    /// The component of an input row's point, where components are numbered by descending number of
    /// charts; `None` for rows out of range or dropped, and on a surface that is no atlas.
    #[must_use]
    pub fn component_of_row(&self, row: usize) -> Option<u32> {
        let atlas = self.surface().atlas()?;
        let point = atlas.cloud.point_of_row.get(row).copied().flatten()?;
        Some(self.components()[atlas.owners[point as usize] as usize])
    }
}

impl<const D: usize> Geodesics<D, Atlas<D>> {
    /// Makes an atlas ready for path queries: its charts are the nodes of Algorithm 2's graph.
    #[must_use]
    pub fn of_atlas(atlas: Atlas<D>) -> Self {
        let nodes = atlas.nodes();
        let lists: Vec<Vec<u32>> = parallel::map(atlas.neighbours.len(), |i| {
            let list = atlas.neighbours.of(i as u32).iter().copied();
            list.filter(|j| atlas.within_extent(i as u32, *j)).collect()
        });
        let graph = Graph::new(nodes, lists.iter().map(Vec::as_slice));
        Self::with_graph(atlas, graph)
    }
}
