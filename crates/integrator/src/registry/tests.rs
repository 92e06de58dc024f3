//! The table is consistent, and what it says of methods is so.

use super::{METHODS, Method, MethodCapabilities, MethodError, Motion, PathDepth, Stage, Started};
use lightshed_scene::{Rgb, Scene, builtin};
use std::sync::atomic::AtomicBool;

/// A small scene with the longest path that the method asks for.
fn scene_for(method: &Method) -> Scene {
    let mut description = builtin::many_lights();
    (description.settings.width, description.settings.height) = (16, 16);
    description.settings.max_depth = method.max_depth(None, Some(4)).unwrap();
    Scene::new(&description).unwrap()
}

/// Every method, plain and with each of its options, is found by its text and renders; it makes
/// samples or frames as it says.
#[test]
fn every_method_is_found_by_its_name_and_renders() {
    let variants = [
        "path:tree",
        "path:cdq:128",
        "path:bvh:sdtree:guide-always",
        "path:vmf",
        "path:mcmm",
        "path:fixed",
        "path:bvh:spread@0.1:cache-passes=4",
        "path:variance@0.5:cache-always",
        "path:mse@100:cache-borders",
        "path:bvh:paths:vmf:variance@1:cache-passes=8",
        "direct:open-bvh",
        "direct:bvh:2",
        "lightcuts:bvh",
        "lightcuts:curve-bvh:cut-rebuild",
        "mcmm:temporal:4",
        "mcmm:smis-emitters:bvh",
        "restir-di:bvh",
        "restir-di:16:1",
        "restir-di:world:world-cells=8",
        "restir-di:bvh:both",
        "restir-di-biased:world:world-reads=1",
        "restir-pt:16",
        "restir-di-biased:uniform",
        "path-reuse:bvh",
        "restir-gi:bvh",
        "restir-pt:reconnection:bvh",
        "volpath:bvh",
        "volpath-decomposition:tree",
        "volpath:cdq:96",
        "volpath-decomposition:bvh:vmf:guide-always",
        "vpl-grid:200:bvh",
        "restir-pt:reconnection",
        "restir-pt-offline:reconnection",
        "restir-suffix:reconnection:4:canonical=4:borrowed=2",
        "restir-suffix:bvh:0",
        "restir-suffix-offline:3",
        "restir-volume:2",
        "vpl-grid:200:vpl-fixed:shadow-samples=1",
        "vpl-brute:200:vpl-subset=3",
    ];
    let plain = METHODS
        .iter()
        .map(|entry| entry.name)
        .filter(|name| !name.starts_with("vpl"));
    for name in plain.chain(variants) {
        let method: Method = name.parse().unwrap();
        assert_eq!(method.to_string(), name);
        let scene = scene_for(&method);
        let stage = Stage::new(&scene);
        let started = method.start(&stage, Motion::STILL).unwrap();
        assert_eq!(
            matches!(started, Started::Frames(_)),
            method.capabilities().frames,
            "{name}"
        );
        let mut image = vec![Rgb::ZERO; 256];
        let frame = started
            .into_frames([16, 16], 1)
            .render_frame(0, 1, &mut image, &AtomicBool::new(false));
        assert!(
            frame.is_some() && image.iter().any(|value| *value != Rgb::ZERO),
            "{name} is black"
        );
    }
}

#[test]
fn entries_are_consistent() {
    for (place, entry) in METHODS.iter().enumerate() {
        let MethodCapabilities {
            media,
            frames,
            chain,
            camera_motion,
            media_motion,
            ..
        } = entry.capabilities;
        assert!(
            METHODS[..place].iter().all(|other| other.name != entry.name),
            "{} stands twice",
            entry.name
        );
        assert!(
            !entry.help.is_empty() && !entry.help.ends_with('.'),
            "{}",
            entry.name
        );
        assert!(
            frames || !(chain || camera_motion || media_motion),
            "{}: motion without frames",
            entry.name
        );
        assert!(
            media || !media_motion,
            "{}: motion of media without media",
            entry.name
        );
        for option in entry.options {
            let accepted = option.default.is_empty() || (option.check)(option.default).is_ok();
            assert!(accepted, "{}: the default of {}", entry.name, option.name);
            // What one option is called and accepts is the same for all methods.
            for other in METHODS.iter().filter_map(|other| other.option(option.name)) {
                assert_eq!(
                    (other.default, other.help),
                    (option.default, option.help),
                    "{}",
                    option.name
                );
            }
        }
    }
}

