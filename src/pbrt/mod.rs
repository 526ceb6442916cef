//! The pbrt text format, v3 and v4, into a [`Scene`].
//!
//! 1. `text` reads files block by block, `lexer` and `stream` turn them into tokens, `Include`
//!    spliced in.
//! 2. `dialect` decides between v3 and v4 before anything is interpreted.
//! 3. `loader` runs the directives over a stack of states (`state`); each directive's parameters
//!    are a `params::ParamSet`. What pbrt tolerates is tolerated, with a warning each: `tolerance`
//!    has what is of v3 as a whole.
//! 4. `shape`, `materials`, `textures`, `lights` and `view` build what directives stand for,
//!    geometry in world space and `f64` (`geometry`).
//! 5. `finish` finds the internal space and fills the tables.
//!
//! `builder` makes scenes in code: of the same words, without a file.

mod brightness;
mod budget;
mod builder;
mod built;
mod coats;
mod color;
mod color_space;
mod curves;
mod dialect;
mod error;
mod extent;
mod finish;
mod flush;
mod folder;
mod geometry;
mod given;
pub mod image;
mod instances;
mod lexer;
mod lights;
mod loader;
mod loading;
mod materials;
pub mod media;
mod mesh;
mod mixtures;
mod options;
mod params;
pub mod ply;
mod quadrics;
mod sensor;
mod shape;
pub mod spectrum;
mod state;
mod stream;
mod text;
mod textures;
mod tolerance;
mod transform;
mod view;

#[cfg(test)]
mod tests;

use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;

use self::budget::Budget;
pub use self::builder::{Light, Material, SceneBuilder};
pub use self::error::SceneError;
use self::error::{Pos, Site};
use self::folder::Folder;
use self::loader::Loader;
pub use self::loading::Loading;
use self::stream::TokenStream;
use self::text::Text;
use crate::scene::Scene;

/// Loads a scene file (`.pbrt` or `.pbrt.gz`) and all it refers to.
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    load_within(path, u64::MAX, &Arc::default())
}

/// [`load`], in no more than about so many bytes of memory; `loading` is told how it goes.
pub fn load_within(path: &Path, memory: u64, loading: &Arc<Loading>) -> Result<Scene, SceneError> {
    let dir = path.parent().unwrap_or(Path::new(""));
    let budget = Budget::new(memory, Arc::clone(loading));
    load_text(&Text::File(path.into()), dir, budget)
}

/// Loads a scene from text. Messages call it `name`; files it refers to are looked for in `dir`.
pub fn load_str(text: &str, name: &str, dir: &Path) -> Result<Scene, SceneError> {
    load_text(&Text::held(name, text.as_bytes()), dir, Budget::default())
}

/// Loads a scene from the bytes of a scene file, compressed or not, as [`load_within`] does.
/// Messages call it `name`; files it refers to are looked for in the current folder.
pub fn load_bytes(
    content: &[u8],
    name: &str,
    memory: u64,
    loading: &Arc<Loading>,
) -> Result<Scene, SceneError> {
    let budget = Budget::new(memory, Arc::clone(loading));
    load_text(&Text::held(name, content), Path::new(""), budget)
}

fn load_text(text: &Text, dir: &Path, budget: Budget) -> Result<Scene, SceneError> {
    let budget = Rc::new(budget);
    let stream = TokenStream::new(text, &budget).map_err(SceneError::plain)?;
    let start = Pos {
        file: text.name(),
        line: 1,
        column: 1,
    };
    let start = Site::new(start, "WorldBegin");
    let dialect = dialect::detect(text, dir);
    let mut loader = Loader::new(
        stream,
        dialect,
        Rc::new(Folder::new(dir, text.path())),
        budget,
    );
    loader.run(&start)?;
    finish::finish(loader)
}
