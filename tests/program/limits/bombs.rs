//! Small files that grow: whatever they grow into, the memory it takes stays near the limit, and
//! the message says what it is.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};

use crate::command::{command, text};

/// As the commands are given it, and what none may take, in bytes.
const LIMIT: &str = "--max-memory 100MB";
const MOST: u64 = 200_000_000;

/// What a render of a scene ends with, and the most memory it took.
struct Ended {
    code: Option<i32>,
    stderr: String,
    peak: u64,
}

/// Linux tells of a living process how much it took at most; it is asked for as long as it lives.
fn render(folder: &Path, scene: &str) -> Ended {
    let arguments = format!(
        "render {scene} {LIMIT} --resolution 8x8 --mutations 1 --bootstrap 100 --chains 64 --threads 1 -o a.pfm"
    );
    let stderr = folder.join("stderr");
    let mut child = command(folder, &arguments)
        .stdout(std::process::Stdio::null())
        .stderr(File::create(&stderr).unwrap())
        .spawn()
        .unwrap();
    let start = Instant::now();
    let mut peak = 0;
    let status = loop {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        if let Some((_, rest)) = status.split_once("VmHWM:") {
            let kib = rest
                .split_whitespace()
                .next()
                .unwrap()
                .parse::<u64>()
                .unwrap();
            peak = peak.max(1024 * kib);
        }
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > Duration::from_secs(120) {
            child.kill().unwrap();
            panic!("{scene} does not end");
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let stderr = text(&fs::read(stderr).unwrap());
    println!(
        "{scene}: {} MB, {:.1} s, {}",
        peak / 1_000_000,
        start.elapsed().as_secs_f64(),
        stderr.trim()
    );
    Ended {
        code: status.code(),
        stderr,
        peak,
    }
}

impl Ended {
    /// In little memory.
    #[track_caller]
    fn small(&self) {
        assert!(self.peak < MOST, "{} bytes\n{}", self.peak, self.stderr);
        assert!(
            self.stderr.lines().all(|line| line.len() < 700),
            "{}",
            self.stderr
        );
    }

    /// In little memory and with one message, which has this in it.
    #[track_caller]
    fn refused(&self, message: &str) {
        self.small();
        assert_eq!(self.code, Some(2), "{}", self.stderr);
        let errors = self.stderr.lines().filter(|l| l.starts_with("error: "));
        assert_eq!(errors.count(), 1, "{}", self.stderr);
        assert!(self.stderr.contains(message), "{}", self.stderr);
    }

    /// In little memory, with a picture.
    #[track_caller]
    fn rendered(&self) {
        self.small();
        assert_eq!(self.code, Some(0), "{}", self.stderr);
    }
}

/// The message of what grows beyond the limit.
const OVER: &str = "and the limit is 95.4 MiB";

/// A compressed file of `before`, `count` times `each`, and `after`.
fn write_gz(path: &Path, before: &str, each: &str, count: usize, after: &str) {
    let packed = |text: &str| {
        let mut gz = GzEncoder::new(Vec::new(), Compression::best());
        gz.write_all(text.as_bytes()).unwrap();
        gz.finish().unwrap()
    };
    // Members of a file follow each other.
    let block = (1 << 24) / each.len();
    let mut file = packed(before);
    let many = packed(&each.repeat(block));
    for _ in 0..count / block {
        file.extend(&many);
    }
    file.extend(packed(&each.repeat(count % block)));
    file.extend(packed(after));
    fs::write(path, file).unwrap();
}

const WORLD: &str = "WorldBegin\nLightSource \"infinite\"\nShape \"sphere\"\n";

/// Text is read as it is needed, however long it is.
#[test]
fn long_texts() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_gz(&folder.join("blank.pbrt.gz"), WORLD, " ", 250 << 20, "");
    render(folder, "blank.pbrt.gz").rendered();
    write_gz(
        &folder.join("comments.pbrt"),
        WORLD,
        "# comment\n",
        24 << 20,
        "",
    );
    render(folder, "comments.pbrt").rendered();
    let ones = folder.join("ones.pbrt");
    fs::write(&ones, vec![0xff; 300 << 20]).unwrap();
    render(folder, "ones.pbrt").refused("ones.pbrt:1:");
    write_gz(
        &folder.join("string.pbrt"),
        "Film \"",
        "x",
        300 << 20,
        "\"\n",
    );
    render(folder, "string.pbrt").refused("a word or string of more than");
}

/// Lists of parameters, of one directive and of many.
#[test]
fn parameters() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let list = |name: &str, kind: &str, value: &str, count| {
        let before = format!("WorldBegin\nShape \"trianglemesh\" \"{kind}\" [");
        write_gz(&folder.join(name), &before, value, count, "]\n");
        render(folder, name)
    };
    list("strings.pbrt", "string a", "\"\" ", 3_000_000).refused(OVER);
    list("floats.pbrt", "float a", "1 ", 9_000_000).refused(OVER);
    list("spectrum.pbrt", "spectrum L", "1 ", 9_000_000).refused(OVER);
    list("points.pbrt", "point3 P", "0 0 0 ", 4_000_000).refused(OVER);
    let spectrum = "WorldBegin\nMaterial \"diffuse\" \"spectrum reflectance\" [";
    write_gz(
        &folder.join("samples.pbrt"),
        spectrum,
        "500 1 ",
        3_000_000,
        "]\n",
    );
    render(folder, "samples.pbrt").small();
    let film = "Film \"rgb\" \"string filename\" \"x\"\n";
    write_gz(&folder.join("films.pbrt"), "", film, 700_000, WORLD);
    render(folder, "films.pbrt").rendered();
}

