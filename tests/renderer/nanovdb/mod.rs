//! NanoVDB files: written here, read back, broken, and rendered.

mod encoder;

use std::fs;
use std::path::Path;

use self::encoder::{Codec, Grid, file};
use crate::media::{DENSITY, expect_agreement};
use crate::support;

use phalanx::formats::nanovdb::{FloatGrid, read};
use phalanx::medium::{MediumTable, Passed, Piece};
use phalanx::pbrt::{load_str, load_within};
use phalanx::scene::{IntegratorKind, Scene};
use support::{Runs, settings};
use tempfile::TempDir;

fn within(bytes: &[u8], name: &str) -> Result<Option<FloatGrid>, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nvdb");
    fs::write(&path, bytes).unwrap();
    read(&path, name, &mut |bytes| match bytes {
        0..0x1000_0000 => Ok(()),
        _ => Err(format!("needs {bytes} bytes")),
    })
}

/// Leaves on both sides of 0 and far away, cubes of all sizes.
fn odd_grid() -> Grid {
    let leaf = |seed: u32| {
        let value = move |i: u32| (i * seed % 101) as f32 * 0.125;
        (0..512).map(value).collect::<Vec<f32>>()
    };
    Grid {
        active: [[-21, -9, -130], [150, 12, 17]],
        leaves: vec![
            ([-24, -16, 8], leaf(3)),
            ([0, 0, 0], leaf(5)),
            ([136, 8, 16], leaf(7)),
            ([-8, -8, -136], leaf(11)),
        ],
        cubes: vec![
            ([-16, -8, -8], 3, 2.5),
            ([128, -128, 0], 7, 0.75),
            ([-4096, 0, -4096], 12, 0.25),
        ],
        ..Grid::dense("density", [0; 3], [1; 3], &[1.0])
    }
    .placed([0.5, 0.25, 2.0], [1.0, 2.0, 3.0])
}

fn expect_grid(found: &FloatGrid, grid: &Grid) {
    assert_eq!(found.low, grid.active[0].map(|v| i64::from(v) - 1));
    let size = [0, 1, 2].map(|k| (grid.active[1][k] - grid.active[0][k] + 3) as u32);
    assert_eq!(found.size, size);
    for (i, value) in found.values.iter().enumerate() {
        let i = i as u32;
        let at = [i % size[0], i / size[0] % size[1], i / size[0] / size[1]];
        let at = [0, 1, 2].map(|k| at[k] as i32 + grid.active[0][k] - 1);
        assert_eq!(*value, grid.value(at), "{at:?}");
    }
}

#[test]
fn what_is_written_is_read() {
    let grid = odd_grid();
    let other = Grid {
        name: "temperature",
        ..Grid::dense("", [3, 4, 5], [2, 1, 2], &[1.0, 2.0, 3.0, 4.0])
    };
    for codec in [
        Codec::Stored,
        Codec::Zlib,
        Codec::Blosc(4096),
        Codec::Blosc(1 << 18),
    ] {
        let mut bytes = file(&[other.clone(), grid.clone()], codec);
        // A further segment, with another grid.
        let third = Grid {
            name: "third",
            ..other.clone()
        };
        bytes.extend(file(std::slice::from_ref(&third), Codec::Zlib));
        let found = within(&bytes, "density").unwrap().unwrap();
        expect_grid(&found, &grid);
        assert_eq!(found.to_world[2], [0.0, 0.0, 2.0, 3.0]);
        assert_eq!(found.bounds, [[-9.5, -0.25, -257.0], [76.5, 5.25, 39.0]]);
        expect_grid(&within(&bytes, "temperature").unwrap().unwrap(), &other);
        expect_grid(&within(&bytes, "third").unwrap().unwrap(), &third);
        assert_eq!(within(&bytes, "fourth"), Ok(None));
    }
    let raw = [other.bytes(), grid.bytes()].concat();
    expect_grid(&within(&raw, "density").unwrap().unwrap(), &grid);
    assert_eq!(within(&raw, "velocity"), Ok(None));
}

