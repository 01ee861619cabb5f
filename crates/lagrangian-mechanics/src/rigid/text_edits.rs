//! Edits of an XML text at the positions of its nodes: all other text is kept byte for byte.

use std::ops::Range;

use lagrangian_motion::statistics::sort_by_number;
use roxmltree::Node;

/// A text and its replacements.
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

/// Indentation of the lines of inserted elements.
struct Indentation<'t> {
    newline: &'static str,
    /// Indentation of the outermost element.
    first: String,
    /// Additional indentation of each deeper level.
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

    /// Text of the element, on separate lines if there is an indentation.
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

/// Line break and indentation before an element.
fn lead(indentation: Option<&Indentation<'_>>) -> String {
    indentation.map_or_else(String::new, |i| format!("{}{}", i.newline, i.first))
}

impl<'t> TextEdits<'t> {
    /// A text without edits yet.
    pub(super) fn of(text: &'t str) -> Self {
        Self {
            text,
            edits: Vec::new(),
        }
    }

    /// Sets an attribute; an existing one is replaced in place.
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
        sort_by_number(&mut self.edits, |edit| edit.range.start as f64);
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

    /// Position of the end of an element's name.
    fn after_tag(&self, node: Node<'_, '_>) -> usize {
        let start = node.range().start;
        let is_end = |c: char| c.is_whitespace() || c == '/' || c == '>';
        self.text[start..]
            .find(is_end)
            .map_or(start, |length| start + length)
    }

    /// Position of the end of the last attribute, or of the name.
    fn after_attributes(&self, node: Node<'_, '_>) -> usize {
        let last = node.attributes().next_back();
        last.map_or_else(|| self.after_tag(node), |a| a.range().end)
    }

    /// Blanks before an element in its line, if it is preceded only by blanks.
    fn indentation(&self, node: Node<'_, '_>) -> Option<&'t str> {
        let before = &self.text[..node.range().start];
        let line = before.rfind('\n').map_or(0, |k| k + 1);
        let blank = before[line..].trim_start_matches('\u{feff}');
        let is_blank = |c: char| c == ' ' || c == '\t';
        blank.chars().all(is_blank).then_some(blank)
    }

    /// The indentation `own`, with the step by which `node` is deeper than its parent.
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
