//! What a simulator that was built without the emulator says.
#![cfg(not(feature = "emulator"))]

#[test]
fn an_image_without_the_emulator_names_the_command_that_has_it() {
    let directory = tempfile::tempdir().unwrap();
    let script = directory.path().join("a.script");
    std::fs::write(&script, "0 Version\n").unwrap();
    let output = assert_cmd::Command::cargo_bin("hil-sim")
        .unwrap()
        .arg("run")
        .arg(&script)
        .args(["--image", "vehicle-controller.elf"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains("cargo emulator"), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
}
