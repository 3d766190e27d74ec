//! Emissive surfaces: a plane convex polygon that shines, and how one draws a point on it.

use super::spherical::SphericalTriangle;
use crate::Rgb;
use crate::math::{Vec2, Vec3, to_world};
use crate::polygon::polygon_irradiance;
use crate::sampling;
use std::f32::consts::PI;

/// A plane convex polygon that shines with one radiance, or one triangle whose texture shines unevenly.
#[derive(Clone, Debug)]
pub struct PolygonLight {
    /// Corners, counter-clockwise as seen from the front; metres. 3 to [`MAX_CORNERS`](super::merge::MAX_CORNERS).
    pub vertices: Vec<Vec3>,
    /// Unit normal on the front.
    pub normal: Vec3,
    /// Of one side, m².
    pub area: f32,
    /// Radiance, cd/m²; the mean over the triangle where a texture shines.
    pub radiance: Rgb,
    /// Whether both sides shine, or the front alone.
    pub two_sided: bool,
    /// The triangles of the mesh it is made of.
    pub triangles: Vec<u32>,
}

/// Below this solid angle (sr) a point is drawn evenly in area: there cos/d² hardly varies, and corners in f32 are too
/// coarse for the spherical triangle. Above the upper bound the point almost lies in the polygon's plane.
const SOLID_ANGLES: std::ops::Range<f64> = 1e-3..6.2;

impl PolygonLight {
    /// Light that leaves it, lm.
    pub fn flux(&self) -> Rgb {
        self.radiance * (PI * self.area * if self.two_sided { 2.0 } else { 1.0 })
    }

    /// Irradiance (lx) at `p` with unit normal `n` if nothing stood between; for a zero `n` that of a surface that
    /// faced every part of it, L times the solid angle.
    pub fn irradiance(&self, p: Vec3, n: Vec3) -> Rgb {
        if !self.shines_on(p) {
            return Rgb::BLACK;
        }
        if n == Vec3::ZERO {
            return self.radiance * self.fan(p).map(|t| t.solid_angle as f32).sum::<f32>();
        }
        self.radiance * (PI * polygon_irradiance(p, n, &self.vertices))
    }

    /// Whether `p` lies on a side that shines.
    pub fn shines_on(&self, p: Vec3) -> bool {
        let height = (p - self.vertices[0]).dot(self.normal);
        height > 0.0 || (self.two_sided && height < 0.0)
    }

    /// A point on it for a receiver at `p`, and its density over the solid angle about `p`, 1/sr; `u` in [0, 1)².
    /// `None` where the polygon sends no light to `p`.
    pub fn sample(&self, p: Vec3, u: [f32; 2]) -> Option<(Vec3, f32)> {
        if !self.shines_on(p) {
            return None;
        }
        let total: f64 = self.fan(p).map(|t| t.solid_angle).sum();
        if !SOLID_ANGLES.contains(&total) {
            let point = self.point(u);
            let way = point - p;
            let pdf = self.area_pdf(way)?;
            return Some((point, pdf));
        }
        let mut left = u[0] as f64 * total;
        let mut chosen = None;
        for t in self.fan(p).filter(|t| t.solid_angle > 0.0) {
            chosen = Some((t, (left / t.solid_angle).min(1.0)));
            left -= t.solid_angle;
            if left < 0.0 {
                break;
            }
        }
        let (triangle, u0) = chosen?;
        let d = triangle.sample([u0, u[1] as f64]);
        let normal = self.normal.as_dvec3();
        let from = p.as_dvec3();
        let t = (self.vertices[0].as_dvec3() - from).dot(normal) / d.dot(normal);
        (t.is_finite() && t > 0.0).then(|| ((from + d * t).as_vec3(), (1.0 / total) as f32))
    }

    /// The density (1/sr) with which [`PolygonLight::sample`] gives `point` on it to a receiver at `p`.
    pub fn pdf(&self, p: Vec3, point: Vec3) -> f32 {
        if !self.shines_on(p) {
            return 0.0;
        }
        let total: f64 = self.fan(p).map(|t| t.solid_angle).sum();
        if SOLID_ANGLES.contains(&total) {
            (1.0 / total) as f32
        } else {
            self.area_pdf(point - p).unwrap_or(0.0)
        }
    }

