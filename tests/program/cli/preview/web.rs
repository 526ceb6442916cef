//! The page, by a plain client.

use super::super::growing::wait_until;
use super::super::{Folder, Running};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// A render with a page.
struct Served {
    running: Running,
    stderr: BufReader<std::process::ChildStderr>,
    /// Host and port, and the path of the page.
    host: String,
    path: String,
}

impl Served {
    fn start(folder: &Folder, arguments: &str) -> Self {
        let mut running = Running::start(folder.command(arguments));
        let child = running.0.as_mut().unwrap();
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        stderr.read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("preview: http://").expect(&line);
        let (host, path) = address.split_once('/').unwrap();
        Self {
            running,
            stderr,
            host: host.into(),
            path: format!("/{path}"),
        }
    }

    /// Status line and headers, and body; `None` if nobody answers.
    fn ask(&self, request: &str) -> Option<(String, Vec<u8>)> {
        let mut stream = TcpStream::connect(&self.host).ok()?;
        stream.write_all(request.as_bytes()).ok()?;
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).ok()?;
        let end = answer.windows(4).position(|w| w == b"\r\n\r\n")?;
        let head = String::from_utf8(answer[..end].to_vec()).unwrap();
        Some((head, answer[end + 4..].to_vec()))
    }

    fn request(&self, method: &str, path: &str) -> Option<(String, Vec<u8>)> {
        let host = &self.host;
        self.ask(&format!(
            "{method} {path} HTTP/1.1\r\nHost: {host}\r\nContent-Length: 0\r\n\r\n"
        ))
    }

    /// Of a path beside the page.
    fn get(&self, name: &str) -> Option<Vec<u8>> {
        let (head, body) = self.request("GET", &format!("{}{name}", self.path))?;
        assert!(head.starts_with("HTTP/1.1 200 OK"), "{head}");
        assert!(
            head.contains(&format!("Content-Length: {}", body.len())),
            "{head}"
        );
        Some(body)
    }

    fn status(&self, after: u64) -> Option<serde_json::Value> {
        let body = self.get(&format!("status?after={after}"))?;
        Some(serde_json::from_slice(&body).unwrap())
    }

    /// Number and size of a picture, whether it has errors, and its values.
    fn picture(&self, after: u32) -> Option<([u32; 4], Vec<f32>)> {
        let body = self.get(&format!("picture?after={after}"))?;
        let words: &[[u8; 4]] = body.as_chunks().0;
        let head: Vec<u32> = words
            .get(..7)?
            .iter()
            .map(|w| u32::from_le_bytes(*w))
            .collect();
        let values = words[7..].iter().map(|w| f32::from_le_bytes(*w)).collect();
        Some(([head[0], head[1], head[2], head[6]], values))
    }

    fn end(mut self) -> (i32, String) {
        let mut stderr = String::new();
        self.stderr.read_to_string(&mut stderr).unwrap();
        (self.running.end().code(), stderr)
    }
}

const PICTURE: &str = "--resolution 64x48 --bootstrap 2000 --chains 512 -o a.exr";

