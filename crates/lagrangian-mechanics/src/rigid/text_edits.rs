//! Edits of an XML text at the places of its nodes: all that is not edited stays as it was, byte for byte.

use std::ops::Range;

use roxmltree::Node;

/// A text and what is replaced in it.
pub(super) struct TextEdits<'t> {
    text: &'t str,
    edits: Vec<Edit>,
}

struct Edit {
    range: Range<usize>,
    new: String,
}

/// An element to insert.
pub(super) struct Element {
    pub(super) tag: &'static str,
    pub(super) attributes: Vec<(&'static str, String)>,
    pub(super) children: Vec<Self>,
}

/// How the lines of inserted elements begin.
struct Indentation<'t> {
    newline: &'static str,
    /// That of the outermost element.
    first: String,
    /// What each deeper one has more.
    step: &'t str,
}

impl Element {
    pub(super) fn new(tag: &'static str, attributes: Vec<(&'static str, String)>) -> Self {
        Self {
            tag,
            attributes,
            children: Vec::new(),
        }
    }

    /// Its text, in lines of their own where there is an indentation.
    fn text(&self, indentation: Option<&Indentation<'_>>) -> String {
        let attributes = self.attributes.iter();
        let attributes: String = attributes
            .map(|(key, value)| format!(" {key}=\"{value}\""))
            .collect();
        let tag = self.tag;
        if self.children.is_empty() {
            return format!("<{tag}{attributes}/>");
        }
        let deeper = indentation.map(Indentation::deeper);
        let child = |child: &Self| lead(deeper.as_ref()) + &child.text(deeper.as_ref());
        let children: String = self.children.iter().map(child).collect();
        format!("<{tag}{attributes}>{children}{}</{tag}>", lead(indentation))
    }
}

impl Indentation<'_> {
    fn deeper(&self) -> Self {
        let Self {
            newline,
            ref first,
            step,
        } = *self;
        Self {
            newline,
            first: format!("{first}{step}"),
            step,
        }
    }
}

/// What stands before an element.
fn lead(indentation: Option<&Indentation<'_>>) -> String {
    indentation.map_or_else(String::new, |i| format!("{}{}", i.newline, i.first))
}

impl<'t> TextEdits<'t> {
    /// No edits of a text yet.
    pub(super) fn of(text: &'t str) -> Self {
        Self {
            text,
            edits: Vec::new(),
        }
    }

    /// Sets an attribute, in its place if it is there already.
    pub(super) fn set(&mut self, node: Node<'_, '_>, key: &str, value: &str) {
        match node.attribute_node(key) {
            Some(attribute) => self.replace(attribute.range_value(), value.into()),
            None => {
                let end = self.after_attributes(node);
                self.replace(end..end, format!(" {key}=\"{value}\""));
            }
        }
    }

    /// Inserts an element as the first child, indented like its siblings.
    pub(super) fn insert(&mut self, parent: Node<'_, '_>, element: &Element) {
        let sibling = parent.children().find(Node::is_element);
        if let Some(sibling) = sibling {
            let start = sibling.range().start;
            let own = self
                .indentation(sibling)
                .map(|own| self.stepped(own, parent));
            let text = element.text(own.as_ref()) + &lead(own.as_ref());
            return self.replace(start..start, text);
        }
        let own = self
            .indentation(parent)
            .map(|own| self.stepped(own, parent));
        let deeper = own.as_ref().map(Indentation::deeper);
        let text = lead(deeper.as_ref()) + &element.text(deeper.as_ref());
        let end = self.after_attributes(parent);
        let close = end + self.text[end..].find('>').unwrap_or(0);
        if !self.text[end..close].ends_with('/') {
            return self.replace(close + 1..close + 1, text);
        }
        let tag = &self.text[parent.range().start + 1..self.after_tag(parent)];
        let text = format!(">{text}{}</{tag}>", lead(own.as_ref()));
        self.replace(end..close + 1, text);
    }

    /// The text with all edits.
    pub(super) fn apply(mut self) -> String {
        self.edits.sort_by_key(|edit| edit.range.start);
        let (mut out, mut from) = (String::with_capacity(self.text.len()), 0);
        for Edit { range, new } in self.edits {
            out += &self.text[from..range.start];
            out += &new;
            from = range.end;
        }
        out + &self.text[from..]
    }

    fn replace(&mut self, range: Range<usize>, new: String) {
        self.edits.push(Edit { range, new });
    }

    /// Where the name of an element ends.
    fn after_tag(&self, node: Node<'_, '_>) -> usize {
        let start = node.range().start;
        let is_end = |c: char| c.is_whitespace() || c == '/' || c == '>';
        self.text[start..]
            .find(is_end)
            .map_or(start, |length| start + length)
    }

    /// Where its last attribute ends, or its name.
    fn after_attributes(&self, node: Node<'_, '_>) -> usize {
        let last = node.attributes().next_back();
        last.map_or_else(|| self.after_tag(node), |a| a.range().end)
    }

    /// What stands before an element in its line, if nothing but blanks does.
    fn indentation(&self, node: Node<'_, '_>) -> Option<&'t str> {
        let before = &self.text[..node.range().start];
        let line = before.rfind('\n').map_or(0, |k| k + 1);
        let blank = before[line..].trim_start_matches('\u{feff}');
        let is_blank = |c: char| c == ' ' || c == '\t';
        blank.chars().all(is_blank).then_some(blank)
    }

    /// The indentation `own`, with the step by which `node` stands deeper than its parent.
    fn stepped(&self, own: &str, node: Node<'_, '_>) -> Indentation<'t> {
        let outer = node.parent().filter(Node::is_element);
        let outer = outer.and_then(|outer| self.indentation(outer));
        let step = self.indentation(node).zip(outer);
        let step = step.and_then(|(inner, outer)| inner.strip_prefix(outer));
        Indentation {
            newline: if self.text.contains("\r\n") {
                "\r\n"
            } else {
                "\n"
            },
            first: own.into(),
            step: step.filter(|step| !step.is_empty()).unwrap_or("  "),
        }
    }
}
