//! A figure as a list of shapes.
//!
//! The shapes are collected first so that both backends get the same picture, and so that the tests can look for
//! overlapping or clipped text.

use std::sync::LazyLock;

use plotters::prelude::{FontDesc, FontFamily, FontStyle, FontTransform};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, RGBAColor, RGBColor, TextStyle, register_font};

use super::geometry::{Point, Rect, dash, length};

/// Width of a figure, in pixels.
pub(super) const WIDTH: u32 = 1400;
/// Height of a figure, in pixels.
pub(super) const HEIGHT: u32 = 1000;

/// A viewer of the SVG without the first font takes one of the same widths.
const FONT: &str = "DejaVu Sans,Bitstream Vera Sans,Verdana,sans-serif";
/// The height of a line, which is the size of a font for bitmaps, em.
pub(super) const BITMAP_FONT_SIZE: f64 = 1.164;

pub(super) const BLACK: RGBColor = RGBColor(0x20, 0x20, 0x20);
pub(super) const GREY: RGBColor = RGBColor(0x66, 0x66, 0x66);
pub(super) const WHITE: RGBColor = RGBColor(0xff, 0xff, 0xff);

/// The color as it would look on white paper with this opacity.
pub(super) fn pale(color: RGBColor, opacity: f64) -> RGBColor {
    let mix = |channel: u8| (255.0 - opacity * (255.0 - f64::from(channel))).round() as u8;
    RGBColor(mix(color.0), mix(color.1), mix(color.2))
}

/// How a line looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pen {
    pub color: RGBColor,
    pub width: f64,
    pub dashed: bool,
}

impl Pen {
    pub const fn solid(color: RGBColor, width: f64) -> Self {
        Self {
            color,
            width,
            dashed: false,
        }
    }

    pub const fn dashed(color: RGBColor, width: f64) -> Self {
        Self {
            color,
            width,
            dashed: true,
        }
    }
}

/// Where a text stands with respect to its point; vertically it is always centred.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Align {
    Left,
    Center,
    Right,
}

/// A line of text.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Label {
    pub text: String,
    pub at: Point,
    pub size: f64,
    pub align: Align,
    pub bold: bool,
    /// Read from below to above.
    pub vertical: bool,
    pub color: RGBColor,
}

impl Label {
    pub fn new(text: impl Into<String>, at: Point, size: f64, align: Align) -> Self {
        // Control characters have no glyph, and XML does not allow them.
        let text: String = text.into();
        let text = text.replace(char::is_control, " ");
        Self {
            text,
            at,
            size,
            align,
            bold: false,
            vertical: false,
            color: BLACK,
        }
    }

    fn font_style(&self) -> FontStyle {
        if self.bold {
            FontStyle::Bold
        } else {
            FontStyle::Normal
        }
    }

    pub fn width(&self) -> f64 {
        // Tenfold, because the layout is in whole pixels.
        let font = FontDesc::new(
            FontFamily::Name(FONT),
            self.size * BITMAP_FONT_SIZE * 10.0,
            self.font_style(),
        );
        let _ = FONTS.as_ref();
        font.box_size(&self.text)
            .map_or(0.0, |(width, _)| f64::from(width) / 10.0)
    }

    /// Makes the font smaller, and at last the text shorter, until it fits.
    pub fn fit(mut self, room: f64) -> Self {
        let smallest = 0.6 * self.size;
        while self.width() > room && self.size > smallest {
            self.size *= 0.95;
        }
        while self.width() > room && self.text.chars().count() > 1 {
            let kept = self.text.chars().count() - 2;
            self.text = self.text.chars().take(kept).chain(['…']).collect();
        }
        self
    }

    /// The style for a backend whose fonts are `scale` as large.
    pub fn style(&self, scale: f64) -> TextStyle<'_> {
        let horizontal = match self.align {
            Align::Left => HPos::Left,
            Align::Center => HPos::Center,
            Align::Right => HPos::Right,
        };
        let font = FontDesc::new(FontFamily::Name(FONT), self.size * scale, self.font_style());
        let font = if self.vertical {
            font.transform(FontTransform::Rotate270)
        } else {
            font
        };
        TextStyle::from(font)
            .color(&self.color)
            .pos(Pos::new(horizontal, VPos::Center))
    }

    /// The rectangle that the capitals and figures fill.
    #[cfg(test)]
    pub fn bounds(&self) -> Rect {
        let half = 0.5 * self.size;
        let start = match self.align {
            Align::Left => 0.0,
            Align::Center => -0.5 * self.width(),
            Align::Right => -self.width(),
        };
        let (x, y) = self.at;
        if self.vertical {
            Rect::new(x - half, y - start - self.width(), x + half, y - start)
        } else {
            Rect::new(x + start, y - half, x + start + self.width(), y + half)
        }
    }
}

/// Something to draw.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    Line(Vec<Point>, Pen),
    Area(Vec<Point>, RGBAColor),
    Text(Label),
}

/// A figure.
#[derive(Debug, Default)]
pub(super) struct Scene {
    pub shapes: Vec<Shape>,
}

impl Scene {
    pub fn line(&mut self, points: &[Point], pen: Pen) {
        if !pen.dashed {
            self.shapes.push(Shape::Line(points.to_vec(), pen));
            return;
        }
        // Very long lines get longer dashes, so that the file stays small.
        let on = (7.0f64).max(length(points) / 3000.0);
        for part in dash(points, on, 0.7 * on) {
            self.shapes.push(Shape::Line(part, pen));
        }
    }

    pub fn area(&mut self, points: Vec<Point>, color: RGBColor, opacity: f64) {
        if points.len() > 2 {
            self.shapes.push(Shape::Area(points, color.mix(opacity)));
        }
    }

    pub fn rect(&mut self, rect: Rect, color: RGBColor, opacity: f64) {
        self.area(corners(rect), color, opacity);
    }

    pub fn frame(&mut self, rect: Rect, pen: Pen) {
        let mut points = corners(rect);
        points.push(points[0]);
        self.line(&points, pen);
    }

    pub fn disc(&mut self, center: Point, radius: f64, color: RGBColor) {
        self.area(circle(center, radius), color, 1.0);
    }

    pub fn text(&mut self, label: Label) {
        self.shapes.push(Shape::Text(label));
    }
}

fn corners(rect: Rect) -> Vec<Point> {
    vec![
        (rect.x0, rect.y0),
        (rect.x1, rect.y0),
        (rect.x1, rect.y1),
        (rect.x0, rect.y1),
    ]
}

/// A circle as a polygon, closed.
pub(super) fn circle(center: Point, radius: f64) -> Vec<Point> {
    (0..=24)
        .map(|side| {
            let (sin, cos) = (f64::from(side) * std::f64::consts::TAU / 24.0).sin_cos();
            (center.0 + radius * cos, center.1 + radius * sin)
        })
        .collect()
}

pub(super) static FONTS: LazyLock<Result<(), String>> = LazyLock::new(|| {
    let fonts = [
        (FontStyle::Normal, dejavu::sans::regular()),
        (FontStyle::Bold, dejavu::sans::bold()),
    ];
    for (style, bytes) in fonts {
        register_font(FONT, style, bytes)
            .map_err(|_| String::from("the embedded font is damaged"))?;
    }
    Ok(())
});
