//! Fences, limits, weighted areas and destinations as the operator types them.

use crate::refusal::{OrderRefusal, Weighed};
use scenecast_core::{fence_of, outline_of, place_of};
use scenecast_protocol::coordinates::DecimetrePoint;
use scenecast_protocol::directive::{Areas, Band, Destination, Fence, Limits, Polygon, Reaction, WeightedArea};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

/// The largest coordinate of a place, metres, of either sign.
const MAX_M: f64 = DecimetrePoint::MAX_DM as f64 / 10.0;

/// A fence as it is typed: vertices in metres east and north of the origin.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("minProperties" = 1))]
pub struct FenceOrder {
    /// The vehicle stays inside; null: no fence.
    #[schemars(length(min = 3, max = 34), inner(inner(range(min = -MAX_M, max = MAX_M))))]
    pub fence: Option<Vec<[f64; 2]>>,
    /// The vehicle stays outside each of these outlines; null: of none.
    #[serde(default, deserialize_with = "listed")]
    #[schemars(with = "Option<Vec<Vec<[f64; 2]>>>", length(max = 15), inner(length(min = 3, max = 34), inner(inner(range(min = -MAX_M, max = MAX_M)))))]
    pub keep_outs: Vec<Vec<[f64; 2]>>,
    /// The end of the return path; null: the start of the vehicle's run.
    #[schemars(inner(range(min = -MAX_M, max = MAX_M)))]
    pub return_point: Option<[f64; 2]>,
}

fn listed<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    Option::deserialize(deserializer).map(Option::unwrap_or_default)
}

/// Limits as they are typed. An absent member stays as it is; null: no limit, or the reaction that is configured on the vehicle.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("minProperties" = 1))]
pub struct LimitsOrder {
    /// Minimum and maximum depth, metres.
    #[schemars(inner(range(min = 0.0, max = 6553.5)))]
    pub depth_m: Option<[f64; 2]>,
    /// Minimum and maximum altitude, metres.
    #[schemars(inner(range(min = 0.0, max = 6553.5)))]
    pub altitude_m: Option<[f64; 2]>,
    /// Maximum length of the path in metres, the return path included.
    #[schemars(range(min = 1, max = 16_777_215))]
    pub distance_m: Option<f64>,
    /// Maximum time in seconds, the return path included.
    #[schemars(range(min = 1, max = 16_777_215))]
    pub time_s: Option<f64>,
    /// Allowed silence of the surface, seconds.
    #[schemars(range(min = 1, max = 65_535))]
    pub silence_s: Option<f64>,
    /// The reaction to a longer silence.
    #[schemars(extend("enum" = ["hold", "return", "surface", null]))]
    pub on_silence: Option<String>,
    /// The reaction to a breach.
    #[schemars(extend("enum" = ["hold", "return", "surface", null]))]
    pub on_breach: Option<String>,
    /// The reaction to an abort.
    #[schemars(extend("enum" = ["hold", "return", "surface", null]))]
    pub on_abort: Option<String>,
}

/// Weighted areas as they are typed. They replace the last ones.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AreasOrder {
    /// Empty: no area has a weight any more.
    #[schemars(length(max = 4))]
    pub areas: Vec<AreaOrder>,
}

/// An area whose cells have a weight in addition to that of their label.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AreaOrder {
    /// Vertices in metres east and north of the origin.
    #[schemars(length(min = 3, max = 34), inner(inner(range(min = -MAX_M, max = MAX_M))))]
    pub outline: Vec<[f64; 2]>,
    /// Added to the weights of labels and of unexplored cells inside.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub weight: f64,
}

/// A destination as it is typed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DestinationOrder {
    /// Metres east and north of the origin; null withdraws the destination.
    // An absent place must not withdraw it.
    #[serde(deserialize_with = "Option::deserialize")]
    #[schemars(required, inner(range(min = -MAX_M, max = MAX_M)))]
    pub place: Option<[f64; 2]>,
}

impl From<&Areas> for AreasOrder {
    fn from(areas: &Areas) -> Self {
        let area = |area: &WeightedArea| AreaOrder {
            outline: vertices(&area.outline),
            weight: f64::from(area.weight) / 100.0,
        };
        Self { areas: areas.0.iter().map(area).collect() }
    }
}

impl From<&Destination> for DestinationOrder {
    fn from(destination: &Destination) -> Self {
        Self { place: destination.place.as_ref().map(vertex) }
    }
}

fn vertex(p: &DecimetrePoint) -> [f64; 2] {
    [p.to_world().east_m, p.to_world().north_m]
}

fn vertices(outline: &Polygon) -> Vec<[f64; 2]> {
    outline.0.iter().map(vertex).collect()
}

