//! Measured surfaces: a file made of a known function, its samples, and files that are none.

use crate::{common, support};

use common::stats::{FALSE_ALARM, Random, assert_follows};
use phalanx::replay::vector::*;
use phalanx::simd::{Lanes, Vec3, f32x8};
use phalanx::surface::measured::Measured;
use phalanx::surface::measured_table::MeasuredTable;
use phalanx::surface::warp::{Grid, Warp};
use phalanx::surface::{Bsdf, BsdfValue, Mode, Tabulated};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

const ALPHA2: f64 = 0.4 * 0.4;

fn lambda(z: f64) -> f64 {
    ((1.0 + ALPHA2 * (1.0 / (z * z) - 1.0).max(0.0)).sqrt() - 1.0) / 2.0
}

fn normals(z: f64) -> f64 {
    ALPHA2 / (PI * (z * z * (ALPHA2 - 1.0) + 1.0).powi(2))
}

/// Reflection off white metal (Trowbridge and Reitz).
fn metal(o: V, i: V) -> f64 {
    let h = unit(add(o, i));
    normals(h[2]) / (4.0 * o[2] * i[2] * (1.0 + lambda(o[2]) + lambda(i[2])))
}

fn polar(theta: f64, phi: f64) -> V {
    [
        theta.sin() * phi.cos(),
        theta.sin() * phi.sin(),
        theta.cos(),
    ]
}

