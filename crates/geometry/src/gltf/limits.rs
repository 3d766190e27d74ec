//! How much a file may ask for, so that a hostile one costs an error and not the machine.

/// Upper bounds on what one file may make the loader read, decode or create.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Triangles in world space, all instances together.
    pub triangles: u64,
    /// Pixels of one image.
    pub image_pixels: u64,
    /// Pixels of all images together.
    pub total_pixels: u64,
    /// Bytes of the file and of all buffers and images that it refers to, together.
    pub bytes: u64,
    /// Generations from a root node to its last descendant.
    pub node_depth: usize,
    /// Copies of a mesh primitive in the scene, all primitives together.
    pub instances: u64,
}

impl Default for Limits {
    /// Room for any scene that fits a workstation: 50 million triangles, images to 16384², 1 Gpixel and
    /// 4 GiB in all, 1000 generations, a million instances.
    fn default() -> Self {
        Limits {
            triangles: 50_000_000,
            image_pixels: 16_384 * 16_384,
            total_pixels: 1 << 30,
            bytes: 4 << 30,
            node_depth: 1000,
            instances: 1_000_000,
        }
    }
}
