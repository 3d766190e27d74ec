//! The picture while it is made: for each pixel its layers of light, and what the eye met there.

use geometry::{Rgb, Vec3};

/// One pixel. The four layers of light are disjoint, so that their sum is the picture itself.
///
/// A ray that met nothing leaves albedo, normal, depth, position and irradiance at zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Light of lamps and sky, reflected once by a diffuse surface, cd/m².
    pub direct: Rgb,
    /// Light that came to the diffuse surface over other surfaces, cd/m².
    pub indirect: Rgb,
    /// What mirrors, glass and gloss show, cd/m².
    pub specular: Rgb,
    /// What shines by itself: lamps seen as such, and the sky, cd/m².
    pub emission: Rgb,
    /// Share of the pixel that is covered by the scene, [0, 1].
    pub alpha: f32,
    /// Diffuse reflectance of the first surface, [0, 1].
    pub albedo: Rgb,
    /// Shading normal of the first surface, world space; shorter than 1 where several were averaged.
    pub normal: Vec3,
    /// Distance from the eye along the primary ray, m.
    pub depth: f32,
    /// The first point met, world space, m.
    pub position: Vec3,
    /// Light arriving there, direct and indirect together, lx.
    pub irradiance: Rgb,
    /// Estimated variance of the pixel's luminance (of the mean, not of one sample), (cd/m²)².
    pub variance: f32,
    /// Rays through the pixel; 0 where it was not reached.
    pub samples: u32,
}

impl Pixel {
    /// Radiance toward the eye, cd/m²: the sum of the four layers of light.
    pub fn beauty(&self) -> Rgb {
        self.direct + self.indirect + self.specular + self.emission
    }

    /// Both pixels' samples together: means weighted by their number, the variance that of the joint mean.
    pub fn merged(&self, other: &Pixel) -> Pixel {
        let samples = self.samples + other.samples;
        if samples == 0 {
            return *self;
        }
        let t = other.samples as f32 / samples as f32;
        Pixel {
            direct: self.direct.lerp(other.direct, t),
            indirect: self.indirect.lerp(other.indirect, t),
            specular: self.specular.lerp(other.specular, t),
            emission: self.emission.lerp(other.emission, t),
            alpha: self.alpha * (1.0 - t) + other.alpha * t,
            albedo: self.albedo.lerp(other.albedo, t),
            normal: self.normal.lerp(other.normal, t),
            depth: self.depth * (1.0 - t) + other.depth * t,
            position: self.position.lerp(other.position, t),
            irradiance: self.irradiance.lerp(other.irradiance, t),
            variance: self.variance * (1.0 - t) * (1.0 - t) + other.variance * t * t,
            samples,
        }
    }

    /// Sets to 0 whatever is not a number, not finite, or negative where that has no meaning.
    ///
    /// Returns whether anything had to be set.
    pub fn sanitise(&mut self) -> bool {
        let mut bad = false;
        let mut light = |v: &mut f32| {
            // Not `*v < 0.0`: NaN compares false with everything and must be caught too.
            if !(v.is_finite() && *v >= 0.0) {
                *v = 0.0;
                bad = true;
            }
        };
        for layer in [
            &mut self.direct,
            &mut self.indirect,
            &mut self.specular,
            &mut self.emission,
            &mut self.albedo,
            &mut self.irradiance,
        ] {
            light(&mut layer.r);
            light(&mut layer.g);
            light(&mut layer.b);
        }
        for v in [&mut self.alpha, &mut self.depth, &mut self.variance] {
            light(v);
        }
        for v in [&mut self.normal, &mut self.position] {
            if !v.is_finite() {
                *v = Vec3::ZERO;
                bad = true;
            }
        }
        // Four layers near f32::MAX are finite, their sum may not be.
        if !self.beauty().is_finite() {
            (self.direct, self.indirect) = (Rgb::BLACK, Rgb::BLACK);
            (self.specular, self.emission) = (Rgb::BLACK, Rgb::BLACK);
            bad = true;
        }
        bad
    }
}

