//! The samples made ready to be searched: as many as suit the surface, over all of its extent.

use crate::guess::JOINED;
use crate::guess::graph::Graph;
use crate::guess::sampling::Extent;
use crate::guess::sampling::grow::{Grown, Sample, grow, measure};
use crate::guess::sampling::join::{WIDER, edge_count, is_enough, is_foretold, join, one_step};
use crate::guess::sampling::region::Region;
use crate::guess::sampling::walk::{CLEARANCE, Walker};
use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::implicit::{Equations, ImplicitSurface};
use crate::surface::{Node, Surface};
use crate::{Vector, parallel};

/// Samples, and what is known of the surface between them.
pub(super) struct SampleNet<const D: usize> {
    pub samples: Vec<Sample<D>>,
    pub tree: Tree<D>,
    /// Largest spacing of a sample, in the input's units.
    widest: f64,
    /// Distance below which two points of the surface lie on one sheet, in the input's units.
    pub clearance: f64,
    /// Least distance from one sheet to the next, in the input's units.
    pub gap: f64,
    /// For each sample, whether the surface goes on beyond the samples of its component.
    pub open: Vec<bool>,
    /// For each sample, whether it lies near a tip; empty where the surface has none.
    tips: Vec<bool>,
    /// How much of the surface was sampled.
    pub extent: Extent,
}

/// Number of samples aimed for; at least a quarter and at most three times as many are accepted.
const SAMPLES_WANTED: usize = 500;
/// Share of too many samples above which, if a wider spacing leaves more, it is the surface's
/// turning that demands them.
const LITTLE_LESS: f64 = 0.8;
/// Most times that the region is doubled before a surface counts as endless.
const MOST_DOUBLINGS: usize = 10;
/// Most times that the region is doubled to connect the seeds on a surface without end.
const MOST_CONNECTING: usize = 4;
/// Curvature of the surface, as a multiple of its median, above which a sample is at a tip.
const SHARP: f64 = 4.0;
/// Most seeds from which the sampling is planned.
const MOST_STARTS: usize = 128;
/// Most rounds of sampling; after each but the last, seeds on parts without samples are added.
const MOST_SAMPLINGS: usize = 3;

impl<const D: usize> SampleNet<D> {
    /// Samples the components that hold the seeds, which are points of the surface, within bounds
    /// where they are given.
    pub fn new<E: Equations<D>>(
        surface: &ImplicitSurface<D, E>,
        seeds: &[Vector<D>],
        bounds: Option<&Region<D>>,
    ) -> (Self, Graph<D, Vector<D>>) {
        let mut starts = strided(seeds);
        for _ in 1..MOST_SAMPLINGS {
            let (net, graph) = Self::about(surface, &starts, seeds, bounds);
            let left = net.left_out(surface, seeds);
            if left.is_empty() {
                return (net, graph);
            }
            starts.extend(strided(&left));
        }
        Self::about(surface, &starts, seeds, bounds)
    }

    /// Samples from the starts. Without bounds it samples all that they lead to; of what has no
    /// end, it samples as much as connects the starts.
    fn about<E: Equations<D>>(
        surface: &ImplicitSurface<D, E>,
        starts: &[Vector<D>],
        seeds: &[Vector<D>],
        bounds: Option<&Region<D>>,
    ) -> (Self, Graph<D, Vector<D>>) {
        if let Some(region) = bounds {
            let crude = grow(surface, starts, region, region.first_spacing());
            let grown = evenly(surface, starts, region, crude);
            return Self::of(surface, grown, Extent::WithinBounds);
        }
        let about_seeds = Region::around(seeds, surface.size());
        let mut region = about_seeds;
        for _ in 0..MOST_DOUBLINGS {
            let crude = grow(surface, starts, &region, region.first_spacing());
            if crude.stopped {
                break;
            }
            if !crude.clipped {
                let grown = evenly(surface, starts, &region, crude);
                return Self::of(surface, grown, Extent::Part);
            }
            region = region.doubled();
        }
        Self::connecting(surface, starts, about_seeds)
    }

    /// Samples a surface without end as far about the seeds as joins them, or most of them. It goes
    /// no farther, because more samples would be coarser.
    fn connecting<E: Equations<D>>(
        surface: &ImplicitSurface<D, E>,
        starts: &[Vector<D>],
        mut region: Region<D>,
    ) -> (Self, Graph<D, Vector<D>>) {
        let mut best = (usize::MAX, region);
        for _ in 0..=MOST_CONNECTING {
            let crude = grow(surface, starts, &region, region.first_spacing());
            let is_last = crude.stopped;
            let (_, graph) = Self::of(surface, crude, Extent::Endless);
            let parts = graph.components().1.len();
            if parts < best.0 {
                best = (parts, region);
            }
            if is_last || parts == 1 {
                break;
            }
            region = region.doubled();
        }
        let crude = grow(surface, starts, &best.1, best.1.first_spacing());
        let grown = evenly(surface, starts, &best.1, crude);
        Self::of(surface, grown, Extent::Endless)
    }

    /// The net of what was grown; its extent is the one given unless all was sampled.
    fn of<E: Equations<D>>(
        surface: &ImplicitSurface<D, E>,
        grown: Grown<D>,
        extent: Extent,
    ) -> (Self, Graph<D, Vector<D>>) {
        let samples = grown.samples;
        let points: Vec<Vector<D>> = samples.iter().map(|s| s.point).collect();
        let tree = Tree::new(&points);
        let graph = join(surface, &samples, &tree, &grown.links);
        let (components, sizes) = graph.components();
        let mut open = vec![false; sizes.len()];
        for (sample, component) in samples.iter().zip(&components) {
            open[*component as usize] |= sample.open;
        }
        let gap = samples.iter().map(|s| s.gap).fold(f64::INFINITY, f64::min);
        let extent = match () {
            () if !open.contains(&true) => Extent::Whole,
            () if grown.stopped || !grown.clipped => Extent::Part,
            () => extent,
        };
        let net = Self {
            tips: tips(&samples, &graph),
            widest: samples.iter().map(|s| s.spacing).fold(0.0, f64::max),
            clearance: CLEARANCE * gap,
            gap,
            open: components.iter().map(|c| open[*c as usize]).collect(),
            samples,
            tree,
            extent,
        };
        (net, graph)
    }

