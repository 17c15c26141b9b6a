//! The map: places and arcs in fixed memory, forward and backward reasoning, routes and crossings.

mod common;
mod mapped;

use common::Random;
use mapped::{Pose, bound_about, disc_about, holds, sample, usual_motion, within};
use std::f64::consts::FRAC_PI_2;
use vehicle_controller::map::{
    Contradiction, Crossing, Cylinder, Disc, Gaussian, Heading, Journey, JourneyError, Leg, Map,
    MapError, Motion, PlaceId, crossing,
};

/// 1 m after a quarter turn, with the paper's ±5° and ±5 cm.
const SIDE: Motion = Motion {
    turn: FRAC_PI_2,
    turn_bound: 0.087_266_46,
    nearest: 0.95,
    farthest: 1.05,
};

/// 2 m straight ahead, exactly.
const AHEAD: Motion = Motion {
    turn: 0.0,
    turn_bound: 0.0,
    nearest: 2.0,
    farthest: 2.0,
};

fn bound(motion: &Motion) -> Cylinder {
    Cylinder::of_motion(motion).unwrap()
}

/// Whoever is in a meadow about the start, facing as at the start within `half`.
fn in_meadow(radius: f64, half: f64) -> Cylinder {
    Cylinder {
        disc: Disc::about(radius),
        heading: Heading::new(0.0, half),
    }
}

fn connect<const P: usize, const A: usize>(
    map: &mut Map<P, A>,
    from: PlaceId,
    to: PlaceId,
    bound: &Cylinder,
) -> Result<(), MapError> {
    map.connect(from, to, bound, &Gaussian::about(bound))
}

fn square() -> Journey {
    let mut journey = Journey::new();
    for _ in 0..4 {
        journey.go(&bound(&SIDE)).unwrap();
    }
    journey
}

#[test]
fn figure_4_after_a_square_it_is_plausible_to_be_back() {
    let journey = square();
    let mut map: Map = Map::new();
    let start = map.mark("start", 0.2).unwrap();
    let elsewhere = map.mark("elsewhere", 0.2).unwrap();
    connect(&mut map, start, elsewhere, &bound(&AHEAD)).unwrap();
    let is_there = |here, place| map.is_plausible(start, &here, place, Heading::ANY);
    assert!(is_there(journey.here(), start));
    // 2 m away is further than 0.70 m and the meadow.
    assert!(!is_there(journey.here(), elsewhere));
    // Nor was it so after one side, or two.
    for stop in &journey.bounds()[..2] {
        assert!(!is_there(*stop, start), "{stop:?}");
    }
    // Back, but facing the other way: excluded by the heading, which is known to 20°.
    assert!(!map.is_plausible(start, &journey.here(), start, Heading::new(3.0, 0.5)));
}

#[test]
fn figure_5_a_landmark_shrinks_the_circles_before() {
    let mut journey = square();
    let before = journey.bounds().to_vec();
    let shrunk = journey.confirm(&in_meadow(0.2, SIDE.turn_bound)).unwrap();
    let after = journey.bounds();
    let radius = |bound: &Cylinder| bound.disc.radius;
    // The confirmed place and the one before; the second one's circle was 0.29 m and is no smaller.
    assert_eq!(shrunk, 2);
    assert!((radius(&after[3]) - 0.2).abs() < 1e-9);
    // In closed form: the meadow 0.2, the arc's own circle r, and d sin 5° of it twice, inverted and turned; the intersection is smaller still.
    let arc = bound(&SIDE);
    let [d, r] = [arc.disc.distance(), arc.disc.radius];
    let cascade = 0.2 + r + d * 5_f64.to_radians().sin() * (1.0 + 5_f64.to_radians().cos());
    println!(
        "third place: {} before, {cascade} cascaded, {} after",
        radius(&before[2]),
        radius(&after[2])
    );
    assert!(radius(&after[2]) <= cascade + 1e-9);
    assert!(radius(&after[2]) < 0.95 * radius(&before[2]));
    assert_eq!(after[..2], before[..2]);
    // Again it tells nothing new.
    assert_eq!(journey.confirm(&in_meadow(0.2, SIDE.turn_bound)), Ok(0));
}

