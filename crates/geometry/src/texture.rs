//! Images on surfaces: texels, sampler, look-up.

use std::sync::LazyLock;

use crate::math::Vec2;
use crate::{Mesh, Rgb, TextureRef};

/// A decoded image and how it is looked up.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Name, for messages.
    pub name: String,
    /// Columns.
    pub width: u32,
    /// Rows; the first row is the image's top, at v = 0 (glTF).
    pub height: u32,
    /// RGBA, 8 bits, encoded as in the file (whether sRGB or linear depends on the use).
    pub texels: Vec<[u8; 4]>,
    /// Beyond u in [0, 1].
    pub wrap_s: Wrap,
    /// Beyond v in [0, 1].
    pub wrap_t: Wrap,
    /// Between texels: true for linear, false for nearest.
    pub linear: bool,
}

/// glTF sampler wrap modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Tile.
    Repeat,
    /// Tile, every other one mirrored.
    MirroredRepeat,
    /// The border goes on for ever.
    ClampToEdge,
}

/// sRGB code to linear light (IEC 61966-2-1), and code / 255 beside it.
static SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let c = i as f64 / 255.0;
        (if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }) as f32
    })
});

/// Linear light, [0, 1], of a byte in sRGB.
pub fn srgb_decode(byte: u8) -> f32 {
    SRGB[usize::from(byte)]
}

impl Texture {
    /// Colour decoded from sRGB to linear, and linear alpha, at `uv`.
    ///
    /// Texels are decoded before they are filtered, as glTF 2.0 (3.8.3) asks. A coordinate that is not
    /// finite counts as 0.
    pub fn sample_srgb(&self, uv: Vec2) -> (Rgb, f32) {
        let table = &*SRGB;
        let [r, g, b, a] = self.filter(uv, |[r, g, b, a]| {
            [table[r as usize], table[g as usize], table[b as usize], f32::from(a) * (1.0 / 255.0)]
        });
        (Rgb::new(r, g, b), a)
    }

    /// The four channels as linear values in [0, 1], at `uv`.
    pub fn sample_linear(&self, uv: Vec2) -> [f32; 4] {
        self.filter(uv, |texel| texel.map(|c| f32::from(c) * (1.0 / 255.0)))
    }

    /// Nearest texel, or the weighted mean of the four around `uv`. Mip levels are not modelled: pixels
    /// take many samples, which is the better filter.
    fn filter(&self, uv: Vec2, decode: impl Fn([u8; 4]) -> [f32; 4]) -> [f32; 4] {
        if self.width == 0 || self.height == 0 {
            return [1.0; 4];
        }
        let (w, h) = (i64::from(self.width), i64::from(self.height));
        let texel = |x: i64, y: i64| decode(self.texels[(y * w + x) as usize]);
        let x = self.wrap_s.reduce(uv.x) * self.width as f32;
        let y = self.wrap_t.reduce(uv.y) * self.height as f32;
        if !self.linear {
            return texel(self.wrap_s.index(x.floor() as i64, w), self.wrap_t.index(y.floor() as i64, h));
        }
        // Texel i has its centre at i + 1/2.
        let (x, y) = (x - 0.5, y - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let columns = [self.wrap_s.index(x0 as i64, w), self.wrap_s.index(x0 as i64 + 1, w)];
        let rows = [self.wrap_t.index(y0 as i64, h), self.wrap_t.index(y0 as i64 + 1, h)];
        let (a, b) = (texel(columns[0], rows[0]), texel(columns[1], rows[0]));
        let (c, d) = (texel(columns[0], rows[1]), texel(columns[1], rows[1]));
        std::array::from_fn(|i| {
            let top = a[i] + (b[i] - a[i]) * fx;
            let bottom = c[i] + (d[i] - c[i]) * fx;
            top + (bottom - top) * fy
        })
    }
}

impl Wrap {
    /// `u` brought near one period without changing what it shows, so that the product with the image's
    /// size stays exact enough however large `u` is.
    fn reduce(self, u: f32) -> f32 {
        if !u.is_finite() {
            return 0.0;
        }
        match self {
            Wrap::Repeat => u - u.floor(),
            Wrap::MirroredRepeat => u - 2.0 * (0.5 * u).floor(),
            Wrap::ClampToEdge => u.clamp(0.0, 1.0),
        }
    }

