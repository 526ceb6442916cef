//! `Shape` directives.

use glam::{DVec2, DVec3};

use super::curves;
use super::dialect::Dialect;
use super::error::{Report, SceneError};
use super::geometry::{Geometry, Mesh, Setting};
use super::params::{ParamSet, Type};
use super::quadrics;
use super::textures::{TextureNames, float_param};
use crate::pbrt::mesh::{self, MeshData, Quadric, append_patches, bilinear_mesh_within};
use crate::pbrt::ply::{self, PlyMesh};
use crate::scene::{Alpha, AlphaTest, Param};

/// Each level of subdivision makes four faces of one. Fuzzers get fewer: they would take the time
/// of that many for a hang.
const MAX_SUBDIVIDED_FACES: usize = if cfg!(fuzzing) { 1 << 12 } else { 1 << 26 };

/// Memory that subdivision takes for each face it makes: the last level and the one before, and the
/// mesh made of it, of twice as many faces as vertices.
const SUBDIVIDED_BYTES: u64 = 64;

pub(super) fn build(
    kind: &str,
    set: &ParamSet,
    setting: &Setting,
    geometry: &mut Geometry,
    report: &mut Report,
) -> Result<(), SceneError> {
    set.refuse(
        &["displacement"],
        "displacement is not supported; displace the mesh itself",
    )?;
    // The numbers become vectors and indices, which become a mesh.
    let copies = geometry.room_to_make(2 * set.number_bytes());
    let _copies = copies.map_err(|e| set.error(e))?;
    match kind {
        "trianglemesh" => match triangle_mesh(set, setting, report)? {
            Ok(mesh) => geometry.add_mesh(setting, &mesh, false, report),
            Err(why) => left_out(set, report, &why),
        },
        "plymesh" => {
            let Some(name) = set.string("filename")? else {
                return left_out(set, report, "needs a \"string filename\"");
            };
            set.accept(&["edgelength"]);
            let path = set.dir.join(name);
            let bytes = match ply::bytes_needed(&path) {
                Ok(bytes) => bytes,
                Err(why) => return left_out(set, report, &why),
            };
            let no_room = |e: String| set.error(format_args!("{}: {e}", path.display()));
            let mut room = geometry.room_to_make(bytes).map_err(no_room)?;
            let name = path.file_name().unwrap_or(path.as_os_str());
            let name = name.to_string_lossy().into_owned();
            geometry.loading().set_file(Some(name));
            let mut full = false;
            let mut take = |bytes| room.add(bytes).inspect_err(|_| full = true);
            let read = ply::read_ply_within(&path, &mut take);
            geometry.loading().set_file(None);
            let read = match read {
                Ok(read) => read,
                Err(why) if full => return Err(set.error(why)),
                Err(why) => return left_out(set, report, &why),
            };
            match set.dialect {
                Dialect::V3 => {
                    add_data(read.into_triangles(), set, setting, geometry, false, report)
                }
                Dialect::V4 => with_patches(read, set, setting, geometry, report),
            }
        }
        "sphere" => sphere(set, setting, geometry, report),
        "disk" => disk(set, setting, geometry, report),
        "bilinearmesh" => bilinear(set, setting, geometry, report),
        "loopsubdiv" => subdivision(set, setting, geometry, report),
        "curve" => curve(set, setting, geometry, report),
        "heightfield" | "nurbs" if set.dialect == Dialect::V3 => {
            match quadrics::grid(kind, set, report)? {
                Ok(mesh) => add_data(mesh, set, setting, geometry, false, report),
                Err(why) => left_out(set, report, &why),
            }
        }
        _ => match quadrics::quadric(kind, set)? {
            Some(quadric) => turned(&quadric, set, setting, geometry, report),
            None => Err(set.error(
                "this shape is unknown; use trianglemesh, plymesh, sphere, cylinder, disk, curve, bilinearmesh or loopsubdiv",
            )),
        },
    }
}

/// How much of a shape is cut out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cut {
    Nothing,
    Partly(Alpha),
    Everything,
}

