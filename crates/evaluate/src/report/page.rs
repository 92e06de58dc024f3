//! HTML around the figures.

/// Text as HTML shows it.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// A picture with a caption.
pub fn figure(source: &str, caption: &str) -> String {
    let caption = escape(caption);
    format!("<figure><img src=\"{source}\" alt=\"{caption}\"><figcaption>{caption}</figcaption></figure>\n")
}

/// Two pictures, of which a slider shows more of the one or the other.
pub fn slider(id: &str, (under, under_name): (&str, &str), (over, over_name): (&str, &str)) -> String {
    let (under_name, over_name) = (escape(under_name), escape(over_name));
    format!(
        "<figure class=\"pair\" id=\"{id}\"><div class=\"stack\"><img src=\"{under}\" alt=\"{under_name}\"><img class=\"over\" \
         src=\"{over}\" alt=\"{over_name}\"></div><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"{over_name} \
         against {under_name}\"><figcaption>{over_name} | {under_name}</figcaption></figure>\n"
    )
}

const STYLE: &str = "\
body{font:15px/1.45 system-ui,sans-serif;margin:0 auto;max-width:1200px;padding:1.5em;color:#222;background:#fafafa}\
h1{margin:0}h2{margin-top:2em;border-bottom:1px solid #ccc}\
table{border-collapse:collapse;margin:1em 0}td,th{padding:.25em .8em;text-align:right;border-bottom:1px solid #ddd}\
td:first-child,th:first-child{text-align:left}\
.small{color:#666;font-size:.87em}.grid{display:grid;grid-template-columns:repeat(auto-fill,minmax(270px,1fr));gap:1em}\
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(360px,1fr));gap:1em}.plots svg{width:100%;height:auto}\
figure{margin:0}figure img{width:100%;image-rendering:pixelated;display:block}\
.stack{position:relative}.over{position:absolute;top:0;left:0;clip-path:inset(0 50% 0 0)}\
input[type=range]{width:100%;margin:.3em 0 0}figcaption{color:#444;font-size:.87em}code{background:#eee;padding:.1em .3em}";

const SCRIPT: &str = "\
document.querySelectorAll('.pair').forEach(function(pair){var over=pair.querySelector('.over');\
var slide=pair.querySelector('input');slide.addEventListener('input',function(){\
over.style.clipPath='inset(0 '+(100-slide.value)+'% 0 0)';});});";

/// The whole page.
pub fn page(title: &str, machine: &str, command: &str, body: &str) -> String {
    let (title, machine, command) = (escape(title), escape(machine), escape(command));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <link rel=\"icon\" href=\"data:,\"><title>{title}</title><style>{STYLE}</style></head>\n<body><h1>{title}</h1>\n\
         <p class=\"small\">{machine}<br><code>{command}</code></p>\n{body}<script>{SCRIPT}</script></body></html>\n"
    )
}
