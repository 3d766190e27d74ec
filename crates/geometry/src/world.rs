//! A scene made ready for rays: its search tree and its lights.

use crate::emitter::Emitters;
use crate::math::Vec3;
use crate::optics::attenuation;
use crate::surface::straight_through;
use crate::{Bvh, Hit, Ray, Rgb, Scene, Volume};

/// Shadow rays give up, as if blocked, after so many panes.
const MAX_LAYERS: usize = 64;

/// The scene, and what answers questions about it.
#[derive(Debug)]
pub struct World {
    /// The scene.
    pub scene: Scene,
    /// Search tree over its triangles.
    pub bvh: Bvh,
    /// All that shines in it.
    pub emitters: Emitters,
    /// Diagonal of the bounding box, m.
    pub diagonal: f32,
    /// Lowest and highest corner of the bounding box, m; zero without vertices.
    pub bounds: (Vec3, Vec3),
    /// Whether any material lets light straight through.
    see_through: bool,
}

impl World {
    /// Builds tree and lights.
    pub fn new(scene: Scene) -> World {
        let bvh = Bvh::build(&scene.mesh);
        let emitters = Emitters::build(&scene);
        let bounds = scene.mesh.bounds().unwrap_or_default();
        let see_through = scene.materials.iter().any(|m| m.may_pass_straight());
        World { bvh, emitters, diagonal: (bounds.1 - bounds.0).length(), bounds, see_through, scene }
    }

    /// The nearest triangle the ray meets.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.bvh.closest_hit(ray)
    }

    /// Share of the light that comes straight along the ray, [0, 1] in each channel: 1 with nothing between, less
    /// through alpha, smooth thin glass and volumes that do not bend light, 0 behind anything else. Light that glass
    /// bends does not count.
    pub fn transmittance(&self, ray: &Ray) -> Rgb {
        if !self.see_through {
            return if self.bvh.occluded(ray) { Rgb::BLACK } else { Rgb::WHITE };
        }
        let mut left = Rgb::WHITE;
        let mut ray = *ray;
        let mut medium = None;
        for _ in 0..MAX_LAYERS {
            let Some(hit) = self.bvh.closest_hit(&ray) else {
                // The rest of the way to a lamp inside a volume; none to the sky, which lies in air.
                return left
                    * if ray.t_max.is_finite() { over(medium, ray.t_max - ray.t_min) } else { Rgb::WHITE };
            };
            left *= straight_through(&self.scene, &ray, &hit);
            if left.max_channel() <= 0.0 {
                return Rgb::BLACK;
            }
            let enclosed =
                self.scene.materials[self.scene.mesh.materials[hit.triangle as usize].0 as usize].enclosed();
            let front = self.scene.mesh.geometric_normal(hit.triangle).dot(ray.direction) <= 0.0;
            let (before, beyond) = if front { (medium, enclosed) } else { (enclosed.or(medium), None) };
            left *= over(before, hit.t - ray.t_min);
            if enclosed.is_some() {
                medium = beyond;
            }
            // t_min excludes the hit itself, and the same origin keeps t of all further hits exact.
            ray.t_min = hit.t;
        }
        Rgb::BLACK
    }
}

/// Share of light left after `way` m of a medium.
fn over(medium: Option<Volume>, way: f32) -> Rgb {
    medium.map_or(Rgb::WHITE, |m| attenuation(m.attenuation_color, m.attenuation_distance, way))
}