#[test]
fn the_page_shows_the_render_and_stops_it() {
    let folder = Folder::new();
    let flags = format!("render {PICTURE} --integrator mmlt --mutations 100000000 --preview web");
    let served = Served::start(&folder, &flags);
    assert!(served.host.starts_with("127.0.0.1:"), "{}", served.host);
    let page = String::from_utf8(served.get("").unwrap()).unwrap();
    assert!(page.contains("<canvas") && page.contains("Stop and save"));

    // The picture changes, and comes to have errors.
    let (first, early) = served.picture(0).unwrap();
    assert_eq!(first[1..3], [64, 48]);
    let mut judged = (first, early.clone());
    wait_until("a picture with errors", || {
        judged = served.picture(judged.0[0]).unwrap();
        judged.0[3] == 1
    });
    assert!(judged.0[0] > first[0] && judged.1[..early.len().min(9216)] != early[..]);
    assert_eq!(judged.1.len(), 2 * 3 * 64 * 48);
    let mut status = served.status(0).unwrap();
    wait_until("errors against time", || {
        status = served.status(status["version"].as_u64().unwrap()).unwrap();
        status["errors"].as_array().unwrap().len() > 1
    });
    assert_eq!(status["scene"], "studio.pbrt");
    assert_eq!(status["phase"], "render");
    assert!(
        status["text"].as_str().unwrap().contains("mutations/s"),
        "{status}"
    );

    // Without the token there is nothing, and nothing is stopped.
    let other = format!("/{}/", "0".repeat(served.path.len() - 2));
    for path in [
        "/",
        "/stop",
        "/status",
        &other,
        &format!("{other}stop"),
        "/../stop",
    ] {
        for method in ["GET", "POST"] {
            let (head, body) = served.request(method, path).unwrap();
            assert!(head.starts_with("HTTP/1.1 404"), "{head}");
            assert!(!String::from_utf8(body).unwrap().contains("canvas"));
        }
    }
    let (head, _) = served
        .request("GET", &format!("{}stop", served.path))
        .unwrap();
    assert!(head.starts_with("HTTP/1.1 405"), "{head}");
    let (head, _) = served.ask("hello\r\n\r\n").unwrap();
    assert!(head.starts_with("HTTP/1.1 400"), "{head}");
    let (head, _) = served
        .ask(&format!("GET /{} HTTP/1.1\r\n\r\n", "x".repeat(1 << 15)))
        .unwrap();
    assert!(head.starts_with("HTTP/1.1 4"), "{head}");
    let status = served.status(0).unwrap();
    assert_eq!(status["stopping"], false);

    let (head, _) = served
        .request("POST", &format!("{}stop", served.path))
        .unwrap();
    assert!(head.starts_with("HTTP/1.1 200"), "{head}");
    // Who is there hears of the end, and has the picture that is written.
    let mut last = judged;
    let mut said = String::new();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while let Some(picture) = served.picture(last.0[0]) {
                last = picture;
            }
        });
        let mut version = 0;
        while let Some(status) = served.status(version) {
            version = status["version"].as_u64().unwrap();
            if let Some(ended) = status["ended"].as_str() {
                said = ended.into();
                break;
            }
        }
    });
    let (code, stderr) = served.end();
    assert_eq!(code, 130, "{stderr}");
    assert!(said.contains("all is written"), "{said}");
    let written = folder.exr("a.exr").pixels;
    assert!(last.1[..9216] == *written.as_flattened());
}

/// Connections that say nothing, or hear nothing, hold up nobody.
#[test]
fn strangers_are_no_harm() {
    let folder = Folder::new();
    let flags = format!("render {PICTURE} --integrator pt --time 3 -q --preview web");
    let served = Served::start(&folder, &flags);
    let idle: Vec<TcpStream> = (0..100)
        .filter_map(|_| TcpStream::connect(&served.host).ok())
        .collect();
    std::thread::sleep(Duration::from_millis(500));
    drop(idle);
    wait_until("an answer", || {
        served.request("GET", &served.path).is_some()
    });
    let mut deaf = TcpStream::connect(&served.host).unwrap();
    let request = format!("GET {}picture?after=0 HTTP/1.1\r\n\r\n", served.path);
    deaf.write_all(request.as_bytes()).unwrap();
    let (code, stderr) = served.end();
    assert_eq!(code, 0, "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    assert!(super::super::bright(&folder.exr("a.exr")));
}

/// A render that is resumed; a picture of which nothing is known but itself.
#[test]
fn all_sorts_of_renders_have_a_page() {
    let folder = Folder::new();
    folder
        .run(&format!(
            "render {PICTURE} --integrator bdpt --spp 2 --checkpoint kept"
        ))
        .succeeds();
    let again = Served::start(
        &folder,
        "resume kept --spp 100000000 -o b.exr --preview web",
    );
    assert_eq!(again.picture(0).unwrap().0[1..3], [64, 48]);
    again
        .request("POST", &format!("{}stop", again.path))
        .unwrap();
    assert_eq!(again.end().0, 130);

    let flags = format!("render {PICTURE} --integrator auto --mutations 100000000 --no-estimate");
    let blind = Served::start(&folder, &format!("{flags} --preview web"));
    let (head, values) = blind.picture(0).unwrap();
    assert_eq!((head[3], values.len()), (0, 3 * 64 * 48));
    assert_eq!(blind.status(0).unwrap()["judged"], false);
    blind
        .request("POST", &format!("{}stop", blind.path))
        .unwrap();
    assert_eq!(blind.end().0, 130);
    folder.run("info b.exr").succeeds();
}
