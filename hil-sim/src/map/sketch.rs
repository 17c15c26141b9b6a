//! A map as the base tells it: the rows of GetMap, drawn as seen from the first place.

use crate::plot::{Chart, Ink, Mark};
use anyhow::{Context, Result, anyhow, ensure};
use vehicle_controller::map::{Cylinder, Disc, Gaussian, Heading, Map, PlaceId};

/// What GetMap told once.
#[derive(Clone, Debug, Default)]
pub struct Sketch {
    map: Map,
}

/// Takes a word of a row for a number.
fn number(word: Option<&&str>, row: &str) -> Result<f64> {
    let word = word.with_context(|| format!("too short: {row}"))?;
    word.parse().with_context(|| row.to_owned())
}

/// d β r, m and degrees.
fn disc(words: &[&str], row: &str) -> Result<Disc> {
    let at = |index: usize| number(words.get(index), row);
    let (distance, bearing) = (at(0)?, at(1)?.to_radians());
    Ok(Disc {
        x: distance * bearing.cos(),
        y: distance * bearing.sin(),
        radius: at(2)?,
    })
}

impl Sketch {
    /// Reads the rows that follow each `Map <places> <landmarks> <arcs> <anchor>` among the lines of a base.
    ///
    /// # Errors
    /// If a row is none.
    pub fn all<'a>(lines: impl IntoIterator<Item = &'a str>) -> Result<Vec<Self>> {
        let mut sketches: Vec<Self> = Vec::new();
        for line in lines {
            let words: Vec<&str> = line.split(' ').collect();
            if words.contains(&"Map") && !line.starts_with(['~', '!']) {
                sketches.push(Self::default());
            }
            let Some(sketch) = sketches.last_mut() else {
                continue;
            };
            match words.as_slice() {
                ["~", "place", name, meadow] => {
                    sketch.map.mark(name, number(Some(meadow), line)?)?;
                }
                ["~", "landmark", landmark, place, spot @ ..] => {
                    let place = sketch.find(place, line)?;
                    let spot = match spot {
                        [] => None,
                        spot => Some(disc(spot, line)?),
                    };
                    sketch.map.label(place, landmark, spot)?;
                }
                ["~", "arc", from, to, rest @ ..] => sketch.arc(from, to, rest, line)?,
                _ => {}
            }
        }
        Ok(sketches)
    }

    fn find(&self, place: &str, row: &str) -> Result<PlaceId> {
        let known = self.map.find(place);
        known.ok_or_else(|| anyhow!("no place: {row}"))
    }

    fn arc(&mut self, from: &str, to: &str, rest: &[&str], row: &str) -> Result<()> {
        let (from, to) = (self.find(from, row)?, self.find(to, row)?);
        let at = |index: usize| number(rest.get(index), row);
        let bound = Cylinder {
            disc: disc(rest, row)?,
            heading: Heading::new(at(3)?.to_radians(), at(4)?.to_radians()),
        };
        self.map
            .connect(from, to, &bound, &Gaussian::about(&bound))?;
        if let Ok(width) = at(5) {
            self.map.set_freeway(from, to, Some(width as f32))?;
        }
        Ok(())
    }

    /// Places and arcs.
    #[must_use]
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// The circle of each place that is known from the first one, by name.
    #[must_use]
    pub fn circles(&self) -> Vec<(String, Disc, f64)> {
        let first = self.map.places().next().map(|(id, _)| id);
        let circle = |id: PlaceId| Some(self.map.relation(first?, id)?.disc);
        let known = self
            .map
            .places()
            .filter_map(|(id, place)| Some((place.name.to_string(), circle(id)?, place.meadow)));
        known.collect()
    }

    /// A chart of it; `forward` is in the ink of forward reasoning.
    ///
    /// # Errors
    /// If there is no place.
    pub fn chart(&self, title: &str, forward: bool) -> Result<Chart> {
        let circles = self.circles();
        ensure!(!circles.is_empty(), "the map has no place");
        let ink = if forward { Ink::Bound } else { Ink::Left };
        let at = |id: PlaceId| {
            let name = self.map.place(id).map(|place| place.name.to_string())?;
            let (_, disc, _) = circles.iter().find(|(known, ..)| *known == name)?;
            Some([disc.x, disc.y])
        };
        let mut chart = Chart {
            title: title.to_owned(),
            has_axes: true,
            legend: vec![
                (ink, "circle of uncertainty".into()),
                (Ink::Meadow, "meadow".into()),
                (Ink::Frame, "arc".into()),
                (Ink::Truth, "freeway".into()),
            ],
            ..Chart::default()
        };
        for arc in self.map.arcs() {
            if let (Some(from), Some(to)) = (at(arc.from), at(arc.to)) {
                let ink = if arc.freeway.is_some() {
                    Ink::Truth
                } else {
                    Ink::Frame
                };
                chart.marks.push(Mark::Way(vec![from, to], ink));
            }
        }
        for (name, disc, meadow) in circles {
            let at = [disc.x, disc.y];
            chart.marks.push(Mark::Circle(at, meadow, Ink::Meadow));
            chart.marks.push(Mark::Circle(at, disc.radius, ink));
            chart.marks.push(Mark::Name(at, name));
        }
        Ok(chart)
    }
}
