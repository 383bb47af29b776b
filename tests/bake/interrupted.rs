//! Ctrl-C in the middle of a run: exit code 130, and every file is what it was.

#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use crate::support::Place;

/// Whether this process ignores SIGINT, as background jobs of some shells do; children inherit that.
fn ignores_interrupts() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").expect("the system tells");
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).expect("a mask").trim();
    u64::from_str_radix(mask, 16).expect("a number") & 1 << 1 != 0
}

/// Starts a bake that would take hours, interrupts it once it has begun, and returns its exit code and the rest of what it says.
fn interrupt(place: &Place) -> (Option<i32>, String) {
    let binary = env!("CARGO_BIN_EXE_umbel");
    let mut command = if ignores_interrupts() {
        let mut command = Command::new("env");
        command.args(["--default-signal=INT", binary]);
        command
    } else {
        Command::new(binary)
    };
    let line = "bake builtin:umbel:100000 --vertices --rays 65536 --set independent -o a.npy --bent b.npy -v";
    command.args(line.split(' ')).current_dir(place.path(""));
    let mut child = command.stderr(Stdio::piped()).spawn().expect("the command starts");
    let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
    // The forecast is told right before the work begins.
    let mut first = String::new();
    stderr.read_line(&mut first).expect("a line");
    assert!(first.starts_with("about "), "{first}");
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(sent.success());
    let mut rest = String::new();
    stderr.read_to_string(&mut rest).expect("a text");
    (child.wait().expect("it ends").code(), rest)
}

#[test]
fn the_old_file_stays() {
    let place = Place::new();
    place.put("a.npy", "the old file");
    let (code, said) = interrupt(&place);
    assert_eq!((code, said.as_str()), (Some(130), "interrupted\n"));
    assert_eq!(place.bytes("a.npy"), b"the old file");
    assert_eq!(place.names(), ["a.npy"]);
}

/// Who holds the pause knows that no temporary file is around: writers wait.
#[test]
fn writers_wait_for_a_pause_to_end() {
    let place = Place::new();
    let path = place.path("a.txt");
    let pause = umbel::files::pause_writing();
    let writer = std::thread::spawn({
        let path = path.clone();
        move || umbel::files::write_atomically(&path, |out| out.write_all(b"new"))
    });
    std::thread::sleep(std::time::Duration::from_millis(50));
    assert_eq!(place.names(), [""; 0]);
    drop(pause);
    writer.join().expect("it ends").expect("written");
    assert_eq!(place.bytes("a.txt"), b"new");
}