/// What a scene may have any number of.
#[test]
fn directives() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let many = |name: &str, count: usize, each: &dyn Fn(usize) -> String| {
        let lines: Vec<String> = (0..count).map(each).collect();
        fs::write(folder.join(name), WORLD.to_owned() + &lines.concat()).unwrap();
        render(folder, name)
    };
    many("materials.pbrt", 400_000, &|i| {
        format!("MakeNamedMaterial \"{i}\" \"string type\" \"diffuse\"\n")
    })
    .refused(OVER);
    many("glasses.pbrt", 200_000, &|i| {
        format!("MakeNamedMaterial \"{i}\" \"string type\" \"dielectric\" \"spectrum eta\" \"glass-BK7\"\n")
    })
    .refused(OVER);
    many("failed.pbrt", 400_000, &|i| {
        format!("Material \"none such {i}\"\n")
    })
    .refused(OVER);
    many("textures.pbrt", 400_000, &|i| {
        format!("Texture \"{i}\" \"float\" \"constant\"\n")
    })
    .refused(OVER);
    many("checks.pbrt", 400_000, &|i| {
        format!("Texture \"{i}\" \"float\" \"checkerboard\"\n")
    })
    .refused(OVER);
    many("used.pbrt", 300_000, &|_| {
        "Material \"diffuse\"\nShape \"sphere\"\n".into()
    })
    .refused(OVER);
    many("systems.pbrt", 500_000, &|i| {
        format!("CoordinateSystem \"{i}\"\n")
    })
    .refused(OVER);
    many("objects.pbrt", 400_000, &|i| {
        format!("ObjectBegin \"{i}\"\nObjectEnd\n")
    })
    .refused(OVER);
    many("lights.pbrt", 500_000, &|_| {
        "LightSource \"point\"\n".into()
    })
    .refused(OVER);
    many("spheres.pbrt", 500_000, &|_| "Shape \"sphere\"\n".into()).refused(OVER);
    many("lamps.pbrt", 300_000, &|i| match i {
        0 => "AreaLightSource \"diffuse\"\n".into(),
        _ => "Shape \"disk\" \"float radius\" 1 \"float innerradius\" 0\n".into(),
    })
    .refused(OVER);
    many("instances.pbrt", 1_000_000, &|i| match i {
        0 => "ObjectBegin \"a\"\nShape \"sphere\"\nObjectEnd\n".into(),
        _ => "ObjectInstance \"a\"\n".into(),
    })
    .refused(OVER);
    many("blocks.pbrt", 30_000, &|_| "AttributeBegin\n".into()).refused("blocks are open");
    many("attributes.pbrt", 30_000, &|i| {
        format!("Attribute \"shape\" \"float {i}\" 1\n")
    })
    .refused("too many");
    many("warnings.pbrt", 100_000, &|i| {
        format!(
            "ReverseOrientation # {i}\nLightSource \"point\" \"float {}{i}\" 1\n",
            "x".repeat(500)
        )
    })
    .small();
    many("unknown.pbrt", 100_000, &|i| {
        format!(
            "LightSource \"point\" \"float {}{i}\" 1\n",
            "long ".replace(' ', "").repeat(50)
        )
    })
    .small();
}

