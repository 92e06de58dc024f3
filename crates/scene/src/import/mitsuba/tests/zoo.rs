//! Malformed and unsupported scenes: each is named with its place.

use super::{message, read};
use crate::import::parse_mitsuba;

/// What is left out or replaced, and a part of the warning.
const LEFT_OUT: &[(&str, &str)] = &[
    (
        "\n\n<shape type=\"torus\" id=\"t\"/>",
        "dir/s.xml:3 (scene/shape[t]): the shape `torus` is not supported",
    ),
    (
        "<shape type=\"sphere\"><float name=\"girth\" value=\"1\"/></shape>",
        "(scene/shape/float[girth]): parameter `girth` of `sphere` is not supported",
    ),
    (
        "<shape type=\"cube\"><bsdf type=\"fur\"/></shape>",
        "the BSDF `fur` is not supported",
    ),
    (
        "<shape type=\"cube\"><medium type=\"homogeneous\"/></shape>",
        "element <medium> of `cube` is not supported",
    ),
    (
        "<medium type=\"homogeneous\"><string name=\"material\" value=\"Skin1\"/></medium>",
        "parameter `material` of `homogeneous` is not supported",
    ),
    (
        "<medium type=\"homogeneous\"><phase type=\"magic\"/></medium>",
        "the phase function `magic` is not supported",
    ),
    (
        "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"noise\"/></bsdf>",
        "the texture `noise` is not supported",
    ),
    (
        "<emitter type=\"torch\"/>",
        "the emitter `torch` is not supported",
    ),
    (
        "<integrator type=\"bdpt\"/>",
        "the integrator `bdpt` is not supported",
    ),
    (
        "<sensor type=\"periscope\"/>",
        "the sensor `periscope` is not supported",
    ),
    (
        "<sensor type=\"perspective\"><sampler type=\"magic\"/></sensor>",
        "the sampler `magic` is not supported",
    ),
    (
        "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"no.png\"/></texture></bsdf>",
        "grey is taken for an image: cannot read dir/no.png",
    ),
    (
        "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"no.tga\"/></texture></bsdf>",
        "dir/no.tga: unknown file extension, expected one of png",
    ),
];

#[test]
fn what_is_unknown_is_left_out_by_name() {
    for (body, expected) in LEFT_OUT {
        let warnings: Vec<String> = read(body).warnings.iter().map(ToString::to_string).collect();
        let found = warnings.iter().any(|warning| warning.contains(expected));
        assert!(found, "{body}: {warnings:?} lack {expected:?}");
    }
}

