//! Which instructions trace rays.

use super::prepared::Prepared;
#[cfg(target_arch = "x86_64")]
use super::simd::Avx2;
use super::wide::Tree;
use super::{Hit, Ray, portable};
use std::ffi::OsStr;
use std::sync::LazyLock;

/// A way to traverse the tree. All test triangles by the same operations, so they give the same hits, bit for bit;
/// they differ in speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Plain Rust, on every machine.
    Portable,
    /// Eight boxes and four triangles at once, on x86-64 with AVX2 and FMA.
    Avx2,
}

impl Kernel {
    /// All kernels, the fastest last.
    pub const ALL: [Kernel; 2] = [Kernel::Portable, Kernel::Avx2];

    /// Whether this machine can run it.
    pub fn is_available(self) -> bool {
        Tracer::new(self).is_some()
    }

    /// The fastest that this machine can run; the portable one where the environment says
    /// `TWOLIGHT_KERNEL=portable`.
    pub fn best() -> Kernel {
        static BEST: LazyLock<Kernel> =
            LazyLock::new(|| Kernel::chosen(std::env::var_os("TWOLIGHT_KERNEL").as_deref()));
        *BEST
    }

    /// The fastest, unless the portable one is wished for.
    fn chosen(wish: Option<&OsStr>) -> Kernel {
        let fastest = || Kernel::ALL.into_iter().rev().find(|k| k.is_available());
        if wish.is_some_and(|w| w == "portable") {
            Kernel::Portable
        } else {
            fastest().unwrap_or(Kernel::Portable)
        }
    }
}

/// A kernel that this machine has.
#[derive(Clone, Copy, Debug)]
pub(super) enum Tracer {
    /// Plain Rust.
    Portable,
    /// AVX2.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
}

impl Tracer {
    /// `None` where the machine has not this kernel.
    pub fn new(kernel: Kernel) -> Option<Tracer> {
        match kernel {
            Kernel::Portable => Some(Tracer::Portable),
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx2 => Avx2::detect().map(Tracer::Avx2),
            #[cfg(not(target_arch = "x86_64"))]
            Kernel::Avx2 => None,
        }
    }

    /// The nearest hit.
    pub fn closest_hit(self, tree: &Tree, ray: &Ray) -> Option<Hit> {
        match self {
            Tracer::Portable => portable::closest_hit(tree, &Prepared::new(ray)?),
            #[cfg(target_arch = "x86_64")]
            Tracer::Avx2(avx2) => avx2.closest_hit(tree, ray),
        }
    }

    /// Whether there is any hit.
    pub fn occluded(self, tree: &Tree, ray: &Ray) -> bool {
        match self {
            Tracer::Portable => Prepared::new(ray).is_some_and(|ray| portable::occluded(tree, &ray)),
            #[cfg(target_arch = "x86_64")]
            Tracer::Avx2(avx2) => avx2.occluded(tree, ray),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_portable_kernel_can_be_wished_for() {
        assert_eq!(Kernel::chosen(Some(OsStr::new("portable"))), Kernel::Portable);
        assert_eq!(Kernel::chosen(None) == Kernel::Avx2, Kernel::Avx2.is_available());
    }
}
