//! Foreign text in words of our own: on one line, and not too long.

/// A text in quotes, on one line and not too long.
pub fn quoted(text: &str) -> String {
    let short: String = text.chars().take(40).collect();
    let dots = if text.chars().count() > 40 { "…" } else { "" };
    format!("\"{}{dots}\"", one_line(&short))
}

/// What another reader says, on one line, without its middle where it quotes much.
#[cfg(feature = "custom")]
pub(crate) fn brief(text: &str) -> String {
    const END: usize = 100;
    let line: Vec<char> = one_line(text).chars().collect();
    if line.len() <= 2 * END {
        return line.into_iter().collect();
    }
    let part = |chars: &[char]| chars.iter().collect::<String>();
    format!("{}…{}", part(&line[..END]), part(&line[line.len() - END..]))
}

/// A text with everything that would break a line escaped.
pub(crate) fn one_line(text: &str) -> String {
    text.chars()
        .flat_map(|c| if c.is_control() { c.escape_default().collect::<Vec<_>>() } else { vec![c] })
        .collect()
}
