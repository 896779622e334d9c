//! The header of an item: one JSON object.

use crate::item::{Band, BandScale, Content, Ground, ImagePose, Item, ItemTime, QuantityBand};
use crate::raster::{Raster, Values};
use crate::refusal::{MAX_HEADER_BYTES, MAX_PICTURE_BYTES, Refusal};
use scenecast_protocol::map::{ClassEntry, Decimal, LayerDescriptor, MAX_CLASS};
use serde::Deserialize;

/// The members of a header; others are refused, because a misspelt one would be lost silently.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Members {
    kind: Kind,
    t_s: Option<f64>,
    time: Option<f64>,
    age_s: Option<f64>,
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
    no_data: Option<u16>,
    /// The levels of a band of 16 bits or of numbers.
    low: Option<f64>,
    step: Option<f64>,
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
    /// Two bytes a pixel, the lower one first.
    Raw16,
    /// Numbers of IEEE 754 with four bytes, the lowest one first.
    Float32,
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

    pub(crate) fn time(&self) -> Result<ItemTime, Refusal> {
        self.0.time()
    }

    /// The item with this picture.
    pub(crate) fn into_item(self, picture: &[u8]) -> Result<Item, Refusal> {
        let members = self.0;
        let time = members.time()?;
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
            Kind::Band => members.band_content(picture)?,
        };
        Ok(Item { time, classes, content })
    }
}

impl Members {
    fn time(&self) -> Result<ItemTime, Refusal> {
        Ok(match (self.t_s, self.time, self.age_s) {
            (None, None, None) => ItemTime::Arrival,
            (Some(t_s), None, None) => ItemTime::Mission(within("t_s", t_s, 0.0, 1e9, "0 to 1e9 s")?),
            (None, Some(time), None) => ItemTime::Unix(within("time", time, 0.0, 1e11, "0 to 1e11 s")?),
            (None, None, Some(age_s)) => ItemTime::Age(within("age_s", age_s, 0.0, 1e6, "0 to 1e6 s")?),
            _ => return Err(Refusal::Times),
        })
    }

    fn check_length(picture: &[u8]) -> Result<(), Refusal> {
        match (1..=MAX_PICTURE_BYTES).contains(&picture.len()) {
            true => Ok(()),
            false => Err(Refusal::PictureBytes(picture.len() as u64)),
        }
    }

    fn size(&self) -> Result<(u32, u32), Refusal> {
        let width = self.width.ok_or(Refusal::Missing("width"))?;
        Ok((width, self.height.ok_or(Refusal::Missing("height"))?))
    }

    /// A picture of one byte a pixel.
    fn raster(&self, picture: &[u8]) -> Result<Raster, Refusal> {
        Self::check_length(picture)?;
        match self.encoding {
            Encoding::Png => Raster::png(picture),
            Encoding::Raw => {
                let (width, height) = self.size()?;
                Raster::raw(width, height, picture, |[byte]| byte)
            }
            Encoding::Raw16 => Err(Refusal::Depth("of 16 bits".to_owned())),
            Encoding::Float32 => Err(Refusal::Depth("of numbers".to_owned())),
        }
    }

    fn band_content(&self, picture: &[u8]) -> Result<Content, Refusal> {
        self.names()?;
        Self::check_length(picture)?;
        let ground = self.ground()?;
        let words = match self.encoding {
            Encoding::Png => match Values::png(picture)? {
                Values::Words(words) => words,
                Values::Bytes(levels) => return self.levels(ground, levels),
            },
            Encoding::Raw => return self.levels(ground, self.raster(picture)?),
            Encoding::Raw16 => {
                let (width, height) = self.size()?;
                Raster::raw(width, height, picture, u16::from_le_bytes)?
            }
            Encoding::Float32 => {
                let (width, height) = self.size()?;
                let numbers = Raster::raw(width, height, picture, f32::from_le_bytes)?;
                let (scale, offset) = self.scale_and_offset()?;
                let quantities = numbers.map(|number| (offset + scale * f64::from(number)) as f32);
                return Ok(Content::Quantities { band: self.quantity_band()?, ground, quantities });
            }
        };
        let (scale, offset) = self.scale_and_offset()?;
        let no_data = self.no_data.unwrap_or(u16::MAX);
        let quantity = |word: u16| if word == no_data { f32::NAN } else { (offset + scale * f64::from(word)) as f32 };
        Ok(Content::Quantities { band: self.quantity_band()?, ground, quantities: words.map(quantity) })
    }

