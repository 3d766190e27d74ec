//! Emissive surfaces: a plane convex polygon that shines, and how one draws a point on it.

use super::spherical::SphericalTriangle;
use crate::Rgb;
use crate::math::{Vec2, Vec3, to_world};
use crate::polygon::polygon_irradiance;
use crate::sampling;
use glam::DVec3;
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
    /// Mean of the corners, and how far the farthest is from it, m.
    centre: Vec3,
    radius: f32,
}

/// From a polygon of less than this solid angle (sr) a point is drawn evenly in area: cos/d² varies by a tenth over it,
/// which adds a hundredth to the variance of what is seen or not, and the spherical triangle takes most of the time of a
/// sample.
const SMALL: f32 = 0.03;
/// The same for one that fills almost the whole hemisphere, sr: there the point almost lies in its plane.
const LARGE: f64 = 6.2;

impl PolygonLight {
    /// Of the corners of a plane convex polygon; see the fields.
    pub fn new(
        vertices: Vec<Vec3>,
        normal: Vec3,
        area: f32,
        radiance: Rgb,
        two_sided: bool,
        triangles: Vec<u32>,
    ) -> PolygonLight {
        let centre = vertices.iter().sum::<Vec3>() / vertices.len() as f32;
        let radius = vertices.iter().map(|v| v.distance(centre)).fold(0.0, f32::max);
        PolygonLight { vertices, normal, area, radiance, two_sided, triangles, centre, radius }
    }

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
            return self.radiance * Fan::new(&self.vertices, p).solid_angle as f32;
        }
        self.radiance * (PI * polygon_irradiance(p, n, &self.vertices))
    }

    /// Whether it is seen so small, and so far from the horizon of `n`, that its middle stands for all of it: about, so
    /// for choosing among lights.
    pub fn looks_small(&self, p: Vec3, n: Vec3) -> bool {
        let way = self.centre - p;
        n != Vec3::ZERO
            && way.length_squared() > 100.0 * self.radius * self.radius
            && way.dot(n).abs() > self.radius
    }

    /// About [`PolygonLight::irradiance`], the mean of the channels: exact unless it looks small.
    pub fn irradiance_about(&self, p: Vec3, n: Vec3) -> f32 {
        if !self.looks_small(p, n) {
            return self.irradiance(p, n).mean();
        }
        let way = self.centre - p;
        let facing = -way.dot(self.normal);
        let facing = if self.two_sided { facing.abs() } else { facing.max(0.0) };
        let d2 = way.length_squared();
        self.radiance.mean() * self.area * (facing / d2) * (way.dot(n).max(0.0) / d2)
    }

    /// Whether `p` lies on a side that shines.
    pub fn shines_on(&self, p: Vec3) -> bool {
        let height = (p - self.vertices[0]).dot(self.normal);
        height > 0.0 || (self.two_sided && height < 0.0)
    }

    /// The polygon as `p` sees it; `None` where it sends no light there.
    #[inline]
    pub fn seen_from(&self, p: Vec3) -> Option<Seen<'_>> {
        let way = self.centre - p;
        let d2 = way.length_squared();
        let height = -way.dot(self.normal);
        if !self.shines_on(p) {
            return None;
        }
        let small =
            d2 > 16.0 * self.radius * self.radius && self.area * height.abs() < SMALL * d2 * d2.sqrt();
        let fan = if small { None } else { Some(Fan::new(&self.vertices, p)) };
        let fan = fan.filter(|f| f.solid_angle > 1e-6 && f.solid_angle < LARGE);
        Some(Seen { light: self, p, fan })
    }

    /// A point on it for a receiver at `p`, and its density over the solid angle about `p`, 1/sr; `u` in [0, 1)².
    /// `None` where the polygon sends no light to `p`.
    pub fn sample(&self, p: Vec3, u: [f32; 2]) -> Option<(Vec3, f32)> {
        self.seen_from(p)?.sample(u)
    }

    /// The density (1/sr) with which [`PolygonLight::sample`] gives `point` on it to a receiver at `p`.
    pub fn pdf(&self, p: Vec3, point: Vec3) -> f32 {
        self.seen_from(p).map_or(0.0, |seen| seen.pdf(point))
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
}

