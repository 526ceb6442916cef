//! Flags about the error of single pixels.

use clap::Args;

// Not doc comments: clap would take them for the command's description.

// What is done with the errors of pixels. Shared by the commands that render.
#[derive(Clone, Copy, Debug, Args)]
pub struct ErrorArgs {
    /// Add layers error.R, error.G, error.B to .exr files: the standard error of each pixel
    ///
    /// From two independent halves of the render, averaged over 5 x 5 pixels.
    #[arg(long, help_heading = "Output")]
    pub error_layers: bool,

    /// Replace bright spots of which only one half of the render knows by their surroundings
    ///
    /// Biased, unlike all else: the light of a spot is taken away. A message says how many pixels
    /// and how much light that is, and .exr files keep the picture as it was rendered in layers
    /// raw.R, raw.G, raw.B. Errors, --stats and --preview are of the picture as it was rendered.
    #[arg(long, help_heading = "Output")]
    pub despeckle: bool,

    /// Say where such spots are, how bright, how much of the light is in them, and which tiles rest
    /// on few chains or samples
    ///
    /// The picture stays as it is. With --stats, `speckles` has all spots.
    #[arg(long, help_heading = "Output")]
    pub firefly_report: bool,
}

impl ErrorArgs {
    /// Whether the errors of pixels are wanted, and by which flag.
    pub fn wanted(&self) -> Option<&'static str> {
        let flags = [
            ("--error-layers", self.error_layers),
            ("--despeckle", self.despeckle),
            ("--firefly-report", self.firefly_report),
        ];
        flags.into_iter().find(|f| f.1).map(|f| f.0)
    }
}
