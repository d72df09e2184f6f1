//! A picture of a terrain: its map, the road pulled straight, and what the wheels meet.

use anyhow::{Result, anyhow};
use base64::Engine;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use vehicle_dyn::road::Course;
use vehicle_dyn::terrain::Terrain;

use super::survey::{Station, Survey};
use crate::report::{FONT, GRID, INK, tick};

const SIZE: (u32, u32) = (1180, 1120);
/// Heights of the panels below the title, pixels.
const MAP_HEIGHT: u32 = 470;
const STRIP_HEIGHT: u32 = 190;
const PROFILE_HEIGHT: u32 = 210;
/// Room left and right of every panel's axes, pixels.
const LEFT: u32 = 70;
const RIGHT: u32 = 100;
/// How far beside the road the pictures reach, m.
const MAP_BESIDE_M: f64 = 45.0;
const STRIP_BESIDE_M: f64 = 4.0;
/// Image pixels to a pixel of the page.
const FINE: f64 = 2.0;
/// Least height that the colours tell from level, m.
const LEAST_SCALE_M: f64 = 0.01;

const LEFT_TRACK: RGBColor = RGBColor(213, 94, 0);
const RIGHT_TRACK: RGBColor = RGBColor(0, 114, 178);
const LOW: [f64; 3] = [24.0, 90.0, 165.0];
const LEVEL: [f64; 3] = [246.0, 245.0, 240.0];
const HIGH: [f64; 3] = [178.0, 60.0, 16.0];
const PAPER: [u8; 4] = [255, 255, 255, 0];

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
/// What is drawn of a station.
type Of = fn(&Station) -> f64;
type Pixels = (std::ops::Range<i32>, std::ops::Range<i32>);

/// Draws a terrain along a course as SVG.
pub(super) fn draw(
    title: &str,
    terrain: &Terrain,
    course: &Course,
    survey: &Survey,
) -> Result<String> {
    let mut svg = String::new();
    let images = {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        let view = View::new(terrain, course, survey);
        panels(&area, title, &view).map_err(|e| anyhow!("cannot draw the terrain: {e}"))?
    };
    insert_below(&mut svg, &images?)
}

/// Puts images under everything drawn but the background.
fn insert_below(svg: &mut String, images: &[String]) -> Result<String> {
    let background = svg
        .find("<rect")
        .and_then(|start| Some(start + svg[start..].find("/>")? + 2))
        .ok_or_else(|| anyhow!("the drawing has no background"))?;
    svg.insert_str(background, &images.concat());
    Ok(std::mem::take(svg))
}

struct View<'a> {
    terrain: &'a Terrain,
    course: &'a Course,
    survey: &'a Survey,
    /// Height of the strongest colour, m.
    scale_m: f64,
}

type Drawn<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn panels(area: &Area<'_>, title: &str, view: &View<'_>) -> Drawn<Result<Vec<String>>> {
    area.fill(&WHITE)?;
    let area = area.titled(title, (FONT, 20).into_font().color(&INK))?;
    let (map, rest) = area.split_vertically(MAP_HEIGHT);
    let (strip, rest) = rest.split_vertically(STRIP_HEIGHT);
    let (heights, slopes) = rest.split_vertically(PROFILE_HEIGHT);
    let images = vec![view.map(&map)?, view.strip(&strip)?, view.colour_bar(&map)?];
    view.heights(&heights)?;
    view.slopes(&slopes)?;
    area.present()?;
    Ok(images.into_iter().collect())
}

impl<'a> View<'a> {
    fn new(terrain: &'a Terrain, course: &'a Course, survey: &'a Survey) -> Self {
        let [low, high] = survey.range(|s| s.height_m);
        Self {
            terrain,
            course,
            survey,
            scale_m: round_up(low.abs().max(high.abs()).max(LEAST_SCALE_M)),
        }
    }

