//! Solving on the mesh as it is: roughly while that grows, and to a bound in the end.

use crate::element::slot;
use crate::flags::{Flags, visible_weights};
use crate::influence;
use crate::refine::Refiner;
use crate::solver::{self, Bound, Convergence, Stakes};
use crate::transport::Transport;
use geometry::{LightGroups, Rgb};
use rayon::prelude::*;

/// Times as many sites as before for which it is worked out anew what the light hangs on.
const GROWN: f32 = 1.2;

/// What solving on the present mesh gave.
pub(crate) struct Solved {
    /// E at the sites, lx.
    pub(crate) e: Vec<Rgb>,
    /// The parts of the groups of lights in it, where these are kept apart and the mesh is final.
    pub(crate) parts: Vec<Vec<Rgb>>,
    /// Estimated variance of each (mean of the channels), lx².
    pub(crate) variance: Vec<f32>,
    pub(crate) convergence: Convergence,
    /// What a residual brings at all later bounces, in units of itself.
    pub(crate) gain: f32,
}

impl Refiner<'_> {
    /// Solves on what there is, roughly: for predictions, not for pictures.
    ///
    /// - `onward`: whether more sites will be chosen by what is found.
    pub(crate) fn settle(&mut self, onward: bool) {
        let tolerance = 0.02 * mean(&self.e).mean();
        let elements = &self.elements;
        self.field.sites.par_iter_mut().for_each(|site| {
            site.row.landings.iter_mut().for_each(|landing| landing.go_to_leaf(elements));
        });
        let transport = self.transport(&Flags::default());
        let settled = self.solved(&transport, tolerance, 12, self.gain, &[], &[], &Flags::default());
        // Nearly the same before and after a round of few sites, and as dear as the solve itself.
        if onward && self.field.sites.len() as f32 > GROWN * self.influential as f32 {
            self.influence = influence::of_slots(self, &transport, &settled.e);
            self.influential = self.field.sites.len();
        }
        self.gain = Some(settled.gain);
        self.e = settled.e;
        self.field.sites.iter_mut().zip(settled.variance).for_each(|(site, v)| site.variance = v);
    }

    /// Solves E = D + K (E + extra) to `tolerance` lx from the present E, in at most `most` steps.
    ///
    /// - `gain`: what a residual is believed to bring at all later bounces, in units of itself; worked out if absent.
    /// - `extra_parts`: the parts of the groups of lights in `extra`; empty as that is.
    pub(crate) fn solved(
        &self,
        transport: &Transport,
        tolerance: f32,
        most: u32,
        gain: Option<f32>,
        extra: &[Rgb],
        extra_parts: &[Vec<Rgb>],
        flags: &Flags,
    ) -> Solved {
        let reflect = |e: &[Rgb]| transport.reflect(e, &[]);
        let apply = |e: &[Rgb]| transport.apply(e, extra);
        let stakes = self.stakes();
        let mut bound = gain.map_or(Bound::new(&stakes), |gain| Bound::about(&stakes, gain));
        let (e, convergence) = solver::iterate(self.e.clone(), tolerance, most, &mut bound, apply, reflect);
        let gain = bound.gain;
        let variance = transport.variance(&e);
        // Each group of lights by itself, on the same rows: E is their sum.
        let settled = !flags.is_empty();
        let groups = if settled { self.groups.as_ref().map_or(0, LightGroups::len) } else { 0 };
        let parts = (0..groups)
            .map(|g| {
                let direct: Vec<Rgb> = self.field.sites.iter().map(|s| s.row.by_group[g]).collect();
                let bound = tolerance * mean(&direct).mean() / self.mean_direct().max(1e-30);
                let extra = extra_parts.get(g).map_or(&[][..], |part| part);
                let apply = |e: &[Rgb]| {
                    let mut sum = transport.reflect(e, extra);
                    sum.iter_mut().zip(&direct).for_each(|(sum, &d)| *sum += d);
                    sum
                };
                solver::solve(direct.clone(), &stakes, bound, most, apply, reflect).0
            })
            .collect();
        Solved { e, parts, variance, convergence, gain }
    }

    /// What an error at each site matters.
    fn stakes(&self) -> Stakes {
        let around =
            self.levels(self.field.sites.iter().zip(&self.e).map(|(s, e)| (s.vertex, s.side, e.mean())));
        let slots = || self.field.sites.iter().map(|s| slot(s.vertex, s.side));
        Stakes {
            weights: slots().map(|s| self.weight(s)).collect(),
            levels: slots().map(|s| around[self.face_slot(s)]).collect(),
        }
    }

    /// The rows over the present mesh.
    pub(crate) fn transport(&self, flags: &Flags) -> Transport<'_> {
        let usable: Vec<bool> = (0..self.field.sources.0.len()).map(|s| self.field.usable(s)).collect();
        let usable = |s: usize| usable[s];
        let (world, elements) = (self.world, &self.elements);
        Transport::locate(elements, &self.field, |node, side, w| {
            visible_weights(world, elements, flags, usable, node, side, w).map(|voices| voices.weights)
        })
    }

    /// Mean over sites of what comes back of emitters' light, lx.
    fn mean_direct(&self) -> f32 {
        mean(&self.field.sites.iter().map(|s| s.row.direct).collect::<Vec<_>>()).mean()
    }
}

/// Mean over sites, lx.
pub(crate) fn mean(e: &[Rgb]) -> Rgb {
    let sum = e
        .iter()
        .fold([0f64; 3], |s, e| [s[0] + f64::from(e.r), s[1] + f64::from(e.g), s[2] + f64::from(e.b)]);
    Rgb::from(sum.map(|s| (s / e.len().max(1) as f64) as f32))
}
