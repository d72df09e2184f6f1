//! The moving world: vehicle, tyres, ground, road and driver. Knows no controller.
//!
//! # The problem
//! A vehicle is data ([`parameters::VehicleParameters`], a TOML file); a simulation of it maps
//!
//! ```text
//! command  (handwheel angle, target speed)                  2 numbers per 10 ms tick
//! state    position 3, orientation 4, velocity 3, rate 3,   38 numbers, integrated by RK4 in
//!          wheel travel 4 + 4, wheel spin 4, slip 8,        1 ms steps
//!          steering 2, powertrain 3
//! output   observation: pose, speeds, wheel loads 4, LTR
//! ```
//!
//! with 14 degrees of freedom: six of the sprung body, the travel of four wheels and their spin.
//! [`paper_model`] is a second, far simpler plant with the same command: the paper's own equations.
//!
//! ```
//! use vehicle_dyn::simulation::{Command, InitialPose, Simulation};
//! use vehicle_dyn::terrain::Terrain;
//!
//! let sedan = vehicle_dyn::vehicles::embedded("sedan")?;
//! let pose = InitialPose { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0, speed_m_s: 25.0 };
//! let mut simulation = Simulation::new(&sedan, Terrain::flat(0.85), pose)?;
//! let mut seen = simulation.observation();
//! for _ in 0..100 {
//!     seen = simulation.step(Command::from_deg_kmh(20.0, 90.0), 0.01)?;
//! }
//! assert!(seen.yaw_rate_rad_s > 0.0 && seen.ltr > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Conventions
//! SI units (rad, m, s, kg, N) unless a name says otherwise. Axes ISO 8855: x forward, y left, z
//! up. A left turn has steering angle, yaw rate, lateral acceleration, roll angle (right side
//! down) and LTR all positive. Wheels: front left, front right, rear left, rear right.
//!
//! # What is checked, and what is not
//! Tests hold statics, symmetry, energy and momentum, the tyre law, the tilt table and the
//! convergence of the integrator: the equations are solved right. Up to the first lifted wheel the vehicle is
//! held against an independent multi-body model with three of its parameter sets, converted by fixed rules:
//! yaw rate within 1 % in the linear range, roll and LTR per lateral acceleration within 5 %, responses to
//! 1 Hz but the phase of LTR (`docs/vehicle-validation.md`). No measurement of a real vehicle was at hand.
//! [`paper_model`] shares the tyre law but no chassis equation: with a vehicle reduced to what both know,
//! the two plants agree to 2 % up to 2 Hz and in their roll poles.
//!
//! Nothing validates the motion after wheels have lifted: no reference for it was at hand. A wheel
//! without load loses its slip within about 10 ms ([`wheels`]), and touches down with none. The
//! car's body never touches the ground; a run should end at 60° of roll.
//!
//! Known simplifications: rolling resistance brakes the wheel's spin, but its moment on the body
//! (load times coefficient times radius, about 40 N m on the sedan) is left out of the pitch. The
//! jacking forces of a steered wheel miss a term in the energy balance that is proportional to the
//! sine of the steering angle ([`suspension::AxleSuspension::forces_n`]). The links' guidance moves the
//! contact points sideways for the slip and for the jacking forces, but where the load acts stays under the
//! hub, which is fixed sideways in the body: with a roll centre at the height h this leaves out a moment of
//! the load times h times the roll angle, up to 5 % of LTR.

pub mod chassis;
pub mod driver;
pub mod manoeuvre;
pub mod metrics;
pub mod paper_model;
pub mod parameters;
pub mod powertrain;
pub mod road;
pub mod sensors;
pub mod simulation;
pub mod steering;
pub mod suspension;
pub mod terrain;
pub mod tyre;
pub mod units;
pub mod vehicles;
pub mod wheels;
