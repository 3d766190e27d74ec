//! One point of one triangle: factors, textures and vertex colours multiplied.

use crate::bsdf::{Layers, Shading};
use crate::math::{Vec2, Vec3};
use crate::{AlphaMode, Hit, Material, Mesh, Ray, Rgb, Scene, Texture, TextureRef};

/// The shading of an unlit material: it sends nothing on.
pub(super) const NOTHING: Shading = Shading { base_color: Rgb::BLACK, ..Shading::LAMBERT };

/// Share of the light that meets the surface at all, [0, 1]: 1 opaque, 0 or 1 for a mask, alpha for a blend.
pub fn coverage_at(scene: &Scene, hit: &Hit) -> f32 {
    let point = Point::new(scene, hit.triangle, hit.u, hit.v);
    match point.material.alpha_mode {
        AlphaMode::Opaque => 1.0,
        _ => point.coverage(point.base_color().1),
    }
}

/// Base colour, linear, [0, 1], and alpha: factor, texture and vertex colour.
pub fn base_color_at(scene: &Scene, hit: &Hit) -> (Rgb, f32) {
    Point::new(scene, hit.triangle, hit.u, hit.v).base_color()
}

/// Emitted radiance, cd/m², toward the front or the back; not weighted by coverage. Black for an unlit material.
pub fn emission_at(scene: &Scene, hit: &Hit, front: bool) -> Rgb {
    Point::new(scene, hit.triangle, hit.u, hit.v).emission(front)
}

/// Share of light that goes on along `ray` as if nothing were there: what the coverage leaves, and of the rest what a
/// smooth thin wall (or a volume with the index of its surroundings) lets pass. Black for an opaque surface.
///
/// Absorption inside a volume is not in it; see [`super::Surface::before`].
pub fn straight_through(scene: &Scene, ray: &Ray, hit: &Hit) -> Rgb {
    let point = Point::new(scene, hit.triangle, hit.u, hit.v);
    if !point.material.may_pass_straight() {
        return Rgb::BLACK;
    }
    let (base_color, alpha) = point.base_color();
    let coverage = point.coverage(alpha);
    let beside = Rgb::splat(1.0 - coverage);
    if coverage == 0.0 || point.material.unlit || point.material.transmission == 0.0 {
        return beside;
    }
    let shading = point.shading(base_color);
    if !shading.is_straight() {
        return beside;
    }
    let normals = point.normals(-ray.direction);
    let cos = -ray.direction.dot(normals.shading);
    beside + Layers::new(&point.with_lobes(shading, &normals), normals.front).straight(cos) * coverage
}

/// A point of a triangle and its material.
pub(super) struct Point<'a> {
    pub scene: &'a Scene,
    pub material: &'a Material,
    pub triangle: u32,
    pub u: f32,
    pub v: f32,
}

impl<'a> Point<'a> {
    pub fn new(scene: &'a Scene, triangle: u32, u: f32, v: f32) -> Point<'a> {
        let material = &scene.materials[scene.mesh.materials[triangle as usize].0 as usize];
        Point { scene, material, triangle, u, v }
    }

    pub fn mesh(&self) -> &'a Mesh {
        &self.scene.mesh
    }

    pub fn position(&self) -> Vec3 {
        let [a, b, c] = self.mesh().corners(self.triangle);
        a + ((b - a) * self.u + (c - a) * self.v)
    }

    /// Base colour and alpha: factor, texture and vertex colour.
    pub fn base_color(&self) -> (Rgb, f32) {
        let m = self.material;
        let (mut color, mut alpha) = (m.base_color, m.alpha);
        if let Some((texture, uv)) = self.texture(&m.base_color_texture) {
            let (c, a) = texture.sample_srgb(uv);
            color *= c;
            alpha *= a;
        }
        if !self.mesh().colors.is_empty() {
            let c = self.mesh().interpolate(self.triangle, self.u, self.v, &self.mesh().colors);
            color *= Rgb::new(c.x, c.y, c.z);
            alpha *= c.w;
        }
        // Vertex colours may exceed 1; a surface that reflects more than it receives lets no solver end.
        (color.min(Rgb::WHITE), alpha.clamp(0.0, 1.0))
    }

    pub fn coverage(&self, alpha: f32) -> f32 {
        match self.material.alpha_mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask(cutoff) => f32::from(alpha >= cutoff),
            AlphaMode::Blend => alpha,
        }
    }

    pub fn emission(&self, front: bool) -> Rgb {
        let m = self.material;
        if m.unlit || m.emissive.is_black() || !(front || m.double_sided) {
            return Rgb::BLACK;
        }
        match self.texture(&m.emissive_texture) {
            Some((texture, uv)) => m.emissive * texture.sample_srgb(uv).0,
            None => m.emissive,
        }
    }

    pub fn shading(&self, base_color: Rgb) -> Shading {
        let m = self.material;
        let linear = |r: &Option<TextureRef>, channel: usize| {
            self.texture(r).map_or(1.0, |(texture, uv)| texture.sample_linear(uv)[channel])
        };
        let (mut metallic, mut roughness) = (m.metallic, m.roughness);
        if let Some((texture, uv)) = self.texture(&m.metallic_roughness_texture) {
            let texel = texture.sample_linear(uv);
            roughness *= texel[1];
            metallic *= texel[2];
        }
        let (mut tint, mut gloss) = (Rgb::WHITE, 1.0);
        if let Some((texture, uv)) = self.texture(&m.specular_color_texture) {
            (tint, gloss) = texture.sample_srgb(uv);
        }
        if let Some(glossiness) = m.glossiness {
            roughness = 1.0 - glossiness * gloss;
        }
        Shading {
            base_color,
            metallic,
            roughness,
            ior: m.ior,
            specular: m.specular * linear(&m.specular_texture, 3),
            specular_color: m.specular_color * tint,
            transmission: m.transmission * linear(&m.transmission_texture, 0),
            solid: m.volume.is_some(),
            ..Shading::LAMBERT
        }
    }

    /// The texture and where in it we are; `None` when the material has none, or names one that is not there.
    pub fn texture(&self, reference: &Option<TextureRef>) -> Option<(&'a Texture, Vec2)> {
        let r = reference.as_ref()?;
        let texture = self.scene.textures.get(r.texture as usize)?;
        let uvs = self.mesh().uvs.get(r.uv_set as usize)?;
        // A part without coordinates in a file where others have them: glTF leaves the result open.
        let uv = if uvs.is_empty() {
            Vec2::ZERO
        } else {
            self.mesh().interpolate(self.triangle, self.u, self.v, uvs)
        };
        Some((texture, r.transform.transform_point2(uv)))
    }
}
