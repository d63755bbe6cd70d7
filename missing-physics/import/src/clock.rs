//! Dates and times of day as seconds.

/// Seconds of `2026-11-23T10:15:30.25`, `23.11.2026 10:15:30,25` (since 1970, zones not looked at) or `10:15:30.25` (since midnight).
pub(crate) fn seconds(text: &str) -> Option<f64> {
    let text = text.trim().trim_end_matches('Z');
    let (date, time) = match text.split_once(['T', ' ']) {
        Some((date, time)) => (Some(date), time.trim()),
        None => (None, text),
    };
    // The zone, where there is one.
    let time = time.split_once('+').map_or(time, |(time, _)| time);
    let day = match date {
        Some(date) => 86_400.0 * days(date)? as f64,
        None => 0.0,
    };
    let parts: Vec<&str> = time.split(':').collect();
    let [hours, minutes, rest @ ..] = parts.as_slice() else { return None };
    let seconds = match rest {
        [] => 0.0,
        [seconds] => seconds.replace(',', ".").parse::<f64>().ok().filter(|s| (0.0..61.0).contains(s))?,
        _ => return None,
    };
    let whole = |text: &str, below: u32| text.parse::<u32>().ok().filter(|n| *n < below).map(f64::from);
    Some(day + 3600.0 * whole(hours, 10_000)? + 60.0 * whole(minutes, 60)? + seconds)
}

/// Days since 1970 of `2026-11-23`, `2026/11/23` or `23.11.2026` (H. Hinnant, days_from_civil).
fn days(date: &str) -> Option<i64> {
    let number = |text: &str| text.parse::<u16>().ok().map(i64::from);
    let parts: Vec<&str> = date.split(['-', '/', '.']).collect();
    let [a, b, c] = parts.as_slice() else { return None };
    let (year, month, day) = match (a.len(), date.contains('.')) {
        (4, _) => (number(a)?, number(b)?, number(c)?),
        (_, true) => (number(c)?, number(b)?, number(a)?),
        _ => return None,
    };
    if !(1900..=2200).contains(&year) || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let of_era = year - 400 * era;
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let of_era = 365 * of_era + of_era / 4 - of_era / 100 + of_year;
    Some(146_097 * era + of_era - 719_468)
}

#[cfg(test)]
mod tests {
    use super::seconds;

    /// Python: datetime(2026, 11, 23, 10, 15, 30, 250000, timezone.utc).timestamp()
    #[test]
    fn dates_are_seconds() {
        for text in [
            "2026-11-23T10:15:30.25Z",
            "2026-11-23 10:15:30.25",
            "23.11.2026 10:15:30,25",
            "2026-11-23T10:15:30.25+01:00",
        ] {
            assert_eq!(seconds(text), Some(1_795_428_930.25), "{text}");
        }
        assert_eq!(seconds("1970-01-01 00:00"), Some(0.0));
        assert_eq!(seconds("10:15:30"), Some(36_930.0));
        for text in ["", "10", "throw 3", "10:61:00", "12:00:99", "a:b", "13.13.2026 10:00", "1:2:3:4"] {
            assert_eq!(seconds(text), None, "{text}");
        }
    }
}