/// A polygon as one point sees it: what all samples toward it share.
#[derive(Clone, Debug)]
pub struct Seen<'a> {
    light: &'a PolygonLight,
    p: Vec3,
    /// `None` for one that is drawn evenly in area.
    fan: Option<Fan>,
}

impl Seen<'_> {
    /// The polygon itself.
    pub fn shape(&self) -> &PolygonLight {
        self.light
    }

    /// See [`PolygonLight::sample`].
    pub fn sample(&self, u: [f32; 2]) -> Option<(Vec3, f32)> {
        let Some(fan) = &self.fan else {
            let point = self.light.point(u);
            return Some((point, self.light.area_pdf(point - self.p)?));
        };
        let d = fan.sample(u)?;
        let (normal, from) = (self.light.normal.as_dvec3(), self.p.as_dvec3());
        let t = (self.light.vertices[0].as_dvec3() - from).dot(normal) / d.dot(normal);
        (t.is_finite() && t > 0.0).then(|| ((from + d * t).as_vec3(), fan.pdf()))
    }

    /// See [`PolygonLight::pdf`].
    pub fn pdf(&self, point: Vec3) -> f32 {
        match &self.fan {
            Some(fan) => fan.pdf(),
            None => self.light.area_pdf(point - self.p).unwrap_or(0.0),
        }
    }
}

/// The triangles of a polygon around its first corner, as a point sees them.
#[derive(Clone, Debug)]
struct Fan {
    triangles: Vec<SphericalTriangle>,
    /// Of all, sr.
    solid_angle: f64,
}

impl Fan {
    fn new(vertices: &[Vec3], p: Vec3) -> Fan {
        let p = p.as_dvec3();
        let way = |v: Vec3| (v.as_dvec3() - p).normalize_or_zero();
        let first = way(vertices[0]);
        let mut from = way(vertices[1]);
        let mut fan = Fan { triangles: Vec::with_capacity(vertices.len() - 2), solid_angle: 0.0 };
        for &v in &vertices[2..] {
            let to = way(v);
            let triangle = SphericalTriangle::new(first, from, to);
            if triangle.solid_angle > 0.0 {
                fan.solid_angle += triangle.solid_angle;
                fan.triangles.push(triangle);
            }
            from = to;
        }
        fan
    }

    fn sample(&self, u: [f32; 2]) -> Option<DVec3> {
        let mut left = f64::from(u[0]) * self.solid_angle;
        let (last, before) = self.triangles.split_last()?;
        for t in before {
            if left < t.solid_angle {
                return Some(t.sample([left / t.solid_angle, f64::from(u[1])]));
            }
            left -= t.solid_angle;
        }
        Some(last.sample([(left / last.solid_angle).min(1.0), f64::from(u[1])]))
    }

    fn pdf(&self) -> f32 {
        (1.0 / self.solid_angle) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emitter::testing::points;

    fn quad(two_sided: bool) -> PolygonLight {
        let vertices = vec![Vec3::ZERO, Vec3::X * 2.0, Vec3::new(2.0, 1.0, 0.0), Vec3::Y];
        PolygonLight::new(vertices, Vec3::Z, 2.0, Rgb::WHITE, two_sided, vec![])
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

    /// Where a middle stands for the whole the error is small, and what is below the horizon brings nothing.
    #[test]
    fn a_light_that_looks_small_is_about_its_middle() {
        let light = quad(false);
        for (p, n) in [
            (Vec3::new(3.0, -1.0, 20.0), Vec3::NEG_Z),
            (Vec3::new(9.0, 9.0, 9.0), Vec3::new(-1.0, -0.5, -0.2).normalize()),
            (Vec3::new(0.5, 0.5, 30.0), Vec3::Z),
        ] {
            assert!(light.looks_small(p, n));
            let (about, exact) = (light.irradiance_about(p, n), light.irradiance(p, n).mean());
            assert!((about - exact).abs() <= 0.02 * exact, "{p}: {about} {exact}");
        }
        assert!(!light.looks_small(Vec3::new(0.0, 0.0, 5.0), Vec3::NEG_Z), "near");
        assert!(!light.looks_small(Vec3::new(1.0, 0.5, 20.0), Vec3::X), "on the horizon");
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
