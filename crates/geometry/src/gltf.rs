//! glTF file to scene, cameras and warnings.
