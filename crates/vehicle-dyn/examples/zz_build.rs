//! x
use vehicle_dyn::road::*;
use vehicle_dyn::terrain::*;
fn main() {
    let s: toml::Table = std::fs::read_to_string("/work/h1/scenarios/sedan-s1.toml")
        .unwrap()
        .parse()
        .unwrap();
    let d: CourseDescription = s["course"].clone().try_into().unwrap();
    let t = std::time::Instant::now();
    let c = Course::new(&d).unwrap();
    println!("course {:?}", t.elapsed());
    let extra = std::env::args().nth(1).unwrap_or_default();
    let g: GroundDescription = toml::from_str(&format!(
        r#"friction = 0.85
{extra}"#
    ))
    .unwrap();
    for _ in 0..3 {
        let t = std::time::Instant::now();
        let mut n = 0;
        let te = Terrain::build_with(&g, &c, &mut |_, k| {
            n = k;
            std::ops::ControlFlow::Continue(())
        })
        .unwrap();
        println!(
            "{n} tiles {:?} {}",
            t.elapsed(),
            te.ground(100., 0.).height_m
        );
        let t = std::time::Instant::now();
        let w = te.write(std::io::Cursor::new(Vec::new())).unwrap();
        println!("write {:?} {} bytes", t.elapsed(), w.into_inner().len());
    }
}
