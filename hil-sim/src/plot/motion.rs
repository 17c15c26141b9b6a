//! The panels of a trace over time, and the table of where it ended.

use plotters::style::RGBColor;

use super::geometry::{INTERVAL_95, Rect};
use super::panel::{Panel, Swatch, axis, legend, time_axis};
use super::scene::{Align, BLACK, GREY, Label, Pen, Scene, WHITE};
use super::{BLUE, PURPLE, VERMILLION, wrap};
use crate::trace::{Row, STATES};

/// Colours of the bands, in the order of [`STATES`]: they differ in lightness as well as in hue.
const STATE_COLORS: [RGBColor; 4] = [
    RGBColor(0xf0, 0xf0, 0xf0),
    RGBColor(0xb5, 0xdf, 0xf5),
    RGBColor(0xfb, 0xf5, 0xb8),
    RGBColor(0xf2, 0xc4, 0xa3),
];
const MEASURED: Pen = Pen::solid(BLUE, 2.0);
const REFERENCE: Pen = Pen::dashed(BLACK, 1.3);
const LEFT: Pen = Pen::solid(BLUE, 2.2);
const RIGHT: Pen = Pen::dashed(VERMILLION, 1.8);
/// Part of a panel's height that is kept free of lines, for the names on the bands.
const NAME_ROOM: f64 = 0.09;
const NAME_SIZE: f64 = 10.5;

/// Draws the three panels, one above the other.
pub(super) fn draw(scene: &mut Scene, place: Rect, rows: &[Row]) {
    let mut entries: Vec<(Swatch, String)> = vec![(Swatch::None, "State (bands):".into())];
    for (color, state) in STATE_COLORS.iter().zip(STATES) {
        entries.push((Swatch::Box(*color), state.into()));
    }
    let top = legend(scene, (place.x0, place.x1), place.y0, &entries) + 6.0;
    let height = (place.y1 - top) / 3.0;
    let part = |index: f64| {
        let y0 = top + index * height;
        // Room for the labels of the x axis.
        Rect::new(place.x0, y0, place.x1, y0 + height - 52.0)
    };
    let names = ["translation speed v_s", "reference v_s_ref"];
    let curves = [|row: &Row| row.v_s, |row: &Row| row.v_s_ref];
    let panel = speed_panel(scene, part(0.0), rows, names, curves, 0.05);
    panel.states(scene, rows, "speed [m/s]", |row| &row.move_state);
    panel.lines(scene, rows, curves);
    let names = ["rotation speed v_alpha", "reference v_alpha_ref"];
    let curves = [
        |row: &Row| row.v_alpha.to_degrees(),
        |row: &Row| row.v_alpha_ref.to_degrees(),
    ];
    let panel = speed_panel(scene, part(1.0), rows, names, curves, 5.0);
    panel.states(scene, rows, "speed [°/s]", |row| &row.turn_state);
    panel.lines(scene, rows, curves);
    duties(scene, part(2.0), rows);
}

type Curve = fn(&Row) -> f64;

/// A panel of a speed and its reference, whose bands come before its lines.
struct SpeedPanel(Panel);

fn speed_panel(
    scene: &mut Scene,
    place: Rect,
    rows: &[Row],
    names: [&str; 2],
    curves: [Curve; 2],
    least: f64,
) -> SpeedPanel {
    let entries = [
        (Swatch::Line(MEASURED), names[0].into()),
        (Swatch::Line(REFERENCE), names[1].into()),
    ];
    let top = legend(scene, (place.x0, place.x1), place.y0, &entries);
    let values = rows
        .iter()
        .flat_map(|row| curves.map(|curve| curve(row)))
        // Standing still is always part of the picture.
        .chain([0.0]);
    SpeedPanel(Panel {
        rect: Rect { y0: top, ..place },
        x: time_axis(rows.iter().map(|row| row.t)),
        y: axis(values, least, NAME_ROOM),
        headroom: NAME_ROOM,
    })
}

impl SpeedPanel {
    /// The bands, below the grid, and their names above it.
    fn states(&self, scene: &mut Scene, rows: &[Row], y_label: &str, state: fn(&Row) -> &String) {
        let samples = rows.iter().filter_map(|row| {
            let index = STATES.iter().position(|name| name == state(row))?;
            Some((row.t, index))
        });
        let rect = self.0.rect;
        let bands = self.0.bands(samples);
        for &(x0, x1, index) in &bands {
            scene.rect(Rect { x0, x1, ..rect }, STATE_COLORS[index], 1.0);
        }
        self.0.axes(scene, "time t [s]", y_label, false);
        for (x0, x1, index) in bands {
            let at = (0.5 * (x0 + x1), rect.y0 + 9.0);
            let mut label = Label::new(STATES[index], at, NAME_SIZE, Align::Center);
            label.color = GREY;
            if label.width() + 8.0 < x1 - x0 {
                scene.text(label);
            }
        }
    }

    fn lines(&self, scene: &mut Scene, rows: &[Row], curves: [Curve; 2]) {
        for (curve, pen) in curves.into_iter().zip([MEASURED, REFERENCE]) {
            let values = rows.iter().map(|row| (row.t, curve(row)));
            self.0.series(scene, values, pen);
        }
    }
}

