//! One method per group of directives: reads its arguments and changes the state or adds to the scene.

use std::cell::Cell;
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use glam::{DAffine3, DMat4, DVec3};

use super::color::ColorSpace;
use super::dialect::Dialect;
use super::error::{Report, SceneError, Site};
use super::folder::Folder;
use super::geometry::{Geometry, Setting};
use super::lexer::{Token, TokenKind};
use super::lights::{self, AreaLight, WorldLight};
use super::materials::{Built, PartMaterial};
use super::params::ParamSet;
use super::shape::{self, Cut};
use super::state::{Block, CurrentMaterial, MaterialDef, StateStack};
use super::stream::{Item, TokenStream};
use super::textures::{self, Class, NAME_BYTES, Tables};
use super::tolerance::{knows_light, knows_material, knows_shape, makes_texture};
use super::transform::Place;
use super::{coats, materials, options, transform};
use crate::pbrt::budget::{Budget, Charge};
use crate::scene::{Alpha, Bump, Component, Material, MaterialKind, NONE, Param};
use crate::surface::ThinDielectricMaterial;

/// Instances are copies; beyond this many bytes that is worth a word.
const NOTABLE_INSTANCE_BYTES: usize = 256 << 20;

/// Memory of a material in the scene's table, which grows by doubling, with the parts that a mixture has.
const MATERIAL_BYTES: u64 = 2 * size_of::<Material>() as u64 + 4 * size_of::<Component>() as u64;

/// A directive whose meaning depends on others that may follow it.
#[derive(Debug)]
pub(super) struct Pending {
    pub kind: String,
    pub set: ParamSet,
    pub ctm: DAffine3,
}

/// The directives of which the last one counts.
#[derive(Debug, Default)]
pub(super) struct View {
    pub camera: Option<Pending>,
    pub film: Option<Pending>,
    pub filter: Option<Pending>,
    pub sampler: Option<Pending>,
    pub integrator: Option<Pending>,
}

#[derive(Debug)]
struct Object {
    name: String,
    geometry: Geometry,
    warned_of_light: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Section {
    Options,
    World,
    End,
}

#[derive(Debug)]
pub(super) struct Loader {
    pub(super) stream: TokenStream,
    pub dialect: Dialect,
    pub dir: Rc<Folder>,
    states: StateStack,
    pub(super) section: Section,
    coordinate_systems: HashMap<String, [DMat4; 2]>,
    /// Media that a `MediumInterface` of v3 can name.
    media: HashSet<String>,
    objects: HashMap<String, Rc<Geometry>>,
    open_object: Option<Object>,
    instance_bytes: usize,
    default_material: Option<u32>,
    bare_materials: Vec<(MaterialKind, u32)>,
    /// Of each material in the table, whether it depends on texture coordinates.
    needs_uv: Vec<bool>,
    /// Materials that could not be made, to be mentioned if nothing ever uses them.
    failed_materials: Vec<Rc<MaterialDef>>,
    pub view: View,
    pub geometry: Geometry,
    pub lights: Vec<WorldLight>,
    pub tables: Tables,
    pub report: Report,
    /// Of the random numbers, by `Option`.
    pub seed: Option<u64>,
    budget: Rc<Budget>,
}

impl Loader {
    pub fn new(stream: TokenStream, dialect: Dialect, dir: Rc<Folder>, budget: Rc<Budget>) -> Self {
        Self {
            stream,
            dialect,
            dir,
            states: StateStack::new(),
            section: Section::Options,
            coordinate_systems: HashMap::new(),
            media: HashSet::new(),
            objects: HashMap::new(),
            open_object: None,
            instance_bytes: 0,
            default_material: None,
            bare_materials: Vec::new(),
            needs_uv: Vec::new(),
            failed_materials: Vec::new(),
            view: View::default(),
            geometry: Geometry::new(&budget),
            lights: Vec::new(),
            tables: Tables::new(Rc::clone(&budget)),
            report: Report::default(),
            seed: None,
            budget,
        }
    }

