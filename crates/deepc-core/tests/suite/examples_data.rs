//! Where the recordings shipped with the examples come from.

use std::fmt::Write as _;
use std::path::PathBuf;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A whole number from 0 to `limit` − 1. Arithmetic on whole numbers and products only, so that
/// every machine writes the same file.
fn draw(rng: &mut ChaCha8Rng, limit: u32) -> u32 {
    rng.next_u32() % limit
}

/// About Gaussian with standard deviation 1: the sum of twelve uniform numbers.
fn noise(rng: &mut ChaCha8Rng) -> f64 {
    (0..12)
        .map(|_| f64::from(draw(rng, 10_001)) / 10_000.0 - 0.5)
        .sum()
}

/// A room in winter, one row every 5 minutes for 40 hours: two heat stores (air and walls),
/// an electric heater of up to 3 kW and a fan that blows air in from outside. Somebody tries
/// out heater and fan, which is what makes the recording useful. Rows hold what was known at one
/// instant: the temperatures measured then, and what heater and fan are set to from then on.
fn heater_recording() -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(20_260_301);
    let mut text = String::from("time_s,heater_kw,fan,outdoor_c,room_c\n");
    let (mut air_c, mut wall_c, mut outdoor_c) = (19.0, 17.0, 4.0);
    let (mut heater_kw, mut fan) = (0.0, 0.0);
    for row in 0..480_u32 {
        if row % 3 == 0 {
            heater_kw = f64::from(draw(&mut rng, 7)) / 2.0;
        }
        if row % 4 == 0 {
            fan = f64::from(draw(&mut rng, 5)) / 4.0;
        }
        outdoor_c += 0.05 * (4.0 - outdoor_c) + 0.4 * noise(&mut rng);
        let outdoor_c = round(outdoor_c, 100.0);
        let room_c = round(air_c + 0.05 * noise(&mut rng), 100.0);
        writeln!(text, "{},{heater_kw},{fan},{outdoor_c},{room_c}", 300 * row)
            .expect("a string takes any text");
        for _ in 0..30 {
            // 10 s each; kW, kJ/K, kW/K.
            let fresh_kw = (0.03 + 0.08 * fan) * (outdoor_c - air_c);
            let through_walls_kw = 0.25 * (wall_c - air_c);
            air_c += 10.0 * (heater_kw + fresh_kw + through_walls_kw) / 600.0;
            wall_c += 10.0 * (0.04 * (outdoor_c - wall_c) - through_walls_kw) / 8000.0;
        }
    }
    text
}

fn round(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}

fn heater_file() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/data/heater.csv")
}

#[test]
fn the_heater_recording_is_what_its_recipe_gives() {
    let shipped = std::fs::read_to_string(heater_file()).expect("the example ships its recording");
    assert_eq!(shipped.replace("\r\n", "\n"), heater_recording());
}

#[test]
#[ignore = "writes examples/data/heater.csv; run it after changing the recipe"]
fn write_the_heater_recording() {
    std::fs::write(heater_file(), heater_recording()).expect("the folder is writable");
}
