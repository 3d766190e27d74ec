//! Animations sampled at one time: what nodes do and how meshes are bent then (glTF 2.0, 3.11 and appendix C).

use std::collections::HashMap;

use glam::DQuat;
use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::{Interpolation, Property};
use gltf::json::validation::Checked;

use super::accessor::Accessor;
use super::document::Document;
use super::error::Error;

/// What of a node an animation moves.
#[derive(Clone, Debug, Default)]
pub(super) struct Moved {
    pub translation: Option<[f32; 3]>,
    pub rotation: Option<[f32; 4]>,
    pub scale: Option<[f32; 3]>,
    /// Of morph targets.
    pub weights: Option<Vec<f32>>,
}

/// All nodes that the file's first animation moves, at one time; empty for the rest pose.
pub(super) type Pose = HashMap<usize, Moved>;

/// The pose at `time`, s; before the first key and after the last one it stands still.
pub(super) fn pose(document: &Document, time: f32) -> Result<Pose, Error> {
    let mut pose = Pose::new();
    let Some(animation) = document.root.animations.first() else { return Ok(pose) };
    for (c, channel) in animation.channels.iter().enumerate() {
        let at = format!("animations[0].channels[{c}]");
        let (Checked::Valid(path), node) = (channel.target.path, channel.target.node.value()) else {
            continue;
        };
        if node >= document.root.nodes.len() {
            return Err(document.fault(format!("{at}.target.node"), node, "there is no node of this number"));
        }
        let s = channel.sampler.value();
        let sampler = animation.samplers.get(s).ok_or_else(|| {
            document.fault(format!("{at}.sampler"), s, "there is no sampler of this number")
        })?;
        let curve = Curve::open(document, sampler, path, &format!("animations[0].samplers[{s}]"))?;
        let Some(curve) = curve else { continue };
        let moved = pose.entry(node).or_default();
        let value = curve.at(time);
        let three = || [value[0], value[1], value[2]];
        match path {
            Property::Translation => moved.translation = Some(three()),
            Property::Scale => moved.scale = Some(three()),
            Property::Rotation => moved.rotation = Some([value[0], value[1], value[2], value[3]]),
            Property::MorphTargetWeights => moved.weights = Some(value),
        }
    }
    Ok(pose)
}

/// One sampler: keys and what holds at them.
struct Curve<'a> {
    times: Accessor<'a>,
    values: Accessor<'a>,
    how: Interpolation,
    path: Property,
    /// Numbers at each key.
    width: usize,
}

