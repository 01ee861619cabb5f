//! Sums over pairs of values.

/// Sums over pairs (x, y).
#[derive(Default)]
pub(super) struct Sums {
    pub(super) count: f64,
    x: f64,
    y: f64,
    pub(super) xx: f64,
    pub(super) xy: f64,
    pub(super) yy: f64,
}

impl Sums {
    pub(super) fn add(&mut self, x: f64, y: f64) {
        let own = Self {
            count: 1.0,
            x,
            y,
            xx: x * x,
            xy: x * y,
            yy: y * y,
        };
        self.plus(&own);
    }

    pub(super) fn plus(&mut self, other: &Self) {
        self.count += other.count;
        self.x += other.x;
        self.y += other.y;
        self.xx += other.xx;
        self.xy += other.xy;
        self.yy += other.yy;
    }

    /// Sums of the deviations from the means.
    pub(super) fn centred(self) -> Self {
        let (x, y) = (self.x / self.count, self.y / self.count);
        Self {
            count: self.count,
            x: 0.0,
            y: 0.0,
            xx: self.xx - self.count * x * x,
            xy: self.xy - self.count * x * y,
            yy: self.yy - self.count * y * y,
        }
    }

    /// The correlation of pairs about 0; 0 where one of them is 0 throughout.
    pub(super) fn correlation(&self) -> f64 {
        match self.xx * self.yy > 0.0 {
            true => self.xy / (self.xx * self.yy).sqrt(),
            false => 0.0,
        }
    }

    /// Slope of the line through the origin, and the root mean square of the residuals.
    pub(super) fn line(&self) -> Option<(f64, f64)> {
        let slope = self.xy / self.xx;
        let left = ((self.yy - slope * self.xy).max(0.0) / self.count).sqrt();
        (self.xx > 0.0 && self.yy > 0.0 && slope.is_finite()).then_some((slope, left))
    }
}
