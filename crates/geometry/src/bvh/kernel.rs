//! Which instructions trace rays.

/// A way to traverse the tree. All give the same hits, bit for bit; they differ in speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Plain Rust, on every machine.
    Portable,
    /// Eight boxes and four triangles at once, on x86-64 with AVX2.
    Avx2,
}

impl Kernel {
    /// All kernels, the fastest last.
    pub const ALL: [Kernel; 2] = [Kernel::Portable, Kernel::Avx2];

    /// Whether this machine can run it.
    pub fn is_available(self) -> bool {
        match self {
            Kernel::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("bmi1"),
            #[cfg(not(target_arch = "x86_64"))]
            Kernel::Avx2 => false,
        }
    }

    /// The fastest that this machine can run.
    pub fn best() -> Kernel {
        Kernel::ALL.into_iter().rev().find(|k| k.is_available()).unwrap_or(Kernel::Portable)
    }
}
