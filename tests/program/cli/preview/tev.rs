//! A receiver of tev's protocol, written from the description in its README: messages of a length,
//! an operation and its data, little endian.

use super::super::growing::wait_until;
use super::super::signals::send;
use super::super::{Folder, Running};
use std::collections::BTreeMap;
use std::io::{self, Read};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// An image as tev would show it.
#[derive(Clone, Debug, Default, PartialEq)]
struct Image {
    size: [usize; 2],
    channels: BTreeMap<String, Vec<f32>>,
    updates: usize,
    created: usize,
}

#[derive(Default)]
struct Images(Mutex<BTreeMap<String, Image>>);

impl Images {
    fn get(&self, name: &str) -> Option<Image> {
        self.0.lock().unwrap().get(name).cloned()
    }
}

/// What is left of a message.
struct Message<'a>(&'a [u8]);

impl Message<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (now, later) = self
            .0
            .split_first_chunk()
            .expect("the message is too short");
        self.0 = later;
        *now
    }

    fn int(&mut self) -> usize {
        usize::try_from(i32::from_le_bytes(self.take())).unwrap()
    }

    fn long(&mut self) -> usize {
        usize::try_from(i64::from_le_bytes(self.take())).unwrap()
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|b| *b == 0).unwrap();
        let text = String::from_utf8(self.0[..end].to_vec()).unwrap();
        self.0 = &self.0[end + 1..];
        text
    }

    fn names(&mut self) -> Vec<String> {
        (0..self.int()).map(|_| self.text()).collect()
    }
}

/// One message; `None` at the end of the connection.
fn receive(stream: &mut TcpStream, images: &Images) -> io::Result<Option<()>> {
    let mut length = [0; 4];
    if let Err(e) = stream.read_exact(&mut length) {
        return match e.kind() {
            io::ErrorKind::UnexpectedEof => Ok(None),
            _ => Err(e),
        };
    }
    // The length counts itself.
    let mut bytes = vec![0; u32::from_le_bytes(length) as usize - 4];
    stream.read_exact(&mut bytes)?;
    let mut message = Message(&bytes);
    let [operation, _focus] = message.take();
    let name = message.text();
    let mut images = images.0.lock().unwrap();
    match operation {
        4 => {
            let size = [message.int(), message.int()];
            let channels = message.names().into_iter();
            let image = images.entry(name).or_default();
            image.size = size;
            image.channels = channels
                .map(|c| (c, vec![0.0; size[0] * size[1]]))
                .collect();
            image.created += 1;
        }
        6 => {
            let image = images.get_mut(&name).expect("it has been created");
            let names = message.names();
            let [x0, y0, width, height] = std::array::from_fn(|_| message.int());
            let offsets: Vec<usize> = names.iter().map(|_| message.long()).collect();
            let strides: Vec<usize> = names.iter().map(|_| message.long()).collect();
            let data: &[[u8; 4]] = message.0.as_chunks().0;
            let count = width * height;
            let ends = offsets.iter().zip(&strides);
            let end = ends.map(|(o, s)| o + (count - 1) * s + 1).max().unwrap();
            assert_eq!((end, message.0.len()), (data.len(), 4 * end));
            for (c, name) in names.iter().enumerate() {
                let to = image
                    .channels
                    .get_mut(name)
                    .expect("a channel of the image");
                for i in 0..count {
                    let at = (y0 + i / width) * image.size[0] + x0 + i % width;
                    to[at] = f32::from_le_bytes(data[offsets[c] + i * strides[c]]);
                }
            }
            image.updates += 1;
        }
        other => panic!("operation {other}"),
    }
    Ok(Some(()))
}

/// Receives from everybody who connects, `most` messages of each.
fn viewer(listener: TcpListener, most: usize) -> Arc<Images> {
    let images = Arc::<Images>::default();
    let all = Arc::clone(&images);
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let mut left = most;
            while left > 0 && receive(&mut stream, &all).unwrap_or(None).is_some() {
                left -= 1;
            }
        }
    });
    images
}

fn start(folder: &Folder, port: u16, arguments: &str) -> Running {
    Running::start(folder.command(&format!("{arguments} --preview tev=127.0.0.1:{port}")))
}

fn listen() -> (TcpListener, u16) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    (listener, port)
}

/// Channels of a file, by name.
fn file(folder: &Folder, name: &str) -> BTreeMap<String, Vec<f32>> {
    let path = folder.path().join(name);
    let image = exr::prelude::read_all_flat_layers_from_file(path).unwrap();
    let channels = image.layer_data[0].channel_data.list.iter();
    channels
        .map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()))
        .collect()
}

/// What is left on the screen is what is in the file.
#[test]
fn the_viewer_has_the_picture_and_its_errors() {
    let (listener, port) = listen();
    let images = viewer(listener, usize::MAX);
    for effort in ["mmlt --time 2.5", "bdpt --time 2.5", "auto --mutations 300"] {
        let folder = Folder::new();
        folder.write("a.pbrt", include_str!("../../../../scenes/cornell.pbrt"));
        let picture = "--resolution 300x200 --crop 0.2,0.9,0.1,0.8 --error-layers -o a.exr";
        let flags = format!("render a.pbrt {picture} --integrator {effort}");
        let before = images.get("a.pbrt").unwrap_or_default();
        start(&folder, port, &flags).end().succeeds();
        let expected = file(&folder, "a.exr");
        let mut image = Image::default();
        // The end of what has been sent may still be on its way.
        wait_until("the last picture", || {
            image = images.get("a.pbrt").unwrap_or_default();
            image.channels == expected
        });
        assert_eq!(image.size, [210, 140]);
        assert_eq!(image.created, before.created + 1);
        assert!(
            image.channels["error.G"].iter().any(|v| *v > 0.0),
            "{effort}"
        );
        // One while it is rendered, and the last.
        let updates = image.updates - before.updates;
        assert!(
            updates >= 2 || !effort.contains("time"),
            "{effort}: {updates}"
        );
    }
}

/// A viewer that loses its connection, and one that comes late.
#[test]
fn the_viewer_may_come_and_go() {
    let folder = Folder::new();
    let (listener, port) = listen();
    drop(listener);
    let picture = "render --resolution 64x64 --integrator pt --spp 100000000 -o a.exr";
    let child = start(&folder, port, picture);
    std::thread::sleep(Duration::from_millis(500));
    let images = viewer(TcpListener::bind(("127.0.0.1", port)).unwrap(), 2);
    let created = || images.get("studio.pbrt").map_or(0, |image| image.created);
    wait_until("a picture on the third connection", || created() >= 3);
    send(child.id(), 2);
    let ran = child.end();
    let stderr = ran.stderr();
    assert_eq!(ran.code(), 130, "{stderr}");
    assert!(
        stderr.contains(&format!("no tev at 127.0.0.1:{port}")),
        "{stderr}"
    );
}

/// One that takes nothing: its connection is full before the first picture is through.
#[test]
fn a_viewer_that_hangs_holds_nothing_up() {
    let folder = Folder::new();
    let (listener, port) = listen();
    let begin = Instant::now();
    let picture = "render --resolution 1200x900 --integrator pt --time 3 -o a.exr";
    let child = start(&folder, port, picture);
    let (stream, _) = listener.accept().unwrap();
    let ran = child.end().succeeds();
    assert!(
        begin.elapsed() < Duration::from_secs(20),
        "{:?}",
        begin.elapsed()
    );
    assert!(ran.stderr().contains("ended by --time"), "{}", ran.stderr());
    assert!(super::super::bright(&folder.exr("a.exr")));
    drop(stream);
}
