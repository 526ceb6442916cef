//! What the first process tells the others to do.

use super::super::args::PictureArgs;
use crate::checkpoint::{Malformed, Origin, Packed, Reader, Writer};
use crate::integrate::Checkpoint;

/// Next to do.
pub enum Task {
    /// Load this scene.
    Load(Origin),
    /// Render it together: from the files, with the picture and the settings of this checkpoint.
    Render(Box<Checkpoint>),
    /// That was all.
    Leave,
}

impl Task {
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut to = Writer::new();
        match self {
            Self::Load(origin) => {
                to.value(0u8);
                origin.save(&mut to);
            }
            Self::Render(checkpoint) => {
                to.value(1u8);
                to.table(&checkpoint.head().into_bytes());
            }
            Self::Leave => to.value(2u8),
        }
        to.finish().into_bytes()
    }

    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, Malformed> {
        let packed = Packed::from_bytes(bytes);
        let mut from = Reader::new(&packed);
        let task = match from.value::<u8>()? {
            0 => Self::Load(Origin::load(&mut from)?),
            1 => {
                let head = Packed::from_bytes(from.list(1 << 30)?);
                let checkpoint = Checkpoint::of(&head, Packed::default())?;
                Self::Render(Box::new(checkpoint))
            }
            _ => Self::Leave,
        };
        from.end()?;
        Ok(task)
    }
}

/// The picture of a checkpoint, as flags have it.
pub fn picture(checkpoint: &Checkpoint) -> PictureArgs {
    PictureArgs {
        resolution: checkpoint.resolution.map(|[w, h]| (w, h)),
        crop: checkpoint.crop,
    }
}
