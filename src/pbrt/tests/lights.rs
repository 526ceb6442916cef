//! Lights of both dialects, and their pictures.

use super::*;
use crate::surface::DiffuseMaterial;

// Lights.

#[test]
fn area_lights() {
    let s = v3(&format!(
        "{V3_TRIANGLE} AreaLightSource \"area\" \"color L\" [1 2 3] \"color scale\" [2 2 2] \"integer nsamples\" 4 Shape \"sphere\" Translate 0 0 3 {V3_TRIANGLE}"
    ));
    assert_eq!(
        s.shapes.iter().map(|x| x.light).collect::<Vec<_>>(),
        [NONE, 0, 1]
    );
    assert_eq!(
        s.lights[0].kind,
        LightKind::Sphere {
            sphere: 0,
            l: [2.0, 4.0, 6.0],
            two_sided: false
        }
    );
    assert_eq!(
        s.lights[1].kind,
        LightKind::Triangle {
            triangle: 1,
            l: [2.0, 4.0, 6.0],
            two_sided: false
        }
    );
    assert!(s.warnings.is_empty(), "{:?}", s.warnings);
}

#[test]
fn power_of_area_lights() {
    // Half the unit square in area, both sides: L = power / (2 area pi).
    let s = v4(&format!(
        "AreaLightSource \"diffuse\" \"float power\" 10 \"bool twosided\" true {V4_TRIANGLE}"
    ));
    let LightKind::Triangle {
        l, two_sided: true, ..
    } = s.lights[0].kind
    else {
        panic!("two-sided")
    };
    assert!((l[0] - 10.0 / std::f32::consts::PI).abs() < 1e-5);
    let s = v4("AreaLightSource \"diffuse\" \"float power\" 10 Scale 2 2 2 Shape \"sphere\"");
    let LightKind::Sphere { l, .. } = s.lights[0].kind else {
        panic!("a sphere")
    };
    assert!(
        (l[0] / (10.0 / (16.0 * std::f32::consts::PI.powi(2))) - 1.0).abs() < 1e-3,
        "{l:?}"
    );
}

#[test]
fn point_lights_scale_with_space() {
    let s = v4(
        "Translate 1 0 0 LightSource \"point\" \"rgb I\" [8 8 8] \"point3 from\" [0 2 0] Shape \"sphere\" \"float radius\" 100",
    );
    let LightKind::Point { p, i } = s.lights[0].kind else {
        panic!("a point light")
    };
    near(
        (p.as_dvec3() / s.space.scale + s.space.centre).as_vec3(),
        Vec3::new(1.0, 2.0, 0.0),
    );
    assert!((f64::from(i[0]) - 8.0 * s.space.scale * s.space.scale).abs() < 1e-9);
    // v3 moves by `from` after the transform.
    let s = v3(
        "Scale 2 2 2 Translate 1 0 0 LightSource \"point\" \"point from\" [0 2 0] Shape \"sphere\"",
    );
    let LightKind::Point { p, .. } = s.lights[0].kind else {
        panic!("a point light")
    };
    near(
        (p.as_dvec3() / s.space.scale + s.space.centre).as_vec3(),
        Vec3::new(2.0, 2.0, 0.0),
    );
}

#[test]
fn directional_lights() {
    let s = v4(
        "Rotate 90 0 0 1 LightSource \"distant\" \"rgb L\" [1 2 3] \"float scale\" 2 \"point3 from\" [0 0 0] \"point3 to\" [5 0 0] \
         LightSource \"spot\" \"point3 to\" [1 0 0] \"float coneangle\" 60 \"float conedeltaangle\" 15 LightSource \"infinite\" \"rgb L\" [1 1 2]",
    );
    let LightKind::Distant { direction, l } = s.lights[0].kind else {
        panic!("distant")
    };
    near(direction, Vec3::Y);
    assert_eq!(l, [2.0, 4.0, 6.0]);
    let LightKind::Spot {
        axis,
        versine_total,
        versine_full,
        falloff,
        ..
    } = s.lights[1].kind
    else {
        panic!("spot")
    };
    near(axis, Vec3::Y);
    assert!((versine_total - 0.5).abs() < 1e-6);
    assert!((versine_full - (1.0 - 0.5_f32.sqrt())).abs() < 1e-6);
    assert_eq!(falloff, SpotFalloff::V4);
    assert_eq!(
        s.lights[2].kind,
        LightKind::InfiniteConstant { l: [1.0, 1.0, 2.0] }
    );
    let s = v4("LightSource \"infinite\" \"float illuminance\" 3");
    let LightKind::InfiniteConstant { l } = s.lights[0].kind else {
        panic!("infinite")
    };
    assert!((l[0] - 3.0 / std::f32::consts::PI).abs() < 1e-6);
}