    fn levels(&self, ground: Ground, levels: Raster) -> Result<Content, Refusal> {
        if self.step.is_some() || self.low.is_some() {
            return Err(Refusal::Scale);
        }
        Ok(Content::Band { band: self.band()?, ground, levels })
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

    fn scale_and_offset(&self) -> Result<(f64, f64), Refusal> {
        let scale = within("scale", self.scale.unwrap_or(1.0), 1e-9, 1e9, "1e-9 to 1e9")?;
        Ok((scale, within("offset", self.offset.unwrap_or(0.0), -1e9, 1e9, "-1e9 to 1e9")?))
    }

    fn quantity_band(&self) -> Result<QuantityBand, Refusal> {
        let scale = match (self.low, self.step) {
            (None, None) => None,
            (Some(low), Some(step)) => {
                let low = within("low", low, -1e9, 1e9, "-1e9 to 1e9")?;
                let step = Decimal::nearest(within("step", step, 1e-9, 1e9, "1e-9 to 1e9")?);
                Some(BandScale { low: Decimal::nearest(low).value(), step })
            }
            _ => return Err(Refusal::Scale),
        };
        let (name, unit) = self.names()?;
        Ok(QuantityBand { name, unit, scale })
    }

    fn band(&self) -> Result<Band, Refusal> {
        let (name, unit) = self.names()?;
        let (scale, offset) = self.scale_and_offset()?;
        let no_data = self.no_data.unwrap_or(u16::from(u8::MAX));
        let no_data = u8::try_from(no_data).map_err(|_| Refusal::Range("no_data", f64::from(no_data), "0 to 255"))?;
        let (scale, offset) = (Decimal::nearest(scale), Decimal::nearest(offset));
        Ok(Band { name, unit, scale, offset, no_data })
    }

    /// Name and unit of a band.
    fn names(&self) -> Result<(String, String), Refusal> {
        let name = self.name.clone().ok_or(Refusal::Missing("name"))?;
        let is_word = |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'_';
        let is_named = (1..=LayerDescriptor::MAX_NAME).contains(&name.len()) && name.bytes().all(is_word);
        let has_unit = self.unit.len() <= LayerDescriptor::MAX_UNIT && !self.unit.chars().any(char::is_control);
        match is_named && has_unit {
            true => Ok((name, self.unit.clone())),
            false => Err(Refusal::Band),
        }
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

    /// The time in a header, and whether a picture belongs to it.
    pub fn peek(header: &[u8]) -> Result<(ItemTime, bool), Refusal> {
        let header = Header::read(header)?;
        Ok((header.time()?, header.has_picture()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(header: &str, picture: &[u8]) -> Result<Item, Refusal> {
        Item::read(header.as_bytes(), picture)
    }

    #[test]
    fn each_kind_of_item_reads_back() {
        let image = r##"{"kind": "image", "t_s": 2.5, "x_m": 3, "y_m": -4, "heading_deg": 90, "encoding": "raw",
            "width": 2, "height": 1, "classes": [{"class": 0, "name": "sand", "colour": "#E0c080"}]}"##;
        let item = read(image, &[0, 255]).unwrap();
        assert_eq!((item.time, item.classes.len()), (ItemTime::Mission(2.5), 1));
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
        let deep = r#"{"kind":"band","name":"depth_16","unit":"m","scale":0.01,"offset":5,"low":0,"step":0.5,"west_m":0,
            "south_m":0,"cell_m":1,"encoding":"raw16","width":2,"height":1,"time":1.7e9}"#;
        let item = read(deep, &[0, 1, 255, 255]).unwrap();
        let Content::Quantities { band, quantities, .. } = item.content else { panic!() };
        assert_eq!((item.time, band.scale), (ItemTime::Unix(1.7e9), BandScale::between(0.0, 126.5)));
        assert!((quantities.values[0] - 7.56).abs() < 1e-6 && quantities.values[1].is_nan());
        let numbers = r#"{"kind":"band","name":"ph","west_m":0,"south_m":0,"cell_m":1,"encoding":"float32","width":1,"height":1}"#;
        let Content::Quantities { band, quantities, .. } = read(numbers, &8.25f32.to_le_bytes()).unwrap().content
        else {
            panic!()
        };
        assert_eq!((band.scale, quantities.values[0]), (None, 8.25));
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
            (&grid(""), &[1, 2], "2 bytes, which are not those of 1 x 1"),
            (&grid(r#","t_s":1,"age_s":2"#), &[0], "only one of t_s, time and age_s"),
            (&grid(r#","age_s":-1"#), &[0], "age_s -1 is not within"),
            (&grid(r#","encoding":"raw16""#), &[0, 0], "duplicate field"),
            (&grid(r#","t_s":-1"#), &[0], "t_s -1 is not within 0 to 1e9 s"),
            (&grid(r#","classes":[{"class":254,"name":"x"}]"#), &[0], "class 254"),
            (&grid(r#","classes":[{"class":3,"name":""}]"#), &[0], "class 3: the name takes 1 to 60 bytes"),
            (&grid(r##","classes":[{"class":3,"name":"x","colour":"#12345"}]"##), &[0], "class 3: the colour takes #"),
            (r#"{"kind":"grid","south_m":0,"cell_m":1}"#, &[0], "west_m is missing"),
            (r#"{"kind":"grid","west_m":0,"south_m":0,"cell_m":0}"#, &[0], "cell_m 0 is not within"),
            (r#"{"kind":"band","name":"Backscatter","west_m":0,"south_m":0,"cell_m":1}"#, &[0], "the band: name takes"),
            (r#"{"kind":"image","x_m":1}"#, &[0], "y_m is missing"),
        ] {
            let told = read(header, picture).unwrap_err().to_string();
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
