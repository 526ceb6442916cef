//! Records: eight floats with names.
//!
//! A table of records is a slice of plain structs of one [`Row`] each, declared once by `record!`:
//! fields in storage order, with their types, and how many floats are left free. Scalar code reads
//! and writes fields of a record by name. Kernels load those of a list of records into lanes, field
//! by field, and store them; both are the transposes of [`Lanes::load_rows`] and
//! [`Lanes::store_rows`], and columns that nobody reads cost nothing.
//!
//! The width of a record, [`Row::WIDTH`], is not the width of the lanes.

use super::{Lanes, Row, Vec3};
use bytemuck::Pod;
use std::fmt::Debug;

/// What a field of a record can be: some 32-bit columns of a row.
pub trait Field: Pod {
    /// `N` of them.
    type Wide<L: Lanes>: Copy + Debug;

    /// From the columns of `N` rows; the field's first is `first`.
    fn gather<L: Lanes>(columns: &[L; Row::WIDTH], first: usize) -> Self::Wide<L>;
    /// Into the columns of `N` rows.
    fn scatter<L: Lanes>(wide: Self::Wide<L>, columns: &mut [L; Row::WIDTH], first: usize);
}

impl Field for f32 {
    type Wide<L: Lanes> = L;

    #[inline(always)]
    fn gather<L: Lanes>(columns: &[L; Row::WIDTH], first: usize) -> L {
        columns[first]
    }
    #[inline(always)]
    fn scatter<L: Lanes>(wide: L, columns: &mut [L; Row::WIDTH], first: usize) {
        columns[first] = wide;
    }
}

impl Field for u32 {
    type Wide<L: Lanes> = L::Uint;

    #[inline(always)]
    fn gather<L: Lanes>(columns: &[L; Row::WIDTH], first: usize) -> L::Uint {
        columns[first].to_bits()
    }
    #[inline(always)]
    fn scatter<L: Lanes>(wide: L::Uint, columns: &mut [L; Row::WIDTH], first: usize) {
        columns[first] = L::from_bits(wide);
    }
}

impl Field for [u32; 2] {
    type Wide<L: Lanes> = [L::Uint; 2];

    #[inline(always)]
    fn gather<L: Lanes>(columns: &[L; Row::WIDTH], first: usize) -> [L::Uint; 2] {
        [columns[first].to_bits(), columns[first + 1].to_bits()]
    }
    #[inline(always)]
    fn scatter<L: Lanes>(wide: [L::Uint; 2], columns: &mut [L; Row::WIDTH], first: usize) {
        [columns[first], columns[first + 1]] = wide.map(L::from_bits);
    }
}

impl Field for [f32; 2] {
    type Wide<L: Lanes> = [L; 2];

    #[inline(always)]
    fn gather<L: Lanes>(columns: &[L; Row::WIDTH], first: usize) -> [L; 2] {
        [columns[first], columns[first + 1]]
    }
    #[inline(always)]
    fn scatter<L: Lanes>(wide: [L; 2], columns: &mut [L; Row::WIDTH], first: usize) {
        [columns[first], columns[first + 1]] = wide;
    }
}

impl Field for [f32; 3] {
    type Wide<L: Lanes> = Vec3<L>;

    #[inline(always)]
    fn gather<L: Lanes>(columns: &[L; Row::WIDTH], first: usize) -> Vec3<L> {
        Vec3::new(columns[first], columns[first + 1], columns[first + 2])
    }
    #[inline(always)]
    fn scatter<L: Lanes>(wide: Vec3<L>, columns: &mut [L; Row::WIDTH], first: usize) {
        columns[first] = wide.x;
        columns[first + 1] = wide.y;
        columns[first + 2] = wide.z;
    }
}

impl Field for [f32; 4] {
    type Wide<L: Lanes> = [L; 4];

    #[inline(always)]
    fn gather<L: Lanes>(columns: &[L; Row::WIDTH], first: usize) -> [L; 4] {
        [
            columns[first],
            columns[first + 1],
            columns[first + 2],
            columns[first + 3],
        ]
    }
    #[inline(always)]
    fn scatter<L: Lanes>(wide: [L; 4], columns: &mut [L; Row::WIDTH], first: usize) {
        for (i, w) in wide.into_iter().enumerate() {
            columns[first + i] = w;
        }
    }
}

