//! How deep and how large the text of a robot may be, found before anything reads it.
//!
//! A reader of XML goes down by recursion, so a text nested 30,000 deep would end the program and not the reading.
//! One pass over the brackets, which recurses nowhere, tells.
//!
//! Source: the XML 1.0 recommendation, fifth edition, §2.3 to 2.8 and §3.1.

use super::error::Error;
use super::fault::UrdfFault;

/// Elements inside elements; a URDF needs six, with the extensions of simulators a dozen.
const DEEPEST: usize = 64;
/// Links of a robot; ten times what a humanoid with hands has. Every later pass is at most quadratic in it.
const MOST_LINKS: usize = 1000;

/// Refuses a text that no robot needs.
///
/// # Errors
///
/// [`Error::Urdf`] with the numbers.
pub(super) fn check(text: &str) -> Result<(), Error> {
    let fail = |what| Err(Error::Urdf { what });
    let (mut depth, mut links) = (0_usize, 0_usize);
    for (_, tag) in tags(text) {
        if tag.starts_with('/') {
            depth = depth.saturating_sub(1);
            continue;
        }
        links += usize::from(name_of(tag) == "link");
        depth += usize::from(!tag.ends_with('/'));
        if depth > DEEPEST {
            return fail(UrdfFault::TooDeep { most: DEEPEST });
        }
        if links > MOST_LINKS {
            return fail(UrdfFault::TooManyLinks { most: MOST_LINKS });
        }
    }
    Ok(())
}

/// Returns what stands between the brackets of each tag, and where it begins; comments and the like are passed over.
pub(super) fn tags(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut at = 0;
    std::iter::from_fn(move || {
        loop {
            at += text[at..].find('<')? + 1;
            let rest = &text[at..];
            let aside = [("!--", "-->"), ("![CDATA[", "]]>"), ("?", "?>")];
            if let Some((_, end)) = aside.into_iter().find(|(begin, _)| rest.starts_with(begin)) {
                at += rest.find(end).unwrap_or(rest.len());
                continue;
            }
            let (begin, tag) = (at, &rest[..tag_end(rest)]);
            at += tag.len();
            if !tag.starts_with('!') {
                return Some((begin, tag));
            }
        }
    })
}

/// Returns the name of a tag's element.
pub(super) fn name_of(tag: &str) -> &str {
    tag.split(|c: char| c.is_whitespace() || c == '/').next().unwrap_or_default()
}

/// Returns where a tag ends, which a `>` in quotes does not do.
fn tag_end(text: &str) -> usize {
    let mut quote = None;
    for (at, byte) in text.bytes().enumerate() {
        match (quote, byte) {
            (None, b'>') => return at,
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), byte) if open == byte => quote = None,
            _ => {}
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_urdf_nested_thirty_thousand_deep_is_refused() {
        let text =
            format!("<robot name=\"r\">{}{}</robot>", "<a>".repeat(30_000), "</a>".repeat(30_000));
        assert!(check(&text).unwrap_err().to_string().contains("64 deep"));
        let mut open = "<a b='>'>".repeat(65);
        assert!(check(&open).is_err());
        open = "<a b='/>'/><!-- <a><a> --><![CDATA[<a>]]><?x <a>?>".repeat(1000);
        assert_eq!(check(&open), Ok(()));
    }

    #[test]
    fn a_robot_of_a_hundred_thousand_links_is_refused() {
        let text = format!("<robot>{}</robot>", "<link name='a'/>".repeat(100_000));
        assert!(check(&text).unwrap_err().to_string().contains("1000 links"));
        let few = format!("<robot>{}</robot>", "<linkage/>".repeat(100_000));
        assert_eq!(check(&few), Ok(()));
    }

    #[test]
    fn what_is_no_xml_ends() {
        for text in ["", "<", "<!--", "<a b=\"", "<<<<", "</a></a>", "é<é é='é'>"] {
            assert_eq!(check(text), Ok(()), "{text}");
        }
    }
}
