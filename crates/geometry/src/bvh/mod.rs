//! What a ray meets first, and whether it meets anything.
//!
//! obvhs builds a binary tree; ours is the rest: the tree is folded into nodes of eight boxes over blocks of
//! four triangles, and traversed by a portable kernel or a vector one, chosen once at run time. All kernels
//! do the same IEEE operations in the same order, so they return the same bits.
//!
//! The triangle test is watertight (Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT
//! 2(1), 2013): no ray passes between two triangles that share an edge or a corner.

mod binary;
mod count;
mod items;
mod kernel;
mod plan;
mod portable;
mod prepared;
#[cfg(target_arch = "x86_64")]
mod simd;
#[cfg(test)]
mod tests;
mod wide;

use crate::Mesh;
use crate::math::Vec3;
use count::Count;
pub use kernel::Kernel;
use kernel::Tracer;
use wide::Tree;

/// A half-line, or a piece of one: `origin + t · direction` for t in (t_min, t_max).
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where t = 0.
    pub origin: Vec3,
    /// Unit length by convention, so that t is in metres.
    pub direction: Vec3,
    /// Nothing at or before this counts; ≥ 0.
    pub t_min: f32,
    /// Nothing at or beyond this counts.
    pub t_max: f32,
}

impl Ray {
    /// From `origin` along the unit vector `direction`, without end.
    pub fn new(origin: Vec3, direction: Vec3) -> Ray {
        Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    /// The point at `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// Where a ray met a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Which triangle of the mesh.
    pub triangle: u32,
    /// Weight of the triangle's second corner.
    pub u: f32,
    /// Weight of its third corner; the first has 1 − u − v.
    pub v: f32,
}

/// The search tree over all triangles of a mesh.
#[derive(Debug)]
pub struct Bvh {
    tree: Tree,
    tracer: Tracer,
    count: Count,
}

impl Bvh {
    /// Builds the tree; triangles without area or with a corner that is not finite are left out.
    pub fn build(mesh: &Mesh) -> Bvh {
        Bvh::build_for(mesh, Kernel::best())
    }

    /// Builds the tree, to be traversed by `kernel`, or in plain Rust where the machine has not that kernel.
    pub fn build_for(mesh: &Mesh, kernel: Kernel) -> Bvh {
        let (items, order) = items::items(mesh);
        let tree = wide::fold(mesh, binary::build(mesh, &items, order));
        Bvh { tree, tracer: Tracer::new(kernel).unwrap_or(Tracer::Portable), count: Count::default() }
    }

    /// The nearest triangle that the ray meets within (t_min, t_max), from either side.
    ///
    /// Of several at exactly the same `t` the one with the smallest index. A ray that is not finite meets
    /// nothing.
    #[inline]
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.count.add_one();
        self.tracer.closest_hit(&self.tree, ray)
    }

    /// Whether the ray meets any triangle within (t_min, t_max).
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.count.add_one();
        self.tracer.occluded(&self.tree, ray)
    }

    /// Rays asked of either function since the tree was built, by all threads.
    pub fn rays_cast(&self) -> u64 {
        self.count.total()
    }

    /// Memory that the tree takes, bytes.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
    }
}
