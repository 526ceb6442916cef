//! Renders that are kept and resumed: killed, asked to end, on a full disk, with a scene that
//! changes meanwhile.

use super::signals::send;
use super::{Folder, Ran};
use std::fs;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

const PICTURE: &str = "--resolution 64x64 --bootstrap 2000 --chains 512";

fn start(folder: &Folder, flags: &str) -> Child {
    let mut command = folder.command(&format!("render {PICTURE} {flags}"));
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// Waits for a file.
fn wait_for(folder: &Folder, name: &str) {
    let start = Instant::now();
    while !folder.path().join(name).exists() {
        assert!(start.elapsed() < Duration::from_secs(60), "no {name}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_render_that_is_killed_comes_to_the_same_file() {
    for effort in [
        "--integrator mmlt --mutations 300",
        "--integrator bdpt --spp 100",
    ] {
        let folder = Folder::new();
        let whole = start(&folder, &format!("{effort} -o whole.exr"));
        let mut child = start(
            &folder,
            &format!("{effort} -o lost.exr --checkpoint kept --every 50ms"),
        );
        for round in 0..3 {
            wait_for(&folder, "kept");
            std::thread::sleep(Duration::from_millis(100));
            send(child.id(), 9);
            child.wait().unwrap();
            let info = folder.run("info kept").succeeds().stdout();
            assert!(info.contains("phalanx resume kept"), "{info}");
            // What it goes on from is not there while it does.
            fs::rename(folder.path().join("kept"), folder.path().join("from")).unwrap();
            let threads = 1 + round % 2;
            let resume =
                format!("resume from -o a.exr --checkpoint kept --every 50ms --threads {threads}");
            child = folder
                .command(&resume)
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
        }
        let ran = Ran(child.wait_with_output().unwrap()).succeeds();
        assert!(ran.stderr().contains("kept in kept"), "{}", ran.stderr());
        Ran(whole.wait_with_output().unwrap()).succeeds();
        let read = |name| fs::read(folder.path().join(name)).unwrap();
        assert!(read("whole.exr") == read("a.exr"), "{effort}");
        let info = folder.run("info a.exr").succeeds().stdout();
        assert!(info.contains("seed"), "{info}");
        // And what has ended can be had again.
        folder.run("resume kept -o again.exr --lanes 1").succeeds();
        assert!(read("whole.exr") == read("again.exr"), "{effort}");
    }
}

#[test]
fn a_signal_keeps_the_render() {
    let folder = Folder::new();
    let child = start(
        &folder,
        "--integrator mmlt --mutations 100000000 -o a.exr --checkpoint kept",
    );
    std::thread::sleep(Duration::from_millis(1200));
    send(child.id(), 15);
    let ran = Ran(child.wait_with_output().unwrap());
    assert_eq!(ran.code(), 143, "{}", ran.stderr());
    assert!(ran.stderr().contains("kept in kept"), "{}", ran.stderr());
    let picture = folder.exr("a.exr");
    // All of it is there.
    let refused = folder.run("resume kept --mutations 1 -o b.exr").fails(2);
    assert!(refused.contains("per pixel already"), "{refused}");
    folder.run("resume kept --time 0.5 -o b.exr").succeeds();
    assert!(folder.exr("b.exr").pixels != picture.pixels);
}

#[test]
fn shards_are_merged() {
    let folder = Folder::new();
    let flags = format!("{PICTURE} --integrator mmlt --mutations 20");
    folder
        .run(&format!("render {flags} -o whole.exr"))
        .succeeds();
    for i in 1..=3 {
        folder
            .run(&format!("render {flags} --checkpoint s{i} --shard {i}/3"))
            .succeeds();
    }
    assert_eq!(folder.files(), ["s1", "s2", "s3", "whole.exr", "whole.png"]);
    let info = folder.run("info s2").succeeds().stdout();
    assert!(info.contains("2/3"), "{info}");
    folder
        .run("merge s3 s1 s2 -o a.exr --checkpoint all")
        .succeeds();
    let read = |name| fs::read(folder.path().join(name)).unwrap();
    assert!(read("whole.exr") == read("a.exr"));
    folder.run("resume all --mutations 30 -o b.exr").succeeds();

    let refused = |arguments: &str, why: &str| {
        let message = folder.run(arguments).fails(2);
        assert!(message.contains(why), "{arguments}: {message}");
    };
    refused("merge s1 s2", "shard 3/3 is missing");
    refused("merge s1 s3", "shard 2/3 is missing");
    refused("merge s1 s2 s2 s3", "s2 is shard 2/3 once more");
    refused("merge s1 s2 all", "all: is no shard");
    refused("resume s1 -o a.exr", "-o: s1 is a shard");
    let other = format!("render {flags} --seed 7 --checkpoint o3 --shard 3/3");
    folder.run(&other).succeeds();
    refused("merge s1 s2 o3", "of different renders");
    refused("render --checkpoint k --shard 4/3", "expected a part");
}

#[test]
fn what_cannot_be_resumed_is_refused() {
    let folder = Folder::new();
    let scene = "Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 16\nLookAt 0 0 5  0 0 0  0 1 0\nCamera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\nInclude \"b.pbrt\"\nWorldEnd\n";
    folder.write("a.pbrt", scene);
    folder.write("b.pbrt", "Shape \"sphere\"\n");
    let render = "render a.pbrt --integrator mmlt --bootstrap 500 --chains 64 --mutations 4 -q";
    let refused = |arguments: &str, why: &str| {
        let message = folder.run(arguments).fails(2);
        assert!(message.contains(why), "{arguments}: {message}");
    };
    folder
        .run(&format!("{render} -o a.exr --checkpoint kept"))
        .succeeds();
    folder.run("resume kept -q -o b.exr").succeeds();
    let read = |name| fs::read(folder.path().join(name)).unwrap();
    assert!(read("a.exr") == read("b.exr"));
    folder.run("resume kept -q --mutations 6").succeeds();

    refused("resume nothing", "cannot be read");
    refused("resume a.pbrt", "is no checkpoint of Phalanx");
    refused("resume a.exr", "is no checkpoint of Phalanx");
    refused("info a.pbrt", "neither a checkpoint of Phalanx nor an .exr");
    refused("resume kept --spp 9", "takes --mutations");
    let content = fs::read(folder.path().join("kept")).unwrap();
    let damage = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut content = content.clone();
        change(&mut content);
        fs::write(folder.path().join("bad"), content).unwrap();
    };
    for at in (0..content.len()).step_by(content.len() / 9) {
        damage(&|content| content[at] ^= 4);
        let [of_resume, of_info] = match at < 8 {
            true => ["no checkpoint", "neither a checkpoint"],
            false => ["is damaged"; 2],
        };
        refused("resume bad", of_resume);
        damage(&|content| content.truncate(at));
        refused("info bad", of_info);
    }

    folder.write("b.pbrt", "Shape \"sphere\" \"float radius\" 2\n");
    refused("resume kept", "b.pbrt has changed since");
    let info = folder.run("info kept").succeeds().stdout();
    assert!(info.contains("b.pbrt has changed since"), "{info}");
    fs::remove_file(folder.path().join("b.pbrt")).unwrap();
    refused("resume kept", "b.pbrt: ");

    refused("render - --checkpoint kept", "standard input");
    refused(
        "render --integrator bdpt --strategies --spp 1 --checkpoint kept",
        "--strategies",
    );
    refused("render a.pbrt c.pbrt --checkpoint kept", "--checkpoint");
    refused("render --checkpoint /dev/null", "pipe or a device");
    refused("render --checkpoint a/b", "a/b");
    assert_eq!(fs::read(folder.path().join("kept")).unwrap(), content);
}

/// The disk fills up after the first checkpoint.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_keeps_the_last_whole_checkpoint() {
    let folder = Folder::new();
    fs::create_dir(folder.path().join("small")).unwrap();
    // A small disk needs a name space of its own, which some machines do not give.
    let shell = |script: &str| {
        std::process::Command::new("unshare")
            .args(["--user", "--map-root-user", "--mount", "sh", "-c", script])
            .current_dir(folder.path())
            .env("PHALANX", env!("CARGO_BIN_EXE_phalanx"))
            .output()
    };
    let mount = "mount -t tmpfs -o size=4m none small";
    match shell(mount) {
        Ok(output) if output.status.success() => {}
        _ => {
            println!("skipped: there are no name spaces to mount a small disk in");
            return;
        }
    }
    let script = format!(
        "{mount} || exit 9
         (while [ ! -e small/kept ]; do sleep 0.02; done; cp small/kept first; cat /dev/zero > small/other) 2>/dev/null &
         $PHALANX render {PICTURE} --integrator mmlt --time 3 -o a.exr --checkpoint small/kept --every 100ms; code=$?
         $PHALANX info small/kept && cp small/kept last && exit $code"
    );
    let output = shell(&script).unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert_eq!(stderr.matches("the render goes on").count(), 1, "{stderr}");
    assert_eq!(
        stderr.matches("error: --checkpoint: ").count(),
        1,
        "{stderr}"
    );
    assert!(super::bright(&folder.exr("a.exr")));
    folder.run("resume last --time 0.2 -o b.exr").succeeds();
}

/// A moment more of a long render is more, however little time it is.
#[test]
fn time_counts_from_now_on() {
    let folder = Folder::new();
    let long = "--resolution 8x8 --bootstrap 2000 --chains 512 --integrator mmlt --mutations 20000";
    folder
        .run(&format!("render {long} -o a.exr --checkpoint kept"))
        .succeeds();
    folder.run("resume kept --time 1ms -o b.exr").succeeds();
}
