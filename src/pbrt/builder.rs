//! Scenes made in code, without a file.
//!
//! A [`SceneBuilder`] writes down what it is told in pbrt's own directives, and has them loaded:
//! what is built is what a file of the same words would give, bit for bit, and every rule of the
//! format holds. Numbers keep all of their digits.

use super::{SceneError, load_str};
use crate::scene::Scene;
use std::fmt::Write;
use std::path::Path;

/// Red, green and blue: a reflectance, or a linear radiance.
type Rgb = [f32; 3];

/// What surfaces are made of; as in pbrt-v4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Material {
    /// Lambertian, of a reflectance of at most 1.
    Diffuse(Rgb),
    /// Smooth or rough metal.
    Conductor {
        /// Index of refraction of each channel.
        eta: Rgb,
        /// Absorption coefficient of each channel.
        k: Rgb,
        /// Width of the microfacets' slopes; 0 for a mirror.
        roughness: f32,
    },
    /// Glass.
    Dielectric {
        /// Index of refraction.
        eta: f32,
        /// Width of the microfacets' slopes; 0 for clear glass.
        roughness: f32,
    },
    /// A diffuse base under a coat of clear lacquer.
    Coated {
        /// Of the base.
        reflectance: Rgb,
        /// Width of the slopes of the coat's microfacets.
        roughness: f32,
    },
}

/// Lights that are no shapes. Radiance is in the scene's own units: a diffuse emitter of radiance 1
/// that fills the view is white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// At a point.
    Point {
        /// Where.
        from: [f32; 3],
        /// Radiant intensity: radiance times area.
        intensity: Rgb,
    },
    /// From infinitely far.
    Distant {
        /// Where its light goes, in any length.
        towards: [f32; 3],
        /// Irradiance of what faces it.
        radiance: Rgb,
    },
    /// The same from everywhere.
    Infinite {
        /// Of all directions.
        radiance: Rgb,
    },
}

/// Builds a scene. Space is right-handed. Shapes have the last material and emission that were set.
///
/// ```
/// use phalanx::pbrt::{Light, Material, SceneBuilder};
/// let scene = SceneBuilder::new(64, 48)
///     .camera([0.0, 1.0, 4.0], [0.0, 0.5, 0.0], 40.0)
///     .material(Material::Diffuse([0.6, 0.5, 0.4]))
///     .mesh(
///         &[[-3.0, 0.0, -3.0], [-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0]],
///         &[[0, 1, 2], [0, 2, 3]],
///     )
///     .material(Material::Dielectric { eta: 1.5, roughness: 0.0 })
///     .sphere([0.0, 0.5, 0.0], 0.5)
///     .light(Light::Infinite { radiance: [1.0; 3] })
///     .build()?;
/// assert_eq!(scene.triangles.len(), 2);
/// # Ok::<(), phalanx::pbrt::SceneError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SceneBuilder {
    size: [u32; 2],
    max_depth: u32,
    view: String,
    world: String,
    /// The directive of the last one.
    material: String,
    emits: bool,
}

/// Numbers within brackets.
fn list<T: std::fmt::Display>(values: impl IntoIterator<Item = T>) -> String {
    let mut text = String::from("[");
    for value in values {
        write!(text, " {value}").expect("text takes all");
    }
    text + " ]"
}

impl SceneBuilder {
    /// A picture of so many pixels, of nothing yet: no shape, no light. The camera looks from the
    /// origin along -z.
    pub fn new(width: u32, height: u32) -> Self {
        let empty = Self {
            size: [width, height],
            max_depth: 8,
            view: String::new(),
            world: String::new(),
            material: String::new(),
            emits: false,
        };
        let diffuse = Material::Diffuse([0.5; 3]);
        empty
            .camera([0.0; 3], [0.0, 0.0, -1.0], 60.0)
            .material(diffuse)
    }

    /// A pinhole that looks `from` a point `at` another, y up, with so many degrees along the
    /// shorter side of the picture.
    pub fn camera(self, from: [f32; 3], at: [f32; 3], degrees: f32) -> Self {
        self.thin_lens(from, at, degrees, 0.0)
    }

