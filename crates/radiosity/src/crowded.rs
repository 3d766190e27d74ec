//! Where something stands close to a large leaf: the light there changes over lengths like its distance, though the corners
//! of the leaf may all lie in the open and know nothing of it. What stands there tells, by rays that land close by.

use crate::element::{Side, VertexId};
use crate::field::Site;
use crate::refine::Refiner;
use crate::transport::Landing;
use geometry::triangle;
use rayon::prelude::*;

/// A ray from nearer than this share of the leaf's longest edge says that something stands close.
const CLOSE: f32 = 0.25;
/// A site nearer to the plane of the leaf, in units of its longest edge, lies on it or beside it.
const BESIDE: f32 = 0.01;
/// Such rays that make a leaf crowded.
const MANY: u32 = 4;

impl Refiner<'_> {
    /// The edges of the leaves that something stands close to, each once, in order.
    pub(crate) fn crowded(&self) -> Vec<(VertexId, VertexId)> {
        let close = |site: &Site| -> Vec<u32> {
            let from = self.elements.vertices[site.vertex as usize].position;
            let side_of_leaf = |landing: &Landing| {
                let (leaf, side, w) = landing.locate(&self.elements);
                let [a, b, c] = self.elements.corners(leaf);
                let to = a * w[0] + b * w[1] + c * w[2];
                let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
                let away = (from - to).dot(triangle::normal(a, b, c)).abs();
                let stands = from.distance(to) < CLOSE * longest && away > BESIDE * longest;
                stands.then_some(2 * leaf + side.index() as u32)
            };
            site.row.landings.iter().filter_map(side_of_leaf).collect()
        };
        let mut sides: Vec<u32> = self.field.sites.par_iter().flat_map_iter(close).collect();
        sides.par_sort_unstable();
        let crowds = sides.chunk_by(|a, b| a == b).filter(|rays| rays.len() as u32 >= MANY);
        let mut edges: Vec<_> = crowds
            .map(|rays| (rays[0] / 2, Side::BOTH[rays[0] as usize % 2]))
            .filter(|&(leaf, side)| self.reach.alive(self.elements.face_of(leaf), side))
            .flat_map(|(leaf, _)| self.elements.edges(leaf))
            .filter(|&(a, b)| self.splittable(a, b))
            .collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }
}
