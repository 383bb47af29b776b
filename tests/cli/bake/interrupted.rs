//! Ctrl-C, SIGTERM and SIGHUP in the middle of a run: exit code 130, and every file is what it was.

#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use common::command::Place;
use common::place;

/// Starts a bake that would take hours, sends it signals once it has begun, and returns its exit code and the rest of what it
/// says. `handling` is an option of `env`: children inherit which signals are ignored, as background jobs of some shells do.
fn interrupt(place: &Place, handling: &str, signals: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new("env");
    command.args([handling, env!("CARGO_BIN_EXE_umbel")]);
    let line = "bake builtin:umbel:100000 --vertices --rays 65536 --set independent -o a.npy --bent b.npy -v";
    command.args(line.split(' ')).current_dir(place.path(""));
    let mut child = command.stderr(Stdio::piped()).spawn().expect("the command starts");
    let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
    // The forecast is told right before the work begins.
    let mut first = String::new();
    stderr.read_line(&mut first).expect("a line");
    assert!(first.starts_with("about "), "{first}");
    for signal in signals {
        let sent = Command::new("kill").args([signal, child.id().to_string().as_str()]).status();
        assert!(sent.expect("kill runs").success());
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let mut rest = String::new();
    stderr.read_to_string(&mut rest).expect("a text");
    (child.wait().expect("it ends").code(), rest)
}

#[test]
fn the_old_file_stays() {
    for signal in ["INT", "TERM", "HUP"] {
        let place = place!();
        place.put("a.npy", "the old file");
        let (code, said) = interrupt(&place, &format!("--default-signal={signal}"), &[&format!("-{signal}")]);
        assert_eq!((code, said.as_str()), (Some(130), "interrupted\n"), "{signal}");
        assert_eq!(place.bytes("a.npy"), b"the old file", "{signal}");
        assert_eq!(place.names(), ["a.npy"], "{signal}");
    }
}

/// `nohup` has a process ignore SIGHUP, and it goes on; the next signal finds it at work.
#[test]
fn ignored_signals_stay_ignored() {
    let place = place!();
    let (code, said) = interrupt(&place, "--ignore-signal=HUP", &["-HUP", "-HUP", "-TERM"]);
    assert_eq!((code, said.as_str()), (Some(130), "interrupted\n"));
    assert_eq!(place.names(), [""; 0]);
}

/// Who holds the pause knows that no temporary file is around: writers wait.
#[test]
fn writers_wait_for_a_pause_to_end() {
    let place = place!();
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