/// 3000 floats: parts of 300 zeros, and of quarters of `i * i mod 97`, packed by c-blosc 1.21.7.
const BY_C_BLOSC: &str = "\
02012104e02e0000e02e0000cc01000014000000160000001f000100ffffffffffffffffffffffaa500000000000\
160000001f000100ffffffffffffffffffffffaa500000000000af0000001f000100ff19ff52a240c03c9000f878\
be048c4054c030b62cbc480082d8b058b0b2740c30ac84400090c0baaa9e969292969eaabac090004084ac300c74\
b2b058b0d8820048bc2cb630c054408c04be78f800903cc040a2804410c8801080800080801080c81044806100b8\
0f5702ff191f004602ff080e69030f5802ff1a0f8c04f50e46020eaf050f5802ff1a0fd206e30f4602110ef5070f\
5802ff1a0f1809d10f460223093b0a503cc040a280cd0000001f000100ff1941413f404104002141410500010800\
104005000204003141403f1500010200002c00021700012200002400000200010800002800000400c14141404040\
3f3e003e3f40401900003500000400032800005300006b00001c000004000f6100980f5702ff191f00e501a60396\
020099020fa702550f5802ff1b019b01184153040f8c04e201f700010200018805004a05000400094e050f5802ff\
1b0f4602ff0706bc070423010f5802ff1c0f1809cf011a020102000f8c04070e460201020004b4045041403f4141";

/// What c-blosc writes is what this reader reads, matches of LZ4 among it: a leaf of it.
#[test]
fn chunks_of_c_blosc_are_read() {
    let packed: Vec<u8> = (0..BY_C_BLOSC.len() / 2)
        .map(|i| u8::from_str_radix(&BY_C_BLOSC[2 * i..2 * i + 2], 16).unwrap())
        .collect();
    let mut found = Vec::new();
    phalanx::formats::nanovdb::blosc::unpack(&packed, &mut found, 12_000).unwrap();
    let truth = (0..3000u32).flat_map(|i| match i / 300 % 2 {
        0 => [0; 4],
        _ => ((i * i % 97) as f32 * 0.25).to_le_bytes(),
    });
    assert!(found.into_iter().eq(truth));
    let mut none = Vec::new();
    let error = phalanx::formats::nanovdb::blosc::unpack(&packed, &mut none, 11_999);
    assert!(error.unwrap_err().contains("longer"));
}

/// Whatever is cut off or changed, there is a grid or a message.
#[test]
fn broken_files_are_refused() {
    let small = Grid::dense("density", [0; 3], [2; 3], &[1.0; 8]);
    for codec in [Codec::Stored, Codec::Zlib, Codec::Blosc(4096)] {
        let whole = file(std::slice::from_ref(&small), codec);
        for length in (0..whole.len()).step_by(whole.len() / 60) {
            let cut = within(&whole[..length], "density");
            let found_nothing = length == 0 && cut == Ok(None);
            assert!(cut.is_err() || found_nothing, "{codec:?} {length}");
        }
        let mut random = 1u32;
        for _ in 0..300 {
            let mut bytes = whole.clone();
            for _ in 0..3 {
                random = random.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                // Most of a file is tables.
                let at = (random >> 8) as usize % bytes.len().min(1400);
                bytes[at] = (random >> 3) as u8;
            }
            if let Err(message) = within(&bytes, "density") {
                assert!(!message.contains('\n') && !message.is_empty());
            }
        }
    }
    let refused = |bytes: &[u8], what: &str| {
        let message = within(bytes, "density").unwrap_err();
        assert!(message.contains(what), "{message}");
    };
    refused(b"NanoVDBXabcdefghijklmnop", "version");
    refused(b"OpenVDB and so on, and on", "no NanoVDB");
    let of = |grid: Grid| file(&[grid], Codec::Stored);
    let level_set = Grid {
        class: 1,
        ..small.clone()
    };
    refused(&of(level_set), "class 1");
    let doubles = Grid {
        kind: 2,
        ..small.clone()
    };
    refused(&of(doubles), "type 2");
    let wide = Grid {
        active: [[0; 3], [4000; 3]],
        ..small.clone()
    };
    refused(&of(wide), "needs 256");
    let wider = Grid {
        active: [[0; 3], [1 << 20, 1, 1]],
        ..small.clone()
    };
    refused(&of(wider), "voxels wide");
    let mut promise = of(small);
    promise[16..24].copy_from_slice(&(1u64 << 60).to_le_bytes());
    refused(&promise, "promises");
}

