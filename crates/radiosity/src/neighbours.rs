//! Which sites lie beside one another.

use crate::element::{Side, slot};
use crate::refine::Refiner;
use rayon::prelude::*;

/// Neighbours of every site across the leaves, in CSR form.
pub(crate) struct Graph {
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

impl Graph {
    /// Sites are neighbours when they speak for corners of one leaf, on a side that `joins` lets join them.
    pub(crate) fn new(refiner: &Refiner, joins: impl Fn(u32, Side) -> bool) -> Graph {
        let (elements, field) = (&refiner.elements, &refiner.field);
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        for leaf in elements.leaves() {
            let corners = elements.nodes[leaf as usize].vertices;
            for side in Side::BOTH {
                if !joins(leaf, side) {
                    continue;
                }
                let sites = corners.map(|v| field.loudest(slot(v, side)));
                for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                    if let (Some(a), Some(b)) = (sites[a], sites[b])
                        && a != b
                    {
                        pairs.extend([(a, b), (b, a)]);
                    }
                }
            }
        }
        pairs.par_sort_unstable();
        pairs.dedup();
        let mut starts = vec![0u32; field.sites.len() + 1];
        for &(a, _) in &pairs {
            starts[a as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        Graph { starts, neighbours: pairs.into_iter().map(|p| p.1).collect() }
    }

    /// Those beside `site`.
    pub(crate) fn of(&self, site: u32) -> &[u32] {
        let range = self.starts[site as usize] as usize..self.starts[site as usize + 1] as usize;
        &self.neighbours[range]
    }
}
