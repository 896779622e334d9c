//! The header of an item: one JSON object.

use crate::item::{Band, Content, Ground, ImagePose, Item};
use crate::picture::{MAX_PICTURE_BYTES, Raster};
use crate::{MAX_HEADER_BYTES, Refusal};
use scenecast_protocol::map::{ClassEntry, Decimal, LayerDescriptor, MAX_CLASS};
use serde::Deserialize;

/// The members of a header; others are refused, because a misspelt one would be lost silently.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Members {
    kind: Kind,
    t_s: Option<f64>,
    /// Length of the picture, for a stream.
    bytes: Option<u64>,
    #[serde(default)]
    encoding: Encoding,
    width: Option<u32>,
    height: Option<u32>,
    x_m: Option<f64>,
    y_m: Option<f64>,
    depth_m: Option<f64>,
    heading_deg: Option<f64>,
    metres_per_pixel: Option<f64>,
    west_m: Option<f64>,
    south_m: Option<f64>,
    cell_m: Option<f64>,
    name: Option<String>,
    #[serde(default)]
    unit: String,
    scale: Option<f64>,
    offset: Option<f64>,
    no_data: Option<u8>,
    #[serde(default)]
    classes: Vec<NamedClass>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Image,
    Grid,
    Band,
    Classes,
}

#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Encoding {
    #[default]
    Png,
    Raw,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NamedClass {
    class: u8,
    name: String,
    colour: Option<String>,
}

/// A header that was read.
#[derive(Debug)]
pub(crate) struct Header(Members);

impl Header {
    pub(crate) fn read(text: &[u8]) -> Result<Self, Refusal> {
        if text.len() > MAX_HEADER_BYTES {
            return Err(Refusal::LongHeader);
        }
        let members = serde_json::from_slice(text).map_err(|e| Refusal::Header(e.to_string()))?;
        Ok(Self(members))
    }

    /// Whether the item has a picture.
    pub(crate) fn has_picture(&self) -> bool {
        self.0.kind != Kind::Classes
    }

    /// The length of the picture that follows on a stream.
    pub(crate) fn picture_bytes(&self) -> Result<usize, Refusal> {
        if !self.has_picture() {
            return Ok(0);
        }
        let bytes = self.0.bytes.ok_or(Refusal::Missing("bytes, the length of the picture,"))?;
        match usize::try_from(bytes) {
            Ok(length @ 1..=MAX_PICTURE_BYTES) => Ok(length),
            _ => Err(Refusal::PictureBytes(bytes)),
        }
    }

    pub(crate) fn t_s(&self) -> Option<f64> {
        self.0.t_s
    }

    /// The item with this picture.
    pub(crate) fn into_item(self, picture: &[u8]) -> Result<Item, Refusal> {
        let members = self.0;
        let t_s = members.t_s.map(|t_s| within("t_s", t_s, 0.0, 1e9, "0 to 1e9 s")).transpose()?;
        let classes = members.classes.iter().map(entry).collect::<Result<Vec<_>, _>>()?;
        let content = match members.kind {
            Kind::Classes => Content::Classes,
            Kind::Image => {
                let metres_per_pixel = members.metres_per_pixel;
                let metres_per_pixel =
                    metres_per_pixel.map(|m| within("metres_per_pixel", m, 1e-5, 100.0, "1e-5 to 100 m"));
                let metres_per_pixel = metres_per_pixel.transpose()?;
                Content::Image { pose: members.pose()?, metres_per_pixel, classes: members.classes_of(picture)? }
            }
            Kind::Grid => Content::Grid { ground: members.ground()?, classes: members.classes_of(picture)? },
            Kind::Band => {
                Content::Band { band: members.band()?, ground: members.ground()?, levels: members.raster(picture)? }
            }
        };
        Ok(Item { t_s, classes, content })
    }
}

impl Members {
    fn raster(&self, picture: &[u8]) -> Result<Raster, Refusal> {
        if picture.is_empty() || picture.len() > MAX_PICTURE_BYTES {
            return Err(Refusal::PictureBytes(picture.len() as u64));
        }
        match self.encoding {
            Encoding::Png => Raster::png(picture),
            Encoding::Raw => {
                let width = self.width.ok_or(Refusal::Missing("width"))?;
                let height = self.height.ok_or(Refusal::Missing("height"))?;
                Raster::raw(width, height, picture)
            }
        }
    }

