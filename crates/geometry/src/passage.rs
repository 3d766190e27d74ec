//! What a path carries from one surface to the next besides its light: the medium it is in, and its colour once a prism
//! has parted it.

use crate::dispersion::Hue;
use crate::math::Vec3;
use crate::optics::attenuation;
use crate::sampling::Rng;
use crate::{Rgb, Surface, Volume};

/// Where a path is, and as what.
#[derive(Clone, Copy, Debug, Default)]
pub struct Passage {
    /// What it went into last; `None` for air, or where it set out.
    medium: Option<Volume>,
    /// The one channel it still carries.
    hue: Option<Hue>,
    /// The one it will carry from the smooth surface that it has met, if it goes through.
    offered: Option<Hue>,
}

impl Passage {
    /// Comes to `surface` over `way` m: what is left of the light, ≥ 0 in each channel. A dispersive surface bends the path
    /// by its hue from then on; one that has none yet is given one by chance, and its channel is worth three. A smooth
    /// surface waits with that until the path goes through, so that what it reflects keeps its colours: their Fresnel
    /// terms are averaged.
    pub fn meet(&mut self, surface: &mut Surface, way: f32, rng: &mut Rng) -> Rgb {
        let left = self.absorb(surface, way);
        if !surface.disperses() {
            return left;
        }
        match self.hue {
            Some(hue) => {
                surface.bend(hue);
                left
            }
            None => {
                let hue = Hue::sample(rng.array());
                if surface.bsdf.is_delta() {
                    surface.bend(hue);
                    self.offered = Some(hue);
                    return left;
                }
                left * self.part(surface, hue) * 3.0
            }
        }
    }

    /// What the medium on the way to `surface` leaves, [0, 1].
    pub fn absorb(&self, surface: &Surface, way: f32) -> Rgb {
        match surface.before.or(self.medium) {
            Some(v) => attenuation(v.attenuation_color, v.attenuation_distance, way),
            None => Rgb::WHITE,
        }
    }

    /// Goes on as `hue` alone, which `surface` bends accordingly: what is left, 1 in its channel.
    pub fn part(&mut self, surface: &mut Surface, hue: Hue) -> Rgb {
        self.hue = Some(hue);
        surface.bend(hue);
        hue.mask()
    }

    /// Whether a prism has parted it already.
    pub fn is_parted(&self) -> bool {
        self.hue.is_some()
    }

    /// Leaves `surface` along `wi`: what is left of the light, 1 in each channel unless it is parted now.
    pub fn leave(&mut self, surface: &Surface, wi: Vec3) -> Rgb {
        let offered = self.offered.take();
        if wi.dot(surface.ng) >= 0.0 {
            return Rgb::WHITE;
        }
        self.medium = surface.beyond;
        match offered {
            Some(hue) => {
                self.hue = Some(hue);
                hue.mask() * 3.0
            }
            None => Rgb::WHITE,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, MaterialId, Mesh, Ray, Scene, World};

    /// A sheet of the plane y = 0 that bounds a dispersive solid below it.
    fn prism(dispersion: f32) -> World {
        let volume = Some(Volume { attenuation_color: Rgb::splat(0.5), attenuation_distance: 2.0 });
        let material = Material {
            metallic: 0.0,
            roughness: 0.0,
            transmission: 1.0,
            ior: 1.5,
            volume,
            dispersion,
            ..Material::default()
        };
        let positions = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]];
        let mesh = Mesh {
            positions: positions.map(|[x, z]| Vec3::new(x, 0.0, z)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            materials: vec![MaterialId(0); 2],
            ..Mesh::default()
        };
        World::new(Scene { mesh, materials: vec![material], ..Scene::default() })
    }

    #[test]
    fn a_path_keeps_its_hue_and_is_bent_by_it() {
        let world = prism(1.0);
        let down = Vec3::new(0.6, -0.8, 0.0);
        let ray = Ray::new(-0.5 * down, down);
        let hit = world.closest(&ray).expect("the sheet");
        let mut rng = Rng::new(1, 0);
        let (mut sum, mut bent) = (Rgb::BLACK, Vec::new());
        for _ in 0..3000 {
            let (mut passage, mut surface) = (Passage::default(), world.surface(&ray, &hit));
            assert_eq!(passage.meet(&mut surface, 0.5, &mut rng), Rgb::WHITE);
            let eta = surface.bsdf.layers.eta();
            let refracted = surface.bsdf.delta_lobes(-down)[1].expect("through").wi;
            assert!((refracted.x - 0.6 * eta).abs() < 1e-5, "Snell's law for the hue");
            assert_eq!(
                { passage }.leave(&surface, Vec3::Y),
                Rgb::WHITE,
                "what is reflected keeps its colours"
            );
            let left = passage.leave(&surface, refracted);
            sum += left / 3000.0;
            bent.push((eta, left));
            let mut again = world.surface(&ray, &hit);
            let second = passage.meet(&mut again, 2.0, &mut rng);
            assert_eq!(again.bsdf.layers.eta(), eta, "the same hue");
            assert_eq!(second, Rgb::splat(0.5), "absorbed, and not parted again");
        }
        assert!((sum - Rgb::WHITE).max_channel().abs() < 4.9 * (2.0f32 / 3000.0).sqrt(), "{sum:?}");
        let mean = |of: fn(&Rgb) -> f32| {
            let all: Vec<f32> =
                bent.iter().filter(|(_, left)| of(left) > 0.0).map(|(eta, _)| 1.0 / eta).collect();
            all.iter().sum::<f32>() / all.len() as f32
        };
        assert!(mean(|c| c.r) < mean(|c| c.g) && mean(|c| c.g) < mean(|c| c.b), "blue is bent most");
        // n_F − n_C = (n − 1)/V = 0.5/20: red and blue bands lie a little farther apart than those lines.
        let spread = mean(|c| c.b) - mean(|c| c.r);
        assert!((spread / 0.025 - 1.25).abs() < 0.2, "{spread}");
    }

    #[test]
    fn what_does_not_disperse_draws_no_hue() {
        let world = prism(0.0);
        let ray = Ray::new(Vec3::Y, Vec3::NEG_Y);
        let mut surface = world.surface(&ray, &world.closest(&ray).expect("the sheet"));
        let mut passage = Passage::default();
        assert_eq!(passage.meet(&mut surface, 1.0, &mut Rng::new(0, 0)), Rgb::WHITE);
        assert!(!passage.is_parted());
    }
}
