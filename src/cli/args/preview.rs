//! Where a picture is shown while it is rendered.

use clap::Args;

// Not doc comments: clap would take them for the command's description.

// Shared by the commands that render.
#[derive(Clone, Debug, Default, Args)]
pub struct PreviewArgs {
    /// Show the picture while it is rendered: tev[=HOST:PORT] in the viewer tev, web[=PORT] in a
    /// browser; may be repeated
    ///
    /// `tev` sends it to tev at 127.0.0.1:14158, with the standard error of each pixel in layers
    /// error.R, error.G, error.B.
    ///
    /// `web` serves a page to browsers on this machine, at a free port unless PORT is given, and
    /// prints its address. Nobody else can guess that, not even on this machine. The page shows
    /// the picture, where it is wrong, its error against time, and warnings, and can stop the
    /// render as Ctrl-C does. `web=ADDRESS:PORT` is for browsers on other machines, such as
    /// web=0.0.0.0:8080; what they see is not encrypted on its way.
    ///
    /// A viewer that is slow, away or gone neither slows the render nor ends it.
    #[arg(long, value_name = "WHERE", value_parser = preview, help_heading = "Output")]
    pub preview: Vec<Preview>,
}

/// A place to show a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Preview {
    /// The host and port that tev listens to.
    Tev(String),
    /// The address and port to serve a page at; port 0 is a free one.
    Web(String),
}

/// As tev's own default.
const TEV: &str = "127.0.0.1:14158";

fn preview(text: &str) -> Result<Preview, String> {
    let expected = "expected tev, tev=HOST:PORT, web, web=PORT or web=ADDRESS:PORT";
    let (name, place) = match text.split_once('=') {
        Some((name, place)) => (name, Some(place.trim())),
        None => (text, None),
    };
    let is_place = |place: &str| {
        place.rsplit_once(':').is_some_and(|(host, port)| {
            // Colons of an address are in brackets.
            let whole = !host.contains(':') || host.starts_with('[') && host.ends_with(']');
            !host.is_empty() && whole && port.parse::<u16>().is_ok()
        })
    };
    let place = match (name.trim(), place) {
        ("tev", None) => Preview::Tev(TEV.into()),
        ("tev", Some(place)) if is_place(place) => Preview::Tev(place.into()),
        ("web", None) => Preview::Web("127.0.0.1:0".into()),
        ("web", Some(port)) if port.parse::<u16>().is_ok() => {
            Preview::Web(format!("127.0.0.1:{port}"))
        }
        ("web", Some(place)) if is_place(place) => Preview::Web(place.into()),
        _ => return Err(expected.into()),
    };
    Ok(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places() {
        let tev = |place: &str| Ok(Preview::Tev(place.into()));
        let web = |place: &str| Ok(Preview::Web(place.into()));
        assert_eq!(preview("tev"), tev("127.0.0.1:14158"));
        assert_eq!(preview("tev=desk:14158"), tev("desk:14158"));
        assert_eq!(preview("tev=[::1]:9"), tev("[::1]:9"));
        assert_eq!(preview("web"), web("127.0.0.1:0"));
        assert_eq!(preview("web=8080"), web("127.0.0.1:8080"));
        assert_eq!(preview("web=0.0.0.0:0"), web("0.0.0.0:0"));
        for bad in [
            "",
            "tev=",
            "tev=desk",
            "tev=:1",
            "tev=a:99999",
            "web=",
            "web=-1",
            "web=99999",
            "web=::1",
            "web=::1:80",
            "wave",
            "=",
            "tev:1",
        ] {
            assert!(preview(bad).is_err(), "{bad}");
        }
    }
}
