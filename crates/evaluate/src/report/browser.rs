//! The page in a real browser: its slider moves, its plots and pictures are there, and nothing is
//! asked of the network.
//!
//! Needs Chromium, and starts it only if asked: `LIGHTSHED_BROWSER` says where one is,
//! `LIGHTSHED_REQUIRE_BROWSER=1` demands the test and looks for `chromium` on the path. Without
//! either the test says SKIPPED.

use super::tests::example_page;
use lightshed_testkit::found_or_skipped;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What a visitor sees and does, put into the page's title as JSON.
const VISIT: &str = "<script>window.addEventListener('load',function(){\
    var pair=document.querySelector('.pair'),over=pair.querySelector('.over'),slide=pair.querySelector('input');\
    var clip=function(){return getComputedStyle(over).clipPath;};var before=clip();\
    slide.value=80;slide.dispatchEvent(new Event('input'));var after=clip();\
    var section=document.querySelector('section'),views=Array.from(section.querySelectorAll('.view img'));\
    var placed=function(){return views.map(function(i){return getComputedStyle(i).transform;});};\
    document.querySelector('.tools button').click();var zoomed=placed();\
    document.querySelector('.tools button[data-factor=\"0\"]').click();var whole=placed();\
    var body=document.querySelector('table.sortable tbody'),first=function(){return body.rows[0].cells[0].textContent;};\
    var fastest=first();document.querySelectorAll('table.sortable th button')[1].click();\
    document.querySelectorAll('table.sortable th button')[1].click();var least=first();\
    var box=section.querySelector('.pixel'),view=section.querySelector('.view');var hidden=box.hidden;\
    var r=view.getBoundingClientRect();['pointerdown','pointerup'].forEach(function(kind){\
        view.dispatchEvent(new PointerEvent(kind,{pointerId:1,clientX:r.left+0.9*r.width,clientY:r.top+0.1*r.height}));});\
    var pixel=[hidden,box.hidden,box.querySelectorAll('polyline').length,box.querySelector('.where').textContent];\
    var player=document.querySelector('.player'),strip=player.querySelector('.strip img');\
    var frame=player.querySelector('input'),button=player.querySelector('.play');\
    var left=function(){return Math.round(strip.getBoundingClientRect().left-strip.parentNode.getBoundingClientRect().left);};\
    var playing=button.textContent;frame.value=0;frame.dispatchEvent(new Event('input'));var start=left();\
    frame.value=3;frame.dispatchEvent(new Event('input'));\
    var played=[playing,button.textContent,start,left()/Math.round(strip.parentNode.getBoundingClientRect().width),\
        strip.getBoundingClientRect().width/strip.parentNode.getBoundingClientRect().width];\
    var images=Array.from(document.images);\
    var plots=Array.from(document.querySelectorAll('svg')).filter(function(svg){\
        return svg.getBoundingClientRect().width>100&&svg.querySelectorAll('path,polyline').length>0;});\
    var asked=performance.getEntriesByType('resource').map(function(e){return e.name;})\
        .filter(function(name){return !name.startsWith('data:');});\
    var wide=document.documentElement.scrollWidth-document.documentElement.clientWidth;\
    document.title=JSON.stringify({zoomed:zoomed,whole:whole,fastest:fastest,least:least,pixel:pixel,wide:wide,played:played,\
        before:before,after:after,images:images.length,\
        shown:images.filter(function(i){return i.complete&&i.naturalWidth>0;}).length,plots:plots.length,asked:asked});\
    });</script></body>";

/// Demands a browser.
const REQUIRED: &str = "LIGHTSHED_REQUIRE_BROWSER";

fn browser() -> Option<PathBuf> {
    let found = match std::env::var_os("LIGHTSHED_BROWSER") {
        Some(path) => Some(PathBuf::from(path)),
        None if std::env::var_os(REQUIRED).is_none() => None,
        None => std::env::var_os("PATH").and_then(|paths| {
            std::env::split_paths(&paths)
                .map(|folder| folder.join("chromium"))
                .find(|path| path.is_file())
        }),
    };
    found_or_skipped(
        found.ok_or("no chromium asked for by LIGHTSHED_BROWSER or LIGHTSHED_REQUIRE_BROWSER"),
        REQUIRED,
    )
}

