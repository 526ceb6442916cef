//! A path as the renderer walks it, in `f32`, every vertex kept.

use super::oracle::path::{End, Path, PathVertex};
use super::oracle::vector::{V, wide};
use crate::transport::mis::Partial;
use crate::transport::paths::Side;
use crate::transport::wavelength::Wavelength;
use std::fmt;

/// A subpath's vertex and how the subpath came there and went on.
#[derive(Clone, Debug)]
pub struct SubpathVertex {
    /// Where it is.
    pub vertex: PathVertex,
    /// Unit, to the previous vertex.
    pub wo: [f32; 3],
    /// Throughput on arrival.
    pub beta: [f32; 3],
    /// Running sums of multiple importance sampling on arrival.
    pub partial: Partial<f32>,
    /// `None` at an endpoint.
    pub sampled: Option<Sampled>,
}

/// A direction that was sampled from a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct Sampled {
    /// Unit.
    pub wi: [f32; 3],
    /// What the throughput was multiplied by.
    pub throughput: [f32; 3],
    /// Density of `wi` given `wo`, over solid angle.
    pub pdf: f32,
    /// Density of `wo` given `wi`, over solid angle.
    pub pdf_reverse: f32,
}

/// A subpath: where it starts, and its vertices on surfaces.
#[derive(Clone, Debug)]
pub struct Subpath {
    /// On the lens, or where the light subpath leaves.
    pub origin: [f32; 3],
    /// Unit.
    pub direction: [f32; 3],
    /// Throughput on leaving.
    pub beta: [f32; 3],
    /// Camera: density of the ray over solid angle, or over area of the film plane if it is
    /// orthographic. Light: 0.
    pub pdf: f32,
    /// Light: index into the scene's lights; camera: [`NONE`](crate::scene::NONE).
    pub light: u32,
    /// In order; the vertex at `origin` is not among them.
    pub steps: Vec<SubpathVertex>,
}

/// What became of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It reaches from the camera to a light; only a visibility ray can still take its light away.
    Whole,
    /// The plan has no strategy for this depth.
    NoStrategy,
    /// A ray of the subpath hit nothing.
    Missed(Side),
    /// A BSDF or the sides of a surface let nothing through.
    Absorbed(Side),
    /// `s = 0`, and the last vertex is not on a light.
    Dark,
    /// The endpoint is of a delta BSDF, which cannot be joined.
    Delta(Side),
    /// The light sends nothing that way.
    Unlit,
    /// `t = 1`, and the camera does not see the endpoint.
    OutOfView,
    /// Both endpoints are in one place.
    Coincident,
    /// The camera's ray comes through no lens.
    Blocked,
}

impl fmt::Display for Fate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |side: &Side| match side {
            Side::Camera => "camera",
            Side::Light => "light",
        };
        match self {
            Fate::Whole => write!(f, "reaches from the camera to a light"),
            Fate::NoStrategy => write!(f, "no strategy can carry light at this depth"),
            Fate::Missed(side) => write!(f, "the {} subpath leaves the scene", name(side)),
            Fate::Absorbed(side) => {
                write!(
                    f,
                    "the {} subpath is absorbed at its last vertex",
                    name(side)
                )
            }
            Fate::Dark => write!(f, "the camera subpath ends on a surface that is no light"),
            Fate::Delta(side) => write!(
                f,
                "the {} subpath ends on a delta BSDF, which cannot be joined",
                name(side)
            ),
            Fate::Unlit => write!(f, "the light sends nothing that way"),
            Fate::OutOfView => write!(
                f,
                "the light subpath's endpoint is out of the camera's view"
            ),
            Fate::Coincident => write!(f, "both subpaths end in one place"),
            Fate::Blocked => write!(f, "the camera's ray comes through no lens"),
        }
    }
}

/// How a path meets a light.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// Where on the light.
    pub end: End,
    /// MIS weight.
    pub weight: f32,
    /// Contribution, choice of strategy included, before visibility.
    pub rgb: [f32; 3],
}

/// The wavelength of a path.
#[derive(Clone, Copy, Debug)]
pub struct Chosen {
    /// As the renderer has it.
    pub single: Wavelength,
    /// The colour, in `f64`.
    pub colour_f64: V,
}

/// A path from its primary samples.
#[derive(Clone, Debug)]
pub struct Walk {
    /// Light vertices of the strategy.
    pub s: u32,
    /// Camera vertices.
    pub t: u32,
    /// Strategies that the depth chooses among.
    pub choices: usize,
    /// If the scene has dispersion.
    pub wavelength: Option<Chosen>,
    /// One over the probability of the strategy; 0 if there is none.
    pub factor: f32,
    /// `None` if `t = 1`.
    pub camera: Option<Subpath>,
    /// `None` if `s < 2`.
    pub light: Option<Subpath>,
    /// How far it came.
    pub fate: Fate,
    /// One, if the path is whole; one for each environment if a camera subpath has left a scene
    /// with several.
    pub meetings: Vec<Meeting>,
    /// Where the path meets the lens if `t = 1`.
    pub lens: [f32; 3],
    /// Raster position it contributes to, in pixels.
    pub raster: [f32; 2],
    /// Of the joined vertices; `None` if no ray asked: nothing is joined, or the contribution is
    /// zero anyway.
    pub visible: Option<bool>,
    /// As in [`Splat`](crate::transport::Splat).
    pub rgb: [f32; 3],
    /// As in [`Splat`](crate::transport::Splat): the contribution was replaced by 0.
    pub rejected: bool,
}

impl Walk {
    /// The path or, in a scene with several environments, paths, to the light they meet; visible or
    /// not.
    pub fn paths(&self) -> impl Iterator<Item = Path> + '_ {
        let camera = self.camera.as_ref();
        let seen = camera.map_or(&[][..], |c| &c.steps[..]);
        // The vertex on an area light hit by chance is the end, not a scattering event.
        let on_light = |m: &Meeting| self.s == 0 && matches!(m.end, End::Area { .. });
        let lit = self.light.as_ref().map_or(&[][..], |l| &l.steps[..]);
        self.meetings.iter().map(move |m| {
            let seen = &seen[..seen.len() - usize::from(on_light(m) && !seen.is_empty())];
            let steps = seen.iter().chain(lit.iter().rev());
            let surface: Vec<PathVertex> = steps.map(|s| s.vertex.clone()).collect();
            Path {
                colour: self.colour_of(&surface),
                s: self.s,
                camera: wide(camera.map_or(self.lens, |c| c.origin)),
                surface,
                end: m.end,
            }
        })
    }

    /// The colour of light scattered at these vertices, in `f64`.
    pub(super) fn colour_of(&self, surface: &[PathVertex]) -> V {
        match &self.wavelength {
            Some(w) if surface.iter().any(|v| v.dispersive) => w.colour_f64,
            _ => [1.0; 3],
        }
    }

    /// The path, if there is one and nothing blocks it. Paths of which nobody asked whether they
    /// are blocked count as visible: they carry nothing, or have met their light.
    pub fn path(&self) -> Option<Path> {
        self.paths().next().filter(|_| self.visible != Some(false))
    }
}
