//! Standard manoeuvres as data, run on a vehicle, with the figures of merit of their standards.
