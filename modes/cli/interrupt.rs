//! Ctrl-C and requests to end: the process ends with exit code 130, whatever it is at, and leaves no half of anything.
//!
//! Outputs come into being by a rename, see [`umbel::files::write_atomically`]. So it is enough to wait until no temporary file is
//! around. A signal that whoever started the process has it ignore, such as `nohup` or a shell for its background jobs, stays
//! ignored.

use std::io::Write as _;

/// What a shell reports for a process that SIGINT, number 2, has ended: 128 + 2. The other signals end it the same way.
const INTERRUPTED: i32 = 130;

/// Ends the process on Ctrl-C, SIGTERM or SIGHUP from here on.
#[cfg(unix)]
pub(crate) fn exit_on_interrupt() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    let ignored = ignored_signals();
    let heeded = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    // Without a handler the system ends the process, as it always did.
    if let Ok(mut signals) = Signals::new(heeded) {
        std::thread::spawn(move || {
            if signals.forever().next().is_some() {
                end();
            }
        });
    }
}

/// Ends the process on Ctrl-C from here on.
#[cfg(not(unix))]
pub(crate) fn exit_on_interrupt() {
    // Without a handler the system ends the process, as it always did.
    let _ = ctrlc::try_set_handler(end);
}

/// The signals that this process ignores, signal n as bit n - 1, where the system tells (Linux).
#[cfg(unix)]
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

/// Waits until no file is half written, and ends the process.
fn end() {
    let _pause = umbel::files::pause_writing();
    // Where nobody listens there is nobody to tell.
    let _ = writeln!(std::io::stderr(), "interrupted");
    std::process::exit(INTERRUPTED);
}
