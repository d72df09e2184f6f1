//! The ground under the wheels: height, gradient and friction by position.

use nalgebra::Vector3;

/// The ground at one point: a plane in first order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// Height, m.
    pub height_m: f64,
    /// Slope along world x (no unit).
    pub gradient_x: f64,
    /// Slope along world y (no unit).
    pub gradient_y: f64,
    /// Friction of the road `mu_road` (no unit).
    pub friction: f64,
}

impl Ground {
    /// Unit normal of the ground plane, pointing up, in world axes.
    #[must_use]
    pub fn normal(&self) -> Vector3<f64> {
        let (gx, gy) = (self.gradient_x, self.gradient_y);
        let scale = 1.0 / (1.0 + gx * gx + gy * gy).sqrt();
        Vector3::new(-gx * scale, -gy * scale, scale)
    }
}

/// A terrain that wheels can stand on.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Terrain {
    /// A plane `z = height + gradient · (x, y)` of uniform friction; level ground has gradient 0.
    Plane(Ground),
}

impl Terrain {
    /// Level ground at height 0 of uniform friction.
    #[must_use]
    pub fn flat(friction: f64) -> Self {
        Self::Plane(Ground {
            height_m: 0.0,
            gradient_x: 0.0,
            gradient_y: 0.0,
            friction,
        })
    }

    /// The ground at world position (`x_m`, `y_m`).
    #[must_use]
    #[inline]
    pub fn ground(&self, x_m: f64, y_m: f64) -> Ground {
        match self {
            Self::Plane(plane) => Ground {
                height_m: plane.height_m + plane.gradient_x * x_m + plane.gradient_y * y_m,
                ..*plane
            },
        }
    }
}
