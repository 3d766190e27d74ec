//! Interference in a thin film: soap, oil, tempered steel.

use super::shading::Film;
use crate::Rgb;
use crate::optics::{fresnel_dielectric, schlick_weight};
use std::f32::consts::{PI, TAU};

/// Orders of interference that are summed: the third is below 1 % for anything but a film between mirrors.
const ORDERS: i32 = 2;

/// Share of light that a film over a base of reflectance `f0` (at normal incidence, in air) reflects, [0, 1].
///
/// L. Belcour and P. Barla, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence",
/// ACM Trans. Graph. 36(4), 2017, with Schlick's Fresnel term for the base as in KHR_materials_iridescence: Airy's
/// series, each order seen through the Gaussian fit of the eye's sensitivity in Fourier space. Divided by the fit's own
/// white, so that a film that does nothing leaves greys grey (the extension's reference lets them turn pink).
pub fn reflectance(film: &Film, f0: Rgb, cos: f32) -> Rgb {
    let cos = cos.clamp(0.0, 1.0);
    // A film of no thickness is not there.
    let t = (film.thickness / 0.03).clamp(0.0, 1.0);
    let n = 1.0 + (film.ior - 1.0) * (t * t * (3.0 - 2.0 * t));
    let inside2 = 1.0 - (1.0 - cos * cos) / (n * n);
    if inside2 < 0.0 {
        return Rgb::WHITE;
    }
    let inside = inside2.sqrt();
    let schlick = |f0: f32, cos: f32| f0 + (1.0 - f0) * schlick_weight(cos);
    let normal = |a: f32, b: f32| ((a - b) / (a + b)).powi(2);
    // Exact, where the extension has Schlick: he reflects at grazing angles even what is not there.
    let outer = fresnel_dielectric(cos, 1.0 / n);
    let through = 1.0 - outer;
    let way = 2.0 * n * film.thickness * inside;
    let channel = |f0: f32| {
        let root = f0.clamp(0.0, 0.9999).sqrt();
        let base = (1.0 + root) / (1.0 - root);
        (schlick(normal(base, n), inside), if base < n { PI } else { 0.0 })
    };
    let base = [channel(f0.r), channel(f0.g), channel(f0.b)];
    let between = base.map(|(r, _)| (outer * r).clamp(0.0, 0.9999).sqrt());
    let inner: [f32; 3] =
        std::array::from_fn(|c| through * through * base[c].0 / (1.0 - between[c] * between[c]));
    let mut out = inner.map(|inner| outer + inner);
    for m in 1..=ORDERS {
        // Within the film, light is reflected at the outer face with its phase turned: the film is denser than air.
        let seen = sensitivity(m as f32 * way, base.map(|(_, shift)| m as f32 * (PI + shift)));
        for ((out, seen), (inner, between)) in out.iter_mut().zip(seen).zip(inner.iter().zip(between)) {
            *out += (inner - through) * between.powi(m) * 2.0 * seen;
        }
    }
    Rgb::from(out).map(|v| v.clamp(0.0, 1.0))
}

/// Fourier transform of the eye's sensitivity at an optical way of `way` nm, as Rec. 709, a phase for each channel.
fn sensitivity(way: f32, shift: [f32; 3]) -> [f32; 3] {
    let phase = TAU * way * 1e-9;
    let lobe = |value: f32, position: f32, variance: f32, shift: f32| {
        value * (TAU * variance).sqrt() * (position * phase + shift).cos() * (-phase * phase * variance).exp()
    };
    let xyz = |shift: f32| {
        [
            lobe(5.4856e-13, 1.6810e6, 4.3278e9, shift) + lobe(9.7470e-14, 2.2399e6, 4.5282e9, shift),
            lobe(4.4201e-13, 1.7953e6, 9.3046e9, shift),
            lobe(5.2481e-13, 2.2084e6, 6.6121e9, shift),
        ]
        .map(|v| v / 1.0685e-7)
    };
    // Rec. 709 from CIE XYZ, each row divided by its sum.
    const ROWS: [[f32; 3]; 3] = [
        [3.240_454_2, -1.537_138_5, -0.498_531_4],
        [-0.969_266, 1.876_010_8, 0.041_556],
        [0.055_643_4, -0.204_025_9, 1.057_225_2],
    ];
    std::array::from_fn(|c| {
        let v = xyz(shift[c]);
        let row = ROWS[c];
        (row[0] * v[0] + row[1] * v[1] + row[2] * v[2]) / (row[0] + row[1] + row[2])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::schlick;

    #[test]
    fn a_film_of_no_thickness_or_of_no_step_changes_nothing() {
        let f0 = Rgb::new(0.04, 0.3, 0.9);
        for film in
            [Film { share: 1.0, ior: 1.4, thickness: 0.0 }, Film { share: 1.0, ior: 1.0, thickness: 300.0 }]
        {
            for cos in [1.0, 0.5, 0.1] {
                let (with, without) = (reflectance(&film, f0, cos), schlick(f0, cos));
                let d = (with - without).map(f32::abs).max_channel();
                assert!(d < 1e-3, "{film:?} at {cos}: {with:?}, {without:?}");
            }
        }
    }

    #[test]
    fn a_soap_film_is_black_where_thin_and_grey_where_thick() {
        // Index 1.33 in air: the two faces cancel as the film vanishes, and reflect 2R/(1 + R) each for itself.
        let of = |thickness| reflectance(&Film { share: 1.0, ior: 1.33, thickness }, Rgb::BLACK, 1.0);
        assert!(of(5.0).max_channel() < 0.01, "{:?}", of(5.0));
        let (thick, r) = (of(20_000.0), 0.02006f32);
        assert!((thick - Rgb::splat(2.0 * r / (1.0 + r))).map(f32::abs).max_channel() < 2e-3, "{thick:?}");
        // A quarter of a wave of 550 nm there and back: the brightest green.
        assert!(of(550.0 / (4.0 * 1.33)).g > 3.5 * r);
    }

    #[test]
    fn it_stays_within_bounds() {
        for i in 0..40 {
            for cos in [0.0, 0.02, 0.3, 0.7, 1.0] {
                for (f0, ior) in [(0.0, 1.3), (0.04, 1.8), (0.95, 1.3), (1.0, 2.5), (0.04, 1.0)] {
                    let film = Film { share: 1.0, ior, thickness: 37.0 * i as f32 };
                    let r = reflectance(&film, Rgb::splat(f0), cos);
                    assert!(r.is_finite() && r.min_channel() >= 0.0 && r.max_channel() <= 1.0);
                }
            }
        }
    }
}
