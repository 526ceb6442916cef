//! The picture in a browser: a page, served by this process.
//!
//! The address of the page holds a random token, without which nothing is served: other users of
//! the machine can reach the port, but see nothing and stop nothing.
//!
//! - `GET` of the page itself: one file, which needs nothing else.
//! - `GET status?after=V`: a JSON object, as soon as there is one of a later version than V.
//! - `GET picture?after=N`: the picture and its errors as they are, as soon as there is one with a
//!   number above N. It is asked for by this, and by nothing else: a page that nobody looks at
//!   costs the render nothing.
//! - `POST stop`: the render ends as by Ctrl-C.

mod answer;
mod board;
mod http;
mod server;

use std::io;
use std::sync::Arc;

use self::board::Board;
use super::about::About;
use crate::cli::progress::Told;
use crate::cli::signals::Signals;
use crate::cli::viewer::Viewer;
use crate::integrate::{SoFar, Wanted};

/// A page that is served until the process ends.
pub struct Web {
    board: Arc<Board>,
    address: String,
}

impl Web {
    /// Serves at `place`, an address and a port; port 0 is a free one.
    ///
    /// # Errors
    /// Nothing can be served there, or there is no random number to be had.
    pub fn start(place: &str, signals: &Signals) -> io::Result<Self> {
        let board = Arc::new(Board::new(signals.clone()));
        let address = server::start(place, &board)?;
        Ok(Self { board, address })
    }

    /// Of the page, with its token.
    pub fn address(&self) -> &str {
        &self.address
    }

    pub fn begin(&self, about: &About) {
        self.board.begin(about);
    }

    pub fn ended(&self, said: &str) {
        self.board.ended(said);
    }

    /// Waits a moment, so that a page that is open hears of the end.
    pub fn finish(&self) {
        self.board.finish();
    }
}

impl Viewer for Web {
    fn wants(&self, last: bool) -> Wanted {
        self.board.wants(last)
    }

    fn show(&self, so_far: &Arc<SoFar>) {
        self.board.show(so_far);
    }

    fn told(&self, told: &Told) {
        self.board.told(told);
    }

    fn error(&self, seconds: f64, relative: f64) {
        self.board.error(seconds, relative);
    }
}
