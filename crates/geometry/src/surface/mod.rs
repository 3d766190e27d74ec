//! The material at one point: textures looked up, factors multiplied, normals turned toward the ray.

mod lobes;
mod lookup;
mod material;
mod normals;
#[cfg(test)]
mod tests;

pub use lookup::{base_color_at, coverage_at, emission_at, straight_through};

use crate::bsdf::{Bsdf, Shading};
use crate::dispersion::{Hue, Index};
use crate::math::Vec3;
use crate::nesting::Sides;
use crate::{Hit, MaterialId, Ray, Rgb, Scene, Volume};
use lookup::Point;

/// What a ray met. All normals are unit and on the side the ray came from.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Where, from the triangle's corners rather than along the ray: exact to an ulp of the coordinates.
    pub position: Vec3,
    /// Which triangle.
    pub triangle: u32,
    /// Weight of its second corner.
    pub u: f32,
    /// Weight of its third corner.
    pub v: f32,
    /// Whether the ray met the triangle's front.
    pub front: bool,
    /// Geometric normal.
    pub ng: Vec3,
    /// Shading normal, normal map applied; at least barely on the side of both `ng` and the ray's origin.
    pub ns: Vec3,
    /// Interpolated vertex normal, without the normal map.
    pub smooth: Vec3,
    /// The material.
    pub material: MaterialId,
    /// Share of the light that meets the surface at all, [0, 1]; the rest goes straight on. 0 or 1 for a mask.
    pub coverage: f32,
    /// Own radiance toward the ray's origin, cd/m²; black on the back unless double-sided. Not weighted by coverage.
    pub emission: Rgb,
    /// The colour of an unlit material, cd/m², which replaces all shading (KHR_materials_unlit).
    pub unlit: Option<Rgb>,
    /// Reflection and transmission; nothing for an unlit material.
    pub bsdf: Bsdf,
    /// What the ray travelled through on its way here, as far as this surface tells; `None` for air.
    pub before: Option<Volume>,
    /// What lies beyond the surface.
    pub beyond: Option<Volume>,
    /// What refracts before and beyond, where one of them bends colours by different angles.
    pub indices: Option<[Index; 2]>,
}

impl Surface {
    /// The surface of `scene` that `ray` met at `hit`, with air around the solid that it bounds:
    /// [`World::surface`](crate::World::surface) knows of others.
    pub fn new(scene: &Scene, ray: &Ray, hit: &Hit) -> Surface {
        Surface::between(scene, ray, hit, None)
    }

    /// The same where it is known what lies before and beyond. A boundary with the same on both sides is not there: it
    /// covers nothing.
    pub fn between(scene: &Scene, ray: &Ray, hit: &Hit, sides: Option<Sides>) -> Surface {
        let point = Point::new(scene, hit.triangle, hit.u, hit.v);
        let material = point.material;
        let normals = point.normals(-ray.direction);
        let (base_color, alpha) = point.base_color();
        let mut shading = match material.unlit {
            true => lookup::NOTHING,
            false => point.with_lobes(point.shading(base_color), &normals),
        };
        let here = scene.mesh.materials[hit.triangle as usize];
        let solid = material.enclosed().map(|_| here);
        let alone = if normals.front { [None, solid] } else { [solid, None] };
        let sides = sides.filter(|_| solid.is_some()).unwrap_or(alone);
        let of = |side: Option<MaterialId>| side.map(|m| &scene.materials[m.0 as usize]);
        let index = |m: &crate::Material| Index { ior: m.ior, dispersion: m.dispersion };
        let indices = sides.map(|side| of(side).map_or(Index::AIR, index));
        if sides != alone && material.ior > 0.0 {
            let [before, beyond] = indices.map(|i| i.ior);
            // The index of the inside over that of the outside.
            shading.ior = if normals.front { beyond / before } else { before / beyond };
        }
        let disperses = solid.is_some() && indices.iter().any(|i| i.dispersion > 0.0);
        Surface {
            position: point.position(),
            triangle: hit.triangle,
            u: hit.u,
            v: hit.v,
            front: normals.front,
            ng: normals.geometric,
            ns: normals.shading,
            smooth: normals.smooth,
            material: here,
            coverage: if solid.is_some() && sides[0] == sides[1] { 0.0 } else { point.coverage(alpha) },
            emission: point.emission(normals.front),
            unlit: material.unlit.then_some(base_color),
            bsdf: Bsdf::new(&shading, normals.shading, normals.geometric, normals.front),
            before: of(sides[0]).and_then(|m| m.volume),
            beyond: of(sides[1]).and_then(|m| m.volume),
            indices: disperses.then_some(indices),
        }
    }

    /// A white Lambertian sheet at `position` that faces the unit normal `n`: the cell of a light meter, which no scene
    /// need contain.
    pub fn white_sheet(position: Vec3, n: Vec3) -> Surface {
        Surface {
            position,
            triangle: 0,
            u: 0.0,
            v: 0.0,
            front: true,
            ng: n,
            ns: n,
            smooth: n,
            material: MaterialId(0),
            coverage: 1.0,
            emission: Rgb::BLACK,
            unlit: None,
            bsdf: Bsdf::new(&Shading { base_color: Rgb::WHITE, ..Shading::LAMBERT }, n, n, true),
            before: None,
            beyond: None,
            indices: None,
        }
    }

    /// The other side of a translucent surface, seen by the light there that comes through diffusely; `None` where none
    /// does. It shines to the opposite of the viewer's direction, and has no lobe but the diffuse one.
    pub fn turned(&self) -> Option<Surface> {
        self.bsdf.is_translucent().then(|| Surface {
            front: !self.front,
            ng: -self.ng,
            ns: -self.ns,
            smooth: -self.smooth,
            bsdf: self.bsdf.turned(),
            ..self.clone()
        })
    }

    /// Whether it bends colours by different angles.
    pub fn disperses(&self) -> bool {
        self.indices.is_some()
    }

    /// Bends light from here on as `hue` is bent.
    pub fn bend(&mut self, hue: Hue) {
        if let Some([before, beyond]) = self.indices {
            self.bsdf.layers.refract_by(before.at(hue) / beyond.at(hue));
        }
    }
}
