//! ROS 2's parameter files: nodes, by names that may have wildcards, and under `ros__parameters` a tree of names.
//!
//! ```yaml
//! /**:
//!   ros__parameters:
//!     cmd_vel:
//!       timeout: 0.3
//! robot1:
//!   base:
//!     ros__parameters:
//!       frames.odom: robot1/odom
//! ```

use anyhow::{Result, bail};
use yaml_rust2::{Yaml, YamlLoader};

/// A parameter's value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// true or false.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A number.
    Real(f64),
    /// Text.
    Text(String),
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bool(value) => value.fmt(f),
            Self::Integer(value) => value.fmt(f),
            Self::Real(value) => value.fmt(f),
            Self::Text(value) => value.fmt(f),
        }
    }
}

/// What a file says to a node of this full name (as `/robot1/base`): dotted names and values, in the file's order. What comes later replaces.
///
/// # Errors
/// With the line, if the file is no YAML, or no parameter file.
pub fn parameters(text: &str, node: &str) -> Result<Vec<(String, Value)>> {
    let documents = YamlLoader::load_from_str(text)?;
    let mut found = Vec::new();
    for document in &documents {
        nodes(document, "", node, &mut found)?;
    }
    Ok(found)
}

/// A value as it is written behind `-p name:=`.
///
/// # Errors
/// If it is none.
pub fn value(text: &str) -> Result<Value> {
    match YamlLoader::load_from_str(text)?.as_slice() {
        [yaml] => scalar("", yaml),
        _ => Ok(Value::Text(String::new())),
    }
}

fn nodes(tree: &Yaml, path: &str, node: &str, found: &mut Vec<(String, Value)>) -> Result<()> {
    let Yaml::Hash(entries) = tree else {
        bail!("`{path}` should have ros__parameters below it");
    };
    for (key, below) in entries {
        let Some(key) = key.as_str() else {
            bail!("below `{path}` there is a key that is no name");
        };
        if key == "ros__parameters" {
            if matches(path, node) {
                flatten(below, "", found)?;
            }
            continue;
        }
        let path = format!("{path}/{}", key.trim_matches('/'));
        nodes(below, &path, node, found)?;
    }
    Ok(())
}

/// `*` stands for one name, `**` for any number of them, none included.
fn matches(pattern: &str, node: &str) -> bool {
    fn tokens<'a>(pattern: &[&'a str], node: &[&'a str]) -> bool {
        match (pattern, node) {
            ([], []) => true,
            (["**", rest @ ..], _) => {
                tokens(rest, node) || !node.is_empty() && tokens(pattern, &node[1..])
            }
            ([first, rest @ ..], [name, others @ ..]) => {
                (*first == "*" || first == name) && tokens(rest, others)
            }
            _ => false,
        }
    }
    let split = |path: &'_ str| -> Vec<String> {
        let names = path.split('/').filter(|name| !name.is_empty());
        names.map(str::to_owned).collect()
    };
    let (pattern, node) = (split(pattern), split(node));
    let pattern: Vec<&str> = pattern.iter().map(String::as_str).collect();
    let node: Vec<&str> = node.iter().map(String::as_str).collect();
    tokens(&pattern, &node)
}

fn flatten(tree: &Yaml, prefix: &str, found: &mut Vec<(String, Value)>) -> Result<()> {
    let Yaml::Hash(entries) = tree else {
        if matches!(tree, Yaml::Null) && prefix.is_empty() {
            return Ok(());
        }
        found.push((prefix.to_owned(), scalar(prefix, tree)?));
        return Ok(());
    };
    for (key, below) in entries {
        let Some(key) = key.as_str() else {
            bail!("below `{prefix}` there is a key that is no name");
        };
        let name = if prefix.is_empty() {
            key.to_owned()
        } else {
            format!("{prefix}.{key}")
        };
        flatten(below, &name, found)?;
    }
    Ok(())
}

fn scalar(name: &str, yaml: &Yaml) -> Result<Value> {
    Ok(match yaml {
        Yaml::Boolean(value) => Value::Bool(*value),
        Yaml::Integer(value) => Value::Integer(*value),
        Yaml::Real(text) => match yaml.as_f64() {
            Some(value) => Value::Real(value),
            None => bail!("{name}: {text} is no number"),
        },
        Yaml::String(text) => Value::Text(text.clone()),
        _ => bail!("{name} should be a number, a text, true or false"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "
/**:
  ros__parameters:
    cmd_vel:
      timeout: 0.3
      stamped: true
/*/base:
  ros__parameters: {qos.odom.depth: 5}
robot1:
  base:
    ros__parameters:
      cmd_vel.timeout: 0.4
      frames: {odom: r1/odom}
/robot2/base:
  ros__parameters:
    cmd_vel.timeout: 1
";

    fn of(node: &str) -> Vec<String> {
        let found = parameters(FILE, node).unwrap();
        found
            .into_iter()
            .map(|(name, value)| format!("{name}={value}"))
            .collect()
    }

    #[test]
    fn a_node_finds_what_is_said_to_it() {
        let all = ["cmd_vel.timeout=0.3", "cmd_vel.stamped=true"];
        assert_eq!(of("/base"), all);
        let depth = "qos.odom.depth=5";
        let [timeout, stamped] = all;
        assert_eq!(
            of("/robot1/base"),
            [
                timeout,
                stamped,
                depth,
                "cmd_vel.timeout=0.4",
                "frames.odom=r1/odom"
            ]
        );
        assert_eq!(
            of("/robot2/base"),
            [timeout, stamped, depth, "cmd_vel.timeout=1"]
        );
        assert_eq!(of("/a/b/base"), all);
    }

    #[test]
    fn files_that_are_none_are_told() {
        for wrong in [
            "cmd_vel: 1",
            "a: [1, 2]",
            "/**:\n  ros__parameters:\n    x: [1]",
            "/**: {ros__parameters: {x: }}",
            "{",
        ] {
            assert!(parameters(wrong, "/base").is_err(), "{wrong}");
        }
        assert_eq!(parameters("", "/base").unwrap(), []);
    }

    #[test]
    fn values_of_the_command_line() {
        assert_eq!(value("0.5").unwrap(), Value::Real(0.5));
        assert_eq!(value("3").unwrap(), Value::Integer(3));
        assert_eq!(value("false").unwrap(), Value::Bool(false));
        assert_eq!(value("a/b").unwrap(), Value::Text("a/b".into()));
    }
}
