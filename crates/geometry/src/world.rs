//! A scene made ready for rays: its search tree and its lights.

use crate::emitter::Emitters;
use crate::flights::room_size;
use crate::math::Vec3;
use crate::nesting::Nesting;
use crate::optics::attenuation;
use crate::outlook::Outlook;
use crate::surface::straight_through;
use crate::{Bvh, Hit, Mesh, Ray, Rgb, Scene, Surface, Volume};
use std::sync::Arc;

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
    /// Size of the rooms in it, m, by the flights of diffuse rays ([`crate::flights`]). What depends on the size of things
    /// is measured by it, not by the diagonal, which a ground plane or a far landscape inflates.
    pub scale: f32,
    /// Lowest and highest corner of the bounding box, m; zero without vertices.
    pub bounds: (Vec3, Vec3),
    /// Search tree over the triangles whose material may let light straight through, where there are any.
    see_through: Option<Bvh>,
    /// What lies within what, where solids overlap.
    nesting: Option<Nesting>,
}

impl World {
    /// Builds tree and lights.
    pub fn new(scene: Scene) -> World {
        let bvh = Bvh::build(&scene.mesh);
        let emitters = Emitters::build(&scene);
        let bounds = scene.mesh.bounds().unwrap_or_default();
        let see_through = see_through(&scene).map(|mesh| Bvh::build(&mesh));
        let diagonal = (bounds.1 - bounds.0).length();
        let scale = room_size(&scene.mesh, &bvh, diagonal);
        let nesting = Nesting::new(&scene);
        let mut world = World { bvh, emitters, diagonal, scale, bounds, see_through, nesting, scene };
        let sky = world.scene.sky.as_ref().filter(|sky| !sky.mean().is_black());
        world.emitters.outlook = sky.and_then(|sky| Outlook::learn(&world, sky)).map(Arc::new);
        world
    }

    /// Gathers anew what shines, after the scene's emissions were changed, and nothing else of it.
    pub fn relight(&mut self) {
        let outlook = self.emitters.outlook.take();
        self.emitters = Emitters::build(&self.scene);
        self.emitters.outlook = outlook;
    }

    /// The nearest triangle the ray meets.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.bvh.closest_hit(ray)
    }

    /// The surface that `ray` met at `hit`, with what lies on its two sides.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let sides = self.nesting.as_ref().and_then(|n| n.sides(&self.scene, ray, hit));
        Surface::between(&self.scene, ray, hit, sides)
    }

    /// Share of the light that comes straight along the ray, [0, 1] in each channel: 1 with nothing between, less
    /// through alpha, smooth thin glass and volumes that do not bend light, 0 behind anything else. Light that glass
    /// bends does not count.
    pub fn transmittance(&self, ray: &Ray) -> Rgb {
        // Few rays meet a pane or a leaf; the small tree tells which, and all others need no surface looked up.
        if !self.see_through.as_ref().is_some_and(|panes| panes.occluded(ray)) {
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

/// The triangles whose material may let light straight through; `None` without any.
fn see_through(scene: &Scene) -> Option<Mesh> {
    let passes: Vec<bool> = scene.materials.iter().map(|m| m.may_pass_straight()).collect();
    let of = scene.mesh.triangles.iter().zip(&scene.mesh.materials);
    let triangles: Vec<[u32; 3]> =
        of.filter(|(_, m)| passes.get(m.0 as usize).is_some_and(|&p| p)).map(|(t, _)| *t).collect();
    (!triangles.is_empty()).then(|| Mesh {
        positions: scene.mesh.positions.clone(),
        triangles,
        ..Mesh::default()
    })
}

/// Share of light left after `way` m of a medium.
fn over(medium: Option<Volume>, way: f32) -> Rgb {
    medium.map_or(Rgb::WHITE, |m| attenuation(m.attenuation_color, m.attenuation_distance, way))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{AlphaMode, Material, MaterialId, Mesh};

    /// Squares of 2 m across the y axis, one for each (height, front up, material).
    fn stack(layers: Vec<(f32, bool, Material)>) -> World {
        let mut mesh = Mesh::default();
        let mut materials = Vec::new();
        for (i, (y, up, material)) in layers.into_iter().enumerate() {
            let s = if up { 1.0 } else { -1.0 };
            mesh.positions
                .extend([[-s, 1.0], [s, 1.0], [s, -1.0], [-s, -1.0]].map(|[x, z]| Vec3::new(x, y, z)));
            let a = 4 * i as u32;
            mesh.triangles.extend([[a, a + 1, a + 2], [a, a + 2, a + 3]]);
            mesh.materials.extend([MaterialId(i as u32); 2]);
            materials.push(material);
        }
        World::new(Scene { mesh, materials, ..Scene::default() })
    }

    fn veil() -> Material {
        Material { alpha: 0.25, alpha_mode: AlphaMode::Blend, ..Material::default() }
    }

    fn clear(attenuation_distance: f32) -> Material {
        let volume = Some(Volume { attenuation_color: Rgb::splat(0.5), attenuation_distance });
        Material { metallic: 0.0, roughness: 0.0, transmission: 1.0, ior: 1.0, volume, ..Material::default() }
    }

    fn down(from: f32, to: f32) -> Ray {
        Ray { t_max: from - to, ..Ray::new(Vec3::new(0.1, from, 0.2), Vec3::NEG_Y) }
    }

    #[test]
    fn opaque_is_black_and_nothing_is_white() {
        let world = stack(vec![(0.0, true, Material::default())]);
        assert_eq!(world.transmittance(&down(1.0, -1.0)), Rgb::BLACK);
        assert_eq!(world.transmittance(&down(1.0, 0.5)), Rgb::WHITE);
        assert_eq!((world.diagonal, world.bounds.1), (8f32.sqrt(), Vec3::new(1.0, 0.0, 1.0)));
    }

    #[test]
    fn veils_multiply_until_something_opaque() {
        let world = stack(vec![(0.0, true, veil()), (0.5, false, veil()), (-1.0, true, Material::default())]);
        assert!((world.transmittance(&down(1.0, -0.5)).g - 0.5625).abs() < 1e-6);
        assert_eq!(world.transmittance(&down(1.0, -2.0)), Rgb::BLACK);
        let many = stack((0..200).map(|i| (i as f32 * 0.01, true, veil())).collect());
        assert_eq!(many.transmittance(&down(3.0, -1.0)), Rgb::BLACK, "given up");
    }

    #[test]
    fn a_medium_absorbs_by_the_way_in_it() {
        let world = stack(vec![(1.0, true, clear(0.5)), (0.0, false, clear(0.5))]);
        // 1 m in all; from within upward or downward ½ m; from above to a lamp within ½ m.
        for (ray, left) in [
            (down(2.0, -1.0), 0.25),
            (down(0.5, -1.0), 0.5),
            (down(2.0, 0.5), 0.5),
            (Ray { direction: Vec3::Y, ..down(0.5, -1.0) }, 0.5),
        ] {
            let got = world.transmittance(&ray).g;
            assert!((got - left).abs() < 1e-5, "{ray:?}: {got}");
        }
    }
}
