//! The past window: the last `T_ini` samples.

use faer::{Mat, MatRef};

/// The last `T_ini` samples, oldest first, and which of them were repaired.
#[derive(Debug, Clone)]
pub(super) struct Window {
    inputs: Mat<f64>,
    disturbances: Mat<f64>,
    outputs: Mat<f64>,
    repaired: Vec<bool>,
    filled: usize,
}

impl Window {
    pub fn new(length: usize, inputs: usize, disturbances: usize, outputs: usize) -> Self {
        Self {
            inputs: Mat::zeros(length, inputs),
            disturbances: Mat::zeros(length, disturbances),
            outputs: Mat::zeros(length, outputs),
            repaired: vec![false; length],
            filled: 0,
        }
    }

    /// Appends a sample and drops the oldest. Lengths must fit.
    pub fn push(&mut self, input: &[f64], disturbance: &[f64], output: &[f64], repaired: bool) {
        for (series, sample) in [
            (&mut self.inputs, input),
            (&mut self.disturbances, disturbance),
            (&mut self.outputs, output),
        ] {
            for (channel, &value) in sample.iter().enumerate() {
                let column = series.col_as_slice_mut(channel);
                column.copy_within(1.., 0);
                if let Some(newest) = column.last_mut() {
                    *newest = value;
                }
            }
        }
        self.repaired.copy_within(1.., 0);
        if let Some(newest) = self.repaired.last_mut() {
            *newest = repaired;
        }
        self.filled = (self.filled + 1).min(self.repaired.len());
    }

    pub fn is_full(&self) -> bool {
        self.filled == self.repaired.len()
    }

    pub fn clear(&mut self) {
        self.filled = 0;
        self.repaired.fill(false);
    }

    /// What is known of the past inputs: at most `T_ini` rows, the newest last.
    pub fn inputs(&self) -> MatRef<'_, f64> {
        self.known(&self.inputs)
    }

    /// The same of the disturbances.
    pub fn disturbances(&self) -> MatRef<'_, f64> {
        self.known(&self.disturbances)
    }

    /// The same of the outputs.
    pub fn outputs(&self) -> MatRef<'_, f64> {
        self.known(&self.outputs)
    }

    fn known<'a>(&self, series: &'a Mat<f64>) -> MatRef<'a, f64> {
        series.subrows(self.repaired.len() - self.filled, self.filled)
    }

    pub fn repaired_samples(&self) -> usize {
        self.repaired.iter().filter(|&&repaired| repaired).count()
    }
}

#[cfg(test)]
mod tests {
    use faer::mat;

    use super::*;

    #[test]
    fn the_window_holds_the_newest_samples_oldest_first() {
        let mut window = Window::new(2, 1, 1, 2);
        window.push(&[1.0], &[0.1], &[10.0, 100.0], false);
        assert!(!window.is_full());
        assert_eq!(window.outputs(), mat![[10.0, 100.0]]);
        window.push(&[2.0], &[0.2], &[20.0, 200.0], true);
        assert!(window.is_full());
        window.push(&[3.0], &[0.3], &[30.0, 300.0], false);
        assert_eq!(window.inputs(), mat![[2.0], [3.0]]);
        assert_eq!(window.disturbances(), mat![[0.2], [0.3]]);
        assert_eq!(window.outputs(), mat![[20.0, 200.0], [30.0, 300.0]]);
        assert_eq!(window.repaired_samples(), 1);
        window.push(&[4.0], &[0.4], &[40.0, 400.0], false);
        assert_eq!(window.repaired_samples(), 0);
    }
}
