//! Says why this processor cannot run this binary, before it dies of an illegal instruction.
//!
//! The instructions are chosen when Phalanx is built (`.cargo/config.toml`).
//! `std::is_x86_feature_detected!` is of no use here: it answers yes at compile time for whatever
//! the binary was built with.

use std::io::Write;

/// Ends the process with a message if the processor lacks instructions this binary is built for.
pub(super) fn check() {
    #[cfg(target_arch = "x86_64")]
    if let Some(message) = x86::unsupported() {
        // Plain bytes: formatting code is built with the very instructions that are missing.
        let _ = std::io::stderr().write_all(message.as_bytes());
        std::process::exit(1);
    }
}

/// A note for binaries built without the vector instructions that Phalanx is made for.
pub(super) fn slow_build() -> Option<&'static str> {
    let slow =
        cfg!(target_arch = "x86_64") && !cfg!(all(target_feature = "avx2", target_feature = "fma"));
    slow.then_some(
        "this binary is built without AVX2 and FMA and several times slower than it could be; \
         build it with RUSTFLAGS=\"-C target-cpu=x86-64-v3\"",
    )
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{__cpuid, __cpuid_count, _xgetbv};

    /// The registers that say what a processor can do (Intel SDM, volume 2A, CPUID).
    #[derive(Clone, Copy, Default)]
    pub(super) struct Features {
        /// Leaf 1, register ECX.
        leaf1_ecx: u32,
        /// Leaf 7, register EBX.
        leaf7_ebx: u32,
        /// Leaf 0x8000_0001, register ECX.
        extended_ecx: u32,
        /// Extended control register 0: what the operating system saves.
        xcr0: u64,
    }

    /// Names of the instruction sets this binary is built with and the processor lacks.
    pub(super) fn unsupported() -> Option<&'static str> {
        if !cfg!(target_feature = "avx2") && !cfg!(target_feature = "fma") {
            return None;
        }
        let features = read();
        if !avx2(&features) {
            return Some(
                "error: this binary needs a processor with AVX2, FMA and BMI2 (x86-64-v3: Intel since 2013, AMD since \
                 2015); rebuild it with RUSTFLAGS=\"-C target-cpu=native\" on this machine\n",
            );
        }
        if cfg!(target_feature = "avx512f") && !avx512(&features) {
            return Some(
                "error: this binary needs a processor with AVX-512; rebuild it with RUSTFLAGS=\"-C target-cpu=x86-64-v3\"\n",
            );
        }
        None
    }

    #[allow(unsafe_code)]
    #[allow(unused_unsafe)] // Safe functions since Rust 1.94.
    fn read() -> Features {
        // SAFETY: every x86-64 processor has the CPUID instruction; leaves it does not know are not
        // asked for.
        unsafe {
            let highest = __cpuid(0).eax;
            let highest_extended = __cpuid(0x8000_0000).eax;
            let leaf1_ecx = if highest >= 1 { __cpuid(1).ecx } else { 0 };
            Features {
                leaf1_ecx,
                leaf7_ebx: if highest >= 7 {
                    __cpuid_count(7, 0).ebx
                } else {
                    0
                },
                extended_ecx: if highest_extended >= 0x8000_0001 {
                    __cpuid(0x8000_0001).ecx
                } else {
                    0
                },
                xcr0: if leaf1_ecx & OSXSAVE != 0 { xcr0() } else { 0 },
            }
        }
    }

    /// # Safety
    /// The processor must report OSXSAVE.
    #[allow(unsafe_code)]
    #[target_feature(enable = "xsave")]
    unsafe fn xcr0() -> u64 {
        // SAFETY: OSXSAVE is reported, so XGETBV exists and register 0 is readable.
        unsafe { _xgetbv(0) }
    }

    const OSXSAVE: u32 = 1 << 27;

    /// x86-64-v3: AVX, AVX2, FMA, F16C, MOVBE, BMI1, BMI2, LZCNT, and an operating system that
    /// saves the registers.
    fn avx2(f: &Features) -> bool {
        let leaf1 = 1 << 12 | 1 << 22 | OSXSAVE | 1 << 28 | 1 << 29;
        let leaf7 = 1 << 3 | 1 << 5 | 1 << 8;
        let lzcnt = 1 << 5;
        f.leaf1_ecx & leaf1 == leaf1
            && f.leaf7_ebx & leaf7 == leaf7
            && f.extended_ecx & lzcnt == lzcnt
            && f.xcr0 & 0b110 == 0b110
    }

    /// AVX-512 F, DQ, CD, BW and VL (x86-64-v4), and their registers saved.
    fn avx512(f: &Features) -> bool {
        let leaf7 = 1 << 16 | 1 << 17 | 1 << 28 | 1 << 30 | 1 << 31;
        f.leaf7_ebx & leaf7 == leaf7 && f.xcr0 & 0b1110_0110 == 0b1110_0110
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn agrees_with_the_operating_system() {
            let Ok(info) = std::fs::read_to_string("/proc/cpuinfo") else {
                return;
            };
            let line = info.lines().find(|l| l.starts_with("flags"));
            let flags: Vec<&str> = line.unwrap_or_default().split_whitespace().collect();
            let all = |names: &[&str]| names.iter().all(|n| flags.contains(n));
            let v3 = ["avx", "avx2", "fma", "f16c", "movbe", "bmi1", "bmi2", "abm"];
            assert_eq!(avx2(&read()), all(&v3));
            let v4 = ["avx512f", "avx512dq", "avx512cd", "avx512bw", "avx512vl"];
            assert_eq!(avx512(&read()), all(&v4));
        }

        #[test]
        fn an_old_processor_is_refused() {
            assert!(!avx2(&Features::default()));
            let mut f = read();
            if avx2(&f) {
                f.xcr0 = 0b010; // The system saves SSE registers only.
                assert!(!avx2(&f));
            }
        }
    }
}
