//! The atlas: a point cloud as a smooth implicit surface.
//!
//! Cells of the search tree are split by sheet; each part gets a *chart*, a polynomial
//! height over its tangent plane, and the charts are blended into F(x) = sum_c phi_c(x) s_c f_c(x) /
//! sum_c phi_c(x), phi_c = (1 - r^2/R_c^2)^4, whose zeros are the surface. Charts blend only along the graph of
//! charts that share points, so sheets that merely come close stay apart.

pub(crate) mod build;
pub(crate) mod chart;
pub(crate) mod fit;
mod links;
pub(crate) mod polynomial;
pub mod report;
pub(crate) mod rim;
mod rows;
mod scale;
pub(crate) mod sheets;

use rayon::prelude::*;

use crate::cloud::Cloud;
use crate::error::Error;
use crate::geodesics::Geodesics;
use crate::guess::Guide;
use crate::guess::graph::Graph;
use crate::surface::level_set::{self, LevelSet};
use crate::surface::{Geometry, Node, Surface};
use crate::{Matrix, Vector};
use chart::{Chart, ChartJet};
use polynomial::Monomials;
use rim::Rim;

/// A chart's index: where on an atlas a node lies.
pub type ChartIndex = u32;

/// A first guess may cut across a rim by this many spacings.
const CROSSING: f64 = 0.75;

/// A smooth surface through a point cloud.
pub struct Atlas<const D: usize> {
    pub(crate) cloud: Cloud<D>,
    pub(crate) charts: Vec<Chart<D>>,
    /// The chart of each point of the cloud, and then of those put between rows of them.
    pub(crate) owners: Vec<u32>,
    /// For each chart, the charts that may overlap its cell, nearest first, itself first.
    pub(crate) neighbours: Lists,
    /// For each of them 1 where its normal points to the same side as the first's, -1 where not; means
    /// nothing for several normals.
    sides: Vec<i8>,
    pub(crate) monomials: Monomials,
    pub(crate) rim: Rim<D>,
    /// Points that no chart fitted.
    outliers: usize,
    /// See [`Surface::detail`].
    detail: f64,
    /// Holds the points of the cloud, and then those put between rows of them.
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

    pub fn of(&self, i: u32) -> &[u32] {
        &self.items[self.range(i)]
    }

    /// Where list i lies among the items of all lists.
    pub fn range(&self, i: u32) -> std::ops::Range<usize> {
        self.starts[i as usize] as usize..self.starts[i as usize + 1] as usize
    }

    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }
}

impl<const D: usize> Atlas<D> {
    /// The points the surface was made of.
    #[must_use]
    pub fn cloud(&self) -> &Cloud<D> {
        &self.cloud
    }

    /// The number of points put between rows of points that lie far apart. What surface these make is a
    /// guess that no error estimate knows of.
    #[must_use]
    pub fn points_between_rows(&self) -> usize {
        self.tree.points.len() - self.cloud.points.len()
    }

    /// The node of an input row, pulled onto the surface.
    ///
    /// # Errors
    /// [`Error::NoSuchPoint`] for rows out of range or dropped, [`Error::NoFoot`] where the pull-back
    /// does not arrive.
    pub fn node_of_row(&self, row: usize) -> Result<Node<D, ChartIndex>, Error> {
        let point = self.cloud.point_of_row.get(row).ok_or(Error::NoSuchPoint {
            row,
            reason: "the cloud has fewer rows",
        })?;
        let point = point.ok_or(Error::NoSuchPoint {
            row,
            reason: "the row was dropped because a value is not finite",
        })?;
        let x = self.cloud.points[point as usize];
        self.pulled(&x, self.owners[point as usize])
    }

    /// The node nearest to a point given in the input's coordinates.
    ///
    /// # Errors
    /// [`Error::NoFoot`] where the pull-back does not arrive.
    pub fn node_near(&self, x: &Vector<D>) -> Result<Node<D, ChartIndex>, Error> {
        let x = x - self.cloud.centre;
        let mut found = Vec::new();
        self.tree.nearest(&x, 1, &mut found);
        let nearest = self.tree.order[found[0].index as usize];
        self.pulled(&x, self.owners[nearest as usize])
    }