impl From<&Fence> for FenceOrder {
    fn from(fence: &Fence) -> Self {
        Self {
            fence: fence.fence.as_ref().map(vertices),
            keep_outs: fence.keep_outs.iter().map(vertices).collect(),
            return_point: fence.return_point.as_ref().map(vertex),
        }
    }
}

impl From<&Limits> for LimitsOrder {
    fn from(limits: &Limits) -> Self {
        let band = |b: Band| [f64::from(b.low_dm) / 10.0, f64::from(b.high_dm) / 10.0];
        let name = |r: Reaction| r.name().to_owned();
        Self {
            depth_m: limits.depth.map(band),
            altitude_m: limits.altitude.map(band),
            distance_m: limits.distance_m.map(f64::from),
            time_s: limits.time_s.map(f64::from),
            silence_s: limits.silence_s.map(f64::from),
            on_silence: limits.on_silence.map(name),
            on_breach: limits.on_breach.map(name),
            on_abort: limits.on_abort.map(name),
        }
    }
}

impl FenceOrder {
    /// Converts the order into the content of the slot.
    pub fn read(&self) -> Result<Fence, OrderRefusal> {
        Ok(fence_of(self.fence.as_deref(), &self.keep_outs, self.return_point)?)
    }
}

impl AreasOrder {
    /// Converts the order into the content of the slot.
    pub fn read(&self) -> Result<Areas, OrderRefusal> {
        let area = |(number, order): (usize, &AreaOrder)| {
            let outline = outline_of(&format!("area {number}"), &order.outline)?;
            Ok(WeightedArea { outline, weight: hundredths(Weighed::Area(number), order.weight)? })
        };
        let areas = Areas((1..).zip(&self.areas).map(area).collect::<Result<_, OrderRefusal>>()?);
        areas.check()?;
        Ok(areas)
    }
}

impl DestinationOrder {
    /// Converts the order into the content of the slot.
    pub fn read(&self) -> Result<Destination, OrderRefusal> {
        Ok(Destination { place: self.place.map(|p| place_of("place", p)).transpose()? })
    }
}

impl LimitsOrder {
    /// Converts the order into the content of the slot.
    pub fn read(&self) -> Result<Limits, OrderRefusal> {
        let limits = Limits {
            depth: self.depth_m.map(|b| band("depth_m", b)).transpose()?,
            altitude: self.altitude_m.map(|b| band("altitude_m", b)).transpose()?,
            distance_m: self.distance_m.map(|v| whole("distance_m", v, Limits::MAX)).transpose()?,
            time_s: self.time_s.map(|v| whole("time_s", v, Limits::MAX)).transpose()?,
            silence_s: self.silence_s.map(|v| whole("silence_s", v, u16::MAX.into())).transpose()?.map(|s| s as u16),
            on_silence: reaction("on_silence", self.on_silence.as_deref())?,
            on_breach: reaction("on_breach", self.on_breach.as_deref())?,
            on_abort: reaction("on_abort", self.on_abort.as_deref())?,
        };
        limits.check()?;
        Ok(limits)
    }
}

/// A weight of -1 to 1 as it is sent.
pub(crate) fn hundredths(what: Weighed, weight: f64) -> Result<i8, OrderRefusal> {
    let is_allowed = (-1.0..=1.0).contains(&weight);
    is_allowed.then_some((weight * 100.0).round() as i8).ok_or(OrderRefusal::Weight { what, weight })
}

fn band(what: &'static str, [low, high]: [f64; 2]) -> Result<Band, OrderRefusal> {
    let dm = |m: f64| {
        let dm = (m * 10.0).round();
        let ok = (0.0..=65_535.0).contains(&dm);
        ok.then_some(dm as u16).ok_or(OrderRefusal::Band { what, metres: m })
    };
    Ok(Band { low_dm: dm(low)?, high_dm: dm(high)? })
}

fn whole(what: &'static str, value: f64, most: u32) -> Result<u32, OrderRefusal> {
    let ok = (1.0..=f64::from(most)).contains(&value);
    ok.then_some(value.round() as u32).ok_or(OrderRefusal::Whole { what, value, most })
}

