//! How much light there is around a place: what an error there is seen beside.

use crate::element::{Side, VertexId, slot};
use crate::refine::Refiner;

/// A face with fewer sites than this does not tell how much light there is around it.
const FEW: u32 = 16;
/// What is this much darker than the mean of all is dark, whoever looks.
const DARK: f32 = 0.01;

impl Refiner<'_> {
    /// How much light there is on each side of each face, lx, for telling what is dark there: the mean over its sites, or over
    /// all of them where it has few. A dim room beside a bright one is looked at by eyes and cameras that are used to it.
    pub(crate) fn levels(&self, sites: impl Iterator<Item = (VertexId, Side, f32)>) -> Vec<f32> {
        let mut sums = vec![(0.0, 0u32); 2 * self.elements.faces as usize];
        let (mut all, mut count) = (0f64, 0u32);
        for (vertex, side, e) in sites {
            let sum = &mut sums[self.face_slot(slot(vertex, side))];
            *sum = (sum.0 + e, sum.1 + 1);
            (all, count) = (all + f64::from(e), count + 1);
        }
        let all = (all / f64::from(count.max(1))) as f32;
        let level = |(sum, n): (f32, u32)| if n >= FEW { (sum / n as f32).max(DARK * all) } else { all };
        sums.into_iter().map(level).collect()
    }

    /// Mean E of each side of each face, lx, over its sites.
    pub(crate) fn means_of_faces(&self) -> Vec<f32> {
        let mut sums = vec![(0.0, 0u32); 2 * self.elements.faces as usize];
        for (site, e) in self.field.sites.iter().zip(&self.e) {
            let sum = &mut sums[self.face_slot(slot(site.vertex, site.side))];
            *sum = (sum.0 + e.mean(), sum.1 + 1);
        }
        sums.into_iter().map(|(sum, n)| sum / n.max(1) as f32).collect()
    }

    /// Number of the side of a face that a slot lies on.
    pub(crate) fn face_slot(&self, slot: usize) -> usize {
        2 * self.elements.vertices[slot / 2].face as usize + slot % 2
    }
}
