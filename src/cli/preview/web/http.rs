//! Requests and answers of HTTP/1.1, one a connection, bounded in size and time.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// Longest request, with all its headers.
const REQUEST: usize = 16 << 10;
const HEADERS: usize = 64;
/// How long a request may take to come.
const COME: Duration = Duration::from_secs(5);
/// How long a browser may take to accept any of an answer.
const GO: Duration = Duration::from_secs(10);

/// What is asked for.
#[derive(Debug, PartialEq, Eq)]
pub struct Request {
    pub method: String,
    /// With what follows a question mark.
    pub target: String,
}

/// What is sent back.
pub struct Answer {
    /// Code and reason.
    pub status: &'static str,
    pub kind: &'static str,
    pub body: Vec<u8>,
}

impl Answer {
    /// A short text.
    pub fn text(status: &'static str, text: &str) -> Self {
        Self {
            status,
            kind: "text/plain; charset=utf-8",
            body: text.into(),
        }
    }
}

/// Pages hold all they need, and talk to nobody but this process.
const HEADER: &str = "Connection: close\r\n\
    Cache-Control: no-store\r\n\
    X-Content-Type-Options: nosniff\r\n\
    Referrer-Policy: no-referrer\r\n\
    Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; \
    style-src 'unsafe-inline'; img-src data:; connect-src 'self'; base-uri 'none'; \
    form-action 'none'; frame-ancestors 'none'\r\n";

/// Reads a request; `None` if it is none.
///
/// # Errors
/// It does not come whole, or not in time.
pub fn read(stream: &mut TcpStream) -> io::Result<Option<Request>> {
    let until = Instant::now() + COME;
    let mut bytes = Vec::new();
    let mut piece = [0; 4096];
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(ErrorKind::TimedOut.into());
        }
        stream.set_read_timeout(Some(left))?;
        let n = match stream.read(&mut piece) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(n) => n,
            Err(e) if e.kind() == ErrorKind::Interrupted => continue,
            Err(e) => return Err(e),
        };
        bytes.extend_from_slice(&piece[..n]);
        match parse(&bytes) {
            Parsed::Whole(request) => return Ok(Some(request)),
            Parsed::Bad => return Ok(None),
            Parsed::Part if bytes.len() > REQUEST => return Ok(None),
            Parsed::Part => {}
        }
    }
}

#[derive(Debug, PartialEq, Eq)]
enum Parsed {
    Whole(Request),
    Part,
    Bad,
}

fn parse(bytes: &[u8]) -> Parsed {
    let mut headers = [httparse::EMPTY_HEADER; HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(bytes) {
        Ok(httparse::Status::Complete(_)) => match (request.method, request.path) {
            (Some(method), Some(target)) => Parsed::Whole(Request {
                method: method.into(),
                target: target.into(),
            }),
            _ => Parsed::Bad,
        },
        Ok(httparse::Status::Partial) => Parsed::Part,
        Err(_) => Parsed::Bad,
    }
}

/// Sends an answer, and ends the connection.
///
/// # Errors
/// Whoever asked is gone, or too slow.
pub fn write(stream: &mut TcpStream, answer: &Answer) -> io::Result<()> {
    stream.set_write_timeout(Some(GO))?;
    let Answer { status, kind, body } = answer;
    let length = body.len();
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{HEADER}\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)?;
    stream.shutdown(Shutdown::Write)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn requests() {
        let whole = Parsed::Whole(Request {
            method: "GET".into(),
            target: "/a?b=1".into(),
        });
        let text = b"GET /a?b=1 HTTP/1.1\r\nHost: x\r\n\r\n";
        assert_eq!(parse(text), whole);
        for end in 1..text.len() {
            assert_eq!(parse(&text[..end]), Parsed::Part, "{end}");
        }
        assert_eq!(parse(b"\x16\x03\x01 hello"), Parsed::Bad);
    }

    proptest! {
        #![proptest_config(crate::property::cases(1000))]

        #[test]
        fn anything_is_a_request_or_none(bytes in proptest::collection::vec(any::<u8>(), 0..99)) {
            parse(&bytes);
        }
    }
}