    /// The terrain from above, with the road's edges.
    fn map(&self, area: &Area<'_>) -> Drawn<Result<String>> {
        let lines = [0.5, -0.5].map(|side| self.edge(side * self.course.width_m()));
        let beside = 0.5 * self.course.width_m() + MAP_BESIDE_M;
        let around = |axis: fn(&(f64, f64)) -> f64| {
            let all = || lines.iter().flatten().map(axis);
            let low = all().fold(f64::INFINITY, f64::min) - beside;
            (low, all().fold(f64::NEG_INFINITY, f64::max) + beside)
        };
        let (x, y) = (around(|p| p.0), around(|p| p.1));
        let (x, y) = same_scale(area, x, y);
        let mut chart = chart(area, "The ground from above", x, y)?;
        mesh(&mut chart, "x, m", "y, m", TRANSPARENT)?;
        for line in lines {
            chart.draw_series(LineSeries::new(line, INK.stroke_width(1)))?;
        }
        let station =
            |text: String, at: (f64, f64)| Text::new(text, at, (FONT, 13).into_font().color(&INK));
        let every = spacing(self.course.total_length_m());
        let mut at = 0.0;
        while at <= self.course.total_length_m() {
            let p = self.course.point(at);
            let point = (p.x_m, p.y_m);
            chart.draw_series([Circle::new(point, 3, INK.filled())])?;
            let (sin, cos) = p.heading_rad.sin_cos();
            let beside = (p.x_m + 30.0 * sin, p.y_m - 30.0 * cos);
            chart.draw_series([station(format!("{at} m"), beside)])?;
            at += every;
        }
        let pixels = chart.plotting_area().get_pixel_range();
        Ok(self.image(&pixels, |u, v| {
            let (px, py) = (x.0 + u * (x.1 - x.0), y.0 + v * (y.1 - y.0));
            let ground = self.terrain.ground(px, py);
            let covered = ground.height_m != 0.0 || ground.gradient_x != 0.0;
            covered.then_some((ground.height_m, ground.gradient_x - ground.gradient_y))
        }))
    }

    /// The road pulled straight: station along, offset across, much stretched.
    fn strip(&self, area: &Area<'_>) -> Drawn<Result<String>> {
        let half = 0.5 * self.course.width_m();
        let (x, y) = (
            (0.0, self.course.total_length_m()),
            (-half - STRIP_BESIDE_M, half + STRIP_BESIDE_M),
        );
        let mut chart = chart(area, "The road pulled straight", x, y)?;
        mesh(
            &mut chart,
            "station, m",
            "offset to the left, m",
            TRANSPARENT,
        )?;
        for edge in [-half, half] {
            let line = [(x.0, edge), (x.1, edge)];
            chart.draw_series(LineSeries::new(line, INK.stroke_width(1)))?;
        }
        let pixels = chart.plotting_area().get_pixel_range();
        Ok(self.image(&pixels, |u, v| {
            let p = self.course.point(x.0 + u * (x.1 - x.0));
            let offset = y.0 + v * (y.1 - y.0);
            let (sin, cos) = p.heading_rad.sin_cos();
            let ground = self
                .terrain
                .ground(p.x_m - offset * sin, p.y_m + offset * cos);
            Some((ground.height_m, 0.0))
        }))
    }

    /// The meaning of the colours, right of the map.
    fn colour_bar(&self, area: &Area<'_>) -> Drawn<Result<String>> {
        let (width, height) = area.dim_in_pixel();
        let (left, top, tall) = (width - RIGHT + 24, 50, height - 130);
        let base = area.get_base_pixel();
        let spans = |start: i32, length: u32| start..start + length.cast_signed();
        let pixels = (
            spans(base.0 + left.cast_signed(), 18),
            spans(base.1 + top, tall),
        );
        let font = || (FONT, 13).into_font().color(&INK);
        for step in [-1.0, -0.5, 0.0, 0.5, 1.0] {
            // Within the panel.
            #[expect(clippy::cast_possible_truncation, reason = "pixels of a page")]
            let down = top + ((0.5 - 0.5 * step) * f64::from(tall)) as i32;
            let text = tick(step * self.scale_m);
            area.draw(&Text::new(
                text,
                (left.cast_signed() + 23, down - 6),
                font(),
            ))?;
        }
        area.draw(&Text::new(
            "height, m",
            (left.cast_signed() - 4, top - 24),
            font(),
        ))?;
        Ok(self.image(&pixels, |_, v| Some(((2.0 * v - 1.0) * self.scale_m, 0.0))))
    }

