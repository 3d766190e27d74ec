//! Prisms: an index of refraction that depends on the wavelength, for light of three channels.
//!
//! A path through a dispersive solid carries one channel from there on, at one wavelength. Each channel stands for a
//! band of wavelengths, about where monochromatic light has that component in Rec. 709; the bands overlap, so that what
//! a prism throws is a rainbow rather than three stripes. White light that is not parted stays white.

use crate::Rgb;

/// Lowest, likeliest and highest wavelength of red, green and blue, nm: triangles under the positive lobes of the
/// matching functions of Rec. 709's primaries (CIE 1931 observer).
const BANDS: [[f32; 3]; 3] = [[555.0, 605.0, 680.0], [480.0, 542.0, 605.0], [410.0, 450.0, 500.0]];

/// Fraunhofer's lines F, d and C, nm.
const LINES: [f32; 3] = [486.1, 587.6, 656.3];

/// One channel of light, at one wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hue {
    /// 0 red, 1 green, 2 blue.
    channel: usize,
    /// nm.
    wavelength: f32,
}

impl Hue {
    /// One of the three channels, and one of its wavelengths.
    ///
    /// - `channel`: 0 red, 1 green, 2 blue.
    /// - `u`: uniform in [0, 1).
    pub fn of_channel(channel: usize, u: f32) -> Hue {
        let [low, middle, high] = BANDS[channel];
        let (rise, fall, width) = (middle - low, high - middle, high - low);
        let wavelength = if u * width < rise {
            low + (u * width * rise).sqrt()
        } else {
            high - ((1.0 - u) * width * fall).sqrt()
        };
        Hue { channel, wavelength }
    }

    /// Any channel, each as likely: a path that goes on with one of three is worth three times as much in it.
    pub fn sample(u: [f32; 2]) -> Hue {
        Hue::of_channel(((3.0 * u[0]) as usize).min(2), u[1])
    }

    /// 1 in its channel, 0 in the others.
    pub fn mask(self) -> Rgb {
        let of = |channel| f32::from(self.channel == channel);
        Rgb::new(of(0), of(1), of(2))
    }
}

/// What a medium does to light, as far as its surface is concerned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Index {
    /// At the line d, > 0.
    pub ior: f32,
    /// 20 over the Abbe number, ≥ 0.
    pub dispersion: f32,
}

impl Index {
    /// Air.
    pub const AIR: Index = Index { ior: 1.0, dispersion: 0.0 };

    /// The index for light of `hue`, ≥ 1 for an `ior` ≥ 1: Cauchy's n(λ) = A + B/λ² through the index at d, as steep as
    /// the Abbe number V = (n_d − 1)/(n_F − n_C) says (KHR_materials_dispersion, "Implementation").
    pub fn at(self, hue: Hue) -> f32 {
        if self.dispersion == 0.0 {
            return self.ior;
        }
        let per_square = |nm: f32| 1.0 / (nm * nm);
        let [f, d, c] = LINES.map(per_square);
        let b = (self.ior - 1.0) * self.dispersion / 20.0 / (f - c);
        let n = self.ior + b * (per_square(hue.wavelength) - d);
        if self.ior >= 1.0 { n.max(1.0) } else { n.max(0.1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_abbe_number_is_that_of_the_file() {
        // Flint glass SF11: n_d 1.78472, V 25.68; its published n_F 1.80645 and n_C 1.77599 differ by 0.03046.
        let glass = Index { ior: 1.78472, dispersion: 20.0 / 25.68 };
        let at = |wavelength| glass.at(Hue { channel: 0, wavelength });
        assert!((at(587.6) - 1.78472).abs() < 1e-6);
        assert!((at(486.1) - at(656.3) - (1.80645 - 1.77599)).abs() < 1e-4, "{}", at(486.1) - at(656.3));
        assert_eq!(Index { dispersion: 0.0, ..glass }.at(Hue::of_channel(2, 0.5)), 1.78472);
        assert!(
            Index { ior: 1.01, dispersion: 50.0 }.at(Hue::of_channel(0, 1.0)) >= 1.0,
            "never below vacuum"
        );
    }

    #[test]
    fn wavelengths_follow_their_bands() {
        for (channel, [low, middle, high]) in BANDS.into_iter().enumerate() {
            let n = 100_000;
            let all: Vec<f32> =
                (0..n).map(|i| Hue::of_channel(channel, (i as f32 + 0.5) / n as f32).wavelength).collect();
            assert!(all.iter().all(|w| (low..=high).contains(w)));
            assert!(all.is_sorted());
            let mean = all.iter().sum::<f32>() / n as f32;
            assert!((mean - (low + middle + high) / 3.0).abs() < 0.1, "channel {channel}: mean {mean}");
            let below = all.iter().filter(|&&w| w < middle).count() as f32 / n as f32;
            assert!((below - (middle - low) / (high - low)).abs() < 1e-3);
        }
    }

    #[test]
    fn all_hues_together_are_white() {
        let n = 3000;
        let sum: Rgb = (0..n).map(|i| Hue::sample([i as f32 / n as f32, 0.3]).mask() * 3.0).sum();
        assert_eq!(sum / n as f32, Rgb::WHITE);
    }
}