#[test]
fn figure_5_is_tighter_for_motions_that_are_bounded_both_ways() {
    let mut journey: Journey = Journey::new();
    let side = Leg::of_motion(&SIDE).unwrap();
    // Whoever looks back along a side sees its beginning 1 m behind, ±5 cm, whatever the turn was wrong by.
    assert!((side.back.disc.x + 1.0).abs() < 1e-9 && side.back.disc.y.abs() < 1e-9);
    assert!((side.back.disc.radius - 0.05).abs() < 1e-9);
    for _ in 0..4 {
        journey.go_along(&side).unwrap();
    }
    let before = journey.bounds().to_vec();
    let shrunk = journey.confirm(&in_meadow(0.2, SIDE.turn_bound)).unwrap();
    assert_eq!(shrunk, 2);
    let radius = |bound: &Cylinder| bound.disc.radius;
    // The meadow, the length's 5 cm, and the heading's 5° over a metre.
    let cascade = 0.2 + 0.05 + 5_f64.to_radians().sin();
    let after = radius(&journey.bounds()[2]);
    assert!((after - cascade).abs() < 1e-6, "{after} {cascade}");
    assert!(after < 0.7 * radius(&before[2]));
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let mut journey = square();
    let before = journey.clone();
    let far = Cylinder {
        disc: Disc {
            x: 3.0,
            y: 0.0,
            radius: 0.5,
        },
        heading: Heading::ANY,
    };
    assert_eq!(journey.confirm(&far), Err(Contradiction));
    assert_eq!(journey, before);
    let facing_back = Cylinder {
        disc: Disc::about(0.5),
        heading: Heading::new(3.0, 0.5),
    };
    assert_eq!(journey.confirm(&facing_back), Err(Contradiction));
    assert_eq!(journey, before);
}

#[test]
fn a_journey_ends_where_its_memory_does() {
    let mut journey: Journey<3> = Journey::new();
    assert_eq!(journey.here(), Cylinder::HERE);
    assert_eq!(journey.confirm(&in_meadow(0.1, 0.1)), Ok(0));
    for _ in 0..3 {
        journey.go(&bound(&SIDE)).unwrap();
    }
    let full = journey.clone();
    assert_eq!(journey.go(&bound(&SIDE)), Err(JourneyError::Full));
    assert_eq!(journey, full);
}

#[test]
fn places_and_arcs_fill_up() {
    let mut map: Map<3, 2> = Map::new();
    let ids = ["a", "b", "c"].map(|name| map.mark(name, 0.3).unwrap());
    assert_eq!(map.mark("d", 0.3), Err(MapError::Full));
    assert_eq!(map.mark("a name too long.", 0.3), Err(MapError::Full));
    // A name that is known changes its meadow.
    assert_eq!(map.mark("b", 0.5), Ok(ids[1]));
    assert_eq!(map.place(ids[1]).unwrap().meadow, 0.5);
    assert_eq!(map.find("c"), Some(ids[2]));
    assert_eq!(map.find("C"), None);
    for (label, is) in [
        ("l1", Ok(())),
        ("l2", Ok(())),
        ("l1", Ok(())),
        ("l3", Ok(())),
        ("l4", Ok(())),
        ("l5", Err(MapError::Full)),
        ("l4", Ok(())),
    ] {
        assert_eq!(map.label(ids[0], label, None), is, "{label}");
    }
    let arc = bound(&SIDE);
    assert_eq!(
        map.set_freeway(ids[0], ids[1], Some(1.0)),
        Err(MapError::Arc)
    );
    connect(&mut map, ids[0], ids[1], &arc).unwrap();
    connect(&mut map, ids[1], ids[2], &arc).unwrap();
    assert_eq!(connect(&mut map, ids[2], ids[0], &arc), Err(MapError::Full));
    // The same arc again: what both have in common. What has nothing in common is refused.
    connect(&mut map, ids[0], ids[1], &arc).unwrap();
    assert_eq!(map.arcs()[0].bound, arc);
    assert_eq!(
        connect(&mut map, ids[0], ids[1], &arc.inverse()),
        Err(MapError::Contradiction)
    );
    assert_eq!(map.arcs()[0].bound, arc);
    assert_eq!(map.set_freeway(ids[1], ids[0], Some(1.0)), Ok(()));
    assert_eq!(map.arcs()[0].freeway, Some(1.0));
    map.forget();
    assert_eq!(map, Map::new());
    for result in [
        connect(&mut map, ids[0], ids[1], &arc),
        map.label(ids[0], "l1", None),
    ] {
        assert_eq!(result, Err(MapError::Place));
    }
    assert!(map.route(ids[0], ids[1], 0.0).is_none());
    assert!(map.relation(ids[0], ids[0]).is_none());
    // There is nothing that would exclude it.
    assert!(map.is_plausible(ids[0], &Cylinder::HERE, ids[1], Heading::ANY));
}

