//! The material at one point: textures looked up, factors multiplied, normals turned toward the ray.

/// See the module.
#[derive(Clone, Debug)]
pub struct Surface {}
