//! Names of files: no output destroys another one, or a file that is read.

use super::SQUARES;
use common::place;

/// Runs a line that must be refused for its names, and checks that every file is what it was.
fn refuse(line: &str, named: &str) {
    let place = place!();
    place.put("squares.obj", SQUARES);
    place.put("points.npy", "points");
    place.put("old.npy", "old");
    std::fs::create_dir(place.path("sub")).expect("a directory");
    std::fs::write(place.path("sub/heights.png"), "heights").expect("written");
    #[cfg(unix)]
    std::os::unix::fs::symlink(place.path("points.npy"), place.path("link.npy")).expect("a link");
    let before = place.names();
    let run = place.run(line);
    assert_eq!((run.code, run.stdout.as_str()), (Some(2), ""), "umbel {line}\n{}", run.stderr);
    assert!(run.stderr.contains(named), "umbel {line}: {named}?\n{}", run.stderr);
    assert_eq!(place.names(), before, "umbel {line}");
    assert_eq!(place.bytes("points.npy"), b"points", "umbel {line}");
    assert_eq!(place.bytes("old.npy"), b"old", "umbel {line}");
}

#[test]
fn two_outputs_in_one_place() {
    for line in [
        "render squares.obj -o q.png --report q.png",
        "render squares.obj -o q.png --report ./q.png",
        "render squares.obj -o q.png --report sub/../q.png",
        "render squares.obj --report umbel.png",
        "render squares.obj --aov id=a.npy --aov depth=./a.npy",
        "render squares.obj --aov id=a.npy --aov depth=a.npy",
        "render squares.obj --aov id=old.npy --aov depth=sub/../old.npy",
        "probe squares.obj --center 0,0,1 -o a.png --aov id=b.npy --report sub/../b.npy",
        "visible squares.obj -o a.npy --report a.npy",
        "shadow squares.obj --light 0,9,0 -o a.npy --mask ./a.npy",
        "shadow squares.obj --light 0,9,0 --light 1,9,0 -o a{light}.npy --mask ./a1.npy",
        "bake squares.obj --vertices -o a.npy --bent sub/../a.npy",
        "bake squares.obj --vertices -o a.npy --dump-rays ./a.npy",
        "verify squares.obj --difference a.png --report a.png",
        "trade squares.obj -o a.html --csv b.csv --report b.csv",
        "reyes squares.obj --subdivide -o a.png --aov id=./b.npy --report b.npy",
    ] {
        let is_spelled_alike = !line.contains("./");
        refuse(line, if is_spelled_alike { "two outputs have this name" } else { "are the same file" });
    }
}

#[test]
fn an_output_in_the_place_of_an_input() {
    for line in [
        "bake squares.obj --points points.npy -o points.npy",
        "bake squares.obj --points points.npy -o sub/../points.npy",
        "bake squares.obj --points old.npy --point-ids points.npy -o ./points.npy",
        "bake squares.obj --vertices -o a.npy --report squares.obj",
        "bake builtin:cornell --occluders squares.obj --vertices -o a.npy --report squares.obj",
        "probe squares.obj --center 0,0,1 --pattern points.npy --aov distance=points.npy",
        "visible squares.obj --views old.npy -o old.npy",
        "reyes squares.obj --displace sub/heights.png --height 1 -o sub/heights.png",
    ] {
        refuse(line, "which is read");
    }
    #[cfg(unix)]
    refuse("bake squares.obj --points link.npy -o points.npy", "which is read");
}

/// What holds nothing cannot be destroyed; and a number in a name is another name.
#[test]
fn devices_take_any_number_of_outputs() {
    let place = place!();
    place.put("squares.obj", SQUARES);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("/dev/null", place.path("a.npy")).expect("a link");
        std::os::unix::fs::symlink("/dev/null", place.path("b.npy")).expect("a link");
        place.quiet_run("render squares.obj --size 9x9 --aov id=a.npy --aov depth=b.npy --report /dev/null");
    }
    place.quiet_run("shadow squares.obj --light 0,9,0 --size 9x9 --cube-size 8 -o a0.npy --mask a1.npy");
}
