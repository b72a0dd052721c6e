//! Every shader parses, validates, and reads what Rust writes; without a GPU.

use naga::valid::{Capabilities, ValidationFlags, Validator};
use tetralod_render::gpu::SHADERS;

fn parsed(name: &str, source: &str) -> naga::Module {
    naga::front::wgsl::parse_str(source)
        .unwrap_or_else(|error| panic!("{name}.wgsl: {}", error.emit_to_string(source)))
}

#[test]
fn every_shader_is_valid_with_the_plain_capabilities_of_webgpu() {
    for (name, source) in SHADERS {
        let module = parsed(name, source);
        let checked = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
        checked.unwrap_or_else(|error| panic!("{name}.wgsl: {}", error.emit_to_string(source)));
        let stages: Vec<_> = module.entry_points.iter().map(|entry| entry.stage).collect();
        assert!(stages.contains(&naga::ShaderStage::Vertex), "{name} has no vertex stage");
        assert!(stages.contains(&naga::ShaderStage::Fragment), "{name} has no fragment stage");
    }
}

#[test]
fn the_frame_has_the_layout_that_its_twin_has() {
    for (name, source) in SHADERS {
        let module = parsed(name, source);
        let found = module.types.iter().find(|(_, of)| of.name.as_deref() == Some("Frame"));
        let Some((_, frame)) = found else { panic!("{name} lost the frame") };
        let naga::TypeInner::Struct { members, span } = &frame.inner else { panic!("{name}: no struct") };
        let places: Vec<_> = members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset)).collect();
        let names = [
            "view_projection",
            "origin",
            "origin_x",
            "origin_y",
            "direction",
            "direction_x",
            "direction_y",
            "eye",
            "key_light",
            "fill_light",
            "up",
            "viewport",
            "depth",
            "sky",
            "ground",
            "moved",
            "clips",
        ];
        // A matrix of four vectors, then a vector each.
        let expected =
            names.iter().enumerate().map(|(i, name)| (*name, if i == 0 { 0 } else { 48 + 16 * i as u32 }));
        let expected: Vec<_> = expected.collect();
        let expected: Vec<_> = expected.iter().map(|(name, offset)| ((*name).to_owned(), *offset)).collect();
        assert_eq!(places, expected, "{name}");
        assert_eq!(*span, 560, "{name}");
    }
}

#[test]
fn broken_shaders_would_be_noticed() {
    let (_, source) = SHADERS[1];
    assert!(naga::front::wgsl::parse_str(&source.replace("normalize(", "normalise(")).is_err());
}

/// The first line where operators stand side by side that WGSL wants parentheses between: naga takes them,
/// browsers do not.
fn unclear(source: &str) -> Option<String> {
    const GROUPS: [&[&str]; 2] = [&["&&", "||"], &["<<", ">>", " & ", " | ", " ^ "]];
    let mixes = |here: &[&str]| {
        GROUPS.iter().any(|group| {
            let mut own = here.iter().filter(|operator| group.contains(operator));
            own.next().is_some_and(|first| own.any(|other| other != first))
        })
    };
    for line in source.lines().map(|line| line.split("//").next().unwrap_or_default()) {
        // Of each open parenthesis: the operators since it or since the last comma.
        let mut seen: Vec<Vec<&str>> = vec![Vec::new()];
        for (i, c) in line.char_indices() {
            match c {
                '(' | '[' => seen.push(Vec::new()),
                ')' | ']' if seen.len() > 1 => drop(seen.pop()),
                ',' | ';' | '{' => seen.iter_mut().for_each(Vec::clear),
                _ => {}
            }
            let here = seen.last_mut().expect("one is always open");
            for group in GROUPS {
                here.extend(group.iter().copied().filter(|operator| line[i..].starts_with(operator)));
            }
            if mixes(here) {
                return Some(line.to_owned());
            }
        }
    }
    None
}

#[test]
fn operators_that_browsers_want_parentheses_between_have_them() {
    for (name, source) in SHADERS {
        assert_eq!(unclear(source), None, "{name}");
    }
    assert!(unclear("let a = b || c && d;").is_some());
    assert!(unclear("if mask >> i & 1u == 1u {").is_some());
    assert!(unclear("let a = b || (c && d); let e = ((f >> g) & 1u) | h;").is_none());
}