    /// Interprets the whole scene.
    pub fn run(&mut self, start: &Site) -> Result<(), SceneError> {
        while let Some(item) = self.stream.next()? {
            match item {
                Item::ImportEnd(pos) => self.end(Block::Import, &Site::new(pos, "Import"))?,
                Item::Token(token) if token.kind != TokenKind::Word => {
                    return Err(token.pos().error(format_args!(
                        "expected a directive, found {}",
                        token.shown()
                    )));
                }
                Item::Token(token) => {
                    if self.section == Section::End {
                        let site = Site::new(token.pos(), token.raw());
                        self.report.warn_at(
                            &site,
                            "what follows WorldEnd is ignored; a file holds one picture",
                        );
                        break;
                    }
                    self.directive(&token)?;
                }
            }
        }
        if let Some(open) = self.states.open_block() {
            self.report.warn_at(&open, "has no end");
        }
        if self.section == Section::Options {
            return Err(start.error("the scene has no WorldBegin"));
        }
        for material in std::mem::take(&mut self.failed_materials) {
            if let (Err(error), false) = (&material.built, material.used.get()) {
                self.report.warn(format!("{error} (not used by any shape)"));
            }
        }
        if self.instance_bytes > NOTABLE_INSTANCE_BYTES {
            let megabytes = self.instance_bytes >> 20;
            self.report.warn_at(
                start,
                format_args!("object instances are copies, which take {megabytes} MB here"),
            );
        }
        Ok(())
    }

    fn directive(&mut self, token: &Token) -> Result<(), SceneError> {
        let name = token.raw();
        let site = Site::new(token.pos(), name);
        if self.skip_misplaced(name, &site)? {
            return Ok(());
        }
        match name {
            "Identity" | "Translate" | "Scale" | "Rotate" | "LookAt" | "Transform"
            | "ConcatTransform" | "CoordinateSystem" | "CoordSysTransform" | "ActiveTransform"
            | "TransformTimes" => self.transform(name, &site),
            "ReverseOrientation" => {
                self.in_world(&site)?;
                self.states.current.reverse = !self.states.current.reverse;
                Ok(())
            }
            "AttributeBegin" => self.begin(Block::Attribute, &site),
            "AttributeEnd" => self.end(Block::Attribute, &site),
            "TransformBegin" => self.begin(Block::Transform, &site),
            "TransformEnd" => self.end(Block::Transform, &site),
            "ObjectBegin" | "ObjectEnd" | "ObjectInstance" => self.object(name, &site),
            "Include" | "Import" => self.include(name, &site),
            "WorldBegin" | "WorldEnd" => self.section(name, &site),
            "Camera" | "Film" | "Sampler" | "PixelFilter" | "Integrator" | "Accelerator" => {
                self.option(name, &site)
            }
            "Material" | "MakeNamedMaterial" | "NamedMaterial" => self.material(name, &site),
            "Texture" => self.texture(&site),
            "LightSource" | "AreaLightSource" => self.light(name, &site),
            "Shape" => self.shape(&site),
            "ColorSpace" | "Option" | "Attribute" => self.v4_setting(name, &site),
            "MakeNamedMedium" | "MediumInterface" => self.medium(name, &site),
            "SurfaceIntegrator" | "VolumeIntegrator" | "Volume" | "Renderer" => {
                Err(site.error("is pbrt-v2; use a scene of pbrt-v3 or pbrt-v4"))
            }
            _ => {
                let shown = token.shown();
                Err(site.pos.error(format_args!(
                    "unknown directive {shown}; expected one of pbrt-v3 or pbrt-v4"
                )))
            }
        }
    }

    // Arguments.

    fn argument(&mut self, site: &Site, what: &str) -> Result<Token, SceneError> {
        match self.stream.next_token()? {
            Some(token) => Ok(token),
            None => Err(site.error(format_args!("the file ends where {what} was expected"))),
        }
    }

    fn quoted(&mut self, site: &Site, what: &str) -> Result<String, SceneError> {
        let token = self.argument(site, what)?;
        if token.kind != TokenKind::Quoted {
            let site = Site::new(token.pos(), &site.label);
            return Err(site.error(format_args!(
                "expected {what} in quotes, found {}",
                token.shown()
            )));
        }
        Ok(token.text().into_owned())
    }

    /// `N` numbers, with or without brackets.
    fn numbers<const N: usize>(&mut self, site: &Site) -> Result<[f64; N], SceneError> {
        let bracketed = self
            .stream
            .peek()?
            .is_some_and(|t| t.kind == TokenKind::Open);
        if bracketed {
            self.stream.next_token()?;
        }
        let mut out = [0.0; N];
        for x in &mut out {
            let token = self.argument(site, "a number")?;
            *x = token.number().map_err(|_| {
                let site = Site::new(token.pos(), &site.label);
                site.error(format_args!(
                    "expected {N} numbers, found {}",
                    token.shown()
                ))
            })?;
        }
        if bracketed {
            let token = self.argument(site, "']'")?;
            if token.kind != TokenKind::Close {
                let site = Site::new(token.pos(), &site.label);
                return Err(site.error(format_args!(
                    "expected ']' after {N} numbers, found {}",
                    token.shown()
                )));
            }
        }
        Ok(out)
    }

