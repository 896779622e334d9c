//! A rectangle of the survey.

/// Limits of the survey, metres from the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    pub west: f64,
    pub south: f64,
    pub east: f64,
    pub north: f64,
}

impl Area {
    /// The area without a border of `margin` metres, at least its middle.
    pub fn shrunk(&self, margin: f64) -> Self {
        let (cx, cy) = ((self.west + self.east) / 2.0, (self.south + self.north) / 2.0);
        Self {
            west: (self.west + margin).min(cx),
            south: (self.south + margin).min(cy),
            east: (self.east - margin).max(cx),
            north: (self.north - margin).max(cy),
        }
    }

    pub fn moved(&self, east_m: f64, north_m: f64) -> Self {
        Self {
            west: self.west + east_m,
            south: self.south + north_m,
            east: self.east + east_m,
            north: self.north + north_m,
        }
    }

    /// Whether a place lies inside or on the edge.
    pub fn contains(&self, (x, y): (f64, f64)) -> bool {
        (self.west..=self.east).contains(&x) && (self.south..=self.north).contains(&y)
    }
}
