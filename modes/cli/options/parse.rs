//! Values on the command line: vectors, sizes, bytes.

use std::path::Path;

use glam::DVec3;

/// "x,y,z" as three finite numbers.
pub(crate) fn parse_vector(text: &str) -> Result<DVec3, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if [x, y, z].iter().all(|c| c.is_finite()) => Ok(DVec3::new(x, y, z)),
        _ => Err("expected three finite numbers such as 1,0.5,-2".into()),
    }
}

/// "WxH" as two positive numbers.
pub(crate) fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parts = text.split_once(['x', 'X']).map(|(w, h)| (w.trim().parse(), h.trim().parse()));
    match parts {
        Some((Ok(width), Ok(height))) if (1..=65536).contains(&width) && (1..=65536).contains(&height) => {
            Ok((width, height))
        }
        _ => Err("expected WIDTHxHEIGHT in pixels, each 1 to 65536, such as 1920x1080".into()),
    }
}

/// A number of bytes with an optional k, M, G or T.
pub(crate) fn parse_bytes(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit: u64 = match text[digits.len()..].to_ascii_lowercase().as_str() {
        "" | "b" => 1,
        "k" | "kb" => 1 << 10,
        "m" | "mb" => 1 << 20,
        "g" | "gb" => 1 << 30,
        "t" | "tb" => 1 << 40,
        _ => return Err("expected a number of bytes such as 500M or 8G".into()),
    };
    let number: f64 =
        digits.parse().map_err(|_| "expected a number of bytes such as 500M or 8G".to_owned())?;
    if number >= 0.0 && number.is_finite() {
        Ok((number * unit as f64) as u64)
    } else {
        Err("expected a size".into())
    }
}

/// The extension in lower case; `-` of the standard output.
pub(crate) fn extension(path: &Path) -> String {
    if path == Path::new("-") {
        return "-".to_owned();
    }
    path.extension().and_then(|extension| extension.to_str()).unwrap_or("").to_ascii_lowercase()
}
