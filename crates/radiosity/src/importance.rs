//! What an error in E would matter, told from outside: radiosity itself knows no camera.
//!
//! Whoever knows what is looked at hands in points of the surfaces that are seen, and points that light what is seen.
//! Sites far from all of them get fewer rays and their surroundings are not refined; the light they send on is averaged
//! over many before it comes to what is seen.

use crate::element::{Elements, Side, slot};

/// Weight of what lights what is seen.
const LIGHTS: f32 = 0.3;
/// Weight of what was not met at all.
const REST: f32 = 0.1;
/// A part of a surface with fewer points than this on all of it goes by the whole: chance may have left it out.
const FEW: f32 = 8.0;
/// An error matters in full where it spreads over so many points, one beside another, that are seen: a twelfth of the
/// width of a picture. Furnished rooms looked at as a whole keep the lengths they have without it
/// (a kitchen gets 31 771 sites, 31 751 without).
const SPAN: f32 = 13.0;

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Scene triangle.
    pub triangle: u32,
    /// Barycentrics on it.
    pub uv: [f32; 2],
    /// Side of it.
    pub side: Side,
    /// Seen, directly or by way of mirrors and glass; otherwise it lights something seen.
    pub seen: bool,
}

/// What matters: points spread as evenly over the pictures as what they are to stand for. Their order does not matter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Importance {
    /// All of them.
    pub points: Vec<Point>,
}

/// What an error of E matters at one slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Care {
    /// (0, 1]: 1 where it is seen.
    pub(crate) weight: f32,
    /// Length of surface over which an error matters in full, m: short where cameras come near, infinite where none looks.
    pub(crate) span: f32,
}

impl Care {
    /// Where nothing is known of any camera.
    pub(crate) const FULL: Care = Care { weight: 1.0, span: f32::INFINITY };
    /// Where no camera looks, nor light for one comes from.
    const NONE: Care = Care { weight: REST, span: f32::INFINITY };
}

/// Points met: those seen, and those that light.
type Count = [u32; 2];

fn weight(count: Count) -> f32 {
    match count {
        [0, 0] => REST,
        [0, _] => LIGHTS,
        _ => 1.0,
    }
}

/// Length over which an error matters in full on `area` (m²) on which there are `count` points.
fn span(count: Count, area: f32) -> f32 {
    SPAN * (area / count[0] as f32).sqrt()
}

impl Importance {
    /// What matters at each slot of the mesh: the most of what the leaves around it say.
    pub(crate) fn care(&self, elements: &Elements) -> Vec<Care> {
        let index = |node: u32, side: Side| 2 * node as usize + side.index();
        let mut of_node: Vec<Count> = vec![[0; 2]; 2 * elements.nodes.len()];
        let mut of_face: Vec<Count> = vec![[0; 2]; 2 * elements.faces as usize];
        for point in &self.points {
            let Some(face) = elements.face(point.triangle) else { continue };
            let kind = usize::from(!point.seen);
            of_face[index(face, point.side)][kind] += 1;
            elements.visit_path(point.triangle, point.uv, |node| {
                of_node[index(node, point.side)][kind] += 1;
            });
        }
        let roots = self.of_roots(elements, &of_node, &of_face);
        let mut care = vec![Care { weight: 0.0, ..Care::NONE }; 2 * elements.vertices.len()];
        for side in Side::BOTH {
            let mut of_nodes = vec![Care::NONE; elements.nodes.len()];
            for (node, &w) in roots.iter().skip(side.index()).step_by(2).enumerate() {
                of_nodes[node] = w;
            }
            // Children come after their parents.
            for node in 0..elements.nodes.len() as u32 {
                let own = of_nodes[node as usize];
                let all: u32 = of_node[index(node, side)].iter().sum();
                for child in elements.nodes[node as usize].children() {
                    let count = of_node[index(child, side)];
                    let many = count[0] as f32 >= FEW;
                    of_nodes[child as usize] = Care {
                        weight: if all as f32 >= FEW { weight(count) } else { own.weight },
                        span: if many { span(count, area(elements, child)) } else { own.span },
                    };
                }
            }
            for leaf in elements.leaves() {
                let of = of_nodes[leaf as usize];
                for v in elements.nodes[leaf as usize].vertices {
                    let c = &mut care[slot(v, side)];
                    *c = Care { weight: c.weight.max(of.weight), span: c.span.min(of.span) };
                }
            }
        }
        care
    }