/// Declares a record and, after the slash, its lane-wide twin. Free columns are declared, too, so
/// that a page of records shows what room there is: `} free 2`. A record without has none.
///
/// ```ignore
/// record! {
///     /// Where a ray went.
///     pub struct Hit / HitLanes {
///         /// Distance in units of the direction's length.
///         t: f32,
///         /// Index of the primitive.
///         primitive: u32,
///     } free 6
/// }
/// let hit = HitLanes::<L>::load(&hits, list);
/// let nearest = hits[0].t;
/// ```
macro_rules! record {
    (
        $(#[$about:meta])*
        $vis:vis struct $Record:ident / $Wide:ident {
            $($(#[$what:meta])* $field:ident: $kind:ty,)*
        } $(free $free:literal)?
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        #[repr(C, align(32))]
        $vis struct $Record {
            $($(#[$what])* pub $field: $kind,)*
            $(#[doc(hidden)] pub free: [f32; $free],)?
        }

        const _: () = assert!(
            size_of::<$Record>() == size_of::<$crate::simd::Row>()
                && align_of::<$Record>() == align_of::<$crate::simd::Row>()
        );

        #[doc = concat!("`N` of [`", stringify!($Record), "`].")]
        #[derive(Clone, Copy, Debug)]
        $vis struct $Wide<L: $crate::simd::Lanes> {
            $($(#[$what])* pub $field: <$kind as $crate::simd::record::Field>::Wide<L>,)*
        }

        #[allow(dead_code)]
        impl<L: $crate::simd::Lanes> $Wide<L> {
            /// The records `list` of a table: 1 to `N`; missing lanes repeat the last.
            #[inline(always)]
            pub fn load(records: &[$Record], list: &[u32]) -> Self {
                let columns = L::load_rows(bytemuck::cast_slice(records), list);
                Self {
                    $($field: <$kind as $crate::simd::record::Field>::gather(
                        &columns,
                        const { std::mem::offset_of!($Record, $field) / 4 },
                    ),)*
                }
            }

            /// Writes the records `list` of a table; what is free becomes 0.
            #[inline(always)]
            pub fn store(self, records: &mut [$Record], list: &[u32]) {
                let mut columns = [L::zero(); $crate::simd::Row::WIDTH];
                $(<$kind as $crate::simd::record::Field>::scatter(
                    self.$field,
                    &mut columns,
                    const { std::mem::offset_of!($Record, $field) / 4 },
                );)*
                L::store_rows(columns, bytemuck::cast_slice_mut(records), list);
            }
        }
    };
}
pub(crate) use record;

#[cfg(test)]
mod tests {
    use crate::simd::{Lanes, UintLanes, f32x8};

    record! {
        /// Some of everything.
        struct Sample / SampleLanes {
            /// A vector.
            p: [f32; 3],
            /// Bits that are no number.
            index: u32,
            /// A pair.
            uv: [f32; 2],
            /// A number.
            t: f32,
        } free 1
    }

    record! {
        /// Nothing left free.
        struct Full / FullLanes {
            /// Four.
            a: [f32; 4],
            /// Four.
            b: [f32; 4],
        }
    }

    fn sample(i: usize) -> Sample {
        let x = i as f32;
        Sample {
            p: [x, -x, 2.0 * x],
            index: 0xffff_0000 | i as u32,
            uv: [0.25, x],
            t: -1.0,
            ..Sample::default()
        }
    }

    fn moves<L: Lanes>() {
        let from: Vec<Sample> = (0..20).map(sample).collect();
        let mut to = vec![Sample::default(); 20];
        let list = &[3, 19, 7][..L::N.min(3)];
        let wide = SampleLanes::<L>::load(&from, list);
        for (i, &at) in list.iter().enumerate() {
            let one = from[at as usize];
            assert_eq!(wide.p.lane(i), one.p);
            assert_eq!(wide.index.lane(i), one.index);
            assert_eq!(wide.uv.map(|v| v.lane(i)), one.uv);
            assert_eq!(wide.t.lane(i), one.t);
        }
        // Missing lanes repeat the last.
        assert_eq!(
            wide.index.lane(L::N - 1),
            from[list[list.len() - 1] as usize].index
        );
        wide.store(&mut to, list);
        for (i, one) in to.iter().enumerate() {
            let written = list.contains(&(i as u32));
            assert_eq!(*one, if written { from[i] } else { Sample::default() });
        }
        let full = [Full {
            a: [1.0, 2.0, 3.0, 4.0],
            b: [5.0, 6.0, 7.0, 8.0],
        }];
        let mut copy = [Full::default()];
        FullLanes::<L>::load(&full, &[0]).store(&mut copy, &[0]);
        assert_eq!(full, copy);
    }

    #[test]
    fn records_are_what_their_fields_say_at_any_width() {
        moves::<f32>();
        moves::<f32x8>();
    }
}
