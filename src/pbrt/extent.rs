//! How large things are, and where the small ones are: what decides on the origin of internal
//! space, and on what is kept in `f64`.

mod large;
mod measure;
mod origin;

pub(super) use self::large::large_of;
pub(super) use self::measure::Eyes;
pub(super) use self::origin::space_of;

#[cfg(test)]
mod tests {
    use super::measure::{SLIVERS, Sizes};
    use crate::pbrt::load_str;
    use crate::scene::Scene;

    fn load(shapes: &str) -> Scene {
        let text =
            format!("LookAt 3 0 1  0 0 0  0 0 1\nCamera \"perspective\"\nWorldBegin\n{shapes}");
        load_str(&text, "test.pbrt", ".".as_ref()).unwrap()
    }

    fn ground(s: f64, x: f64) -> String {
        let (a, b) = (x - s, x + s);
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]\n\
             \"point P\" [{a} {a} 0 {b} {a} 0 {b} {b} 0 {a} {b} 0]\n"
        )
    }

    const BALL: &str =
        "AttributeBegin\nTranslate 0 0 .5\nShape \"sphere\" \"float radius\" .5\nAttributeEnd\n";

    #[test]
    fn grounds_are_large_if_something_small_is_next_to_them() {
        assert_eq!(load(&(ground(4e2, 0.0) + BALL)).large.len(), 0);
        assert_eq!(load(&(ground(1e5, 0.0) + BALL)).large.len(), 2);
        // The camera is small enough.
        assert_eq!(load(&ground(1e5, 0.0)).large.len(), 2);
        assert_eq!(load(&ground(10.0, 0.0)).large.len(), 0);
        // A spark in the air is no reason.
        let spark = "AttributeBegin\nTranslate 0 0 1\n\
            Shape \"sphere\" \"float radius\" 1e-5\nAttributeEnd\n";
        assert_eq!(load(&(ground(3.0, 0.0) + spark)).large.len(), 0);
    }

    #[test]
    fn neighbours_of_large_triangles_are_their_seam() {
        // A fan of small triangles on the ground's corner.
        let fan = "Shape \"trianglemesh\" \"integer indices\" [0 1 2]\n\
            \"point P\" [-100000 -100000 0 -100000 -100001 0 -100001 -100001 0]\n";
        let scene = load(&(ground(1e5, 0.0) + BALL + fan));
        let seams: Vec<bool> = scene.large.triangles.iter().map(|t| t.seam).collect();
        assert_eq!(seams, [false, false, true]);
    }

    #[test]
    fn the_origin_is_where_small_things_are() {
        let scene = load(&(ground(1e6, 9e5) + BALL));
        assert!(scene.space.centre.length() < 10.0, "{:?}", scene.space);
        let reach = scene.bounds.map(|b| b.length());
        assert!(
            reach.iter().all(|r| *r <= 1.0) && reach[1] > 0.5,
            "{reach:?}"
        );
        // In usual scenes it is the middle.
        let scene = load(&(ground(5.0, 4.0) + BALL));
        assert_eq!(scene.space.centre.truncate(), glam::DVec2::splat(4.0));
    }

    #[test]
    fn quantiles_leave_slivers_out() {
        let mut sizes = Sizes::new();
        assert_eq!(sizes.quantile(0.5), 0.0);
        sizes.add(1e-9);
        (0..1000).for_each(|_| sizes.add(3.0));
        let size = sizes.quantile(SLIVERS);
        assert!((2.0..=3.0).contains(&size), "{size}");
        assert!(sizes.quantile(0.0) < 1.01e-9);
    }
}
