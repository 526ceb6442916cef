//! The table of BSDFs: a line each, from which all else follows that has to know them all.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Kernel, Mode};
use super::packing::{self, BsdfMaterial, Evaluate, Shared};
use crate::scene::{Description, Dialect, MaterialKind, Parameters};
use crate::simd::{Lanes, Vec3};
use std::any::Any;

/// A line for each description: its type, and its kernels as `Kind: type`. Calls the macro `$then`
/// with all lines, and what else was given.
///
/// Their order is that of queues and of reports; pictures do not depend on it.
macro_rules! bsdfs {
    ($then:ident! $($rest:tt)*) => {
        $crate::surface::table::$then! {
            [
                diffuse::DiffuseMaterial =>
                    Diffuse: diffuse::Diffuse, OrenNayar: diffuse::OrenNayar;
                mirror::MirrorMaterial => Mirror: mirror::Mirror;
                conductor::ConductorMaterial =>
                    SmoothConductor: conductor::Smooth, RoughConductor: conductor::Rough;
                dielectric::DielectricMaterial =>
                    SmoothDielectric: dielectric::Smooth, RoughDielectric: rough_dielectric::Rough;
                plastic::PlasticMaterial => Plastic: plastic::Plastic;
                thin_dielectric::ThinDielectricMaterial =>
                    ThinDielectric: thin_dielectric::ThinDielectric;
                diffuse_transmission::DiffuseTransmissionMaterial =>
                    DiffuseTransmission: diffuse_transmission::DiffuseTransmission;
                substrate::SubstrateMaterial => Substrate: substrate::Substrate;
                coated_materials::CoatMaterial => Coat: coated_conductor::Coat;
                coated_diffuse::CoatedDiffuseMaterial =>
                    CoatedDiffuse: coated_diffuse::Rough, CoatedDiffuseBase: coated_diffuse::Base;
                coated_materials::CoatedConductorMaterial =>
                    CoatedMirror: coated_conductor::Smooth,
                    CoatedConductor: coated_conductor::Rough,
                    CoatedConductorBase: coated_conductor::Base;
                // Its kernels are those of the three before.
                coated_materials::TexturedCoatMaterial => ;
                #[cfg(test)]
                tests::lommel_seeliger::LommelSeeligerMaterial =>
                    #[cfg(test)] LommelSeeliger: tests::lommel_seeliger::LommelSeeliger;
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

pub(crate) use {bsdfs, call, dispatch, for_kind, kinds};

bsdfs!(kinds!);

/// What materials of one BSDF are called in a dialect.
pub fn names(dialect: Dialect) -> impl Iterator<Item = &'static str> {
    let all = NAMES.iter().copied().flatten();
    all.filter(move |name| name.0 == dialect).map(|name| name.1)
}
