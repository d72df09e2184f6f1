//! Finding the wheel loads that their own tyre forces bring about.

use nalgebra::{Matrix4, Vector4};

/// How much larger an error may get before what was learnt is forgotten.
const LARGEST_GROWTH: f64 = 2.0;

/// Broyden's method for the fixed point of the loads: every round corrects a matrix that says how an
/// error of the loads is to be answered.
///
/// It works on right less left and right plus left of both axles: a mirrored vehicle then has the same
/// sums, signs aside, and mirrored bits.
#[derive(Debug, Clone)]
pub(super) struct LoadSearch {
    /// `[R − L, R + L]` of the front, then of the rear axle, N.
    tried: Vector4<f64>,
    /// Step per error; the identity is plain repetition.
    answer: Matrix4<f64>,
    /// Error of the round before, and the step it led to, N.
    before: Option<(Vector4<f64>, Vector4<f64>)>,
}

fn split(loads: &[f64; 4]) -> Vector4<f64> {
    let [front_left, front_right, rear_left, rear_right] = loads;
    Vector4::new(
        front_right - front_left,
        front_right + front_left,
        rear_right - rear_left,
        rear_right + rear_left,
    )
}

impl LoadSearch {
    /// Begins with these loads: front left, front right, rear left, rear right, N.
    pub fn new(loads_n: [f64; 4]) -> Self {
        Self {
            tried: split(&loads_n),
            answer: Matrix4::identity(),
            before: None,
        }
    }

    /// Begins anew with the loads found last and what was learnt on the way.
    pub fn begin(&mut self) {
        self.before = None;
    }

    /// Loads to try next, N.
    pub fn loads_n(&self) -> [f64; 4] {
        let axle = |difference: f64, sum: f64| [0.5 * (sum - difference), 0.5 * (sum + difference)];
        let tried = &self.tried;
        let ([fl, fr], [rl, rr]) = (axle(tried[0], tried[1]), axle(tried[2], tried[3]));
        [fl, fr, rl, rr]
    }

    /// Takes in what the tried loads led to; returns the largest difference between both, N.
    pub fn take(&mut self, found_n: &[f64; 4]) -> f64 {
        let error = split(found_n) - self.tried;
        if let Some((error_before, step)) = self.before {
            if error.amax() > LARGEST_GROWTH * error_before.amax() {
                self.answer = Matrix4::identity();
            } else {
                let change = error_before - error;
                let answered = self.answer * change;
                let row = step.transpose() * self.answer;
                let scale = step.dot(&answered);
                // Otherwise nothing can be learnt from a step this small.
                if scale.abs() > f64::MIN_POSITIVE {
                    self.answer += (step - answered) * row / scale;
                }
            }
        }
        let step = self.answer * error;
        self.tried += step;
        self.before = Some((error, step));
        error.amax()
    }
}
