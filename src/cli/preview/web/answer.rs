//! What is served at which path.

use super::board::Board;
use super::http::{Answer, Request};
use crate::converge::report::VIRIDIS;
use crate::integrate::SoFar;

const PAGE: &str = include_str!("page.html");
const CSS: &str = include_str!("page.css");
const DRAW: &str = include_str!("draw.js");
const JS: &str = include_str!("page.js");

/// What somebody wants.
#[derive(Debug, PartialEq, Eq)]
pub enum Asked {
    Page,
    /// Later than this version.
    Status(u64),
    /// Above this number.
    Picture(u64),
    Stop,
    /// What is there, but not for this method.
    Otherwise,
    /// What is not there, or not for whoever asks.
    Nothing,
}

impl Asked {
    /// By path and method. Without the token nothing is there.
    pub fn of(request: &Request, token: &str) -> Self {
        let (path, query) = match request.target.split_once('?') {
            Some((path, query)) => (path, query),
            None => (request.target.as_str(), ""),
        };
        let inside = path
            .strip_prefix('/')
            .and_then(|path| path.strip_prefix(token));
        let after = || {
            let value = query
                .split('&')
                .find_map(|part| part.strip_prefix("after="));
            value.and_then(|value| value.parse().ok()).unwrap_or(0)
        };
        match (request.method.as_str(), inside) {
            ("GET", Some("/")) => Self::Page,
            ("GET", Some("/status")) => Self::Status(after()),
            ("GET", Some("/picture")) => Self::Picture(after()),
            ("POST", Some("/stop")) => Self::Stop,
            (_, Some("/" | "/status" | "/picture" | "/stop")) => Self::Otherwise,
            _ => Self::Nothing,
        }
    }
}

/// The answer; and the version of the status and the number of the picture that it holds, or 0 in
/// place of them. Where there is no picture, it is empty.
pub fn answer(asked: &Asked, board: &Board) -> (Answer, [u64; 2]) {
    let of = |kind, body| Answer {
        status: "200 OK",
        kind,
        body,
    };
    let mut holds = [0; 2];
    let answer = match asked {
        Asked::Page => of("text/html; charset=utf-8", page().into_bytes()),
        Asked::Status(after) => {
            let (version, status) = board.status(*after);
            holds[0] = version;
            of("application/json", status.into_bytes())
        }
        Asked::Picture(after) => {
            let packed = board.picture(*after).map(|(number, so_far)| {
                holds[1] = number;
                pack(number, &so_far)
            });
            of("application/octet-stream", packed.unwrap_or_default())
        }
        Asked::Stop => {
            board.stop();
            of("application/json", b"{}".to_vec())
        }
        Asked::Otherwise => Answer::text("405 Method Not Allowed", "Not in this way.\n"),
        Asked::Nothing => Answer::text("404 Not Found", "Nothing is here.\n"),
    };
    (answer, holds)
}

/// The whole page, with the colours of its maps.
fn page() -> String {
    let colours: Vec<String> = (VIRIDIS.iter().flatten()).map(u8::to_string).collect();
    let script = DRAW.replace("VIRIDIS_RGB", &colours.join(", ")) + JS;
    PAGE.replace("{{css}}", CSS).replace("{{js}}", &script)
}

/// Pixels that are sent, at most: browsers have trouble with more.
const MOST: usize = 8 << 20;

