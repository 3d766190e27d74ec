//! What is left when a command is killed: the earlier file or the new one, whole.

use super::{folder, scene, twolight};
use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Kills `args` (which write `output`) at `moments` moments, from the start to about its end, and lets it run at last.
fn killed(args: &[&str], output: &str, moments: u64) {
    let dir = folder();
    let cornell = scene("cornell-box.gltf");
    fs::copy(cornell, dir.path().join("room.gltf")).expect("it can be copied");
    let start = std::time::Instant::now();
    let run = twolight(dir.path(), args);
    assert_eq!(run.status, 0, "{}", run.err);
    let takes = start.elapsed().as_millis() as u64;
    let read = || fs::read(dir.path().join(output)).expect("it is there at any moment");
    let want = read();
    fs::write(dir.path().join(output), "an earlier file").expect("it can be written");
    let mut ended = 0;
    for moment in 0..moments {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin("twolight"))
            .args(args)
            .current_dir(dir.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("it starts");
        std::thread::sleep(Duration::from_millis(takes * (moment + 1) / moments));
        ended += u32::from(child.try_wait().expect("it can be asked").is_none());
        let _ = child.kill();
        child.wait().expect("it ends");
        let now = read();
        assert!(now == b"an earlier file" || now == want, "half a file after kill {moment}");
    }
    assert!(ended > 0, "none was killed while it worked");
    assert_eq!(twolight(dir.path(), args).status, 0);
    assert!(read() == want, "another file after the kills");
}

#[test]
fn a_killed_render_leaves_a_whole_picture() {
    let args = ["render", "room.gltf", "-o", "a.exr", "--size", "48x48", "--error", "10%", "--quiet"];
    killed(&args, "a.exr", 20);
}

#[test]
fn a_killed_bake_leaves_a_whole_file() {
    killed(
        &["bake", "room.gltf", "-o", "lit.glb", "--error", "20%", "--vertices", "1000", "--quiet"],
        "lit.glb",
        20,
    );
}