    /// Whether some node of a way lies nearest to a sample near a tip.
    pub fn passes_tip(&self, way: &[Node<D, Vector<D>>]) -> bool {
        let mut found = Vec::new();
        let mut is_near = |node: &Node<D, Vector<D>>| {
            self.tree.nearest(&node.point, 1, &mut found);
            let nearest = found
                .first()
                .map(|near| self.tree.order[near.index as usize]);
            nearest.is_some_and(|sample| self.tips[sample as usize])
        };
        !self.tips.is_empty() && way.iter().any(&mut is_near)
    }

    /// The seeds from which no walk leads to a sample.
    fn left_out<E: Equations<D>>(
        &self,
        surface: &ImplicitSurface<D, E>,
        seeds: &[Vector<D>],
    ) -> Vec<Vector<D>> {
        let scratch = || Walker::new(surface);
        let left = parallel::map_with(seeds.len(), scratch, |walker, i| {
            let mut is_near = false;
            self.entrances(&seeds[i], walker, &mut |_| is_near = true);
            !is_near
        });
        let seeds = seeds.iter().zip(left).filter(|(_, left)| *left);
        seeds.map(|(seed, _)| *seed).collect()
    }

    /// Visits the samples a step from a point of the surface that a walk leads to.
    pub fn entrances<E: Equations<D>>(
        &self,
        point: &Vector<D>,
        walker: &mut Walker<'_, D, E>,
        visit: &mut dyn FnMut(u32),
    ) {
        let Some(here) = measure(walker, point, f64::INFINITY) else {
            return;
        };
        let geometry = walker.scratch.clone();
        let codimension = walker.scratch.codimension;
        let mut found: Vec<Neighbour> = Vec::new();
        let mut count = edge_count(D - codimension) / 2;
        let (mut seen, mut visited) = (0, false);
        loop {
            self.tree.nearest(point, count, &mut found);
            for neighbour in found.iter().skip(seen) {
                let index = self.tree.order[neighbour.index as usize];
                let there = &self.samples[index as usize];
                let here = Sample {
                    spacing: there.spacing,
                    ..here.clone()
                };
                let is_clear = neighbour.squared < self.clearance * self.clearance;
                if neighbour.squared == 0.0
                    || one_step(&here, there, codimension)
                        && (is_clear
                            || is_foretold(&geometry, &here, there)
                                && walker.arrives(point, &there.point, there.gap))
                {
                    visited = true;
                    visit(index);
                }
            }
            if visited || is_enough(&found, count, JOINED * self.widest) {
                return;
            }
            seen = found.len();
            count *= WIDER;
        }
    }
}

/// Whether each sample is at a tip, where the surface curves far more than elsewhere, or beside
/// one; empty where there is no tip.
fn tips<const D: usize>(samples: &[Sample<D>], graph: &Graph<D, Vector<D>>) -> Vec<bool> {
    let mut radii: Vec<f64> = samples.iter().map(|sample| sample.by_turning).collect();
    radii.sort_by(f64::total_cmp);
    let Some(median) = radii.get(radii.len() / 2) else {
        return Vec::new();
    };
    let is_tip = |i: u32| SHARP * samples[i as usize].by_turning < *median;
    let beside = |i: u32| graph.edges(i).iter().any(|edge| is_tip(edge.to));
    let all = 0..samples.len() as u32;
    if all.clone().any(is_tip) {
        all.map(|i| is_tip(i) || beside(i)).collect()
    } else {
        Vec::new()
    }
}

/// At most [`MOST_STARTS`] of the seeds, evenly chosen.
fn strided<const D: usize>(seeds: &[Vector<D>]) -> Vec<Vector<D>> {
    let stride = seeds.len().div_ceil(MOST_STARTS).max(1);
    seeds.iter().step_by(stride).copied().collect()
}

/// Grows about [`SAMPLES_WANTED`] samples, beginning with samples of the region's first spacing.
fn evenly<const D: usize, E: Equations<D>>(
    surface: &ImplicitSurface<D, E>,
    starts: &[Vector<D>],
    region: &Region<D>,
    first: Grown<D>,
) -> Grown<D> {
    let k = surface.intrinsic_dimension() as f64;
    let mut spacing = region.first_spacing();
    let mut result = first;
    for _ in 0..8 {
        let count = result.samples.len();
        let bound_by_turning = result.samples.iter().all(|s| s.spacing < spacing);
        if (SAMPLES_WANTED / 4..=3 * SAMPLES_WANTED).contains(&count)
            || (count > SAMPLES_WANTED && bound_by_turning)
        {
            break;
        }
        let by_turning = result.samples.iter().filter(|s| s.spacing < spacing);
        if result.stopped && 2 * by_turning.count() > count {
            break;
        }
        let factor = (count as f64 / SAMPLES_WANTED as f64).powf(1.0 / k);
        spacing *= factor.clamp(0.2, 5.0);
        result = grow(surface, starts, region, spacing);
        let change = result.samples.len() as f64 / count.max(1) as f64;
        if count > SAMPLES_WANTED && change > LITTLE_LESS {
            break;
        }
    }
    result
}
