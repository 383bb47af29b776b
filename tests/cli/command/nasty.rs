//! Small files with something wrong or odd in them: a picture or a clear error, never a panic.

use common::command::size_option;
use common::place;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// Files after three good vertices.
const AFTER_A_TRIANGLE: [&str; 30] = [
    "f",
    "f 1",
    "f 1 2",
    "f 1 1 1",
    "f 1 2 2",
    "f 1 2 3 1 2 3",
    "f 3 2 1\nf 1 2 3\nf 2 3 1",
    "f 0 1 2",
    "f 1 2 4",
    "f -1 -2 -3",
    "f -1 -2 -4",
    "f 1 -2 3",
    "f 1.5 2 3",
    "f a b c",
    "f 1/ 2/ 3/",
    "f 1// 2// 3//",
    "f 1/1 2/1 3/1",
    "f 1//9 2//9 3//9",
    "f 1/2/3/4 2 3",
    "f 99999999999999999999 1 2",
    "f 4294967296 1 2",
    "f 1 2 \\",
    "f 1 2 \\\n3",
    "vn 0 0 0\nf 1//1 2//1 3//1",
    "vn nan inf 0\nf 1//1 2//1 3//1",
    "vn 3e38 3e38 3e38\nf 1//1 2//1 3//1",
    "usemtl nothing\nf 1 2 3",
    "mtllib a.obj\nusemtl x\nf 1 2 3",
    "o\ng\ng a b c\ns off\nf 1 2 3\nwhat is this\ncurv 1 2 3",
    "v 1 1 0 0.5 0.5 0.5\nf 1 2 4 3",
];

/// Files with vertices of their own.
const WHOLE: [&str; 16] = [
    "",
    "\n\n\n",
    "# only a remark",
    "v",
    "v 1",
    "v 1 2 3",
    "f 1 2 3",
    "v 5 5 5\nv 5 5 5\nv 5 5 5\nf 1 2 3",
    "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 3 4",
    "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 4",
    "v 3e38 0 0\nv -3e38 0 0\nv 0 3e38 0\nf 1 2 3",
    "v 3.4e38 3.4e38 3.4e38\nv -3.4e38 -3.4e38 -3.4e38\nv 3.4e38 0 0\nf 1 2 3",
    "v 1e-45 0 0\nv 0 1e-45 0\nv 0 0 1e-45\nf 1 2 3",
    "v 16777216 16777216 0\nv 16777218 16777216 0\nv 16777216 16777218 0\nf 1 2 3",
    "v 1e39 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3",
    "v -0 -0 -0\nv 1 -0 -0\nv -0 1 -0\nf 1 2 3",
];

/// Runs the verb on one file.
fn try_file(bytes: &[u8], line: &str) {
    let place = place!();
    place.put("a.obj", bytes);
    let run = place.run(line);
    let told = format!("umbel {line}\n{}\n{}", String::from_utf8_lossy(bytes), run.stderr);
    match run.code {
        Some(0) if line.starts_with("render") => {
            umbel::files::read_png_rgb8(&place.path("a.png")).expect("a picture");
        }
        Some(0) => {}
        Some(3) => assert!(run.stderr.starts_with("error: a.obj"), "{told}"),
        // A scene of 1e38 or 1e-45 units leaves the range of the rays.
        Some(2) => assert!(run.stderr.starts_with("error: "), "{told}"),
        other => panic!("exit code {other:?}\n{told}"),
    }
    assert!(!run.stderr.contains("panicked"), "{told}");
}

fn try_text(text: &str) {
    for lens in ["pinhole", "ortho", "cube"] {
        let size = size_option(lens, "9x9", 5);
        try_file(text.as_bytes(), &format!("render a.obj --camera {lens} {size} -o a.png"));
    }
    try_file(text.as_bytes(), "verify a.obj --size 9x9");
    try_file(text.as_bytes(), "visible a.obj --size 9x9 --objects");
    try_file(text.as_bytes(), "probe a.obj --center 0.1,0,-0.2 --pattern rings=9,columns=9 -o a.ply");
    try_file(text.as_bytes(), "info a.obj");
    try_file(text.as_bytes(), "render a.obj --drop-non-finite --size 9x9 -o a.png");
}

#[test]
fn faces() {
    for lines in AFTER_A_TRIANGLE {
        try_text(&format!("{TRIANGLE}{lines}\n"));
    }
}

#[test]
fn files() {
    for text in WHOLE {
        try_text(text);
    }
}

#[test]
fn bytes() {
    let windows = format!("\u{feff}{TRIANGLE}f 1 2 3\n").replace('\n', "\r\n");
    let many_corners = (0..3000).map(|k| format!(" {}", k % 3 + 1));
    let long_face = format!("{TRIANGLE}f{}", many_corners.collect::<String>());
    let files: [&[u8]; 6] = [
        windows.as_bytes(),
        long_face.as_bytes(),
        b"v 0 0 0\0\0\0",
        b"\xff\xfe v 0 0 0",
        b"o \xe4\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3",
        b"\x1f\x8b\x08\x00 compressed",
    ];
    for bytes in files {
        try_file(bytes, "render a.obj --size 9x9 -o a.png");
    }
}

/// A range error must not hide a picture that could have been made.
#[test]
fn ordinary_oddities_give_a_picture() {
    for text in [
        "",
        "v 5 5 5\nv 5 5 5\nv 5 5 5\nf 1 2 3",
        "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3",
        "v 16777216 16777216 0\nv 16777218 16777216 0\nv 16777216 16777218 0\nf 1 2 3",
    ] {
        for lens in ["pinhole", "equirect", "fisheye", "cube"] {
            let place = place!();
            place.put("a.obj", text);
            let run = place.run(&format!("render a.obj --camera {lens} {}", size_option(lens, "9x9", 5)));
            assert_eq!(run.code, Some(0), "{lens}\n{text}\n{}", run.stderr);
        }
    }
}