impl<'a> Curve<'a> {
    /// `None` for a sampler without keys.
    fn open(
        document: &'a Document,
        sampler: &json::animation::Sampler,
        path: Property,
        at: &str,
    ) -> Result<Option<Curve<'a>>, Error> {
        let Checked::Valid(how) = sampler.interpolation else {
            return Err(document.fault(format!("{at}.interpolation"), "?", "not one of glTF's"));
        };
        let input = format!("{at}.input");
        let times = Accessor::open(document, sampler.input, &input, &[Type::Scalar], &[ComponentType::F32])?;
        let kind = match path {
            Property::Translation | Property::Scale => Type::Vec3,
            Property::Rotation => Type::Vec4,
            Property::MorphTargetWeights => Type::Scalar,
        };
        let numbers = [
            ComponentType::F32,
            ComponentType::I8,
            ComponentType::U8,
            ComponentType::I16,
            ComponentType::U16,
        ];
        let values = Accessor::open(document, sampler.output, &format!("{at}.output"), &[kind], &numbers)?;
        if times.len() == 0 {
            return Ok(None);
        }
        let each = if how == Interpolation::CubicSpline { 3 } else { 1 };
        let width = values.len() / each / times.len();
        // An accessor without a buffer view may claim any length: nobody bends a mesh by a million targets.
        let fits = width * each * times.len() == values.len() && (1..=65_536).contains(&width);
        if !fits || (kind != Type::Scalar && width != 1) {
            let problem = format!("does not fit {} keys", times.len());
            return Err(document.fault(format!("{at}.output.count"), values.len(), problem));
        }
        Ok(Some(Curve { times, values, how, path, width }))
    }

    /// The value at `time`.
    fn at(&self, time: f32) -> Vec<f32> {
        let key = |i: usize| self.times.get::<1>(i)[0];
        // The last key not after `time`, by bisection: keys rise.
        let (mut low, mut high) = (0, self.times.len());
        while low < high {
            let middle = low + (high - low) / 2;
            if key(middle) <= time { low = middle + 1 } else { high = middle }
        }
        let Some(k) = low.checked_sub(1) else { return self.value(0, 1) };
        if k + 1 == self.times.len() || self.how == Interpolation::Step {
            return self.value(k, 1);
        }
        let step = key(k + 1) - key(k);
        let t = if step > 0.0 { ((time - key(k)) / step).clamp(0.0, 1.0) } else { 0.0 };
        let (a, b) = (self.value(k, 1), self.value(k + 1, 1));
        if self.how == Interpolation::CubicSpline {
            let (out, into) = (self.value(k, 2), self.value(k + 1, 0));
            let (t2, t3) = (t * t, t * t * t);
            let mix = |i: usize| {
                (2.0 * t3 - 3.0 * t2 + 1.0) * a[i]
                    + step * (t3 - 2.0 * t2 + t) * out[i]
                    + (3.0 * t2 - 2.0 * t3) * b[i]
                    + step * (t3 - t2) * into[i]
            };
            return (0..a.len()).map(mix).collect();
        }
        if self.path == Property::Rotation {
            let q = |v: &[f32]| {
                let q = DQuat::from_xyzw(v[0].into(), v[1].into(), v[2].into(), v[3].into());
                if q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
            };
            return q(&a).slerp(q(&b), t.into()).to_array().map(|v| v as f32).to_vec();
        }
        a.iter().zip(&b).map(|(a, b)| a + (b - a) * t).collect()
    }

    /// What holds at key `k`; `part` of a spline: 0 the tangent into it, 1 the value, 2 the tangent out of it.
    fn value(&self, k: usize, part: usize) -> Vec<f32> {
        let first = if self.how == Interpolation::CubicSpline { 3 * k + part } else { k } * self.width;
        if self.path == Property::MorphTargetWeights {
            return (first..first + self.width).map(|i| self.values.get::<1>(i)[0]).collect();
        }
        self.values.get::<4>(first).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Translation of node 0 with keys at 1 s and 3 s.
    fn x_at(how: &str, values: &[f32], time: f32) -> f32 {
        let mut bytes: Vec<u8> = [1.0f32, 3.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        bytes.extend(values.iter().flat_map(|x| [*x, 0.0, 0.0]).flat_map(f32::to_le_bytes));
        let json = format!(
            r#""bufferViews":[{{"buffer":0,"byteLength":{}}}],"nodes":[{{}}],"accessors":[
            {{"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR"}},
            {{"bufferView":0,"byteOffset":8,"componentType":5126,"count":{},"type":"VEC3"}}],
            "animations":[{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"translation"}}}}],
            "samplers":[{{"input":0,"output":1,"interpolation":"{how}"}}]}}]"#,
            bytes.len(),
            values.len()
        );
        let document = Document::for_test(&json, bytes);
        pose(&document, time).expect("valid")[&0].translation.expect("moved")[0]
    }

    #[test]
    fn keys_are_held_stepped_and_interpolated() {
        for (time, linear, step) in [(0.0, 2.0, 2.0), (1.0, 2.0, 2.0), (2.0, 3.0, 2.0), (9.0, 4.0, 4.0)] {
            assert_eq!(x_at("LINEAR", &[2.0, 4.0], time), linear);
            assert_eq!(x_at("STEP", &[2.0, 4.0], time), step);
        }
        // In-tangent, value, out-tangent: with the slope of the line it is the line.
        assert_eq!(x_at("CUBICSPLINE", &[9.0, 2.0, 1.0, 1.0, 4.0, 9.0], 2.0), 3.0);
        assert_eq!(x_at("CUBICSPLINE", &[9.0, 2.0, 0.0, 0.0, 4.0, 9.0], 1.5), 2.0 + 2.0 * 0.15625);
    }
}
