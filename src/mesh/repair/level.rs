//! How much of a mesh is mended, and how a file says so.

/// How much [`repair_at`](crate::mesh::repair_at) mends.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum RepairLevel {
    /// Nothing: a mesh that needs repair is refused.
    None,
    /// What has only one sensible repair, and does not change the domain.
    #[default]
    Safe,
    /// Also open seams: points become one where that joins two faces that lie on each other.
    Weld {
        /// How far apart, in model units, such points may be; 0 for points at one place.
        distance: f64,
    },
}

impl RepairLevel {
    /// All levels.
    pub const ALL: [Self; 3] = [Self::None, Self::Safe, Self::Weld { distance: 0.0 }];
    /// The key under which [`RepairLevel::metadata`] says how a mesh was mended.
    pub const METADATA_KEY: &str = "repair";

    /// The name, as options have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Safe => "safe",
            Self::Weld { .. } => "weld",
        }
    }

    /// How far apart points may be that become one.
    pub fn weld_distance(self) -> f64 {
        if let Self::Weld { distance } = self { distance } else { 0.0 }
    }

    /// The entry of a file's metadata that says how the input was mended. None for the other levels than
    /// [`Weld`](Self::Weld): the mesh is that of [`Safe`](Self::Safe).
    pub fn metadata(self) -> Option<(String, String)> {
        let text = match self {
            Self::None | Self::Safe => return None,
            Self::Weld { distance: 0.0 } => self.name().to_owned(),
            Self::Weld { distance } => format!("{} {distance}", self.name()),
        };
        Some((Self::METADATA_KEY.to_owned(), text))
    }

    /// The level at which the input has to be mended, so that it is the mesh that a file with this metadata was built from.
    pub fn from_metadata(metadata: &[(String, String)]) -> Self {
        let entry = metadata.iter().find(|(key, _)| key == Self::METADATA_KEY);
        let distance = entry.and_then(|(_, text)| match text.strip_prefix("weld")? {
            "" => Some(0.0),
            distance => distance.trim_start().parse().ok(),
        });
        distance.map_or(Self::Safe, |distance| Self::Weld { distance })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metadata_says_the_level() {
        assert_eq!(RepairLevel::None.metadata().or(RepairLevel::Safe.metadata()), None);
        for distance in [0.0, 0.1, 1e-300, 2.5e20] {
            let level = RepairLevel::Weld { distance };
            let other = ("about".to_owned(), "weld 7".to_owned());
            let metadata: Vec<_> = [other].into_iter().chain(level.metadata()).collect();
            assert_eq!(RepairLevel::from_metadata(&metadata), level);
        }
        assert_eq!(RepairLevel::from_metadata(&[("repair".into(), "by hand".into())]), RepairLevel::Safe);
    }
}