    fn classes_of(&self, picture: &[u8]) -> Result<Raster, Refusal> {
        let raster = self.raster(picture)?;
        match raster.values.iter().find(|&&class| class > MAX_CLASS && class != u8::MAX) {
            Some(&class) => Err(Refusal::Class(class)),
            None => Ok(raster),
        }
    }

    /// The pose, if any part of it is given; depth and heading may be left out.
    fn pose(&self) -> Result<Option<ImagePose>, Refusal> {
        if [self.x_m, self.y_m, self.depth_m, self.heading_deg].iter().all(Option::is_none) {
            return Ok(None);
        }
        let heading_deg = within("heading_deg", self.heading_deg.unwrap_or(0.0), -720.0, 720.0, "-720 to 720 degrees")?;
        Ok(Some(ImagePose {
            x_m: metres("x_m", self.x_m)?,
            y_m: metres("y_m", self.y_m)?,
            depth_m: within("depth_m", self.depth_m.unwrap_or(0.0), -100.0, 12_000.0, "-100 to 12000 m")?,
            heading_rad: heading_deg.to_radians(),
        }))
    }

    fn ground(&self) -> Result<Ground, Refusal> {
        let cell_m = self.cell_m.ok_or(Refusal::Missing("cell_m"))?;
        Ok(Ground {
            west_m: metres("west_m", self.west_m)?,
            south_m: metres("south_m", self.south_m)?,
            cell_m: within("cell_m", cell_m, 1e-4, 1e4, "1e-4 to 1e4 m")?,
        })
    }

    fn band(&self) -> Result<Band, Refusal> {
        let name = self.name.clone().ok_or(Refusal::Missing("name"))?;
        let (scale, offset) = (self.scale.unwrap_or(1.0), self.offset.unwrap_or(0.0));
        let scale = within("scale", scale, 1e-9, 1e9, "1e-9 to 1e9")?;
        let offset = within("offset", offset, -1e9, 1e9, "-1e9 to 1e9")?;
        let is_word = |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'_';
        let is_named = (1..=LayerDescriptor::MAX_NAME).contains(&name.len()) && name.bytes().all(is_word);
        let has_unit = self.unit.len() <= LayerDescriptor::MAX_UNIT && !self.unit.chars().any(char::is_control);
        if !is_named || !has_unit {
            return Err(Refusal::Band);
        }
        let (scale, offset) = (Decimal::nearest(scale), Decimal::nearest(offset));
        Ok(Band { name, unit: self.unit.clone(), scale, offset, no_data: self.no_data.unwrap_or(u8::MAX) })
    }
}

fn entry(named: &NamedClass) -> Result<ClassEntry, Refusal> {
    let class = named.class;
    let label = ClassEntry::label_of(class).ok_or(Refusal::Class(class))?;
    let colour = named.colour.as_deref().map(|text| colour(text).ok_or(Refusal::Colour(class))).transpose()?;
    ClassEntry::new(label, &named.name, colour).ok_or(Refusal::ClassName(class))
}

