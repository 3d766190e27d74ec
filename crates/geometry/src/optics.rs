//! Reflect, refract, Fresnel: both passes send rays on through glass.
//!
//! Every direction points *away* from the surface, on both sides of an event: `wo` is where the path came from,
//! the result is where it goes on. The relative index is always `eta = n_i / n_t`: the index of the medium that
//! holds `wo` over the index of the one beyond. Entering glass from air it is 1/1.5, leaving it 1.5.

use crate::Rgb;
use crate::math::Vec3;

/// The mirror direction of the unit vector `wo` about the unit normal `n`: 2 (n·wo) n − wo.
///
/// Unit length to rounding; the sign of `n` does not matter.
pub fn reflect(wo: Vec3, n: Vec3) -> Vec3 {
    n * (2.0 * n.dot(wo)) - wo
}

/// The direction in which light goes on through an interface (Snell's law), unit length, away from the surface.
///
/// ```text
/// w_t = −η w_o + (η cos θ_i − cos θ_t) n,   cos² θ_t = 1 − η² (1 − cos² θ_i)
/// ```
/// Many texts print this for a vector that points *toward* the surface, which bends the ray the wrong way here.
///
/// - `wo`: unit, away from the surface, on the side of `n`.
/// - `n`: unit normal on the side of `wo`.
/// - `eta`: n_i / n_t, > 0.
///
/// Returns `None` at total internal reflection.
pub fn refract(wo: Vec3, n: Vec3, eta: f32) -> Option<Vec3> {
    let cos_i = n.dot(wo);
    let cos_t = cos_transmitted(cos_i, eta)?;
    let wt = wo * -eta + n * (eta * cos_i - cos_t);
    // Rounding of a long chain of interfaces must not add up: the formula alone drifts by some ulp each time.
    Some(wt.normalize())
}

/// cos θ_t of Snell's law, or `None` beyond the critical angle.
fn cos_transmitted(cos_i: f32, eta: f32) -> Option<f32> {
    // 1 − η²(1 − c²), arranged so that an index just off 1 does not cancel.
    let cos2 = (1.0 - eta) * (1.0 + eta) + (eta * cos_i) * (eta * cos_i);
    (cos2 >= 0.0).then(|| cos2.min(1.0).sqrt())
}

/// Share of unpolarised light that the interface of two clear media reflects: Fresnel's equations, exact.
///
/// - `cos_i`: cosine between the normal and the incident direction, clamped to [0, 1].
/// - `eta`: n_i / n_t, > 0.
///
/// Returns a value in [0, 1]: exactly 0 for `eta` = 1, 1 beyond the critical angle; never NaN.
pub fn fresnel_dielectric(cos_i: f32, eta: f32) -> f32 {
    if eta == 1.0 {
        return 0.0; // the formula gives 0/0 at grazing incidence
    }
    let cos_i = cos_i.clamp(0.0, 1.0);
    let Some(cos_t) = cos_transmitted(cos_i, eta) else { return 1.0 };
    let ratio = |a: f32, b: f32| if a + b > 0.0 { (a - b) / (a + b) } else { 1.0 };
    let s = ratio(eta * cos_i, cos_t);
    let p = ratio(cos_i, eta * cos_t);
    0.5 * (s * s + p * p)
}

/// (1 − cos)⁵, the angular part of Schlick's approximation; 0 at normal incidence, 1 at grazing.
pub fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// Schlick's approximation F0 + (1 − F0)(1 − cos)⁵ of Fresnel's equations, channel by channel.
///
/// C. Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", Computer Graphics Forum 13(3), 1994.
pub fn schlick(f0: Rgb, cos: f32) -> Rgb {
    f0.lerp(Rgb::WHITE, schlick_weight(cos))
}

/// Reflectance at normal incidence between air and a medium of index `ior`: ((n − 1)/(n + 1))².
///
/// 0.04 for 1.5; 1 for the `ior` = 0 of KHR_materials_ior, as that extension asks.
pub fn f0_from_ior(ior: f32) -> f32 {
    let r = (ior - 1.0) / (ior + 1.0);
    r * r
}