    fn heights(&self, area: &Area<'_>) -> Drawn<()> {
        let [low, high] = self.survey.range(|s| s.height_m);
        let room = 0.15 * (high - low).max(LEAST_SCALE_M);
        let y = (low - room, high + 4.0 * room);
        let x = (0.0, self.course.total_length_m());
        let mut chart = chart(area, "Height under the wheel tracks", x, y)?;
        mesh(&mut chart, "station, m", "height, m", GRID)?;
        let sides: [(&str, RGBColor, Of); 2] = [
            ("0.7 m left", LEFT_TRACK, |s| s.height_m[0]),
            ("0.7 m right", RIGHT_TRACK, |s| s.height_m[1]),
        ];
        for (name, colour, of) in sides {
            self.line(&mut chart, name, colour, of)?;
        }
        legend(&mut chart)
    }

    /// Cross slope, and the friction where it differs.
    fn slopes(&self, area: &Area<'_>) -> Drawn<()> {
        let [low, high] = self
            .survey
            .range(|s| [s.cross_slope_percent, s.cross_slope_percent]);
        let reach = low.abs().max(high.abs()).max(1.0) * 1.2;
        let x = (0.0, self.course.total_length_m());
        let [slippery, grippy] = self.survey.range(|s| s.friction);
        if grippy - slippery < 1e-6 {
            let caption = "Bank: cross slope between the tracks (the right side is lower where it is positive)";
            let mut chart = chart(area, caption, x, (-reach, reach))?;
            mesh(&mut chart, "station, m", "cross slope, %", GRID)?;
            return self.line(&mut chart, "", INK, |s| s.cross_slope_percent);
        }
        let (left, right) = area.split_horizontally(SIZE.0 / 2);
        let mut bank = chart(
            &left,
            "Bank: cross slope between the tracks",
            x,
            (-reach, reach),
        )?;
        mesh(&mut bank, "station, m", "cross slope, %", GRID)?;
        self.line(&mut bank, "", INK, |s| s.cross_slope_percent)?;
        let mut friction = chart(&right, "Friction under the tracks", x, (0.0, 1.5 * grippy))?;
        mesh(&mut friction, "station, m", "friction", GRID)?;
        self.line(&mut friction, "0.7 m left", LEFT_TRACK, |s| s.friction[0])?;
        self.line(&mut friction, "0.7 m right", RIGHT_TRACK, |s| s.friction[1])?;
        legend(&mut friction)
    }

