//! Ctrl-C: the process ends with exit code 130, whatever it is at, and leaves no half of anything.
//!
//! Outputs come into being by a rename, see [`umbel::files::write_atomically`]. So it is enough to wait until no temporary file is
//! around. A signal that whoever started the process has it ignore, such as a shell for its background jobs, stays ignored.

use std::io::Write as _;

/// What a shell reports for a process that SIGINT, number 2, has ended: 128 + 2.
const INTERRUPTED: i32 = 130;

/// Ends the process on Ctrl-C from here on.
pub(crate) fn exit_on_interrupt() {
    let end = || {
        let _pause = umbel::files::pause_writing();
        // Where nobody listens there is nobody to tell.
        let _ = writeln!(std::io::stderr(), "interrupted");
        std::process::exit(INTERRUPTED);
    };
    // Without a handler the system ends the process, or ignores the signal, as it always did.
    let _ = ctrlc::try_set_handler(end);
}