/// Faces of subdivision, and of lists in meshes.
#[test]
fn meshes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let control = "WorldBegin\nShape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2] \"integer levels\" ";
    for levels in 9..14 {
        fs::write(folder.join("levels.pbrt"), format!("{control}{levels}\n")).unwrap();
        let ended = render(folder, "levels.pbrt");
        ended.small();
        if levels > 10 {
            assert!(
                ended.stderr.contains("levels.pbrt:2:1: Shape"),
                "{}",
                ended.stderr
            );
        }
    }
    // Patches that are cut up as finely as they ever are.
    let patch = "WorldBegin\nShape \"bilinearmesh\" \"point3 P\" [0 0 0  9 0 0  0 9 0  9 9 9] \"integer indices\" [";
    let patches = patch.to_owned() + &"0 1 2 3 ".repeat(3000) + "]\n";
    fs::write(folder.join("patches.pbrt"), patches).unwrap();
    render(folder, "patches.pbrt").refused(OVER);

    fs::write(
        folder.join("mesh.pbrt"),
        "WorldBegin\nShape \"plymesh\" \"string filename\" \"mesh.ply\"\n",
    )
    .unwrap();
    let mesh = |list: &str, polygon: &[u8], faces: usize| {
        let header = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             element face {faces}\nproperty list {list}\nend_header\n"
        );
        let mut file = header.into_bytes();
        file.extend([0; 36]);
        file.extend(polygon.repeat(faces));
        let mut gz = GzEncoder::new(
            File::create(folder.join("mesh.ply")).unwrap(),
            Compression::fast(),
        );
        gz.write_all(&file).unwrap();
        gz.finish().unwrap();
        render(folder, "mesh.pbrt")
    };
    let polygon = |corners: u32| {
        let mut polygon = corners.to_le_bytes().to_vec();
        polygon.resize(4 + corners as usize, 0);
        polygon
    };
    mesh("uint uchar vertex_indices", &polygon(300_000_000), 1)
        .refused("mesh.ply: face 0 of 1: longer than");
    mesh("uint uchar vertex_indices", &polygon(1_000_000), 100).refused("mesh.ply");
    mesh("uint uchar vertex_indices", &polygon(1000), 100_000).refused("mesh.ply");
}