/// A folder with a PFM picture of this size, every texel `(1, 2, 3)`.
fn folder_with_picture(width: u32, height: u32) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a folder");
    let mut bytes = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
    for _ in 0..width * height {
        bytes.extend([1.0f32, 2.0, 3.0].iter().flat_map(|x| x.to_le_bytes()));
    }
    std::fs::write(dir.path().join("a.pfm"), bytes).expect("written");
    dir
}

#[test]
fn environments() {
    let load = |size: (u32, u32), text: &str| {
        let dir = folder_with_picture(size.0, size.1);
        load_str(text, "t.pbrt", dir.path()).map_err(|e| e.to_string())
    };
    let s = load(
        (4, 2),
        "Film \"image\" WorldBegin Rotate 90 0 0 1 LightSource \"infinite\" \"string mapname\" \"a.pfm\" \"rgb L\" [2 1 1] WorldEnd",
    )
    .expect("loads");
    let LightKind::InfiniteImage {
        image,
        scale,
        to_light,
        layout,
    } = s.lights[0].kind
    else {
        panic!("an image")
    };
    assert_eq!(
        (scale, layout, s.images[image as usize].width),
        ([2.0, 1.0, 1.0], EnvLayout::LatLong, 4)
    );
    // The light's x is the world's y.
    let along = |v: Vec3| Vec3::from(to_light.map(|row| Vec3::from(row).dot(v)));
    near(along(Vec3::Y), Vec3::X);
    near(along(Vec3::X), Vec3::NEG_Y);

    let v4 = "Film \"rgb\" WorldBegin LightSource \"infinite\" \"string filename\" \"a.pfm\" \"float scale\" 3";
    let s = load((2, 2), v4).expect("loads");
    let LightKind::InfiniteImage { scale, layout, .. } = s.lights[0].kind else {
        panic!("an image")
    };
    assert_eq!((scale, layout), ([3.0; 3], EnvLayout::EqualArea));
    let error = load((4, 2), v4).expect_err("not square");
    assert!(
        error.starts_with("t.pbrt:1:23: LightSource \"infinite\": ") && error.contains("imgtool"),
        "{error}"
    );
}

#[test]
fn image_textures() {
    let dir = folder_with_picture(1, 1);
    let load = |text: &str| load_str(text, "t.pbrt", dir.path()).map_err(|e| e.to_string());
    let map = "\"imagemap\" \"string filename\" \"a.pfm\"";
    let s = load(&format!(
        "Film \"image\" WorldBegin Texture \"a\" \"color\" {map} \"float scale\" 2 \"string wrap\" \"clamp\" \
         Texture \"b\" \"float\" {map} Texture \"c\" \"float\" {map} WorldEnd"
    ))
    .expect("loads");
    // One picture for colours, one for the two uses as a number.
    assert_eq!(s.images.len(), 2);
    assert!(matches!(
        s.textures[0],
        Texture::Image {
            image: 0,
            wrap: Wrap::Clamp,
            scale: 2.0,
            invert: false,
            ..
        }
    ));
    let y = 0.212671 + 2.0 * 0.715160 + 3.0 * 0.072169;
    assert!((s.images[1].texels[0][2] - y).abs() < 1e-5);
    let s = load(&format!(
        "Film \"rgb\" WorldBegin Texture \"b\" \"float\" {map} \"bool invert\" true"
    ))
    .expect("loads");
    assert_eq!(s.images[0].texels[0], [2.0; 3]);
    assert!(matches!(s.textures[0], Texture::Image { invert: true, .. }));
}

#[test]
fn emission_by_other_spectra() {
    // Lights of v4 have luminance 1 whatever the magnitude of a spectrum; v3 takes it as it is.
    let luminance = |s: &Scene| match s.lights[0].kind {
        LightKind::InfiniteConstant { l } => crate::scene::spectrum::luminance(l),
        _ => panic!("constant"),
    };
    for text in [
        "\"blackbody L\" 3000",
        "\"spectrum L\" [400 7 700 7]",
        "\"spectrum L\" \"stdillum-D65\"",
    ] {
        let s = v4(&format!(
            "LightSource \"infinite\" {text} \"float scale\" 2"
        ));
        assert!((luminance(&s) - 2.0).abs() < 1e-4, "{text}");
    }
    let s = v3("LightSource \"infinite\" \"spectrum L\" [400 7 700 7]");
    assert!((luminance(&s) - 7.0).abs() < 1e-3);
    let s = v3("LightSource \"infinite\" \"blackbody L\" [3000 2]");
    assert!((0.01..1.99).contains(&luminance(&s)));
}