/// A picture of `width` × `height` pixels, rows from the top, each from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// All pixels, row by row. Who writes here directly calls [`Film::sanitise`] afterwards.
    pub pixels: Vec<Pixel>,
    /// Pixels that held something not finite or negative, which was set to 0. More than none is a bug worth
    /// reporting, so the count is shown to the user.
    pub repaired: u64,
}

impl Film {
    /// All black.
    pub fn new(width: u32, height: u32) -> Film {
        Film { width, height, pixels: vec![Pixel::default(); width as usize * height as usize], repaired: 0 }
    }

    /// From finished pixels, row by row from the top; they are sanitised.
    pub fn from_pixels(width: u32, height: u32, pixels: Vec<Pixel>) -> Film {
        assert_eq!(pixels.len(), width as usize * height as usize, "a film has width × height pixels");
        let mut film = Film { width, height, pixels, repaired: 0 };
        film.sanitise();
        film
    }

    /// The pixel in column `x`, row `y`.
    pub fn get(&self, x: u32, y: u32) -> &Pixel {
        &self.pixels[self.index(x, y)]
    }

    /// Puts `pixel` in column `x`, row `y`, sanitised.
    pub fn set(&mut self, x: u32, y: u32, mut pixel: Pixel) {
        self.repaired += u64::from(pixel.sanitise());
        let i = self.index(x, y);
        self.pixels[i] = pixel;
    }

    /// Sanitises all pixels and adds to [`Film::repaired`]; afterwards every number of the film is finite.
    pub fn sanitise(&mut self) {
        self.repaired += self.pixels.iter_mut().map(|p| u64::from(p.sanitise())).sum::<u64>();
    }

    /// Whether no pixel was reached.
    pub fn is_blank(&self) -> bool {
        self.pixels.iter().all(|p| p.samples == 0)
    }

    /// Radiance toward the eye of every pixel, cd/m².
    pub fn beauty(&self) -> Vec<Rgb> {
        self.pixels.iter().map(Pixel::beauty).collect()
    }

    fn index(&self, x: u32, y: u32) -> usize {
        assert!(x < self.width && y < self.height, "({x}, {y}) lies on the film");
        y as usize * self.width as usize + x as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beauty_is_the_sum_of_the_layers() {
        let pixel = Pixel {
            direct: Rgb::new(1.0, 2.0, 3.0),
            indirect: Rgb::splat(0.5),
            specular: Rgb::splat(0.25),
            emission: Rgb::splat(8.0),
            ..Pixel::default()
        };
        assert_eq!(pixel.beauty(), Rgb::new(9.75, 10.75, 11.75));
    }

    #[test]
    fn nothing_that_is_not_finite_enters_and_each_such_pixel_is_counted() {
        let mut film = Film::new(3, 2);
        film.set(0, 0, Pixel { direct: Rgb::new(f32::NAN, 1.0, -1.0), ..Pixel::default() });
        film.set(1, 0, Pixel { position: Vec3::new(-1.0, f32::INFINITY, 0.0), ..Pixel::default() });
        film.set(2, 1, Pixel { normal: -Vec3::Y, position: -Vec3::ONE, ..Pixel::default() });
        film.pixels[4].depth = f32::INFINITY;
        film.pixels[5].emission = Rgb::splat(3e38);
        film.pixels[5].direct = Rgb::splat(3e38);
        film.sanitise();
        assert_eq!(film.repaired, 4);
        assert_eq!(film.get(0, 0).direct, Rgb::new(0.0, 1.0, 0.0));
        assert_eq!(film.get(2, 1).normal, -Vec3::Y);
        assert!(film.beauty().iter().all(|c| c.is_finite()));
        film.sanitise();
        assert_eq!(film.repaired, 4, "what was repaired is not counted again");
    }
}
