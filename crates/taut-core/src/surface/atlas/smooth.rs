//! Larger charts where the surface is smooth: one chart for the points of several leaves of the
//! tree.
//!
//! A clean fit of the highest degree to a wider neighbourhood needs no more samples than one to a
//! small neighbourhood: only some of its points, at an even stride, are fitted, and the rest are
//! only checked. So both the charts and the work for each point become fewer, at an error that
//! grows with the fifth power of the radius and is held far below the spacing of the points.

use crate::parallel;
use crate::spatial::tree::Tree;
use crate::surface::atlas::build::Built;
use crate::surface::atlas::links::STEEPEST_SECANT;
use crate::surface::atlas::polynomial::{HIGHEST_DEGREE, Monomials};
use crate::surface::atlas::scale::{self, NOISY};
use crate::surface::atlas::sheets::{Neighbourhood, Sheet, Workspace};

/// Most leaves that a chart may stand for; a power of two, so that they are a subtree.
pub(super) const MOST_LEAVES: usize = 4;
/// Largest residual of a large chart, in spacings.
const SMOOTH_RESIDUAL: f64 = 1e-6;
/// Number of points of a large chart's neighbourhood, as a share of those that its leaves would
/// have.
const SHARED_POINTS: f64 = 0.9;
/// Number of samples that are enough for a chart without noise.
const ENOUGH_SAMPLES: usize = 60;
/// Number of groups of leaves by which it is judged whether large charts will do.
const JUDGED_GROUPS: usize = 64;

/// How many leaves a chart may stand for: the largest of 4, 2 and 1 at which more than half of some
/// groups of leaves are smooth enough.
pub(super) fn leaves_a_chart<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    leaves: &[Vec<u32>],
) -> usize {
    let mut most = MOST_LEAVES;
    while most > 1 {
        let groups = leaves.len().div_ceil(most);
        let step = groups.div_ceil(JUDGED_GROUPS).max(1);
        let judged: Vec<&[Vec<u32>]> = leaves.chunks(most).step_by(step).collect();
        let smooth = parallel::map_with(judged.len(), Workspace::default, |workspace, i| {
            large(tree, monomials, judged[i], workspace).is_some()
        });
        if 2 * smooth.iter().filter(|smooth| **smooth).count() > smooth.len() {
            break;
        }
        most /= 2;
    }
    most
}

/// One chart for the points of a few leaves, if they lie on one sheet that is smooth and has no
/// other sheet within reach.
pub(super) fn large<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    leaves: &[Vec<u32>],
    workspace: &mut Workspace<D>,
) -> Option<Built<D>> {
    let own = leaves.concat();
    let usual = scale::usual_points(monomials) * leaves.len();
    let wanted = (SHARED_POINTS * usual as f64) as usize;
    let seed = scale::seed(tree, &own)?;
    let mut sheet = Sheet::new(tree, monomials, seed);
    let Neighbourhood { members, frame } = sheet.grow(wanted, workspace)?;
    if !workspace.alone() || members.len() < wanted || own.iter().any(|i| !members.contains(i)) {
        return None;
    }
    let stride = wanted.div_ceil(ENOUGH_SAMPLES);
    let sampled = Neighbourhood {
        members: members.into_iter().step_by(stride).collect(),
        frame,
    };
    let mut chart = scale::fit_chart(&sheet, &sampled, workspace)?.chart;
    chart.spacing /= (stride as f64).powf(1.0 / monomials.variables as f64);
    let smooth = usize::from(chart.degree) == HIGHEST_DEGREE
        && chart.residual <= SMOOTH_RESIDUAL * chart.spacing
        && chart.steepest(monomials) <= STEEPEST_SECANT;
    let m = D - monomials.variables;
    let mut offsets = [0.0; D];
    let mut on_it = |i: &u32| {
        chart.offsets(monomials, &tree.points[*i as usize], &mut offsets);
        offsets[..m].iter().map(|v| v * v).sum::<f64>() <= (NOISY * chart.spacing).powi(2)
    };
    if !(smooth && own.iter().all(&mut on_it)) {
        return None;
    }
    Some(Built::new(tree, chart, sampled.members, own))
}
