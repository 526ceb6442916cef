//! Vertices and faces as the file has them.

use ply_rs_bw::ply::{BeginList, PropertyAccess, PropertyAccessResult};

/// x y z, nx ny nz, u v.
pub(super) struct Vertex(pub [f32; 8]);

impl Vertex {
    /// Where a property of this name goes.
    pub fn slot(name: &str) -> Option<usize> {
        Some(match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            "nx" => 3,
            "ny" => 4,
            "nz" => 5,
            "u" | "s" | "texture_u" | "texture_s" => 6,
            "v" | "t" | "texture_v" | "texture_t" => 7,
            _ => return None,
        })
    }

    fn set(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        if let Some(slot) = Self::slot(name) {
            self.0[slot] = value;
        }
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Vertex([0.0; 8])
    }
    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
    fn set_char(&mut self, name: &str, value: i8) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
    fn set_short(&mut self, name: &str, value: i16) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
    fn set_ushort(&mut self, name: &str, value: u16) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
    fn set_int(&mut self, name: &str, value: i32) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
    fn set_uint(&mut self, name: &str, value: u32) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
}

/// Vertex indices; a negative one wraps to a number no mesh reaches.
pub(super) struct Face(pub Vec<u32>);

impl Face {
    pub fn is_indices(name: &str) -> bool {
        matches!(name, "vertex_indices" | "vertex_index")
    }

    fn set<T>(
        &mut self,
        name: &str,
        list: Vec<T>,
        index: impl Fn(T) -> u32,
    ) -> PropertyAccessResult {
        if Self::is_indices(name) {
            self.0 = list.into_iter().map(index).collect();
        }
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Face(Vec::new())
    }
    fn begin_list_uint(&mut self, name: &str, _length: usize) -> BeginList<'_, u32> {
        if Self::is_indices(name) {
            BeginList::Fill(&mut self.0)
        } else {
            BeginList::UseSetter
        }
    }
    fn set_list_int(&mut self, name: &str, list: Vec<i32>) -> PropertyAccessResult {
        self.set(name, list, |v| v as u32)
    }
    fn set_list_char(&mut self, name: &str, list: Vec<i8>) -> PropertyAccessResult {
        self.set(name, list, |v| v as i32 as u32)
    }
    fn set_list_uchar(&mut self, name: &str, list: Vec<u8>) -> PropertyAccessResult {
        self.set(name, list, u32::from)
    }
    fn set_list_short(&mut self, name: &str, list: Vec<i16>) -> PropertyAccessResult {
        self.set(name, list, |v| v as i32 as u32)
    }
    fn set_list_ushort(&mut self, name: &str, list: Vec<u16>) -> PropertyAccessResult {
        self.set(name, list, u32::from)
    }
    fn set_list_float(&mut self, name: &str, list: Vec<f32>) -> PropertyAccessResult {
        self.set(name, list, |v| whole(v.into()))
    }
    fn set_list_double(&mut self, name: &str, list: Vec<f64>) -> PropertyAccessResult {
        self.set(name, list, whole)
    }
}

/// An index that was written as a float; what is none becomes a number no mesh reaches.
fn whole(v: f64) -> u32 {
    if v.fract() == 0.0 && (f64::from(i32::MIN)..=f64::from(u32::MAX)).contains(&v) {
        v as i64 as u32
    } else {
        u32::MAX
    }
}

/// An element that nobody asks for.
pub(super) struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Skipped
    }
}
