//! Clearcoat, sheen and other lobes that few materials have, looked up where they have them.

use super::lookup::Point;
use super::normals::{Normals, lift};
use crate::bsdf::{Clearcoat, Film, Shading, Sheen, Translucency};
use crate::math::{Vec2, Vec3};
use crate::{Rgb, TextureRef};

impl Point<'_> {
    /// `shading` with the lobes that only few materials have.
    pub fn with_lobes(&self, shading: Shading, normals: &Normals) -> Shading {
        let m = self.material;
        if !m.has_lobes() {
            return shading;
        }
        Shading {
            clearcoat: m.clearcoat.map(|c| Clearcoat {
                strength: c.strength * self.linear(&c.strength_texture, 0),
                roughness: c.roughness * self.linear(&c.roughness_texture, 1),
                normal: self.of_coat(&c.normal_texture, c.normal_scale, normals),
            }),
            sheen: m.sheen.map(|s| Sheen {
                color: s.color * self.srgb(&s.color_texture),
                roughness: s.roughness * self.linear(&s.roughness_texture, 3),
            }),
            translucency: m.diffuse_transmission.map(|t| Translucency {
                share: t.share * self.linear(&t.share_texture, 3),
                color: t.color * self.srgb(&t.color_texture),
            }),
            film: m.iridescence.map(|f| {
                let [thin, thick] = f.thickness;
                let thickness = thin + (thick - thin) * self.linear(&f.thickness_texture, 1);
                Film { share: f.share * self.linear(&f.share_texture, 0), ior: f.ior, thickness }
            }),
            anisotropy: m.anisotropy.and_then(|a| {
                let (mut strength, mut direction) = (a.strength, Vec2::X);
                if let Some((texture, uv)) = self.texture(&a.texture) {
                    let [x, y, z, _] = texture.sample_linear(uv);
                    strength *= z;
                    direction = Vec2::new(2.0 * x - 1.0, 2.0 * y - 1.0).normalize_or(Vec2::X);
                }
                let direction = Vec2::from_angle(a.rotation).rotate(direction);
                let n = if normals.front { normals.smooth } else { -normals.smooth };
                let (t, b) = self.tangent_frame(n)?;
                Some((strength, t * direction.x + b * direction.y))
            }),
            ..shading
        }
    }

    /// The normal of a clearcoat: its own map on the smooth normal, on the viewer's side.
    fn of_coat(&self, map: &Option<TextureRef>, scale: f32, normals: &Normals) -> Vec3 {
        let side = if normals.front { 1.0 } else { -1.0 };
        let mapped = self.mapped(normals.smooth * side, map, scale) * side;
        lift(mapped, normals.geometric)
    }

    fn linear(&self, map: &Option<TextureRef>, channel: usize) -> f32 {
        self.texture(map).map_or(1.0, |(texture, uv)| texture.sample_linear(uv)[channel])
    }

    fn srgb(&self, map: &Option<TextureRef>) -> Rgb {
        self.texture(map).map_or(Rgb::WHITE, |(texture, uv)| texture.sample_srgb(uv).0)
    }
}