/// A folder with a file of these grids, and a v4 scene of a medium in it that fills a ball.
fn around(grids: &[Grid], codec: Codec, medium: &str, rest: &str) -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.nvdb"), file(grids, codec)).unwrap();
    (
        folder,
        text(
            &format!("\"string type\" \"nanovdb\" \"string filename\" \"a.nvdb\" {medium}"),
            rest,
        ),
    )
}

fn text(medium: &str, rest: &str) -> String {
    format!(
        "LookAt 0 0 -4  0 0 0  0 1 0\nCamera \"orthographic\"\n\
         Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\n\
         PixelFilter \"box\"\nIntegrator \"volpath\" \"integer maxdepth\" 4\nWorldBegin\n\
         AttributeBegin\nTranslate -1 -1 -1 Scale 2 2 2\n\
         MakeNamedMedium \"smoke\" \"float g\" .4 {medium}\nAttributeEnd\n{rest}\
         Material \"interface\"\nMediumInterface \"smoke\" \"\"\n\
         Shape \"sphere\" \"float radius\" 2\n"
    )
}

fn load(folder: &TempDir, text: &str) -> Scene {
    load_str(text, "test.pbrt", folder.path()).unwrap_or_else(|e| panic!("{e}"))
}

/// Optical depth of red between two points of the world.
fn depth(scene: &Scene, from: [f64; 3], to: [f64; 3]) -> f64 {
    let space = &scene.space;
    let inside = |p: [f64; 3]| [0, 1, 2].map(|k| (p[k] - space.centre[k]) * space.scale);
    let (from, to) = (inside(from), inside(to));
    let piece = Piece {
        origin: from.map(|v| v as f32),
        direction: [0, 1, 2].map(|k| (to[k] - from[k]) as f32),
        range: [0.0, 1.0],
    };
    let mut passed = Passed::default();
    MediumTable::of(&scene.media, None).pass(0, &piece, &mut passed);
    -f64::from(passed.transmittance()[0]).ln()
}

/// Between its first and its last voxel a density of 1 is 1, beyond the last it falls to 0 within a
/// voxel, and before the first there is nothing, where pbrt-v4 has its bounds; those of a
/// temperature that reaches farther are the density's, too.
#[test]
fn grids_end_where_those_of_pbrt_do() {
    let ones = Grid::dense("density", [5, 5, 5], [4, 4, 4], &[1.0; 64]);
    // Voxels 5 and 8 lie at 0.1 and 0.7 of the unit cube.
    let ones = ones.placed([0.2; 3], [-0.9; 3]);
    let warm = Grid::dense("temperature", [3, 3, 3], [8, 8, 8], &[50.0; 512]);
    let warm = warm.placed([0.2; 3], [-0.9; 3]);
    let medium = "\"spectrum sigma_a\" [200 .5 900 .5] \"spectrum sigma_s\" [200 .25 900 .25] \
                  \"float scale\" 2 ";
    for (grids, before) in [(vec![ones.clone()], 0.0), (vec![ones.clone(), warm], 0.5)] {
        let (folder, text) = around(&grids, Codec::Zlib, medium, "");
        let scene = load(&folder, &text);
        // In the world a voxel is 0.4 wide.
        let truth = 1.5 * 0.4 * (before + 3.0 + 0.5);
        for axis in 0..3 {
            let (mut from, mut to) = ([-0.3, 0.1, 0.2], [-0.3, 0.1, 0.2]);
            (from[axis], to[axis]) = (-3.0, 3.0);
            let found = depth(&scene, from, to);
            assert!((found / truth - 1.0).abs() < 1e-5, "{found} {truth}");
            assert!((depth(&scene, to, from) / truth - 1.0).abs() < 1e-5);
        }
    }
}

/// A numbered grid within a frame of zeros, as a file and as text.
fn framed() -> ([i32; 3], Vec<f32>) {
    let (size, mut values) = ([4, 5, 6], vec![0.0; 120]);
    for (i, value) in DENSITY.into_iter().enumerate() {
        let at = [i % 2 + 1, i / 2 % 3 + 1, i / 6 + 1];
        values[(at[2] * 5 + at[1]) * 4 + at[0]] = value as f32;
    }
    (size, values)
}

const LIGHT: &str = "LightSource \"point\" \"point3 from\" [1 2 -2] \"rgb I\" [9 9 9]\n";