/// What pictures carry besides their pixels.
#[test]
fn pictures() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let show = |file: &str| {
        let scene = format!(
            "{WORLD}Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{file}\"\n\
             Material \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"\n"
        );
        fs::write(folder.join("picture.pbrt"), scene).unwrap();
        render(folder, "picture.pbrt")
    };
    let zeros = |count: usize| {
        let mut zlib = ZlibEncoder::new(Vec::new(), Compression::fast());
        let block = vec![0; 1 << 20];
        for _ in 0..count >> 20 {
            zlib.write_all(&block).unwrap();
        }
        zlib.finish().unwrap()
    };
    let png = |kind: &[u8; 4], data: &[u8]| {
        let mut file = Vec::new();
        let picture = image::GrayImage::from_pixel(4, 4, image::Luma([128]));
        picture
            .write_to(
                &mut std::io::Cursor::new(&mut file),
                image::ImageFormat::Png,
            )
            .unwrap();
        let mut chunk = (data.len() as u32).to_be_bytes().to_vec();
        chunk.extend(kind);
        chunk.extend(data);
        let mut crc = flate2::Crc::new();
        crc.update(&chunk[4..]);
        chunk.extend(crc.sum().to_be_bytes());
        // After the header.
        file.splice(33..33, chunk);
        file
    };
    let unpacked = zeros(400 << 20);
    for (kind, start) in [
        (b"iCCP", &b"p\0\0"[..]),
        (b"zTXt", b"p\0\0"),
        (b"iTXt", b"p\0\x01\0\0\0"),
    ] {
        let data = [start, &unpacked[..]].concat();
        fs::write(folder.join("a.png"), png(kind, &data)).unwrap();
        show("a.png").rendered();
    }
    // Holes in files cost nothing, until somebody reads them.
    let sparse = |name: &str, start: &[u8]| {
        let mut file = File::create(folder.join(name)).unwrap();
        file.write_all(start).unwrap();
        file.set_len(400 << 20).unwrap();
        show(name)
    };
    for kind in [b"eXIf", b"abCd"] {
        let mut start = png(kind, b"")[..33].to_vec();
        start.extend((300u32 << 20).to_be_bytes());
        start.extend(kind);
        sparse("b.png", &start).small();
    }
    let mut jpeg = Vec::new();
    let picture = image::GrayImage::from_pixel(8, 8, image::Luma([128]));
    picture
        .write_to(
            &mut std::io::Cursor::new(&mut jpeg),
            image::ImageFormat::Jpeg,
        )
        .unwrap();
    sparse("a.jpg", &jpeg).refused(OVER);
    sparse("a.hdr", b"#?RADIANCE\nX=").refused("a.hdr: its header is longer");
    let attribute = |name: &str, kind: &str, length: u32| {
        let mut bytes = [name.as_bytes(), b"\0", kind.as_bytes(), b"\0"].concat();
        bytes.extend(length.to_le_bytes());
        bytes
    };
    let exr = [&0x01312f76u32.to_le_bytes()[..], &2u32.to_le_bytes()].concat();
    let long = attribute("comments", "string", 300 << 20);
    sparse("a.exr", &[exr.clone(), long].concat()).refused("a.exr: its header is longer");
    let short: Vec<u8> = (0..2_000_000)
        .flat_map(|i| [attribute(&i.to_string(), "int", 4), vec![0; 4]].concat())
        .collect();
    sparse("b.exr", &[exr, short].concat()).refused("b.exr: its header is longer");
    sparse("a.pfm", b"Pf\n10000 10000\n-1\n").refused(OVER);
    let mut spd = "500 1\n".repeat(200_000);
    spd.push('\n');
    fs::write(folder.join("a.spd"), spd).unwrap();
    let spectrum = "Material \"diffuse\" \"spectrum reflectance\" \"a.spd\"\nShape \"sphere\"\n";
    fs::write(folder.join("spectrum.pbrt"), WORLD.to_owned() + spectrum).unwrap();
    render(folder, "spectrum.pbrt").refused("too many for a spectrum");
}

/// Lights that each have a copy of one image.
#[test]
fn lights_with_images() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut sky = b"PF\n1000 1000\n-1\n".to_vec();
    sky.resize(sky.len() + 12_000_000, 0x3f);
    fs::write(folder.join("sky.pfm"), sky).unwrap();
    for kind in ["infinite", "goniometric", "projection"] {
        let light = format!("LightSource \"{kind}\" \"string filename\" \"sky.pfm\"\n");
        let scene = "WorldBegin\nShape \"sphere\"\n".to_owned() + &light.repeat(30);
        fs::write(folder.join("lights.pbrt"), scene).unwrap();
        render(folder, "lights.pbrt").refused("lights 4");
    }
}

/// Files within files.
#[test]
fn includes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for i in 0..300 {
        let file = folder.join(format!("{i}.pbrt"));
        fs::write(
            file,
            format!("# {}\nInclude \"{}.pbrt\"\n", "x".repeat(100_000), i + 1),
        )
        .unwrap();
    }
    render(folder, "0.pbrt").refused("Include");
}