    /// The texel in [0, n) that stands at index `i` of the endless row.
    fn index(self, i: i64, n: i64) -> i64 {
        // Divisions are slow, and most look-ups need none.
        if (0..n).contains(&i) {
            return i;
        }
        match self {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::MirroredRepeat => {
                let i = i.rem_euclid(2 * n);
                if i < n { i } else { 2 * n - 1 - i }
            }
            Wrap::ClampToEdge => i.clamp(0, n - 1),
        }
    }
}

impl TextureRef {
    /// Where barycentric (u, v) of triangle `t` of `mesh` falls on the image, KHR_texture_transform applied.
    pub fn uv(&self, mesh: &Mesh, t: u32, u: f32, v: f32) -> Vec2 {
        let set = &mesh.uvs[usize::from(self.uv_set.min(1))];
        let uv = if set.is_empty() { Vec2::ZERO } else { mesh.interpolate(t, u, v, set) };
        self.transform.transform_point2(uv)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Four columns of red 0, 51, 102, 153 in one row.
    fn ramp(wrap: Wrap, linear: bool) -> Texture {
        let texels = (0..4).map(|i| [51 * i, 0, 0, 255]).collect();
        Texture { name: String::new(), width: 4, height: 1, texels, wrap_s: wrap, wrap_t: wrap, linear }
    }

    fn column(texture: &Texture, u: f32) -> i32 {
        (texture.sample_linear(Vec2::new(u, 0.5))[0] * 5.0).round() as i32
    }

    #[test]
    fn each_wrap_mode_walks_its_own_way_past_the_border() {
        let at = |wrap| [-1.1, -0.6, -0.1, 0.1, 0.9, 1.1, 1.6, 2.1].map(|u| column(&ramp(wrap, false), u));
        assert_eq!(at(Wrap::Repeat), [3, 1, 3, 0, 3, 0, 2, 0]);
        assert_eq!(at(Wrap::MirroredRepeat), [3, 2, 0, 0, 3, 3, 1, 0]);
        assert_eq!(at(Wrap::ClampToEdge), [0, 0, 0, 0, 3, 3, 3, 3]);
    }

    #[test]
    fn linear_filtering_meets_texel_centres_and_blends_across_the_seam() {
        let at = |wrap, u: f32| ramp(wrap, true).sample_linear(Vec2::new(u, 0.5))[0] * 5.0;
        for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
            assert!((at(wrap, 0.375) - 1.0).abs() < 1e-5);
            assert!((at(wrap, 0.5) - 1.5).abs() < 1e-5);
        }
        assert!((at(Wrap::Repeat, 0.0) - 1.5).abs() < 1e-5, "half of the last column, half of the first");
        assert!(at(Wrap::ClampToEdge, 0.0).abs() < 1e-5);
        assert!((at(Wrap::MirroredRepeat, 1.0) - 3.0).abs() < 1e-5);
    }

    #[test]
    fn srgb_is_decoded_before_filtering_and_alpha_is_not() {
        let texels = vec![[0, 0, 0, 0], [255, 188, 0, 128]];
        let wrap = Wrap::ClampToEdge;
        let t = Texture {
            name: String::new(),
            width: 2,
            height: 1,
            texels,
            wrap_s: wrap,
            wrap_t: wrap,
            linear: true,
        };
        let (c, a) = t.sample_srgb(Vec2::new(0.5, 0.5));
        assert!((c.r - 0.5).abs() < 1e-6);
        assert!((t.sample_srgb(Vec2::ONE).0.g - 0.502_886).abs() < 1e-4, "sRGB 188 is about half the light");
        assert!((a - 64.0 / 255.0).abs() < 1e-6);
    }

    #[test]
    fn the_first_row_is_at_v_zero() {
        let texels = vec![[255, 0, 0, 255], [0, 0, 0, 255]];
        let wrap = Wrap::Repeat;
        let t = Texture {
            name: String::new(),
            width: 1,
            height: 2,
            texels,
            wrap_s: wrap,
            wrap_t: wrap,
            linear: false,
        };
        assert_eq!(t.sample_linear(Vec2::new(0.5, 0.25))[0], 1.0);
        assert_eq!(t.sample_linear(Vec2::new(0.5, 0.75))[0], 0.0);
    }

    proptest! {
        #[test]
        fn no_coordinate_panics_or_leaves_the_range(bits: [u32; 2], linear: bool, mode in 0..3usize) {
            let wrap = [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge][mode];
            let uv = Vec2::new(f32::from_bits(bits[0]), f32::from_bits(bits[1]));
            let t = ramp(wrap, linear);
            for c in t.sample_linear(uv) {
                prop_assert!((0.0..=1.00001).contains(&c));
            }
            prop_assert!(t.sample_srgb(uv).0.is_finite());
        }
    }
}
