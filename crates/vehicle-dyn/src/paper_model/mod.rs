//! The paper's own vehicle model: five chassis equations with all wheels on the ground.