    fn params(&mut self, site: Site) -> Result<ParamSet, SceneError> {
        let color_space = self.states.current.color_space;
        ParamSet::read(
            &mut self.stream,
            site,
            self.dialect,
            Rc::clone(&self.dir),
            color_space,
            &mut self.report,
        )
    }

    /// `"kind"` and its parameters, with the defaults that `Attribute` set for `target`.
    fn kind_and_params(
        &mut self,
        site: &Site,
        target: &str,
    ) -> Result<(String, ParamSet), SceneError> {
        let kind = self.quoted(site, "a type")?;
        let mut set = self.params(Site::new(
            site.pos.clone(),
            format!("{} \"{kind}\"", site.label),
        ))?;
        if let Some(defaults) = self.states.current.attributes.get(target) {
            set.add_defaults(defaults)?;
        }
        Ok((kind, set))
    }

    /// An error in v4; v3 ignores the directive.
    fn tolerate(&mut self, site: &Site, what: &str) -> Result<(), SceneError> {
        if self.dialect == Dialect::V4 {
            return Err(site.error(what));
        }
        self.report.warn_at(site, format_args!("ignored: {what}"));
        Ok(())
    }

    fn in_world(&self, site: &Site) -> Result<(), SceneError> {
        match self.section {
            Section::Options => Err(site.error("belongs after WorldBegin")),
            _ => Ok(()),
        }
    }

    fn in_options(&self, site: &Site) -> Result<(), SceneError> {
        match self.section {
            Section::Options => Ok(()),
            _ => Err(site.error("belongs before WorldBegin")),
        }
    }

    // Transforms and blocks.

    fn transform(&mut self, name: &str, site: &Site) -> Result<(), SceneError> {
        let change = match name {
            "Identity" => {
                return self.states.current.change(site, |_| DMat4::IDENTITY);
            }
            "Translate" => DMat4::from_translation(DVec3::from(self.numbers::<3>(site)?)),
            "Scale" => DMat4::from_scale(DVec3::from(self.numbers::<3>(site)?)),
            "Rotate" => {
                let [degrees, x, y, z] = self.numbers(site)?;
                transform::rotate(degrees, DVec3::new(x, y, z))
                    .ok_or_else(|| site.error("its axis is zero; use for instance 0 0 1"))?
                    .into()
            }
            "LookAt" => self.look_at(site)?.into(),
            "Transform" | "ConcatTransform" => {
                let m = transform::from_numbers(&self.numbers(site)?);
                if name == "Transform" {
                    return self.states.current.change(site, |_| m);
                }
                m
            }
            "CoordinateSystem" => {
                let name = self.quoted(site, "a name")?;
                if !self.coordinate_systems.contains_key(&name) {
                    let bytes = NAME_BYTES
                        + (name.len() + 2 * size_of_val(&self.states.current.ctm)) as u64;
                    self.budget.take(bytes).map_err(|e| site.error(e))?;
                }
                self.coordinate_systems
                    .insert(name, self.states.current.ctm);
                return Ok(());
            }
            "CoordSysTransform" => {
                let name = self.quoted(site, "a name")?;
                match self.coordinate_systems.get(&name) {
                    Some(ctm) => self.states.current.ctm = *ctm,
                    None => self.report.warn_at(
                        site,
                        format_args!("ignored: there is no coordinate system named \"{name}\""),
                    ),
                }
                return Ok(());
            }
            "ActiveTransform" => {
                let token = self.argument(site, "StartTime, EndTime or All")?;
                self.states.current.active = match token.raw() {
                    "StartTime" => [true, false],
                    "EndTime" => [false, true],
                    "All" => [true, true],
                    _ => {
                        return Err(site.error(format_args!(
                            "expected StartTime, EndTime or All, found {}",
                            token.shown()
                        )));
                    }
                };
                return Ok(());
            }
            _ => {
                // TransformTimes: of no consequence while nothing moves.
                self.in_options(site)?;
                self.numbers::<2>(site)?;
                return Ok(());
            }
        };
        self.states.current.change(site, |ctm| ctm * change)
    }

    fn look_at(&mut self, site: &Site) -> Result<DAffine3, SceneError> {
        let n: [f64; 9] = self.numbers(site)?;
        let v = |i: usize| DVec3::new(n[i], n[i + 1], n[i + 2]);
        if let Some(view) = transform::look_at(v(0), v(3), v(6)) {
            return Ok(view);
        }
        let parallel = v(0) != v(3) && v(6) != DVec3::ZERO;
        if self.dialect == Dialect::V3 && parallel {
            self.report.warn_at(
                site,
                "ignored: its up vector is along the view, which tells nothing of what is up",
            );
            return Ok(DAffine3::IDENTITY);
        }
        Err(site
            .error("the eye is the point looked at, or the up vector is zero or along the view"))
    }