/// Against pbrt-v4's pictures of a flat patch, to their noise.
#[test]
fn v4_colours_of_lights_and_reflectances() {
    let light = |text: &str| match v4(&format!("{text} Shape \"sphere\"")).lights[0].kind {
        LightKind::InfiniteConstant { l } => l,
        _ => panic!("{text}"),
    };
    let near = |a: Rgb, b: Rgb, slack: f32| {
        let same = a.iter().zip(b).all(|(x, y)| (x - y).abs() < slack);
        assert!(same, "{a:?} is not {b:?}");
    };
    // Nothing beyond the samples; blue is out of gamut. The picture of the case is 0.6073 of its
    // light.
    let l = light("LightSource \"infinite\" \"spectrum L\" [500 1 600 1]");
    near(l.map(|c| c * 0.6073), [0.2208, 0.7901, 0.0], 2e-3);
    let dark = light("LightSource \"infinite\" \"spectrum L\" [360 1 830 1]");
    near(dark, [1.2048, 0.9483, 0.9087], 2e-3);
    // Lights have the white of their space.
    let white = [1.0463, 0.9942, 0.9156];
    for text in [
        "ColorSpace \"aces2065-1\" LightSource \"infinite\" \"rgb L\" [1 1 1]",
        "ColorSpace \"aces2065-1\" LightSource \"infinite\"",
    ] {
        near(light(text), white, 2e-3);
    }
    for space in ["dci-p3", "rec2020", "srgb"] {
        let text = format!("ColorSpace \"{space}\" LightSource \"infinite\" \"rgb L\" [1 1 1]");
        near(light(&text), [1.0; 3], 1e-4);
    }
    let albedo = |text: &str| {
        let s = v4(&format!("Material \"diffuse\" {text} Shape \"sphere\""));
        match s.materials[0].kind.get() {
            Some(DiffuseMaterial {
                reflectance: Param::Constant(c),
                ..
            }) => *c,
            _ => panic!("{text}"),
        }
    };
    // A ball before a sky of 1 fills pi / 4 of the case's picture.
    let seen = albedo("\"blackbody reflectance\" 3000").map(|c| 1.0 - (1.0 - c) * FRAC_PI_4);
    near(seen, [0.7094, 0.5040, 0.3179], 3e-3);
    let half = albedo("\"spectrum reflectance\" [500 .5 600 .5]");
    assert!(half[0] < 0.2 && half[2] < 0.1, "{half:?}");
    let whole = albedo("\"spectrum reflectance\" [300 .5 900 .5]");
    near(whole, [0.5; 3], 1e-5);
    // pbrt-v3's build is RGB, and takes white to be the spectrum that is 1 everywhere.
    let s = v3("Material \"matte\" \"spectrum Kd\" [300 .5 900 .5] Shape \"sphere\"");
    let Some(DiffuseMaterial {
        reflectance: Param::Constant(kd),
        ..
    }) = s.materials[0].kind.get()
    else {
        panic!("{:?}", s.materials);
    };
    near(*kd, [0.6024, 0.4741, 0.4544], 1e-3);
}

#[test]
fn lights_cut_out_entirely_shine_unseen() {
    let lamp = "AreaLightSource \"diffuse\" \"rgb L\" [2 2 2]";
    let mesh = "Shape \"trianglemesh\" \"integer indices\" [0 1 2]";
    for s in [
        v4(&format!("{lamp} Shape \"sphere\" \"float alpha\" 0")),
        v4(&format!(
            "{lamp} {mesh} \"point3 P\" [0 0 0 1 0 0 0 1 0] \"float alpha\" 0"
        )),
        v3(&format!(
            "{lamp} {mesh} \"point P\" [0 0 0 1 0 0 0 1 0] \"float alpha\" 0"
        )),
        v4(&format!(
            "Texture \"t\" \"float\" \"constant\" \"float value\" 0 {lamp} Shape \"sphere\" \"texture alpha\" \"t\""
        )),
    ] {
        assert_eq!(s.lights.len(), 1);
        assert!(s.is_hidden(&s.lights[0].kind));
        assert!(s.warnings.is_empty(), "{:?}", s.warnings);
    }
    let s = v4(&format!("{lamp} Shape \"sphere\""));
    assert!(!s.is_hidden(&s.lights[0].kind));
}