    /// The chart of a point of the cloud.
    pub(crate) fn owner(&self, point: usize) -> ChartIndex {
        self.owners[point]
    }

    /// The points lie off the surface by more than it errs.
    pub(crate) fn is_noisy(&self) -> bool {
        self.detail > 0.0
    }

    /// The foot of `x` seen from a chart or, where the iteration does not arrive from there, from the
    /// nearest of its neighbours from which it does.
    fn pulled(&self, x: &Vector<D>, place: ChartIndex) -> Result<Node<D, ChartIndex>, Error> {
        let mut scratch = Geometry::new(D - self.monomials.variables);
        let mut places = self.neighbours.of(place).iter();
        let node = places.find_map(|place| {
            let mut place = *place;
            let point = self.foot(x, &mut place, &mut scratch)?;
            Some(Node { point, place })
        });
        node.ok_or_else(|| Error::NoFoot {
            point: format!("{:?}", (x + self.cloud.centre).as_slice()),
            reason: "it is too far from the points, or the surface is undefined there",
        })
    }

    /// The straight step between two charts' origins does not cross a hole.
    fn within_extent(&self, i: ChartIndex, j: ChartIndex) -> bool {
        let (a, b) = (&self.charts[i as usize], &self.charts[j as usize]);
        [0.25, 0.5, 0.75].iter().all(|t| {
            let x = a.origin + (b.origin - a.origin) * *t;
            let depth = |place| self.beyond_rim(&x, place).map_or(0.0, |d| d.0);
            depth(i).max(depth(j)) <= CROSSING * a.spacing.max(b.spacing)
        })
    }

    /// Calls `visit` for every chart whose support holds `x`, with its side, its offset from the
    /// origin and its weight's argument 1 - r^2/R^2; returns whether there was one.
    fn overlapping(
        &self,
        x: &Vector<D>,
        home: ChartIndex,
        mut visit: impl FnMut(&Chart<D>, f64, Vector<D>, f64),
    ) -> bool {
        let mut any = false;
        let sides = &self.sides[self.neighbours.range(home)];
        for (index, side) in self.neighbours.of(home).iter().zip(sides) {
            let chart = &self.charts[*index as usize];
            let offset = x - chart.origin;
            let inside = 1.0 - offset.norm_squared() / (chart.radius * chart.radius);
            if inside > 0.0 {
                any = true;
                visit(chart, f64::from(*side), offset, inside);
            }
        }
        any
    }

    /// The blend F = sum_c phi_c s_c f_c / sum_c phi_c with its derivatives, of the charts known at
    /// `home`; beyond all supports the home chart alone.
    fn blend<const HESSIANS: bool>(&self, x: &Vector<D>, home: ChartIndex, out: &mut Geometry<D>) {
        let m = out.codimension;
        out.values.fill(0.0);
        out.gradients.fill(Vector::zeros());
        if HESSIANS {
            out.hessians.fill(Matrix::zeros());
        }
        let home_chart = &self.charts[home as usize];
        let mut jet = ChartJet::new();
        let mut total = Weight::zero();
        let any = self.overlapping(x, home, |chart, side, offset, inside| {
            chart.jet::<HESSIANS>(&self.monomials, x, &mut jet);
            let weight = Weight::new(inside, &offset, chart.radius);
            total.add(&weight);
            for a in 0..m {
                for b in 0..m {
                    let alignment = if m == 1 {
                        side
                    } else {
                        home_chart.frame.column(a).dot(&chart.frame.column(b))
                    };
                    let value = alignment * jet.value[b];
                    out.values[a] += weight.value * value;
                    out.gradients[a] +=
                        jet.gradient[b] * (alignment * weight.value) + weight.gradient * value;
                    if HESSIANS {
                        let cross = jet.gradient[b] * weight.gradient.transpose() * alignment;
                        out.hessians[a] += jet.hessian[b] * (alignment * weight.value)
                            + cross
                            + cross.transpose()
                            + weight.hessian * value;
                    }
                }
            }
        });
        if !any {
            home_chart.jet::<HESSIANS>(&self.monomials, x, &mut jet);
            out.values.copy_from_slice(&jet.value[..m]);
            out.gradients.copy_from_slice(&jet.gradient[..m]);
            if HESSIANS {
                out.hessians.copy_from_slice(&jet.hessian[..m]);
            }
            return;
        }
        let inverse = 1.0 / total.value;
        for a in 0..m {
            let value = out.values[a] * inverse;
            let gradient = (out.gradients[a] - total.gradient * value) * inverse;
            if HESSIANS {
                let cross = gradient * total.gradient.transpose();
                out.hessians[a] -= cross + cross.transpose() + total.hessian * value;
                out.hessians[a] *= inverse;
            }
            out.values[a] = value;
            out.gradients[a] = gradient;
        }
    }
}