    /// What matters on each side of each scene triangle: by its own points where its share of the face's should be enough
    /// to tell.
    fn of_roots(&self, elements: &Elements, of_node: &[Count], of_face: &[Count]) -> Vec<Care> {
        let roots = elements.roots;
        let mut areas = vec![0f32; elements.faces as usize];
        for t in 0..roots {
            if let Some(face) = elements.face(t) {
                areas[face as usize] += area(elements, t);
            }
        }
        let of = |t: u32, side: Side| {
            let Some(face) = elements.face(t) else { return Care::NONE };
            let whole = of_face[2 * face as usize + side.index()];
            let all = areas[face as usize].max(1e-30);
            let expected = whole.iter().sum::<u32>() as f32 * area(elements, t) / all;
            let own = of_node[2 * t as usize + side.index()];
            let many = own[0] as f32 >= FEW;
            Care {
                weight: if expected >= FEW { weight(own) } else { weight(whole) },
                span: if many { span(own, area(elements, t)) } else { span(whole, all) },
            }
        };
        (0..roots).flat_map(|t| Side::BOTH.map(|side| of(t, side))).collect()
    }
}

/// Area of a node of the mesh, m².
fn area(elements: &Elements, node: u32) -> f32 {
    let [a, b, c] = elements.corners(node);
    geometry::triangle::area(a, b, c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{MaterialId, Mesh, Vec3};

    #[test]
    fn what_is_seen_weighs_most_and_what_nothing_meets_least() {
        // A square of 2 triangles, split finely; all seen points in the lower left quarter, lighting ones at the right.
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
            normals: vec![Vec3::Z; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            materials: vec![MaterialId(0); 2],
            ..Mesh::default()
        };
        let mut elements = Elements::new(&mesh);
        elements.split_longer_than(0.1, 100_000);
        let mut points = Vec::new();
        for i in 0..100 {
            for j in 0..100 {
                let (x, y) = ((i as f32 + 0.5) / 100.0, (j as f32 + 0.5) / 100.0);
                // (0,0) (1,0) (1,1): x = u + v, y = v; (0,0) (1,1) (0,1): x = u, y = u + v.
                let (triangle, uv) = if y < x { (0, [x - y, y]) } else { (1, [x, y - x]) };
                if x < 0.5 && y < 0.5 {
                    points.push(Point { triangle, uv, side: Side::Front, seen: true });
                } else if x > 0.7 {
                    points.push(Point { triangle, uv, side: Side::Front, seen: false });
                }
            }
        }
        let mut importance = Importance { points };
        let care = importance.care(&elements);
        let slots = |x: f32, y: f32| {
            let near = |v: &usize| elements.vertices[*v].position.distance_squared(Vec3::new(x, y, 0.0));
            let v = (0..elements.vertices.len()).min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
            [2 * v, 2 * v + 1]
        };
        let at = |x: f32, y: f32| slots(x, y).map(|slot| care[slot].weight);
        assert_eq!(at(0.2, 0.3), [1.0, REST]);
        assert_eq!(at(0.95, 0.5), [LIGHTS, REST]);
        assert_eq!(at(0.3, 0.95), [REST, REST]);
        // Seen points lie a hundredth of a metre apart, in the quarter where there are any.
        let [seen, behind] = slots(0.2, 0.3).map(|slot| care[slot].span);
        assert!((seen / (0.01 * SPAN) - 1.0).abs() < 0.15 && behind.is_infinite(), "{seen} {behind}");
        importance.points.reverse();
        assert_eq!(importance.care(&elements), care);
    }
}
