//! Previews: the picture where it can be seen while it is rendered.

mod about;
mod pace;
mod packet;
mod tev;
mod web;

pub use self::about::About;
use self::tev::Tev;
use self::web::Web;
use super::args::preview::Preview;
use super::failure::Failure;
use super::messages::Messages;
use super::signals::Signals;
use super::viewer::Viewer;

/// All of them. They outlive a render: there may be several, one after the other.
pub struct Previews {
    tev: Option<Tev>,
    web: Option<Web>,
}

impl Previews {
    /// Those that are asked for; of each kind the last. The address of a page is printed.
    ///
    /// # Errors
    /// A page cannot be served there.
    pub fn start(
        asked: &[Preview],
        signals: &Signals,
        messages: Messages,
    ) -> Result<Self, Failure> {
        let (mut tev, mut web) = (None, None);
        for preview in asked {
            match preview {
                Preview::Tev(place) => tev = Some(place),
                Preview::Web(place) => web = Some(place),
            }
        }
        let fail = |place: &str, e| Failure::Io(format!("--preview: {place}: {e}"));
        // Without a thread for it there is no preview, and no render either.
        let tev = tev.map(|place| Tev::start(place, messages).map_err(|e| fail(place, e)));
        let web = web.map(|place| Web::start(place, signals).map_err(|e| fail(place, e)));
        let (tev, web) = (tev.transpose()?, web.transpose()?);
        if let Some(web) = &web {
            messages.always(format_args!("preview: {}", web.address()));
        }
        Ok(Self { tev, web })
    }

    /// From now on this is rendered.
    pub fn begin(&self, about: &About) {
        if let Some(tev) = &self.tev {
            tev.begin(about.scene, about.settings.estimate_error);
        }
        if let Some(web) = &self.web {
            web.begin(about);
        }
    }

    /// Those who want to see it.
    pub fn viewers(&self) -> impl Iterator<Item = &dyn Viewer> {
        let tev = self.tev.iter().map(|tev| tev as &dyn Viewer);
        tev.chain(self.web.iter().map(|web| web as &dyn Viewer))
    }

    /// How a render has ended.
    pub fn ended(&self, said: &str) {
        if let Some(web) = &self.web {
            web.ended(said);
        }
    }

    /// There is nothing more to render; viewers have a moment to hear of it.
    pub fn finish(&self) {
        if let Some(tev) = &self.tev {
            tev.finish();
        }
        if let Some(web) = &self.web {
            web.finish();
        }
    }
}
