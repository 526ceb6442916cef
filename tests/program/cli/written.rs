//! What a render may overwrite, and what becomes of what was there.

use super::{Folder, Ran, TINY, bright};
use std::fs;
use std::process::Command;

const SCENE: &str = "Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8 \"string filename\" \"film.png\"\n\
    WorldBegin\n\
    LightSource \"infinite\" \"string mapname\" \"sky.pfm\"\n\
    Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"film.png\"\n\
    Include \"part.pbrt\"\n\
    WorldEnd\n";
const PART: &str = "Material \"matte\" \"texture Kd\" \"t\"\n\
    Shape \"plymesh\" \"string filename\" \"mesh.ply\"\n\
    Material \"matte\" \"spectrum Kd\" \"grey.spd\"\n\
    Shape \"sphere\"\n";
const MESH: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

/// A scene of many files.
fn scene_of_files() -> Folder {
    let folder = Folder::new();
    folder.write("a.pbrt", SCENE);
    folder.write("part.pbrt", PART);
    folder.write("mesh.ply", MESH);
    folder.write("grey.spd", "400 0.5 700 0.5\n");
    let white = image::RgbImage::from_pixel(2, 2, image::Rgb([200; 3]));
    white.save(folder.path().join("film.png")).unwrap();
    let mut sky = b"PF\n2 2\n-1.0\n".to_vec();
    sky.extend([0, 0, 128, 63].repeat(12));
    fs::write(folder.path().join("sky.pfm"), sky).unwrap();
    folder
}

/// All files and what is in them.
fn contents(folder: &Folder) -> Vec<(String, Vec<u8>)> {
    let read = |name: String| {
        let content = fs::read(folder.path().join(&name)).unwrap_or_default();
        (name, content)
    };
    folder.files().into_iter().map(read).collect()
}

#[test]
fn inputs_are_not_overwritten() {
    let folder = scene_of_files();
    fs::create_dir(folder.path().join("sub")).unwrap();
    #[cfg(unix)]
    {
        let at = |name: &str| folder.path().join(name);
        std::os::unix::fs::symlink("sky.pfm", at("link.pfm")).unwrap();
        std::os::unix::fs::symlink("../sub/../a.pbrt", at("sub/link.json")).unwrap();
        fs::hard_link(at("film.png"), at("hard.png")).unwrap();
    }
    let before = contents(&folder);
    let mut cases = vec![
        ("-o sky.pfm", "sky.pfm"),
        ("-o ./sub/../sky.pfm", "sky.pfm"),
        ("-o film.png", "film.png"),
        // The film's own name.
        ("", "film.png"),
        ("--stats a.pbrt -o x.exr", "a.pbrt"),
        ("--stats part.pbrt -o x.exr", "part.pbrt"),
        ("--stats mesh.ply -o x.exr", "mesh.ply"),
        ("--stats grey.spd -o x.exr", "grey.spd"),
    ];
    if cfg!(unix) {
        cases.extend([
            ("-o link.pfm", "sky.pfm"),
            ("-o hard.png", "film.png"),
            ("--stats sub/link.json -o x.exr", "a.pbrt"),
        ]);
    }
    for (flags, input) in cases {
        let message = folder.run(&format!("render a.pbrt {flags}")).fails(2);
        let expected = format!("would overwrite {input}, which is an input");
        assert!(message.contains(&expected), "{flags}: {message}");
    }
    for file in ["a.pbrt", "mesh.ply"] {
        let message = folder.run(&format!("bench a.pbrt --json {file}")).fails(2);
        assert!(message.contains("would overwrite"), "{message}");
    }
    assert!(contents(&folder) == before);
    let ran = folder.run(&format!("render a.pbrt {TINY} -o x.exr"));
    ran.succeeds();
}