/// Files have the picture of the same numbers in a `uniformgrid`, also where they glow.
#[test]
fn files_are_as_grids_of_numbers() {
    let (size, values) = framed();
    let list = |values: &[f32]| {
        values
            .iter()
            .map(f32::to_string)
            .collect::<Vec<_>>()
            .join(" ")
    };
    let sigma = "\"rgb sigma_a\" [.5 1 2] \"rgb sigma_s\" [3 2 1] \"float scale\" 1.5 \
                 \"float temperaturescale\" 2500 \"float temperatureoffset\" .2 ";
    let step = size.map(|n| 1.0 / f64::from(n));
    // Number 0 is the first of the frame; its place is the middle of the first cell.
    let place = |grid: Grid| grid.placed(step, step.map(|s| 0.5 * s));
    let density = place(Grid::dense("smoke", [0; 3], size, &values));
    let heat = place(Grid::dense("heat", [0; 3], size, &values));
    let names = "\"string gridname\" \"smoke\" \"string temperaturename\" \"heat\"";
    for (glows, light) in [(false, LIGHT), (true, "")] {
        let mut grids = vec![density.clone()];
        grids.extend(glows.then(|| heat.clone()));
        let (folder, of_file) = around(
            &grids,
            Codec::Blosc(4096),
            &format!("{sigma}{names} \"float Lescale\" .7"),
            light,
        );
        let numbers = format!(
            "\"string type\" \"uniformgrid\" \"integer nx\" 4 \"integer ny\" 5 \"integer nz\" 6 \
             \"float density\" [{}] {sigma}",
            list(&values)
        );
        let heat = format!(
            "\"float temperature\" [{}] \"float Lescale\" [{}]",
            list(&values),
            list(&[0.7; 120])
        );
        let of_numbers = text(&(numbers + if glows { &heat } else { "" }), light);
        let [one, other] = [of_file, of_numbers].map(|text| {
            let scene = load(&folder, &text);
            Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 64), 12)
        });
        for c in 0..3 {
            assert!(one.whole(c).mean > 0.0);
            let what = format!("file, glows {glows}, channel {c}");
            one.whole(c).expect_same(&other.whole(c), &what);
        }
    }
}

/// Integrators agree about a density from a file.
#[test]
fn integrators_agree_about_files() {
    let (size, values) = framed();
    let step = size.map(|n| 1.0 / f64::from(n));
    let grid = Grid::dense("density", [0; 3], size, &values).placed(step, step.map(|s| 0.5 * s));
    let medium = "\"rgb sigma_a\" [.4 .2 .0] \"rgb sigma_s\" [2 2.5 3]";
    let lamp = "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [3 3 3]\nTranslate 1.5 2 -2\n\
                Shape \"sphere\" \"float radius\" .5\nAttributeEnd\n";
    let (folder, text) = around(&[grid], Codec::Zlib, medium, lamp);
    expect_agreement(&load(&folder, &text), 1, "media-nanovdb");
}

/// What a scene gets wrong has a message with its place.
#[test]
fn messages_say_what_is_wrong() {
    let ones = Grid::dense("density", [5, 5, 5], [4, 4, 4], &[1.0; 64]);
    let refused = |grids: &[Grid], medium: &str, what: &str| {
        let (folder, text) = around(grids, Codec::Stored, medium, "");
        let error = load_str(&text, "test.pbrt", folder.path()).unwrap_err();
        let error = error.to_string();
        assert!(error.starts_with("test.pbrt:9:"), "{error}");
        assert!(error.contains(what), "{error}");
    };
    refused(
        std::slice::from_ref(&ones),
        "\"string gridname\" \"fog\"",
        "no grid \"fog\"",
    );
    let full = Grid {
        background: 0.5,
        ..ones.clone()
    };
    refused(&[full], "", "only 0 is supported");
    let flat = ones.clone().placed([1.0, 0.0, 1.0], [0.0; 3]);
    refused(&[flat], "", "no volume");
    let text = text("\"string type\" \"nanovdb\"", "");
    let error = load_str(&text, "test.pbrt", Path::new(".")).unwrap_err();
    assert!(error.to_string().contains("\"string filename\""), "{error}");

    let (folder, text) = around(&[ones], Codec::Zlib, "", "");
    let path = folder.path().join("a.pbrt");
    fs::write(&path, text).unwrap();
    let error = load_within(&path, 200_000, &Default::default()).unwrap_err();
    assert!(error.to_string().contains("the limit is"), "{error}");
}
