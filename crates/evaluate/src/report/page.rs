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

/// A picture of a scene, with the zoom that all pictures of the scene share.
pub fn view(source: &str, caption: &str) -> String {
    let caption = escape(caption);
    format!(
        "<figure><div class=\"view\"><img src=\"{source}\" alt=\"{caption}\"></div><figcaption>{caption}</figcaption></figure>\n"
    )
}

/// Two pictures of a scene. A slider shows more of the one or of the other; the zoom is shared.
pub fn slider(id: &str, (under, under_name): (&str, &str), (over, over_name): (&str, &str)) -> String {
    let (under_name, over_name) = (escape(under_name), escape(over_name));
    format!(
        "<figure class=\"pair\" id=\"{id}\"><div class=\"view\"><img src=\"{under}\" alt=\"{under_name}\"><div class=\"over\">\
         <img src=\"{over}\" alt=\"{over_name}\"></div></div><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" \
         aria-label=\"{over_name} against {under_name}\"><figcaption>{over_name} | {under_name}</figcaption></figure>\n"
    )
}

/// The buttons of the shared zoom.
pub const TOOLS: &str = "<p class=\"tools\"><button data-factor=\"2\" aria-label=\"Zoom in\">+</button>\
    <button data-factor=\"0.5\" aria-label=\"Zoom out\">−</button><button data-factor=\"0\">whole image</button>\
    <span class=\"small\">All images of the scene zoom together: double click, pinch or Ctrl and the wheel; drag to \
    move. A click selects a pixel.</span></p>\n";

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Seconds after which the page of a comparison that still runs loads itself again.
pub const WATCH_SECONDS: u32 = 5;

/// The whole page. `done` is the share of a comparison that still runs.
pub fn page(title: &str, machine: &str, command: &str, done: Option<f64>, body: &str) -> String {
    let (title, machine, command) = (escape(title), escape(machine), escape(command));
    let (watch, bar) = match done {
        None => (String::new(), String::new()),
        Some(share) => {
            let share = 100.0 * share.clamp(0.0, 1.0);
            (
                format!(" data-watch=\"{WATCH_SECONDS}\""),
                format!(
                    "<p>Running: {share:.0} % done. This page loads itself again every {WATCH_SECONDS} seconds.</p>\n\
                     <div class=\"bar\"><div style=\"width:{share:.1}%\"></div></div>\n"
                ),
            )
        }
    };
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width,initial-scale=1\"><link rel=\"icon\" href=\"data:,\"><title>{title}</title>\
         <style>\n{STYLE}</style></head>\n<body{watch}><h1>{title}</h1>\n<p class=\"small\">{machine}<br><code>{command}</code>\
         </p>\n{bar}{body}<script>\n{SCRIPT}</script></body></html>\n"
    )
}
