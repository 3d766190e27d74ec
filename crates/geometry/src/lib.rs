//! The world, and what a ray meets in it.
//!
//! One space: the importer bakes every transform, so everything here is world space, in metres.
//! Light is linear, Rec. 709, photometric: emissive in cd/m², lamps in cd, the sun in lx.
//! No camera is part of the [`Scene`]: light does not know where we stand.
//!
//! A [`Scene`] is plain data, read from a file by [`gltf::load`] or filled in by hand. [`World::new`] makes it ready:
//! it builds the search tree ([`bvh`]) and gathers what shines ([`emitter`]). Rays then ask the world what they meet
//! ([`World::closest`]) and how much light passes between two points ([`World::transmittance`]); [`Surface`] is the
//! material at the point met, and its [`bsdf`] says where light goes on from there.
//!
//! ```
//! use geometry::{Material, MaterialId, Ray, Rgb, Scene, Surface, Vec3, World};
//!
//! let mut scene = Scene::default();
//! scene.materials.push(Material { base_color: Rgb::splat(0.5), metallic: 0.0, specular: 0.0, ..Material::default() });
//! scene.mesh.positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
//! scene.mesh.normals = vec![Vec3::Z; 3];
//! scene.mesh.triangles = vec![[0, 1, 2]];
//! scene.mesh.materials = vec![MaterialId(0)];
//! let world = World::new(scene);
//!
//! let down = Ray::new(Vec3::new(0.2, 0.2, 3.0), -Vec3::Z);
//! let hit = world.closest(&down).expect("the triangle lies below");
//! assert!((hit.t - 3.0).abs() < 1e-6);
//! let surface = Surface::new(&world.scene, &down, &hit);
//! assert!(surface.front && surface.ng == Vec3::Z);
//! ```

pub mod bsdf;
pub mod bvh;
pub mod camera;
pub mod dispersion;
pub mod emitter;
pub mod fingerprint;
pub mod flights;
pub mod gltf;
pub mod ies;
pub mod light_groups;
pub mod lobes;
pub mod math;
pub mod mesh;
pub mod nesting;
pub mod optics;
pub mod outlook;
pub mod passage;
pub mod photometry;
pub mod polygon;
pub mod rgb;
pub mod sampling;
pub mod scene;
pub mod sky;
pub mod solid;
pub mod surface;
pub mod texture;
pub mod triangle;
pub mod world;

pub use bvh::{Bvh, Hit, Ray};
pub use camera::{Camera, Projection};
pub use emitter::Emitters;
pub use fingerprint::Fingerprint;
pub use light_groups::LightGroups;
pub use math::{Vec2, Vec3};
pub use mesh::{Mesh, Part};
pub use outlook::Outlook;
pub use passage::Passage;
pub use rgb::Rgb;
pub use scene::{AlphaMode, Light, LightKind, Material, MaterialId, Scene, TextureRef, Volume};
pub use sky::Sky;
pub use surface::Surface;
pub use texture::Texture;
pub use world::World;