fn reaction(what: &'static str, name: Option<&str>) -> Result<Option<Reaction>, OrderRefusal> {
    let unknown = |name: &str| OrderRefusal::Reaction { what, name: name.to_owned() };
    let named = |name: &str| Reaction::from_name(name).ok_or_else(|| unknown(name));
    name.map(named).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fence(json: &str) -> Result<Fence, String> {
        serde_json::from_str::<FenceOrder>(json).map_err(|e| e.to_string())?.read().map_err(|e| e.to_string())
    }

    fn limits(json: &str) -> Result<Limits, String> {
        serde_json::from_str::<LimitsOrder>(json).map_err(|e| e.to_string())?.read().map_err(|e| e.to_string())
    }

    #[test]
    fn invalid_orders_are_refused_with_the_allowed_values() {
        let refused = |json: &str| fence(json).unwrap_err();
        assert_eq!(refused(r#"{"fence": [[0,0],[9,0]]}"#), "fence: 2 vertices: it takes 3 to 34");
        assert_eq!(refused(r#"{"fence": []}"#), "fence: 0 vertices: it takes 3 to 34");
        assert_eq!(refused(r#"{"fence": [[0,0],[9,9],[9,0],[0,9]]}"#), "fence: edge 1 crosses or touches edge 3");
        assert_eq!(refused(r#"{"fence": [[0,0],[1,1],[2,2]]}"#), "fence: it has no area");
        let degrees = refused(r#"{"fence": [[-4.15,50.34],[-4.13,50.34],[-4.13,50.36]]}"#);
        assert_eq!(
            degrees,
            "fence: it is smaller than a metre; it takes metres east and north of the origin, not degrees"
        );
        assert_eq!(
            refused(r#"{"fence": [[0,0],[9,0],[9,9]], "return_point": [0, 9]}"#),
            "return_point lies outside the fence"
        );
        assert!(refused(r#"{"fence": [[0,0],[1e9,0],[9,9]]}"#).contains("100 km"));
        assert!(refused(r#"{"fenze": []}"#).contains("unknown field"));
        assert_eq!(
            limits(r#"{"depth_m": [30, 10]}"#).unwrap_err(),
            "depth_m: the lowest value must be below the highest"
        );
        assert_eq!(limits(r#"{"time_s": 0}"#).unwrap_err(), "time_s 0: it takes 1 to 16777215");
        assert_eq!(
            limits(r#"{"on_silence": "panic"}"#).unwrap_err(),
            "on_silence \"panic\": it takes hold, return or surface"
        );
        assert!(limits(r#"{"altitude_m": [-1, 10]}"#).unwrap_err().contains("0 to 6553.5 m"));
    }

    #[test]
    fn areas_and_destinations_are_read_or_refused_with_the_limits() {
        let areas = |json: &str| serde_json::from_str::<AreasOrder>(json).unwrap().read();
        let sent = areas(r#"{"areas": [{"outline": [[0,0],[9.04,0],[9,9]], "weight": -0.255}]}"#).unwrap();
        assert_eq!((sent.0[0].outline.0[1], sent.0[0].weight), (DecimetrePoint::new(90, 0), -26));
        assert_eq!(AreasOrder::from(&sent).areas[0].weight, -0.26);
        let heavy = areas(r#"{"areas": [{"outline": [[0,0],[9,0],[9,9]], "weight": 1.5}]}"#);
        assert_eq!(heavy.unwrap_err().to_string(), "area 1: weight 1.5 is not within -1 to 1");
        let flat = areas(r#"{"areas": [{"outline": [[0,0],[1,1],[2,2]], "weight": 1}]}"#);
        assert_eq!(flat.unwrap_err().to_string(), "area 1: it has no area");
        let five = AreasOrder { areas: vec![AreasOrder::from(&sent).areas[0].clone(); 5] };
        assert_eq!(five.read().unwrap_err().to_string(), "5 areas: it takes 4 or fewer");
        let to = |place| DestinationOrder { place }.read();
        assert_eq!(to(Some([1.26, -3.0])).unwrap().place, Some(DecimetrePoint::new(13, -30)));
        assert_eq!(to(None), Ok(Destination::default()));
        assert!(to(Some([1e9, 0.0])).unwrap_err().to_string().contains("within 100 km"));
    }

    #[test]
    fn typed_orders_become_slots() {
        let sent =
            fence(r#"{"fence": [[0,0],[9.04,0],[9,9]], "keep_outs": [[[4,1],[5,1],[5,2]]], "return_point": [8,1]}"#);
        let sent = sent.unwrap();
        assert_eq!(sent.fence.unwrap().0[1], DecimetrePoint::new(90, 0));
        assert_eq!((sent.keep_outs.len(), sent.return_point), (1, Some(DecimetrePoint::new(80, 10))));
        assert_eq!(fence("{}"), Ok(Fence::default()), "lifts the fence");
        let sent = limits(r#"{"depth_m": [5, 40], "silence_s": 600, "on_silence": "return"}"#).unwrap();
        assert_eq!(sent.depth, Some(Band { low_dm: 50, high_dm: 400 }));
        assert_eq!((sent.silence_s, sent.on_silence), (Some(600), Some(Reaction::Return)));
    }
}