#[test]
fn outputs_do_not_overwrite_one_another() {
    let folder = Folder::new();
    fs::create_dir(folder.path().join("sub")).unwrap();
    let mut cases = vec![
        "-o a.exr -o ./a.exr",
        "-o a.exr -o sub/../a.exr",
        "-o a.exr --stats a.exr",
        "-o a.exr -o a.s1.t2.weighted.exr --strategies --integrator bdpt",
        "-o a.exr --stats a.s0.t2.unweighted.exr --strategies --integrator bdpt",
    ];
    #[cfg(unix)]
    {
        let at = |name: &str| folder.path().join(name);
        std::os::unix::fs::symlink("a.exr", at("link.exr")).unwrap();
        folder.write("b.exr", "");
        fs::hard_link(at("b.exr"), at("hard.exr")).unwrap();
        cases.extend(["-o a.exr -o link.exr", "-o b.exr -o hard.exr"]);
    }
    let before = contents(&folder);
    for flags in cases {
        let message = folder
            .run(&format!("render --max-depth 3 {flags}"))
            .fails(2);
        let part = ["is the same file as", "would be written twice"];
        assert!(part.iter().any(|p| message.contains(p)), "{message}");
    }
    assert!(contents(&folder) == before);
}

#[test]
fn compared_and_studied_pictures_are_inputs() {
    let folder = Folder::new();
    folder
        .run(&format!("render {TINY} -q -o a.pfm -o b.exr"))
        .succeeds();
    folder.write("index.html", "Shape \"sphere\"");
    fs::create_dir(folder.path().join("out")).unwrap();
    fs::copy(
        folder.path().join("b.exr"),
        folder.path().join("out/studio-reference.exr"),
    )
    .unwrap();
    let before = contents(&folder);
    for arguments in [
        "compare a.pfm b.exr -o ./a.pfm",
        "compare a.pfm b.exr --json b.exr",
        "compare a.pfm b.exr -o c.png --json ./c.png",
        "converge --reference b.exr --json b.exr --resolution 32x32",
        "converge -o out --json out/index.html",
        "converge -o out --json out/./studio.svg",
    ] {
        let message = folder.run(arguments).fails(2);
        let part = ["would overwrite", "is the same file as", "twice"];
        assert!(part.iter().any(|p| message.contains(p)), "{message}");
    }
    assert!(
        contents(&folder)
            .iter()
            .filter(|f| f.0 != "converge")
            .eq(&before)
    );
}

#[test]
fn a_missing_folder_is_named() {
    let folder = Folder::new();
    folder.write("file", "");
    for (flags, expected) in [
        (
            "-o no/such/a.exr",
            "no/such/a.exr: the folder no/such does not exist",
        ),
        (
            "--stats no/s.json",
            "no/s.json: the folder no does not exist",
        ),
        ("-o file/a.exr", "file/a.exr: file is not a folder"),
        ("-o dir.exr/", "is the name of a folder"),
    ] {
        let message = folder.run(&format!("render {flags}")).fails(2);
        assert!(message.contains(expected), "{message}");
    }
    let name = "n".repeat(300) + ".exr";
    folder.run(&format!("render -o {name}")).fails(2);
}

#[cfg(unix)]
mod unix {
    use super::*;
    use std::io::Read;
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

