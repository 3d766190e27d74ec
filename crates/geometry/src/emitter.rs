//! Lamps, emissive triangles and sky as things one samples.
