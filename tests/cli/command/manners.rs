//! Manners: a scene without a verb, views by name, the standard output, completions, manual pages, the version.

use std::process::Command;

use common::command::Place;
use common::place;

use super::SQUARES;

/// The bytes that a run writes on stdout.
fn stdout(place: &Place, line: &str) -> Vec<u8> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_umbel"));
    let output = command.current_dir(place.path(".")).args(line.split(' ')).output().unwrap();
    assert!(output.status.success(), "{line}\n{}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

fn refuse(place: &Place, line: &str, named: &str) {
    let run = place.run(line);
    assert!(run.code == Some(2) && run.stderr.contains(named), "{line}: {:?}\n{}", run.code, run.stderr);
}

#[test]
fn a_scene_without_a_verb_is_rendered() {
    let place = place!();
    place.put("a.obj", SQUARES);
    place.quiet_run("render a.obj --size 40x30 -o named.png");
    place.quiet_run("a.obj --size 40x30");
    assert_eq!(place.bytes("umbel.png"), place.bytes("named.png"));
    place.quiet_run("builtin:cornell --size 8x8 -o b.png");
    refuse(&place, "paint", "paint");
}

#[test]
fn the_standard_output_takes_pictures_arrays_and_reports() {
    let place = place!();
    place.put("a.obj", SQUARES);
    place.quiet_run("render a.obj --size 40x30 -o a.png --aov id=id.npy");
    assert_eq!(stdout(&place, "render a.obj --size 40x30 -o -"), place.bytes("a.png"));
    assert_eq!(stdout(&place, "render a.obj --size 40x30 --aov id=-"), place.bytes("id.npy"));
    let report = stdout(&place, "render a.obj --size 40x30 -o b.png --report -");
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    assert_eq!(report["rays"], 1200);
    refuse(&place, "render a.obj -o - --report -", "two outputs have this name");
    assert!(!place.names().contains(&"-".to_owned()));
}

#[test]
fn views_by_name_and_by_angles_are_the_same() {
    let place = place!();
    place.put("a.obj", SQUARES);
    let ids = |options: &str| {
        place.quiet_run(&format!("render a.obj --size 60x50 --aov id=id.npy {options}"));
        place.npy("id.npy").u32()
    };
    for (name, azimuth, elevation) in [
        ("front", 0, 0),
        ("right", 90, 0),
        ("back", 180, 0),
        ("left", -90, 0),
        ("top", 0, 90),
        ("bottom", 720, -90),
    ] {
        let (named, angled) = (
            ids(&format!("--view {name} --camera ortho")),
            ids(&format!("--azimuth {azimuth} --elevation {elevation} --camera ortho")),
        );
        assert_eq!(named, angled, "{name}");
    }
    assert_ne!(ids("--view iso"), ids("--view front"));
    assert_eq!(ids("--azimuth 45"), ids("--elevation 26"));
    // The front of a drawing with Z up looks along +Y.
    let front = ids("--view front");
    assert!(front.iter().any(|&id| id != u32::MAX));
    let turned: String = SQUARES.lines().fold(String::new(), |text, line| match line.strip_prefix("v ") {
        Some(numbers) => {
            let p: Vec<f64> = numbers.split_whitespace().map(|x| x.parse().unwrap()).collect();
            text + &format!("v {} {} {}\n", p[0], -p[2], p[1])
        }
        None => text + line + "\n",
    });
    place.put("a.obj", turned);
    assert_eq!(ids("--view front --up 0,0,1"), front);
    for (line, named) in [
        ("--view front --eye 0,0,1", "--view"),
        ("--view front --azimuth 3", "--view"),
        ("--view north", "north"),
        ("--elevation 91", "--elevation"),
        ("--azimuth inf", "--azimuth"),
    ] {
        refuse(&place, &format!("render a.obj {line}"), named);
    }
}

/// All options of a verb, as its help lists them.
fn options(help: &str) -> Vec<&str> {
    help.split_whitespace()
        .filter(|word| word.starts_with("--") && word.len() > 3)
        .map(|word| word.split([',', '.', '[', '=']).next().unwrap_or_default())
        .collect()
}

#[test]
fn manual_pages_have_what_help_has() {
    let place = place!();
    place.quiet_run("man pages");
    for verb in ["render", "probe", "visible", "shadow", "bake", "reyes", "trade", "verify", "info"] {
        let page =
            String::from_utf8(place.bytes(&format!("pages/umbel-{verb}.1"))).unwrap().replace('\\', "");
        let help = place.run(&format!("{verb} --help")).stdout;
        let listed = help.lines().filter(|line| line.trim_start().starts_with('-'));
        for option in listed.flat_map(|line| options(line.trim_start()).into_iter().take(1)) {
            assert!(page.contains(option), "{verb} {option}");
        }
    }
    assert!(String::from_utf8(place.bytes("pages/umbel.1")).unwrap().contains("Exit codes"));
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = place.run(&format!("completions {shell}")).stdout;
        assert!(script.contains("shadow") && script.contains("azimuth"), "{shell}");
    }
}

#[test]
fn short_help_is_short_and_the_version_tells_what_is_built_in() {
    let place = place!();
    let (short, long) = (place.run("render -h").stdout, place.run("render --help").stdout);
    assert!(!short.contains("--partition") && long.contains("--partition") && short.len() < long.len());
    let version = place.run("--version").stdout;
    assert!(
        version.contains(env!("CARGO_PKG_VERSION"))
            && version.contains("instructions:")
            && version.contains("formats:")
    );
    assert_eq!(place.run("-V").stdout.lines().count(), 1);
}