#[test]
fn other_names_and_values_are_refused() {
    for text in [
        "",
        "paths",
        "path:hybrid",
        "path-reuse:reconnection",
        "restir-pt:shift=tree",
        "restir-volume:many",
        "restir-volume:9",
        "restir-gi:",
        "path:",
        "direct:light-samples=0",
        "path:light-samples=0",
        "lightcuts:cut-rebuild=2",
        "path:variance",
        "path:variance@-1",
        "path:fixed@0.5",
        "path:cache=mse",
    ] {
        assert!(text.parse::<Method>().is_err(), "{text}");
    }
    // What a command line takes with a colon has one without in a method's text.
    let mut method = Method::named("path").unwrap();
    method.set("cache", "variance:0.25").unwrap();
    assert_eq!(method.to_string(), "path:variance@0.25");
    assert!(method.capabilities().biased && !method.capabilities().chain);
    // Paths with a guide that end in a cache are biased, and the cache alone trains the guide.
    let method: Method = "path:cdq:variance@0.25".parse().unwrap();
    let MethodCapabilities {
        biased,
        chain,
        device,
        ..
    } = method.capabilities();
    assert_eq!((biased, chain, device), (true, false, true));
    for (text, device) in [
        ("path:variance@0.25:cache-always", true),
        ("path:vmf:variance@0.25", false),
        ("path:variance@0.25:cache-refine=2", false),
        ("path:variance@0.25:cache-facets=8", false),
    ] {
        let method: Method = text.parse().unwrap();
        let found = method.capabilities();
        assert!(found.biased && found.device == device, "{text}");
    }
    // A default is as if it was not given.
    let method: Method = "restir-pt:hybrid".parse().unwrap();
    assert_eq!(method, Method::named("restir-pt").unwrap());
}

#[test]
fn depths_and_media_are_checked() {
    for entry in METHODS {
        let method = Method::named(entry.name).unwrap();
        let expected = match entry.capabilities.depth {
            PathDepth::Any => Some(7),
            PathDepth::Direct => Some(2),
            PathDepth::Bounded { default, .. } => Some(default),
        };
        assert_eq!(method.max_depth(None, Some(7)), Ok(expected), "{}", entry.name);
        let short = method.max_depth(Some(1), None);
        assert_eq!(
            short.is_ok(),
            entry.capabilities.depth == PathDepth::Any,
            "{}",
            entry.name
        );
        let fire = Scene::new(&builtin::fire()).unwrap();
        let started = method.start(&Stage::new(&fire), Motion::STILL).map(|_| ());
        let expected = if entry.capabilities.media {
            Ok(())
        } else {
            Err(MethodError::Media(entry.name))
        };
        assert_eq!(started, expected);
    }
}