    /// A point even in area; `u` in [0, 1)².
    pub fn point(&self, u: [f32; 2]) -> Vec3 {
        let first = self.vertices[0];
        let mut left = u[0] * self.area;
        let last = self.vertices.len() - 2;
        for i in 1..=last {
            let (b, c) = (self.vertices[i], self.vertices[i + 1]);
            let area = crate::triangle::area(first, b, c);
            if left < area || i == last {
                let (v, w) = sampling::triangle(Vec2::new((left / area).clamp(0.0, 1.0), u[1]));
                return first + (b - first) * v + (c - first) * w;
            }
            left -= area;
        }
        first
    }

    /// A unit direction from the front, in proportion to its cosine with the normal (density cos/π), and the side
    /// that a `u[0]` below one half sends to the back when both shine; the density then is cos/2π.
    pub(crate) fn direction(&self, u: [f32; 2]) -> Vec3 {
        let (side, u0) = match (self.two_sided, u[0] < 0.5) {
            (false, _) => (1.0, u[0]),
            (true, true) => (-1.0, 2.0 * u[0]),
            (true, false) => (1.0, 2.0 * u[0] - 1.0),
        };
        to_world(sampling::cosine_hemisphere(Vec2::new(u0, u[1])), self.normal * side)
    }

    /// Density over solid angle of a point drawn evenly in area, d² / (A cos); `None` edge-on.
    fn area_pdf(&self, way: Vec3) -> Option<f32> {
        let d2 = way.length_squared();
        let cos = way.dot(self.normal).abs() / d2.sqrt();
        let pdf = d2 / (self.area * cos);
        (pdf.is_finite() && pdf > 0.0).then_some(pdf)
    }

    /// The triangles of the polygon as seen from `p`.
    fn fan(&self, p: Vec3) -> impl Iterator<Item = SphericalTriangle> + '_ {
        let p = p.as_dvec3();
        let way = move |v: Vec3| v.as_dvec3() - p;
        let first = way(self.vertices[0]);
        self.vertices[1..].windows(2).map(move |v| SphericalTriangle::new(first, way(v[0]), way(v[1])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emitter::testing::points;

    fn quad(two_sided: bool) -> PolygonLight {
        let vertices = vec![Vec3::ZERO, Vec3::X * 2.0, Vec3::new(2.0, 1.0, 0.0), Vec3::Y];
        PolygonLight {
            vertices,
            normal: Vec3::Z,
            area: 2.0,
            radiance: Rgb::WHITE,
            two_sided,
            triangles: vec![],
        }
    }

    /// ∫ cos/π dω by sampling is the form factor, near (solid angle) and far (area), and pdf agrees with sample.
    #[test]
    fn samples_give_the_closed_form() {
        let light = quad(false);
        for p in [Vec3::new(0.3, 0.2, 0.1), Vec3::new(3.0, -1.0, 1.0), Vec3::new(20.0, 30.0, 60.0)] {
            let n = (Vec3::new(1.0, 0.5, 0.0) - p).normalize();
            let (mut sum, k) = (0f64, 50_000);
            for u in points(k) {
                let (point, pdf) = light.sample(p, [u[0], u[1]]).expect("in front");
                assert!((light.pdf(p, point) / pdf - 1.0).abs() < 1e-4);
                assert!(point.z.abs() < 1e-5 && point.x > -1e-5 && point.x < 2.0 + 1e-5);
                sum += ((point - p).normalize().dot(n).max(0.0) / (PI * pdf)) as f64 / k as f64;
            }
            let exact = polygon_irradiance(p, n, &light.vertices);
            assert!((sum as f32 / exact - 1.0).abs() < 1e-3, "{p}: {sum} {exact}");
        }
    }

    #[test]
    fn the_back_is_dark_unless_two_sided() {
        let behind = Vec3::new(0.5, 0.5, -1.0);
        assert!(quad(false).sample(behind, [0.5; 2]).is_none() && quad(false).pdf(behind, Vec3::ZERO) == 0.0);
        assert!(quad(true).sample(behind, [0.5; 2]).is_some());
        assert!(quad(false).irradiance(behind, Vec3::Z).is_black());
    }

    #[test]
    fn directions_leave_the_sides_that_shine() {
        for i in 0..100 {
            let u = [(i as f32 + 0.5) / 100.0, 0.37];
            assert!(quad(false).direction(u).z > 0.0);
            assert_eq!(quad(true).direction(u).z > 0.0, u[0] >= 0.5);
            assert!((quad(true).direction(u).length() - 1.0).abs() < 1e-5);
        }
    }
}
