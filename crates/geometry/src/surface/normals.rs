//! Geometric, smooth and shading normal of a point, all turned toward the viewer.

use super::lookup::Point;
use crate::TextureRef;
use crate::math::Vec3;

/// Smallest cosine kept between the shading normal and both the viewer and the geometric normal.
const MIN_COS: f32 = 1e-3;

/// The three normals of a point, unit, on the viewer's side.
pub(super) struct Normals {
    /// Whether the viewer sees the triangle's front.
    pub front: bool,
    /// Of the triangle.
    pub geometric: Vec3,
    /// Interpolated from the corners.
    pub smooth: Vec3,
    /// With the normal map.
    pub shading: Vec3,
}

impl Point<'_> {
    /// The normals for a viewer in the unit direction `wo`.
    pub fn normals(&self, wo: Vec3) -> Normals {
        let mut geometric = self.mesh().geometric_normal(self.triangle);
        if geometric == Vec3::ZERO {
            geometric = wo; // a triangle without area: any normal serves
        }
        let front = geometric.dot(wo) >= 0.0;
        let side = if front { 1.0 } else { -1.0 };
        let smooth = self.smooth(geometric);
        let mapped = self.mapped(smooth, &self.material.normal_texture, self.material.normal_scale);
        let geometric = geometric * side;
        let shading = lift(lift(mapped * side, geometric), wo);
        Normals { front, geometric, smooth: smooth * side, shading }
    }

    /// Vertex normals interpolated, on the triangle's front.
    fn smooth(&self, geometric: Vec3) -> Vec3 {
        if self.mesh().normals.is_empty() {
            return geometric;
        }
        let n = self.mesh().interpolate(self.triangle, self.u, self.v, &self.mesh().normals);
        let n = n.try_normalize().unwrap_or(geometric);
        // Some files wind their triangles against their normals; which side is lit is the winding's to say.
        if n.dot(geometric) < 0.0 { -n } else { n }
    }

    /// `n` by a normal map (glTF 2.0, 3.9.3): the texel's x along the tangent, y along the bitangent.
    pub fn mapped(&self, n: Vec3, map: &Option<TextureRef>, scale: f32) -> Vec3 {
        let Some((texture, uv)) = self.texture(map) else { return n };
        let Some((t, b)) = self.tangent_frame(n) else { return n };
        let [x, y, z, _] = texture.sample_linear(uv).map(|c| 2.0 * c - 1.0);
        (t * (x * scale) + b * (y * scale) + n * z.max(0.0)).try_normalize().unwrap_or(n)
    }

    /// Tangent and bitangent, unit, about the unit normal `n` on the triangle's front; `None` where there are none.
    pub fn tangent_frame(&self, n: Vec3) -> Option<(Vec3, Vec3)> {
        if self.mesh().tangents.is_empty() {
            return None;
        }
        let tangent = self.mesh().interpolate(self.triangle, self.u, self.v, &self.mesh().tangents);
        // Interpolation leaves the tangent neither unit nor square to the normal.
        let t = tangent.truncate();
        let t = (t - n * n.dot(t)).try_normalize()?;
        Some((t, n.cross(t) * 1f32.copysign(tangent.w)))
    }
}

/// `n` turned just enough toward the unit vector `to` that their cosine is at least [`MIN_COS`].
pub(super) fn lift(n: Vec3, to: Vec3) -> Vec3 {
    let cos = n.dot(to);
    if cos >= MIN_COS {
        return n;
    }
    let flat = (n - to * cos).try_normalize().unwrap_or_else(|| crate::math::frame(to).0);
    flat * (1.0 - MIN_COS * MIN_COS).sqrt() + to * MIN_COS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lifting_changes_only_what_points_away() {
        let n = Vec3::new(0.6, 0.0, 0.8);
        assert_eq!(lift(n, Vec3::Z), n);
        for away in [-Vec3::Z, Vec3::new(0.6, 0.0, -0.8), Vec3::X] {
            let l = lift(away, Vec3::Z);
            assert!((l.length() - 1.0).abs() < 1e-6 && l.z > 0.0, "{l}");
        }
    }
}
