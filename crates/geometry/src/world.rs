//! A scene made ready for rays: its search tree and its lights.

use crate::emitter::Emitters;
use crate::math::Vec3;
use crate::scene::AlphaMode;
use crate::{Bvh, Hit, Ray, Rgb, Scene};

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
        let see_through = scene
            .materials
            .iter()
            .any(|m| m.alpha_mode != AlphaMode::Opaque || (m.transmission > 0.0 && m.volume.is_none()));
        World { bvh, emitters, diagonal: (bounds.1 - bounds.0).length(), bounds, see_through, scene }
    }

    /// The nearest triangle the ray meets.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.bvh.closest_hit(ray)
    }

    /// Share of the light that comes straight along the ray, [0, 1] in each channel: 1 with nothing between, less
    /// through alpha and smooth thin glass, 0 behind anything else. Light that glass bends does not count.
    pub fn transmittance(&self, ray: &Ray) -> Rgb {
        if !self.see_through {
            return if self.bvh.occluded(ray) { Rgb::BLACK } else { Rgb::WHITE };
        }
        let mut left = Rgb::WHITE;
        let mut ray = *ray;
        for _ in 0..MAX_LAYERS {
            let Some(hit) = self.bvh.closest_hit(&ray) else { return left };
            left *= straight_through(&self.scene, &ray, &hit);
            if left.max_channel() <= 0.0 {
                return Rgb::BLACK;
            }
            // t_min excludes the hit itself, and the same origin keeps t of all further hits exact.
            ray.t_min = hit.t;
        }
        Rgb::BLACK
    }
}

/// Nothing is seen through, until the shading model says what is.
fn straight_through(_: &Scene, _: &Ray, _: &Hit) -> Rgb {
    Rgb::BLACK
}