    fn begin(&mut self, block: Block, site: &Site) -> Result<(), SceneError> {
        if block != Block::Transform {
            self.in_world(site)?;
        }
        self.states.begin(block, self.dialect, site)
    }

    fn end(&mut self, block: Block, site: &Site) -> Result<(), SceneError> {
        self.states.end(block, self.dialect, site, &mut self.report)
    }

    fn begin_object(&mut self, site: &Site) -> Result<(), SceneError> {
        let name = self.quoted(site, "a name")?;
        if let Some(open) = &self.open_object {
            let what = format!(
                "object \"{}\" is still open; objects do not nest",
                open.name
            );
            if self.dialect == Dialect::V4 {
                return Err(site.error(what));
            }
            self.report
                .warn_at(site, format_args!("{what}: it ends here"));
            self.close_object(site);
        }
        self.begin(Block::Object, site)?;
        let bytes = NAME_BYTES + 2 * name.len() as u64;
        self.budget.take(bytes).map_err(|e| site.error(e))?;
        self.open_object = Some(Object {
            name,
            geometry: Geometry::new(&self.budget),
            warned_of_light: false,
        });
        Ok(())
    }

    /// The object that is open can be placed from here on.
    fn close_object(&mut self, site: &Site) {
        let Some(object) = self.open_object.take() else {
            return;
        };
        let geometry = Rc::new(object.geometry);
        if self.objects.insert(object.name.clone(), geometry).is_some() {
            self.report.warn_at(
                site,
                format_args!("object \"{}\" replaces an earlier one", object.name),
            );
        }
    }

    fn place_object(&mut self, site: &Site) -> Result<(), SceneError> {
        let name = self.quoted(site, "a name")?;
        let known = self.objects.get(&name);
        let what = match known {
            _ if self.open_object.is_some() => {
                "objects cannot hold instances; repeat the shapes".to_owned()
            }
            None => format!("there is no object named \"{name}\""),
            Some(object) => {
                let place = self.states.current.fixed_ctm(site)?;
                let Some(by) = place.affine() else {
                    return Err(site.error(
                        "the current transform is projective; place the shapes themselves",
                    ));
                };
                self.geometry.add_instance(site, object, by)?;
                self.instance_bytes = self.instance_bytes.saturating_add(object.bytes());
                return Ok(());
            }
        };
        self.tolerate(site, &what)
    }

    fn object(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        self.in_world(site)?;
        match directive {
            "ObjectBegin" => self.begin_object(site),
            "ObjectEnd" => {
                if self.dialect == Dialect::V3 && self.open_object.is_none() {
                    self.report
                        .warn_at(site, "there is no object that ends here");
                }
                self.end(Block::Object, site)?;
                self.close_object(site);
                Ok(())
            }
            _ => self.place_object(site),
        }
    }

    fn include(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        let name = self.quoted(site, "a file name")?;
        let path = self.dir.join(&name);
        let import = (directive == "Import").then(|| site.pos.clone());
        if import.is_some() {
            self.begin(Block::Import, site)?;
        }
        if self.dialect == Dialect::V3 && !path.exists() {
            self.report.warn_at(
                site,
                format_args!("ignored: there is no file {}", path.display()),
            );
            return Ok(());
        }
        self.stream
            .include(&path, import)
            .map_err(|e| site.error(e))
    }

    fn section(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        if directive == "WorldEnd" {
            self.in_world(site)?;
            match self.dialect {
                Dialect::V3 => self.section = Section::End,
                Dialect::V4 => self
                    .report
                    .warn_at(site, "pbrt-v4 scenes have no WorldEnd; ignored"),
            }
            return Ok(());
        }
        self.in_options(site)?;
        self.section = Section::World;
        self.states.current.ctm = [DMat4::IDENTITY; 2];
        self.states.current.active = [true; 2];
        self.coordinate_systems
            .insert("world".to_owned(), self.states.current.ctm);
        Ok(())
    }

    // What is rendered how.