#[test]
fn nothing_excluded_was_ever_true_in_any_journey() {
    let mut random = Random(0x5EED_0045);
    let (mut smaller, mut stops) = (0, 0);
    for _ in 0..10_000 {
        let mut journey: Journey<12> = Journey::new();
        let mut truth = vec![Pose::default()];
        for _ in 0..2 + random.below(10) {
            let motion = usual_motion(&mut random);
            let pose = truth.last().unwrap().after(sample(&mut random, &motion));
            truth.push(pose);
            journey.go(&bound(&motion)).unwrap();
            // From time to time it is seen where this is: in a meadow, facing somewhere.
            if random.below(3) == 0 {
                let half = if random.below(2) == 0 {
                    4.0
                } else {
                    random.between(0.02, 0.5)
                };
                let radius = random.between(0.1, 1.0);
                let seen = bound_about(&mut random, pose, radius, half);
                smaller += journey.confirm(&seen).expect("it is true");
            }
            stops += 1;
            for (bound, pose) in journey.bounds().iter().zip(&truth[1..]) {
                assert!(holds(bound, *pose), "{journey:?} {truth:?}");
            }
        }
    }
    println!("{smaller} circles shrank in journeys of {stops} stops");
    assert!(smaller > 10_000);
}

/// A map of places whose true poses are known, as seen from the first one.
struct World {
    map: Map<8, 16>,
    places: Vec<(PlaceId, Pose)>,
}

fn world(random: &mut Random) -> World {
    let mut map = Map::new();
    let mut places: Vec<(PlaceId, Pose)> = Vec::new();
    for name in ["p0", "p1", "p2", "p3", "p4", "p5", "p6", "p7"] {
        let id = map.mark(name, within(random, 0.1, 1.0)).unwrap();
        let pose = if places.is_empty() {
            Pose::default()
        } else {
            // From one of the places before, by two motions.
            let (from, pose) = places[random.below(places.len())];
            let motions = [usual_motion(random), usual_motion(random)];
            let moved = motions
                .iter()
                .fold(pose, |pose, motion| pose.after(sample(random, motion)));
            let chain = motions.map(|motion| bound(&motion));
            connect(&mut map, from, id, &Cylinder::of_chain(&chain)).unwrap();
            moved
        };
        places.push((id, pose));
    }
    for _ in 0..random.below(8) {
        let (from, pose) = places[random.below(8)];
        let (to, end) = places[random.below(8)];
        let relative = pose.inverse().then(end);
        let (radius, half) = (random.between(0.1, 1.0), random.between(0.05, 0.5));
        let seen = bound_about(random, relative, radius, half);
        connect(&mut map, from, to, &seen).expect("it is true");
    }
    World { map, places }
}

/// True if the segments from a to b and from c to d cross.
fn cross([a, b, c, d]: [[f64; 2]; 4]) -> bool {
    let left = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]) > 0.0
    };
    left(a, b, c) != left(a, b, d) && left(c, d, a) != left(c, d, b)
}

