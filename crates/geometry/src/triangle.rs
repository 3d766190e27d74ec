//! Area, normal and solid angle of a triangle.

use crate::Vec3;

/// Area, m².
pub fn area(a: Vec3, b: Vec3, c: Vec3) -> f32 {
    0.5 * (b - a).cross(c - a).length()
}

/// Unit normal on the side from which a, b, c run counter-clockwise; zero for a triangle without area.
pub fn normal(a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    // In f64: the cross product of two short edges underflows f32 in a scene modelled in tiny units.
    let n = (b.as_dvec3() - a.as_dvec3()).cross(c.as_dvec3() - a.as_dvec3());
    n.normalize_or_zero().as_vec3()
}

/// Solid angle of the triangle from the origin of the three vectors, sr, in [0, 2π).
///
/// Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", IEEE Trans. Biomed. Eng. 30(2), 1983, eq. 8.
pub fn solid_angle(a: Vec3, b: Vec3, c: Vec3) -> f32 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let triple = a.dot(b.cross(c)).abs();
    let base = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * triple.atan2(base)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_octant_is_half_pi() {
        assert!((solid_angle(Vec3::X, Vec3::Y, Vec3::Z) - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    }
}
