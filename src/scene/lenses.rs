//! Systems of lenses: what pbrt's `realistic` camera looks through.

/// A system of lenses before a film, around the camera's `z` axis. Lengths are those of the
/// camera's space, which pbrt takes to be metres; the film lies in the plane `z = 0`.
#[derive(Clone, Debug, PartialEq)]
pub struct Lenses {
    /// Surfaces from the scene to the film, in focus: the last one's thickness is its distance
    /// from the film. At least one.
    pub elements: Vec<LensElement>,
    /// Of the film; its sides are to each other as those of the picture.
    pub diagonal: f64,
    /// What the stops let through, if they are no disks.
    pub mask: Option<StopMask>,
    /// How bright pictures are.
    pub weighting: LensWeighting,
    /// Rectangles `[x0, x1, y0, y1]` in the plane of the rear vertex, of rings of the film that are
    /// equally wide, from its middle to its corner: through them points of the film on the `x` axis
    /// see the scene, if at all.
    pub pupils: Vec<Option<[f64; 4]>>,
    /// Internal length of a unit of the camera's space.
    pub unit: f32,
}

/// A spherical surface, or a stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensElement {
    /// Radius of the sphere, positive if its centre lies on the film's side; 0 is a stop.
    pub curvature_radius: f64,
    /// Along the axis, to the next surface or to the film.
    pub thickness: f64,
    /// Index of refraction on the film's side.
    pub eta: f64,
    /// What is further from the axis is blocked.
    pub aperture_radius: f64,
}

/// What the stop lets through, over the square around its disk.
#[derive(Clone, Debug, PartialEq)]
pub struct StopMask {
    /// In texels.
    pub width: u32,
    /// In texels.
    pub height: u32,
    /// Row by row in the direction of `y`; looked up bilinearly, 0 beyond the square. The mean is
    /// the share of the square that the disk has.
    pub texels: Vec<f32>,
}

/// What the light that passes the lenses is multiplied by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LensWeighting {
    /// Pixels are the irradiance on the film times this exposure time.
    Irradiance(f32),
    /// pbrt-v3's `simpleweighting`: times the part that the exit pupil has of the one seen from
    /// the middle of the film, both of them by their bounding boxes.
    Simple,
}