    fn option(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        self.in_options(site)?;
        let (kind, set) = self.kind_and_params(site, "option")?;
        let mut ctm = DAffine3::IDENTITY;
        if directive == "Camera" {
            let collapsed =
                || set.error("the current transform collapses space, so there is no view of it");
            let place = self.states.current.fixed_ctm(&set.site)?;
            let to_world = match place {
                Place::Affine(t) => transform::inverse(&t).ok_or_else(collapsed)?.into(),
                Place::Projective(m) => m.inverse(),
            };
            ctm = match place {
                Place::Affine(t) => t,
                Place::Projective(_) => {
                    let view = Place::of(&to_world).frame();
                    view.and_then(|t| transform::inverse(&t))
                        .ok_or_else(collapsed)?
                }
            };
            self.coordinate_systems
                .insert("camera".to_owned(), [to_world; 2]);
        }
        let pending = Some(Pending { kind, set, ctm });
        match directive {
            "Camera" => self.view.camera = pending,
            "Film" => self.view.film = pending,
            "Sampler" => self.view.sampler = pending,
            "PixelFilter" => self.view.filter = pending,
            "Integrator" => self.view.integrator = pending,
            // How rays are traced is our own affair.
            _ => {}
        }
        Ok(())
    }

    fn v4_setting(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        match directive {
            "ColorSpace" => {
                let name = self.quoted(site, "a name")?;
                let Some(space) = ColorSpace::parse(&name) else {
                    self.report.warn_at(
                        site,
                        format_args!(
                            "ignored: \"{name}\" is unknown; use srgb, dci-p3, rec2020 or aces2065-1"
                        ),
                    );
                    return Ok(());
                };
                self.states.current.color_space = space;
                Ok(())
            }
            "Option" => self.global_option(site),
            _ => {
                let (target, mut set) = self.kind_and_params(site, "")?;
                if !["shape", "light", "material", "medium", "texture"].contains(&target.as_str()) {
                    return Err(site.error(format_args!(
                        "\"{target}\" is unknown; use shape, light, material, medium or texture"
                    )));
                }
                let attributes = Rc::make_mut(&mut self.states.current.attributes);
                if let Some(earlier) = attributes.get(&target) {
                    set.add_defaults(earlier)?;
                }
                attributes.insert(target, set);
                Ok(())
            }
        }
    }

    /// `Option "name" value`; also `"type name"`, and with brackets.
    fn global_option(&mut self, site: &Site) -> Result<(), SceneError> {
        let name = self.quoted(site, "the name of an option")?;
        let mut token = self.argument(site, "the value of an option")?;
        if token.kind == TokenKind::Open {
            token = self.argument(site, "the value of an option")?;
            let close = self.argument(site, "']'")?;
            if close.kind != TokenKind::Close {
                return Err(site.error(format_args!("expected ']', found {}", close.shown())));
            }
        }
        let seed = options::set(&name, &token, site, &mut self.report)?;
        self.seed = seed.or(self.seed);
        Ok(())
    }

    fn medium(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        let mut inside = self.quoted(site, "a name")?;
        if directive == "MakeNamedMedium" {
            // Of consequence only once a MediumInterface names it.
            let set = self.params(site.clone())?;
            if matches!(set.string("type")?, Some("homogeneous" | "heterogeneous")) {
                self.media.insert(inside);
            }
            return Ok(());
        }
        let mut outside = String::new();
        if self
            .stream
            .peek()?
            .is_some_and(|t| t.kind == TokenKind::Quoted)
        {
            outside = self.quoted(site, "a name")?;
        }
        if self.dialect == Dialect::V3 {
            for name in [&mut inside, &mut outside] {
                if !name.is_empty() && !self.media.contains(name) {
                    self.report.warn_at(
                        site,
                        format_args!("there is no medium named \"{name}\": none is used"),
                    );
                    name.clear();
                }
            }
        }
        if inside.is_empty() && outside.is_empty() {
            return Ok(());
        }
        Err(site.error("participating media are not supported; remove it, or name no medium: MediumInterface \"\" \"\""))
    }

    // Surfaces and lights.

    fn texture(&mut self, site: &Site) -> Result<(), SceneError> {
        let name = self.quoted(site, "a name")?;
        let class = self.quoted(site, "a type, \"float\" or \"spectrum\"")?;
        let (kind, set) = self.kind_and_params(site, "texture")?;
        let class = match class.as_str() {
            "float" => Class::Float,
            "spectrum" | "color" => Class::Color,
            other => {
                let what = format!("texture type \"{other}\" is unknown; use float or spectrum");
                return self.tolerate(site, &what);
            }
        };
        if self.dialect == Dialect::V3 && !makes_texture(&kind, class == Class::Float) {
            let what = format_args!("left out: pbrt-v3 has no such texture; it is undefined");
            self.report.warn_at(&set.site, what);
            return Ok(());
        }
        let place = self.states.current.start_ctm(&set.site, &mut self.report);
        let ctm = place.affine().copied().ok_or_else(|| {
            set.error("the current transform is projective, which no texture in space can be")
        });
        let names = &mut self.states.current.textures;
        let built = textures::build(
            &kind,
            class,
            &set,
            &ctm,
            names,
            &mut self.tables,
            &mut self.report,
        );
        let known = names.insert(name.clone(), class, built, &self.budget);
        if known.map_err(|e| set.error(e))? {
            self.report.warn_at(
                &set.site,
                format_args!("texture \"{name}\" replaces an earlier one"),
            );
        }
        Ok(())
    }