    /// The same with a lens of a radius, in focus `at` the point.
    pub fn thin_lens(mut self, from: [f32; 3], at: [f32; 3], degrees: f32, radius: f32) -> Self {
        let [x, y, z] = [0, 1, 2].map(|axis| at[axis] - from[axis]);
        let distance = (x * x + y * y + z * z).sqrt();
        // pbrt's camera is left-handed.
        let look = [from, at, [0.0, 1.0, 0.0]].concat();
        let look: Vec<String> = look.iter().map(f32::to_string).collect();
        self.view = format!(
            "Scale -1 1 1\nLookAt {}\nCamera \"perspective\" \"float fov\" {degrees} \
             \"float lensradius\" {radius} \"float focaldistance\" {distance}\n",
            look.join(" ")
        );
        self
    }

    /// Most scattering events on a path; 8 unless this says otherwise.
    pub fn max_depth(mut self, depth: u32) -> Self {
        self.max_depth = depth;
        self
    }

    fn tell(mut self, directive: &str) -> Self {
        self.world += directive;
        self.world.push('\n');
        self
    }

    /// Of the shapes that follow.
    pub fn material(mut self, material: Material) -> Self {
        let words = match material {
            Material::Diffuse(rgb) => format!("\"diffuse\" \"rgb reflectance\" {}", list(rgb)),
            Material::Conductor { eta, k, roughness } => format!(
                "\"conductor\" \"rgb eta\" {} \"rgb k\" {} \"float roughness\" {roughness} \
                 \"bool remaproughness\" false",
                list(eta),
                list(k)
            ),
            Material::Dielectric { eta, roughness } => format!(
                "\"dielectric\" \"float eta\" {eta} \"float roughness\" {roughness} \
                 \"bool remaproughness\" false"
            ),
            Material::Coated {
                reflectance,
                roughness,
            } => format!(
                "\"coateddiffuse\" \"rgb reflectance\" {} \"float roughness\" {roughness} \
                 \"bool remaproughness\" false",
                list(reflectance)
            ),
        };
        self.material = format!("Material {words}");
        let directive = self.material.clone();
        self.tell(&directive)
    }

    /// The shapes that follow are area lights: their radiance, on the side that their normals point
    /// to. Zero ends it.
    pub fn emission(mut self, radiance: Rgb) -> Self {
        // What a shape emits belongs to a block, and so does a material within it.
        if self.emits {
            let again = format!("AttributeEnd\n{}", self.material);
            self = self.tell(&again);
        }
        self.emits = radiance != [0.0; 3];
        if !self.emits {
            return self;
        }
        let radiance = list(radiance);
        self.tell(&format!(
            "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" {radiance}"
        ))
    }

    /// A whole sphere. Its normals point outwards.
    pub fn sphere(self, centre: [f32; 3], radius: f32) -> Self {
        let centre = centre.map(|c| c.to_string()).join(" ");
        self.tell(&format!(
            "AttributeBegin\nTranslate {centre}\nShape \"sphere\" \"float radius\" {radius}\n\
             AttributeEnd"
        ))
    }

    /// Triangles over vertices. Seen from where their normals point to, the vertices of a triangle
    /// go round counterclockwise.
    pub fn mesh(self, vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let points = list(vertices.as_flattened());
        let indices = list(triangles.as_flattened());
        self.tell(&format!(
            "Shape \"trianglemesh\" \"point3 P\" {points} \"integer indices\" {indices}"
        ))
    }

    /// A light that is no shape.
    pub fn light(self, light: Light) -> Self {
        let words = match light {
            Light::Point { from, intensity } => format!(
                "\"point\" \"point3 from\" {} \"rgb I\" {}",
                list(from),
                list(intensity)
            ),
            Light::Distant { towards, radiance } => format!(
                "\"distant\" \"point3 from\" [ 0 0 0 ] \"point3 to\" {} \"rgb L\" {}",
                list(towards),
                list(radiance)
            ),
            Light::Infinite { radiance } => {
                format!("\"infinite\" \"rgb L\" {}", list(radiance))
            }
        };
        self.tell(&format!("LightSource {words}"))
    }

    /// What has been written down: a pbrt-v4 scene.
    pub fn text(&self) -> String {
        let [width, height] = self.size;
        let end = if self.emits { "AttributeEnd\n" } else { "" };
        format!(
            "Film \"rgb\" \"integer xresolution\" {width} \"integer yresolution\" {height}\n\
             Integrator \"mlt\" \"integer maxdepth\" {}\n{}WorldBegin\n{}{end}",
            self.max_depth, self.view, self.world
        )
    }

    /// The scene. The error of what cannot be, such as a sphere of radius NaN or an index beyond a
    /// mesh, names the line of [`SceneBuilder::text`].
    pub fn build(&self) -> Result<Scene, SceneError> {
        load_str(&self.text(), "built scene", Path::new(""))
    }
}