/// Each snippet, and a part of what must be said of it.
const ZOO: &[(&str, &str)] = &[
    ("<shape", "dir/s.xml:1: not well-formed XML"),
    ("<shape type=\"sphere\"/>stray", "text between elements"),
    (
        "<wibble/>",
        "dir/s.xml:1 (scene/wibble): the element <wibble> is not supported",
    ),
    ("<shape/>", "(scene/shape): attribute `type` is missing"),
    (
        "<shape type=\"sphere\" colour=\"red\"/>",
        "<shape> has no attribute `colour`",
    ),
    (
        "<shape type=\"sphere\"><float name=\"radius\" value=\"-1\"/></shape>",
        "`radius` must be positive",
    ),
    (
        "<shape type=\"sphere\"><float name=\"radius\" value=\"x\"/></shape>",
        "`x` is not a number",
    ),
    (
        "<shape type=\"sphere\"><float name=\"radius\" value=\"1e39\"/></shape>",
        "out of range",
    ),
    (
        "<shape type=\"sphere\"><float name=\"radius\" value=\"nan\"/></shape>",
        "not finite",
    ),
    (
        "<shape type=\"sphere\"><string name=\"radius\" value=\"1\"/></shape>",
        "`radius` is <string>, expected <float>",
    ),
    (
        "<shape type=\"sphere\"><float name=\"radius\" value=\"1\"/><float name=\"radius\" value=\"1\"/></shape>",
        "the name is taken",
    ),
    (
        "<shape type=\"cube\"><transform name=\"to_world\"><scale x=\"0\"/></transform></shape>",
        "a scale of zero",
    ),
    (
        "<shape type=\"cube\"><transform name=\"to_world\"><matrix value=\"1 0 0 0 0 0 0 0 1\"/></transform></shape>",
        "singular",
    ),
    (
        "<shape type=\"cube\"><transform name=\"to_world\"><matrix value=\"1 2\"/></transform></shape>",
        "a matrix of 9 or 16 numbers, found 2",
    ),
    (
        "<shape type=\"cube\"><transform name=\"to_world\"><rotate angle=\"3\"/></transform></shape>",
        "the axis of rotation has no length",
    ),
    (
        "<shape type=\"cube\"><transform name=\"to_world\"><rotate x=\"1\"/></transform></shape>",
        "attribute `angle` is missing",
    ),
    (
        "<shape type=\"cube\"><transform name=\"to_world\"><lookat origin=\"0,0,0\" target=\"0,1,0\" up=\"0,1,0\"/></transform></shape>",
        "`up` is parallel to the view",
    ),
    (
        "<shape type=\"cube\"><transform name=\"to_world\"><float name=\"x\" value=\"1\"/></transform></shape>",
        "no step of a transform",
    ),
    (
        "<shape type=\"cube\"><ref id=\"nobody\"/></shape>",
        "nothing has the id `nobody`",
    ),
    (
        "<shape type=\"cube\" id=\"a\"/><shape type=\"cube\" id=\"a\"/>",
        "the id `a` is taken",
    ),
    (
        "<shape type=\"cube\"><bsdf type=\"diffuse\"/><bsdf type=\"diffuse\"/></shape>",
        "a second <bsdf>",
    ),
    (
        "<shape type=\"cube\"><bsdf type=\"mask\"/></shape>",
        "one BSDF is needed within, found 0",
    ),
    (
        "<bsdf type=\"twosided\"><bsdf type=\"null\"/></bsdf>",
        "only BSDFs that do not transmit",
    ),
    (
        "<medium type=\"fog\"/>",
        "(scene/medium): the medium `fog` is not supported",
    ),
    (
        "<medium type=\"homogeneous\" id=\"a\"/><shape type=\"cube\"><ref id=\"a\"/></shape>",
        "a medium of a shape must be named `interior` or `exterior`",
    ),
    (
        "<bsdf type=\"null\" id=\"a\"/><shape type=\"cube\"><ref id=\"a\" name=\"interior\"/></shape>",
        "a reference to <bsdf>, expected <medium>",
    ),
    (
        "<medium type=\"homogeneous\"><float name=\"scale\" value=\"-1\"/></medium>",
        "`scale` is negative",
    ),
    (
        "<medium type=\"homogeneous\"><rgb name=\"sigma_t\" value=\"1 -2 3\"/></medium>",
        "negative component",
    ),
    (
        "<medium type=\"homogeneous\"><float name=\"sigma_t\" value=\"3e38\"/><float name=\"scale\" value=\"10\"/></medium>",
        "`sigma_t` times `scale` is out of range",
    ),
    (
        "<medium type=\"homogeneous\"><float name=\"albedo\" value=\"1.5\"/></medium>",
        "`albedo` must be in [0, 1]",
    ),
    (
        "<medium type=\"homogeneous\"><phase type=\"hg\"><float name=\"g\" value=\"1\"/></phase></medium>",
        "`g` must be within (-1, 1)",
    ),
    (
        "<medium type=\"homogeneous\"><phase type=\"hg\"/><phase type=\"hg\"/></medium>",
        "a second <phase>",
    ),
    (
        "<medium type=\"homogeneous\"><phase type=\"blendphase\"><float name=\"weight\" value=\"0.5\"/><phase type=\"hg\"/></phase></medium>",
        "needs two phase functions, found 1",
    ),
    (
        "<medium type=\"heterogeneous\"><volume name=\"sigma_t\" type=\"gridvolume\"/></medium>",
        "`filename` is missing",
    ),
    (
        "<medium type=\"heterogeneous\"><volume name=\"sigma_t\" type=\"gridvolume\"><string name=\"filename\" value=\"no.vol\"/></volume></medium>",
        "cannot read dir/no.vol",
    ),
    (
        "<medium type=\"heterogeneous\"><volume name=\"sigma_t\" type=\"fractal\"/></medium>",
        "the volume `fractal` is not supported",
    ),
    (
        "<medium type=\"heterogeneous\"><volume name=\"sigma_t\" type=\"constvolume\"/></medium>",
        "`value` is missing",
    ),
    (
        "<sensor type=\"perspective\"><medium type=\"homogeneous\"/><medium type=\"homogeneous\"/></sensor>",
        "a second medium",
    ),
    ("<bsdf type=\"twosided\"/>", "`twosided` needs one or two BSDFs"),
    (
        "<bsdf type=\"twosided\"><bsdf type=\"dielectric\"/></bsdf>",
        "only BSDFs that do not transmit",
    ),
    (
        "<bsdf type=\"twosided\" id=\"a\"><ref id=\"a\"/></bsdf>",
        "nested more than 16 deep",
    ),
    (
        "<bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"2\"/></bsdf>",
        "`weight` must be in [0, 1]",
    ),
    (
        "<bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"1\"/><bsdf type=\"diffuse\"/></bsdf>",
        "needs two BSDFs, found 1",
    ),
    (
        "<bsdf type=\"conductor\"><string name=\"material\" value=\"Xx\"/></bsdf>",
        "no RGB figures for the conductor `Xx`",
    ),
    (
        "<bsdf type=\"conductor\"><rgb name=\"eta\" value=\"1\"/></bsdf>",
        "must be given together",
    ),
    (
        "<bsdf type=\"dielectric\"><string name=\"int_ior\" value=\"jelly\"/></bsdf>",
        "unknown material `jelly`",
    ),
    (
        "<bsdf type=\"roughconductor\"><float name=\"alpha\" value=\"0\"/></bsdf>",
        "`alpha` must be positive",
    ),
    (
        "<bsdf type=\"roughconductor\"><string name=\"distribution\" value=\"phong\"/></bsdf>",
        "unknown `distribution` `phong`",
    ),
    (
        "<bsdf type=\"roughconductor\"><float name=\"alpha_u\" value=\"1\"/></bsdf>",
        "either `alpha` or both",
    ),
    (
        "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"1 2\"/></bsdf>",
        "`1 2` is not a colour",
    ),
    (
        "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"-1\"/></bsdf>",
        "negative component",
    ),
    (
        "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"#12345\"/></bsdf>",
        "not of the form #rrggbb",
    ),
    (
        "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"400:1, 300:0\"/></bsdf>",
        "wavelengths of a spectrum must ascend",
    ),
    ("<shape type=\"ply\"/>", "`filename` is missing"),
    (
        "<shape type=\"ply\"><string name=\"filename\" value=\"no.ply\"/></shape>",
        "cannot read dir/no.ply",
    ),
    ("<emitter type=\"area\"/>", "belongs into a shape"),
    (
        "<shape type=\"cube\"><emitter type=\"point\"/></shape>",
        "can hold an area emitter, not `point`",
    ),
    (
        "<emitter type=\"constant\"/><emitter type=\"constant\"/>",
        "a second environment",
    ),
    (
        "<emitter type=\"directional\"><vector name=\"direction\" value=\"0\"/></emitter>",
        "the direction has no length",
    ),
    (
        "<emitter type=\"spot\"><float name=\"cutoff_angle\" value=\"9\"/><float name=\"beam_width\" value=\"10\"/></emitter>",
        "`beam_width` ≤ `cutoff_angle`",
    ),
    (
        "<integrator type=\"path\"/><integrator type=\"path\"/>",
        "a second <integrator>",
    ),
    (
        "<integrator type=\"path\"><integer name=\"max_depth\" value=\"-3\"/></integrator>",
        "`max_depth` of -3",
    ),
    (
        "<integrator type=\"path\"><integer name=\"max_depth\" value=\"$d\"/></integrator>",
        "`$d` is not defined",
    ),
    (
        "<integrator type=\"path\"><boolean name=\"hide_emitters\" value=\"yes\"/></integrator>",
        "neither `true` nor `false`",
    ),
    (
        "<bsdf type=\"diffuse\"><spectrum type=\"irregular\" name=\"reflectance\"><string name=\"wavelengths\" value=\"400 500\"/><string name=\"values\" value=\"1\"/></spectrum></bsdf>",
        "2 wavelengths for 1 values",
    ),
    (
        "<bsdf type=\"diffuse\"><spectrum type=\"magic\" name=\"reflectance\"/></bsdf>",
        "the spectrum `magic` is not supported",
    ),
    (
        "<bsdf type=\"diffuse\"><texture type=\"mesh_attribute\" name=\"reflectance\"><string name=\"name\" value=\"color\"/></texture></bsdf>",
        "neither of vertices",
    ),
    (
        "<bsdf type=\"bumpmap\"><bsdf type=\"diffuse\"/></bsdf>",
        "a bump map needs one texture, found 0",
    ),
    (
        "<shape type=\"linearcurve\"><string name=\"filename\" value=\"no.txt\"/></shape>",
        "cannot read dir/no.txt",
    ),
    ("<sensor type=\"thinlens\"/>", "`aperture_radius` is missing"),
    (
        "<sensor type=\"perspective\"><float name=\"fov\" value=\"180\"/></sensor>",
        "below 180 degrees",
    ),
    (
        "<sensor type=\"perspective\"><float name=\"fov\" value=\"1\"/><string name=\"fov_axis\" value=\"z\"/></sensor>",
        "unknown `fov_axis` `z`",
    ),
    (
        "<sensor type=\"perspective\"><float name=\"fov\" value=\"1\"/><string name=\"focal_length\" value=\"9mm\"/></sensor>",
        "exclude each other",
    ),
    (
        "<sensor type=\"perspective\"><transform name=\"to_world\"><scale value=\"2\"/></transform></sensor>",
        "must rotate and translate only",
    ),
    (
        "<sensor type=\"perspective\"><float name=\"near_clip\" value=\"1e5\"/></sensor>",
        "`near_clip` is not below",
    ),
    (
        "<sensor type=\"perspective\"><film type=\"hdrfilm\"><integer name=\"width\" value=\"0\"/></film></sensor>",
        "`width` must be a positive",
    ),
    (
        "<include filename=\"no.xml\"/>",
        "could not be imported: cannot read dir/no.xml",
    ),
];

#[test]
fn everything_wrong_is_named() {
    for (body, expected) in ZOO {
        let found = message(body);
        assert!(
            found.contains(expected),
            "{body}\n says {found:?}\n lacks {expected:?}"
        );
    }
    for (text, expected) in [
        ("", "not well-formed"),
        ("<mesh version=\"3.0.0\"/>", "the root is <mesh>"),
        ("<scene/>", "attribute `version` is missing"),
        ("<scene version=\"0.6.0\"/>", "version 0.6.0 is not supported"),
    ] {
        let found = parse_mitsuba(text, "s.xml", &[]).unwrap_err().to_string();
        assert!(found.contains(expected), "{found}");
    }
}

#[test]
fn deep_nesting_is_an_error_and_no_overflow() {
    let deep = format!(
        "{}{}",
        "<bsdf type=\"twosided\">".repeat(100_000),
        "</bsdf>".repeat(100_000)
    );
    assert!(message(&deep).contains("levels of nesting"));
}