/// Opens the page and says what the visitor saw.
fn visit(browser: &Path, folder: &Path, page: &str, width: u32) -> Value {
    let file = folder.join("page.html");
    std::fs::write(&file, page.replace("</body>", VISIT)).expect("the folder can be written to");
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--virtual-time-budget=5000",
            "--dump-dom",
        ])
        .arg(format!("--window-size={width},900"))
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(format!("file://{}", file.display()))
        .output()
        .expect("the browser runs");
    let dom = String::from_utf8_lossy(&output.stdout);
    let title = dom
        .split_once("<title>")
        .and_then(|(_, rest)| rest.split_once("</title>"))
        .map_or("", |(title, _)| title);
    serde_json::from_str(title)
        .unwrap_or_else(|error| panic!("{error}: {title:?}, {}", String::from_utf8_lossy(&output.stderr)))
}

#[test]
fn the_page_works_in_a_browser() {
    let Some(browser) = browser() else { return };
    let folder = std::env::temp_dir().join(format!("lightshed-browser-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("there is room for temporary files");
    let page = example_page();
    let seen = visit(&browser, &folder, &page, 1280);
    assert_eq!(seen["before"], "inset(0px 50% 0px 0px)", "{seen}");
    assert_eq!(seen["after"], "inset(0px 20% 0px 0px)", "{seen}");
    assert_eq!(seen["plots"], 4, "{seen}");
    // All views of the scene zoom, and back.
    for (state, transform) in [
        ("zoomed", "matrix(2, 0, 0, 2, "),
        ("whole", "matrix(1, 0, 0, 1, 0, 0)"),
    ] {
        let views = seen[state].as_array().expect("a list");
        assert!(views.len() > 4, "{seen}");
        assert!(
            views
                .iter()
                .all(|view| view.as_str().is_some_and(|view| view.starts_with(transform))),
            "{seen}"
        );
        assert!(views.iter().all(|view| *view == views[0]), "{seen}");
    }
    assert_eq!(
        (&seen["fastest"], &seen["least"]),
        (&"other".into(), &"path".into()),
        "{seen}"
    );
    assert_eq!(
        seen["pixel"],
        serde_json::json!([true, false, 2, "pixel (3, 0)"]),
        "{seen}"
    );
    // A sequence plays; the slider stops it at its frame. Strips are as wide as their frames.
    let played = seen["played"].as_array().expect("a list");
    assert_eq!(
        played[..3],
        ["Pause".into(), "Play".into(), Value::from(0)],
        "{seen}"
    );
    let number = |place: usize| played[place].as_f64().expect("a number");
    assert!(
        (number(3) + 3.0).abs() < 0.05 && (number(4) - 8.0).abs() < 0.05,
        "{seen}"
    );
    // Nothing is wider than the window, on a phone neither.
    assert_eq!(seen["wide"], 0, "{seen}");
    let phone = visit(&browser, &folder, &page, 500);
    assert_eq!(phone["wide"], 0, "{phone}");
    assert!(
        seen["images"].as_u64() > Some(4) && seen["images"] == seen["shown"],
        "{seen}"
    );
    assert_eq!(seen["asked"], Value::Array(Vec::new()), "{seen}");

    // A player without its script stays where it is.
    let stuck = page.replace("player.style.setProperty", "player.style.removeProperty");
    let stuck = visit(&browser, &folder, &stuck, 1280);
    assert_eq!(stuck["played"][3], Value::from(0), "{stuck}");

    // A slider without its script, a picture that is not there, and one from elsewhere are noticed.
    let still = visit(
        &browser,
        &folder,
        &page.replace("addEventListener('input'", "addEventListener('never'"),
        1280,
    );
    assert_eq!(still["before"], still["after"]);
    let elsewhere = page.replacen("<img src=\"data:", "<img src=\"http://127.0.0.1:9/", 1);
    let broken = visit(&browser, &folder, &elsewhere, 1280);
    assert_ne!(broken["images"], broken["shown"]);
    assert_ne!(broken["asked"], Value::Array(Vec::new()));
    std::fs::remove_dir_all(&folder).ok();
}
