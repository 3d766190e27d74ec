//! What a ray meets first, and whether it meets anything.
//!
//! obvhs builds a binary tree; ours is the rest: the tree is folded into nodes of eight boxes over blocks of
//! four triangles, and traversed by a portable kernel or a vector one, chosen once at run time
//! (`TWOLIGHT_KERNEL=portable` in the environment chooses the first). All kernels meet triangles by the same IEEE
//! operations in the same order, so they return the same bits; their box tests differ in rounding only, which could
//! tell only between two triangles met at distances that differ by rounding alone.
//!
//! The triangle test is watertight (Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT
//! 2(1), 2013): no ray passes between two triangles that share an edge or a corner.
//!
//! Rays a second, as ratios to those of Embree 3.13 (single rays, default, not watertight; its robust mode is at 0.77
//! to 0.89) on the same rays in the same run, one thread of a Zen 3 with AVX2, by `cargo xtask bench rays --fast`. The
//! machine was busy; where there are two numbers they are the least and the greatest of two or more runs.
//!
//! | scene | triangles | camera | diffuse | shadow | build, CPU s | bytes per triangle |
//! |---|---|---|---|---|---|---|
//! | `room` | 49 164 | 1.00–1.14 | 0.82–0.96 | 0.93–1.10 | 0.07 | 74 |
//! | kitchen | 56 904 | 1.11 | 1.16 | 1.43 | 0.09 | 80 |
//! | `assets/gallery.glb` | 72 724 | 1.44–1.73 | 1.22–1.26 | 1.46–1.97 | 0.08 | 76 |
//! | classroom | 103 830 | 1.14 | 1.06 | 1.03 | 0.15 | 84 |
//! | a study, after Veach | 382 615 | 1.23 | 1.10 | 1.09 | 0.60 | 73 |
//! | white room | 400 090 | 1.01–1.04 | 0.84–0.95 | 1.07–1.15 | 0.63 | 73 |
//! | `million` | 995 340 | 0.89–1.02 | 0.68–0.79 | 0.81–0.96 | 1.86 | 76 |
//!
//! In `million` incoherent rays wait for memory: pages of 2 MB gave them 3 to 8 % once, and nothing beyond noise in four
//! later pairs of runs (not done: it takes a system call that the standard library does not make). Nodes are a fifth of
//! the tree, blocks, of which 2.7 places in 4 are taken, the rest: with boxes quantised to 8 bits a side (128 bytes a
//! node instead of 256) diffuse rays there were a fifth faster, camera and shadow rays 5 to 9 % slower; in `room`, the
//! gallery and the white room camera and shadow rays were 8 to 25 % slower, diffuse ones by 0 to 30 % (a run each).
//!
//! What is left to gain: of a render at 5 % (kitchen, staircase) or of a view of the gallery from a solution, all
//! traversal takes 13 to 17 %, camera rays 1 to 2 % (`perf record`). Packets for them could save no more than that and are
//! not built; AVX-512 was not at hand.
//!
//! One level only, all in world space. A second level could spare a mesh that stands in many places its 73 to 84
//! bytes per triangle, which are 5.5 of the 102 MB that rendering the gallery takes at most: positions and irradiance
//! are kept for each place in any case. It would cost each ray the 14 ns of preparing it anew, of the 100 to 130 that
//! a camera ray takes in all, for each place whose box it enters.

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