/// What is cut out of a shape of type `kind`. A number in v3 cuts out all (0) or nothing, and only
/// meshes have one.
pub(super) fn alpha(kind: &str, set: &ParamSet, names: &TextureNames) -> Result<Cut, SceneError> {
    let test = match set.dialect {
        Dialect::V3 if !matches!(kind, "trianglemesh" | "plymesh") => return Ok(Cut::Nothing),
        Dialect::V3 => AlphaTest::NotZero,
        Dialect::V4 => AlphaTest::Fraction,
    };
    let cut_of = |param: Option<Param>| match (param, test) {
        (None, _) => Cut::Nothing,
        (Some(Param::Constant([a, ..])), AlphaTest::NotZero) if a != 0.0 => Cut::Nothing,
        (Some(Param::Constant([a, ..])), AlphaTest::Fraction) if a >= 1.0 => Cut::Nothing,
        (Some(Param::Constant([a, ..])), _) if a <= 0.0 => Cut::Everything,
        (Some(value), test) => Cut::Partly(Alpha {
            value,
            test,
            shadow: None,
        }),
    };
    let cut = cut_of(float_param(set, names, "alpha")?);
    if set.dialect == Dialect::V4 {
        set.refuse(
            &["shadowalpha"],
            "is of pbrt-v3; use \"alpha\", which cuts shadows out, too",
        )?;
        return Ok(cut);
    }
    let shadow = match cut_of(float_param(set, names, "shadowalpha")?) {
        Cut::Nothing => return Ok(cut),
        Cut::Everything => Param::Constant([0.0; 3]),
        Cut::Partly(alpha) => alpha.value,
    };
    let alpha = match cut {
        Cut::Partly(alpha) if alpha.value != shadow => alpha,
        Cut::Nothing => Alpha {
            value: Param::Constant([1.0; 3]),
            test,
            shadow: None,
        },
        // Shadows are those of what is there.
        Cut::Everything | Cut::Partly(_) => return Ok(cut),
    };
    if let Some(param) = set.find("shadowalpha") {
        set.note_at(
            param,
            "shadows other than the shape's own: pt is pbrt's picture, bdpt and chains show a mean of what \
             subpaths meet and what they are joined through",
        );
    }
    Ok(Cut::Partly(Alpha {
        shadow: Some(shadow),
        ..alpha
    }))
}

/// A shape that cannot be made: an error, but for v3, which goes on without it.
fn left_out(set: &ParamSet, report: &mut Report, why: &str) -> Result<(), SceneError> {
    if set.dialect == Dialect::V4 {
        return Err(set.error(why));
    }
    leave_out(set, report, why, "pbrt-v3");
    Ok(())
}

/// Goes on without a shape, as `whose` renderer does.
fn leave_out(set: &ParamSet, report: &mut Report, why: &str, whose: &str) {
    let warning = format_args!("{why}; it is left out, as in {whose}");
    report.warn_at(&set.site, warning);
    set.accept_all();
}

/// The mesh, or why there is none.
fn triangle_mesh(
    set: &ParamSet,
    setting: &Setting,
    report: &mut Report,
) -> Result<Result<Mesh, String>, SceneError> {
    let Some(positions) = set.triples("P", Type::Point3)? else {
        return Ok(Err(
            "needs vertex positions, \"point3 P\" (v3: \"point P\")".into(),
        ));
    };
    if positions.len() > u32::MAX as usize / 4 {
        return Err(set.error("has too many vertices"));
    }
    let indices = match set.indices("indices", positions.len())? {
        Some(Ok(indices)) => indices,
        Some(Err(why)) => return Ok(Err(why)),
        None if positions.len() == 3 && set.dialect == Dialect::V4 => vec![0, 1, 2],
        None => return Ok(Err("needs vertex indices, \"integer indices\"".into())),
    };
    let triangles = match groups::<3>(set, &indices, report) {
        Ok(triangles) => triangles,
        Err(why) => return Ok(Err(why)),
    };
    let vertices = positions.len();
    let normals = set.triples("N", Type::Normal)?;
    let normals = one_each(set, "N", normals, vertices, report);
    let tangents = set.triples("S", Type::Vector3)?;
    let tangents = one_each(set, "S", tangents, vertices, report);
    let uvs = texture_coordinates(set, vertices, report)?;
    set.accept(&["faceIndices"]);
    Ok(Ok(Mesh {
        positions,
        normals,
        tangents: tangents.filter(|_| setting.sees_tangents),
        uvs,
        triangles,
    }))
}

/// One a vertex, or none.
fn texture_coordinates(
    set: &ParamSet,
    vertices: usize,
    report: &mut Report,
) -> Result<Option<Vec<DVec2>>, SceneError> {
    let (name, mut uvs) = match set.pairs("uv")? {
        Some(uv) => ("uv", Some(uv)),
        None => ("st", set.pairs("st")?),
    };
    // v3 does not mind more than there are vertices.
    if let (Dialect::V3, Some(uvs)) = (set.dialect, &mut uvs)
        && uvs.len() > vertices
    {
        let what = format!("has {} \"{name}\" for {vertices} vertices", uvs.len());
        report.warn_at(&set.site, format_args!("{what}; the last are not used"));
        uvs.truncate(vertices);
    }
    Ok(one_each(set, name, uvs, vertices, report))
}

