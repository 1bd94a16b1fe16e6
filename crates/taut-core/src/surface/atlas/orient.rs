//! Which side of a surface is outside: signs for the charts' normals.
//!
//! Each link says whether two charts' normals point to the same side. Signs spread along a spanning
//! tree of links that prefers charts of nearly equal normals (Hoppe, DeRose, Duchamp, McDonald,
//! Stuetzle, Surface reconstruction from unorganized points, 1992). Links that contradict it are
//! counted: a Moebius strip has some whatever the signs.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::surface::atlas::build::{Built, Draft};
use crate::surface::atlas::links;
use crate::{Matrix, Vector};

/// The signs of charts, and what speaks against them.
pub(super) struct Orientation {
    /// For each chart 1, or -1 if it is to be turned over.
    pub signs: Vec<i8>,
    /// The number of links that the signs of their charts contradict.
    pub contradictions: usize,
    /// The number of points whose given normal points to the other side.
    pub against: usize,
}

/// Orients the charts of a hypersurface. Each component is oriented by the given normals of its
/// points (by tree index, zero where unknown), or else so that its normals point out of what it
/// encloses.
pub(super) fn orient<const D: usize>(draft: &Draft<D>, given: Option<&[Vector<D>]>) -> Orientation {
    let mut signs = spread(draft);
    let component = links::groups(&draft.linked);
    let votes: Vec<Vote> = draft.built.iter().map(|b| vote(draft, b, given)).collect();
    let mut sums = vec![(0.0, 0.0); signs.len()];
    for ((vote, sign), component) in votes.iter().zip(&signs).zip(&component) {
        let sum = &mut sums[*component as usize];
        sum.0 += f64::from(*sign) * (vote.along as f64 - vote.against as f64);
        sum.1 += f64::from(*sign) * vote.flux;
    }
    let mut against = 0;
    for ((vote, sign), component) in votes.iter().zip(&mut signs).zip(&component) {
        let (given, flux) = sums[*component as usize];
        if given < 0.0 || (given == 0.0 && flux < 0.0) {
            *sign = -*sign;
        }
        against += if *sign > 0 { vote.against } else { vote.along };
    }
    let contradicts = |(chart, links): (usize, &Vec<links::Link>)| {
        let turns = links.iter();
        turns
            .filter(|(other, turn)| signs[chart] * turn * signs[*other as usize] < 0)
            .count()
    };
    // Each link is in two lists.
    let contradictions = draft
        .linked
        .iter()
        .enumerate()
        .map(contradicts)
        .sum::<usize>()
        / 2;
    Orientation {
        signs,
        contradictions,
        against,
    }
}

/// Signs that spread from the first chart of each component along links, those of the least turning
/// first.
fn spread<const D: usize>(draft: &Draft<D>) -> Vec<i8> {
    let normal = |i: u32| draft.built[i as usize].chart.frame.column(0);
    let mut signs = vec![0_i8; draft.built.len()];
    let mut waiting = BinaryHeap::new();
    for first in 0..signs.len() as u32 {
        if signs[first as usize] != 0 {
            continue;
        }
        waiting.push((Reverse(0), Reverse(first), 1));
        while let Some((_, Reverse(chart), sign)) = waiting.pop() {
            if signs[chart as usize] != 0 {
                continue;
            }
            signs[chart as usize] = sign;
            for (other, turn) in &draft.linked[chart as usize] {
                if signs[*other as usize] == 0 {
                    let turning = 1.0 - normal(chart).dot(&normal(*other)).abs();
                    // The bits are ordered like the number, because it is not negative.
                    let turning = turning.max(0.0).to_bits();
                    waiting.push((Reverse(turning), Reverse(*other), sign * turn));
                }
            }
        }
    }
    signs
}

/// What a chart says about its own orientation.
struct Vote {
    /// The number of points whose given normal lies along the chart's normal.
    along: usize,
    /// The number of points whose given normal lies against the chart's normal.
    against: usize,
    /// The chart's share of the flux of x through the surface, positive where the normal points
    /// out.
    flux: f64,
}

/// The vote of a chart about its own orientation.
fn vote<const D: usize>(draft: &Draft<D>, built: &Built<D>, given: Option<&[Vector<D>]>) -> Vote {
    let chart = &built.chart;
    let area = built.own.len() as f64 * chart.spacing.powi(draft.monomials.variables as i32);
    let mut vote = Vote {
        along: 0,
        against: 0,
        flux: area * chart.origin.dot(&chart.frame.column(0)),
    };
    for point in &built.own {
        let Some(normal) = given.map(|given| given[*point as usize]) else {
            break;
        };
        let x = draft.tree.points[*point as usize];
        let along = normal.dot(&chart.normal(&draft.monomials, &x));
        vote.along += usize::from(along > 0.0);
        vote.against += usize::from(along < 0.0);
    }
    vote
}

/// Turns charts over so that all signs become 1.
pub(super) fn turn<const D: usize>(draft: &mut Draft<D>, signs: &[i8]) {
    for (built, sign) in draft.built.iter_mut().zip(signs) {
        if *sign < 0 {
            let chart = &mut built.chart;
            let frame: &mut Matrix<D> = &mut chart.frame;
            frame.column_mut(0).neg_mut();
            for coefficient in &mut chart.coefficients {
                *coefficient = -*coefficient;
            }
        }
    }
    for (chart, links) in draft.linked.iter_mut().enumerate() {
        for (other, turn) in links {
            *turn *= signs[chart] * signs[*other as usize];
        }
    }
}