/// Share of light left after `t` metres of a coloured medium, each channel in [0, 1]: color^(t / distance).
///
/// Beer and Lambert's law as KHR_materials_volume parametrises it.
/// - `color`: share left after `distance`, in [0, 1].
/// - `distance`: m, > 0; infinite for a clear medium.
/// - `t`: m, ≥ 0.
pub fn attenuation(color: Rgb, distance: f32, t: f32) -> Rgb {
    if t <= 0.0 || distance.is_infinite() {
        return Rgb::WHITE;
    }
    let x = t / distance.max(f32::MIN_POSITIVE);
    color.map(|c| c.clamp(0.0, 1.0).powf(x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{self, Rng};

    #[test]
    fn snell_holds_and_the_result_is_unit_and_in_the_plane_of_incidence() {
        let mut rng = Rng::new(1, 0);
        let mut reflected = 0;
        for _ in 0..1000 {
            let n = sampling::sphere(rng.vec2());
            let wo = crate::math::to_world(sampling::cosine_hemisphere(rng.vec2()), n);
            let eta = 0.4 + 2.0 * rng.f32();
            let sin_i = n.cross(wo).length();
            let Some(wt) = refract(wo, n, eta) else {
                assert!(eta * sin_i > 1.0 - 1e-5, "refraction exists at η sin θ = {}", eta * sin_i);
                assert_eq!(fresnel_dielectric(n.dot(wo), eta), 1.0);
                reflected += 1;
                continue;
            };
            assert!((wt.length() - 1.0).abs() < 1e-6);
            assert!(wt.dot(n) < 1e-6, "on the far side");
            assert!((n.cross(wt).length() - eta * sin_i).abs() < 2e-6, "Snell");
            assert!(wt.dot(n.cross(wo)).abs() < 1e-6, "in the plane of incidence");
            // The tangential part goes on the way it came, away from wo.
            assert!((wt - n * n.dot(wt)).dot(wo - n * n.dot(wo)) <= 1e-6);
        }
        assert!(reflected > 50, "the test saw total internal reflection: {reflected}");
    }

    #[test]
    fn a_ray_at_45_degrees_into_glass() {
        let h = 0.5f32.sqrt();
        let wt = refract(Vec3::new(h, 0.0, h), Vec3::Z, 1.0 / 1.5).unwrap();
        assert!((wt - Vec3::new(-0.471405, 0.0, -0.881917)).length() < 1e-6);
        assert!((reflect(Vec3::new(h, 0.0, h), Vec3::Z) - Vec3::new(-h, 0.0, h)).length() < 1e-6);
    }

    #[test]
    fn fresnel_agrees_with_published_equations() {
        // ior, incidence in degrees, reflectance of one interface: Fresnel's equations in double precision.
        let table = [
            (1.52, 0.0, 0.04257999),
            (1.52, 45.0, 0.05304523),
            (1.52, 80.0, 0.39094986),
            (1.33, 75.0, 0.21142660),
            (1.5, 0.0, 0.04),
            (1.5, 75.0, 0.25306056),
            (2.0, 45.0, 0.12265076),
        ];
        for (n, degrees, expected) in table {
            let f = fresnel_dielectric((degrees as f32).to_radians().cos(), 1.0 / n);
            assert!((f - expected).abs() < 3e-6, "n {n}, {degrees}°: {f}");
        }
    }

    #[test]
    fn fresnel_is_the_same_from_both_sides_and_never_nan() {
        for n in [1.0f32, 1.0 + 1e-7, 1.0001, 1.5, 2.4, 0.889] {
            for i in 0..=100 {
                let cos = i as f32 / 100.0;
                let grazing = cos < 0.05; // where F goes from 0 to 1 within the rounding of the cosine, for n ≈ 1
                let outside = fresnel_dielectric(cos, 1.0 / n);
                assert!((0.0..=1.0).contains(&outside), "n {n}, cos {cos}: {outside}");
                if let Some(wt) = refract(Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos), Vec3::Z, 1.0 / n) {
                    let inside = fresnel_dielectric(-wt.z, n);
                    // Near the critical angle the slope is steep: 1e-7 in the cosine moves F by 1e-3.
                    assert!(
                        grazing || (inside - outside).abs() < 2e-3,
                        "n {n}, cos {cos}: {outside} {inside}"
                    );
                }
            }
        }
        assert_eq!(fresnel_dielectric(0.0, 1.0), 0.0);
        assert_eq!(fresnel_dielectric(0.7, 1.0), 0.0);
    }

    #[test]
    fn total_internal_reflection_begins_at_the_critical_angle() {
        let critical = (1.0f32 / 1.5).asin(); // 41.81° in glass
        assert!(fresnel_dielectric((critical + 1e-3).cos(), 1.5) == 1.0);
        assert!(fresnel_dielectric((critical - 1e-3).cos(), 1.5) < 0.9);
    }

    #[test]
    fn attenuation_is_a_power_of_the_path() {
        let c = Rgb::new(0.25, 1.0, 0.0);
        assert_eq!(attenuation(c, 2.0, 2.0), c);
        assert!((attenuation(c, 2.0, 1.0).r - 0.5).abs() < 1e-6);
        assert_eq!(attenuation(c, f32::INFINITY, 1e9), Rgb::WHITE);
        assert_eq!(attenuation(c, 2.0, 0.0), Rgb::WHITE);
    }

    #[test]
    fn f0_of_glass_and_of_no_index() {
        assert!((f0_from_ior(1.5) - 0.04).abs() < 1e-7);
        assert_eq!(f0_from_ior(0.0), 1.0);
        assert_eq!(schlick(Rgb::splat(0.04), 0.0), Rgb::WHITE);
    }
}
