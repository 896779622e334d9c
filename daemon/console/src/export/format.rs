//! The file formats of a map.

use super::cells::MapCells;
use super::files::{csv, geojson, indexed_png, labels, ply, projection, world_file};
use super::geotiff::{Reference, geotiff};
use crate::state::Origin;

/// A file format of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapFormat {
    /// An indexed PNG, of at most 2^23 pixels.
    Png,
    /// The world file of that PNG.
    WorldFile,
    /// The projection of that PNG.
    Projection,
    /// Regions of equal label as polygons.
    GeoJson,
    /// A point cloud for CloudCompare and the like.
    Ply,
    /// A line for each explored cell.
    Csv,
    /// A line for each label: name, area, and the label that stands for it at each cut of the tree.
    Labels,
    /// A GeoTIFF in the projection of the mission, a pixel a cell.
    Tiff,
    /// A GeoTIFF in the zone of UTM.
    UtmTiff,
    /// A GeoTIFF in longitude and latitude.
    Wgs84Tiff,
}

impl MapFormat {
    pub const ALL: [Self; 10] = [
        Self::Png,
        Self::WorldFile,
        Self::Projection,
        Self::GeoJson,
        Self::Ply,
        Self::Csv,
        Self::Labels,
        Self::Tiff,
        Self::UtmTiff,
        Self::Wgs84Tiff,
    ];

    /// The end of the name of a file in this format.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::WorldFile => "pgw",
            Self::Projection => "png.aux.xml",
            Self::GeoJson => "geojson",
            Self::Ply => "ply",
            Self::Csv => "csv",
            Self::Labels => "labels.csv",
            Self::Tiff => "tif",
            Self::UtmTiff => "utm.tif",
            Self::Wgs84Tiff => "wgs84.tif",
        }
    }

    pub(crate) const fn content_type(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::WorldFile => "text/plain",
            Self::Projection => "application/xml",
            Self::GeoJson => "application/geo+json",
            Self::Ply => "application/ply",
            Self::Csv | Self::Labels => "text/csv",
            Self::Tiff | Self::UtmTiff | Self::Wgs84Tiff => "image/tiff",
        }
    }
}

impl MapCells {
    /// The map as a file; `origin` is the place of x = y = 0 of the world frame.
    ///
    /// # Errors
    ///
    /// One line for people: the map is too large for the format, or the format needs an origin.
    pub fn export(&self, format: MapFormat, origin: Option<Origin>) -> Result<Vec<u8>, String> {
        match format {
            MapFormat::Png => indexed_png(self),
            MapFormat::WorldFile => Ok(world_file(self).into()),
            MapFormat::Projection => Ok(projection(origin).into()),
            MapFormat::GeoJson => Ok(geojson(self, origin).into()),
            MapFormat::Ply => Ok(ply(self, origin).into()),
            MapFormat::Csv => Ok(csv(self).into()),
            MapFormat::Labels => Ok(labels(self).into()),
            MapFormat::Tiff => geotiff(self, origin, Reference::Mission),
            MapFormat::UtmTiff => geotiff(self, origin, Reference::Utm),
            MapFormat::Wgs84Tiff => geotiff(self, origin, Reference::Wgs84),
        }
    }
}
