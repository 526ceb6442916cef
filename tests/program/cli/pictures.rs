//! What a render writes: pictures in every format, figures, strategies.

use super::{Folder, TINY, bright};
use phalanx::film::output::read_pfm;
use std::fs;

#[test]
fn without_arguments_the_built_in_scene_becomes_two_files() {
    let folder = Folder::new();
    let ran = folder.run(&format!("render {TINY}")).succeeds();
    assert_eq!(folder.files(), ["studio.exr", "studio.png"]);
    let picture = folder.exr("studio.exr");
    assert_eq!((picture.width, picture.height), (32, 32));
    assert!(bright(&picture));
    let png = image::open(folder.path().join("studio.png")).unwrap();
    assert_eq!((png.width(), png.height()), (32, 32));
    assert_eq!(ran.stdout(), "");
    assert!(ran.stderr().contains("wrote studio.png"));
}

#[test]
fn every_format_and_folder() {
    let folder = Folder::new();
    fs::create_dir(folder.path().join("sub")).unwrap();
    folder
        .run(&format!(
            "render {TINY} -o sub/a.exr --output b.PFM -o c.png -o c.png"
        ))
        .succeeds();
    assert_eq!(folder.files(), ["b.PFM", "c.png", "sub"]);
    let exr = folder.exr("sub/a.exr");
    let pfm = read_pfm(&folder.path().join("b.PFM")).unwrap();
    assert_eq!(exr.pixels, pfm.pixels);
}

#[test]
fn the_scene_names_its_picture() {
    let folder = Folder::new();
    let film =
        |name: &str| format!("Film \"image\" {name}\nWorldBegin\nShape \"sphere\"\nWorldEnd\n");
    let cases = [
        (
            "a.pbrt",
            "\"string filename\" \"/some/where/x.pfm\"",
            "x.pfm",
        ),
        ("b.pbrt", "\"string filename\" \"y.tga\"", "y.exr"),
        ("d.pbrt", "\"string filename\" \"z\"", "z.exr"),
        ("c.pbrt", "", "c.exr"),
    ];
    for (scene, name, picture) in cases {
        folder.write(scene, &film(name));
        let ran = folder
            .run(&format!("render {scene} {TINY} --quiet"))
            .succeeds();
        assert!(folder.files().contains(&picture.to_string()), "{picture}");
        let instead =
            format!("only .exr, .pfm and .png are written here: writing {picture} instead");
        let other = name.contains("y.tga") || name.contains("\"z\"");
        assert_eq!(ran.stderr().contains(&instead), other, "{}", ran.stderr());
    }
}