    fn line(&self, chart: &mut Chart<'_, '_>, name: &str, colour: RGBColor, of: Of) -> Drawn<()> {
        let points = self.survey.stations.iter().map(|s| (s.station_m, of(s)));
        let drawn = chart.draw_series(LineSeries::new(points, colour.stroke_width(1)))?;
        if !name.is_empty() {
            drawn.label(name).legend(move |(x, y)| {
                PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(3))
            });
        }
        Ok(())
    }

    /// The road at an offset from its middle.
    fn edge(&self, offset: f64) -> Vec<(f64, f64)> {
        let total = self.course.total_length_m();
        // A course is at most 1e5 m long.
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "small"
        )]
        let count = (0.5 * total).ceil() as usize;
        let place = |i: usize| {
            let p = self.course.point(total * i as f64 / count as f64);
            let (sin, cos) = p.heading_rad.sin_cos();
            (p.x_m - offset * sin, p.y_m + offset * cos)
        };
        (0..=count).map(place).collect()
    }

    /// An image over a rectangle of the page. `at` gives height and light at a place that is given in
    /// shares of the width from the left and of the height from below; `None` stays empty.
    fn image(
        &self,
        (columns, rows): &Pixels,
        at: impl Fn(f64, f64) -> Option<(f64, f64)>,
    ) -> Result<String> {
        let (width, height) = (columns.end - columns.start, rows.end - rows.start);
        // Pixels of a page.
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "small"
        )]
        let [across, down] = [width, height].map(|n| (FINE * f64::from(n)) as u32);
        let mut pixels = Vec::with_capacity(4 * (across * down) as usize);
        for row in 0..down {
            for column in 0..across {
                let u = (f64::from(column) + 0.5) / f64::from(across);
                let v = 1.0 - (f64::from(row) + 0.5) / f64::from(down);
                pixels.extend(at(u, v).map_or(PAPER, |(z, light)| self.colour(z, light)));
            }
        }
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, across, down);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&pixels)?;
        writer.finish()?;
        let data = base64::engine::general_purpose::STANDARD.encode(file);
        Ok(format!(
            "\n<image x=\"{}\" y=\"{}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\" href=\"data:image/png;base64,{data}\"/>",
            columns.start, rows.start
        ))
    }

    /// Blue below, brown above level; slopes that face the light are brighter.
    fn colour(&self, height_m: f64, light: f64) -> [u8; 4] {
        let share = (height_m / self.scale_m).clamp(-1.0, 1.0);
        let end = if share < 0.0 { LOW } else { HIGH };
        let shade = 1.0 + (2.0 * light).clamp(-0.2, 0.2);
        let channel = |i: usize| {
            let value = (LEVEL[i] + (end[i] - LEVEL[i]) * share.abs()) * shade;
            // Clamped to a byte.
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "clamped"
            )]
            let byte = value.clamp(0.0, 255.0) as u8;
            byte
        };
        [channel(0), channel(1), channel(2), 255]
    }
}

fn chart<'a, 'b>(
    area: &'a Area<'b>,
    caption: &str,
    x: (f64, f64),
    y: (f64, f64),
) -> Drawn<Chart<'a, 'b>> {
    Ok(ChartBuilder::on(area)
        .margin_top(6)
        .margin_left(10)
        .margin_right(RIGHT)
        .caption(caption, (FONT, 15).into_font().color(&INK))
        .x_label_area_size(40)
        .y_label_area_size(LEFT)
        .build_cartesian_2d(x.0..x.1, y.0..y.1)?)
}

fn mesh(chart: &mut Chart<'_, '_>, x: &str, y: &str, lines: impl Into<RGBAColor>) -> Drawn<()> {
    let mut mesh = chart.configure_mesh();
    mesh.x_label_formatter(&|value| tick(*value))
        .y_label_formatter(&|value| tick(*value))
        .x_desc(x)
        .y_desc(y)
        .y_labels(6)
        .label_style((FONT, 13).into_font().color(&INK))
        .axis_desc_style((FONT, 14).into_font().color(&INK))
        .axis_style(INK.stroke_width(1))
        .bold_line_style(lines.into())
        .light_line_style(TRANSPARENT)
        .draw()?;
    Ok(())
}

fn legend<'a, 'b: 'a>(chart: &mut Chart<'a, 'b>) -> Drawn<()> {
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .label_font((FONT, 13).into_font().color(&INK))
        .background_style(WHITE.mix(0.85))
        .border_style(GRID)
        .draw()?;
    Ok(())
}

/// Widens one of two ranges so that a metre is as long along x as along y.
fn same_scale(area: &Area<'_>, x: (f64, f64), y: (f64, f64)) -> ((f64, f64), (f64, f64)) {
    let (width, height) = area.dim_in_pixel();
    let (wide, tall) = (f64::from(width - LEFT - RIGHT), f64::from(height - 80));
    let metre = ((x.1 - x.0) / wide).max((y.1 - y.0) / tall);
    let widen = |(low, high): (f64, f64), pixels: f64| {
        let more = 0.5 * (metre * pixels - (high - low));
        (low - more, high + more)
    };
    (widen(x, wide), widen(y, tall))
}

/// Distance of the marks along a course of some length, m.
fn spacing(total_m: f64) -> f64 {
    round_up(total_m / 12.0)
}

/// The next 1, 2 or 5 times a power of ten.
fn round_up(value: f64) -> f64 {
    let decade = 10.0_f64.powf(value.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|f| f * decade >= value);
    decade * factor.unwrap_or(10.0)
}
