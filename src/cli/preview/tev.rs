//! The picture in tev, a viewer of its own process.

use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::pace::Pace;
use super::packet;
use crate::cli::messages::Messages;
use crate::cli::viewer::Viewer;
use crate::integrate::{SoFar, Wanted};

/// How long a connection may take.
const CONNECT: Duration = Duration::from_secs(2);
/// Time between tries to connect.
const RETRY: Duration = Duration::from_secs(1);
/// How long tev may take for a picture.
const SEND: Duration = Duration::from_secs(10);
/// How long the program waits for the last picture to be sent.
const LAST: Duration = Duration::from_secs(2);

/// Sends pictures from a thread of its own. Only the newest is kept for it.
pub struct Tev(Arc<Shared>);

#[derive(Default)]
struct Shared {
    slot: Mutex<Slot>,
    changed: Condvar,
}

#[derive(Default)]
struct Slot {
    /// What tev is to call the picture.
    name: String,
    /// It has errors.
    judged: bool,
    pace: Pace,
    /// To be sent.
    picture: Option<Arc<SoFar>>,
    link: Link,
    /// There will be no more pictures.
    closed: bool,
    /// The thread has ended.
    done: bool,
}

/// How things stand with tev.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Link {
    #[default]
    Away,
    /// It has all that there was to send.
    Idle,
    /// A picture is being sent.
    Busy,
}

impl Tev {
    /// For tev at `place`, a host and a port, whether it is there or not.
    ///
    /// # Errors
    /// No thread can be had.
    pub fn start(place: &str, messages: Messages) -> io::Result<Self> {
        let shared = Arc::<Shared>::default();
        let place = place.to_owned();
        let tev = Self(Arc::clone(&shared));
        let work = move || {
            shared.work(&place, messages);
            shared.lock().done = true;
            shared.changed.notify_all();
        };
        thread::Builder::new().name("tev".into()).spawn(work)?;
        Ok(tev)
    }

    /// A picture of this name is rendered from now on, with or without errors.
    pub fn begin(&self, name: &str, judged: bool) {
        let mut slot = self.0.lock();
        slot.name = name.into();
        slot.judged = judged;
        slot.pace = Pace::default();
    }

    /// There will be no more pictures; the last one has a moment to get there.
    pub fn finish(&self) {
        let mut slot = self.0.lock();
        slot.closed = true;
        self.0.changed.notify_all();
        let waits = |slot: &mut Slot| !slot.done && slot.link != Link::Away;
        drop(self.0.changed.wait_timeout_while(slot, LAST, waits));
    }
}

impl Viewer for Tev {
    fn wants(&self, last: bool) -> Wanted {
        let mut slot = self.0.lock();
        match slot.link {
            Link::Away => Wanted::Nothing,
            _ if last => Wanted::Judged,
            Link::Idle if slot.picture.is_none() => slot.pace.ask(),
            _ => Wanted::Nothing,
        }
    }

    fn show(&self, so_far: &Arc<SoFar>) {
        let mut slot = self.0.lock();
        slot.pace.shown();
        slot.picture = Some(Arc::clone(so_far));
        self.0.changed.notify_all();
    }
}

/// What to send next.
struct Job {
    name: String,
    judged: bool,
    picture: Arc<SoFar>,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends pictures until there are no more, and connects as often as that takes.
    fn work(&self, place: &str, messages: Messages) {
        let mut told = false;
        loop {
            let sent = connect(place).and_then(|stream| {
                told = false;
                self.send_all(stream)
            });
            let closed = {
                let mut slot = self.lock();
                slot.link = Link::Away;
                self.changed.notify_all();
                slot.closed
            };
            match sent {
                Ok(()) => return,
                // A viewer that comes later sees the picture, too.
                Err(e) if !told && !closed => {
                    messages.note(format_args!(
                        "--preview: no tev at {place} ({e}); the render goes on, and looks for it now and then"
                    ));
                    told = true;
                }
                Err(_) => {}
            }
            let slot = self.lock();
            let waited = self.changed.wait_timeout_while(slot, RETRY, |s| !s.closed);
            if waited.unwrap_or_else(PoisonError::into_inner).0.closed {
                return;
            }
        }
    }

    /// The next picture; `None` if there will be none.
    fn next(&self) -> Option<Job> {
        let mut slot = self.lock();
        slot.link = Link::Idle;
        let waits = |slot: &mut Slot| slot.picture.is_none() && !slot.closed;
        let waited = self.changed.wait_while(slot, waits);
        let mut slot = waited.unwrap_or_else(PoisonError::into_inner);
        let picture = slot.picture.take()?;
        slot.link = Link::Busy;
        Some(Job {
            name: slot.name.clone(),
            judged: slot.judged,
            picture,
        })
    }

    fn send_all(&self, mut stream: TcpStream) -> io::Result<()> {
        let mut created = None;
        while let Some(job) = self.next() {
            let until = Instant::now() + SEND;
            let picture = &job.picture.picture;
            let size = [picture.width, picture.height];
            let image = Some((job.name.clone(), size));
            if created != image {
                let packet = packet::create(&job.name, size, job.judged);
                send(&mut stream, &packet, until)?;
                created = image;
            }
            let errors = job.picture.errors.as_deref().filter(|_| job.judged);
            for packet in packet::update(&job.name, picture, errors) {
                send(&mut stream, &packet, until)?;
            }
        }
        Ok(())
    }
}

fn connect(place: &str) -> io::Result<TcpStream> {
    let mut failure = io::Error::other("no such host");
    for address in place.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(stream) => return Ok(stream),
            Err(e) => failure = e,
        }
    }
    Err(failure)
}

/// Sends a message, or fails when time is up.
fn send(stream: &mut TcpStream, mut packet: &[u8], until: Instant) -> io::Result<()> {
    while !packet.is_empty() {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        stream.set_write_timeout(Some(left))?;
        match stream.write(packet) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(n) => packet = &packet[n..],
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(())
}