    fn material(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        match directive {
            "NamedMaterial" => {
                let name = self.quoted(site, "a name")?;
                // v3 looks for it now, v4 where a shape needs it.
                self.states.current.material = match self.dialect {
                    Dialect::V4 => CurrentMaterial::Named(Rc::new(site.clone()), name.into()),
                    Dialect::V3 => match self.states.current.named_materials.get(&name) {
                        Some(made) => CurrentMaterial::Made(Rc::clone(made)),
                        None => {
                            let what = format_args!(
                                "ignored: there is no material named \"{name}\" yet; the one before stays"
                            );
                            self.report.warn_at(site, what);
                            return Ok(());
                        }
                    },
                };
            }
            "Material" => {
                let (kind, set) = self.kind_and_params(site, "material")?;
                let name = kind.clone();
                let made = self.make_material(name, kind, set)?;
                self.states.current.material = CurrentMaterial::Made(made);
            }
            _ => {
                let (name, mut set) = self.kind_and_params(site, "material")?;
                let kind = match set.string("type")?.map(str::to_owned) {
                    Some(kind) => kind,
                    None if self.dialect == Dialect::V3 => {
                        let what = "has no \"string type\": rays pass through, as of \"none\"";
                        self.report.warn_at(&set.site, what);
                        String::new()
                    }
                    None => return Err(set.error("needs a \"string type\"")),
                };
                let label = format!("{} of type \"{kind}\"", set.site.label);
                set.site = Site::new(set.site.pos, label);
                let made = self.make_material(name.clone(), kind, set)?;
                let names = &mut self.states.current.named_materials;
                let known = names.contains_key(&name);
                names.insert_mut(name.clone(), made);
                if known {
                    self.report.warn_at(
                        site,
                        format_args!("material \"{name}\" replaces an earlier one"),
                    );
                }
            }
        }
        Ok(())
    }

    fn make_material(
        &mut self,
        name: String,
        mut kind: String,
        set: ParamSet,
    ) -> Result<Rc<MaterialDef>, SceneError> {
        if self.dialect == Dialect::V3 && !knows_material(&kind) {
            self.report.warn_at(
                &set.site,
                format_args!("material \"{kind}\" is unknown: \"matte\" is used"),
            );
            kind = "matte".to_owned();
        }
        let built = self.build_material(&kind, &set);
        let own = match &built {
            Ok((built, _)) => built.bytes(),
            Err(error) => error.0.len(),
        };
        let texts = 2 * name.len() + kind.len() + set.site.label.len() + own;
        let bytes = NAME_BYTES + (size_of::<MaterialDef>() + texts) as u64;
        let room = Charge::of(&self.budget, bytes).map_err(|e| set.error(e))?;
        if built.is_ok() {
            set.finish(&mut self.report);
        }
        let failed = built.is_err();
        let made = Rc::new(MaterialDef {
            name,
            kind,
            set,
            built,
            index: Cell::new(None),
            used: Cell::new(false),
            _room: room,
        });
        if failed {
            self.failed_materials.push(Rc::clone(&made));
        }
        Ok(made)
    }

    fn build_material(
        &mut self,
        kind: &str,
        set: &ParamSet,
    ) -> Result<(Built, Option<Bump>), SceneError> {
        let state = &self.states.current;
        let names = &state.textures;
        let built = materials::build(kind, set, names, &state.named_materials)?;
        if let Some(site) = coats::undispersed(kind, set)? {
            self.report.warn_at(
                &site,
                "coats do not disperse light: its index of refraction is that of 587.6 nm throughout",
            );
        }
        let bump = match built.first_named() {
            None => materials::bump(kind, set, names, &mut self.tables, &mut self.report)?,
            // v3 adds the lobes of the second material to the BSDF of the first, which has the frame (`MixMaterial`).
            Some(first) if set.dialect == Dialect::V3 => {
                (first.built.as_ref().ok()).and_then(|(_, bump)| *bump)
            }
            // v4 chooses a material, and shades as that one does.
            Some(_) => None,
        };
        Ok((built, bump))
    }

