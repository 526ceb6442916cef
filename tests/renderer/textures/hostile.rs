//! Textures of any parameters: whatever is put in, values are numbers.

use crate::property;
use phalanx::scene::{
    Image, Mapping, MarbleSpline, Octaves, Param, Texture, ToTexture, UvMapping, Wrap,
};
use phalanx::surface::texture::{Place, evaluate, prefetch_texels};
use proptest::prelude::*;

/// Any bits in any parameter and place.
fn any_texture() -> impl Strategy<Value = Vec<Texture>> {
    let number = || {
        prop_oneof![
            3 => -10f32..10.0,
            1 => prop::num::f32::ANY,
            1 => prop::sample::select(vec![
                0.0, -0.0, f32::MAX, f32::MIN, f32::INFINITY, f32::NAN, 1e-40,
            ]),
        ]
    };
    let numbers = prop::collection::vec(number(), 40);
    (prop::collection::vec(0..20u32, 4), numbers, 0..=64u32).prop_map(|(kinds, n, count)| {
        let matrix = |i: usize| -> ToTexture {
            std::array::from_fn(|r| std::array::from_fn(|c| n[(i + 4 * r + c) % n.len()]))
        };
        let rgb = |i: usize| [n[i], n[i + 1], n[i + 2]];
        let octaves = Octaves {
            count,
            roughness: n[7],
        };
        let mut list = vec![Texture::Constant(rgb(0))];
        for kind in kinds {
            let a = Param::Texture(list.len() as u32 - 1);
            let b = Param::Texture(0);
            let mapping = match kind % 5 {
                0 => Mapping::Uv(UvMapping {
                    su: n[0],
                    sv: n[1],
                    du: n[2],
                    dv: n[3],
                }),
                1 => Mapping::Spherical(matrix(4)),
                2 => Mapping::Planar(matrix(4)),
                _ => Mapping::Cylindrical {
                    to_texture: matrix(4),
                    unit: kind % 5 == 3,
                },
            };
            let to_texture = matrix(9);
            list.push(match kind {
                0 => Texture::Scale { a, b },
                1 => Texture::Mix { a, b, amount: a },
                2 => Texture::DirectionMix {
                    a,
                    b,
                    direction: rgb(5),
                },
                3 | 4 => Texture::Checkerboard { a, b, mapping },
                5 => Texture::Blocks { a, b, to_texture },
                6 | 7 => Texture::Dots {
                    dot: a,
                    ground: b,
                    mapping,
                },
                8 => Texture::Bilerp {
                    v00: rgb(0),
                    v01: rgb(1),
                    v10: rgb(2),
                    v11: rgb(3),
                    mapping,
                },
                9..=11 => Texture::Uv { mapping },
                12 => Texture::Fbm {
                    octaves,
                    to_texture,
                },
                13 => Texture::Wrinkled {
                    octaves,
                    to_texture,
                },
                14 => Texture::Windy { to_texture },
                15 | 16 => Texture::Marble {
                    octaves,
                    scale: n[8],
                    variation: n[9],
                    spline: if kind == 15 {
                        MarbleSpline::V3
                    } else {
                        MarbleSpline::V4
                    },
                    to_texture,
                },
                _ => Texture::Image {
                    image: 0,
                    mapping,
                    wrap: [Wrap::Repeat, Wrap::Black, Wrap::Clamp][kind as usize % 3],
                    scale: n[10],
                    invert: n[11] > 0.0,
                },
            });
        }
        list
    })
}

proptest! {
    #![proptest_config(property::cases(20_000))]

    #[test]
    fn values_are_finite_whatever_is_put_in(
        textures in any_texture(),
        place in prop::array::uniform8(
            prop_oneof![2 => -2f32..2.0, 1 => prop::num::f32::ANY, 1 => Just(0.0)],
        ),
    ) {
        let image = Image {
            name: String::new(),
            width: 3,
            height: 2,
            texels: vec![[1.0, 0.5, 0.25]; 6],
        };
        let [u, v, x, y, z, nx, ny, nz] = place;
        let place = Place { uv: [u, v], p: [x, y, z], n: [nx, ny, nz] };
        for i in 0..textures.len() as u32 {
            prefetch_texels(&textures, std::slice::from_ref(&image), i, &place);
            let images = std::slice::from_ref(&image);
            let value = evaluate(&textures, images, Param::Texture(i), &place);
            prop_assert!(value.iter().all(|v| v.is_finite()), "{:?} {:?}", value, textures[i as usize]);
        }
    }
}