    #[test]
    fn what_is_replaced_keeps_its_place_and_mode() {
        let folder = Folder::new();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("far")).unwrap();
        folder.write("far/a.exr", "old");
        fs::set_permissions(at("far/a.exr"), fs::Permissions::from_mode(0o640)).unwrap();
        symlink("far/a.exr", at("link.exr")).unwrap();
        symlink("link.exr", at("second.exr")).unwrap();
        symlink("far/new.png", at("dangling.png")).unwrap();
        symlink("circle.exr", at("circle.exr")).unwrap();
        folder
            .run(&format!("render {TINY} -q -o second.exr -o dangling.png"))
            .succeeds();
        for name in ["link.exr", "second.exr", "dangling.png"] {
            assert!(at(name).symlink_metadata().unwrap().is_symlink(), "{name}");
        }
        assert_eq!(at("far/a.exr").metadata().unwrap().mode() & 0o777, 0o640);
        assert!(bright(&folder.exr("far/a.exr")));
        assert!(at("far/new.png").exists());
        assert_eq!(fs::read_dir(at("far")).unwrap().count(), 2);
        let message = folder.run("render -o circle.exr").fails(2);
        assert!(message.contains("circle"), "{message}");
    }

    #[test]
    fn read_only_files_stay() {
        let folder = Folder::new();
        for name in ["a.exr", "s.json"] {
            folder.write(name, "old");
            let path = folder.path().join(name);
            fs::set_permissions(path, fs::Permissions::from_mode(0o444)).unwrap();
        }
        for flags in ["-o a.exr", "--stats s.json"] {
            let message = folder.run(&format!("render {flags}")).fails(2);
            assert!(message.contains("is read-only"), "{message}");
        }
        assert_eq!(fs::read(folder.path().join("a.exr")).unwrap(), b"old");
    }

    fn fifo(folder: &Folder, name: &str) {
        let made = Command::new("mkfifo")
            .arg(folder.path().join(name))
            .status();
        assert!(made.unwrap().success());
    }

    #[test]
    fn pipes_and_devices_are_written_into() {
        let folder = Folder::new();
        fifo(&folder, "pipe.exr");
        fifo(&folder, "pipe.png");
        let read = |name: &str| {
            let path = folder.path().join(name);
            std::thread::spawn(move || {
                let mut bytes = Vec::new();
                fs::File::open(path)
                    .unwrap()
                    .read_to_end(&mut bytes)
                    .unwrap();
                bytes
            })
        };
        let (exr, png) = (read("pipe.exr"), read("pipe.png"));
        let written =
            format!("render {TINY} -q -o pipe.exr -o pipe.png -o a.exr --stats /dev/null");
        folder.run(&written).succeeds();
        assert_eq!(
            exr.join().unwrap().len() as u64,
            fs::metadata(folder.path().join("a.exr")).unwrap().len()
        );
        assert!(image::load_from_memory(&png.join().unwrap()).is_ok());
        assert_eq!(folder.files(), ["a.exr", "pipe.exr", "pipe.png"]);
        folder
            .run(&format!("render {TINY} -o /dev/null"))
            .succeeds();
        folder
            .run("render --strategies --integrator bdpt -o /dev/null")
            .fails(2);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn open_files_are_written_where_they_are() {
        let folder = Folder::new();
        let shell = |script: String| {
            let done = Command::new("sh")
                .args(["-c", &script])
                .current_dir(folder.path())
                .env("PHALANX", env!("CARGO_BIN_EXE_phalanx"))
                .status();
            assert!(done.unwrap().success(), "{script}");
        };
        let render = format!("$PHALANX render -q {TINY}");
        shell(format!(
            "(echo first; {render} --stats /dev/stdout -o a.pfm; echo last) > out"
        ));
        shell(format!(
            "{render} --stats /dev/fd/7 -o /proc/self/fd/8 7>> out 8> b.exr"
        ));
        let text = fs::read_to_string(folder.path().join("out")).unwrap();
        let (first, rest) = text.split_once('\n').unwrap();
        let (json, more) = rest.split_once("last\n").unwrap();
        assert_eq!(first, "first");
        for json in [json, more] {
            assert!(
                serde_json::from_str::<serde_json::Value>(json).is_ok(),
                "{text}"
            );
        }
        assert!(bright(&folder.exr("b.exr")));
        assert_eq!(folder.files(), ["a.pfm", "b.exr", "out"]);
        // Two ways to one file.
        let script = format!("{render} --stats /dev/stdout -o b.exr > b.exr; test $? = 2");
        shell(script);
    }

    /// A limit on the size of files is an error like a full disk.
    #[test]
    fn a_limit_on_files_kills_no_render() {
        let folder = Folder::new();
        let done = Command::new("sh")
            .args([
                "-c",
                "ulimit -f 64; exec \"$0\" \"$@\"",
                env!("CARGO_BIN_EXE_phalanx"),
            ])
            .args(
                "render --resolution 100x100 --mutations 2 --bootstrap 500 -o a.pfm --stats s.json"
                    .split(' '),
            )
            .current_dir(folder.path())
            .output();
        let ran = Ran(done.unwrap());
        let stderr = ran.stderr();
        assert_eq!(ran.0.status.code(), Some(1), "{stderr}");
        assert!(
            stderr.contains("a.pfm: ") && stderr.contains("nor can it be saved elsewhere"),
            "{stderr}"
        );
        assert!(stderr.contains("wrote s.json"), "{stderr}");
        assert_eq!(folder.files(), ["s.json"]);
    }
}
