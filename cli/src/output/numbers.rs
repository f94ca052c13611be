//! Writes numbers so that people read them at a glance.

use std::time::Duration;

use lamp_stack::format_significant;

/// Returns a number and what it counts: `1,270 layers`.
pub(crate) fn number_of(number: u64, one: &str) -> String {
    format!("{} {one}{}", grouped(number), if number == 1 { "" } else { "s" })
}

/// Returns a number with its digits in groups of three: `34,500`.
pub(crate) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let groups: Vec<&[u8]> = digits.as_bytes().rchunks(3).rev().collect();
    String::from_utf8(groups.join(&b',')).expect("they are digits")
}

/// Returns a number of bytes in the unit that fits: `3.54 GB`.
pub(crate) fn size_in_words(bytes: u64) -> String {
    const UNITS: [&str; 4] = ["kB", "MB", "GB", "TB"];
    if bytes < 1000 {
        return number_of(bytes, "byte");
    }
    let mut size = bytes as f64 / 1e3;
    let mut units = UNITS.iter();
    // A size that rounds to 1000 is one of the next unit.
    while size >= 999.5 && units.len() > 1 {
        size /= 1e3;
        units.next();
    }
    format!("{} {}", format_significant(size, 3), units.as_slice()[0])
}

/// Returns how long something took: `84 s`, `3 h 5 min`.
pub(crate) fn seconds_in_words(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    match seconds {
        ..0.095 => format!("{:.2} s", seconds.max(0.01)),
        ..9.95 => format!("{seconds:.1} s"),
        ..99.5 => format!("{seconds:.0} s"),
        _ => {
            let minutes = (seconds / 60.0).round() as u64;
            match minutes / 60 {
                0 => format!("{minutes} min"),
                hours => format!("{hours} h {} min", minutes % 60),
            }
        }
    }
}

/// Returns a volume: `340.512 mm3`, `1,522.435 cm3` from a million cubic millimeters on.
pub(crate) fn volume_in_words(mm3: f64) -> String {
    let (volume, unit) = if mm3 < 1e6 { (mm3, "mm3") } else { (mm3 / 1e3, "cm3") };
    let text = format!("{volume:.3}");
    let (whole, part) = text.split_once('.').expect("it has decimals");
    match whole.parse() {
        Ok(whole) => format!("{}.{part} {unit}", grouped(whole)),
        // Beyond all whole numbers, digits say nothing.
        Err(_) => format!("{volume:e} {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_at_a_glance() {
        let cases = [0, 7, 999, 1_000, 34_500, 1_234_567].map(grouped);
        assert_eq!(cases, ["0", "7", "999", "1,000", "34,500", "1,234,567"]);
        let sizes = [1, 999, 1_000, 233_145, 999_499, 999_500, 3_540_000_000, 7_100_000_000_000];
        assert_eq!(
            sizes.map(size_in_words),
            ["1 byte", "999 bytes", "1.00 kB", "233 kB", "999 kB", "1.00 MB", "3.54 GB", "7.10 TB"]
        );
        let times = [0.004, 0.4, 9.96, 84.2, 99.6, 3599.0, 3600.0, 11_090.0];
        assert_eq!(
            times.map(|time| seconds_in_words(Duration::from_secs_f64(time))),
            ["0.01 s", "0.4 s", "10 s", "84 s", "2 min", "1 h 0 min", "1 h 0 min", "3 h 5 min"]
        );
    }

    #[test]
    fn volumes_have_the_unit_that_fits() {
        let volumes = [0.0, 340.512, 999_999.999, 1_522_434.894, 1e30].map(volume_in_words);
        assert_eq!(
            volumes,
            ["0.000 mm3", "340.512 mm3", "999,999.999 mm3", "1,522.435 cm3", "1e27 cm3"]
        );
    }
}
