//! One self-contained HTML page: texts, tables, SVG figures, embedded pictures. Opens without a network, in light and dark.

use std::fmt::Write as _;

/// A page under construction; blocks appear in the order they are added.
#[derive(Clone, Debug, Default)]
pub struct Page {
    title: String,
    body: String,
}

/// A picture in a page.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The file's bytes.
    pub png: Vec<u8>,
    /// Line below.
    pub caption: String,
    /// Smaller second line; may be empty.
    pub note: String,
    /// Show pixels as squares, for crops in which noise is to be seen.
    pub pixelated: bool,
}

const STYLE: &str = "
:root{color-scheme:light dark;--ink:#1b1f24;--dim:#59636e;--back:#f6f7f9;--card:#fff;--line:#d5dae0}
@media(prefers-color-scheme:dark){:root{--ink:#e6e9ed;--dim:#9aa5b1;--back:#14171b;--card:#1d2126;--line:#353c44}}
*{box-sizing:border-box}
body{margin:0;background:var(--back);color:var(--ink);font:16px/1.5 Helvetica,Arial,'Liberation Sans',sans-serif}
main{max-width:1280px;margin:0 auto;padding:24px 20px 48px}
h1{font-size:1.6rem;margin:.2em 0 .5em}h2{font-size:1.15rem;margin:1.8em 0 .6em}
.remarks{margin:.6em 0 1em;padding:8px 14px 8px 32px;max-width:88ch;background:var(--card);border:1px solid var(--line);border-left:4px solid #b7791f;border-radius:6px;overflow-wrap:anywhere}
p{margin:.4em 0;max-width:80ch}.lead{font-size:1.1rem}
.figures{display:flex;flex-wrap:wrap;gap:16px}
.figures>div{flex:1 1 420px;background:#fff;border:1px solid var(--line);border-radius:6px;padding:6px;min-width:0}
.figures svg{width:100%;height:auto;display:block}
.strip{max-width:640px;margin:.6em 0;background:#fff;border:1px solid var(--line);border-radius:6px}.strip svg{width:100%;height:auto;display:block}
.pictures{display:grid;grid-template-columns:repeat(auto-fill,minmax(200px,1fr));gap:14px}
@media(max-width:600px){.pictures{grid-template-columns:repeat(2,1fr);gap:8px}main{padding:16px 12px 32px}.figures>div{flex-basis:100%;padding:0}}
figure{margin:0;background:var(--card);border:1px solid var(--line);border-radius:6px;overflow:hidden}
figure img{display:block;width:100%;height:auto;background:#000}.pixelated{image-rendering:pixelated}
figcaption{padding:6px 10px;font-size:.9rem;overflow-wrap:anywhere}figcaption small{color:var(--dim);display:block}
.scroll{overflow-x:auto;background:var(--card);border:1px solid var(--line);border-radius:6px}
table{border-collapse:collapse;width:100%;font-size:.92rem}
th,td{padding:6px 12px;text-align:right;white-space:nowrap;border-bottom:1px solid var(--line);font-variant-numeric:tabular-nums}
tr:last-child td{border-bottom:0}th{color:var(--dim);font-weight:600}th:first-child,td:first-child{text-align:left}
.small{color:var(--dim);font-size:.85rem}.small p{overflow-wrap:anywhere;max-width:none}
";

impl Page {
    /// An empty page with `title` at its head.
    pub fn new(title: &str) -> Self {
        Self { title: title.to_owned(), body: String::new() }
    }

    /// A heading.
    pub fn heading(&mut self, text: &str) -> &mut Self {
        let _ = writeln!(self.body, "<h2>{}</h2>", escape(text));
        self
    }

    /// The sentences that say what came out.
    pub fn lead(&mut self, sentences: &[String]) -> &mut Self {
        for sentence in sentences {
            let _ = writeln!(self.body, "<p class=\"lead\">{}</p>", escape(sentence));
        }
        self
    }

    /// What a reader must know before the numbers: warnings of the scene, light not met, paths lost. Nothing where there are none.
    pub fn remarks(&mut self, remarks: &[String]) -> &mut Self {
        if !remarks.is_empty() {
            self.body.push_str("<ul class=\"remarks\">\n");
            for remark in remarks {
                let _ = writeln!(self.body, "<li>{}</li>", escape(remark));
            }
            self.body.push_str("</ul>\n");
        }
        self
    }

    /// A paragraph.
    pub fn text(&mut self, text: &str) -> &mut Self {
        let _ = writeln!(self.body, "<p>{}</p>", escape(text));
        self
    }

    /// SVG documents side by side where there is room.
    pub fn figures(&mut self, svgs: &[String]) -> &mut Self {
        self.body.push_str("<div class=\"figures\">\n");
        for svg in svgs {
            let _ = writeln!(self.body, "<div>{svg}</div>");
        }
        self.body.push_str("</div>\n");
        self
    }

    /// One low SVG, not wider than it must be.
    pub fn strip(&mut self, svg: &str) -> &mut Self {
        let _ = writeln!(self.body, "<div class=\"strip\">{svg}</div>");
        self
    }

    /// Pictures side by side where there is room.
    pub fn pictures(&mut self, pictures: &[Picture]) -> &mut Self {
        self.body.push_str("<div class=\"pictures\">\n");
        for picture in pictures {
            let class = if picture.pixelated { " class=\"pixelated\"" } else { "" };
            let (caption, note) = (escape(&picture.caption), escape(&picture.note));
            let note = if note.is_empty() { note } else { format!("<small>{note}</small>") };
            let data = base64(&picture.png);
            let _ = writeln!(
                self.body,
                "<figure><img{class} alt=\"{caption}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}{note}</figcaption></figure>"
            );
        }
        self.body.push_str("</div>\n");
        self
    }

    /// A table; the first column is text, the others are numbers.
    pub fn table(&mut self, head: &[&str], rows: &[Vec<String>]) -> &mut Self {
        self.body.push_str("<div class=\"scroll\"><table>\n<tr>");
        for cell in head {
            let _ = write!(self.body, "<th>{}</th>", escape(cell));
        }
        self.body.push_str("</tr>\n");
        for row in rows {
            self.body.push_str("<tr>");
            for cell in row {
                let _ = write!(self.body, "<td>{}</td>", escape(cell));
            }
            self.body.push_str("</tr>\n");
        }
        self.body.push_str("</table></div>\n");
        self
    }

    /// Small print: how it was made.
    pub fn small(&mut self, lines: &[String]) -> &mut Self {
        self.body.push_str("<div class=\"small\">\n");
        for line in lines {
            let _ = writeln!(self.body, "<p>{}</p>", escape(line));
        }
        self.body.push_str("</div>\n");
        self
    }

    /// The file.
    pub fn to_html(&self) -> String {
        let title = escape(&self.title);
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
             <title>{title}</title>\n<style>{STYLE}</style></head>\n<body><main>\n<h1>{title}</h1>\n{}</main></body></html>\n",
            self.body
        )
    }
}

/// Text as it may stand in HTML and SVG, in attributes too.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let all = three.iter().fold(0_u32, |all, &b| all << 8 | u32::from(b)) << (8 * (3 - three.len()));
        for digit in 0..4 {
            let more = digit <= three.len();
            out.push(if more { DIGITS[(all >> (18 - 6 * digit) & 63) as usize] as char } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        for (plain, coded) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn what_comes_from_a_user_is_text_on_the_page() {
        let mut page = Page::new("a<b>&\"c\"");
        page.table(&["x"], &[vec!["<script>".into()]]).small(&["1 < 2".into()]);
        let html = page.to_html();
        assert!(!html.contains("<script>") && html.contains("&lt;script&gt;") && html.contains("a&lt;b&gt;&amp;"));
        assert!(!html.contains("http"), "nothing is fetched");
        assert!(!html.contains("<ul"), "no remarks, no list");
        page.remarks(&["2 < 3 paths lost".into()]);
        assert!(page.to_html().contains("<li>2 &lt; 3 paths lost</li>"));
    }
}
