//! Traces that are written, and read back.

use super::*;

fn row(t: f64) -> Row {
    let mut csv = csv::Reader::from_reader("".as_bytes());
    csv.set_headers(csv::StringRecord::from(COLUMNS.to_vec()));
    let cells: Vec<String> = COLUMNS
        .iter()
        .enumerate()
        .map(|(index, column)| match *column {
            "move_state" => "ACCEL".into(),
            "turn_state" => "HOLD".into(),
            "fault" => "none".into(),
            "left_count" | "right_count" => (-7 - index as i64).to_string(),
            _ => (index as f64 * 0.125).to_string(),
        })
        .collect();
    let record = csv::StringRecord::from(cells);
    let header = csv::StringRecord::from(COLUMNS.to_vec());
    let mut row: Row = record.deserialize(Some(&header)).unwrap();
    row.t = t;
    row
}

fn text(rows: &[Row]) -> String {
    let mut writer = Writer::new(Vec::new());
    for row in rows {
        writer.write(row).unwrap();
    }
    String::from_utf8(writer.finish().unwrap()).unwrap()
}

fn read_text(text: &str) -> anyhow::Result<Vec<Row>> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("trace.csv");
    std::fs::write(&path, text).unwrap();
    read(&path)
}

/// The message without the folder.
fn error(text: &str) -> String {
    let message = format!("{:#}", read_text(text).unwrap_err());
    message[message.find("trace.csv").unwrap()..].to_owned()
}

fn replace(line: usize, column: &str, cell: &str) -> String {
    let good = text(&[row(0.0), row(0.01), row(0.02)]);
    let index = COLUMNS.iter().position(|name| *name == column).unwrap();
    let lines: Vec<String> = good
        .lines()
        .enumerate()
        .map(|(number, content)| {
            let mut cells: Vec<&str> = content.split(',').collect();
            if number + 1 == line {
                cells[index] = cell;
            }
            cells.join(",")
        })
        .collect();
    lines.join("\n")
}

#[test]
fn rows_come_back_as_written() {
    let mut second = row(0.01);
    second.true_x = -1.234_567_89e-7;
    second.cxx = 1e-12;
    second.fault = "overcurrent, left".into();
    second.left_count = i64::MIN;
    let rows = [row(0.0), second];
    assert_eq!(read_text(&text(&rows)).unwrap(), rows);
}

#[test]
fn a_vehicle_that_steers_has_further_columns() {
    let steered = |t| Row {
        steer: Some(-0.25),
        true_steer: Some(-0.251),
        ..row(t)
    };
    let rows = [steered(0.0), steered(0.01)];
    let written = text(&rows);
    let header = format!("{},steer,true_steer", COLUMNS.join(","));
    assert_eq!(written.lines().next(), Some(header.as_str()));
    assert_eq!(read_text(&written).unwrap(), rows);
    let car = [Row {
        front_left_count: Some(-3),
        front_right_count: Some(70_000),
        ..steered(0.0)
    }];
    assert_eq!(read_text(&text(&car)).unwrap(), car);
    // A trace is of one vehicle.
    let mut writer = Writer::new(Vec::new());
    writer.write(&rows[0]).unwrap();
    assert!(writer.write(&row(0.02)).is_err());
    let wrong = written.replacen("-0.25,", "left,", 1);
    assert!(error(&wrong).contains("`left` is not a number"));
}

#[test]
fn serde_writes_the_same_header() {
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.serialize(row(0.0)).unwrap();
    let serialized = String::from_utf8(csv.into_inner().unwrap()).unwrap();
    assert_eq!(serialized.lines().next(), text(&[]).lines().next());
    assert_eq!(text(&[]).trim_end(), COLUMNS.join(","));
}

#[test]
fn numbers_are_compact() {
    assert_eq!(compact(0.1 + 0.2), "0.3");
    assert_eq!(compact(-0.0), "0");
    assert_eq!(compact(-1_234.567_891_234), "-1234.56789");
    assert_eq!(compact(2e-10), "0.0000000002");
    assert!(
        text(&[row(1.0 / 3.0)])
            .lines()
            .nth(1)
            .unwrap()
            .starts_with("0.333333,0.125,")
    );
}

#[test]
fn bad_cells_are_located() {
    let cases = [
        (
            3,
            "cxx",
            "abc",
            "trace.csv:3: column `cxx`: `abc` is not a number",
        ),
        (
            2,
            "v_s",
            "",
            "trace.csv:2: column `v_s`: `` is not a number",
        ),
        (
            4,
            "battery",
            "inf",
            "trace.csv:4: column `battery`: `inf` is not a finite number",
        ),
        (
            2,
            "est_x",
            "NaN",
            "trace.csv:2: column `est_x`: `NaN` is not a finite number",
        ),
        (
            2,
            "left_count",
            "1.5",
            "trace.csv:2: column `left_count`: `1.5` is not an integer",
        ),
        (
            4,
            "turn_state",
            "STOP",
            "trace.csv:4: column `turn_state`: `STOP` is not a state",
        ),
        (
            4,
            "t",
            "0.005",
            "trace.csv:4: column `t`: 0.005 is before 0.01 of the previous row",
        ),
    ];
    for (line, column, cell, message) in cases {
        assert_eq!(error(&replace(line, column, cell)), message);
    }
}

#[test]
fn bad_shapes_are_located() {
    assert_eq!(
        error(&replace(1, "cyy", "other")),
        "trace.csv:1: column `cyy` is missing"
    );
    assert_eq!(
        error(&replace(1, "cyy", "cxx")),
        "trace.csv:1: column `cxx` appears twice"
    );
    assert_eq!(error(""), "trace.csv: the trace is empty");
    assert_eq!(error(&text(&[])), "trace.csv: the trace has no row");
    let short = text(&[row(0.0)]) + "1,2,3\n";
    assert_eq!(error(&short), "trace.csv:3: 3 cells instead of 33");
    let missing = read(Path::new("/nowhere/trace.csv")).unwrap_err();
    assert!(format!("{missing}").starts_with("/nowhere/trace.csv: cannot open"));
}

#[test]
fn writer_refuses_what_the_reader_would() {
    let mut bad = row(0.5);
    bad.v_s = f64::NAN;
    let message = format!("{:#}", Writer::new(Vec::new()).write(&bad).unwrap_err());
    assert_eq!(
        message,
        "trace row at t = 0.5 s: column `v_s`: `NaN` is not a finite number"
    );
}
