//! Leaves of which the mesh knows nothing: their corners all lie within other things, as those of a panel in its frame
//! do, but light comes to their middles. Such a leaf gets a vertex there, which speaks for all of it.

use crate::element::{Side, VertexId, slot};
use crate::field::Site;
use crate::influence;
use crate::refine::Refiner;
use rayon::prelude::*;
use std::collections::HashMap;

/// Share of the light that goes to unknown places which is looked after; the rest lies in crumbs.
const MOST: f64 = 0.95;
/// A leaf that less than this share of all landings go to is a crumb.
const CRUMB: f64 = 1e-6;

/// A leaf that nothing is known of, and how much matters what is there.
#[derive(Clone, Copy, Default)]
struct Unknown {
    leaf: u32,
    /// On which sides rays landed.
    sides: [bool; 2],
    /// Shares of landings times the area that their sites speak for, m².
    landed: f64,
}

impl Refiner<'_> {
    /// Gathers in the middle of the leaves that rays land on and no corner speaks for, those first that matter most.
    pub(crate) fn reveal(&mut self) {
        let (unknown, landed) = self.unknown();
        let wanted = MOST * unknown.iter().map(|u| u.landed).sum::<f64>();
        let mut sum = 0.0;
        let matters = |u: &Unknown| {
            let more = sum < wanted && u.landed > CRUMB * landed;
            sum += u.landed;
            more
        };
        let chosen: Vec<Unknown> =
            unknown.into_iter().take(self.config.most_sites / 4).take_while(matters).collect();
        let middles: Vec<(VertexId, [bool; 2])> =
            chosen.iter().map(|u| (self.elements.split_at_middle(u.leaf), u.sides)).collect();
        if !middles.is_empty() {
            self.weigh();
            self.gather(&middles);
        }
    }

    /// The leaves that landings find nothing on, those first that most comes to; and what all landings come to.
    fn unknown(&self) -> (Vec<Unknown>, f64) {
        let known = |leaf: u32, side: Side| {
            let corners = self.elements.nodes[leaf as usize].vertices;
            corners.iter().any(|&v| self.field.usable(slot(v, side)))
        };
        let look = |(site, area): (&Site, f64)| {
            let mut found = Vec::new();
            for landing in &site.row.landings {
                let (leaf, side, _) = landing.locate(&self.elements);
                if !known(leaf, side) {
                    found.push((leaf, side, f64::from(landing.weight().mean()) * area));
                }
            }
            found
        };
        let areas = influence::areas(self);
        let found: Vec<_> =
            self.field.sites.par_iter().zip(areas.par_iter().copied()).flat_map_iter(look).collect();
        let mut leaves: HashMap<u32, Unknown> = HashMap::new();
        for (leaf, side, landed) in found {
            let of = leaves.entry(leaf).or_default();
            of.leaf = leaf;
            of.sides[side.index()] = true;
            of.landed += landed;
        }
        let mut leaves: Vec<Unknown> = leaves.into_values().collect();
        leaves.sort_unstable_by(|a, b| b.landed.total_cmp(&a.landed).then(a.leaf.cmp(&b.leaf)));
        // Of what sets out about a half arrives: near enough for a threshold.
        (leaves, 0.5 * areas.iter().sum::<f64>())
    }
}