fn colour(text: &str) -> Option<[u8; 3]> {
    let hex = text.strip_prefix('#').filter(|hex| hex.len() == 6 && hex.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let [_, red, green, blue] = u32::from_str_radix(hex, 16).ok()?.to_be_bytes();
    Some([red, green, blue])
}

fn metres(name: &'static str, value: Option<f64>) -> Result<f64, Refusal> {
    within(name, value.ok_or(Refusal::Missing(name))?, -1e6, 1e6, "-1e6 to 1e6 m")
}

fn within(name: &'static str, value: f64, low: f64, high: f64, range: &'static str) -> Result<f64, Refusal> {
    if (low..=high).contains(&value) { Ok(value) } else { Err(Refusal::Range(name, value, range)) }
}

impl Item {
    /// Reads an item from its header and its picture. A header without a picture takes none.
    pub fn read(header: &[u8], picture: &[u8]) -> Result<Self, Refusal> {
        Header::read(header)?.into_item(picture)
    }

    /// The mission time in a header, and whether a picture belongs to it.
    pub fn peek(header: &[u8]) -> Result<(Option<f64>, bool), Refusal> {
        let header = Header::read(header)?;
        Ok((header.t_s(), header.has_picture()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(header: &str, picture: &[u8]) -> Result<Item, String> {
        Item::read(header.as_bytes(), picture).map_err(|why| why.to_string())
    }

    #[test]
    fn each_kind_of_item_reads_back() {
        let image = r##"{"kind": "image", "t_s": 2.5, "x_m": 3, "y_m": -4, "heading_deg": 90, "encoding": "raw",
            "width": 2, "height": 1, "classes": [{"class": 0, "name": "sand", "colour": "#E0c080"}]}"##;
        let item = read(image, &[0, 255]).unwrap();
        assert_eq!((item.t_s, item.classes.len()), (Some(2.5), 1));
        assert_eq!(
            (item.classes[0].label(), item.classes[0].name(), item.classes[0].colour()),
            (1, "sand", Some([0xE0, 0xC0, 0x80]))
        );
        let Content::Image { pose: Some(pose), metres_per_pixel: None, classes } = item.content else { panic!() };
        assert_eq!(
            (pose.x_m, pose.y_m, pose.heading_rad, &classes.values[..]),
            (3.0, -4.0, 90f64.to_radians(), &[0, 255][..])
        );
        let grid = r#"{"kind":"grid","west_m":0,"south_m":1,"cell_m":0.5,"encoding":"raw","width":1,"height":1}"#;
        assert!(matches!(
            read(grid, &[253]).unwrap().content,
            Content::Grid { ground: Ground { south_m: 1.0, .. }, .. }
        ));
        let band = r#"{"kind":"band","name":"backscatter","unit":"dB","scale":0.5,"offset":-80,"west_m":0,"south_m":0,
            "cell_m":1,"encoding":"raw","width":1,"height":1}"#;
        let Content::Band { band, levels, .. } = read(band, &[254]).unwrap().content else { panic!() };
        assert_eq!(
            (band.scale, band.offset, band.no_data, levels.values[0]),
            (Decimal::new(5, -1), Decimal::new(-80, 0), 255, 254)
        );
        assert_eq!(read(r#"{"kind":"classes"}"#, &[]).unwrap().content, Content::Classes);
        let own = r#"{"kind":"image","encoding":"raw","width":1,"height":1}"#;
        assert!(matches!(read(own, &[0]).unwrap().content, Content::Image { pose: None, .. }));
    }

    #[test]
    fn refused_items_are_named() {
        let grid = |more: &str| {
            format!(
                r#"{{"kind":"grid","west_m":0,"south_m":0,"cell_m":1,"encoding":"raw","width":1,"height":1{more}}}"#
            )
        };
        for (header, picture, said) in [
            ("{", &[0][..], "the header: EOF"),
            (r#"{"kind":"map"}"#, &[], "unknown variant `map`"),
            (&grid(r#","wdth":3"#), &[0], "unknown field `wdth`"),
            (&grid(""), &[254], "class 254: it takes 0 to 253"),
            (&grid(""), &[], "0 bytes: allowed are 1"),
            (&grid(""), &[1, 2], "2 bytes, and the header names 1 x 1"),
            (&grid(r#","t_s":-1"#), &[0], "t_s -1 is not within 0 to 1e9 s"),
            (&grid(r#","classes":[{"class":254,"name":"x"}]"#), &[0], "class 254"),
            (&grid(r#","classes":[{"class":3,"name":""}]"#), &[0], "class 3: the name takes 1 to 60 bytes"),
            (&grid(r##","classes":[{"class":3,"name":"x","colour":"#12345"}]"##), &[0], "class 3: the colour takes #"),
            (r#"{"kind":"grid","south_m":0,"cell_m":1}"#, &[0], "west_m is missing"),
            (r#"{"kind":"grid","west_m":0,"south_m":0,"cell_m":0}"#, &[0], "cell_m 0 is not within"),
            (r#"{"kind":"band","name":"Backscatter","west_m":0,"south_m":0,"cell_m":1}"#, &[0], "the band: name takes"),
            (r#"{"kind":"image","x_m":1}"#, &[0], "y_m is missing"),
        ] {
            let told = read(header, picture).unwrap_err();
            assert!(told.contains(said), "{told} for {header}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_an_item_or_are_refused(header in ".{0,60}", picture in proptest::collection::vec(any::<u8>(), 0..60)) {
            let _ = Item::read(header.as_bytes(), &picture);
            let grid = r#"{"kind":"grid","west_m":0,"south_m":0,"cell_m":1}"#;
            prop_assert!(Item::read(grid.as_bytes(), &picture).is_err());
        }
    }
}
