//! A point on the film to a primary ray.

use crate::bvh::Ray;
use crate::math::{Mat4, Vec3};

/// Where the picture is taken from. The camera looks along −z of its own frame, +y is up (glTF 2.0, 3.10).
#[derive(Clone, Debug)]
pub struct Camera {
    /// Name in the file, for `--camera`.
    pub name: String,
    /// Camera to world; rotation and translation only.
    pub to_world: Mat4,
    /// Perspective or orthographic.
    pub projection: Projection,
    /// Nearest distance along the view axis that is seen, m, ≥ 0.
    pub near: f32,
    /// Width over height as the file states it, if it does.
    pub aspect: Option<f32>,
}

/// How the film sees the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Lines meet in the eye.
    Perspective {
        /// Full vertical angle of view, radians, in (0, π).
        yfov: f32,
    },
    /// Lines are parallel.
    Orthographic {
        /// Half the height of the picture, m.
        ymag: f32,
    },
}

impl Camera {
    /// The ray through the film point (x, y), both in [0, 1], from the top left; `aspect` is width over height.
    pub fn ray(&self, x: f32, y: f32, aspect: f32) -> Ray {
        let (sx, sy) = (2.0 * x - 1.0, 1.0 - 2.0 * y);
        let (origin, direction) = match self.projection {
            Projection::Perspective { yfov } => {
                let h = (0.5 * yfov).tan();
                (Vec3::ZERO, Vec3::new(sx * h * aspect, sy * h, -1.0))
            }
            Projection::Orthographic { ymag } => (Vec3::new(sx * ymag * aspect, sy * ymag, 0.0), Vec3::NEG_Z),
        };
        // The near plane cuts at a depth along the axis: scale by |direction| = 1/cos.
        let t_min = self.near * direction.length();
        let origin = self.to_world.transform_point3(origin);
        let direction = self.to_world.transform_vector3(direction).normalize();
        Ray { origin, direction, t_min, t_max: f32::INFINITY }
    }

    /// A view of the whole box from `lo` to `hi`, for a file without a camera: from the front (+z), slightly above.
    pub fn framing(lo: Vec3, hi: Vec3) -> Camera {
        let centre = 0.5 * (lo + hi);
        let radius = (0.5 * (hi - lo).length()).max(1e-6);
        let yfov = 0.7f32;
        let from = centre + Vec3::new(0.35, 0.25, 1.0).normalize() * radius / (0.5 * yfov).sin();
        let z = (from - centre).normalize();
        let x = Vec3::Y.cross(z).normalize();
        Camera {
            name: "framing".into(),
            to_world: Mat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), from.extend(1.0)),
            projection: Projection::Perspective { yfov },
            near: 0.0,
            aspect: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_framing_camera_looks_at_the_middle() {
        let camera = Camera::framing(Vec3::ZERO, Vec3::splat(2.0));
        let ray = camera.ray(0.5, 0.5, 1.5);
        let to_middle = (Vec3::ONE - ray.origin).normalize();
        assert!(to_middle.dot(ray.direction) > 1.0 - 1e-5);
    }

    #[test]
    fn left_is_left_and_up_is_up() {
        let camera = Camera {
            name: String::new(),
            to_world: Mat4::IDENTITY,
            projection: Projection::Perspective { yfov: 1.0 },
            near: 0.0,
            aspect: None,
        };
        let d = camera.ray(0.0, 0.0, 1.0).direction;
        assert!(d.x < 0.0 && d.y > 0.0 && d.z < 0.0);
    }
}
