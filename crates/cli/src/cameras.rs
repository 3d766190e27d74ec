//! Which of a scene's cameras are meant.

use crate::job::{AskedWrongly, fit_for_file};
use anyhow::Result;
use geometry::{Camera, Scene};

/// The cameras to render, and what the user should know about the choice.
#[derive(Debug)]
pub struct Choice {
    /// At least one.
    pub cameras: Vec<Camera>,
    /// A choice that was made for the user.
    pub note: Option<String>,
}

/// The cameras that `asked` means (a name, a number from 0, "all", or nothing) among those of the file.
pub fn choose(asked: Option<&str>, cameras: &[Camera], scene: &Scene) -> Result<Choice> {
    let one = |camera: &Camera, note| Ok(Choice { cameras: vec![camera.clone()], note });
    let Some(first) = cameras.first() else {
        if let Some(asked) = asked.filter(|&a| a != "all") {
            return Err(AskedWrongly(format!("there is no camera {asked:?}: the file has none")).into());
        }
        let (lo, hi) = scene.mesh.bounds().unwrap_or_default();
        let note = "the file has no camera: looking at the whole scene from the front, slightly above".into();
        return one(&Camera::framing(lo, hi), Some(note));
    };
    match asked {
        None if cameras.len() > 1 => {
            let note =
                format!("{} cameras: taking {:?}, the first (see --camera)", cameras.len(), first.name);
            one(first, Some(note))
        }
        None => one(first, None),
        Some("all") => Ok(Choice { cameras: named_apart(cameras), note: None }),
        Some(asked) => {
            // A name goes before a number, for cameras called "2".
            let by_number = || asked.parse::<usize>().ok().and_then(|i| cameras.get(i));
            match cameras.iter().find(|c| c.name == asked).or_else(by_number) {
                Some(camera) => one(camera, None),
                None => {
                    let names: Vec<String> =
                        cameras.iter().enumerate().map(|(i, c)| format!("{i} {:?}", c.name)).collect();
                    let message = format!("there is no camera {asked:?}; the file has {}", names.join(", "));
                    Err(AskedWrongly(message).into())
                }
            }
        }
    }
}

/// The cameras with names that differ (also on file systems that ignore case), so that each gets a file.
fn named_apart(cameras: &[Camera]) -> Vec<Camera> {
    let mut seen = std::collections::HashSet::new();
    let rename = |(i, camera): (usize, &Camera)| {
        let mut camera = camera.clone();
        if camera.name.is_empty() {
            camera.name = i.to_string();
        }
        while !seen.insert(fit_for_file(&camera.name).to_lowercase()) {
            camera.name = format!("{}-{i}", camera.name);
        }
        camera
    };
    cameras.iter().enumerate().map(rename).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Vec3;

    fn named(names: &[&str]) -> Vec<Camera> {
        let camera = Camera::framing(Vec3::ZERO, Vec3::ONE);
        names.iter().map(|n| Camera { name: (*n).into(), ..camera.clone() }).collect()
    }

    fn chosen(asked: Option<&str>, names: &[&str]) -> Vec<String> {
        let choice = choose(asked, &named(names), &Scene::default()).unwrap();
        choice.cameras.into_iter().map(|c| c.name).collect()
    }

    #[test]
    fn cameras_go_by_name_number_or_all_together() {
        let names = ["Hall", "Kitchen", "0"];
        assert_eq!(chosen(None, &names), ["Hall"]);
        assert_eq!(chosen(Some("Kitchen"), &names), ["Kitchen"]);
        assert_eq!(chosen(Some("1"), &names), ["Kitchen"]);
        assert_eq!(chosen(Some("0"), &names), ["0"]);
        assert_eq!(chosen(Some("all"), &["a", "A", "", "a"]), ["a", "A-1", "2", "a-3"]);
        assert_eq!(chosen(Some("all"), &["A/B", "A:B"]), ["A/B", "A:B-1"]);
        assert_eq!(chosen(None, &[]), ["framing"]);
    }

    #[test]
    fn an_unknown_camera_is_answered_with_those_there_are() {
        let error = choose(Some("Attic"), &named(&["Hall"]), &Scene::default()).unwrap_err();
        assert!(error.is::<AskedWrongly>() && error.to_string().contains("Hall"), "{error}");
        assert!(choose(Some("0"), &[], &Scene::default()).is_err());
    }
}
