//! Which triangles enter the tree, and which of them go together.

use super::binary::Bounds;
use crate::Mesh;
use crate::math::Vec3;
use rayon::prelude::*;

/// Triangles that share a centroid, as one leaf in obvhs's eyes: a range of the order returned beside it.
pub(super) struct Item {
    /// Box around them.
    pub bounds: Bounds,
    /// First of them in the order.
    pub first: u32,
    /// How many.
    pub count: u32,
}

/// Bits of the centroid's cell on each axis.
const CELL_BITS: u32 = 21;

/// The valid triangles of a mesh in Morton order, cut into items.
///
/// obvhs clusters neighbours whose union is smallest. Where all unions are equal, as among n copies of one
/// triangle, it joins one pair in each pass and takes n² time: 16 000 copies took it 9 s. So triangles whose
/// centroids fall in one cell of a grid of 2²¹ cells along the longest axis become one item, which
/// [`super::binary`] halves itself.
pub(super) fn items(mesh: &Mesh) -> (Vec<Item>, Vec<u32>) {
    let valid: Vec<u32> =
        (0..mesh.triangles.len() as u32).into_par_iter().filter(|&t| is_valid(mesh, t)).collect();
    let scene =
        valid.par_iter().map(|&t| Bounds::of(&mesh.corners(t))).reduce(Bounds::empty, |a, b| a.union(&b));
    let scale = ((1u64 << CELL_BITS) - 1) as f64 / scene.longest_side().max(f64::MIN_POSITIVE);
    let mut keyed: Vec<(u64, u32)> = valid
        .par_iter()
        .map(|&t| {
            let centre = Bounds::of(&mesh.corners(t)).centre() - scene.lo.as_dvec3();
            (morton((centre * scale).to_array().map(|x| x as u64)), t)
        })
        .collect();
    keyed.par_sort_unstable();

    let order: Vec<u32> = keyed.iter().map(|&(_, t)| t).collect();
    let mut items = Vec::with_capacity(order.len());
    for run in keyed.chunk_by(|a, b| a.0 == b.0) {
        let bounds = run.iter().fold(Bounds::empty(), |b, &(_, t)| b.union(&Bounds::of(&mesh.corners(t))));
        let first = items.last().map_or(0, |i: &Item| i.first + i.count);
        items.push(Item { bounds, first, count: run.len() as u32 });
    }
    (items, order)
}

/// Whether a triangle has three finite corners and some area.
fn is_valid(mesh: &Mesh, t: u32) -> bool {
    let [a, b, c] = mesh.corners(t);
    // The normal is taken in f64, so only a triangle without area in exact arithmetic (or nearly) has none.
    a.is_finite() && b.is_finite() && c.is_finite() && crate::triangle::normal(a, b, c) != Vec3::ZERO
}

/// Interleaves the lower 21 bits of three numbers.
fn morton(cell: [u64; 3]) -> u64 {
    let spread = |x: u64| {
        let x = (x | x << 32) & 0x001f_0000_0000_ffff;
        let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
        let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
        let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
        (x | x << 2) & 0x1249_2492_4924_9249
    };
    spread(cell[0]) << 2 | spread(cell[1]) << 1 | spread(cell[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn morton_interleaves_all_bits() {
        let all = (1 << CELL_BITS) - 1;
        assert_eq!(morton([all, all, all]), (1 << 63) - 1);
        assert_eq!(morton([1, 0, 0]), 4);
        assert_eq!(morton([0, 2, 1]), 0b010_001);
    }
}
