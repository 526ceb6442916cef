//! Materials of the scenes, and textures they name.

pub const MATTE: &str = "Material \"matte\" \"rgb Kd\" [0.7 0.6 0.5]";
pub const BLUE: &str = "Material \"matte\" \"rgb Kd\" [0.2 0.3 0.8]";
pub const ROUGH: &str = "Material \"matte\" \"rgb Kd\" [0.6 0.7 0.6] \"float sigma\" 40";
pub const MIRROR: &str = "Material \"mirror\" \"rgb Kr\" [0.9 0.8 0.9]";
pub const GLASS: &str = "Material \"glass\" \"float eta\" 1.5";
pub const FROSTED: &str = "Material \"glass\" \"rgb Kr\" [0.9 1 0.8] \"rgb Kt\" [0.8 0.9 1] \"float uroughness\" 0.3 \"float vroughness\" 0.6 \"bool remaproughness\" \"false\"";
pub const METAL: &str = "Material \"metal\" \"rgb eta\" [0.2 0.9 1.4] \"rgb k\" [3.9 2.4 2.1] \"float roughness\" 0.3 \"bool remaproughness\" \"false\"";
pub const STEEL: &str = "Material \"metal\" \"rgb eta\" [0.2 0.9 1.4] \"rgb k\" [3.9 2.4 2.1] \"float roughness\" 0.0 \"bool remaproughness\" \"false\"";
pub const BRUSHED: &str = "Material \"metal\" \"float uroughness\" 0.15 \"float vroughness\" 0.5 \"bool remaproughness\" \"false\"";
pub const PANE: &str = "Material \"thindielectric\" \"float eta\" 1.5";
pub const PAPER: &str = "Material \"diffusetransmission\" \"rgb reflectance\" [0.3 0.25 0.2] \"rgb transmittance\" [0.5 0.5 0.4]";
pub const LACQUER: &str = "Material \"substrate\" \"rgb Kd\" [0.5 0.2 0.1] \"rgb Ks\" [0.1 0.2 0.1] \"float uroughness\" 0.15 \"float vroughness\" 0.4 \"bool remaproughness\" \"false\"";
pub const COATED: &str = "Material \"coateddiffuse\" \"rgb reflectance\" [0.7 0.3 0.2] \"float roughness\" 0.3 \"bool remaproughness\" \"false\"";
pub const VARNISHED: &str = "Material \"coatedconductor\" \"float interface.roughness\" 0.2 \"float conductor.uroughness\" 0.2 \"float conductor.vroughness\" 0.4 \"bool remaproughness\" \"false\"";
pub const POLISHED: &str = "Material \"coateddiffuse\" \"rgb reflectance\" [0.2 0.5 0.3]";
pub const BRONZE: &str = "Material \"coatedconductor\" \"float conductor.roughness\" 0.3 \"bool remaproughness\" \"false\"";
pub const CHROME: &str = "Material \"coatedconductor\" \"float thickness\" 0.1";
pub const CRYSTAL: &str = "Material \"dielectric\" \"spectrum eta\" \"glass-F11\"";
pub const HAZE: &str = "Material \"dielectric\" \"spectrum eta\" [400 1.8 500 1.6 700 1.5] \"float uroughness\" 0.3 \"float vroughness\" 0.6 \"bool remaproughness\" \"false\"";
pub const FOIL: &str = "Material \"thindielectric\" \"spectrum eta\" [400 1.8 700 1.4]";
pub const SHADE: &str = "Material \"translucent\" \"rgb Ks\" [0 0 0] \"rgb Kd\" [1 0.9 0.7] \"rgb transmit\" [0.6 0.6 0.6] \"rgb reflect\" [0.3 0.4 0.3]";
pub const PLASTIC: &str = "Material \"plastic\" \"rgb Kd\" [0.5 0.3 0.2] \"rgb Ks\" [0.4 0.4 0.4] \"float roughness\" 0.2 \"bool remaproughness\" \"false\"";
pub const STONE: &str = "Material \"matte\" \"texture Kd\" \"marble\"";
pub const DOTTED: &str = "Material \"matte\" \"texture Kd\" \"dots\"";
pub const CREASED: &str =
    "Material \"plastic\" \"texture Kd\" \"globe\" \"texture roughness\" \"creases\"";

/// Textures have to be made before they are named.
pub const CHECKS: &str = "Texture \"checks\" \"float\" \"checkerboard\" \"float uscale\" 3 \"float vscale\" 4 \"float tex1\" 0.2 \"float tex2\" 1\n";
pub const BUMPY: &str = "\"texture bumpmap\" \"heights\"";

/// Named materials that are mixtures.
pub const MIXTURES: &str = "Texture \"checks\" \"spectrum\" \"checkerboard\" \"float uscale\" 3 \"float vscale\" 3 \"rgb tex1\" [1 0.8 0.3] \"rgb tex2\" [0 0.1 0.6]
MakeNamedMaterial \"matte\" \"string type\" \"matte\" \"rgb Kd\" [0.7 0.6 0.5]
MakeNamedMaterial \"mirror\" \"string type\" \"mirror\" \"rgb Kr\" [0.9 0.8 0.9]
MakeNamedMaterial \"glass\" \"string type\" \"glass\" \"float eta\" 1.5
MakeNamedMaterial \"plastic\" \"string type\" \"plastic\" \"texture Kd\" \"checks\" \"rgb Ks\" [0.4 0.4 0.4] \"float roughness\" 0.2 \"bool remaproughness\" \"false\"
MakeNamedMaterial \"polished\" \"string type\" \"mix\" \"string namedmaterial1\" \"mirror\" \"string namedmaterial2\" \"matte\" \"texture amount\" \"checks\"
MakeNamedMaterial \"veil\" \"string type\" \"mix\" \"string namedmaterial1\" \"glass\" \"string namedmaterial2\" \"plastic\" \"rgb amount\" [0.7 0.6 0.7]
MakeNamedMaterial \"nested\" \"string type\" \"mix\" \"string namedmaterial1\" \"polished\" \"string namedmaterial2\" \"plastic\" \"rgb amount\" [0.3 0.5 0.4]
";
