//! The frame of a page: head, style, sections, provenance.

use std::fmt::{self, Display, Write};

/// A page under construction.
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    style: String,
    body: String,
}

impl Page {
    /// An empty page.
    #[must_use]
    pub fn new(title: &str, lead: &str) -> Self {
        let title = escape(title);
        let body = format!("<header><h1>{title}</h1><p>{}</p></header>\n", escape(lead));
        Self {
            title,
            style: STYLE.to_owned(),
            body,
        }
    }

    /// Adds a section with a heading and a body of HTML; its id is the heading in small letters, joined by hyphens.
    pub fn section(&mut self, heading: &str, html: impl Display) {
        let id = escape(&heading.to_lowercase().replace(' ', "-"));
        self.push(format_args!(
            "<section id=\"{id}\"><h2>{}</h2>\n{html}</section>\n",
            escape(heading)
        ));
    }

    /// Adds rules to its style.
    pub fn style(&mut self, css: &str) {
        self.style.push_str(css);
    }

    /// Adds HTML as it is.
    pub fn raw(&mut self, html: impl Display) {
        self.push(format_args!("{html}"));
    }

    /// The finished page; `provenance` says how to make it again.
    #[must_use]
    pub fn finish(mut self, provenance: &str) -> String {
        self.push(format_args!("<footer>{}</footer>\n", escape(provenance)));
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n{}</main>\n</body>\n</html>\n",
            self.title, self.style, self.body
        )
    }

    fn push(&mut self, html: fmt::Arguments<'_>) {
        // Writing to a string does not fail.
        let _ = self.body.write_fmt(html);
    }
}

/// Text as HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// The style of all pages.
pub(crate) const STYLE: &str = "
:root{color-scheme:light dark;--ink:#1c2733;--dim:#5b6876;--line:#d5dbe1;--paper:#fbfaf7;--card:#fff;--mark:#d1495b;--path:#2e6f9e}
@media(prefers-color-scheme:dark){:root{--ink:#e4e8ec;--dim:#9aa7b4;--line:#35404b;--paper:#14191f;--card:#1b222a;--mark:#ff7b8a;--path:#73b7e6}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.55 system-ui,sans-serif}
main{max-width:64rem;margin:0 auto;padding:1.5rem}
header p{color:var(--dim);max-width:44rem}
h1{font-size:1.9rem;margin:.5rem 0}
h2{font-size:1.2rem;margin:0 0 .75rem}
section{background:var(--card);border:1px solid var(--line);border-radius:.5rem;padding:1.1rem;margin:1rem 0}
.map{position:relative}.map img,.map svg{display:block;width:100%;height:auto}.map svg{position:absolute;inset:0}
.row{display:flex;flex-wrap:wrap;gap:.6rem}
.row figure{margin:0;text-align:center;font-size:.8rem;color:var(--dim)}
.row img{display:block;width:72px;height:72px;image-rendering:pixelated;border:1px solid var(--line)}
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(17rem,1fr));gap:1rem}
.plots svg{width:100%;height:auto}
svg text{fill:var(--ink)}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
th,td{text-align:right;padding:.3rem .6rem;border-bottom:1px solid var(--line)}
th:first-child,td:first-child{text-align:left}
td img{width:40px;height:40px;image-rendering:pixelated;display:block}
footer{color:var(--dim);font-size:.85rem;overflow-wrap:anywhere;margin:1.5rem 0}
";
