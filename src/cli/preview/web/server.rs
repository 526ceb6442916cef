//! Connections: one thread waits for them, and each has a thread of its own, up to a number.

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::thread;
use std::time::Duration;

use super::answer::{Asked, answer};
use super::board::Board;
use super::http::{self, Answer};

/// Connections at a time; more are turned away.
const MOST: usize = 32;
/// Bytes of the token: nobody guesses so many.
const TOKEN: usize = 16;
/// Pause after a connection that could not be accepted, as where no file can be opened.
const PAUSE: Duration = Duration::from_millis(100);

/// Serves `board` at a place, until the process ends; the address of the page.
///
/// # Errors
/// Nothing can be served there, or there is no random number to be had.
pub fn start(place: &str, board: &Arc<Board>) -> io::Result<String> {
    let listener = TcpListener::bind(place)?;
    let mut token = [0; TOKEN];
    getrandom::fill(&mut token).map_err(io::Error::other)?;
    let token: String = token.iter().map(|byte| format!("{byte:02x}")).collect();
    let address = format!("http://{}/{token}/", reached(listener.local_addr()?));
    let board = Arc::clone(board);
    let work = move || accept(&listener, &board, &token);
    thread::Builder::new().name("preview".into()).spawn(work)?;
    Ok(address)
}

/// Where browsers on this machine find it: all addresses are none that they could go to.
fn reached(mut address: SocketAddr) -> SocketAddr {
    if address.ip().is_unspecified() {
        address.set_ip(match address.ip() {
            IpAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
            IpAddr::V6(_) => Ipv6Addr::LOCALHOST.into(),
        });
    }
    address
}

/// One of at most so many connections.
struct Place(Arc<AtomicUsize>);

impl Drop for Place {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Relaxed);
    }
}

fn accept(listener: &TcpListener, board: &Arc<Board>, token: &str) {
    let taken = Arc::new(AtomicUsize::new(0));
    let token: Arc<str> = token.into();
    for stream in listener.incoming() {
        let Ok(stream) = stream else {
            thread::sleep(PAUSE);
            continue;
        };
        taken.fetch_add(1, Relaxed);
        let place = Place(Arc::clone(&taken));
        if taken.load(Relaxed) > MOST {
            continue;
        }
        let (board, token) = (Arc::clone(board), Arc::clone(&token));
        let work = move || {
            // Whoever does not wait for the answer does without it.
            let _ = serve(stream, &board, &token);
            drop(place);
        };
        // Without a thread there is no answer either.
        let _ = thread::Builder::new().name("preview".into()).spawn(work);
    }
}

fn serve(mut stream: TcpStream, board: &Board, token: &str) -> io::Result<()> {
    let Some(request) = http::read(&mut stream)? else {
        let answer = Answer::text("400 Bad Request", "This is no request.\n");
        return http::write(&mut stream, &answer);
    };
    let asked = Asked::of(&request, token);
    let (answer, holds) = answer(&asked, board);
    http::write(&mut stream, &answer)?;
    board.handed(holds);
    Ok(())
}