/// An option that would change nothing is refused by name; where it has an effect it is not.
#[test]
fn options_without_effect_are_refused() {
    let scene = scene_for(&Method::named("path").unwrap());
    let start = |text: &str| {
        let method: Method = text.parse().unwrap();
        method.start(&Stage::new(&scene), Motion::STILL).map(|_| ())
    };
    for (idle, used) in [
        ("path:guide-training=4", "path:cdq:guide-training=4"),
        ("path:sdtree:128", "path:cdq:128"),
        ("path:cdq:light-samples=2", "path:bvh:light-samples=2"),
        ("path:fixed:light-samples=2", "path:light-samples=2"),
        (
            "restir-pt-offline:none:short-paths=one",
            "restir-pt-offline:short-paths=one",
        ),
        ("path:cache-passes=4", "path:fixed:cache-passes=4"),
        ("path:cache-always", "path:fixed:cache-passes=1:cache-always"),
        (
            "path:cache-survival=0.5",
            "path:fixed:cache-passes=1:cache-survival=0.5",
        ),
        ("path:cdq:guide-training=4:fixed", "path:cdq:guide-training=4"),
        (
            "path:cdq:guide-always:fixed",
            "path:cdq:fixed:cache-passes=1:cache-always",
        ),
        (
            "vpl-grid:200:shadow-samples=0:shadow-spread",
            "vpl-grid:200:shadow-samples=1:shadow-spread",
        ),
    ] {
        let found = start(idle);
        assert!(
            matches!(found, Err(MethodError::Refused { .. })),
            "{idle}: {found:?}"
        );
        assert_eq!(start(used), Ok(()), "{used}");
    }
}

/// Where nothing is smooth, frames for stills are means of four that share paths, with the short
/// paths of an image of four times as many.
/// Planted faults: short paths by the number of frames alone, or in any case.
#[test]
fn frames_for_stills_have_the_short_paths_of_all_that_share() {
    const SIDE: u32 = 32;
    let mut description = builtin::by_name("furnace").unwrap();
    (description.settings.width, description.settings.height) = (SIDE, SIDE);
    let scene = Scene::new(&description).unwrap();
    let mean = |(text, samples): (&str, u32), frames: std::ops::Range<u32>| {
        let method: Method = text.parse().unwrap();
        let stage = Stage::new(&scene).for_samples(samples);
        let started = method.start(&stage, Motion::STILL).unwrap();
        let mut method = started.into_frames([SIDE; 2], 1);
        let mut mean = vec![Rgb::ZERO; (SIDE * SIDE) as usize];
        let mut image = mean.clone();
        let share = 1.0 / frames.len() as f32;
        for frame in frames {
            method
                .render_frame(frame, 5, &mut image, &AtomicBool::new(false))
                .unwrap();
            for (mean, value) in mean.iter_mut().zip(&image) {
                *mean += *value * share;
            }
        }
        mean
    };
    for how in ["one", "several"] {
        let [stills, shared] =
            ["restir-pt-offline", "path-reuse"].map(|name| format!("{name}:short-paths={how}"));
        let still = mean((&stills, 40), 2..3);
        assert!(still == mean((&shared, 160), 8..12), "{how}");
        // Forty frames that share are too few.
        assert_eq!(still == mean((&shared, 40), 8..12), how == "one");
    }
}

/// Options of reuse change the sixth frame of a chain: each is passed on by its method.
#[test]
fn options_of_reuse_change_frames() {
    let sixth = |text: &str| {
        let method: Method = text.parse().unwrap();
        let scene = scene_for(&method);
        let stage = Stage::new(&scene);
        let mut frames = method
            .start(&stage, Motion::STILL)
            .unwrap()
            .into_frames([16, 16], 1);
        let mut image = vec![Rgb::ZERO; 256];
        for frame in 0..6 {
            frames
                .render_frame(frame, 1, &mut image, &AtomicBool::new(false))
                .unwrap();
        }
        image
    };
    for (plain, changes) in [
        (
            "restir-pt",
            &[
                "cap=1",
                "pairs=16",
                "direct-samples=2",
                "footprint=40",
                "mutations=1",
            ][..],
        ),
        (
            "restir-suffix",
            &[
                "cap=1",
                "pairs=16",
                "direct-samples=2",
                "spacing=2",
                "canonical=1",
            ],
        ),
        ("restir-di", &["pairs=16", "mutations=1"]),
    ] {
        let before = sixth(plain);
        assert!(sixth(plain) == before, "{plain}");
        for change in changes {
            assert!(sixth(&format!("{plain}:{change}")) != before, "{plain}:{change}");
        }
    }
}
