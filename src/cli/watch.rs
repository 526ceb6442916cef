//! A render, and all that goes on beside it: files, checkpoints, previews.

use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use super::interim::{self, Interim};
use super::keeping::{self, Keeper, Keeping};
use super::messages::Messages;
use super::preview::Previews;
use super::progress::Progress;
use super::viewer::{Viewer, Watched};
use crate::film::output::{self, Attribute};
use crate::formats::tone::Display;
use crate::integrate::{Observer, Render, RenderError, SoFar, State};

/// What goes on beside a render.
pub struct Watch<'a> {
    pub files: &'a Files<'a>,
    /// Time between pictures that are written.
    pub every: Option<Duration>,
    pub previews: &'a Previews,
    pub keeping: Option<&'a Keeping>,
    pub progress: &'a Progress<'a>,
    pub messages: Messages,
}

/// Pictures to write.
pub struct Files<'a> {
    pub paths: &'a [PathBuf],
    pub display: Display,
    /// What EXR files say whatever the picture is.
    pub attributes: Vec<Attribute>,
    /// EXR files have the error of each pixel.
    pub errors: bool,
}

impl Watch<'_> {
    /// Renders by `start`. With the last state, if the render is kept.
    pub fn render(
        &self,
        start: impl FnOnce(&dyn Observer) -> Result<Render, RenderError>,
    ) -> Result<(Render, Option<State>), RenderError> {
        thread::scope(|scope| {
            let (interim, keeper);
            let mut viewers: Vec<&dyn Viewer> = self.previews.viewers().collect();
            if let Some(every) = self.every {
                let pictures;
                (interim, pictures) = Interim::new(every, self.files.errors);
                viewers.push(&interim);
                let write = |so_far: &SoFar| self.files.write(so_far);
                scope.spawn(move || interim::write_all(pictures, self.messages, write));
            }
            let watched = Watched::new(self.progress, viewers);
            let Some(keeping) = self.keeping else {
                return start(&watched).map(|render| (render, None));
            };
            let states;
            (keeper, states) = Keeper::new(&watched, keeping);
            scope.spawn(move || keeping::write_all(states, keeping, self.messages));
            let render = start(&keeper)?;
            Ok((render, keeper.end()))
        })
    }
}

impl Files<'_> {
    /// Writes a picture that is not the last one. A file that fails does not keep others from
    /// being written.
    ///
    /// # Errors
    /// Of the first file that fails.
    fn write(&self, so_far: &SoFar) -> Result<(), String> {
        let errors = so_far.errors.as_deref().filter(|_| self.errors);
        let layers: Vec<(&str, &[[f32; 3]])> = errors.map(|e| ("error", e)).into_iter().collect();
        let write = |path: &Path| {
            let (attributes, display) = (&self.attributes, &self.display);
            output::write_layers(path, &so_far.picture, &layers, attributes, display)
        };
        let files = self.paths.iter();
        let files = files.filter(|path| !crate::files::is_special(path));
        let failed: Vec<_> = files.filter_map(|path| write(path).err()).collect();
        match failed.first() {
            Some(error) => Err(error.to_string()),
            None => Ok(()),
        }
    }
}
