//! What cannot be meant is refused with a remedy, and before anything is written.

use common::place;

#[test]
fn impossible_requests_are_refused() {
    let place = place!();
    for (line, code, said) in [
        ("trade -o page.txt", 2, "-o takes .html"),
        ("trade --csv t.json", 2, "--csv takes .csv"),
        ("trade --repeat 3", 2, "--rounds"),
        ("trade --report r.json", 2, "--json"),
        ("trade --mode shadow --reference 9", 2, "exact mask"),
        ("trade --reference 5000", 2, "4096"),
        ("trade builtin:cornell -- --samples 4", 2, "--samples"),
        ("trade builtin:cornell -- --no-such-option", 2, "--no-such-option"),
        ("trade missing.obj", 3, "missing.obj"),
        ("bake --vertices -o o.npy --max-error 0.1 --rays 8", 2, "--rays"),
        ("bake --vertices -o o.npy --max-error 0", 2, "above 0"),
        ("bake --vertices -o o.npy --max-error 0.1 --time-budget 3", 2, "cannot be used with"),
        ("shadow --mask m.png --max-error 0.1", 2, "--light and -o"),
        ("shadow --sun 1,2,3 -o m.npy --max-error 0.1", 2, "--map-size"),
        ("shadow --sun 1,2,3 -o m.npy --time-budget 3", 2, "--mask"),
        ("shadow -o m.npy --max-error 0.1 --cube-size 64", 2, "--cube-size"),
        (
            "shadow builtin:umbel:20000 --size 64x40 -o m.npy --max-error 0.00001 --max-memory 30M",
            4,
            "--mask",
        ),
    ] {
        let run = place.run(line);
        assert_eq!(run.code, Some(code), "{line}: {}", run.stderr);
        assert!(run.stderr.contains(said), "{line}: {}", run.stderr);
        assert_eq!(place.names(), Vec::<String>::new(), "{line}");
    }
}
