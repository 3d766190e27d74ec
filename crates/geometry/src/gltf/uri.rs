//! URIs of buffers and images: `data:` or a file under the glTF file's folder, nothing else.

use std::path::PathBuf;

/// Where a URI leads.
#[derive(Debug, PartialEq)]
pub(super) enum Target {
    /// The bytes of a `data:` URI.
    Bytes(Vec<u8>),
    /// A path below the glTF file's folder; where the name holds a `%`, also the name taken as it stands,
    /// for the exporters that do not encode.
    File(PathBuf, Option<PathBuf>),
}

/// Reads `uri`, or says what is wrong with it.
pub(super) fn resolve(uri: &str) -> Result<Target, &'static str> {
    if let Some(data) = strip_prefix_ignore_case(uri, "data:") {
        let (head, body) = data.split_once(',').ok_or("a data URI without a comma")?;
        return if head.to_ascii_lowercase().ends_with(";base64") {
            base64(body.as_bytes()).map(Target::Bytes).ok_or("not valid base64")
        } else {
            Ok(Target::Bytes(percent_decode(body)))
        };
    }
    if has_scheme(uri) {
        return Err("only relative paths and data URIs are read, no other scheme");
    }
    let raw = below(uri);
    match String::from_utf8(percent_decode(uri)) {
        Ok(name) if name != uri => below(&name).map(|path| Target::File(path, raw.ok())),
        _ => raw.map(|path| Target::File(path, None)),
    }
}

/// A short form of `uri` for messages.
pub(super) fn shown(uri: &str) -> String {
    let short: String = uri.chars().take(80).collect();
    if short.len() < uri.len() { format!("\"{short}…\"") } else { format!("\"{short}\"") }
}

fn strip_prefix_ignore_case<'a>(s: &'a str, prefix: &str) -> Option<&'a str> {
    let head = s.get(..prefix.len())?;
    head.eq_ignore_ascii_case(prefix).then(|| &s[prefix.len()..])
}

/// RFC 3986, 3.1: a letter, then letters, digits, `+`, `-`, `.`, up to a colon before any slash.
fn has_scheme(uri: &str) -> bool {
    let Some((head, _)) = uri.split_once(':') else { return false };
    head.starts_with(|c: char| c.is_ascii_alphabetic())
        && head.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
}

/// `%41` to `A`. A `%` without two hex digits stays as it is.
fn percent_decode(s: &str) -> Vec<u8> {
    let bytes = s.as_bytes();
    let hex = |i: usize| bytes.get(i).and_then(|&b| char::from(b).to_digit(16));
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        match (bytes[i], hex(i + 1), hex(i + 2)) {
            (b'%', Some(high), Some(low)) => {
                out.push((16 * high + low) as u8);
                i += 3;
            }
            (b, _, _) => {
                out.push(b);
                i += 1;
            }
        }
    }
    out
}

/// `name` as a path that cannot leave the folder. Backslashes count as slashes, as some exporters write them.
fn below(name: &str) -> Result<PathBuf, &'static str> {
    if name.starts_with(['/', '\\']) {
        return Err("an absolute path; only files under the glTF file's own folder are read");
    }
    if name.contains('\0') {
        return Err("a path with a zero byte");
    }
    let mut path: Vec<&str> = Vec::new();
    for part in name.split(['/', '\\']) {
        match part {
            "" | "." => {}
            ".." => {
                path.pop().ok_or("a path that leaves the glTF file's folder")?;
            }
            // On Windows `C:x` names another drive, wherever it stands.
            part if cfg!(windows) && part.contains(':') => return Err("a path with a colon"),
            part => path.push(part),
        }
    }
    if path.is_empty() { Err("an empty path") } else { Ok(path.iter().collect()) }
}

/// RFC 4648, 4; white space is skipped and padding may be missing. `None` on any other byte.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    const SKIP: u8 = 64;
    const BAD: u8 = 65;
    const TABLE: [u8; 256] = {
        let mut table = [BAD; 256];
        let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let mut i = 0;
        while i < 64 {
            table[alphabet[i] as usize] = i as u8;
            i += 1;
        }
        (table[b' ' as usize], table[b'\n' as usize]) = (SKIP, SKIP);
        (table[b'\r' as usize], table[b'\t' as usize]) = (SKIP, SKIP);
        table
    };
    let end = text.iter().rposition(|&b| b != b'=').map_or(0, |i| i + 1);
    if text.len() - end > 2 {
        return None;
    }
    let mut out = Vec::with_capacity(end / 4 * 3 + 3);
    let (mut bits, mut held) = (0u32, 0);
    for &b in &text[..end] {
        match TABLE[b as usize] {
            BAD => return None,
            SKIP => {}
            six => {
                bits = bits << 6 | u32::from(six);
                held += 6;
                if held >= 8 {
                    held -= 8;
                    out.push((bits >> held) as u8);
                }
            }
        }
    }
    // Six bits alone make no byte: the text was cut.
    (held < 6).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn file(uri: &str) -> Option<String> {
        match resolve(uri) {
            Ok(Target::File(path, _)) => Some(path.to_string_lossy().replace('\\', "/")),
            _ => None,
        }
    }

    #[test]
    fn relative_paths_stay_below_the_folder() {
        assert_eq!(file("a.bin").as_deref(), Some("a.bin"));
        assert_eq!(file("./x/../a b.bin").as_deref(), Some("a b.bin"));
        assert_eq!(file("a%20b%C3%A9.bin").as_deref(), Some("a bé.bin"));
        assert_eq!(file("tex\\a.png").as_deref(), Some("tex/a.png"));
        for bad in [
            "/etc/hosts",
            "../a",
            "x/../../a",
            "%2e%2e/a",
            "%2Fetc/hosts",
            "http://h/a",
            "file:///a",
            "C:\\a",
            "",
            "a%00b",
        ] {
            assert_eq!(file(bad), None, "{bad}");
        }
    }

    #[test]
    fn percent_signs_that_encode_nothing_are_kept() {
        assert_eq!(file("100%.png").as_deref(), Some("100%.png"));
        assert_eq!(file("%FF.png").as_deref(), Some("%FF.png"), "not UTF-8: the name as it stands");
        assert_eq!(file("a%2").as_deref(), Some("a%2"));
    }

    #[test]
    fn base64_follows_the_rfc() {
        let vectors = [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg", "foob"),
            ("Zm9v\nYmE=", "fooba"),
        ];
        for (text, bytes) in vectors {
            assert_eq!(base64(text.as_bytes()).as_deref(), Some(bytes.as_bytes()), "{text}");
        }
        for bad in ["Z", "Zm9vY", "Zm9*", "Z===", "Zm=9"] {
            assert_eq!(base64(bad.as_bytes()), None, "{bad}");
        }
    }

    #[test]
    fn data_uris_carry_bytes() {
        assert_eq!(resolve("data:application/octet-stream;base64,Zm9v"), Ok(Target::Bytes(b"foo".to_vec())));
        assert_eq!(resolve("data:text/plain,f%6F%FF"), Ok(Target::Bytes(b"fo\xFF".to_vec())));
        assert!(resolve("data:;base64").is_err());
    }

    proptest! {
        #[test]
        fn no_uri_panics_or_escapes(uri in "[./\\\\%a-z0-9:~ \\PC]{0,24}") {
            if let Ok(Target::File(path, other)) = resolve(&uri) {
                for path in [Some(path), other].into_iter().flatten() {
                    prop_assert!(path.is_relative());
                    prop_assert!(path.components().all(|c| matches!(c, std::path::Component::Normal(_))));
                }
            }
        }
    }
}
