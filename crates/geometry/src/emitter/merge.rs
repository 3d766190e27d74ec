//! Triangles of one lamp panel joined to one convex polygon, so that a panel is one light.

use super::area::PolygonLight;
use crate::math::Vec3;
use crate::{Mesh, Rgb};
use std::collections::HashMap;

/// Most corners a joined polygon may have: enough for panels, few enough for the closed form per pixel.
pub const MAX_CORNERS: usize = 8;

/// Two unit normals closer than this (sine of the angle) count as one plane.
const COPLANAR: f32 = 1e-4;

/// Triangles that shine evenly, as convex polygons of one radiance and sidedness.
///
/// `lit` names the triangles with their radiance and whether both sides shine. Grows each polygon greedily by the
/// triangles across its edges, as long as it stays plane, convex and small.
pub(super) fn polygons(mesh: &Mesh, lit: &[(u32, Rgb, bool)]) -> Vec<PolygonLight> {
    let across: HashMap<[Corner; 2], usize> = lit
        .iter()
        .enumerate()
        .flat_map(|(i, &(t, ..))| {
            let [a, b, c] = mesh.corners(t).map(corner);
            [([a, b], i), ([b, c], i), ([c, a], i)]
        })
        .collect();
    let mut taken = vec![false; lit.len()];
    let mut lights = Vec::new();
    for i in 0..lit.len() {
        if taken[i] {
            continue;
        }
        let (first, radiance, two_sided) = lit[i];
        taken[i] = true;
        let normal = mesh.geometric_normal(first);
        let (mut vertices, mut area, mut triangles) =
            (mesh.corners(first).to_vec(), mesh.area(first), vec![first]);
        let mut edge = 0;
        while edge < vertices.len() && vertices.len() < MAX_CORNERS {
            let n = vertices.len();
            let (a, b) = (vertices[edge], vertices[(edge + 1) % n]);
            let neighbour = across.get(&[corner(b), corner(a)]).copied().filter(|&j| !taken[j]);
            let apex = neighbour.filter(|&j| lit[j].1 == radiance && lit[j].2 == two_sided).and_then(|j| {
                let normal_j = mesh.geometric_normal(lit[j].0);
                let apex = mesh
                    .corners(lit[j].0)
                    .into_iter()
                    .find(|&c| corner(c) != corner(a) && corner(c) != corner(b))?;
                let plane = normal_j.dot(normal) > 0.0 && normal_j.cross(normal).length() < COPLANAR;
                (plane && stays_convex(&vertices, edge, apex, normal)).then_some((j, apex))
            });
            match apex {
                Some((j, apex)) => {
                    taken[j] = true;
                    vertices.insert(edge + 1, apex);
                    area += mesh.area(lit[j].0);
                    triangles.push(lit[j].0);
                    edge = 0;
                }
                None => edge += 1,
            }
        }
        lights.push(PolygonLight::new(vertices, normal, area, radiance, two_sided, triangles));
    }
    lights
}

/// A position by its bits: two triangles share an edge when its ends are equal, whatever their indices.
type Corner = [u32; 3];

fn corner(p: Vec3) -> Corner {
    // Adding zero makes −0 and 0 one.
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// Whether the polygon stays convex when `apex` comes between the ends of its edge number `edge`.
fn stays_convex(vertices: &[Vec3], edge: usize, apex: Vec3, normal: Vec3) -> bool {
    let n = vertices.len();
    let at = |i: usize| vertices[i % n];
    let (before, a, b, after) = (at(edge + n - 1), at(edge), at(edge + 1), at(edge + 2));
    if before == apex || after == apex {
        return false;
    }
    let turns_left = |p: Vec3, q: Vec3, r: Vec3| {
        let (d, e) = (q - p, r - q);
        d.cross(e).dot(normal) > -1e-5 * d.length() * e.length()
    };
    turns_left(before, a, apex) && turns_left(apex, b, after)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
        Mesh {
            positions: positions.iter().map(|&p| p.into()).collect(),
            triangles: triangles.to_vec(),
            ..Mesh::default()
        }
    }

    fn lit(n: u32) -> Vec<(u32, Rgb, bool)> {
        (0..n).map(|t| (t, Rgb::WHITE, false)).collect()
    }

    #[test]
    fn a_quad_of_two_triangles_is_one_light() {
        // With corners of its own for each triangle, as flat-shaded files have them.
        let m = mesh(
            &[[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [0., 0., -0.], [2., 1., 0.], [0., 1., 0.]],
            &[[0, 1, 2], [3, 4, 5]],
        );
        let lights = polygons(&m, &lit(2));
        assert_eq!(lights.len(), 1);
        assert_eq!((lights[0].vertices.len(), lights[0].area), (4, 2.0));
        assert_eq!(lights[0].triangles, [0, 1]);
    }

    #[test]
    fn a_bent_panel_and_two_colours_stay_apart() {
        let bent = mesh(&[[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [0., 1., 0.5]], &[[0, 1, 2], [0, 2, 3]]);
        assert_eq!(polygons(&bent, &lit(2)).len(), 2);
        let flat = mesh(&[[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [0., 1., 0.]], &[[0, 1, 2], [0, 2, 3]]);
        let two = [(0, Rgb::WHITE, false), (1, Rgb::splat(2.0), false)];
        assert_eq!(polygons(&flat, &two).len(), 2);
    }

    #[test]
    fn an_l_is_cut_in_convex_pieces() {
        let m = mesh(
            &[[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [1., 1., 0.], [1., 2., 0.], [0., 2., 0.]],
            &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]],
        );
        let lights = polygons(&m, &lit(4));
        assert!(lights.len() >= 2);
        assert!((lights.iter().map(|l| l.area).sum::<f32>() - 3.0).abs() < 1e-6);
    }
}