/// A chart's weight phi = (1 - r^2/R^2)^4 and its derivatives.
struct Weight<const D: usize> {
    value: f64,
    gradient: Vector<D>,
    hessian: Matrix<D>,
}

impl<const D: usize> Weight<D> {
    fn zero() -> Self {
        Self {
            value: 0.0,
            gradient: Vector::zeros(),
            hessian: Matrix::zeros(),
        }
    }

    /// From `inside` = 1 - r^2/R^2 > 0 and the offset from the chart's origin.
    fn new(inside: f64, offset: &Vector<D>, radius: f64) -> Self {
        let slope = -2.0 / (radius * radius);
        let squared = inside * inside;
        let mut hessian = offset * offset.transpose() * (12.0 * squared * slope * slope);
        for i in 0..D {
            hessian[(i, i)] += 4.0 * squared * inside * slope;
        }
        Self {
            value: squared * squared,
            gradient: offset * (4.0 * squared * inside * slope),
            hessian,
        }
    }

    fn add(&mut self, other: &Self) {
        self.value += other.value;
        self.gradient += other.gradient;
        self.hessian += other.hessian;
    }
}

impl<const D: usize> LevelSet<D> for Atlas<D> {
    type Place = ChartIndex;

    fn locate(&self, x: &Vector<D>, place: &mut ChartIndex) -> bool {
        loop {
            let mut nearest = *place;
            let mut least = f64::INFINITY;
            for index in self.neighbours.of(*place) {
                let squared = (x - self.charts[*index as usize].origin).norm_squared();
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

impl<const D: usize> Surface<D> for Atlas<D> {
    type Place = ChartIndex;

    fn intrinsic_dimension(&self) -> usize {
        self.monomials.variables
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
        if self.is_noisy() {
            return self.geometry(x, place, out);
        }
        let mut jet = ChartJet::new();
        self.charts[place as usize].jet::<true>(&self.monomials, x, &mut jet);
        let m = out.codimension;
        out.values.copy_from_slice(&jet.value[..m]);
        out.gradients.copy_from_slice(&jet.gradient[..m]);
        out.hessians.copy_from_slice(&jet.hessian[..m]);
        out.factor()
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

    fn detail(&self) -> f64 {
        self.detail
    }

    fn height_error(&self, place: ChartIndex) -> f64 {
        self.charts[place as usize].height_error
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
}

impl<const D: usize> Geodesics<D, Atlas<D>> {
    /// The component of an input row's point, numbered by descending number of charts; `None` for
    /// rows out of range or dropped.
    #[must_use]
    pub fn component_of_row(&self, row: usize) -> Option<u32> {
        let atlas = self.surface();
        let point = atlas.cloud.point_of_row.get(row).copied().flatten()?;
        Some(self.components()[atlas.owners[point as usize] as usize])
    }

    /// Makes an atlas ready for path queries: its charts are the nodes of Algorithm 2's graph.
    #[must_use]
    pub fn of_atlas(atlas: Atlas<D>) -> Self {
        let nodes = atlas
            .charts
            .iter()
            .zip(0..)
            .map(|(chart, place)| Node {
                point: chart.origin,
                place,
            })
            .collect();
        let lists: Vec<Vec<u32>> = (0..atlas.neighbours.len() as u32)
            .into_par_iter()
            .map(|i| {
                let list = atlas.neighbours.of(i).iter().copied();
                list.filter(|j| atlas.within_extent(i, *j)).collect()
            })
            .collect();
        let graph = Graph::new(nodes, lists.iter().map(Vec::as_slice));
        Self::with_graph(atlas, graph)
    }
}
