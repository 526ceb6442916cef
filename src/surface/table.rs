//! What follows from the [table](super) of BSDFs: all that has to know every one of them.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Kernel, Mode};
use super::packing::{self, BsdfMaterial, Evaluate, Shared};
use super::tabulated::Tabulated;
use crate::scene::{Description, Dialect, MaterialKind, Parameters};
use crate::simd::{Lanes, Vec3};
use std::any::Any;

/// Calls `$self.$f::<BsdfType, ...>($args)` for the BSDF type of a kind.
macro_rules! for_kind {
    ($kind:expr, $self:ident . $f:ident :: <_ $(, $g:ty)*> ($($arg:expr),* $(,)?)) => {
        $crate::surface::bsdfs!(
            $crate::surface::table::dispatch; $kind, $self, $f, [$(, $g)*], ($($arg),*)
        )
    };
}

macro_rules! dispatch {
    (
        [$($(#[$of:meta])* $($described:ident)::+ =>
            $($(#[$attr:meta])* $kind:ident: $($path:ident)::+),*;)*]
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
    ([$($(#[$of:meta])* $($described:ident)::+ =>
            $($(#[$attr:meta])* $kind:ident: $($path:ident)::+),*;)*]) => {
        /// The kinds of BSDF kernels; a shading queue each.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Kind {
            $($(
                $(#[$attr])*
                #[doc = concat!("The kernel `", stringify!($($path)::+), "`.")]
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

            /// [`Bsdf::WHOLE`].
            pub const fn is_whole(self) -> bool {
                match self {
                    $($($(#[$attr])* Kind::$kind => <super::$($path)::+ as Bsdf>::WHOLE,)*)*
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

            /// [`Bsdf::sample`], of a kind without tables.
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

            /// [`Bsdf::eval`], of a kind without tables.
            pub fn eval<L: Lanes>(
                self,
                row: &[L; 8],
                [wo, wi]: [Vec3<L>; 2],
                mode: Mode,
            ) -> BsdfValue<L> {
                self.eval_in(&Tabulated::default(), row, [wo, wi], mode)
            }

            /// [`Bsdf::eval_in`].
            pub fn eval_in<L: Lanes>(
                self,
                tables: &Tabulated,
                row: &[L; 8],
                [wo, wi]: [Vec3<L>; 2],
                mode: Mode,
            ) -> BsdfValue<L> {
                match self {
                    $($($(#[$attr])* Kind::$kind => {
                        <super::$($path)::+ as Bsdf>::eval_in(tables, row, wo, wi, mode)
                    })*)*
                }
            }
        }

        /// The names of all descriptions, a line's together.
        const NAMES: &[&[(Dialect, &str)]] =
            &[$($(#[$of])* <super::$($described)::+ as BsdfMaterial>::NAMES),*];

        /// Reads the material of this name, if a BSDF has it in the dialect of the file.
        pub fn read<P: Parameters>(name: &str, set: &P) -> Option<Result<MaterialKind, P::Error>> {
            $(
                $(#[$of])*
                if packing::is_named::<super::$($described)::+>(set.dialect(), name) {
                    let read = <super::$($described)::+ as BsdfMaterial>::read(set);
                    return Some(read.map(MaterialKind::from));
                }
            )*
            None
        }

        /// The kernel of a material and what makes its rows; `None` if it is not in the table.
        pub fn prepare<'a>(
            description: &'a (dyn Description + 'static),
            shared: &mut Shared,
        ) -> Option<(Kind, Box<dyn Evaluate + 'a>)> {
            let any: &dyn Any = description;
            $(
                $(#[$of])*
                if let Some(material) = any.downcast_ref::<super::$($described)::+>() {
                    let (kernel, rows) = packing::prepare(material, shared);
                    return Kind::of(kernel).map(|kind| (kind, rows));
                }
            )*
            None
        }
    };
}

pub(crate) use {call, dispatch, for_kind};

bsdfs!(kinds;);

/// What materials of one BSDF are called in a dialect.
pub fn names(dialect: Dialect) -> impl Iterator<Item = &'static str> {
    let all = NAMES.iter().copied().flatten();
    all.filter(move |name| name.0 == dialect).map(|name| name.1)
}
