//! Messages that repeat what a user or a file wrote: on one line, no longer than can be read, and
//! without what a terminal would obey.

/// Longest name or word that is repeated whole, in characters.
const MAX_NAME: usize = 120;
/// Longest message, in characters.
const MAX_MESSAGE: usize = 600;

/// The message with its control characters escaped, long names (words, or what is between quotes)
/// shortened in their middle, and the whole of it if it still is too long.
pub(crate) fn brief(message: &str) -> String {
    let escaped = escaped(message);
    let mut out = String::new();
    let parts = escaped.split('"').count();
    for (i, part) in escaped.split('"').enumerate() {
        if i > 0 {
            out.push('"');
        }
        // A last quote without a partner opens nothing.
        if i % 2 == 1 && i + 1 < parts {
            push_shortened(&mut out, part, MAX_NAME);
            continue;
        }
        for (i, word) in part.split(' ').enumerate() {
            if i > 0 {
                out.push(' ');
            }
            push_shortened(&mut out, word, MAX_NAME);
        }
    }
    let mut message = String::new();
    push_shortened(&mut message, &out, MAX_MESSAGE);
    message
}

fn escaped(message: &str) -> String {
    let mut out = String::with_capacity(message.len());
    for c in message.chars() {
        match is_control(c) {
            true => out.extend(c.escape_default()),
            false => out.push(c),
        }
    }
    out
}

/// Control characters, and invisible ones that break a line or change the direction of writing.
fn is_control(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

/// Two thirds of it from its beginning, the rest from its end: both tell names apart.
fn push_shortened(out: &mut String, text: &str, most: usize) {
    let place = |n: usize| text.char_indices().nth(n).map(|(at, _)| at);
    if place(most).is_none() {
        out.push_str(text);
        return;
    }
    let tail = most / 3;
    let head = place(most - tail - 1).unwrap_or(0);
    let from_end = text.char_indices().nth_back(tail - 1);
    out.push_str(&text[..head]);
    out.push('…');
    out.push_str(&text[from_end.map_or(text.len(), |(at, _)| at)..]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_messages_stay() {
        let message = "a.pbrt:1:2: Shape \"sphere\": \"radius\" is -1; it’s 5 ± 1";
        assert_eq!(brief(message), message);
        assert_eq!(brief(""), "");
    }

    #[test]
    fn names_longer_than_a_line_lose_their_middle() {
        let long = |c: &str| c.repeat(100_000);
        let cases = [
            format!("{}: no such file", long("ä")),
            format!("Texture \"{}\" is unknown", long("a b")),
            format!("Texture \"x\" {} is \"", long("a b")),
            long("\""),
            long(" "),
            long("\n"),
        ];
        for message in cases {
            let short = brief(&message);
            assert!(short.chars().count() <= MAX_MESSAGE, "{short}");
            assert!(short.contains('…'));
        }
        let short = brief(&format!("Texture \"begin {} end\" is unknown", long("x")));
        assert!(short.starts_with("Texture \"begin xxx"), "{short}");
        assert!(short.ends_with("xxx end\" is unknown"), "{short}");
        assert_eq!(
            short.chars().count(),
            MAX_NAME + "Texture \"\" is unknown".len()
        );
    }

    #[test]
    fn terminals_are_told_nothing() {
        assert_eq!(
            brief("a\u{1b}[2Jb\nc\u{202e}d"),
            "a\\u{1b}[2Jb\\nc\\u{202e}d"
        );
    }
}