#[test]
fn figures_are_a_json_object() {
    let folder = Folder::with_cornell();
    folder
        .run(&format!(
            "render cornell.pbrt {TINY} --integrator mmlt --stats s.json --seed 18446744073709551615 --threads 2 --max-depth 3 --mutations 200"
        ))
        .succeeds();
    let text = fs::read_to_string(folder.path().join("s.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let json = json.as_object().unwrap();
    let names = "seed lanes threads width height max_depth mutations mutations_per_second rays rays_per_second \
        load_seconds bootstrap_seconds render_seconds total_seconds acceptance_large acceptance_small b b_stderr \
        rejected_nonfinite peak_rss_bytes relmse relative_error stuck_chains";
    for name in names.split_whitespace() {
        assert!(json[name].is_number(), "{name}: {}", json[name]);
    }
    let depths = json["depths"].as_array().unwrap();
    let b: f64 = depths.iter().map(|d| d["b"].as_f64().unwrap()).sum();
    assert!((b / json["b"].as_f64().unwrap() - 1.0).abs() < 1e-9);
    for name in ["b_stderr", "share", "chains", "mutations"] {
        assert!(depths[0][name].is_number(), "{name}");
    }
    let strategies = depths[1]["strategies"].as_array().unwrap();
    for name in ["s", "t", "share", "acceptance_small", "acceptance_large"] {
        assert!(strategies[0][name].is_number(), "{name}");
    }
    let tiles = &json["tiles"];
    assert_eq!((&tiles["columns"], &tiles["rows"]), (&2.into(), &2.into()));
    let numbers = |name: &str| -> Vec<f64> {
        let list = tiles[name].as_array().unwrap();
        list.iter().map(|v| v.as_f64().unwrap()).collect()
    };
    let mean = numbers("mean").iter().sum::<f64>() / 4.0;
    assert!((mean / b - 1.0).abs() < 1e-6, "{mean} {b}");
    assert!(numbers("stderr").iter().all(|e| *e > 0.0 && *e < b));
    assert_eq!(json["integrator"], "mmlt");
    assert_eq!(json["seed"], u64::MAX);
    assert_eq!(
        (json["threads"].as_u64(), json["lanes"].as_u64()),
        (Some(2), Some(8))
    );
    assert_eq!(json["max_depth"], 3);
    assert!(json["mutations"].as_u64().unwrap() >= 2 * 32 * 32);
    let seconds = |name: &str| json[name].as_f64().unwrap();
    let parts = ["load_seconds", "bootstrap_seconds", "render_seconds"].map(seconds);
    assert!(parts.iter().sum::<f64>() <= seconds("total_seconds"));
    // `/dev/stdout` is written into, not replaced.
    let ran = folder
        .run(&format!("render {TINY} -q --stats /dev/stdout"))
        .succeeds();
    assert!(serde_json::from_str::<serde_json::Value>(&ran.stdout()).is_ok());
}

#[test]
fn strategies_are_written_beside_the_picture() {
    let folder = Folder::new();
    let small = "--resolution 16x16 --max-depth 2";
    let ran = folder
        .run(&format!(
            "render {small} --integrator bdpt --spp 2 --strategies -o a.exr -o b.png"
        ))
        .succeeds();
    let said = ran.stderr();
    assert!(said.contains("wrote a.s0.t2.weighted.exr"), "{said}");
    let mut expected = vec!["a.exr".to_string(), "b.png".into()];
    for (s, t) in [
        (0, 2),
        (0, 3),
        (1, 2),
        (2, 1),
        (0, 4),
        (1, 3),
        (2, 2),
        (3, 1),
    ] {
        for kind in ["weighted", "unweighted"] {
            expected.push(format!("a.s{s}.t{t}.{kind}.exr"));
            expected.push(format!("b.s{s}.t{t}.{kind}.png"));
        }
    }
    expected.sort();
    assert_eq!(folder.files(), expected);
    let whole = folder.exr("a.exr");
    let mut sum = vec![[0.0f32; 3]; whole.pixels.len()];
    for file in expected.iter().filter(|f| f.contains(".weighted.exr")) {
        let part = folder.exr(file);
        assert_eq!((part.full, part.offset), (whole.full, whole.offset));
        let values = sum.as_flattened_mut().iter_mut();
        (values.zip(part.pixels.as_flattened())).for_each(|(sum, v)| *sum += v);
    }
    for (a, b) in (sum.as_flattened().iter()).zip(whole.pixels.as_flattened()) {
        assert!((a - b).abs() <= 2e-6 * b, "{a} {b}");
    }
    let many = "render --integrator bdpt --strategies --max-depth 21 -o c.exr";
    assert!(folder.run(many).fails(2).contains("at most 20"));
    for integrator in ["pt", "lt"] {
        let ran = folder
            .run(&format!(
                "render {small} --integrator {integrator} --spp 1 --strategies -o c.exr"
            ))
            .succeeds();
        let said = ran.stderr();
        assert!(said.contains("--strategies means nothing"), "{said}");
    }
}

#[test]
fn exr_files_carry_settings_and_figures() {
    use exr::prelude::AttributeValue;
    let folder = Folder::new();
    folder
        .run(&format!(
            "render {TINY} --integrator mmlt --seed 7 -o a.exr --sigma 0.02"
        ))
        .succeeds();
    let meta = exr::meta::MetaData::read_from_file(folder.path().join("a.exr"), true).unwrap();
    let all = &meta.headers[0].own_attributes.other;
    let get = |name: &str| {
        let name = format!("phalanx:{name}");
        all.iter().find(|(n, _)| **n == *name).map(|(_, v)| v)
    };
    let software = meta.headers[0].own_attributes.software_name.as_ref();
    assert!(software.unwrap().to_string().starts_with("Phalanx "));
    assert_eq!(get("seed"), Some(&AttributeValue::I32(7)));
    assert!(matches!(get("b"), Some(AttributeValue::F64(b)) if *b > 0.0));
    assert!(matches!(get("sigma"), Some(AttributeValue::F64(s)) if (*s - 0.02).abs() < 1e-6));
    assert!(matches!(get("mutations"), Some(AttributeValue::I32(n)) if *n >= 2048));
    assert!(get("scene").is_some());
}

/// However they were made.
#[test]
fn equal_renders_are_equal_files() {
    let folder = Folder::new();
    for integrator in ["auto", "mmlt", "bdpt"] {
        let files = ["--threads 1 --lanes 1", "--threads 2 --lanes 8"].map(|how| {
            let flags =
                format!("--integrator {integrator} --spp 2 --error-layers -o a.exr -o a.png");
            folder
                .run(&format!("render {TINY} {flags} {how}"))
                .succeeds();
            ["a.exr", "a.png"].map(|name| std::fs::read(folder.path().join(name)).unwrap())
        });
        assert!(files[0] == files[1], "{integrator}");
    }
}

/// Glass under a small lamp: what comes through it is found by few paths.
const SPARKLING: &str = r#"LookAt 0 2 5  0 0.5 0  0 1 0
Camera "perspective" "float fov" 40
PixelFilter "box" "float xwidth" 0.5 "float ywidth" 0.5
Film "image" "integer xresolution" 64 "integer yresolution" 64
WorldBegin
LightSource "infinite" "rgb L" [0.2 0.2 0.2]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [900 900 900]
Translate 1 3 1
Shape "sphere" "float radius" 0.05
AttributeEnd
Material "matte" "rgb Kd" [0.6 0.6 0.6]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-4 0 -4 4 0 -4 4 0 4 -4 0 4]
Material "glass"
AttributeBegin
Translate 0 0.7 0
Shape "sphere" "float radius" 0.6
AttributeEnd
WorldEnd
"#;

/// The layer of an EXR file, red, green and blue.
fn layer(path: &std::path::Path, prefix: &str) -> Option<Vec<[f32; 3]>> {
    let image = exr::prelude::read_all_flat_layers_from_file(path).unwrap();
    let channels = &image.layer_data[0].channel_data.list;
    let values = |c: &str| -> Option<Vec<f32>> {
        let name = format!("{prefix}{c}");
        let channel = channels.iter().find(|channel| channel.name.eq(&name))?;
        Some(channel.sample_data.values_as_f32().collect())
    };
    let [r, g, b] = [values("R")?, values("G")?, values("B")?];
    Some((0..r.len()).map(|i| [r[i], g[i], b[i]]).collect())
}

/// What is said to have been replaced and to be gone is; what was rendered is beside it.
#[test]
fn spots_are_replaced_and_kept() {
    let folder = Folder::new();
    folder.write("a.pbrt", SPARKLING);
    let effort = |integrator: &str| match integrator {
        "pt" => "--spp 16 --max-depth 6",
        _ => "--mutations 24 --chains 512 --bootstrap 3000 --max-depth 6",
    };
    for integrator in ["pt", "mmlt"] {
        let flags = format!(
            "render a.pbrt --no-png --threads 1 --integrator {integrator} {}",
            effort(integrator)
        );
        folder.run(&format!("{flags} -o plain.exr")).succeeds();
        let ran = folder.run(&format!(
            "{flags} -o a.exr -o a.pfm --despeckle --firefly-report --stats a.json"
        ));
        let said = ran.succeeds().stderr();
        let path = folder.path().join("a.exr");
        let (clean, raw) = (folder.exr("a.exr").pixels, layer(&path, "raw.").unwrap());
        assert_eq!(raw, folder.exr("plain.exr").pixels, "{integrator}");
        assert_eq!(layer(&folder.path().join("plain.exr"), "raw."), None);

        let stats = std::fs::read_to_string(folder.path().join("a.json")).unwrap();
        let stats: serde_json::Value = serde_json::from_str(&stats).unwrap();
        let speckles = &stats["speckles"];
        let changed = (clean.iter().zip(&raw)).filter(|(a, b)| a != b).count();
        assert!(changed > 0, "{integrator}: {said}");
        assert_eq!(speckles["pixels"], changed, "{integrator}");
        let sum = |pixels: &[[f32; 3]]| -> f64 {
            pixels.as_flattened().iter().map(|v| f64::from(*v)).sum()
        };
        let gone = (sum(&raw) - sum(&clean)) / sum(&raw);
        let share = speckles["share"].as_f64().unwrap();
        assert!(gone > 0.0 && (gone - share).abs() < 1e-9, "{gone} {share}");
        for part in [
            format!("--despeckle: {changed} pixel"),
            format!("{:.3} % of the picture's light is gone", 100.0 * gone),
            "layers raw of a.exr have what was rendered".into(),
            "fireflies: ".into(),
        ] {
            assert!(said.contains(&part), "{part}: {said}");
        }
    }
    let one = "render a.pbrt --no-png --integrator pt --spp 1 --despeckle -o a.pfm";
    let said = folder.run(one).succeeds().stderr();
    assert!(
        said.contains("one sample per pixel has no two halves"),
        "{said}"
    );
    let both = "render a.pbrt --despeckle --no-estimate -o a.pfm";
    assert!(folder.run(both).fails(2).contains("--no-estimate"));
}
