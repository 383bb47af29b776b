//! The instruction sets of the kernels. All give the same bits; the best one is found at run time.

use fearless_simd::Level;

use crate::error::Error;

/// Which instructions the kernels use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Isa {
    /// The best that the machine has.
    #[default]
    Auto,
    /// SSE2: the least that every x86-64 has.
    Sse2,
    /// SSE4.2: x86-64-v2.
    Sse42,
    /// AVX2: x86-64-v3.
    Avx2,
    /// AVX-512 as of Ice Lake and Zen 4.
    Avx512,
    /// NEON of 64-bit ARM.
    Neon,
}

impl Isa {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Sse2 => "sse2",
            Self::Sse42 => "sse4.2",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
            Self::Neon => "neon",
        }
    }

    /// The instruction set that `Auto` stands for on this machine, or this one.
    ///
    /// # Errors
    /// When the machine does not have it.
    pub fn resolve(self) -> Result<Self, Error> {
        if self != Self::Auto {
            return self.level().map(|_| self);
        }
        let best = [Self::Avx512, Self::Avx2, Self::Sse42, Self::Sse2, Self::Neon];
        Ok(best.into_iter().find(|isa| isa.level().is_ok()).unwrap_or(Self::Auto))
    }

    /// The level of `fearless_simd`.
    ///
    /// # Errors
    /// When the machine does not have it.
    pub fn level(self) -> Result<Level, Error> {
        let best = Level::new();
        self.restrict(best).ok_or(Error::Isa { isa: self.name() })
    }

    /// A level at most as high as the machine's.
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    fn restrict(self, best: Level) -> Option<Level> {
        match self {
            Self::Auto => Some(best),
            Self::Sse2 => best.as_sse2().map(Level::Sse2),
            Self::Sse42 => best.as_sse4_2().map(Level::Sse4_2),
            Self::Avx2 => best.as_avx2().map(Level::Avx2),
            Self::Avx512 => best.as_avx512().map(Level::Avx512),
            Self::Neon => None,
        }
    }

    /// A level at most as high as the machine's.
    #[cfg(target_arch = "aarch64")]
    fn restrict(self, best: Level) -> Option<Level> {
        match self {
            Self::Auto => Some(best),
            Self::Neon => best.as_neon().map(Level::Neon),
            _ => None,
        }
    }

    /// A level at most as high as the machine's.
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64")))]
    fn restrict(self, best: Level) -> Option<Level> {
        (self == Self::Auto).then_some(best)
    }
}
