//! A user's example: a scene in a string, and what its camera sees, without any lighting.
//!
//! `cargo run --release -p lightshed-scene --example scene_user`
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Scene, SurfacePoint, import::parse_mitsuba};
use std::error::Error;

const XML: &str = r#"<scene version="3.0.0">
    <sensor type="perspective">
        <float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="3, 2, 4" target="0, 0.4, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="78"/><integer name="height" value="30"/></film>
    </sensor>
    <shape type="rectangle"><transform name="to_world"><scale value="2"/><rotate x="1" angle="-90"/></transform></shape>
    <shape type="cube"><transform name="to_world"><scale value="0.4"/><translate x="-0.6" y="0.4"/></transform></shape>
    <shape type="sphere"><point name="center" x="0.6" y="0.5" z="0.3"/><float name="radius" value="0.5"/></shape>
    <shape type="rectangle">
        <transform name="to_world"><rotate x="1" angle="90"/><scale value="0.5"/><translate y="2"/></transform>
        <emitter type="area"><rgb name="radiance" value="4"/></emitter>
    </shape>
</scene>"#;

fn main() -> Result<(), Box<dyn Error>> {
    let loaded = parse_mitsuba(XML, "user.xml", &[])?;
    for warning in &loaded.warnings {
        eprintln!("{warning}");
    }
    let settings = loaded.description.settings;
    let scene = Scene::new(&loaded.description)?;
    println!("{} emitting triangles", scene.emitters().finite_count());
    let sun = Vec3::new(0.5, 0.8, 0.3).normalize();
    for y in 0..settings.height {
        let shade = |x: u32| {
            let ray = scene
                .camera()
                .ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), [0.5; 2]);
            let Some(point) = scene.intersect(&ray) else {
                return ' ';
            };
            if point.emitter != SurfacePoint::NO_EMITTER {
                return '$';
            }
            // Lit by a sun that casts shadows.
            let cos = point.shading.to_local(sun).z.max(0.0);
            let lit = if scene.occluded(&point.spawn(sun)) {
                0.0
            } else {
                cos
            };
            char::from(b".:-=+*#%@"[(0.2 * 8.0 + lit * 6.4) as usize])
        };
        println!("{}", (0..settings.width).map(shade).collect::<String>());
    }
    Ok(())
}
