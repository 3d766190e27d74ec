//! glam under one roof, and the few vector helpers it lacks.

pub use glam::{Affine2, Affine3A, Mat3, Mat4, Quat, Vec2, Vec3, Vec3A, Vec4};

/// Two unit vectors that make a right-handed frame with the unit vector `n`.
///
/// Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017: no branch, no pole.
pub fn frame(n: Vec3) -> (Vec3, Vec3) {
    let sign = 1f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// `local` (z along `n`) to world space.
pub fn to_world(local: Vec3, n: Vec3) -> Vec3 {
    let (s, t) = frame(n);
    s * local.x + t * local.y + n * local.z
}

/// The origin of a ray that leaves a surface at `p` toward the side that `n` (unit, geometric) points to,
/// moved just far enough that it cannot meet that surface again.
///
/// Wächter and Binder, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems, 2019, ch. 6:
/// an offset in units in the last place of `p`, so it scales with the scene; near zero a fixed small step.
pub fn offset_origin(p: Vec3, n: Vec3) -> Vec3 {
    const ORIGIN: f32 = 1.0 / 32.0;
    const FLOAT_SCALE: f32 = 1.0 / 65536.0;
    const INT_SCALE: f32 = 256.0;
    let shift = |p: f32, n: f32| {
        if p.abs() < ORIGIN {
            return p + FLOAT_SCALE * n;
        }
        let ulps = (INT_SCALE * n) as i32;
        let bits = p.to_bits() as i32;
        f32::from_bits((if p < 0.0 { bits.wrapping_sub(ulps) } else { bits.wrapping_add(ulps) }) as u32)
    };
    Vec3::new(shift(p.x, n.x), shift(p.y, n.y), shift(p.z, n.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_is_orthonormal_and_right_handed() {
        for n in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::Z, Vec3::new(0.3, -0.5, -0.81).normalize()] {
            let (s, t) = frame(n);
            assert!((s.cross(t) - n).length() < 1e-6, "{n}");
            assert!((s.length() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn the_offset_scales_with_the_coordinates() {
        for scale in [1e-3f32, 1.0, 1e3, 1e6] {
            let p = Vec3::splat(scale);
            let d = (offset_origin(p, Vec3::Y) - p).y;
            assert!(d > 0.0 && d < 1e-4 * scale.max(1.0), "{scale}: {d}");
        }
    }
}