/// A picture for the page, all of it little endian: as `u32` its number, the width and height of
/// what follows, how many pixels of the picture one of them stands for in either direction, the
/// place of the crop window from the left and the top, and whether there are errors; then `f32`,
/// three a pixel: the picture, and its errors.
fn pack(number: u64, so_far: &SoFar) -> Vec<u8> {
    let picture = &so_far.picture;
    let (width, height) = (picture.width as usize, picture.height as usize);
    let mut step = 1;
    while width.div_ceil(step) * height.div_ceil(step) > MOST {
        step += 1;
    }
    let size = [width, height].map(|side| side.div_ceil(step));
    let numbers = [
        number as u32,
        size[0] as u32,
        size[1] as u32,
        step as u32,
        picture.offset[0],
        picture.offset[1],
        u32::from(so_far.errors.is_some()),
    ];
    let mut bytes: Vec<u8> = numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
    let tables = [Some(&picture.pixels), so_far.errors.as_ref()];
    for (table, pixels) in tables.into_iter().flatten().enumerate() {
        bytes.reserve(12 * size[0] * size[1]);
        for y in (0..height).step_by(step) {
            for x in (0..width).step_by(step) {
                let rows = y..height.min(y + step);
                let columns = x..width.min(x + step);
                let inside = rows.flat_map(|y| columns.clone().map(move |x| y * width + x));
                let value = mean(inside.map(|i| pixels[i]), table == 1);
                bytes.extend(value.iter().flat_map(|v| v.to_le_bytes()));
            }
        }
    }
    bytes
}

/// Of values, or of standard errors: the root of their mean square.
fn mean(pixels: impl Iterator<Item = [f32; 3]>, squares: bool) -> [f32; 3] {
    let (mut sum, mut count) = ([0.0; 3], 0);
    let mut only = [0.0; 3];
    for pixel in pixels {
        for (sum, v) in sum.iter_mut().zip(pixel) {
            let v = f64::from(v);
            *sum += if squares { v * v } else { v };
        }
        only = pixel;
        count += 1;
    }
    if count == 1 {
        return only;
    }
    sum.map(|v| {
        let mean = v / f64::from(count);
        (if squares { mean.sqrt() } else { mean }) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Picture;

    #[test]
    fn nothing_is_there_without_the_token() {
        let asked = |method: &str, target: &str| {
            let request = Request {
                method: method.into(),
                target: target.into(),
            };
            Asked::of(&request, "secret")
        };
        assert_eq!(asked("GET", "/secret/"), Asked::Page);
        assert_eq!(asked("GET", "/secret/status?after=7"), Asked::Status(7));
        assert_eq!(
            asked("GET", "/secret/picture?a=1&after=8"),
            Asked::Picture(8)
        );
        assert_eq!(asked("GET", "/secret/picture?after=x"), Asked::Picture(0));
        assert_eq!(asked("POST", "/secret/stop"), Asked::Stop);
        assert_eq!(asked("GET", "/secret/stop"), Asked::Otherwise);
        assert_eq!(asked("POST", "/secret/"), Asked::Otherwise);
        for other in [
            "/",
            "",
            "/secre/",
            "/secrets/",
            "/secret",
            "secret/",
            "//secret/",
            "/stop",
        ] {
            assert_eq!(asked("GET", other), Asked::Nothing, "{other}");
            assert_eq!(asked("POST", other), Asked::Nothing, "{other}");
        }
    }

    #[test]
    fn the_page_is_filled() {
        let page = page();
        assert!(!page.contains("{{") && !page.contains("VIRIDIS_RGB"));
        // Nothing from elsewhere.
        assert!(!page.contains("http:") && !page.contains("https:"));
    }

    #[test]
    fn pictures_are_packed_as_they_are() {
        let so_far = SoFar {
            picture: Picture {
                width: 2,
                height: 1,
                offset: [5, 6],
                full: [9, 9],
                pixels: vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
            },
            errors: Some(vec![[0.5; 3]; 2]),
            relative_error: Some(0.25),
            warnings: None,
        };
        let bytes = pack(3, &so_far);
        let words: Vec<[u8; 4]> = bytes.as_chunks().0.to_vec();
        let head: Vec<u32> = words[..7].iter().map(|b| u32::from_le_bytes(*b)).collect();
        assert_eq!(head, [3, 2, 1, 1, 5, 6, 1]);
        let rest: Vec<f32> = words[7..].iter().map(|b| f32::from_le_bytes(*b)).collect();
        assert_eq!(rest[..6], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(rest[6..], [0.5; 6]);
    }
}