/// An array of another length than that of the vertices is left out.
fn one_each<T>(
    set: &ParamSet,
    name: &str,
    array: Option<Vec<T>>,
    vertices: usize,
    report: &mut Report,
) -> Option<Vec<T>> {
    let array = array?;
    if array.len() == vertices {
        return Some(array);
    }
    let what = format!("has {} \"{name}\" for {vertices} vertices", array.len());
    report.warn_at(&set.site, format_args!("{what}; they are left out"));
    None
}

/// Indices by faces; what is left over does not count.
fn groups<const N: usize>(
    set: &ParamSet,
    indices: &[u32],
    report: &mut Report,
) -> Result<Vec<[u32; N]>, String> {
    let (groups, rest) = indices.as_chunks::<N>();
    let what = format!("has {} indices, not a multiple of {N}", indices.len());
    if groups.is_empty() {
        return Err(what);
    }
    if !rest.is_empty() {
        report.warn_at(&set.site, format_args!("{what}; the last are ignored"));
    }
    Ok(groups.to_vec())
}

fn add_data(
    mut data: MeshData,
    set: &ParamSet,
    setting: &Setting,
    geometry: &mut Geometry,
    power_of_whole: bool,
    report: &mut Report,
) -> Result<(), SceneError> {
    for warning in data.warnings.drain(..) {
        report.warn_at(&set.site, warning);
    }
    let mesh = Mesh::from_data(data).map_err(|e| set.error(e))?;
    geometry.add_mesh(setting, &mesh, power_of_whole, report)
}

/// v4: faces of four corners are bilinear patches.
fn with_patches(
    read: PlyMesh,
    set: &ParamSet,
    setting: &Setting,
    geometry: &mut Geometry,
    report: &mut Report,
) -> Result<(), SceneError> {
    let PlyMesh { mut mesh, quads } = read;
    let patches: Vec<_> = quads.iter().map(|&[a, b, c, d]| [a, b, d, c]).collect();
    drop(quads);
    let power = setting.light.as_ref().is_some_and(|l| l.has_power());
    if patches.is_empty() || !power && (mesh.uvs.is_some() || !setting.needs_uv) {
        let mut room = geometry.room_to_make(0).map_err(|e| set.error(e))?;
        append_patches(&mut mesh, &patches, setting.needs_uv, &mut |n| room.add(n))
            .map_err(|e| set.error(e))?;
        mesh.drop_degenerate();
        return add_data(mesh, set, setting, geometry, false, report);
    }
    // Each triangle by itself and each patch by itself have their texture coordinates, and the
    // light's power.
    let (p, n, uv) = (
        &mesh.positions,
        mesh.normals.as_deref(),
        mesh.uvs.as_deref(),
    );
    let mut add = |patches: &[[u32; 4]]| {
        let mut room = geometry.room_to_make(0).map_err(|e| set.error(e))?;
        let corners = patches.as_flattened();
        let data = bilinear_mesh_within(p, n, uv, corners, &mut |n| room.add(n))
            .map_err(|e| set.error(e))?;
        add_data(data, set, setting, geometry, power, report)
    };
    if power {
        (patches.iter()).try_for_each(|patch| add(std::slice::from_ref(patch)))?;
    } else {
        add(&patches)?;
    }
    if mesh.triangles.is_empty() {
        mesh.positions.clear();
    }
    mesh.drop_degenerate();
    add_data(mesh, set, setting, geometry, false, report)
}

fn sphere(
    set: &ParamSet,
    setting: &Setting,
    geometry: &mut Geometry,
    report: &mut Report,
) -> Result<(), SceneError> {
    let radius = set.float_or("radius", 1.0)?;
    if radius <= 0.0 {
        return Err(set.error(format_args!("radius {radius} is not positive")));
    }
    match quadrics::part_of_sphere(set, radius)? {
        Some(part) => turned(&part, set, setting, geometry, report),
        None => geometry.add_sphere(setting, radius),
    }
}

fn turned(
    quadric: &Quadric,
    set: &ParamSet,
    setting: &Setting,
    geometry: &mut Geometry,
    report: &mut Report,
) -> Result<(), SceneError> {
    let data = quadric.mesh(quadrics::phi_max(set)?, setting.needs_uv);
    add_data(data, set, setting, geometry, true, report)
}

fn curve(
    set: &ParamSet,
    setting: &Setting,
    geometry: &mut Geometry,
    report: &mut Report,
) -> Result<(), SceneError> {
    let pieces = match curves::pieces(set, setting.fibre, report)? {
        Ok(pieces) => pieces,
        Err(why) => {
            leave_out(set, report, &why, "pbrt");
            return Ok(());
        }
    };
    let mut room = geometry.room_to_make(0).map_err(|e| set.error(e))?;
    let data = mesh::curve(&pieces, setting.fibre, &mut |n| room.add(n));
    let data = data.map_err(|e| set.error(e))?;
    drop(room);
    add_data(data, set, setting, geometry, true, report)
}

