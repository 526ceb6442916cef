//! A small scene for many questions: a floor, a wall, a ball, a lamp.

use super::{BOTH, Runs, head, scene, settings};
use phalanx::integrate::Settings;
use phalanx::scene::{IntegratorKind, Scene};

pub const CAMERA: &str = "LookAt 0 1.5 5  0 .8 0  0 1 0\nCamera \"perspective\" \"float fov\" [40]";

/// A floor, a wall, a ball, all of one albedo.
pub fn stage(albedo: [f64; 3]) -> String {
    let [r, g, b] = albedo;
    format!(
        "Material \"matte\" \"rgb Kd\" [{r} {g} {b}]\n\
         Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 -3 0 3 3 0 3 3 0 -2]\n\
         Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 3 0 -2 3 3 -2 -3 3 -2]\n\
         AttributeBegin\nTranslate .3 .6 0\nShape \"sphere\" \"float radius\" [.6]\nAttributeEnd\n"
    )
}

pub const GREY: [f64; 3] = [0.7, 0.7, 0.7];

/// A lamp over the stage.
pub fn lamp(l: &str) -> String {
    format!(
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" {l}\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\n\
         Translate -.5 2.5 .5\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" [.4]\nAttributeEnd\n"
    )
}

pub fn lit_stage(width: u32, height: u32) -> Scene {
    // The same view whatever the shape of the film.
    let camera = format!("{CAMERA} \"float screenwindow\" [-1.333 1.333 -1 1]");
    scene(&(head(width, height, 4, &camera) + &lamp("[8 8 8]") + &stage(GREY)))
}

/// MMLT and PT with changed settings: runs of both, at least 20 000 mutations or samples each.
pub fn both(scene: &Scene, change: &dyn Fn(&mut Settings), seeds: u64) -> [Runs; 2] {
    BOTH.map(|kind| renders(scene, kind, change, seeds))
}

/// The same of one integrator.
pub fn renders(
    scene: &Scene,
    kind: IntegratorKind,
    change: &dyn Fn(&mut Settings),
    seeds: u64,
) -> Runs {
    let pixels = u64::from(scene.film.width) * u64::from(scene.film.height);
    let mut s = settings(scene, kind, (20_000 / pixels).max(2));
    change(&mut s);
    Runs::new(scene, &s, seeds)
}
