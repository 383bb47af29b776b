//! `umbel probe` from outside: ranges against formulas, patterns against lenses, and files that are no patterns.

mod files;
mod points;
mod ranges;

/// A box with the corners (−3, −1, −2) and (5, 4, 7), two triangles a side, the sides −X +X −Y +Y −Z +Z in this order.
const BOX: &str = "\
v -3 -1 -2
v 5 -1 -2
v -3 4 -2
v 5 4 -2
v -3 -1 7
v 5 -1 7
v -3 4 7
v 5 4 7
f 1 3 7 5
f 2 4 8 6
f 1 2 6 5
f 3 4 8 7
f 1 2 4 3
f 5 6 8 7
";

/// An NPY file of version 1.0 by hand: nothing of the reader is trusted.
fn npy(descr: &str, fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    npy_with_header(&format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}"), data)
}

/// An NPY file with any header.
fn npy_with_header(header: &str, data: &[u8]) -> Vec<u8> {
    let padded = format!("{header:<117}\n");
    let length = u16::try_from(padded.len()).expect("a short header").to_le_bytes();
    [b"\x93NUMPY\x01\x00", length.as_slice(), padded.as_bytes(), data].concat()
}

/// The bytes of f8.
fn f8(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A list of directions as f8, (N, 3).
fn directions(list: &[[f64; 3]]) -> Vec<u8> {
    npy("<f8", false, &format!("({}, 3)", list.len()), &f8(list.as_flattened()))
}
