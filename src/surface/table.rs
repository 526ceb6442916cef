//! The table of BSDFs: a line each, from which all else follows that has to know them all.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Kernel, Mode};
use crate::simd::{Lanes, Vec3};

/// One line a file: its kernels as `Kind: type`. Calls the macro `$then` with all lines, and what
/// else was given.
///
/// Of two lines the order is that of queues and of reports; pictures do not depend on it.
macro_rules! bsdfs {
    ($then:ident! $($rest:tt)*) => {
        $crate::surface::table::$then! {
            [
                Diffuse: diffuse::Diffuse, OrenNayar: diffuse::OrenNayar;
                Mirror: mirror::Mirror;
                SmoothConductor: conductor::Smooth, RoughConductor: conductor::Rough;
                SmoothDielectric: dielectric::Smooth;
                Plastic: plastic::Plastic;
                ThinDielectric: thin_dielectric::ThinDielectric;
                DiffuseTransmission: diffuse_transmission::DiffuseTransmission;
                Substrate: substrate::Substrate;
                RoughDielectric: rough_dielectric::Rough;
                Coat: coated_conductor::Coat;
                CoatedDiffuse: coated_diffuse::Rough, CoatedDiffuseBase: coated_diffuse::Base;
                CoatedMirror: coated_conductor::Smooth,
                    CoatedConductor: coated_conductor::Rough,
                    CoatedConductorBase: coated_conductor::Base;
            ]
            $($rest)*
        }
    };
}

/// Calls `$self.$f::<BsdfType, ...>($args)` for the BSDF type of a kind.
macro_rules! for_kind {
    ($kind:expr, $self:ident . $f:ident :: <_ $(, $g:ty)*> ($($arg:expr),* $(,)?)) => {
        $crate::surface::table::bsdfs!(
            dispatch! $kind, $self, $f, [$(, $g)*], ($($arg),*)
        )
    };
}

macro_rules! dispatch {
    (
        [$($($(#[$attr:meta])* $kind:ident: $($path:ident)::+),*;)*]
        $value:expr, $self:ident, $f:ident, $generics:tt, $args:tt
    ) => {
        match $value {
            $($($(#[$attr])* $crate::surface::Kind::$kind => $crate::surface::table::call!(
                $self, $f, $crate::surface::$($path)::+, $generics, $args
            ),)*)*
        }
    };
}

macro_rules! call {
    ($self:ident, $f:ident, $bsdf:ty, [$($generics:tt)*], $args:tt) => {
        $self.$f::<$bsdf $($generics)*>$args
    };
}

macro_rules! kinds {
    ([$($($(#[$attr:meta])* $kind:ident: $($path:ident)::+),*;)*]) => {
        /// The kinds of BSDF kernels; a shading queue each.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Kind {
            $($(
                $(#[$attr])*
                #[doc = concat!("[`", stringify!($($path)::+), "`](super::", stringify!($($path)::+), ")")]
                $kind,
            )*)*
        }

        impl Kind {
            const COUNT: usize = [$($($(#[$attr])* Kind::$kind,)*)*].len();

            /// All of them, in order.
            pub const ALL: [Kind; Self::COUNT] = [$($($(#[$attr])* Kind::$kind,)*)*];

            /// [`Bsdf::DELTA`].
            pub const fn is_delta(self) -> bool {
                match self {
                    $($($(#[$attr])* Kind::$kind => <super::$($path)::+ as Bsdf>::DELTA,)*)*
                }
            }

            /// [`Bsdf::LOBES`].
            pub const fn has_lobes(self) -> bool {
                match self {
                    $($($(#[$attr])* Kind::$kind => <super::$($path)::+ as Bsdf>::LOBES,)*)*
                }
            }

            /// [`Bsdf::NAME`].
            pub const fn name(self) -> &'static str {
                match self {
                    $($($(#[$attr])* Kind::$kind => <super::$($path)::+ as Bsdf>::NAME,)*)*
                }
            }

            /// The kind of a type; `None` if that is not in the table.
            pub fn of(kernel: Kernel) -> Option<Self> {
                let of = |kind: Kind| match kind {
                    $($($(#[$attr])* Kind::$kind => Kernel::of::<super::$($path)::+>(),)*)*
                };
                Self::ALL.into_iter().find(|kind| of(*kind) == kernel)
            }

            /// [`Bsdf::sample`].
            pub fn sample<L: Lanes>(
                self,
                row: &[L; 8],
                wo: Vec3<L>,
                u: [L; 3],
                mode: Mode,
            ) -> BsdfSample<L> {
                match self {
                    $($($(#[$attr])* Kind::$kind => {
                        <super::$($path)::+ as Bsdf>::sample(row, wo, u, mode)
                    })*)*
                }
            }

            /// [`Bsdf::eval`].
            pub fn eval<L: Lanes>(
                self,
                row: &[L; 8],
                [wo, wi]: [Vec3<L>; 2],
                mode: Mode,
            ) -> BsdfValue<L> {
                match self {
                    $($($(#[$attr])* Kind::$kind => {
                        <super::$($path)::+ as Bsdf>::eval(row, wo, wi, mode)
                    })*)*
                }
            }
        }
    };
}

pub(crate) use {bsdfs, call, dispatch, for_kind, kinds};

bsdfs!(kinds!);
