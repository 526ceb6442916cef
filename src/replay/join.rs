//! The last step of a recorded path, in `f32`: it meets a light, or its tips are joined; contribution, MIS weight, visibility.

use super::Recorder;
use super::path::End;
use super::vector::wide;
use super::walk::{Fate, Flight, Meeting, Tip, Walk, reversed};
use crate::light::Kind;
use crate::scene::NONE;
use crate::simd::{Row, Vec3};
use crate::transport::cutout::Through;
use crate::transport::mis;
use crate::transport::paths::Side;

/// A BSDF along the link between two tips.
struct Value {
    /// `f` and its cosine.
    f: Vec3<f32>,
    pdf: f32,
    pdf_reverse: f32,
    /// Against the geometric normal.
    cos: f32,
}

impl Recorder<'_> {
    /// `s = 0`: the camera tip may be on a light.
    pub(super) fn meet(&self, walk: &mut Walk) -> Fate {
        let Some(tip) = walk.camera.as_ref().and_then(|c| c.steps.last()) else {
            return Fate::Dark;
        };
        let light = tip.vertex.light;
        if light == NONE {
            return Fate::Dark;
        }
        let (p, surface) = (tip.vertex.p, tip.vertex.surface);
        let tip = Tip::lit(tip);
        let cos = tip.wo.dot(tip.ng);
        let lights = &self.world.lights;
        let seen = lights.emitted::<f32>(&self.world.geometry, &[light], tip.p, cos, surface);
        let weight = (tip.partial).weight_hit(seen.direct_pdf, seen.emission_pdf);
        let rgb = tip.beta.mul_elem(seen.radiance) * (weight * walk.factor);
        let rgb = walk.coloured(rgb, true);
        walk.meetings.push(Meeting {
            end: End::Area { light, p },
            weight,
            rgb: rgb.lane(0),
        });
        Fate::Whole
    }

    /// `s = 0`: the camera subpath has left the scene.
    pub(super) fn escape(&self, flight: Flight, walk: &mut Walk) -> Fate {
        let direction = Vec3::splat(flight.direction);
        for &light in &self.world.lights.infinite {
            let seen = self.world.lights.escaped::<f32>(light, direction);
            let weight = (flight.partial).weight_hit(seen.direct_pdf, seen.emission_pdf);
            let rgb = Vec3::splat(flight.beta).mul_elem(seen.radiance) * (weight * walk.factor);
            let rgb = walk.coloured(rgb, false);
            walk.meetings.push(Meeting {
                end: End::Sky {
                    light,
                    direction: wide(flight.direction),
                },
                weight,
                rgb: rgb.lane(0),
            });
        }
        if walk.meetings.is_empty() {
            return Fate::Missed(Side::Camera);
        }
        Fate::Whole
    }

    /// `s = 1`.
    pub(super) fn join_light(&self, light: u32, u: [f32; 2], walk: &mut Walk) -> Fate {
        let Some(step) = walk.camera.as_ref().and_then(|c| c.steps.last()) else {
            return Fate::Absorbed(Side::Camera);
        };
        let tip = Tip::of(step);
        let lights = &self.world.lights;
        let seen = lights.sample_direct::<f32>(&self.world.geometry, &[light], tip.p, u);
        if !seen.valid || self.world.emits(&[light], u) & 1 == 0 {
            return Fate::Unlit;
        }
        let w = seen.to_light;
        let value = self.value(&step.vertex.kind, &step.vertex.row, &tip, w, Side::Camera);
        let weight = (tip.partial).weight_direct(
            value.pdf,
            value.pdf_reverse,
            value.cos,
            seen.pdf,
            seen.emission_ratio,
            !seen.delta,
        );
        let scale = weight * walk.factor / seen.pdf;
        let rgb = tip.beta.mul_elem(value.f).mul_elem(seen.radiance) * scale;
        let end = match lights.kind(light) {
            kind if kind.is_area() => End::Area {
                light,
                p: self.on_light(light, wide(seen.target.lane(0))),
            },
            kind if kind.is_point() => End::Point { light },
            Kind::Distant => End::Distant { light },
            _ => End::Sky {
                light,
                direction: wide(w.lane(0)),
            },
        };
        self.see(tip.offset(w), seen.target, end, weight, rgb, walk)
    }

    /// `t = 1`.
    pub(super) fn join_lens(&self, lens: (f32, f32), walk: &mut Walk) -> Fate {
        let Some(step) = walk.light.as_ref().and_then(|l| l.steps.last()) else {
            return Fate::Absorbed(Side::Light);
        };
        let tip = Tip::of(step);
        let link = self.world.camera.connect::<f32, false>(tip.p, lens);
        walk.raster = [link.raster.0, link.raster.1];
        if !link.valid {
            return Fate::OutOfView;
        }
        walk.lens = link.origin.lane(0);
        // As the renderer turns it, twice.
        let w = -(-link.to_camera);
        let value = self.value(&step.vertex.kind, &step.vertex.row, &tip, w, Side::Light);
        let weight = (tip.partial).weight_camera(link.pdf * value.cos, value.pdf_reverse);
        let rgb = tip.beta.mul_elem(value.f) * (link.pdf * weight * walk.factor);
        let end = self.origin_of(walk);
        self.see(
            tip.offset(link.to_camera),
            link.origin,
            end,
            weight,
            rgb,
            walk,
        )
    }

    /// `s, t >= 2`.
    pub(super) fn join_tips(&self, walk: &mut Walk) -> Fate {
        let tip_of = |side: &Option<super::walk::Subpath>| {
            side.as_ref().and_then(|s| s.steps.last().cloned())
        };
        let (Some(a), Some(b)) = (tip_of(&walk.camera), tip_of(&walk.light)) else {
            return Fate::Absorbed(Side::Light);
        };
        let (camera, light) = (Tip::of(&a), Tip::of(&b));
        let v = light.p - camera.p;
        let d2 = v.length2();
        let w = v * (1.0 / d2.sqrt());
        if d2 <= f32::MIN_POSITIVE || d2.is_nan() {
            return Fate::Coincident;
        }
        let values = [
            self.value(&a.vertex.kind, &a.vertex.row, &camera, w, Side::Camera),
            self.value(&b.vertex.kind, &b.vertex.row, &light, -w, Side::Light),
        ];
        let inv_d2 = 1.0 / d2;
        let side = |tip: &Tip, value: &Value| mis::Side {
            partial: tip.partial,
            pdf: value.pdf,
            pdf_reverse: value.pdf_reverse,
            cos: value.cos,
        };
        let weight = mis::weight_connect(
            &side(&camera, &values[0]),
            &side(&light, &values[1]),
            inv_d2,
        );
        let f = |tip: &Tip, value: &Value| tip.beta.mul_elem(value.f);
        let rgb = f(&camera, &values[0]).mul_elem(f(&light, &values[1]))
            * (inv_d2 * weight * walk.factor);
        let end = self.origin_of(walk);
        self.see(camera.offset(w), light.offset(-w), end, weight, rgb, walk)
    }

    fn value(
        &self,
        kind: &crate::surface::Kind,
        row: &[f32; 8],
        tip: &Tip,
        wi: Vec3<f32>,
        side: Side,
    ) -> Value {
        let surface = tip.surface(self.world.sides, row);
        let value = surface.eval(*kind, [tip.wo, wi], side.mode());
        let wi_ng = wi.dot(tip.ng);
        let cos = match side {
            Side::Camera => wi.dot(tip.ns).abs(),
            Side::Light => mis::adjoint_cosine(wi_ng, tip.wo.dot(tip.ns), tip.wo.dot(tip.ng)),
        };
        Value {
            f: value.f * cos,
            pdf: value.pdf,
            pdf_reverse: value.pdf_reverse,
            cos: wi_ng.abs(),
        }
    }

    /// The light vertex that the light subpath started from.
    fn origin_of(&self, walk: &Walk) -> End {
        let (light, origin, direction) = walk.light.as_ref().map_or((0, [0.0; 3], [0.0; 3]), |l| {
            (l.light, l.origin, l.direction)
        });
        match self.world.lights.kind(light) {
            kind if kind.is_area() => End::Area {
                light,
                p: self.on_light(light, wide(origin)),
            },
            kind if kind.is_point() => End::Point { light },
            Kind::Distant => End::Distant { light },
            _ => End::Sky {
                light,
                direction: reversed(direction),
            },
        }
    }

    /// Asks whether the joined vertices see each other, if anything depends on it.
    fn see(
        &self,
        from: Vec3<f32>,
        to: Vec3<f32>,
        end: End,
        weight: f32,
        rgb: Vec3<f32>,
        walk: &mut Walk,
    ) -> Fate {
        let rgb = walk.coloured(rgb, false).lane(0);
        if rgb != [0.0; 3] {
            let (o, d) = (from.lane(0), (to - from).lane(0));
            let ray = [Row([o[0], o[1], o[2], 1.0, d[0], d[1], d[2], 0.0])];
            let (mut blocked, mut hit) = ([0], [Row::default()]);
            let mut through = Through::default();
            (self.world).occluded::<f32>(&ray, &[0], &mut blocked, &mut hit, &mut through);
            walk.visible = Some(blocked[0] == 0);
        }
        walk.meetings.push(Meeting { end, weight, rgb });
        Fate::Whole
    }

    /// Sums what arrives; contributions that are not finite, or negative, are replaced by 0.
    pub(super) fn settle(&self, walk: &mut Walk) {
        for m in &walk.meetings {
            // What no ray was traced for adds nothing.
            let arrives = walk.visible != Some(false) && (walk.s == 0 || walk.visible.is_some());
            for c in 0..3 {
                walk.rgb[c] += if arrives { m.rgb[c] } else { 0.0 };
            }
        }
        if !(walk.rgb.iter()).all(|v| (0.0..=f32::MAX).contains(v)) {
            walk.rgb = [0.0; 3];
            walk.rejected = true;
        }
    }
}
