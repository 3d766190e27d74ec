//! The world, and what a ray meets in it.
//!
//! One space: the importer bakes every transform, so everything here is world space, in metres.
//! Light is linear, Rec. 709, photometric: emissive in cd/m², lamps in cd, the sun in lx.
//! No camera is part of the [`Scene`]: light does not know where we stand.

pub mod bsdf;
pub mod bvh;
pub mod camera;
pub mod emitter;
pub mod gltf;
pub mod math;
pub mod mesh;
pub mod optics;
pub mod photometry;
pub mod polygon;
pub mod rgb;
pub mod sampling;
pub mod scene;
pub mod sky;
pub mod surface;
pub mod texture;
pub mod triangle;
pub mod world;

pub use bvh::{Bvh, Hit, Ray};
pub use camera::{Camera, Projection};
pub use emitter::Emitters;
pub use math::{Vec2, Vec3};
pub use mesh::{Mesh, Part};
pub use rgb::Rgb;
pub use scene::{AlphaMode, Light, LightKind, Material, MaterialId, Scene, TextureRef, Volume};
pub use sky::Sky;
pub use surface::Surface;
pub use texture::Texture;
pub use world::World;