#[test]
fn nothing_excluded_was_ever_true_in_any_map() {
    let mut random = Random(0x5EED_0046);
    let (mut excluded, mut identified, mut told) = (0, 0, 0);
    for _ in 0..500 {
        let World { mut map, places } = world(&mut random);
        for (from, pose) in &places {
            for (to, end) in &places {
                let relation = map.relation(*from, *to).expect("all are connected");
                if from == to {
                    assert_eq!(relation, Cylinder::HERE);
                } else {
                    assert!(holds(&relation, pose.inverse().then(*end)));
                }
            }
        }
        // A landmark that is seen from two places.
        let seen = [random.below(8), random.below(8)].map(|at| places[at]);
        for (id, _) in seen {
            map.label(id, "lamp", None).unwrap();
        }
        // Somewhere in a meadow.
        let (id, pose) = seen[0];
        let meadow = map.place(id).unwrap().meadow;
        let facing = random.between(-3.0, 3.0);
        let [turn, run] = [random.between(-3.0, 3.0), within(&mut random, 0.0, meadow)];
        let inside = Pose::default().after([turn, run]);
        let me = pose.then(Pose {
            theta: facing,
            ..inside
        });
        let (from, start) = places[random.below(8)];
        let seen_from = start.inverse().then(me);
        let here = bound_about(&mut random, seen_from, 0.5, 0.3);
        let face = Heading::new(facing, 0.01);
        assert!(map.is_plausible(from, &here, id, face));
        assert!(map.is_plausible(from, &here, id, Heading::ANY));
        let plausible = |id: &PlaceId| map.is_plausible(from, &here, *id, Heading::ANY);
        excluded += places.iter().filter(|(id, _)| !plausible(id)).count();
        if let Some(found) = map.identify(from, &here, "lamp") {
            assert_eq!(found, id);
            identified += 1;
        }
        for _ in 0..20 {
            let ends = [0; 4].map(|_: u8| places[random.below(8)]);
            let [a, b, c, d] = ends.map(|(id, _)| id);
            let crosses = cross(ends.map(|(_, pose)| [pose.x, pose.y]));
            match map.crosses(a, b, c, d) {
                Crossing::Must => assert!(crosses),
                Crossing::Cannot => assert!(!crosses),
                Crossing::May => continue,
            }
            told += 1;
        }
    }
    println!(
        "{excluded} places excluded, {identified} landmarks identified, {told} crossings told"
    );
    assert!(excluded > 500 && identified > 100 && told > 500);
}

#[test]
fn crossings_of_known_ways() {
    use Crossing::{Cannot, May, Must};
    let at = |x, y, radius| Disc { x, y, radius };
    let told = |radius| {
        [
            // A cross; side by side; one after the other; one that ends before the other.
            crossing(
                &at(-1.0, 0.0, radius),
                &at(1.0, 0.0, radius),
                &at(0.0, -1.0, radius),
                &at(0.0, 1.0, radius),
            ),
            crossing(
                &at(-1.0, 0.0, radius),
                &at(1.0, 0.0, radius),
                &at(-1.0, 1.0, radius),
                &at(1.0, 1.0, radius),
            ),
            crossing(
                &at(-1.0, 0.0, radius),
                &at(0.0, 0.0, radius),
                &at(1.0, 0.0, radius),
                &at(2.0, 0.0, radius),
            ),
            crossing(
                &at(-1.0, 0.0, radius),
                &at(1.0, 0.0, radius),
                &at(0.3, 1.0, radius),
                &at(0.2, 2.0, radius),
            ),
        ]
    };
    assert_eq!(told(0.0), [Must, Cannot, Cannot, Cannot]);
    assert_eq!(told(0.2), [Must, Cannot, Cannot, Cannot]);
    assert_eq!(told(0.6), [May; 4]);
    // From one place.
    let place = at(0.0, 0.0, 0.1);
    assert_eq!(
        crossing(&place, &at(1.0, 0.0, 0.1), &place, &at(0.0, 1.0, 0.1)),
        May
    );
    let nowhere = at(f64::NAN, 0.0, 0.1);
    assert_eq!(
        crossing(&nowhere, &place, &at(5.0, 5.0, 0.1), &at(6.0, 5.0, 0.1)),
        May
    );
}

#[test]
fn no_sample_crosses_otherwise_than_told() {
    let mut random = Random(0x5EED_0047);
    let mut told = [0_u32; 3];
    for _ in 0..10_000 {
        let ends = [0; 4].map(|_: u8| {
            let radius = random.between(0.0, 0.5);
            let at = [random.between(-2.0, 2.0), random.between(-2.0, 2.0)];
            disc_about(&mut random, at, radius)
        });
        let [a, b, c, d] = &ends;
        let crossing = crossing(a, b, c, d);
        told[crossing as usize] += 1;
        for _ in 0..100 {
            let points = ends.map(|disc| {
                let [x, y, radius] = [disc.x, disc.y, disc.radius];
                let away = within(&mut random, 0.0, radius);
                let (sin, cos) = random.between(-3.2, 3.2).sin_cos();
                [x + away * cos, y + away * sin]
            });
            match crossing {
                Crossing::Must => assert!(cross(points), "{ends:?} {points:?}"),
                Crossing::Cannot => assert!(!cross(points), "{ends:?} {points:?}"),
                Crossing::May => {}
            }
        }
    }
    println!("must, may, cannot: {told:?}");
    assert!(told.iter().all(|times| *times > 300));
}