    /// Index of the current material for a shape with these parameters.
    fn material_for(&mut self, shape: &ParamSet) -> Result<u32, SceneError> {
        let made = match &self.states.current.material {
            CurrentMaterial::Default => {
                if let (Some(index), false) = (self.default_material, materials::overrides(shape)) {
                    return Ok(index);
                }
                let kind = if self.dialect == Dialect::V3 {
                    "matte"
                } else {
                    "diffuse"
                };
                let set = ParamSet::empty(shape.site.clone(), self.dialect, Rc::clone(&self.dir));
                let made = self.make_material("default".to_owned(), kind.to_owned(), set)?;
                if !(self.dialect == Dialect::V3 && materials::overrides(shape)) {
                    let index = self.add_material(&made, &made.built.clone()?)?;
                    self.default_material = Some(index);
                    return Ok(index);
                }
                made
            }
            CurrentMaterial::Made(made) => Rc::clone(made),
            CurrentMaterial::Named(site, name) => {
                match self.states.current.named_materials.get(&**name) {
                    Some(made) => Rc::clone(made),
                    None => {
                        return Err(site.error(format_args!(
                            "there is no material named \"{name}\"; make it with MakeNamedMaterial"
                        )));
                    }
                }
            }
        };
        made.used.set(true);
        if self.dialect == Dialect::V3 && materials::overrides(shape) {
            let built = self.build_material(&made.kind, &shape.over(&made.set))?;
            if made.built.as_ref() != Ok(&built) {
                return self.add_material(&made, &built);
            }
        }
        self.material_index(&made)
    }

    /// The place of a material in the scene's table, which it takes when it is first asked for.
    fn material_index(&mut self, made: &MaterialDef) -> Result<u32, SceneError> {
        if let Some(index) = made.index.get() {
            return Ok(index);
        }
        made.used.set(true);
        let index = self.add_material(made, &made.built.clone()?)?;
        made.index.set(Some(index));
        Ok(index)
    }

    /// A material of emissive shapes alone: what rays pass straight through, yet meet, or what they do not meet.
    fn bare_material(&mut self, kind: MaterialKind) -> Result<u32, SceneError> {
        let known = self.bare_materials.iter().find(|(k, _)| *k == kind);
        if let Some(&(_, index)) = known {
            return Ok(index);
        }
        let index = self.push_material(Material {
            name: "none".to_owned(),
            origin: "emissive shapes".to_owned(),
            kind: kind.clone(),
            bump: None,
        })?;
        self.bare_materials.push((kind, index));
        Ok(index)
    }

    /// Appends a material to the scene's table, after its components, so that the table has no cycles.
    fn add_material(
        &mut self,
        made: &MaterialDef,
        (built, bump): &(Built, Option<Bump>),
    ) -> Result<u32, SceneError> {
        let material = |kind, bump| Material {
            name: made.name.clone(),
            origin: made.set.site.origin(),
            kind,
            bump,
        };
        let parts = match built {
            Built::One(kind) => {
                return self.push_material(material(kind.clone(), *bump));
            }
            Built::Mixture(parts) => parts,
        };
        let components = parts.iter().map(|part| {
            let index = match &part.material {
                PartMaterial::Own(kind) => self.push_material(material(kind.clone(), *bump))?,
                PartMaterial::Named(named) => match &named.built {
                    // All of v3's mixture is in one shading frame.
                    Ok((built, own)) if self.dialect == Dialect::V3 && own != bump => {
                        named.used.set(true);
                        self.add_material(named, &(built.clone(), *bump))?
                    }
                    _ => self.material_index(named)?,
                },
            };
            Ok(Component {
                material: index,
                weight: part.weight,
                albedo: part.albedo.clone(),
            })
        });
        let components = components.collect::<Result<_, SceneError>>()?;
        self.push_material(material(MaterialKind::Mixture { components }, None))
    }

    fn push_material(&mut self, material: Material) -> Result<u32, SceneError> {
        let own = material.name.len() + material.origin.len() + material.kind.bytes();
        let bytes = MATERIAL_BYTES + own as u64;
        let room = self.budget.take(bytes);
        room.map_err(|e| {
            SceneError::plain(format_args!(
                "{}: material \"{}\": {e}",
                material.origin, material.name
            ))
        })?;
        let below = |i: u32| self.needs_uv[i as usize];
        let needs_uv = material.kind.needs_uv(self.tables.textures(), &below);
        self.needs_uv.push(needs_uv || material.bump.is_some());
        self.tables.materials.push(material);
        Ok(self.tables.materials.len() as u32 - 1)
    }

    /// Whether turning the tangents of a surface around its normal changes what it looks like.
    fn sees_tangents(&self, material: u32) -> bool {
        let made = &self.tables.materials[material as usize];
        let below = || made.kind.components().iter().map(|c| c.material);
        made.bump.is_some()
            || made.kind.is_anisotropic()
            || below().any(|part| self.sees_tangents(part))
    }