type Array = (&'static str, Vec<usize>, Vec<f32>);

fn tensors(arrays: &[Array]) -> Vec<u8> {
    let mut bytes = b"tensor_file\0\x01\0".to_vec();
    bytes.extend((arrays.len() as u32).to_le_bytes());
    let list = arrays
        .iter()
        .map(|(name, shape, _)| 2 + name.len() + 2 + 1 + 8 + 8 * shape.len());
    let mut offset = bytes.len() + list.sum::<usize>();
    for (name, shape, data) in arrays {
        bytes.extend((name.len() as u16).to_le_bytes());
        bytes.extend(name.as_bytes());
        bytes.extend((shape.len() as u16).to_le_bytes());
        bytes.push(10);
        bytes.extend((offset as u64).to_le_bytes());
        shape
            .iter()
            .for_each(|s| bytes.extend((*s as u64).to_le_bytes()));
        offset += 4 * data.len();
    }
    for (.., data) in arrays {
        data.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    }
    bytes
}

/// The metal as a file has it, of two wavelengths: the second reflects half.
fn arrays() -> Vec<Array> {
    let (thetas, nx, ny) = (24, 48, 48);
    let angle = |k: usize| FRAC_PI_2 * ((k as f64 + 0.02) / thetas as f64).min(0.99);
    let theta: Vec<f32> = (0..thetas).map(|k| angle(k) as f32).collect();
    let cell = |k: usize, n: usize| k as f64 / (n - 1) as f64;
    let zenith = |x: f64| x * x * FRAC_PI_2;
    let plane = |f: &dyn Fn(f64, f64) -> f64| -> Vec<f32> {
        let cells = (0..nx * ny).map(|k| f(cell(k % nx, nx), cell(k / nx, ny)) as f32);
        cells.collect()
    };
    let ndf = plane(&|x, _| normals(zenith(x).cos()));
    let sigma = plane(&|x, _| {
        let z = zenith(x).cos().max(1e-4);
        z * (1.0 + lambda(z))
    });
    let half = |x: f64, y: f64| polar(zenith(x), (2.0 * y - 1.0) * PI);
    let (mut vndf, mut spectra, mut luminance) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..thetas {
        let o = polar(f64::from(theta[k]), 0.0);
        let slice = plane(&|x, y| {
            let m = half(x, y);
            normals(m[2]) * dot(o, m).max(0.0) * x * zenith(x).sin()
        });
        let one = [vec![0.0], vec![0.0]];
        let warp = Warp::new(Grid::new(slice.clone(), [nx, ny], one, 1).unwrap()).unwrap();
        let slices = warp.slices([0.0; 2]);
        let values = plane(&|x, y| {
            let [x, y] = warp.sample(&slices, [x, y]);
            let m = half(x, y);
            let i = sub(scale(m, 2.0 * dot(o, m)), o);
            let z = i[2].max(1e-3);
            (1.0 + lambda(o[2])) / (1.0 + lambda(o[2]) + lambda(z))
        });
        vndf.extend(slice);
        spectra.extend(&values);
        spectra.extend(values.iter().map(|v| 0.5 * v));
        luminance.extend(values);
    }
    vec![
        ("theta_i", vec![thetas], theta),
        ("phi_i", vec![1], vec![0.0]),
        ("wavelengths", vec![2], vec![500.0, 600.0]),
        ("ndf", vec![ny, nx], ndf),
        ("sigma", vec![ny, nx], sigma),
        ("vndf", vec![1, thetas, ny, nx], vndf),
        ("luminance", vec![1, thetas, ny, nx], luminance),
        ("spectra", vec![1, thetas, 2, ny, nx], spectra),
    ]
}

/// Green of the first wavelength, red of the second.
fn parse(bytes: &[u8]) -> Result<MeasuredTable, String> {
    MeasuredTable::parse(bytes, |nm| {
        assert_eq!(nm, [500.0, 600.0]);
        Ok(vec![[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    })
}

fn tables() -> Tabulated {
    let mut tables = Tabulated::default();
    let table = parse(&tensors(&arrays())).unwrap_or_else(|e| panic!("{e}"));
    tables.name_of(&Arc::new(table));
    tables
}

fn eval<L: Lanes>(tables: &Tabulated, wo: V, wi: V, mode: Mode) -> BsdfValue<L> {
    let [wo, wi] = [narrow(wo), narrow(wi)].map(Vec3::splat);
    Measured::eval_in(tables, &[L::zero(); 8], wo, wi, mode)
}

#[test]
fn tables_have_the_values_of_what_they_were_made_of() {
    let tables = tables();
    let mut random = Random(1);
    let mut seen = 0;
    while seen < 1000 {
        let (o, i) = (random.direction(), random.direction());
        if o[2].abs().min(i[2].abs()) < 0.2 {
            continue;
        }
        seen += 1;
        let value = eval::<f32>(&tables, o, i, Mode::Radiance);
        let [r, g, b] = value.f.lane(0).map(f64::from);
        if o[2] * i[2] < 0.0 {
            assert!(g == 0.0 && value.pdf == 0.0, "{value:?}");
            continue;
        }
        let up = |w: V| [w[0], w[1], w[2].abs()];
        let expected = metal(up(o), up(i));
        assert!(
            (g - expected).abs() < 0.03 * expected + 2e-3,
            "{o:?} {i:?}: {g} {expected}"
        );
        assert!((r - 0.5 * g).abs() < 1e-5 && b == 0.0, "{value:?}");
        let back = eval::<f32>(&tables, i, o, Mode::Importance);
        assert_eq!(
            (back.f.y, back.pdf, back.pdf_reverse),
            (value.f.y, value.pdf_reverse, value.pdf)
        );
        let eight = eval::<f32x8>(&tables, o, i, Mode::Radiance);
        assert_eq!(
            (eight.f.lane(3), eight.pdf.lane(3)),
            (value.f.lane(0), value.pdf)
        );
    }
}

#[test]
fn sampling_follows_the_density() {
    const CELLS: usize = 10;
    const FINE: usize = 24;
    const SAMPLES: usize = 40_000;
    let tables = tables();
    let mut random = Random(2);
    for wo in [polar(0.3, 1.0), polar(1.1, -2.0), polar(PI - 0.8, 0.0)] {
        let n = CELLS * FINE;
        let mut expected = vec![0.0; CELLS * CELLS + 1];
        let (side, mut albedo) = (wo[2].signum(), 0.0);
        for k in 0..n * n {
            let [x, y] = [k % n, k / n].map(|k| (k as f64 + 0.5) / n as f64);
            let wi = polar((side * x).acos(), y * TAU);
            let value = eval::<f32>(&tables, wo, wi, Mode::Radiance);
            let share = TAU / (n * n) as f64 * SAMPLES as f64;
            albedo +=
                metal([wo[0], wo[1], wo[2].abs()], [wi[0], wi[1], x]) * x * TAU / (n * n) as f64;
            expected[k % n / FINE + CELLS * (k / n / FINE)] += f64::from(value.pdf) * share;
        }
        let all: f64 = expected.iter().sum();
        assert!(all < 1.01 * SAMPLES as f64, "{all}");
        expected[CELLS * CELLS] = (SAMPLES as f64 - all).max(0.0);
        let mut observed = vec![0.0; CELLS * CELLS + 1];
        let (mut mean, wo32) = (0.0, Vec3::<f32>::splat(narrow(wo)));
        for _ in 0..SAMPLES {
            let u = std::array::from_fn(|_| random.uniform());
            let s = Measured::sample_in(&tables, &[0.0; 8], wo32, u, Mode::Radiance);
            let w = wide(s.wi.lane(0));
            if s.throughput.y == 0.0 {
                observed[CELLS * CELLS] += 1.0;
                continue;
            }
            mean += f64::from(s.throughput.y) / SAMPLES as f64;
            let cell = |x: f64| ((x * CELLS as f64) as usize).min(CELLS - 1);
            let phi = w[1].atan2(w[0]).rem_euclid(TAU) / TAU;
            observed[cell(side * w[2]) + CELLS * cell(phi)] += 1.0;
        }
        assert_follows(&observed, &expected, FALSE_ALARM / 3.0, &format!("{wo:?}"));
        assert!((mean / albedo - 1.0).abs() < 0.03, "{mean} {albedo}");
    }
}

#[test]
fn files_that_are_none_are_refused() {
    let good = arrays();
    let bytes = tensors(&good);
    let with = |name: &str, change: &dyn Fn(&mut Array)| {
        let mut arrays = good.clone();
        arrays.iter_mut().filter(|a| a.0 == name).for_each(change);
        parse(&tensors(&arrays)).expect_err("is refused")
    };
    for (error, expected) in [
        (parse(&bytes[..10]).unwrap_err(), "is no measured BSDF"),
        (parse(&bytes[..60]).unwrap_err(), "is cut short in its list"),
        (
            parse(&bytes[..bytes.len() - 4]).unwrap_err(),
            "is cut short in \"spectra\"",
        ),
        (with("ndf", &|a| a.0 = "nfd"), "has no array \"ndf\""),
        (
            with("sigma", &|a| a.1 = vec![usize::MAX, 9]),
            "is cut short in \"sigma\"",
        ),
        (with("vndf", &|a| a.2[5] = f32::NAN), "no numbers"),
        (with("vndf", &|a| a.2[5] = -1.0), "below 0"),
        (with("luminance", &|a| a.1[1] = 23), "for other angles"),
        (with("theta_i", &|a| a.2[3] = 0.0), "do not rise"),
        (
            with("spectra", &|a| a.1[2] = 1),
            "other angles or wavelengths",
        ),
        (with("luminance", &|a| a.2.fill(0.0)), "0 everywhere"),
    ] {
        assert!(error.contains(expected), "{error}: {expected}");
    }
}

/// Through a scene file, under both integrators.
#[test]
fn integrators_agree_about_measured_surfaces() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("metal.bsdf");
    let mut arrays = arrays();
    // Two wavelengths say little of a colour: the whole range, and darker towards red.
    (arrays.iter_mut().filter(|a| a.0 == "wavelengths")).for_each(|a| a.2 = vec![360.0, 830.0]);
    std::fs::write(&name, tensors(&arrays)).unwrap();
    let scene = support::scene(&format!(
        "LookAt 0 -3 1 0 0 .3 0 0 1 Camera \"perspective\" \"float fov\" 45
        Film \"rgb\" \"integer xresolution\" 12 \"integer yresolution\" 9 PixelFilter \"box\"
        Integrator \"mlt\" \"integer maxdepth\" 4
        WorldBegin LightSource \"infinite\" \"rgb L\" [.3 .3 .3]
        LightSource \"point\" \"rgb I\" [1 1 1] \"float scale\" 8 \"point3 from\" [1 -2 3]
        Material \"measured\" \"string filename\" \"{}\" Shape \"sphere\" \"float radius\" .7
        Material \"diffuse\" Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]
        \"point3 P\" [-3 -3 -.7 3 -3 -.7 3 3 -.7 -3 3 -.7]",
        name.display()
    ));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    support::expect_integrators_agree(&scene, 64, 16, [3, 3], "measured");
}
