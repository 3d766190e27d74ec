//! Traversal in plain Rust, for every machine, and the definition of what the vector kernels compute.

use super::Hit;
use super::prepared::Prepared;
use super::wide::{BLOCK, Block, LANES, Node, STACK, Tree, WIDTH};

/// The nearest hit.
pub(super) fn closest_hit(tree: &Tree, ray: &Prepared) -> Option<Hit> {
    let mut best = None;
    let mut t_max = ray.t_max;
    let mut stack = [(0.0f32, 0u32); STACK];
    stack[0] = (ray.t_min, 0);
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let (near, reference) = stack[top];
        if near > t_max {
            continue;
        }
        if reference & BLOCK != 0 {
            block(&tree.blocks[(reference & !BLOCK) as usize], ray, &mut t_max, &mut best);
            continue;
        }
        let node = &tree.nodes[reference as usize];
        let first = top;
        for (near, &child) in enter(node, ray, t_max).into_iter().zip(&node.child) {
            if near < f32::INFINITY {
                // Farthest first, so that the nearest is popped first.
                let mut i = top;
                while i > first && stack[i - 1].0 < near {
                    stack[i] = stack[i - 1];
                    i -= 1;
                }
                stack[i] = (near, child);
                top += 1;
            }
        }
    }
    best
}

/// The nearest hit by asking every triangle: what the tree must give.
#[cfg(test)]
pub(super) fn closest_in_all_blocks(tree: &Tree, ray: &Prepared) -> Option<Hit> {
    let (mut t_max, mut best) = (ray.t_max, None);
    tree.blocks.iter().for_each(|b| block(b, ray, &mut t_max, &mut best));
    best
}

/// Whether there is any hit.
pub(super) fn occluded(tree: &Tree, ray: &Prepared) -> bool {
    let mut stack = [0u32; STACK];
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let reference = stack[top];
        if reference & BLOCK != 0 {
            let (mut t_max, mut best) = (ray.t_max, None);
            block(&tree.blocks[(reference & !BLOCK) as usize], ray, &mut t_max, &mut best);
            if best.is_some() {
                return true;
            }
            continue;
        }
        let node = &tree.nodes[reference as usize];
        for (near, &child) in enter(node, ray, ray.t_max).into_iter().zip(&node.child) {
            if near < f32::INFINITY {
                stack[top] = child;
                top += 1;
            }
        }
    }
    false
}

/// Where the ray enters each child's box, or infinity where it misses it within [t_min, t_max].
///
/// In an axis along which the ray does not move, (b − o) · ∞ is ±∞, or NaN for an origin right on the box's
/// face; a NaN here must leave the interval as it is, which `f32::max` and `min` promise.
fn enter(node: &Node, ray: &Prepared, t_max: f32) -> [f32; WIDTH] {
    let mut near = [ray.t_min; WIDTH];
    let mut far = [t_max; WIDTH];
    for axis in 0..3 {
        let (o, inv_near, inv_far) = (ray.origin[axis], ray.inverse_near[axis], ray.inverse_far[axis]);
        let entry = &node.bounds[ray.enters[axis]][axis];
        let exit = &node.bounds[1 - ray.enters[axis]][axis];
        for lane in 0..WIDTH {
            near[lane] = near[lane].max((entry[lane] - o) * inv_near);
            far[lane] = far[lane].min((exit[lane] - o) * inv_far);
        }
    }
    for lane in 0..WIDTH {
        if near[lane] > far[lane] {
            near[lane] = f32::INFINITY;
        }
    }
    near
}

/// Meets the ray with four triangles; keeps the nearest, and of equals the first by index.
///
/// Woop et al. 2013, section 3: the corners, relative to the origin, are sheared so that the ray becomes the
/// z axis; U, V and W are then the areas (twice, signed) of the triangles that the axis makes with the three
/// edges. An edge yields the same number, but for its sign, in both of its triangles, and the sign is right
/// or the number is zero: a · b − c · d rounds its products monotonically, and no fused multiply-add may
/// spoil that. Zero counts as inside.
fn block(block: &Block, ray: &Prepared, t_max: &mut f32, best: &mut Option<Hit>) {
    let [sx, sy] = ray.shear;
    for lane in 0..LANES {
        let corners = block.corners.each_ref().map(|rows| ray.axes.map(|k| rows[k][lane]));
        let [a, b, c] = corners.map(|p| {
            let z = p[2] - ray.origin[ray.axes[2]];
            [p[0] - ray.origin[ray.axes[0]] - sx * z, p[1] - ray.origin[ray.axes[1]] - sy * z]
        });
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            continue;
        }
        let det = u + v + w;
        if det == 0.0 {
            continue;
        }
        let t = plane(corners, ray);
        let triangle = block.triangle[lane];
        let nearer = t < *t_max || (t == *t_max && best.is_some_and(|b| triangle < b.triangle));
        if t > ray.t_min && nearer {
            let inverse = 1.0 / det;
            *t_max = t;
            *best = Some(Hit { t, triangle, u: v * inverse, v: w * inverse });
        }
    }
}

/// Where the ray meets the plane of a triangle: t = n · (a − o) / n · d, all in the order of the ray's axes.
///
/// Not the mean of the corners' z weighted by U, V and W, as in Woop et al.: that errs by an ulp of the
/// farthest corner, 10 µm on a floor of 100 m, and rays from just above it fell through. Here a plane along
/// two axes is met exactly.
fn plane([a, b, c]: [[f32; 3]; 3], ray: &Prepared) -> f32 {
    let [x, y, z] = [0, 1, 2];
    let e = [b[x] - a[x], b[y] - a[y], b[z] - a[z]];
    let f = [c[x] - a[x], c[y] - a[y], c[z] - a[z]];
    let n = [e[y] * f[z] - e[z] * f[y], e[z] * f[x] - e[x] * f[z], e[x] * f[y] - e[y] * f[x]];
    let to = [0, 1, 2].map(|i| a[i] - ray.origin[ray.axes[i]]);
    let dot = |p: [f32; 3]| n[x] * p[x] + n[y] * p[y] + n[z] * p[z];
    dot(to) / dot(ray.direction)
}
