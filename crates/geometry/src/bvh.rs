//! What a ray meets first, and whether it meets anything.

use crate::Mesh;
use crate::math::Vec3;

/// A half-line, or a piece of one: `origin + t · direction` for t in (t_min, t_max).
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where t = 0.
    pub origin: Vec3,
    /// Unit length by convention, so that t is in metres.
    pub direction: Vec3,
    /// Nothing at or before this counts.
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
pub struct Bvh {}

impl Bvh {
    /// Builds the tree; triangles without area or with a corner that is not finite are left out.
    pub fn build(_mesh: &Mesh) -> Bvh {
        todo!("bvh")
    }

    /// The nearest triangle that the ray meets within (t_min, t_max), from either side.
    pub fn closest_hit(&self, _ray: &Ray) -> Option<Hit> {
        todo!("bvh")
    }

    /// Whether the ray meets any triangle within (t_min, t_max).
    pub fn occluded(&self, _ray: &Ray) -> bool {
        todo!("bvh")
    }
}
