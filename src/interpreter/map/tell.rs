//! What is known of the map as text.

use crate::interpreter::reply;
use crate::interpreter::text::Text;
use crate::map::{Arc, Disc, Landmark, Place, There};
use crate::params::DEGREES;

/// `yes-maybe` or `no`, and the probability.
pub(super) fn there(text: &mut Text, there: &There) {
    text.word(if there.is_plausible {
        "yes-maybe"
    } else {
        "no"
    });
    match there.probability {
        Some(probability) => text.fixed(probability.into(), 3),
        None => text.word("-"),
    };
}

/// `~ place <name> <meadow>`.
pub(super) fn place(text: &mut Text, place: &Place) {
    text.str("~ place").word(&place.name).fixed(place.meadow, 3);
}

/// `~ landmark <name> <place> d β r`, or without the figures.
pub(super) fn landmark(text: &mut Text, place: &Place, landmark: &Landmark) {
    text.str("~ landmark")
        .word(&landmark.name)
        .word(&place.name);
    if let Some(spot) = &landmark.spot {
        disc(text, spot);
    }
}

fn disc(text: &mut Text, disc: &Disc) {
    text.fixed(disc.distance(), 4)
        .fixed(disc.bearing() * DEGREES, 3)
        .fixed(disc.radius, 4);
}

/// `~ arc <from> <to> d β r η α <freeway> x y θ Cxx Cxy Cxθ Cyy Cyθ Cθθ`.
pub(super) fn arc(text: &mut Text, arc: &Arc, from: &str, to: &str) {
    let heading = &arc.bound.heading;
    disc(text.str("~ arc").word(from).word(to), &arc.bound.disc);
    text.fixed(heading.centre() * DEGREES, 3)
        .fixed(heading.half() * DEGREES, 3);
    match arc.freeway {
        Some(width) => text.fixed(width.into(), 3),
        None => text.word("-"),
    };
    let [x, y, theta] = arc.likely.mean.map(f64::from);
    let [xx, xy, xt, yy, yt, tt] = arc.likely.covariance.map(f64::from);
    text.fixed(x, 4).fixed(y, 4);
    reply::heading(text, theta);
    text.scientific(xx)
        .scientific(xy)
        .scientific(xt * DEGREES)
        .scientific(yy)
        .scientific(yt * DEGREES)
        .scientific(tt * DEGREES * DEGREES);
}
