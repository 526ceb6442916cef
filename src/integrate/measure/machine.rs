//! What the figures were measured on.

use serde::Serialize;

/// A machine, as far as it tells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Machine {
    /// Model of the processor; `None` where the system does not tell.
    pub cpu: Option<String>,
    /// Hardware threads this process may use.
    pub cores: usize,
    /// Such as `x86_64`.
    pub arch: &'static str,
    /// Such as `linux`.
    pub os: &'static str,
    /// Vector instructions that this binary is built with.
    pub target_features: Vec<&'static str>,
}

macro_rules! built_with {
    ($($name:literal)*) => {
        [$(($name, cfg!(target_feature = $name))),*]
    };
}

impl Machine {
    /// This one.
    pub fn this() -> Self {
        let features = built_with!(
            "sse2" "sse4.1" "avx" "avx2" "fma" "bmi2" "f16c" "avx512f" "avx512vl" "avx512dq" "avx512bw" "neon"
        );
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        Self {
            cpu: model(&info),
            cores: std::thread::available_parallelism().map_or(1, |n| n.get()),
            arch: std::env::consts::ARCH,
            os: std::env::consts::OS,
            target_features: features.iter().filter(|f| f.1).map(|f| f.0).collect(),
        }
    }
}

/// The processor's name in the text of `/proc/cpuinfo` (x86 has one).
fn model(info: &str) -> Option<String> {
    let line = info.lines().find(|l| l.starts_with("model name"))?;
    let name = line.split_once(':')?.1.trim();
    (!name.is_empty()).then(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_processors() {
        let info = "processor\t: 0\nmodel\t\t: 1\nmodel name\t: Some CPU @ 2.00GHz\nflags\t: fpu\n";
        assert_eq!(model(info).as_deref(), Some("Some CPU @ 2.00GHz"));
        assert_eq!(model("model name\t:\n"), None);
        assert_eq!(model(""), None);
    }
}
