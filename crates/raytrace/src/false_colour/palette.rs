//! Colours in order, whose brightness rises evenly, so that a grey print tells the same.

/// Black, violet, magenta, orange, pale yellow: stops of matplotlib's magma (CC0). sRGB.
pub const MAGMA: [[f32; 3]; 6] = [
    [0.0, 0.0, 4.0],
    [59.0, 15.0, 112.0],
    [140.0, 41.0, 129.0],
    [222.0, 73.0, 104.0],
    [254.0, 159.0, 109.0],
    [252.0, 253.0, 191.0],
];

/// Violet, blue, green, yellow: stops of matplotlib's viridis (CC0), which the colour-blind can read too. sRGB.
pub const VIRIDIS: [[f32; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 44.0, 122.0],
    [59.0, 82.0, 139.0],
    [44.0, 113.0, 142.0],
    [33.0, 145.0, 140.0],
    [39.0, 173.0, 129.0],
    [92.0, 200.0, 99.0],
    [170.0, 220.0, 50.0],
    [253.0, 231.0, 37.0],
];

/// The colour at `at` in [0, 1] along the evenly spaced `stops`, sRGB; beyond the ends the last one.
pub fn colour(stops: &[[f32; 3]], at: f32) -> [u8; 3] {
    let at = at.clamp(0.0, 1.0) * (stops.len() - 1) as f32;
    let i = (at as usize).min(stops.len() - 2);
    let t = at - i as f32;
    [0, 1, 2].map(|c| (stops[i][c] * (1.0 - t) + stops[i + 1][c] * t + 0.5) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Rgb;

    #[test]
    fn viridis_gets_brighter() {
        let grey = |i: usize| {
            let [r, g, b] = colour(&VIRIDIS, i as f32 / 64.0).map(|v| f32::from(v).powf(2.2));
            Rgb::new(r, g, b).luminance()
        };
        assert!((0..64).all(|i| grey(i + 1) > grey(i)));
        assert_eq!((colour(&VIRIDIS, -1.0), colour(&VIRIDIS, 2.0)), ([68, 1, 84], [253, 231, 37]));
    }
}