fn disk(
    set: &ParamSet,
    setting: &Setting,
    geometry: &mut Geometry,
    report: &mut Report,
) -> Result<(), SceneError> {
    let radius = set.float_or("radius", 1.0)?;
    let inner = set.float_or("innerradius", 0.0)?.max(0.0);
    let height = set.float_or("height", 0.0)?;
    let phi_max = quadrics::phi_max(set)?.to_degrees();
    let plain = !setting.needs_uv && setting.light.is_none();
    let data = if plain && inner == 0.0 && phi_max == 360.0 {
        mesh::whole_disk(radius as f32, height as f32)
    } else {
        mesh::disk(radius as f32, inner as f32, height as f32, phi_max as f32)
    };
    add_data(data, set, setting, geometry, true, report)
}

fn narrow(v: &[DVec3]) -> Vec<[f32; 3]> {
    v.iter().map(|v| v.as_vec3().to_array()).collect()
}

fn bilinear(
    set: &ParamSet,
    setting: &Setting,
    geometry: &mut Geometry,
    report: &mut Report,
) -> Result<(), SceneError> {
    // A hint where to look for light, which does not change the picture.
    set.accept(&["emissionfilename"]);
    let Some(positions) = set.triples("P", Type::Point3)? else {
        return Err(set.error("needs vertex positions, \"point3 P\""));
    };
    let vertices = positions.len();
    let indices = match set.indices("indices", vertices)? {
        Some(indices) => indices.map_err(|why| set.error(why))?,
        None if vertices == 4 => vec![0, 1, 2, 3],
        None => return Err(set.error("needs vertex indices, \"integer indices\"")),
    };
    let patches = groups::<4>(set, &indices, report).map_err(|why| set.error(why))?;
    let normals = set.triples("N", Type::Normal)?;
    let normals = one_each(set, "N", normals, vertices, report);
    let uvs = texture_coordinates(set, vertices, report)?;
    set.accept(&["faceIndices"]);

    let p = narrow(&positions);
    let n = normals.as_deref().map(narrow);
    let uv: Option<Vec<[f32; 2]>> = uvs.map(|t| t.iter().map(|t| t.as_vec2().to_array()).collect());
    let mut add = |indices: &[u32], power_of_whole: bool| {
        let (n, uv) = (n.as_deref(), uv.as_deref());
        let mut room = geometry.room_to_make(0).map_err(|e| set.error(e))?;
        let data = bilinear_mesh_within(&p, n, uv, indices, &mut |n| room.add(n))
            .map_err(|e| set.error(e))?;
        add_data(data, set, setting, geometry, power_of_whole, report)
    };
    if setting.light.as_ref().is_some_and(|l| l.has_power()) {
        // Power is that of each patch, not of the triangles it is made of.
        patches.iter().try_for_each(|patch| add(patch, true))
    } else {
        add(patches.as_flattened(), false)
    }
}

fn subdivision(
    set: &ParamSet,
    setting: &Setting,
    geometry: &mut Geometry,
    report: &mut Report,
) -> Result<(), SceneError> {
    let name = if set.has("levels") {
        "levels"
    } else {
        "nlevels"
    };
    let levels = set.int_in(name, 3, 0, 13)? as u32;
    set.accept(&["scheme", "nlevels"]);
    let Some(positions) = set.triples("P", Type::Point3)? else {
        let why = "needs vertex positions, \"point3 P\" (v3: \"point P\")";
        return left_out(set, report, why);
    };
    let Some(indices) = set.indices("indices", positions.len())? else {
        return left_out(set, report, "needs vertex indices, \"integer indices\"");
    };
    let indices = indices.map_err(|why| set.error(why))?;
    let faces = groups::<3>(set, &indices, report).map_err(|why| set.error(why))?;
    let indices = faces.as_flattened();
    let faces = faces.len();
    if faces.saturating_mul(1 << (2 * levels)) > MAX_SUBDIVIDED_FACES {
        return Err(set.error(format_args!(
            "{faces} faces subdivided {levels} times are more than {MAX_SUBDIVIDED_FACES}; use fewer levels"
        )));
    }
    let bytes = (faces << (2 * levels)) as u64 * SUBDIVIDED_BYTES;
    let _room = geometry
        .room_to_make(bytes)
        .map_err(|e| set.error(format_args!("{faces} faces subdivided {levels} times: {e}")))?;
    let data =
        mesh::loop_subdivide(levels, &narrow(&positions), indices).map_err(|e| set.error(e))?;
    add_data(data, set, setting, geometry, false, report)
}