fn duties(scene: &mut Scene, place: Rect, rows: &[Row]) {
    let fault = |row: &Row| row.fault != "none" && !row.fault.is_empty();
    let mut faults: Vec<&str> = Vec::new();
    for row in rows.iter().filter(|row| fault(row)) {
        if !faults.contains(&row.fault.as_str()) {
            faults.push(&row.fault);
        }
    }
    let mut entries = vec![
        (Swatch::Line(LEFT), String::from("left duty")),
        (Swatch::Line(RIGHT), String::from("right duty")),
    ];
    if !faults.is_empty() {
        let text = format!("fault: {}", faults.join(", "));
        entries.push((Swatch::Box(FAULT), text));
    }
    let top = legend(scene, (place.x0, place.x1), place.y0, &entries);
    let values = rows
        .iter()
        .flat_map(|row| [row.left_duty, row.right_duty])
        .chain([-1.0, 1.0]);
    let room = if faults.is_empty() {
        0.0
    } else {
        2.0 * NAME_ROOM
    };
    let panel = Panel {
        rect: Rect { y0: top, ..place },
        x: time_axis(rows.iter().map(|row| row.t)),
        y: axis(values, 2.0, room),
        headroom: room,
    };
    let samples = rows
        .iter()
        .map(|row| (row.t, fault(row).then_some(row.fault.as_str())));
    let bands = panel.bands(samples);
    for (x0, x1, name) in &bands {
        if name.is_some() {
            let (x0, x1) = (*x0, x1.max(x0 + 2.0));
            scene.rect(
                Rect {
                    x0,
                    x1,
                    ..panel.rect
                },
                FAULT,
                1.0,
            );
        }
    }
    panel.axes(scene, "time t [s]", "motor duty [-1..1]", false);
    panel.series(scene, rows.iter().map(|row| (row.t, row.left_duty)), LEFT);
    panel.series(scene, rows.iter().map(|row| (row.t, row.right_duty)), RIGHT);
    fault_names(scene, panel.rect, &bands);
}

/// A tint of the palette's purple.
const FAULT: RGBColor = RGBColor(0xe6, 0xbc, 0xd3);

/// Writes the names at the bands in two rows; a name without room there is still in the legend.
fn fault_names(scene: &mut Scene, rect: Rect, bands: &[(f64, f64, Option<&str>)]) {
    let mut free = [rect.x0 + 2.0; 2];
    for (x0, x1, name) in bands {
        let Some(name) = name else { continue };
        let label = Label::new(*name, (0.0, 0.0), NAME_SIZE, Align::Center);
        let mut label = label.fit(0.5 * rect.width());
        label.color = PURPLE;
        label.bold = true;
        let half = 0.5 * label.width() + 3.0;
        let middle = (0.5 * (x0 + x1)).clamp(rect.x0 + half, rect.x1 - half);
        let row = free.iter().position(|free| middle - half >= *free);
        if let Some(row) = row {
            label.at = (middle, rect.y0 + 10.0 + 15.0 * row as f64);
            free[row] = middle + half + 4.0;
            let (x, y) = label.at;
            let paper = Rect::new(x - half, y - 7.0, x + half, y + 7.0);
            scene.rect(paper, WHITE, 0.75);
            scene.text(label);
        }
    }
}

/// Draws where the run ended: true, estimated, and how far apart.
pub(super) fn table(scene: &mut Scene, place: Rect, row: &Row) {
    let error = [
        row.est_x - row.true_x,
        row.est_y - row.true_y,
        wrap(row.est_theta - row.true_theta),
    ];
    let bound = [row.cxx, row.cyy, row.ctt].map(|variance| INTERVAL_95 * variance.max(0.0).sqrt());
    let cells = |prefix: &str, pose: [f64; 3]| {
        [
            format!("{prefix}{:.4}", pose[0]),
            format!("{prefix}{:.4}", pose[1]),
            format!("{prefix}{:.2}", pose[2].to_degrees()),
        ]
    };
    let truth = [row.true_x, row.true_y, row.true_theta];
    let estimate = [row.est_x, row.est_y, row.est_theta];
    let header = ["x [m]", "y [m]", "heading [°]"].map(String::from);
    let lines = [
        (format!("At the end, t = {:.2} s", row.t), header, true),
        ("true pose".into(), cells("", truth), false),
        ("estimated pose".into(), cells("", estimate), false),
        ("estimated − true".into(), cells("", error), false),
        (
            "95 % bound of the estimate".into(),
            cells("±", bound),
            false,
        ),
    ];
    let row_height = place.height() / lines.len() as f64;
    let column = place.width() / 5.0;
    for (index, (name, cells, bold)) in lines.into_iter().enumerate() {
        let y = place.y0 + (index as f64 + 0.5) * row_height;
        let mut label = Label::new(name, (place.x0 + 4.0, y), 13.0, Align::Left);
        label.bold = bold;
        scene.text(label.fit(2.0 * column - 8.0));
        for (index, cell) in cells.into_iter().enumerate() {
            let at = (place.x0 + (index as f64 + 3.0) * column - 4.0, y);
            let mut label = Label::new(cell, at, 13.0, Align::Right);
            label.bold = bold;
            scene.text(label.fit(column - 12.0));
        }
        let y = place.y0 + (index as f64 + 1.0) * row_height;
        let width = if bold { 1.2 } else { 0.4 };
        scene.line(&[(place.x0, y), (place.x1, y)], Pen::solid(GREY, width));
    }
}