    /// Index of a cut-out; shapes that follow each other mostly share one.
    fn add_alpha(&mut self, alpha: Alpha) -> u32 {
        let alphas = &mut self.tables.alphas;
        if alphas.last() != Some(&alpha) {
            alphas.push(alpha);
        }
        alphas.len() as u32 - 1
    }

    fn light(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        self.in_world(site)?;
        let (kind, set) = self.kind_and_params(site, "light")?;
        let area = directive == "AreaLightSource";
        let known = match directive {
            "AreaLightSource" => matches!(kind.as_str(), "area" | "diffuse"),
            _ => knows_light(&kind),
        };
        if self.dialect == Dialect::V3 && !known {
            self.report
                .warn_at(&set.site, "left out: there is no such light");
            if area {
                self.states.current.light = None;
            }
            return Ok(());
        }
        if area {
            let light = AreaLight::build(&kind, set, &mut self.tables, &mut self.report)?;
            self.states.current.light = Some(Rc::new(light));
            return Ok(());
        }
        let place = self.states.current.start_ctm(&set.site, &mut self.report);
        let ctm = place
            .frame()
            .ok_or_else(|| set.error("the current transform collapses space"))?;
        if let Some(light) = lights::build(&kind, &set, &ctm, &mut self.tables, &mut self.report)? {
            let room = self.budget.take(light.bytes());
            room.map_err(|e| set.error(e))?;
            self.lights.push(light);
        }
        Ok(())
    }

    fn shape(&mut self, site: &Site) -> Result<(), SceneError> {
        self.in_world(site)?;
        let (kind, set) = self.kind_and_params(site, "shape")?;
        if self.dialect == Dialect::V3 && !knows_shape(&kind) {
            self.report
                .warn_at(&set.site, "left out: there is no such shape");
            return Ok(());
        }
        let place = self.states.current.fixed_ctm(&set.site)?;
        let mut material = self.material_for(&set)?;
        let mut light = self.states.current.light.clone().filter(|l| !l.is_black());
        let interface = self.tables.materials[material as usize].kind == MaterialKind::Interface;
        if light.is_some() && interface && self.dialect == Dialect::V4 {
            self.report.warn_at(
                &set.site,
                "its area light is ignored, as its material is \"interface\"",
            );
            light = None;
        }
        if let (Some(object), Some(_)) = (&mut self.open_object, &light) {
            light = None;
            if !object.warned_of_light {
                object.warned_of_light = true;
                self.report.warn_at(
                    &set.site,
                    "area lights in objects are ignored, as in pbrt; place the shape itself",
                );
            }
        }
        let cut = shape::alpha(&kind, &set, &self.states.current.textures)?;
        let (visible, alpha) = match cut {
            Cut::Nothing => (true, None),
            Cut::Partly(alpha) => (true, Some(alpha)),
            // It still shines.
            Cut::Everything => (light.is_some(), None),
        };
        if light.is_some() && cut == Cut::Everything {
            material = self.bare_material(MaterialKind::Interface)?;
        } else if light.is_some() && interface {
            // v3 lets rays through such a shape, yet not shadow rays: as a pane that does not reflect.
            self.report.warn_at(
                &set.site,
                "emits although its material is \"none\": a ray that passes through it scatters once for \"maxdepth\"",
            );
            let pane = ThinDielectricMaterial {
                eta: Param::Constant([1.0; 3]),
                dispersion: None,
            };
            material = self.bare_material(pane.into())?;
        }
        let textures = self.tables.textures();
        let textured = |alpha: Alpha| alpha.value.uses_uv(textures);
        let needs_uv = self.needs_uv[material as usize]
            || alpha.is_some_and(textured)
            || light.as_ref().is_some_and(|l| l.image.is_some());
        let setting = Setting {
            site: Rc::new(set.site.clone()),
            place,
            reverse: self.states.current.reverse,
            material,
            alpha: alpha.map_or(NONE, |a| self.add_alpha(a)),
            needs_uv,
            sees_tangents: self.sees_tangents(material),
            light,
        };
        // What is invisible is checked, and left out.
        let mut nowhere = Geometry::new(&self.budget);
        let geometry = match &mut self.open_object {
            _ if !visible => &mut nowhere,
            Some(object) => &mut object.geometry,
            None => &mut self.geometry,
        };
        shape::build(&kind, &set, &setting, geometry, &mut self.report)?;
        set.finish(&mut self.report);
        Ok(())
    }
}
