//! The writing of a figure as SVG or PNG.

use std::path::Path;

use anyhow::{Context, anyhow, bail};
use plotters::prelude::{BitMapBackend, DrawingBackend, SVGBackend};
use plotters::style::{Color, ShapeStyle};

use super::geometry::Point;
use super::scene::{BITMAP_FONT_SIZE, FONTS, HEIGHT, Pen, Scene, Shape, WHITE, WIDTH};

/// How a figure is written.
#[derive(Clone, Copy)]
pub enum Format {
    Svg,
    Png,
}

impl Format {
    /// The format that a file's extension asks for.
    pub fn of(path: &Path) -> anyhow::Result<Self> {
        let extension = path
            .extension()
            .map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => bail!("{}: a figure must be named *.svg or *.png", path.display()),
        }
    }
}

impl Scene {
    /// Writes the figure; the extension of the file chooses the format.
    pub fn save(&self, path: &Path) -> anyhow::Result<()> {
        let draw = match Format::of(path)? {
            Format::Svg => Self::svg,
            Format::Png => Self::png,
        };
        FONTS.as_ref().map_err(|error| anyhow!("{error}"))?;
        draw(self, path).with_context(|| format!("cannot write the figure {}", path.display()))
    }

    fn svg(&self, path: &Path) -> anyhow::Result<()> {
        let mut text = String::new();
        let mut backend =
            SVGBackend::with_string(&mut text, (WIDTH * SVG.scale, HEIGHT * SVG.scale));
        self.draw(&mut backend, &SVG)?;
        drop(backend);
        let scaled = format!(
            "width=\"{}\" height=\"{}\"",
            WIDTH * SVG.scale,
            HEIGHT * SVG.scale
        );
        let size = format!(
            "width=\"{WIDTH}\" height=\"{HEIGHT}\" stroke-linejoin=\"round\" text-rendering=\"geometricPrecision\""
        );
        // What is the default, and what separates nothing, makes a tenth of the file.
        let text = text
            .replacen(&scaled, &size, 1)
            .replace(" opacity=\"1\"", "");
        std::fs::write(path, text.replace(" \"/>", "\"/>"))?;
        Ok(())
    }

    fn png(&self, path: &Path) -> anyhow::Result<()> {
        let (width, height) = (WIDTH * BITMAP.scale, HEIGHT * BITMAP.scale);
        let mut pixels = vec![0xff; width as usize * height as usize * 3];
        let mut large = BitMapBackend::with_buffer(&mut pixels, (width, height));
        self.draw(&mut large, &BITMAP)?;
        drop(large);
        // The backend would hide why a file cannot be created.
        std::fs::File::create(path)?;
        let mut backend = BitMapBackend::new(path, (WIDTH, HEIGHT));
        drawn(backend.blit_bitmap((0, 0), (WIDTH, HEIGHT), &average(&pixels)))?;
        drawn(backend.present())
    }

    fn draw<B: DrawingBackend>(&self, backend: &mut B, target: &Target) -> anyhow::Result<()> {
        let (width, height) = backend.get_size();
        let size = (width as i32, height as i32);
        drawn(backend.draw_rect((0, 0), size, &WHITE, true))?;
        for shape in &self.shapes {
            target.draw(backend, shape)?;
        }
        drawn(backend.present())
    }
}

/// What the backends do differently.
struct Target {
    /// Units of the backend per pixel of the figure.
    scale: u32,
    /// What plotters takes as the size of a font, em.
    font_size: f64,
    /// How much lower than plotters the text must be written for capitals to be centred, em.
    drop: f64,
    /// Whether lines must be drawn one segment at a time: at a sharp corner the rasterizer would draw a spike.
    segments: bool,
}

/// The scale makes the backend's whole numbers tenths of pixels; plotters divides font sizes by 1.24.
const SVG: Target = Target {
    scale: 10,
    font_size: 1.24,
    drop: 0.09,
    segments: false,
};

/// Drawn larger and averaged, because the backend places everything at whole pixels. The size of a font is the height
/// of its lines, 1.164 em for DejaVu Sans.
const BITMAP: Target = Target {
    scale: 3,
    font_size: BITMAP_FONT_SIZE,
    drop: 0.25,
    segments: true,
};

/// The backends' errors do not fit the bounds of anyhow's.
fn drawn<E: std::fmt::Display>(result: Result<(), E>) -> anyhow::Result<()> {
    result.map_err(|error| anyhow!("{error}"))
}

impl Target {
    fn pixel(&self, point: Point) -> (i32, i32) {
        let scale = f64::from(self.scale);
        (
            (point.0 * scale).round() as i32,
            (point.1 * scale).round() as i32,
        )
    }

    fn draw<B: DrawingBackend>(&self, backend: &mut B, shape: &Shape) -> anyhow::Result<()> {
        match shape {
            Shape::Line(points, pen) => self.draw_line(backend, points, *pen),
            Shape::Area(points, color) => {
                let points = points.iter().map(|point| self.pixel(*point));
                drawn(backend.fill_polygon(points, color))
            }
            Shape::Text(label) => {
                let shift = self.drop * label.size;
                let (x, y) = label.at;
                let at = if label.vertical {
                    (x + shift, y)
                } else {
                    (x, y + shift)
                };
                let style = label.style(self.font_size * f64::from(self.scale));
                drawn(backend.draw_text(&label.text, &style, self.pixel(at)))
            }
        }
    }

    fn draw_line<B: DrawingBackend>(
        &self,
        backend: &mut B,
        points: &[Point],
        pen: Pen,
    ) -> anyhow::Result<()> {
        let width = (pen.width * f64::from(self.scale)).round().max(1.0) as u32;
        let style = ShapeStyle {
            color: pen.color.to_rgba(),
            filled: false,
            stroke_width: width,
        };
        let pixels = points.iter().map(|point| self.pixel(*point));
        if !self.segments {
            return drawn(backend.draw_path(pixels, &style));
        }
        let pixels: Vec<_> = pixels.collect();
        for pair in pixels.windows(2) {
            drawn(backend.draw_line(pair[0], pair[1], &style))?;
        }
        // Round corners fill the gaps between the segments of a wide line.
        if width > 3 && pixels.len() > 2 {
            for corner in &pixels[1..pixels.len() - 1] {
                drawn(backend.draw_circle(*corner, width / 2, &style, true))?;
            }
        }
        Ok(())
    }
}

/// The mean of every square of supersampled pixels.
fn average(pixels: &[u8]) -> Vec<u8> {
    let factor = BITMAP.scale as usize;
    let (width, height) = (WIDTH as usize, HEIGHT as usize);
    let row = width * factor * 3;
    let mut small = Vec::with_capacity(width * height * 3);
    for y in 0..height {
        for x in 0..width {
            for channel in 0..3 {
                let sum: usize = (0..factor * factor)
                    .map(|sample| {
                        let (dx, dy) = (sample % factor, sample / factor);
                        let at = (y * factor + dy) * row + (x * factor + dx) * 3 + channel;
                        usize::from(pixels[at])
                    })
                    .sum();
                small.push((sum / (factor * factor)) as u8);
            }
        }
    }
    small
}