#[test]
fn routes_are_as_short_as_any() {
    // Against Floyd and Warshall's, on all pairs.
    let mut random = Random(0x5EED_0048);
    for _ in 0..300 {
        let World { mut map, places } = world(&mut random);
        for arc in map.arcs().to_vec() {
            let width = random.between(-0.3, 1.5) as f32;
            map.set_freeway(arc.from, arc.to, Some(width)).unwrap();
        }
        let width = random.between(0.1, 1.0) as f32;
        let at = |id: PlaceId| places.iter().position(|(place, _)| *place == id).unwrap();
        let mut shortest = [[f64::INFINITY; 8]; 8];
        for (place, row) in shortest.iter_mut().enumerate() {
            row[place] = 0.0;
        }
        let mut steps = shortest;
        for arc in map.arcs() {
            if arc.freeway.is_some_and(|wide| wide >= width) {
                let length = arc.bound.disc.distance();
                let (from, to) = (at(arc.from), at(arc.to));
                steps[from][to] = steps[from][to].min(length);
                steps[to][from] = steps[to][from].min(length);
            }
        }
        shortest = steps;
        for by in 0..8 {
            for from in 0..8 {
                for to in 0..8 {
                    let around = shortest[from][by] + shortest[by][to];
                    shortest[from][to] = shortest[from][to].min(around);
                }
            }
        }
        for (from, _) in &places {
            for (to, _) in &places {
                let least = shortest[at(*from)][at(*to)];
                let Some(route) = map.route(*from, *to, width) else {
                    assert!(least.is_infinite());
                    continue;
                };
                assert_eq!((route.first(), route.last()), (Some(from), Some(to)));
                let length: f64 = route.windows(2).map(|w| steps[at(w[0])][at(w[1])]).sum();
                // The sums' roundings.
                assert!((length - least).abs() <= 1e-5 * (1.0 + least), "{route:?}");
            }
        }
    }
}

#[test]
fn arcs_that_follow_from_others_make_room() {
    let mut map: Map<8, 4> = Map::new();
    let ids: Vec<PlaceId> = (0..8)
        .map(|n| map.mark(&format!("p{n}"), 0.5).unwrap())
        .collect();
    let bound = |radius: f64| Cylinder {
        disc: Disc {
            x: 1.0,
            y: 0.0,
            radius,
        },
        heading: Heading::ANY,
    };
    let likely = Gaussian::HERE;
    map.connect(ids[0], ids[1], &bound(9.0), &likely).unwrap();
    for (to, radius) in [(2, 1.0), (3, 3.0), (4, 2.0)] {
        map.reason(ids[0], ids[to], &bound(radius), &likely)
            .unwrap();
    }
    map.set_freeway(ids[0], ids[3], Some(0.0)).unwrap();
    // Of the wider ones, one was driven and one is a freeway.
    map.connect(ids[1], ids[5], &bound(5.0), &likely).unwrap();
    assert!(!map.has_arc(ids[0], ids[4]) && map.has_arc(ids[1], ids[5]));
    // One that is wider than those it would displace is none.
    map.reason(ids[0], ids[6], &bound(1.5), &likely).unwrap();
    assert!(!map.has_arc(ids[0], ids[6]));
    map.reason(ids[0], ids[6], &bound(0.5), &likely).unwrap();
    assert!(map.has_arc(ids[0], ids[6]) && !map.has_arc(ids[0], ids[2]));
    // What was driven since is an arc like any other.
    map.connect(ids[0], ids[6], &bound(4.0), &likely).unwrap();
    assert_eq!(
        map.connect(ids[1], ids[7], &bound(1.0), &likely),
        Err(MapError::Full)
    );
    assert_eq!(map.arcs().len(), 4);
}
